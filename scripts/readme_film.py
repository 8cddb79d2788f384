"""The README's film: a drop foot without and with S1's device, one settled stride in slow motion.

    python scripts/readme_film.py [--out docs/drop_foot.gif]

The first wears the shoe that the verdict compares with, the second the device's own outsole. There is no
floor: a toe that trips passes through.
Foot, shank and toe height are the simulation's. Thigh and other leg are the recorded walk's, which has one
leg: the other one is drawn half a stride later. Trunk and head are signs.
"""

import argparse
import pathlib
from dataclasses import dataclass
from typing import Any

import matplotlib
import mujoco
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

import afo_sim
from afo_sim.common import find_gait
from afo_sim.gait import GaitCycle
from afo_sim.gait.file import read
from afo_sim.metrics import Stride
from afo_sim.model import ANKLE, Foot, foot_of
from afo_sim.show import STYLE, RunView
from afo_sim.simulation import reference_of

TITLES = {"in a trainer, without the device": True, "with S1's device": False}  # whether nothing else is worn
FRAMES, LASTS = 96, 8.0  # of the film, and its length [s]
# Of the body height: Winter 2009, figure 4.1; the head is a sign.
SHANK, THIGH, TRUNK, HEAD = 0.246, 0.245, 0.288, 0.09
FAR, NEAR, BELOW, GOOD, DEVICE = "0.8", "0.3", "#b3261e", "#1b7a4b", "#1054da"
COLOURS_OF_ALL = 32
TICKS = 0.25  # between marks on the floor [m]
MOST = 1_500_000  # [bytes]


@dataclass(frozen=True)
class Walk:
    """One settled stride of a run, and what its figure is drawn from."""

    title: str
    run: afo_sim.Recording
    stride: Stride
    cycle: GaitCycle
    foot: Foot
    height: float

    @classmethod
    def of(cls, title: str, *, bare: bool) -> "Walk":
        described = afo_sim.load("scenario", "walk-dropfoot-afo")
        run = afo_sim.run(reference_of(described) if bare else described)
        model, leg = mujoco.MjModel.from_xml_string(run.model_xml), afo_sim.load("leg", run.scenario["leg"])
        cycle = read(find_gait(run.scenario["gait"]["cycle"]))
        height = cycle.body_height or leg.body_height
        return cls(title, run, RunView("", NEAR, run).strides[-1], cycle, foot_of(model, leg, ANKLE), height)

    def recorded(self, name: str, phase: float) -> float:
        """A column of the recorded walk at a phase [-]."""
        return float(np.interp(phase % 1.0, self.cycle.phase, getattr(self.cycle, name), period=1.0))


def along(start: np.ndarray, length: float, angle: float) -> np.ndarray:
    """The upper end of a segment that leans forward by `angle` [rad]."""
    return start + length * np.array([np.sin(angle), np.cos(angle)])


def draw(axis: Any, walk: Walk, phase: float) -> None:
    """The figure at a phase, its hip at x = 0."""
    stride, height = walk.stride, walk.height
    names = ("ankle/position/x", "ankle/position/z", "shank/angle", "ankle/angle", "toe/extension")
    x, z, shank, angle, extension = (float(stride.at(name, phase)) for name in names)
    knee = along(np.array([0.0, z]), SHANK * height, shank)
    hip = along(knee, THIGH * height, shank - walk.recorded("knee_angle", phase))
    shift = np.array([hip[0], 0.0])
    ankle = np.array([0.0, z]) - shift
    heel, ball, pulp, tip = sole(walk, ankle, angle - shank, extension)
    knee, hip = knee - shift, hip - shift
    other_leg(axis, walk, phase + 0.5, hip)
    neck = along(hip, TRUNK * height, 0.03)
    limb(axis, NEAR, 16.0, neck, hip)
    axis.plot(*along(neck, HEAD * height, 0.03), "o", color=NEAR, ms=22.0)
    limb(axis, NEAR, 7.0, hip, knee, ankle)
    axis.fill(*zip(ankle, heel, ball, strict=True), color="0.8", lw=0.0)
    limb(axis, NEAR, 4.0, heel, ball, pulp, tip)
    if "chamber/dorsiflexor/pressure" in walk.run.columns:
        device(axis, knee, ankle, ball)
    lowest = 1e3 * min(float(stride.at(name, phase)) for name in ("toe/height", "ball/height"))
    if phase > stride.toe_off:
        colour = BELOW if lowest < 0.0 else GOOD
        words = f"toe {abs(lowest):.0f} mm {'below' if lowest < 0.0 else 'above'} the floor"
        axis.plot([tip[0], tip[0]], [0.0, tip[1]], color=colour, lw=2.0)
        axis.text(0.0, -0.16, words, ha="center", va="center", color=colour, fontsize=13, weight="bold")
    axis.set_title(walk.title, fontsize=13, weight="bold", pad=2.0)
    floor(axis, x - shift[0])


