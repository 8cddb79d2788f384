"""The whole walker from the side: shank, foot and device as simulated, all else as recorded or as a sign.

Thigh and other leg are the recorded walk's, the other one half a stride later, its knee bent until its sole
is not below the floor. Lengths are shares of the body height (Winter 2009, figure 4.1). Trunk and head are
signs: assumed, and no number depends on them.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np

from afo_sim.common import InputError, JsonMapping, Keywords
from afo_sim.description import load
from afo_sim.gait import GaitCycle
from afo_sim.metrics import Stride, without_floor
from afo_sim.model import ANKLE, Foot, foot_of, muscle_names, person_of, persons_stride
from afo_sim.show.ground_force import above
from afo_sim.show.moving_parts import Mountings
from afo_sim.show.run_view import RunView
from afo_sim.show.style import BLUE, Axes
from afo_sim.simulation import Recording, reference_of, run_scenario

SHANK, THIGH, TRUNK, HEAD = 0.246, 0.245, 0.288, 0.09  # of the body height [-]; the head: to its centre
LEAN = 0.03  # of the trunk, forward; assumed [rad]
_APART = 0.16  # of the legs in space [m]
_SEGMENTS = (  # beside the simulated leg: from, to, radius, how far beyond that leg [m]
    ("knee", "hip", 0.06, 0.0),
    ("other_knee", "hip", 0.06, _APART),
    ("other_ankle", "other_knee", 0.045, _APART),
    ("hip", "neck", 0.1, 0.5 * _APART),
    ("head", "head", 0.1, 0.5 * _APART),
    ("other_ankle", "heel", 0.016, _APART),
    ("other_ankle", "ball", 0.016, _APART),
    ("heel", "ball", 0.016, _APART),
    ("ball", "tip", 0.016, _APART),
)
RADII = tuple(radius for *_, radius, _ in _SEGMENTS)  # of the capsules in space [m]
FAR, NEAR, MOUNT = "0.8", "0.3", "0.55"
BELOW, ABOVE, DEVICE = "#b3261e", "#1b7a4b", BLUE.lower()
COLUMNS = ("ankle/position/x", "ankle/position/z", "shank/angle", "ankle/angle")  # that limbs are drawn from
_TICKS = 0.25  # between marks on the floor [m]
SAME = 0.1  # toe clearance by which a reference that is walked again may differ [mm]


@dataclass(frozen=True)
class Pose:
    """Points of a walker at one instant, x forward and z up from the floor [m] (2,)."""

    neck: np.ndarray
    head: np.ndarray
    hip: np.ndarray
    knee: np.ndarray
    ankle: np.ndarray
    sole: np.ndarray
    other_knee: np.ndarray
    other_ankle: np.ndarray
    other_sole: np.ndarray
    muscles: tuple[np.ndarray, ...]


@dataclass(frozen=True, eq=False)
class Limbs:
    """What is drawn of a walker above the simulated shank, and of the other leg."""

    cycle: GaitCycle
    height: float
    foot: Foot

    @classmethod
    def of(cls, recording: Recording, model: mujoco.MjModel) -> "Limbs":
        """Those of the person that walks in a run."""
        scenario = recording.scenario
        foot = foot_of(model, scenario.leg, ANKLE)
        return cls(persons_stride(scenario), person_of(scenario).body_height, foot)

    def points(self, ankle: np.ndarray, shank: np.ndarray, phase: np.ndarray) -> dict[str, np.ndarray]:
        """Joints (n, 2) and the other sole (n, 4, 2) by their names in `Pose` [m]."""
        knee = _along(ankle, SHANK * self.height, shank)
        hip = _along(knee, THIGH * self.height, shank - self._recorded("knee_angle", phase))
        neck = _along(hip, TRUNK * self.height, LEAN)
        found = {"knee": knee, "hip": hip, "neck": neck, "head": _along(neck, HEAD * self.height, LEAN)}
        # The other leg hangs from the hip as recorded; its knee bends until its sole is not below the floor.
        phase, length = phase + 0.5, SHANK * self.height
        shank = self._recorded("shank_angle", phase)
        knee = _along(hip, -THIGH * self.height, shank - self._recorded("knee_angle", phase))
        ankle = _along(knee, -length, shank)
        sole = self.sole(ankle, self._recorded("ankle_angle", phase) - shank, 0.0)
        sunk = np.minimum(sole[..., 1].min(axis=-1), 0.0)[..., None] * np.array([0.0, 1.0])
        ankle, sole = ankle - sunk, sole - sunk[..., None, :]
        down = ankle - hip
        far = np.linalg.norm(down, axis=-1, keepdims=True)
        along = 0.5 * (far + (THIGH**2 - SHANK**2) * self.height**2 / far)
        ahead = np.sqrt(np.maximum((THIGH * self.height) ** 2 - along**2, 0.0))
        forward = down[..., ::-1] * np.array([-1.0, 1.0])
        found["other_knee"] = hip + (along * down + ahead * forward) / far
        return found | {"other_ankle": ankle, "other_sole": sole}

    def sole(self, ankle: np.ndarray, pitch: np.ndarray, extension: np.ndarray | float) -> np.ndarray:
        """Heel, ball, pulp and tip of the outsole (n, 4, 2) [m]."""
        points = self.foot.outsole(pitch, extension).values()
        return ankle[..., None, :] + np.stack([np.stack(point, axis=-1) for point in points], axis=-2)

    def _recorded(self, name: str, phase: np.ndarray) -> np.ndarray:
        return np.interp(phase % 1.0, self.cycle.phase, getattr(self.cycle, name), period=1.0)


@dataclass(frozen=True, eq=False)
class WalkingFigure:
    """The walker in one stride of a run."""

    view: RunView
    stride: Stride

    @classmethod
    def of(cls, view: RunView, stride: int = -1) -> "WalkingFigure":
        """The walker in one of the strides that count; by default the last, the settled one."""
        if not view.strides:
            raise InputError("has no whole stride to draw", field=view.label or "the run")
        figure = cls(view, view.strides[stride])
        _ = figure.limbs
        return figure

    @cached_property
    def limbs(self) -> Limbs:
        """Of its walker."""
        return Limbs.of(self.view.recording, self._model)

    @cached_property
    def _model(self) -> mujoco.MjModel:
        return mujoco.MjModel.from_xml_string(self.view.recording.model_xml)

    @cached_property
    def _mountings(self) -> Mountings:
        groups = muscle_names(load("orthosis", self.view.recording.described["orthosis"]))
        return Mountings(self._model, groups, self.view.recording.columns)

    def pose(self, phase: float) -> Pose:
        """The walker at a gait phase from 0 to 1 [-]."""
        x, z, shank, angle = (self.stride.at(name, phase) for name in COLUMNS)
        bent = "toe/extension" in self.view.recording.columns
        extension = self.stride.at("toe/extension", phase) if bent else 0.0
        ankle = np.array([x, z])
        points = self.limbs.points(ankle, shank, np.array(phase))
        sole = self.limbs.sole(ankle, angle - shank, extension)
        paths = wrapped_paths(self._model, self._mountings, lambda n: float(self.stride.at(n, phase)), ankle)
        return Pose(ankle=ankle, sole=sole, muscles=paths, **points)

    def lowest(self, phase: float, *, floor: bool = True) -> float:
        """Height of toes or ball, whichever is lower [m]; without a floor, of a swing that none catches."""
        names: Iterable[str] = ("toe/height", "ball/height")
        if not floor:
            names = (without_floor(self.view.recording.columns, name) for name in names)
        return min(float(self.stride.at(name, phase)) for name in names)


def wrapped_paths(
    model: mujoco.MjModel, mountings: Mountings, at: Callable[[str], float], ankle: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Each muscle's path at a drawn ankle, by the values of the columns."""
    data = mujoco.MjData(model)
    mountings.pose(data, at)
    shift = ankle - data.xanchor[model.joint(ANKLE).id][[0, 2]]
    points = data.wrap_xpos.reshape(-1, 3)[:, [0, 2]]
    spans = zip(data.ten_wrapadr, data.ten_wrapnum, strict=True)
    return tuple(points[start : start + count] + shift for start, count in spans if count > 1)


