"""The figure of a response: curves of its cases over the cycle, and falls of perturbed starts."""

import pathlib
from typing import Any

import numpy as np

from afo_sim.show.style import GREY, RUN_STYLES, RUNS, write_page
from afo_sim.walker import CASES, SAMPLES, Case, Response, norm_at, strides_of, walk_in_words

_SIZE = (7.2, 9.4)  # [inch]
_ROWS = {
    "thigh": "thigh [°]\nflexion +",
    "knee": "knee [°]\nflexion +",
    "ankle": "ankle [°]\ndorsiflexion +",
    "load": "vertical force\n[body weights]",
}
_SIDES = {"right": "the device's leg", "left": "the other leg"}
_NORM = {"color": "0.6", "lw": 2.2, "zorder": 1.0}


def look_of(case: Case) -> dict[str, Any]:
    """Colour and line of a case, the same in each picture; the first shows beneath another."""
    k = list(CASES).index(case.name)
    return {"color": RUNS[k], "ls": RUN_STYLES[k], "lw": 1.3 if k else 2.2}


def draw_response(response: Response, path: pathlib.Path) -> None:
    """Draw the curves of each case over its cycle beside the healthy norm, and its falls.

    Parameters
    ----------
    response : what `respond` gives
    path : file to write; its suffix, png, pdf or svg, is the format
    """

    def fill(figure: Any) -> None:
        grid = figure.add_gridspec(5, 2, height_ratios=(1.0, 1.0, 1.0, 1.0, 0.8))
        first = response["healthy"]
        norm = norm_at(round(first.gait.speed, 2), first.walked.body.size.taller)
        for row, (name, label) in enumerate(_ROWS.items()):
            axes = [figure.add_subplot(grid[row, column]) for column in (0, 1)]
            for axis, side in zip(axes, _SIDES, strict=True):
                _curves(axis, response, side, name, norm)
                axis.set(xlim=(0.0, 100.0), xlabel="gait cycle [%]" if row == len(_ROWS) - 1 else "")
            axes[0].set_ylabel(label)
            low, high = zip(*(axis.get_ylim() for axis in axes), strict=True)
            for axis in axes:
                axis.set_ylim(min(low), max(high))
            if row == 0:
                for axis, side in zip(axes, _SIDES.values(), strict=True):
                    axis.set_title(side, loc="left")
                handles, names = axes[0].get_legend_handles_labels()
        _falls(figure.add_subplot(grid[-1, :]), response)
        figure.legend(handles, names, loc="outside upper left", ncols=2)

    write_page(path, _SIZE, fill)


def _curves(axis: Any, response: Response, side: str, name: str, norm: dict[str, np.ndarray]) -> None:
    """The mean curve of each case that has strides; the others stand in the legend alone."""
    cycle, factor = np.linspace(0.0, 100.0, SAMPLES), 1.0 if name == "load" else 180.0 / np.pi
    label = f"healthy norm at {response['healthy'].gait.speed:.2f} m/s, Bovi et al. 2011"
    axis.plot(cycle, factor * norm[name], label=label, **_NORM)
    for case in response.cases.values():
        strides, label = strides_of(case.walked, side), f"{CASES[case.name]}: {walk_in_words(case)}"
        curve = factor * strides.mean(name) if len(strides.duration) else np.full(SAMPLES, np.nan)
        axis.plot(cycle, curve, label=label, **look_of(case))


def _falls(axis: Any, response: Response) -> None:
    """Share of perturbed starts that fall, with its interval."""
    cases = [case for case in response.cases.values() if case.falls is not None]
    for place, case in enumerate(cases):
        assert case.falls is not None
        share, (low, high) = 100.0 * case.falls.count / case.falls.of, case.falls.interval
        axis.barh(place, share, height=0.6, color=look_of(case)["color"], alpha=0.55)
        axis.plot([100.0 * low, 100.0 * high], [place, place], color="0.2", lw=1.4, marker="|", ms=7.0)
    axis.set_yticks(range(len(cases)), [CASES[case.name] for case in cases])
    axis.set(xlim=(0.0, 101.0), ylim=(max(len(cases), 1) - 0.4, -0.6))
    axis.set_xlabel("perturbed starts that fall in simulation [%], with 95 % interval")
    if not cases:
        axis.text(50.0, 0.0, "no perturbed starts were asked for", ha="center", color=GREY)
