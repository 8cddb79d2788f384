"""From a table of loads to a muscle that runs: S1's own bench, fitted, judged, and worn.

Reads S1's two tables, fits the braid with a bladder to both, says what the tables cannot tell, predicts each
muscle from the other, and lets the fitted muscle lift a foot.
"""

import math
import pathlib
import sys

import afo_sim
from afo_sim.bench.measured import read_measured
from afo_sim.common import assets
from afo_sim.fitting.law_files import write_fit
from afo_sim.fitting.law_fit import fit, held_out, rms
from afo_sim.fitting.law_problem import pose


def main(out: pathlib.Path = pathlib.Path("runs/fit_a_muscle")) -> None:
    """Fit, judge, run."""
    muscles = assets.folder("models") / "muscles"
    tables = [read_measured(muscles / f) for f in ("s1_215mm/table_1.csv", "s1_120mm/table_2.csv")]
    result = held_out(fit(pose("tondu_lopez_2000_bladder", tables)))
    print(
        f"{len(result.residuals)} cells, {100 * result.rms:.3f} cm RMS with {len(result.values)} parameters"
    )
    for name, value in result.values.items():
        width = result.half_width[name]
        print(f"  {name:18s} {value:9.4g}", "no interval" if math.isinf(width) else f"± {width:.2g}")
    for line in result.verdict:
        print(f"  the tables do not tell {line}")
    for kind, groups in result.held_out.items():
        each = ", ".join(f"{label}: {100 * rms(errors):.2f}" for label, errors in groups.items())
        print(f"  {kind} left out: {100 * result.held_out_rms(kind):.2f} cm RMS ({each})")
    write_fit([result], {}, out)
    worn = afo_sim.run(
        "seated",
        {"orthosis.muscle.dorsiflexor.type": str(out / "table_1" / "muscle.toml"), "duration": "8 s"},
    )
    print(f"worn, it moves the foot by {worn.metrics['range_of_motion'].value:.1f} deg; see {out}/fit.png")


if __name__ == "__main__":
    main(*map(pathlib.Path, sys.argv[1:]))
