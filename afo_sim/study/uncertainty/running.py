"""Uncertainty bands of a walking run: draws of the uncertain inputs, each with its settled stride."""

import dataclasses
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common import InputError, JsonDict, Keywords, with_code
from afo_sim.description import Scenario
from afo_sim.description.scenario_text import own_walk
from afo_sim.metrics import BELOW, HELP, LIFT, ORTHOSIS, OWN, Metric, settled, words
from afo_sim.metrics.strides import strides
from afo_sim.model import person_of
from afo_sim.simulation import Asked, Recording, as_taken, limits_of, needs_of
from afo_sim.study.engine import CYCLE, OK, UNSETTLED, Outcome
from afo_sim.study.pool import Report, pool
from afo_sim.study.uncertainty.draw import Applied, Column, Draws, applied, draw
from afo_sim.study.uncertainty.spreads import read
from afo_sim.study.uncertainty.worth import Explained, explained, fewest

_QUANTILES = (0.05, 0.5, 0.95)
FEWEST, MOST = 20, 100_000  # draws
_EVERY = 2  # of CYCLE's phases, that are kept
_MEASURED_NEXT = 3
_NOTICED = 0.99  # share of a band's width: what leaves more is not worth a measurement [-]
_CLEARANCE = "toe_clearance"
_EXPLAINED = (_CLEARANCE, "torque_against_push_off", "air_per_stride")
_METRICS = (
    _CLEARANCE,
    "ball_clearance",
    "peak_swing_dorsiflexion",
    "foot_pitch_at_contact",
    "foot_slap_velocity",
    "orthosis_peak_dorsiflexion_torque",
    "torque_covered",
    "torque_against_push_off",
    "torque_against_push_off_per_mass",
    "work_against_push_off",
    "plantarflexion_lost_at_toe_off",
    "air_per_stride",
    "free_air_per_stride",
)
_JUDGED = (  # metrics that the other answers of a verdict are made of
    "strides_counted",
    "strides_per_bottle",
    "compressor_duty",
    "source_share",
    *(f"{part}_skin_pressure{of}" for part in ("cuff", "plate") for of in ("", "_sustained")),
)
_HEIGHTS = (_CLEARANCE, "ball_clearance")  # metrics [mm] to which a drawn height is added …
_HIGH = tuple(f"{name}/height_without_floor" for name in ("sole", "ball", "toe"))  # … and columns [m]
_FOREFOOT = _HIGH[1:]
_CURVES = ("ankle/angle", *_HIGH, ORTHOSIS)


def quantiles(values: np.ndarray) -> list[float]:
    """5, 50 and 95 % quantiles (3,) of values (n,), or of each column of curves, then (3, m), as lists."""
    found: list[float] = np.quantile(values, _QUANTILES, axis=0).tolist()
    return found


def shares_of_one(heights: np.ndarray, path: np.ndarray, limit: float) -> np.ndarray:
    """Share of one wearer's strides that come to a height or lower [-] (n,), one for each draw."""
    return np.asarray((heights[:, None] + path[None, :] <= limit).mean(axis=1))


@dataclass(frozen=True, eq=False)
class Found:
    """Draws that have run: their outcomes in order, and those that ended well as a mask (n,)."""

    draws: Draws
    outcomes: tuple[Outcome, ...]

    @property
    def ok(self) -> np.ndarray:
        """Mask of the draws that ran to their end (n,)."""
        return np.array([outcome.status == OK for outcome in self.outcomes])

    @property
    def heights(self) -> np.ndarray:
        """What is added to each height of the sole [m] (n,), of all that spreads."""
        return self.draws.heights(each_stride=False) + self.draws.heights(each_stride=True)

    def metric(self, name: str) -> np.ndarray:
        """A metric of every draw (n,); NaN where it has none."""
        found = [float(outcome.metrics.get(name, np.nan)) for outcome in self.outcomes]
        return np.array(found) + (1e3 * self.heights if name in _HEIGHTS else 0.0)

    def curves(self, column: str) -> np.ndarray:
        """A column of the draws that ended well, over CYCLE (number of them, 201)."""
        found = np.array([o.curves[column] for o in self.outcomes if o.status == OK])
        return found + self.heights[self.ok, None] if column in _HIGH else found


def check_draws(scenario: Scenario, count: int, spreads: str) -> Applied:
    """What is drawn for bands; refuses those that cannot be drawn."""
    if not scenario.walking:
        problem = "bands are of walking, and here nobody walks"
        raise InputError(problem, field="draws", value=count, allowed="a scenario with a gait")
    if not isinstance(count, int) or not FEWEST <= count <= MOST:
        problem = "is not a number of draws that gives a band from 5 to 95 %"
        raise InputError(problem, field="draws", value=count, allowed=f"{FEWEST} to {MOST}")
    found = applied(read(spreads), scenario)
    if not (found.unknowns or found.fits):
        problem = "this scenario has nothing of what they state"
        raise InputError(problem, field="spreads", value=spreads, allowed="spreads of what it has")
    return found


