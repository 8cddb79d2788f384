"""S0's study of a three-element muscle, on the stand: contractile force, contraction under load, open loop.

The muscle of S0 itself (MAS-20-250N) is published without its coefficients; the two muscles whose are known
stand in for it. S0 filled through a proportional regulator, here a small solenoid valve does.

    python scripts/static_load_study.py [OUT]
"""

import pathlib
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from afo_sim.lab import Trial, set_point_text, static_load
from afo_sim.lab import stand_trial as stand
from afo_sim.show import COLOURS, write_figure
from afo_sim.show.stand_figure import colour

MUSCLES = ("reynolds_2003", "serres_2009")


def main() -> None:
    """Run, print the lines, draw."""
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "runs")
    isobaric = [stand.isobaric(name) for name in MUSCLES]
    isotonic = [stand.isotonic(name) for name in MUSCLES]
    step = [stand.step(name) for name in MUSCLES]
    for trial in isobaric:
        print(f"{trial.name}: {static_load(trial).text}")
    for trial in step:
        constants = ", ".join(f"{m['fill_contraction_time_constant'].value:.2f}" for m in trial.metrics)
        print(f"{trial.name}: open loop under {trial.plan.load[0]:g} N, time constants {constants} s")
    for suffix in ("png", "pdf"):
        draw_study(isobaric, isotonic, step, folder / f"static_load.{suffix}")
    print(f"written to {folder / 'static_load.png'}")


def draw_study(
    isobaric: Sequence[Trial],
    isotonic: Sequence[Trial],
    step: Sequence[Trial],
    path: pathlib.Path,
) -> None:
    """Draw S0's figures, a row a muscle: F_ce with its line, contraction under loads, open loop.

    Parameters
    ----------
    isobaric, isotonic, step : a test of each muscle, in the same order
    path : file to write; its suffix is the format
    """

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


if __name__ == "__main__":
    main()
