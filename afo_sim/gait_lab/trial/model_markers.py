"""Markers of an OpenSim model in a trial: matched by name, compared by distance."""

import re
from collections import defaultdict
from collections.abc import Mapping
from itertools import combinations

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait_lab.readers.markers import Markers
from afo_sim.gait_lab.readers.opensim_model import OpenSimModel

SCALE = 0.05  # difference in length that a scaled model has not (assumed)
APART = 0.03  # least distance of two markers that tells a scale [m] (assumed)


def match_markers(model: OpenSimModel, markers: Markers) -> dict[str, np.ndarray]:
    """Paths of the model's markers in the trial, by the model's names [m] (n, 3).

    Names match whatever their case and punctuation, and whatever stands before a colon.
    """
    trial: dict[str, str] = {}
    for name in markers.positions:
        trial.setdefault(_plain(name), name)
    found = {}
    for name in model.markers:
        there = name if name in markers.positions else trial.get(_plain(name))
        if there is not None and np.isfinite(markers.positions[there]).any():
            found[name] = markers.positions[there]
    if not found:
        own = ", ".join(model.markers) or "none at all"
        problem = f"has no marker of the model {model.file.name}; the model's are {own}"
        raise InputError(problem, file=markers.file, value=", ".join(markers.positions))
    return found


def name_warnings(model: OpenSimModel, markers: Markers) -> tuple[str, ...]:
    """A warning where two markers of the trial have the name of one of the model's: two people's, perhaps."""
    of_name = defaultdict(list)
    for name in markers.positions:
        of_name[_plain(name)].append(name)
    lines = []
    for name in model.markers:
        there = of_name[_plain(name)]
        if len(there) > 1 and name not in markers.positions:
            lines.append(f"{' and '.join(there)} are both the model's {name}; {there[0]} was taken")
    return tuple(lines)


def scale_warnings(model: OpenSimModel, seen: Mapping[str, np.ndarray]) -> tuple[str, ...]:
    """A warning where distances between markers of one body are not the model's.

    Units: seen [m] (n, 3).
    """
    of_body = defaultdict(list)
    for name in seen:
        of_body[model.markers[name][0]].append(name)
    ratios = []
    for pair in (pair for names in of_body.values() for pair in combinations(names, 2)):
        there = np.linalg.norm(seen[pair[0]] - seen[pair[1]], axis=1)
        here = float(np.linalg.norm(model.markers[pair[0]][1] - model.markers[pair[1]][1]))
        if here > APART and np.isfinite(there).any():
            ratios.append(float(np.nanmedian(there)) / here)
    if not ratios or abs(np.median(ratios) - 1.0) <= SCALE:
        return ()
    ratio = float(np.median(ratios))
    return (
        f"the trial's markers lie {ratio:.3g} times as far apart as the model's (median of {len(ratios)}"
        " pairs, each on one body): is this the person's scaled model?",
    )


def _plain(name: str) -> str:
    return re.sub("[^a-z0-9]", "", name.split(":")[-1].lower())
