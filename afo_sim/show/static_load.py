"""S0's static load study, drawn: contractile force, contraction under loads, open loop."""

import pathlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from afo_sim.lab.stand_table import set_point_text
from afo_sim.lab.stand_trial import Trial, static_load
from afo_sim.show.stand_figure import colour
from afo_sim.show.style import COLOURS, plain, write_figure


def draw_study(
    isobaric: Sequence[Trial],
    isotonic: Sequence[Trial],
    step: Sequence[Trial],
    path: pathlib.Path,
) -> None:
    """Draw S0's figures, a row a muscle: F_ce with its line, contraction under loads, open loop."""

    def fill(figure: Any) -> None:
        rows = figure.subplots(len(isobaric), 3, squeeze=False)
        for axes, *trials in zip(rows, isobaric, isotonic, step, strict=True):
            _draw_contractile_force(axes[0], trials[0])
            _draw_contraction(axes[1], trials[1])
            _draw_open_loop(axes[2], trials[2])

    write_figure(path, (12.0, 2.7 * len(isobaric)), fill)


def _draw_contractile_force(axis: Any, trial: Trial) -> None:
    found = static_load(trial)
    line = np.array([found.pressure.min(), found.pressure.max()])
    axis.plot(line * 1e-5, found.start + found.slope * line, color=COLOURS[0], label="line")
    axis.plot(found.pressure * 1e-5, found.contractile_force, "o", ms=4, color=COLOURS[1], label="stand")
    axis.set_title(
        f"{plain(trial.name, None)}\n{found.start:.1f} N + {found.slope * 1e3:.3f} N/kPa p", loc="left"
    )
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
