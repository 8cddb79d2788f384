"""Commands that analyse one scenario: its frequency response (bode), what is small enough (size)."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer
from typer import Argument, Option

from afo_sim.cli.common import (
    Scenario,
    Sets,
    Threads,
    app,
    check_counts,
    one_group,
    picked,
    print_table,
    progress,
    read_sets,
    short_lived,
)
from afo_sim.cli.overwriting import check_same
from afo_sim.cli.printed_run import print_line
from afo_sim.common import InputError


@app.command("bode")
def bode_command(
    scenario: Scenario,
    sets: Sets = None,
    what: Annotated[
        str | None, Option(help="reference, pressure or valves; by default the first that the scenario has")
    ] = None,
    amplitude: Annotated[
        str | None, Option(help='half of the peak to peak, for example "5 deg" or "0.5 bar"')
    ] = None,
    mean: Annotated[str | None, Option(help='about which it goes, for example "2 bar"')] = None,
    chamber: Annotated[str | None, Option(help="that is excited; the orthosis' first by default")] = None,
    frequencies: Annotated[
        str | None, Option(help='rising, for example "0.1, 0.5, 1, 2 Hz"; 0.1 to 5 Hz by default')
    ] = None,
    out: Annotated[Path | None, Option(help="folder to write to; runs/<scenario>-bode by default")] = None,
    force: Annotated[bool, Option("--force", help="replace another frequency response")] = False,
) -> None:
    """Frequency response: pressure and angle over a reference, a pressure or the valves, at an amplitude."""
    values = read_sets(sets)
    hertz = None if frequencies is None else _read_frequencies(frequencies)
    short_lived()
    with progress("reading, compiling the muscles") as report:
        from afo_sim.description import load
        from afo_sim.show import draw_bode
        from afo_sim.study import FREQUENCIES, bode, excited

        description = load("scenario", scenario, values or None)
        folder = out or Path("runs") / f"{description.name}-bode"
        asked = excited(description, what, amplitude, mean, chamber)
        now = {
            "what": asked.what,
            "amplitude": getattr(asked, "amplitude", 1.0),
            "mean": getattr(asked, "mean", 0.0),
            "chamber": getattr(asked, "chamber", ""),
            "scenario": description.resolved(),
        }
        problem = "holds the frequency response of another description or excitation"
        check_same(folder, "frequency response", "bode.json", now, problem, force=force)
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
    _print_bode(found)
    print(f"written to {folder}: bode.png, bode.csv, bode.json")


def _read_frequencies(text: str) -> list[float]:
    """Frequencies given on the command line [Hz]: numbers between commas, "Hz" behind the last or each."""
    found = []
    for part in text.split(","):
        try:
            found.append(float(part.strip().removesuffix("Hz")))
        except ValueError:
            allowed = 'numbers in Hz between commas: "0.1, 0.5, 1, 2 Hz"'
            raise InputError("are not numbers", field="--frequencies", value=text, allowed=allowed) from None
    return found


def _print_bode(found: Any) -> None:
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


@dataclass(frozen=True)
class _Sizing:
    """Options of `size`: what is sized, by which limits."""

    kind: Annotated[str, Argument(help="pressure, valve, tube, supply or muscle")]
    scenario: Scenario
    sets: Sets = None
    limit: Annotated[
        list[str] | None,
        Option(help='as "toe_clearance >= 10 mm"; of walking the toe clearance that its limits want'),
    ] = None
    cadence: Annotated[float | None, Option(help="of walking [steps/min]; its own by default")] = None
    at: Annotated[str | None, Option(help='pressure: does this one suffice, as "3 bar"')] = None
    between: Annotated[
        tuple[str, str] | None, Option(help='pressure: lowest and highest that are tried, as "1 bar" "4 bar"')
    ] = None
    chamber: Annotated[str | None, Option(help="valve: of which; the first that is filled")] = None
    side: Annotated[str | None, Option(help="valve: inlet, outlet or both; both by default")] = None
    proportional: Annotated[bool, Option("--proportional", help="valve: try proportional ones, too")] = False
    length: Annotated[str | None, Option(help='tube: needed: of each chamber, as "2 m"')] = None
    hours: Annotated[float | None, Option(help="supply: that it lasts without a pause")] = None
    strides: Annotated[float | None, Option(help="supply: that it lasts without a pause")] = None
    group: Annotated[str | None, Option(help="muscle: of which group; the first by default")] = None
    count: Annotated[str | None, Option(help='muscle: how many, as "3" or "1-4"')] = None
    out: Annotated[Path | None, Option(help="folder to write to; none by default")] = None
    threads: Threads = 0
    force: Annotated[bool, Option("--force", help="replace another sizing")] = False


@app.command("size")
@one_group
def size_command(sizing: _Sizing) -> None:
    """Smallest valve, tube, supply or muscle, or least pressure, that meets limits; does 3 bar suffice?"""
    values = read_sets(sizing.sets)
    check_counts(sizing.threads, 0)
    options = picked(sizing, "cadence", "at", "between", "chamber", "side", "length", "hours", "strides")
    options |= picked(sizing, "group", "count") | {"proportional": sizing.proportional or None}
    with progress("reading, compiling the muscles") as report:
        from afo_sim.study import requested

        asked = requested(sizing.kind, sizing.scenario, values or None, limits=sizing.limit or (), **options)
        if sizing.out is not None:
            now, problem = {"request": asked.to_json()}, "holds the answer to another question"
            check_same(sizing.out, "sizing", "size.json", now, problem, force=sizing.force)
        found = asked.run(sizing.threads, report)
        if sizing.out is not None:
            from afo_sim.show import draw_size

            found.save(sizing.out, draw=draw_size)
    if found.asked is None:
        print_table(*found.table, whole_names=True)
        for line in found.remarks:
            print_line(line)
    print_line(f"{found.answer}.")
    if sizing.out is not None:
        print(f"written to {sizing.out}: size.png, size.csv, size.json")
    if not found.holds:
        raise typer.Exit(1)
