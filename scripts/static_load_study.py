"""S0's study of a three-element muscle, on the stand: contractile force, contraction under load, open loop.

The muscle of S0 itself (MAS-20-250N) is published without its coefficients; the two muscles whose are known
stand in for it. S0 filled through a proportional regulator, here a small solenoid valve does.

    python scripts/static_load_study.py [OUT]
"""

import pathlib
import sys

from afo_sim.lab import stand_trial as stand
from afo_sim.lab import static_load
from afo_sim.show import draw_study

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


if __name__ == "__main__":
    main()
