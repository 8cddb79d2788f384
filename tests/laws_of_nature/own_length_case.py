"""Cases for the separate computation: a built scenario as its `Device` and `Drive`, and the start."""

import math

import numpy as np
from laws_of_nature.own_length_reference import (
    AMBIENT,
    GAMMA,
    GAS,
    GRAVITY,
    WARMTH,
    Anchor,
    Chamber,
    Device,
    Drive,
    Foot,
    Muscle,
    Surroundings,
    Valve,
)
from laws_of_nature.toe_reference import Toes, rest_extension, series
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from afo_sim.description import MuscleGroup, Orthosis, Scenario
from afo_sim.gait import GaitCycle
from afo_sim.model import Built, person_of
from afo_sim.simulation import Recording

FINE = 1e-4  # step of the tables that recorded walking is read from [s]


def device_of(built: Built) -> Device:
    """The numbers of a built scenario."""
    scenario = built.scenario
    orthosis, patient, (heavier, taller) = scenario.orthosis, scenario.patient, size_of(built)
    names = list(orthosis.chamber)
    chambers = tuple(
        Chamber(name, c.tube_volume, c.wall_conductance, valve_of(c.inlet), valve_of(c.outlet))
        for name, c in orthosis.chamber.items()
    )
    muscles = tuple(
        muscle_of(group, names.index(group.chamber or name)) for name, group in orthosis.muscle.items()
    )
    return Device(
        muscles,
        chambers,
        anchors_of(orthosis),
        foot_of(built),
        scenario.supply.pressure + AMBIENT,
        0.0 if patient is None else patient.spasticity * heavier * taller**1.5,
    )


def muscle_of(group: MuscleGroup, chamber: int) -> Muscle:
    """A group of muscles between two anchors."""
    kind, origin, insertion = group.type, group.origin, group.insertion
    assert origin is not None and insertion is not None and group.link_length is not None
    assert (kind.law, kind.friction, kind.damper) == ("tondu_lopez_2000_bladder", "none", None)
    assert (origin.segment, insertion.segment) == ("shank", "foot")
    assert origin.spacing == insertion.spacing and origin.from_joint[1] == insertion.from_joint[1]  # planar
    law = kind.law_set.parameters
    return Muscle(
        count=group.count,
        chamber=chamber,
        origin=(origin.from_joint[0], origin.from_joint[2]),
        insertion=(insertion.from_joint[0], insertion.from_joint[2]),
        series=kind.end_length + group.link_length + group.slack + group.cable.offset,
        cable=group.cable.stiffness,
        length=kind.total_length - kind.end_length,
        radius=kind.bore / 2.0,
        angle=kind.braid_angle,
        end_correction=law["k"],
        bladder_force=law["bladder_force"],
        bladder_stiffness=law["bladder_stiffness"],
        lowest=kind.law_set.pressure_range[0],
        return_stiffness=kind.return_stiffness,
        damping=kind.damping,
        braid=kind.braid_stiffness,
        dead=kind.dead_volume,
    )


def valve_of(valve: object) -> Valve:
    """A described valve."""
    names = ("conductance", "critical_ratio", "opening_delay", "closing_delay")
    return Valve(*(getattr(valve, name) for name in names))


def anchors_of(orthosis: Orthosis) -> tuple[Anchor, ...]:
    """Cuff and plate, where they give way."""
    found = []
    for anchor in orthosis.anchor.values():
        assert not anchor.damping
        if anchor.stiffness is not None:
            found.append(Anchor(stiffness=anchor.stiffness))
        else:
            found.append(Anchor(force=anchor.stiffening.force, scale=anchor.stiffening.length))
    return tuple(found)


def foot_of(built: Built) -> Foot:
    """The foot with all that it carries, from the bodies of the compiled model; its tissue as described.

    The tissue's moment goes with mass × length of the person, damping with √length more.
    """
    model, leg, patient = built.model, built.scenario.leg, built.scenario.patient
    joint, toes, (heavier, taller) = model.joint("ankle"), toes_of(built), size_of(built)
    mass, centre, inertia = together(built, leg.foot, model.joint("ankle").pos, without_toes=toes is not None)
    assert leg.friction == 0.0
    return Foot(
        mass=mass,
        centre=centre,
        inertia=inertia,
        armature=float(model.dof_armature[joint.dofadr[0]]),
        damping=leg.damping * heavier * taller**1.5,
        scale=leg.passive.scale * heavier * taller * (1.0 if patient is None else patient.passive_scale),
        offset=leg.passive.offset + (0.0 if patient is None else patient.passive_offset),
        load=built.scenario.load_moment,
        stops=(float(joint.range[0]), float(joint.range[1])),
        toes=toes,
    )


