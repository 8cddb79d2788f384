"""Pressure by muscle activation: rectified, delayed, low-passed with two time constants."""

import math
from collections import deque
from collections.abc import Mapping

from afo_sim.control.command import Command, switched
from afo_sim.control.controller import Observation
from afo_sim.control.required_inputs import RequiredInput
from afo_sim.description import Emg, Scenario, in_si


def activated(activation: float, excitation: float, dt: float, rise: float, fall: float) -> float:
    """Activation after a time with a constant excitation: a' = (u − a)/τ, solved exactly."""
    constant = rise if excitation > activation else fall
    if constant == 0.0:
        return excitation
    return excitation + (activation - excitation) * math.exp(-dt / constant)


class EmgController:
    """A controller: a chamber by activation."""

    def __init__(self, description: Emg, scenario: Scenario):
        self.description, self.full = description, in_si(description.full)
        self.sign = 1.0 if description.side == "dorsiflexor" else -1.0
        self.asks = [RequiredInput(description.column, "controller.emg", "full", description.full)]
        self.reset()

    def reset(self) -> None:
        """Begin relaxed."""
        self.activation, self.filling = 0.0, False
        self.excitations: deque[float] = deque()  # on their way, the oldest first

    def __call__(self, seen: Observation) -> Mapping[str, Command]:
        """The command at the present activation."""
        described = self.description
        # of a delay ago, from 0 to 1; 0 before the first
        self.excitations.append(min(max(self.sign * seen[described.column] / self.full, 0.0), 1.0))
        waiting = round(described.delay / seen.period)
        excitation = self.excitations.popleft() if len(self.excitations) > waiting else 0.0
        times = described.activation_time, described.deactivation_time
        self.activation = activated(self.activation, excitation, seen.period, *times)
        if described.pressure is not None:
            return {described.chamber: described.pressure * self.activation}
        self.filling = switched(self.filling, self.activation, described.vent_below, described.fill_above)
        if self.filling:
            return {described.chamber: "inlet"}
        return {described.chamber: "outlet" if self.activation < described.vent_below else "shut"}

    def tell(self) -> dict[str, float]:
        """The activation, and the pressure command if there is a drive."""
        found = {"activation": self.activation}
        if self.description.pressure is not None:
            found["reference_pressure"] = self.description.pressure * self.activation
        return found


CONTROLLER = EmgController
