"""A controller in the loop: rows since its last command → observation → command → inputs of the next."""

import functools
import math
import numbers
from collections.abc import Callable
from typing import Any

import numpy as np

from afo_sim import native
from afo_sim.common.errors import AfoSimError, InputError
from afo_sim.control.asked import asked_of, check_asked
from afo_sim.control.controller import TOLD, Controller
from afo_sim.control.making import make
from afo_sim.control.watch import TookTooLong, Watch
from afo_sim.description.scenario import Scenario
from afo_sim.model import controls as schedule
from afo_sim.model.build import Built
from afo_sim.simulation.commander import Commander
from afo_sim.simulation.observing import Seen, frame_of, known_columns, seen_columns, unit_of
from afo_sim.simulation.policy import Moment, Policy, PolicyFault, Rows
from afo_sim.simulation.rollout import FIELDS
from afo_sim.simulation.sensed import SensorBank
from afo_sim.simulation.stepped import forces_of

TIME_LIMIT = 10.0  # for one command [s]: a controller may compile something at its first
SLIGHTLY = 1e-6  # of a period, to which it must be whole steps


def steps_of_period(scenario: Scenario, rate: float) -> int:
    """Steps from one command to the next; InputError where that is no whole number."""
    if isinstance(rate, bool) or not isinstance(rate, numbers.Real):
        problem = "is no number of commands a second"
        raise InputError(problem, field="controller.rate", value=rate, allowed="a number in Hz, such as 100")
    steps = 1.0 / (rate * scenario.timestep) if rate > 0.0 else 0.0
    if round(steps) < 1 or abs(steps - round(steps)) > SLIGHTLY * steps:
        allowed = f"{1.0 / scenario.timestep:g} Hz divided by 1, 2, 3, …"
        problem = "is not a whole fraction of the step rate"
        raise InputError(problem, field="controller.rate", value=rate, allowed=allowed)
    return round(steps)


def described_policy(built: Built) -> Policy | None:
    """The policy of a scenario's own controller, made afresh; None where it has none.

    Raises
    ------
    InputError
        The controller does not fit the scenario.
    """
    described = built.scenario.controller
    if described is None:
        return None
    return Loop(built, make(described, built.scenario), described.rate).policy()