def _along(start: np.ndarray, length: float, angle: np.ndarray | float) -> np.ndarray:
    """The upper ends (n, 2) of segments that lean forward by `angle` [rad] (n,)."""
    return start + length * np.stack([np.sin(angle), np.cos(angle)], axis=-1)


def capsules(points: JsonMapping) -> np.ndarray:
    """Ends of the capsules of RADII in space (n, k, 2, 3) [m], from `Limbs.points` or one `Pose`'s fields."""
    sole = dict(zip(("heel", "ball", "pulp", "tip"), np.moveaxis(points["other_sole"], -2, 0), strict=True))
    places = {**points, **sole}
    ends = np.stack([np.stack([places[a], places[b]], -2) for a, b, _, _ in _SEGMENTS], -3)
    aside = np.broadcast_to(np.array([away for *_, away in _SEGMENTS])[:, None], ends.shape[:-1])
    return np.stack([ends[..., 0], aside, ends[..., 1]], axis=-1)


def reference_view(recording: Recording, label: str, colour: str) -> RunView | None:
    """The walk that a run is compared with, walked again; None where there is none, or it walks otherwise."""
    before = recording.metrics.get("reference_toe_clearance")
    if before is None or not recording.described.get("reference"):
        return None
    try:
        again = run_scenario(reference_of(recording.scenario))
    except InputError:
        return None
    now = again.metrics.get("toe_clearance")
    same = again.ok and now is not None and abs(now.value - before.value) < SAME
    return RunView(label, colour, again) if same else None


