"""Results of a response: a table of its cases, and three questions answered in words."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from afo_sim.walker.body import floor_of
from afo_sim.walker.gait_signs import signs_of
from afo_sim.walker.likeness import measured_cost
from afo_sim.walker.respond import Case, Falls, Response

CASES = {
    "healthy": "healthy",
    "patient": "patient, not adapted",
    "patient adapted": "patient, adapted",
    "device": "with device, not adapted",
    "device adapted": "with device, adapted",
}
LEGS = {"right": "device's leg", "left": "other leg"}
EXPERIMENTAL = "Experimental: these gaits are not realistic yet. Compare cases; apply no number to a patient."

NOT_SEEN = (
    "Circumduction and hip hiking cannot occur in a plane, nor knee hyperextension (stop at 5° of flexion)."
)
NORM_OF = "Norm: Bovi et al. 2011 at each walker's own speed, from 0.85 m/s."
LEAST = 0.10  # relative difference of a cost of transport from which on it is claimed [-]
NONE = "–"
FALLS = (
    "A walker in the sagittal plane with reflexes, without eyes, arms or steps aside, starts from poses "
    "drawn about its own and is pushed once, if it has not fallen before. Falls compare walkers; they are "
    "not a patient's risk of falling."
)
_NATURAL = (
    "The shipped natural gait does not tolerate weak plantarflexors: with 15 % lost on one leg, 14 of "
    "20 starts fall."
)
_CHANGES = (
    "Both legs move in the sagittal plane. A case that is not adapted keeps the reflexes of healthy walking. "
    "An adapted one is the best that a search found for a stated cost; a person may adapt differently."
)
_COST = (
    "The muscles' energy comes from a model. Over walking conditions, seven such models follow measured gas "
    "exchange with a correlation of 0.9 or more (Koelewijn et al. 2019, doi 10.1371/journal.pone.0222037). "
    "Differences below 10 % are not claimed. The cost itself, with 1.51 W/kg at rest, is not validated."
)


@dataclass(frozen=True)
class _Row:
    """A number by its name in `numbers`, how it is written, whether each leg has one."""

    label: str
    unit: str
    digits: int
    factor: float = 1.0
    both: bool = False

    def of(self, name: str, case: Case, side: str = "right") -> str:
        """The cell of a case; a dash where there is no such number."""
        value = case.numbers.get(f"{side}/{name}" if self.both else name, math.nan)
        return NONE if name == "device_torque_swing" and "device" not in case.name else self.text(value)

    def text(self, value: float | None) -> str:
        """A number in this row's unit; a dash where there is none."""
        if value is None or not math.isfinite(value):
            return NONE
        return f"{round(self.factor * value, self.digits) + 0.0:.{self.digits}f}".replace("-", "−")


ROWS = {
    "speed": _Row("speed", "m/s", 2),
    "stride_length": _Row("stride length", "m", 2),
    "stride_time": _Row("stride time", "s", 2),
    "clearance": _Row("toe clearance in mid-swing", "mm", 0, 1e3, both=True),
    "scuffs": _Row("swings that touch the floor", "%", 0, 100.0, both=True),
    "ankle_swing": _Row("ankle in mid-swing", "°", 1, both=True),
    "thigh_max": _Row("thigh's greatest flexion", "°", 1, both=True),
    "knee_max": _Row("knee's greatest flexion", "°", 1, both=True),
    "ankle_stance_max": _Row("ankle's greatest dorsiflexion in stance", "°", 1, both=True),
    "ankle_mid_stance": _Row("ankle's change from 25 to 60 % of stance", "°", 1, both=True),
    "knee_mid_stance": _Row("knee in mid-stance", "°", 1, both=True),
    "pitch_contact": _Row("sole at contact, toe up positive", "°", 1, both=True),
    "foot_fall": _Row("sole's fall from heel strike to flat", "°/s", 0, both=True),
    "push_off_peak": _Row("push-off power of the ankle", "W/kg", 2, both=True),
    "trunk_forward": _Row("trunk's forward lean", "°", 1),
    "force_peak": _Row("greatest vertical force", "body weights", 2, both=True),
    "push_off_work": _Row("push-off work of the ankle", "J/kg", 2, both=True),
    "cost_of_transport": _Row("cost of transport", "J/(kg·m)", 1),
    "device_torque_swing": _Row("device's torque in swing", "N·m", 2),
    "air_per_stride": _Row("air per stride", "g", 3, 1e3),
}
_BRIEF = ("speed", "clearance", "ankle_swing", "cost_of_transport", "air_per_stride")
_CHANGED = ("speed", "stride_length", "clearance", "ankle_swing", "knee_max", "thigh_max", "push_off_work")


