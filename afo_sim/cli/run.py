"""Commands that simulate: run, torque-map."""

import pathlib
import sys
from typing import Annotated, Any

import typer

from afo_sim.cli.apps import app
from afo_sim.cli.common import (
    Plain,
    Rate,
    Scenario,
    Sets,
    hertz_of,
    plainly,
    print_table,
    progress,
    quantity,
    read_sets,
    short_lived,
    watching,
)
from afo_sim.cli.overwriting import check_folder, check_run_folder
from afo_sim.cli.printed_run import print_run
from afo_sim.common.errors import InputError


@app.command()
def run(
    scenario: Scenario = "seated",
    out: Annotated[
        pathlib.Path | None, typer.Option(help="folder to write to; runs/<scenario> by default")
    ] = None,
    sets: Sets = None,
    rrd: Annotated[bool, typer.Option("--rrd/--no-rrd", help="write recording.rrd")] = True,
    rate: Rate = None,
    plain: Plain = False,
    change: Annotated[
        bool, typer.Option("--change/--no-change", help="find out what to change first (walking)")
    ] = True,
    uncertainty: Annotated[
        int, typer.Option(help="draws of what is not known, for bands (walking); 0 for none")
    ] = 0,
    spreads: Annotated[
        str, typer.Option(help="with --uncertainty: what is not known, a shipped name or a TOML file")
    ] = "usual",
    numbers: Annotated[bool, typer.Option("--numbers", help="print every number of a walk")] = False,
    live: Annotated[bool, typer.Option("--live", help="watch in the Rerun viewer while it runs")] = False,
    force: Annotated[bool, typer.Option("--force", help="replace the run of another description")] = False,
) -> None:
    """Simulate one scenario; without an argument, the seated solenoid-timer test.

    A folder that holds a run of the very same description is replaced; another run is not, without --force.
    """
    values = read_sets(sets)
    hertz = None if rate is None else hertz_of(rate)
    short_lived()
    with watching(live) as watch, progress("reading, compiling the muscles") as report:
        from afo_sim.common.writing import check_writable
        from afo_sim.description.reader import load
        from afo_sim.model.person import with_person
        from afo_sim.simulation.run import run_scenario
        from afo_sim.study.run_studies import check_studies, with_studies

        description = load("scenario", scenario, values)
        description = description.set(plainly(plain, description.walking))
        check_studies(description, draws=uncertainty, spreads=spreads)
        folder = out or pathlib.Path("runs") / description.name
        check_run_folder(folder, with_person(description).resolved(), force=force)
        check_writable(folder)
        recording = run_scenario(description, progress=report, watch=watch)
        recording = with_studies(
            recording, description, effects=change, draws=uncertainty, spreads=spreads, report=report
        )
        recording.save(folder, rrd=rrd, rate=hertz)
    print_run(recording, folder, numbers=numbers)
    if not recording.ok:
        print(f"afo-sim: {recording.status.removeprefix('failed: ')}", file=sys.stderr)
        sys.exit(3)


@app.command()
def compare(
    scenario: Scenario,
    laws: Annotated[
        str, typer.Option(help="names with commas between; by default every law that all muscles know")
    ] = "",
    out: Annotated[
        pathlib.Path | None, typer.Option(help="folder to write to; runs/<scenario>-laws by default")
    ] = None,
    sets: Sets = None,
    rrd: Annotated[bool, typer.Option("--rrd/--no-rrd", help="write recording.rrd of all runs")] = True,
) -> None:
    """One scenario with several muscle laws, side by side."""
    values = read_sets(sets)
    with progress("reading, compiling the muscles") as report:
        from afo_sim.common.writing import check_writable
        from afo_sim.show.compare import write
        from afo_sim.simulation import compare as comparing

        folder = out or pathlib.Path("runs") / f"{pathlib.Path(scenario).stem}-laws"
        check_folder(folder, "comparison of laws")
        check_writable(folder)
        names = [name.strip() for name in laws.split(",") if name.strip()]
        runs = comparing.compare_laws(scenario, names, values, report=report)
        write(runs, folder, rrd=rrd)
    for title, header, rows in comparing.tables(runs):
        print_table(title, header, rows)
    for name, recording in runs.items():
        for warning in recording.warnings:
            print(f"warning: {name}: {warning}")
    print(f"written to {folder}" + (f"; look at it with: afo-sim view {folder}/recording.rrd" if rrd else ""))
    failed = {name: recording.status for name, recording in runs.items() if not recording.ok}
    for name, status in failed.items():
        print(f"afo-sim: {name}: {status.removeprefix('failed: ')}", file=sys.stderr)
    if failed:
        sys.exit(3)


