"""A response in motion: lines of its walkers, for film and viewer, and the film, in real time."""

import pathlib
from collections.abc import Callable, Iterable

import mujoco
import numpy as np

from afo_sim.common import Keywords, replacing
from afo_sim.model import ANKLE, POINTS, SOLE
from afo_sim.show.moving_parts import Mountings, joint_columns, padded
from afo_sim.show.style import BLUE, Axes, ink, styled
from afo_sim.show.walker_figure import look_of
from afo_sim.show.walking_figure import HEAD, TRUNK
from afo_sim.walker import CASES, ROOT, SIDES, Case, Response, contacts, floor_of, walk_in_words

_PICTURES, _EVERY = 75, 0.08  # of the film, and time between them [s]
_WIDE, _BEHIND, _TALL = 8.0, 0.6, 1.95  # walkway, its part behind the first place, height that is seen [m]
_DOTS, _SHADES = 80, 32  # per metre, colours
_LIMBS = {"left": ("0.72", 3.5), "trunk": ("0.2", 9.0), "right": ("0.2", 4.0)}
_LIMBS |= {
    f"healthy {limb}": ("#9ed8d0" if limb == "left" else "#0a8f7f", 1.4) for limb in _LIMBS
}  # beside another
_SIDES = dict(zip(("left", "right"), reversed(SIDES), strict=True))  # what the model's names begin with


def draw_film(response: Response, path: pathlib.Path) -> None:
    """Film the first seconds of each undisturbed walk, cases below each other, as a GIF."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from PIL import Image

    cases, frames = list(response.cases.values()), []
    with styled():
        figure = Figure(figsize=(_WIDE, _TALL * len(cases)), dpi=_DOTS, facecolor="white")
        canvas, share = FigureCanvasAgg(figure), 1.0 / len(cases)
        places = (figure.add_axes((0.0, 1.0 - (k + 1) * share, 1.0, share)) for k in range(len(cases)))
        movers = [_filmed(axis, case, cases[0]) for axis, case in zip(places, cases, strict=True)]
        for number in range(_PICTURES):
            for move in movers:
                move(number)
            canvas.draw()
            frames.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB"))
    palette = frames[-1].quantize(_SHADES)
    first, *others = (frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    told = "; ".join(f"{CASES[case.name]}: {walk_in_words(case)}" for case in cases)
    many: Keywords = {"append_images": others, "duration": round(1e3 * _EVERY), "loop": 0}
    many["comment"] = f"Film from the side, the healthy walker in thin lines over each. {told}."
    with replacing(path) as temporary:
        first.save(temporary, format="GIF", save_all=True, optimize=True, **many)


def _beside(case: Case, healthy: Case, rows: np.ndarray, hips: np.ndarray) -> dict[str, np.ndarray]:
    """The healthy walker's lines at the phases of a case's rows, between contacts of the right foot alike."""
    steps = [contacts(each.walked, "right") for each in (case, healthy)]
    count = min(map(len, steps))
    ours, theirs = (np.r_[0, each[:count], each[:count].max(initial=0) + 1e6] for each in steps)
    alike = np.interp(rows, ours, theirs).round().astype(int)
    found = poses(healthy, alike.clip(max=len(healthy.walked["time"]) - 1))
    ahead = np.c_[hips - found["trunk"][:, 0, 0], np.zeros((len(rows), 2))]
    return {f"healthy {limb}": found[limb] + ahead[:, None] for limb in ("left", "trunk", "right")}


def _filmed(axis: Axes, case: Case, healthy: Case) -> Callable[[int], None]:
    """A walker on its walkway, the healthy one over it; what moves it to the picture of a number."""
    time = case.walked["time"]
    rows = np.searchsorted(time, _EVERY * np.arange(_PICTURES)).clip(max=len(time) - 1)
    seen = poses(case, rows)
    seen |= {} if case is healthy else _beside(case, healthy, rows, seen["trunk"][:, 0, 0])
    axis.set(xlim=(-_BEHIND, _WIDE - _BEHIND), ylim=(-0.12, _TALL - 0.12))
    axis.axhline(0.0, color="0.3", lw=1.2)
    axis.vlines(np.arange(round(_WIDE)), -0.04, 0.0, color="0.3", lw=1.2)
    axis.set_axis_off()
    look: Keywords = {"transform": axis.transAxes, "weight": "bold", "va": "top"}
    title = CASES[case.name] + ("" if case is healthy else "; thin lines: healthy, at the same phase")
    axis.text(0.01, 0.97, title, color=ink(look_of(case)["color"]), **look)
    words = axis.text(0.99, 0.97, "", color="#b3261e", ha="right", **look)
    lines = {}
    for name in seen:
        colour, width = _LIMBS.get(name, (BLUE, 1.6))
        (lines[name],) = axis.plot([], [], color=colour, lw=width, solid_capstyle="round")
    (head,) = axis.plot([], [], "o", color="0.2", ms=13.0)

    def move(number: int) -> None:
        for name, line in lines.items():
            points = seen[name][number]
            line.set_data(*(points[:-1] if name == "trunk" else points)[:, [0, 2]].T)
        head.set_data(*seen["trunk"][number, -1:, [0, 2]])
        fell = case.walked.fell
        words.set_text("" if fell is None or number * _EVERY < fell else walk_in_words(case))

    return move


def coordinates(case: Case) -> dict[str, np.ndarray]:
    """The columns of a walk by the names of the model's coordinates, qpos/… and time."""
    found, kept = {"time": case.walked["time"]}, case.walked.columns
    for column in joint_columns(case.walked.body.model):
        name = column.removeprefix("qpos/")
        own = name.replace("left_", "left/") if name.startswith("left_") else f"right/{name}"
        found[column] = kept[f"trunk/{name}" if name in ROOT else own]
    found["qpos/pitch"] = found["qpos/pitch"] - floor_of(case.walked.body.scenario).slope  # to the floor
    return found


def poses(case: Case, rows: Iterable[int]) -> dict[str, np.ndarray]:
    """A walker's lines at some rows, each (n, places, 3), x forward, y left, z up [m]."""
    body, kept = case.walked.body, coordinates(case)
    model = body.model
    data, moved, trunk = mujoco.MjData(model), Mountings(model, {}, ()), model.body("trunk").id
    up = 1.75 * body.size.taller * np.array([[0.0], [TRUNK], [TRUNK + HEAD]])
    found: dict[str, list[np.ndarray]] = {}
    for row in rows:
        moved.pose(data, lambda name, row=row: float(kept[name][row]))  # type: ignore[misc]  # `row` is no argument
        legs = {}
        for side, prefix in _SIDES.items():
            joints = [data.xanchor[model.joint(f"{prefix}{name}").id] for name in ("hip", "knee", ANKLE)]
            sole = [data.site(f"{prefix}{SOLE}{point}").xpos for point in POINTS]
            legs[side] = np.array([*joints, *sole, joints[-1]])
        hip = 0.5 * (legs["left"][0] + legs["right"][0])
        now = {"left": legs["left"], "trunk": hip + up * data.xmat[trunk][2::3], "right": legs["right"]}
        points = data.wrap_xpos.reshape(-1, 3)
        for name in body.ids.muscles if body.ids else ():
            tendon = model.tendon(name).id
            first = data.ten_wrapadr[tendon]
            now[name] = points[first : first + data.ten_wrapnum[tendon]].copy()
        for name, line in now.items():
            found.setdefault(name, []).append(line)
    return {name: padded(lines) for name, lines in found.items()}