def in_words(response: Response) -> list[str]:
    """Signs of each case by the words of a gait scientist, their numbers, and what cannot be seen."""
    healthy, lines = response["healthy"], []
    ours = {(each["sign"], each["leg"]) for each in signs_of(healthy) or ()}
    for case in response.cases.values():
        signs, alone = signs_of(case), case is healthy
        who = CASES[case.name].capitalize() + (f" ({walk_in_words(case)})" if case.numbers["fell"] else "")
        if not signs:
            lines.append(f"{who}: {'too few strides to classify' if signs is None else 'no sign'}.")
        for leg, whose in (LEGS | {"trunk": "trunk"}).items():
            names, told = list[str](), dict[str, str]()
            for each in (sign for sign in signs or () if sign["leg"] == leg):
                healthy_too = not alone and (each["sign"], leg) in ours
                names.append(f"{each['sign']} (as healthy)" if healthy_too else each["sign"])
                for name, values in each["numbers"].items():
                    row = ROWS[name]
                    beside = "" if alone else f", healthy {row.of(name, healthy, leg)}"
                    own = f"{row.label} {row.of(name, case, leg)} {row.unit}"
                    told[name] = f"{own} (norm {row.text(values['norm'])}{beside})"
            if told:
                lines.append(f"{who}, {whose}: {', '.join(names)}; {', '.join(told.values())}.")
    return [line.replace(" °", "°") for line in (*lines, NOT_SEEN, NORM_OF)]


def asked_in_words(response: Response) -> list[str]:
    """The settings of a response in words."""
    asked = response.asked
    weak = ", ".join(f"{name} {share:g}" for name, share in asked["strength"].items()) or "full"
    lines = [
        f"Settings: healthy gait {asked['gait']}; remaining strength: {weak}; {asked['starts']} starts, "
        f"pushed by {asked['push']:g} N; {asked['generations']} generations of search over {asked['subset']} "
        f"gains; seed {asked['seed']}; steps of {1e3 * asked['timestep']:g} ms."
    ]
    if response.scenario.worn_on == "both":
        lines.append(f"Both legs wear the device; “{LEGS['left']}” is the left one. Air is for both.")
    return lines


def table(response: Response) -> tuple[list[str], list[list[str]]]:
    """A response as header and rows of text, a column for each case; "–" where it has no such number."""
    cases = list(response.cases.values())
    rows = [["undisturbed walk", *map(walk_in_words, cases)]]
    rows.append(["falls of perturbed starts, with 95 % interval", *(_falls(case.falls) for case in cases)])
    for name, row in ROWS.items():
        for side, leg in LEGS.items() if row.both else (("", ""),):
            label = f"{row.label}, {leg}" if leg else row.label
            rows.append([f"{label} [{row.unit}]", *(row.of(name, case, side) for case in cases)])
    return ["", *(CASES[case.name] for case in cases)], rows


def in_brief(case: Case) -> dict[str, str]:
    """A case in one line, by what each cell is."""
    found = {"case": CASES[case.name], "undisturbed walk": walk_in_words(case)}
    found["falls, with 95 % interval"] = _falls(case.falls)
    signs = ", ".join(each["sign"] for each in signs_of(case) or () if each["leg"] == "right")
    found["signs, device's leg"] = signs or (NONE if signs_of(case) is None else "none")
    return found | {f"{row.label} [{row.unit}]": row.of(n, case) for n, row in ROWS.items() if n in _BRIEF}


def walk_in_words(case: Case) -> str:
    """How an undisturbed walk ended."""
    time = case.numbers["duration"]
    return f"fell after {time:.1f} s" if case.numbers["fell"] else f"walks {time:.3g} s"


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
    """Whether the wearer falls in simulation, what they change, what it costs them, in plain English."""
    doubts, answers = (
        tuple(_doubts(response)),
        (
            ("Does the wearer fall (in simulation)?", _of_falls(response), f"{FALLS} {_NATURAL}"),
            ("What do they change?", _of_changes(response), _CHANGES),
            ("What does it cost them?", _of_cost(response), _COST),
        ),
    )
    return tuple(Reply(question, " ".join(each), (assumed, *doubts)) for question, each, assumed in answers)


def _doubts(response: Response) -> Iterator[str]:
    """A healthy walker who falls; adapted cases whose search did not converge, or does not say so."""
    if (floor := floor_of(response.scenario)).slope or floor.uneven:
        yield "The norms and the shipped gaits are for a level floor."
    if response["healthy"].numbers["fell"]:
        yield "The healthy walker falls too: its gait does not suit this body and describes no patient."
    if any(case.falls is not None and case.falls.count for case in response.cases.values()):
        yield "Numbers are from one undisturbed walk; if some starts fall, another start gives other numbers."
    if any(name.endswith("adapted") for name in response.cases):
        yield (
            "An adapted gait was searched for this body and 12 drawn patients. Patients who differ from "
            "them and do not adapt again may fall more often (--patients CONDITION --draws N)."
        )
    healthy = response["healthy"].gait.vector.gains
    for name, case in response.cases.items():
        known, adapted = _converged(case), name.endswith("adapted")
        if adapted and np.array_equal(case.gait.vector.gains, healthy):
            yield f"“{CASES[name]}” keeps the healthy gait: the searches found no better one."
        elif adapted and not known:
            what = "is not known to have converged" if known is None else "did not converge"
            yield f"The search of “{CASES[name]}” {what}: a longer search may find another walk."


