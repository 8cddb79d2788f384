"""A controller in the loop: rows since its last command → observation → command → inputs of the next."""

import functools
import math
import numbers
import os
import pathlib
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from afo_sim import native
from afo_sim.common import AfoSimError, InputError, Mixed, si, unknown
from afo_sim.control import CONTROLLER_COLUMNS, Controller, TookTooLong, Watch, check_required, checked, make
from afo_sim.control.required_inputs import required_inputs
from afo_sim.description import Scenario
from afo_sim.model import OFF, Built
from afo_sim.model import supply_and_timer as schedule
from afo_sim.simulation.columns import SENSOR, describe, formulas, frame_of
from afo_sim.simulation.frame import Frame
from afo_sim.simulation.rollout import FIELDS
from afo_sim.simulation.sensed import SensorBank
from afo_sim.simulation.simulate import forces_of
from afo_sim.simulation.stepping import Moment, Policy, PolicyFault, Rows

Readings = Mapping[str, np.ndarray]  # of sensors, by name (n,)


@dataclass(frozen=True, eq=False)
class Seen:
    """An Observation: see `control/controller.py`."""

    frame: Frame  # rows since the last command
    readings: Readings  # of sensors by name
    time: float  # now [s]
    period: float  # between commands [s]
    columns: Mapping[str, Callable[[Frame], np.ndarray]]  # formulas by name
    found: dict[str, np.ndarray] = field(default_factory=dict)  # columns that were computed [SI]

    def rows(self, column: str) -> np.ndarray:
        """All samples of a column since the last command (n,)."""
        if column in self.found:
            return self.found[column]
        name = column.removeprefix(SENSOR)
        if name != column and name in self.readings:
            self.found[column] = self.readings[name]
        elif column in self.columns:
            self.found[column] = np.asarray(self.columns[column](self.frame))
        else:
            sensors = [f"{SENSOR}{known}" for known in self.readings]
            known = sensors if name != column else [*self.columns, *sensors]
            raise unknown(column, known, field="column", problem="a controller sees no such column")
        return self.found[column]

    def __getitem__(self, column: str) -> float:
        return float(self.rows(column)[-1])

    def __contains__(self, column: str) -> bool:
        return column in self.columns or column.removeprefix(SENSOR) in self.readings


def unit_of(scenario: Scenario, column: str) -> str:
    """SI unit of what a controller sees; a sensor's is that of its column, and a switch has none."""
    if column.startswith(SENSOR):
        sensor = scenario.sensor[column.removeprefix(SENSOR)]
        return describe(sensor.column)[0] if sensor.whole.threshold is None else ""
    return describe(column)[0]


class Commander:
    """The commands in force of one simulation, over the inputs that its scenario gives."""

    def __init__(self, built: Built, *, timed: bool = True):
        self.built, self.timed = built, timed
        self.reset()

    def reset(self) -> None:
        """Take all commands back."""
        shut = dict.fromkeys(self.built.index.chambers, (0.0, 0.0))
        self.commands: dict[str, tuple[float, float] | float] = {} if self.timed else dict(shut)

    def take(self, commands: object) -> None:
        """Put commands in force, all or none; InputError where one is wrong."""
        index = self.built.index
        described = self.built.scenario.orthosis.chamber
        three_way = [name for name, chamber in described.items() if chamber.three_way]
        merged = self.commands | checked(commands, index.chambers, index.drives, three_way)
        self.commands = {name: command for name, command in merged.items() if command is not None}

    def apply(self, inputs: np.ndarray) -> None:
        """Write the commands in force into inputs (…, nu)."""
        index = self.built.index
        for chamber, command in self.commands.items():
            driven = isinstance(command, float)
            coils = (0.0, 0.0) if isinstance(command, float) else command
            for side, coil in zip(("inlet", "outlet"), coils, strict=True):
                inputs[..., index.valves[f"{chamber}_{side}"]] = coil
            if chamber in index.drives:
                inputs[..., index.drives[chamber]] = command if driven else OFF


RATE = 100.0  # of a controller's commands [Hz]
TIME_LIMIT = 10.0  # for one command [s]: a controller may compile something at its first
_PACKAGE = f"{pathlib.Path(__file__).parents[1]}{os.sep}"
SLIGHTLY = 1e-6  # of a period, to which it must be whole steps


def described_policy(built: Built) -> Policy | None:
    """The policy of a scenario's own controller, made afresh; None where it has none."""
    described = built.scenario.controller
    if described is None:
        return None
    return Loop(built, make(described, built.scenario), described.rate).policy()


