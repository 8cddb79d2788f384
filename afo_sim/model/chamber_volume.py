"""The least volume of a chamber."""

import math

from afo_sim.description import Orthosis
from afo_sim.model.air_path import half_of_tubes


def least_volume(orthosis: Orthosis, name: str) -> float:
    """Volume of a chamber whose muscles are straight tubes: tubes, dead volumes, bores [m³]."""
    chamber, muscles = orthosis.chamber[name], orthosis.muscles_of(name).values()
    volume = chamber.tube_volume + half_of_tubes(orthosis, name)
    volume += sum(g.count * g.type.dead_volume for g in muscles)
    volume += sum(g.count * g.type.nominal_length * math.pi * g.type.bore**2 / 4.0 for g in muscles)
    return volume
