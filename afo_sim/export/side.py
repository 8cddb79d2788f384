"""The side of the leg that ran."""

from afo_sim.common.errors import InputError
from afo_sim.description.reader import load
from afo_sim.model.person import persons_stride
from afo_sim.simulation.recording import Recording

ANKLE = ["dorsiflexion", "plantarflexion"]  # directions of a leg's joint that is an ankle


def side_of(recording: Recording) -> tuple[str, str]:
    """("right" or "left", a note): the simulated side where it was told, else the recorded walker's.

    It was told by the scenario's `side`, or by a leg that is a left one. Where nobody walks, it is the leg's.
    """
    leg = recording.scenario["leg"]
    if leg.get("directions", ANKLE) != ANKLE:
        raise InputError(
            "has no ankle, and OpenSim's coordinates are of a person",
            field="leg",
            value=leg.get("name"),
            allowed="sto, csv, mat or mjb for a run of this",
        )
    told, own = recording.scenario.get("side"), leg.get("side", "right")
    if told or own == "left" or not recording.scenario.get("gait"):
        return told or own, ""
    try:
        return persons_stride(load("scenario", recording.scenario)).side, ""
    except InputError as error:
        return "right", f"the right side is taken: the recorded walking cannot be read any more ({error})"
