"""The figure of a wearer at several values of one key: the ankle in swing, and falls."""

import pathlib
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from afo_sim.show.style import new_figure
from afo_sim.show.walker_figure import look_of
from afo_sim.walker import CASES, LEGS, Response


def draw_doses(key: str, values: Sequence[Any], responses: Sequence[Response], path: pathlib.Path) -> None:
    """Draw the ankle in mid-swing and the falls of each case over a key's values, with 95 % intervals."""
    places, unit = axis_of(values)
    with new_figure(path, (6.4, 6.4)) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True, subplot_kw={"xmargin": 0.05})
        for k, name in enumerate(dict.fromkeys(case for found in responses for case in found.cases)):
            at = np.array([x for x, found in zip(places, responses, strict=True) if name in found.cases])
            cases = [found[name] for found in responses if name in found.cases]
            look = look_of(cases[0]) | {"marker": "o", "ms": 4.0}
            upper.plot(at, [case.numbers["right/ankle_swing"] for case in cases], label=CASES[name], **look)
            if falls := [case.falls for case in cases if case.falls is not None]:  # of all, or of none
                shares = 100.0 * np.array([each.count / each.of for each in falls])
                off = np.abs(100.0 * np.array([each.interval for each in falls]).T - shares)
                at += 0.008 * np.ptp(places) * (k - 2)  # so that intervals stand apart
                lower.errorbar(at, shares, off, capsize=2.0, elinewidth=0.9, **look)
        upper.set_title("a gap: a walk that ends before there are strides to count", loc="left")
        upper.set(ylabel=f"ankle in mid-swing [°]\ndorsiflexion +, the {LEGS['right']}")
        lower.set(ylabel="perturbed starts that fall\nin simulation [%], 95 % interval", ylim=(-3.0, 103.0))
        lower.set_xlabel(f"{key} [{unit}]" if unit else key)
        if unit is None:
            lower.set_xticks(places, [str(value) for value in values])
        figure.legend(*upper.get_legend_handles_labels(), loc="outside upper left", ncols=2)


def axis_of(values: Sequence[Any]) -> tuple[list[float], str | None]:
    """Numbers and their common unit, as written; places in order and None where they have none."""
    found = [
        re.fullmatch(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*)", str(value)) for value in values
    ]
    units = {match[2] if match else None for match in found}
    if len(units) > 1 or None in units:
        return [float(k) for k in range(len(values))], None
    return [float(match[1]) for match in found if match], units.pop()
