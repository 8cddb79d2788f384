"""Cutting: the signals of a stride over its phase, as a gait cycle; its ankle zero and height."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from afo_sim.common import GRAVITY, InputError, Notice
from afo_sim.gait import COP_FORCE, LATE_SWING, MOMENT_ERROR, RANGES, GaitCycle, flat_part
from afo_sim.gait_lab.noted import Noted, note
from afo_sim.gait_lab.readers.opensim_table import OpenSimTable
from afo_sim.gait_lab.readers.signals import evenly, fill_gaps
from afo_sim.gait_lab.trial.choices import Choices
from afo_sim.gait_lab.trial.files import WalkingTrial
from afo_sim.gait_lab.trial.ground_force import GroundForce
from afo_sim.gait_lab.trial.leg_motion import LegMotion, from_points
from afo_sim.gait_lab.trial.leg_points import LegPoints
from afo_sim.gait_lab.trial.recorded_stride import FORCE, RecordedStride, sample
from afo_sim.gait_lab.trial.walking_frame import WalkingFrame

# What a cycle's notes say of a moment that no file gave.
FROM_GROUND_FORCE = "derived from ground force and centre of pressure, the foot taken as massless"
_LIGHT = 30.0  # force below which an adult's centre of pressure means nothing; a child's goes by weight [N]

# Pitch of the sole where it should lie flat, from which on it does not: a model's sole is pitched by 0.7 to
# 4.3 deg there in eight legs of two healthy adults, so twice the most (derived) [deg].
_RAISED = 8.0
_CHAIN_ERROR = 0.03  # of typed lengths together; 1 cm costs about 0.05 N·m/kg (assumed) [m]


@dataclass(frozen=True, eq=False)
class Cutter(Noted):
    """One leg's motion and ground force, calibrated by the flat foot of all its strides."""

    motion: LegMotion
    closed_motion: LegMotion | None  # of the stride that is closed cyclically, if there is one
    ground: GroundForce | None
    belt_speed: float  # [m/s]
    mass: float  # of the body [kg]
    choices: Choices
    zero: float  # to take out of the ankle angle [rad]
    lift: float  # to add to the ankle's height [m]
    notices: tuple[Notice, ...]

    @classmethod
    def of(
        cls, strides: Sequence[RecordedStride], leg: LegPoints, motion: LegMotion, ground: GroundForce | None,
        frame: WalkingFrame, mass: float, choices: Choices,
    ) -> Self:  # fmt: skip
        """Calibrate by the part of all strides in which the sole lies flat: its pitch, the ankle's height."""
        closed = next((stride for stride in strides if stride.closed is not None), None)
        # the motion of a closed stride is filtered as if it went on for ever
        again = None if closed is None else from_points(leg, frame, choices.cutoff, closed)
        plain = cls(motion, again, ground, frame.belt_speed, mass, choices, 0.0, 0.0, ())
        pitch, height = np.vstack([plain._flat(stride) for stride in strides]).mean(axis=0)
        zero, calibration = _ankle_zero(float(pitch), leg.sole, choices.keep_zero)
        notices = [calibration]
        lift = 0.0 if choices.ankle_height is None else choices.ankle_height - height
        _require_height(float(height), choices)
        if lift:
            text = "ankle's height moved by {lift_mm:+.0f} mm"
            notices.append(note("ankle-lifted", text, lift_mm=1e3 * float(lift)))
        return replace(plain, zero=zero, lift=lift, notices=tuple(notices))

    def _motion_of(self, stride: RecordedStride) -> LegMotion:
        return self.motion if stride.closed is None or self.closed_motion is None else self.closed_motion

    def _flat(self, stride: RecordedStride) -> np.ndarray:
        """Pitch of the foot [rad] and height of the ankle [m] where the sole lies flat, (m, 2)."""
        motion = self.motion
        if stride.closed is None:
            phase = (motion.time - stride.start) / stride.time
            pitch, height = motion.ankle_angle - motion.shank_angle, motion.ankle_z
        else:
            phase = np.linspace(0.0, 1.0, self.choices.rows)
            found = self._motion(stride, phase)
            pitch, height = found[:, 2] - found[:, 0], found[:, 4]
        flat = flat_part(phase, pitch, height, _standing(stride, phase)).holds(phase)
        return np.column_stack([pitch, height])[flat]

    def _motion(self, stride: RecordedStride, phase: np.ndarray) -> np.ndarray:
        """Shank, knee, ankle angle, and the ankle's way over the belt and height, (m, 5)."""
        motion = self._motion_of(stride)
        way = motion.ankle_x + self.belt_speed * motion.time
        signals = [motion.shank_angle, motion.knee_angle, motion.ankle_angle, way, motion.ankle_z]
        travels = [False, False, False, True, False]
        return sample(motion.time, np.column_stack(signals), stride, phase, travels)

    def _force(self, stride: RecordedStride, phase: np.ndarray) -> np.ndarray:
        """Forward and upward force and the moment of the upward one about the ankle's plumb point, (m, 3)."""
        ground = self.ground
        if ground is None or not stride.loaded:
            return np.full((len(phase), 3), np.nan)
        if stride.closed is not None:  # a moment about the ankle repeats, one about the floor does not
            motion = self._motion_of(stride)
            known = motion.time
            about = ground.moment - np.interp(ground.time, known, motion.ankle_x) * ground.force_z
            loads = np.column_stack([ground.force_x, ground.force_z, about])
            inside = (ground.time >= known[0]) & (ground.time <= known[-1])
            # the window's ends are the motion's, which plates may miss by one of its samples
            slack = known[1] - known[0]
            return sample(ground.time[inside], loads[inside], stride, phase, [False] * 3, slack=slack)
        loads = np.column_stack([ground.force_x, ground.force_z, ground.moment])
        found = sample(ground.time, loads, stride, phase, [False] * 3)
        found[np.isnan(found[:, 0]) & (stride.start + phase * stride.time > stride.toe_off)] = 0.0
        ankle = sample(self.motion.time, self.motion.ankle_x[:, None], stride, phase, [True])[:, 0]
        return np.column_stack([found[:, :2], found[:, 2] - ankle * found[:, 1]])

    def cycle(self, stride: RecordedStride, trial: WalkingTrial) -> GaitCycle:
        """The stride over its phase; forces are NaN where no plate lay."""
        choices, mass = self.choices, self.mass
        phase = np.linspace(0.0, 1.0, choices.rows)
        shank, knee, ankle, way, z = self._motion(stride, phase).T
        z = z + self.lift
        force_x, force_z, about = self._force(stride, phase).T
        force_z = np.maximum(force_z, 0.0)
        pressed = force_z > min(_LIGHT, COP_FORCE * mass * GRAVITY)
        place = np.where(pressed & (phase < LATE_SWING), about / np.where(pressed, force_z, 1.0), np.nan)
        moment = np.where(pressed | np.isnan(force_z), -(about + z * force_x), 0.0) / mass
        source = FROM_GROUND_FORCE
        if trial.moments is not None:
            given = _moment_of(trial.moments, stride, phase) / mass
            if _agree(given, moment, pressed):
                moment, source = given, f"as in {trial.moments.file.name}"
        flat = flat_part(phase, ankle - shank, z, _standing(stride, phase)).holds(phase)
        return GaitCycle(
            source=choices.source,
            licence=choices.licence,
            side=stride.side,
            stride_time=stride.end - stride.start,
            body_mass=mass,
            walking_speed=float(way[-1] - way[0]) / (stride.end - stride.start),
            ankle_height=float(z[flat].mean()),
            phase=phase,
            shank_angle=shank,
            knee_angle=knee,
            ankle_angle=ankle - self.zero,
            ankle_x=way - way[0],
            ankle_z=z,
            grf_x=force_x / (mass * GRAVITY),
            grf_z=force_z / (mass * GRAVITY),
            cop_x=place,
            ankle_moment=moment,
            body_height=choices.height,
            sole_thickness=choices.sole,
            walker=choices.walker,
            notes=_notes(stride, choices, source),
        )


