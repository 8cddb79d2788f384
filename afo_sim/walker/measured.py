"""The walker compared with measurements: healthy norms and wearers' responses, none of them fitted."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.stats import kendalltau

from afo_sim.common import GRAVITY, FloatOrArray, JsonDict, assets
from afo_sim.description import Scenario
from afo_sim.walker.body import BARE, Body, build_body
from afo_sim.walker.gait import Vector
from afo_sim.walker.gait_file import Gait, read_gait
from afo_sim.walker.likeness import BOVI, beside_people
from afo_sim.walker.patients import DEVICE, Who, device_key, read_gaits
from afo_sim.walker.population import read_condition
from afo_sim.walker.respond import falls_of, prepared
from afo_sim.walker.strides import SAMPLES, norm_at, numbers, strides_of
from afo_sim.walker.walking import Push, Walked, walk_body

Verdict = Literal["agrees", "sign agrees", "disagrees", "cannot tell"]
GAITS = ("slow", "natural", "fast")
WALKED, PUSH_HORIZON = 20.0, 8.0  # [s]
STARTS, FEW = 50, 10
SCENARIO, HEALTHY = "walk-dropfoot-afo", {"patient": "healthy"}
RESPONSES, ADAPTED = "responses.toml", "responses_adapted.toml"  # the latter by scripts/adapted_wearers.py
ALIKE, SCATTER = 0.8, 0.026  # wearers of one sign (assumed); a cost between two searches, RMS [-]
UNKNOWN = (math.nan, math.nan)
LOADING, SWING, PUSH_OFF, WHOLE = slice(16), slice(65, 96), slice(30, 66), slice(100)  # [% of the stride]


@dataclass(frozen=True)
class Compared:
    """A measured number and the walker's; the median of many wearers."""

    quantity: str
    measured: float
    simulated: float
    unit: str
    verdict: Verdict
    source: str
    why: str
    in_cost: bool = False  # of the search for the gait
    spread: tuple[float, float] = UNKNOWN  # of what was measured, of the kind that `why` tells
    between: tuple[float, float] = UNKNOWN  # least and most of the walker's wearers


@dataclass(frozen=True, eq=False)
class Wearer:
    """A person: size, tissue and device, the share left of each muscle, and how they walk."""

    scenario: Scenario
    strength: Mapping[str, float]
    gaits: Mapping[str, Vector]  # by what they are adapted to: "nothing", DEVICE, "spring of 30 N*m/rad"

    def body(self, sets: Mapping[str, object] | None = None, spring: float = 0.0) -> Body:
        """Bare, or with the device where there are `sets`; a spring at its ankle [N·m/deg]."""
        worn = self.scenario.set(BARE if sets is None else sets)
        return build_body(worn, dict(self.strength), math.degrees(spring))

    def walk(
        self, sets: Mapping[str, object] | None = None, spring: float = 0.0, *, weeks: bool = False
    ) -> Walked:
        """Their walk with such a body by their own gait, or by that after weeks of it."""
        worn = f"spring of {math.degrees(spring):g} N*m/rad" if spring else DEVICE
        return walk_body(self.body(sets, spring), self.gaits[worn if weeks else "nothing"], WALKED)


People = Mapping[str, Sequence[Wearer]]
# a name in RESPONSES, each wearer's (NaN of a fall), and whether it is told
Responses = Iterator[tuple[str, FloatOrArray] | tuple[str, FloatOrArray, bool]]


def wearers(condition: str, scenario: str = SCENARIO) -> list[Wearer]:
    """Patients of a condition in a scenario, with the gaits that they have adapted to."""
    kind = read_condition(condition)
    described = prepared(scenario, {"timestep": "1 ms", "patient": kind.patient})
    who = Who(described, kind, kind.draw(), 0.0)
    foot = f" in {described.shoe.name if described.shoe else 'bare feet'} on {described.leg.name}"
    gaits: list[dict[str, Vector]] = [{} for _ in who.drawn]
    for (worn, k), known in read_gaits(kind.file.with_suffix(".csv"), who.drawn).items():
        gaits[k][worn.removesuffix(foot).replace(device_key(described), DEVICE)] = known.vector
    return [Wearer(*who.person(*of, worn=True), own) for *of, own in zip(who.drawn, gaits, strict=True)]


def compare() -> list[Compared]:
    """All rows, by simulation: two minutes of it."""
    worn = {who: wearers(*which) for who, which in _told("people").items()}
    rows = [each for part in (kao_ferris, leaves, lifted, springs) for each in part(worn)]
    kept = assets.read_toml(assets.folder("models") / ADAPTED)
    return [*healthy(), *pushed(), *(beside(*each) for each in (*rows, *kept.items()))]


