"""Designs that a model of all runs so far holds for the best: cubic ridge regression in a trust region."""

import math
from itertools import combinations_with_replacement

import numpy as np

from afo_sim.study.search.aim import LACKING, OBJECTIVE, OUTSIDE, PATIENT, Columns, Problem, best_of, row

_LEAST, _MOST = 0.005, 0.5  # radii of the trust region, as shares of each range
_SOUND = 0.1  # share of a predicted improvement that must be found
_NOTHING = 1e-4  # improvement in standard deviations of what is in the region
_LEAST_MARGIN = 0.1  # in standard errors of the model
_REACH, _STEEP = 1.5, 8  # radii at which a run counts half, and how steeply that falls
_BENDS = 0.7, 0.5  # how much is believed to bend within a radius, and within a standard deviation of a trait
_RIDGES = 10.0 ** np.arange(-9, 2)  # over the square of the largest singular value
_TERMS = 700  # of a polynomial at most
_CLOUD, _ELITE, _ROUNDS = 300, 30, 12  # of the minimisation of the model
_DRAWN = 1024  # Sobol points, of which those within the constraints are taken


def _fitted(
    at: np.ndarray, values: np.ndarray, weights: np.ndarray, alone: np.ndarray, traits: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Metrics (n, q) as polynomials `at` designs and traits of patients (n, d), cubic where d is small.

    The ridge of each leaves the least error (q,) where one of the runs `alone` is left out; this is returned,
    and for patients of some traits the powers of the design (m, …) and their factors (m, q, patients).

    Source: Hoerl & Kennard 1970, doi 10.1080/00401706.1970.10488634; leaving one out: Golub, Heath & Wahba
    1979, doi 10.1080/00401706.1979.10489751
    """
    count = at.shape[1]
    degree = next(k for k in (3, 2, 1) if k == 1 or math.comb(count + k, k) <= _TERMS)
    each = combinations_with_replacement(range(count + 1), degree)  # the constant term is the last one
    powers = np.array([[chosen.count(k) for k in range(count + 1)] for chosen in each])
    factorials = [math.prod(map(math.factorial, p)) for p in powers.tolist()]
    scales = 1.0 / np.sqrt(factorials)  # alike in all directions
    powers = powers[:, :count]
    terms, root = _monomials(at, powers) * scales, np.sqrt(weights)
    constant = root / np.linalg.norm(root)  # what a constant explains is not shrunk
    left, right = root[:, None] * terms[:, :-1], root[:, None] * values
    left, right = (side - np.outer(constant, constant @ side) for side in (left, right))
    modes, sizes, turned = np.linalg.svd(left, full_matrices=False)
    shares = modes.T @ right
    error, factors = np.full(values.shape[1], np.inf), np.zeros((len(powers), values.shape[1]))
    for ridge in _RIDGES * max(sizes[0] ** 2, 1e-300):
        kept = sizes**2 / (sizes**2 + ridge)
        own = np.maximum(1.0 - modes**2 @ kept - constant**2, 1e-9)
        apart = ((right - modes @ (kept[:, None] * shares)) / own[:, None])[alone]
        found = np.sqrt(np.sum(apart**2, axis=0) / np.sum(weights[alone]))
        solved = turned.T @ ((sizes / (sizes**2 + ridge))[:, None] * shares)
        factors[:-1] = np.where(found < error, solved, factors[:-1])
        error = np.minimum(found, error)
    factors[-1] = weights @ (values - terms[:, :-1] @ factors[:-1]) / np.sum(weights)
    factors[:-1] *= scales[:-1, None]  # the constant is in no scaled term
    size = count - traits.shape[1]
    designs, where = np.unique(powers[:, :size], axis=0, return_inverse=True)
    of_patients = np.zeros((len(designs), values.shape[1], len(traits)))
    parts = factors[:, :, None] * _monomials(traits, powers[:, size:]).T[:, None]
    np.add.at(of_patients, where.ravel(), parts)
    return error, designs, of_patients


def _monomials(places: np.ndarray, powers: np.ndarray) -> np.ndarray:
    """Of places (n, d) and powers (m, d): (n, m)."""
    return np.asarray(np.prod(places[:, None, :] ** powers, axis=2))


class Surrogate:
    """A search by a model of every metric over designs and patients.

    Each generation runs one design with all patients, the model's best in a region around the best known one,
    and others around it with one patient each, from which the model learns. The region shrinks where less
    than a tenth of the predicted improvement is found, else it follows the step. The limits are kept with a
    margin, which doubles where the design broke them and else is halved.

    Source: Conn, Scheinberg & Vicente 2009, Introduction to Derivative-Free Optimization, chapter 10;
    correction at the centre: Alexandrov et al. 1998, doi 10.1007/BF01197433; the model is minimised by
    cross-entropy: Rubinstein 1999, doi 10.1023/A:1010091220143
    """

    def __init__(self, problem: Problem, seed: int):
        from scipy.stats import qmc  # slow to import

        self.problem, self.aim = problem, problem.aim
        size, self._many = len(problem.parameters), len(problem.traits)
        self._each = (problem.population or max(self._many, 7) + 1) - 1  # designs to learn from
        self._generator = np.random.default_rng(seed)
        self._sobol = qmc.Sobol(size, scramble=True, seed=self._generator)
        self._radius, self._margin = _MOST, 1.0
        self._places, self._patients = np.zeros((0, size)), np.zeros(0, np.int64)
        self._values = np.zeros((0, len(self.aim.metrics), self._many))
        self._known = Columns()  # of designs with all patients
        self._proposed = False

    def runs(self, generations: int) -> int:
        """Simulations of that many generations at most."""
        return generations * (self._many + self._each) + 3 * self._each

    @property
    def converged(self) -> bool:
        """True where the region is so small that nothing is left to find, and something has run."""
        return self._radius < _LEAST and bool(np.isfinite(self._cost(self._best)[0]))

    def ask(self) -> tuple[np.ndarray, np.ndarray]:
        """The next designs as shares from 0 to 1 (n, dimensions), and of each the patient (n,); -1 is all."""
        size = self._places.shape[1]
        usable = np.asarray(np.isfinite(self._values).all(axis=1))  # (runs, patients)
        self._proposed = bool(np.count_nonzero(usable) > size + 1)
        if not self._proposed:
            self._asked = self._drawn(np.zeros(size), np.ones(size), 4 * self._each + 1)
        else:
            self._learn(usable)
            low, high = self._around(self._centre)
            best = self._least(low, high)
            self._asked = np.vstack([best, self._drawn(*self._around(best), self._each)])
        several = -(-len(self._asked) // self._many)
        drawn = np.concatenate([self._generator.permutation(self._many) for _ in range(several)])
        drawn = drawn[: len(self._asked)] if self._many > 1 else np.full(len(self._asked), -1)
        drawn[0] = -1
        return self._asked, drawn

    def tell(self, columns: Columns) -> None:
        """Take the results of the last requested designs."""
        whole = columns[PATIENT] < 0
        judged = {name: values[whole] for name, values in columns.items()}
        if self._proposed:
            self._follow(row(judged, 0), self._asked[:1])
        many = range(self._many)
        values = np.array([[columns[f"{name}/{k}"] for k in many] for name in self.aim.metrics])
        self._values = np.concatenate([self._values, np.moveaxis(values, 2, 0)])
        self._places = np.vstack([self._places, self._asked])
        self._patients = np.append(self._patients, columns[PATIENT])
        self._known = {n: np.append(self._known.get(n, c[:0]), c) for n, c in judged.items()}

    def _around(self, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.maximum(centre - self._radius, 0.0), np.minimum(centre + self._radius, 1.0)

    def _drawn(self, low: np.ndarray, high: np.ndarray, count: int) -> np.ndarray:
        cloud = low + (high - low) * self._sobol.random(max(_DRAWN, count))
        return cloud[np.argsort(self._outside(cloud), kind="stable")[:count]]

    def _outside(self, places: np.ndarray) -> np.ndarray:
        return self.problem.outside(self.problem.values(places))

    def _learn(self, usable: np.ndarray) -> None:
        """Fit the model about the best design, and correct it so that it is exact there."""
        whole = np.flatnonzero(self._patients < 0)
        self._fails = usable.sum(axis=1) < np.where(self._patients < 0, self._many, 1)
        best = best_of(self.aim, self._known)
        self._best = row(self._known, best)
        self._keeps = bool(self.aim.feasible(self._best)[0])
        self._centre = self._places[whole[best]]
        near = (self._places - self._centre) / self._radius
        weights = 1.0 / (1.0 + (np.max(np.abs(near), axis=1) / _REACH) ** _STEEP)
        designs, patients = np.nonzero(usable & (weights > 1e-5)[:, None])
        traits = _BENDS[1] * self.problem.traits
        alone = (self._patients[designs] >= 0) | (self._many == 1)
        alone |= not alone.any()
        values = self._values[designs, :, patients]
        weights = weights[designs]
        mean = np.average(values, axis=0, weights=weights)
        self._spread = np.sqrt(np.average((values - mean) ** 2, axis=0, weights=weights))
        at = np.hstack([_BENDS[0] * near[designs], traits[patients]])
        self._error, self._powers, self._factors = _fitted(at, values, weights, alone, traits)
        off = self._values[whole[best]] - self._metrics(self._centre[None])[0]
        self._factors[np.sum(self._powers, axis=1) == 0] += np.nan_to_num(off)

    def _metrics(self, places: np.ndarray) -> np.ndarray:
        """Of designs (n, dimensions), as the model has it: (n, metrics, patients)."""
        near = _BENDS[0] * (places - self._centre) / self._radius
        return np.asarray(np.tensordot(_monomials(near, self._powers), self._factors, 1))

    def _predicted(self, places: np.ndarray, margin: float = 0.0) -> Columns:
        """Designs as the model has them, with levels that are worse by a margin; none at a good centre."""
        metrics = dict(zip(self.aim.metrics, np.moveaxis(self._metrics(places), 1, 0), strict=True))
        found = self.aim.judge(metrics) | {OUTSIDE: self._outside(places)}
        if self._fails.any():  # as the nearest one that was run
            apart = np.max(np.abs(places[:, None] - self._places), axis=2)
            found[LACKING] = found[LACKING] + self._fails[np.argmin(apart, axis=1)]
        away = np.minimum(np.max(np.abs(places - self._centre), axis=1) / self._radius, 1.0)
        errors = dict(zip(self.aim.metrics, self._error, strict=True))
        for limit in self.aim.limits:
            worse = margin * errors[limit.metric] * (away if self._keeps else 1.0)
            level = found[f"{limit.name}_level"]
            found[f"{limit.name}_short"] = limit.short(level - worse if limit.at_least else level + worse)
        return found

    def _least(self, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """The best design of the model in a box, by cross-entropy over the aim's ranks."""
        elite = self._centre[None]
        cloud = low + (high - low) * self._generator.random((_CLOUD, len(low)))
        for _ in range(_ROUNDS):
            cloud = np.vstack([elite, cloud])
            order = np.argsort(self.aim.ranks(self._predicted(cloud, self._margin)), kind="stable")
            elite = cloud[order[:_ELITE]]
            middle = elite.mean(axis=0)
            steps = self._generator.standard_normal((_CLOUD, len(elite))) / math.sqrt(len(elite))
            cloud = np.clip(middle + 1.2 * steps @ (elite - middle), low, high)
        return np.asarray(elite[0])

    def _follow(self, found: Columns, place: np.ndarray) -> None:
        """Set region and margin by what was found of the best design of the model (1, dimensions)."""
        before, keeps = self._cost(self._best)[0], bool(self.aim.feasible(found)[0])
        if not np.isfinite(before):  # no design has run with all patients yet: there is nothing to compare
            return
        gain, promised = (before - self._cost(each)[0] for each in (found, self._predicted(place)))
        sound = gain > max(_NOTHING, _SOUND * promised) or (keeps and not self._keeps)
        half, step = self._radius / 2.0, float(np.max(np.abs(place - self._centre)))
        self._radius = min(max(2.0 * step, half), 4.0 * half, _MOST) if sound else half
        self._margin = self._margin / 2.0 if keeps else min(2.0 * max(self._margin, _LEAST_MARGIN), 1.0)

    def _cost(self, columns: Columns) -> np.ndarray:
        """Shortfalls in standard deviations, and the objective where the best design keeps all limits."""
        spread = dict(zip(self.aim.metrics, np.where(self._spread > 0.0, self._spread, 1.0), strict=True))
        sign = 1.0 if self.aim.objective.goal == "lowest" else -1.0
        cost = sign * self._keeps * columns[OBJECTIVE] / spread[self.aim.objective.metric]
        for limit in self.aim.limits:
            cost = cost + columns[f"{limit.name}_short"] / spread[limit.metric]
        return np.where((columns[LACKING] > 0) | (columns[OUTSIDE] > 0.0), np.inf, cost)
