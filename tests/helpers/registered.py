"""A block after which what was registered in it is forgotten."""

from collections.abc import Iterator
from contextlib import contextmanager

from afo_sim.common import extending
from afo_sim.physics import FRICTIONS, LAWS


@contextmanager
def forgotten() -> Iterator[None]:
    tables, added = [(table, dict(table)) for table in (LAWS, FRICTIONS)], list(extending.ADDED)
    try:
        yield
    finally:
        for table, before in tables:
            table.clear()
            table.update(before)
        extending.ADDED[:] = added
