"""Pictures of walking: all shipped walkers; a drop foot with and without S1's orthosis, in film and viewer.

    python scripts/walk_pictures.py [--walkers] [--out models/scenarios/pictures]

`--walkers` draws the shipped walkers alone. The others need what `afo-sim view --screenshot` needs.
"""

import argparse
import io
import pathlib
import tempfile
from typing import Any

import matplotlib
import mujoco
import numpy as np
import small_png
from matplotlib.figure import Figure
from PIL import Image

import afo_sim
from afo_sim.common import GRAVITY
from afo_sim.gait import norm as gait_norm
from afo_sim.metrics import Stride
from afo_sim.model import ANKLE, foot_of
from afo_sim.show import COLOURS, INTERNAL, STYLE, RunView, video
from afo_sim.show.rerun import screenshot, write_comparison
from afo_sim.show.walking_figure import WalkingFigure, reference_view

SCENARIOS = ("walk-dropfoot", "walk-dropfoot-afo", "walk-dropfoot-afo-short")
PHASES = (0.01, 0.24, 0.50, 0.82)  # of the first settled stride
# The scene in the viewer's picture: left, top, right, bottom [pixel]. Without valves its pane is taller.
BARE, WORN = (7, 66, 793, 688), (140, 66, 660, 478)
SIZE, GAP = (400, 317), 6  # of each scene, and between two [pixel]
SEEN = 7.80  # moment of the comparison, left of the plots' legends [strides]

WALKERS = (*(f"bovi2011_{task}" for task in ("xs", "s", "natural", "m", "l")), "gatk_mean", "opensim_walk")
POSES = (0.0, 0.55, 0.75, 0.85)  # of the settled stride
APART = 0.42  # poses side by side [m]
SHANK, WEIGHT = 0.26, 0.22  # drawn: of the shank; of a force of one body weight [m]
SKIN, SOLE, FORCE, BAND = "0.35", COLOURS[1], COLOURS[0], "0.72"


def settled_start(run: afo_sim.Recording) -> float:
    """Time at which the settled strides begin [s]."""
    return float(run["time"][int(np.argmax(run["gait/solved"] == 1.0))])


def moments(runs: list[afo_sim.Recording], folders: list[pathlib.Path], scratch: pathlib.Path) -> Image.Image:
    """The scenes of each run at each phase of its settled stride: a row for each run."""
    wide, high = (length + GAP for length in SIZE)
    picture = Image.new("RGB", (len(PHASES) * wide - GAP, len(runs) * high - GAP), "white")
    for row, (run, folder) in enumerate(zip(runs, folders, strict=True)):
        box = WORN if RunView("", SOLE, run).has_orthosis else BARE
        for column, phase in enumerate(PHASES):
            taken = scratch / "moment.png"
            at = settled_start(run) + phase * run.metrics["stride_time"].value
            screenshot(folder / "recording.rrd", taken, at)
            scene = Image.open(taken).convert("RGB").crop(box).resize(SIZE, Image.Resampling.LANCZOS)
            picture.paste(scene, (column * wide, row * high))
    return picture


def in_viewer(out: pathlib.Path) -> None:
    """Draw the drop foot's moments, and the comparison of its runs."""
    with tempfile.TemporaryDirectory() as name:
        scratch = pathlib.Path(name)
        runs = [afo_sim.run(scenario, {"duration": "13.2 s"}) for scenario in SCENARIOS]
        folders = [run.save(scratch / scenario) for scenario, run in zip(SCENARIOS, runs, strict=True)]
        drawn = moments(runs, folders, scratch)
        both = scratch / "both.rrd"
        write_comparison([folders[-1], folders[0]], both)
        screenshot(both, scratch / "both.png", SEEN * runs[0].metrics["stride_time"].value)
        compared = Image.open(scratch / "both.png").convert("RGB")
        compared = compared.resize((1200, 675), Image.Resampling.LANCZOS)
    small_png.save(filmed(runs[1]), out / "film.png")
    small_png.save(drawn, out / "walk-moments.png")
    small_png.save(compared, out / "walk-compared.png")


