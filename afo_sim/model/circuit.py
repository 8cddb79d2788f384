"""The pneumatic circuit of an orthosis, as `native` takes it."""

from collections.abc import Mapping

from afo_sim import native
from afo_sim.description.control.drive import Drive
from afo_sim.description.orthosis import Chamber, Mounting, MuscleGroup, Orthosis
from afo_sim.model.mounting import ANKLE

KINDS = {"bang_bang": native.BANG_BANG, "pwm": native.PWM, "regulator": native.REGULATOR}


def circuit_of(
    orthosis: Orthosis,
    joint: str = ANKLE,
    inverts: bool = False,
    drives: Mapping[str, Drive] | None = None,
) -> native.Circuit:
    """The circuit of an orthosis: alike parallel muscles share one own contraction, others have their own.

    Parameters
    ----------
    orthosis : frozen description
    joint : the one that MuJoCo asks for; nothing in the chambers puts a force on it
    inverts : whether the foot turns to its sides, which makes parallel paths unlike
    drives : pressure drives by chamber
    """
    driven = drives or {}
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
                tube_volume=chamber.tube_volume,
                wall_conductance=chamber.wall_conductance,
                inlet=chamber.inlet,
                outlet=chamber.outlet,
                drive=drive_of(driven[name], opening_delay(chamber)) if name in driven else None,
            )
            for name, chamber in orthosis.chamber.items()
        ),
        anchors=tuple(_anchor(name, mounting) for name, mounting in orthosis.anchor.items()),
    )


def opening_delay(chamber: Chamber) -> float:
    """Longer one of the opening delays of a chamber's valves [s]."""
    return max(chamber.inlet.opening_delay, chamber.outlet.opening_delay)


def _alike(name: str, group: MuscleGroup, inverts: bool) -> list[tuple[str, ...]]:
    """Names of a group's muscles: in one tuple where their paths are equally long, else each in its own."""
    tendons = tuple(f"{name}_{k}" for k in range(1, group.count + 1))
    return [tendons] if group.alike and not inverts else [(tendon,) for tendon in tendons]


def drive_of(drive: Drive, opening_delay: float = 0.0) -> native.CircuitDrive:
    """A described drive of valves with this opening delay [s], as the circuit takes it."""
    row = {
        "kind": KINDS[drive.kind],
        "dead_band": drive.dead_band,
        "release": drive.releases_at,
        "period": drive.period,
        "least_on": drive.shortest_pulse(opening_delay),
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