class Loop:
    """The loop of one simulation; it makes the Policy that a roll-out asks.

    Parameters
    ----------
    built : compiled scenario
    controller : see `control/controller.py`
    rate : of commands [Hz]
    time_limit : wall time that one command may take [s]

    Raises
    ------
    InputError
        It is no controller, reads what is not there, cannot be reset, or does not go with rate or limit.
    """

    def __init__(self, built: Built, controller: Controller, rate: float, time_limit: float = TIME_LIMIT):
        if not callable(controller):
            allowed = "a function of what is seen, or an object that can be called with it"
            raise InputError("is no controller", field="controller", value=controller, allowed=allowed)
        limit: Any = time_limit  # whatever the caller's annotations say
        if not (isinstance(limit, numbers.Real) and float(limit) > 0.0):
            allowed = "a number above 0 [s]; infinite for none"
            raise InputError("is no time", field="time_limit", value=time_limit, allowed=allowed)
        self.built, self.controller = built, controller
        self.watch = Watch(time_limit)
        self.period = steps_of_period(built.scenario, rate)
        self.schedule = schedule.controls(built)
        self.commander = Commander(built)
        self.sensors = SensorBank(built)
        self.columns = seen_columns(built)
        asks, known = asked_of(controller), known_columns(built)
        check_asked(asks, known, functools.partial(unit_of, built.scenario))
        self.reads = [ask.column for ask in asks if ask.column in known]
        self.last = self.schedule[:1]  # inputs of the steps since the last command
        self.told: list[tuple[int, dict[str, float]]] = []
        reset = getattr(controller, "reset", None)
        if reset is not None:
            try:
                self._watched(lambda _: reset(), "to reset")
            except PolicyFault as fault:
                raise InputError(f"cannot be reset: {fault}", field="controller") from fault

    def policy(self) -> Policy:
        """The policy of a roll-out."""
        return Policy(self.choose, self.period, self.columns_told)

    def choose(self, moment: Moment) -> np.ndarray:
        """Inputs of the steps of a moment, from what the controller commands in it."""
        steps = moment.steps
        rows = moment.last
        if not len(rows["time"]):
            rows = self._first(moment.now)
        seen = self._seen(rows, steps)
        self._ask(seen, steps.start)
        inputs = self.schedule[steps.start : steps.stop].copy()
        self.commander.apply(inputs)
        self.last = inputs
        return inputs

    def _seen(self, rows: Rows, steps: range) -> Seen:
        first = max(steps.start - len(rows["time"]), 0)
        frame = frame_of(self.built, rows, self.last, first)
        timestep = self.built.scenario.timestep
        readings = self.sensors.feed(frame, self.columns)
        return Seen(frame, readings, steps.start * timestep, self.period * timestep, self.columns)

    def _ask(self, seen: Seen, step: int) -> None:
        """Ask the controller, and put its commands in force; PolicyFault where it fails."""
        for column in self.reads:  # a comparison with no number is false: the valves would just stay shut
            if not math.isfinite(seen[column]):
                raise PolicyFault(f"the controller reads {column}, and that is no number")
        commands = self._watched(lambda _: self.controller(seen), "for a command")
        tell = getattr(self.controller, "tell", None)
        found = None if tell is None else self._watched(lambda _: tell(), "to tell its columns")
        try:
            told = None if tell is None else checked_told(found)
        except AfoSimError as error:
            raise PolicyFault(f"what the controller tells is refused: {error}") from error
        try:
            self.commander.take(commands)
        except AfoSimError as error:
            raise PolicyFault(f"the controller's command is refused: {error}") from error
        if told is not None:
            self.told.append((step, told))

    def _watched(self, call: Callable[[None], Any], what: str) -> Any:
        """What the controller gives; PolicyFault where it raises something or takes too long."""
        try:
            return self.watch.call(call, None)
        except TookTooLong:
            problem = f"the controller took more than {self.watch.limit:g} s {what}"
            raise PolicyFault(f"{problem}; allowed: up to time_limit") from None
        except AfoSimError as error:
            raise PolicyFault(f"the controller failed: {error}") from error
        except Exception as error:
            raise PolicyFault(f"the controller raised {type(error).__name__}: {error}") from error

    def columns_told(self, first: int, stop: int) -> Rows:
        """What the controller has told, as columns of the steps first…stop, held from command to command."""
        if not self.told:
            return {}
        starts = np.array([step for step, _ in self.told])
        place = np.searchsorted(starts, np.arange(first, stop), side="right") - 1
        names = dict.fromkeys(name for _, told in self.told for name in told)
        return {
            f"controller/{name}": np.array([told.get(name, math.nan) for _, told in self.told])[place]
            for name in names
        }

    def _first(self, now: Rows) -> Rows:
        """The row of the start: its state, and the forces in it."""
        model = self.built.model
        data = native.scratch(model)
        for name in ("qpos", "qvel", "act"):
            getattr(data, name)[:] = now[name]
        data.time = float(now["time"][0])
        return forces_of(model, data, self.schedule[0], FIELDS)


def checked_told(told: object) -> dict[str, float]:
    """What a controller tells, by the names of TOLD; InputError otherwise."""
    if not isinstance(told, dict) or not set(told) <= set(TOLD):
        raise InputError("tells something unknown", field="tell", value=told, allowed=", ".join(TOLD))
    strange = {name: value for name, value in told.items() if not isinstance(value, numbers.Real)}
    for name, value in strange.items():
        raise InputError("tells no number", field=f"tell: {name}", value=value, allowed="a number, or NaN")
    return {name: float(value) for name, value in told.items()}
