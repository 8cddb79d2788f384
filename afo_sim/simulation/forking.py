"""What can be forked: its state is a value, and its copies and pickles go on with the same bits."""

import copy
import types
from dataclasses import dataclass
from operator import attrgetter
from typing import Self

from afo_sim import native
from afo_sim.common import Function, InputError, Mixed


@dataclass(frozen=True, eq=False, slots=True)
class State:
    """A moment of what is stepped: whose it is, and all that decides what follows. It never changes."""

    of: tuple[object, ...]  # whose it is
    values: tuple[object, ...]  # all that decides what follows


class Forkable:
    """What is made again, by a function and its arguments, and then brought to a state."""

    _of: tuple[object, ...]  # what two of them must agree in
    _memory: tuple[str, ...]  # dotted names of what decides all that follows
    _hold: native.Hold

    def _like(self) -> tuple[Function, tuple[object, ...]]:
        raise NotImplementedError

    def state(self) -> State:
        """The present state, for `restore`; InputError where a controller cannot be copied."""
        self._hold.still("controller")
        return State((type(self), *self._of), tuple(map(_kept, attrgetter(*self._memory)(self))))

    def restore(self, state: State) -> None:
        """Go to a state of this one or of its like; InputError where it is none."""
        self._hold.still()
        if not isinstance(state, State) or state.of != (type(self), *self._of):
            allowed = "what state() of one with the same arguments gave"
            raise InputError("is not a state of this", field="state", allowed=allowed)
        for name, value in zip(self._memory, state.values, strict=True):
            owner, _, own = name.rpartition(".")
            setattr(attrgetter(owner)(self) if owner else self, own, _kept(value))

    def copy(self) -> Self:
        """One of its own in the same state; nothing is shared that changes. `close` both."""
        state, (make, arguments) = self.state(), self._like()
        made: Self = make(*arguments)
        made.restore(state)
        return made

    __copy__ = copy

    def __deepcopy__(self, memo: dict[int, object]) -> Self:
        return self.copy()

    def __reduce__(self) -> tuple[object, ...]:
        return *self._like(), self.state()

    __setstate__ = restore


def _kept(value: Mixed) -> Mixed:
    """A copy of its own; tuples, also those in a list, never change and are shared."""
    if type(value) is tuple or (type(value) is list and value and type(value[0]) is tuple):
        return value[:]
    allowed = "an object that copy.deepcopy copies, or a function without variables of another one"
    inner = isinstance(value, types.FunctionType) and value.__closure__
    if inner or isinstance(value, types.BuiltinFunctionType):  # deepcopy would share what they remember
        raise InputError("cannot be copied", field="controller", value=value, allowed=allowed)
    try:
        return copy.deepcopy(value)
    except Exception as error:  # whatever a user's own object raises where it is copied
        raise InputError(f"cannot be copied: {error}", field="controller", allowed=allowed) from error
