"""Names for people, and units that they read, on axes and in tables of a sweep."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from afo_sim.common import EXAMPLES, InputError, in_unit
from afo_sim.metrics import metric_words, no_metric
from afo_sim.study.results import Results

Better = Literal["lowest", "highest"]

_DEFAULT = ("toe_clearance", "air_per_stride", "orthosis_peak_dorsiflexion_torque")  # those that are there
_HOW_MANY = 3  # metrics, where none is asked for and _DEFAULT are not there
_LOW_IS_GOOD = (
    "air_", "free_air_", "angle_error_", "gvs_", "torque_missing", "torque_unneeded", "foot_slap",
    "needed_", "swings_with", "contacts_with_forefoot", "contacts_with_flat", "rise_time", "peak_pressure_",
    "normal_litres_", "torque_against_", "work_against_", "ankle_range_lost", "dorsiflexion_lost",
    "plantarflexion_lost_", "walkers_falls", "walkers_air", "walkers_lose", "walkers_cost",
)  # fmt: skip
# Units by the size of the values: (largest value below which it is used [SI], unit).
_SIZES = {
    "m": ((0.03, "mm"), (1.0, "cm"), (np.inf, "m")),
    "s": ((1.0, "ms"), (np.inf, "s")),
    "kg": ((1.0, "g"), (np.inf, "kg")),
    "m^3": ((1e-3, "ml"), (np.inf, "l")),
}
_FURTHER = {"rad/s": "deg/s", "kg/s": "g/s", "K": "K", "J": "J"}
_POWERS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


@dataclass(frozen=True)
class Scale:
    """The scale of a column: its label, the factor from its own unit, the unit it is shown in."""

    label: str
    factor: float
    unit: str

    @property
    def title(self) -> str:
        """Label and unit, for an axis."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label

    def text(self, value: object) -> str:
        """A value of the column with its digits, without the unit."""
        if isinstance(value, str):
            return value
        shown = self.factor * float(value)  # type: ignore[arg-type]  # a cell is a text or a number
        return "–" if not np.isfinite(shown) else f"{shown:.4g}".replace("-", "−")


def scale(results: Results, name: str) -> Scale:
    """The scale of a parameter or a metric."""
    unit = (results.parameters | results.metrics)[name]
    label = metric_words.words(name).label if name in results.metrics else name.replace("_", " ")
    factor, human = human_scale(unit, results[name])
    shown, *powers = metric_words.UNITS.get(human, human).split("^")
    for power in powers:
        digits = len(power) - len(power.lstrip("-0123456789"))
        shown += power[:digits].translate(_POWERS) + power[digits:]
    return Scale(label, factor, shown.replace("*", "·"))


def human_scale(unit: str, values: np.ndarray) -> tuple[float, str]:
    """The factor to the unit in which people read values that are given in `unit`, and that unit."""
    human = EXAMPLES[unit].partition(" ")[2] if unit in EXAMPLES else unit
    if unit in _SIZES and values.dtype.kind in "fiu":
        largest = float(np.nanmax(np.abs(values), initial=0.0))
        human = next(each for limit, each in _SIZES[unit] if largest < limit)
    elif unit in _FURTHER or not unit:
        human = _FURTHER.get(unit, "")
    return in_unit(1.0, unit, human) if human != unit else 1.0, human


def _better(metric: str) -> Better:
    return "lowest" if metric.startswith(_LOW_IS_GOOD) else "highest"


def chosen(results: Results, asked: list[str]) -> dict[str, Better]:
    """{metric: which end is good} as requested, or the most important metrics."""
    if not asked:
        there = [name for name in _DEFAULT if name in results.metrics]
        return {name: _better(name) for name in there or list(results.metrics)[:_HOW_MANY]}
    found: dict[str, Better] = {}
    for text in asked:
        name, colon, end = text.partition(":")
        if name not in results.metrics:
            problem, allowed = "the sweep has no such metric", ", ".join(results.metrics)
            raise no_metric(problem, name, results.metrics, field="metric", allowed=allowed)
        if colon and end not in ("lowest", "highest"):
            raise InputError("is not a valid choice", field=name, value=end, allowed="lowest, highest")
        found[name] = end if colon else _better(name)  # type: ignore[assignment]  # examined above
    return found
