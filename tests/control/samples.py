"""Observations written by hand, for controllers without a simulation."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.control import Controller, make
from afo_sim.description import Scenario, load

MACHINE: dict[str, Any] = {
    "start": "swing",
    "state": {
        "swing": {"dorsiflexor": "inlet", "plantarflexor": "outlet"},
        "contact": {"dorsiflexor": "shut"},
        "stance": {"dorsiflexor": [0.0, 0.5]},
    },
    "transition": [
        {"state": "swing", "to": "contact", "column": "foot/heel_load", "above": "0.05 kN"},
        {"state": "contact", "to": "stance", "column": "state_time", "above": "30 ms"},
        {
            "state": "stance",
            "to": "swing",
            "column": "ankle/velocity",
            "below": "-60 deg/s",
            "after": "20 ms",
        },
    ],
}


def changed(number: int, **keys: Any) -> dict[str, Any]:
    """The machine's transitions, one of them changed."""
    moved = [dict(transition) for transition in MACHINE["transition"]]
    moved[number] = {k: v for k, v in (moved[number] | keys).items() if v is not None}
    return {"transition": moved}


@dataclass(frozen=True)
class Sample:
    """What a controller sees at a time [s], the same since the last command; next in a period [s]."""

    time: float
    period: float
    values: Mapping[str, float]
    n: int = 1

    def __getitem__(self, column: str) -> float:
        return self.values[column]

    def rows(self, column: str) -> np.ndarray:
        return np.full(self.n, self.values[column])


def walker(controller: dict[str, Any], **sets: Any) -> Scenario:
    """A shipped walk with a controller instead of its phases."""
    return load("scenario", "walk-dropfoot-afo", {"phases": None, "controller": controller} | sets)


def made(controller: dict[str, Any], **sets: Any) -> Controller:
    """A controller of that walk."""
    scenario = walker(controller, **sets)
    assert scenario.controller is not None
    return make(scenario.controller, scenario)


def commands(controller: Controller, period: float, **columns: list[float]) -> list[Mapping[str, Any]]:
    """What it commands, sample by sample; in names of columns "__" stands for "/"."""
    series = {name.replace("__", "/"): values for name, values in columns.items()}
    count = len(next(iter(series.values())))
    return [
        controller(Sample(k * period, period, {name: values[k] for name, values in series.items()}))
        for k in range(count)
    ]
