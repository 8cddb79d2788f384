"""The floor under this foot, registered to the recording.

A recorded pose is wrong by millimetres and degrees, which a stiff floor answers with nonsense. So the floor
is laid, under each point of the sole and at every step, where the recorded foot carries the recorded force:
whoever walks as recorded feels what was recorded, and whoever lands otherwise is caught by the pads. Where
nothing is recorded to press, the floor is at zero, or as deep as the recorded point itself.

What the pads do not carry of the recorded force acts as recorded, whatever the foot does: the moment of the
horizontal force (the pads have no friction), of a centre of pressure that is not between two standing points
(the rolling heel, the tip of the toe), of what pads lose under a foot that rises fast, and what plates hum
while the foot is in the air.

The load on the pulp bends the toes about their hinge. In the recorded walking their own flexors bear it: they
give its moment about the hinge, less what weight and inertia of the toes need, as recorded, whatever the foot
does. So the recorded walker's toes stand at their rest extension, and who lands otherwise bends them against
their spring. The long flexors lie with the ankle's plantarflexors, and a described patient has as much
strength left of them (assumed); in a patient's own walk they give what they gave. The horizontal force is
borne by the flexors, too: both act as recorded and cancel, so that neither is in the hinge. Nothing recorded
presses on the tip. Its pad stops toes that drag.
"""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import GRAVITY, Doubles, InputError, Keywords, Notice
from afo_sim.description import Ground
from afo_sim.model.foot import TOE_POINTS, Foot, turned
from afo_sim.model.outsole import BEARING, padded
from afo_sim.model.person import USUAL_GROUND, Size, walker_of
from afo_sim.model.walk import Walk
from afo_sim.physics import kernels

if TYPE_CHECKING:
    from afo_sim.description import Scenario

LOADED = 1.0  # force from which on a pad stands on the floor; below it plates only hum [N]
RAMP = 0.02  # time in which the floor passes from its own height to the recorded sole's [s]
NEAR, FAR = 0.003, 0.010  # height from which on a pad bears less, and from which on nothing [m]
NOTICED = 0.01  # lost force from which on a warning says so [body weights]
FASTEST = 0.1  # least share that the recorded velocity may leave of a pad's force [-]
PAD_LIMIT = 8.0  # greatest (natural frequency × time step)² of a foot on its pads; by error of steps [-]
TOE_JOINT = 25.0  # of a leg without toes, as PredSim's [N·m/rad]


@dataclass(frozen=True, eq=False)
class Contact:
    """The floor over the steps (n,), and how its pads bear (n, n_pad)."""

    floor: np.ndarray  # recorded, under each pad [m]
    load: np.ndarray  # recorded, on each pad [N]
    moment: np.ndarray  # what the recorded ground force has about the ankle beside the pads' [N·m]
    shift: np.ndarray  # how far it stands ahead of the pads' centre [m]
    support: np.ndarray  # upward, what the body above gives so that the ankle stays where it was recorded [N]
    warnings: tuple[Notice, ...]  # of recorded force that no floor has the pads carry
    loaded: float = LOADED  # force from which on a pad stands on the floor [N]
    flexors: np.ndarray | None = None  # the toes' own muscles', extension positive [N·m]; None: rigid


def ground_of(scenario: "Scenario", size: Size) -> Ground:
    """The ground that a person of a size feels as one of the leg's size feels the scenario's."""
    return _felt(scenario.ground or USUAL_GROUND, size)


@functools.lru_cache(maxsize=4)  # a case asks three times
def _felt(ground: Ground, size: Size) -> Ground:
    stiffer = size.heavier / size.taller
    joint = TOE_JOINT if ground.toe_stiffness is None else ground.toe_stiffness
    # a copy is not checked again: the bounds are of a person of the leg's size
    return ground.model_copy(
        update={
            "stiffness": ground.stiffness * stiffer,
            "damping": ground.damping / size.slower,
            "toe_stiffness": joint * size.springy,
            "body_stiffness": ground.body_stiffness * stiffer,
            "body_damping": ground.body_damping * stiffer * size.slower,
        }
    )


def pad_stiffness(ground: Ground, foot: Foot) -> dict[str, float]:
    """Of each pad [N/m]; under the toe of a rigid foot a toe joint's, over its lever from the ball."""
    stiffness = dict.fromkeys(padded(foot.toes), ground.stiffness)
    if foot.toes is None:
        lever = foot.points["pulp"][0] - foot.points["ball"][0]
        joint = TOE_JOINT if ground.toe_stiffness is None else ground.toe_stiffness
        stiffness["pulp"] = min(joint / lever**2, ground.stiffness)
    return stiffness


