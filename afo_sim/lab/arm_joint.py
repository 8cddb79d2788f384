"""Joints of a measured arm half a second ahead: antagonists over pulleys, under their measured pressures.

A joint begins at its measured angle and velocity; after that it is told nothing but pressures: of its flexor
(`pressure`) and extensor.

    I q̈ = r cosh(μβ) (F_f − F_e) − (b + the muscles' own damping) q̇ − friction
    |friction| ≤ r sinh(μβ) (F_f + F_e): cables behind guides have the tensions F e^(∓μβ)

Every second episode is fitted, the others are judged: RMS error over the spread of the angle ahead. The limit
is that of a linear model, fitted to the same, which is told the start and the pressures every 0.1 s.
"""

import itertools
from collections.abc import Iterator, Sequence

import numpy as np
from scipy.ndimage import map_coordinates
from scipy.optimize import least_squares

from afo_sim.common import AMBIENT_PRESSURE
from afo_sim.description import load
from afo_sim.lab.bench_log import BenchLog
from afo_sim.lab.identifiability import rms
from afo_sim.lab.ledger import LedgerRow

AHEAD, EVERY, SUBSTEPS = 50, 10, 2  # samples ahead, samples between starts, steps in a sample
# Of each joint where a fit begins, and what is plausible [SI].
RANGES = {
    "inertia": (0.05, 1e-3, 1.0),
    "damping": (0.5, 0.0, 3.0),  # beside the muscles' own
    "wrap": (0.5, 0.0, 1.2),  # μβ: polymer cables with 0.05 to 0.2, turned by a quarter to a whole turn
    "contraction": (0.08, -0.03, 0.2),  # of both muscles at an angle of zero
    "imbalance": (0.0, -0.1, 0.1),  # half of what the flexor is more contracted by
}
NEEDED = {"angle", "velocity", "extensor", "muscle", "total_length", "radius"}
Windows = dict[str, np.ndarray]  # columns of each start's samples, and what a linear model is told


def windows(log: BenchLog, half: int) -> Windows:
    """Windows of every second episode, which gaps in time part, from the first (0) or the second (1) on."""
    steps = np.diff(log.time)
    spans = [*itertools.pairwise([0, *np.flatnonzero(steps > 1.5 * steps[0]) + 1, len(log.time)])][half::2]
    first = np.concatenate([np.arange(begun, end - AHEAD, EVERY) for begun, end in spans])
    each = {name: column[first[:, None] + np.arange(AHEAD + 1)] for name, column in log.columns.items()}
    start = [np.ones(len(first)), each["angle"][:, 0], each["velocity"][:, 0]]
    told = np.column_stack([*start, each["pressure"][:, ::EVERY], each["extensor"][:, ::EVERY]])
    return each | {"told": told}


class Arm:
    """Joints with one kind of muscle; `names` are of the numbers that are fitted."""

    def __init__(self, logs: Sequence[BenchLog]):
        self.names = [name for name in RANGES for _ in logs]
        self.muscle = load("muscle", logs[0].bench["muscle"])
        self.radius, long = np.array([[log.bench[n] for n in ("radius", "total_length")] for log in logs]).T
        self.turn = self.radius / (long - 2.0 * self.muscle.end_length)
        gauge, kappa = np.linspace(0.0, 8e5, 81), np.linspace(-0.06, 0.4, 921)
        self.table = self.muscle.force(gauge[None, :], contraction=kappa[:, None])

    def swing(self, x: np.ndarray, told: Sequence[Windows]) -> np.ndarray:
        """Angles at each sample [rad] (n, T, j) from numbers by `names`, in leapfrog steps."""
        p = {name: x[[name == each for each in self.names]] for name in RANGES}
        angle, speed = (np.stack([w[name][:, 0] for w in told], -1) for name in ("angle", "velocity"))
        pressure = np.stack([[w["pressure"], w["extensor"]] for w in told], -1)
        h, side, out = np.diff(told[0]["time"][0, :2]) / SUBSTEPS, np.array([[[1.0]], [[-1.0]]]), [angle]
        for k in range(AHEAD * SUBSTEPS):
            angle = angle + 0.5 * h * speed
            at, share = divmod((k + 0.5) / SUBSTEPS, 1.0)
            gauge = (1.0 - share) * pressure[:, :, int(at)] + share * pressure[:, :, int(at) + 1]
            kappa = p["contraction"] + side * (p["imbalance"] + self.turn * angle)
            places = np.array([(kappa + 0.06) * 2e3, gauge / 1e4])
            flexor, extensor = h * self.radius * map_coordinates(self.table, places, order=1, mode="nearest")
            own = self.muscle.damping * self.radius * self.turn * (gauge + AMBIENT_PRESSURE).sum(0)
            drag, hold = 0.5 * h * (p["damping"] + own), np.sinh(p["wrap"]) * (flexor + extensor)
            push = np.cosh(p["wrap"]) * (flexor - extensor) + (p["inertia"] - drag) * speed
            speed = (push - push.clip(-hold, hold)) / (p["inertia"] + drag)
            angle = np.clip(angle + 0.5 * h * speed, -3.0, 3.0)
            out += [angle] if (k + 1) % SUBSTEPS == 0 else []
        return np.stack(out, 1)

    def fit(self, told: Sequence[Windows]) -> np.ndarray:
        """Numbers by least squares of the angles every 0.1 s."""
        begin, low, high = np.array([RANGES[name] for name in self.names]).T
        truth = np.stack([w["angle"] for w in told], -1)

        def residuals(share: np.ndarray) -> np.ndarray:
            missed = self.swing(low + (share - 1.0) * (high - low), told) - truth
            return np.asarray(missed[:, EVERY::EVERY] / truth[:, -1].std(axis=0)).ravel()

        first = 1.0 + (begin - low) / (high - low)  # 1 to 2: derivatives step by a share of the range
        best = least_squares(residuals, first, bounds=(1.0, 2.0), diff_step=2e-3, max_nfev=30)
        return np.asarray(low + (best.x - 1.0) * (high - low))


def joint_rows(logs: Sequence[BenchLog]) -> Iterator[LedgerRow]:
    """A row for each joint of which a log states all that is needed."""
    for log in (log for log in logs if log.columns.keys() | log.bench.keys() >= NEEDED):
        arm, seen, other = Arm([log]), windows(log, 0), windows(log, 1)
        x = arm.fit([seen])
        fitted, held = (arm.swing(x, [each])[:, -1, 0] for each in (seen, other))
        linear = other["told"] @ np.linalg.lstsq(seen["told"], seen["angle"][:, -1], rcond=None)[0]
        pairs = (fitted, seen), (held, other), (linear, other), (other["angle"][:, 0], other)
        errors = [100.0 * rms(guess - w["angle"][:, -1]) / w["angle"][:, -1].std() for guess, w in pairs]
        quantity = "{} 0.5 s ahead, limit {:.0f}, linear; stays {:.0f}".format(log.file.stem, *errors[2:])
        band, source = (min(errors[:2]), errors[1], max(errors[:2])), log.bench.get("source", "")
        yield LedgerRow(log.file.parent.name, quantity, "% of spread", band, source=source, limit=errors[2])
