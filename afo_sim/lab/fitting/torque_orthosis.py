"""A fitted device as an orthosis that runs: the fitted numbers in their places, each with its source."""

from collections.abc import Mapping
from typing import Any

from afo_sim.common.errors import InputError
from afo_sim.common.units import format_quantity
from afo_sim.description import reader
from afo_sim.description.orthosis import Orthosis
from afo_sim.physics.laws import LAWS

ANCHORS = {"cuff_stiffness": "shank", "plate_stiffness": "foot"}
CABLE = {"series_stiffness": ("stiffness", "N/m"), "offset": ("offset", "m")}


def fitted_orthosis(
    orthosis: Orthosis, chamber: str, values: Mapping[str, float], sources: Mapping[str, str]
) -> Orthosis:
    """An orthosis with fitted values in place of its own.

    Units: values [SI].
    """
    table = orthosis.model_dump(mode="json", exclude_none=True)
    for name, value in values.items():
        if name in ANCHORS:
            _anchor(table, ANCHORS[name], value, sources[name])
            continue
        for group in orthosis.muscles_of(chamber):
            muscle = table["muscle"][group]
            if name in CABLE:
                key, unit = CABLE[name]
                _put(muscle.setdefault("cable", {}), key, format_quantity(value, unit), sources[name])
            else:
                law = orthosis.muscle[group].type.law
                unit = LAWS[law].parameter(name).unit
                _put(muscle["type"]["laws"][law], name, format_quantity(value, unit), sources[name])
                muscle["type"].pop("covariance", None)  # of another fit, about another value
    table["name"] = f"{orthosis.name or 'orthosis'}-fitted"
    try:
        found: Orthosis = reader.load("orthosis", table)
    except InputError as error:
        problem = f"the fit is no orthosis: {error.field} {error.problem}"
        raise InputError(problem, value=error.value, allowed=error.allowed) from None
    return found


def _anchor(table: dict[str, Any], segment: str, value: float, source: str) -> None:
    """An anchor of a stiffness, in place of a stiffening law; its damping stays."""
    anchor = table.setdefault("anchor", {}).setdefault(segment, {})
    anchor.pop("stiffening", None)
    _put(anchor, "stiffness", format_quantity(value, "N/m"), source)


def _put(table: dict[str, Any], key: str, value: Any, source: str) -> None:
    table[key] = value
    table["provenance"] = table.get("provenance", {}) | {key: {"kind": "fitted", "source": source}}
