"""Columns of a recording that are computed when they are first read: most are read by nobody."""

from collections.abc import Callable, Iterable, Iterator, Mapping

import numpy as np

Columns = Mapping[str, np.ndarray]


class Lazy(Columns):
    """Columns by name: `known` ones, and those of `names`, each computed once, when it is first read."""

    def __init__(self, names: Iterable[str], read: Callable[[str], np.ndarray], known: Columns | None = None):
        self._read = read
        self._found: dict[str, np.ndarray | None] = dict.fromkeys(names) | dict(known or {})

    def __getitem__(self, name: str) -> np.ndarray:
        found = self._found[name]
        if found is None:
            found = self._found[name] = self._read(name)
        return found

    def __contains__(self, name: object) -> bool:
        return name in self._found

    def __iter__(self) -> Iterator[str]:
        return iter(self._found)

    def __len__(self) -> int:
        return len(self._found)


def each(columns: Columns, part: Callable[[np.ndarray], np.ndarray]) -> Lazy:
    """The same part of all columns."""
    return Lazy(columns, lambda name: part(columns[name]))
