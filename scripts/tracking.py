"""PID on the ankle angle follows a sine: S1's muscles with its valves, and with four times their flow.

    python scripts/tracking.py OUT

Writes tracking.png and tracking.csv to the folder OUT, and prints the table. The gains are chosen once
for each valve, by `TUNED_ON` and a grid; everything that is told is of other signals. A run is of the
seated device, from rest.
"""

import itertools
import math
import pathlib
import sys
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import small_png

import afo_sim
from afo_sim.show import GREY, RUN_STYLES, RUNS
from afo_sim.simulation import Recording

CONDUCTANCE = 0.055  # of S1's valves, C of ISO 6358 [dm³/(s·bar)]
FACTORS = (1.0, 4.0)  # of the valves' conductance
CHAMBERS = ("dorsiflexor", "plantarflexor")
# Proportional band [deg], derivative time [s], integral time [s]
BANDS, DERIVATIVES, INTEGRALS = (
    (0.25, 0.5, 1.0, 2.0, 4.0, 8.0),
    (0.0, 0.01, 0.02, 0.05, 0.1),
    (None, 2.0, 0.5),
)
GRID = list(itertools.product(BANDS, DERIVATIVES, INTEGRALS))
FINER = ((100.0, 2.0), (100.0, 1.0), (200.0, 1.0))  # of the controller [Hz], time step [ms]
PERIODS = 10  # of the sine
SETTLE = 4  # of them that are not judged


class Sine(NamedTuple):
    """A reference about 0 deg: amplitude [deg], frequency [Hz]."""

    amplitude: float
    frequency: float

    def __str__(self) -> str:
        return f"±{self.amplitude:g} deg at {self.frequency:g} Hz"


TUNED_ON = Sine(4.0, 0.4)
SHOWN = Sine(5.0, 0.5)  # 10 deg peak to peak
TESTS = (SHOWN, Sine(10.0, 0.5), Sine(2.0, 0.5), Sine(5.0, 0.25), Sine(5.0, 1.0))


class Gains(NamedTuple):
    """Proportional band [deg], derivative and integral time [s]; None is no integral."""

    band: float
    derivative: float
    integral: float | None

    def __str__(self) -> str:
        integral = "no integral" if self.integral is None else f"Ti {self.integral:g} s"
        return f"band {self.band:g} deg, Td {1e3 * self.derivative:g} ms, {integral}"


class Tracked(NamedTuple):
    """How a sine is followed after SETTLE periods: angles in deg; ratio and lag of the first harmonic."""

    rms: float
    peak: float
    ratio: float
    lag: float
    lowest: float
    highest: float
    full: float  # share of the time in which the output is at its limit


def sets(factor: float, gains: Gains, sine: Sine, rate: float = 100.0, step: float = 2.0) -> dict[str, Any]:
    """What is set in the scenario `seated`."""
    valves = [f"orthosis.chamber.{c}.{side}.conductance" for c in CHAMBERS for side in ("inlet", "outlet")]
    reference = {"amplitude": f"{sine.amplitude} deg", "frequency": f"{sine.frequency} Hz"}
    pid: dict[str, Any] = {
        "lowers": "plantarflexor",
        "derivative_time": f"{gains.derivative} s",
        "angle": {"proportional_band": f"{gains.band} deg", "reference": reference},
    }
    if gains.integral is not None:
        pid["integral_time"] = f"{gains.integral} s"
    return dict.fromkeys(valves, f"{factor * CONDUCTANCE:.6g} dm^3/(s*bar)") | {
        "timer": None,
        "controller": {"rate": f"{rate} Hz", "pid": pid},
        "duration": f"{PERIODS / sine.frequency} s",
        "timestep": f"{step} ms",
    }


