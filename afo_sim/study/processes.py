"""Processes of this machine that compute cases beside this one, where its threads wait for each other."""

import itertools
import queue
import threading
import time
import warnings
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Self

from afo_sim.common import (
    Child,
    ChildEnded,
    Function,
    InputError,
    JsonMapping,
    Mixed,
    Notice,
    code_fingerprint,
    packed,
    take,
)
from afo_sim.simulation import EVERYTHING, Asked, References
from afo_sim.study import engine
from afo_sim.study.engine import Numbered

PATIENCE = 1.0  # of computing before processes are started; one takes about as long to be ready [s]
_PORTION = 6  # cases handed over at a time: of fewer each costs more, of more somebody is idle at the end
_AHEAD = 2  # portions that a process has, so that it does not wait for the next
_DEATHS = 3  # of processes, one after another, until the case that they compute is given up
_CODE = code_fingerprint()  # now, with the import: a file that is edited later is not the code that runs

# scenario, cases, what is asked for, what the user has registered
Job = tuple[JsonMapping, list[tuple[int, JsonMapping]], Asked, bytes]
Queue = queue.SimpleQueue[Mixed]


def serve(receive: Function, send: Function) -> None:
    """Compute jobs as a child."""
    found: Mixed = _CODE
    last: Mixed = None
    while True:
        send(found)
        scenario, cases, asked, added = receive()
        if scenario != last:
            last, references = scenario, References()
        try:
            take(added)
            found = list(engine.outcomes(scenario, cases, 1, len(cases), asked, references))
        except Exception as error:  # which the parent raises
            found = error


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
        children, self.children, self.count = self.children, [], 0
        for child in children:
            self.jobs.put(None)
            child.close()

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
            self.children.append(Child(f"{__name__}:serve"))
            given = self.children, len(self.children) - 1
            threading.Thread(target=self._feed, args=given, daemon=True).start()
        waited_for, given_up = 0, dict[int, str]()  # cases
        portion, added = 1 if asked.walkers else _PORTION, packed()  # those of walkers take seconds each

        def own() -> Iterator[tuple[int, JsonMapping]]:
            nonlocal waited_for
            while True:
                room = self.count + 1
                while self.jobs.qsize() < room and (some := list(itertools.islice(cases, portion))):
                    self.jobs.put((scenario, some, asked, added))
                    waited_for += len(some)
                try:
                    job: Job = self.jobs.get_nowait()
                except queue.Empty:
                    return
                waited_for -= len(job[1])
                yield from job[1]

        def answered() -> Iterator[Numbered]:
            nonlocal waited_for
            found = self.answers.get()
            if isinstance(found, Exception):
                raise found
            if isinstance(found, Notice):
                warnings.warn(found, stacklevel=2)
                return
            waited_for -= len(found)
            if isinstance(found, dict):
                given_up.update(found)
            else:
                yield from found

        for numbered in engine.outcomes(scenario, own(), 1, _PORTION, asked):
            yield numbered
            while not self.answers.empty():
                yield from answered()
        while waited_for:
            yield from answered()
        for number, how in given_up.items():
            problem = f"case {number} was given up: each of {_DEATHS} processes that computed it {how}"
            allowed = "fewer threads, or run the same command again; computed cases are kept"
            raise InputError(problem, allowed=allowed)

    def _feed(self, children: list[Child], k: int) -> None:
        """Hand jobs over and take outcomes, by another child if one ends; not where its code is another."""
        held: deque[Job] = deque()  # without outcomes; the first is being computed
        deaths = 0  # since there were outcomes
        while True:
            said, given = None, 0
            try:
                said = children[k].receive()
                while said == _CODE:
                    while given < _AHEAD:
                        if given == len(held):
                            try:
                                job = self.jobs.get(block=not held)
                            except queue.Empty:
                                break
                            if job is None:
                                return
                            held.append(job)
                        children[k].send(held[given])
                        given += 1
                    self.answers.put(children[k].receive())
                    held.popleft()
                    given, deaths = given - 1, 0
                raise ChildEnded("is of other code")
            except ChildEnded as error:
                if not (held and self.count):
                    return
                how = str(error)
            except Exception as error:  # of a job that cannot be sent: the parent raises it
                return self.answers.put(error)
            deaths = (deaths + 1) % _DEATHS
            scenario, cases, asked, added = held.popleft()
            if deaths:  # one by one, so that only the case to blame is given up
                held.extendleft((scenario, [case], asked, added) for case in reversed(cases))
                text = "process {pid} {how}; another one computes its cases again"
                self.answers.put(Notice("process-ended", text, pid=children[k].process.pid, how=how))
            else:
                self.answers.put({number: how for number, _ in cases})
            with suppress(OSError):  # it cannot be started: the old one says again that it has ended
                children[k] = Child(f"{__name__}:serve")
            if not self.count:  # ended meanwhile
                children[k].close()
