"""The pneumatic circuit of an orthosis, as `native` takes it."""

import functools

from afo_sim import native
from afo_sim.description import Drive, Mounting, MuscleGroup, Orthosis, Scenario, Supply
from afo_sim.description.orthosis import Chamber
from afo_sim.model.air_path import VALVE_END, AirPath, half_of_tubes, valve_row
from afo_sim.model.mounting import ANKLE

KINDS = {"bang_bang": native.BANG_BANG, "pwm": native.PWM, "regulator": native.REGULATOR}


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
            )
            for name, chamber in orthosis.chamber.items()
        ),
        anchors=tuple(_anchor(name, mounting) for name, mounting in orthosis.anchor.items()),
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


def opening_delay(chamber: Chamber) -> float:
    """Longer one of the opening delays of a chamber's valves [s]."""
    return max(chamber.inlet.opening_delay, chamber.vent.opening_delay)


def shortest_pulse(chamber: Chamber) -> float:
    """Shortest pulse that a chamber's valves answer [s]: the longest opening delay or minimum on-time."""
    least = [valve.minimum_on_time or 0.0 for valve in (chamber.inlet, chamber.outlet) if valve is not None]
    return max(opening_delay(chamber), *least)


def _alike(name: str, group: MuscleGroup, inverts: bool) -> list[tuple[str, ...]]:
    """Names of a group's muscles: in one tuple where their paths are equally long, else each in its own."""
    tendons = tuple(f"{name}_{k}" for k in range(1, group.count + 1))
    return [tendons] if group.alike and not inverts else [(tendon,) for tendon in tendons]


def drive_of(drive: Drive, shortest: float = 0.0) -> native.CircuitDrive:
    """A described drive of valves that answer no pulse below the shortest [s], as the circuit takes it."""
    row = {
        "kind": KINDS[drive.kind],
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
    return native.CircuitDrive(row, drive.valve_bandwidth)


def _anchor(name: str, mounting: Mounting) -> native.CircuitAnchor:
    law = mounting.stiffening
    return native.CircuitAnchor(
        name=name,
        stiffness=mounting.stiffness or 0.0,
        force=0.0 if law is None else law.force,
        length=0.0 if law is None else law.length,
        damping=mounting.damping,
    )
