"""A trial → one gait cycle, and what was understood on the way."""

import pathlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.common.units import GRAVITY
from afo_sim.gait.checks import RANGES, examine, findings
from afo_sim.gait.cycle import FLAT, GaitCycle
from afo_sim.gait.readers.axes import Axes
from afo_sim.gait.readers.choices import Choices
from afo_sim.gait.readers.ground_force import GroundForce, foot_force
from afo_sim.gait.readers.leg_motion import LegMotion
from afo_sim.gait.readers.opensim_table import OpenSimTable
from afo_sim.gait.readers.signals import evenly, fill_gaps
from afo_sim.gait.readers.strides import RecordedStride, find_strides
from afo_sim.gait.readers.trial import WalkingTrial, read_trial

STANDING = 0.15  # speed that is no walking [m/s]
HEIGHTS = RANGES["ankle_height_m"]  # that an ankle can have above the floor [m]
COP_FORCE = 30.0  # vertical force below which the centre of pressure means nothing [N]


@dataclass(frozen=True, eq=False)
class Imported:
    """A gait cycle with what it was cut from."""

    cycle: GaitCycle
    strides: tuple[RecordedStride, ...]  # all that were found
    chosen: int  # which of them the cycle is
    motion: LegMotion
    ground: GroundForce
    remarks: tuple[str, ...]

    def findings(self) -> list[tuple[str, str]]:
        """Findings on the trial and the stride, in words and numbers: (subject, finding)."""
        found = [("understood", remark) for remark in self.remarks]
        for number, stride in enumerate(self.strides, start=1):
            taken = ", taken" if number - 1 == self.chosen else ""
            by = "" if stride.by == "force" else ", its end by posture"
            found.append((f"stride {number}", f"{stride.start:.3f} to {stride.end:.3f} s{by}{taken}"))
        return found + findings(self.cycle)


def import_gait(files: Sequence[str | pathlib.Path], choices: Choices) -> Imported:
    """Read the files of a trial and cut one stride from it.

    Parameters
    ----------
    files : .mot, .sto, .trc, .c3d of one trial, in any order
    choices : what the files do not say

    Returns
    -------
    Imported, examined as `gait.read` examines a file

    Raises
    ------
    InputError
        A file cannot be read, something is missing, or the stride contradicts itself.
    """
    return cut_cycle(read_trial([pathlib.Path(file) for file in files]), choices)


def cut_cycle(trial: WalkingTrial, choices: Choices) -> Imported:
    """Find the strides of a trial, and bring one of them to gait phase; errors as `import_gait`."""
    if choices.mass is None:
        raise InputError("the body mass is not in the files", field="mass", allowed='for example "72 kg"')
    motion, axes = trial.motion(choices)
    ground = foot_force(trial.plates, motion, axes, choices)
    strides = find_strides(ground, motion)
    chosen = (choices.stride or 1) - 1
    if chosen >= len(strides):
        times = ", ".join(f"{k}: {s.start:.2f} to {s.end:.2f} s" for k, s in enumerate(strides, start=1))
        raise InputError("there is no such stride", field="stride", value=choices.stride, allowed=times)
    zero, shift, more = _calibration(motion, strides, choices)
    cycle = _cycle(trial, motion, ground, strides[chosen], zero, shift, choices)
    _require_walk(cycle, axes)
    remarks = (*motion.remarks, f"forward {axes.forward}, up {axes.up}", *ground.remarks, *more)
    examine(cycle, ", ".join(file.name for file in trial.files))
    return Imported(cycle, tuple(strides), chosen, motion, ground, remarks)


def _require_walk(cycle: GaitCycle, axes: Axes) -> None:
    """Refuse what looks like a wrong option, in the words of the options."""
    speed, height = cycle.walking_speed, cycle.ankle_height
    if abs(speed) < STANDING:
        raise InputError(
            f"the ankle travels at {speed:.2f} m/s only: a treadmill?",
            field="belt_speed",
            allowed='the belt\'s speed, for example "1.2 m/s"',
        )
    if speed < 0.0:
        raise InputError(
            f"the leg walks backward along {axes.forward}, at {speed:.2f} m/s",
            field="forward",
            allowed="the axis of walking; heel and toe not confused; the belt speed of a treadmill",
        )
    if not HEIGHTS[0] <= height <= HEIGHTS[1]:
        raise InputError(
            f"the ankle is {height:.3g} m above the laboratory's zero with the foot flat",
            field="up",
            allowed='the axis upward, with the floor at 0; or the ankle height, for example "7 cm"',
        )