def check_sole(foot: Foot, scenario: "Scenario") -> None:
    """Refuse a sole that the pads cannot represent."""
    heel, ball, toe = (foot.points[name][0] for name in BEARING)
    if not heel < 0.0 < ball < toe:
        problem = "the sole's points do not lie heel, ankle, ball, toe from back to front"
        raise InputError(problem, file=scenario.leg.file, field="ground.mode", value="contact")
    stiffness = pad_stiffness(ground_of(scenario, Size.of(scenario)), foot)
    number = scenario.timestep**2 * max(
        stiffness[name] * (np.hypot(*foot.points[name]) ** 2 / foot.inertia + 1.0 / foot.mass)
        for name in BEARING
    )
    if number > PAD_LIMIT:
        step = 1e3 * scenario.timestep
        allowed = f"at most {0.99 * step * np.sqrt(PAD_LIMIT / number):.2g} ms, or a softer ground.stiffness"
        problem = "the floor is too stiff for this time step"
        raise InputError(problem, field="timestep", value=f"{step:g} ms", allowed=allowed)


@dataclass(frozen=True)
class _Borne:
    """What the registered floor takes of a compiled model."""

    mass: float  # of shank and foot [kg]
    shank: tuple[float, float]  # its mass times its centre's place from the ankle (x, z) [kg·m]
    armature: float  # of the toes' hinge [kg·m²]

    @classmethod
    def of(cls, model: mujoco.MjModel, foot: Foot, scenario: "Scenario") -> "_Borne":
        """Of a leg with what it wears."""
        data = native.scratch(model)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        body = model.body(scenario.leg.shank).id
        mass, centre = float(model.body_subtreemass[body]), data.subtree_com[body]
        ankle = data.xanchor[model.joint("ankle").id]
        x, z = (mass * (centre - ankle)[[0, 2]] - foot.mass * np.array(foot.centre)).tolist()
        toes = scenario.leg.toes
        armature = 0.0 if toes is None else float(model.dof_armature[int(model.joint(toes.joint).dofadr[0])])
        return cls(mass, (x, z), armature)


def register(
    walk: Walk, foot: Foot, model: mujoco.MjModel, scenario: "Scenario", body_mass: float
) -> Contact:
    """Lay the floor so that the recorded motion carries the recorded force."""
    size, patient = Size.of(scenario), scenario.patient
    assert patient is not None
    left = 1.0 if walker_of(scenario) == "patient" else patient.plantarflexor_strength
    carried = _Borne.of(model, foot, scenario)
    return _registered(walk, foot, carried, ground_of(scenario, size), size, body_mass * GRAVITY, left)


# Cases of a sweep share it.
@functools.lru_cache(maxsize=8)
def _registered(
    walk: Walk, foot: Foot, leg: _Borne, ground: Ground, size: Size, weight: float, left: float
) -> Contact:
    """The same, with what is left of the toe flexors' strength."""
    ahead, height, lever, velocity = _placed_pads(walk, foot)
    _, upward, place = (signal[1:-1] for signal in walk.ground)
    least = size.heavier * LOADED
    pressed = np.maximum(weight * upward, 0.0)[:, None] * shares(place, ahead, height, size.taller)
    ramp = size.slower * RAMP / walk.timestep
    # what lies beyond the ends of whole strides stands a stride away
    over, phase, more = pressed - least, walk.phase[1:-1], math.ceil(ramp) + 1
    back, forward = np.searchsorted(phase, [phase[-1] - 1.0, phase[0] + 1.0])
    after = over[back + 1 : back + 1 + more] if phase[-1] - 1.0 >= phase[0] else over[:0]
    before = over[max(forward - more, 0) : forward] if phase[0] + 1.0 <= phase[-1] else over[:0]
    stands = standing(np.concatenate([before, over, after]), ramp)[len(before) : len(before) + len(over)]
    stiffness = np.array(list(pad_stiffness(ground, foot).values()))
    floor, load, borne = np.empty_like(pressed), np.empty_like(pressed), np.empty((len(pressed), 4))
    arrays = (pressed, stands, height, velocity, ahead, lever, stiffness, floor, load, borne)
    _run(_carried, ground.damping, *pressed.shape, *arrays)
    total, turning, given, lost = borne.T
    fastest = float(np.max(velocity, where=pressed > least, initial=0.0)) / size.slower
    flexors, toes = None, foot.toes
    if walk.toe is not None:  # weight and inertia of toes that stand at their rest extension, about the hinge
        assert toes is not None
        square = walk.timestep**2
        hinge = [np.diff(at, 2) / square for at in turned(toes.hinge, walk.sole)]
        along, rising = (hinge[i] + walk.acceleration[:, i] for i in range(2))
        x, z = (at[1:-1] for at in turned(toes.centre, walk.toes))
        extending = np.diff(walk.toe, 2) / square
        own = toes.inertia * (walk.turning + extending) + leg.armature * extending
        flexors = own + toes.mass * (x * (rising + GRAVITY) - z * along) - left * given
    # upward force that shank and foot need in the recorded motion: their weight and inertia [N] (n,)
    lift = turned(leg.shank, walk.shank)[1]
    lift += foot.mass * turned(foot.centre, walk.sole)[1]
    if foot.toes is not None and walk.toe is not None:  # the foot's centre is that of straight toes
        straight, bent = (turned(foot.toes.centre, turn)[1] for turn in (walk.sole, walk.toes))
        lift += foot.toes.mass * (bent - straight)
    lift += leg.mass * walk.pose[:, 1]
    borne_by_leg = np.diff(lift, 2) / walk.timestep**2 + leg.mass * GRAVITY
    return Contact(
        floor=floor,
        load=load,
        moment=weight * walk.ground_lever - turning,
        shift=np.where(total > least, place - turning / np.maximum(total, least), 0.0),
        support=borne_by_leg - total,
        warnings=_lost(lost / weight, walk.phase[1:-1], fastest),
        loaded=least,
        flexors=flexors,
    )


