"""Measured muscles of two benches as logs for `afo-sim stand replay`.

    python scripts/bench_logs.py FOLDER OUT

FOLDER holds `aarl_festo10_isometric/show` and `aarl_festo20_fill_leak/show`: recordings of the repository
Agile-and-Adaptive-Robotics/Muscle_Sensory, Portland State University, commit e3a82772 (B. Bolen, A. Hunt). It
states no licence, so that they are read where they lie and are no part of this one. OUT gets a folder of
logs of each, for `afo-sim validate --bench --data OUT`.
"""

import argparse
import csv
import gzip
import pathlib
from collections.abc import Iterator
from typing import Any

import numpy as np

KINKS = ("Unkink", "kinked25", "kinked50", "kinked75")
RESTS = {10: (8.3, 7.0), 20: (18.2, 15.2), 30: (28.1, 23.2)}  # cut [cm]: at rest, free at 620 kPa [cm]
SOURCE = "Portland State University, Muscle_Sensory e3a82772, no licence stated"
HELD = {
    10: (8.3, 7.975, 7.65, 7.325),
    20: (18.2, 17.45, 16.7, 15.95),
    30: (28.1, 26.875, 25.65, 24.425),
}  # [cm]
ZERO, FIRST = 8180.0, 0.008  # reading of the gauge without air [Pa], time before the first pulse [s]


def festo_10(folder: pathlib.Path, cut: int, kink: str) -> dict[str, Any]:
    """A 10 mm muscle held at a length, filled and vented by pulses; openings as its own gauge shows them.

    The gauge stands on the valves' side: it jumps as a valve opens and falls back as it shuts. The commands
    were not recorded, and openings of 5 to 15 ms were sampled every 1.9 ms; so rows are put in where the
    reading crosses a share of its first rise, and where it has lost one of it.
    """
    with gzip.open(folder / "aarl_festo10_isometric" / "show" / f"10mm_{cut}cm_{kink}_Test9.csv.gz") as file:
        force, pressure, time, state = np.loadtxt(file, delimiter=",").T
    rises = np.concatenate([[True], np.diff(time) > 0.0])
    force, pressure, time, state = (each[rises] for each in (force, pressure, time, state))
    force, pressure = force - np.median(force[time < FIRST]), 1e3 * pressure - ZERO
    spans = {k: list(_openings(time, pressure, k)) for k in (1, 2)}
    edges = np.ravel([*spans[1], *spans[2]])
    whole = np.unique(np.concatenate([time, edges]))
    coils = {name: np.zeros(len(whole)) for name in ("inlet", "outlet")}
    for name, k in (("inlet", 1), ("outlet", 2)):
        for start, end in spans[k]:
            coils[name][(whole >= start) & (whole < end)] = 1.0
    rest, free = RESTS[cut]
    return {
        "time [s]": whole,
        "pressure [Pa]": np.interp(whole, time, pressure),
        "force [N]": np.interp(whole, time, force),
        **coils,
        "muscle": "dmsp_10",
        "source": SOURCE,
        "total_length": f"{rest} cm",
        "free_contraction": f"{1.0 - free / rest:.6f}",
        "length": f"{HELD[cut][KINKS.index(kink)]} cm",
    }


def _openings(time: np.ndarray, pressure: np.ndarray, kind: int) -> Iterator[tuple[float, ...]]:
    """From and to of each opening of the inlet (1) or the outlet (2), as the gauge shows them [s]."""
    way, share, longest = ((1.0, 0.25, 14), (-1.0, 0.15, 32))[kind - 1]
    for start in np.arange(0.0, time[-1], 0.5) - (0.0, 0.05)[kind - 1]:
        rows = np.flatnonzero((time >= start) & (time < start + 0.12))
        if len(rows) < 10:
            continue
        before = (time > start - 0.1) & (time < start + 0.003)
        rise = way * (pressure[rows] - (np.median(pressure[before]) if start > 0.0 else 0.0))
        if rise.max() < 6e3:
            continue
        level = min(8e3, 0.4 * rise.max())
        begun = int(np.argmax(rise > level))
        peak = begun + int(np.argmax(rise[begun : begun + longest]))
        lost = rise[peak : peak + 8] < (1.0 - share) * rise[peak]
        ended = peak + int(np.argmax(lost)) if lost.any() else peak + 1
        ends = [time[rows[0]], time[rows[ended]]]
        if begun > 0:
            ends[0] = np.interp(level, rise[begun - 1 : begun + 1], time[rows[begun - 1 : begun + 1]])
        if lost.any():
            last = slice(ended, ended - 2 if ended > 1 else None, -1)
            ends[1] = np.interp((1.0 - share) * rise[peak], rise[last], time[rows[last]])
        yield tuple(ends)


def festo_20(folder: pathlib.Path, number: int) -> dict[str, Any]:
    """A 20 mm muscle that fills through a valve; its length, valve and load are not known."""
    path = folder / "aarl_festo20_fill_leak" / "show" / f"fill{number}.csv"
    time, pressure = np.loadtxt(path, delimiter=",", skiprows=1).T
    rises = np.concatenate([[True], np.diff(time) > 0.0])
    time, gauge = time[rises], 1e3 * (pressure[rises] - pressure[0])
    known = {"muscle": "dmsp_20", "source": f"{SOURCE}; supply: the last readings, contraction 0 assumed"}
    known |= {"contraction": "0", "supply": f"{np.median(gauge[-15:]):.0f} Pa"}
    return {"time [s]": time, "pressure [Pa]": gauge, "inlet": np.ones(len(time))} | known


def write(log: dict[str, Any], path: pathlib.Path) -> None:
    """A log as a CSV."""
    texts = {key: value for key, value in log.items() if isinstance(value, str)}
    columns = {key: value for key, value in log.items() if key not in texts}
    with path.open("w", encoding="utf-8", newline="") as file:
        file.writelines(f"# {key}: {value}\n" for key, value in texts.items())
        csv.writer(file).writerows([list(columns), *np.round(np.column_stack(list(columns.values())), 9)])


def main() -> None:
    """Write all logs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    given = parser.parse_args()
    tens, twenties = (given.out / f"aarl_festo{size}" for size in ("10_isometric", "20_fill_leak"))
    for folder in (tens, twenties):
        folder.mkdir(parents=True, exist_ok=True)
    for cut in RESTS:
        for kink in KINKS:
            write(festo_10(given.folder, cut, kink), tens / f"{cut}cm_{kink}.csv")
    for number in (2, 5, 7):
        write(festo_20(given.folder, number), twenties / f"fill{number}.csv")


if __name__ == "__main__":
    main()
