"""The calf's share of a stride's positive work, on each shipped stride, by sagittal inverse dynamics.

Assumed: an average person's segments (Winter 2009, table 4.1 and figure 4.1), the foot's mass at the ankle,
and a trunk that does not turn.
"""

import numpy as np

from afo_sim.common import GRAVITY, assets
from afo_sim.description import MASS_SHARES
from afo_sim.gait import Chain, GaitCycle, stance
from afo_sim.gait.file import read
from afo_sim.metrics import HEEL_RISE

CENTRES = {"shank": 0.567, "thigh": 0.567}  # from the distal joint, of the length
GYRATION = {"shank": 0.302, "thigh": 0.323}  # about the centre of mass, of the length
PHASE = np.linspace(0.0, 1.0, 2001)


def joint_powers(cycle: GaitCycle) -> dict[str, np.ndarray]:
    """Power of ankle, knee and hip over PHASE, per body mass [W/kg], each (n,)."""
    assert cycle.body_height is not None
    angles = {n: [cycle.signal(f"{n}_angle", PHASE, k) for k in range(3)] for n in ("shank", "knee", "ankle")}
    angles["thigh"] = [shank - knee for shank, knee in zip(angles["shank"], angles["knee"], strict=True)]
    lengths = Chain.of_height(cycle.body_height)
    forward, upward, _ = cycle.ground(PHASE)
    acceleration = cycle.signal("ankle_x", PHASE, 2) + 1j * cycle.signal("ankle_z", PHASE, 2)
    pull = GRAVITY * (forward + 1j * upward)  # of what is below
    pull -= MASS_SHARES["foot"] * (acceleration + 1j * GRAVITY)
    below = np.interp(PHASE, cycle.phase, cycle.ankle_moment)  # moment of what is below, forward positive
    powers = {"ankle": below * angles["ankle"][1]}
    for name, joint, above in (("shank", "knee", angles["thigh"][1]), ("thigh", "hip", 0.0)):
        lean, rate, turning = angles[name]
        mass, length = MASS_SHARES[name], getattr(lengths, name)
        along, moved = 1j * np.exp(-1j * lean), np.exp(-1j * lean) * (turning - 1j * rate**2)
        centre = CENTRES[name] * length
        weight = mass * (acceleration + centre * moved + 1j * GRAVITY) - pull  # force at the upper joint
        # moments of the forces about the centre of mass, forward lean positive
        levers = (np.conj(centre * along) * pull - np.conj((length - centre) * along) * weight).imag
        moment = mass * (GYRATION[name] * length) ** 2 * turning - below - levers
        powers[joint] = moment * (rate - above)
        acceleration, pull, below = acceleration + length * moved, -weight, -moment
    return powers


def positive_work(cycle: GaitCycle) -> dict[str, float]:
    """Positive work of ankle, knee and hip over the stride, and of push-off, per body mass [J/kg]."""
    powers = joint_powers(cycle)
    powers["push-off"] = np.where((PHASE > HEEL_RISE) & (stance(cycle) > PHASE), powers["ankle"], 0.0)
    positive = {name: np.maximum(power, 0.0) for name, power in powers.items()}
    return {n: float(np.trapezoid(power, cycle.stride_time * PHASE)) for n, power in positive.items()}


def calf_share(name: str) -> float:
    """The ankle's positive work in push-off over that of ankle, knee and hip in a shipped stride [%]."""
    work = positive_work(read(assets.find_gait(name)))
    return 100.0 * work["push-off"] / (work["ankle"] + work["knee"] + work["hip"])
