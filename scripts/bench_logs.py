"""Measured muscles of three benches as logs: two for `afo-sim stand replay`, and the joints of an arm.

    python scripts/bench_logs.py FOLDER OUT

FOLDER holds `aarl_festo10_isometric/show` and `aarl_festo20_fill_leak/show`: recordings of the repository
Agile-and-Adaptive-Robotics/Muscle_Sensory, Portland State University, commit e3a82772 (B. Bolen, A. Hunt). It
states no licence, so that they are read where they lie and are no part of this one. `pamy_acrkn/show` holds
episodes of the arm PAMY (ALRhub/action-conditional-rkn, data/PAMData/Data2, MIT, © 2021 vaisakh-shaj). OUT
gets a folder of logs of each, for `afo-sim validate --bench --data OUT`.
"""

import argparse
import csv
import gzip
import json
import pathlib
from collections.abc import Iterator
from typing import Any

import numpy as np

KINKS = ("Unkink", "kinked25", "kinked50", "kinked75")
RESTS = {10: (8.3, 7.0), 20: (18.2, 15.2), 30: (28.1, 23.2)}  # cut [cm]: at rest, free at 620 kPa [cm]
SOURCE = "Portland State University, Muscle_Sensory e3a82772, no licence stated"
# length of a muscle by its cut, in the order of KINKS [cm]
HELD = {10: (8.3, 7.975, 7.65, 7.325), 20: (18.2, 17.45, 16.7, 15.95), 30: (28.1, 26.875, 25.65, 24.425)}
APART = 0.05  # at least, between passes [ms]
EVEN = 12  # passes on either side over which they are even
ZERO, FIRST = 8180.0, 0.008  # reading of the gauge without air [Pa], time before the first pulse [s]

# PAMY. Published: radii, lengths of muscles, upper arm (pam_mujoco ec114ef1, pamy1/body_template.xml); counts
# at zero of joints 1 and 2 (pam_models 9d821247, pam.json). Read off: counts from 0 to 1. Assumed: 4 to 20 mA
# of 15 bits for 0 to 6 bar, so that 6554 counts are no gauge pressure; these at zero of joints 3 and 4.
ARM_COUNTS = [*2 * [(13e3, 9e3)], (13.5e3, 9.5e3), (14.5e3, 7.5e3), *2 * [(6554, 13e3)], *2 * [(6554, 15e3)]]
ARM_ZERO, ARM_COUNT = 6554.0, 6e5 / (32767.0 - 6554.0)  # [counts], [Pa]
ARM_JUMP = 0.4  # of an angle in a sample [rad], by which the last one belongs to the next episode


def festo_10(folder: pathlib.Path, cut: int, kink: str, openings: str = "loop") -> dict[str, Any]:
    """A 10 mm muscle held at a length, filled and vented by pulses, whose commands were not recorded.

    openings : where they come from
        loop   the rig's published program and the time stamps; nothing of the gauge
        width  the program, with one width a file for the inlet, the mean that the gauge shows
        gauge  rows are put in where the reading crosses a share of its first rise, and has lost one of it
    """
    with gzip.open(folder / "aarl_festo10_isometric" / "show" / f"10mm_{cut}cm_{kink}_Test9.csv.gz") as file:
        force, pressure, stamp, state = np.loadtxt(file, delimiter=",").T
    force, pressure = force - np.median(force[stamp < FIRST]), 1e3 * pressure - ZERO
    rest, free = RESTS[cut]
    log = {
        "muscle": "dmsp_10",
        "source": SOURCE,
        "total_length": f"{rest} cm",
        "free_contraction": f"{1.0 - free / rest:.6f}",
        "length": f"{HELD[cut][KINKS.index(kink)]} cm",
    }
    time = passes(stamp)
    inlet, outlet = commands(stamp, state)
    if openings == "loop":
        columns = {"pressure [Pa]": pressure, "force [N]": force, "inlet": inlet, "outlet": outlet}
        return {"time [s]": time, **columns} | log
    rises = np.concatenate([[True], np.diff(stamp) > 0.0])
    spans = [list(_openings(stamp[rises], pressure[rises], kind)) for kind in (1, 2)]
    if openings == "width":
        begins, ends = (time[np.flatnonzero(np.diff(outlet, prepend=0.0) == way)] for way in (1.0, -1.0))
        spans[1] = [*zip(begins, ends, strict=False)]
        width = float(np.mean(np.diff(spans[0])))
        spans[0] = [
            (begin, begin + width) for begin in time[np.flatnonzero(np.diff(inlet, prepend=0.0) > 0.0)]
        ]
    whole = np.unique(np.concatenate([time, *map(np.ravel, spans)]))
    columns = {"pressure [Pa]": pressure, "force [N]": force}
    columns = {name: np.interp(whole, time, each) for name, each in columns.items()}
    for name, each in zip(("inlet", "outlet"), spans, strict=True):
        columns[name] = sum(((whole >= a) & (whole < b)).astype(float) for a, b in each)
    fed = {
        "gauge": "pressure (openings read off the gauge)",
        "width": "pressure (mean width read off the gauge)",
    }
    return {"time [s]": whole, **columns, "fed": fed[openings]} | log


