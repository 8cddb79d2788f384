"""The steps of a trial: each foot's ground force and strides, less those that two feet share."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from afo_sim.common import InputError, Notice, with_code
from afo_sim.gait_lab.noted import note
from afo_sim.gait_lab.readers.plates import Plate
from afo_sim.gait_lab.trial.choices import SIDES, Choices
from afo_sim.gait_lab.trial.events import find_events
from afo_sim.gait_lab.trial.files import WalkingTrial
from afo_sim.gait_lab.trial.ground_force import EDGE, GroundForce, foot_force, stands_there
from afo_sim.gait_lab.trial.leg_motion import LegMotion
from afo_sim.gait_lab.trial.leg_points import Legs
from afo_sim.gait_lab.trial.recorded_stride import FORCE, RecordedStride
from afo_sim.gait_lab.trial.strides import find_strides
from afo_sim.gait_lab.trial.walking_frame import WalkingFrame

_LAME = 0.9  # twice one foot's stance that no lame foot is below, as a share of the stride [-]; assumed
_OPEN = 3.0  # difference of a closed stride's ends that is reported (assumed) [deg]

_ELSEWHERE = 0.08  # share of the weight on other plates while the other foot swings (assumed) [-]
_MIDDLE = (0.2, 0.8)  # part of the other foot's swing in which it surely stands nowhere (assumed) [-]


def find_steps(
    trial: WalkingTrial, legs: Legs, motions: Mapping[str, LegMotion], frame: WalkingFrame, choices: Choices
) -> tuple[dict[str, GroundForce], list[RecordedStride], list[Notice]]:
    """Ground forces and strides of both legs."""
    grounds: dict[str, GroundForce] = {}
    strides: list[RecordedStride] = []
    notices: list[Notice] = []
    if not trial.plates:
        left_out = with_code(trial.notices, "plate-left-out")[:4]
        why = "; ".join(left_out) or "no file holds ground forces"
        file = None if left_out else ", ".join(file.name for file in trial.files)
        allowed = "columns such as ground_force_vx, _vy, _px in a .mot, or a C3D "
        allowed += "whose plates are of types 1 to 4"
        problem = f"{why}; without ground forces no ankle moment is known"
        raise InputError(problem, file=file, allowed=allowed)

    def force(side: str) -> GroundForce:
        return foot_force(trial.plates, motions[side], legs, frame, choices)

    for side in (side for side in SIDES if side in motions):
        try:
            grounds[side] = force(side)
        except InputError as error:
            if side == choices.side or choices.both:
                raise _with_other_foot(error, force, motions.keys() - {side}) from None
            notices.append(_unused_leg(side, error))
        try:
            other = motions.get("left" if side == "right" else "right")
            found = find_strides(motions[side], grounds.get(side), other)
            straight = [stride for stride in found if _straight(stride, frame)]
            if not straight:
                turns = "; ".join(frame.warnings)
                problem = f"no whole stride lies in the walk's straight part: {turns}"
                raise InputError(problem, allowed="a stride or more straight ahead")
            for stride in straight:
                if stride.closed is not None:  # whose length then has the belt's way in it
                    length = stride.closed.length + frame.belt_speed * stride.time
                    stride = replace(stride, closed=replace(stride.closed, length=length))
                strides.append(stride)
        except InputError as error:
            if side == choices.side or choices.both:
                raise
            notices.append(_unused_leg(side, error))
    _refuse_running(strides)
    swings = {side: _swings(motion) for side, motion in motions.items()}
    kept = []  # those whose foot stands on a second plate as well are not loaded, and say so
    for stride in strides:
        beside = "left" if stride.side == "right" else "right"
        judged = stride.loaded and stride.closed is None and stride.side in grounds and beside in swings
        during = [(a, b) for a, b in swings.get(beside, ()) if stride.start < a and b < stride.toe_off]
        lost = _lost(stride.side, during, trial.plates, grounds, legs, frame) if judged and during else 0.0
        if lost > _ELSEWHERE:
            seen = f"{100.0 * lost:.0f} % of the weight stands on another plate while the other foot swings"
            stride = replace(stride, loaded=False, missing=f"the ground force is missing in part ({seen})")
        kept.append(stride)
    return grounds, kept, notices


def _with_other_foot(
    error: InputError, find: Callable[[str], GroundForce], sides: Iterable[str]
) -> InputError:
    """Why a foot is on no plate; where another one is, that as the way out."""
    for other in sides:
        with suppress(InputError):
            seen = [f"plate {c.plate} from {c.start:.2f} to {c.end:.2f} s" for c in find(other).contacts[:4]]
            problem = f"{error.problem}; the {other} foot is on {', '.join(seen)}"
            return error.replaced(problem=problem, allowed=other)
    return error


def _refuse_running(strides: Sequence[RecordedStride]) -> None:
    """Refuse strides with a flight phase: the feet of a walker stand for more than a stride together."""
    duty: dict[str, list[float]] = {}
    for stride in strides:
        if stride.loaded and stride.start_by == FORCE:
            duty.setdefault(stride.side, []).append((stride.toe_off - stride.start) / stride.time)
    means = {side: float(np.mean(each)) for side, each in duty.items()}
    if duty and 2.0 * sum(means.values()) / len(means) < (1.0 if len(means) == 2 else _LAME):
        each = " and ".join(f"the {side} foot {100.0 * mean:.1f} %" for side, mean in means.items())
        seen = f"the walker runs: {each} of the stride on its plate, so at times both feet are off the floor"
        raise InputError(seen, allowed="a walk, in which both feet together stand for more than a stride")


def _unused_leg(side: str, error: InputError) -> Notice:
    return note("leg-unused", "{subject} leg: {problem}", subject=side, problem=error.problem)


def open_ends(strides: Sequence[RecordedStride]) -> list[Notice]:
    """A warning where the two ends of a stride that was closed do not meet."""
    found = []
    for stride in strides:
        ends = {} if stride.closed is None else stride.closed.residual
        angles = {n: float(abs(np.degrees(v))) for n, v in ends.items() if n.endswith("_angle")}
        name = max(angles, key=angles.__getitem__, default="")
        if name and angles[name] > _OPEN:
            text = "the closed stride's ends differ by {apart:.1f} deg at the {joint}: "
            text += "bring a longer recording"
            joint = name.removesuffix("_angle")
            found.append(Notice("ends-open", text, subject=stride.side, apart=angles[name], joint=joint))
    return found


def _straight(stride: RecordedStride, frame: WalkingFrame) -> bool:
    """Whether the stride lies in the straight part of a walk that turns or comes back."""
    if frame.span is None:
        return True
    margin = 0.1 * stride.time
    return frame.span[0] - margin <= stride.start and stride.end <= frame.span[1] + margin


def _swings(motion: LegMotion) -> list[tuple[float, float]]:
    """The middle of each swing of a foot [s]."""
    events = find_events(motion)
    found = []
    for off in events.toe_offs:
        strike = next((time for time in events.strikes if time > off), None)
        if strike is not None and strike - off < events.stride_time:
            found.append((off + _MIDDLE[0] * (strike - off), off + _MIDDLE[1] * (strike - off)))
    return found


def _lost(
    side: str, during: Sequence[tuple[float, float]], plates: Sequence[Plate],
    grounds: Mapping[str, GroundForce], legs: Legs, frame: WalkingFrame,
) -> float:  # fmt: skip
    """Share of what presses under a foot that is not counted for it [-]."""
    own = grounds[side]
    inside = _within(own.time, during)
    carried = 0.0
    for plate in plates:
        if plate.name not in own.plates:
            continue
        time, force = own.plates[plate.name]
        pressed = _within(time, during) & (force > EDGE)
        if np.any(pressed) and stands_there(time[pressed], plate.place[pressed], side, legs, frame):
            carried += float(np.mean(np.interp(own.time[inside], time, force)))
    return 1.0 - float(np.mean(own.force_z[inside])) / carried if carried > 0.0 else 0.0


def _within(time: np.ndarray, spans: Sequence[tuple[float, float]]) -> np.ndarray:
    found = np.zeros(len(time), dtype=bool)
    for start, end in spans:
        found |= (time >= start) & (time <= end)
    return found