def height_words(low: float, deep: float) -> str:
    """The height of the toes, and of those that the floor carries how deep they would be without it [m]."""
    return f"toe {above(low)}" if deep >= 0.0 else f"toe drags, {-1e3 * deep:.0f} mm too low"


def draw_figure(axis: Axes, figure: WalkingFigure, phase: float) -> None:
    """Draw a walker in true proportions, the hip at x = 0, with the height of the toes in swing."""
    pose = figure.pose(phase)
    shift = np.array([pose.hip[0], 0.0])
    _draw_leg(axis, FAR, (5.0, 3.0), shift, pose.hip, pose.other_knee, pose.other_ankle, pose.other_sole)
    _line(axis, NEAR, 16.0, shift, [pose.neck, pose.hip])
    axis.plot(*(pose.head - shift), "o", color=NEAR, ms=22.0)
    _draw_leg(axis, NEAR, (7.0, 4.0), shift, pose.hip, pose.knee, pose.ankle, pose.sole)
    shank = pose.ankle - pose.knee
    for path in pose.muscles:
        cuff = pose.knee + shank * float((path[0] - pose.knee) @ shank / (shank @ shank))  # where it stands
        _line(axis, MOUNT, 5.0, shift, [cuff, path[0]])
        _line(axis, DEVICE, 2.5, shift, path)
    if phase > figure.stride.toe_off:
        low, deep = figure.lowest(phase), figure.lowest(phase, floor=False)
        colour = BELOW if deep < 0.0 else ABOVE
        tip = pose.sole[-1] - shift
        axis.plot([tip[0], tip[0]], [0.0, tip[1]], color=colour, lw=2.0)
        look: Keywords = {"ha": "center", "va": "center", "fontsize": 13.0, "weight": "bold"}
        axis.text(0.0, -0.16, height_words(low, deep), color=colour, **look)
    axis.axhline(0.0, color="0.3", lw=1.2, zorder=0)
    for mark in np.arange(-0.75, 1.01, _TICKS) - float(shift[0]) % _TICKS:  # which pass under the walker
        axis.plot([mark, mark - 0.04], [0.0, -0.04], color="0.6", lw=1.0, zorder=0)
    axis.set(xlim=(-0.85, 0.85), ylim=(-0.22, 1.72), aspect="equal")
    axis.set_axis_off()


def _draw_leg(
    axis: Axes, colour: str, widths: tuple[float, float], shift: np.ndarray, *points: np.ndarray
) -> None:
    *joints, sole = points
    _line(axis, colour, widths[0], shift, joints)
    axis.fill(*(np.array([joints[-1], *sole[:2]]) - shift).T, color=FAR, lw=0.0)
    _line(axis, colour, widths[1], shift, sole)


def _line(
    axis: Axes, colour: str, width: float, shift: np.ndarray, points: np.ndarray | list[np.ndarray]
) -> None:
    look: Keywords = {"solid_capstyle": "round", "solid_joinstyle": "round"}
    axis.plot(*(np.array(points) - shift).T, color=colour, lw=width, **look)
