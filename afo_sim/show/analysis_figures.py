"""The figure of a sizing: each limit's margin over the candidates' size, what keeps it shaded."""

import math
import pathlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from afo_sim.metrics import UNITS
from afo_sim.show.style import BLUE, GREEN, GREY, MARKERS, RED, RUN_STYLES, RUNS, plain, write_figure
from afo_sim.study import HALF_POWER, Curve, FrequencyResponse, Requirement, Sizing, Tried

_BODE_SIZE = (6.4, 5.0)  # [inch]
_LONG = 72  # letters of a legend's line
_LEAST, _MOST = -50.0, 10.0  # gain that is shown at most [dB]
_QUARTER = 90.0  # between two lines of the phase's axis [deg]


def draw_bode(found: FrequencyResponse, path: pathlib.Path) -> None:
    """Draw every curve of a frequency response."""
    _draw_curves({_label(curve): curve for curve in found.curves.values()}, path, _bode_title(found))


def _draw_curves(curves: Mapping[str, Curve], path: pathlib.Path, title: str = "") -> None:
    """Draw curves of one or several frequency responses over each other."""

    def fill(figure: Any) -> None:
        bode_panels(figure, curves)
        if title:
            figure.suptitle(plain(title, 95), x=0.01, ha="left", fontsize=9.0)

    write_figure(path, _BODE_SIZE, fill)


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
        gain.semilogx(curve.frequency, curve.decibel, label=plain(name, _LONG), **look)
        phase.semilogx(curve.frequency, np.degrees(curve.phase), **look)
    _axes(gain, phase, list(curves.values()))
    gain.legend(loc="lower left")


def _axes(gain: Any, phase: Any, curves: list[Curve]) -> None:
    lowest = min(float(curve.decibel.min()) for curve in curves)
    gain.set_ylim(max(lowest - 3.0, _LEAST), min(max(float(c.decibel.max()) for c in curves) + 3.0, _MOST))
    gain.axhline(HALF_POWER, color=GREY, lw=0.7)
    gain.annotate("−3 dB", (1.0, HALF_POWER), xycoords=("axes fraction", "data"), ha="right", va="bottom",
                  color=GREY, fontsize=8.0)  # fmt: skip
    over = "over 1" if all(curve.is_ratio for curve in curves) else "over 1, or over the first"
    gain.set_ylabel(f"gain [dB]\n{over}")
    phase.axhline(-90.0, color=GREY, lw=0.7)
    low = min(float(np.degrees(curve.phase).min()) for curve in curves)
    high = max(float(np.degrees(curve.phase).max()) for curve in curves)
    first, last = math.floor(low / _QUARTER) * _QUARTER, max(math.ceil(high / _QUARTER) * _QUARTER, 0.0)
    phase.set_ylim(first, last)
    phase.set_yticks(np.arange(first, last + 1.0, _QUARTER))
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


def _bode_title(found: FrequencyResponse) -> str:
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


_WIDTH, _HEAD, _PANEL = 6.4, 1.3, 1.6  # [inch]
_DECADES = 30.0  # ratio of largest to smallest size from which on the axis is logarithmic
_MOST_NAMES = 40  # candidates that are named
_NAME = 16  # letters of a name
_APART = 0.021  # of two names, as a share of the axis' width
_EDGE = 0.05  # of the axis, beside the first and last candidate [-]


def draw_size(found: Sizing, path: pathlib.Path) -> None:
    """Draw the margins of all candidates that were run."""

    def fill(figure: Any) -> None:
        _size_panels(figure, found)
        figure.suptitle(plain(_title(found), 95), x=0.01, ha="left", fontsize=9.0)

    write_figure(path, (_WIDTH, _HEAD + _PANEL * max(len(found.requirements), 1)), fill)


def _size_panels(figure: Any, found: Sizing) -> None:
    """A panel for each limit, over one axis of sizes; in an empty Matplotlib figure or a part of one."""
    panels = list(np.atleast_1d(figure.subplots(max(len(found.requirements), 1), 1, sharex=True)))
    ran = [each for each in found.tried if each.status == "run"]
    places = _places(found, ran)
    for axis, requirement in zip(panels, found.requirements, strict=False):
        _panel(axis, requirement, ran, places, found)
    _across(panels[-1], found, places)
    panels[-1].legend(loc="best")
    if found.kind != "pressure":
        _names(panels[0], ran, places)


def _title(found: Sizing) -> str:
    kind = {"supply": "source", "muscle": "set of muscles"}.get(found.kind, found.kind)
    if found.best is None:
        return f"{found.scenario}: no {kind} that was tried meets all limits"
    if found.kind == "supply" and any(e.meets and not np.isfinite(e.candidate.size) for e in found.tried):
        kind = "source of known mass" if np.isfinite(found.best.candidate.size) else "source of unknown mass"
    if found.kind == "muscle":
        kind = "set, none measured," if found.best.candidate.doubt else "measured set"
    least = "least" if found.kind == "pressure" else "smallest"
    return f"{found.scenario}: {found.best.name} is the {least} {kind} that meets all limits"


