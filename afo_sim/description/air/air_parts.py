"""What lies between the supply and the muscles beside the chambers: rigid volumes, and parts that air flows
through, whose kinds have one entry each in `PARTS`."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Annotated, Literal

from afo_sim.common import AMBIENT_PRESSURE, STANDARD_DENSITY
from afo_sim.description.air.regulator import Regulator
from afo_sim.description.air.tube import Tube
from afo_sim.description.air.valve import Valve
from afo_sim.description.quantity import Described, Quantity, refusal
from afo_sim.physics import FlowEdge, flow_edge

AMBIENT, SUPPLY = flow_edge.AMBIENT, flow_edge.SUPPLY  # nodes whose pressures are given

Gauge = Annotated[float, Quantity("Pa", at_least=0.0, at_most=5e6)]
TubeLength = Annotated[float, Quantity("m", above=0.0, at_most=100.0)]
ByFlow = Annotated[float, Quantity("J/(kg*K)", at_least=0.0, at_most=1e5)]
Conductance = Annotated[float, Quantity("m^3/(s*Pa)", above=0.0, at_most=1e-6)]
Ratio = Annotated[float, Quantity("", at_least=0.0, at_most=0.9)]
Kind = Literal[
    "tube", "orifice", "throttle", "check_valve", "quick_exhaust", "silencer", "leak", "valve", "regulator"
]
USUAL_RATIO = 0.3  # of a leak, whose shape nobody knows


class Volume(Described):
    """A rigid volume of air: a reservoir, a manifold."""

    volume: Annotated[float, Quantity("m^3", above=0.0, at_most=1.0)]
    """Air volume."""
    wall_conductance: Annotated[float, Quantity("W/K", at_least=0.0, at_most=1e4)] = 0.0
    """Heat conductance from the air inside to the air outside; 0 is adiabatic."""
    wall_conductance_by_flow: ByFlow = 0.0
    """What the heat conductance grows by with the flow into it."""
    start_pressure: Gauge | None = None
    """Gauge pressure before the first step; what the supply's air brings it to without a valve by default,
    behind a regulator or a check valve less than the supply's, else none."""


class QuickExhaust(Described):
    """A quick exhaust between a chamber's tube and its muscles."""

    conductance: Conductance
    """Sonic conductance C (ISO 6358) from the tube to the muscles."""
    critical_ratio: Ratio
    """Critical pressure ratio b (ISO 6358), of both ways."""
    exhaust_conductance: Conductance
    """Sonic conductance from the muscles to the ambient air."""
    cracking_pressure: Annotated[float, Quantity("Pa", at_least=0.0, at_most=2e5)] = 0.0
    """Pressure difference between tube and muscles that opens either way."""


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
    inertia: bool | None = None
    """Of a tube: whether its air has inertia; without by default."""
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
    def part(self) -> "AirPart":
        """Its kind."""
        return PARTS[self.kind]

    def edges(self, name: str) -> tuple[FlowEdge, ...]:
        """What it is made of, under a name of its own: the way from upstream to downstream, then others."""
        return tuple(self.part.edges(name, self))

    @property
    def ratio(self) -> float:
        """Critical pressure ratio [-]; 0.3 for a leak without one."""
        return USUAL_RATIO if self.critical_ratio is None else self.critical_ratio

    def _must_have_what_its_kind_has(self) -> None:
        a_kind = f"an {self.kind}" if self.kind[0] in "aeiou" else f"a {self.kind}"
        part = self.part
        for name in sorted({name for each in PARTS.values() for name in each.own} - {*part.own}):
            if getattr(self, name) is not None:
                problem = f"is not a valid key of {a_kind}"
                raise refusal(problem, f"{', '.join(part.own)}, upstream, downstream", name)
        for name in part.needs:
            if getattr(self, name) is None:
                raise refusal(f"is missing; {a_kind} needs it", ", ".join(part.needs), name)
        if self.inertia and {AMBIENT, SUPPLY} & {self.upstream, self.downstream}:
            raise refusal("ends where air has no inertia", "a volume or a chamber at both ends", "inertia")
        if self.upstream == self.downstream:
            raise refusal("leads back to its origin", "another node", "downstream")
        if self.downstream == AMBIENT and not part.to_ambient:
            problem = f"of a {self.kind} is the ambient air"
            raise refusal(problem, "a volume or a chamber", "downstream")


