"""Symbols of an air path's parts, after ISO 1219-1 as far as their lines go from left to right [inch]."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

INK, THIN, WIDE = "0.1", 1.1, 1.9
TRIANGLE = 0.11  # of the ambient air: its width
DROP = 0.09  # from a port to the line that goes down to it
_BALL = 0.045


@dataclass(frozen=True)
class Symbol:
    """Where a symbol reaches from its middle: to its ports on both sides, up, down; and its third port."""

    half: float
    up: float
    down: float
    low: tuple[float, float] = (0.0, 0.0)


class Pen:
    """Draws on an axis whose unit is an inch, around a middle, to the right or mirrored."""

    def __init__(self, axis: Any, x: float, y: float, *, mirrored: bool = False, width: float = THIN) -> None:
        self.axis, self.x, self.y, self.width = axis, x, y, width
        self.sign = -1.0 if mirrored else 1.0

    def line(self, *points: tuple[float, float], **look: Any) -> None:
        """A line through points from the middle."""
        x, y = np.array(points).T
        look = {"color": INK, "lw": self.width, "solid_capstyle": "round", "zorder": 5} | look
        self.axis.plot(self.x + self.sign * x, self.y + y, **look)

    def closed(self, *points: tuple[float, float], face: str = "white", **look: Any) -> None:
        """A polygon."""
        from matplotlib.patches import Polygon

        corners = np.array(points) * (self.sign, 1.0) + (self.x, self.y)
        look = {"facecolor": face, "edgecolor": INK, "lw": self.width, "zorder": 4} | look
        self.axis.add_patch(Polygon(corners, closed=True, **look))

    def box(self, left: float, bottom: float, right: float, top: float, **look: Any) -> None:
        """A rectangle."""
        self.closed((left, bottom), (right, bottom), (right, top), (left, top), **look)

    def circle(self, x: float, y: float, radius: float, face: str = "white") -> None:
        """A circle."""
        from matplotlib.patches import Circle

        place = (self.x + self.sign * x, self.y + y)
        self.axis.add_patch(Circle(place, radius, facecolor=face, edgecolor=INK, lw=self.width, zorder=5))

    def arrow(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """An arrow with its head at the end."""
        self.line(start, end)
        (x0, y0), (x1, y1) = start, end
        along = np.array([x1 - x0, y1 - y0]) / np.hypot(x1 - x0, y1 - y0)
        across = np.array([-along[1], along[0]])
        tip = np.array(end)
        wings = [tuple(tip - 0.07 * along + side * 0.026 * across) for side in (1.0, -1.0)]
        self.closed(end, *wings, face=INK, lw=0.0, zorder=6)

    def zigzag(self, start: tuple[float, float], end: tuple[float, float], swing: float = 0.035) -> None:
        """A spring."""
        a, b = np.array(start), np.array(end)
        along = (b - a) / np.hypot(*(b - a))
        across = np.array([-along[1], along[0]])
        turns = [a + (b - a) * k / 5.0 + across * swing * (-1) ** k * (0 < k < 5) for k in range(6)]
        self.line(*[tuple(point) for point in turns])

    def ambient(self, x: float, y: float, drop: float = 0.07) -> None:
        """The ambient air below a point: a triangle on its tip's end."""
        self.line((x, y), (x, y - drop))
        half = 0.5 * TRIANGLE
        self.closed((x - half, y - drop), (x + half, y - drop), (x, y - drop - 0.1), zorder=6)


def _seat(pen: Pen, y: float, *, spring: bool = False, x: float = 0.0) -> None:
    """A ball on its seat, which flow to the right lifts."""
    pen.line((x + 0.03, y + 0.075), (x - 0.045, y), (x + 0.03, y - 0.075))
    pen.circle(x + 0.018, y, _BALL)
    if spring:
        pen.zigzag((x + 0.018 + _BALL, y), (x + 0.17, y), 0.03)


def _blocked(pen: Pen, x: float, y: float, inwards: float) -> None:
    pen.line((x, y), (x + 0.055 * inwards, y))
    pen.line((x + 0.055 * inwards, y - 0.035), (x + 0.055 * inwards, y + 0.035))


def _actuated(pen: Pen, top: float, bottom: float, proportional: bool) -> None:
    """Coil on top, spring below; the lines beside a proportional valve."""
    pen.box(-0.08, top, 0.08, top + 0.09)
    pen.line((-0.04, top), (0.04, top + 0.09))
    pen.zigzag((0.0, bottom), (0.0, bottom - 0.1))
    if proportional:
        for x in (-0.18, 0.18):
            pen.line((x, bottom + 0.22), (x, top))
        pen.arrow((-0.13, top - 0.0), (0.13, top + 0.1))


