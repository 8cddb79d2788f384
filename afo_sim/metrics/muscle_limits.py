"""How close the muscles come to their limits, and how long they last."""

from collections.abc import Mapping, Sequence

import numpy as np

from afo_sim.metrics import peak
from afo_sim.metrics.facts import Run
from afo_sim.metrics.kernel import chambers
from afo_sim.metrics.metric import SAFETY, Found, Of, reported

SWING = 0.1  # of a chamber's highest pressure, by which it must rise and fall for that to be a cycle [-]
FILLED = 1e4  # gauge pressure that a chamber which is filled exceeds [Pa]
BAND = 0.25  # half the height of the band about the middle that a cycle crosses, of the swing [-]
USED = "100 % is the limit; for the muscle that comes closest"
CYCLES = "a cycle is a filling and venting, however partial; a filled muscle has one a stride at least"
BRIEFLY = f"{peak.MEANING}; {USED}"


@reported(
    SAFETY,
    ("muscle_share_of_pressure", "percent", "Highest muscle pressure as a share of its limit", USED),
    ("muscle_share_of_force", "percent", "Highest muscle force as a share of its limit", BRIEFLY),
    ("muscle_share_of_contraction", "percent", "Greatest contraction as a share of its limit", BRIEFLY),
    ("muscle_share_of_stretch", "percent", "Greatest stretch as a share of its limit", BRIEFLY),
    of=Of.RUN,
)
def muscles(run: Run) -> Found:
    """How close muscles come to their limits."""
    if not run.rows:
        return
    shares: dict[str, list[float]] = {"pressure": [], "force": [], "contraction": [], "stretch": []}
    for name, own in (run.facts.muscles or {}).items():
        contraction, step = run.rows[f"muscle/{name}/contraction"], run.facts.timestep
        shares["pressure"].append(float(run.rows[f"chamber/{own.chamber}/pressure"].max()) / own.pressure)
        shares["force"].append(peak.highest_mean(run.rows[f"muscle/{name}/force"], step) / own.force)
        shares["contraction"].append(peak.highest_mean(contraction, step) / own.contraction_max)
        if own.contraction_min < 0.0:  # a braid that may not be stretched at all has no share of it
            shares["stretch"].append(peak.highest_mean(-contraction, step) / -own.contraction_min)
    yield from muscle_metrics(shares)


def muscle_metrics(shares: Mapping[str, Sequence[float]]) -> Found:
    """How close muscles come to their limits."""
    for what, each in shares.items():
        if each:
            yield f"muscle_share_of_{what}", 100.0 * max(0.0, *each)


@reported(
    SAFETY,
    ("muscle_cycles_per_stride", "", "Cycles of the muscles per stride", CYCLES),
    ("strides_until_muscle_life", "", "Strides until the muscles' stated life", CYCLES),
    ("days_until_muscle_life", "d", "Days until the muscles' stated life",
     "at as many strides a day as the limits say"),
    of=Of.RUN,
)  # fmt: skip
def muscle_life(run: Run) -> Found:
    """How long muscles last that are stated to last some number of cycles; of walking alone."""
    limits, number = run.facts.limits, len(run.counted)
    if limits is None or not number or not run.facts.muscles:
        return
    most = max(cycles(run.rows[f"chamber/{name}/pressure"], number) for name in chambers(run.rows))
    yield from life_metrics(most, limits.muscle_life, limits.strides_per_day)


def life_metrics(cycles: float, life: float, strides_per_day: float) -> Found:
    """How long muscles last that are stated to last some number of cycles."""
    yield "muscle_cycles_per_stride", cycles
    if cycles > 0.0:
        yield "strides_until_muscle_life", life / cycles
        if strides_per_day > 0.0:
            yield "days_until_muscle_life", life / cycles / strides_per_day


def cycles(pressure: np.ndarray, strides: int) -> float:
    """How often the muscles of a chamber are filled and vented in a stride."""
    lowest, highest = float(pressure.min()), float(pressure.max())
    if highest <= FILLED:
        return 0.0
    swing, middle = highest - lowest, 0.5 * (lowest + highest)
    if swing < SWING * highest:
        return 1.0
    high = pressure[np.abs(pressure - middle) >= BAND * swing] > middle
    risen = int(np.count_nonzero(high & ~np.roll(high, 1)))  # the last row comes before the first
    return max(1.0, risen / strides)
