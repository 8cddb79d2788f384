"""Commands by the gait phase, estimated from the shank's angle or from a switch under the heel."""

import math
from collections import deque
from collections.abc import Mapping

import numpy as np

from afo_sim.control.command import Command
from afo_sim.control.controller import Observation
from afo_sim.control.phase_estimate import PhaseEstimate
from afo_sim.control.required_inputs import RequiredInput
from afo_sim.description import ChamberPhases, GaitPhase, Scenario

OPENS = 0.5  # share of the threshold below which the switch opens again [-]
BOUNCE = 0.4  # least duration of a stride; what closes sooner is the same contact [s]
LOST = 1.5  # durations of a stride without a heel strike, from which on the phase is not known [-]


class FootSwitch:
    """An estimator of the gait phase."""

    def __init__(self, threshold: float, strides: int = 3):
        self.threshold, self.strides = threshold, strides
        self.reset()

    def reset(self) -> None:
        """Forget every stride."""
        self.durations: deque[float] = deque(maxlen=self.strides)
        self.since = 0.0  # heel strike, or the beginning [s]
        self.struck = False  # whether there was a heel strike
        self.closed = True  # a switch that is closed at first was not seen to close

    def update(self, value: float, dt: float) -> bool:
        """Take a sample, and return whether it has a heel strike."""
        self.since += dt
        if not math.isfinite(value):  # a lost sample: the foot stands where it stood
            return False
        closed = value >= (OPENS * self.threshold if self.closed else self.threshold)
        striking = closed and not self.closed and (not self.struck or self.since >= BOUNCE)
        if striking:
            if self.durations and self.since > LOST * self.stride_time:
                self.durations.clear()  # he stood: neither that stride nor those before it tell the next
            elif self.struck:
                self.durations.append(self.since)
            self.since, self.struck = 0.0, True
        self.closed = closed
        return striking

    @property
    def stride_time(self) -> float:
        """Mean duration of the last strides [s]; NaN before the first whole one."""
        return sum(self.durations) / len(self.durations) if self.durations else math.nan

    @property
    def ready(self) -> bool:
        """Whether the phase is known: a whole stride was seen, and the next heel strike is not overdue."""
        return bool(self.durations) and self.since <= LOST * self.stride_time

    @property
    def phase(self) -> float:
        """Gait phase from 0 to 1 [-]; 1 where the next heel strike is late, 0 where it is not known."""
        return min(self.since / self.stride_time, 1.0) if self.ready else 0.0


class GaitPhaseController:
    """A controller: valves in intervals of the estimated phase, or pressures over it."""

    def __init__(self, description: GaitPhase, scenario: Scenario):
        self.description = description
        self.oscillator = PhaseEstimate(scenario.timestep) if description.angle else None
        self.switch = FootSwitch(description.heel_strike, description.strides) if description.load else None
        estimator = self.oscillator or self.switch
        assert estimator is not None
        self.estimator = estimator
        table = "controller.gait_phase"
        columns = ((description.angle, "column", "rad"), (description.load, "switch", "N"))
        self.asks = [RequiredInput(column, table, key, unit=unit) for column, key, unit in columns if column]

    def reset(self) -> None:
        """Forget what was estimated."""
        for estimator in (self.oscillator, self.switch):
            if estimator is not None:
                estimator.reset()

    def __call__(self, seen: Observation) -> Mapping[str, Command]:
        """The commands at the estimated phase."""
        struck = False
        if self.switch is not None:
            struck = self.switch.update(seen[self.description.load], seen.period)
        if self.oscillator is not None:
            self.oscillator.update(seen[self.description.angle], seen.period, struck)
        # who stands waits, too: an inlet that stayed open would fill the muscle to supply
        if not self.estimator.ready or (self.oscillator is not None and self.oscillator.stopped):
            return dict.fromkeys(self.description.chambers, self.description.waiting)
        phase = self.estimator.phase % 1.0
        return {chamber: command_at(given, phase) for chamber, given in self.description.chambers.items()}

    def tell(self) -> dict[str, float]:
        """Estimated phase and stride time, NaN while unknown, and the source of the heel strike."""
        known = self.estimator.ready
        told = {key: getattr(self.estimator, key) if known else math.nan for key in ("phase", "stride_time")}
        return told | ({"heel_strike": self.oscillator.heel_strike} if self.oscillator else {})


def command_at(given: ChamberPhases, phase: float) -> Command:
    """A chamber's command at a phase from 0 to 1: a pressure [Pa], or two coils."""
    if given.pressure:
        phases, pressures = zip(*given.pressure, strict=True)
        return float(np.interp(phase, phases, pressures, period=1.0))
    return _coil(given.inlet, phase), _coil(given.outlet, phase)


def _coil(intervals: tuple[tuple[float, float], ...], phase: float) -> float:
    """1 within an interval; one whose start is above its end goes on over heel strike."""
    within = (a <= phase < b if a < b else phase >= a or phase < b for a, b in intervals)
    return float(any(within))


CONTROLLER = GaitPhaseController