def toes_of(built: Built) -> Toes | None:
    """The toes, where they bend: their body in the compiled model, their spring as it is described.

    Stiffness goes with mass × length of the person, damping with √length more; an orthosis stays as it is.
    """
    model, scenario = built.model, built.scenario
    described = scenario.leg.toes
    if described is None or not scenario.walking:
        return None
    joint, plate, shoe = model.joint(described.joint), scenario.orthosis.outsole, scenario.shoe
    mass, centre, about = together(built, described.body, joint.pos)
    ankle = model.joint("ankle").pos
    x, _, z = model.body(described.body).pos + joint.pos - ankle
    heavier, taller = size_of(built)
    sole = 0.0 if shoe is None else shoe.toe_stiffness * heavier * taller
    return Toes(
        hinge=(float(x), float(z)),
        mass=mass,
        centre=centre,
        inertia=about - mass * (centre[0] ** 2 + centre[1] ** 2),
        armature=float(model.dof_armature[joint.dofadr[0]]),
        stiffness=described.stiffness * heavier * taller,
        sole_stiffness=sole if plate is None else plate.toe_stiffness,
        damping=described.damping * heavier * taller**1.5,
    )


def size_of(built: Built) -> tuple[float, float]:
    """Factors on masses and lengths of the leg, of the person who walks."""
    leg, person = built.scenario.leg, person_of(built.scenario)
    return person.body_mass / leg.body_mass, person.body_height / leg.body_height


def together(
    built: Built, name: str, pivot: np.ndarray, *, without_toes: bool = False
) -> tuple[float, tuple[float, float], float]:
    """A body with all that it carries: mass [kg], centre from a pivot in it [m], inertia about it [kg·m²]."""
    model, toes = built.model, built.scenario.leg.toes
    carried = {model.body(name).id: np.zeros(3)}
    for body in range(model.nbody):
        parent = int(model.body_parentid[body])
        hinged = without_toes and toes is not None and model.body(body).name == toes.body
        if parent in carried and not hinged:
            carried[body] = carried[parent] + model.body_pos[body]
    mass, moment, inertia = 0.0, np.zeros(3), 0.0
    for body, place in carried.items():
        assert body == model.body(name).id or np.allclose(model.body_quat[body], [1.0, 0.0, 0.0, 0.0])
        at = place + model.body_ipos[body] - pivot
        turn = Rotation.from_quat(model.body_iquat[body], scalar_first=True).as_matrix()
        own = (turn @ np.diag(model.body_inertia[body]) @ turn.T)[1, 1]
        mass += model.body_mass[body]
        moment += model.body_mass[body] * at
        inertia += own + model.body_mass[body] * (at[0] ** 2 + at[2] ** 2)
    return float(mass), (float(moment[0] / mass), float(moment[2] / mass)), float(inertia)


def seats_of(scenario: Scenario) -> list[tuple[str, str]]:
    """Chamber and side of every valve, in the order of the reference's seats."""
    return [(name, side) for name in scenario.orthosis.chamber for side in ("inlet", "outlet")]


def timed(built: Built) -> Drive:
    """A fixed shank, and valves switched by a clock."""
    scenario = built.scenario
    timer, knee, end = scenario.timer, scenario.shank.knee_angle, scenario.duration
    assert timer is not None and knee is not None
    around = Surroundings(0.0, 0.0, 0.0, 0.0, knee, 0.0, 0.0)
    events: list[tuple[float, int, bool]] = []
    for number, (chamber, side) in enumerate(seats_of(scenario)):
        pairs = getattr(timer.chambers.get(chamber), side, ())
        cycles = range(math.ceil(end / timer.period))
        on = joined([(k * timer.period + a, k * timer.period + b) for k in cycles for a, b in pairs])
        valve = valve_of(getattr(scenario.orthosis.chamber[chamber], side))
        events += [(time, number, opened) for time, opened in valve.travels(on, end)]
    return Drive(lambda time: around, tuple(sorted(events)))


