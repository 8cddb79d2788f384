"""Walks on a shipped walker's stride, and the phase that is estimated in them."""

from dataclasses import dataclass

import numpy as np
from documents import script

from afo_sim.control import PhaseEstimate
from afo_sim.description import Gait
from afo_sim.model import phase_at

table = script("phase_table")
apart = table.phase_events.apart
PERIOD, STEP = 0.01, 0.001  # of the controller; age of a sample [s]
STRIDES, LEARNT = 14.0, 2.0  # that are walked; after which it counts
NOISE = np.radians(0.5)
STOPS, STANDS = 4.3, 3.0  # stride in which the walker stops [-], and for how long [s]
STANCE_FORCE = 0.05  # upward force at which a switch under the heel closes [body weights]
ALONE, CALIBRATED, ALWAYS = 0.0, 4.0, np.inf  # strides in which there is a foot switch
CONDITIONS = ("even", "5 % varied", "a stop", "cadence × 1.2, × 0.8")


@dataclass(frozen=True, eq=False)
class Estimated:
    """A walk and its estimate at every command (n,).

    time [s]; walked and phase, true (with whole strides) and estimated; shank [rad], as sampled; stopped, as
    found; counts, what is judged.
    """

    time: np.ndarray
    walked: np.ndarray
    phase: np.ndarray
    shank: np.ndarray
    stopped: np.ndarray
    counts: np.ndarray

    @property
    def error(self) -> np.ndarray:
        """Estimated less true phase, of the cycle (n,)."""
        return apart(self.phase, self.walked)


def estimated(
    walker: str,
    condition: str = "even",
    *,
    switch: float = ALONE,
    noise: float = 0.0,
    seed: int = 0,
    period: float = PERIOD,
    age: float = STEP,
    lead: float = 0.0,
) -> Estimated:
    """Walk, and estimate the phase from the shank's angle.

    Parameters
    ----------
    walker : of `walkers`
    condition : of `CONDITIONS`
    switch : strides in which a foot switch tells the heel strikes
    noise : standard deviation of the angle's samples [rad]
    seed : of the stride times and of the noise
    period : of the samples [s]
    age : of a sample when it is used [s]
    lead : that the estimator is told [s]
    """
    cycle = table.cycle(walker)
    gait = Gait.model_validate({"cycle": walker} | _set(condition, seed, cycle.stride_time))
    stands = STANDS if condition == "a stop" else 0.0
    time = np.arange(0.0, STRIDES * cycle.stride_time + stands, period)
    walked = phase_at(gait, cycle.stride_time, time)
    sampled = phase_at(gait, cycle.stride_time, time - age)
    shank = cycle.signal("shank_angle", sampled)
    shank = shank + noise * np.random.default_rng(1000 + seed).standard_normal(len(time))
    loaded = cycle.ground(sampled)[1] > STANCE_FORCE
    struck = np.append(False, loaded[1:] & ~loaded[:-1]) & (walked < switch)
    phase, _, stopped, _ = table.followed(shank, struck, period=period, estimate=PhaseEstimate(lead))
    counts = walked >= (CALIBRATED if switch == CALIBRATED else LEARNT)
    if stands:  # and two strides from where the walker goes on
        onward = walked[np.searchsorted(time, STOPS * cycle.stride_time + stands)]
        counts &= (walked < STOPS) | (walked >= onward + LEARNT)
    return Estimated(time, walked, phase, shank, stopped > 0.0, counts)


def _set(condition: str, seed: int, stride: float) -> dict[str, object]:
    """What a condition sets, of strides of a duration [s]."""
    if condition == "5 % varied":
        return {"variability": 0.05, "seed": seed}
    if condition == "a stop":
        return {"pace": [[f"{STOPS * stride} s", 0.0], [f"{STOPS * stride + STANDS} s", 1.0]]}
    if condition == CONDITIONS[3]:
        return {"pace": [[f"{3.0 * stride} s", 1.2], [f"{7.0 * stride} s", 0.8]]}
    return {}


def worst(walker: str, condition: str, *, switch: float, noise: float, seeds: int = 3) -> tuple[float, float]:
    """The largest and the root mean square error [% of the cycle] of what counts, the worst of the seeds."""
    random = noise > 0.0 or condition == "5 % varied"
    found = []
    for seed in range(seeds if random else 1):
        trial = estimated(walker, condition, switch=switch, noise=noise, seed=seed)
        error = 100.0 * np.abs(trial.error[trial.counts])
        found.append((float(error.max()), float(np.sqrt(np.mean(error**2)))))
    return max(most for most, _ in found), max(rms for _, rms in found)
