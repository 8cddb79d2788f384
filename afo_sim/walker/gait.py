"""A walker walks: from a start, by its reflexes' gains, until it falls or the time is over."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.model import ANKLE, POINTS, SOLE
from afo_sim.physics import (
    GAINS,
    GASTROCNEMIUS,
    HAMSTRINGS,
    ILIOPSOAS,
    LEG_MUSCLES,
    NERVE,
    NERVES,
    SOLEUS,
    TIBIALIS,
    balanced_fibre,
)
from afo_sim.walker.body import FORWARD, HIP, KNEE, PITCH, SIDES, STOPS, UP, Body, floor_of

LEVEL = 3  # points at which an uneven floor begins, 1 m apart and level
SUNK = 0.003  # of the lowest point of the sole at the start [m]
OFFSETS = (PITCH, HIP, KNEE, ANKLE, f"left_{HIP}", f"left_{KNEE}", f"left_{ANKLE}")
# Angle [rad] and velocity at the start, first leg in early stance: SCONE's InitStateH0918Gait10.
START = {
    PITCH: (-0.105763, -0.0896),
    FORWARD: (0.0, 1.0757),
    UP: (0.0, 0.1543),
    HIP: (0.439316, -1.35971),
    KNEE: (-0.393922, 0.26788),
    ANKLE: (0.104714, 0.84012),
    f"left_{HIP}": (0.198813, 3.34368),
    f"left_{KNEE}": (-1.03755, -3.15281),
    f"left_{ANKLE}": (-0.348473, 1.26642),
}
ACTIVATION = {
    "hamstrings": (0.126, 0.012),
    "glutei": (0.171, 0.010),
    "iliopsoas": (0.054, 0.290),
    "vasti": (0.484, 0.011),
    "gastrocnemius": (0.144, 0.106),
    "soleus": (0.069, 0.123),
    "tibialis": (0.135, 0.262),
}


@dataclass(frozen=True, eq=False)
class Vector:
    """What a gait is: offsets of the first pose [rad] (7,), factor on its speed, gains of each leg (2, n)."""

    offsets: np.ndarray
    gains: np.ndarray
    speed: float = 1.0


def start(body: Body, vector: Vector, noise: Sequence[float] | np.ndarray = ()) -> mujoco.MjData:
    """The first state of a walker: its pose, fibres at rest at their activations, nerves that tell it."""
    model, floor = body.model, floor_of(body.scenario)
    data = mujoco.MjData(model)
    if floor.uneven:
        first = int(model.actuator_user[body.reflexes[0], native.REFLEX_ROW.floor]) + LEVEL
        drawn = np.random.default_rng(floor.seed).uniform(0.0, floor.uneven, native.FLOOR_POINTS - LEVEL)
        data.userdata[first : first + len(drawn)] = drawn
    for side, reflex in enumerate(body.reflexes):
        first = native.REFLEX_ROW.gains
        model.actuator_user[reflex, first : first + len(GAINS)] = vector.gains[side]
    for name, (place, rate) in START.items():
        rate *= vector.speed if name in (FORWARD, UP) else 1.0
        scale = np.sqrt(body.size.taller) if name in (FORWARD, UP) else 1.0 / np.sqrt(body.size.taller)
        data.qpos[int(model.joint(name).qposadr[0])] = place
        data.qvel[int(model.joint(name).dofadr[0])] = rate * scale
    for name, offset in (*zip(OFFSETS, vector.offsets, strict=True), *zip(OFFSETS, noise, strict=False)):
        data.qpos[int(model.joint(name).qposadr[0])] += offset
    mujoco.mj_kinematics(model, data)
    lowest = min(
        data.site_xpos[model.site(f"{side}{SOLE}{point}").id][2] for side in SIDES for point in POINTS
    )
    data.qpos[int(model.joint(UP).qposadr[0])] = -lowest - SUNK
    mujoco.mj_fwdPosition(model, data)
    for name, (_, _, begins) in STOPS.items():
        data.ctrl[[model.actuator(f"{side}{name}").id for side in SIDES]] = begins
    for side in range(2):
        _rest(body, data, side)
    for grip in np.flatnonzero(model.actuator_user[:, native.KIND] == native.Kind.GRIP):
        data.act[model.actuator_actadr[grip]] = data.actuator_length[grip]
    return data


def _rest(body: Body, data: mujoco.MjData, side: int) -> None:
    model, rows = body.model, body.model.actuator_user
    row, act = native.LEG_MUSCLE_ROW, native.LEG_MUSCLE_ACT
    signals = np.zeros(NERVES)
    for k, (i, name) in enumerate(zip(body.muscles[side], LEG_MUSCLES, strict=True)):
        own, at = rows[i], int(model.actuator_actadr[i])
        activation = ACTIVATION[name][side]
        form = own[[row.optimal, row.slack, row.width, row.strain, row.fastest, row.damping, row.passive]]
        active, path = own[row.strength] * activation, float(data.actuator_length[i])
        length, _, tension, _ = balanced_fibre(path, 1.0, 0.0, active, 0.0, *form)
        data.act[at + act.excitation] = data.act[at + act.activation] = activation
        data.act[at + act.length] = length
        data.act[at + act.force] = tension
        signals[NERVE.force + k] = tension
        for nerve, muscle in (
            (NERVE.tibialis_length, TIBIALIS),
            (NERVE.iliopsoas_length, ILIOPSOAS),
            (NERVE.hamstrings_length, HAMSTRINGS),
            (NERVE.soleus_length, SOLEUS),
            (NERVE.gastrocnemius_length, GASTROCNEMIUS),
        ):
            if muscle == k:
                signals[nerve] = length
    reflex = rows[body.reflexes[side]]
    place = native.REFLEX_ROW
    signals[NERVE.knee] = data.qpos[int(reflex[place.knee])]
    signals[NERVE.knee_rate] = data.qvel[int(reflex[place.knee_rate])]
    signals[NERVE.pitch] = data.qpos[int(reflex[place.pitch])] + reflex[place.slope]
    signals[NERVE.pitch_rate] = data.qvel[int(reflex[place.pitch_rate])]
    first, slots = int(reflex[place.userdata]), int(reflex[place.slots])
    data.userdata[first : first + NERVES * slots] = np.tile(signals, slots)
    data.userdata[: 2 * model.nv] = np.repeat(data.qvel, 2)
    # the first leg stands, the other swings
    data.act[int(model.actuator_actadr[body.reflexes[side]])] = 0.0 if side == 0 else 3.0
