"""How far an import is from the known walker, in the units of the promise: degrees, per cent, millimetres."""

from typing import Any

import numpy as np
from gait_lab.laboratory import Laboratory

from afo_sim.common import GRAVITY

# What an import keeps: 0.5° and 2 %, 5 mm for places.
BOUNDS = {
    "shank [deg]": 0.5,
    "knee [deg]": 0.5,
    "ankle [deg]": 0.5,
    "force [%]": 2.0,
    "moment peak [%]": 2.0,
    "stride time [%]": 2.0,
    "speed [%]": 2.0,
    "ankle travel [%]": 2.0,
    "centre of pressure [mm]": 5.0,
    "ankle height [mm]": 5.0,
}
# One malleolus alone: the centre lies ahead of it and above by a mean over persons. Over four strides of one
# person it varies by 6 to 15 and 7 to 12 mm (Duarte's BMClab), so by 5 mm from the middle: 0.7° of a shank of
# 40 cm, 3.6 % of a lever of 14 cm.
ONE_MALLEOLUS = {
    "shank [deg]": 0.5 + 0.7,
    "knee [deg]": 0.5 + 0.7,
    "ankle [deg]": 0.5 + 0.7,
    "moment peak [%]": 2.0 + 3.6,
    "centre of pressure [mm]": 5.0 + 5.0,
}
LATERAL_ONLY = ("plug-in gait", "helen hayes", "gait2392", "moco")  # marker sets


def differences(done: Any, laboratory: Laboratory, side: str, *, foot: bool = False) -> dict[str, float]:
    """RMS over the stride, or the difference of a single number; forces in per cent of the body weight.

    `foot`: the moment is that of inverse dynamics, with the foot's mass.
    """
    cycle, walker = done.cycle, laboratory.walker
    (chosen,) = done.chosen
    stride = done.strides[chosen]
    time = stride.start + cycle.phase * (stride.end - stride.start)
    found = {}
    for name in ("shank", "knee", "ankle"):
        error = getattr(cycle, f"{name}_angle") - walker.angle(side, name, time)
        found[f"{name} [deg]"] = _rms(np.degrees(error))
    force, place = walker.force(side, time)
    weight = walker.mass * GRAVITY
    error = cycle.body_mass * GRAVITY * np.column_stack([cycle.grf_x, cycle.grf_z]) - force[:, :2]
    found["force [%]"] = 100.0 * _rms(error) / weight
    moment = walker.moment(side, time, foot=foot)
    peak = -cycle.body_mass * float(cycle.ankle_moment.min())
    found["moment peak [%]"] = 100.0 * abs(peak / -float(moment.min()) - 1.0)
    ankle = walker.ankle_plane(side, time)
    length = float(ankle[-1, 0] - ankle[0, 0])
    number = round(float(walker.phase(side, time[:1])[0]))
    lasting = walker.heel_strike(side, number + 1) - walker.heel_strike(side, number)
    found["stride time [%]"] = 100.0 * abs(cycle.stride_time / lasting - 1.0)
    found["speed [%]"] = 100.0 * abs(cycle.walking_speed / (length / lasting) - 1.0)
    travel = float(cycle.ankle_x[-1] - cycle.ankle_x[0])
    found["ankle travel [%]"] = 100.0 * abs(travel / length - 1.0)
    pressed = np.isfinite(cycle.cop_x) & (force[:, 1] > 0.1 * weight)
    assert pressed.mean() > 0.5
    found["centre of pressure [mm]"] = 1e3 * _rms((cycle.cop_x - place[:, 0] + ankle[:, 0])[pressed])
    found["ankle height [mm]"] = 1e3 * _rms(cycle.ankle_z - ankle[:, 1])
    return found


def beyond(found: dict[str, float], bounds: dict[str, float] | None = None) -> dict[str, float]:
    """Differences above their bounds, none if the import is right."""
    bounds = BOUNDS | (bounds or {})
    return {name: round(value, 2) for name, value in found.items() if not value <= bounds[name]}


def noise_bounds(millimetres: float) -> dict[str, float]:
    """White noise through the 10 Hz filter at 100 Hz keeps √(2 · 10 / 100 · 1.11) = 0.47 of its size.

    An angle's noise is √2 of it over the segment (the midpoint of two markers: √½ of that); 0.5° beside it.
    """
    one = 1e-3 * millimetres * np.sqrt(2.0 * 10.0 / 100.0 * 1.11)
    shank = np.degrees(one / 0.40)
    foot = np.degrees(np.sqrt(2.0) * one / 0.19)
    ankle = float(np.hypot(shank, foot))
    return {
        "shank [deg]": 0.5 + float(shank),
        "knee [deg]": 0.5 + float(np.sqrt(3.0) * shank),
        "ankle [deg]": 0.5 + ankle,
        "moment peak [%]": 2.0 + 100.0 * 3.0 * float(one) / 0.14,  # over the lever of 14 cm
        "centre of pressure [mm]": 5.0 + 1e3 * float(one),
    }


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
