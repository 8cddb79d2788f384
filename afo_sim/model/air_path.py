"""The pneumatic circuit of an orthosis: volumes, restrictions, source and muscles, as `native` takes them.

A tube's friction lies between the halves of its air. A regulator with droop has a volume behind its seat,
which feeds all that names the supply. A source's own pressure is before it.
"""

import functools
import math
from dataclasses import dataclass, replace

from afo_sim import native
from afo_sim.common import STANDARD_DENSITY
from afo_sim.description import (
    SUPPLY,
    Chamber,
    Drive,
    MuscleGroup,
    Orthosis,
    Regulator,
    Scenario,
    Supply,
    quick_exhaust_edges,
    regulator_edges,
    tube_edge,
)
from afo_sim.model.mounting import ANKLE
from afo_sim.physics import AIR, FlowEdge, Gas, flow_edge

SOURCE, OUTLET = "source", "regulator"  # of a supply: bottle, cartridge or tank; behind its regulator
VALVE_END, TUBE = "{}_valve_end", "{}_tube"  # of a chamber's tube
TUBE_END, QUICK_EXHAUST = "{}_tube_end", "{}_quick_exhaust"  # where one stands between tube and muscles


@dataclass(frozen=True)
class AirPath:
    """A circuit's parts other than chambers."""

    volumes: tuple[native.CircuitVolume, ...]
    stores: tuple[native.CircuitStore, ...]
    restrictions: tuple[FlowEdge, ...]
    gas: Gas = AIR
    feed: str = SUPPLY
    upstream: str = ""

    @classmethod
    def of(cls, orthosis: Orthosis, supply: Supply | None = None) -> "AirPath":
        """The air path of an orthosis on a supply; on endless air without one."""
        if not orthosis.chamber:
            return cls((), (), ())
        source = None if supply is None else supply.source
        regulator = None if supply is None else supply.regulator
        feed = SUPPLY if regulator is None else OUTLET
        gas = AIR if source is None else source.real_gas
        before = SUPPLY if source is None else SOURCE
        pressure = 0.0 if supply is None else supply.pressure
        brought, volumes, stores = _brought(orthosis, pressure), [], []
        restrictions: list[FlowEdge] = []
        for name, volume in orthosis.volume.items():
            start = brought.get(name, 0.0) if volume.start_pressure is None else volume.start_pressure
            room = volume.volume + beside(orthosis, name)
            walls = volume.wall_conductance, volume.wall_conductance_by_flow
            volumes.append(native.CircuitVolume(name, room, walls[0], start, "", walls[1]))
        for name, chamber in orthosis.chamber.items():
            tube, length, quick = chamber.tube, chamber.tube_length, chamber.quick_exhaust
            if tube is None or length is None:
                continue
            first, half = VALVE_END.format(name), 0.5 * tube.volume(length)
            end = name if quick is None else TUBE_END.format(name)
            volumes.append(native.CircuitVolume(first, half + chamber.port_volume, start_as=name))
            restrictions.append(tube_edge(TUBE.format(name), first, end, tube, length, chamber.tube_inertia))
            if quick is not None:
                volumes.append(native.CircuitVolume(end, half, start_as=name))
                restrictions += quick_exhaust_edges(QUICK_EXHAUST.format(name), end, name, quick)
        for each in (edge for name, part in orthosis.restriction.items() for edge in part.edges(name)):
            a, b, pilot = (feed if node == SUPPLY else node for node in (each.origin, each.end, each.pilot))
            restrictions.append(replace(each, origin=a, end=b, pilot=pilot))
        if source is not None and source.kind == "compressor":
            stall, starts, stops = source.stall_pressure, source.switch_on, source.switch_off
            assert stall is not None and starts is not None and stops is not None
            volumes.append(native.CircuitVolume(SOURCE, source.volume, source.wall_conductance, stops))
            free = source.delivery(0.0) / STANDARD_DENSITY
            restrictions.append(
                flow_edge.compressor(
                    "compressor", SOURCE, free_air=free, stall=stall, starts=starts, stops=stops
                )
            )
        elif source is not None:
            row = {name: getattr(source, name) for name in ("volume", "shell", "wall_conductance")}
            row["real_gas"] = source.real_gas.row
            stores.append(native.CircuitStore(SOURCE, row, source.full_mass))
        if regulator is not None:
            volumes.append(native.CircuitVolume(OUTLET, outlet_room(orthosis, regulator), 0.0, pressure))
            restrictions += regulator_edges(OUTLET, regulator, pressure, before, OUTLET)
        scaled = tuple((each if gas is AIR else each.times(gas.flow_factor)) for each in restrictions)
        upstream = SOURCE if source is not None and regulator is None else ""
        return cls(tuple(volumes), tuple(stores), scaled, gas, feed, upstream)

    def node(self, name: str) -> str:
        """The node of a name in an orthosis."""
        return self.feed if name == SUPPLY else name


