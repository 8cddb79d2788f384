"""The answers about air: how much a stride takes, how long its source lasts, what it adds."""

import math
from collections.abc import Iterator

from afo_sim.metrics.answer import (
    ADDS,
    AGAINST,
    AIR,
    CHANGED,
    QUESTIONS,
    Answer,
    Feed,
    Limits,
    Numbers,
    Status,
    at_least,
    capital,
    clean,
    has,
    in_digits,
    lasting,
    millimetres,
    passes,
    three,
    unknown,
)

SAG = 10.0  # of the set pressure, by which the supply may fall below it [percent]
_HEIGHT = "toe_clearance"
_EASIER = 1.1  # times as much a single filling must hinder push-off, for air to be worth it; assumed


def air(metrics: Numbers, worn: bool, limits: Limits, feed: Feed | None) -> Answer:
    """Air per stride and hour, and how long its source lasts or whether it keeps up."""
    wanted, few = limits.strides_per_bottle
    limit = f"target ≥ {wanted:g} strides, bad below {few:g}"
    if feed is not None and feed.runs:
        limit = "mean flow at most what it delivers at the set pressure"
    if feed is not None or _sags(metrics):
        limit += f"; supply sag at most {SAG:g} %"
    if not worn:
        return Answer(AIR, QUESTIONS[AIR], "good", "None: nothing is worn that uses air.", limit, kept=1.0)
    if not has(metrics, "air_per_stride"):
        return unknown(AIR, "the air per stride is undefined", limit)
    grams = metrics["air_per_stride"].value
    if grams <= 0.0:
        return Answer(AIR, QUESTIONS[AIR], "good", "None: no stride uses air.", limit, kept=1.0)
    parts = [f"A stride uses {grams:.3g} g of air"]
    if has(metrics, "free_air_per_minute"):
        parts.append(f"{three(60.0 * metrics['free_air_per_minute'].value)} l/h (ANR)")
    wished = f"a bottle of {1e3 * limits.bottle_volume:g} l at {1e-5 * limits.bottle_pressure:g} bar"
    runs, words = (False, wished) if feed is None else (feed.runs, feed.words)
    status, stated = _compressor(metrics, words) if runs else _bottle(metrics, (wanted, few), words)
    found = [f"{', '.join(parts)}.", stated]
    if _sags(metrics):
        status = "bad"
        if has(metrics, "source_empty_after"):
            found.append(f"The source is empty after {lasting(metrics['source_empty_after'].value)}.")
        if has(metrics, "supply_sag") and has(metrics, "lowest_supply_pressure"):
            low, sag = metrics["lowest_supply_pressure"].value, metrics["supply_sag"].value
            found.append(f"The supply falls to {low:.2f} bar, {sag:.0f} % below its set pressure.")
    lasts = metrics.get("strides_per_bottle", math.nan)
    plain = lasts > 0.0 and not _sags(metrics) and not runs
    brief = f"{capital(words)}: {lasts:.0f} strides (target ≥ {wanted:g})" if plain else ""
    return Answer(AIR, QUESTIONS[AIR], status, " ".join(found), limit, brief)


def _bottle(metrics: Numbers, limit: tuple[float, float], words: str) -> tuple[Status, str]:
    """How long a bottle or cartridge lasts."""
    if not has(metrics, "strides_per_bottle"):
        return "unknown", "This recording has no strides per bottle: run it again."
    strides = metrics["strides_per_bottle"].value
    if strides <= 0.0:
        stated = f"{capital(words)} lasts no stride: its pressure is not above the supply's."
        return at_least(strides, limit), stated
    lasts = f"{strides:.0f} strides" if strides >= 10.0 else f"{strides:.1f} strides"
    if has(metrics, "stride_time"):
        lasts += f", {lasting(strides * metrics['stride_time'].value)}"
    return at_least(strides, limit), f"{capital(words)} lasts {lasts}."


