"""Bands of a run's numbers in words and tables: uncertain inputs of orthosis and wearer varied together."""

import math
from collections.abc import Iterator, Mapping, Sequence

from afo_sim.common import JsonDict, JsonMapping
from afo_sim.metrics import NO_RATE, Metric, of_draws, percent, unit, words
from afo_sim.show.run_view import RunView
from afo_sim.simulation import Recording

_STUDY = "uncertainty"
_CLEARANCE, _TORQUE, _AIR = "toe_clearance", "torque_against_push_off", "air_per_stride"
_HOLDS = "bands include the uncertain inputs, not how far past predictions were off (afo-sim validate)"
_MANY_FAILED = 0.1  # share of failed draws from which on that is stated first [-]
_LEAST_SHARE = 0.01  # of the variance, below which a group has no row [-]
_OF_METRICS = {_CLEARANCE: "toe clearance", _TORQUE: "torque against push-off", _AIR: "air"}


def lines(recording: Recording) -> list[str]:
    """For the terminal; none where there is nothing to report."""
    study = _study(recording)
    if study is None:
        return []
    heading = _warnings(study) or [f"All uncertain inputs varied together ({study['draws']} draws)"]
    notes = [_HOLDS, *study["notes"], *_in_no_band(study), *_left_out(study)]
    return [*heading, *(f"  {line}" for line in [*_sentences(study), "; ".join(notes)])]


def brief(recording: Recording) -> list[str]:
    """For a short answer on the terminal: failures, the bands, what to measure next."""
    study = _study(recording)
    if study is None:
        return []
    found, left = [], study["draws"] - study["failed"]["count"]
    for name in [name for name in _OF_METRICS if name in study["metrics"]]:
        _, (low, _, high), of = _told(study["metrics"][name])
        found.append(f"{_OF_METRICS[name]} {low} to {high} {of}")
    if study["trips"]:
        share = of_draws(study["trips"]["touch"]["share"], left, "trips", "trip")
        found.append(f"of the strides {share}: {NO_RATE}")
    bands = [f"5 to 95 % of {left} draws of uncertain inputs: {'; '.join(found)}"] if found else []
    return [*_warnings(study), *bands, *_in_no_band(study), *_measure_next(study)]


def markdown(recording: Recording) -> str:
    """For the viewer; "" where there is nothing to report."""
    study = _study(recording)
    if study is None:
        return ""
    parts = ["## Uncertainty", *_warnings(study), *_sentences(study)]
    table = ["| | run | 5 % | 50 % | 95 % | |", "|---|---|---|---|---|---|"]
    table += [f"| {' | '.join(row)} |" for row in _rows(study)]
    return "\n\n".join([*parts, "\n".join(table), *_notes(study)])


def of_report(runs: Sequence[RunView]) -> list[JsonDict]:
    """What the report's part report_bands.html.j2 draws; empty where there is nothing to report."""
    return [_part(run, study) for run in runs if (study := _study(run.recording)) is not None]


def _study(recording: Recording) -> JsonMapping | None:
    found = recording.studies.get(_STUDY)
    return found if isinstance(found, Mapping) else None


def _part(run: RunView, study: JsonMapping) -> JsonDict:
    names = [name for name in _OF_METRICS if name in study.get("rest", {})]
    bars = []
    for group in study["groups"]:
        shares = tuple(100.0 * float(group["explained"].get(name, 0.0)) for name in names)
        if max(shares, default=0.0) >= 100.0 * _LEAST_SHARE:
            bars.append((_plain(group["name"]), group["each_stride"], group["measure"], shares))
    rest = tuple(100.0 * study["rest"][name] for name in names)
    bars += [("several together, and the rest", True, "", rest)] if bars else []
    told = {"warnings": _warnings(study), "sentences": _sentences(study), "notes": _notes(study)}
    explained, drawn = [_OF_METRICS[name] for name in names], list(map(_drawn, study["drawn"]))
    table = {"draws": study["draws"], "rows": _rows(study), "drawn": drawn}
    return {"run": run, **told, **table, "explained": explained, "bars": bars}


def _warnings(study: JsonMapping) -> list[str]:
    failed, count = study["failed"], study["draws"]
    if failed["count"] <= _MANY_FAILED * count:
        return []
    reasons = "; ".join(f"{one['count']} × {one['reason']}" for one in failed["reasons"][:2])
    left = count - failed["count"]
    return [f"{failed['count']} of {count} draws failed ({reasons}); the bands are from the other {left}"]


