"""The command that opens the studio."""

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from afo_sim.cli.common import app, progress


@app.command("studio")
def studio_command(
    scenario: Annotated[
        str, Argument(help="walking scenario: a shipped name, a TOML file or a saved folder")
    ] = ("walk-dropfoot-afo"),
    patient: Annotated[
        list[Path] | None, Option(help="files of the patient's own trial, such as trial.c3d", metavar="FILE")
    ] = None,
    side: Annotated[str, Option(help="right|left: side of the patient's trial")] = "right",
    out: Annotated[Path, Option(help="folder that the Save button writes to")] = Path("runs/studio"),
    browser: Annotated[bool, Option("--browser/--no-browser", help="open the page in the browser")] = True,
    port: Annotated[int, Option(help="port of the page; 0: any free port")] = 0,
) -> None:
    """Try a design with sliders on a local web page."""
    with progress("reading the files, compiling the muscles"):
        from afo_sim.studio import serve

        serving = serve(scenario, list(patient or ()), out, side=side, port=port)
    serving(browser)
