"""What this room had once: each name is refused by what to use instead."""

from collections.abc import Callable
from typing import NoReturn

from afo_sim.common import InputError

ENTITY = "afo_sim.attach, which puts an orthosis on any MuJoCo model or MjSpec"


def refusing(instead: str) -> Callable[[str], NoReturn]:
    """A module's `__getattr__` that refuses every name."""

    def refuse(name: str) -> NoReturn:
        if name.startswith("__"):
            raise AttributeError(name)
        raise InputError("is retired", field=name, allowed=instead)

    return refuse
