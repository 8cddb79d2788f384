"""The foot as a rigid body about a moving ankle, the moments on it, and its toes' hinge in the model.

The hinge is a spring about its rest angle over the gait phase:

    moment = −K (q − ρ) − c (q̇ − ρ̇),   K = k_toes + k_outsole,   ρ = k_toes r / K

r is the extension at which the toes' own spring rests (`gait/toe_extension.py`); the outsole's rests in its
own shape. Where nobody walks, the toes do not bend.
"""

import functools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import GRAVITY, Foreign, InputError, unknown
from afo_sim.description import Leg, Scenario
from afo_sim.gait import Wave
from afo_sim.gait.toe_extension import toe_extension
from afo_sim.model.outsole import POINTS, SOLE, Point, worn
from afo_sim.model.person import Size

TOE_POINTS = ("pulp", "tip")  # points of the outsole that turn with the toes
REST = "toe_rest"  # the actuator that moves the spring's rest angle
HINGE_LIMIT = 0.5  # of (rate × time step)² of the hinge at most; MuJoCo takes its spring explicitly


@dataclass(frozen=True, eq=False)
class Turn:
    """Cosine and sine of the sole's pitch [-] (n,)."""

    cosine: np.ndarray
    sine: np.ndarray

    @classmethod
    def by(cls, pitch: "np.ndarray | Turn") -> "Turn":
        """Of pitches, toe up [rad]."""
        return pitch if isinstance(pitch, Turn) else cls(np.cos(pitch), np.sin(pitch))

    def further(self, angle: np.ndarray | float) -> "Turn":
        """Turned by an angle more [rad] (n,)."""
        cosine, sine = np.cos(angle), np.sin(angle)
        return Turn(self.cosine * cosine - self.sine * sine, self.sine * cosine + self.cosine * sine)


def turned(point: tuple[float, float], pitch: np.ndarray | Turn) -> tuple[np.ndarray, np.ndarray]:
    """A point of the foot from the ankle, x forward and z up [m], at sole pitches, toe up [rad]."""
    return turned_all([point], pitch)[0]


