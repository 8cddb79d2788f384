"""Commands over many cases: sweep, replay, optimise."""

import re
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

from typer import Argument, Option

from afo_sim.cli import common
from afo_sim.cli.common import print_line as print
from afo_sim.cli.overwriting import check_folder, take
from afo_sim.common import InputError, Keywords

if TYPE_CHECKING:
    from afo_sim.study import Opened, Store, SweepProgress
    from afo_sim.study.folder import Changed


@dataclass(frozen=True)
class _Sweep:
    """Options of `sweep`: which cases, and who computes them."""

    source: Annotated[str, Argument(metavar="[SWEEP]", help="name of a shipped sweep, or a TOML file")] = ""
    out: Annotated[Path | None, Option(help="output folder; runs/<sweep>, with --show DIR/figures")] = None
    threads: common.Threads = 0
    workers: common.Workers = 0
    scheduler: common.Scheduler = ""
    part: Annotated[str, Option(help="K/N: compute only the K-th of N parts, for a job array")] = "1/1"
    if_changed: Annotated[str, Option(help="if file or code changed: refuse, restart or continue")] = "refuse"
    plain: common.Plain = False
    dry_run: Annotated[bool, Option("--dry-run", help="only report cases, time and disk space")] = False
    yes_many: Annotated[bool, Option("--yes-many", help="allow more than ten million cases")] = False
    show: Annotated[Path | None, Option(help="folder of a sweep: print its tables, draw its figures")] = None
    metric: Annotated[list[str] | None, Option(help="with --show: NAME or NAME:lowest|highest")] = None
    best: Annotated[int, Option(help="with --show: number of best cases")] = 5


@common.app.command()
@common.one_group
def sweep(given: _Sweep) -> None:
    """Compute many cases of one scenario. Run it again to continue an interrupted sweep."""
    if given.show is not None:
        show_folder(given.show, given.out, given.metric or [], given.best)
        return
    if not given.source:
        raise InputError("is missing", field="SWEEP", allowed="a sweep file, or --show DIR")
    common.check_changed(given.if_changed, given.dry_run)
    common.check_counts(given.threads, given.workers)
    found = re.fullmatch(r"(\d+)/(\d+)", given.part)
    if found is None or not 1 <= int(found[1]) <= int(found[2]):
        allowed = "K/N with 1 ≤ K ≤ N, such as 3/20"
        raise InputError("is not a valid part", field="--part", value=given.part, allowed=allowed)
    which = int(found[1]), int(found[2])
    with common.progress("reading the files, compiling the muscles") as report:
        from afo_sim.show import unseen
        from afo_sim.simulation import occupy
        from afo_sim.study import SWEEP, design, left, pool, runner, sweep_plan, time_step

        plan = sweep_plan.read(given.source)
        plan = plan.walked() if given.plain else plan
        folder = given.out or Path("runs") / plan.file.stem
        occupy(folder)  # beside other processes of the same sweep
        cases = design.cases_of(plan, sys.maxsize if given.yes_many else design.MOST)
        store = runner.open_store(plan, cases, folder, cast("Changed", given.if_changed))
        threads = given.threads or pool.processors()
        workload = runner.estimate(store, given.workers or (1 if given.scheduler else threads), which)
        done = f", {workload.done} of them done" if workload.done else ""
        dropped = f" ({workload.dropped} outside the constraints)" if workload.dropped else ""
        takes = "" if workload.done == workload.cases else f"; about {common.duration(workload.seconds)}"
        takes += " by one worker" if takes and given.scheduler else ""
        print(f"{workload.cases} cases{dropped}{done}{takes}; about {workload.bytes / 1e6:.3g} MB of results")
        for note in plan.notes:
            print(f"note: {note}")
        if given.dry_run:
            return
        begun = time.monotonic()
        on: Keywords = {"threads": threads, "workers": given.workers, "scheduler": given.scheduler}
        try:
            state = runner.run(store, part=which, report=reporter(report), **on)
        except KeyboardInterrupt:
            print("afo-sim: stopped; run the same command to continue", file=sys.stderr)
            sys.exit(130)
        took = time.monotonic() - begun
        _keep_recordings(store)
    speed = f" in {common.duration(took)} ({state.new / took:.3g} a second)" if state.new else ""
    failed = f", {state.failed} of them failed (see --show)" if state.failed else ""
    of = "" if given.part == "1/1" else f" of part {given.part}"
    rest = "" if store.finished else f", {left(store)} of the sweep are left"
    done = f"{state.done} of {state.cases}{of} are done{rest}"
    print(f"{state.new} cases computed{speed}{failed}; {done}: {store.folder}")
    if of_step := time_step.remark(folder):
        print(of_step)
    for line in unseen(SWEEP.read(folder)["scenario"], store.metrics):
        print(line)


def _keep_recordings(store: "Store") -> None:
    """Write the recordings that a finished sweep is to keep and has not kept yet."""
    from afo_sim.simulation import RERUN
    from afo_sim.study import replay as replaying

    for case in store.cases.plan.keep if store.finished else ():
        target = replaying.recording_folder(store.folder, case)
        if (target / RERUN).is_file():
            continue
        try:
            replaying.replay(store.folder, case).recording.save(target)
        except (InputError, OSError) as error:  # the results are there, and the same command tries again
            print(f"afo-sim: case {case} is not kept: {error}", file=sys.stderr)


