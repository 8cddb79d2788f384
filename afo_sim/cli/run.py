"""Commands that simulate: run, compare, torque-map, both."""

import dataclasses
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, cast

from typer import Argument, Option

from afo_sim.cli import common
from afo_sim.cli.common import print_line as print
from afo_sim.cli.overwriting import check_folder, check_run_folder, check_same, telling
from afo_sim.cli.printed_run import note_lines, print_answers, print_run, warning_lines
from afo_sim.common import InputError

if TYPE_CHECKING:
    from afo_sim.metrics import Answer
    from afo_sim.simulation import Both, Recording, TorqueMaps, Worse

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


@common.app.command()
def run(
    scenario: common.Scenario = "seated",
    out: Annotated[Path | None, Option(help="output folder; runs/<scenario> by default")] = None,
    sets: common.Sets = None,
    rrd: common.RecordingOption = None,
    rate: common.Rate = None,
    plain: common.Plain = False,
    change: Annotated[
        bool, Option("--change/--no-change", help="find the design changes that help most (walking only)")
    ] = True,
    uncertainty: Annotated[int, Option(help="draws of the uncertain inputs (walking only); 0: none")] = 0,
    spreads: Annotated[str, Option(help="with --uncertainty: shipped or own spreads (TOML)")] = "usual",
    step: Annotated[
        str, Option(help="time step: controlled (halved until doubling it changes no number) or fixed")
    ] = "controlled",
    numbers: Annotated[bool, Option("--numbers", help="print every metric")] = False,
    live: Annotated[bool, Option("--live", help="show the run live in the Rerun viewer")] = False,
    force: Annotated[bool, Option("--force", help="overwrite another run in that folder")] = False,
) -> None:
    """Simulate one scenario. By default: the seated solenoid-timer test.

    A run of the same description in the output folder is replaced; any other run only with --force.
    """
    values = common.read_sets(sets)
    hertz = None if rate is None else common.hertz_of(rate)
    common.short_lived()
    with (
        common.watching(live) as watch,
        common.progress("reading the files, compiling the muscles") as report,
    ):
        from afo_sim.description import load
        from afo_sim.model import with_person
        from afo_sim.simulation import check_step, run_at_step
        from afo_sim.study import check_studies, with_studies

        description = load("scenario", scenario, values)
        description = description.set({"gait.settled": "walked"} if plain and description.walking else {})
        check_studies(description, draws=uncertainty, spreads=spreads)
        check_step(step)
        folder = out or Path("runs") / description.name
        check_run_folder(folder, with_person(description).resolved(), force=force)
        recording = run_at_step(description, step, report=report, watch=watch, keeps=True)
        recording = with_studies(
            recording, description, effects=change, draws=uncertainty, spreads=spreads, report=report
        )
        with telling(folder):
            recording.save(folder, rrd=common.drawn(rrd), rate=hertz)
    print_run(recording, folder, numbers=numbers)
    _stop({} if recording.ok else {"": recording.status})


def _stop(failed: dict[str, str]) -> None:
    for name, status in failed.items():
        print(f"afo-sim: {name}{status.removeprefix('failed: ')}", file=sys.stderr)
    if failed:
        sys.exit(3)


