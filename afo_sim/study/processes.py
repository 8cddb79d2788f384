"""Processes of this machine that compute cases beside this one, where its threads wait for each other."""

import itertools
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Self

from afo_sim.common import InputError, JsonMapping, Mixed, child_environment, code_fingerprint, packed, take
from afo_sim.common.versions import PACKAGE
from afo_sim.simulation import EVERYTHING, Asked, References
from afo_sim.study import engine
from afo_sim.study.engine import Numbered

PATIENCE = 1.0  # of computing before processes are started; one takes about as long to be ready [s]
_PORTION = 6  # cases handed over at a time: of fewer each costs more, of more somebody is idle at the end
_AHEAD = 2  # portions that a process has, so that it does not wait for the next
_SERVE = f"""
import importlib.util as u, sys
found = u.spec_from_file_location("afo_sim", {str(PACKAGE / "__init__.py")!r})
sys.modules["afo_sim"] = u.module_from_spec(found)
found.loader.exec_module(sys.modules["afo_sim"])
from afo_sim.study.processes import serve
serve()
"""  # of this package, wherever another one of its name lies
_CODE = code_fingerprint()  # now, with the import: a file that is edited later is not the code that runs

# scenario, cases, what is asked for, what the user has registered
Job = tuple[JsonMapping, list[tuple[int, JsonMapping]], Asked, bytes]
Queue = queue.SimpleQueue[Mixed]


class Child:
    """A process that computes jobs; it ends when this process does, however that ends."""

    def __init__(self, jobs: Queue, answers: Queue) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-c", _SERVE],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=child_environment(),
            start_new_session=True,  # Ctrl-C is this process's to answer
        )
        self._thread = threading.Thread(target=self._feed, args=(jobs, answers), daemon=True)
        self._thread.start()

    def _feed(self, jobs: Queue, answers: Queue) -> None:
        """Hand jobs over and take outcomes, or the error that ends all; not where its code is another."""
        assert self.process.stdin is not None and self.process.stdout is not None
        said, given = None, 0
        try:
            said = pickle.load(self.process.stdout)
            while said == _CODE:
                while given < _AHEAD:
                    try:
                        job = jobs.get(block=given == 0)
                    except queue.Empty:
                        break
                    if job is None:
                        return
                    pickle.dump(job, self.process.stdin, pickle.HIGHEST_PROTOCOL)
                    self.process.stdin.flush()
                    given += 1
                answers.put(pickle.load(self.process.stdout))
                given -= 1
        except Exception:  # whatever a pickle that ends too early raises
            if said == _CODE:
                problem = f"a process was killed (exit code {self.process.wait()}; out of memory?)"
                allowed = "fewer processes, or run the same command again; computed cases are kept"
                answers.put(InputError(problem, field="threads", allowed=allowed))

    def close(self) -> None:
        """End the process."""
        self.process.kill()
        self._thread.join()
        self.process.communicate()


def serve() -> None:
    """Compute jobs that come by standard input, until it is closed: the whole life of a child."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what anybody prints is no answer
    jobs: Queue = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(jobs,), daemon=True).start()
    found: Mixed = _CODE
    last: Mixed = None
    while True:
        pickle.dump(found, out, pickle.HIGHEST_PROTOCOL)
        out.flush()
        scenario, cases, asked, added = jobs.get()
        if scenario != last:
            last, references = scenario, References()
        try:
            take(added)
            found = list(engine.outcomes(scenario, cases, 1, len(cases), asked, references))
        except Exception as error:  # which the parent raises
            found = error


def _listen(jobs: Queue) -> None:
    """Take what the parent sends; end this process at once when that one has ended."""
    try:
        while True:
            jobs.put(pickle.load(sys.stdin.buffer))
    finally:
        os._exit(0)


@dataclass
class Processes:
    """So many processes beside this one, started once work has taken its time, and ended with the block."""

    count: int
    patience: float = PATIENCE
    spent: float = 0.0
    children: list[Child] = field(default_factory=list)
    jobs: Queue = field(default_factory=queue.SimpleQueue)
    answers: Queue = field(default_factory=queue.SimpleQueue)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """End them; whoever waits for a job gets none."""
        for each in [None] * len(self.children):
            self.jobs.put(each)
        while self.children:
            self.children.pop().close()
        self.count = 0

    def outcomes(
        self, scenario: JsonMapping, cases: Iterable[tuple[int, JsonMapping]], threads: int = 1,
        chunk: int = 32, asked: Asked = EVERYTHING,
    ) -> Iterator[Numbered]:  # fmt: skip
        """As `engine.outcomes`: by this process's threads at first, then by all, if as much is left to do."""
        cases = iter(cases)
        few = self._at_first(cases) if self.count else cases
        done = 0
        for numbered in engine.outcomes(scenario, few, threads, chunk, asked):
            done += 1
            yield numbered
        rest = list(itertools.islice(cases, max(done, 1)))
        if len(rest) < done and not self.children:
            yield from engine.outcomes(scenario, rest, threads, chunk, asked)
        elif rest:
            try:
                yield from self._shared(scenario, itertools.chain(rest, cases), asked)
            except BaseException:  # some are at work on what nobody waits for
                self.__exit__()
                raise

    def _at_first(self, cases: Iterator[Mixed]) -> Iterator[Mixed]:
        before, begun = self.spent, time.monotonic()
        while self.spent < self.patience and (case := next(cases, None)) is not None:
            yield case
            self.spent = before + time.monotonic() - begun

    def _shared(self, scenario: JsonMapping, cases: Iterator[Mixed], asked: Asked) -> Iterator[Numbered]:
        """Cases by all processes, this one too: each takes the next when it has room for it."""
        while len(self.children) < self.count:
            self.children.append(Child(self.jobs, self.answers))
        waited_for = 0  # jobs
        portion, added = 1 if asked.walkers else _PORTION, packed()  # those of walkers take seconds each

        def own() -> Iterator[tuple[int, JsonMapping]]:
            nonlocal waited_for
            while True:
                room = self.count + 1
                while self.jobs.qsize() < room and (some := list(itertools.islice(cases, portion))):
                    self.jobs.put((scenario, some, asked, added))
                    waited_for += 1
                try:
                    job: Job = self.jobs.get_nowait()
                except queue.Empty:
                    return
                waited_for -= 1
                yield from job[1]

        for numbered in engine.outcomes(scenario, own(), 1, _PORTION, asked):
            yield numbered
            while not self.answers.empty():
                waited_for -= 1
                yield from _answer(self.answers.get())
        while waited_for:
            waited_for -= 1
            yield from _answer(self.answers.get())


def _answer(found: Mixed) -> list[Numbered]:
    if isinstance(found, Exception):
        raise found
    return list(found)