def _converged(case: Case) -> bool | None:
    """Whether the search that adapted a case converged; None where its gait does not say."""
    return case.gait.search.get("converged") if case.found is None else case.found.converged


def _pairs(response: Response) -> dict[str, tuple[Case, Case]]:
    cases = response.cases
    devices = [kind for kind in (" adapted", "") if {f"patient{kind}", f"device{kind}"} <= set(cases)]
    kind = devices[0] if devices else " adapted" if "patient adapted" in cases else ""
    patient, how = cases[f"patient{kind}"], "adapted" if kind else "not adapted"
    found = {f"The patient against healthy, {how}": (cases["healthy"], patient)}
    return found | {
        f"With the device against without, {how}": (patient, cases[f"device{k}"]) for k in devices[:1]
    }


def _of_falls(response: Response) -> Iterator[str]:
    for case in response.cases.values():
        among = "" if case.falls is None else f"; falls after perturbed starts: {_falls(case.falls)}"
        yield f"{CASES[case.name].capitalize()}: {walk_in_words(case)}{among}."
    for title, (before, after) in list(_pairs(response).items())[1:]:
        if before.falls is None or after.falls is None:
            continue
        low, high = difference(before.falls, after.falls)
        more = (
            "more falls"
            if low > 0.0
            else "fewer falls"
            if high < 0.0
            else "no distinguishable difference in falls"
        )
        spread = f"{100.0 * low:+.0f} to {100.0 * high:+.0f}".replace("-", "−")
        yield f"{title}: {more} ({spread} % of {after.falls.of} starts, 95 % interval)."


def difference(before: Falls, after: Falls) -> tuple[float, float]:
    """95 % interval of the share that falls after, less that before [-], as if of independent starts."""
    # Source: Newcombe 1998, Statistics in Medicine 17, 873, method 10.
    (low, high), (lower, higher) = after.interval, before.interval
    now, then = after.count / after.of, before.count / before.of
    apart = now - then
    return apart - math.hypot(now - low, higher - then), apart + math.hypot(high - now, then - lower)


def _compared(response: Response, words: Callable[[Case, Case], str]) -> Iterator[str]:
    for title, pair in _pairs(response).items():
        gone = [
            f"“{CASES[case.name]}” {walk_in_words(case)}{'' if case.numbers['fell'] else ', too few strides'}"
            for case in pair
            if case.numbers["fell"] or not math.isfinite(case.numbers["cost_of_transport"])
        ]
        yield f"{title}: {'not comparable; ' + '; '.join(gone) if gone else words(*pair)}."


def _of_changes(response: Response) -> Iterator[str]:
    def words(before: Case, after: Case) -> str:
        rows = [(name, ROWS[name]) for name in _CHANGED]
        told = [f"{row.label} {row.of(n, before)} → {row.of(n, after)} {row.unit}" for n, row in rows]
        return f"on the device's leg {', '.join(told)}".replace(" °", "°")

    yield from _compared(response, words)
    torque = ROWS["device_torque_swing"].of("device_torque_swing", [*response.cases.values()][-1])
    if torque != NONE:
        yield f"In swing the device applies {torque} N·m to the ankle (dorsiflexion positive)."


def _of_cost(response: Response) -> Iterator[str]:
    def words(before: Case, after: Case) -> str:
        name = "cost_of_transport"
        row, change = ROWS[name], after.numbers[name] / before.numbers[name] - 1.0
        more = f"{abs(change):.0%} {'more' if change > 0.0 else 'less'}"
        speeds = f"at {ROWS['speed'].of('speed', before)} and {ROWS['speed'].of('speed', after)} m/s"
        values = f"{row.of(name, before)} → {row.of(name, after)} {row.unit}, {speeds}"
        if abs(change) < LEAST:
            return f"not distinguishable ({values})"
        open_ends = [case for case in (before, after) if "adapted" in case.name and not _converged(case)]
        claimed = "; a longer search may find less" if open_ends else ""
        return f"{more} ({values}{claimed})"

    healthy = response["healthy"].numbers
    if math.isfinite(own := healthy["cost_of_transport"]):
        known = measured_cost(healthy["speed"])
        beside = f"where people need {known:.1f} at that speed (Looney et al. 2019)"
        yield f"The healthy walker needs {own:.1f} J/(kg·m) {beside}: {own / known:.1f} times as much."
    yield from _compared(response, words)
    air = ROWS["air_per_stride"].of("air_per_stride", [*response.cases.values()][-1])
    if air != NONE:
        yield f"The device uses {air} g of air per stride."
