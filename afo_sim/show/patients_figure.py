"""The figure of a population: each patient's ankle, and each patient's numbers from case to case."""

import pathlib

import numpy as np

from afo_sim.common import JsonDict
from afo_sim.show.style import RUN_STYLES, RUNS, new_figure
from afo_sim.walker import NAMES, SAMPLES, Population, norm_at

_CHANGED = {  # numbers of each patient: what is written beside them, factor
    "falls": ("starts that fall [%]", 100.0),
    "right/clearance": ("toe clearance [mm]", 1e3),
    "right/ankle_swing": ("ankle in mid-swing [°]\ndorsiflexion +", 1.0),
    "right/thigh_max": ("greatest flexion\nof the thigh [°]", 1.0),
    "speed": ("speed [m/s]", 1.0),
    "cost_of_transport": ("cost of transport\n[J/(kg·m)]", 1.0),
}
_TICKS = dict(
    zip(NAMES, ("none", "device\n1st day", "device\nweeks", "spring\n1st day", "spring\nweeks"), strict=True)
)
_SPEED = 1.22  # of the norm that is drawn [m/s]


def look_of(case: str) -> JsonDict:
    """Colour and line of a case."""
    k = list(NAMES).index(case)
    return {"color": RUNS[k], "ls": RUN_STYLES[k]}


def draw_patients(population: Population, path: pathlib.Path) -> None:
    """Draw the ankle of each patient in each case, and each patient's numbers from case to case."""
    cases, cycle = population.cases, np.linspace(0.0, 100.0, SAMPLES)
    norm = np.degrees(norm_at(_SPEED)["ankle"])
    with new_figure(path, (7.6, 7.0)) as figure:
        rows = figure.add_gridspec(3, 1, height_ratios=(1.0, 0.9, 0.9))
        top, below = rows[0].subgridspec(1, len(cases)), [rows[k].subgridspec(1, 3) for k in (1, 2)]
        axis = None
        for k, (case, patients) in enumerate(cases.items()):
            axis = figure.add_subplot(top[k], sharey=axis)
            axis.plot(cycle, norm, color="0.6", lw=2.2)
            walks = [one.curves["right/ankle"] for one in patients if "right/ankle" in one.curves]
            curves, colour = np.degrees(walks), look_of(case)["color"]
            for curve in curves:
                axis.plot(cycle, curve, color=colour, lw=0.6, alpha=0.5)
            if walks:
                axis.plot(cycle, np.median(curves, axis=0), color=colour, lw=2.0)
            title = NAMES[case].replace(", ", "\n")
            axis.set_title(f"{title}\n{len(curves)} of {len(patients)} walk", loc="left")
            axis.set_xlabel("gait cycle [%]")
            axis.tick_params(labelleft=k == 0)
            if k == 0:
                axis.set_ylabel("ankle of the device's leg [°]\ndorsiflexion +")
        for k, (name, (label, factor)) in enumerate(_CHANGED.items()):
            axis = figure.add_subplot(below[k // 3][k % 3])
            table = factor * np.array([population.values(case, name) for case in cases])
            spread = np.linspace(-0.16, 0.16, table.shape[1]) if name == "falls" else 0.0  # beside each other
            places = np.arange(len(cases))[:, None] + spread * np.ones(table.shape[1])
            axis.plot(places, table, color="0.7", lw=0.5, marker=".", ms=3.0, zorder=1)
            middle = [np.median(row[np.isfinite(row)]) if np.isfinite(row).any() else np.nan for row in table]
            middle = table.mean(axis=1) if name == "falls" else middle
            axis.plot(range(len(cases)), middle, color="0.1", lw=1.2, marker="_", ms=14.0, mew=2.2, zorder=2)
            axis.set_xticks(range(len(cases)), [_TICKS[case] for case in cases])
            axis.tick_params(axis="x", labelsize=7.0)
            axis.set(ylabel=label, xlim=(-0.4, len(cases) - 0.6))
            if name == "falls":
                axis.set_ylim(-3.0, 103.0)
        words = f"{len(population.drawn)} patients, {population.condition.name}. Thin: each patient; thick: "
        words += f"median (of falls the mean); grey: norm on bare feet, {_SPEED} m/s, Bovi et al. 2011"
        figure.suptitle(words, fontsize="small", x=0.01, ha="left")
