"""The walker against measurement: healthy norms, and how wearers responded, on which nothing is fitted."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from afo_sim.walker.body import BARE, build_body
from afo_sim.walker.gait_file import Gait, read_gait
from afo_sim.walker.likeness import BOVI, beside_people
from afo_sim.walker.respond import falls_of, prepared
from afo_sim.walker.strides import numbers, strides_of
from afo_sim.walker.walking import Push, Walked, walk

Verdict = Literal["agrees", "disagrees", "cannot tell"]
GAITS = ("slow", "natural", "fast")
WALKED, PUSH_HORIZON = 20.0, 8.0  # [s]
STARTS = 50
CLAIMED = 0.10  # relative difference of a cost of transport that the energy's model can tell
KAO = "Kao & Ferris 2009, Gait Posture, PMC2663810"
GEBOERS = "Geboers et al. 2002, Arch. Phys. Med. Rehabil."
WATERVAL = "Waterval et al. 2023, J. NeuroEng. Rehabil. 20, doi 10.1186/s12984-023-01239-z"
GALLE = "Galle et al. 2017, J. NeuroEng. Rehabil., PMC5408443"
SCENARIO, HEALTHY = "walk-dropfoot-afo", {"patient": "healthy"}
SPRING = 60.0  # of a posterior leg spring, about 1 N·m/deg (assumed) [N·m/rad]


@dataclass(frozen=True)
class Compared:
    """A measured number beside the walker's."""

    quantity: str
    measured: float
    simulated: float
    unit: str
    verdict: Verdict
    source: str
    why: str
    in_cost: bool = False  # of the search for the gait


def compare(report: Callable[[str], None] | None = None) -> list[Compared]:
    """All rows, by simulation: half a minute of it."""
    found: list[Compared] = []
    for part in (healthy, pushed, kao_ferris, geboers, waterval, galle):
        for row in part():
            found.append(row)
            if report is not None:
                report(row.quantity)
    return found


def _walk(gait: Gait, worn: dict[str, Any] | None = None, **body: Any) -> Walked:
    """A healthy walker in the shipped scenario's shoes, with its device where `worn` sets it."""
    described = prepared(SCENARIO, HEALTHY | (BARE if worn is None else worn))
    return walk(build_body(described, **body), gait.vector, WALKED)


def healthy() -> Iterator[Compared]:
    """The three shipped gaits against what is measured on adults."""
    for name in GAITS:
        yield from held(name, _walk(read_gait(name)))


def held(name: str, walked: Walked) -> Iterator[Compared]:
    """A walk of a gait, the mean of its legs, beside the rows of `TABLE`."""
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
    body, gait = build_body(prepared(SCENARIO, HEALTHY | BARE)), read_gait("natural")
    for force, most in ((50.0, 0), (100.0, 1)):
        pushes = [Push(3.0 + 0.1 * k, sign * force) for k in range(10) for sign in (1.0, -1.0)]
        falls = sum(walk(body, gait.vector, PUSH_HORIZON, (push,)).fell is not None for push in pushes)
        what, why = f"healthy: falls of 20 walks pushed by ±{force:g} N", f"at most {most}"
        yield Compared(what, 0.0, falls, "", _judged(falls <= most), "stated bound", why, force == 50.0)
    falls, most = falls_of(body, gait.vector, starts=STARTS).count, 2
    what, why = f"healthy: falls of {STARTS} drawn starts, pushed once", f"at most {most}"
    yield Compared(what, 0.0, falls, "", _judged(falls <= most), "stated bound", why, True)


