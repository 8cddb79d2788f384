"""The floor under this foot, registered to the recording.

A recorded pose is wrong by millimetres and degrees, which a stiff floor answers with nonsense. So the floor
is laid, under each point of the sole and at every step, where the recorded foot carries the recorded force:
whoever walks as recorded feels what was recorded, and whoever lands otherwise is caught by the pads. Where
nothing is recorded to press, the floor is at zero, or as deep as the recorded point itself.

What the pads do not tell of the recorded force acts as recorded, whatever the foot does: the moment of the
horizontal force (the pads have no friction), and of a centre of pressure that is not between two standing
points (the rolling heel, the tip of the toe).
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common.errors import InputError
from afo_sim.common.units import GRAVITY
from afo_sim.description.walking import Ground
from afo_sim.model.foot import POINTS, Foot, turned
from afo_sim.model.walk import Walk

if TYPE_CHECKING:
    from afo_sim.description.scenario import Scenario

LOADED = 1.0  # force from which on a pad stands on the floor; below it plates only hum [N]
RAMP = 0.02  # time in which the floor passes from its own height to the recorded sole's [s]
NEAR, FAR = 0.003, 0.010  # height from which on a pad bears less, and from which on nothing [m]
NOTICED = 0.01  # lost force from which on a warning says so [body weights]
FASTEST = 0.1  # least share that the recorded velocity may leave of a pad's force [-]
STIFF = 1.0  # of (rate × time step)² of the pads; it is unstable at 4


@dataclass(frozen=True, eq=False)
class Contact:
    """The floor over the steps (n,).

    floor [m] and load [N], recorded, of each pad (n, 3); moment is what the recorded ground force has about
    the ankle beside the pads' [N·m]; shift is how far it stands ahead of the pads' centre [m]; support is
    what the body above gives so that the ankle stays where it was recorded, upward [N]. lost is the most of
    the recorded force that no floor has the pads carry, since they leave it too fast, in body weights [-].
    """

    floor: np.ndarray
    load: np.ndarray
    moment: np.ndarray
    shift: np.ndarray
    support: np.ndarray
    lost: float

    def warnings(self) -> tuple[str, ...]:
        """Warnings of recorded force that the pads cannot reproduce even on the recorded path."""
        if self.lost <= NOTICED:
            return ()
        loss = f"the pads lose up to {100.0 * self.lost:.0f} % of the body weight of the recorded force"
        return (f"{loss}, where the recorded foot leaves the floor fast: lower ground.damping",)


def pad_stiffness(ground: Ground, foot: Foot) -> dict[str, float]:
    """Of each pad [N/m], the toe's from the toe joint's stiffness over its lever from the ball."""
    lever = foot.points["toe"][0] - foot.points["ball"][0]
    return {
        "heel": ground.stiffness,
        "ball": ground.stiffness,
        "toe": min(ground.toe_stiffness / lever**2, ground.stiffness),
    }


def check_sole(foot: Foot, scenario: "Scenario") -> None:
    """Refuse a sole that the pads cannot stand on.

    Raises
    ------
    InputError
        Its points are not in order, or the pads are too stiff for the time step.
    """
    heel, ball, toe = (foot.points[name][0] for name in POINTS)
    if not heel < 0.0 < ball < toe:
        raise InputError(
            "the sole's points do not lie heel, ankle, ball, toe from back to front",
            file=scenario.leg.file,
            field="ground.mode",
            value="contact",
        )
    assert scenario.ground is not None
    stiffness = pad_stiffness(scenario.ground, foot)
    number = scenario.timestep**2 * max(
        stiffness[name] * (np.hypot(*foot.points[name]) ** 2 / foot.inertia + 1.0 / foot.mass)
        for name in POINTS
    )
    if number > STIFF:
        enough = 1e3 * scenario.timestep / np.sqrt(number)
        raise InputError(
            "the floor is too stiff for this time step",
            field="timestep",
            value=f"{1e3 * scenario.timestep:g} ms",
            allowed=f"at most {0.99 * enough:.2g} ms, or a softer ground.stiffness",
        )


def register(
    walk: Walk, foot: Foot, model: mujoco.MjModel, scenario: "Scenario", body_mass: float
) -> Contact:
    """Lay the floor so that the recorded motion carries the recorded force.

    Parameters
    ----------
    walk : recorded walking
    foot : with all that hangs on it
    model : compiled, with the joint that lets the leg sink
    scenario : with ground
    body_mass : that the recorded ground force is scaled with [kg]
    """
    ground = scenario.ground
    assert ground is not None
    pitch = walk.ankle - walk.pose[:, 2]
    points = [turned(foot.points[name], pitch) for name in POINTS]
    ahead = np.stack([x for x, _ in points], axis=1)[1:-1]
    heights = walk.pose[:, 1, None] + np.stack([z for _, z in points], axis=1)
    # as the integrator takes velocities: the step's before, through the pose it has reached
    velocity = np.diff(walk.pose[:, 1])[:-1, None] + ahead * np.diff(pitch)[:-1, None]
    velocity /= walk.timestep
    height = heights[1:-1]
    forward, upward, place = walk.cycle.ground(walk.phase[1:-1])
    weight = body_mass * GRAVITY
    load = np.maximum(weight * upward, 0.0)[:, None] * shares(place, ahead, height)
    above = np.maximum(height, 0.0) * (1.0 - standing(load > LOADED, RAMP / walk.timestep))
    stiffness = np.array(list(pad_stiffness(ground, foot).values()))
    share = 1.0 - ground.damping * velocity
    give = np.maximum(share, FASTEST)
    lost = np.sum(load * (1.0 - np.maximum(share, 0.0) / give), axis=1)
    total, turning = load.sum(axis=1), np.sum(load * ahead, axis=1)
    shift = np.where(total > LOADED, place - turning / np.maximum(total, LOADED), 0.0)
    recorded = weight * (place * upward + walk.pose[1:-1, 1] * forward)
    return Contact(
        floor=height - above + load / (stiffness * give),
        load=load,
        moment=recorded - turning,
        shift=shift,
        support=leg_force(walk, pitch, foot, model, scenario.leg.shank) - total,
        lost=float(lost.max()) / weight,
    )


def shares(place: np.ndarray, ahead: np.ndarray, height: np.ndarray) -> np.ndarray:
    """Share of the force that each pad bears, by the lever rule on the two pads beside the force.

    Of the two, one that is higher than the other and than the floor bears less: where the heel rolls, the
    centre of pressure moves ahead of it long before the ball is down.

    Parameters
    ----------
    place : of the force, ahead of the ankle [m] (n,)
    ahead, height : of heel, ball and toe, ahead of the ankle and above the floor [m] (n, 3)

    Returns
    -------
    (n, 3) from 0 to 1, sum 1
    """
    share = np.zeros_like(ahead)
    before = place < ahead[:, 1]
    for rows, back in ((before, 0), (~before, 1)):
        pair = slice(back, back + 2)
        x, z = ahead[rows, pair], height[rows, pair]
        front = np.clip((place[rows] - x[:, 0]) / np.maximum(x[:, 1] - x[:, 0], 1e-6), 0.0, 1.0)
        part = np.column_stack([1.0 - front, front])
        over = z - np.maximum(z[:, ::-1], 0.0)  # over its neighbour and the floor
        up = np.clip((over - NEAR) / (FAR - NEAR), 0.0, 1.0)
        given = part * up**2 * (3.0 - 2.0 * up)
        share[rows, pair] = part - given + given[:, ::-1]
    return share


def standing(loaded: np.ndarray, ramp: float) -> np.ndarray:
    """1 where a pad is loaded, smoothly to 0 within a ramp before and after.

    Parameters
    ----------
    loaded : mask (n, 3)
    ramp : [samples]
    """
    found = np.zeros(loaded.shape)
    sample = np.arange(len(loaded))
    for pad in range(loaded.shape[1]):
        where = np.flatnonzero(loaded[:, pad])
        if len(where):
            after = np.searchsorted(where, sample)
            ends = where[np.clip(after, 0, len(where) - 1)], where[np.clip(after - 1, 0, len(where) - 1)]
            away = np.minimum(*(np.abs(end - sample) for end in ends))
            found[:, pad] = 0.5 + 0.5 * np.cos(np.pi * np.clip(away / ramp, 0.0, 1.0))
    return found


def leg_force(walk: Walk, pitch: np.ndarray, foot: Foot, model: mujoco.MjModel, shank: str) -> np.ndarray:
    """Upward force that shank and foot need in the recorded motion: their weight and inertia [N] (n,)."""
    data = native.scratch(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    body = model.body(shank).id
    mass, centre = float(model.body_subtreemass[body]), data.subtree_com[body]
    ankle = data.xanchor[model.joint("ankle").id]
    # mass × centre of the shank alone, from the ankle
    own = mass * (centre - ankle)[[0, 2]] - foot.mass * np.array(foot.centre)
    lift = turned((float(own[0]), float(own[1])), -walk.pose[:, 2])[1]
    lift += foot.mass * turned(foot.centre, pitch)[1]
    lift += mass * walk.pose[:, 1]
    return np.diff(lift, 2) / walk.timestep**2 + mass * GRAVITY
