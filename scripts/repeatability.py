"""S0's repeatability study as sensors see it: the same open-loop filling, measured again and again.

S0 filled a muscle to pressures up to 6 bar, measured its contraction with an infrared sensor on a converter
of 0.01 V a step, and repeated that (its section 4.8.2, table 4.2). The table is not in the text that this
project has, so no number of S0 stands beside ours. Comparable is the kind of spread alone: here the muscle
does the same each time, and all spread is the sensors'; S0's holds that of muscle, regulator and load too.

    python scripts/repeatability.py [OUT]
"""

import pathlib
import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
import small_png

import afo_sim as afo
from afo_sim.description import load
from afo_sim.show import GREY, RUNS
from afo_sim.simulation import sensor_columns

PRESSURES = tuple(range(1, 7))  # of the supply, gauge [bar]
REPEATS = 10
GROUP = "dorsiflexor"
LENGTH, PRESSURE = f"muscle/{GROUP}_1/length", f"chamber/{GROUP}/pressure"
NEARER = 0.08  # distance of the near target from the muscle's other end [m]
MOUNTINGS = {"far": "at the muscle's other end", "near": "8 cm nearer"}
SETS: dict[str, Any] = {
    "duration": "4 s",
    "sensor": {
        "far": {"column": LENGTH, "type": "gp2y0a41"},
        "near": {"column": LENGTH, "type": "gp2y0a41", "offset": f"{-NEARER} m"},
        "pressure": {"column": PRESSURE, "type": "mpx5700"},
    },
}


@dataclass(frozen=True)
class Filling:
    """One pressure: what is true, and one reading of each sensor in every repeat (repeats,) [SI]."""

    supply: float
    length: float
    pressure: float
    read: dict[str, np.ndarray]

    def error(self, sensor: str) -> tuple[float, float]:
        """Mean error of a sensor, and standard deviation over the repeats [SI]."""
        off = self.read[sensor] - (self.pressure if sensor == "pressure" else self.length)
        return float(off.mean()), float(off.std(ddof=1))


def fill(bar: float, repeats: int = REPEATS) -> Filling:
    """Fill once, and measure it `repeats` times: one reading at its end, each time with other noise."""
    scenario = load("scenario", "seated", {**SETS, "supply.pressure": f"{bar} bar"})
    run, built = afo.run(scenario), afo.build(scenario)
    found: dict[str, list[float]] = {name: [] for name in SETS["sensor"]}
    for seed in range(repeats):
        readings = sensor_columns(built, run.columns, round(1000 * bar) + seed)
        for name, values in found.items():
            shift = NEARER if name == "near" else 0.0
            values.append(float(readings[f"sensor/{name}"][-1]) + shift)
    length, pressure = (float(run[name][-1]) for name in (LENGTH, PRESSURE))
    return Filling(bar, length, pressure, {name: np.array(values) for name, values in found.items()})


def table(fillings: list[Filling]) -> str:
    """Mean error ± standard deviation of each sensor, by pressure; S0's numbers are lost."""
    lines = [
        "| supply [bar] | muscle [mm] | infrared, far [mm] | infrared, near [mm] | transducer [mbar] | S0 |",
        "|---|---|---|---|---|---|",
    ]
    for filling in fillings:
        cells = []
        for name, scale in (("far", 1e3), ("near", 1e3), ("pressure", 1e-2)):
            mean, deviation = (scale * value for value in filling.error(name))
            cells.append(f"{mean:+.2f} ± {deviation:.2f}")
        row = (f"{filling.supply:g}", f"{1e3 * filling.length:.1f}", *cells, "lost")
        lines.append(f"| {' | '.join(row)} |")
    return "\n".join(lines)


def draw(fillings: list[Filling], path: pathlib.Path) -> None:
    """Length over pressure as it is, and as each repeat read it."""

    def panels(figure: Any) -> None:
        for axes, (name, where) in zip(figure.subplots(1, 2, sharey=True), MOUNTINGS.items(), strict=True):
            bars = [1e-5 * filling.pressure for filling in fillings]
            truth = [1e3 * filling.length for filling in fillings]
            axes.plot(bars, truth, color=GREY, label="the muscle")
            for filling in fillings:
                pressures, lengths = 1e-5 * filling.read["pressure"], 1e3 * filling.read[name]
                label = "a reading in each repeat" if filling is fillings[0] else None
                axes.plot(pressures, lengths, ".", color=RUNS[0], label=label)
            axes.set_title(f"infrared sensor {where}")
            axes.set_xlim(0.7, 6.3)
            axes.set_xlabel("pressure [bar gauge]")
        figure.axes[0].set_ylabel("muscle length [mm]")
        figure.axes[0].legend()

    small_png.draw(path, (8.0, 3.6), panels)


def main() -> None:
    """Measure, print the table, draw."""
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "runs")
    folder.mkdir(parents=True, exist_ok=True)
    fillings = []
    for bar in PRESSURES:
        print(f"{bar} bar, {REPEATS} repeats", file=sys.stderr)
        fillings.append(fill(bar))
    print(table(fillings))
    draw(fillings, folder / "repeatability.png")


if __name__ == "__main__":
    main()