def walked(built: Built, begin: float, end: float) -> Drive:
    """Recorded walking from `begin` to `end` [s], and valves that follow the gait phase.

    The shank's motion is the cycle's Fourier series with its own second derivatives; ground force and
    centre of pressure are linear between the recorded samples; the patient's moment and stiffness are
    taken as given, at the steps of the built scenario, linear between them.
    """
    scenario, walk, own = built.scenario, built.walk, built.active
    assert walk is not None and own is not None and scenario.gait is not None
    assert scenario.gait.variability == 0.0 and built.contact is None
    cycle, first = walk.cycle, scenario.gait.start_phase
    stride = scenario.gait.stride_time or cycle.stride_time
    strikes = [(k - first) * stride for k in range(math.floor(first), math.ceil(end / stride + first) + 1)]
    tables = {}
    count = math.ceil(stride / FINE)
    for k, strike in enumerate(strikes):
        if strike + stride < begin or strike > end:
            continue
        phase = np.arange(count + 1) / count
        time = strike + phase * stride
        step = np.arange(len(own.moment)) * walk.timestep
        moment = np.interp(time, step, own.moment) + ground_moment(cycle, phase) * built.body_mass
        rows = [
            cycle.signal("shank_angle", phase),
            *(motion(cycle, name, phase, stride) for name in ("shank_angle", "ankle_x", "ankle_z")),
            cycle.signal("knee_angle", phase),
            moment,
            np.interp(time, step, own.stiffness),
            cycle.signal("shank_angle", phase, 1) * cycle.stride_time / stride,
            *resting(built, phase, stride),
        ]
        tables[k] = np.column_stack(rows).tolist()
    spacing = stride / count

    def around(time: float) -> Surroundings:
        k = math.floor((time - strikes[0]) / stride)
        at = (time - strikes[k]) / spacing
        low = min(int(at), count - 1)
        part, table = at - low, tables[k]
        return Surroundings(*(a + part * (b - a) for a, b in zip(table[low], table[low + 1], strict=True)))

    events = []
    for number, (chamber, side) in enumerate(seats_of(scenario)):
        chambers = {} if scenario.phases is None else scenario.phases.chambers
        phases = getattr(chambers.get(chamber), side, ())
        turns = [(a, b) for low, high in phases for a, b in unwrapped(low, high)]
        on = [(strike + a * stride, strike + b * stride) for strike in strikes for a, b in turns]
        on = joined([(max(a, 0.0), b) for a, b in on if b > 0.0])
        valve = valve_of(getattr(scenario.orthosis.chamber[chamber], side))
        events += [(time, number, opened) for time, opened in valve.travels(on, end)]
    return Drive(around, tuple(sorted(events)), tuple(strikes))


def resting(built: Built, phase: np.ndarray, stride: float) -> tuple[np.ndarray, np.ndarray]:
    """Rest extension of the toes at phases [rad] and its rate [rad/s]; zero of a rigid foot."""
    toes = built.scenario.leg.toes
    if toes is None:
        return np.zeros_like(phase), np.zeros_like(phase)
    waves = rest_extension(toes.swing_extension)
    return series(waves, phase), series(waves, phase, 1) / stride


def unwrapped(low: float, high: float) -> list[tuple[float, float]]:
    """An interval of phase that may run over the heel strike, as intervals that do not."""
    return [(low, high)] if low < high else [(low, 1.0), (0.0, high)]


def motion(cycle: GaitCycle, name: str, phase: np.ndarray, stride: float) -> np.ndarray:
    """Second derivative by time of a recorded signal, walked at a stride time [s]."""
    return cycle.signal(name, phase, 2) * (cycle.stride_time / stride) ** 2


def ground_moment(cycle: GaitCycle, phase: np.ndarray) -> np.ndarray:
    """Moment of the recorded ground force about the ankle, per body mass, at phases 0…1 [N·m/kg].

    Phase 1 has the last sample's force, not the next stride's first.
    """
    known = np.isfinite(cycle.cop_x)
    ahead = np.interp(phase, cycle.phase[known], cycle.cop_x[known], period=1.0)
    upward, forward = (np.interp(phase, cycle.phase, force) for force in (cycle.grf_z, cycle.grf_x))
    return GRAVITY * (ahead * upward + cycle.signal("ankle_z", phase) * forward)


