"""From a table of loads to a muscle that runs: S1's own bench, fitted, judged, and worn.

Reads S1's two tables, fits the braid with a bladder to both, says what the tables cannot tell, predicts each
muscle from the other, and lets the fitted muscle lift a foot.
"""

import pathlib
import sys

import afo_sim
from afo_sim.common import assets
from afo_sim.lab import fit
from afo_sim.lab.law_result import remarks, write
from afo_sim.show import write_fit_figure


def main(out: pathlib.Path = pathlib.Path("runs/fit_a_muscle")) -> None:
    """Fit, judge, run."""
    muscles = assets.folder("models") / "muscles"
    tables = [muscles / "s1_215mm/table_1.csv", muscles / "s1_120mm/table_2.csv"]
    result = fit(tables, law="tondu_lopez_2000_bladder")
    for name, value in result.parameters.items():
        interval = result.intervals[name]
        ends = "no interval" if interval is None else f"{interval[0]:.4g} to {interval[1]:.4g}"
        print(f"  {name:18s} {value:9.4g}  {ends}")
    for line in remarks(result):
        print(line)
    write(result, out)
    write_fit_figure(result, out)
    worn = afo_sim.run(
        "seated",
        {"orthosis.muscle.dorsiflexor.type": str(out / "table_1" / "muscle.toml"), "duration": "8 s"},
    )
    print(f"worn, it moves the foot by {worn.metrics['range_of_motion'].value:.1f} deg; see {out}/fit.png")


if __name__ == "__main__":
    main(*map(pathlib.Path, sys.argv[1:]))
