"""The choice of the law: the same muscle, the same orthosis, every law that is known for it.

Prints each law's error on the maker's characteristic of a 10 mm fluidic muscle, and what the foot does with
it on the orthosis; draws the curves and the angles into runs/compare_laws.png.
"""

import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import numpy as np
from matplotlib import pyplot

import afo_sim
from afo_sim.common import assets
from afo_sim.description import load
from afo_sim.lab import read_measured, rms, select
from afo_sim.physics import LAWS, forces

MUSCLE = "dmsp_10"
GROUP = "orthosis.muscle.dorsiflexor"
# A 25 cm muscle in the place of a 21.5 cm one: less link.
SETS = {f"{GROUP}.type": MUSCLE, f"{GROUP}.link_length": "9 cm", "duration": "8 s"}


def main(out: pathlib.Path = pathlib.Path("runs/compare_laws.png")) -> None:
    """Compare, print, draw."""
    muscle = load("muscle", MUSCLE)
    maker, _ = select(read_measured(assets.folder("models") / "muscles" / MUSCLE / "characteristic.csv"))
    assert maker.contraction is not None
    figure, (static, motion) = pyplot.subplots(1, 2, figsize=(11, 4.5), layout="constrained")
    at = np.round(maker.pressure) == 4e5
    static.plot(maker.contraction[at], maker.force[at], "ko", label="maker, 4 bar")
    kappa = np.linspace(0.0, 0.25, 101)
    print(f"{'law':22s} {'RMS against the maker':>22s} {'range of motion':>16s} {'peak torque':>12s}")
    for name, law_set in muscle.laws.items():
        law, coefficients = LAWS[name], LAWS[name].coefficients(muscle.braid, law_set.parameters)
        curve = forces(law.native_id, coefficients, kappa, np.full(101, 4e5))
        missed = rms(forces(law.native_id, coefficients, maker.contraction, maker.pressure) - maker.force)
        run = afo_sim.run("seated", SETS | {f"{GROUP}.type.law": name})
        motion_range, torque = (run.metrics[m].value for m in ("range_of_motion", "peak_dorsiflexion_torque"))
        print(f"{name:22s} {missed:20.1f} N {motion_range:12.1f} deg {torque:8.2f} N·m")
        static.plot(kappa, np.maximum(curve, 0.0), label=name)
        motion.plot(run["time"], np.degrees(run["ankle/angle"]))
    static.set(xlabel="contraction ratio κ [-]", ylabel="force at 4 bar [N]", title=MUSCLE)
    motion.set(xlabel="time [s]", ylabel="ankle angle [deg], dorsiflexion +", title="seated, 4 bar")
    static.legend(fontsize=8)
    out.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(out, dpi=120)
    print(f"drawn into {out}")


if __name__ == "__main__":
    main(*map(pathlib.Path, sys.argv[1:]))