def kao_ferris() -> Iterator[Compared]:
    """A dorsiflexor muscle on a healthy wearer, by the activity of their own tibialis: S1's, switched."""
    gait = read_gait("natural")
    plain = strides_of(_walk(gait), "right")
    emg = {"column": "ankle/moment/biological", "full": "20 N*m", "chamber": "dorsiflexor"}
    sets = {
        "patient": "healthy",
        "phases": None,
        "start": None,
        "controller": {"emg": emg},
        "supply.pressure": "3 bar",
    }
    with_device = strides_of(_walk(gait, sets), "right")
    why = "S1's muscles at 3 bar, valves by the dorsiflexors' own moment; the wearer does not adapt"
    if not len(with_device.duration):
        yield Compared("dorsiflexion in swing", 9.0, math.nan, "deg", "cannot tell", KAO, f"{why}: fell")
        return
    swing, first = slice(70, 95), slice(0, 15)
    more = np.degrees(np.mean((with_device.mean("ankle") - plain.mean("ankle"))[swing]))
    yield _same_way("ankle in swing, with less without", 9.0, float(more), "deg", KAO, why)
    bursts = [strides.mean("tibialis")[first].max() for strides in (with_device, plain)]
    yield _same_way(
        "first burst of the tibialis", -28.0, 100.0 * (bursts[0] / bursts[1] - 1.0), "%", KAO, why
    )


def _same_way(what: str, measured: float, simulated: float, unit: str, source: str, why: str) -> Compared:
    """Agrees within half and twice the measured response; nothing can be told of a walker who fell."""
    if not math.isfinite(simulated):
        return Compared(what, measured, math.nan, unit, "cannot tell", source, f"{why}: the walker fell")
    near = _judged(0.5 <= simulated / measured <= 2.0)
    return Compared(what, measured, simulated, unit, near, source, f"within half to twice; {why}")


def geboers() -> Iterator[Compared]:
    """Mean activity of the tibialis with a passive orthosis: patients −7 %, healthy −20 %."""
    gait = read_gait("natural")
    why = f"a spring of {SPRING:g} N·m/rad (assumed), no adaptation"
    for who, share, measured in (("healthy", 1.0, -20.0), ("foot drop, 40 % left", 0.4, -7.0)):
        means = []
        for spring in (0.0, SPRING):
            strides = strides_of(_walk(gait, strength={"tibialis": share}, spring=spring), "right")
            means.append(strides.mean("tibialis").mean() if len(strides.duration) else math.nan)
        change = 100.0 * (means[1] / means[0] - 1.0)
        yield _same_way(f"tibialis with an orthosis, {who}", measured, change, "%", GEBOERS, why)


def waterval() -> Iterator[Compared]:
    """Whether the stiffness that costs least rises with weakness of the plantarflexors; no adaptation."""
    gait, best, apart = read_gait("natural"), [], math.inf
    for share in (0.8, 0.6):
        costs = []
        for stiffness in (0.0, 60.0, 120.0, 240.0):
            weak = dict.fromkeys(("soleus", "gastrocnemius"), share)
            walked = _walk(gait, strength=weak, spring=stiffness)
            costs.append(numbers(walked)["cost_of_transport"] if walked.fell is None else math.inf)
        least, second, *_ = sorted(costs)
        apart = min(apart, second / least - 1.0)
        best.append((0.0, 60.0, 120.0, 240.0)[int(np.argmin(costs))] if min(costs) < math.inf else math.nan)
    rises = float(np.sign(best[1] - best[0])) if all(math.isfinite(value) for value in best) else 0.0
    verdict: Verdict = "cannot tell" if rises == 0.0 or apart < CLAIMED else _judged(rises > 0.0)
    words = (
        f"least cost at {best[0]:g} and {best[1]:g} N·m/rad, 80 and 60 % strength left, by {apart:.1%} least"
    )
    yield Compared("stiffness of least cost, by weakness", 1.0, rises, "sign", verdict, WATERVAL, words)


def galle() -> Iterator[Compared]:
    """Onset of a plantarflexor muscle: only metabolic cost was measured."""
    words = "its ten conditions differ by less than the energy model's own error"
    yield Compared(
        "best onset of a plantarflexor", 42.0, math.nan, "% of the stride", "cannot tell", GALLE, words
    )
