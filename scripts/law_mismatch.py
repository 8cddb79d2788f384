"""Energy that each force law makes or loses in one cycle of the arm: the table of docs/accuracy.md.

python scripts/law_mismatch.py
"""

import numpy as np

from afo_sim import load
from afo_sim.model.build import build
from afo_sim.simulation import Energy, balance, run_built

SCENARIO, MUSCLE = "arm", "dmsp_20"
GROUPS = ("flexor", "extensor")
CYCLE = (6.5, 11.0)  # of its second cycle, in which each muscle is filled and vented once [s]


def cycle_of(law: str) -> Energy:
    """Energy balance of one cycle with a law of the muscle."""
    sets = {f"orthosis.muscle.{group}.type.law": law for group in GROUPS}
    built = build(load("scenario", SCENARIO, sets))
    run = run_built(built)
    assert run.ok, run.status
    inside = (run["time"] >= CYCLE[0] - 1e-9) & (run["time"] <= CYCLE[1] + 1e-9)
    return balance(built, {name: np.asarray(values)[inside] for name, values in run.columns.items()})


def main() -> None:
    """Print the table."""
    print("| law | net work of the air | lost in dampers | made by the law | of the turnover |")
    print("|---|---|---|---|---|")
    for law in load("muscle", MUSCLE).laws:
        found = cycle_of(law)
        numbers = f"{found.air_work:.2f} J | {found.damper_loss:.2f} J | {found.law_mismatch:+.2f} J"
        row = f"| `{law}` | {numbers} | {100.0 * found.mismatch:+.2f} % of {found.turnover:.0f} J |"
        print(row.replace("-", "−"))
        assert abs(found.error) < 1e-3  # of the turnover is found nowhere


if __name__ == "__main__":
    main()
