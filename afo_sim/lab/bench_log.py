"""A log of a muscle on a bench: pressure, force, length, coils over time, and settings of the bench."""

import pathlib
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from afo_sim.common import InputError, JsonDict, Table, TableLike, read_facts, table_of, unknown
from afo_sim.lab.measured import Known, columns_of

# Column → the SI units that it may be given in.
_UNITS = {"time": "s", "pressure": "Pa", "force": "N", "length": "m", "contraction": ""}
_UNITS |= {"angle": "rad", "velocity": "rad/s", "extensor": "Pa"}  # of a joint between two muscles
_COLUMNS: Known = {name: (unit,) for name, unit in _UNITS.items()} | {"inlet": (), "outlet": ()}
_EXAMPLE = "time [s], pressure [kPa], force [N], inlet, outlet"
# of the inlet; of the outlet with `outlet_`, and then as of the inlet where they are not stated
TIMES = ("opening_delay", "closing_delay", "opening_ramp", "closing_ramp")
VALVE = ("conductance", "critical_ratio", "threshold", *TIMES)
HOLD = ("hold_decay", "hold_pressure")  # of the outlet alone: nothing but the supply is before the inlet
# SI unit → header lines "# key: value", which are the keys of `bench`; None for texts.
_KEYS: dict[str | None, str] = {
    "m": "total_length length end_loss mounting_offset line_bore line_length radius link",
    "": "free_contraction contraction critical_ratio outlet_critical_ratio threshold outlet_threshold",
    "N": "blocked_force",
    "kg": "load",
    "N/m": "spring mounting_stiffness",
    "Pa": "supply start_pressure dead_band outlet_hold_pressure",
    "m^3/(s*Pa)": "conductance outlet_conductance leak_conductance",
    "m^3": "tube_volume gauge_volume",
    "W/K": "wall_conductance",
    "J/(kg*K)": "wall_conductance_by_flow",
    "s": "timestep period inlet_pulse outlet_pulse venting_from start outlet_hold_decay "
    + " ".join(f"{name} outlet_{name}" for name in ("lag", *TIMES)),
    None: "muscle law valve fed source licence note",
}
BENCH = {name: unit for unit, names in _KEYS.items() for name in names.split()}
# Least and greatest value of a setting, or of its unit [SI]; from 0 to 1e4 of others.
_LIMITS = {"contraction": (-0.5, 0.9), "timestep": (1e-5, 0.1), "period": (1e-3, 1e4), "load": (1e-4, 1e4)}
_LIMITS |= {"": (0.0, 0.9), "Pa": (0.0, 2e6), "N/m": (0.0, 1e9), "mounting_offset": (-0.1, 0.1)}
_LIMITS |= {"mounting_stiffness": (1e3, 1e9), "line_bore": (5e-4, 0.05), "line_length": (0.2, 100.0)}
_LIMITS |= {"start": (-1e3, 1e4), "outlet_hold_pressure": (0.0, 1e8), "length": (1e-3, 10.0)}
_LIMITS |= {"total_length": (1e-3, 10.0)}
_FEWEST = 10  # samples
# Settings that do nothing without another.
_NEEDS = dict.fromkeys(("line_bore", "gauge_volume"), "line_length")
_NEEDS |= {"outlet_hold_decay": "outlet_hold_pressure", "outlet_hold_pressure": "outlet_hold_decay"}


@dataclass(frozen=True, eq=False)
class BenchLog:
    """Samples by column on a clock that begins at 0, and settings by key of `BENCH`; SI."""

    file: pathlib.Path
    columns: dict[str, np.ndarray]
    bench: JsonDict

    @property
    def time(self) -> np.ndarray:
        """Since the bench's `start` [s] (n,)."""
        return self.columns["time"] - float(self.bench.get("start", 0.0))

    @property
    def muscle_key(self) -> tuple[object, ...]:
        """What distinguishes its muscle."""
        return self.bench.get("muscle"), self.bench.get("total_length")

    @property
    def fed(self) -> tuple[str, ...]:
        """Channels that an input was derived from: their errors are no prediction's."""
        names = self.bench.get("fed", "").partition("(")[0].split(",")
        return tuple(name.strip() for name in names if name.strip())

    @property
    def first_pressure(self) -> float:
        """Gauge pressure at the start [Pa]: as stated, as read, or none where the log began later."""
        early = self.time[0] > 0.0
        read = 0.0 if early else float(np.interp(0.0, self.time, self.columns["pressure"]))
        return max(float(self.bench.get("start_pressure", read)), 0.0)

    def stated(self, bench: Mapping[str, object]) -> "BenchLog":
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
        for key in _NEEDS.keys() & found.keys():
            if _NEEDS[key] not in found:
                allowed = f"{_NEEDS[key]} beside it"
                raise InputError("has no effect alone", file=self.file, field=key, allowed=allowed)
        if found.get("start", 0.0) >= self.columns["time"][-1]:
            raise InputError("is after the last sample", file=self.file, field="start", value=found["start"])
        return replace(self, bench=found)

    def coils(self, time: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
        """Shares of steps from times [s] with coils on [-], of stated pulses or of each row's."""
        bench = self.bench
        lags = np.array([bench.get("lag", 0.0), bench.get("outlet_lag", bench.get("lag", 0.0))])
        ends = np.maximum(np.append(time, time[-1] + step) - lags[:, None], 0.0)
        if "period" in bench:
            turn = bench.get("venting_from", np.inf)
            since = np.minimum(ends[0], turn), np.maximum(ends[1] - turn, 0.0)
            pulses = [min(bench.get(f"{side}_pulse", 0.0), bench["period"]) for side in ("inlet", "outlet")]
            parts = [np.divmod(beyond, bench["period"]) for beyond in since]
            on = [n * w + np.minimum(rest, w) for (n, rest), w in zip(parts, pulses, strict=True)]
        else:
            nothing, widths = np.zeros_like(self.time), np.diff(self.time)
            rows = np.clip(np.searchsorted(self.time, ends, side="right") - 1, 0, len(self.time) - 1)
            coils = [self.columns.get(side, nothing) for side in ("inlet", "outlet")]
            whole = [np.concatenate([[0.0], np.cumsum(coil[:-1] * widths)]) for coil in coils]
            sides = zip(whole, coils, rows, ends, strict=True)
            on = [w[row] + c[row] * (end - self.time[row]) for w, c, row, end in sides]
        # to a billionth, so that an edge on a step's end is one
        inlet, outlet = (np.round(np.clip(np.diff(each) / step, 0.0, 1.0), 9) for each in on)
        return inlet, outlet


def read_bench_log(data: TableLike | BenchLog) -> BenchLog:
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
