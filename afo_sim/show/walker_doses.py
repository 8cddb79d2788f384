"""The figure of a wearer at several values of one key: the ankle in swing, and falls."""

import math
import pathlib
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common import JsonMapping
from afo_sim.show.panels import legend
from afo_sim.show.patients_figure import look_of as look_in
from afo_sim.show.style import new_figure
from afo_sim.show.walker_figure import look_of
from afo_sim.walker import CASES, LEGS, NAMES, Population, Response, share_of_falls


@dataclass(frozen=True)
class Dose:
    """A case at one value: the ankle in mid-swing [°] and starts that fall [%], each with its interval."""

    case: str
    look: JsonMapping
    ankle: tuple[float, float, float]
    falls: tuple[float, float, float] | None


def doses_of(found: Response | Population) -> list[Dose]:
    """Each case of one wearer; or over patients: medians, and 5 to 95 % of them."""
    doses = list[Dose]()
    if isinstance(found, Response):
        for case in found.cases.values():
            ankle, falls = case.numbers["right/ankle_swing"], None
            if case.falls is not None:
                low, high = case.falls.interval
                falls = 100.0 * case.falls.count / case.falls.of, 100.0 * low, 100.0 * high
            doses.append(Dose(CASES[case.name], look_of(case), (ankle, ankle, ankle), falls))
        return doses
    for name in found.cases:
        ankles = found.values(name, "right/ankle_swing")
        known = ankles[np.isfinite(ankles)]
        low, middle, high = np.percentile(known, (5.0, 50.0, 95.0)) if len(known) else (math.nan,) * 3
        falls = share_of_falls(found, name) if found.asked["starts"] else None
        doses.append(Dose(NAMES[name], look_in(name), (float(middle), float(low), float(high)), falls))
    return doses


def draw_doses(
    key: str, values: Sequence[object], doses: Sequence[Sequence[Dose]], path: pathlib.Path
) -> None:
    """Draw the ankle in mid-swing and the falls of each case over a key's values, with intervals."""
    places, unit = axis_of(values)
    with new_figure(path, (6.4, 6.4)) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True, subplot_kw={"xmargin": 0.05})
        for k, name in enumerate(dict.fromkeys(dose.case for each in doses for dose in each)):
            found = [
                (x, dose) for x, each in zip(places, doses, strict=True) for dose in each if dose.case == name
            ]
            at = np.array([x for x, _ in found]) + 0.008 * np.ptp(places) * (k - 2)  # intervals stand apart
            look = {"capsize": 2.0, "elinewidth": 0.9, "marker": "o", "ms": 4.0} | dict(found[0][1].look)
            for axis, rows in (
                (upper, [dose.ankle for _, dose in found]),
                (lower, [dose.falls for _, dose in found]),
            ):
                if all(row is not None for row in rows):
                    middle, low, high = np.array(rows, float).T
                    axis.errorbar(at, middle, (middle - low, high - middle), label=name, **look)
        bars = any(dose.ankle[1] < dose.ankle[2] for each in doses for dose in each)
        words = "bars of the ankle: 5 to 95 % of patients; " if bars else ""
        upper.set_title(f"{words}a gap: a walk that ends before there are strides to count", loc="left")
        upper.set(ylabel=f"ankle in mid-swing [°]\ndorsiflexion +, the {LEGS['right']}")
        lower.set(ylabel="perturbed starts that fall\nin simulation [%], 95 % interval", ylim=(-3.0, 103.0))
        lower.set_xlabel(f"{key} [{unit}]" if unit else key)
        if unit is None:
            lower.set_xticks(places, [str(value) for value in values])
        legend(figure, [upper], columns=2)


def axis_of(values: Sequence[object]) -> tuple[list[float], str | None]:
    """Numbers and their common unit, as written; places in order and None where they have none."""
    found = [
        re.fullmatch(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*)", str(value)) for value in values
    ]
    units = {match[2] if match else None for match in found}
    if len(units) > 1 or None in units:
        return [float(k) for k in range(len(values))], None
    return [float(match[1]) for match in found if match], units.pop()