def _calibration(
    motion: LegMotion, strides: Sequence[RecordedStride], choices: Choices
) -> tuple[float, float, list[str]]:
    """Calibration by the flat foot of all strides: the ankle's zero [rad], the floor's shift [m], remarks."""
    flat = np.zeros(len(motion.time), dtype=bool)
    for stride in strides:
        start, end = stride.window(FLAT)
        flat |= (motion.time >= start) & (motion.time <= end)
    pitch = (motion.ankle_angle - motion.shank_angle)[flat]
    zero = 0.0 if choices.keep_zero else float(pitch.mean())
    shift = 0.0 if choices.ankle_height is None else choices.ankle_height - float(motion.ankle_z[flat].mean())
    more = []
    if choices.keep_zero:
        more.append(f"ankle's zero kept; the foot's pitch where flat is {np.degrees(pitch.mean()):+.1f} deg")
    else:
        more.append(f"ankle's zero moved by {np.degrees(-zero):+.1f} deg, so that the flat foot is level")
    if choices.ankle_height is not None:
        more.append(f"ankle's height moved by {1e3 * shift:+.0f} mm")
    return zero, shift, more


def _cycle(
    trial: WalkingTrial,
    motion: LegMotion,
    ground: GroundForce,
    stride: RecordedStride,
    zero: float,
    shift: float,
    choices: Choices,
) -> GaitCycle:
    from scipy.interpolate import CubicSpline

    mass = float(choices.mass or 0.0)
    phase = np.linspace(0.0, 1.0, choices.rows)
    time = stride.start + phase * stride.time
    kinematics = [motion.shank_angle, motion.knee_angle, motion.ankle_angle - zero]
    kinematics += [motion.ankle_x, motion.ankle_z + shift]
    shank, knee, ankle, x, z = CubicSpline(motion.time, np.column_stack(kinematics))(time).T
    forces = np.column_stack([ground.force_x, ground.force_z, ground.moment])
    force_x, force_z, moment = CubicSpline(ground.time, forces)(time).T
    force_z = np.maximum(force_z, 0.0)
    pressed = force_z > COP_FORCE
    cop = np.where(pressed & (phase < 0.9), moment / np.where(pressed, force_z, 1.0) - x, np.nan)
    flat = (phase >= FLAT[0]) & (phase <= FLAT[1])
    way = x + choices.belt_speed * (time - time[0])
    if trial.moments is None:
        # what balances the ground, the foot massless; in swing nothing
        ankle_moment = -np.where(pressed, moment - x * force_z + z * force_x, 0.0) / mass
        moment_source = "derived from ground force and centre of pressure, the foot taken as massless"
    else:
        ankle_moment = np.interp(time, *_moment(trial.moments, choices)) / mass
        moment_source = f"as in {trial.moments.file.name}"
    return GaitCycle(
        source=choices.source or ", ".join(file.name for file in trial.files),
        licence=choices.licence,
        side=choices.side,
        stride_time=stride.time,
        body_mass=mass,
        walking_speed=float(way[-1] - way[0]) / stride.time,
        ankle_height=float(z[flat].mean()),
        phase=phase,
        shank_angle=shank,
        knee_angle=knee,
        ankle_angle=ankle,
        ankle_x=way - way[0],
        ankle_z=z,
        grf_x=force_x / (mass * GRAVITY),
        grf_z=force_z / (mass * GRAVITY),
        cop_x=cop,
        ankle_moment=ankle_moment,
        notes=_notes(stride, choices, moment_source),
    )


def _moment(table: OpenSimTable, choices: Choices) -> tuple[np.ndarray, np.ndarray]:
    """Time and internal ankle moment, dorsiflexion positive [N·m], of an inverse-dynamics file."""
    name = f"ankle_angle_{choices.letter}_moment"
    if name not in table.columns:
        raise InputError(
            "this column is missing", file=table.file, field=name, allowed=", ".join(table.columns)
        )
    values, gaps = fill_gaps(table.time, table.columns[name])
    if gaps:
        raise InputError(
            f"has no number from {gaps[0][0]:g} to {gaps[0][1]:g} s", file=table.file, field=name
        )
    return evenly(table.time, values)


def _notes(stride: RecordedStride, choices: Choices, moment: str) -> dict[str, str]:
    cutoff = f"low-pass at {choices.cutoff:g} Hz" if choices.cutoff else "not filtered"
    second = "ground force" if stride.by == "force" else "the leg's posture"
    return {
        "cut": f"{stride.start:.4f} to {stride.end:.4f} s of the trial; second heel strike by {second}",
        "processing": f"kinematics and ground force {cutoff}, {choices.rows} rows",
        "ankle_moment": moment,
    }
