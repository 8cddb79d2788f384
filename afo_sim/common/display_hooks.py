"""What results look like, in a terminal and in a notebook, and the registration of what the rooms above draw.

A computed result does not know how it is drawn, nor how it is written for another program. `Any` here is a
result, a value in one, or what draws it: their types stand in rooms above.
"""

import functools
import itertools
import math
import reprlib
import threading
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Self, TypeVar

from afo_sim.common.errors import no_attribute

ROOM = 4500  # bytes of the texts that show one result
K = TypeVar("K")
V = TypeVar("V")
_shows: list[Any] = []


def show_with(show: Any) -> None:
    """Register what draws and writes results from now on: an object with the methods of `afo_sim._Show`."""
    _shows[:] = [show]


def shown() -> Any:
    """What is registered to draw and write results; the package registers its own when it is imported."""
    return _shows[0]


class Shown:
    """A result with a short text, which a notebook shows with its picture; a dataclass has repr=False."""

    def __repr__(self) -> str:
        return called(self, vars(self))

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            try:
                return super().__getattr__(name)  # of pydantic
            except AttributeError:
                raise no_attribute(self, name) from None

    def _repr_html_(self) -> str | None:  # asked for by Jupyter
        found: str | None = shown().html(self)
        return found


class Brief(dict[K, V]):
    """A dict that shows a line for each of its first items; `dict(it)` shows all."""

    def __repr__(self) -> str:
        lines = [f"{key}: {_SHORT.repr(value)}" for key, value in self.items()]
        kept = sum(size < ROOM for size in itertools.accumulate(len(line.encode()) + 1 for line in lines))
        left = [f"… and {len(lines) - kept} more of {len(lines)}"] if kept < len(lines) else []
        return "\n".join([*lines[:kept], *left]) or "{}"


class Lazy(Brief[K, V]):
    """A dict of which some is known; parts are computed, each once, until what is asked for is there."""

    def __init__(self, known: Mapping[K, V], *parts: Callable[[], Mapping[K, V]]):
        super().__init__(known)
        self._parts, self._lock = list(parts), threading.RLock()

    @property
    def known(self) -> dict[K, V]:
        """What is there already."""
        return dict(zip(dict.keys(self), dict.values(self), strict=True))

    def whole(self, until: Any = None) -> Self:
        """All of it, or as many parts as it takes for a key to be there."""
        with self._lock:
            while self._parts and (until is None or not dict.__contains__(self, until)):
                dict.update(self, self._parts[0]())
                del self._parts[0]
        return self

    def __missing__(self, key: K) -> V:
        if key in self:
            return dict.__getitem__(self, key)
        raise KeyError(key)

    def __contains__(self, key: object) -> bool:
        return dict.__contains__(self, key) or dict.__contains__(self.whole(key), key)

    def get(self, key: K, default: Any = None) -> Any:
        """As of a dict."""
        return dict.get(self if key in self else {}, key, default)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (dict(self),)


def _of_whole(own: Callable[..., Any]) -> Callable[..., Any]:
    def method(self: Lazy[Any, Any], *given: Any) -> Any:
        return own(self.whole(), *(each.whole() if isinstance(each, Lazy) else each for each in given))

    return functools.wraps(own)(method)


for _name in (
    *("__iter__", "__len__", "__reversed__", "__eq__", "__ne__", "__or__", "__ror__", "__ior__"),
    *("__setitem__", "__delitem__", "keys", "values", "items", "copy", "pop", "popitem", "setdefault"),
    *("update", "clear"),
):
    setattr(Lazy, _name, _of_whole(getattr(dict, _name)))


class _Short(reprlib.Repr):
    """Values in a few words: of an array shape and range, of a collection the first items."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlevel, self.maxdict, self.maxlist, self.maxtuple = 2, 4, 4, 4
        self.maxstring = self.maxother = 90

    def repr1(self, value: Any, level: int) -> str:
        if isinstance(value, dict):
            return self.repr_dict(value, level)
        return super().repr1(value, level)

    def repr_ndarray(self, value: Any, level: int) -> str:
        known = value[abs(value) < math.inf] if value.dtype.kind in "fiu" else value[:0]  # no NaN
        span = f" from {known.min():.3g} to {known.max():.3g}" if known.size else ""
        return f"<{' × '.join(map(str, value.shape))}{span}>"


_SHORT = _Short()


def called(thing: object, parts: Mapping[str, Any]) -> str:
    """A thing's class with its public parts, each in a few words."""
    named = (f"{name}={_SHORT.repr(value)}" for name, value in parts.items() if name[0] != "_")
    return f"{type(thing).__name__}({', '.join(named)})"
