"""A sensor: what of a true quantity the electronics read, and a type of sensor that one can buy."""

import functools
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import field_validator

from afo_sim.common import FloatOrArray, Given, dimension, parse_quantity, read_any_quantity
from afo_sim.description.quantity import Described, Named, Quantity, refusal
from afo_sim.physics import line_output, line_value

_SensorTime = Annotated[float, Quantity("s", at_least=0.0, at_most=10.0)]
_VOLT = "V"
_HIGHEST_SEED = 2**32 - 1
_NOT_NEGATIVE = ("hysteresis", "noise", "resolution")
_TEXTS = ("offset", "drift", "hysteresis", "noise", "minimum", "maximum", "resolution", "threshold")


@dataclass(frozen=True)
class Line:
    """A calibration line of a quantity x: V = slope x + intercept, or V = slope/x + intercept."""

    slope: float  # [V] per unit of x, or times it where inverse
    intercept: float  # [V]
    taken_slope: float  # slope that the reader takes for it
    taken_intercept: float  # intercept that the reader takes for it [V]
    inverse: bool = False  # of 1/x, not of x

    def volts(self, value: FloatOrArray) -> FloatOrArray:
        """Physical output [V] at a quantity [SI], by the true line; a number or an array."""
        return np.vectorize(line_output)(value, self.slope, self.intercept, float(self.inverse))

    def value(self, volts: FloatOrArray) -> FloatOrArray:
        """Reading [SI] at a physical output [V], by the line that the electronics take for true."""
        return np.vectorize(line_value)(volts, self.taken_slope, self.taken_intercept, float(self.inverse))


class Calibration(Described):
    """The line from quantity to voltage, and the one that the electronics take for it."""

    slope: str
    """Slope of the true line, such as "6.43 mV/kPa"; of an inverse one such as "10.4 V*cm"."""
    intercept: str = "0 V"
    """Voltage of the true line where the quantity, or its inverse, is 0."""
    shape: Literal["linear", "inverse"] = "linear"
    """Linear: V = slope × quantity + intercept; inverse: V = slope/quantity + intercept."""
    assumed_slope: str | None = None
    """Slope by which the electronics reckon; the true one by default."""
    assumed_intercept: str | None = None
    """Intercept by which the electronics reckon; the true one by default."""

    def line(self, unit: str) -> Line:
        """The line of a quantity in an SI unit; FieldError where a text is of another dimension."""
        inverse = self.shape == "inverse"
        per = (f"V*{unit}" if inverse else f"V/({unit})") if unit else _VOLT
        slope, intercept = _read("slope", self.slope, per), _read("intercept", self.intercept, _VOLT)
        taken_slope, taken = self.assumed_slope, self.assumed_intercept
        found = Line(
            slope,
            intercept,
            slope if taken_slope is None else _read("assumed_slope", taken_slope, per),
            intercept if taken is None else _read("assumed_intercept", taken, _VOLT),
            inverse,
        )
        for key, steepness in (("slope", found.slope), ("assumed_slope", found.taken_slope)):
            if steepness == 0.0:
                raise FieldError(key, "is 0: such an output carries no information")
        return found


class FieldError(ValueError):
    """A field of a sensor does not fit its column: which field, and why."""

    def __init__(self, key: str, problem: str):
        super().__init__(problem)
        self.key = key


def _read(key: str, text: str, unit: str) -> float:
    try:
        return parse_quantity(text, unit)
    except ValueError as error:
        raise FieldError(key, str(error)) from None


class SensorFields(Described):
    """What lies between a quantity and its reading. A text is in the unit of the sensor's column."""

    gain: Annotated[float, Quantity("", at_least=-10.0, at_most=10.0)] | None = None
    """Element's sensitivity over the nominal one; 1 by default."""
    offset: str | None = None
    """Error of the zero, in the column's unit; none by default."""
    drift: str | None = None
    """Growth of the zero's error, in the column's unit per time; none by default."""
    hysteresis: str | None = None
    """Width of the play between rising and falling, of a switch between its two thresholds."""
    lowpass: Annotated[float, Quantity("Hz", above=0.0, at_most=1e6)] | None = None
    """Corner frequency of the first-order low-pass before sampling; none by default."""
    rate: Annotated[float, Quantity("Hz", above=0.0, at_most=1e6)] | None = None
    """Samples a second, held in between; every step by default."""
    noise: str | None = None
    """Standard deviation of each sample's noise, in the column's unit or in V; none by default."""
    minimum: str | None = None
    """Lowest value that it can report, in the column's unit or in V; lower ones are clipped."""
    maximum: str | None = None
    """Highest value that it can report, in the column's unit or in V; higher ones are clipped."""
    resolution: str | None = None
    """Step of the reading in the column's unit, or of the converter in V; none by default."""
    delay: _SensorTime | None = None
    """Time from sample to reading, to whole time steps; none by default."""
    threshold: str | None = None
    """Makes it a switch that reads 1 above and 0 below, in the column's unit."""
    debounce: _SensorTime | None = None
    """Time that a switch must be over its threshold before it changes, to whole time steps."""
    calibration: Calibration | None = None
    """Its output in volts, and the line by which it is read; without one the reading is direct."""

    @field_validator(*_TEXTS, mode="before")
    @classmethod
    def _is_quantity(cls, value: Given) -> Given:
        """A text with a number that is one, of whatever dimension; a bare number as a text."""
        if value is None:
            return None
        if isinstance(value, int | float) and not isinstance(value, bool):
            value = repr(float(value))
        if not isinstance(value, str):
            raise refusal("is not a quantity", 'a text in the column\'s unit, such as "0.02 bar"')
        try:
            _any(value)
        except ValueError as error:
            raise refusal(str(error), 'a text in the column\'s unit, such as "0.02 bar"') from None
        return value

    def _must_be_not_negative(self) -> None:
        for key in _NOT_NEGATIVE:
            text = getattr(self, key)
            if text is not None and _any(text) < 0.0:
                raise refusal("is negative", "0 or more", key)