def _sentences(study: JsonMapping) -> list[str]:
    """The answer in words: clearance, trips, the other bands, what to measure next."""
    found = []
    metrics = study["metrics"]
    if _CLEARANCE in metrics:
        found.append(f"toe clearance {_band(_CLEARANCE, metrics)}")
    if study["trips"]:
        trips, draws = study["trips"], study["draws"] - study["failed"]["count"]
        touch = of_draws(trips["touch"]["share"], draws, "trips", "trip")
        within = "within 10 mm of the floor"
        near = of_draws(trips["within_10mm"]["share"], draws, f"comes {within}", f"come {within}")
        low, _, high = (percent(share) for share in trips["touch"]["of_one"])
        own = f"a single wearer trips in {low if low == high else f'{low} to {high}'} of the strides"
        told = f"of {draws} strides with varied inputs {touch}; {near}"
        found.append(f"{told}; {own} (5 to 95 % of the draws): {NO_RATE}")
    others = [f"{_OF_METRICS[name]} {_band(name, metrics)}" for name in (_TORQUE, _AIR) if name in metrics]
    return [*found, *(["; ".join(others)] if others else []), *_measure_next(study)]


def _measure_next(study: JsonMapping) -> list[str]:
    """What to measure next: how much of the clearance's band and of wrong guesses it would leave."""
    named = {group["name"]: group for group in study["groups"]}
    groups = [named[name] for name in study["measure_next"]]
    if not groups:
        return []
    told, parts = f"measure next: {', '.join(_plain(group['name']) for group in groups)}", []
    if "band_left" in groups[0]:  # not of older runs
        left = ", ".join(percent(group["band_left"][_CLEARANCE]) for group in groups)
        parts.append(f"{left} of the clearance's band")
    if "wrong_left" in groups[0]:  # not of own walks
        wrong = ", ".join(percent(group["wrong_left"]) for group in groups)
        parts.append(f"{wrong} wrong guesses about the target (now {percent(study['wrong'])})")
    return [f"{told}; with each known, {' and '.join(parts)} remain" if parts else told]


def _band(name: str, metrics: JsonMapping) -> str:
    """A number with its band: "13.2 mm, 5 to 95 %: −2.2 to 27.3 mm"."""
    facts = metrics[name]
    _, (low, _, high), of = _told(facts)
    own = f"{facts['own']:.{_decimals(facts) + 1}f}".replace("-", "−")
    return f"{own} {of}, 5 to 95 %: {low} to {high} {of}"


def _rows(study: JsonMapping) -> Iterator[tuple[str, ...]]:
    """Of each number its label, the run's own value, 5, 50 and 95 % of the draws, its unit."""
    for name, facts in study["metrics"].items():
        own, quantiles, of = _told(facts)
        yield words(name).label, own, *quantiles, of


def _told(facts: JsonMapping) -> tuple[str, list[str], str]:
    """Own value and quantiles with as many decimals as the band deserves, and the unit."""
    decimals, numbers = _decimals(facts), (facts["own"], *facts["quantiles"])
    own, *others = (f"{x:.{decimals}f}".replace("-", "−") for x in numbers)
    return own, others, unit(Metric(0.0, facts["unit"]))


def _decimals(facts: JsonMapping) -> int:
    low, _, high = facts["quantiles"]
    return 2 if high <= low else min(max(1 - math.floor(math.log10(high - low)), 0), 4)


def _plain(name: str) -> str:
    return name.replace("_", " ")


def _drawn(one: JsonMapping) -> tuple[str, str, str, str]:
    """A drawn number: name, own value and band in the unit of people, kind, source."""
    from afo_sim.description import amount

    own, (low, _, high) = one["own"], one["quantiles"]
    band = f"{amount(own, one['unit'], 3)}: {amount(low, one['unit'], 3)} to {amount(high, one['unit'], 3)}"
    return _plain(one["name"]), band, str(one["kind"]), str(one["source"])


def _in_no_band(study: JsonMapping) -> list[str]:
    found, count = _undefined(study), study["failed"]["count"]
    few = 0 < count <= _MANY_FAILED * study["draws"]
    return (
        [*found, f"{count} of {study['draws']} draws failed and are left out of the bands"] if few else found
    )


def _notes(study: JsonMapping) -> list[str]:
    failed = [f"draw failed, {one['count']} times: {one['reason']}" for one in study["failed"]["reasons"]]
    again = f"{study['rejected']} draws of a muscle's fit gave no valid muscle and were repeated"
    failed += [again] if study["rejected"] else []
    return [_HOLDS, *study["notes"], *_undefined(study), *failed, *_left_out(study)]


def _left_out(study: JsonMapping) -> list[str]:
    names = dict.fromkeys(_plain(text.partition(":")[0]) for text in study["left_out"])
    return [f"not varied here: {', '.join(names)}"] if names else []


def _undefined(study: JsonMapping) -> list[str]:
    return [
        f"{words(name).label} is undefined in {facts['undefined']} draws, which its band leaves out"
        for name, facts in study["metrics"].items()
        if facts["undefined"]
    ]