def turned_all(
    points: Iterable[tuple[float, float]], pitch: np.ndarray | Turn
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Points of the foot as `turned` gives them."""
    places, turn = np.array([*points]), Turn.by(pitch)
    return [*zip(_along(0, places, turn), _along(1, places, turn), strict=True)]


def carried(point: tuple[float, float], pitch: np.ndarray | Turn, acceleration: np.ndarray) -> np.ndarray:
    """Moment about the ankle that accelerates a point of the foot with it, over its mass [m²/s²] (n,)."""
    x, z = turned(point, pitch)
    return x * acceleration[:, 1] - z * acceleration[:, 0]


def _along(axis: int, points: np.ndarray, turn: Turn) -> np.ndarray:
    """x (axis 0) or z (axis 1) of points (k, 2) from the ankle [m] (k, n)."""
    x, z = points.T.reshape(2, -1, *[1] * np.ndim(turn.cosine))
    return x * turn.cosine - z * turn.sine if axis == 0 else x * turn.sine + z * turn.cosine


@dataclass(frozen=True)
class ToeSegment:
    """The toes of a foot, in its axes where they are not extended."""

    hinge: tuple[float, float]  # from the ankle (x, z) [m]
    mass: float  # [kg]
    centre: tuple[float, float]  # of mass, from the hinge (x, z) [m]
    inertia: float  # about the hinge [kg·m²]

    def moment(
        self, ankle: np.ndarray, motions: "Sequence[tuple[Turn, np.ndarray, np.ndarray]]"
    ) -> np.ndarray:
        """Moment about the ankle that the toes' weight and inertia need, dorsiflexion positive [N·m] (n,)."""
        x, z, along, upward = np.zeros((4, len(ankle)))
        for point, (turn, rate, change) in zip((self.hinge, self.centre), motions, strict=True):
            ahead, above = turned(point, turn)
            x, z = x + ahead, z + above
            along = along - change * above - rate**2 * ahead
            upward = upward + change * ahead - rate**2 * above
        own = self.inertia - self.mass * (self.centre[0] ** 2 + self.centre[1] ** 2)
        carried = x * (ankle[:, 1] + upward + GRAVITY) - z * (ankle[:, 0] + along)
        return own * motions[-1][2] + self.mass * carried


@dataclass(frozen=True)
class Foot:
    """In the foot's axes from the ankle, x forward and z up with the foot flat; toes straight."""

    mass: float  # [kg]
    centre: tuple[float, float]  # of mass (x, z) [m]
    inertia: float  # about the ankle [kg·m²]
    points: dict[str, tuple[float, float]] = field(hash=False)  # of the outsole, by name (x, z) [m]
    toes: ToeSegment | None = None  # None of a rigid foot

    @property
    def shape(self) -> "Foot":
        """The same without masses: what feet of other devices share with it."""
        toes = self.toes
        still = None if toes is None else replace(toes, mass=0.0, centre=(0.0, 0.0), inertia=0.0)
        return replace(self, mass=0.0, centre=(0.0, 0.0), inertia=0.0, toes=still)

    def with_more(self, bare: "Foot", times: float) -> "Foot":
        """The foot with additional mass as a multiple of the bare one's, in the same places."""
        if times == 0.0:
            return self
        toes, more = self.toes, bare.toes
        if toes is not None and more is not None:
            mass, centre = _together(toes, more, times)
            toes = replace(toes, mass=mass, centre=centre, inertia=toes.inertia + times * more.inertia)
        mass, centre = _together(self, bare, times)
        return replace(self, mass=mass, centre=centre, inertia=self.inertia + times * bare.inertia, toes=toes)

    @property
    def level(self) -> float:
        """Pitch at which the outsole stands flat, toe up [rad]: minus the slope from heel to ball."""
        (back, low), (front, high) = self.points["heel"], self.points["ball"]
        return -math.atan2(high - low, front - back)

    @property
    def ankle_height(self) -> float:
        """Of the ankle above the floor on which the outsole stands flat [m]."""
        return -float(turned(self.points["heel"], np.array(self.level))[1])

    def outsole(
        self, pitch: "np.ndarray | Turn", extension: np.ndarray | float = 0.0
    ) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Points of the outsole from the ankle, x forward and z up [m] (n,), by name."""
        turn = Turn.by(pitch)
        toes = turn if self.toes is None else turn.further(extension)
        x, z = (self.places(axis, turn, toes) for axis in (0, 1))
        return {name: (x[k], z[k]) for k, name in enumerate(POINTS)}

    def places(self, axis: int, turn: Turn, toes: Turn) -> np.ndarray:
        """x (axis 0) or z (axis 1) of POINTS from the ankle at turns of foot and toes [m] (n_point, n)."""
        points, rigid = np.array([self.points[name] for name in POINTS]), len(POINTS) - len(TOE_POINTS)
        if self.toes is None:
            return _along(axis, points, turn)
        further, points[rigid:] = points[rigid:] - self.toes.hinge, self.toes.hinge
        found = _along(axis, points, turn)
        found[rigid:] += _along(axis, further, toes)
        return found

    def frame_moment(
        self, pitch: "np.ndarray | Turn", acceleration: np.ndarray, shank_acceleration: np.ndarray
    ) -> np.ndarray:
        """Moment about the ankle that the driven shank's acceleration puts on the foot."""
        return self.inertia * shank_acceleration - self.mass * carried(self.centre, pitch, acceleration)

    def gravity_moment(self, pitch: "np.ndarray | Turn") -> np.ndarray:
        """Weight about the ankle, dorsiflexion positive [N·m] (n,), at sole pitches [rad] (n,)."""
        return -self.mass * GRAVITY * turned(self.centre, pitch)[0]


def _together(one: Foot | ToeSegment, other: Foot | ToeSegment, times: float) -> tuple[float, Point]:
    """Mass and its centre of one, and of so many times the other."""
    mass, added = one.mass + times * other.mass, times * other.mass
    if one.centre == other.centre:
        return mass, one.centre
    x, z = ((one.mass * a + added * b) / mass for a, b in zip(one.centre, other.centre, strict=True))
    return mass, (x, z)


def foot_of(model: mujoco.MjModel, leg: Leg, joint: str) -> Foot:
    """The foot of a compiled model, with all its descendants."""
    data = native.scratch(model)
    mujoco.mj_fwdPosition(model, data)
    foot = model.body(leg.foot).id
    ankle = data.xanchor[model.joint(joint).id]
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    dof = int(model.joint(joint).dofadr[0])
    points = {}
    for name in POINTS:
        site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, f"{SOLE}{name}")
        if site < 0:
            problem = "the foot lacks some of the sole's sites, which walking needs"
            allowed = f"sites {', '.join(POINTS)}, or toe for the last two"
            raise InputError(problem, file=leg.file, field="leg.file", allowed=allowed)
        points[name] = _plane(data.site_xpos[site] - ankle)
    toes = None
    if leg.toes is not None:
        body, hinge = model.body(leg.toes.body).id, model.joint(leg.toes.joint)
        at, turning = data.xanchor[hinge.id], int(hinge.dofadr[0])
        toes = ToeSegment(
            hinge=_plane(at - ankle),
            mass=float(model.body_subtreemass[body]),
            centre=_plane(data.subtree_com[body] - at),
            inertia=float(full[turning, turning] - model.dof_armature[turning]),
        )
    return Foot(
        mass=float(model.body_subtreemass[foot]),
        centre=_plane(data.subtree_com[foot] - ankle),
        inertia=float(full[dof, dof] - model.dof_armature[dof]),
        points=points,
        toes=toes,
    )