@app.command("torque-map")
def torque_map_command(
    scenario: Scenario = "seated",
    out: Annotated[pathlib.Path, typer.Option(help="folder to write to")] = pathlib.Path("runs/torque-map"),
    sets: Sets = None,
    angle: Annotated[tuple[str, str, str], typer.Option(help="from, to, step", metavar="FROM TO STEP")] = (
        "-20 deg",
        "25 deg",
        "1 deg",
    ),
    pressure: Annotated[
        list[str] | None, typer.Option(help="gauge pressure; may be given several times")
    ] = None,
) -> None:
    """Torque necessary against torque available: ankle angle × pressure → orthosis torque."""
    values = read_sets(sets)
    start, stop, step = (quantity("--angle", text, "rad") for text in angle)
    pressures = [quantity("--pressure", p, "Pa") for p in pressure or ["1 bar", "2 bar", "3 bar", "4 bar"]]
    if not (step > 0.0 and stop > start) or (stop - start) / step > 2000:
        raise InputError("is no range", field="--angle", value=" ".join(angle), allowed="FROM < TO, STEP > 0")
    for text, value in zip(pressure or [], pressures, strict=False):
        if not 0.0 <= value <= 2e6:
            raise InputError("is out of range", field="--pressure", value=text, allowed="0 bar to 20 bar")
    with progress("computing torques"):
        import numpy as np

        from afo_sim.common.writing import check_writable, together
        from afo_sim.description.reader import load
        from afo_sim.model import torque_map as tm
        from afo_sim.model.build import build
        from afo_sim.show.torque_map import draw

        built = build(load("scenario", scenario, values))
        if not built.index.chambers:
            problem = "has no chamber: there is no torque to map"
            raise InputError(problem, field="orthosis", value=built.scenario.orthosis.name)
        check_folder(out)
        check_writable(out)
        angles = start + step * np.arange(int((stop - start) / step + 1.0 + 1e-9))
        supply = built.scenario.supply.pressure
        tm.require_angles(built, angles)
        maps = tm.torque_map(built, angles, np.array(sorted({*pressures, supply})))
        warnings = tm.limit_warnings(built, maps)
        title = f"{built.scenario.orthosis.name} on {built.scenario.leg.name}: static torque"
        with together(out) as scratch:
            tm.write_csv(maps, scratch / "torque_map.csv")
            for suffix in ("png", "pdf"):
                draw(maps, scratch / f"torque_map.{suffix}", title)
        answers = tm.answer(maps, supply)
    _print_torque_maps(maps, answers, supply, out)
    for warning in warnings:
        print(f"warning: {warning}")


def _print_torque_maps(maps: list[Any], answers: dict[str, Any], supply: float, out: pathlib.Path) -> None:
    import numpy as np

    for found in maps:
        chosen = np.unique(np.linspace(0, len(found.angles) - 1, 10).round().astype(int))
        header = ["angle [deg]", *(f"{p * 1e-5:g} bar" for p in found.pressures)]
        rows = [
            [f"{np.degrees(found.angles[k]):.0f}", *(f"{t:.2f}" for t in found.torque[k])] for k in chosen
        ]
        print_table(f"{found.chamber}: orthosis torque [N·m], dorsiflexion +", header, rows)
    for chamber, needs in answers.items():
        for need, span in needs.items():
            reach = (
                "nowhere"
                if span is None
                else f"from {np.degrees(span[0]):.0f} to {np.degrees(span[1]):.0f} deg"
            )
            print(f"{chamber}: enough for {need} {reach}, at the supply's {supply * 1e-5:g} bar")
    print(f"written to {out}")
