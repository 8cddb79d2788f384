"""The unit of length of marker coordinates, by the size of who wears them."""

import numpy as np

PERSON = (0.5, 2.5)  # largest extent of a person's markers [m]; assumed: a leg alone to arms stretched up
BELIEVED = (0.3, 8.0)  # extent for which a stated unit is not doubted [m]; markers on the floor may be far
FEW = 8  # markers up to which a small cloud may be no more than a foot
SMALLEST = 0.05  # extent of any few markers [m]
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
_NAMES = {
    "metre": "m", "metres": "m", "meter": "m", "meters": "m", "millimeter": "mm", "millimeters": "mm",
    "millimetre": "mm", "millimetres": "mm", "centimeter": "cm", "centimeters": "cm", "centimetre": "cm",
    "centimetres": "cm", "inch": "in", "inches": "in", "feet": "ft", "foot": "ft",
}  # fmt: skip


def length_name(text: str) -> str:
    """A unit of length as `parse_quantity` knows it: "Millimeters" is mm, "(m)" is m."""
    plain = text.strip().strip("[]().,").strip().lower()
    return _NAMES.get(plain, plain)


def extent(points: np.ndarray) -> float:
    """The largest extent of a cloud of points along an axis, in a middle frame; NaN if nothing is seen.

    Units: points (n, markers, 3).
    """
    seen = np.isfinite(points).all(axis=2)
    frames = np.flatnonzero(seen.sum(axis=1) >= 2)
    if not len(frames):
        return float("nan")
    frames = frames[:: max(1, len(frames) // 200)]
    some = points[frames]
    span = np.nanmax(some, axis=1) - np.nanmin(some, axis=1)
    return float(np.median(span.max(axis=1)))


def metres(points: np.ndarray, stated: float | None, unit: str) -> tuple[float | None, list[str]]:
    """Metres in the coordinates' unit, and warnings; the stated one unless nobody is of that size.

    Units: points (n, markers, 3).
    """
    size = extent(points)
    fits = [(name, factor) for name, factor in UNITS.items() if PERSON[0] <= size * factor <= PERSON[1]]
    if stated is not None:
        lowest = SMALLEST if points.shape[1] <= FEW else BELIEVED[0]
        if not np.isfinite(size) or size == 0.0 or lowest <= size * stated <= BELIEVED[1]:
            return stated, []
        seen = f"its markers span {size * stated:.3g} m if they are in {unit} as stated"
        if len(fits) != 1:
            return stated, [f"{seen}: nobody is of that size, nor in another unit"]
        name, factor = fits[0]
        return factor, [f"{seen}; they were read as {name}, which makes {size * factor:.2f} m"]
    if len(fits) != 1:
        return None, []
    name, factor = fits[0]
    return factor, [f"its unit of length is not stated; read as {name}, a person of {size * factor:.2f} m"]
