"""A log of a muscle on a bench: pressure, force, length, coils over time, and settings of the bench."""

import pathlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from afo_sim.common import InputError, Table, read_facts, table_of, unknown
from afo_sim.lab.measured import Known, columns_of

# Column → the SI units that it may be given in.
_UNITS = {"time": "s", "pressure": "Pa", "force": "N", "length": "m", "contraction": ""}
_COLUMNS: Known = {name: (unit,) for name, unit in _UNITS.items()} | {"inlet": (), "outlet": ()}
_EXAMPLE = "time [s], pressure [kPa], force [N], inlet, outlet"
# SI unit → header lines "# key: value", which are the keys of `bench`; None for texts.
_KEYS: dict[str | None, str] = {
    "m": "total_length length",
    "": "free_contraction contraction critical_ratio outlet_critical_ratio",
    "N": "blocked_force",
    "kg": "load",
    "N/m": "spring",
    "Pa": "supply",
    "m^3/(s*Pa)": "conductance outlet_conductance",
    "m^3": "tube_volume",
    "W/K": "wall_conductance",
    "s": "timestep period inlet_pulse outlet_pulse venting_from",
    None: "muscle valve source licence note",
}
BENCH = {name: unit for unit, names in _KEYS.items() for name in names.split()}
# Least and greatest value of a setting, or of its unit [SI]; from 0 to 1e4 of others.
_LIMITS = {"contraction": (-0.5, 0.9), "timestep": (1e-5, 0.1), "period": (1e-3, 1e4), "load": (1e-4, 1e4)}
_LIMITS |= {"": (0.0, 0.9), "Pa": (0.0, 2e6), "N/m": (0.0, 1e7)}
_FEWEST = 10  # samples


@dataclass(frozen=True, eq=False)
class BenchLog:
    """Samples by column on a clock that begins at 0, and settings by key of `BENCH`; SI."""

    file: pathlib.Path
    columns: dict[str, np.ndarray]
    bench: dict[str, Any]

    @property
    def time(self) -> np.ndarray:
        """[s] (n,)."""
        return self.columns["time"]

    def stated(self, bench: Mapping[str, Any]) -> "BenchLog":
        """The log with other settings of its bench, as texts or in SI."""
        for key in bench:
            if key not in BENCH:
                raise unknown(key, BENCH, field="bench", problem="is not a setting of a bench")
        texts = {key: value for key, value in bench.items() if isinstance(value, str)}
        found = {**self.bench, **bench, **read_facts(Table(self.file, (), (), texts), BENCH)}
        for key, value in found.items():
            unit = BENCH[key]
            low, high = _LIMITS.get(key) or _LIMITS.get(str(unit), (0.0, 1e4))
            if unit is not None and not low <= value <= high:
                allowed = f"{low:g} to {high:g} {unit}"
                raise InputError("is out of range", file=self.file, field=key, value=value, allowed=allowed)
        return replace(self, bench=found)

    def coils(self, time: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
        """Shares of steps that start at times [s] for which the coils of inlet and outlet are on [-].

        Of a stated train of pulses, or of each row's until the next.
        """
        bench, ends = self.bench, np.append(time, time[-1] + step)
        if "period" in bench:
            turn = bench.get("venting_from", np.inf)
            since = np.minimum(ends, turn), np.maximum(ends - turn, 0.0)
            pulses = [min(bench.get(f"{side}_pulse", 0.0), bench["period"]) for side in ("inlet", "outlet")]
            parts = [np.divmod(beyond, bench["period"]) for beyond in since]
            on = [n * w + np.minimum(rest, w) for (n, rest), w in zip(parts, pulses, strict=True)]
        else:
            nothing, widths = np.zeros_like(self.time), np.diff(self.time)
            row = np.clip(np.searchsorted(self.time, ends, side="right") - 1, 0, len(self.time) - 1)
            coils = [self.columns.get(side, nothing) for side in ("inlet", "outlet")]
            whole = [np.concatenate([[0.0], np.cumsum(coil[:-1] * widths)]) for coil in coils]
            on = [w[row] + c[row] * (ends - self.time[row]) for w, c in zip(whole, coils, strict=True)]
        # to a billionth, so that an edge on a step's end is one
        inlet, outlet = (np.round(np.clip(np.diff(each) / step, 0.0, 1.0), 9) for each in on)
        return inlet, outlet


def read_bench_log(data: Any) -> BenchLog:
    """A log of a bench, from a CSV or from {title with unit: array}."""
    if isinstance(data, BenchLog):
        return data
    table = table_of(data, _EXAMPLE, "log")
    columns, _ = columns_of(table, _COLUMNS, _EXAMPLE)
    if not {"time", "pressure"} <= columns.keys():
        value = ", ".join(columns)
        raise InputError("needs time and pressure", file=table.file, value=value, allowed=_EXAMPLE)
    time = columns["time"]
    if len(time) < _FEWEST or np.diff(time).min() <= 0.0:
        allowed = f"at least {_FEWEST} samples, each later than the last"
        raise InputError("time does not increase", file=table.file, field="time", allowed=allowed)
    return BenchLog(table.file, columns | {"time": time - time[0]}, read_facts(table, BENCH))