def filmed(run: afo_sim.Recording) -> Image.Image:
    """Push-off and mid-swing of the film, without and with the device."""
    reference = reference_view(run, "", SOLE)
    assert reference is not None
    rows = []
    for phase in PHASES[2:]:
        for title, view in (("without the device", reference), ("with S1's device", RunView("", SOLE, run))):
            with video.Painter(view.recording, 640, 720, WalkingFigure.of(view), title) as painter:
                rows.append(painter.picture(phase).copy())
    return Image.fromarray(np.hstack(rows)).resize((1280, 360), Image.Resampling.LANCZOS)


def pose(axis: Any, run: afo_sim.Recording, stride: Stride, phase: float, at: float) -> None:
    """The leg at a phase, its ankle at x = `at` [m], with the ground's force where it stands."""
    names = ("ankle/position/x", "ankle/position/z", "shank/angle", "ankle/angle", "toe/extension")
    x, z, shank, ankle, extension = (float(stride.at(name, phase)) for name in names)
    model = mujoco.MjModel.from_xml_string(run.model_xml)
    foot = foot_of(model, afo_sim.load("leg", run.scenario["leg"]), ANKLE)
    pitch = np.array(ankle - shank)
    heel, ball, pulp, tip = (
        (at + float(px), z + float(pz)) for px, pz in foot.outsole(pitch, extension).values()
    )
    knee = at + SHANK * np.sin(shank), z + SHANK * np.cos(shank)
    axis.plot(*zip(knee, (at, z), strict=True), color=SKIN, lw=3.0, solid_capstyle="round")
    axis.fill(*zip((at, z), heel, ball, strict=True), color="0.85", lw=0.0)
    axis.plot(*zip(heel, (at, z), ball, strict=True), color=SKIN, lw=1.0)
    axis.plot(*zip(heel, ball, pulp, tip, strict=True), color=SOLE, lw=1.6, marker="o", ms=1.8)
    force = [float(stride.at(f"ground/force/{a}", phase)) / (GRAVITY * stride.body_mass) for a in "xz"]
    if force[1] > 0.05:
        start = at + float(stride.at("ground/position/x", phase)) - x
        axis.annotate(
            "",
            (start + WEIGHT * force[0], WEIGHT * force[1]),
            (start, 0.0),
            arrowprops={"arrowstyle": "-|>", "color": FORCE, "lw": 1.2, "shrinkA": 0.0, "shrinkB": 0.0},
        )
    axis.text(at, -0.035, f"{100.0 * phase:.0f} %", ha="center", va="top", fontsize=7.5)


def scene(axis: Any, run: afo_sim.Recording, stride: Stride) -> None:
    """The leg at POSES on the floor."""
    for k, phase in enumerate(POSES):
        pose(axis, run, stride, phase, APART * k)
    axis.axhline(0.0, color="0.3", lw=0.8, zorder=0)
    axis.set_aspect("equal")
    axis.set_xlim(-0.25, APART * (len(POSES) - 1) + 0.32)
    axis.set_ylim(-0.085, 0.46)
    axis.set_axis_off()


def clearance(axis: Any, run: afo_sim.Recording, stride: Stride) -> str:
    """Height of the outsole in swing with its event, and of otherwise extended toes; the event in words."""
    x, own = 100.0 * stride.phase, 1e3 * stride["sole/height"]
    low, high = (1e3 * stride[f"sole/height_{how}_extended"] for how in ("less", "more"))
    axis.fill_between(x, low, high, color=SOLE, alpha=0.3, lw=0.0, label="toes extended by 6 to 16°, assumed")
    axis.plot(x, own, color=SOLE, label="lowest of the outsole")
    seen = x[stride.fast & stride.passing]
    axis.axvspan(seen[0], seen[-1], color="0.93", lw=0.0, zorder=0, label="where the minimum counts")
    names = ("", "_less_extended", "_more_extended", "_phase")
    height, less, more, when = (run.metrics[f"toe_clearance{name}"].value for name in names)
    axis.plot(when, height, "o", ms=5.0, color=FORCE, label="toe clearance, of toes less to more extended")
    words = f"{height:.0f} mm ({less:.0f} to {more:.0f})" if abs(more - less) >= 1.0 else f"{height:.0f} mm"
    axis.annotate(
        f"{words}, {when:.0f} %", (0.97, 0.98), xycoords="axes fraction", ha="right", va="top", fontsize=8.0
    )
    axis.axhline(0.0, color="0.3", lw=0.8)
    axis.set_xlim(60.0, 100.0)
    axis.set_ylim(-15.0, 105.0)
    return words


