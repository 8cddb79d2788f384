"""The sensors of a scenario, fed with the rows of a run; see `physics/sensing.py` for what each does."""

import math
import zlib
from collections.abc import Callable, Mapping
from numbers import Integral
from operator import attrgetter

import numpy as np

from afo_sim.common import InputError, Mixed, unknown
from afo_sim.description import FieldError, Sensor, numbers
from afo_sim.model import Built
from afo_sim.native import compiled_sense
from afo_sim.physics import sensing
from afo_sim.simulation.columns import SENSOR, describe, formulas
from afo_sim.simulation.frame import Frame

Columns = Mapping[str, Callable[[Frame], np.ndarray]]
OUTPUT = "/output"
SEEDS = 2**32  # a seed counts modulo this
ROOM = 64  # rows that the arrays have room for at first


class SensorBank:
    """All sensors of one simulation, with what they remember from stretch to stretch."""

    def __init__(self, built: Built, seed: int = 0):
        self.built, self.seed = built, seed
        self.sensors = check_sensors(built)
        self.outputs: dict[str, np.ndarray] = {}  # of the last stretch, in V
        if not self.sensors:
            return
        timestep, line = built.scenario.timestep, 0
        self._p = np.zeros((len(self.sensors), sensing.N_PARAMETER))
        for row, (name, sensor) in zip(self._p, self.sensors.items(), strict=True):
            _fill(row, name, sensor, timestep)
            row[sensing.LINE] = line
            line += int(row[sensing.DELAY])
        self._memory = np.empty((len(self.sensors), sensing.N_MEMORY))
        self._lines = np.empty(max(line, 1))
        self._calibrated = {
            name: k for k, (name, s) in enumerate(self.sensors.items()) if s.whole.calibration is not None
        }
        self._seeds = self._p[:, sensing.SEED].copy()
        self._make_room(ROOM)
        self._begin()

    def reset(self, seed: int | None = None) -> None:
        """Forget everything; `seed` (0 to 2^32 − 1) is added to the seeds of all sensors, 0 by default."""
        self.seed = checked_seed(seed)
        if self.sensors:
            self._begin()

    @property
    def moment(self) -> tuple[Mixed, ...]:
        """What they remember; it may be assigned again."""
        return (self.seed, self._p.copy(), self._memory.copy(), self._lines.copy()) if self.sensors else ()

    @moment.setter
    def moment(self, moment: tuple[Mixed, ...]) -> None:
        if moment:
            self.seed, self._p[:], self._memory[:], self._lines[:] = moment

    def feed(self, frame: Frame, columns: Columns) -> dict[str, np.ndarray]:
        """Readings at the rows of the next stretch, by sensor (n,); `outputs` are those in V."""
        true = {name: columns[sensor.column](frame) for name, sensor in self.sensors.items()}
        return self.feed_values(true, frame.first_step, frame.n)

    def feed_values(self, true: Mapping[str, np.ndarray], first: int, n: int) -> dict[str, np.ndarray]:
        """Readings of true quantities [SI] (n,), by sensor, from row `first` of the run on."""
        if not self.sensors:
            return {}
        if first == 0:
            self._begin()
        if n > self._width:
            self._make_room(n)
        for k, values in enumerate(true.values()):
            self._values[k, :n] = values
        counts = (len(self.sensors), n, self._width, first, self.built.scenario.timestep)
        if self.built.scenario.callback == "native":
            compiled_sense()[0](*self._at, *counts)
        else:
            sensing.sense(*self._flat, *counts)
        self.outputs = {name: self._out[k, :n].copy() for name, k in self._calibrated.items()}
        return {name: self._readings[k, :n].copy() for k, name in enumerate(self.sensors)}

    def _begin(self) -> None:
        self._memory[:], self._lines[:] = math.nan, math.nan
        self._p[:, sensing.SEED] = (self._seeds + self.seed) % SEEDS

    def _make_room(self, n: int) -> None:
        shape = (len(self.sensors), n)
        self._width, self._values = n, np.empty(shape)
        self._readings, self._out = np.empty(shape), np.empty(shape)
        arrays = (self._p, self._memory, self._lines, self._values, self._readings, self._out)
        self._flat = [array.reshape(-1) for array in arrays]
        self._at = [array.ctypes.data for array in arrays]


