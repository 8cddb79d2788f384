"""The command of a walker that responds to its device."""

import csv
import functools
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from typer import Option

from afo_sim.cli.common import (
    RecordingOption,
    Scenario,
    Sets,
    Threads,
    app,
    check_counts,
    drawn,
    one_group,
    picked,
    print_table,
    progress,
    quantity,
    read_sets,
    short_lived,
)
from afo_sim.cli.overwriting import check_same
from afo_sim.cli.printed_run import print_line
from afo_sim.common import InputError

_KIND = "responding walk"
_MOST = 100  # values of a key
_VARIED = ("speed", "clearance", "ankle_swing", "cost_of_transport", "air_per_stride")


@dataclass(frozen=True)
class _Walk:
    """Options of `walk`: who walks, by which gaits, how it is disturbed, how the patient adapts."""

    scenario: Scenario
    sets: Sets = None
    gait: Annotated[str, Option(help="healthy gait: a shipped name, or a file")] = "natural"
    strength: Annotated[
        list[str] | None,
        Option(metavar="MUSCLE=SHARE", help="share left, as tibialis=0.2; left_… of the other leg"),
    ] = None
    duration: Annotated[str, Option(help="of the undisturbed walks")] = "20 s"
    starts: Annotated[int, Option(help="perturbed starts of each case; 0 for none")] = 50
    push: Annotated[str, Option(help="on the trunk, once in each perturbed start")] = "50 N"
    generations: Annotated[
        int, Option("--adapt", help="let the patient adapt: generations of 16 walks; 0 for none")
    ] = 0
    subset: Annotated[str, Option(help="gains that adapt: swing, stance or all")] = "all"
    adapted: Annotated[Path | None, Option(help="gait of the patient who has adapted")] = None
    adapted_device: Annotated[Path | None, Option(help="the same, with the device")] = None
    seed: Annotated[int, Option(help="of perturbed starts and search")] = 0
    threads: Threads = 0
    vary: Annotated[
        str | None,
        Option(metavar="KEY=V1,V2,…", help='a table over values, as supply.pressure="2 bar,3 bar"'),
    ] = None
    out: Annotated[Path | None, Option(help="folder to write to; runs/<scenario>-walk by default")] = None
    rrd: RecordingOption = None
    force: Annotated[bool, Option("--force", help="replace another responding walk")] = False


@app.command("walk")
@one_group
def walk_command(walk: _Walk) -> None:
    """A walker that responds, by reflexes: does the wearer fall, what do they change, what does it cost?"""
    values, shares = read_sets(walk.sets), read_sets(walk.strength, "--strength", "tibialis=0.2")
    key, varied = _read_varied(walk.vary)
    check_counts(walk.threads, 0)
    options = picked(walk, "gait", "starts", "generations", "subset", "seed") | {"strength": shares}
    options["duration"] = quantity("--duration", walk.duration, "s")
    options["push"] = quantity("--push", walk.push, "N")
    options |= {name: None if path is None else str(path) for name, path in
                picked(walk, "adapted", "adapted_device").items()}  # fmt: skip
    short_lived()
    with progress("reading, compiling the muscles") as report:
        from afo_sim.walker import JSON, in_brief, prepared

        sets = [values | {key: value} if key else values for value in varied]
        described = [prepared(walk.scenario, each) for each in sets]
        folder = walk.out or Path("runs") / f"{described[0].name}-walk"
        command = options | {"varied": key, "scenarios": [each.resolved() for each in described]}
        problem = "holds the responding walk of another description, or with other options"
        check_same(folder, _KIND, JSON, {"command": command}, problem, force=walk.force)
        options["threads"] = walk.threads or os.cpu_count() or 1
        if not key:
            found, rrd = _respond(walk.scenario, values, options, report), drawn(walk.rrd)
            report(0, 0, "drawing")
            _save(found, folder, command, rrd=rrd)
        else:
            rows = []
            for number, (value, each) in enumerate(zip(varied, sets, strict=True)):
                before = f"{number + 1} of {len(sets)}, "
                found = _respond(walk.scenario, each, options, report, before)
                rows.append({key: str(value)} | in_brief(found))
            _save_varied(folder, command, rows)
    if key:
        title = f"{described[0].name}: the wearer at values of {key}"
        print_table(title, list(rows[0]), [list(row.values()) for row in rows], whole_names=True)
        print(f"written to {folder}: walk.csv, walk.json")
    else:
        _print(found, folder, rrd=rrd)


def _read_varied(text: str | None) -> tuple[str, list[Any]]:
    """The key that is varied and its values; "" and one value where none is."""
    if text is None:
        return "", [None]
    key, _, values = text.partition("=")
    parts = [part.strip() for part in values.split(",") if part.strip()]
    if not key.strip() or not 0 < len(parts) <= _MOST:
        allowed = f'supply.pressure="2 bar,3 bar", at most {_MOST} values'
        raise InputError("is not KEY=V1,V2,…", field="--vary", value=text, allowed=allowed)
    return key.strip(), [read_sets([f"x={part}"])["x"] for part in parts]


def _respond(
    scenario: str, sets: dict[str, Any], options: dict[str, Any], report: Any, before: str = ""
) -> Any:
    from afo_sim.walker import CASES, respond

    def moved(case: str, share: float) -> None:
        report(round(100.0 * share), 100, f"{before}{CASES[case]}")

    return respond(scenario, sets, progress=moved, **options)


def _save(found: Any, folder: Path, command: dict[str, Any], *, rrd: bool) -> None:
    from afo_sim.show import write_pictures
    from afo_sim.walker import save

    save(found, folder, command=command, draw=functools.partial(write_pictures, rrd=rrd))


def _save_varied(folder: Path, command: dict[str, Any], rows: list[dict[str, str]]) -> None:
    """The table as walk.csv, beside what was asked."""
    from afo_sim.common import as_stored, check_writable, together, write_json
    from afo_sim.walker import FILES, JSON, TABLE

    rows = [{name: cell.replace("−", "-") for name, cell in row.items()} for row in rows]
    check_writable(folder)
    with together(folder, FILES) as scratch:
        with (scratch / TABLE).open("w", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows([rows[0], *(row.values() for row in rows)])
        write_json(scratch / JSON, as_stored({"command": command, "rows": rows}, folder))


def _print(found: Any, folder: Path, *, rrd: bool) -> None:
    from afo_sim.walker import table, verdict

    header, rows = table(found)
    print_table(f"{found.scenario.name}: a walker that responds", header, rows, whole_names=True)
    for line in _verdict_lines(verdict(found)):
        print_line(line)
    view = f"; to view: afo-sim view {folder}/walk.rrd" if rrd else ""
    print(f"written to {folder}: walk.html, walk.png, walk.gif, walk.json{view}")


def _verdict_lines(replies: Any) -> Iterator[str]:
    for reply in replies:
        yield f"{reply.question} {reply.text}"
    for each in dict.fromkeys(text for reply in replies for text in reply.assumptions):
        yield f"assumed: {each}"
