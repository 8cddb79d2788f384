"""Description → controller."""

from collections.abc import Callable, Mapping
from typing import Any

from afo_sim.control.controller import Controller
from afo_sim.control.emg import EmgController
from afo_sim.control.gait_phase import GaitPhaseController
from afo_sim.control.impedance import ImpedanceController
from afo_sim.control.pid import PidController
from afo_sim.control.state_machine import StateMachineController
from afo_sim.control.timer import TimerController
from afo_sim.control.toe_load import ToeLoadController
from afo_sim.description.control.controller import ControllerDescription
from afo_sim.description.scenario import Scenario

Maker = Callable[[Any, Scenario], Controller]  # (description of the kind, scenario) → a fresh controller
MAKERS: Mapping[str, Maker] = {
    "timer": TimerController,
    "gait_phase": GaitPhaseController,
    "state_machine": StateMachineController,
    "pid": PidController,
    "impedance": ImpedanceController,
    "toe_load": ToeLoadController,
    "emg": EmgController,
}


def make(description: ControllerDescription, scenario: Scenario) -> Controller:
    """A fresh controller.

    Parameters
    ----------
    description : of the scenario
    scenario : that it is for; tells chambers, timers and time step
    """
    kind = description.kind
    return MAKERS[kind](getattr(description, kind), scenario)
