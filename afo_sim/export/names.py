"""Names of columns as other programs take them."""

import re
from collections.abc import Iterable

LONGEST = 63  # of a MATLAB name (namelengthmax)


def legal_names(names: Iterable[str]) -> dict[str, str]:
    """{name: the same in letters, digits and underscores, different from all others}.

    A space splits a label in OpenSim's Storage, and a slash makes it a path to a component of a model; MATLAB
    allows neither. "muscle/dorsiflexor_1/force" is muscle_dorsiflexor_1_force.
    """
    found: dict[str, str] = {}
    taken: set[str] = set()
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_")
        plain = plain if re.match("[A-Za-z]", plain) else f"x_{plain}"
        legal, number = plain[:LONGEST], 2
        while legal.lower() in taken:
            ending = f"_{number}"
            legal, number = plain[: LONGEST - len(ending)] + ending, number + 1
        taken.add(legal.lower())
        found[name] = legal
    return found
