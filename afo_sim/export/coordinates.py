"""A run's joint angles as OpenSim's coordinates, and its ground force as OpenSim's external load.

OpenSim's axes are x forward, y up, z to the right; this project's z, which is up, is its y. In Gait2392
ankle_angle_r turns the foot about (-0.105, -0.174, 0.979) of the tibia and mtp_angle_r the toes about
(-0.581, 0, 0.814) of the foot: from forward to up, so that dorsiflexion and extension are positive, as here.
subtalar_angle_r turns the foot about (0.787, 0.605, -0.121) of the talus, subtalar_angle_l about
(-0.787, -0.605, -0.121): inversion is positive on both sides, as here.
(Gait2392_Simbody/gait2392_simbody.osim of opensim-org/opensim-models.) In the Rajagopal models the toes' axis
points to the left, and their mtp_angle_r is positive in flexion.
"""

from collections.abc import Mapping
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from afo_sim.export.rows import TIME, Rows

ANKLE, TOES, SUBTALAR = "ankle/angle", "toe/extension", "subtalar/angle"
FORWARD, UP, PLACE = "ground/force/x", "ground/force/z", "ground/position/x"
ALONG, HEIGHT, MOMENT = "ankle/position/x", "ankle/position/z", "ankle/moment/ground"
LOADS = (FORWARD, UP, PLACE, ALONG, HEIGHT, MOMENT)
NEEDED = (ANKLE, TOES, SUBTALAR, *LOADS)
FORCE, POINT, TORQUE = "ground_force_v", "ground_force_p", "ground_torque_"
AXES = "xyz"


def coordinates(rows: Rows, side: str) -> dict[str, np.ndarray]:
    """{coordinate of OpenSim: values [deg]}: `time` [s], ankle_angle_r, subtalar_angle_r, mtp_angle_r."""
    found = {TIME: rows.columns[TIME]}
    for column, name in ((ANKLE, "ankle_angle"), (SUBTALAR, "subtalar_angle"), (TOES, "mtp_angle")):
        if column in rows.columns:
            found[f"{name}_{side[0]}"] = np.degrees(rows.columns[column])
    return found


def ground_loads(rows: Rows) -> dict[str, np.ndarray]:
    """{OpenSim's label: values}, after `time`: force [N], its point [m] and moment [N·m]; {} without them.

    The walk is in the plane x–y: force and point across it are 0, and the point is on the floor. About z,
    across the plane, stands what the run's own moment M of the ground about the ankle has beyond that of the
    force at its point: M − ((px − ax)·Fy + ay·Fx). It is nothing where the recorded force acts. In contact
    the foot is pressed otherwise than recorded, and the moment would be another one without it.
    """
    if not set(LOADS) <= set(rows.columns):
        return {}
    forward, up, place, along, height, moment = (rows.columns[name] for name in LOADS)
    given: Mapping[str, np.ndarray] = {
        f"{FORCE}x": forward,
        f"{FORCE}y": up,
        f"{POINT}x": place,
        f"{TORQUE}z": moment - ((place - along) * up + height * forward),
    }
    none = np.zeros(len(rows.columns[TIME]))
    labels = [f"{quantity}{axis}" for quantity in (FORCE, POINT, TORQUE) for axis in AXES]
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
