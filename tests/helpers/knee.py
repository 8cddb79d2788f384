"""The published pin knee as an orthosis: its muscle between femur and tibia; flexion is positive."""

import numpy as np

from afo_sim.description import Orthosis, reader
from afo_sim.lab import FEMUR_ANCHOR, FITTINGS, PIN, TIBIA_ANCHOR, KneeTest, knee_tests


def knee_orthosis(test: KneeTest) -> Orthosis:
    """A test's muscle as a flexor."""
    forward, up = map(float, np.subtract(FEMUR_ANCHOR, PIN))
    table = {
        "name": f"pin_knee_{test.name}",
        "joint": "knee",
        "range_of_motion": ["-20 deg", "120 deg"],
        "muscle": {
            "flexor": {
                "count": 1,
                "type": test.muscle.model_dump(mode="json", exclude_none=True),
                "origin": {"segment": "proximal", "from_joint": [f"{forward} m", "0 m", f"{up} m"]},
                "insertion": {
                    "segment": "distal",
                    "from_joint": [f"{TIBIA_ANCHOR[0]} m", "0 m", f"{TIBIA_ANCHOR[1]} m"],
                },
                "link_length": f"{FITTINGS + test.tendon} m",
            }
        },
        "chamber": {
            "flexor": {"inlet": "mh1", "outlet": "mh1", "tube_volume": "4 ml", "wall_conductance": "0.5 W/K"}
        },
    }
    return reader.load("orthosis", table)


def knee_data() -> dict[str, list[object]]:
    """The 185 published torques, a group for each test; published extension positive."""
    found: dict[str, list[object]] = {
        key: [] for key in ("group", "angle [rad]", "pressure [Pa]", "torque [N*m]")
    }
    for name, test in knee_tests().items():
        found["group"] += [name] * len(test)
        for key, values in zip(list(found)[1:], (-test.angle, test.pressure, -test.torque), strict=True):
            found[key] += values.tolist()
    return found
