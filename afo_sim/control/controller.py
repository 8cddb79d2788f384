"""The controller: observation → command at a control rate; and how one is made from its description."""

import importlib
from collections.abc import Mapping
from typing import Protocol

import numpy as np

from afo_sim.control.command import Command
from afo_sim.description import ControllerDescription, Scenario


class Observation(Protocol):
    """A view of the last sample, by column name, SI; unread names cost nothing."""

    @property
    def time(self) -> float:
        """Present time, at which the command begins [s]."""

    @property
    def period(self) -> float:
        """Time from one command to the next [s]."""

    def __getitem__(self, column: str) -> float:
        """The last sample of a column; InputError where there is no such column."""

    def rows(self, column: str) -> np.ndarray:
        """All samples of a column since the last command (n,)."""


Told = Mapping[str, float]  # what a controller reports beside its commands, by name


class Controller(Protocol):
    """What chooses the commands of the next control period. Any function of an observation is one."""

    def __call__(self, seen: Observation, /) -> Mapping[str, Command]:
        """The commands by chamber."""


# Columns "controller/<name>" that controllers may report: {name: (unit, meaning)}
CONTROLLER_COLUMNS: dict[str, tuple[str, str]] = {
    "state": ("", "number of the state machine's state, from 0"),
    "phase": ("", "estimated gait phase, 0 = heel strike, up to 1"),
    "stride_time": ("s", "estimated duration of a stride"),
    "heel_strike": ("", "what phase 0 is known from: 2 a foot switch, 1 the shank, 0 other people"),
    "reference": ("rad", "angle that is asked for, dorsiflexion positive"),
    "reference_moment": ("N*m", "moment that is asked for, dorsiflexion positive"),
    "reference_pressure": ("Pa", "pressure that is asked for, gauge"),
    "error": ("rad", "reference less measured"),
    "output": ("", "of the controller, −1 to 1"),
    "activation": ("", "of the muscle that the electrodes see, 0 to 1"),
    "toe_load": ("N", "that the controller sees"),
}


def make(description: ControllerDescription, scenario: Scenario) -> Controller:
    """A fresh controller: what the module of its kind's name calls CONTROLLER."""
    kind = description.kind
    module = importlib.import_module(f"afo_sim.control.{kind}")
    made: Controller = module.CONTROLLER(getattr(description, kind), scenario)
    return made
