"""Metrics beside those of strides: how the settled one was found, a reference to compare with, energy."""

import math
from collections.abc import Mapping

from afo_sim.metrics.air_per_stride import EACH
from afo_sim.metrics.metric import CLEARANCE, ENERGY, TIME, Metric, Of, all_measured, reported


@reported(
    TIME,
    ("strides_solved", "", "Strides that the solver simulated",
     "at the chosen time step; a wearer walks more"),
    ("settled_air_change", "percent", "Change of the air over the settled stride", "largest, of mass and σ"),
    ("settled_angle_change", "deg", "Change of the ankle angle over the settled stride",
     "at its ends, or largest in two strides"),
    of=Of.BESIDE,
)  # fmt: skip
def settling_metrics(strides: int, air: float, angle: float) -> dict[str, Metric]:
    """Metrics of a stride that was solved for."""
    changes = ("settled_air_change", 100.0 * air), ("settled_angle_change", math.degrees(angle))
    return all_measured([("strides_solved", float(strides)), *changes])


BY_LAWS = "toe_clearance_by_other_laws"
LESS = "toe_clearance_less_extended"
COMPARED = "toe_clearance"  # of both walks
TOUCHES = "swings_with_toe_contact"  # of the reference: a toe that passes high may touch earlier in swing


@reported(
    CLEARANCE,
    ("reference_toe_clearance", "mm", "Toe clearance of the reference", "the same patient, otherwise shod"),
    ("reference_swings_with_toe_contact", "percent",
     "Swings of the reference in which the forefoot touches the floor", "the same patient, otherwise shod"),
    ("lift_over_reference", "mm", "Toe clearance minus the reference's", "the same patient, otherwise shod"),
    of=Of.BESIDE,
    made_of=(COMPARED,),
)  # fmt: skip
def reference_metrics(own: Mapping[str, Metric], reference: Mapping[str, Metric]) -> dict[str, Metric]:
    """The reference walk's clearance, whether its forefoot touches, and how much higher this toe is."""
    if COMPARED not in own or COMPARED not in reference:
        return {}
    values = {
        "reference_toe_clearance": float(reference[COMPARED]),
        "lift_over_reference": float(own[COMPARED]) - float(reference[COMPARED]),
    }
    if TOUCHES in reference:
        values[f"reference_{TOUCHES}"] = float(reference[TOUCHES])
    return all_measured(values.items())


_ALONE, _ALONE_BARE = "without compensation", "without compensation, of the reference"
_HER = "the patient's ankle in swing on healthy hip, knee and path"
_COMPARED = (COMPARED, TOUCHES)
_WORN = (*_COMPARED, "torque_against_push_off_per_mass", "work_against_push_off", LESS)


@reported(
    CLEARANCE,
    ("uncompensated_reference_toe_clearance", "mm", f"Toe clearance {_ALONE_BARE}", _HER),
    ("uncompensated_toe_clearance", "mm", f"Toe clearance {_ALONE}", f"{_HER}, with the device"),
    (f"uncompensated_reference_{TOUCHES}", "percent", f"Swings that touch the floor {_ALONE_BARE}", _HER),
    (f"uncompensated_{TOUCHES}", "percent", f"Swings that touch the floor {_ALONE}", _HER),
    (f"uncompensated_{_WORN[2]}", "N*m/kg", f"Torque against push-off {_ALONE}", _HER),
    (f"uncompensated_{_WORN[3]}", "J/kg", f"Work against push-off {_ALONE}", _HER),
    (f"uncompensated_{LESS}", "mm", f"Toe clearance {_ALONE}, toes less extended", _HER),
    of=Of.BESIDE,
    made_of=_WORN,
)
def uncompensated_metrics(reference: Mapping[str, Metric], worn: Mapping[str, Metric]) -> dict[str, Metric]:
    """The walk without and with the device of a patient who makes up for nothing."""
    pairs = (("uncompensated_", worn, _WORN), ("uncompensated_reference_", reference, _COMPARED))
    return all_measured((of + n, float(walk[n])) for of, walk, names in pairs for n in names if n in walk)


@reported(
    CLEARANCE,
    (BY_LAWS, "mm", "Lowest toe clearance by another law", "of those that the muscles' files hold"),
    of=Of.BESIDE,
    made_of=(COMPARED,),
)
def by_laws_metrics(lowest: float) -> dict[str, Metric]:
    """The lowest clearance [mm] by any other law of the muscles."""
    return all_measured([(BY_LAWS, lowest)])


_ONCE = "filled once before the first step and shut, at the best pressure"
_KEPT = ("pressure", COMPARED, *_WORN[2:4])


@reported(
    CLEARANCE,
    ("filled_once_pressure", "bar", "Pressure of the best single filling", _ONCE),
    ("filled_once_toe_clearance", "mm", "Toe clearance after a single filling", _ONCE),
    ("filled_once_torque_against_push_off_per_mass", "N*m/kg",
     "Torque against push-off after a single filling", _ONCE),
    ("filled_once_work_against_push_off", "J/kg", "Work against push-off after a single filling", _ONCE),
    of=Of.BESIDE,
    made_of=_KEPT[1:],
)  # fmt: skip
def filled_once_metrics(filled: Mapping[str, Metric]) -> dict[str, Metric]:
    """The walk with valves that never open: a device that is a spring."""
    return all_measured((f"filled_once_{name}", float(filled[name])) for name in _KEPT if name in filled)


@reported(
    ENERGY,
    ("air_work", "J", "Work of the air on the muscles", EACH),
    ("skeleton_work", "J", "Work of the muscles on the skeleton", EACH),
    ("damper_loss", "J", "Lost in dampers", f"of muscles, cuff and plate; {EACH}"),
    ("friction_loss", "J", "Lost in friction", f"of the muscles; {EACH}"),
    ("wrap_loss", "J", "Lost at guides", f"friction at the paths' points and surfaces; {EACH}"),
    ("spring_change", "J", "Stored in springs", f"change in cables, cuff and plate; {EACH}"),
    ("bladder_change", "J", "Stored in bladders", f"change of what the muscles hold; {EACH}"),
    ("law_mismatch", "J", "Work that the force laws add", f"beyond the work of the air; {EACH}"),
    ("law_mismatch_share", "percent", "Work that the force laws add, share", "of the net work of the air"),
    ("energy_error", "percent", "Energy not accounted for",
     "share of the air's absolute work, over the run or two settled strides"),
    of=Of.BESIDE,
)  # fmt: skip
def energy_metrics(terms: Mapping[str, float], number: int, error: float) -> dict[str, Metric]:
    """Metrics of an energy balance: air_work + law_mismatch is what is done, the others where it goes."""
    found = {name: value / number for name, value in terms.items()}
    if terms["air_work"] != 0.0:
        found["law_mismatch_share"] = 100.0 * terms["law_mismatch"] / abs(terms["air_work"])
    return all_measured((found | {"energy_error": 100.0 * error}).items())
