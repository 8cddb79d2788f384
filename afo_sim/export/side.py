"""The side of the leg that ran."""

from afo_sim.common.errors import InputError
from afo_sim.description.reader import load
from afo_sim.model.person import persons_stride
from afo_sim.simulation.recording import Recording

ANKLE = ["dorsiflexion", "plantarflexion"]  # directions of a leg's joint that is an ankle


def side_of(recording: Recording) -> tuple[str, str]:
    """("right" or "left", a note): the side of the recorded walker; right where nobody walks.

    Raises
    ------
    InputError
        What ran is no leg.
    """
    leg = recording.scenario["leg"]
    if leg.get("directions", ANKLE) != ANKLE:
        raise InputError(
            "has no ankle, and OpenSim's coordinates are of a person",
            field="leg",
            value=leg.get("name"),
            allowed="sto, csv, mat or mjb for a run of this",
        )
    if not recording.scenario.get("gait"):
        return "right", ""
    try:
        return persons_stride(load("scenario", recording.scenario)).side, ""
    except InputError as error:
        return "right", f"the right side is taken: the recorded walking cannot be read any more ({error})"
