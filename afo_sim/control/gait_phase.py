"""Commands by estimated gait phase."""

from collections.abc import Mapping

import numpy as np

from afo_sim.control.asked import Asked
from afo_sim.control.command import Command
from afo_sim.control.foot_switch import FootSwitch
from afo_sim.control.observation import Observation
from afo_sim.control.phase_estimate import PhaseEstimate
from afo_sim.description.control.switching import ChamberPhases, GaitPhase
from afo_sim.description.scenario import Scenario


class GaitPhaseController:
    """A controller: valves in intervals of the estimated phase, or pressures over it."""

    def __init__(self, description: GaitPhase, scenario: Scenario):
        self.description = description
        self.oscillator = PhaseEstimate(scenario.timestep) if description.angle else None
        self.switch = FootSwitch(description.heel_strike, description.strides) if description.load else None
        table = "controller.gait_phase"
        columns = ((description.angle, "column", "rad"), (description.load, "switch", "N"))
        self.asks = [Asked(column, table, key, unit=unit) for column, key, unit in columns if column]

    @property
    def estimator(self) -> PhaseEstimate | FootSwitch:
        """What estimates the phase."""
        estimator = self.oscillator or self.switch
        assert estimator is not None
        return estimator

    @property
    def stands(self) -> bool:
        """Whether the shank was found to stand: an inlet that stayed open would fill the muscle to supply."""
        return self.oscillator is not None and self.oscillator.stopped

    def reset(self) -> None:
        """Forget what was estimated."""
        for estimator in (self.oscillator, self.switch):
            if estimator is not None:
                estimator.reset()

    def _look(self, seen: Observation) -> None:
        """Take the samples."""
        struck = False
        if self.switch is not None:
            struck = self.switch.update(seen[self.description.load], seen.period)
        if self.oscillator is not None:
            self.oscillator.update(seen[self.description.angle], seen.period, struck)

    def __call__(self, seen: Observation) -> Mapping[str, Command]:
        """The commands at the estimated phase."""
        self._look(seen)
        if not self.estimator.ready or self.stands:
            return dict.fromkeys(self.description.chambers, self.description.waiting)
        phase = self.estimator.phase % 1.0
        return {chamber: command_at(told, phase) for chamber, told in self.description.chambers.items()}

    def tell(self) -> dict[str, float]:
        """Estimated phase and stride time; NaN while they are not known."""
        estimator = self.estimator
        known = estimator.ready
        return {
            "phase": estimator.phase if known else float("nan"),
            "stride_time": estimator.stride_time if known else float("nan"),
        }


def command_at(told: ChamberPhases, phase: float) -> Command:
    """A chamber's command at a phase from 0 to 1: a pressure [Pa], or two coils."""
    if told.pressure:
        phases, pressures = zip(*told.pressure, strict=True)
        return float(np.interp(phase, phases, pressures, period=1.0))
    return _coil(told.inlet, phase), _coil(told.outlet, phase)


def _coil(intervals: tuple[tuple[float, float], ...], phase: float) -> float:
    """1 within an interval; one whose start is above its end goes on over heel strike."""
    return float(
        any(
            start <= phase < end if start < end else phase >= start or phase < end for start, end in intervals
        )
    )