def show_folder(folder: Path, out: Path | None, metrics: list[str], best: int) -> None:
    """Print the results of a sweep, and write its figures."""
    with common.progress("reading"):
        from afo_sim.show import FIGURES, tables
        from afo_sim.show.sweep_figures import write_figures
        from afo_sim.study import chosen, read
        from afo_sim.study.findings import findings

        results = read(folder)
        found = findings(results, chosen(results, metrics))
    common.print_tables(tables(found, best))
    for remark in found.remarks:
        print(remark)
    target = out or folder / FIGURES
    with common.progress("drawing"):
        paths = write_figures(found, target)
    print(f"figures in {target}: {', '.join(path.name for path in paths) or 'none'}")


@common.app.command()
def replay(
    folder: Annotated[Path, Argument(metavar="DIR", help="folder of a sweep")],
    case: Annotated[int, Argument(help="number of the case")],
    out: Annotated[Path | None, Option(help="output folder; DIR/recordings/case_N by default")] = None,
    rrd: common.RecordingOption = None,
) -> None:
    """Run one case of a sweep again, with its full recording."""
    with common.progress("reading the files, compiling the muscles") as report:
        from afo_sim.study import replay as replaying

        target = out or replaying.recording_folder(folder, case)
        check_folder(target, "run")
        again = replaying.replay(folder, case, progress=report)
        again.recording.save(target, rrd=common.drawn(rrd))
    if again.different:
        rows = [[name, f"{row!r}", f"{now!r}"] for name, (row, now) in again.different.items()]
        common.print_table("not as in the sweep's row", ["metric", "row", "now"], rows)
    if not again.same:
        print(f"case {case}: {again.status} in the sweep, now {again.recording.status}: {target}")
        print("afo-sim: another processor, other code or other libraries", file=sys.stderr)
        sys.exit(1)
    verdict = "every metric is its row's, to the last bit" if again.recording.ok else again.recording.status
    print(f"case {case}: {verdict}: {target}")


def reporter(show: Callable[..., None]) -> Callable[["SweepProgress"], None]:
    """Rate, failures and time left."""
    begun = time.monotonic()

    def report(state: "SweepProgress") -> None:
        failed = f", {state.failed} failed" if state.failed else ""
        rate = state.new / max(time.monotonic() - begun, 1e-9)
        left = f", {common.duration((state.cases - state.done) / rate)} left" if rate > 0.0 else ""
        line = f"{state.done} of {state.cases} cases{failed}; {rate:.3g} per second{left}"
        show(state.done, state.cases, line)

    return report


@common.app.command()
def optimise(
    source: Annotated[str, Argument(metavar="SEARCH", help="name of a shipped search, or a TOML file")],
    out: Annotated[Path | None, Option(help="output folder; runs/<search> by default")] = None,
    threads: common.Threads = 0,
    workers: common.Workers = 0,
    scheduler: common.Scheduler = "",
    if_changed: Annotated[
        str, Option(help="if file or code changed: refuse, restart or continue")
    ] = "refuse",
    plain: common.Plain = False,
    dry_run: Annotated[bool, Option("--dry-run", help="only report cases, time and disk space")] = False,
) -> None:
    """Search for the best design within limits. Run it again to continue an interrupted search."""
    common.check_changed(if_changed, dry_run)
    common.check_counts(threads, workers)
    with common.progress("reading the files, compiling the muscles") as report:
        from afo_sim.show import draw_search, unseen
        from afo_sim.study import processors, statement, tables
        from afo_sim.study.pool import pool
        from afo_sim.study.search import plan, runner, store

        search = plan.read(source)
        search = search.walked() if plain else search
        folder = out or Path("runs") / search.file.stem
        take(folder)
        opened = runner.open_search(search, folder, cast("Changed", if_changed))
        threads = threads or processors()
        print(_plan_text(opened, workers or (1 if scheduler else threads)))
        if dry_run:
            return
        with pool(threads, workers, scheduler) as who:
            best = runner.run(opened, who, report)
        figure = folder / store.FIGURE
        if not opened.finished or not figure.is_file():
            draw_search(opened.problem, opened.units, store.read_table(folder / store.DESIGNS), figure)
    common.print_tables(tables(best), statement(best))
    for line in unseen(opened.scenario, opened.problem.aim.metrics):
        print(line)
    print(f"written to {folder}; to run this design: afo-sim run {folder / 'best.toml'}")


def _plan_text(opened: "Opened", workers: int) -> str:
    if opened.finished:
        return "the search is already finished; nothing was computed"
    search, method = opened.search, opened.problem.method
    time = common.duration(opened.runs * opened.seconds / workers)
    starts = f"{search.starts} starts, each " if search.starts > 1 else ""
    each = f"up to {search.generations} generations by {method}: {opened.runs} runs; about {time} in all"
    whole = "" if method == search.method else f"\n{search.method} takes no whole numbers: {method} searches"
    return starts + each + whole