def valve_row(valve: native.ValveParameters, gas: Gas) -> dict[str, float]:
    """A valve's parameters for another gas, which chokes at another flow through the same hole."""
    row = dict(valve.row)
    return row | {"conductance": row["conductance"] * gas.flow_factor}


def _brought(orthosis: Orthosis, pressure: float) -> dict[str, float]:
    """Gauge pressure at which the supply's air comes to rest in the nodes that no valve shuts off [Pa]."""
    found, changed = {SUPPLY: pressure}, True
    while changed:
        changed = False
        for each in orthosis.restriction.values():
            if not each.part.feeds:
                continue
            both, ways = each.part.both_ways, [(each.upstream, each.downstream)]
            if both:
                ways.append((each.downstream, each.upstream))
            for origin, end in ways:
                if origin not in found or end == native.AMBIENT_NAME:
                    continue
                rests = found[origin] - (0.0 if both else each.cracking_pressure or 0.0)
                if each.pressure is not None:
                    rests = min(rests, each.pressure)
                if rests > found.get(end, 0.0):
                    found[end], changed = rests, True
    return found


def half_of_tubes(orthosis: Orthosis, name: str) -> float:
    """Air of what leads to a chamber [m³]: half of its own tube and of others, regulators' outlets."""
    chamber = orthosis.chamber[name]
    total = 0.0
    if chamber.tube is not None and chamber.tube_length is not None and chamber.quick_exhaust is None:
        total += 0.5 * chamber.tube.volume(chamber.tube_length)
    return total + beside(orthosis, name)


def beside(orthosis: Orthosis, name: str) -> float:
    """Air of restrictions that counts at a node [m³]: half of each tube's, all of a regulator's outlet."""
    total = 0.0
    for each in orthosis.restriction.values():
        if each.tube is not None and each.length is not None and name in (each.upstream, each.downstream):
            total += 0.5 * each.tube.volume(each.length)
        elif each.regulator is not None and name == each.downstream:
            total += each.regulator.outlet_volume
    return total


def outlet_room(orthosis: Orthosis, regulator: Regulator) -> float:
    """Air behind a supply's regulator [m³]: its outlet, and what leads on from the supply."""
    return regulator.outlet_volume + beside(orthosis, SUPPLY)


def least_volume(orthosis: Orthosis, name: str) -> float:
    """Volume of a chamber whose muscles are straight tubes: tubes, dead volumes, bores [m³]."""
    chamber, muscles = orthosis.chamber[name], orthosis.muscles_of(name).values()
    volume = chamber.tube_volume + half_of_tubes(orthosis, name)
    volume += sum(g.count * (g.type.dead_volume - g.type.rubber_volume) for g in muscles)
    volume += sum(g.count * g.type.nominal_length * math.pi * g.type.bore**2 / 4.0 for g in muscles)
    return volume


def own_supply(scenario: Scenario) -> Supply | None:
    """The supply that is a part of the circuit; None where it is an input."""
    supply = scenario.supply
    return supply if supply.source or supply.regulator or scenario.orthosis.volume else None


