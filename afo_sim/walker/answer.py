"""What a response says: a table of its cases, and three questions answered in words."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from afo_sim.walker.respond import Case, Falls, Response

CASES = {
    "healthy": "healthy",
    "patient": "patient, not adapted",
    "patient adapted": "patient, adapted",
    "device": "with device, not adapted",
    "device adapted": "with device, adapted",
}
SIDES = {"right": "device's leg", "left": "other leg"}
LEAST = 0.10  # relative difference of a cost of transport from which on it is claimed [-]
NONE = "–"


@dataclass(frozen=True)
class _Row:
    """number : its name; factor : from SI to unit; both : one row for each leg."""

    number: str
    label: str
    unit: str
    digits: int
    factor: float = 1.0
    both: bool = False

    def of(self, case: Case, side: str = "") -> str:
        """The cell of a case; a dash where there is no such number."""
        value = case.numbers.get(f"{side}/{self.number}" if side else self.number, math.nan)
        if not math.isfinite(value) or (self.number == "device_torque_swing" and "device" not in case.name):
            return NONE
        text = f"{self.factor * value:.{self.digits}f}"
        return (text[1:] if float(text) == 0.0 and text[0] == "-" else text).replace("-", "−")


_ROWS = {
    row.number: row
    for row in (
        _Row("speed", "speed", "m/s", 2),
        _Row("stride_length", "stride length", "m", 2),
        _Row("stride_time", "stride time", "s", 2),
        _Row("clearance", "toe clearance in mid-swing", "mm", 0, 1e3, both=True),
        _Row("scuffs", "swings that touch the floor", "%", 0, 100.0, both=True),
        _Row("ankle_swing", "ankle in mid-swing", "°", 1, both=True),
        _Row("thigh_max", "thigh's greatest flexion", "°", 1, both=True),
        _Row("knee_max", "knee's greatest flexion", "°", 1, both=True),
        _Row("force_peak", "greatest vertical force", "body weights", 2, both=True),
        _Row("push_off_work", "push-off work of the ankle", "J/kg", 2, both=True),
        _Row("cost_of_transport", "cost of transport", "J/(kg·m)", 1),
        _Row("device_torque_swing", "device's torque in swing", "N·m", 2),
        _Row("air_per_stride", "air per stride", "g", 3, 1e3),
    )
}


def table(response: Response) -> tuple[list[str], list[list[str]]]:
    """A response as header and rows, a column for each case.

    Parameters
    ----------
    response : what `respond` gives

    Returns
    -------
    header and rows of text; "–" where a case has no such number
    """
    cases = list(response.cases.values())
    rows = [["undisturbed walk", *map(walk_in_words, cases)]]
    rows.append(["falls of perturbed starts, with 95 % interval", *(_falls(case.falls) for case in cases)])
    for row in _ROWS.values():
        for side in SIDES if row.both else ("",):
            label = f"{row.label}, {SIDES[side]}" if side else row.label
            rows.append([f"{label} [{row.unit}]", *(row.of(case, side) for case in cases)])
    return ["", *(CASES[case.name] for case in cases)], rows


_BRIEF = ("speed", "clearance", "ankle_swing", "cost_of_transport", "air_per_stride")


def in_brief(response: Response) -> dict[str, str]:
    """The wearer in one line, by what each cell is: how they walk, falls, and five numbers."""
    case = of_wearer(response)
    found = {
        "case": CASES[case.name],
        "undisturbed walk": walk_in_words(case),
        "falls, with 95 % interval": _falls(case.falls),
    }
    for row in (_ROWS[name] for name in _BRIEF):
        found[f"{row.label} [{row.unit}]"] = row.of(case, "right" if row.both else "")
    return found


def walk_in_words(case: Case) -> str:
    """How an undisturbed walk ended."""
    if case.numbers["fell"]:
        return f"fell after {case.numbers['duration']:.1f} s"
    return f"walks {case.numbers['duration']:.3g} s"


def _falls(falls: Falls | None) -> str:
    if falls is None:
        return NONE
    low, high = falls.interval
    return f"{falls.count} of {falls.of} ({100.0 * low:.0f} to {100.0 * high:.0f} %)"


@dataclass(frozen=True)
class Reply:
    """A question about a response, its answer, and what the answer assumes."""

    question: str
    text: str
    assumptions: tuple[str, ...]


def verdict(response: Response) -> tuple[Reply, ...]:
    """Whether the wearer falls in simulation, what they change, what it costs them.

    Parameters
    ----------
    response : what `respond` gives

    Returns
    -------
    an answer for each question, in plain English
    """
    doubts = tuple(_doubts(response))
    return (
        Reply("Does the wearer fall (in simulation)?", " ".join(_of_falls(response)), (_FALLS, *doubts)),
        Reply("What do they change?", " ".join(_of_changes(response)), (_CHANGES, *doubts)),
        Reply("What does it cost them?", " ".join(_of_cost(response)), (_COST, *doubts)),
    )


_FALLS = (
    "A walker in the sagittal plane with reflexes and without eyes, arms or steps aside starts from poses drawn "
    "about its own and is pushed once. Its falls compare one walker with another. They are not a patient's risk "
    "of falling."
)
_CHANGES = (
    "Both legs are in the sagittal plane. A case that is not adapted keeps the reflexes of the healthy walk. "
    "An adapted one is the best that a search found for a stated cost; a person may adapt otherwise."
)
_COST = (
    "The muscles' energy is a model's. Over conditions of walking, seven such models follow measured gas "
    "exchange with a correlation of 0.9 and more (Koelewijn et al. 2019, doi 10.1371/journal.pone.0222037). "
    "Differences below 10 % are not claimed."
)


def _doubts(response: Response) -> Iterator[str]:
    """Adapted cases whose search did not converge, or does not say so."""
    for case in response.cases.values():
        if not case.name.endswith("adapted"):
            continue
        known = case.gait.search.get("converged") if case.found is None else case.found.converged
        if known is None:
            yield f"It is not known whether the search of “{CASES[case.name]}” converged."
        elif not known:
            yield (
                f"The search of “{CASES[case.name]}” did not converge: a longer one may find another walk."
            )


def of_wearer(response: Response) -> Case:
    """The wearer of the device, adapted where that is known; the patient where there is no device."""
    names = ("device adapted", "device", "patient adapted", "patient")
    return response.cases[next(name for name in names if name in response.cases)]


def _pair(response: Response) -> tuple[Case, Case] | None:
    """The patient without and with the device, both adapted or neither; None without a device."""
    cases = response.cases
    for kind in (" adapted", ""):
        if f"patient{kind}" in cases and f"device{kind}" in cases:
            return cases[f"patient{kind}"], cases[f"device{kind}"]
    return None


def _of_falls(response: Response) -> Iterator[str]:
    for case in response.cases.values():
        among = "" if case.falls is None else f"; of perturbed starts {_falls(case.falls)} fall"
        yield f"{_capital(CASES[case.name])}: {walk_in_words(case)}{among}."
    pair = _pair(response)
    if pair is None or pair[0].falls is None or pair[1].falls is None:
        return
    before, after = pair[0].falls, pair[1].falls
    low, high = difference(before, after)
    spread = f"{100.0 * low:+.0f} to {100.0 * high:+.0f} % of starts".replace("-", "−")
    if low > 0.0 or high < 0.0:
        more = "more" if low > 0.0 else "fewer"
        yield f"With the device {more} starts fall than without ({spread})."
    else:
        yield f"With and without the device, falls are not distinguishable with {after.of} starts ({spread})."


def difference(before: Falls, after: Falls) -> tuple[float, float]:
    """95 % interval of the share that falls after, less that before [-].

    Source
    ------
    Newcombe 1998, Statistics in Medicine 17, 873, method 10, of independent shares. Starts are the same in both
    cases, which it leaves aside.
    """
    (low, high), (low_before, high_before) = after.interval, before.interval
    share, share_before = after.count / after.of, before.count / before.of
    apart = share - share_before
    return (
        apart - math.hypot(share - low, high_before - share_before),
        apart + math.hypot(high - share, share_before - low_before),
    )


_CHANGED = ("speed", "stride_length", "clearance", "ankle_swing", "knee_max", "thigh_max", "push_off_work")


def _of_changes(response: Response) -> Iterator[str]:
    pair = _pair(response)
    patient = of_wearer(response) if pair is None else pair[0]
    yield _change("Patient against healthy", response["healthy"], patient)
    if pair is not None:
        yield _change("With the device against without", *pair)
        torque = _ROWS["device_torque_swing"].of(pair[1])
        if torque != NONE:
            yield f"In swing the device turns the ankle with {torque} N·m, dorsiflexion positive."


def _change(title: str, before: Case, after: Case) -> str:
    """What differs between two cases on the leg with the device, in words."""
    if missing := _without_strides(before, after):
        return f"{title}: not comparable; {missing}."
    told = []
    for row in (_ROWS[name] for name in _CHANGED):
        side = "right" if row.both else ""
        told.append(
            f"{row.label} {row.of(before, side)} → {row.of(after, side)} {row.unit}".replace(" °", "°")
        )
    kind = ", not adapted" if not after.name.endswith("adapted") else ", adapted"
    return f"{title}{kind}, on the device's leg: {', '.join(told)}."


def _without_strides(*cases: Case) -> str:
    """Why cases have no strides to count; "" where they have."""
    return "; ".join(
        f"“{CASES[case.name]}” {walk_in_words(case)}, too few strides to count"
        for case in cases
        if not math.isfinite(case.numbers["cost_of_transport"])
    )


def _of_cost(response: Response) -> Iterator[str]:
    pair = _pair(response)
    patient = of_wearer(response) if pair is None else pair[0]
    yield _cost("Patient against healthy", response["healthy"], patient)
    if pair is not None:
        yield _cost("With the device against without", *pair)
    air = _ROWS["air_per_stride"].of(of_wearer(response))
    if air != NONE:
        yield f"The device takes {air} g of air per stride."


def _cost(title: str, before: Case, after: Case) -> str:
    if missing := _without_strides(before, after):
        return f"{title}: not comparable; {missing}."
    change = after.numbers["cost_of_transport"] / before.numbers["cost_of_transport"] - 1.0
    row = _ROWS["cost_of_transport"]
    values = f"{row.of(before)} → {row.of(after)} {row.unit}"
    if abs(change) < LEAST:
        return f"{title}: not distinguishable ({values})."
    return f"{title}: {abs(change):.0%} {'more' if change > 0.0 else 'less'} ({values})."


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
