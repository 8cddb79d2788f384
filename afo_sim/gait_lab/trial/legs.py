"""The legs of a trial, from the best that its files hold; the chain of joint angles where nothing else is."""

from dataclasses import replace

import numpy as np

from afo_sim.common import InputError, Notice
from afo_sim.gait_lab.noted import note
from afo_sim.gait_lab.readers.opensim_model import OpenSimModel
from afo_sim.gait_lab.readers.opensim_table import OpenSimTable
from afo_sim.gait_lab.readers.unit_checks import angle_unit
from afo_sim.gait_lab.trial.choices import Choices
from afo_sim.gait_lab.trial.files import WalkingTrial
from afo_sim.gait_lab.trial.leg_points import LegPoint, LegPoints
from afo_sim.gait_lab.trial.marker_legs import legs_from_markers
from afo_sim.gait_lab.trial.model_legs import legs_from_angles, legs_from_model_markers

_OF_MARKERS = ("markers", "map", "static")  # which a model's own markers make needless
_OF_ANGLES = ("thigh", "shank", "hip", "degrees")  # of a chain of joint angles without a model
_HIP = (-0.063, -0.072)  # hip from the pelvis' origin: between the gait2392 and Rajagopal models [m]
_THIGH, _SHANK = 0.41, 0.40  # where the ankle's place is measured, these only carry angles [m]
_FOOT = (-0.05, 0.15)  # heel and toe ahead of the ankle; they carry the foot's angle [m]
_OUT_OF_PLANE = 12.0  # swing of pelvis or hip; half of it in usual walking (assumed) [deg]
_TYPED_ERROR = 0.02  # of an ankle that depends on three typed lengths (assumed) [m]
_ANGLES = ("pelvis_tilt", "hip_flexion", "knee_angle", "ankle_angle")


def find_legs(
    trial: WalkingTrial, choices: Choices, model: OpenSimModel | None
) -> tuple[dict[str, LegPoints], OpenSimModel | None]:
    """Points of both legs, or of the one that the files hold."""
    if model is not None and trial.angles is not None:
        knees = [
            name for name in trial.angles.columns if name.startswith("knee_angle_") and "beta" not in name
        ]
        degrees, unit = angle_unit(trial.angles, knees, choices.degrees)
        legs = legs_from_angles(model, trial.angles, degrees)
        unused = _unused_choices(trial, choices, by_model=True)
        if choices.side not in legs:
            problem = f"the files do not hold the {choices.side} leg"
            files, allowed = ", ".join(map(str, trial.files)), ", ".join(legs) or "a leg"
            raise InputError(problem, file=files, field="side", value=choices.side, allowed=allowed)
        legs = {side: replace(_with(leg, *unit, *unused), by_angles=True) for side, leg in legs.items()}
        return legs, model
    if model is not None and trial.markers is not None:
        return _by_model(model, trial, choices)
    if trial.angles is not None:
        return _legs_from_chain(trial.angles, choices, trial.bodies, _seen(trial, choices)), None
    if trial.markers is not None:
        legs = legs_from_markers(trial.markers, choices, trial.standing)
        unused = _unused_choices(trial, choices, by_model=False)
        return {side: _with(leg, *unused) for side, leg in legs.items()}, None
    problem = "no file holds the leg's motion"
    allowed = f"joint angles ({', '.join(_ANGLES)}) in a .mot or .sto, or markers in a .trc, .c3d or .csv"
    raise InputError(problem, file=", ".join(str(file) for file in trial.files), allowed=allowed)


def _by_model(
    model: OpenSimModel, trial: WalkingTrial, choices: Choices
) -> tuple[dict[str, LegPoints], OpenSimModel | None]:
    """The model posed over the markers; markers alone, with a warning, where it cannot be."""
    assert trial.markers is not None
    try:
        legs = legs_from_model_markers(model, trial.markers, choices)
    except InputError as error:
        problem = error
    else:
        unused = _unused_choices(trial, choices, by_model=True)
        return {side: _with(leg, *unused) for side, leg in legs.items()}, model
    try:
        legs = legs_from_markers(trial.markers, choices, trial.standing)
    except InputError:
        raise problem from None
    text = "the model {subject} is not used, the markers alone are; is it this person's? It {problem}"
    doubt = Notice("model-unused", text, subject=model.name, problem=problem.problem)
    return {side: _with(leg, doubt) for side, leg in legs.items()}, None


def _seen(trial: WalkingTrial, choices: Choices) -> dict[str, LegPoints]:
    """Legs from markers beside joint angles, if they are complete: only the ankle's place is wanted."""
    if trial.markers is None:
        return {}
    try:
        return legs_from_markers(trial.markers, choices, trial.standing)
    except InputError:
        if choices.markers or choices.map:  # what the person named herself must be right
            raise
        return {}