def tracked(run: Recording, sine: Sine) -> Tracked:
    """How a run has followed its sine.

    The error is against the sine itself at every step, not against what the controller held.
    """
    late = run["time"] >= SETTLE / sine.frequency - 1e-9
    time, angle = run["time"][late], np.degrees(run["ankle/angle"][late])
    error = sine.amplitude * np.sin(2.0 * math.pi * sine.frequency * time) - angle
    turn = np.exp(-2j * math.pi * sine.frequency * time)  # over whole periods
    phasor = 2.0 * np.mean(angle * turn) / (-1j * sine.amplitude)
    return Tracked(
        rms=float(np.sqrt(np.mean(error**2))),
        peak=float(np.abs(error).max()),
        ratio=abs(phasor),
        lag=-math.degrees(np.angle(phasor)),
        lowest=float(angle.min()),
        highest=float(angle.max()),
        full=float(np.mean(np.abs(run["controller/output"][late]) >= 1.0 - 1e-9)),
    )


def follow(factor: float, gains: Gains, sine: Sine, **more: float) -> tuple[Recording, Tracked]:
    """A run, and how it has followed."""
    run = afo_sim.run("seated", sets(factor, gains, sine, **more))
    assert run.ok, run.status
    return run, tracked(run, sine)


def tuned(factor: float, grid: list[tuple[float, float, float | None]] = GRID) -> Gains:
    """Of all gains of a grid those with the least root mean square error on TUNED_ON."""
    return min(itertools.starmap(Gains, grid), key=lambda gains: follow(factor, gains, TUNED_ON)[1].rms)


def draw(runs: dict[float, Recording], path: pathlib.Path) -> None:
    """Angle and pressures over time, of both valves."""

    def fill(figure: Any) -> None:
        angle, pressure = figure.subplots(2, 1, sharex=True)
        begin = SETTLE / SHOWN.frequency
        for k, (factor, run) in enumerate(runs.items()):
            late = (run["time"] >= begin) & (run["time"] < begin + 3.0 / SHOWN.frequency)
            time = run["time"][late]
            look = {"color": RUNS[k], "ls": RUN_STYLES[k]}
            angle.plot(time, np.degrees(run["ankle/angle"][late]), label=named(factor), **look)
            for chamber, width in zip(CHAMBERS, (1.5, 0.8), strict=True):
                bar = 1e-5 * run[f"chamber/{chamber}/pressure"][late]
                pressure.plot(time, bar, lw=width, label=f"{chamber}, {named(factor)}", **look)
        sine = SHOWN.amplitude * np.sin(2.0 * math.pi * SHOWN.frequency * time)
        angle.plot(time, sine, color=GREY, lw=0.9, label="asked for", zorder=0)
        angle.set(ylabel="ankle angle [deg]\ndorsiflexion positive", ylim=(-6.0, 9.5))
        angle.legend(loc="upper left", ncols=3, columnspacing=1.0)
        pressure.set(ylabel="gauge pressure [bar]", ylim=(0.0, 6.0), xlabel="time [s]")
        pressure.legend(loc="upper left", ncols=2, columnspacing=1.0)

    small_png.draw(path, (6.4, 4.4), fill)


def named(factor: float) -> str:
    """The valves in words."""
    return "S1's valves" if factor == 1.0 else f"{factor:g} × their flow"


def main(out: pathlib.Path) -> None:
    """Tune, test, print, draw; the shown sine also with half the time step and half the period."""
    out.mkdir(parents=True, exist_ok=True)
    rows, runs = [], {}
    for factor in FACTORS:
        gains = tuned(factor)
        print(f"{named(factor)}: {gains}, the best of the grid on {TUNED_ON}")
        for sine in TESTS:
            for rate, step in FINER if sine == SHOWN else FINER[:1]:
                found = follow(factor, gains, sine, rate=rate, step=step)[1]
                told = {"valves": factor, "sine": str(sine), "rate [Hz]": rate, "step [ms]": step}
                rows.append(told | found._asdict())
        runs[factor], _ = follow(factor, gains, SHOWN)
    table = pd.DataFrame(rows)
    print(table.to_string(index=False, float_format="{:.3g}".format))
    table.to_csv(out / "tracking.csv", index=False)
    draw(runs, out / "tracking.png")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "runs/tracking"))