def _standing(stride: RecordedStride, phase: np.ndarray) -> np.ndarray:
    """Mask of the phases before toe-off (n,)."""
    return np.asarray(stride.start + phase * stride.time < stride.toe_off)


def reference_of(
    trial: WalkingTrial, strides: Sequence[RecordedStride], mass: float, rows: int
) -> np.ndarray | None:
    """Mean ankle moment over strides [N·m/kg] of an inverse-dynamics file, or else the laboratory's own."""
    phase = np.linspace(0.0, 1.0, rows)
    if trial.moments is not None:
        return np.asarray(np.mean([_moment_of(trial.moments, s, phase) for s in strides], axis=0) / mass)
    found = stated_over(trial.stated.time, trial.stated.whole_moments(mass), strides, phase)
    return None if found is None else found / mass


def stated_over(
    time: np.ndarray, curves: Mapping[str, np.ndarray], strides: Sequence[RecordedStride], phase: np.ndarray
) -> np.ndarray | None:
    """Mean over strides of a curve that the laboratory computed, by side; NaN where it did not."""
    if not all(stride.side in curves for stride in strides):
        return None
    found = []
    for stride in strides:
        at = stride.start + phase * stride.time
        if stride.closed is not None:
            first = stride.closed.window[0]
            at = first + (at - first) % stride.time
        found.append(np.interp(at, time, curves[stride.side], np.nan, np.nan))
    mean = np.mean(found, axis=0)
    return np.asarray(mean) if np.isfinite(mean).any() else None


