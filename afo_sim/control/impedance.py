"""Impedance control: a spring and a damper about a reference angle, as pressures of a pair of chambers."""

import numpy as np

from afo_sim.control.command import Command
from afo_sim.control.controller import Observation, Told
from afo_sim.control.required_inputs import RequiredInput
from afo_sim.control.tracking import apart, target
from afo_sim.description import Impedance, Scenario

EPSILON = 1e-9  # by which flat stretches of the map rise [N·m]
FLAT = 1e-6  # moments that are the same [N·m]


class ImpedanceController:
    """A spring and a damper about a reference angle."""

    def __init__(self, described: Impedance, scenario: Scenario):
        self.described = described
        table = "controller.impedance"
        self.asks = [
            RequiredInput(described.angle, table, "angle", unit="rad"),
            RequiredInput(described.velocity, table, "velocity", unit="rad/s"),
        ]
        if described.reference.column is not None:
            self.asks.append(
                RequiredInput(described.reference.column, f"{table}.reference", "column", unit="rad")
            )
        rows = np.array(sorted(described.torque_map))
        self.angles, self.differences = np.unique(rows[:, 0]), np.unique(rows[:, 1])
        # rows are sorted by angle and then by d; where a cable hangs, a moment is that of several pressures
        grid = rows[:, 2].reshape(len(self.angles), len(self.differences))
        self.moments = np.maximum.accumulate(grid, axis=1)
        self.reset()

    def reset(self) -> None:
        """Forget the last run."""
        self.reported: dict[str, float] = {}

    def difference(self, moment: float, angle: float) -> float:
        """Pressure [Pa] by which the chambers depart from the mean for a moment [N·m] at an angle [rad]."""
        moments = np.array([np.interp(angle, self.angles, column) for column in self.moments.T])
        rising = moments + EPSILON * np.arange(len(moments))  # so that there is one d
        low = float(np.interp(moment - FLAT, rising, self.differences))
        high = float(np.interp(moment + FLAT, rising, self.differences))
        most = self.described.half_range
        return min(max(min(max(0.0, low), high), -most), most)

    def __call__(self, seen: Observation) -> dict[str, Command]:
        """Commands of the next period."""
        it = self.described
        reference, angle, velocity = target(it.reference, seen), seen[it.angle], seen[it.velocity]
        # τ = K (θ_ref − θ) − B dθ/dt + feed-forward
        moment = it.stiffness * (reference - angle) - it.damping * velocity + it.feed_forward
        difference = self.difference(moment, angle)
        self.reported = {
            "reference": reference,
            "error": reference - angle,
            "reference_moment": moment,
            "output": difference / it.half_range,
        }
        return apart(it.raises, it.lowers, it.mean_pressure, difference)

    def tell(self) -> Told:
        """Reference, error, the moment that is asked for, and the share of the pressures' range."""
        return self.reported


CONTROLLER = ImpedanceController