@common.app.command()
def compare(
    scenario: common.Scenario,
    others: Annotated[list[str] | None, Argument(hidden=True)] = None,
    laws: Annotated[str, Option(help="names, separated by commas; by default all common laws")] = "",
    out: Annotated[Path | None, Option(help="output folder; runs/<scenario>-laws by default")] = None,
    sets: common.Sets = None,
    rrd: common.RecordingOption = None,
) -> None:
    """Compare several muscle laws in one scenario."""
    if others or (Path(scenario) / "recording.parquet").is_file():
        folders = " ".join([scenario, *(others or "B")])
        problem = "is for the laws of one scenario, not for runs"
        raise InputError(problem, field="compare", allowed=f"afo-sim report {folders}")
    values = common.read_sets(sets)
    with common.progress("reading the files, compiling the muscles") as report:
        from afo_sim.show import write
        from afo_sim.simulation import compare as comparing

        folder = out or Path("runs") / f"{Path(scenario).stem}-laws"
        check_folder(folder, "comparison of laws")
        names = [name.strip() for name in laws.split(",") if name.strip()]
        runs = comparing.compare_laws(scenario, names, values, report=report)
        rrd = common.drawn(rrd)
        write(runs, folder, rrd=rrd)
    common.print_tables(comparing.tables(runs))
    for name, recording in runs.items():
        for warning in recording.warnings:
            print(f"warning: {name}: {warning}")
    print(f"written to {folder}" + (f"; to look at it: afo-sim view {folder}/recording.rrd" if rrd else ""))
    _stop({f"{name}: ": recording.status for name, recording in runs.items() if not recording.ok})


@common.app.command("torque-map")
def torque_map_command(
    scenario: common.Scenario = "walk-dropfoot-afo",
    out: Annotated[Path, Option(help="output folder")] = Path("runs/torque-map"),
    sets: common.Sets = None,
    walk: Annotated[
        str | None, Option(metavar="SCENARIO", help="walking scenario that the needed torque is taken from")
    ] = None,
    angle: Annotated[
        tuple[str, str, str] | None,
        Option(
            metavar="FROM TO STEP",
            help='for example "-20 deg" "25 deg" "1 deg"; the range of motion by default',
        ),
    ] = None,
    pressure: Annotated[list[str] | None, Option(help="gauge pressure; repeat for several")] = None,
    uncertainty: Annotated[int, Option(help="number of draws, for bands of the needed torque")] = 0,
) -> None:
    """Compare needed and available torque over angle and pressure."""
    values = common.read_sets(sets)
    start, stop, step = (
        common.quantity("--angle", text, "rad") for text in angle or ("-20 deg", "25 deg", "1 deg")
    )
    asked = pressure or ["1 bar", "2 bar", "3 bar", "4 bar"]
    pressures = [common.quantity("--pressure", each, "Pa", at_least=0.0, at_most=2e6) for each in asked]
    if not (step > 0.0 and stop > start) or (stop - start) / step > 2000:
        given = " ".join(angle or ())
        raise InputError("is not a valid range", field="--angle", value=given, allowed="FROM < TO, STEP > 0")
    check_folder(out)
    with common.progress("computing torques"):
        import numpy as np

        from afo_sim.common import together
        from afo_sim.model import write_csv
        from afo_sim.show import draw
        from afo_sim.simulation import torque_map
        from afo_sim.study.uncertainty.running import need_bands

        angles = None if angle is None else start + step * np.arange(int((stop - start) / step + 1.0 + 1e-9))
        found = torque_map(scenario, values, walk=walk, angles=angles, pressures=pressures)
        bands = need_bands(found.scenario, uncertainty) if uncertainty else {}
        with together(out) as scratch:
            write_csv(found.maps, scratch / "torque_map.csv")
            draw(found, scratch / "torque_map")
    _print_torque_maps(found, bands, out)


