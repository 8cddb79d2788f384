"""Answers to the newest design, in a thread of its own: what is no longer wanted is given up."""

import functools
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from afo_sim.common import InputError, JsonDict, JsonMapping, SimulationError
from afo_sim.studio.answers import Answers
from afo_sim.studio.design import Design, session_folder

_STILL, _IDLE = 0.12, 0.4  # from the last change to what takes longer, and to what takes long [s]


class _Superseded(Exception):
    """A newer design, or another wish, has come."""


@dataclass(frozen=True)
class Wish:
    """A design to answer; `what` is wanted beyond what every design gets, "" nothing."""

    serial: int
    design: Design
    what: str = ""
    options: JsonMapping = field(default_factory=dict)
    variants: Mapping[str, Design] = field(default_factory=dict)


class Engine:
    """Answers the newest wish, stage by stage, and tells each answer with the design's serial number."""

    def __init__(self, tell: Callable[[JsonDict], None]) -> None:
        self.folder = session_folder()
        self._tell, self._answers = tell, Answers(self.folder)
        self._wish: Wish | None = None
        self._changed, self._ended = threading.Condition(), False
        self._told: tuple[int, set[str]] = (0, set())  # a serial number, and the stages that are answered
        self._thread = threading.Thread(target=self._work, name="studio", daemon=True)
        self._thread.start()

    def want(self, wish: Wish) -> None:
        """Answer this from now on, and nothing else."""
        with self._changed:
            self._wish = wish
            self._changed.notify()

    def close(self) -> None:
        """End the thread."""
        with self._changed:
            self._ended = True
            self._changed.notify()
        self._thread.join(timeout=10.0)

    def _work(self) -> None:
        while True:
            with self._changed:
                while self._wish is None and not self._ended:
                    self._changed.wait()
                if self._ended:
                    return
                wish, self._wish = self._wish, None
            assert wish is not None
            try:
                self._answer(wish)
            except _Superseded:
                pass
            except Exception as error:  # a fault of ours must not end the thread that answers
                text = f"this design met a fault of the program: {type(error).__name__}: {error}"
                self._say(wish, {"kind": "problem", "text": text})

    def _answer(self, wish: Wish) -> None:
        if self._told[0] != wish.serial:
            self._told = wish.serial, set()
        for name, stage in self._stages(wish):
            if name not in self._told[1]:
                try:
                    for message in stage():
                        self._say(wish, message)
                        self._check()
                except (InputError, SimulationError) as error:  # controls are shown all the same
                    self._say(wish, {"kind": "problem", "text": str(error)})
                    if name != "settled":
                        return
                self._told[1].add(name)

    def _stages(self, wish: Wish) -> Iterator[tuple[str, Callable[[], Iterable[JsonDict]]]]:
        """What is told of a design, the quickest first; what is told already is left out."""
        answers, design = self._answers, wish.design

        def report(done: int, total: int, what: str = "") -> None:  # and give up what is no longer wanted
            self._check()
            if wish.what and wish.what not in self._told[1]:
                share = done / total if total else 0.0
                self._say(wish, {"kind": "progress", "what": what or wish.what, "share": share})

        yield "settled", lambda: [answers.settled(design)]
        self._rest(_STILL)  # while somebody drags, nothing but the settled stride is answered
        yield "state", lambda: [answers.state(design)]
        yield "reference", lambda: answers.reference(design)
        yield "run", lambda: answers.run(design, report)
        for slot, kept in wish.variants.items():
            yield f"variant {slot}", functools.partial(answers.variant, slot, kept, report)
        if wish.what:
            self._told[1].discard(wish.what)
            yield wish.what, lambda: answers.further(design, wish.what, wish.options, report)
        if "effects" not in self._told[1]:
            self._rest(_IDLE)
        yield "effects", lambda: [answers.effects(design, report)]

    def _rest(self, seconds: float) -> None:
        """Wait for a newer design, and go on if there is none."""
        with self._changed:
            self._changed.wait_for(lambda: self._wish is not None or self._ended, seconds)
        self._check()

    def _check(self) -> None:
        if self._wish is not None or self._ended:
            raise _Superseded

    def _say(self, wish: Wish, message: JsonDict) -> None:
        if self._wish is None:
            self._tell({"serial": wish.serial, **message})