def passes(stamp: np.ndarray) -> np.ndarray:
    """When each pass of the rig's program began [s], from its own stamps of whole milliseconds.

    The clock of its board advances by 1.024 ms and skips three of 128 values, to be right on average;
    passes follow each other evenly but the first dozen, which fill the serial buffer.
    """
    value = np.rint(1e3 * stamp).astype(int)
    skipped = np.flatnonzero(np.bincount(value % 128, minlength=128) == 0)
    tick = 1.024 * (value - value // 128 * len(skipped) - np.searchsorted(skipped, value % 128, side="right"))
    found, place = tick + 0.512, np.arange(len(tick))
    for k in range(EVEN, len(tick)):
        near = slice(max(EVEN, k - EVEN), k + EVEN + 1)
        x, y = place[near] - place[near].mean(), tick[near] + 0.512
        found[k] = y.mean() + (k - place[near].mean()) * (x @ y) / (x @ x)
    found = np.clip(found, tick, tick + 1.024)
    return 1e-3 * (np.maximum.accumulate(found - APART * place) + APART * place)


def commands(stamp: np.ndarray, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whether the coils are on from each pass on: the rig's published program (ValvePWM_mod.ino).

    Filling, the inlet is on while the stamp modulo 500 ms is at most 5 ms; venting, the outlet, which is open
    without current, while it is more than 450 ms. The widths are the program's own, alike in all files.
    """
    phase, filling = np.rint(1e3 * stamp).astype(int) % 500, state < 1.5
    return (filling & (phase <= 5)) * 1.0, (~filling & (phase > 450)) * 1.0


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
    known = {"muscle": "dmsp_20", "source": f"{SOURCE}; contraction 0 assumed", "contraction": "0"}
    return {"time [s]": time, "pressure [Pa]": gauge, "inlet": np.ones(len(time))} | known


def leak(folder: pathlib.Path, number: int) -> dict[str, Any]:
    """A 20 mm muscle that was filled and shut, and leaks; by a later calibration of its gauge."""
    path = folder / "aarl_festo20_fill_leak" / "show" / f"leak{number}.csv"
    time, valve, raw = np.loadtxt(path, delimiter=",", skiprows=1).T
    shut = valve < 0.5
    gauge = 1e3 * (0.7654 * raw[shut] - 18.609) - ZERO
    known = {"muscle": "dmsp_20", "source": f"{SOURCE}; contraction 0 assumed", "contraction": "0"}
    return {"time [s]": 1e-3 * time[shut], "pressure [Pa]": gauge, "inlet": np.zeros(shut.sum())} | known


def arm_joint(folder: pathlib.Path, joint: int) -> dict[str, Any]:
    """A joint (0 to 3) of PAMY in all its episodes, which pauses of a second part."""
    parts, start = [], 0.0
    for path in sorted((folder / "pamy_acrkn" / "show").glob("*.json.gz")):
        with gzip.open(path) as file:
            rows = np.array(json.load(file)["ob"])[1:]  # the first is of before a reset
        rows = rows[: len(rows) - int(np.abs(np.diff(rows[-2:, :4], axis=0)).max() > ARM_JUMP)]
        counts = np.array(ARM_COUNTS)[2 * joint : 2 * joint + 2]
        gauge = ARM_COUNT * (counts[:, 0] + counts[:, 1] * rows[:, 8 + 2 * joint : 10 + 2 * joint] - ARM_ZERO)
        time = start + 0.01 * np.arange(len(rows))
        parts.append(np.column_stack([time, rows[:, joint], 10.0 * rows[:, 4 + joint], gauge]))
        start = time[-1] + 1.0
    titles = ("time [s]", "angle [rad]", "velocity [rad/s]", "pressure [Pa]", "extensor [Pa]")
    known = {"muscle": "dmsp_20", "total_length": f"{68 if joint else 100} cm", "radius": "37.1 mm"}
    known |= {"link": "40.5 cm"} if joint == 2 else {}
    source = "PAMY, action-conditional-rkn 7a8ae18; assumed: bore, pressure of a count"
    return dict(zip(titles, np.concatenate(parts).T, strict=True)) | known | {"source": source}


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
    joints = given.out / "pamy_acrkn"
    for folder in (tens, twenties, joints):
        folder.mkdir(parents=True, exist_ok=True)
    for cut in RESTS:
        for kink in KINKS:
            for openings in ("loop", "width", "gauge"):
                log = festo_10(given.folder, cut, kink, openings)
                write(log, tens / f"{openings}_{cut}cm_{kink}.csv")
    for number in (2, 5, 7):
        write(festo_20(given.folder, number), twenties / f"fill{number}.csv")
    for joint in range(4):
        write(arm_joint(given.folder, joint), joints / f"{joint + 1}.csv")
    for number in (1, 4):
        write(leak(given.folder, number), twenties / f"leak{number}.csv")


if __name__ == "__main__":
    main()