def _print_torque_maps(found: "TorqueMaps", bands: dict[str, list[float]], out: Path) -> None:
    import numpy as np

    from afo_sim.description import JOINTS
    from afo_sim.model import person_of

    for own in found.maps:
        chosen = np.unique(np.linspace(0, len(own.angles) - 1, 10).round().astype(int))
        header = ["angle [deg]", *(f"{p * 1e-5:g} bar" for p in own.pressures)]
        rows = [[f"{np.degrees(own.angles[k]):.0f}", *(f"{t:.2f}" for t in own.torque[k])] for k in chosen]
        positive = JOINTS[own.joint].directions[0]
        common.print_table(f"{own.chamber}: orthosis torque [N·m], {positive} +", header, rows)
    rows, header = [], ["phase", "needs [N·m]", "at [deg]", "chamber", "enough for", "short by"]
    for chambers, need, lacking in found.lacking:
        angle, asked, k = np.degrees(need.angle), need.torque > 0.0, int(lacking.argmax())
        enough, band = asked & (lacking <= 0.0), " ({0:.2f} to {2:.2f})" if bands else ""
        peak = f"{need.peak:.2f}" + band.format(*bands.get(need.phase, ()))
        met = f"{100.0 * enough.sum() / asked.sum():.0f} %" if asked.any() else "none needed"
        short = f"{lacking[k]:.2f} N·m at {round(angle[k])} deg" if lacking[k] > 0.0 else "–"
        pulling = " + ".join(chambers) or "none"
        rows.append([need.phase, peak, f"{angle.min():.0f} to {angle.max():.0f}", pulling, met, short])
    scenario = found.scenario
    if rows:
        title = f"torque needed by {person_of(scenario).body_mass:g} kg" + (" (5 to 95 %)" if bands else "")
        common.print_table(f"{title}, at the supply's {scenario.supply.pressure * 1e-5:g} bar", header, rows)
        print("available torque is static, as if filled instantly; a run shows what the valves leave of it")
        print(
            ""
            if bands
            else "the needed torque is uncertain by a factor of two or more (see --uncertainty 20)"
        )
    elif scenario.leg.joint == "ankle":
        why = "for a patient's own walk" if scenario.walking else "without walking"
        print(f"the needed torque is unknown {why}; name another walk, such as --walk walk-dropfoot-afo")
    for warning in found.warnings:
        print(f"warning: {warning}")
    print(f"written to {out}")


@common.app.command("both")
def both_command(
    scenario: common.Scenario,
    left: Annotated[str, Option(help="scenario of the left leg; else the same", metavar="SCENARIO")] = "",
    out: Annotated[Path | None, Option(help="output folder; runs/<scenario>-both by default")] = None,
    sets: common.Sets = None,
    left_sets: Annotated[
        list[str] | None, Option("--left-set", metavar="KEY=VALUE", help="set a key of the left leg only")
    ] = None,
    apart: Annotated[
        float | None, Option(help="delay of the left leg as a share of the stride; 0.5 by default, seated 0")
    ] = None,
    affected: Annotated[
        str | None, Option(help="right|left: only this side wears the device; the other walks as recorded")
    ] = None,
    rrd: common.RecordingOption = None,
    rate: common.Rate = None,
    numbers: Annotated[bool, Option("--numbers", help="print every metric of both legs")] = False,
    force: Annotated[bool, Option("--force", help="overwrite another run in that folder")] = False,
) -> None:
    """Simulate both legs on one supply. Reports total air, flow from the source, and the worse leg."""
    values, others = common.read_sets(sets), common.read_sets(left_sets, "--left-set")
    hertz = None if rate is None else common.hertz_of(rate)
    side = cast(Literal["right", "left"], affected)  # `described` examines it
    common.short_lived()
    with common.progress("reading the files, compiling the muscles") as report:
        from afo_sim.model import with_person
        from afo_sim.simulation import bilateral as legs

        pair = legs.described(scenario, left or None, sets=values, left_sets=others, affected=side)
        folder = out or Path("runs") / f"{pair[0].name}-both"
        shift = legs.checked(*pair, apart)
        kind, problem = "run of both legs", "holds the same legs {apart} of a stride apart"
        check_folder(folder, kind)
        for each, leg in zip(("right", "left"), pair, strict=True):
            check_run_folder(folder / each, with_person(leg).resolved(), force=force)
        check_same(folder, kind, "both.json", {"apart": shift}, problem, force=force, whom="them")
        found = legs.both(*pair, apart=shift, affected=side, progress=report)
        with telling(folder):
            found.save(folder, rrd=common.drawn(rrd), rate=hertz)
    _print_both(found, folder, numbers=numbers)
    _stop({} if found.ok else {"": found.status})


