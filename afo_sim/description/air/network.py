"""What lies between the supply and the muscles beside the chambers: rigid volumes, and restrictions."""

from typing import Annotated, Literal, Self

from pydantic import model_validator

from afo_sim.description.air.regulator import Regulator
from afo_sim.description.air.tube import Tube
from afo_sim.description.air.valve import Valve
from afo_sim.description.quantity import Described, Quantity, refusal

AMBIENT, SUPPLY = "ambient", "supply"  # nodes whose pressures are given

Gauge = Annotated[float, Quantity("Pa", at_least=0.0, at_most=5e6)]
TubeLength = Annotated[float, Quantity("m", above=0.0, at_most=100.0)]
Conductance = Annotated[float, Quantity("m^3/(s*Pa)", above=0.0, at_most=1e-6)]
Ratio = Annotated[float, Quantity("", at_least=0.0, at_most=0.9)]
Kind = Literal[
    "tube", "orifice", "throttle", "check_valve", "quick_exhaust", "silencer", "leak", "valve", "regulator"
]
OPEN_ENDED = ("silencer", "leak")  # lead to the ambient air unless told otherwise
# Fields that a restriction of each kind needs, and those that it may have besides; it has no others.
NEEDED: dict[str, tuple[str, ...]] = {
    "tube": ("tube", "length"),
    "orifice": ("conductance", "critical_ratio"),
    "throttle": ("conductance", "critical_ratio", "check_conductance"),
    "check_valve": ("conductance", "critical_ratio"),
    "quick_exhaust": ("conductance", "critical_ratio", "exhaust_conductance"),
    "silencer": ("conductance", "critical_ratio"),
    "leak": ("conductance",),
    "valve": ("valve",),
    "regulator": ("regulator", "pressure"),
}
MAY_HAVE: dict[str, tuple[str, ...]] = {
    "throttle": ("cracking_pressure",),
    "check_valve": ("cracking_pressure",),
    "quick_exhaust": ("cracking_pressure",),
    "leak": ("critical_ratio",),
}
OF_ONE_KIND = {name for table in (NEEDED, MAY_HAVE) for names in table.values() for name in names}
USUAL_RATIO = 0.3  # of a leak, whose shape nobody knows


class Volume(Described):
    """A rigid volume of air: a reservoir, a manifold."""

    volume: Annotated[float, Quantity("m^3", above=0.0, at_most=1.0)]
    """Air volume."""
    wall_conductance: Annotated[float, Quantity("W/K", at_least=0.0, at_most=1e4)] = 0.0
    """Heat conductance from the air inside to the air outside; 0 is adiabatic."""
    start_pressure: Gauge | None = None
    """Gauge pressure before the first step; what the supply's air brings it to without a valve by default,
    behind a regulator or a check valve less than the supply's, else none."""


class Restriction(Described):
    """What air flows through between two nodes: "supply", "ambient", a volume or a chamber."""

    kind: Kind
    """Tube, orifice, throttle (with a check valve beside it that is free downstream), check valve, quick
    exhaust (its muscle downstream), silencer, leak, valve, or pressure regulator."""
    upstream: str
    """Node on one side: "supply", "ambient", a volume or a chamber."""
    downstream: str = AMBIENT
    """Node on the other side; the ambient air by default."""
    tube: Tube | None = None
    """Of a tube: a shipped name, or the path of a tube's TOML file or folder."""
    length: TubeLength | None = None
    """Of a tube: its length. Half of its air counts at each end."""
    valve: Valve | None = None
    """Of a valve: a shipped name, or the path of a valve's TOML file or folder; timer or phases open it."""
    regulator: Regulator | None = None
    """Of a regulator: a shipped name, or the path of a regulator's TOML file or folder."""
    pressure: Gauge | None = None
    """Of a regulator: gauge pressure that it is set to."""
    conductance: Conductance | None = None
    """Sonic conductance C (ISO 6358); of a quick exhaust towards its muscle, of a throttle both ways."""
    critical_ratio: Ratio | None = None
    """Critical pressure ratio b (ISO 6358)."""
    check_conductance: Conductance | None = None
    """Of a throttle: sonic conductance of the check valve beside it."""
    exhaust_conductance: Conductance | None = None
    """Of a quick exhaust: sonic conductance from its muscle to the ambient air."""
    cracking_pressure: Annotated[float, Quantity("Pa", at_least=0.0, at_most=2e5)] | None = None
    """Of a check valve, a throttle's too: pressure difference that opens it; none by default."""

    @property
    def ratio(self) -> float:
        """Critical pressure ratio [-]; of a leak that tells none 0.3."""
        return USUAL_RATIO if self.critical_ratio is None else self.critical_ratio

    @model_validator(mode="after")
    def _has_what_its_kind_has(self) -> Self:
        a_kind = f"an {self.kind}" if self.kind[0] in "aeiou" else f"a {self.kind}"
        own = (*NEEDED[self.kind], *MAY_HAVE.get(self.kind, ()))
        for name in sorted(OF_ONE_KIND - {*own}):
            if getattr(self, name) is not None:
                raise refusal(f"is no key of {a_kind}", f"{', '.join(own)}, upstream, downstream", name)
        for name in NEEDED[self.kind]:
            if getattr(self, name) is None:
                raise refusal(f"is missing; {a_kind} needs it", ", ".join(NEEDED[self.kind]), name)
        if self.upstream == self.downstream:
            raise refusal("leads back to where it comes from", "another node", "downstream")
        if self.downstream == AMBIENT and self.kind in ("tube", "quick_exhaust", "regulator"):
            problem = f"of a {self.kind} is the ambient air"
            raise refusal(problem, "a volume or a chamber", "downstream")
        return self