def _run(kernel: Callable[..., float], number: float, steps: int, pads: int, *arrays: np.ndarray) -> None:
    """Let a kernel write into the last ones of arrays (steps, pads)."""
    (compiled,) = COMPILED[kernel]()
    flat = [np.ascontiguousarray(array) for array in arrays]
    compiled(number, steps, pads, *[array.ctypes.data for array in flat])


def _carried(
    damping: float, steps: int, pads: int, pressed: Doubles, stands: Doubles, height: Doubles,
    velocity: Doubles, ahead: Doubles, lever: Doubles, stiffness: Doubles, floor: Doubles, load: Doubles,
    borne: Doubles,
) -> float:  # fmt: skip
    """Floor and load of each pad; of all force, its moments about ankle and toes' hinge, what is lost."""
    for k in range(steps):
        total = turning = given = lost = 0.0
        for pad in range(pads):
            i, stiff = k * pads + pad, stiffness[pad]
            above = max(height[i], 0.0) * (1.0 - stands[i])
            share = 1.0 - damping * velocity[i]
            give = max(share, FASTEST)
            # a pad in the air bears no hum of the plates
            bears = max(pressed[i] - stiff * give * above, 0.0)
            carries = bears * max(share, 0.0) / give
            floor[i], load[i] = height[i] - above + pressed[i] / (stiff * give), bears
            total += carries
            turning += carries * ahead[i]
            given += carries * lever[i]
            lost += bears - carries
        borne[4 * k], borne[4 * k + 1], borne[4 * k + 2], borne[4 * k + 3] = total, turning, given, lost
    return 0.0


def _lost(force: np.ndarray, phase: np.ndarray, fastest: float) -> tuple[Notice, ...]:
    """A warning where pads lose force [body weights], since the recorded foot rises too fast [m/s]."""
    worst = int(np.argmax(force))
    most, at = float(force[worst]), float(phase[worst]) % 1.0
    if most <= NOTICED:
        return ()
    text = (
        f"the pads lose up to {100.0 * most:.0f} % of body weight of the recorded force at "
        f"{100.0 * at:.0f} % of the stride, where the recorded foot leaves the floor fast: "
        "lower {subject} to {damping:.2f} s/m"
    )
    enough = (1.0 - FASTEST) / max(fastest, 1e-3)  # loses nothing
    hundredth = math.floor(100.0 * enough) / 100.0
    told: Keywords = {"lost": most, "phase": at, "damping": hundredth}
    return (Notice("ground-force-lost", text, subject="ground.damping", **told),)


def _placed_pads(walk: Walk, foot: Foot) -> tuple[np.ndarray, ...]:
    """Where the pads are in the recorded walk: ahead of the ankle and above the floor [m], ahead of the toes'
    hinge [m], 0 of those that the toes do not turn, and how fast they rise [m/s] (n, n_pad)."""
    names = padded(foot.toes)
    hinge = (0.0, 0.0) if foot.toes is None else foot.toes.hinge
    bends = [0.0 if foot.toes is None else float(name in TOE_POINTS) for name in names]
    points = np.array([(*foot.points[name], turns) for name, turns in zip(names, bends, strict=True)])
    toe = np.zeros(len(walk.phase)) if walk.toe is None else walk.toe
    turns = walk.sole.cosine, walk.sole.sine, walk.toes.cosine, walk.toes.sine
    moves = np.ascontiguousarray(walk.pose[:, 1]), walk.ankle - walk.pose[:, 2], toe
    found = tuple(np.empty((len(toe) - 2, len(names))) for _ in range(4))
    numbers = np.array([*hinge, 2.0 * walk.timestep])
    _run(_placed, 0.0, *found[0].shape, numbers, points, *turns, *moves, *found)
    return found


