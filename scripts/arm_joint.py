"""One joint of a measured four-joint arm, half a second ahead, from the pressures of its two muscles.

    python scripts/arm_joint.py FOLDER

FOLDER holds episodes of the arm PAMY (ALRhub/action-conditional-rkn, data/PAMData/Data2, MIT, © 2021
vaisakh-shaj), gzipped JSON, at 100 Hz. A joint's two muscles are taken for `dmsp_20`s on a pulley: nothing of
their size or mounting was published with the data, so that all of it is assumed here. Their own measured
pressures over the half second drive the joint; its start is the measured angle and speed.

Three predictions beside it: the angle stays; a linear model of start and pressures, fitted on the first half
of the files; and the joint with one number, its pulley's radius, fitted on that half. All errors are of the
second half, over the spread of its angles. The joint agrees where it errs no more than the linear model.
"""

import argparse
import gzip
import json
import pathlib

import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.optimize import minimize_scalar

from afo_sim.common import AMBIENT_PRESSURE
from afo_sim.description import load
from afo_sim.lab.ledger import HEADER, LedgerRow, table

AHEAD, EVERY, RATE = 50, 5, 0.01  # samples ahead, between starts; [s]
SUBSTEPS = 10
TOP = 3e5  # gauge pressure of the largest reading [Pa]: assumed
RADIUS, MIDDLE = 0.03, 0.10  # of the pulley [m], both muscles' contraction at angle 0 [-]: assumed
INERTIA = 0.03  # 0.7 kg at some 0.2 m [kg·m²]: assumed
MUSCLE = load("muscle", "dmsp_20")
Starts = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]  # angle, speed, pressures, angle to come


def starts(files: list[pathlib.Path], joint: int) -> Starts:
    """Angle [rad], speed [rad/s], pressures of both muscles (n, AHEAD + 1, 2) [-], angle ahead [rad]."""
    found = []
    for file in files:
        with gzip.open(file) as opened:
            rows = np.array(json.load(opened)["ob"])[1:]  # the first is of before a reset
        for k in range(0, len(rows) - AHEAD, EVERY):
            pressure = rows[k : k + AHEAD + 1, 8 + 2 * joint : 10 + 2 * joint]
            found.append((rows[k, joint], 10.0 * rows[k, 4 + joint], pressure, rows[k + AHEAD, joint]))
    angle, speed, pressure, to_come = (np.array(each) for each in zip(*found, strict=True))
    return angle, speed, pressure, to_come


def pull() -> RegularGridInterpolator:
    """Force of a muscle [N] by contraction and gauge pressure [Pa]."""
    kappa, gauge = np.linspace(-0.05, 0.35, 81), np.linspace(0.0, TOP, 31)
    force = MUSCLE.force(gauge[None, :], contraction=kappa[:, None])
    return RegularGridInterpolator((kappa, gauge), force, bounds_error=False, fill_value=None)


def joint_ahead(data: Starts, radius: float, force: RegularGridInterpolator) -> np.ndarray:
    """Angle of the simulated joint after AHEAD samples [rad]; its damping is its muscles' R p_abs κ̇."""
    angle, speed, pressure, _ = data
    length, step = MUSCLE.nominal_length, RATE / SUBSTEPS
    for k in range(AHEAD):
        gauge = TOP * np.clip(pressure[:, k], 0.0, 1.0)
        damping = MUSCLE.damping * (gauge.sum(axis=1) + 2.0 * AMBIENT_PRESSURE) * radius**2 / length
        for _ in range(SUBSTEPS):
            turned = radius * angle / length  # the first muscle turns the joint towards positive angles
            agonist, antagonist = force((MIDDLE + turned, gauge[:, 0])), force((MIDDLE - turned, gauge[:, 1]))
            pushed = speed + step * radius * (agonist - antagonist) / INERTIA
            speed = pushed / (1.0 + step * damping / INERTIA)
            angle = angle + step * speed
    return angle


def design(data: Starts) -> np.ndarray:
    """Columns of the linear model: one, angle, speed, both pressures every 0.1 s."""
    angle, speed, pressure, _ = data
    return np.column_stack([np.ones(len(angle)), angle, speed, pressure[:, ::10].reshape(len(angle), -1)])


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def main() -> None:
    """Print the errors of the second half of the files."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--joint", type=int, default=0)
    given = parser.parse_args()
    files = sorted(given.folder.glob("*.json.gz"))
    half, force = len(files) // 2, pull()
    seen, unseen = (starts(some, given.joint) for some in (files[:half], files[half:]))
    weights = np.linalg.lstsq(design(seen), seen[3], rcond=None)[0]

    def missed(radius: float, data: Starts = seen) -> float:
        return rms(joint_ahead(data, radius, force) - data[3])

    radius = minimize_scalar(missed, bounds=(0.01, 0.15), method="bounded", options={"xatol": 1e-3}).x
    spread, linear = unseen[3].std(), rms(design(unseen) @ weights - unseen[3])
    stays = f"the angle that stays: {100.0 * rms(unseen[0] - unseen[3]) / spread:.0f} %"
    rows = []
    for text, one in (("nothing fitted", RADIUS), (f"radius of {1e3 * radius:.0f} mm fitted", radius)):
        error = 100.0 * missed(one, unseen) / spread
        band, limit = (error, error, error), 100.0 * linear / spread
        name = f"joint {given.joint + 1} {AHEAD * RATE:g} s ahead, {text}, limit {limit:.1f}"
        rows.append(LedgerRow("pamy_acrkn", name, "%", band, source=stays, limit=limit))
    print("\n".join(" | ".join(row) for row in [HEADER, *table(rows)]))
    print(f"{len(unseen[0])} starts; limit: a linear model's error; {stays}; spread {spread:.3f} rad")


if __name__ == "__main__":
    main()
