"""Trials with one fault each, of the known walker."""

import dataclasses
import pathlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from gait_lab.gait_truth import ONE_MALLEOLUS, noise_bounds
from gait_lab.known_walker import Walker
from gait_lab.laboratory import Laboratory, Recorded
from gait_lab.marker_sets import in_world
from gait_lab.osim_writer import write_osim
from gait_lab.trial_files import write_angles, write_forces, write_trc

PLAIN = Laboratory()
SET = "opensim c3d"


@dataclass(frozen=True)
class Faulty:
    """A fault and what must happen: the numbers stay right and a warning says `warns`, or `refuses` says why.

    Where both texts are given, either will do.
    """

    write: Callable[[pathlib.Path], list[pathlib.Path]]
    warns: str | None = None  # pattern of one of the warnings; "" if none is asked for
    refuses: str | None = None  # pattern of the message
    loose: dict[str, float] = field(default_factory=dict)  # wider bounds, with the reason beside them
    right: bool = True  # the numbers must be right where it is not refused
    choices: dict[str, Any] = field(default_factory=dict)
    laboratory: Laboratory = PLAIN
    side: str = "right"  # the leg that is really imported
    remark: bool = False  # a remark is enough


Points = dict[str, np.ndarray]
Write = Callable[[pathlib.Path], list[pathlib.Path]]


def _trial(
    folder: pathlib.Path,
    points: Points | None = None,
    plates: list[Recorded] | None = None,
    laboratory: Laboratory = PLAIN,
    unit: str = "mm",
) -> list[pathlib.Path]:
    points = laboratory.markers(SET) if points is None else points
    plates = laboratory.plates("feet") if plates is None else plates
    files = [write_trc(folder / "walk.trc", laboratory.time, points, unit)]
    return [*files, write_forces(folder / "grf.mot", plates)] if plates else files


def _marked(change: Callable[[Points], Points | None]) -> Write:
    """The trial with its markers changed, in place or not."""

    def write(folder: pathlib.Path) -> list[pathlib.Path]:
        points = {n: p.copy() for n, p in PLAIN.markers(SET).items()}
        return _trial(folder, change(points) or points)

    return write


def _pressed(change: Callable[[Recorded], Recorded], kind: str = "feet") -> Write:
    """The trial with its plates changed."""
    return lambda folder: _trial(folder, plates=[change(plate) for plate in PLAIN.plates(kind)])


def _edited(write: Write, old: str, new: str) -> Write:
    """A trial with one text of its first file changed."""

    def changed(folder: pathlib.Path) -> list[pathlib.Path]:
        files = write(folder)
        text = files[0].read_text()
        assert old in text, old
        files[0].write_text(text.replace(old, new, 1))
        return files

    return changed


def _noise(millimetres: float) -> Write:
    def shaken(points: Points) -> Points:
        rng = np.random.default_rng(5)
        return {n: p + rng.normal(0.0, 1e-3 * millimetres, p.shape) for n, p in points.items()}

    return _marked(shaken)


def _gap(start: float, end: float) -> Write:
    def lost(points: Points) -> None:
        for name in ("RLMAL", "RMMAL"):
            points[name][(PLAIN.time >= start) & (PLAIN.time < end)] = np.nan

    return _marked(lost)


def _renamed(**names: str) -> Write:
    return _marked(lambda points: {names.get(n, n): p for n, p in points.items()})


def _without(*names: str) -> Write:
    return _marked(lambda points: {n: p for n, p in points.items() if n not in names})


def _baseline(newton: float) -> Write:
    """Plates that were not zeroed: a constant force acts at the middle of each."""

    def offset(plate: Recorded) -> Recorded:
        force = plate.force + np.array([0.0, newton, 0.0])
        up = np.where(np.abs(force[:, 1:2]) < 0.5, 0.5, force[:, 1:2])
        place = (plate.force[:, 1:2] * plate.place + newton * plate.corners.mean(axis=0)) / up
        return dataclasses.replace(plate, force=force, place=place)

    return _pressed(offset, "steps")


