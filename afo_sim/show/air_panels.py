"""Panels of the air before and behind the chambers: volumes, flow of the supply, the source."""

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from afo_sim.show.run_view import SET_PRESSURE, Over, RunView
from afo_sim.show.style import BLUE, COLOURS, GREY, LINE_STYLES, ORANGE, plain
from afo_sim.show.unknown_band import mean_and_spread

THIN = 0.75  # of the lines of volumes beside chambers
VALVE_END = (0, (4, 1.5))  # of the line of a tube's other end, in its chamber's colour
FLOWS = {  # of an orthosis' air: name, colour, style
    "supply/mass_flow": ("from the supply", BLUE, "-"),
    "exhaust/mass_flow": ("to the ambient air", ORANGE, (0, (3, 1))),
}
ALIKE = 1e-3  # of the set pressure: a supply that stays this near to it is drawn once
PER_MINUTE = 6e4  # l/min in a m³/s
ICE = 273.15  # [K]
QUANTITIES = ("pressure", "mass", "temperature")  # of a source


def volumes(axis: Any, run: RunView, over: Over) -> None:
    """Pressure in each volume of a run's air path, in thin lines."""
    free = COLOURS[len(run.colours) :] or COLOURS
    looks = itertools.cycle(zip(free, itertools.cycle(LINE_STYLES[1:]), strict=False))
    for name, label in run.volumes.items():
        chamber = next((each for each in run.chambers if label.startswith(f"{each}, ")), None)
        colour, style = (run.colours[chamber], VALVE_END) if chamber else next(looks)
        x, values = run.curves(f"volume/{name}/pressure", over)
        look = {"color": colour, "ls": style, "lw": THIN, "label": plain(label), "zorder": 4}
        axis.plot(x, 1e-5 * values.mean(axis=0), **look)


def set_pressure(axis: Any, run: RunView, over: Over) -> None:
    """The pressure that a run's supply is set to, where the supply does not hold it."""
    if SET_PRESSURE not in run.recording.columns:
        return
    wanted, had = (run.recording[name] for name in (SET_PRESSURE, "supply/pressure"))
    if np.abs(wanted - had).max(initial=0.0) > ALIKE * np.abs(wanted).max(initial=0.0):
        x, values = run.curves(SET_PRESSURE, over)
        axis.plot(x, 1e-5 * values.mean(axis=0), color=GREY, lw=THIN, ls=":", label="supply, set")


def has_flow(run: RunView) -> bool:
    """Whether a run has an air path, and tells the flow into it and out of it."""
    return run.has_network and tells_flow(run)


def tells_flow(run: RunView) -> bool:
    """Whether a run tells the flow from its supply or to the ambient air."""
    return any(name in run.recording.columns for name in FLOWS)


def air_flow(axis: Any, runs: Sequence[RunView], over: Over = "time") -> None:
    """Flow from the supply and to the ambient air, as free air (ANR)."""
    run = runs[0]
    litres = PER_MINUTE / run.gas.free_density
    for name, (label, colour, style) in FLOWS.items():
        if name in run.recording.columns:
            x, values = run.curves(name, over)
            mean_and_spread(axis, litres * values, colour, label, x, style)
    axis.set_ylim(bottom=min(0.0, axis.get_ylim()[0]))
    axis.set_ylabel("air flow\n[l/min ANR]")


def source(axis: Any, run: RunView, quantity: str) -> None:
    """Pressure, mass or temperature of what is in a run's bottle, cartridge or tank, over time."""
    time, values = run.curves(f"{run.source}/{quantity}", "time")
    scaled, label = {
        "pressure": (1e-5 * values, "gauge pressure\n[bar]"),
        "mass": (1e3 * values, "content\n[g]"),
        "temperature": (values - ICE, "temperature\n[°C]"),
    }[quantity]
    mean_and_spread(axis, scaled, run.colour, run.name, time, run.style)
    axis.ticklabel_format(axis="y", useOffset=False)
    axis.set_ylabel(label)
