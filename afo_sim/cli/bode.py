"""Command that measures a frequency response: bode."""

import json
import pathlib
from typing import Annotated, Any

import typer

from afo_sim.cli.apps import app
from afo_sim.cli.common import Scenario, Sets, print_table, progress, read_sets, short_lived
from afo_sim.cli.overwriting import OTHER, check_folder
from afo_sim.cli.printed_run import print_line
from afo_sim.common.errors import InputError

KIND = "frequency response"


@app.command("bode")
def bode_command(
    scenario: Scenario,
    sets: Sets = None,
    what: Annotated[
        str | None,
        typer.Option(help="reference, pressure or valves; by default the first that the scenario has"),
    ] = None,
    amplitude: Annotated[
        str | None, typer.Option(help='half of the peak to peak, for example "5 deg" or "0.5 bar"')
    ] = None,
    mean: Annotated[str | None, typer.Option(help='about which it goes, for example "2 bar"')] = None,
    chamber: Annotated[
        str | None, typer.Option(help="that is excited; the orthosis' first by default")
    ] = None,
    frequencies: Annotated[
        str | None, typer.Option(help='rising, for example "0.1, 0.5, 1, 2 Hz"; 0.1 to 5 Hz by default')
    ] = None,
    out: Annotated[
        pathlib.Path | None, typer.Option(help="folder to write to; runs/<scenario>-bode by default")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="replace another frequency response")] = False,
) -> None:
    """Frequency response: pressure and angle over a reference, a pressure or the valves, at an amplitude."""
    values = read_sets(sets)
    hertz = None if frequencies is None else read_frequencies(frequencies)
    short_lived()
    with progress("reading, compiling the muscles") as report:
        from afo_sim.common.writing import check_writable
        from afo_sim.description.reader import load
        from afo_sim.show.bode_figure import draw_bode
        from afo_sim.study.frequency_response import FREQUENCIES, bode, excited

        description = load("scenario", scenario, values or None)
        folder = out or pathlib.Path("runs") / f"{description.name}-bode"
        asked = excited(description, what, amplitude, mean, chamber)
        _check(folder, description.resolved(), asked, force=force)
        check_writable(folder)
        found = bode(
            description,
            what=what,
            amplitude=amplitude,
            mean=mean,
            chamber=chamber,
            frequencies=FREQUENCIES if hertz is None else hertz,
            report=report,
        )
        found.save(folder, draw=draw_bode)
    print_bode(found)
    print(f"written to {folder}: bode.png, bode.csv, bode.json")


def read_frequencies(text: str) -> list[float]:
    """Frequencies given on the command line [Hz]: numbers between commas, "Hz" behind the last or each."""
    found = []
    for part in text.split(","):
        try:
            found.append(float(part.strip().removesuffix("Hz")))
        except ValueError:
            allowed = 'numbers in Hz between commas: "0.1, 0.5, 1, 2 Hz"'
            raise InputError("are no numbers", field="--frequencies", value=text, allowed=allowed) from None
    return found


def _check(folder: pathlib.Path, scenario: dict[str, Any], asked: Any, *, force: bool) -> None:
    """Refuse a folder that holds the response of another description or excitation."""
    check_folder(folder, KIND)
    if force or not (folder / "bode.json").is_file():
        return
    now = {
        "what": asked.what,
        "amplitude": getattr(asked, "amplitude", 1.0),
        "mean": getattr(asked, "mean", 0.0),
        "chamber": getattr(asked, "chamber", ""),
        "scenario": json.loads(json.dumps(scenario)),
    }
    try:
        table = json.loads((folder / "bode.json").read_text(encoding="utf-8"))
        before = {key: table[key] for key in now}
    except (OSError, ValueError, KeyError, TypeError):
        before = {}
    if before != now:
        problem = "holds the frequency response of another description or excitation"
        allowed = f"--force, which replaces it, or {OTHER}"
        raise InputError(problem, field="out", value=str(folder), allowed=allowed)


def print_bode(found: Any) -> None:
    """Print every curve of a FrequencyResponse as a table, with its bandwidth."""
    for name, curve in found.curves.items():
        unit = f" [{curve.gain_unit}]" if curve.gain_unit else ""
        header = ["Hz", f"gain{unit}", "gain [dB]", "phase [deg]", "distortion [%]"]
        rows = [
            [
                f"{frequency:.4g}",
                f"{curve.shown_gain[k]:.3g}",
                f"{curve.decibel[k]:.1f}",
                f"{curve.phase[k] * 57.29577951308232:.0f}",
                f"{100.0 * curve.distortion[k]:.0f}{'' if curve.unsettled[k] <= found.tolerance else ' *'}",
            ]
            for k, frequency in enumerate(curve.frequency)
        ]
        print_table(f"{name} over {words_of(found)}", header, rows)
        over = "1" if curve.is_ratio else "the first gain"
        print_line(f"−3 dB (against {over}): {curve.bandwidth}; −90°: {curve.quarter}")
        print()
    if any((curve.unsettled > found.tolerance).any() for curve in found.curves.values()):
        print_line("* the first harmonic still changed: a drift or a limit cycle; read these rows with care")


def words_of(found: Any) -> str:
    """What the input is, in words."""
    return {
        "reference": "what the controller is asked for",
        "pressure": f"the pressure that {found.chamber}'s drive is asked for",
        "valves": f"{found.chamber}'s valves (1 inlet open, −1 outlet open)",
    }[found.what]
