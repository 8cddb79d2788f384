"""The stages in which a wish is answered, the quickest first; what is no longer wanted is given up."""

import functools
import queue
import time
from collections.abc import Callable, Iterable, Iterator

from afo_sim.common import Function, InputError, JsonDict, SimulationError
from afo_sim.studio.answers import Answers
from afo_sim.studio.engine import Wish

_SIGN = 0.1  # between two signs of how far it is [s]
_STILL, _IDLE = 0.12, 0.4  # from the last change to what takes longer, and to what takes long [s]


class _Superseded(Exception):
    """A newer design, or another wish, has come."""


def serve(receive: Function, send: Function) -> None:
    """The life of the process that answers: wishes come with their numbers, and answers go with them."""
    send((0, None))  # wishes are of classes that are imported now
    stages = Stages(receive, send)
    while True:
        stages.answer()


class Stages:
    """What is told of the newest wish: None at its end, and an empty answer as a sign of life."""

    def __init__(self, receive: Function, send: Function) -> None:
        self._receive, self._send = receive, send
        self._newer = receive()
        self._answers = Answers(self._newer[1])
        self._told: tuple[int, set[str]] = (0, set())  # a serial number, and the stages that are answered

    def answer(self) -> None:
        """Answer the newest wish, or as much of it as is wanted."""
        (self._number, _, wish), self._newer = self._newer or self._receive(), None
        self._say({})
        try:
            self._answer(wish)
        except _Superseded:
            return
        except Exception as error:  # a fault of ours must not end what answers
            text = f"this design met a fault of the program: {type(error).__name__}: {error}"
            self._say({"kind": "problem", "text": text})
        self._say(None)

    def _answer(self, wish: Wish) -> None:
        if self._told[0] != wish.serial:
            self._told = wish.serial, set()
        for name, stage in self._stages(wish):
            if name not in self._told[1]:
                try:
                    for message in stage():
                        self._say(message)
                        self._rest()
                except (InputError, SimulationError) as error:  # controls are shown all the same
                    self._say({"kind": "problem", "text": str(error)})
                    if name != "settled":
                        return
                self._told[1].add(name)

    def _stages(self, wish: Wish) -> Iterator[tuple[str, Callable[[], Iterable[JsonDict]]]]:
        """What is told of a design; what is told already is left out."""
        answers, design = self._answers, wish.design

        def report(done: int, total: int, what: str = "") -> None:  # and give up what is no longer wanted
            self._rest()
            share = done / total if total else 0.0
            wanted = wish.what and wish.what not in self._told[1]
            if time.monotonic() > self._still:
                self._say({"kind": "progress", "what": what or wish.what, "share": share} if wanted else {})

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

    def _rest(self, seconds: float = 0.0) -> None:
        """Wait for a newer wish, and go on if there is none."""
        try:
            self._newer = self._newer or self._receive(timeout=seconds)
        except queue.Empty:
            return
        raise _Superseded

    def _say(self, message: JsonDict | None) -> None:
        self._still = time.monotonic() + _SIGN
        self._send((self._number, message))