@functools.lru_cache(maxsize=1024)
def _any(text: str) -> float:
    try:
        return parse_quantity(text, "")
    except ValueError:
        return read_any_quantity(text)[0]


class SensorType(Named, SensorFields):
    """A sensor that one can buy, by its numbers."""

    unit: str
    """SI unit of the columns that it reads, such as "Pa"; "" for none."""

    @property
    def line(self) -> Line:
        """Its calibration line; ValueError where it has none."""
        if self.calibration is None:
            raise ValueError(f"{self.name or 'the sensor'} has no calibration: its reading is direct")
        return self.calibration.line(self.unit)

    def volts(self, value: FloatOrArray) -> FloatOrArray:
        """Physical output [V] at a quantity [SI], by the true line."""
        return self.line.volts(value)

    def value(self, volts: FloatOrArray) -> FloatOrArray:
        """Reading [SI] at a physical output [V], by the line that the electronics take for true."""
        return self.line.value(volts)

    def _must_fit_its_unit(self) -> None:
        try:
            dimension(self.unit or "m/m")
        except Exception:  # pint's many
            raise refusal("is not a valid unit", 'an SI unit such as "Pa", "N", "m", "rad"', "unit") from None
        try:
            numbers(self, self.unit)
        except FieldError as error:
            raise refusal(str(error), "", error.key) from None


class Sensor(SensorFields):
    """A sensor on a column of the run; its reading is the column "sensor/<name>", in the same unit."""

    column: str
    """Column that it reads, such as "ankle/angle"."""
    type: SensorType | None = None
    """Sensor whose numbers it has, but for those that stand here: a shipped name, or the path of a sensor's
    TOML file or folder."""
    seed: int = 0
    """Seed of the noise, from 0; each sensor has noise of its own by its name."""

    def _must_have_seed(self) -> None:
        if not 0 <= self.seed <= _HIGHEST_SEED:
            raise refusal("is out of range", f"0 to {_HIGHEST_SEED}", "seed")

    @property
    def whole(self) -> SensorFields:
        """All its fields: its own, else its type's."""
        own = {name: getattr(self, name) for name in FIELDS}
        if self.type is not None:
            own |= {name: getattr(self.type, name) for name, value in own.items() if value is None}
        return SensorFields.model_construct(**own)


FIELDS = tuple(name for name in SensorFields.model_fields if name != "provenance")


@dataclass(frozen=True)
class Numbers:
    """A sensor's fields as numbers [SI of its column]; those with `out_` are of its output [V]."""

    gain: float
    offset: float
    drift: float
    hysteresis: float
    noise: float
    out_noise: float
    minimum: float
    maximum: float
    out_minimum: float
    out_maximum: float
    resolution: float
    out_resolution: float
    threshold: float | None
    line: Line | None


def numbers(fields: SensorFields, unit: str) -> Numbers:
    """The texts of a sensor's fields as numbers, on a column of an SI unit."""
    line = None
    if fields.calibration is not None:
        try:
            line = fields.calibration.line(unit)
        except FieldError as error:
            raise FieldError(f"calibration.{error.key}", str(error)) from None

    def own(key: str, default: float, of: str = unit) -> float:
        text = getattr(fields, key)
        return default if text is None else _read(key, text, of)

    found: dict[str, float] = {}
    for key, none in (("noise", 0.0), ("minimum", -np.inf), ("maximum", np.inf), ("resolution", 0.0)):
        text = getattr(fields, key)
        in_volts = text is not None and line is not None and _is_voltage(text)
        found[key] = none if in_volts else own(key, none)
        found[f"out_{key}"] = _read(key, text, _VOLT) if in_volts else none
    if found["minimum"] > found["maximum"] or found["out_minimum"] > found["out_maximum"]:
        raise FieldError("minimum", "is above the maximum")
    return Numbers(
        gain=1.0 if fields.gain is None else fields.gain,
        offset=own("offset", 0.0),
        drift=own("drift", 0.0, f"{unit}/s" if unit else "s^-1"),
        hysteresis=own("hysteresis", 0.0),
        threshold=None if fields.threshold is None else own("threshold", 0.0),
        line=line,
        **found,
    )


@functools.lru_cache(maxsize=1024)
def _is_voltage(text: str) -> bool:
    try:
        return read_any_quantity(text)[1] == dimension(_VOLT)
    except ValueError:
        return False
