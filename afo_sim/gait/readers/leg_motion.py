"""The leg over time: shank, knee and ankle angle and the ankle's place, from markers or joint angles."""

import dataclasses
from dataclasses import dataclass

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait.readers.axes import Axes
from afo_sim.gait.readers.choices import Choices
from afo_sim.gait.readers.markers import Markers
from afo_sim.gait.readers.opensim_table import OpenSimTable
from afo_sim.gait.readers.signals import evenly, fill_gaps, low_pass

ANGLES = ("pelvis_tilt", "hip_flexion", "knee_angle", "ankle_angle")
HIP = (-0.063, -0.072)  # hip from the pelvis' origin: between the gait2392 and Rajagopal models [m]


@dataclass(frozen=True, eq=False)
class LegMotion:
    """Sagittal motion of one leg in the laboratory, filtered; arrays (n,)."""

    time: np.ndarray  # [s]
    shank_angle: np.ndarray  # knee ahead of ankle positive [rad]
    knee_angle: np.ndarray  # flexion positive [rad]
    ankle_angle: np.ndarray  # dorsiflexion positive, with the file's own zero [rad]
    ankle_x: np.ndarray  # [m]
    ankle_z: np.ndarray  # [m]
    hidden: tuple[tuple[str, float, float], ...] = ()  # what was not seen, from when to when [s]
    remarks: tuple[str, ...] = ()


def from_markers(markers: Markers, axes: Axes, choices: Choices) -> LegMotion:
    """Angles between the lines hip–knee, knee–ankle and heel–toe.

    The foot's line need not be its sole: the ankle's zero comes later, from the flat foot.

    Raises
    ------
    InputError
        A point of the leg has no marker.
    """
    names = {role: markers.name(role, choices) for role in ("hip", "knee", "ankle", "heel", "toe")}
    points, hidden = {}, []
    for role, chosen in names.items():
        points[role], gaps = _path(markers, chosen, axes, choices.cutoff)
        hidden += [(" and ".join(chosen), *gap) for gap in gaps]
    time, _ = evenly(markers.time, markers.time)
    shank = _lean(points["knee"] - points["ankle"])
    thigh = _lean(points["hip"] - points["knee"])
    foot = points["toe"] - points["heel"]
    pitch = np.unwrap(np.arctan2(foot[:, 1], foot[:, 0]))
    chosen_markers = ", ".join(f"{role} {' and '.join(chosen)}" for role, chosen in names.items())
    return LegMotion(
        time=time,
        shank_angle=shank,
        knee_angle=shank - thigh,
        ankle_angle=pitch + shank,
        ankle_x=points["ankle"][:, 0],
        ankle_z=points["ankle"][:, 1],
        hidden=tuple(hidden),
        remarks=(f"markers: {chosen_markers}",),
    )


def from_joint_angles(
    table: OpenSimTable,
    choices: Choices,
    markers: Markers | None = None,
    bodies: OpenSimTable | None = None,
    axes: Axes | None = None,
) -> LegMotion:
    """The sagittal chain pelvis–hip–knee–ankle of an inverse-kinematics file.

    Signs are OpenSim's: pelvis tilt backward positive, hip flexion and dorsiflexion positive; the knee's
    is found from its swing. Rotation of the leg out of the sagittal plane is left out.

    Parameters
    ----------
    table : with pelvis_tilt, hip_flexion_r, knee_angle_r, ankle_angle_r (or _l)
    choices : side, unit, lengths
    markers : for the ankle's centre, if there are any
    bodies : body positions from OpenSim's analysis (talus_r_X, talus_r_Y), for the ankle's centre
    axes : of the markers; OpenSim's own by default

    Raises
    ------
    InputError
        A coordinate is missing, degrees and radians are confused, or the ankle's centre cannot be had.
    """
    angles, remarks = _joint_angles(table, choices)
    tilt, hip, knee, ankle = angles
    time = evenly(table.time, table.time)[0]
    motion = LegMotion(
        time=time,
        shank_angle=knee - hip - tilt,
        knee_angle=knee,
        ankle_angle=ankle,
        ankle_x=np.zeros_like(time),
        ankle_z=np.zeros_like(time),
        remarks=tuple(remarks),
    )
    if bodies is not None and f"talus_{choices.letter}_X" in bodies.columns:
        place = [_filtered(bodies, f"talus_{choices.letter}_{a}", choices.cutoff) for a in "XY"]
        return _placed(motion, *evenly(bodies.time, np.column_stack(place)), "ankle: origin of the talus")
    if markers is not None and markers.has("ankle", choices):
        chosen = markers.name("ankle", choices)
        path, gaps = _path(markers, chosen, axes or Axes(), choices.cutoff)
        moved = _placed(motion, evenly(markers.time, markers.time)[0], path, f"ankle: {' and '.join(chosen)}")
        return dataclasses.replace(moved, hidden=tuple((" and ".join(chosen), *gap) for gap in gaps))
    path = _chain(table, choices, tilt, hip, motion.shank_angle)
    return _placed(motion, time, path, "ankle: pelvis translation and segment lengths")