def beside(name: str, own: FloatOrArray, sure: bool = True) -> Compared:
    """Wearers' responses beside a published one.

    They agree where the sign is right and their median lies in the published spread. A sign is told where
    four of five wearers share it.
    """
    told, each = _told(name), np.ravel(own)
    known, (low, high) = each[np.isfinite(each)], told.setdefault("spread", UNKNOWN)
    median, least, most = map(float, np.quantile(known, (0.5, 0.0, 1.0))) if len(known) else (math.nan,) * 3
    verdict: Verdict = "cannot tell"
    if sure and np.mean(np.sign(each) == np.sign(median)) >= ALIKE:
        verdict = "agrees" if low <= median <= high else "sign agrees"
        verdict = verdict if median * told["measured"] > 0.0 else "disagrees"
    if len(known) < len(each):
        told["why"] += f"; {len(each) - len(known)} of {len(each)} unknown"
    return Compared(**told, simulated=median, verdict=verdict, between=(least, most))


def _told(name: str) -> JsonDict:
    return dict(assets.read_toml(assets.folder("models") / RESPONSES)[name])


def _curve(walked: Walked, name: str) -> np.ndarray:
    """A mean curve of the device's leg (101,); NaN of who fell."""
    strides = strides_of(walked, "right")
    return strides.mean(name) if walked.fell is None and len(strides.duration) else np.full(SAMPLES, math.nan)


def _change(
    pair: tuple[Walked, Walked], name: str, part: slice, of: Callable[[np.ndarray], FloatOrArray] = np.mean
) -> float:
    """Of a number of a curve in a part of the stride, the first walk's over the second's [%]."""
    after, before = (of(_curve(walked, name)[part]) for walked in pair)
    return float(100.0 * (after / before - 1.0))


def _faster(pair: tuple[Walked, Walked]) -> float:
    """By how much the first walks faster; NaN where one falls [m/s]."""
    return float(np.diff([numbers(w)["speed"] if w.fell is None else math.nan for w in pair[::-1]])[0])


def _walk(gait: Gait) -> Walked:
    return walk_body(build_body(prepared(SCENARIO, HEALTHY | BARE)), gait.vector, WALKED)


def healthy() -> Iterator[Compared]:
    """The three shipped gaits compared with measurements on adults."""
    for name in GAITS:
        yield from held(name, _walk(read_gait(name)))


def held(name: str, walked: Walked) -> Iterator[Compared]:
    """A walk of a gait, the mean of its legs, compared with the rows of `TABLE`."""
    speed, lasted = numbers(walked)["speed"], walked["time"][-1]
    if walked.fell is not None or not math.isfinite(speed):
        yield Compared(f"{name}: walks {WALKED:g} s", WALKED, lasted, "s", "disagrees", BOVI, "fell", True)
        return
    for row, known, own, centre, half in beside_people(walked, speed):
        half *= 1.0 if name == "natural" else row.wider
        why, verdict = f"{centre:.3g} ± {half:.3g}", _judged(abs(own - centre) <= half)
        if half == math.inf:
            why, verdict = "only shown", "cannot tell"
        what = f"{name}: {row.quantity}"
        yield Compared(what, known, own, row.unit, verdict, row.source, why, row.in_cost)


def _judged(good: bool) -> Verdict:
    return "agrees" if good else "disagrees"


def pushed() -> Iterator[Compared]:
    """Pushes of the healthy walker's trunk for 0.1 s at ten instants of a second; drawn starts."""
    body, gait = build_body(prepared(SCENARIO, HEALTHY | BARE)), read_gait("natural").vector
    rows = [(int(falls_of(body, gait, starts=STARTS).count), f"{STARTS} drawn starts, pushed once", 2, True)]
    for force, most in ((100.0, 1), (50.0, 0)):
        pushes = [Push(3.0 + 0.1 * k, sign * force) for k in range(10) for sign in (1.0, -1.0)]
        falls = sum(walk_body(body, gait, PUSH_HORIZON, (push,)).fell is not None for push in pushes)
        rows.insert(0, (falls, f"20 walks pushed by ±{force:g} N", most, force == 50.0))
    for falls, of, most, cost in rows:
        good, why = _judged(falls <= most), f"at most {most}"
        yield Compared(f"healthy: falls of {of}", 0.0, falls, "", good, "stated bound", why, cost)