def _print_both(legs: "Both", folder: Path, *, numbers: bool) -> None:
    """Print two legs' runs: a screen of what decides, or with `numbers` everything."""
    from afo_sim.show import in_brief

    names = {side: leg.described["name"] for side, leg in legs.legs.items()}
    tail = [(f"written to {folder}; to compare the legs: afo-sim report {folder}", 2)]
    print(f"right: {names['right']}; left: {names['left']}, {legs.apart:g} of a stride later")
    if legs.affected:
        print(f"affected side: {legs.affected}; the other side wears no device and walks as recorded")
    if numbers or not legs.verdict:
        _print_tables(legs, whole=numbers)
    judged = [_judged(legs, worse) for worse in legs.verdict]
    warnings = warning_lines(legs, bool(judged) and not numbers)
    either = [note for leg in (legs.right, legs.left) for note in note_lines(leg)]
    doubts = [] if numbers else [note for note in either if note.code != "mirrored"]  # one of two always is
    notes = [*warnings, *_peak(legs), *((f"note: {note}", 6) for note in legs.notes)]
    first = [(f"note: {in_brief(doubts)}", 6)] if doubts else []
    print_answers(judged, notes, tail, first=first, whole=numbers)


def _print_tables(legs: "Both", *, whole: bool) -> None:
    """The air of both; as a `whole` also both sides compared, and every number of each leg."""
    from afo_sim.show import printed

    sides, air = ("right", "left", "both"), []
    for name, words in ROWS:
        cells = [legs.numbers.get(f"{name}_{who}") for who in sides]
        factor = 1e-3 if name.startswith("way") else 1.0  # in kilometres
        if any(cell is not None for cell in cells):
            air.append([words, *("–" if cell is None else f"{factor * cell.value:.4g}" for cell in cells)])
    common.print_table("air on one supply", ["", *sides], air)
    if not whole:
        return
    for kind, each in legs.asymmetry.items():
        common.print_table(
            f"right and left compared, {kind}", common.SIDES_HEADER, [row.cells for row in each]
        )
    rows = []
    for name, metric in legs.right.metrics.items():
        if name in legs.left.metrics:
            title = f"{name} [{metric.unit}]" if metric.unit else name
            rows.append([title, *(printed(name, leg.metrics[name]) for leg in legs.legs.values())])
    common.print_table("each leg", ["", "right", "left"], rows)


def _peak(legs: "Both") -> list[tuple[str, int]]:
    found = [legs.numbers.get(f"peak_flow_{who}") for who in ("right", "left", "both")]
    peaks = [peak.value for peak in found if peak is not None]
    if len(peaks) < 3 or max(peaks[:2]) <= 0.0:
        return []
    times = peaks[2] / max(peaks[:2])
    return [(f"the source must deliver {peaks[2]:.3g} l/min (ANR) at peak, {times:.2f} times one leg's", 2)]


def _judged(legs: "Both", worse: "Worse") -> tuple["Recording", "Answer"]:
    """A leg and its answer to one question, the worse one; where they are alike but for numbers, both's."""
    answers = worse.answers
    if len(answers) == 1:
        who = {worse.leg: ("affected side: ", "")}
    elif "both" in answers:
        who = {"both": ("both legs together: ", "together: ")}
    elif worse.leg != "both":
        who = {worse.leg: (f"the {worse.leg} leg, the worse one: ", f"{worse.leg}: ")}
    elif answers["right"].text == answers["left"].text:
        who = {"right": ("both legs: ", "")}
    else:
        who = {side: (f"{side}: ", f"{side}: ") for side in ("right", "left")}
    text = " ".join(f"{name}{answers[key].text}" for key, (name, _) in who.items())
    short = [f"{name}{answers[key].brief}" for key, (_, name) in who.items() if answers[key].brief]
    brief = "; ".join(short) if len(short) == len(who) else ""
    key = next(iter(who))
    return (legs.left if key == "left" else legs.right), dataclasses.replace(
        answers[key], text=text, brief=brief
    )