@functools.lru_cache(maxsize=4)  # cases of a sweep share it, and what is kept by it
def circuit_of(
    orthosis: Orthosis,
    joint: str = ANKLE,
    inverts: bool = False,
    drives: tuple[tuple[str, Drive], ...] = (),
    supply: Supply | None = None,
) -> native.Circuit:
    """The circuit of an orthosis: alike parallel muscles share one own contraction, others have their own."""
    driven, path = dict(drives), AirPath.of(orthosis, supply)
    return native.Circuit(
        muscles=tuple(
            native.CircuitMuscle(
                name=tendons[0],
                tendons=tendons,
                row=group.type.row,
                series_length=group.series_length,
                chamber=group.chamber or name,
                cable_stiffness=group.cable.stiffness,
                anchors=tuple(orthosis.anchor) if group.pulley is None else (),
                wrap_friction=group.wrap_friction,
            )
            for name, group in orthosis.muscle.items()
            for tendons in _alike(name, group, inverts)
        ),
        chambers=tuple(
            native.CircuitChamber(
                name=name,
                joint=joint,
                tube_volume=chamber.tube_volume + half_of_tubes(orthosis, name),
                wall_conductance=chamber.wall_conductance,
                inlet=native.CircuitValve(**valve_row(chamber.inlet, path.gas)),
                outlet=native.CircuitValve(**valve_row(chamber.vent, path.gas)),
                drive=drive_of(driven[name], shortest_pulse(chamber)) if name in driven else None,
                feed=path.node(chamber.feed),
                exhaust=path.node(chamber.exhaust),
                port="" if chamber.tube is None else VALVE_END.format(name),
                three_way=chamber.three_way,
                wall_conductance_by_flow=chamber.wall_conductance_by_flow,
            )
            for name, chamber in orthosis.chamber.items()
        ),
        anchors=tuple(
            native.CircuitAnchor(
                name=name,
                stiffness=mounting.stiffness or 0.0,
                force=0.0 if mounting.stiffening is None else mounting.stiffening.force,
                length=0.0 if mounting.stiffening is None else mounting.stiffening.length,
                damping=mounting.damping,
            )
            for name, mounting in orthosis.anchor.items()
        ),
        volumes=path.volumes,
        stores=path.stores,
        restrictions=path.restrictions,
        upstream=path.upstream,
        gas_constant=path.gas.constant,
        heat_capacity_ratio=path.gas.heat_capacity_ratio,
    )


def endless(pressure: float) -> Supply | None:
    """A supply that never sags, at a gauge pressure [Pa]; None where it is not above ambient pressure."""
    return Supply.model_validate({"pressure": f"{pressure!r} Pa"}) if pressure > 0.0 else None


def shortest_pulse(chamber: Chamber) -> float:
    """Shortest pulse that a chamber's valves answer [s]: the longest opening delay or minimum on-time."""
    least = [valve.minimum_on_time or 0.0 for valve in (chamber.inlet, chamber.outlet) if valve is not None]
    return max(chamber.inlet.opening_delay, chamber.vent.opening_delay, *least)


def _alike(name: str, group: MuscleGroup, inverts: bool) -> list[tuple[str, ...]]:
    """Names of a group's muscles: in one tuple where their paths are equally long, else each in its own."""
    tendons = tuple(f"{name}_{k}" for k in range(1, group.count + 1))
    return [tendons] if group.alike and not inverts else [(tendon,) for tendon in tendons]


def drive_of(drive: Drive, shortest: float = 0.0) -> native.CircuitDrive:
    """A described drive of valves that answer no pulse below the shortest [s], as the circuit takes it."""
    row = {
        "kind": native.DriveKind[drive.kind.upper()],
        "dead_band": drive.dead_band,
        "release": drive.releases_at,
        "period": drive.period,
        "least_on": drive.shortest_pulse(shortest),
        "least_off": drive.least_off,
        "full_at": drive.full_at,
        "integral_rate": 0.0 if drive.integral_time is None else 1.0 / drive.integral_time,
        "derivative_time": drive.derivative_time,
        "filter_time": drive.filter_time,
    }
    return native.CircuitDrive(row, drive.bandwidth if drive.kind == "regulator" else 0.0)
