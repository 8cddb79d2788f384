"""The figure of a response: curves of its cases over the cycle, and falls of perturbed starts."""

import pathlib

import numpy as np

from afo_sim.common import JsonDict
from afo_sim.show.panels import legend
from afo_sim.show.style import RUN_STYLES, RUNS, Axes, new_figure
from afo_sim.walker import CASES, LEGS, SAMPLES, Case, Response, norm_at, sole_tilt, strides_of, walk_in_words

_SIZE = (7.2, 9.4)  # [inch]
_ROWS = {
    "thigh": "thigh [°]\nflexion +",
    "knee": "knee [°]\nflexion +",
    "ankle": "ankle [°]\ndorsiflexion +",
    "load": "vertical force\n[body weights]",
}


def look_of(case: Case) -> JsonDict:
    """Colour and line of a case, the same in each picture; the first shows beneath another."""
    k = list(CASES).index(case.name)
    return {"color": RUNS[k], "ls": RUN_STYLES[k], "lw": 1.3 if k else 2.2}


def draw_response(response: Response, path: pathlib.Path) -> None:
    """Draw the curves of each case over its cycle with the healthy norm, and its falls."""
    with new_figure(path, _SIZE) as figure:
        grid = figure.add_gridspec(len(_ROWS) + 1, 2)
        axes = [[figure.add_subplot(grid[row, k]) for k in (0, 1)] for row in range(len(_ROWS))]
        for row, name in zip(axes, _ROWS, strict=True):
            for axis, side in zip(row, LEGS, strict=True):
                _curves(axis, response, side, name)
                axis.sharey(row[0])
            row[0].set_ylabel(_ROWS[name])
        for top, bottom, leg in zip(axes[0], axes[-1], LEGS.values(), strict=True):
            top.set_title(f"the {leg}", loc="left")
            bottom.set_xlabel("gait cycle [%]")
        axis = figure.add_subplot(grid[-1, :])
        for place, case in enumerate(response.cases.values()):
            if case.falls is not None:
                share, ends = 100.0 * case.falls.count / case.falls.of, 100.0 * np.array(case.falls.interval)
                axis.barh(place, share, height=0.6, color=look_of(case)["color"], alpha=0.55)
                axis.plot(ends, [place, place], color="0.2", lw=1.4, marker="|", ms=7.0)
        axis.set_yticks(range(len(response.cases)), [CASES[name] for name in response.cases])
        axis.set(xlim=(0.0, 101.0), ylim=(len(response.cases) - 0.4, -0.6))
        axis.set_xlabel("perturbed starts that fall in simulation [%], with 95 % interval")
        legend(figure, (row[0] for row in axes), columns=2)


def _curves(axis: Axes, response: Response, side: str, name: str) -> None:
    """The mean curve of each case that has strides; the others stand in the legend alone."""
    cycle, factor = np.linspace(0.0, 100.0, SAMPLES), 1.0 if name == "load" else 180.0 / np.pi
    healthy = response["healthy"]
    speed = round(healthy.gait.speed, 2)
    norm = factor * norm_at(speed, healthy.walked.body.size.taller)[name]
    axis.plot(cycle, norm, color="0.6", lw=2.2, label=f"healthy norm at {speed} m/s, Bovi et al. 2011")
    if name == "ankle" and (tilt := np.degrees(sole_tilt(healthy.walked.body))) > 0.1:
        words = f"the norm in these shoes, whose soles tilt by {tilt:.1f}°"
        axis.plot(cycle, norm - tilt, color="0.6", lw=1.2, ls=":", label=words)
    for case in response.cases.values():
        strides, label = strides_of(case.walked, side), f"{CASES[case.name]}: {walk_in_words(case)}"
        curve = factor * strides.mean(name) if len(strides.duration) else np.full(SAMPLES, np.nan)
        axis.plot(cycle, curve, label=label, **look_of(case))
