"""Older name of `afo_sim.rl.environments`; importing registers the tasks in Gymnasium."""

import importlib

from afo_sim.common import Mixed, older

_now = older("environments")


def __getattr__(name: str) -> Mixed:
    if name.startswith("__"):
        raise AttributeError(name)
    return getattr(_now, name, None) or importlib.import_module(f"{_now.__name__}.{name}")
