"""Numbers of patients who respond to a device, over all patients of a condition."""

from collections.abc import Mapping

from afo_sim.metrics.metric import REPORTED, WALKERS, Metric, Of, all_measured, reported

_WHEN = {"": "first day with the device", "_adapted": "adapted to the device", "_without": "without a device"}
_MEDIAN = "median of the patients who walk long enough to have strides"
_ROWS = (
    ("falls", "percent", "Starts that fall", "of all patients' perturbed starts, in simulation"),
    ("toe_clearance", "mm", "Toe clearance in mid-swing", f"of the device's leg, {_MEDIAN}"),
    ("air_per_stride", "g", "Patients' air per stride", _MEDIAN),
    ("gain", "", "Share of patients who gain", "and lose nothing, beyond the model's error"),
    ("lose", "", "Share of patients who lose", "in one number or more, beyond the model's error"),
    ("ankle_swing", "deg", "Ankle in mid-swing", f"of the device's leg, {_MEDIAN}"),
    ("speed", "m/s", "Patients' speed", _MEDIAN),
    ("cost_of_transport", "J/(kg*m)", "Cost of transport", _MEDIAN),
)


@reported(
    WALKERS,
    *(
        (f"walkers_{name}{ending}", unit, f"{label}, {when}", meaning)
        for name, unit, label, meaning in _ROWS
        for ending, when in _WHEN.items()
        if ending != "_without" or name not in ("air_per_stride", "gain", "lose")
    ),
    of=Of.BESIDE,
)
def walkers_metrics(values: Mapping[str, float]) -> dict[str, Metric]:
    """Those values that are of this table, with units."""
    return all_measured((x.name, values[x.name]) for x in REPORTED[walkers_metrics] if x.name in values)