def _compressor(metrics: Numbers, words: str) -> tuple[Status, str]:
    """Whether a compressor keeps up, and how long it runs; one that never rests is no good one."""
    if not has(metrics, "compressor_duty"):
        return "unknown", "This recording has no duty of the compressor: run it again."
    duty = metrics["compressor_duty"].value
    share = metrics["source_share"].value if has(metrics, "source_share") else math.inf
    stated = f"{capital(words)} runs {three(duty)} % of the time"
    if has(metrics, "compressor_power"):
        stated += f", {metrics['compressor_power'].value:.3g} W on average"
    if share > 100.0:
        gives = "nothing"
        if math.isfinite(share) and has(metrics, "free_air_per_minute"):
            gives = f"{100.0 * metrics['free_air_per_minute'].value / share:.1f} l/min"
        return "bad", f"{stated} and cannot keep up: at the set pressure it delivers {gives}."
    status: Status = "doubtful" if duty >= 100.0 else "good"
    return status, f"{stated}; the flow is {three(share)} % of its delivery."


def _sags(metrics: Numbers) -> bool:
    """Whether the supply falls too far below its set pressure, or the source runs empty."""
    falls = has(metrics, "supply_sag") and metrics["supply_sag"].value > SAG
    return falls or has(metrics, "source_empty_after")


def air_adds(metrics: Numbers, limits: Limits, own_walk: bool) -> Iterator[Answer]:
    """What switched air gives beyond the same device filled once and shut, which is a spring."""
    # Of an own walk all is without compensation. Whose toe needs no device needs no air.
    of = "uncompensated_" if own_walk else ""
    names = (_HEIGHT, *AGAINST, "pressure")
    once = {n: metrics[f"filled_once_{n}"].value for n in names if has(metrics, f"filled_once_{n}")}
    if _HEIGHT not in once or not all(has(metrics, f"{of}{name}") for name in (_HEIGHT, *AGAINST)):
        return
    wanted = clean(1e3 * limits.toe_clearance[0])
    own = metrics[f"{of}{_HEIGHT}"].value
    bare = metrics.get(f"{of}reference_{_HEIGHT}", -math.inf)
    firsts = {name: max(getattr(limits, key)[0], 1e-12) for name, key in AGAINST.items()}
    against = max(metrics[f"{of}{name}"].value / first for name, first in firsts.items())
    shut = max(once.get(name, math.inf) / first for name, first in firsts.items())
    torque = "torque_against_push_off_per_mass"
    text = f"With one filling to {once['pressure']:.3g} bar and the valves then shut, the toe passes "
    text += f"{passes(once[_HEIGHT])} and push-off is resisted by {once.get(torque, math.nan):.3f} N·m/kg; "
    text += f"with switched air {passes(own)} and {metrics[of + torque].value:.3f} N·m/kg"
    status: Status = "doubtful"
    higher = own > once[_HEIGHT] + CHANGED
    if bare >= wanted:
        said = short = "the toe needs neither"
    elif once[_HEIGHT] >= wanted > own:
        said = short = "one filling is enough, switched air is not"
    elif own < wanted:
        short = "not enough"
        said = "switched air lifts the toe higher, but not enough" if higher else "neither is enough"
    elif once[_HEIGHT] < wanted and higher:
        status, said = "good", "only switched air lifts the toe enough"
        short = "switched air is needed"
    elif shut > max(_EASIER * against, 1.0):
        status, said = "good", "switched air relieves push-off"
        short = said
    else:
        short = "a spring would do"
        said = "for toe and push-off a spring that is set once would do as well, if nothing leaks"
    low, high = map(millimetres, (once[_HEIGHT], own))
    brief = f"Toe clearance {low} if filled once, {high} with switched air: {short}"
    yield Answer(ADDS, QUESTIONS[ADDS], status, f"{text}: {said}.", adds_limit(limits), brief)


def adds_limit(limits: Limits) -> str:
    """What switched air must give beyond one filling, in words."""
    wanted = in_digits(clean(1e3 * limits.toe_clearance[0]))
    reached = f"good if only switched air clears {wanted} mm"
    return f"{reached}, or one filling resists push-off {_EASIER:g} times as much"