def moment(axis: Any, stride: Stride) -> None:
    """Whole internal moment per mass, the file's, and the norm's band; plantarflexion upward."""
    fine = np.linspace(0.0, 1.0, 401)
    low, high = (-gait_norm.read().at(f"moment_{end}", fine) for end in ("high", "low"))
    look = {"color": BAND, "lw": 2.5, "label": "published means of moment"}  # two means, often alike
    axis.fill_between(100.0 * fine, low, high, **look)
    total = -sum(stride[name] for name in INTERNAL) / stride.body_mass
    axis.plot(100.0 * stride.phase, total, color=SOLE, lw=1.3, label="moment of the run")
    recorded = -stride["gait/ankle_moment"] / stride.body_mass
    axis.plot(100.0 * stride.phase, recorded, "k--", lw=0.9, label="of inverse dynamics")
    axis.axvline(100.0 * stride.toe_off, color="0.6", lw=0.6, ls=":")
    axis.axhline(0.0, color="0.75", lw=0.6, zorder=0)
    axis.set_xlim(0.0, 100.0)
    axis.set_ylim(-0.3, 2.0)


def draw_walkers(figure: Any) -> None:
    """A row for each shipped walker: scene, clearance, moment."""
    axes = figure.subplots(len(WALKERS), 3, width_ratios=[2.0, 1.35, 1.35])
    for row, name in zip(axes, WALKERS, strict=True):
        run = afo_sim.run("walk-healthy", {"gait.cycle": name, "duration": "5 s"})
        stride = RunView("", SOLE, run).strides[-1]
        scene(row[0], run, stride)
        words = clearance(row[1], run, stride)
        moment(row[2], stride)
        speed = float(np.ptp(stride["ankle/position/x"]) / np.ptp(stride["time"]))
        title = f"{name}, {speed:.2f} m/s, {stride.body_mass:.3g} kg"
        row[0].set_title(title, loc="left", fontsize=9.0)
        row[1].set_ylabel("[mm]")
        row[2].set_ylabel("[N·m/kg]")
        print(f"{title}: toe clearance {words}, at {run.metrics['toe_clearance_phase'].value:.1f} %")
    for axis in axes[-1, 1:]:
        axis.set_xlabel("gait cycle [%]")
    axes[0, 1].set_title("outsole above the floor", loc="left")
    axes[0, 2].set_title("ankle moment, plantarflexion +", loc="left")
    handles, labels = (
        a + b for a, b in zip(*(axis.get_legend_handles_labels() for axis in axes[0, 1:]), strict=True)
    )
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=8.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    place = pathlib.Path(__file__).resolve().parents[1] / "models" / "scenarios" / "pictures"
    parser.add_argument("--walkers", action="store_true")
    parser.add_argument("--out", type=pathlib.Path, default=place)
    given = parser.parse_args()
    with matplotlib.rc_context(STYLE):
        figure, drawn = Figure(figsize=(9.6, 11.2), layout="constrained"), io.BytesIO()
        draw_walkers(figure)
        figure.savefig(drawn, dpi=110, format="png")
    small_png.save(Image.open(drawn), given.out / "walkers.png")
    if not given.walkers:
        in_viewer(given.out)


if __name__ == "__main__":
    main()