def _path(
    markers: Markers, names: tuple[str, ...], axes: Axes, cutoff: float
) -> tuple[np.ndarray, list[tuple[float, float]]]:
    """A point's filtered way in the sagittal plane (n, 2), and when it was not seen."""
    points = axes.plane(markers.point(names))
    columns, hidden = [], []
    for column in points.T:
        filled, gaps = fill_gaps(markers.time, column)
        columns.append(filled)
        hidden += [gap for gap in gaps if gap not in hidden]
    time, even = evenly(markers.time, np.column_stack(columns))
    return low_pass(time, even, cutoff), hidden


def _lean(upward: np.ndarray) -> np.ndarray:
    """Angle of an upward vector (n, 2) from the vertical, forward positive [rad]."""
    return np.unwrap(np.arctan2(upward[:, 0], upward[:, 1]))


def _filtered(table: OpenSimTable, name: str, cutoff: float) -> np.ndarray:
    filled, gaps = fill_gaps(table.time, table.columns[name])
    if gaps:
        raise InputError(
            f"has no number from {gaps[0][0]:g} to {gaps[0][1]:g} s", file=table.file, field=name
        )
    return low_pass(*evenly(table.time, filled), cutoff)


def _joint_angles(table: OpenSimTable, choices: Choices) -> tuple[list[np.ndarray], list[str]]:
    """Tilt, hip, knee (flexion positive) and ankle in rad, and remarks."""
    names = [ANGLES[0], *(f"{name}_{choices.letter}" for name in ANGLES[1:])]
    for name in names:
        if name not in table.columns:
            raise InputError(
                "this coordinate is missing", file=table.file, field=name, allowed=", ".join(table.columns)
            )
    degrees = table.degrees if choices.degrees is None else choices.degrees
    knee = table.columns[names[2]]
    _require_unit(table, names[2], degrees)
    angles = [_filtered(table, name, choices.cutoff) * (np.pi / 180.0 if degrees else 1.0) for name in names]
    remarks = [f"joint angles in {'degrees' if degrees else 'radians'}"]
    if -knee.min() > knee.max():
        angles[2] = -angles[2]
        remarks.append("knee angle turned round: its file has flexion negative")
    return angles, remarks


def _require_unit(table: OpenSimTable, knee: str, degrees: bool | None) -> None:
    """Refuse a unit that is not stated, or that a knee cannot be in."""
    if degrees is None:
        raise InputError(
            "does not say whether its angles are in degrees",
            file=table.file,
            field="inDegrees",
            allowed="inDegrees=yes or no in its header, or `angles=deg`, `angles=rad`",
        )
    peak = float(np.nanmax(np.abs(table.columns[knee])))
    stated = "degrees" if degrees else "radians"
    if (degrees and peak < 2.5) or (not degrees and peak > 3.5):
        other = "radians" if degrees else "degrees"
        raise InputError(
            f"reaches {peak:.3g}, which looks like {other}, but is said to be in {stated}",
            file=table.file,
            field=knee,
            allowed=f"`angles={other[:3]}`, or a header that says so; a walking knee reaches some 60 deg",
        )


def _placed(motion: LegMotion, time: np.ndarray, path: np.ndarray, remark: str) -> LegMotion:
    """The motion with the ankle's way (n, 2), brought to the motion's own times."""
    if time[0] > motion.time[0] + 0.1 or time[-1] < motion.time[-1] - 0.1:
        keep = (motion.time >= time[0]) & (motion.time <= time[-1])
        if keep.sum() < 3:
            spans = f"{motion.time[0]:g} to {motion.time[-1]:g} s and {time[0]:g} to {time[-1]:g} s"
            raise InputError(f"joint angles and the ankle's place are of different times: {spans}")
        cut = {n: getattr(motion, n)[keep] for n in ("time", "shank_angle", "knee_angle", "ankle_angle")}
        motion = dataclasses.replace(motion, **cut)
    x, z = (np.interp(motion.time, time, column) for column in path.T)
    return dataclasses.replace(motion, ankle_x=x, ankle_z=z, remarks=(*motion.remarks, remark))


def _chain(
    table: OpenSimTable, choices: Choices, tilt: np.ndarray, hip: np.ndarray, shank: np.ndarray
) -> np.ndarray:
    """The ankle's way (n, 2) from the pelvis' translation down the leg."""
    missing = [n for n in ("pelvis_tx", "pelvis_ty") if n not in table.columns]
    lengths = {"`thigh`": choices.thigh, "`shank`": choices.shank, "`ankle_height`": choices.ankle_height}
    missing += [name for name, value in lengths.items() if value is None]
    if missing:
        raise InputError(
            "the ankle's place cannot be had from joint angles alone; missing: " + ", ".join(missing),
            file=table.file,
            allowed="a .trc with an ankle marker, or body positions with talus_"
            f"{choices.letter}_X and _Y, or pelvis_tx and pelvis_ty with `thigh`, `shank`, `ankle_height`",
        )
    assert choices.thigh is not None and choices.shank is not None
    pelvis = np.column_stack([_filtered(table, n, choices.cutoff) for n in ("pelvis_tx", "pelvis_ty")])
    forward, up = choices.hip or HIP
    hips = np.column_stack(
        [forward * np.cos(tilt) - up * np.sin(tilt), forward * np.sin(tilt) + up * np.cos(tilt)]
    )
    thigh = tilt + hip
    down = choices.thigh * np.column_stack([np.sin(thigh), -np.cos(thigh)])
    down += choices.shank * np.column_stack([-np.sin(shank), -np.cos(shank)])
    return np.asarray(pelvis + hips + down)
