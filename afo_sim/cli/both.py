"""Command that simulates both legs of a person on one supply."""

import json
import pathlib
import sys
from typing import Annotated, Any

import typer

from afo_sim.cli.apps import app
from afo_sim.cli.common import Rate, Scenario, Sets, hertz_of, print_table, progress, read_sets, short_lived
from afo_sim.cli.overwriting import OTHER, check_folder, check_run_folder
from afo_sim.cli.printed_run import print_line
from afo_sim.common.errors import InputError

# Rows of the table: (beginning of the number's name, words); each stands for right, left and both.
ROWS = (
    ("air_per_stride", "air per stride [g]"),
    ("air_per_cycle", "air per cycle [g]"),
    ("mean_flow", "mean flow from the source [l/min ANR]"),
    ("peak_flow", "peak flow from the source [l/min ANR]"),
    ("strides_per_bottle", "strides on one bottle"),
    ("way_per_bottle", "way on one bottle [km]"),
    ("hours_per_bottle", "hours on one bottle [h]"),
    ("source_share", "mean flow of the compressor's [%]"),
    ("compressor_duty", "duty of the compressor [%]"),
    ("compressor_power", "mean electric power [W]"),
)
SHOWN = (  # metrics of either leg that stand on the screen without --numbers
    "toe_clearance",
    "lowest_toe_clearance_first_ten",
    "foot_pitch_at_contact",
    "torque_against_push_off_10ms",
    "peak_dorsiflexion_angle",
    "peak_plantarflexion_angle",
    "range_of_motion",
    "peak_dorsiflexion_torque_10ms",
    "orthosis_peak_dorsiflexion_torque_10ms",
    "cuff_skin_pressure",
)


@app.command("both")
def both_command(
    scenario: Scenario,
    left: Annotated[
        str, typer.Option(help="scenario of the left leg; the same by default", metavar="SCENARIO")
    ] = "",
    out: Annotated[
        pathlib.Path | None, typer.Option(help="folder to write to; runs/<scenario>-both by default")
    ] = None,
    sets: Sets = None,
    left_sets: Annotated[
        list[str] | None,
        typer.Option("--set-left", metavar="KEY=VALUE", help="of the left leg alone"),
    ] = None,
    apart: Annotated[
        float | None,
        typer.Option(help="share of a stride that the left leg is behind; 0.5, seated 0"),
    ] = None,
    rrd: Annotated[bool, typer.Option("--rrd/--no-rrd", help="write recording.rrd of each leg")] = True,
    rate: Rate = None,
    numbers: Annotated[bool, typer.Option("--numbers", help="print every number of both legs")] = False,
    force: Annotated[bool, typer.Option("--force", help="replace the run of other descriptions")] = False,
) -> None:
    """Simulate both legs on one supply: the air of both, the flow from the source, the worse leg."""
    values, others = read_sets(sets), read_sets(left_sets, "--set-left")
    hertz = None if rate is None else hertz_of(rate)
    short_lived()
    with progress("reading, compiling the muscles") as report:
        from afo_sim.common.writing import check_writable
        from afo_sim.model.person import with_person
        from afo_sim.simulation import bilateral as legs

        pair = legs.described(scenario, left or None, sets=values, left_sets=others)
        folder = out or pathlib.Path("runs") / f"{pair[0].name}-both"
        shift = legs.checked(*pair, apart)
        _check_folder(folder, [with_person(each).resolved() for each in pair], shift, force=force)
        check_writable(folder)
        found = legs.both(*pair, apart=shift, progress=report)
        found.save(folder, rrd=rrd, rate=hertz)
    print_both(found, folder, numbers=numbers)
    if not found.ok:
        print(f"afo-sim: {found.status}", file=sys.stderr)
        sys.exit(3)


def _check_folder(folder: pathlib.Path, pair: list[dict[str, Any]], apart: float, *, force: bool) -> None:
    """Refuse a folder that holds other legs' runs, or anything else."""
    check_folder(folder, "run of both legs")
    for side, scenario in zip(("right", "left"), pair, strict=True):
        check_run_folder(folder / side, scenario, force=force)
    if force or not (folder / "both.json").is_file():
        return
    try:
        before = json.loads((folder / "both.json").read_text(encoding="utf-8"))["apart"]
    except (OSError, ValueError, KeyError, TypeError):
        before = None
    if before != apart:
        raise InputError(
            f"holds the same legs {before} of a stride apart",
            field="out",
            value=str(folder),
            allowed=f"--force, which replaces them, or {OTHER}",
        )


def print_both(legs: Any, folder: pathlib.Path, *, numbers: bool = False) -> None:
    """Print two legs' runs."""
    names = {side: leg.scenario["name"] for side, leg in legs.legs.items()}
    print(f"right: {names['right']}; left: {names['left']}, {legs.apart:g} of a stride behind")
    header = ["", "right", "left", "both"]
    print_table(
        "air on one supply", header, [_air_row(legs.numbers, *row) for row in ROWS if _has(legs, row[0])]
    )
    shared = [n for n in legs.right.metrics if n in legs.left.metrics and (numbers or n in SHOWN)]
    rows = [[_named(legs, n), *(f"{leg.metrics[n].value:.4g}" for leg in legs.legs.values())] for n in shared]
    print_table("either leg", ["", "right", "left"], rows)
    _print_peak(legs)
    for worse in legs.verdict:
        _print_worse(legs, worse)
    for warning in legs.warnings:
        print_line(f"warning: {warning}", hang=9)
    for note in legs.notes:
        print_line(f"note: {note}", hang=6)
    print(f"written to {folder}; compare the legs with: afo-sim report {folder}/right {folder}/left")


def _has(legs: Any, name: str) -> bool:
    return any(found.startswith(f"{name}_") for found in legs.numbers)


def _air_row(numbers: Any, name: str, words: str) -> list[str]:
    """A row for right, left and both; a way in kilometres."""
    factor = 1e-3 if name.startswith("way") else 1.0
    cells = (numbers.get(f"{name}_{who}") for who in ("right", "left", "both"))
    return [words, *("–" if cell is None else f"{factor * cell.value:.4g}" for cell in cells)]


def _named(legs: Any, name: str) -> str:
    unit = legs.right.metrics[name].unit
    return f"{name} [{unit}]" if unit else name


def _print_peak(legs: Any) -> None:
    """What the source must give at once, against one leg's need."""
    if "peak_flow_both" not in legs.numbers:
        return
    peaks = [legs.numbers[f"peak_flow_{who}"].value for who in ("right", "left", "both")]
    highest = max(peaks[:2])
    if highest > 0.0:
        print(
            f"the source must give {peaks[2]:.3g} l/min (ANR) at once, "
            f"{peaks[2] / highest:.2f} times one leg's"
        )


def _print_worse(legs: Any, worse: Any) -> None:
    """One question of the verdict: the worse leg's answer; where they are alike but for numbers, both."""
    from afo_sim.show.verdict import INDENT, badge, limit

    answers = worse.answers
    if "both" in answers:
        key, told = "both", f"both legs together: {answers['both'].text}"
    elif worse.leg != "both":
        key, told = worse.leg, f"the {worse.leg} leg, the worse one: {answers[worse.leg].text}"
    elif answers["right"].text == answers["left"].text:
        key, told = "right", f"both legs: {answers['right'].text}"
    else:
        key, told = "right", f"right: {answers['right'].text} Left: {answers['left'].text}"
    answer = answers[key]
    against = limit(legs.left if key == "left" else legs.right, answer)
    print_line(f"{badge(answer):<{INDENT}}{worse.question} {told} ({against})", hang=INDENT, badge=INDENT)