def uncertainty(
    scenario: Scenario, recording: Recording, draws: int, spreads: str = "usual",
    report: Report | None = None, *, seed: int = 0, threads: int = 0,
) -> JsonDict:  # fmt: skip
    """Bands of a run's numbers and curves, by drawing all that is not known together."""
    drawn = draw(check_draws(scenario, draws, spreads), scenario, draws, seed)
    kept = frozenset(name for name in (*_METRICS, *OWN, *_JUDGED) if name in recording.metrics)
    pressures = tuple(f"chamber/{name}/pressure" for name in scenario.orthosis.chamber)
    asked = Asked(kept, doubts=False, curves=(*_CURVES, *pressures))
    cases = [drawn.sets(k) for k in range(draws)]
    with pool(threads) as who:
        at = as_taken(scenario, recording)
        outcomes = who.in_order(at, cases, asked, "varying uncertain inputs", report)
    return {"spreads": spreads} | _bands_of(Found(drawn, tuple(outcomes)), recording)


def need_bands(scenario: Scenario, draws: int) -> dict[str, list[float]]:
    """5, 50, 95 % quantiles of what each phase needs [N·m]: patient and walk are drawn, the device is not."""
    drawn, found = draw(check_draws(scenario, draws, "usual"), scenario, draws), []
    for k in range(draws):
        sets = {key: text for key, text in drawn.sets(k).items() if not key.startswith("orthosis.")}
        found.append({need.phase: need.peak for need in needs_of(scenario.set(sets))[1]})
    return {phase: quantiles(np.array([each[phase] for each in found])) for phase in found[0]}


def _bands_of(found: Found, recording: Recording) -> JsonDict:
    """What draws that have run say, as `uncertainty` returns it."""
    draws, ok = found.draws, found.ok
    failed = [outcome for outcome in found.outcomes if outcome.status != OK]
    reasons = Counter(f"{outcome.status}: {outcome.reason.splitlines()[0]}" for outcome in failed)
    bands: JsonDict = {
        "draws": draws.count,
        "seed": draws.seed,
        "failed": {
            "count": len(failed),
            "draws": np.flatnonzero(~ok).tolist(),
            "reasons": [{"reason": reason, "count": count} for reason, count in reasons.most_common(5)],
        },
        "rejected": draws.rejected,
        "left_out": list(draws.left_out),
        "notes": [*draws.notes, *_notes(found, recording)],
        "drawn": [_drawn(column) for column in draws.columns],
        **{name: [] for name in ("groups", "measure_next")},
        **{name: {} for name in ("rest", "metrics", "curves", "trips", "kept")},
    }
    if not ok.any():
        return bands
    for name in (*_METRICS, *OWN):
        values = found.metric(name)[ok]
        if name in recording.metrics and np.isfinite(values).any():
            bands["metrics"][name] = {
                "unit": recording.metrics[name].unit,
                "own": recording.metrics[name].value,
                "quantiles": quantiles(values[np.isfinite(values)]),
                "undefined": int(np.count_nonzero(~np.isfinite(values))),
            }
    bands["phase"] = CYCLE[::_EVERY].tolist()
    kept = next(outcome.curves for outcome in found.outcomes if outcome.status == OK)
    bands["curves"] = {name: quantiles(found.curves(name)[:, ::_EVERY]) for name in kept}
    bands["trips"] = _trips(found, recording)
    bands["kept"] = _kept(found, recording)
    return bands | _worth(found, recording, [name for name in _EXPLAINED if name in bands["metrics"]])


def _notes(found: Found, recording: Recording) -> list[str]:
    """What to mind of these draws."""
    notes = []
    restless = sum(bool(with_code(outcome.warnings, UNSETTLED)) for outcome in found.outcomes)
    if restless:
        notes.append(f"{restless} draws have no stride that repeats; theirs is the last that was walked")
    needed = fewest([group.deviates for group in found.draws.groups])
    if int(found.ok.sum()) < needed:
        notes.append(f"the draws are too few to show what explains the bands: it takes {needed}")
    for name in _METRICS:
        values = found.metric(name)[found.ok & np.isfinite(found.metric(name))]
        own = float(recording.metrics.get(name, np.nan))
        if len(values) and values.min() < values.max() and np.isfinite(own):
            low, _, high = quantiles(values)
            if not low <= own <= high:
                side = "above" if own > high else "below"
                text = f"{words(name).label} of this run lies {side} its own band: "
                notes.append(f"{text}nearly whatever departs from the run moves it one way")
    return notes


def _drawn(column: Column) -> JsonDict:
    """One drawn number: where it stands, its own value and its band [SI], and why it spreads so."""
    low, middle, high = quantiles(column.values)
    return {
        "name": column.name,
        "keys": list(column.keys),
        "unit": column.unit,
        "own": column.own,
        "quantiles": [low, middle, high],
        "each_stride": column.table.each_stride,
        "kind": column.table.kind,
        "source": column.table.source,
    }


