"""Both legs on one supply over one stride: ankle angles, chamber pressures, flow from the source."""

import functools
import pathlib
from typing import TYPE_CHECKING, Any

import numpy as np

from afo_sim.description.attachment import Side
from afo_sim.show.run_view import RunView
from afo_sim.show.style import BLUE, GREY, RED, RUN_STYLES, ZERO, plain, write_figure
from afo_sim.simulation.both_source import litres_a_minute

if TYPE_CHECKING:
    from afo_sim.simulation.both import Both

SIZE = (7.1, 6.2)  # [inch]
COLOUR: dict[Side, str] = {"right": BLUE, "left": RED}
STYLE: dict[Side, Any] = {"right": "-", "left": RUN_STYLES[1]}
UNUSED = 1e-3  # gauge pressure below which a chamber is not drawn [bar]


def draw_both(legs: "Both", path: pathlib.Path) -> None:
    """Draw two legs over one cycle of the right one."""
    write_figure(path, SIZE, functools.partial(_page, legs=legs))


def _page(figure: Any, legs: "Both") -> None:
    top, middle, bottom = figure.subplots(3, 1, sharex=True)
    percent = 100.0 * np.append(legs.phase, 1.0)
    _angles(top, legs, percent)
    _pressures(middle, legs, percent)
    _flow(bottom, legs, percent)
    walks = bool(legs.right.scenario.get("gait"))
    for axis in (top, middle, bottom):
        axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        if walks and legs.apart:
            axis.axvline(100.0 * legs.apart, color=GREY, lw=0.6, ls=":", zorder=0)
    what = "stride of the right leg, from its heel strike" if walks else "timer's period"
    bottom.set_xlabel(f"{what} [%]; 100 % = {legs.cycle:.3g} s")
    bottom.set_xlim(0.0, 100.0)
    figure.align_ylabels((top, middle, bottom))
    title = " and ".join(f"{side}: {plain(str(leg.scenario['name']))}" for side, leg in legs.legs.items())
    apart = f", {100.0 * legs.apart:g} % of a stride apart" if legs.apart else ""
    figure.suptitle(f"both legs on one supply{apart}\n{title}", x=0.01, ha="left", fontsize=9.0)


def _closed(values: np.ndarray) -> np.ndarray:
    """A periodic curve with its first value again at its end."""
    return np.append(values, values[0])


def _angles(axis: Any, legs: "Both", percent: np.ndarray) -> None:
    axis.axhline(0.0, color=ZERO, lw=0.6, zorder=1)
    for side in legs.legs:
        angle = np.degrees(_closed(legs.over_stride(side, "ankle/angle")))
        axis.plot(percent, angle, color=COLOUR[side], ls=STYLE[side], label=side)
    view = RunView("", BLUE, legs.right)
    axis.set_ylabel(f"{view.joint} angle [deg]\n{view.positive} +")


def _pressures(axis: Any, legs: "Both", percent: np.ndarray) -> None:
    # one feeds both; a leg without muscles has no column of it
    fed = next(side for side, leg in legs.legs.items() if "supply/pressure" in leg.columns)
    supply = 1e-5 * _closed(legs.over_stride(fed, "supply/pressure"))
    axis.plot(percent, supply, color=GREY, lw=0.8, label="supply")
    for side, leg in legs.legs.items():
        for number, name in enumerate(RunView("", BLUE, leg).chambers):
            values = 1e-5 * _closed(legs.over_stride(side, f"chamber/{name}/pressure"))
            if values.max() > UNUSED:
                width = 1.3 if number == 0 else 0.8  # a second chamber's line is thinner
                label = f"{side}, {plain(name)}"
                axis.plot(percent, values, color=COLOUR[side], ls=STYLE[side], lw=width, label=label)
    axis.set_ylabel("gauge pressure\n[bar]")
    axis.set_ylim(bottom=min(0.0, axis.get_ylim()[0]))


def _flow(axis: Any, legs: "Both", percent: np.ndarray) -> None:
    litres = litres_a_minute(legs.legs)
    both = litres * _closed(legs.flow["both"])
    axis.fill_between(percent, both, color="0.85", lw=0.0, label="both")
    for side in legs.legs:
        own = litres * _closed(legs.flow[side])
        axis.plot(percent, own, color=COLOUR[side], ls=STYLE[side], label=side)
    mean = legs.numbers["mean_flow_both"].value
    axis.axhline(mean, color="black", lw=0.8, ls="--", label=f"mean of both, {mean:.3g}")
    axis.set_ylabel("flow from the source\n[l/min ANR]")
    axis.set_ylim(bottom=0.0)
