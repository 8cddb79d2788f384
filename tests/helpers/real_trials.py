"""Public walking trials and what others computed from them, read without the program's readers.

The sets are not part of the repository: `AFO_SIM_TRIALS` names their folder, else they are looked for
beside the repository in `shared/data/gait_trials`.
"""

import functools
import os
import pathlib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pytest

REPOSITORY = pathlib.Path(__file__).parents[2]
FOLDER = pathlib.Path(os.environ.get("AFO_SIM_TRIALS", REPOSITORY.parent / "shared" / "data" / "gait_trials"))
COMPUTED = REPOSITORY / "tests" / "gait_lab" / "opensim_reference"
MOCO, SUBJECT01, C3D = FOLDER / "moco_3d_walking", FOLDER / "subject01_walk1", FOLDER / "c3d"
STEP = 20.0  # upward force of a foot on the floor [N]
where_recorded = pytest.mark.skipif(
    not FOLDER.is_dir(),
    reason=f"the public walking trials are not at {FOLDER}; AFO_SIM_TRIALS names their folder",
)


@dataclass(frozen=True, eq=False)
class Curve:
    """A number over time, known from its first to its last time."""

    time: np.ndarray
    values: np.ndarray

    def at(self, time: np.ndarray) -> np.ndarray:
        """Its values, NaN where they are not known."""
        return np.interp(time, self.time, self.values, left=np.nan, right=np.nan)

    def between(self, start: float, end: float) -> "Curve":
        part = (self.time >= start) & (self.time <= end)
        return Curve(self.time[part], self.values[part])


@functools.cache
def table(path: pathlib.Path) -> Mapping[str, np.ndarray]:
    """Columns of an OpenSim table or of a CSV with # lines, by the coordinate's name."""
    lines = path.read_text(encoding="utf-8").splitlines()
    if path.suffix == ".csv":
        lines = [line.replace(",", " ") for line in lines if not line.startswith("#")]
    else:
        end = next(k for k, line in enumerate(lines) if line.strip().lower() == "endheader")
        lines = [line for line in lines[end + 1 :] if line.strip()]
    names = [name.split("/")[-2] if name.endswith("/value") else name for name in lines[0].split()]
    rows = np.array([line.split() for line in lines[1:]], dtype=float)
    return dict(zip(names, rows.T, strict=True))


def curve(path: pathlib.Path, name: str, factor: float = 1.0) -> Curve:
    """One column of a table over its first."""
    columns = table(path)
    return Curve(next(iter(columns.values())), factor * columns[name])


def upward_force(path: pathlib.Path, plate: str) -> Curve:
    """Upward force on a plate of an OpenSim file [N]."""
    return curve(path, f"{plate}vy")


def heel_strikes(force: Curve) -> np.ndarray:
    """Times at which an upward force passes 20 N [s]; the first sample counts if the force just begins."""
    above = force.values > STEP
    before = np.r_[force.values[0] > STEP + 5.0, above[:-1]]
    begins = np.flatnonzero(above & ~before)
    return np.asarray(force.time[begins])


@dataclass(frozen=True)
class Trial:
    """What a laboratory has of one trial, and the reference for it."""

    files: tuple[pathlib.Path, ...]
    model: pathlib.Path | None
    mass: float  # [kg]
    moments: tuple[pathlib.Path, str]  # file and column of the internal ankle moment, "?" for the side [N·m]
    angles: tuple[pathlib.Path, str, float]  # of the ankle angle, with the factor to degrees
    forces: tuple[pathlib.Path, Mapping[str, str]]  # file, and each side's plate
    known: tuple[float, float]  # when the reference holds [s]
    moment_error: float  # largest root mean square in stance [N·m/kg]
    angle_error: float  # likewise, without the mean difference [deg]
    malleoli: tuple[float, float] | None = None  # midpoint of the model's malleoli from its ankle joint,
    # forward and up along the shank [m], where the moment is asked for about it

    def moment(self, side: str) -> Curve:
        """Internal ankle moment, dorsiflexion positive [N·m/kg]."""
        file, column = self.moments
        return curve(file, column.replace("?", side[0]).replace("*", side), 1.0 / self.mass).between(
            *self.known
        )

    def about_malleoli(self, side: str, time: np.ndarray, shank: np.ndarray) -> np.ndarray:
        """What the moment gains about the malleoli's midpoint: ahead · Fz − above · Fx [N·m/kg]."""
        if self.malleoli is None:
            return np.zeros_like(time)
        file, plates = self.forces
        forward, up = (curve(file, plates[side] + axis, 1.0 / self.mass).at(time) for axis in ("vx", "vy"))
        along, above = self.malleoli
        ahead = along * np.cos(shank) + above * np.sin(shank)
        higher = above * np.cos(shank) - along * np.sin(shank)
        return np.asarray(ahead * up - higher * forward)

    def angle(self, side: str) -> Curve:
        """Ankle angle, dorsiflexion positive, with the reference's own zero [deg]."""
        file, column, factor = self.angles
        return curve(file, column.replace("?", side[0]).replace("*", side), factor).between(*self.known)

    def force(self, side: str) -> Curve:
        """Upward force on the side's plate [N]."""
        file, plates = self.forces
        return upward_force(file, plates[side])


# Inverse dynamics and kinematics have their ends cut off: 50 ms of filtering, where their residual force on
# the pelvis reaches 290 N in the middle of a walk with 25 N.
_WALK = MOCO / "grf_walk.mot", {"right": "ground_force_r_", "left": "ground_force_l_"}
_BELT = SUBJECT01 / "subject01_walk1_grf.mot", {"right": "ground_force_", "left": "l_ground_force_"}
_DEGREES = float(np.degrees(1.0))
_ID = MOCO / "id_walk.sto", "ankle_angle_?_moment"
_IK = MOCO / "coordinates.sto", "ankle_angle_?", _DEGREES
_OWN = COMPUTED / "moco_3d_walking_markers.csv"
_SCALED = MOCO / "subject_walk_scaled.osim"