def _dark(points: Points) -> None:
    """Frames in which nothing is seen."""
    for path in points.values():
        path[[74, 75, 144, 224]] = np.nan


def _twice(points: Points) -> None:
    points["TWICE"] = points["RLMAL"] + np.array([0.3, 0.2, 0.0])


def _spike(points: Points) -> None:
    points["RLMAL"][100] += np.array([0.2, 0.1, 0.0])


def _backward(folder: pathlib.Path) -> list[pathlib.Path]:
    """Time runs the other way: the walker goes backward."""
    plates = [
        dataclasses.replace(plate, force=plate.force[::-1], place=plate.place[::-1])
        for plate in PLAIN.plates("feet")
    ]
    return _trial(folder, {n: p[::-1] for n, p in PLAIN.markers(SET).items()}, plates)


def _model(scale: float, form: str, degrees: bool = True) -> Write:
    def write(folder: pathlib.Path) -> list[pathlib.Path]:
        model = write_osim(folder / "scaled.osim", PLAIN.walker, SET, scale=scale)
        if form == "markers":
            return [*_trial(folder), model]
        angles = write_angles(folder / "ik.mot", PLAIN.time, PLAIN.angles(), degrees=degrees)
        return [angles, model, write_forces(folder / "grf.mot", PLAIN.plates("feet"))]

    return write


def _circle(radius: float) -> Callable[[pathlib.Path], list[pathlib.Path]]:
    """The way bent to a circle to the left, markers and plates alike."""

    def bent(points: np.ndarray, time: np.ndarray, *, vector: bool = False) -> np.ndarray:
        way = PLAIN.walker.speed * time
        turn = way / radius
        ahead = points[:, 0] if vector else points[:, 0] - way
        out = points[:, 2] if vector else points[:, 2] + radius
        x, z = np.cos(turn) * ahead + np.sin(turn) * out, -np.sin(turn) * ahead + np.cos(turn) * out
        return np.column_stack([x, points[:, 1], z])

    def write(folder: pathlib.Path) -> list[pathlib.Path]:
        points = {n: bent(p, PLAIN.time) for n, p in in_world(PLAIN.walker, SET, PLAIN.time).items()}
        plates = [
            dataclasses.replace(
                plate, force=bent(plate.force, plate.time, vector=True), place=bent(plate.place, plate.time)
            )
            for plate in PLAIN.plates("feet")
        ]
        return _trial(folder, points, plates)

    return write


SPEED = Walker().speed
MASS = Walker().mass
BELT = Laboratory(belt=SPEED)


def _on_belt(folder: pathlib.Path) -> list[pathlib.Path]:
    return _trial(folder, laboratory=BELT)


MIRRORED = Laboratory(mirrored=True)

