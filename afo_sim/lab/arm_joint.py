"""Joints of a measured arm half a second ahead: antagonists over pulleys, under their measured pressures.

I q̈ = r cosh(μβ) (F_f − F_e) − b q̇ − friction + weight, and what joints share
|friction| ≤ r sinh(μβ) (F_f + F_e): cables behind guides have the tensions F e^(∓μβ)
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates
from scipy.optimize import least_squares

from afo_sim.common import AMBIENT_PRESSURE, GRAVITY, InputError
from afo_sim.description import load
from afo_sim.lab.bench_log import BenchLog
from afo_sim.lab.identifiability import rms

AHEAD, EVERY, SUBSTEPS = 50, 10, 2  # samples ahead, samples between starts, steps in a sample
RANGES = {  # of each joint where a fit begins, and what is plausible [kg·m²], [N·m·s], [-], [-], [-], [m]
    "inertia": (0.05, 1e-3, 1.0),  # without what hangs on a link
    "damping": (0.5, 0.0, 3.0),  # b
    "cable_friction": (0.5, 0.0, 1.2),  # μβ: polymer cables with 0.05 to 0.2, turned by a quarter to a whole
    "contraction": (0.08, -0.03, 0.2),  # of both muscles at an angle of zero
    "imbalance": (0.0, -0.1, 0.1),  # half of what the flexor is more contracted by
    "distance": (0.22, 0.1, 0.4),  # of the point mass beyond a link [m]
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
        self.links = {k: log.bench["link"] for k, log in enumerate(logs) if "link" in log.bench}
        self.names = [n for n in RANGES for _ in (self.links if n == "distance" else logs)]
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
        before = speed
        for k in range(AHEAD * SUBSTEPS):
            angle, middle, before = angle + 0.5 * h * speed, 1.5 * speed - 0.5 * before, speed
            at, share = divmod((k + 0.5) / SUBSTEPS, 1.0)
            gauge = (1.0 - share) * pressure[:, :, int(at)] + share * pressure[:, :, int(at) + 1]
            kappa = p["contraction"] + side * (p["imbalance"] + self.turn * angle)
            places = np.array([(kappa + 0.06) * 2e3, gauge / 1e4])
            static = map_coordinates(self.table, places, order=1, mode="nearest")
            slower = self.muscle.damping * (gauge + AMBIENT_PRESSURE) * side * self.turn * middle
            pull = (static > 0.0) * (static - slower).clip(0.0)  # no cable pushes, no slack muscle brakes
            flexor, extensor = h * self.radius * pull
            drag, hold = 0.5 * h * p["damping"], np.sinh(p["cable_friction"]) * (flexor + extensor)
            mass = p["inertia"] + 0.0 * angle
            push = np.cosh(p["cable_friction"]) * (flexor - extensor) - drag * speed
            for (b, link), far in zip(self.links.items(), p["distance"], strict=True):
                a, ratio, inertia = b - 1, link / far, p["inertia"][b]
                bent, weight = h * inertia * ratio * np.sin(angle[:, b]), h * GRAVITY * inertia / far
                across = inertia * (1.0 + ratio * np.cos(angle[:, b]))
                mass[:, a] += 2.0 * across + inertia * (ratio**2 - 1.0)
                tipped = weight * np.sin(angle[:, a] + angle[:, b])
                push[:, a] += tipped + weight * ratio * np.sin(angle[:, a]) + across * speed[:, b]
                push[:, a] += bent * middle[:, b] * (2.0 * middle[:, a] + middle[:, b])
                push[:, b] += tipped - bent * middle[:, a] ** 2 + across * speed[:, a]
            push, whole = push + mass * speed, mass + drag
            speed = (push - push.clip(-hold, hold)) / whole
            for b in self.links:  # where the second slips, the first has the inertia that it leaves
                a, left = b - 1, push[:, b] - across * speed[:, b - 1]
                free, slips = push[:, b] - np.sign(left) * hold[:, b], np.abs(left) > hold[:, b]
                share, rest = across / whole[:, b], push[:, a] - across / whole[:, b] * free
                both = (rest - rest.clip(-hold[:, a], hold[:, a])) / (whole[:, a] - share * across)
                speed[:, a] = np.where(slips, both, speed[:, a])
                speed[:, b] = np.where(slips, free / whole[:, b] - share * both, 0.0)
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


@dataclass(frozen=True)
class Joint:
    """A joint's errors over the spread of the angle ahead [%], and its numbers [SI]."""

    log: BenchLog
    fitted: float  # of episodes that were fitted
    held: float  # of the others
    linear: float  # of the others by a linear model
    stays: float  # of the others by the angle at the start
    numbers: dict[str, float]

    @property
    def text(self) -> str:
        """Its numbers [SI], and which of them end at a bound of what is plausible."""
        near = {n: 1e-3 * (high - low) for n, (_, low, high) in RANGES.items()}
        ends = [n for n, x in self.numbers.items() if np.abs(np.subtract(RANGES[n][1:], x)).min() < near[n]]
        bound = f"; at a bound, not identified: {', '.join(ends)}" if ends else ""
        return ", ".join(f"{name} {value:.3g}" for name, value in self.numbers.items()) + bound


def joints(logs: Sequence[BenchLog]) -> Iterator[Joint]:
    """Each joint, those that a link joins together."""
    groups = list[list[BenchLog]]()
    for log in logs:
        if missing := NEEDED - (log.columns.keys() | log.bench.keys()):
            problem, allowed = "lacks what a joint needs", ", ".join(sorted(missing))
            raise InputError(problem, file=log.file, allowed=allowed)
        if "link" in log.bench and not groups:
            raise InputError("has no joint before it", file=log.file, field="link")
        groups = [*groups[:-1], [*groups[-1], log]] if groups and "link" in log.bench else [*groups, [log]]
    for group in groups:
        arm, halves = Arm(group), [[windows(log, half) for log in group] for half in (0, 1)]
        x = arm.fit(halves[0])
        (fitted, held), (seen, other) = [arm.swing(x, each)[:, -1] for each in halves], halves
        for k, log in enumerate(group):
            slopes = np.linalg.lstsq(seen[k]["told"], seen[k]["angle"][:, -1], rcond=None)[0]
            guesses = held[:, k], other[k]["told"] @ slopes, other[k]["angle"][:, 0]
            held_out, linear, stays = (_error(each, other[k]) for each in guesses)
            known = {name: x[[name == each for each in arm.names]] for name in RANGES}
            numbers = {name: float(own[min(k, len(own) - 1)]) for name, own in known.items() if len(own)}
            yield Joint(log, _error(fitted[:, k], seen[k]), held_out, linear, stays, numbers)


def _error(guess: np.ndarray, told: Windows) -> float:
    ahead = told["angle"][:, -1]
    return float(100.0 * rms(guess - ahead) / ahead.std())
