"""The command of a walker that responds to its device."""

import functools
import os
import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from typer import Option

from afo_sim.cli import common
from afo_sim.cli.common import RecordingOption, Scenario, Sets, Threads
from afo_sim.cli.overwriting import check_same
from afo_sim.cli.printed_run import print_line
from afo_sim.common import InputError, optional


@dataclass(frozen=True)
class _Walk:
    """Options of `walk`: who walks, by which gaits, how it is disturbed, how the patient adapts."""

    scenario: Scenario
    sets: Sets = None
    patients: Annotated[
        str | None,
        Option(
            metavar="NAME",
            help="of a condition: a shipped name, a file, or `one`: the scenario's own patient alone; "
            "by default those that are shipped for the scenario's patient",
        ),
    ] = None
    spring: Annotated[str | None, Option(help='a passive orthosis beside it, as "30 N*m/rad" (patients)')] = (
        None
    )
    gait: Annotated[str, Option(help="healthy gait: a shipped name, or a file (one)")] = "natural"
    strength: Annotated[
        list[str] | None,
        Option(metavar="MUSCLE=SHARE", help="share left, as tibialis=0.2 or left_soleus=0 (one)"),
    ] = None
    duration: Annotated[str | None, Option(help="of the undisturbed walks; 10 s, of one 20 s")] = None
    starts: Annotated[
        int | None, Option(help="perturbed starts of each case; 2 of each patient, 50 of one")
    ] = None
    push: Annotated[str, Option(help="on the trunk, once in each perturbed start")] = "50 N"
    generations: Annotated[
        int, Option("--adapt", help="generations of 16 walks in which those adapt who have no gait yet")
    ] = 0
    subset: Annotated[str, Option(help="gains that adapt: swing, stance or all (one)")] = "all"
    adapted: Annotated[
        str | None, Option(help="gait of who has adapted; of patients: patients.csv of a walk")
    ] = None
    adapted_device: Annotated[str | None, Option(help="the same, with the device (one)")] = None
    draws: Annotated[int, Option(help="people drawn about each patient, who keep the gait")] = 0
    seed: Annotated[int, Option(help="of perturbed starts and search")] = 0
    threads: Threads = 0
    vary: Annotated[
        str | None,
        Option(metavar="KEY=V1,V2,…", help='a table: supply.pressure="2 bar,3 bar", strength.soleus=1,0'),
    ] = None
    out: Annotated[Path | None, Option(help="folder to write to; runs/<scenario>-walk by default")] = None
    rrd: RecordingOption = None
    force: Annotated[bool, Option("--force", help="replace another responding walk")] = False


@common.app.command("walk")
@common.one_group
def walk_command(walk: _Walk) -> None:
    """Experimental: walkers that respond. Who gains, who falls, what do they change, what does it cost?"""
    key, values = _varied(walk.vary)
    common.check_counts(walk.threads, 0)
    common.short_lived()
    condition = _condition_of(walk, key)
    if walk.draws and (key or condition is None):
        problem = "is not taken with --vary" if key else "draws people about each patient of a condition"
        allowed = "0" if key else "--patients CONDITION: a shipped name, or a file of your own"
        raise InputError(problem, field="--draws", value=walk.draws, allowed=allowed)
    optional("matplotlib")  # before minutes of walking
    if condition is None:
        _walk_one(walk, key, values)
    else:
        _walk_patients(walk, condition, key, values)


def _condition_of(walk: _Walk, key: str) -> str | None:
    """The condition whose patients walk; None where the scenario's own one walks alone."""
    from afo_sim.common import assets
    from afo_sim.description import load
    from afo_sim.walker import prepared

    of_one: dict[str, Any] = {"strength": walk.strength, "adapted-device": walk.adapted_device}
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
        allowed = f"--patients {'|'.join(assets.names('population'))}"
        problem = "is worn by patients of a condition"
        raise InputError(problem, field="--spring", value=walk.spring, allowed=allowed)
    return condition


