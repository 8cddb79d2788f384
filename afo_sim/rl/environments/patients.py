"""Patients, devices and sensors by number: whoever asks for the same number gets the same."""

import math
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from afo_sim.common import InputError

TRAINING = "training"
POOLS = {TRAINING: range(64), "held-out": range(1000, 1032)}
USUAL = -1  # the scenario's own patient, with sensors that have noise alone
DELAYS = 4  # delays of the sensors in control periods are below it


class Sensors(NamedTuple):
    """Errors of a device's sensors: offset and noise (6,), as observed; delay in control periods."""

    offset: np.ndarray
    noise: np.ndarray
    delay: int


def numbers_of(patients: str | Iterable[int]) -> list[int]:
    """Numbers of a pool by its name, or as given; InputError where there is none."""
    if isinstance(patients, str) and patients in POOLS:
        return list(POOLS[patients])
    found = list(patients) if isinstance(patients, Iterable) and not isinstance(patients, str) else [None]
    if not found or not all(isinstance(k, int | np.integer) and k >= 0 for k in found):
        allowed = f"{', '.join(map(repr, POOLS))}, or whole numbers from 0 on"
        raise InputError("are no patients", field="patients", value=patients, allowed=allowed)
    return found  # type: ignore[return-value]


def patient(number: int) -> tuple[Mapping[str, Any], Sensors]:
    """A patient in a device: dotted keys over the scenario, and what the sensors err by."""
    noise = np.array([math.radians(0.1), math.radians(0.05), 0.0, 0.0, 780.0, 780.0])
    if number == USUAL:
        return {}, Sensors(np.zeros(6), noise, 0)
    random = np.random.default_rng([number, 1])

    def normal(mean: float, sd: float, low: float, high: float) -> float:
        return float(np.clip(random.normal(mean, sd), low, high))

    def spread(median: float, sd: float, low: float, high: float) -> float:
        return math.exp(normal(math.log(median), sd, math.log(low), math.log(high)))

    flow = math.exp(random.uniform(0.0, math.log(5.0)))  # S1's valves to five times as wide
    sets = {
        "patient.body_mass": f"{normal(50.0, 7.0, 38.0, 65.0)} kg",
        "patient.body_height": f"{normal(1.58, 0.07, 1.45, 1.72)} m",
        "patient.dorsiflexor_strength": random.uniform(0.0, 0.15),
        "patient.plantarflexor_strength": random.uniform(0.7, 1.0),
        "patient.passive_scale": spread(0.6, 0.5, 0.2, 2.0),
        "patient.passive_offset": f"{normal(0.0, 3.6, -7.2, 7.2)} deg",
        "gait.speed": f"{random.uniform(0.95, 1.35)} m/s",
        "supply.pressure": f"{random.uniform(4.0, 5.0)} bar",
        "orthosis.anchor.shank.stiffness": f"{math.exp(random.uniform(math.log(5.0), math.log(12.0)))} kN/m",
        "orthosis.muscle.dorsiflexor.link_length": f"{112.0 + normal(0.0, 2.0, -4.0, 4.0)} mm",
    }
    for valve in ("inlet", "outlet"):
        own = spread(0.055 * flow, 0.1, 0.04, 0.4)
        for chamber in ("dorsiflexor", "plantarflexor"):
            sets[f"orthosis.chamber.{chamber}.{valve}.conductance"] = f"{own} dm^3/(s*bar)"
    tilt, gyro, pressure = math.radians(2.0), math.radians(0.5), 2e3  # mounting, zero rate, zero
    offset = random.normal(0.0, (tilt, gyro, 0.0, 0.0, pressure, pressure))
    return sets, Sensors(offset, noise, int(random.integers(1, DELAYS)))