FAULTS: dict[str, Faulty] = {
    "noise of 3 mm": Faulty(_noise(3.0), "", loose=noise_bounds(3.0)),
    "noise of 5 mm": Faulty(_noise(5.0), "", loose=noise_bounds(5.0)),
    "gap of 50 ms in the ankle's markers": Faulty(_gap(0.90, 0.95), ""),
    "gap of 0.4 s in one stride's ankle": Faulty(
        _gap(0.90, 1.30), r"RLMAL|ankle", remark=True
    ),
    "ankle unseen for 1.9 s": Faulty(
        _gap(0.90, 2.80), r"RLMAL|ankle", r"RLMAL|ankle", remark=True
    ),
    "mass given 30 % high": Faulty(
        _trial, r"\b67(\.\d)? kg", r"mass", choices={"mass": 1.3 * MASS}, right=False
    ),
    "heel and toe exchanged": Faulty(
        _renamed(RCAL="RMT2", RMT2="RCAL", RMT1="RMT5"), r"heel.*toe|toe.*heel", r"heel.*toe|toe.*heel"
    ),
    "left and right exchanged": Faulty(
        _marked(lambda points: {"RL"[n[0] == "R"] + n[1:]: p for n, p in points.items()}),
        r"right and left are exchanged", side="left",
    ),
    "knee and ankle exchanged": Faulty(
        _renamed(RLFC="RLMAL", RLMAL="RLFC", RMFC="RMMAL", RMMAL="RMFC"),
        r"exchanged|swapped",
        r"exchanged|swapped",
    ),
    "millimetres said to be metres": Faulty(
        _edited(_trial, "\tmm\t", "\tm\t"), r"\bmm\b|milli", r"\bmm\b|milli|metre"
    ),
    "radians under a header of degrees": Faulty(
        _edited(_model(1.0, "angles", degrees=False), "inDegrees=no", "inDegrees=yes"), r"radian", r"radian"
    ),
    "a label twice, other points": Faulty(_edited(_marked(_twice), "TWICE", "RLMAL"), r"RLMAL", r"RLMAL"),
    "no force plates": Faulty(
        lambda folder: _trial(folder, plates=[]), r"force", r"force"
    ),
    "plate not zeroed, 30 N": Faulty(_baseline(30.0), r"\b(2[6-9]|3[0-4])(\.\d+)? N", remark=True),
    "a marker that leaps 22 cm for one frame": Faulty(_marked(_spike), r"ankle leaps"),
    "walk backward": Faulty(_backward, r"backward", r"backward", right=False),
    "markers with y up, plates with z up": Faulty(
        lambda folder: _trial(folder, plates=Laboratory(up="z").plates("feet")), r"axes|up", r"axes|up"
    ),
    "the foot's force on the ground": Faulty(
        _pressed(lambda plate: dataclasses.replace(plate, force=-plate.force)), r"turned round", remark=True
    ),
    "rows of NaN among the markers": Faulty(_marked(_dark), ""),
    "left-handed axes": Faulty(
        lambda folder: _trial(folder, laboratory=MIRRORED), r"left-handed|mirror", laboratory=MIRRORED
    ),
    "belt speed given 15 % high": Faulty(
        _on_belt, r"0\.9[5-9]|1\.0|15 ?%|13 ?%", choices={"belt_speed": 1.15 * SPEED}, right=False,
        laboratory=BELT,
    ),
    "no heel marker": Faulty(_without("RCAL"), r"heel", r"heel"),
    "no knee, no ankle, no toe": Faulty(
        _without("RLFC", "RMFC", "RLMAL", "RMMAL", "RMT1", "RMT2"), refuses=r"(?=.*knee)(?=.*ankle)(?=.*toe)"
    ),
    "no medial ankle marker": Faulty(_without("RMMAL"), "", loose=ONE_MALLEOLUS),
    "no pelvis markers": Faulty(_without("RASI", "LASI", "RPSI", "LPSI"), r"hip|pelvis", r"hip|pelvis"),
    "markers with another person's model": Faulty(
        _model(0.85, "markers"), r"1\.1[78] times|0\.85|\d mm", r"mm|%", right=False
    ),
    "angles with another person's model": Faulty(
        _model(0.85, "angles"), r"model", r"model", right=False
    ),
    "walk on a circle of 3 m": Faulty(_circle(3.0), r"circle|turn|curve", r"circle|turn|curve", right=False),
    "both feet on one plate": Faulty(
        lambda folder: _trial(folder, plates=PLAIN.plates("both")), refuses=r"both feet|foot alone|plate"
    ),
    "plates of another trial": Faulty(
        lambda folder: _trial(folder, plates=Laboratory(walker=Walker(start=0.9)).plates("feet")),
        r"pressure|foot|plate", r"pressure|foot|plate|clock", right=False,
    ),
    "heel marker named as the ankle": Faulty(
        _trial, refuses=r"the ankle lies 0 mm from the heel", choices={"markers": {"ankle": ("RCAL",)}}
    ),
    "heel and ankle exchanged": Faulty(
        _trial, refuses=r"2\.[34] cm.*N·m/kg.*the heel",
        choices={"markers": {"ankle": ("RCAL",), "heel": ("RLMAL",)}},
    ),
}  # fmt: skip
