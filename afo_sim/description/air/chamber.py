"""A chamber as it is described: the muscles' air, with its valves, its tube and where these lead."""

from typing import Annotated

from afo_sim.description.air.air_parts import AMBIENT, SUPPLY, ByFlow, QuickExhaust, TubeLength
from afo_sim.description.air.tube import Tube
from afo_sim.description.air.valve import Valve
from afo_sim.description.quantity import Described, Quantity, refusal


class Chamber(Described):
    """Muscles that share their valves: inlet from the supply, outlet to ambient."""

    inlet: Valve
    """Valve from the supply: a shipped name, or the path of a valve's TOML file or folder."""
    outlet: Valve | None = None
    """Valve to the air outside; without it the inlet is a 3/2 valve, which vents while its coil has no
    current."""
    feed: str = SUPPLY
    """Node before the inlet: "supply", a volume or another chamber."""
    exhaust: str = AMBIENT
    """Node behind the outlet: "ambient", a volume or another chamber, which takes the air up."""
    tube: Tube | None = None
    """Tube between valves and muscles: a shipped name, or the path of a tube's TOML file or folder; its
    friction counts, and half of its air at each end."""
    tube_length: TubeLength | None = None
    """Length of that tube."""
    tube_inertia: bool = False
    """Whether the air in that tube has inertia."""
    port_volume: Annotated[float, Quantity("m^3", at_least=0.0, at_most=1e-3)] = 0.0
    """Volume beside the tube's own at its valves' end, such as a gauge's."""
    quick_exhaust: QuickExhaust | None = None
    """Quick exhaust between the tube and the muscles; what they give off goes to the ambient air there, and
    the outlet vents the tube alone."""
    tube_volume: Annotated[float, Quantity("m^3", at_least=0.0, at_most=0.1)] = 0.0
    """Volume of tubes and fittings between valves and muscles that adds no friction; needed where no tube is
    named."""
    wall_conductance: Annotated[float, Quantity("W/K", at_least=0.0, at_most=1e4)]
    """Heat conductance from the air inside to the air outside; 0 is adiabatic."""
    wall_conductance_by_flow: ByFlow = 0.0
    """What the heat conductance grows by with the flow into the chamber, which stirs its air."""

    @property
    def three_way(self) -> bool:
        """Whether one 3/2 valve fills and vents it."""
        return self.outlet is None

    @property
    def vent(self) -> Valve:
        """Its way out: the outlet, or the 3/2 valve's path to its exhaust."""
        if self.outlet is not None:
            return self.outlet
        valve, path = self.inlet, self.inlet.exhaust
        assert path is not None
        return Valve.model_construct(
            conductance=path.conductance,
            critical_ratio=path.critical_ratio,
            opening_delay=valve.closing_delay,
            closing_delay=valve.opening_delay,
            opening_ramp=valve.closing_ramp,
            closing_ramp=valve.opening_ramp,
            rated_switches=valve.rated_switches,
        )

    def _must_vent(self) -> None:
        if self.outlet is None and self.inlet.exhaust is None:
            problem = "is missing: the inlet is a 2/2 valve, and nothing would let the air out"
            raise refusal(problem, "a valve, or a 3/2 valve as the inlet", "outlet")
        if (self.tube is None) != (self.tube_length is None):
            key = "tube" if self.tube is None else "tube_length"
            raise refusal("is missing: tube and tube_length belong together", "both, or neither", key)
        for key in ("tube_inertia", "port_volume", "quick_exhaust"):
            if getattr(self, key) and self.tube is None:
                raise refusal("needs a tube", "tube and tube_length beside it", key)
        if self.tube is None and "tube_volume" not in self.model_fields_set:
            raise refusal("is missing", "the air between valves and muscles, or a tube", "tube_volume")