TRIALS = {
    "overground, model and joint angles": Trial(
        (MOCO / "coordinates.sto", MOCO / "grf_walk.mot"),
        _SCALED, 85.27, _ID, _IK, _WALK, (0.5, 1.75), 0.06, 3.0,
    ),
    # The body of coordinates.sto lies up to 3 cm below the markers, which moves the ankle's moment: OpenSim's
    # own from these markers is up to 0.08 N·m/kg away from id_walk.sto. So it is the reference here.
    "overground, model and markers": Trial(
        (MOCO / "markers_walk.trc", MOCO / "grf_walk.mot"),
        _SCALED, 85.27, (_OWN, "ankle_moment_*"), _IK, _WALK, (0.15, 2.2), 0.06, 3.0,
    ),
    # The model's ankle joint lies 12 mm behind and 25 mm below the midpoint of its own malleoli, which is
    # where markers put the ankle. So the moment of id_walk.sto is moved there by statics.
    "overground, markers alone": Trial(
        (MOCO / "markers_walk.trc", MOCO / "grf_walk.mot"),
        None, 85.27, _ID, _IK, _WALK, (0.5, 1.75), 0.10, 5.0, malleoli=(0.0122, 0.0247),
    ),
    "overground, all there is": Trial(
        (MOCO / "coordinates.sto", MOCO / "markers_walk.trc", MOCO / "grf_walk.mot", MOCO / "id_walk.sto"),
        _SCALED, 85.27, _ID, _IK, _WALK, (0.5, 1.75), 0.06, 3.0,
    ),
    "treadmill, model and joint angles": Trial(
        (SUBJECT01 / "subject01_walk1_ik.mot", SUBJECT01 / "subject01_walk1_grf.mot"),
        SUBJECT01 / "subject01.osim",
        72.6, (COMPUTED / "subject01_walk1.csv", "ankle_moment_*"),
        (SUBJECT01 / "subject01_walk1_ik.mot", "ankle_angle_?", 1.0), _BELT, (0.45, 1.55), 0.06, 3.0,
    ),
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class C3DTrial:
    """A C3D file as ezc3d reads it: marker places and plates, in metres and the laboratory's axes (Z up)."""

    time: np.ndarray  # of the markers [s]
    markers: Mapping[str, np.ndarray]  # (n, 3) [m]
    force_time: np.ndarray
    forces: Mapping[str, np.ndarray]  # by side, without what the empty plate shows [N] (m, 3)
    places: Mapping[str, np.ndarray]  # centre of pressure [m] (m, 3)

    def forward(self) -> np.ndarray:
        """The way that the pelvis takes, level (3,)."""
        back = self.markers["RPSI"]
        back = back[np.isfinite(back).all(axis=1)]
        way = (back[-1] - back[0]) * [1.0, 1.0, 0.0]
        return np.asarray(way / np.linalg.norm(way))

    def moment(self, side: str) -> Curve:
        """Internal moment about the ankle centre that the file holds, in the plane of walking; the foot
        taken as massless, dorsiflexion positive [N·m]."""
        letter, forward = side[0].upper(), self.forward()
        ankle = self.markers[f"{letter}AJC"]
        seen = np.isfinite(ankle).all(axis=1)
        time = self.time[seen]
        lever, force = (
            np.column_stack([np.interp(time, self.force_time, column) for column in values.T])
            for values in (self.places[side], self.forces[side])
        )
        lever = lever - ankle[seen]
        moment = (lever @ forward) * force[:, 2] - lever[:, 2] * (force @ forward)
        return Curve(time, -np.where(force[:, 2] > STEP, moment, 0.0))

    def upward(self, side: str) -> Curve:
        """Upward force on the side's plate [N]."""
        return Curve(self.force_time, self.forces[side][:, 2])

    def heel_strikes(self, side: str) -> np.ndarray:
        """Times at which the heel is farthest ahead of the pelvis (Zeni 2008), 20 to 40 ms early [s]."""
        ahead = (self.markers[f"{side[0].upper()}CAL"] - self.markers["RPSI"]) @ self.forward()
        found = []
        for k in range(15, len(ahead) - 15):  # samples of 4 ms
            near, about = ahead[k - 15 : k + 16], ahead[max(k - 75, 0) : k + 76]
            if np.isfinite(near).all() and ahead[k] == np.nanmax(about):
                found.append(float(self.time[k]))
        return np.array(found)


@functools.cache
def c3d_trial(name: str) -> C3DTrial:
    """Both files: the left foot meets the first plate with its forefoot alone, the right foot the second."""
    import ezc3d

    file = ezc3d.c3d(str(C3D / name), extract_forceplat_data=True)
    labels = file["parameters"]["POINT"]["LABELS"]["value"]
    points = file["data"]["points"]
    forces, places = {}, {}
    for side, plate in zip(("left", "right"), file["data"]["platform"], strict=True):
        force = plate["force"].T
        forces[side] = force - np.median(force[:1500], axis=0)
        places[side] = plate["center_of_pressure"].T / 1000.0
    rate = file["parameters"]["POINT"]["RATE"]["value"][0]
    fast = file["parameters"]["ANALOG"]["RATE"]["value"][0]
    return C3DTrial(
        time=np.arange(points.shape[2]) / rate,
        markers={label: points[:3, k].T / 1000.0 for k, label in enumerate(labels)},
        force_time=np.arange(len(forces["left"])) / fast,
        forces=forces,
        places=places,
    )
