"""The whole walker from the side: shank, foot and device as simulated, all else as recorded or as a sign.

Thigh and other leg are the recorded walk's. A recording has one leg, so the other one is drawn half a stride
later. Lengths of thigh, shank and trunk are shares of the body height (Winter 2009, figure 4.1). The lean of
the trunk and the head are signs. They are assumed, and no number depends on them.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import mujoco
import numpy as np

from afo_sim.common import InputError, find_gait
from afo_sim.description import load
from afo_sim.gait import GaitCycle
from afo_sim.gait.file import read
from afo_sim.metrics import Stride
from afo_sim.model import ANKLE, Foot, foot_of, muscle_names
from afo_sim.show.moving_parts import Mountings
from afo_sim.show.run_view import RunView
from afo_sim.simulation import Recording, reference_of, run_scenario

SHANK, THIGH, TRUNK, HEAD = 0.246, 0.245, 0.288, 0.09  # of the body height [-]; the head: to its centre
LEAN = 0.03  # of the trunk, forward; assumed [rad]
FAR, NEAR, BELOW, ABOVE, DEVICE, MOUNT = "0.8", "0.3", "#b3261e", "#1b7a4b", "#1054da", "0.55"
_TICKS = 0.25  # between marks on the floor [m]
_SAME = 1e-4  # toe clearance by which a reference that is walked again may differ [m]


@dataclass(frozen=True)
class Pose:
    """Points of a walker at one instant, x forward and z up from the floor [m] (2,).

    sole, other_sole : heel, ball, pulp and tip of the outsole (4, 2)
    muscles : the path of each, from origin to insertion (n, 2)
    """

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
class WalkingFigure:
    """The walker in one stride of a run.

    view : the run; it walks
    stride : whose poses are drawn
    cycle : the recorded walk that drives the run
    """

    view: RunView
    stride: Stride
    cycle: GaitCycle

    @classmethod
    def of(cls, view: RunView, stride: int = -1) -> "WalkingFigure":
        """The walker in one of the strides that count; by default the last, the settled one.

        Raises
        ------
        InputError
            The file of the recorded walk is not there any more.
        """
        return cls(view, view.strides[stride], read(find_gait(str(view.recording.scenario["gait"]["cycle"]))))

    @cached_property
    def height(self) -> float:
        """Of the body: the recorded walker's, or else the leg's [m]."""
        return float(self.cycle.body_height or load("leg", self.view.recording.scenario["leg"]).body_height)

    @cached_property
    def foot(self) -> Foot:
        """The foot with the outsole that is worn."""
        return foot_of(self._model, load("leg", self.view.recording.scenario["leg"]), ANKLE)

    @cached_property
    def _model(self) -> mujoco.MjModel:
        return mujoco.MjModel.from_xml_string(self.view.recording.model_xml)

    @cached_property
    def _mountings(self) -> Mountings:
        groups = muscle_names(load("orthosis", self.view.recording.scenario["orthosis"]))
        return Mountings(self._model, groups, self.view.recording.columns)

    def pose(self, phase: float) -> Pose:
        """The walker at a gait phase from 0 to 1 [-]."""
        names = ("ankle/position/x", "ankle/position/z", "shank/angle", "ankle/angle")
        x, z, shank, angle = (float(self.stride.at(name, phase)) for name in names)
        bent = "toe/extension" in self.view.recording.columns
        extension = float(self.stride.at("toe/extension", phase)) if bent else 0.0
        ankle = np.array([x, z])
        knee = _along(ankle, SHANK * self.height, shank)
        hip = _along(knee, THIGH * self.height, shank - self._recorded("knee_angle", phase))
        neck = _along(hip, TRUNK * self.height, LEAN)
        other = self._other_leg(hip, phase + 0.5)
        head, sole = _along(neck, HEAD * self.height, LEAN), self._sole(ankle, angle - shank, extension)
        return Pose(neck, head, hip, knee, ankle, sole, *other, self._paths(phase, ankle))

    def lowest(self, phase: float) -> float:
        """Height of the toes or the ball, whichever is lower [m]."""
        return min(float(self.stride.at(name, phase)) for name in ("toe/height", "ball/height"))

    def _other_leg(self, hip: np.ndarray, phase: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Knee, ankle and sole of the other leg, which hangs from the hip as recorded at a phase."""
        shank = self._recorded("shank_angle", phase)
        knee = _along(hip, -THIGH * self.height, shank - self._recorded("knee_angle", phase))
        ankle = _along(knee, -SHANK * self.height, shank)
        return knee, ankle, self._sole(ankle, self._recorded("ankle_angle", phase) - shank, 0.0)

    def _recorded(self, name: str, phase: float) -> float:
        return float(np.interp(phase % 1.0, self.cycle.phase, getattr(self.cycle, name), period=1.0))

    def _sole(self, ankle: np.ndarray, pitch: float, extension: float) -> np.ndarray:
        points = self.foot.outsole(np.array(pitch), extension).values()
        return np.array([ankle + np.array([float(x), float(z)]) for x, z in points])

    def _paths(self, phase: float, ankle: np.ndarray) -> tuple[np.ndarray, ...]:
        """Each muscle's path beside the drawn ankle, with cuff and plate where they are."""
        model, data = self._model, mujoco.MjData(self._model)
        for j in range(model.njnt):
            data.qpos[model.jnt_qposadr[j]] = self.stride.at(f"qpos/{model.joint(j).name}", phase)
        given = self._mountings.columns
        self._mountings.place({anchor: float(self.stride.at(name, phase)) for anchor, name in given.items()})
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_tendon(model, data)
        shift = ankle - data.xanchor[model.joint(ANKLE).id][[0, 2]]
        points = data.wrap_xpos.reshape(-1, 3)[:, [0, 2]]
        spans = zip(data.ten_wrapadr, data.ten_wrapnum, strict=True)
        return tuple(points[start : start + count] + shift for start, count in spans if count > 1)


