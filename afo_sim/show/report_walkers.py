"""The walkers that a report begins with: without and with the device, where the toe clearance is taken."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from afo_sim.common import InputError, Keywords
from afo_sim.metrics import REFERENCES, without_floor
from afo_sim.show.ground_force import above
from afo_sim.show.report_figures import WIDTH, svg
from afo_sim.show.run_view import RunView
from afo_sim.show.style import Axes, styled
from afo_sim.show.walking_figure import ABOVE, BELOW, SAME, WalkingFigure, draw_figure, reference_view

_MOST = 3  # walkers beside one another, of whom one may be the reference
_TALL, _DEEP, _WIDE, _CLOSE = 0.99, 0.07, 0.52, 0.22  # of the body height: up, down, across; of the foot
_WHOLE, _GAP = 0.44, 0.03  # shares of the drawing's width: the whole walker, the space behind it
_BELOW = 0.27  # the floor above the lower edge, where the foot is enlarged and the number stands [inch]
_SCALE = 2.35  # at which `draw_figure` chose its lines [inch/m]
_COLUMNS = {"gait/stride", "ankle/position/x", "toe/height", "ball/height", "sole/height"}


@dataclass(frozen=True)
class _Walker:
    """A drawing as SVG text, with its gait phase [%]; its run, None of a reference."""

    run: RunView | None
    name: str
    drawing: str
    phase: str


def walkers(runs: Sequence[RunView]) -> list[_Walker]:
    """One for each run that walks, behind their reference where it fits, all wear a device and share it."""
    walking = [run for run in runs if run.recording.columns.keys() >= _COLUMNS and run.strides]
    shown: list[tuple[RunView | None, str, RunView]] = [(run, run.label, run) for run in walking]
    kinds = {run.recording.described.get("reference") for run in walking}
    found = [run.recording.metrics.get("reference_toe_clearance") for run in walking]
    heights = [float(height) for height in found if height is not None]
    # another patient's stands beside no run
    one = len(kinds) == 1 and len(heights) == len(walking) and max(heights) - min(heights) < SAME
    few = one and len(walking) < _MOST and all(run.has_orthosis for run in walking)
    before = reference_view(walking[0].recording, "", "") if few else None
    if before is not None:
        without, own = REFERENCES[walking[0].recording.described["reference"]]
        shown[0] = (walking[0], own if len(walking) == 1 else walking[0].label, walking[0])
        shown.insert(0, (None, without, before))
    among = max(len(shown), 2)
    return [walker for k, one in enumerate(shown) for walker in _drawn(f"walker{k}", *one, WIDTH / among)]


def _drawn(name: str, run: RunView | None, label: str, view: RunView, width: float) -> Iterator[_Walker]:
    """A walker, the foot enlarged beside it; none without a toe clearance, its recorded walk or a column."""
    from matplotlib.figure import Figure

    found = view.recording.metrics.get("toe_clearance_phase")
    if found is None or not math.isfinite(found.value):
        return
    phase, percent = found.value / 100.0, f"{found.value:.0f}"
    height = view.recording.metrics["toe_clearance"].value  # the mean that the answers state
    height_column = without_floor(view.recording.columns, "sole/height")
    off = [abs(1e3 * float(stride.at(height_column, phase)) - height) for stride in view.strides]
    try:
        walker = WalkingFigure.of(view, off.index(min(off)))
        pose = walker.pose(phase)
    except InputError:
        return
    with styled(**{"svg.fonttype": "path", "svg.hashsalt": name}):
        figure = Figure(figsize=(width, width * _WHOLE * (_TALL + _DEEP) / _WIDE))
        whole = figure.add_axes((0.0, 0.0, _WHOLE, 1.0))
        close = figure.add_axes((_WHOLE + _GAP, 0.0, 1.0 - _WHOLE - _GAP, 1.0))
        middle = 0.5 * (pose.sole[:, 0].min() + pose.sole[:, 0].max()) - pose.hip[0]
        _draw(whole, walker, phase, 0.0, _WIDE, _DEEP * width * _WHOLE / _WIDE)
        _draw(close, walker, phase, middle, _CLOSE, _BELOW)
        frame = [0.0, 1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 1.0, 0.0]
        close.plot(*frame, transform=close.transAxes, color="0.8", lw=1.5)
        look: Keywords = {"ha": "center", "va": "bottom", "fontsize": 9.0, "weight": "bold"}
        look |= {"color": BELOW if height < 0.0 else ABOVE, "transform": close.transAxes}
        close.text(0.5, 0.015, f"{height:+.0f} mm".replace("-", "−"), **look)
        told = f"in mid-swing at {percent} % of the gait cycle: toe {above(1e-3 * height)}"
        yield _Walker(run, label, svg(name, "Walker from the side", figure, told), percent)


def _draw(
    axis: Axes, walker: WalkingFigure, phase: float, middle: float, across: float, below: float
) -> None:
    """A walker without words, its lines as thick as its limbs."""
    draw_figure(axis, walker, phase)
    for text in list(axis.texts):
        text.remove()
    box, half = axis.bbox, 0.5 * across * walker.limbs.height
    scale = box.width / axis.figure.dpi / (2.0 * half)  # [inch/m]
    for line in axis.lines:
        thin = scale / _SCALE
        line.set(linewidth=max(thin * line.get_linewidth(), 0.7), markersize=thin * line.get_markersize())
    tall = box.height / axis.figure.dpi
    axis.set(xlim=(middle - half, middle + half), ylim=(-below / scale, (tall - below) / scale))
