"""The places on a PyMJCF leg at which cuff and plate stand: at the ankle, in the axes of shank and foot."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from afo_sim.common.errors import InputError, unknown
from afo_sim.description.attachment import Side
from afo_sim.legs.finding import Found, find
from afo_sim.legs.mjcf import tree_of

ROUNDING = 1e-12  # [m] and of unit vectors: what is nearer to a straight number is that number


@dataclass(frozen=True, eq=False)
class Place:
    """A place on a body of PyMJCF's.

    body : the element
    position : in its axes [m] (3,)
    quaternion : w, x, y, z (4,)
    """

    body: Any
    position: np.ndarray
    quaternion: np.ndarray

    def site(self, name: str) -> Any:
        """A site there, to attach to."""
        return self.body.add("site", name=name, pos=self.position, quat=self.quaternion, size=[0.005] * 3)


def found_leg(leg: Any, shank: Any, foot: Any, ankle: Any, side: Side | None, zero: float | None) -> Found:
    """A leg in the PyMJCF model of an entity, in the posture that it is described in."""
    names = {"shank": _name(leg, shank), "foot": _name(leg, foot), "ankle": _name(leg, ankle)}
    try:
        model = mujoco.MjModel.from_xml_string(leg.to_xml_string(), leg.get_assets())
    except ValueError as error:
        raise InputError(f"MuJoCo cannot compile the leg's entity: {error}", field="leg_entity") from None
    return find(tree_of(model), **names, side=side, zero=zero)


def _name(leg: Any, element: Any) -> str | None:
    if element is None or isinstance(element, str):
        return element
    return str(element.prefixed_identifier(leg.namescope))


def element(leg: Any, kind: str, name: str) -> Any:
    """The element of a name; InputError where PyMJCF has none."""
    made = leg.find(kind, name)
    if made is None:
        names = [e.full_identifier for e in leg.find_all(kind) if e.name]
        raise unknown(name, names, field=kind, problem=f"the leg's entity has no {kind} of this name")
    return made


def carrier(leg: Any, found: Found, foot: Any) -> str:
    """Name of the body that carries the plate: the named foot, else the heaviest that the ankle moves.

    The heaviest, since the talus carries no shoe, and the calcaneus does.
    """
    named = _name(leg, foot)
    if named is not None:
        return named
    model = mujoco.MjModel.from_xml_string(leg.to_xml_string(), leg.get_assets())
    return max(tree_of(model).below(found.foot), key=lambda part: part.mass).name


def places(leg: Any, found: Found, foot: str) -> dict[str, Place]:
    """{segment: place at the ankle's centre, x forward, y left, z up at an ankle angle of zero}."""
    model = mujoco.MjModel.from_xml_string(leg.to_xml_string(), leg.get_assets())
    data = mujoco.MjData(model)
    joint = model.joint(found.ankle)
    data.qpos[joint.qposadr[0]] = found.zero
    mujoco.mj_kinematics(model, data)
    made = {}
    for segment, name in (("shank", found.shank), ("foot", foot)):
        body = model.body(name).id
        turn = data.xmat[body].reshape(3, 3)
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, _straight(turn.T @ found.axes).ravel())
        position = _straight(turn.T @ (found.centre - data.xpos[body]))
        made[segment] = Place(element(leg, "body", name), position, quaternion)
    return made


def tilts(leg: Any, found: Found, foot: str) -> bool:
    """Whether other joints than the ankle turn the body that carries the plate against the shank."""
    model = mujoco.MjModel.from_xml_string(leg.to_xml_string(), leg.get_assets())
    body, shank, count = model.body(foot).id, model.body(found.shank).id, 0
    while body not in (shank, 0):
        count += int(model.body_jntnum[body])
        body = int(model.body_parentid[body])
    return count > 1


def _straight(values: np.ndarray) -> np.ndarray:
    """Values without the rounding of axes meant to be parallel; it would change a run's last bits."""
    whole = np.round(values) + 0.0
    return np.where(np.abs(values - whole) < ROUNDING, whole, values)