def joined(pairs: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Intervals in order, those that touch as one."""
    found: list[tuple[float, float]] = []
    for low, high in sorted(pairs):
        if found and low <= found[-1][1] + 1e-9:
            found[-1] = (found[-1][0], max(high, found[-1][1]))
        else:
            found.append((low, high))
    return found


def rest(device: Device, around: Surroundings) -> list[float]:
    """The states at rest in unmoving surroundings, the chambers at ambient pressure and temperature."""

    def excess(angle: float) -> float:
        pulls, arms, _ = device.tensions(angle, hanging(device, angle))
        moment = sum(m.count * t * arm for m, t, arm in zip(device.muscles, pulls, arms, strict=True))
        return device.accelerations(angle, 0.0, [], moment, around)[0]

    angle = brentq(excess, *device.foot.stops, xtol=1e-14)
    contractions = hanging(device, angle)
    return [angle, 0.0, *contractions, *filled(device, contractions)]


def hanging(device: Device, angle: float) -> list[float]:
    """Contractions at rest without air at an ankle angle: spring and cable of each group in balance."""

    def balanced(given: float) -> list[float]:
        found = []
        for muscle in device.muscles:
            away = muscle.path(angle)[0] - muscle.series - given

            def excess(x: float, muscle: Muscle = muscle, away: float = away) -> float:
                return muscle.spring(x, 0.0) - muscle.cable * max(away - muscle.length * (1.0 - x), 0.0)

            found.append(brentq(excess, -0.3, 0.3, xtol=1e-15))
        return found

    if not device.anchors:
        return balanced(0.0)
    given = brentq(lambda z: device.tensions(angle, balanced(z))[2] - z, 0.0, 0.5, xtol=1e-14)
    return balanced(given)


def filled(device: Device, contractions: list[float], pressure: float = 0.0) -> list[float]:
    """σ and m of the chambers at a gauge pressure and ambient temperature."""
    found = []
    for volume in device.volumes(contractions):
        absolute = pressure + AMBIENT
        found += [absolute * volume**GAMMA, absolute * volume / (GAS * WARMTH)]
    return found


def start_at(built: Built, drive: Drive, level: float = 0.0) -> list[float]:
    """The states at the start of recorded walking: muscles hang without air, toes rest.

    `level` [rad] is how far the outsole turns the ankle's zero.
    """
    device, cycle, gait = device_of(built), built.walk.cycle, built.scenario.gait
    angle = float(cycle.signal("ankle_angle", gait.start_phase)) + gait.ankle_offset + level
    speed = float(cycle.signal("ankle_angle", gait.start_phase, 1))
    contractions = hanging(device, angle)
    state = [angle, speed, *contractions, *filled(device, contractions)]
    toes, around = device.foot.toes, drive.around(0.0)
    if toes is not None:
        share = toes.stiffness / (toes.stiffness + toes.sole_stiffness)
        state += [share * around.toe_rest, share * around.toe_rest_rate]
    return state


def state_at(built: Built, run: Recording, row: int) -> list[float]:
    """The states at a row of a recording."""
    scenario = built.scenario
    groups = scenario.orthosis.muscle
    state = [*motion_at(run, "ankle/angle", row)]
    state += [float(run[f"muscle/{name}_1/contraction"][row]) for name in groups]
    for name in scenario.orthosis.chamber:
        pressure, volume, mass = (
            run[f"chamber/{name}/{what}"][row] for what in ("pressure", "volume", "mass")
        )
        state += [float((pressure + AMBIENT) * volume**GAMMA), float(mass)]
    if scenario.leg.toes is not None:
        state += motion_at(run, "toe/extension", row)
    return state


def motion_at(run: Recording, column: str, row: int) -> list[float]:
    """An angle at a row, and its rate by five rows: recorded velocities stand between the angles."""
    angle, step = run[column][row - 2 : row + 3], run["time"][1] - run["time"][0]
    rate = (angle[0] - 8.0 * angle[1] + 8.0 * angle[3] - angle[4]) / (12.0 * step)
    return [float(angle[2]), float(rate)]
