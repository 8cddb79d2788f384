"""The figure of a sizing: each limit's margin over the candidates' size, what keeps it shaded."""

import pathlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from afo_sim.metrics import UNITS
from afo_sim.show.style import BLUE, GREEN, GREY, RED, plain, write_figure
from afo_sim.study import Requirement, Sizing, Tried

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
