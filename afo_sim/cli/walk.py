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

DRAWN_STARTS = 30  # of each drawn patient


@dataclass(frozen=True)
class _Walk:
    """Options of `walk`: who walks, by which gaits, how it is disturbed, how the patient adapts."""

    scenario: Scenario
    sets: Sets = None
    gait: Annotated[str, Option(help="healthy gait: a shipped name, or a file")] = "natural"
    strength: Annotated[
        list[str] | None, Option(metavar="MUSCLE=SHARE", help="share left, as tibialis=0.2 or left_soleus=0")
    ] = None
    duration: Annotated[str, Option(help="of the undisturbed walks")] = "20 s"
    starts: Annotated[int, Option(help="perturbed starts of each case; 0 for none")] = 50
    push: Annotated[str, Option(help="on the trunk, once in each perturbed start")] = "50 N"
    generations: Annotated[
        int, Option("--adapt", help="generations of 16 walks in which who is weak adapts")
    ] = 0
    subset: Annotated[str, Option(help="gains that adapt: swing, stance or all")] = "all"
    adapted: Annotated[str | None, Option(help="gait of the patient who has adapted")] = None
    adapted_device: Annotated[str | None, Option(help="the same, with the device")] = None
    draws: Annotated[int, Option(help="patients drawn over what is not known of this one")] = 0
    seed: Annotated[int, Option(help="of perturbed starts and search")] = 0
    threads: Threads = 0
    vary: Annotated[
        str | None, Option(metavar="KEY=V1,V2,…", help='a table: strength.soleus=1,0 supply.pressure="2 bar"')
    ] = None
    out: Annotated[Path | None, Option(help="folder to write to; runs/<scenario>-walk by default")] = None
    rrd: RecordingOption = None
    force: Annotated[bool, Option("--force", help="replace another responding walk")] = False


@common.app.command("walk")
@common.one_group
def walk_command(walk: _Walk) -> None:
    """Experimental: a walker that responds. Does the wearer fall, what do they change, what does it cost?"""
    key, values = _varied(walk.vary)
    weak, muscle = key.startswith("strength"), key.removeprefix("strength").removeprefix(".")
    sets = [common.read_sets(walk.sets) | ({key: value} if key and not weak else {}) for value in values]
    common.check_counts(walk.threads, 0)
    if not 0 <= walk.draws <= 1000 or (walk.draws and key):
        allowed = "0 without --vary" if key else "0 to 1000"
        raise InputError("is out of range", field="--draws", value=walk.draws, allowed=allowed)
    names = ("gait", "starts", "generations", "subset", "adapted", "adapted_device", "seed")
    options = common.picked(walk, *names) | {
        "duration": common.quantity("--duration", walk.duration, "s"),
        "push": common.quantity("--push", walk.push, "N"),
    }
    left = common.read_sets(walk.strength, "--strength", "tibialis=0.2")
    strengths = [left | ({muscle: value} if weak else {}) for value in values]
    common.short_lived()
    with common.progress("reading, compiling the muscles") as report:
        from afo_sim.walker import CASES, JSON, in_brief, prepared, respond, save, save_table, strengths_of

        described = [prepared(walk.scenario, each) for each in sets]
        for value in values if weak else []:  # before anybody walks
            strengths_of(described[0], {muscle: value}, "--vary strength")
        folder = walk.out or Path("runs") / f"{described[0].name}-walk"
        command = options | {"varied": key, "strength": strengths}
        command["scenarios"] = [each.resolved() for each in described]
        problem = "holds the responding walk of another description, or with other options"
        check_same(folder, "responding walk", JSON, {"command": command}, problem, force=walk.force)
        rrd = not key and common.drawn(walk.rrd)
        rows, responses = list[dict[str, str]](), list[Any]()
        optional("matplotlib")  # before minutes of walking

        def moved(case: str, share: float) -> None:
            report(round(100.0 * share), 100, f"{len(responses) + 1} of {len(sets)}: {CASES[case]}")

        threads, searches = walk.threads or os.cpu_count() or 1, folder / "walk.searches"
        for value, each, left in zip(values, sets, strengths, strict=True):
            options |= {"strength": left, "kept": searches / str(len(responses) + 1)}
            found = respond(walk.scenario, each, threads=threads, progress=moved, **options)
            responses.append(found)
            one = [replace(found, cases={n: case}) for n, case in found.cases.items() if n != "healthy"]
            rows += [{key: str(value)} | in_brief(each) for each in one]
            if walk.draws and not key:
                found = _drawn(found, walk.draws, threads, report, left)
        report(0, 0, "drawing")
        if key:
            from afo_sim.show import draw_doses

            save_table(rows, folder, command)
            draw_doses(key, values, responses, folder / "walk.png")
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


def _drawn(found: Any, draws: int, threads: int, report: Any, strength: dict[str, float]) -> Any:
    """The response with falls over drawn patients, of each case by the gait that has adapted, if one has."""
    from afo_sim.walker import DRAWN, draw_falls

    cases = {name: case for name, case in found.cases.items() if f"{name} adapted" not in found.cases}
    gaits = {name: case.gait for name, case in cases.items() if name != "healthy"}
    asked: dict[str, Any] = {name: found.asked[name] for name in ("push", "seed")} | {"threads": threads}
    asked["report"] = lambda share: report(round(100.0 * share), 100, "drawn patients")
    band = draw_falls(found.scenario, gaits, draws=draws, starts=DRAWN_STARTS, strength=strength, **asked)
    drawn = {"draws": draws, "starts": DRAWN_STARTS, "over": DRAWN}
    drawn |= {"falls_5_50_95": {name: band.range(name) for name in gaits}, "table": band.table()}
    return replace(found, asked=dict(found.asked) | {"drawn": drawn})


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
    if drawn := found.asked.get("drawn"):
        common.print_table(f"{drawn['draws']} drawn patients", *drawn["table"], whole_names=True)
    assumed = dict.fromkeys(f"assumed: {text}" for reply in replies for text in reply.assumptions)
    for line in (*assumed, *asked_in_words(found)):
        print_line(line, hang=2)
    _print_limits()
    print(f"{written}: walk.html, walk.png, walk.gif, walk.json{view}")


def _print_limits() -> None:
    from afo_sim.metrics import NO_DEVICE
    from afo_sim.walker import EXPERIMENTAL

    print_line(f"{EXPERIMENTAL} Falls are the walker's, never a patient's risk. {NO_DEVICE}")