def _placed(
    _: float, steps: int, pads: int, p: Doubles, points: Doubles, cosine: Doubles, sine: Doubles,
    toe_cosine: Doubles, toe_sine: Doubles, z: Doubles, pitch: Doubles, toe: Doubles, ahead: Doubles,
    height: Doubles, lever: Doubles, velocity: Doubles,
) -> float:  # fmt: skip
    for k in range(steps):
        c, s, toe_c, toe_s = cosine[k + 1], sine[k + 1], toe_cosine[k + 1], toe_sine[k + 1]
        hinge_x, hinge_z = p[0] * c - p[1] * s, p[0] * s + p[1] * c
        for pad in range(pads):
            i, x, up = k * pads + pad, points[3 * pad], points[3 * pad + 1]
            arm = 0.0
            if points[3 * pad + 2] > 0.0:
                x, up = x - p[0], up - p[1]
                arm = x * toe_c - up * toe_s
                x, up = hinge_x + arm, hinge_z + x * toe_s + up * toe_c
            else:
                x, up = x * c - up * s, x * s + up * c
            # as the integrator takes velocities: the mean of the steps before and after
            rise = z[k + 2] - z[k] + x * (pitch[k + 2] - pitch[k]) + arm * (toe[k + 2] - toe[k])
            ahead[i], height[i], lever[i], velocity[i] = x, z[k + 1] + up, arm, rise / p[2]
    return 0.0


def shares(place: np.ndarray, ahead: np.ndarray, height: np.ndarray, taller: float = 1.0) -> np.ndarray:
    """Share of the force that each pad bears, by the lever rule on the two pads beside the force."""
    found = np.zeros_like(ahead)
    _run(_shared, taller, *ahead.shape, place, ahead, height, found)
    return found


def _shared(
    taller: float, steps: int, pads: int, place: Doubles, ahead: Doubles, height: Doubles, found: Doubles
) -> float:
    for k in range(steps):
        i = k * pads + (0 if place[k] < ahead[k * pads + 1] else 1)
        front = (place[k] - ahead[i]) / max(ahead[i + 1] - ahead[i], 1e-6)
        front = min(max(front, 0.0), 1.0)
        given = 0.0  # by the pad in front to the one behind
        for part, own, other, sign in (
            (1.0 - front, height[i], height[i + 1], -1.0),
            (front, height[i + 1], height[i], 1.0),
        ):
            over = own - max(other, 0.0)  # over its neighbour and the floor
            up = min(max((over / taller - NEAR) / (FAR - NEAR), 0.0), 1.0)
            given += sign * part * up * up * (3.0 - 2.0 * up)
        found[i], found[i + 1] = 1.0 - front + given, front - given
    return 0.0


def standing(over: np.ndarray, ramp: float) -> np.ndarray:
    """1 where a pad is loaded, smoothly to 0 within a ramp before and after."""
    found = np.empty(over.shape)
    _run(_stands, ramp, *over.shape, over, found)
    return found


def _stands(ramp: float, steps: int, pads: int, over: Doubles, found: Doubles) -> float:
    for pad in range(pads):
        edge = -math.inf  # where the load begins or ends, the last one so far
        for k in range(steps):
            i = k * pads + pad
            if k > 0 and (over[i] > 0.0) != (over[i - pads] > 0.0):
                edge = k - 1 + over[i - pads] / (over[i - pads] - over[i])
            found[i] = k - edge
        edge = math.inf  # the next one
        for k in range(steps - 1, -1, -1):
            i = k * pads + pad
            if k < steps - 1 and (over[i] > 0.0) != (over[i + pads] > 0.0):
                edge = k + over[i] / (over[i] - over[i + pads])
            away = min(found[i], edge - k) / ramp
            found[i] = 1.0 if over[i] > 0.0 else 0.0
            if over[i] <= 0.0 and away < 1.0:
                found[i] = 0.5 + 0.5 * math.cos(math.pi * away)
    return 0.0


COMPILED = {
    kernel: kernels(f"pads{kernel.__name__}", kernel, rooms=("model",))
    for kernel in (_placed, _shared, _stands, _carried)
}