def sole(walk: Walk, ankle: np.ndarray, pitch: float, extension: float = 0.0) -> list[np.ndarray]:
    """Heel, ball, pulp of the toe and its tip, below an ankle; angles [rad]."""
    points = walk.foot.outsole(np.array(pitch), extension).values()
    return [ankle + np.array([float(x), float(z)]) for x, z in points]


def other_leg(axis: Any, walk: Walk, phase: float, hip: np.ndarray) -> None:
    """The other leg as it is recorded at a phase, from the hip down."""
    shank = walk.recorded("shank_angle", phase)
    knee = along(hip, -THIGH * walk.height, shank - walk.recorded("knee_angle", phase))
    ankle = along(knee, -SHANK * walk.height, shank)
    heel, ball, pulp, tip = sole(walk, ankle, walk.recorded("ankle_angle", phase) - shank)
    limb(axis, FAR, 5.0, hip, knee, ankle)
    axis.fill(*zip(ankle, heel, ball, strict=True), color=FAR, lw=0.0)
    limb(axis, FAR, 3.0, heel, ball, pulp, tip)


def device(axis: Any, knee: np.ndarray, ankle: np.ndarray, ball: np.ndarray) -> None:
    """The cuff below the knee and the muscle from there to the forefoot; where, is of no scale."""
    along_shank = (knee - ankle) / np.linalg.norm(knee - ankle)
    ahead = np.array([along_shank[1], -along_shank[0]])
    top, low = ankle + 0.33 * along_shank, ankle + 0.25 * along_shank
    limb(axis, "0.55", 11.0, top, low)
    limb(axis, DEVICE, 3.5, low + 0.05 * ahead, 0.55 * ball + 0.45 * ankle + 0.02 * along_shank)


def limb(axis: Any, colour: str, width: float, *points: np.ndarray) -> None:
    """Segments through points."""
    look: dict[str, Any] = {"solid_capstyle": "round", "solid_joinstyle": "round"}
    axis.plot(*zip(*points, strict=True), color=colour, lw=width, **look)


def floor(axis: Any, gone: float) -> None:
    """The floor with marks that pass under the walker, who has gone some way [m]."""
    axis.axhline(0.0, color="0.3", lw=1.2, zorder=0)
    for mark in np.arange(-0.75, 1.01, TICKS) - gone % TICKS:
        axis.plot([mark, mark - 0.04], [0.0, -0.04], color="0.6", lw=1.0, zorder=0)
    axis.set(xlim=(-0.85, 0.85), ylim=(-0.22, 1.72), aspect="equal")
    axis.set_axis_off()


def frame(walks: list[Walk], phase: float) -> Image.Image:
    """Both walks side by side."""
    figure = Figure(figsize=(8.0, 5.0), dpi=100, facecolor="white")
    for place, walk in enumerate(walks):
        draw(figure.add_axes((0.5 * place, 0.0, 0.5, 0.92)), walk, phase)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    place = pathlib.Path(__file__).resolve().parents[1] / "docs" / "drop_foot.gif"
    parser.add_argument("--out", type=pathlib.Path, default=place)
    out = parser.parse_args().out
    with matplotlib.rc_context(STYLE):
        walks = [Walk.of(title, bare=bare) for title, bare in TITLES.items()]
        frames = [frame(walks, phase) for phase in np.linspace(0.0, 1.0, FRAMES, endpoint=False)]
    palette = frames[int(0.86 * FRAMES)].quantize(COLOURS_OF_ALL)
    first, *others = (each.quantize(palette=palette, dither=Image.Dither.NONE) for each in frames)
    many: dict[str, Any] = {"append_images": others, "duration": 1e3 * LASTS / FRAMES, "loop": 0}
    first.save(out, save_all=True, optimize=True, **many)
    if out.stat().st_size > MOST:
        raise SystemExit(f"{out} is too large: {out.stat().st_size} bytes, allowed {MOST}")


if __name__ == "__main__":
    main()
