"""Answers from a process of its own, which may hang, grow or crash: the studio goes on with another one."""

import asyncio
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from afo_sim.common import Child, ChildEnded, InputError, JsonDict, JsonMapping
from afo_sim.studio.design import Design, session_folder

_OBEYS = 20.0  # in which an answer that is no longer wanted is given up, once there was a whole one [s]
_SILENT = 300.0  # without a sign of life: kernels may be compiled meanwhile [s]
_LIMITS = {"AS": 16 << 30, "CORE": 0}  # memory of a child, and of its dump [B]


@dataclass(frozen=True)
class Wish:
    """A design to answer; `what` is wanted beyond what every design gets, "" nothing."""

    serial: int
    design: Design
    what: str = ""
    options: JsonMapping = field(default_factory=dict)
    variants: Mapping[str, Design] = field(default_factory=dict)


class Engine:
    """Has the newest wish answered, and tells each answer with the design's serial number."""

    def __init__(self, tell: Callable[[JsonDict], None]) -> None:
        self.folder, self._tell = session_folder(), tell  # for files of this session
        self._wanted, self._reading = asyncio.Event(), asyncio.Lock()
        self._newest = self._sent = self._begun = 0  # numbers of wishes
        self._start()  # while others are read

    def _start(self) -> None:
        self.child = Child("afo_sim.studio.stages:serve", _LIMITS)
        self._ended = self._heard = self._busy = False
        self._patience = _SILENT

    def want(self, wish: Wish) -> None:
        """Answer this from now on, and nothing else."""
        self._wish, self._newest = wish, self._newest + 1
        self._wanted.set()
        self._send()

    async def run(self) -> None:
        """Hear the answers, to the end of the studio."""
        while await self._wanted.wait():
            if self._ended:
                self._start()
            try:
                number, message = await asyncio.to_thread(self.child.receive, _SILENT if self._busy else None)
            except ChildEnded as error:
                self._lost(error)
                continue
            self._begun = max(self._begun, number)
            self._heard, self._busy = True, message is not None
            self._send()
            if message and number == self._newest:
                self._patience = _OBEYS if message["kind"] == "run" else self._patience
                self._tell({"serial": self._wish.serial, **message})

    async def read_trial(self, *trial: object) -> JsonDict:
        """What `imported` finds in files, by a process for one trial at a time."""
        async with self._reading:
            child = Child("afo_sim.studio.trial:serve", _LIMITS)
            try:
                child.send((*trial, self.folder))
                found: JsonDict | Exception = await asyncio.to_thread(child.receive, _SILENT)
            except ChildEnded as error:
                raise InputError(f"cannot be read: the program for it {error}", field="trial") from None
            finally:
                child.close()
        if isinstance(found, Exception):
            raise found
        return found

    def _send(self) -> None:
        """Send the newest wish when the one before it is begun: only so much waits for a child that hangs."""
        if self._heard and self._begun == self._sent != self._newest:
            self._sent = self._newest
            loop, wish = asyncio.get_running_loop(), (self._sent, self.folder, self._wish)
            loop.run_in_executor(None, self.child.send, wish)
            loop.call_later(self._patience, self._unless_begun, self.child, self._sent)

    def _unless_begun(self, child: Child, number: int) -> None:
        if self.child is child and self._begun < number:
            child.close()

    def _lost(self, error: ChildEnded) -> None:
        """Go on with another child: at once if a wish waits, and else when the next one comes."""
        if not self._heard or self._begun == self._newest:
            if self._busy or not self._heard:
                text = f"the answer {error}; change a value to go on"
                self._tell({"serial": self._wish.serial, "kind": "problem", "text": text})
            self._begun = self._newest
            self._wanted.clear()
        self._ended, self._heard, self._sent = True, False, self._begun


def compared(slot: str, told: Mapping[str, JsonDict]) -> JsonDict:
    """What a variant in a slot is compared by, of the answers of its design by their kinds."""
    found: JsonDict = {"kind": "variant", "slot": slot, "values": told["state"]["values"]}
    if "run" not in told:
        return found | {"problem": told["problem"]["text"]}
    return found | {"curves": told["settled"]["curves"], "results": told["run"]["results"]}