def valve(pen: Pen, marks: frozenset[str]) -> None:
    """A 2/2 valve, shut without current."""
    pen.box(-0.15, -0.1, 0.15, 0.1)
    pen.box(-0.15, 0.1, 0.15, 0.3)
    _blocked(pen, -0.15, 0.0, 1.0)
    _blocked(pen, 0.15, 0.0, -1.0)
    pen.arrow((-0.15, 0.2), (0.15, 0.2))
    _actuated(pen, 0.3, -0.1, "proportional" in marks)


def valve_3_2(pen: Pen, marks: frozenset[str]) -> None:
    """A 3/2 valve, which vents without current; its exhaust below its way in."""
    pen.box(-0.15, -0.14, 0.15, 0.08)
    pen.box(-0.15, 0.08, 0.15, 0.3)
    _blocked(pen, -0.15, 0.0, 1.0)
    pen.arrow((0.15, 0.0), (-0.15, -0.09))
    pen.arrow((-0.15, 0.22), (0.15, 0.22))
    _blocked(pen, -0.15, 0.13, 1.0)
    pen.line((-0.15, -0.09), (-0.22, -0.09), (-0.22, -0.15))
    _actuated(pen, 0.3, -0.14, "proportional" in marks)


def tube(pen: Pen, marks: frozenset[str]) -> None:
    """A tube."""
    pen.box(-0.2, -0.04, 0.2, 0.04, face="0.88")
    pen.line((-0.2, -0.06), (-0.2, 0.06))
    pen.line((0.2, -0.06), (0.2, 0.06))


def _restrictor(pen: Pen) -> None:
    angle = np.linspace(-0.8, 0.8, 15)
    for side in (1.0, -1.0):
        bow = [(0.13 * float(np.sin(a)), side * (0.155 - 0.13 * float(np.cos(a)))) for a in angle]
        pen.line(*bow)


def orifice(pen: Pen, marks: frozenset[str]) -> None:
    """A restriction that stays."""
    pen.line((-0.18, 0.0), (0.18, 0.0))
    _restrictor(pen)


def throttle(pen: Pen, marks: frozenset[str]) -> None:
    """A restriction, and a check valve past it."""
    orifice(pen, marks)
    pen.line((-0.18, 0.0), (-0.18, 0.18), (0.18, 0.18), (0.18, 0.0))
    _seat(pen, 0.18, x=-0.03)
    if "spring" in marks:
        pen.zigzag((0.035, 0.18), (0.15, 0.18), 0.03)


def check_valve(pen: Pen, marks: frozenset[str]) -> None:
    """A valve that air opens in one direction."""
    pen.line((-0.18, 0.0), (-0.045, 0.0))
    pen.line((0.17 if "spring" in marks else 0.06, 0.0), (0.18, 0.0))
    _seat(pen, 0.0, spring="spring" in marks)


def quick_exhaust(pen: Pen, marks: frozenset[str]) -> None:
    """A check valve whose muscle vents through its third port."""
    pen.box(-0.18, -0.13, 0.18, 0.11)
    _seat(pen, 0.0, x=-0.06)
    pen.line((-0.18, 0.0), (-0.105, 0.0))
    pen.line((0.0, 0.0), (0.18, 0.0))
    pen.line((0.09, 0.0), (0.09, -0.07))
    pen.line((0.03, -0.07), (0.15, -0.07))
    pen.line((0.09, -0.07), (0.0, -0.16))


def silencer(pen: Pen, marks: frozenset[str]) -> None:
    """A silencer."""
    pen.box(-0.15, -0.08, 0.15, 0.08)
    for x in (-0.06, 0.02, 0.1):
        pen.line((x, -0.08), (x, 0.08))


def leak(pen: Pen, marks: frozenset[str]) -> None:
    """A leak: a line that is not whole."""
    pen.line((-0.16, 0.0), (0.16, 0.0), ls=(0, (1.2, 1.4)), lw=1.3)
    pen.zigzag((-0.05, 0.0), (0.05, 0.0), 0.06)


def regulator(pen: Pen, marks: frozenset[str]) -> None:
    """A pressure regulator, which its outlet shuts against a spring."""
    pen.box(-0.14, -0.13, 0.14, 0.13)
    pen.arrow((-0.14, 0.0), (0.14, 0.0))
    pen.zigzag((0.0, 0.13), (0.0, 0.27))
    pen.arrow((-0.09, 0.14), (0.09, 0.26))
    pen.line((-0.2, 0.0), (-0.14, 0.0))
    pen.line((0.14, 0.0), (0.2, 0.0))
    pen.line((0.2, 0.0), (0.2, -0.18), (0.0, -0.18), (0.0, -0.13), ls=(0, (2, 1.5)), lw=0.7)