def checked_seed(seed: int | None, plus: int = 0) -> int:
    """A seed of the sensors' noise and `plus`, modulo 2^32; 0 for None; InputError where it is none."""
    if seed is None:
        return 0
    if isinstance(seed, bool) or not isinstance(seed, Integral) or not 0 <= seed < SEEDS:
        allowed = f"a whole number, 0 to {SEEDS - 1}"
        raise InputError("is not a valid seed", field="seed", value=seed, allowed=allowed)
    return (int(seed) + plus) % SEEDS


def check_sensors(built: Built) -> dict[str, Sensor]:
    """The sensors of a scenario, by name; InputError, in words, where one does not fit its column."""
    sensors = built.scenario.sensor
    known = formulas(built, whole=False) if sensors else {}
    for name, sensor in sensors.items():
        at = f"sensor.{name}"
        if "/" in name or not name.strip():
            problem = "is not a valid name of a sensor: it " + ("has a /" if name.strip() else "is empty")
            raise InputError(problem, field="sensor", value=name)
        if sensor.column not in known:
            problem = "a run of this scenario has no such column that can be sensed"
            raise unknown(sensor.column, known, field=f"{at}.column", problem=problem)
        unit = describe(sensor.column)[0]
        if sensor.type is not None and sensor.type.unit != unit:
            of = f"{sensor.column} in {unit or 'no unit'}"
            problem = f"reads {sensor.type.unit or 'what has no unit'}, and the column is {of}"
            raise InputError(problem, field=f"{at}.type", value=sensor.type.name)
        try:
            numbers(sensor.whole, unit)
        except FieldError as error:
            value = attrgetter(error.key)(sensor.whole)
            raise InputError(str(error), field=f"{at}.{error.key}", value=value) from None
    return sensors


def _fill(row: np.ndarray, name: str, sensor: Sensor, timestep: float) -> None:
    """A sensor's parameters, as `physics/sensing.py` takes them."""
    fields, unit = sensor.whole, describe(sensor.column)[0]
    found = numbers(fields, unit)
    switch = found.threshold is not None
    line = found.line
    corner = fields.lowpass
    row[sensing.GAIN], row[sensing.OFFSET], row[sensing.DRIFT] = found.gain, found.offset, found.drift
    row[sensing.PLAY] = 0.0 if switch else found.hysteresis
    row[sensing.SHARE] = 1.0 if corner is None else -math.expm1(-2.0 * math.pi * corner * timestep)
    rate = fields.rate or 0.0
    row[sensing.RATE] = 0.0 if rate * timestep >= 1.0 else rate  # faster than the run: every step
    row[sensing.NOISE], row[sensing.OUT_NOISE] = found.noise, found.out_noise
    row[sensing.LOW], row[sensing.HIGH] = found.minimum, found.maximum
    row[sensing.OUT_LOW], row[sensing.OUT_HIGH] = found.out_minimum, found.out_maximum
    row[sensing.STEP], row[sensing.OUT_STEP] = found.resolution, found.out_resolution
    row[sensing.SLOPE] = row[sensing.TAKEN_SLOPE] = 1.0
    if line is not None:
        row[sensing.SLOPE], row[sensing.INTERCEPT] = line.slope, line.intercept
        row[sensing.TAKEN_SLOPE], row[sensing.TAKEN_INTERCEPT] = line.taken_slope, line.taken_intercept
        row[sensing.INVERSE] = float(line.inverse)
    row[sensing.SWITCH], row[sensing.THRESHOLD] = float(switch), found.threshold or 0.0
    row[sensing.HYSTERESIS] = found.hysteresis
    row[sensing.DEBOUNCE] = round((fields.debounce or 0.0) / timestep)
    row[sensing.DELAY] = round((fields.delay or 0.0) / timestep)
    row[sensing.SEED], row[sensing.NUMBER] = sensor.seed, zlib.crc32(name.encode())


def sensor_columns(built: Built, columns: Mapping[str, np.ndarray], seed: int = 0) -> dict[str, np.ndarray]:
    """Columns "sensor/<name>", and "sensor/<name>/output" [V] of calibrated ones, of all rows of a run."""
    if not built.scenario.sensor:
        return {}
    bank = SensorBank(built, seed)
    true = {name: columns[sensor.column] for name, sensor in bank.sensors.items()}
    readings = bank.feed_values(true, 0, len(columns["time"]))
    found = {}
    for name, values in readings.items():
        found[f"{SENSOR}{name}"] = values
        if name in bank.outputs:
            found[f"{SENSOR}{name}{OUTPUT}"] = bank.outputs[name]
    return found
