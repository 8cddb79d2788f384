"""The steps of a trial: the ground's force on each foot, and the strides of both legs."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait_lab.trial.choices import Choices
from afo_sim.gait_lab.trial.files import WalkingTrial
from afo_sim.gait_lab.trial.ground_force import GroundForce, foot_force
from afo_sim.gait_lab.trial.leg_motion import LegMotion
from afo_sim.gait_lab.trial.leg_points import LegPoints
from afo_sim.gait_lab.trial.recorded_stride import RecordedStride
from afo_sim.gait_lab.trial.shared_steps import without_shared_steps
from afo_sim.gait_lab.trial.strides import find_strides
from afo_sim.gait_lab.trial.walking_frame import WalkingFrame

OPEN = 3.0  # difference of a closed stride's ends that is told (assumed) [deg]


def find_steps(
    trial: WalkingTrial,
    legs: Mapping[str, LegPoints],
    motions: Mapping[str, LegMotion],
    frame: WalkingFrame,
    choices: Choices,
) -> tuple[dict[str, GroundForce], list[RecordedStride], list[str]]:
    """Ground forces and strides of both legs."""
    grounds: dict[str, GroundForce] = {}
    strides: list[RecordedStride] = []
    remarks: list[str] = []
    if not trial.plates:
        raise InputError(
            "no file holds ground forces, and without them no ankle moment is known",
            file=", ".join(file.name for file in trial.files),
            allowed="columns such as ground_force_vx, _vy, _px in a .mot, or a C3D with force plates",
        )
    for side in ("right", "left"):
        if side not in motions:
            continue
        try:
            grounds[side] = foot_force(trial.plates, motions[side], legs, frame, choices)
        except InputError as error:
            if side == choices.side or choices.both:
                raise
            remarks.append(f"{side} leg: {error.problem}")
        try:
            found = find_strides(motions[side], grounds.get(side))
            straight = [stride for stride in found if _straight(stride, frame)]
            if not straight:
                raise InputError(
                    "no whole stride lies in the walk's straight part: " + "; ".join(frame.warnings)
                )
            strides += [_over_ground(stride, frame.belt_speed) for stride in straight]
        except InputError as error:
            if side == choices.side or choices.both:
                raise
            remarks.append(f"{side} leg: {error.problem}")
    return grounds, without_shared_steps(strides, trial.plates, grounds, motions, legs, frame), remarks


def open_ends(strides: Sequence[RecordedStride]) -> list[str]:
    """A warning where the two ends of a stride that was closed do not meet."""
    found = []
    for stride in strides:
        ends = {} if stride.closed is None else stride.closed.residual
        angles = {n: abs(np.degrees(v)) for n, v in ends.items() if n.endswith("_angle")}
        name = max(angles, key=angles.__getitem__, default="")
        if name and angles[name] > OPEN:
            found.append(
                f"the closed stride's ends differ by {angles[name]:.1f} deg at the {name.split('_')[0]}: "
                "bring a longer recording"
            )
    return found


def _straight(stride: RecordedStride, frame: WalkingFrame) -> bool:
    """Whether the stride lies in the straight part of a walk that turns or comes back."""
    if frame.span is None:
        return True
    margin = 0.1 * stride.time
    return frame.span[0] - margin <= stride.start and stride.end <= frame.span[1] + margin


def _over_ground(stride: RecordedStride, belt_speed: float) -> RecordedStride:
    """A closed stride whose length has the belt's way in it."""
    if stride.closed is None:
        return stride
    length = stride.closed.length + belt_speed * stride.time
    return replace(stride, closed=replace(stride.closed, length=length))