def _moment_of(table: OpenSimTable, stride: RecordedStride, phase: np.ndarray) -> np.ndarray:
    """Internal ankle moment over a stride's phase, dorsiflexion positive [N·m], of inverse dynamics."""
    name = f"ankle_angle_{stride.side[0]}_moment"
    if name not in table.columns:
        allowed = ", ".join(table.columns)
        raise InputError("this column is missing", file=table.file, field=name, allowed=allowed)
    values, gaps = fill_gaps(table.time, table.columns[name])
    if gaps:
        problem = f"has no number from {gaps[0][0]:g} to {gaps[0][1]:g} s"
        raise InputError(problem, file=table.file, field=name)
    time, even = evenly(table.time, values)
    return sample(time, even[:, None], stride, phase, [False])[:, 0]


def _agree(given: np.ndarray, demanded: np.ndarray, pressed: np.ndarray) -> bool:
    """Whether a given moment is there and balances the ground's force, by the limit of every gait cycle."""
    if not np.all(np.isfinite(given)):
        return False  # its file does not last as long as the stride
    if not np.any(pressed):
        return True
    error = np.sqrt(np.mean((given - demanded)[pressed] ** 2))
    return bool(error <= MOMENT_ERROR * np.abs(demanded[pressed]).max())


def _notes(stride: RecordedStride, choices: Choices, moment: str) -> dict[str, str]:
    cutoff = f"low-pass at {choices.cutoff:g} Hz" if choices.cutoff else "not filtered"
    second = "second heel strike by ground force" if stride.by == FORCE else f"by {stride.by}"
    notes = {
        "cut": f"{stride.start:.4f} to {stride.end:.4f} s of the trial; {second}",
        "processing": f"kinematics and ground force {cutoff}, {choices.rows} rows",
        "ankle_moment": moment,
    }
    if stride.closed is not None:
        first, last = stride.closed.window
        gap = f"a gap of {stride.closed.gap:.3f} s"
        notes["closed"] = f"cyclically from {first:.3f} to {last:.3f} s, {gap} bridged"
        # its own ends may be times that the trial does not have
        notes["cut"] = f"recorded {first:.4f} to {last:.4f} s of the trial; by {stride.by}"
    return notes


def _ankle_zero(flat: float, sole: float | None, keep: bool) -> tuple[float, Notice]:
    """The ankle angle's zero [rad]: the foot's pitch where flat, or the sole's if it never lies flat."""
    if keep:
        text = "ankle's zero kept; the foot's pitch where flat is {pitch:+.1f} deg"
        return 0.0, note("ankle-zero-kept", text, pitch=float(np.degrees(flat)))
    if sole is None or abs(np.degrees(flat - sole)) <= _RAISED:
        text = "ankle's zero moved by {moved:+.1f} deg, so that the flat foot is level"
        return flat, note("ankle-zero-moved", text, moved=float(np.degrees(-flat)))
    text = "the sole is pitched by {pitch:+.1f} deg, toe up positive, in the part of stance in which it "
    text += "should be flat: the ankle's zero is shifted by {moved:+.1f} deg, as the standing trial or the "
    text += "model states"
    pitch, moved = float(np.degrees(flat - sole)), float(np.degrees(-sole))
    return sole, Notice("sole-pitched", text, pitch=pitch, moved=moved)


def _require_height(height: float, choices: Choices) -> None:
    """Refuse an ankle far from its place above the floor, or from the typed lengths."""
    low, high = RANGES["ankle_height_m"]
    stated = choices.ankle_height
    if choices.thigh is not None and stated is not None and abs(height - stated) > _CHAIN_ERROR:
        word = "short" if height > stated else "long"
        problem = f"thigh, shank and ankle height are {100.0 * abs(height - stated):.1f} cm too {word}: they "
        problem += f"leave the ankle {100.0 * height:.1f} cm above the floor with the foot flat"
        own = f"the walker's own, within {100.0 * _CHAIN_ERROR:.0f} cm together"
        raise InputError(problem, field="thigh", allowed=f"{own}; or the scaled model, `model`")
    if stated is None and not low <= height <= high:
        problem = f"the ankle is {height:.3g} m above the laboratory's zero with the foot flat"
        allowed = "the axis upward, with the floor at 0; the person's own scaled model; or the ankle height, "
        raise InputError(problem, field="up", allowed=f'{allowed}for example "7 cm"')