def _with(leg: LegPoints, *notices: Notice) -> LegPoints:
    return replace(leg, notices=(*leg.notices, *notices))


def _unused_choices(trial: WalkingTrial, choices: Choices, *, by_model: bool) -> tuple[Notice, ...]:
    """A warning on what a person has chosen in vain; none if all counts."""
    names: list[str] = []
    if by_model:
        names += [*_OF_MARKERS, "thigh", "shank", "hip"]
        names += [] if trial.angles is not None else ["degrees"]
    elif trial.angles is None:
        names += _OF_ANGLES
    given = [name for name in names if getattr(choices, name) not in (None, {}, ())]
    why = "the model places the joints" if by_model else "they are of joint angles, and these are markers"
    text = "{subject}: not used, {why}"
    return (Notice("choices-unused", text, subject=", ".join(given), why=why),) if given else ()


def _legs_from_chain(
    table: OpenSimTable, choices: Choices, bodies: OpenSimTable | None, seen: dict[str, LegPoints]
) -> dict[str, LegPoints]:
    found = {}
    for side in ("right", "left"):
        complete = all(name in table.columns for name in _names(side))
        placed = _has_talus(bodies, side) or side in seen or not _missing(table, choices)
        if side == choices.side or (complete and placed):
            found[side] = _leg(table, side, choices, bodies, seen.get(side))
    return found


def _names(side: str) -> list[str]:
    return [_ANGLES[0], *(f"{name}_{side[0]}" for name in _ANGLES[1:])]


def _has_talus(bodies: OpenSimTable | None, side: str) -> bool:
    return bodies is not None and f"talus_{side[0]}_X" in bodies.columns


def _missing(table: OpenSimTable, choices: Choices) -> list[str]:
    lengths = {"`thigh`": choices.thigh, "`shank`": choices.shank, "`ankle_height`": choices.ankle_height}
    missing = [name for name in ("pelvis_tx", "pelvis_ty") if name not in table.columns]
    return missing + [name for name, value in lengths.items() if value is None]


def _leg(
    table: OpenSimTable, side: str, choices: Choices, bodies: OpenSimTable | None, seen: LegPoints | None
) -> LegPoints:
    tilt, hip, knee, ankle, notices = _angles(table, side, choices)
    shank = knee - hip - tilt
    heading = _heading(table, seen)
    time, point = _ankle(table, side, choices, bodies, seen, tilt, hip, shank, heading)
    shank, knee, pitch = (np.interp(time, table.time, v) for v in (shank, knee, ankle - shank))

    def along(angle: np.ndarray, length: float) -> np.ndarray:
        """A vector of some length, leaning forward from the vertical (n, 3) [m]."""
        upward = np.cos(angle)[:, None] * np.array([0.0, 1.0, 0.0])
        return length * (np.sin(angle)[:, None] * heading + upward)

    place = point.path
    knees = place + along(shank, choices.shank or _SHANK)
    points = {
        "hip": LegPoint(knees + along(shank - knee, choices.thigh or _THIGH), "joint angles"),
        "knee": LegPoint(knees, "joint angles"),
        "ankle": replace(point, better="the scaled model with `--model`"),
    }
    for role, ahead in zip(("heel", "toe"), _FOOT, strict=True):
        end = place + along(np.pi / 2 - pitch, ahead)
        points[role] = LegPoint(end, "ankle angle", way="a foot of assumed length")
    pelvis = _pelvis(table)
    if pelvis is not None:
        pelvis = np.column_stack([np.interp(time, table.time, c) for c in pelvis.T])
    return LegPoints(side, time, points, pelvis=pelvis, by_angles=True, notices=tuple(notices))


def _angles(
    table: OpenSimTable, side: str, choices: Choices
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, list[Notice]]:
    """Tilt, hip, knee (flexion positive) and ankle [rad], and notices."""
    names = _names(side)
    missing = [name for name in names if name not in table.columns]
    if missing:
        problem = "these coordinates are missing" if len(missing) > 1 else "this coordinate is missing"
        allowed = ", ".join(table.columns)
        raise InputError(problem, file=table.file, field=", ".join(missing), allowed=allowed)
    degrees, unit = angle_unit(table, [names[2]], choices.degrees)
    tilt, hip, knee, ankle = (table.columns[n] * (np.pi / 180.0 if degrees else 1.0) for n in names)
    word = "degrees" if degrees else "radians"
    notices = [note("angle-unit", "joint angles in {unit}", unit=word), *unit]
    notices += _out_of_plane(table, side, degrees)
    if -np.nanmin(knee) > np.nanmax(knee):
        knee = -knee
        text = "knee angle turned round: its file has flexion negative"
        notices.append(note("knee-turned", text, subject=names[2]))
    return tilt, hip, knee, ankle, notices