def _plane(place: np.ndarray) -> tuple[float, float]:
    return float(place[0]), float(place[2])


def _toe_spring(scenario: Scenario, size: Size) -> tuple[float, float]:
    """Stiffness of the hinge with the outsole's [N·m/rad], and the share of it that is the toes' own [-]."""
    toes, outsole = scenario.leg.toes, worn(scenario)
    assert toes is not None
    own, sole = toes.stiffness * size.springy, 0.0
    if outsole is not None:
        sole = outsole.toe_stiffness * (1.0 if scenario.orthosis.outsole else size.springy)
    return own + sole, own / (own + sole)


@dataclass(frozen=True)
class Resting:
    """Where the hinge rests: the toes' share of its stiffness [-], their rest extension in swing [rad]."""

    share: float
    swing: float

    @classmethod
    def of(cls, scenario: Scenario) -> Self:
        """Of a scenario of walking whose leg has toes."""
        toes = scenario.leg.toes
        assert toes is not None
        return cls(_toe_spring(scenario, Size.of(scenario))[1], toes.swing_extension)

    def at(self, wave: Wave) -> np.ndarray:
        """Rest extension ρ at gait phases [rad] (n,)."""
        return self.share * _extended(self.swing, wave)


@functools.lru_cache(maxsize=8)  # cases of a sweep share it
def _extended(swing: float, wave: Wave) -> np.ndarray:
    return toe_extension(swing)(wave)


def check_name(name: str, existing: Sequence[Foreign], file: object, field: str) -> None:
    """Refuse a name that no body or joint of a leg's file has."""
    names = [element.name for element in existing if element.name]
    if name not in names:
        raise unknown(name, names, file=file, field=field, problem="the leg has no such body or joint")


def hinge_toes(spec: mujoco.MjSpec, scenario: Scenario, size: Size) -> None:
    """Give the toes' hinge its damper; weld it without walking."""
    toes, file = scenario.leg.toes, scenario.leg.file
    if toes is None:
        return
    for kind, existing in (("body", spec.bodies), ("joint", spec.joints)):
        check_name(getattr(toes, kind), existing, file, f"leg.toes.{kind}")
    joint = spec.joint(toes.joint)
    if joint.type != mujoco.mjtJoint.mjJNT_HINGE or joint.parent.name != toes.body:
        problem = f"is not the hinge of the body {toes.body!r}"
        raise InputError(problem, file=file, field="leg.toes.joint", value=toes.joint)
    if not scenario.walking:
        spec.delete(joint)
        return
    joint.damping = [size.damped * toes.damping, 0.0, 0.0]  # MuJoCo's polynomial
    stiffness = _toe_spring(scenario, size)[0]
    # Inertia that a stiff hinge needs so as not to ring at the time step [kg·m²]; 0 for soft ones
    body = spec.body(toes.body)
    inertia = float(np.max(body.inertia)) + body.mass * float(np.sum(np.square(body.ipos)))
    joint.armature += max(stiffness * scenario.timestep**2 / HINGE_LIMIT - inertia, 0.0)


def spring_toes(spec: mujoco.MjSpec, scenario: Scenario, size: Size) -> None:
    """Give the toes' hinge its spring; an orthosis' part of it is the same for all persons."""
    if scenario.leg.toes is not None and scenario.walking:
        stiffness, _ = _toe_spring(scenario, size)
        spec.joint(scenario.leg.toes.joint).stiffness = [stiffness, 0.0, 0.0]


def fill_hinge(model: mujoco.MjModel, scenario: Scenario, size: Size) -> None:
    """The same spring into a compiled model that persons share."""
    if scenario.leg.toes is not None and scenario.walking:
        joint = model.joint(scenario.leg.toes.joint).id
        model.jnt_stiffness[joint] = _toe_spring(scenario, size)[0]


def rest_moment(
    model: mujoco.MjModel, scenario: Scenario, resting: np.ndarray, timestep: float
) -> np.ndarray:
    """Input of the rest's actuator: K ρ + c ρ̇ [N·m] (n,)."""
    assert scenario.leg.toes is not None
    joint = model.joint(scenario.leg.toes.joint)
    stiffness, damping = model.jnt_stiffness[joint.id], model.dof_damping[int(joint.dofadr[0])]
    return stiffness * resting[1:-1] + damping * (resting[2:] - resting[:-2]) / (2.0 * timestep)
