"""The leg that an OpenSim model describes: its bodies, its joint centres, and the points of its foot."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait_lab.readers.opensim_joint import Joint
from afo_sim.gait_lab.readers.opensim_model import OpenSimModel
from afo_sim.gait_lab.trial.model_foot import ModelFoot, find_foot

# Names of bodies by segment, without side and punctuation; the first is OpenSim's own
NAMES = {
    "pelvis": ("pelvis", "hip", "hips"),
    "thigh": ("femur", "thigh", "upperleg"),
    "shank": ("tibia", "shank", "lowerleg", "tibfib", "shin"),
    "foot": ("calcn", "calcaneus", "foot", "hindfoot", "rearfoot", "calc"),
    "toes": ("toes", "toe", "forefoot", "phalanges"),
}


@dataclass(frozen=True, eq=False)
class ModelJoint:
    """A joint of the leg, and its centre as a fixed point of both bodies that it connects.

    The centre moves with the distal body. On the proximal one it stands where the default coordinates put
    it: a knee that slides as it bends has it elsewhere at other angles.
    """

    joint: Joint  # the first one between the two that can move
    proximal: np.ndarray  # centre in the proximal body's axes, by default [m] (3,)
    distal: np.ndarray  # in the distal body's axes [m] (3,)


@dataclass(frozen=True, eq=False)
class ModelLeg:
    """One leg of a model."""

    side: str
    bodies: Mapping[str, str]  # segment: the model's body; no toes where the model has none
    hip: ModelJoint
    knee: ModelJoint
    ankle: ModelJoint
    foot: ModelFoot  # its points in the axes of the foot's body, toes straight

    @property
    def points(self) -> dict[str, tuple[str, np.ndarray]]:
        """The leg's points by role: the segment that shows each, and its place there [m] (3,)."""
        return {
            "hip": ("thigh", self.hip.distal),
            "knee": ("shank", self.knee.distal),
            "ankle": ("shank", self.ankle.proximal),
            "heel": ("foot", self.foot.heel),
            "toe": ("foot", self.foot.toe),
        }


def find_leg(model: OpenSimModel, side: str) -> ModelLeg:
    """Find a leg by the names of its bodies, and its joints between them."""
    bodies, missing = {}, []
    for segment, names in NAMES.items():
        found = [
            body for body in model.bodies if _called(body, names, "" if segment == "pelvis" else side[0])
        ]
        if found:
            bodies[segment] = found[0]
        elif segment != "toes":
            missing.append(f"{segment} ({names[0]}{'' if segment == 'pelvis' else '_' + side[0]})")
    if missing:
        raise InputError(
            f"has no {side} leg: no body for {', '.join(missing)}",
            file=model.file,
            allowed=f"bodies named as OpenSim's gait models have them; there are {', '.join(model.bodies)}",
        )
    hip, knee, ankle = (
        _joint(model, bodies[a], bodies[b])
        for a, b in (("pelvis", "thigh"), ("thigh", "shank"), ("shank", "foot"))
    )
    foot = find_foot(model, bodies["foot"], bodies.get("toes"), ankle.distal)
    return ModelLeg(side, bodies, hip, knee, ankle, foot)


def knee_on_thigh(model: OpenSimModel, leg: ModelLeg, turn: np.ndarray) -> np.ndarray:
    """The knee's centre in the thigh's axes at the knee angle that a fit shows [m] (n, 3).

    Of all angles that the model allows, in steps of a 500th, the one whose rotation is nearest counts. A knee
    of several coordinates keeps its default place.

    Units: turn (n, 3, 3).
    """
    coordinates = [c for c in leg.knee.joint.coordinates if c.rotational]
    if len(coordinates) != 1 or not np.isfinite(coordinates[0].limits).all():
        return np.where(np.isfinite(turn[:, :1, 0]), leg.knee.proximal, np.nan)
    angles = np.linspace(*coordinates[0].limits, 501)
    allowed = model.pose(leg.bodies["thigh"], leg.bodies["shank"], {coordinates[0].name: angles})
    known = np.isfinite(turn).all(axis=(1, 2))
    likeness = np.einsum("nij,aij->na", np.where(known[:, None, None], turn, 0.0), allowed.rotation)
    places = allowed.point(leg.knee.distal)[np.argmax(likeness, axis=1)]
    return np.where(known[:, None], places, np.nan)


def _called(body: str, names: tuple[str, ...], letter: str) -> bool:
    """Whether a body has one of the names, with the side's letter or word before or after it."""
    plain = re.sub("[^a-z]", "", body.lower())
    word = {"r": "right", "l": "left", "": ""}[letter]
    return any(plain in (n + letter, letter + n, n + word, word + n) for n in names)


def _joint(model: OpenSimModel, proximal: str, distal: str) -> ModelJoint:
    steps = [step for step in model.path(proximal, distal) if step[0].coordinates]
    if not steps:
        raise InputError(f"has no joint that moves between {proximal} and {distal}", file=model.file)
    joint, outward = steps[0]
    body, frame = (joint.child, joint.in_child) if outward else (joint.parent, joint.in_parent)
    distal_place = model.pose(distal, body, {}).point(frame.position[0])
    return ModelJoint(joint, model.pose(proximal, distal, {}).point(distal_place)[0], distal_place[0])
