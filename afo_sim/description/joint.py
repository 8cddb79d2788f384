"""Joints that muscles turn, in words: their segments, which way is positive, what lies on a segment."""

from dataclasses import dataclass
from typing import Literal

JointName = Literal["ankle", "knee", "hip", "shoulder", "elbow", "wrist", "finger", "thumb", "hinge"]
Segment = Literal["shank", "foot", "proximal", "distal"]
# {segment: what lies on it}
WORN: dict[str, str] = {"shank": "cuff", "proximal": "cuff", "foot": "plate", "distal": "plate"}


@dataclass(frozen=True)
class Joint:
    """A hinge between two segments."""

    above: str  # the proximal segment's word
    below: str  # the distal segment's word
    directions: tuple[str, str] = ("flexion", "extension")  # turning to positive, to negative angles
    turn: float = 1.0  # +1: positive angles move a hanging distal segment forward (toes up); −1: backward
    segments: tuple[Segment, Segment] = ("proximal", "distal")  # names in a description: proximal, distal

    @property
    def axis(self) -> tuple[float, float, float]:
        """Axis about which positive angles turn: forward, left, up."""
        return 0.0, -self.turn, 0.0


JOINTS: dict[JointName, Joint] = {
    "ankle": Joint("shank", "foot", ("dorsiflexion", "plantarflexion"), segments=("shank", "foot")),
    "knee": Joint("thigh", "shank", turn=-1.0),
    "hip": Joint("pelvis", "thigh"),
    "shoulder": Joint("trunk", "upper arm"),
    "elbow": Joint("upper arm", "forearm"),
    "wrist": Joint("forearm", "hand"),
    "finger": Joint("hand", "finger"),
    "thumb": Joint("hand", "thumb"),
    "hinge": Joint("fixed body", "moved body"),
}


def a_joint(name: str) -> str:
    """A joint's name behind its article."""
    return f"an {name}" if name[0] in "ae" else f"a {name}"
