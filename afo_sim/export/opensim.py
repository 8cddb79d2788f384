"""A run for OpenSim: coordinates, external loads, and its tables over time, .sto and .mot.

OpenSim's axes are x forward, y up, z to the right; this project's z, which is up, is its y. In Gait2392
ankle_angle_r turns the foot about (-0.105, -0.174, 0.979) of the tibia and mtp_angle_r the toes about
(-0.581, 0, 0.814) of the foot: from forward to up, so that dorsiflexion and extension are positive, as here.
(Gait2392_Simbody/gait2392_simbody.osim of opensim-org/opensim-models.) In the Rajagopal models the toes' axis
points to the left, and their mtp_angle_r is positive in flexion.
"""

import csv
import pathlib
import re
from collections.abc import Mapping
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from afo_sim.common import InputError
from afo_sim.export.rows import TIME, Report, Rows, write_numbers
from afo_sim.model import persons_stride
from afo_sim.simulation import Recording

ANKLE_ANGLE, TOES = "ankle/angle", "toe/extension"
FORWARD, UP, PLACE = "ground/force/x", "ground/force/z", "ground/position/x"
ALONG, HEIGHT, MOMENT = "ankle/position/x", "ankle/position/z", "ankle/moment/ground"
_LOADS = (FORWARD, UP, PLACE, ALONG, HEIGHT, MOMENT)
NEEDED = (ANKLE_ANGLE, TOES, *_LOADS)
FORCE, POINT, TORQUE = "ground_force_v", "ground_force_p", "ground_torque_"
_AXES = "xyz"
_UNITS = (
    "Units are S.I. units (second, meters, Newtons, ...)",
    "If the header above contains a line with 'inDegrees', this indicates whether rotational values are in "
    "degrees (yes) or radians (no).",
)
_ANKLE = ["dorsiflexion", "plantarflexion"]  # directions of a leg's joint that is an ankle


def coordinates(rows: Rows, side: str) -> dict[str, np.ndarray]:
    """{coordinate of OpenSim: values [deg]}: `time` [s], ankle_angle_r, mtp_angle_r."""
    found = {TIME: rows.columns[TIME]}
    for column, name in ((ANKLE_ANGLE, "ankle_angle"), (TOES, "mtp_angle")):
        if column in rows.columns:
            found[f"{name}_{side[0]}"] = np.degrees(rows.columns[column])
    return found


def ground_loads(rows: Rows) -> dict[str, np.ndarray]:
    """{OpenSim's label: values}, after `time`: force [N], its point [m] and moment [N·m]; {} without them."""
    if not set(_LOADS) <= set(rows.columns):
        return {}
    forward, up, place, along, height, moment = (rows.columns[name] for name in _LOADS)
    given: Mapping[str, np.ndarray] = {
        f"{FORCE}x": forward,
        f"{FORCE}y": up,
        f"{POINT}x": place,
        f"{TORQUE}z": moment - ((place - along) * up + height * forward),
    }
    none = np.zeros(len(rows.columns[TIME]))
    labels = [f"{quantity}{axis}" for quantity in (FORCE, POINT, TORQUE) for axis in _AXES]
    return {TIME: rows.columns[TIME]} | {label: given.get(label, none) for label in labels}


def external_loads(name: str, data: str, side: str) -> str:
    """OpenSim's ExternalLoads as XML: the ground's force acts on the heel bone's body of a side."""
    facts = {
        "applied_to_body": f"calcn_{side[0]}",
        "force_expressed_in_body": "ground",
        "point_expressed_in_body": "ground",
        "force_identifier": FORCE,
        "point_identifier": POINT,
        "torque_identifier": TORQUE,
        "data_source_name": data,
    }
    lines = "".join(f"\t\t\t\t<{key}>{escape(value)}</{key}>\n" for key, value in facts.items())
    return (
        '<?xml version="1.0" encoding="UTF-8" ?>\n<OpenSimDocument Version="40000">\n'
        f"\t<ExternalLoads name={quoteattr(name)}>\n\t\t<objects>\n"
        f'\t\t\t<ExternalForce name="{side}">\n{lines}\t\t\t</ExternalForce>\n'
        f"\t\t</objects>\n\t\t<groups />\n\t\t<datafile>{escape(data)}</datafile>\n"
        "\t</ExternalLoads>\n</OpenSimDocument>\n"
    )


def write_storage(
    path: pathlib.Path, name: str, columns: Mapping[str, np.ndarray], *, degrees: bool, report: Report
) -> None:
    """Write a table that OpenSim's Storage and its TimeSeriesTable read to the same bits."""
    labels = list(columns)
    assert labels[0] == TIME and not any(re.search(r"\s", label) for label in labels)
    for label, values in columns.items():
        if not np.isfinite(values).all():
            raise InputError("is not a finite number in every row, which OpenSim cannot read", field=label)
    header = [
        re.sub(r"[\s=]+", " ", name).strip() or "run",
        "version=1",
        f"nRows={len(columns[TIME])}",
        f"nColumns={len(labels)}",
        f"inDegrees={'yes' if degrees else 'no'}",
        "DataType=double",
        "",
        *_UNITS,
        "",
        "endheader",
        "\t".join(labels),
    ]
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write("\n".join(header) + "\n")
        writer = csv.writer(file, delimiter="\t", lineterminator="\n")
        write_numbers(writer.writerows, list(columns.values()), report)


def side_of(recording: Recording) -> tuple[str, str]:
    """("right" or "left", a note): the simulated side where it was stated, else the recorded walker's."""
    leg = recording.described["leg"]
    if leg.get("directions", _ANKLE) != _ANKLE:
        problem = "has no ankle, and OpenSim's coordinates are of a person"
        allowed = "sto, csv, mat or mjb for a run of this"
        raise InputError(problem, field="leg", value=leg.get("name"), allowed=allowed)
    stated, own = recording.described.get("side"), leg.get("side", "right")
    if stated or own == "left" or not recording.described.get("gait"):
        return stated or own, ""
    try:
        return persons_stride(recording.scenario).side, ""
    except InputError as error:
        return "right", f"the right side is taken: the recorded walking cannot be read any more ({error})"