@dataclass(frozen=True)
class AirPart:
    """A kind of restriction."""

    needs: tuple[str, ...]
    edges: Callable[[str, Restriction], Iterator[FlowEdge]]
    may_have: tuple[str, ...] = ()
    lines: Callable[[Restriction], tuple[str, ...]] | None = None
    feeds: bool = True  # whether it brings air on without a coil
    both_ways: bool = True
    to_ambient: bool = True
    blows_off: bool = True  # whether air that it lets out all the time is worth a warning
    branches: tuple[str, ...] = ()

    @property
    def own(self) -> tuple[str, ...]:
        """Fields that restrictions of this kind alone have."""
        return (*self.needs, *self.may_have)


def tube_edge(name: str, origin: str, end: str, tube: Tube, length: float, inertia: bool = False) -> FlowEdge:
    """A length of a tube [m]."""
    if inertia:
        return flow_edge.line(name, origin, end, tube.bore, length)
    return FlowEdge(name, origin, end, tube.conductance(length), tube.critical_ratio(length))


def quick_exhaust_edges(
    name: str, origin: str, end: str, quick: QuickExhaust | Restriction
) -> Iterator[FlowEdge]:
    """From origin to end as a check valve; from end to the ambient air while the origin has less pressure."""
    c, vent, cracking = quick.conductance, quick.exhaust_conductance, quick.cracking_pressure or 0.0
    assert c is not None and vent is not None
    ratio = quick.critical_ratio or 0.0
    yield flow_edge.check_valve(name, origin, end, c, ratio, cracking=cracking)
    yield flow_edge.quick_exhaust(f"{name}_exhaust", end, origin, vent, ratio, cracking=cracking)


def regulator_edges(
    name: str, regulator: Regulator, pressure: float, before: str, behind: str
) -> Iterator[FlowEdge]:
    """A regulator's seat, its relief and its bleed, set to a gauge pressure [Pa]."""
    ratio = regulator.critical_ratio
    yield flow_edge.regulator(
        name, before, behind, regulator.conductance, ratio, setting=pressure, per_droop=regulator.gain
    )
    if regulator.relief is not None:
        yield flow_edge.relief(
            f"{name}_relief", behind, regulator.opens_to_ambient, ratio, limit=pressure + regulator.relief,
            per_excess=regulator.gain,
        )  # fmt: skip
    if regulator.bleed_flow > 0.0:  # choked at the set pressure
        bleed = regulator.bleed_flow / (STANDARD_DENSITY * (pressure + AMBIENT_PRESSURE))
        yield FlowEdge(f"{name}_bleed", behind, AMBIENT, bleed, ratio)


def _plain(name: str, each: Restriction) -> Iterator[FlowEdge]:
    yield FlowEdge(name, each.upstream, each.downstream, each.conductance or 0.0, each.ratio)


def _tube(name: str, each: Restriction) -> Iterator[FlowEdge]:
    assert each.tube is not None and each.length is not None
    yield tube_edge(name, each.upstream, each.downstream, each.tube, each.length, bool(each.inertia))


def _valve(name: str, each: Restriction) -> Iterator[FlowEdge]:
    assert each.valve is not None
    row = each.valve.row
    c, b = row["conductance"], row["critical_ratio"]
    yield FlowEdge(name, each.upstream, each.downstream, c, b, valve=row)