def _places(found: Sizing, ran: Sequence[Tried]) -> np.ndarray:
    """Where candidates stand on the axis; side by side where some have no size (n,)."""
    sizes = np.array([found.axis[2] * each.candidate.size for each in ran])
    return sizes if np.isfinite(sizes).all() else np.arange(1.0, len(ran) + 1.0)


def _logarithmic(found: Sizing, places: np.ndarray) -> bool:
    wide = len(places) > 1 and places.min() > 0.0 and places.max() / places.min() > _DECADES
    return (
        wide and found.kind != "pressure" and bool(np.isfinite([e.candidate.size for e in found.tried]).all())
    )


def _across(axis: Any, found: Sizing, places: np.ndarray) -> None:
    """The axis of sizes, which all panels share."""
    label, unit, _ = found.axis
    sized = np.isfinite([each.candidate.size for each in found.tried if each.status == "run"]).all()
    axis.set_xlabel(
        f"{label} [{unit}]" if sized and unit else f"in the order of the {label}, then of the volume"
    )
    if not len(places):
        return
    if _logarithmic(found, places):
        axis.set_xscale("log")
        axis.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axis.xaxis.set_minor_formatter(lambda value, _: "")
    elif not sized:
        axis.set_xticks([])
    low, high = (np.log10(p) if _logarithmic(found, places) else p for p in (places.min(), places.max()))
    room = _EDGE * (high - low) or 0.1 * (abs(high) or 1.0)
    ends = (low - room, high + room)
    axis.set_xlim(*(10.0**end for end in ends) if _logarithmic(found, places) else ends)


def _panel(
    axis: Any, requirement: Requirement, ran: Sequence[Tried], places: np.ndarray, found: Sizing
) -> None:
    margins = np.array([each.margin(requirement) for each in ran])
    margins = np.where(np.isfinite(margins), margins, np.nan)
    if found.kind in ("pressure", "valve", "tube"):
        axis.plot(places, margins, color=GREY, lw=0.8, zorder=1)
    for meets, colour, marker, name in (
        (True, GREEN, "o", "meets all limits"),
        (False, RED, "x", "does not"),
    ):
        own = np.array([each.meets == meets for each in ran], bool)
        if own.any():
            axis.plot(places[own], margins[own], marker, color=colour, ms=5.0, label=name, zorder=3)
    if found.best is not None:
        at = places[[each.name for each in ran].index(found.best.name)]
        axis.axvline(at, color=BLUE, lw=1.0, zorder=2, label=f"choice: {plain(found.best.name)}")
    known = margins[np.isfinite(margins)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (-1.0, 1.0)
    room = 0.08 * (max(high, 0.0) - min(low, 0.0) or 1.0)
    bottom, top = min(low, 0.0) - room, max(high, 0.0) + room
    axis.axhspan(0.0, top, color=GREEN, alpha=0.10, lw=0.0, zorder=0)
    axis.axhline(0.0, color=GREY, lw=0.7, zorder=1)
    axis.set_ylim(bottom, top)
    unit = UNITS.get(requirement.unit, requirement.unit)
    axis.set_ylabel(f"margin [{unit}]" if unit else "margin")
    first = axis.get_subplotspec().is_first_row() and found.kind != "pressure"
    longest = max((len(plain(each.name, _NAME)) for each in ran), default=0)
    axis.set_title(
        plain(f"{requirement.label} {requirement.wanted}", 70),
        loc="left",
        pad=16.0 + 3.9 * longest if first else 4.0,
    )


def _names(axis: Any, ran: Sequence[Tried], places: np.ndarray) -> None:
    """Names of the candidates above the first panel, moved apart, each with a line to its place."""
    if not 0 < len(ran) <= _MOST_NAMES:
        return
    shares = [axis.transAxes.inverted().transform(axis.transData.transform((at, 0.0)))[0] for at in places]
    order = np.argsort(shares, kind="stable")
    moved = np.array(shares, float)[order]
    for k in range(1, len(moved)):
        moved[k] = max(moved[k], moved[k - 1] + _APART)
    moved -= max(moved[-1] - 1.0, 0.0) if len(moved) else 0.0
    for k in range(len(moved) - 2, -1, -1):  # those before make room for what was moved back
        moved[k] = min(
            moved[k], shares[order[k]] if moved[k] < shares[order[k]] else moved[k], moved[k + 1] - _APART
        )
    for k, share in zip(order, moved, strict=True):
        axis.annotate(plain(ran[k].name, _NAME), (places[k], 1.0), xycoords=("data", "axes fraction"),
                      xytext=(share, 1.07), textcoords="axes fraction", rotation=90, ha="center", va="bottom",
                      fontsize=6.5, color=GREY, arrowprops={"arrowstyle": "-", "color": GREY, "lw": 0.4,
                      "shrinkA": 0.0, "shrinkB": 0.0})  # fmt: skip
