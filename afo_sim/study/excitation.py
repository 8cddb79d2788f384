"""What a device is excited with: a sine on its reference or on a drive's pressure, or valves in turn."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from afo_sim.common import InputError, unknown
from afo_sim.control import make
from afo_sim.description import QUANTITIES, Impedance, Pid, Scenario
from afo_sim.model import Built
from afo_sim.model import controls as schedule
from afo_sim.model.build import build
from afo_sim.simulation import SENSOR, Commander, Loop, Policy, fixed, steps_of_period

What = Literal["reference", "pressure", "valves"]
WHATS: tuple[What, ...] = ("reference", "pressure", "valves")
_SQUARE = 4.0 / math.pi  # first harmonic of a square wave from −1 to 1
_ANGLE = "ankle/angle"


class Excitation(Protocol):
    """An input of a scenario that goes to and fro with a frequency, as phasor · exp(j 2π f t)."""

    @property
    def what(self) -> What: ...
    @property
    def unit(self) -> str: ...
    @property
    def phasor(self) -> complex: ...
    @property
    def outputs(self) -> tuple[str, ...]: ...
    @property
    def tick(self) -> int: ...

    def begun(self, frequency: float, n_step: int) -> tuple[Built, Policy]:
        """The compiled scenario and its inputs of n_step steps."""
        ...


@dataclass(frozen=True)
class OnReference:
    """A sine on what the scenario's controller is asked for."""

    scenario: Scenario
    mean: float
    amplitude: float
    what: What = "reference"

    @property
    def described(self) -> Pid | Impedance:
        """The controller that follows a reference."""
        controller = self.scenario.controller
        found = None if controller is None else controller.pid or controller.impedance
        if found is None:
            problem = "has no controller with a reference"
            allowed = "a scenario with [controller.pid] or [controller.impedance]; or pressure, or valves"
            raise InputError(problem, field="what", value="reference", allowed=allowed)
        return found

    @property
    def unit(self) -> str:
        """Unit of what is controlled."""
        it = self.described
        return QUANTITIES[it.quantity] if isinstance(it, Pid) else "rad"

    @property
    def phasor(self) -> complex:
        """Of amplitude · sin(ωt)."""
        return -1j * self.amplitude

    @property
    def outputs(self) -> tuple[str, ...]:
        """The true column of what is controlled, the ankle's angle, and the chambers' pressures."""
        it = self.described
        column = it.loop.column if isinstance(it, Pid) else it.angle
        known = self.scenario.sensor if column.startswith(SENSOR) else {}
        sensor = known.get(column.removeprefix(SENSOR))
        chambers = [name for name in (it.raises, it.lowers) if name is not None]
        true = column if sensor is None else sensor.column
        return tuple(dict.fromkeys((true, _ANGLE, *(f"chamber/{name}/pressure" for name in chambers))))

    @property
    def tick(self) -> int:
        """Steps of a control period."""
        assert self.scenario.controller is not None
        return steps_of_period(self.scenario, self.scenario.controller.rate)

    def begun(self, frequency: float, n_step: int) -> tuple[Built, Policy]:
        """The scenario with the sine as its reference, and its controller in the loop."""
        asked = {
            "mean": self.mean,
            "amplitude": self.amplitude,
            "frequency": frequency,
            "end_frequency": None,
            "sweep_time": None,
            "column": None,
            "table": (),
        }
        assert self.scenario.controller is not None
        it = self.described
        if isinstance(it, Pid):
            loop = it.loop.with_values(reference=it.loop.reference.with_values(**asked))
            changed: dict[str, Pid | Impedance] = {"pid": it.with_values(**{it.quantity: loop})}
        else:
            changed = {"impedance": it.with_values(reference=it.reference.with_values(**asked))}
        described = self.scenario.controller.with_values(**changed)
        scenario = self.scenario.with_values(
            controller=described, duration=n_step * self.scenario.timestep, timer=None
        )
        built = build(scenario)
        return built, Loop(built, make(described, scenario), described.rate).policy()


@dataclass(frozen=True)
class _OnChamber:
    """What goes to and fro at one chamber; the other chambers are vented."""

    scenario: Scenario
    chamber: str

    @property
    def tick(self) -> int:
        """Half a period is whole steps."""
        return 1

    @property
    def outputs(self) -> tuple[str, ...]:
        """The chamber's pressure, and the ankle's angle."""
        return f"chamber/{self.chamber}/pressure", _ANGLE


@dataclass(frozen=True)
class OnPressure(_OnChamber):
    """A sine on the pressure that one chamber's drive is asked for; the other chambers are vented."""

    mean: float
    amplitude: float
    what: What = "pressure"
    unit: str = "Pa"

    @property
    def phasor(self) -> complex:
        """Of amplitude · sin(ωt)."""
        return -1j * self.amplitude

    def begun(self, frequency: float, n_step: int) -> tuple[Built, Policy]:
        """The drive's pressure, step by step."""
        built = build(self.scenario)
        inputs = schedule.controls(built, n_step)
        _command(built, inputs, {self.chamber: self.mean})
        time = np.arange(n_step) * self.scenario.timestep
        sine = self.mean + self.amplitude * np.sin(2.0 * math.pi * frequency * time)
        inputs[:, built.index.drives[self.chamber]] = sine
        return built, fixed(inputs)


@dataclass(frozen=True)
class OnValves(_OnChamber):
    """One chamber's inlet open for half a period, its outlet for the other; the other chambers are vented."""

    what: What = "valves"
    unit: str = ""

    @property
    def phasor(self) -> complex:
        """Of the square wave's first harmonic, 4/π sin(ωt)."""
        return -1j * _SQUARE

    def begun(self, frequency: float, n_step: int) -> tuple[Built, Policy]:
        """The coils, step by step."""
        built = build(self.scenario)
        inputs = schedule.controls(built, n_step)
        half = round(0.5 / (frequency * self.scenario.timestep))
        for number, first in enumerate(range(0, n_step, half)):
            command = "outlet" if number % 2 else "inlet"
            _command(built, inputs[first : first + half], {self.chamber: command})
        return built, fixed(inputs)


def _command(built: Built, inputs: np.ndarray, commands: Mapping[str, str | float]) -> None:
    """Write one chamber's command, and the others vented, into inputs (n, nu)."""
    commander = Commander(built)
    commander.take(dict.fromkeys(built.index.chambers, "outlet") | dict(commands))
    commander.apply(inputs)


def chamber_of(scenario: Scenario, chamber: str | None) -> str:
    """A chamber of the orthosis; the first by default."""
    known = scenario.orthosis.chamber
    if not known:
        raise InputError("has no chamber: there is nothing to excite", field="scenario", value=scenario.name)
    if chamber is not None and chamber not in known:
        raise unknown(chamber, known, field="chamber", problem="the orthosis has no such chamber")
    return chamber or next(iter(known))
