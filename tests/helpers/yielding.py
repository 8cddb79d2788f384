"""Sitting runs whose cuff and plate give, and whose do not."""

import afo_sim
from afo_sim.simulation import Recording

STIFFNESS = {"shank": 4000.0, "foot": 20000.0}  # [N/m]


def yielding_run() -> Recording:
    """S1's orthosis on a cuff and a plate that give."""
    mounted = {f"orthosis.anchor.{a}.stiffness": f"{k:g} N/m" for a, k in STIFFNESS.items()}
    return afo_sim.run("seated", {"duration": "8 s", **mounted})


def rigid_run(duration: str = "1 s") -> Recording:
    """S1's orthosis on a cuff and a plate that do not."""
    scenario = afo_sim.load("scenario", "seated", {"duration": duration}).resolved()
    del scenario["orthosis"]["anchor"]
    return afo_sim.run(scenario)