def supply(pen: Pen, marks: frozenset[str]) -> None:
    """Compressed air without end."""
    pen.circle(0.0, 0.0, 0.13)
    pen.circle(0.0, 0.0, 0.035, INK)


def compressor(pen: Pen, marks: frozenset[str]) -> None:
    """A compressor."""
    pen.circle(0.0, 0.0, 0.17)
    pen.closed((0.04, 0.08), (0.04, -0.08), (0.165, 0.0), zorder=6)


def _capsule(pen: Pen, half: float, tall: float, face: str = "white") -> None:
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 15)
    straight = half - tall
    right = [(straight + tall * float(np.cos(a)), tall * float(np.sin(a))) for a in angle]
    left = [(-x, -y) for x, y in right]
    pen.closed(*right, *left, face=face)


def bottle(pen: Pen, marks: frozenset[str]) -> None:
    """A bottle of gas."""
    _capsule(pen, 0.2, 0.1)
    pen.box(0.195, -0.035, 0.25, 0.035)


def cartridge(pen: Pen, marks: frozenset[str]) -> None:
    """A cartridge with liquid below its vapour."""
    bottle(pen, marks)
    pen.box(-0.13, -0.099, 0.13, -0.01, face="0.75", lw=0.0)
    pen.line((-0.13, -0.01), (0.13, -0.01), lw=0.6)


def volume(pen: Pen, marks: frozenset[str]) -> None:
    """A rigid volume."""
    _capsule(pen, 0.27, 0.11)


def point(pen: Pen, marks: frozenset[str]) -> None:
    """A small volume between two parts."""
    pen.circle(0.0, 0.0, 0.045)


def chamber(pen: Pen, marks: frozenset[str]) -> None:
    """A braided muscle; `marks` holds its colour."""
    from matplotlib.colors import to_hex, to_rgb

    colour = next((mark for mark in marks if mark.startswith("#")), "#737373")
    pale = to_hex([1.0 - 0.35 * (1.0 - part) for part in to_rgb(colour)])
    x = np.linspace(-0.24, 0.24, 25)
    y = 0.05 + 0.07 * np.cos(np.pi * x / 0.48)
    upper, lower = list(zip(x, y, strict=True)), list(zip(x[::-1], -y[::-1], strict=True))
    pen.closed(*upper, *lower, face=pale, edgecolor=colour, lw=1.3)
    for k in range(5):
        left, right = -0.2 + 0.08 * k, -0.12 + 0.08 * k
        for way in (1.0, -1.0):
            pen.line((left, -0.06 * way), (right, 0.06 * way), color=colour, lw=0.7)
    pen.box(-0.3, -0.05, -0.24, 0.05, face="0.3")
    pen.box(0.24, -0.05, 0.3, 0.05, face="0.3")


_Draw = Callable[[Pen, frozenset[str]], None]
SYMBOLS: dict[str, tuple[_Draw, Symbol]] = {
    "valve": (valve, Symbol(0.15, 0.4, 0.2)),
    "valve_3_2": (valve_3_2, Symbol(0.15, 0.4, 0.25, (-0.22, -0.15))),
    "tube": (tube, Symbol(0.2, 0.07, 0.07)),
    "orifice": (orifice, Symbol(0.18, 0.1, 0.1)),
    "throttle": (throttle, Symbol(0.18, 0.27, 0.1)),
    "check_valve": (check_valve, Symbol(0.18, 0.09, 0.09)),
    "quick_exhaust": (quick_exhaust, Symbol(0.18, 0.12, 0.17, (0.0, -0.16))),
    "silencer": (silencer, Symbol(0.15, 0.09, 0.09)),
    "leak": (leak, Symbol(0.16, 0.08, 0.08)),
    "regulator": (regulator, Symbol(0.2, 0.29, 0.19)),
    "supply": (supply, Symbol(0.13, 0.14, 0.14)),
    "compressor": (compressor, Symbol(0.17, 0.18, 0.18)),
    "bottle": (bottle, Symbol(0.25, 0.11, 0.11)),
    "cartridge": (cartridge, Symbol(0.25, 0.11, 0.11)),
    "volume": (volume, Symbol(0.27, 0.12, 0.12)),
    "point": (point, Symbol(0.045, 0.06, 0.06)),
    "chamber": (chamber, Symbol(0.3, 0.14, 0.14)),
}