def _throttle(name: str, each: Restriction) -> Iterator[FlowEdge]:
    assert each.check_conductance is not None
    yield flow_edge.check_valve(
        name, each.upstream, each.downstream, each.check_conductance, each.ratio,
        cracking=each.cracking_pressure or 0.0, throttle=each.conductance or 0.0, throttle_ratio=each.ratio,
    )  # fmt: skip


def _check_valve(name: str, each: Restriction) -> Iterator[FlowEdge]:
    c, cracking = each.conductance or 0.0, each.cracking_pressure or 0.0
    yield flow_edge.check_valve(name, each.upstream, each.downstream, c, each.ratio, cracking=cracking)


def _regulator(name: str, each: Restriction) -> Iterator[FlowEdge]:
    assert each.regulator is not None and each.pressure is not None
    yield from regulator_edges(name, each.regulator, each.pressure, each.upstream, each.downstream)


def bar(pressure: float) -> str:
    """A pressure [Pa] as text in bar."""
    return f"{1e-5 * pressure:.3g} bar"


def tube_lines(tube: Tube, length: float) -> tuple[str, ...]:
    """Label of a tube of a length [m] in a drawing."""
    return (f"{length:.3g} m, {1e6 * tube.volume(length):.3g} ml",)


def opening_lines(part: QuickExhaust | Restriction) -> tuple[str, ...]:
    """Label of a part's opening pressure in a drawing."""
    return (f"opens {bar(part.cracking_pressure)}",) if part.cracking_pressure else ()


def regulator_lines(regulator: Regulator, pressure: float) -> tuple[str, ...]:
    """Label of a regulator at a set gauge pressure [Pa] in a drawing."""
    droop = f"{1e-5 * regulator.droop:.2g} bar at {6e4 * regulator.rated_flow:.3g} l/min"
    relief = () if regulator.relief is None else (f"relief +{bar(regulator.relief)}",)
    return (f"set {bar(pressure)}", f"droops {droop}", *relief)


def _product_lines(each: Restriction) -> tuple[str, ...]:
    product, own = each.tube or each.valve or each.regulator, tuple[str, ...]()
    assert product is not None
    if each.tube is not None and each.length is not None:
        own = tube_lines(each.tube, each.length)
    if each.regulator is not None and each.pressure is not None:
        own = regulator_lines(each.regulator, each.pressure)
    return (f"{each.kind} {product.name}".strip(), *own)


FLOW = ("conductance", "critical_ratio")
PARTS: dict[str, AirPart] = {
    "tube": AirPart(("tube", "length"), _tube, may_have=("inertia",), lines=_product_lines, to_ambient=False),
    "orifice": AirPart(FLOW, _plain),
    "throttle": AirPart(
        (*FLOW, "check_conductance"),
        _throttle,
        may_have=("cracking_pressure",),
        lines=lambda each: (
            "throttle, check",
            f"check C {1e8 * (each.check_conductance or 0.0):.3g}",
            *opening_lines(each),
        ),
    ),
    "check_valve": AirPart(
        FLOW,
        _check_valve,
        may_have=("cracking_pressure",),
        lines=lambda each: ("check valve", *opening_lines(each)),
        both_ways=False,
    ),
    "quick_exhaust": AirPart(
        (*FLOW, "exhaust_conductance"),
        lambda name, each: quick_exhaust_edges(name, each.upstream, each.downstream, each),
        may_have=("cracking_pressure",),
        lines=lambda each: ("quick exhaust", *opening_lines(each)),
        both_ways=False,
        to_ambient=False,
        blows_off=False,
        branches=("exhaust",),
    ),
    "silencer": AirPart(FLOW, _plain, feeds=False),
    "leak": AirPart(("conductance",), _plain, may_have=("critical_ratio",), feeds=False, blows_off=False),
    "valve": AirPart(("valve",), _valve, lines=_product_lines, feeds=False, blows_off=False),
    "regulator": AirPart(
        ("regulator", "pressure"),
        _regulator,
        lines=_product_lines,
        both_ways=False,
        to_ambient=False,
        branches=("relief", "bleed"),
    ),
}
