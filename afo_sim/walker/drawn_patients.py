"""Patients drawn over what is not known of one: numbers, corners, and the bodies that they are."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from afo_sim.description import Scenario
from afo_sim.model import person_of
from afo_sim.walker.body import BARE

PLANTARFLEXORS = ("soleus", "gastrocnemius")
TISSUE = math.sqrt(math.log(1.0 + 0.57**2))  # of ln of the passive stiffness, from a variation of 57 %
NEAR = 0.1  # to either side of a share that is stated [-]
DRAWN = {
    "tissue": "passive stiffness over the stated: lognormal, 57 % between people (Chung et al. 2004)",
    "plantarflexors": "0.8 to 1 of the stated share (assumed)",
    "tibialis": "and each weak muscle: 0.1 to either side of the stated share, within 0 to 1 (assumed)",
    "mass": "10 % to either side (assumed); without a device only the push tells a mass from another",
    "height": "5 % to either side (assumed)",
    "cuff": "2 to 8 kN/m along the shank (assumed; no calf cuff was measured)",
}


def draw_patients(
    scenario: Scenario, own: Mapping[str, float], draws: int, seed: int
) -> tuple[dict[str, np.ndarray], dict[str, dict[str, float]], list[dict[str, float]]]:
    """Numbers of drawn patients (draws,), those of corners by name, and each patient's, corners first."""
    stated = {name: share for name, share in own.items() if name not in PLANTARFLEXORS}
    ranges = {name: (max(x - NEAR, 0.0), max(min(x + NEAR, 1.0), x)) for name, x in stated.items()}
    stated["plantarflexors"], ranges["plantarflexors"] = 1.0, (0.8, 1.0)
    rng = np.random.default_rng([seed, 7])
    drawn = {name: rng.uniform(*ends, draws) for name, ends in ranges.items()}
    drawn["tissue"] = rng.lognormal(-0.5 * TISSUE**2, TISSUE, draws)
    drawn["mass"], drawn["height"] = rng.uniform(0.9, 1.1, draws), rng.uniform(0.95, 1.05, draws)
    if "shank" in scenario.orthosis.anchor:
        drawn["cuff"] = rng.uniform(2e3, 8e3, draws)
    words = ", ".join(f"{name} {share:.3g}" for name, share in stated.items())
    stated |= {"tissue": 1.0, "mass": 1.0, "height": 1.0}
    corners = {f"as stated: {words}": stated}
    for name, ends in ranges.items():
        for end in sorted({*ends, 0.0 if stated[name] < 1.0 else ends[0]} - {stated[name]}):
            corners[f"{name} {end:.3g}"] = stated | {name: end}
    each = ({name: float(numbers[k]) for name, numbers in drawn.items()} for k in range(draws))
    return drawn, corners, [*corners.values(), *each]


def as_drawn(
    scenario: Scenario, own: Mapping[str, float], numbers: Mapping[str, float], *, worn: bool
) -> tuple[Scenario, dict[str, float]]:
    """A scenario, and the share left of each muscle, of a patient with some numbers."""
    person, patient = person_of(scenario), scenario.patient
    assert patient is not None
    sets: dict[str, Any] = {
        "patient.passive_scale": patient.passive_scale * numbers["tissue"],
        "patient.body_mass": f"{person.body_mass * numbers['mass']!r} kg",
        "patient.body_height": f"{person.body_height * numbers['height']!r} m",
    }
    if worn and "cuff" in numbers:
        sets["orthosis.anchor.shank.stiffness"] = f"{numbers['cuff']!r} N/m"
    left = {name: own.get(name, 1.0) * numbers["plantarflexors"] for name in PLANTARFLEXORS}
    return (scenario if worn else scenario.set(BARE)).set(sets), {n: numbers.get(n, 1.0) for n in own} | left
