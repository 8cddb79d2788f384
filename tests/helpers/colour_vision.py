"""Colours as people see them: contrast, distance, and vision without red, green or blue cones."""

import itertools
from collections.abc import Iterable

import numpy as np

# Machado, Oliveira, Fernandes 2009, severity 1.0, on linear RGB.
DEUTERANOPIA = [
    [0.367322, 0.860646, -0.227968],
    [0.280085, 0.672501, 0.047413],
    [-0.011820, 0.042940, 0.968881],
]
PROTANOPIA = [
    [0.152286, 1.052583, -0.204868],
    [0.114503, 0.786281, 0.099216],
    [-0.003882, -0.048116, 1.051998],
]
TRITANOPIA = [
    [1.255528, -0.076749, -0.178779],
    [-0.078411, 0.930809, 0.147602],
    [0.004733, 0.691367, 0.303900],
]
VISIONS = {"all cones": np.eye(3), "no green": np.array(DEUTERANOPIA), "no red": np.array(PROTANOPIA)}
VISIONS |= {"no blue": np.array(TRITANOPIA)}
# IEC 61966-2-1, linear RGB to XYZ, over the white point D65.
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
LAB = np.array([[0.0, 116.0, 0.0], [500.0, -500.0, 0.0], [0.0, 200.0, -200.0]])
# Ottosson 2020, OKLab: linear RGB to cones, cube roots of these to lightness and two axes.
CONES = [[0.4122214708, 0.5363325363, 0.0514459929], [0.2119034982, 0.6806995451, 0.1073969566]]
CONES += [[0.0883024619, 0.2817188376, 0.6299787005]]
AXES = [[0.2104542553, 0.7936177850, -0.0040720468], [1.9779984951, -2.4285922050, 0.4505937099]]
AXES += [[0.0259040371, 0.7827717662, -0.8086757660]]


def linear(colour: str | Iterable[int]) -> np.ndarray:
    """Linear RGB of "#rrggbb" or of three numbers to 255."""
    if isinstance(colour, str):
        digits = colour.lstrip("#")
        digits = "".join(2 * digit for digit in digits) if len(digits) == 3 else digits
        colour = bytes.fromhex(digits)
    parts = np.array(list(colour), float) / 255.0
    return np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)


def contrast(one: str | Iterable[int], other: str | Iterable[int] = "#ffffff") -> float:
    """Contrast ratio by WCAG 2.2 [-]."""
    weights = [0.2126, 0.7152, 0.0722]
    low, high = sorted(float(linear(colour) @ weights) + 0.05 for colour in (one, other))
    return high / low


def nearest(colours: Iterable[str | Iterable[int]], vision: str) -> float:
    """Least distance in OKLab of any two colours as a vision sees them."""
    places = [
        np.array(AXES) @ np.cbrt(np.array(CONES) @ np.clip(VISIONS[vision] @ linear(colour), 0.0, 1.0))
        for colour in colours
    ]
    return min(float(np.linalg.norm(a - b)) for a, b in itertools.combinations(places, 2))


def difference(one: str, other: str, vision: str) -> float:
    """CIE 1976 difference in L*a*b* of two colours as a vision sees them [-]."""
    places = []
    for colour in (one, other):
        share = XYZ @ np.clip(VISIONS[vision] @ linear(colour), 0.0, 1.0) / XYZ.sum(axis=1)
        places.append(LAB @ np.where(share > 0.008856, np.cbrt(share), 7.787 * share + 16.0 / 116.0))
    return float(np.linalg.norm(places[0] - places[1]))