def _walk_patients(walk: _Walk, condition: str, key: str, values: list[Any]) -> None:
    """The patients of a condition walk, at each value of what is varied."""
    given = {name: x for name, x in common.read_sets(walk.sets).items() if name != "patient"}
    sets = [given | ({key: x} if key and key != "spring" else {}) for x in values]
    springs = [str(value) if key == "spring" else walk.spring for value in values]
    options: dict[str, Any] = common.picked(walk, "generations", "seed") | {
        "patients": condition,
        "gaits": walk.adapted,
        "others": walk.draws,
        "starts": 2 if walk.starts is None else walk.starts,
        "duration": common.quantity("--duration", walk.duration or "10 s", "s"),
        "push": common.quantity("--push", walk.push, "N"),
    }
    read = functools.partial(common.quantity, "--spring", unit="N*m/rad", above=0.0, at_most=1000.0)
    stiff = [None if each is None else read(each) for each in springs]
    with common.progress("reading, compiling the muscles") as report:
        from afo_sim.show import doses_over, draw_doses, write_population
        from afo_sim.walker import in_lines, populate, prepared, recorded_walk, save_population, save_table

        described = [prepared(walk.scenario, each) for each in sets]
        folder, command = _into(walk, described, options | {"varied": key, "springs": stiff})
        found = list[Any]()

        def moved(what: str, share: float) -> None:
            report(round(1000.0 * share), 1000, f"{len(found) + 1} of {len(sets)}: {what}")

        searches = folder / "walk.searches"
        for each, spring in zip(sets, stiff, strict=True):
            options["kept"] = searches / str(len(found) + 1)
            options["threads"] = walk.threads or os.cpu_count() or 1
            found.append(populate(walk.scenario, each, spring=spring, progress=moved, **options))
        report(0, 0, "drawing")
        if key:
            pairs = zip(values, found, strict=True)
            rows = [{key: str(value)} | row for value, one in pairs for row in in_lines(one)]
            save_table(rows, folder, command)
            draw_doses(key, values, [doses_over(one) for one in found], folder / "walk.png")
        else:
            recorded = recorded_walk(found[0].middle)
            save_population(found[0], recorded, folder, command, write_population)
    if walk.generations:
        shutil.rmtree(searches, ignore_errors=True)
    if key:
        title = f"{described[0].name}: {len(found[0].drawn)} patients ({condition}) at values of {key}"
        common.print_table(title, list(rows[0]), [list(row.values()) for row in rows], whole_names=True)
        _print_limits()
        print(f"written to {folder}: walk.csv, walk.json, walk.png")
    else:
        _print_patients(found[0], recorded)
        print(f"written to {folder}: walk.html, walk.png, walk.csv, walk.json, patients.csv, curves.parquet")


def _into(walk: _Walk, described: list[Any], asked: dict[str, Any]) -> tuple[Path, dict[str, Any]]:
    """The folder to write to, and the command, which the walk that lies there was written by, too."""
    from afo_sim.walker import JSON

    folder = walk.out or Path("runs") / f"{described[0].name}-walk"
    command = asked | {"scenarios": [each.resolved() for each in described]}
    problem = "holds the responding walk of another description, or with other options"
    check_same(folder, "responding walk", JSON, {"command": command}, problem, force=walk.force)
    return folder, command


def _print_patients(found: Any, recorded: Any) -> None:
    from afo_sim.walker import in_lines, replies

    answers = replies(found, recorded)
    for reply in answers:
        print_line(f"{reply.question} {reply.text}", hang=2)
    rows = in_lines(found)
    of = len(found.drawn)
    title = f"{found.condition.name}: medians, and 5 to 95 % of {of} patients; of falls the 95 % interval"
    common.print_table(title, list(rows[0]), [list(row.values()) for row in rows], whole_names=True)
    for text in dict.fromkeys(text for reply in answers for text in reply.assumptions):
        print_line(f"assumed: {text}", hang=2)
    _print_limits()


