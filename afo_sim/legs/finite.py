"""Numbers of a tree that are none."""

from collections.abc import Iterator

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.legs.tree import Joint, Part, Tree

OF_A_PART = ("pose", "mass", "centre", "inertia")
OF_A_JOINT = ("axis", "position", "damping", "friction", "armature", "stiffness", "spring_reference", "zero")


def check_finite(tree: Tree) -> None:
    """Refuse a tree with a number that is not finite."""
    found = [
        InputError("is not finite", file=tree.file, field=field)
        for part in tree.parts.values()
        for field in (
            *_part_fields(part),
            *(field for joint in part.joints for field in _joint_fields(joint)),
        )
    ]
    if found:
        found[0].others = tuple(found[1:])
        raise found[0]


def _part_fields(part: Part) -> Iterator[str]:
    for name in OF_A_PART:
        if not np.isfinite(getattr(part, name)).all():
            yield f"part {part.name!r}: {name}"
    for name, place in part.points.items():
        if not np.isfinite(place).all():
            yield f"part {part.name!r}: point {name!r}"
    for shape in part.shapes:
        if not all(np.isfinite(numbers).all() for numbers in (shape.pose, shape.size, shape.vertices)):
            yield f"part {part.name!r}: shape {shape.name!r}"


def _joint_fields(joint: Joint) -> Iterator[str]:
    for name in OF_A_JOINT:
        if not np.isfinite(getattr(joint, name)).all():
            yield f"joint {joint.name!r}: {name}"
    if joint.range is not None and not np.isfinite(joint.range).all():
        yield f"joint {joint.name!r}: range"
