"""Units of length and angle: as the file states, unless no person has that size or bends a knee that far."""

import pathlib
from collections.abc import Sequence

import numpy as np

from afo_sim.common import InputError, Keywords, Notice, parse_quantity
from afo_sim.gait_lab.readers.opensim_table import OpenSimTable

_PERSON = (0.5, 2.5)  # largest extent of a person's markers [m]; assumed: a leg alone to arms stretched up
_BELIEVED = (0.3, 8.0)  # extent for which a stated unit is not doubted [m]; markers on the floor may be far
_FEW = 8  # markers up to which a small cloud may be no more than a foot
_SMALLEST = 0.05  # extent of any few markers [m]
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
_NAMES = {
    "metre": "m", "metres": "m", "meter": "m", "meters": "m", "millimeter": "mm", "millimeters": "mm",
    "millimetre": "mm", "millimetres": "mm", "centimeter": "cm", "centimeters": "cm", "centimetre": "cm",
    "centimetres": "cm", "inch": "in", "inches": "in", "feet": "ft", "foot": "ft",
}  # fmt: skip

# A walking knee's range is some 60 deg, 1.05 rad (norm of 42 adults, Fukuchi 2018); the limits are derived.
_HALF_TURN = 3.2  # angle that no knee reaches in radians, a little over π
_LEAST_RANGE = 0.35  # of a knee that walks, stiff or not [rad], 20 deg; 0.35 deg is a knee that is locked


def length_name(text: str) -> str:
    """A unit of length as `parse_quantity` knows it: "Millimeters" is mm, "(m)" is m."""
    plain = text.strip().strip("[]().,").strip().lower()
    return _NAMES.get(plain, plain)


def unit_within(size: float, limits: tuple[float, float]) -> tuple[str, float]:
    """The only unit of length that puts a size within limits [m], with its metres; "" if there is none."""
    fits = [(unit, factor) for unit, factor in UNITS.items() if limits[0] <= size * factor <= limits[1]]
    return fits[0] if len(fits) == 1 else ("", 0.0)


def _extent(points: np.ndarray) -> float:
    """The largest extent of a cloud of points along an axis, in a middle frame; NaN if nothing is seen."""
    frames = np.flatnonzero(np.isfinite(points).all(axis=2).sum(axis=1) >= 2)
    if not len(frames):
        return float("nan")
    frames = frames[:: max(1, len(frames) // 200)]
    some = points[frames]
    span = np.nanmax(some, axis=1) - np.nanmin(some, axis=1)
    return float(np.median(span.max(axis=1)))


def metres(points: np.ndarray, stated: float | None, unit: str) -> tuple[float | None, list[Notice]]:
    """Metres in the coordinates' unit, and warnings; the stated one unless nobody is of that size."""
    size = _extent(points)
    name, factor = unit_within(size, _PERSON)
    if stated is not None:
        lowest = _SMALLEST if points.shape[1] <= _FEW else _BELIEVED[0]
        if not np.isfinite(size) or size == 0.0 or lowest <= size * stated <= _BELIEVED[1]:
            return stated, []
        seen = "its markers span {stated_size:.3g} m if they are in {stated} as stated"
        if not name:
            text = f"{seen}: nobody is of that size, nor in another unit"
            return stated, [Notice("length-unit-impossible", text, stated_size=size * stated, stated=unit)]
        text = f"{seen}; they were read as {{unit}}, which makes {{size:.2f}} m"
        data: Keywords = {"stated_size": size * stated, "size": size * factor}
        return factor, [Notice("length-unit-doubted", text, stated=unit, unit=name, **data)]
    if not name:
        return None, []
    text = "its unit of length is not stated; read as {unit}, a person of {size:.2f} m"
    return factor, [Notice("length-unit-guessed", text, unit=name, size=size * factor)]


def metres_of(path: pathlib.Path, field: str, unit: str, points: np.ndarray) -> tuple[float, list[Notice]]:
    """As `metres` of a unit as a file's field has it; InputError where it is no length, or unknown."""
    try:
        stated = parse_quantity(f"1 {unit}", "m") if unit else None
    except ValueError:
        problem = "is not a valid length"
        raise InputError(problem, file=path, field=field, value=unit, allowed="m, mm, cm") from None
    factor, notices = metres(points, stated, unit)
    if factor is None:
        raise InputError("is not stated", file=path, field=field, allowed="m, mm, cm")
    return factor, notices


def angle_unit(
    table: OpenSimTable, knee_columns: Sequence[str], stated: bool | None
) -> tuple[bool, tuple[Notice, ...]]:
    """Whether the table's rotations are in degrees, regardless of its header."""
    name, size, span = _knee(table, knee_columns)
    looks: bool | None = None
    if size > _HALF_TURN:
        looks = True
    elif span >= _LEAST_RANGE:
        looks = False
    says = table.degrees if stated is None else stated
    if stated is not None:
        if looks is True and not stated:
            problem = f"the knee reaches {size:.4g}, which cannot be radians"
            raise InputError(problem, file=table.file, field=name, allowed="`angles=deg`")
        if looks is not False or not stated:
            return stated, ()
        text = "{subject} has a range of {span:.3g} only: were its angles in radians, the knee would bend by "
        text += "{bend:.0f} deg"
        doubt = Notice("angle-unit-doubted", text, subject=name, span=span, bend=float(np.degrees(span)))
        return stated, (doubt,)
    if looks is None:
        if says is not None:
            return says, ()
        problem = "does not say whether its angles are in degrees, and its knee does not show it"
        value, allowed = f"a range of {span:.3g}", "`angles=deg` or `angles=rad`"
        raise InputError(problem, file=table.file, field=name, value=value, allowed=allowed)
    if looks is says:
        return looks, ()
    word = "degrees" if looks else "radians"
    header = "does not say the unit" if says is None else f"says {'degrees' if says else 'radians'}"
    text = "{file}: {subject} has a range of {span:.3g}, so its angles are in {unit} (a knee that bends by "
    text += "{bend:.0f} deg); its header {header}"
    bend = float(span if looks else np.degrees(span))
    data: Keywords = {"file": table.file.name, "span": span, "unit": word, "bend": bend}
    return looks, (Notice("angle-unit-read", text, subject=name, **data, header=header),)


def _knee(table: OpenSimTable, names: Sequence[str]) -> tuple[str, float, float]:
    """The knee that moves most: its name, largest amount and range, in the file's unit."""
    found = ("", 0.0, 0.0)
    for name in names:
        values = table.columns.get(name, np.empty(0))
        known = values[np.isfinite(values)]
        if len(known) and (span := float(np.ptp(known))) >= found[2]:
            found = (name, float(np.abs(known).max()), span)
    return found
