"""The command of a walker that responds to its device."""

import functools
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, cast

from typer import Option

from afo_sim.cli import common
from afo_sim.cli.common import RecordingOption, Scenario, Sets, Threads
from afo_sim.cli.common import print_line as print
from afo_sim.cli.overwriting import check_same
from afo_sim.common import Foreign, Function, InputError, Json, JsonDict, Mixed, optional

_Texts = Sequence[str]
_Table = tuple[list[str], list[list[str]]]


@dataclass(frozen=True)
class _Walk:
    """Options of `walk`: who walks, by which gaits, how it is disturbed, how the patient adapts."""

    scenario: Scenario
    sets: Sets = None
    patients: Annotated[
        str | None,
        Option(
            metavar="NAME",
            help="condition: a shipped name, a file, or `one` for the scenario's own patient alone; "
            "by default those that are shipped for the scenario's patient",
        ),
    ] = None
    spring: Annotated[str | None, Option(help='passive orthosis beside it, "30 N*m/rad" (patients)')] = None
    gait: Annotated[str, Option(help="healthy gait: a shipped name or a file (one)")] = "natural"
    strength: Annotated[
        list[str] | None,
        Option(
            metavar="MUSCLE=SHARE", help="remaining strength, such as tibialis=0.2 or left_soleus=0 (one)"
        ),
    ] = None
    duration: Annotated[str | None, Option(help="duration of undisturbed walks; 10 s, for one 20 s")] = None
    starts: Annotated[int | None, Option(help="perturbed starts per case; by default 2, for one 50")] = None
    push: Annotated[str, Option(help="push on the trunk, once in each perturbed start")] = "50 N"
    generations: Annotated[int, Option(help="generations of 16 walks for patients yet to adapt")] = 0
    subset: Annotated[str, Option(help="gains that adapt: swing, stance or all (one)")] = "all"
    adapted: Annotated[str | None, Option(help="adapted gait; for patients: an earlier patients.csv")] = None
    adapted_device: Annotated[str | None, Option(help="adapted gait with the device (one)")] = None
    draws: Annotated[int, Option(help="number of people varied about each patient, with the same gait")] = 0
    seed: Annotated[int, Option(help="seed of perturbed starts and search")] = 0
    threads: Threads = 0
    vary: Annotated[
        str | None,
        Option(
            metavar="KEY=V1,V2,…",
            help='compute a table over values: supply.pressure="2 bar,3 bar", strength.soleus=1,0',
        ),
    ] = None
    out: Annotated[Path | None, Option(help="output folder; runs/<scenario>-walk by default")] = None
    rrd: RecordingOption = None
    force: Annotated[bool, Option("--force", help="overwrite another responding walk")] = False


@common.app.command("walk")
@common.one_group
def walk_command(walk: _Walk) -> None:
    """Simulate walkers who respond to the device (experimental). Who gains, who falls, at what cost?"""
    key, values = _varied(walk.vary)
    common.check_counts(walk.threads, 0)
    common.short_lived()
    condition = _condition_of(walk, key)
    if walk.draws and (key or condition is None):
        problem = "is not taken with --vary" if key else "draws people about each patient of a condition"
        allowed = "0" if key else "--patients CONDITION: a shipped name, or a file of your own"
        raise InputError(problem, field="--draws", value=walk.draws, allowed=allowed)
    optional("matplotlib")  # before minutes of walking
    _walk(walk, condition, key, values)


def _condition_of(walk: _Walk, key: str) -> str | None:
    """The condition whose patients walk; None where the scenario's own one walks alone."""
    from afo_sim.common import assets
    from afo_sim.description import load
    from afo_sim.walker import prepared

    of_one: JsonDict = {"strength": walk.strength, "adapted-device": walk.adapted_device}
    of_one |= {"subset": walk.subset != "all", "gait": walk.gait != "natural", "rrd": walk.rrd}
    sets, own = common.read_sets(walk.sets), ("patient", "strength")
    of_one |= {"vary": key.partition(".")[0] in own and walk.vary}
    own_sets = [name for name in sets if name.startswith("patient.") or (walk.patients and name == "patient")]
    of_one |= {"set": own_sets[0] if own_sets else None}
    asked = next((name for name, given in of_one.items() if given), None)
    if walk.patients not in (None, "one"):
        if asked:
            problem, allowed = "is of one patient", "--patients one"
            raise InputError(problem, field=f"--{asked}", value=str(of_one[asked]), allowed=allowed)
        return walk.patients
    alone = asked or walk.adapted or any(name.startswith("leg") for name in (key, *sets))
    patient = None if walk.patients or alone else prepared(walk.scenario, sets).patient
    condition = None if patient is None else patient.name
    if condition not in assets.names("population") or patient != load("patient", condition):
        condition = None
    if condition is None and (walk.spring or key == "spring"):
        problem, allowed = "is worn by patients", f"--patients {'|'.join(assets.names('population'))}"
        raise InputError(problem, field="--spring", value=walk.spring, allowed=allowed)
    return condition