def _walk_one(walk: _Walk, key: str, values: list[Any]) -> None:
    """The scenario's own patient walks, at each value of what is varied."""
    weak, muscle = key.startswith("strength"), key.removeprefix("strength").removeprefix(".")
    sets = [common.read_sets(walk.sets) | ({key: value} if key and not weak else {}) for value in values]
    names = ("gait", "generations", "subset", "adapted", "adapted_device", "seed")
    options: dict[str, Any] = common.picked(walk, *names) | {
        "starts": 50 if walk.starts is None else walk.starts,
        "duration": common.quantity("--duration", walk.duration or "20 s", "s"),
        "push": common.quantity("--push", walk.push, "N"),
    }
    left = common.read_sets(walk.strength, "--strength", "tibialis=0.2")
    strengths = [left | ({muscle: value} if weak else {}) for value in values]
    with common.progress("reading, compiling the muscles") as report:
        from afo_sim.walker import CASES, in_brief, prepared, respond, save, save_table, strengths_of

        described = [prepared(walk.scenario, each) for each in sets]
        for value in values if weak else []:  # before anybody walks
            strengths_of(described[0], {muscle: value}, "--vary strength")
        folder, command = _into(walk, described, options | {"varied": key, "strength": strengths})
        rrd = not key and common.drawn(walk.rrd)
        rows, responses = list[dict[str, str]](), list[Any]()

        def moved(case: str, share: float) -> None:
            report(round(100.0 * share), 100, f"{len(responses) + 1} of {len(sets)}: {CASES[case]}")

        threads, searches = walk.threads or os.cpu_count() or 1, folder / "walk.searches"
        for value, each, left in zip(values, sets, strengths, strict=True):
            options |= {"strength": left, "kept": searches / str(len(responses) + 1)}
            found = respond(walk.scenario, each, threads=threads, progress=moved, **options)
            responses.append(found)
            one = [replace(found, cases={n: case}) for n, case in found.cases.items() if n != "healthy"]
            rows += [{key: str(value)} | in_brief(each) for each in one]
        report(0, 0, "drawing")
        if key:
            from afo_sim.show import doses_of, draw_doses

            save_table(rows, folder, command)
            draw_doses(key, values, [doses_of(each) for each in responses], folder / "walk.png")
        else:
            from afo_sim.show import write_pictures

            save(found, folder, command=command, draw=functools.partial(write_pictures, rrd=rrd))
    if walk.generations:
        shutil.rmtree(searches, ignore_errors=True)
    if key:
        title = f"{described[0].name}: the wearer at values of {key}"
        common.print_table(title, list(rows[0]), [list(row.values()) for row in rows], whole_names=True)
        _print_limits()
        print(f"written to {folder}: walk.csv, walk.json, walk.png")
    else:
        _print(found, f"written to {folder}", f"; to view: afo-sim view {folder}/walk.rrd" if rrd else "")


def _varied(text: str | None) -> tuple[str, list[Any]]:
    """The key that is varied and its values; "" and one value where none is."""
    if text is None:
        return "", [None]
    key, _, values = text.partition("=")
    parts = [part.strip() for part in values.split(",") if part.strip()]
    if not key.strip() or not parts:
        problem, allowed = "is not KEY=V1,V2,…", 'supply.pressure="2 bar,3 bar"'
        raise InputError(problem, field="--vary", value=text, allowed=allowed)
    return key.strip(), [common.read_sets([f"x={part}"])["x"] for part in parts]


def _print(found: Any, written: str, view: str) -> None:
    from afo_sim.walker import asked_in_words, in_words, table, verdict

    replies = verdict(found)
    for line in (*in_words(found), *(f"{reply.question} {reply.text}" for reply in replies)):
        print_line(line, hang=2)
    common.print_table(f"{found.scenario.name}: a walker that responds", *table(found), whole_names=True)
    assumed = dict.fromkeys(f"assumed: {text}" for reply in replies for text in reply.assumptions)
    for line in (*assumed, *asked_in_words(found)):
        print_line(line, hang=2)
    _print_limits()
    print(f"{written}: walk.html, walk.png, walk.gif, walk.json{view}")


def _print_limits() -> None:
    from afo_sim.metrics import NO_DEVICE
    from afo_sim.walker import EXPERIMENTAL

    print_line(f"{EXPERIMENTAL} Falls are the walker's, never a patient's risk. {NO_DEVICE}")
