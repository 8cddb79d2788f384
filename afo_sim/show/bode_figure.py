"""Frequency responses as a Bode figure: gain and phase over frequency."""

import math
import pathlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from afo_sim.show.style import GREY, MARKERS, RUN_STYLES, RUNS, plain, write_figure
from afo_sim.study.frequency_curve import HALF_POWER, Curve
from afo_sim.study.frequency_response import FrequencyResponse

SIZE = (6.4, 5.0)  # [inch]
LONG = 72  # letters of a legend's line
LEAST, MOST = -50.0, 10.0  # gain that is shown at most [dB]
QUARTER = 90.0  # between two lines of the phase's axis [deg]


def draw_bode(found: FrequencyResponse, path: pathlib.Path) -> None:
    """Draw every curve of a frequency response.

    Parameters
    ----------
    found : what `bode` gives
    path : file to write; its suffix, png, pdf or svg, is the format
    """
    draw_curves({_label(curve): curve for curve in found.curves.values()}, path, _title(found))


def draw_curves(curves: Mapping[str, Curve], path: pathlib.Path, title: str = "") -> None:
    """Draw curves of one or several frequency responses over each other."""

    def fill(figure: Any) -> None:
        bode_panels(figure, curves)
        if title:
            figure.suptitle(plain(title, 95), x=0.01, ha="left", fontsize=9.0)

    write_figure(path, SIZE, fill)


def bode_panels(figure: Any, curves: Mapping[str, Curve]) -> None:
    """Gain above phase, in a Matplotlib figure or a part of one."""
    gain, phase = figure.subplots(2, 1, sharex=True)
    for k, (name, curve) in enumerate(curves.items()):
        look = {
            "color": RUNS[k % len(RUNS)],
            "ls": RUN_STYLES[k % len(RUN_STYLES)],
            "marker": MARKERS[1 + k % (len(MARKERS) - 1)],
            "ms": 3.0,
        }
        gain.semilogx(curve.frequency, curve.decibel, label=plain(name, LONG), **look)
        phase.semilogx(curve.frequency, np.degrees(curve.phase), **look)
    _axes(gain, phase, list(curves.values()))
    gain.legend(loc="lower left")


def _axes(gain: Any, phase: Any, curves: list[Curve]) -> None:
    lowest = min(float(curve.decibel.min()) for curve in curves)
    gain.set_ylim(max(lowest - 3.0, LEAST), min(max(float(c.decibel.max()) for c in curves) + 3.0, MOST))
    gain.axhline(HALF_POWER, color=GREY, lw=0.7)
    gain.annotate("−3 dB", (1.0, HALF_POWER), xycoords=("axes fraction", "data"), ha="right", va="bottom",
                  color=GREY, fontsize=8.0)  # fmt: skip
    over = "over 1" if all(curve.is_ratio for curve in curves) else "over 1, or over the first"
    gain.set_ylabel(f"gain [dB]\n{over}")
    phase.axhline(-90.0, color=GREY, lw=0.7)
    low = min(float(np.degrees(curve.phase).min()) for curve in curves)
    high = max(float(np.degrees(curve.phase).max()) for curve in curves)
    first, last = math.floor(low / QUARTER) * QUARTER, max(math.ceil(high / QUARTER) * QUARTER, 0.0)
    phase.set_ylim(first, last)
    phase.set_yticks(np.arange(first, last + 1.0, QUARTER))
    phase.set_ylabel("phase [deg]\na lag is negative")
    phase.set_xlabel("frequency [Hz]")
    for axis in (gain, phase):
        axis.grid(True, which="both", color="0.92", lw=0.5)
    from matplotlib.ticker import FixedLocator, NullFormatter

    phase.xaxis.set_major_locator(FixedLocator(_ticks(curves)))
    phase.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    phase.xaxis.set_minor_formatter(NullFormatter())


def _ticks(curves: list[Curve]) -> list[float]:
    """1, 2 and 5 of each decade that is shown [Hz]."""
    low = min(float(curve.frequency[0]) for curve in curves)
    high = max(float(curve.frequency[-1]) for curve in curves)
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    marks = [round(step * 10.0**decade, 9) for decade in decades for step in (1, 2, 5)]
    return [mark for mark in marks if low * 0.999 <= mark <= high * 1.001]


def _label(curve: Curve) -> str:
    if curve.is_ratio:
        return f"{curve.output} over its input"
    return f"{curve.output}; 0 dB = {curve.shown_gain[0]:.3g} {curve.gain_unit}"


def _title(found: FrequencyResponse) -> str:
    name = found.scenario["name"]
    if found.what == "valves":
        return f"{name}: {found.chamber}'s inlet and outlet in turn"
    factor, unit = {"Pa": (1e-5, "bar"), "rad": (180.0 / math.pi, "deg")}.get(
        found.input_unit, (1.0, found.input_unit)
    )
    of = (
        "what the controller is asked for"
        if found.what == "reference"
        else f"{found.chamber}'s asked pressure"
    )
    return f"{name}: {of}, {factor * found.mean:.3g} ± {factor * found.amplitude:.3g} {unit}"
