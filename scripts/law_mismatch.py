"""Energy that each force law makes or loses: in one cycle of the arm, and in a fast walk on wide valves.

python scripts/law_mismatch.py

The tables of docs/accuracy.md. The volume ratios are V/V0 at a contraction ratio of 0.1 and 0.2 and 3 bar.
"""

import numpy as np

from afo_sim import load, run
from afo_sim.model.build import build
from afo_sim.simulation import Energy, balance, run_built

SCENARIO, MUSCLE = "arm", "dmsp_20"
GROUPS = ("flexor", "extensor")
CYCLE = (6.5, 11.0)  # of its second cycle, in which each muscle is filled and vented once [s]
FRONT, CHAMBER = "orthosis.muscle.dorsiflexor", "orthosis.chamber.dorsiflexor"
TAUT = 0.327  # path of muscle and link together [m]
WALK = {
    f"{FRONT}.count": 1,
    f"{CHAMBER}.inlet": "vt307",
    f"{CHAMBER}.outlet": "vt307",
    "gait.stride_time": "0.9 s",
    "supply.pressure": "5 bar",
}


def cycle_of(law: str) -> Energy:
    """Energy balance of one cycle with a law of the muscle."""
    sets = {f"orthosis.muscle.{group}.type.law": law for group in GROUPS}
    built = build(load("scenario", SCENARIO, sets))
    found = run_built(built)
    assert found.ok, found.status
    inside = (found["time"] >= CYCLE[0] - 1e-9) & (found["time"] <= CYCLE[1] + 1e-9)
    return balance(built, {name: np.asarray(values)[inside] for name, values in found.columns.items()})


def walked(muscle: str, law: str) -> str:
    """The row of one muscle and law in the walk."""
    own = load("muscle", muscle).using(law=law)
    link = f"{TAUT - own.total_length!r} m"
    found = run("walk-dropfoot-afo", WALK | {f"{FRONT}.type": own, f"{FRONT}.link_length": link})
    assert found.ok, found.status
    full, one, two = own.volume(contraction=[0.0, 0.1, 0.2], pressure=3e5) - own.dead_volume
    kind = "braid" if own.law_volume.reason else "law"
    names = ("air_work", "law_mismatch_share", "air_per_stride", "toe_clearance")
    work, share, air, clearance = (float(found.metrics[name]) for name in names)
    volumes = f"{one / full:.2f}, {two / full:.2f}"
    return (
        f"| `{muscle}` | `{law}` | {kind} | {volumes} | {work:.2f} J | {share:+.1f} % | "
        f"{1e3 * air:.1f} mg | {clearance:.2f} mm |"
    )


def main() -> None:
    """Print both tables."""
    print("| law | net work of the air | lost in dampers | made by the law | of the turnover |")
    print("|---|---|---|---|---|")
    for law in load("muscle", MUSCLE).laws:
        found = cycle_of(law)
        numbers = f"{found.air_work:.2f} J | {found.damper_loss:.2f} J | {found.law_mismatch:+.2f} J"
        row = f"| `{law}` | {numbers} | {100.0 * found.mismatch:+.2f} % of {found.turnover:.0f} J |"
        print(row.replace("-", "−"))
        assert abs(found.error) < 1e-3  # of the turnover is found nowhere
    print("\n| muscle | law | volume | V/V0 | net work of the air | made by the law | air | toe |")
    print("|---|---|---|---|---|---|---|---|")
    for muscle in ("dmsp_10", "dmsp_20"):
        for law in load("muscle", muscle).laws:
            print(walked(muscle, law).replace("-", "−"))


if __name__ == "__main__":
    main()