def kao_ferris(people: People) -> Responses:
    """S1's dorsiflexors by the wearer's own tibialis, at a published moment."""
    setting, found = _told("setting"), []
    moments = -norm_at(1.25)["moment"].min() * np.array(setting["shares"])  # [N·m/kg]
    for wearer in people["healthy"]:
        plain, rows = wearer.walk(), []
        full = f"{_curve(plain, 'tibialis').max() / setting['gain']:.6g}"
        emg = {"column": "tibialis/activation", "full": full}
        sets = {"phases": None, "start": None, "controller": {"emg": emg}}
        for bar in setting["pressures"]:
            pair = wearer.walk(sets | {"supply.pressure": f"{bar} bar"}), plain
            worn, bare = (_curve(walked, "ankle")[70:96].mean() for walked in pair)
            bursts = _change(pair, "tibialis", LOADING, np.max), _change(pair, "tibialis", SWING)
            moment = _curve(pair[0], "torque").max() * GRAVITY / pair[0].body.weight
            rows.append([moment, math.degrees(worn - bare), *bursts])
        own, *each = np.transpose(rows)
        found.append([np.interp(moments, own, x, math.nan, math.nan) for x in each])
    names = ("dorsiflexor_swing", "dorsiflexor_burst", "dorsiflexor_swing_burst")
    yield from zip(names, np.swapaxes(found, 0, 1), strict=True)


def leaves(people: People) -> Responses:
    """Springs at the ankle, as leaf springs and an elastic exoskeleton are."""
    well, weak, worn, elastic = (
        [(w.walk(spring=x, weeks=which == "worn"), w.walk()) for w in people[who] for x in of]
        for which, (who, of) in _told("setting")["springs"].items()
    )
    yield "leaf_healthy", [_change(pair, "tibialis", LOADING) for pair in well]
    yield "leaf_drop_foot", [_change(pair, "tibialis", WHOLE) for pair in weak]
    least = [[math.degrees(_curve(walked, "ankle")[LOADING].min()) for walked in pair] for pair in worn]
    yield "leaf_loading", [after - bare for after, bare in least]
    yield "leaf_speed", [_faster(pair) for pair in worn]
    yield "elastic_soleus", [_change(pair, "soleus", PUSH_OFF, np.max) for pair in elastic]
    yield "elastic_moment", [_change(pair, "moment", PUSH_OFF, np.max) for pair in elastic]


def lifted(people: People) -> Responses:
    """S1 as it is on wearers with a drop foot, after weeks."""
    yield "lifting_speed", [_faster((w.walk({}, weeks=True), w.walk())) for w in people["drop foot"]]
    dead = [replace(w, strength={**w.strength, "tibialis": 0.0}) for w in people["drop foot"]]
    bodies = [((w.body({}), w.gaits[DEVICE]), (w.body(), w.gaits["nothing"])) for w in dead]
    falls = [[falls_of(*case, starts=FEW).count for case in pair] for pair in bodies]
    yield "lifting_falls", [100.0 * (worn / bare - 1.0) if bare else math.nan for worn, bare in falls]


def springs(people: People) -> Responses:
    """Springs on weak plantarflexors, adapted to each; by weakness it is told beyond chance and scatter."""
    who, stiffness = people["weak plantarflexors"], np.radians(_told("setting")["stiffness"])  # [N·m/deg]
    each = [[_sprung(w.walk(spring=x, weeks=x > 0.0), x) for x in stiffness] for w in who]
    cost, ankle, power = np.moveaxis(np.array(each), 2, 0)
    yield "spring_dorsiflexion", np.polyfit(stiffness, ankle.T, 1)[0]
    yield "spring_power", np.polyfit(stiffness, power.T, 1)[0]
    rank = kendalltau([w.strength["soleus"] for w in who], cost.argmin(axis=1))
    apart = np.diff(np.log(np.sort(cost, axis=1)[:, :2]))  # the least from the next
    yield "spring_by_weakness", [rank.statistic], rank.pvalue < 0.05 and np.median(apart) > SCATTER


def _sprung(walked: Walked, spring: float) -> list[float]:
    """Cost, most dorsiflexion in stance [deg], peak power of ankle and spring [W/kg]; inf, NaN of a fall."""
    own, ankle = numbers(walked), _curve(walked, "ankle")
    torque = -math.degrees(spring) * GRAVITY / walked.body.weight * ankle  # [N·m/kg]
    power = _curve(walked, "power") + torque * np.gradient(ankle) * 100.0 / own["stride_time"]
    cost = own["cost_of_transport"] if walked.fell is None else math.inf
    return [cost, math.degrees(ankle[10:62].max()), power[35:70].max()]