def _trips(found: Found, recording: Recording) -> JsonDict:
    """Share of the drawn strides whose forefoot comes to a height, and the band of one wearer's own share."""
    if not all(name in found.outcomes[int(np.argmax(found.ok))].curves for name in _FOREFOOT):
        return {}
    columns, time = recording.columns, recording["time"]
    whole = strides(columns, float(time[1] - time[0]), person_of(recording.scenario).body_mass)
    stride = (settled(columns, whole) or whole)[-1]  # of the plain run, whose metrics are those shown
    first, *_, last = stride.phase[stride.passing]
    passing = (first <= CYCLE) & (last >= CYCLE)
    heights = np.min([found.curves(name)[:, passing] for name in _FOREFOOT], axis=(0, 2))
    path = found.draws.heights(each_stride=True)
    alone = heights - path[found.ok]
    trips: JsonDict = {}
    for name, limit in (("touch", 0.0), ("within_10mm", BELOW)):
        of_one = quantiles(shares_of_one(alone, path, limit))
        trips[name] = {"height": limit, "share": float(np.mean(heights <= limit)), "of_one": of_one}
    return trips


def _kept(found: Found, recording: Recording) -> dict[str, float]:
    """Share of the draws that are judged good, by the answer; the walk without the device is the run's."""
    kinds = ("reference_", "uncompensated_")
    compared = {name: m for name, m in recording.metrics.items() if name.startswith(kinds)}
    judged: dict[str, list[str]] = {}
    # what is wanted of the toe leaves room for strides that vary
    steady = {name: 1e3 * found.draws.heights(each_stride=True) for name in _HEIGHTS}
    asked = (name for name in (*_METRICS, *_JUDGED) if name in recording.metrics)
    values = {name: found.metric(name) - steady.get(name, 0.0) for name in asked}
    for k in np.flatnonzero(found.ok):
        metrics = {name: Metric(float(of[k]), recording.metrics[name].unit) for name, of in values.items()}
        bare: Keywords = {"columns": {}, "strides": {}, "studies": {}, "warnings": ()}
        drawn = dataclasses.replace(recording, metrics=metrics | compared, **bare)
        for answer in drawn.verdict:
            judged.setdefault(answer.name, []).append(answer.status)
    own = own_walk(recording.described)  # whose help and toe rest on a stride that is not drawn, too
    known = {
        name: found
        for name, found in judged.items()
        if set(found) != {"unknown"} and not (own and name in (HELP, LIFT))
    }
    return {name: statuses.count("good") / len(statuses) for name, statuses in known.items()}


def _worth(found: Found, recording: Recording, names: Sequence[str]) -> JsonDict:
    """What each group explains of some metrics, and what it is worth to know it."""
    wanted = 1e3 * limits_of(recording).toe_clearance[0]
    groups: list[JsonDict] = [
        {"name": group.name, "each_stride": group.each_stride, "measure": group.measure, "explained": {}}
        | ({} if group.each_stride else {"band_left": {}, "band_left_error": {}})
        for group in found.draws.groups
    ]
    measured = [(k, group) for k, group in enumerate(groups) if not group["each_stride"]]

    def of(values: np.ndarray) -> Explained | None:
        whole = np.isfinite(values) & found.ok
        return explained([group.deviates[whole] for group in found.draws.groups], values[whole], wanted)

    rest, known = {}, {}
    for name in names:
        if (of_metric := of(found.metric(name))) is not None:
            rest[name] = of_metric.rest
            for group, share in zip(groups, of_metric.shares, strict=True):
                group["explained"][name] = share
            for k, group in measured:
                band, _, error, _ = of_metric.left[:, k + 1].tolist()
                group["band_left"][name], group["band_left_error"][name] = band, error
    steady = found.metric(_CLEARANCE) - 1e3 * found.draws.heights(each_stride=True)  # as in _kept
    if _CLEARANCE in rest and not own_walk(recording.described) and (of_toe := of(steady)) is not None:
        _, known["wrong"], _, known["wrong_error"] = of_toe.left[:, 0].tolist()
        for k, group in measured:
            _, group["wrong_left"], _, group["wrong_left_error"] = of_toe.left[:, k + 1].tolist()
    first = next(iter(rest), "")
    next_ = [group for _, group in measured if group["band_left"].get(_CLEARANCE, 1.0) < _NOTICED]

    def worth_most(group: JsonDict) -> tuple[float, float]:
        gain = known.get("wrong", 0.0) - group.get("wrong_left", 0.0)
        sure = gain > group.get("wrong_left_error", np.inf)  # less is noise
        return -gain if sure else 0.0, group["band_left"][_CLEARANCE]

    next_.sort(key=worth_most)
    return known | {
        "groups": sorted(groups, key=lambda group: -group["explained"].get(first, 0.0)),
        "rest": rest,
        "measure_next": [group["name"] for group in next_[:_MEASURED_NEXT]],
    }
