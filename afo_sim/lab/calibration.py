"""Calibration of a sensor: the line, or inverse curve, from known quantities to readings in volts."""

import numpy as np

from afo_sim.common import GRAVITY, InputError, Table, quantity_at, split_title, table_of
from afo_sim.description import toml_text
from afo_sim.lab.measured import Known, columns_of

_EXAMPLE = "reference [bar], reading [V]"
_COLUMNS: Known = {"reference": ("Pa", "N", "kg", "m", "rad", "rad/s", "N*m"), "reading": ("V",)}


def calibrate(
    log: object, *, inverse: bool = False, step: float = 0.01
) -> tuple[dict[str, tuple[float, str]], str]:
    """A line, or V = slope/x + intercept, of a log's references and readings: results, a sensor.toml."""
    x, output, unit, si, table = _readings(log, inverse)
    basis, per = (1.0 / x, "V*") if inverse else (x, "V/")
    per += unit if unit.isalpha() else f"({unit})"
    (slope, intercept), covariance = np.polyfit(basis, output, 1, cov=True)
    errors = np.sqrt(np.diag(covariance))
    if abs(slope) <= 2.0 * errors[0] or np.ptp(output) < step:
        raise InputError("does not depend on the reference", file=table.file, field="reading")
    residual, full = output - slope * basis - intercept, abs(slope) * np.ptp(basis)
    off = [
        np.abs(_digits(slope, d) * basis + _digits(intercept, d) - output + residual).max()
        for d in range(4, 9)
    ]
    few = 0.005 * np.sqrt(np.mean(residual**2))  # changes no digit of what is said of the line
    digits = next((d for d, moved in enumerate(off, start=4) if moved <= few), 9)
    middle, nonlinearity, gap = _without_hysteresis(x, residual)
    found = {
        "slope": (slope, per),
        "slope, standard error": (errors[0], per),
        "intercept": (intercept, "V"),
        "intercept, standard error": (errors[1], "V"),
        "RMS residual": (np.sqrt(np.mean(residual**2)), "V"),
        "nonlinearity": (100.0 * nonlinearity / full, "% of full scale"),
        "hysteresis": (100.0 * gap / full, "% of full scale"),
    }
    for end in (x.min(), x.max()):
        found[f"{step:g} V at {end:.4g} {unit}"] = (step / abs(slope) * (end**2 if inverse else 1.0), unit)
    name, play = table.file.name, np.nan if inverse else gap / abs(slope)
    sensor = {
        "description": f"calibrated by {name}, {x.min():.4g} to {x.max():.4g} {unit}",
        "unit": si,
        "noise": _fitted(np.sqrt(np.sum(middle**2) / (len(x) - 2)), "V", f"{name}: residual without play"),
        "resolution": _fitted(step, "V", "step of the converter as stated") | {"kind": "user"},
        "hysteresis": _fitted(play, unit, f"{name}: between runs up and down") if play >= 0.0 else None,
        "calibration": {
            "shape": "inverse" if inverse else "linear",
            "slope": _fitted(slope, per, f"{name}: standard error {errors[0]:.3g}", digits),
            "intercept": _fitted(intercept, "V", f"{name}: standard error {errors[1]:.3g}", digits),
        },
    }
    return {key: (float(v), of) for key, (v, of) in found.items() if np.isfinite(v)}, toml_text(sensor)


def _readings(log: object, inverse: bool) -> tuple[np.ndarray, np.ndarray, str, str, Table]:
    """References, outputs [V], unit, SI unit and table; refuse what determines no line."""
    table = table_of(log, _EXAMPLE, "log")
    columns, units = columns_of(table, _COLUMNS, _EXAMPLE, {f"a {name}": (name,) for name in _COLUMNS})
    unit, si = split_title(table.titles[[*columns].index("reference")])[1], units["reference"]
    x = columns["reference"] / quantity_at("reference", f"1 {unit}", si)
    if si == "kg":
        x, unit, si = GRAVITY * columns["reference"], "N", "N"
    if len(x) < 3 or np.ptp(x) == 0.0 or (inverse and x.min() <= 0.0):
        allowed = f"3 readings, at two references or more{', above 0' if inverse else ''}"
        raise InputError("determines no line", file=table.file, field="reference", allowed=allowed)
    return x, columns["reading"], unit, si, table


def _without_hysteresis(x: np.ndarray, residual: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Residuals midway between runs up and down (n,), their largest mean at a level, and the largest gap."""
    level = np.floor(100.0 * (x - x.min()) / np.ptp(x) + 0.29)  # no edge is at a round share
    side = np.sign(np.diff(level, prepend=level[0]))  # 1 where the reference had last risen, −1 fallen
    side = side[np.maximum.accumulate(np.where(side, np.arange(len(x)), np.flatnonzero(side)[0]))]
    runs = np.diff([0, *(1 + np.flatnonzero(np.diff(side))), len(side)])
    middle, largest, gap = residual.copy(), 0.0, np.nan
    for here in (level == each for each in np.unique(level)):
        up, down = residual[here & (side > 0)], residual[here & (side < 0)]
        if runs.min() >= 3 and len(up) and len(down):
            middle[here] += 0.5 * side[here] * (down.mean() - up.mean())
            gap = np.fmax(gap, abs(down.mean() - up.mean()))
        largest = max(largest, abs(middle[here].mean()))
    return middle, largest, gap


def _digits(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")


def _fitted(value: float, unit: str, source: str, digits: int = 9) -> dict[str, str]:
    return {"value": f"{value:.{digits}g} {unit}", "kind": "fitted", "source": source}
