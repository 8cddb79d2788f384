"""Commands that compare with measurement: fit, fit-run, validate."""

import json
import pathlib
import sys
from typing import Annotated

import typer

from afo_sim.cli.apps import app
from afo_sim.cli.common import Sets, print_table, progress, read_sets
from afo_sim.cli.overwriting import check_folder


@app.command("fit-run")
def fit_run_command(
    log: Annotated[
        pathlib.Path, typer.Argument(help="CSV of your own measurement: time, angle, pressures …")
    ],
    scenario: Annotated[str, typer.Option(help="a shipped scenario's name, or a TOML file")],
    fit: Annotated[
        str, typer.Option(help="parameters with commas between them; none only lays log and run together")
    ] = "",
    sets: Sets = None,
    noise: Annotated[
        list[str] | None, typer.Option(metavar="CHANNEL=VALUE", help='for example angle="0.5 deg"')
    ] = None,
    hold_out: Annotated[
        float, typer.Option(help="share of the log, from its end, to predict; 0 for none")
    ] = 0.3,
    out: Annotated[pathlib.Path, typer.Option(help="folder to write to")] = pathlib.Path("runs/fit-run"),
) -> None:
    """Fit dynamic parameters of a scenario to your own log; say what the log does not tell."""
    values = read_sets(sets)
    told = read_sets(noise, "--noise", 'angle="0.5 deg"')
    names = [name.strip() for name in fit.split(",") if name.strip()]
    with progress("reading, compiling the muscles") as report:
        from afo_sim.common.writing import check_writable
        from afo_sim.fitting import run_files as fit_run_files
        from afo_sim.fitting import run_fit as fit_run

        check_folder(out, "fit to a log")
        check_writable(out)
        problem = fit_run.pose(scenario, log, names, sets=values, noise=told, hold_out=hold_out)
        found = fit_run.fit_run(problem, report=lambda text: report(0, 0, text))
        fit_run_files.write_fit_run(found, out)
    for title, header, rows in fit_run_files.tables(found):
        print_table(title, header, rows)
    for line in fit_run_files.remarks(found):
        print(line)
    hint = f"; run it with: afo-sim run {out / fit_run_files.SCENARIO}" if names else ""
    print(f"written to {out}{hint}")


@app.command()
def fit(
    files: Annotated[list[pathlib.Path], typer.Argument(help="CSV of measured points, one per muscle")],
    law: Annotated[str, typer.Option(help="a law's name, or all")],
    out: Annotated[pathlib.Path, typer.Option(help="folder to write to")] = pathlib.Path("runs/fit"),
    hold_out: Annotated[
        str, typer.Option(help="what is left out in turn: all|none|pressure|load|curve|muscle")
    ] = "all",
    test: Annotated[
        list[pathlib.Path] | None, typer.Option(help="further CSV that is predicted, not fitted")
    ] = None,
    free: Annotated[list[str] | None, typer.Option(help="a parameter to fit as well")] = None,
    fix: Annotated[list[str] | None, typer.Option(metavar="NAME=VALUE", help="a parameter to hold")] = None,
    tell: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=VALUE", help='what the CSV does not say, for example bore="20 mm"'),
    ] = None,
    loss: Annotated[
        str, typer.Option(help="linear|soft_l1|huber|cauchy; the last three bear outliers")
    ] = "linear",
    like: Annotated[str, typer.Option(help="muscle to take from what the data do not tell")] = "s1_215mm",
) -> None:
    """Fit a muscle's law to measured points; say what the data do not tell."""
    with progress("reading") as report:
        from afo_sim.common.writing import check_writable
        from afo_sim.fitting import command as fit_command

        check_folder(out, "fit of a muscle's law")
        check_writable(out)
        asked = fit_command.Request(
            tuple(files),
            tuple(test or ()),
            law,
            hold_out,
            tuple(free or ()),
            read_sets(fix, "--fix", "k=1"),
            read_sets(tell, "--tell", 'bore="20 mm"'),
            loss,
            like,
        )
        answer = fit_command.answer(asked, report=lambda text: report(0, 0, text))
        fit_command.write(answer, out, like)
    for title, header, rows in fit_command.tables(answer):
        print_table(title, header, rows)
    for line in fit_command.remarks(answer):
        print(line)
    print(f"written to {out}")


@app.command("validate")
def validate_command(
    as_json: Annotated[bool, typer.Option("--json", help="every row, cells too, as a JSON list")] = False,
    figures: Annotated[
        pathlib.Path | None, typer.Option(help="folder for S1's and S3's figures, redrawn")
    ] = None,
) -> None:
    """Every published number of the four papers against simulation; exit code 1 when one is missed."""
    with progress("comparing with the papers") as report:
        from afo_sim.common.writing import check_writable
        from afo_sim.validation import table as v

        if figures is not None:
            check_writable(figures, "--figures")
        rows = v.validate(report)
        written = []
        if figures is not None:
            from afo_sim.show.validation_figures import write_figures

            written = write_figures(figures)
    if as_json:
        print(json.dumps([v.record(row) for row in rows], indent=1, ensure_ascii=False))
    else:
        print_table("published and simulated", list(v.HEADER), v.table(rows), droppable=v.SOURCING)
        print("\n".join([v.LEGEND, "", *v.remarks(rows), "", v.verdict(rows)]))
    for path in written:
        print(path, file=sys.stderr if as_json else sys.stdout)
    if not all(row.passed for row in rows):
        sys.exit(1)
