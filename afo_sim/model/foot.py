"""The foot as a rigid body about a moving ankle: mass, inertia, its named points, and the moments on it."""

from collections.abc import Iterable
from dataclasses import dataclass

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common.errors import InputError
from afo_sim.common.units import GRAVITY

POINTS = ("heel", "ball", "toe")  # sites of the sole


@dataclass(frozen=True)
class Foot:
    """In the foot's axes from the ankle, x forward and z up with the foot flat.

    mass [kg]; centre, of mass (x, z) [m]; inertia about the ankle [kg·m²]; points, of the sole, by name
    (x, z) [m].
    """

    mass: float
    centre: tuple[float, float]
    inertia: float
    points: dict[str, tuple[float, float]]

    @property
    def ankle_height(self) -> float:
        """Of the ankle above the flat sole [m]: the lower of heel and ball."""
        return -min(self.points[name][1] for name in ("heel", "ball"))

    def frame_moment(
        self, pitch: "np.ndarray | Turn", acceleration: np.ndarray, shank_acceleration: np.ndarray
    ) -> np.ndarray:
        """Moment about the ankle that the driven shank's acceleration puts on the foot.

        I φ̈ − m (c_x a_z − c_z a_x): the foot turns with ψ = θ − φ, and its centre is carried by the ankle.

        Parameters
        ----------
        pitch : ψ, of the sole, toe up [rad] (n,)
        acceleration : of the ankle, x and z [m/s²] (n, 2)
        shank_acceleration : φ̈, knee ahead positive [rad/s²] (n,)

        Returns
        -------
        (n,) dorsiflexion positive [N·m]
        """
        x, z = turned(self.centre, pitch)
        carried = self.mass * (x * acceleration[:, 1] - z * acceleration[:, 0])
        return self.inertia * shank_acceleration - carried

    def gravity_moment(self, pitch: "np.ndarray | Turn") -> np.ndarray:
        """Weight about the ankle, dorsiflexion positive [N·m] (n,), at sole pitches [rad] (n,)."""
        return -self.mass * GRAVITY * turned(self.centre, pitch)[0]


@dataclass(frozen=True, eq=False)
class Turn:
    """Cosine and sine of the sole's pitch [-] (n,)."""

    cosine: np.ndarray
    sine: np.ndarray

    @classmethod
    def by(cls, pitch: "np.ndarray | Turn") -> "Turn":
        """Of pitches, toe up [rad]."""
        return pitch if isinstance(pitch, Turn) else cls(np.cos(pitch), np.sin(pitch))


def turned(point: tuple[float, float], pitch: np.ndarray | Turn) -> tuple[np.ndarray, np.ndarray]:
    """A point of the foot from the ankle, x forward and z up [m], at sole pitches, toe up [rad]."""
    return turned_all([point], pitch)[0]


def turned_all(
    points: Iterable[tuple[float, float]], pitch: np.ndarray | Turn
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Points of the foot as `turned` gives them."""
    turn = Turn.by(pitch)
    return [(x * turn.cosine - z * turn.sine, x * turn.sine + z * turn.cosine) for x, z in points]


def foot_of(model: mujoco.MjModel, body: str, joint: str) -> Foot:
    """The foot of a compiled model, with all that hangs on it.

    Parameters
    ----------
    model : compiled; the foot is flat where all its joints are at zero
    body, joint : names of foot and ankle

    Raises
    ------
    InputError
        The foot lacks the sites heel, ball or toe.
    """
    data = native.scratch(model)
    mujoco.mj_fwdPosition(model, data)
    foot = model.body(body).id
    ankle = data.xanchor[model.joint(joint).id]
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    dof = int(model.joint(joint).dofadr[0])
    centre = data.subtree_com[foot] - ankle
    points = {}
    for name in POINTS:
        site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, name)
        if site < 0:
            raise InputError(
                "the foot has no such site: walking needs the sole's points",
                field="leg.file",
                value=name,
                allowed=", ".join(POINTS),
            )
        place = data.site_xpos[site] - ankle
        points[name] = (float(place[0]), float(place[2]))
    return Foot(
        mass=float(model.body_subtreemass[foot]),
        centre=(float(centre[0]), float(centre[2])),
        inertia=float(full[dof, dof] - model.dof_armature[dof]),
        points=points,
    )