class Loop:
    """The loop of one simulation; it makes the Policy that a roll-out asks."""

    def __init__(
        self, built: Built, controller: Controller, rate: float | str, time_limit: float | str = TIME_LIMIT
    ):
        if not callable(controller):
            allowed = "a function of what is seen, or an object that can be called with it"
            problem = "is not a valid controller"
            raise InputError(problem, field="controller", value=controller, allowed=allowed)
        allowed = 'above 0, as a number [s] or "10 s"; infinite for none'
        limit = si(time_limit, "s", "time_limit", allowed)
        if not limit > 0.0:
            raise InputError("is not a valid time", field="time_limit", value=time_limit, allowed=allowed)
        self.built, self.controller = built, controller
        self.watch = Watch(limit)
        hertz = si(rate, "Hz", "controller.rate", 'a number [Hz], or "100 Hz"')
        steps = 1.0 / (hertz * built.scenario.timestep) if hertz > 0.0 else 0.0
        self.period = round(steps)  # steps from one command to the next
        if self.period < 1 or abs(steps - self.period) > SLIGHTLY * steps:
            allowed = f"{1.0 / built.scenario.timestep:g} Hz divided by 1, 2, 3, …"
            problem = "is not a whole fraction of the step rate"
            raise InputError(problem, field="controller.rate", value=rate, allowed=allowed)
        self.schedule = schedule.controls(built)
        self.commander = Commander(built)
        self.sensors = SensorBank(built)
        self.columns = formulas(built, whole=False)  # those that every roll-out records what they need for
        asks = required_inputs(controller)
        known = [*self.columns, *(f"{SENSOR}{name}" for name in built.scenario.sensor)]
        check_required(asks, known, functools.partial(unit_of, built.scenario))
        self.reads = [ask.column for ask in asks if ask.column in known]
        self.last = self.schedule[:1]  # inputs of the steps since the last command
        self.reported: list[tuple[int, dict[str, float]]] = []
        self.raised: BaseException | None = None  # of the controller when it was asked last, or of its answer
        reset = getattr(controller, "reset", None)
        if reset is not None:
            try:
                self._watched(lambda _: reset(), "to reset")
            except PolicyFault as fault:
                raise InputError(f"cannot be reset: {fault}", field="controller") from self.raised

    def policy(self, keeps: bool = False) -> Policy:
        """The policy of a roll-out."""
        return Policy(self.choose, self.period, self.columns_reported, keeps)

    def choose(self, moment: Moment) -> np.ndarray:
        """Inputs of the steps of a moment, from what the controller commands in it."""
        steps, timestep = moment.steps, self.built.scenario.timestep
        rows = moment.last
        if not len(rows["time"]):  # the row of the start: its state, and the forces in it
            model, now = self.built.model, moment.now
            data = native.scratch(model)
            for name in ("qpos", "qvel", "act"):
                getattr(data, name)[:] = now[name]
            data.time = float(now["time"][0])
            rows = forces_of(model, data, self.schedule[0], FIELDS)
        frame = frame_of(self.built, rows, self.last, max(steps.start - len(rows["time"]), 0))
        readings = self.sensors.feed(frame, self.columns)
        seen = Seen(frame, readings, steps.start * timestep, self.period * timestep, self.columns)
        self.ask(seen, steps.start)
        inputs = self.schedule[steps.start : steps.stop].copy()
        self.commander.apply(inputs)
        self.last = inputs
        return inputs

    def ask(self, seen: Seen, step: int) -> None:
        """Ask the controller, and put its commands in force; PolicyFault where it fails."""
        self.raised = None
        for column in self.reads:  # a comparison with no number is false: the valves would just stay shut
            if not math.isfinite(seen[column]):
                raise PolicyFault(f"the controller reads {column}, which is not a number")
        commands = self._watched(lambda _: self.controller(seen), "for a command")
        tell = getattr(self.controller, "tell", None)
        found = None if tell is None else self._watched(lambda _: tell(), "to report its columns")
        try:
            reported = None if tell is None else checked_report(found)
            self.commander.take(commands)
        except AfoSimError as error:
            raise self._fault("'s answer is refused", error) from error
        if reported is not None:
            self.reported.append((step, reported))

    def _watched(self, call: Callable[[None], Mixed], what: str) -> Mixed:
        """What the controller gives; PolicyFault where it raises something or takes too long."""
        try:
            return self.watch.call(call, None)
        except TookTooLong:
            problem = f"the controller took more than {self.watch.limit:g} s {what}"
            raise PolicyFault(f"{problem}; allowed: up to time_limit") from None
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # also sys.exit(), which would end all that is simulated beside
            kind = "failed" if isinstance(error, AfoSimError) else f"raised {type(error).__name__}"
            raise self._fault(f" {kind}", error) from error

    def _fault(self, problem: str, error: BaseException) -> PolicyFault:
        self.raised = error
        return PolicyFault(f"the controller{problem}: {error}{place_of(error)}")

    def columns_reported(self, first: int, stop: int) -> Rows:
        """Reports of the controller as columns of the steps first…stop, held from command to command."""
        if not self.reported:
            return {}
        starts = np.array([step for step, _ in self.reported])
        place = np.searchsorted(starts, np.arange(first, stop), side="right") - 1
        found = {}
        for name in dict.fromkeys(name for _, reported in self.reported for name in reported):
            told = np.array([reported.get(name, math.nan) for _, reported in self.reported])
            found[f"controller/{name}"] = told[place]
        return found


def place_of(error: BaseException) -> str:
    """Where it was raised in the first file of its traceback that is not this package's: " (mine.py:12)"."""
    lines = [(frame.f_code.co_filename, line) for frame, line in traceback.walk_tb(error.__traceback__)]
    others = [at for at in lines if not at[0].startswith(_PACKAGE)]
    return next((f" ({file}:{line})" for file, line in reversed(others) if file == others[0][0]), "")


def checked_report(reported: object) -> dict[str, float]:
    """What a controller reports, by the names of CONTROLLER_COLUMNS; InputError otherwise."""
    if not isinstance(reported, dict) or not set(reported) <= set(CONTROLLER_COLUMNS):
        known = ", ".join(CONTROLLER_COLUMNS)
        raise InputError("reports something unknown", field="tell", value=reported, allowed=known)
    strange = {name: value for name, value in reported.items() if not isinstance(value, numbers.Real)}
    for name, value in strange.items():
        problem = "reports something that is not a number"
        raise InputError(problem, field=f"tell: {name}", value=value, allowed="a number, or NaN")
    return {name: float(value) for name, value in reported.items()}