def _along(start: np.ndarray, length: float, angle: float) -> np.ndarray:
    """The upper end of a segment that leans forward by `angle` [rad]."""
    end: np.ndarray = start + length * np.array([np.sin(angle), np.cos(angle)])
    return end


def reference_view(recording: Recording, label: str, colour: str) -> RunView | None:
    """The walk that a run is compared with, walked again; None where there is none, or it walks otherwise.

    It walks otherwise where a file of its scenario has changed, or this program has since the run.
    """
    before = recording.metrics.get("reference_toe_clearance")
    if before is None or not recording.scenario.get("reference"):
        return None
    try:
        again = run_scenario(reference_of(load("scenario", recording.scenario)))
    except InputError:
        return None
    now = again.metrics.get("toe_clearance")
    same = again.ok and now is not None and abs(now.value - before.value) < _SAME
    return RunView(label, colour, again) if same else None


def draw_figure(axis: Any, figure: WalkingFigure, phase: float, *, letters: float = 13.0) -> None:
    """Draw a walker in true proportions, the hip at x = 0, with the height of the toes in swing.

    Parameters
    ----------
    axis : of matplotlib; what it shows is cut to the figure
    figure, phase : who is drawn, and at which gait phase [-]
    letters : size of the words [point]
    """
    pose = figure.pose(phase)
    shift = np.array([pose.hip[0], 0.0])
    _draw_leg(axis, FAR, (5.0, 3.0), shift, pose.hip, pose.other_knee, pose.other_ankle, pose.other_sole)
    _line(axis, NEAR, 16.0, shift, [pose.neck, pose.hip])
    axis.plot(*(pose.head - shift), "o", color=NEAR, ms=22.0)
    _draw_leg(axis, NEAR, (7.0, 4.0), shift, pose.hip, pose.knee, pose.ankle, pose.sole)
    for path in pose.muscles:
        cuff = pose.knee + (pose.ankle - pose.knee) * _share(pose, path[0])
        _line(axis, MOUNT, 5.0, shift, [cuff, path[0]])
        _line(axis, DEVICE, 2.5, shift, path)
    if phase > figure.stride.toe_off:
        low = figure.lowest(phase)
        colour = BELOW if low < 0.0 else ABOVE
        words = f"toe {abs(1e3 * low):.0f} mm {'below' if low < 0.0 else 'above'} the floor"
        tip = pose.sole[-1] - shift
        axis.plot([tip[0], tip[0]], [0.0, tip[1]], color=colour, lw=2.0)
        axis.text(0.0, -0.16, words, ha="center", va="center", color=colour, fontsize=letters, weight="bold")
    _draw_floor(axis, float(shift[0]))


def _share(pose: Pose, point: np.ndarray) -> float:
    """Where a point stands along the shank, from the knee (0) to the ankle (1)."""
    shank = pose.ankle - pose.knee
    return float((point - pose.knee) @ shank / (shank @ shank))


def _draw_leg(
    axis: Any, colour: str, widths: tuple[float, float], shift: np.ndarray, *points: np.ndarray
) -> None:
    """Hip, knee, ankle and the foot."""
    *joints, sole = points
    _line(axis, colour, widths[0], shift, joints)
    axis.fill(*(np.array([joints[-1], *sole[:2]]) - shift).T, color=FAR, lw=0.0)
    _line(axis, colour, widths[1], shift, sole)


def _line(axis: Any, colour: str, width: float, shift: np.ndarray, points: Any) -> None:
    look: dict[str, Any] = {"solid_capstyle": "round", "solid_joinstyle": "round"}
    axis.plot(*(np.array(points) - shift).T, color=colour, lw=width, **look)


def _draw_floor(axis: Any, gone: float) -> None:
    """The floor with marks that pass under the walker, who has gone some way [m]."""
    axis.axhline(0.0, color="0.3", lw=1.2, zorder=0)
    for mark in np.arange(-0.75, 1.01, _TICKS) - gone % _TICKS:
        axis.plot([mark, mark - 0.04], [0.0, -0.04], color="0.6", lw=1.0, zorder=0)
    axis.set(xlim=(-0.85, 0.85), ylim=(-0.22, 1.72), aspect="equal")
    axis.set_axis_off()
