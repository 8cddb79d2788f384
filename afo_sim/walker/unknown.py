"""Falls in simulation over what is not known of a patient: drawn, never chosen."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.common import InputError
from afo_sim.description import Scenario
from afo_sim.model import person_of
from afo_sim.walker.body import BARE, build_body
from afo_sim.walker.gait_file import Gait
from afo_sim.walker.respond import Falls, falls_of, strengths_of

MOST_DRAWS = 1000
TISSUE = math.sqrt(math.log(1.0 + 0.57**2))  # of ln of the passive stiffness, from a variation of 57 %
DRAWN = {
    "patient.passive_scale": "lognormal, 57 % between people (Chung et al. 2004)",
    "strength": "each dead or weak muscle 0 to 0.1 stronger, plantarflexors 0.8 to 1 (assumed)",
    "patient.body_mass": "10 % to either side (assumed)",
    "orthosis.anchor.shank.stiffness": "2 to 8 kN/m (assumed; no calf cuff was measured)",
}


@dataclass(frozen=True, eq=False)
class Band:
    """Falls of each draw, by case."""

    draws: Mapping[str, np.ndarray]
    falls: Mapping[str, tuple[Falls, ...]]

    def shares(self, case: str) -> np.ndarray:
        """Share of starts that fell in each draw (n,)."""
        return np.array([each.count / each.of for each in self.falls[case]])

    def range(self, case: str) -> tuple[float, float, float]:
        """5, 50 and 95 % of the draws' shares [-]."""
        low, middle, high = np.percentile(self.shares(case), (5.0, 50.0, 95.0))
        return float(low), float(middle), float(high)


def draw_falls(
    scenario: Scenario,
    gaits: Mapping[str, Gait],
    *,
    draws: int,
    starts: int,
    push: float = 50.0,
    strength: Mapping[str, float] | None = None,
    seed: int = 0,
    threads: int = 2,
    report: Callable[[float], None] | None = None,
) -> Band:
    """Falls among perturbed starts, over drawn patients; both cases have the same draws and starts."""
    if not 1 <= draws <= MOST_DRAWS:
        raise InputError("is out of range", field="draws", value=draws, allowed=f"1 to {MOST_DRAWS}")
    rng, own = np.random.default_rng([seed, 7]), strengths_of(scenario, strength)
    assert scenario.patient is not None
    mass = person_of(scenario).body_mass
    drawn = {
        "tissue": rng.lognormal(-0.5 * TISSUE**2, TISSUE, draws),
        "stronger": rng.uniform(0.0, 0.1, draws),
        "plantarflexors": rng.uniform(0.8, 1.0, draws),
        "mass": rng.uniform(0.9, 1.1, draws),
        "cuff": rng.uniform(2e3, 8e3, draws),
    }
    bare = scenario.set(BARE)
    falls: dict[str, list[Falls]] = {case: [] for case in gaits}
    for k in range(draws):
        sets: dict[str, Any] = {
            "patient.passive_scale": float(scenario.patient.passive_scale * drawn["tissue"][k]),
            "patient.body_mass": f"{float(mass * drawn['mass'][k])!r} kg",
        }
        cuff = {"orthosis.anchor.shank.stiffness": f"{float(drawn['cuff'][k])!r} N/m"}
        shares = {name: min(share + float(drawn["stronger"][k]), 1.0) for name, share in own.items()}
        for name in ("soleus", "gastrocnemius"):
            shares[name] = shares.get(name, 1.0) * float(drawn["plantarflexors"][k])
        for case, gait in gaits.items():
            wearing = bare.set(sets) if case == "patient" else scenario.set(sets | cuff)
            body = build_body(wearing, shares)
            falls[case].append(falls_of(body, gait, starts=starts, push=push, seed=seed, threads=threads))
        if report is not None:
            report((k + 1) / draws)
    return Band(drawn, {case: tuple(found) for case, found in falls.items()})
