"""Push-off in proportion to the load under the toes, and a lifted foot while they bear little."""

from collections.abc import Mapping

from afo_sim.control.command import Command, switched
from afo_sim.control.controller import Observation
from afo_sim.control.required_inputs import RequiredInput
from afo_sim.description import Scenario, ToeLoad


class ToeLoadController:
    """p = p_peak F / F_peak for push-off, to p_peak; the lifting chamber by two thresholds."""

    def __init__(self, description: ToeLoad, scenario: Scenario):
        self.description = description
        self.asks = [RequiredInput(description.column, "controller.toe_load", unit="N")]
        self.reset()

    def reset(self) -> None:
        """Begin with toes that bear nothing."""
        self.load, self.loaded, self.pushing = 0.0, False, False

    def __call__(self, seen: Observation) -> Mapping[str, Command]:
        """The commands at the load that is measured."""
        described = self.description
        self.load = seen[described.column]
        share = self.load / described.peak
        self.loaded = switched(self.loaded, share, described.unloaded, described.loaded)
        self.pushing = switched(self.pushing, share, described.vent_below, described.fill_above)
        commands: dict[str, Command] = {}
        if described.lifts is not None:
            pressure = described.lift_pressure
            full: Command = "inlet" if pressure is None else pressure
            empty: Command = "outlet" if pressure is None else 0.0
            commands[described.lifts] = empty if self.loaded else full
        if described.pushes is not None:
            shut = "outlet" if share < described.vent_below else "shut"
            commands[described.pushes] = "inlet" if self.pushing else shut
            if described.push_pressure is not None:
                commands[described.pushes] = described.push_pressure * min(max(share, 0.0), 1.0)
        return commands

    def tell(self) -> dict[str, float]:
        """The load, and whether the toes carry much."""
        return {"toe_load": self.load, "state": float(self.loaded)}


CONTROLLER = ToeLoadController
