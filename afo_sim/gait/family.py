"""Walkers of one family, mean curves at several speeds, and those between them."""

import dataclasses
import functools
import os
import pathlib
from collections.abc import Sequence

import numpy as np

from afo_sim.common import FloatOrArray, InputError, read_header
from afo_sim.gait.checks import COP_FORCE
from afo_sim.gait.cycle import GaitCycle
from afo_sim.gait.file import read

_FAMILY = "family"  # header key that the members have alike
_SAME_SPEED = 1e-9  # relative difference that is none
_BLENDED = ("shank_angle", "knee_angle", "ankle_angle", "ankle_z", "grf_x", "grf_z", "ankle_moment")
_NUMBERS = ("body_mass", "ankle_height", "body_height", "sole_thickness")
# Name, time of change [ns] and size of each CSV: what shows that a folder's gait files have changed.
_Stamp = tuple[tuple[str, int, int], ...]


def at_speed(file: pathlib.Path, speed: float, taller: float = 1.0) -> GaitCycle:
    """The walker of a family at a speed, linear between the two members beside it."""
    members = family_of(file)
    quicker = float(np.sqrt(taller))
    speeds, asked = np.array([cycle.walking_speed for _, cycle in members]), speed
    speed = asked / quicker
    same = np.flatnonzero(np.abs(speeds - speed) <= _SAME_SPEED * speeds)
    if len(same):
        return members[int(same[0])][1]
    if not speeds[0] < speed < speeds[-1]:
        problem, value = "its family does not walk at that speed", f"{asked:g} m/s"
        allowed = f"{quicker * speeds[0]:.4g} to {quicker * speeds[-1]:.4g} m/s"
        allowed += " for a person of this height" if taller != 1.0 else ""
        raise InputError(problem, file=file, field="gait.speed", value=value, allowed=allowed)
    above = int(np.searchsorted(speeds, speed))
    beside = members[above - 1 : above + 1]
    slow, fast = (cycle for _, cycle in beside)
    share = (speed - slow.walking_speed) / (fast.walking_speed - slow.walking_speed)
    ends = (f"{name} ({cycle.walking_speed:.3g} m/s)" for name, cycle in beside)
    between = f"between {' and '.join(ends)}"
    return _blended(slow, fast, share, speed, between)


def family_of(file: pathlib.Path) -> tuple[tuple[str, GaitCycle], ...]:
    """Name and stride of each member of a file's family, by rising speed."""
    folder = pathlib.Path(file).resolve().parent
    with os.scandir(folder) as entries:
        files = [(e.name, e.stat()) for e in entries if e.name.endswith(".csv") and e.is_file()]
    stamp = tuple(sorted((name, stat.st_mtime_ns, stat.st_size) for name, stat in files))
    family = _families(folder, stamp).get(pathlib.Path(file).name)
    if family is None and pathlib.Path(file).suffix != ".csv":
        family = read_header(pathlib.Path(file)).get(_FAMILY)
    if not family:
        known = sorted(name for name, other in _families(folder, stamp).items() if other)
        problem = "is of no family, so that it has no other speed"
        allowed = "a stride with a line '# family: …'" + (f", such as {', '.join(known)}" if known else "")
        raise InputError(problem, file=file, field=_FAMILY, allowed=allowed)
    return _members(folder, family, stamp)


@functools.lru_cache(maxsize=8)
def _families(folder: pathlib.Path, stamp: _Stamp) -> dict[str, str | None]:
    """The family of each CSV of a folder; None of what has none, or cannot be read."""
    found: dict[str, str | None] = {}
    for name, _, _ in stamp:
        try:
            found[name] = read_header(folder / name).get(_FAMILY)
        except InputError:
            found[name] = None  # another's file, of any kind
    return found


@functools.lru_cache(maxsize=8)
def _members(folder: pathlib.Path, family: str, stamp: _Stamp) -> tuple[tuple[str, GaitCycle], ...]:
    names = [name for name, other in _families(folder, stamp).items() if other == family]
    cycles = {pathlib.Path(name).stem: read(folder / name) for name in names}
    members = sorted(cycles.items(), key=lambda member: member[1].walking_speed)
    first_name, first = members[0]
    for name, cycle in members[1:]:
        if not np.array_equal(cycle.phase, first.phase):
            problem = f"has other rows than {first_name} of its family"
            raise InputError(problem, file=folder / f"{name}.csv", field="phase")
    return tuple(members)


def _blended(slow: GaitCycle, fast: GaitCycle, share: float, speed: float, between: str) -> GaitCycle:
    """The stride at a share of the way from the slow one to the fast one."""

    def mix(of_slow: FloatOrArray, of_fast: FloatOrArray) -> FloatOrArray:
        """A column or a number; None where it is not known of both."""
        known = of_slow is not None and of_fast is not None
        return (1.0 - share) * of_slow + share * of_fast if known else None

    mixed = {name: mix(getattr(slow, name), getattr(fast, name)) for name in (*_BLENDED, *_NUMBERS)}
    forward = mix(slow.ankle_x - slow.ankle_x[0], fast.ankle_x - fast.ankle_x[0])
    notes = {key: text for key, text in slow.notes.items() if fast.notes.get(key) == text}
    notes |= {"description": f"{slow.notes.get(_FAMILY, '')} {between}", "between": between}
    return dataclasses.replace(
        slow,
        source="; ".join(dict.fromkeys((slow.source, fast.source))),
        licence="; ".join(dict.fromkeys((slow.licence, fast.licence))),
        stride_time=float(forward[-1]) / speed,
        walking_speed=speed,
        ankle_x=forward,
        cop_x=_place((slow, fast), (1.0 - share, share), mixed["grf_z"]),
        walker=slow.walker if slow.walker == fast.walker else None,
        notes=notes,
        **mixed,
    )


def _place(cycles: Sequence[GaitCycle], weights: Sequence[float], force: np.ndarray) -> np.ndarray:
    """Centre of pressure that has the moments of both; NaN where hardly anything presses (n,)."""
    moment, total = np.zeros_like(force), np.zeros_like(force)
    for cycle, weight in zip(cycles, weights, strict=True):
        _, upward, place = cycle.ground(cycle.phase)
        moment += weight * upward * place
        total += weight * upward
    known = np.any([np.isfinite(cycle.cop_x) for cycle in cycles], axis=0) & (force > COP_FORCE)
    return np.where(known, moment / np.where(known, total, 1.0), np.nan)
