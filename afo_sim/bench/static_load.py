"""S0's static load study of a three-element muscle: contractile force and stiffness over pressure.

At rest L = F_ce(p) − K(p) x: at each pressure the stand's isobaric curve is a straight line over the
shortening x, whose start is F_ce and whose slope is −K. S0 draws F_ce over pressure with its line.
"""

import pathlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.bench.trial import Trial
from afo_sim.show.figure import COLOURS, RESOLUTION, STYLE
from afo_sim.show.stand_figure import colour, set_point_text

PULLING = 0.02  # of F_ce: below it the muscle goes slack and its curve is no line


@dataclass(frozen=True)
class StaticLoad:
    """F_ce and K at each pressure, and the straight line of F_ce.

    pressure : gauge [Pa] (n,)
    contractile_force : F_ce [N] (n,)
    stiffness : K [N/m] (n,)
    start, slope : F_ce = start + slope p [N], [N/Pa]
    worst : greatest distance of F_ce from its line [N]
    """

    pressure: np.ndarray
    contractile_force: np.ndarray
    stiffness: np.ndarray
    start: float
    slope: float
    worst: float

    @property
    def text(self) -> str:
        """The line, for people."""
        low, high = self.stiffness.min() * 1e-3, self.stiffness.max() * 1e-3
        return (
            f"F_ce = {self.start:.1f} N + {self.slope * 1e3:.3f} N/kPa p (worst {self.worst:.2g} N off), "
            f"K {low:.2f} to {high:.2f} N/mm"
        )


def static_load(trial: Trial) -> StaticLoad:
    """F_ce and K from an isobaric test, as S0 takes them from hung loads.

    Parameters
    ----------
    trial : isobaric, of a muscle whose curves are straight; the mean of the ways up and down is taken
    """
    force, stiffness = [], []
    for k in range(len(trial.curves)):
        loop = trial.loop(k)
        pulls = loop["force"] > PULLING * loop["force"].max()
        shortening = trial.plan.muscle.nominal_length * loop["contraction"][pulls]
        slope, start = np.polyfit(shortening, loop["force"][pulls], 1)
        force.append(start)
        stiffness.append(-slope)
    pressure, contractile = trial.plan.set_points, np.array(force)
    slope, start = np.polyfit(pressure, contractile, 1) if len(pressure) > 1 else (0.0, contractile[0])
    worst = float(np.abs(start + slope * pressure - contractile).max())
    return StaticLoad(pressure, contractile, np.array(stiffness), float(start), float(slope), worst)


def draw_study(
    isobaric: Sequence[Trial],
    isotonic: Sequence[Trial],
    step: Sequence[Trial],
    path: pathlib.Path,
    suffix: str = "png",
) -> None:
    """Draw S0's figures, a row a muscle: F_ce with its line, contraction under loads, open loop.

    Parameters
    ----------
    isobaric, isotonic, step : a test of each muscle, in the same order
    path, suffix : file and format
    """
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(12.0, 2.7 * len(isobaric)), layout="constrained")
        rows = figure.subplots(len(isobaric), 3, squeeze=False)
        for axes, *trials in zip(rows, isobaric, isotonic, step, strict=True):
            _draw_contractile_force(axes[0], trials[0])
            _draw_contraction(axes[1], trials[1])
            _draw_open_loop(axes[2], trials[2])
        figure.savefig(path, format=suffix, dpi=RESOLUTION)


def _draw_contractile_force(axis: Any, trial: Trial) -> None:
    found = static_load(trial)
    line = np.array([found.pressure.min(), found.pressure.max()])
    axis.plot(line * 1e-5, found.start + found.slope * line, color=COLOURS[0], label="line")
    axis.plot(found.pressure * 1e-5, found.contractile_force, "o", ms=4, color=COLOURS[1], label="stand")
    axis.set_title(f"{trial.name}\n{found.start:.1f} N + {found.slope * 1e3:.3f} N/kPa p", loc="left")
    axis.set_xlabel("gauge pressure [bar]")
    axis.set_ylabel("contractile force F_ce [N]")
    axis.margins(0.05)
    axis.set_ylim(bottom=0.0)
    axis.legend(loc="lower right")


def _draw_contraction(axis: Any, trial: Trial) -> None:
    for k in range(len(trial.curves)):
        loop = trial.loop(k)
        up = loop["branch"] % 2 == 0
        shade, text = colour(trial, k), set_point_text(trial, k)
        axis.plot(loop["pressure"][up] * 1e-5, 100.0 * loop["contraction"][up], color=shade, label=text)
    axis.set_title("under constant loads; grey: no coefficients published", loc="left")
    axis.set_xlabel("gauge pressure [bar]")
    axis.set_ylabel("contraction [%]")
    low, high = (p * 1e-5 for p in trial.plan.muscle.law_set.pressure_range)
    left, right = axis.get_xlim()
    for edge in ((left, max(low, left)), (min(high, right), right)):
        axis.axvspan(*edge, color="0.93", lw=0.0, zorder=0)
    axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _draw_open_loop(axis: Any, trial: Trial) -> None:
    for k, columns in enumerate(trial.curves):
        axis.plot(columns["time"], 100.0 * columns["contraction"], color=colour(trial, k))
        tau = trial.metrics[k]["fill_contraction_time_constant"].value
        axis.plot([], [], color=colour(trial, k), label=f"{set_point_text(trial, k)}: τ = {tau:.2f} s")
    axis.set_title(f"open loop under {trial.plan.load[0]:g} N", loc="left")
    axis.set_xlabel("time [s]: filled, then vented")
    axis.set_ylabel("contraction [%]")
    axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