def _out_of_plane(table: OpenSimTable, side: str, degrees: bool) -> list[Notice]:
    """A warning where the pelvis or the hip turns out of the plane in which the chain is drawn."""
    names = ("pelvis_list", "pelvis_rotation", f"hip_adduction_{side[0]}", f"hip_rotation_{side[0]}")
    scale = 1.0 if degrees else 180.0 / np.pi
    swings = {
        name: 0.5 * scale * float(np.nanmax(table.columns[name]) - np.nanmin(table.columns[name]))
        for name in names
        if name in table.columns
    }
    most = max(swings, key=lambda name: swings[name], default="")
    if not most or swings[most] <= _OUT_OF_PLANE:
        return []
    text = "{subject} swings by ±{swing:.0f} deg, which a chain in one plane leaves out: the scaled model, "
    text += "`model`, takes it in"
    return [Notice("out-of-plane", text, subject=most, swing=swings[most])]


def _pelvis(table: OpenSimTable) -> np.ndarray | None:
    """The pelvis' way (n, 3) [m]."""
    if "pelvis_tx" not in table.columns or "pelvis_ty" not in table.columns:
        return None
    zero = np.zeros_like(table.time)
    return np.column_stack([table.columns.get(f"pelvis_t{axis}", zero) for axis in "xyz"])


def _heading(table: OpenSimTable, seen: LegPoints | None) -> np.ndarray:
    """Horizontal direction in which the pelvis travels; x where it hardly does (3,)."""
    pelvis = _pelvis(table)
    if pelvis is None and seen is not None:
        pelvis = seen.points["ankle"].path
        pelvis = pelvis[np.all(np.isfinite(pelvis), axis=1)]
    if pelvis is None or len(pelvis) < 2:
        return np.array([1.0, 0.0, 0.0])
    way = (pelvis[-1] - pelvis[0]) * np.array([1.0, 0.0, 1.0])
    length = float(np.linalg.norm(way))
    return way / length if length > 0.3 else np.array([1.0, 0.0, 0.0])


def _ankle(
    table: OpenSimTable, side: str, choices: Choices, bodies: OpenSimTable | None, seen: LegPoints | None,
    tilt: np.ndarray, hip: np.ndarray, shank: np.ndarray, heading: np.ndarray,
) -> tuple[np.ndarray, LegPoint]:  # fmt: skip
    """Times [s] (n,) and the ankle."""
    if bodies is not None and _has_talus(bodies, side):
        zero = np.zeros_like(bodies.time)
        path = np.column_stack([bodies.columns.get(f"talus_{side[0]}_{axis}", zero) for axis in "XYZ"])
        time, path = _common(table, bodies.time, path)
        return time, LegPoint(path, "origin of the talus")
    if seen is not None:
        time, path = _common(table, seen.time, seen.points["ankle"].path)
        return time, replace(seen.points["ankle"], path=path, bridged=None)
    missing = _missing(table, choices)
    if missing:
        problem = f"the ankle's place cannot be had from joint angles alone; missing: {', '.join(missing)}"
        allowed = "the scaled model (`model`), or a .trc with an ankle marker, or body positions with "
        allowed += f"talus_{side[0]}_X and _Y, or pelvis_tx and pelvis_ty with `thigh`, `shank`, "
        allowed += "`ankle_height`"
        raise InputError(problem, file=table.file, allowed=allowed)
    assert choices.thigh is not None and choices.shank is not None
    forward, up = choices.hip or _HIP
    thigh = tilt + hip
    x = forward * np.cos(tilt) - up * np.sin(tilt)
    x = x + choices.thigh * np.sin(thigh) - choices.shank * np.sin(shank)
    y = forward * np.sin(tilt) + up * np.cos(tilt)
    y = y - choices.thigh * np.cos(thigh) - choices.shank * np.cos(shank)
    pelvis = _pelvis(table)
    assert pelvis is not None
    path = pelvis + x[:, None] * heading + y[:, None] * np.array([0.0, 1.0, 0.0])
    return table.time, LegPoint(path, "pelvis translation and typed lengths", _TYPED_ERROR)


def _common(table: OpenSimTable, time: np.ndarray, path: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    keep = (table.time >= time[0] - 0.1) & (table.time <= time[-1] + 0.1)
    if keep.sum() < 3:
        spans = f"{table.time[0]:g} to {table.time[-1]:g} s and {time[0]:g} to {time[-1]:g} s"
        raise InputError(f"joint angles and the ankle's place are of different times: {spans}")
    # a lost marker stays lost: np.interp hands NaN on to its neighbours
    return table.time[keep], np.column_stack([np.interp(table.time[keep], time, c) for c in path.T])