def _options(
    walk: _Walk, condition: str | None, key: str, values: Sequence[str | None]
) -> tuple[JsonDict, str, list[Json], list[JsonDict]]:
    """Options of all walks; the name of one that differs, what it is, and what is set at each value."""
    given, names, duration = common.read_sets(walk.sets), ["generations", "seed"], "10 s"
    weak, muscle = key.startswith("strength"), key.removeprefix("strength").removeprefix(".")
    if condition is None:
        names += ["gait", "subset", "adapted", "adapted_device"]
        own, starts, duration, options = "strength", 50, "20 s", JsonDict()
        left = common.read_sets(walk.strength, "--strength", "tibialis=0.2")
        each: list[Json] = [{**left, **({muscle: value} if weak else {})} for value in values]
    else:
        given.pop("patient", None)
        own, starts = "spring", 2
        options = {"patients": condition, "gaits": walk.adapted, "others": walk.draws}
        springs = [str(value) if key == "spring" else walk.spring for value in values]
        read = functools.partial(common.quantity, "--spring", unit="N*m/rad", above=0.0, at_most=500.0)
        each = [None if spring is None else read(spring) for spring in springs]
    options |= common.picked(walk, *names) | {"starts": starts if walk.starts is None else walk.starts}
    options |= {"duration": common.quantity("--duration", walk.duration or duration, "s")}
    options |= {"push": common.quantity("--push", walk.push, "N")}
    return options, own, each, [given | ({} if weak or key in ("", "spring") else {key: x}) for x in values]


def _walk(walk: _Walk, condition: str | None, key: str, values: Sequence[str | None]) -> None:
    """The patients of a condition walk, or the scenario's own one, at each value of what is varied."""
    options, own, each, sets = _options(walk, condition, key, values)
    alone = condition is None
    with common.progress("reading the files, compiling the muscles") as report:
        from afo_sim import show, walker

        described = [walker.prepared(walk.scenario, one) for one in sets]
        for value in values if alone and key.startswith("strength") else []:  # before anybody walks
            muscle = key.removeprefix("strength").removeprefix(".")
            walker.strengths_of(described[0], {muscle: cast(float, value)}, "--vary strength")
        folder, found = walk.out or Path("runs") / f"{described[0].name}-walk", list[Foreign]()
        command = options | {"varied": key, own: each, "scenarios": [one.resolved() for one in described]}
        same, problem = {"command": command}, "holds the responding walk of another description or options"
        check_same(folder, "responding walk", walker.JSON, same, problem, force=walk.force)
        rrd = alone and not key and common.drawn(walk.rrd)

        def moved(case: str, share: float) -> None:
            what = walker.CASES.get(case, case) if alone else case
            report(round(1000.0 * share), 1000, f"{len(found) + 1} of {len(sets)}: {what}")

        run: Function = walker.walk if alone else walker.populate
        options["threads"] = walk.threads or os.cpu_count() or 1
        for one, its in zip(sets, each, strict=True):
            options |= {own: its}
            options |= {} if alone or not found else {"known": found[-1].gaits}
            found.append(run(walk.scenario, one, progress=moved, **options))
        report(0, 0, "drawing")
        pairs = zip(values, found, strict=True)
        rows = [({key: str(x)} if key else {}) | row for x, one in pairs for row in walker.in_lines(one)]
        table = list(rows[0]), [list(row.values()) for row in rows]
        if key:
            gaits = "" if alone or not found[-1].gaits else walker.gaits_table(found[-1])
            walker.save_table(rows, folder, command, gaits)
            show.draw_doses(key, values, [show.doses_of(one) for one in found], folder / "walk.png")
        elif alone:
            draw = functools.partial(show.write_pictures, rrd=rrd)
            walker.save(found[0], folder, command=command, draw=draw)
        else:
            recorded = walker.recorded_walk(found[0].middle)
            walker.save_population(found[0], recorded, folder, command, show.write_population)
    if key:
        whose = "the wearer" if alone else f"{len(found[0].drawn)} patients ({condition})"
        _print(f"{described[0].name}: {whose} at values of {key}", table)
        files = "walk.csv, walk.json, walk.png" + (", patients.csv" if gaits else "")
    elif alone:
        words, asked = walker.in_words(found[0]), walker.asked_in_words(found[0])
        title = f"{described[0].name}: a walker that responds"
        _print(title, walker.table(found[0]), words, walker.verdict(found[0]), asked)
        files = "walk.html, walk.png, walk.gif, walk.json"
    else:
        of = f"5 to 95 % of {len(found[0].drawn)} patients; for falls the 95 % interval"
        _print(f"{found[0].condition.name}: medians, and {of}", table, [], walker.replies(found[0], recorded))
        files = "walk.html, walk.png, walk.csv, walk.json, patients.csv, curves.parquet"
    view = f"; to view: afo-sim view {folder}/walk.rrd" if rrd else ""
    print(f"written to {folder}: {files}{view}")


def _print(title: str, table: _Table, words: _Texts = (), replies: Mixed = (), asked: _Texts = ()) -> None:
    from afo_sim.metrics import NO_DEVICE
    from afo_sim.walker import EXPERIMENTAL

    for line in (*words, *(f"{reply.question} {reply.text}" for reply in replies)):
        print(line, hang=2)
    common.print_table(title, *table, whole_names=True)
    assumed = dict.fromkeys(f"assumed: {text}" for reply in replies for text in reply.assumptions)
    for line in (*assumed, *asked):
        print(line, hang=2)
    print(f"{EXPERIMENTAL} Falls are the simulated walker's, never a patient's risk. {NO_DEVICE}")


def _varied(text: str | None) -> tuple[str, Sequence[str | None]]:
    """The key that is varied and its values; "" and one value where none is."""
    if text is None:
        return "", [None]
    key, _, values = text.partition("=")
    parts = [part.strip() for part in values.split(",") if part.strip()]
    if not key.strip() or not parts:
        problem, allowed = "is not KEY=V1,V2,…", 'supply.pressure="2 bar,3 bar"'
        raise InputError(problem, field="--vary", value=text, allowed=allowed)
    return key.strip(), [common.read_sets([f"x={part}"])["x"] for part in parts]
