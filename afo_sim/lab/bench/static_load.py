"""S0's static load study of a three-element muscle: contractile force and stiffness over pressure.

At rest L = F_ce(p) − K(p) x: at each pressure the stand's isobaric curve is a straight line over the
shortening x, whose start is F_ce and whose slope is −K. S0 draws F_ce over pressure with its line.
"""

from dataclasses import dataclass

import numpy as np

from afo_sim.lab.bench.trial import Trial

PULLING = 0.02  # of F_ce: below it the muscle goes slack and its curve is no line


@dataclass(frozen=True)
class StaticLoad:
    """F_ce and K at each pressure, and the straight line of F_ce.

    pressure : gauge [Pa] (n,)
    contractile_force : F_ce [N] (n,)
    stiffness : K [N/m] (n,)
    start, slope : F_ce = start + slope p [N], [N/Pa]
    worst : greatest distance of F_ce from its line [N]
    """

    pressure: np.ndarray
    contractile_force: np.ndarray
    stiffness: np.ndarray
    start: float
    slope: float
    worst: float

    @property
    def text(self) -> str:
        """The line, for people."""
        low, high = self.stiffness.min() * 1e-3, self.stiffness.max() * 1e-3
        return (
            f"F_ce = {self.start:.1f} N + {self.slope * 1e3:.3f} N/kPa p (worst {self.worst:.2g} N off), "
            f"K {low:.2f} to {high:.2f} N/mm"
        )


def static_load(trial: Trial) -> StaticLoad:
    """F_ce and K from an isobaric test, as S0 takes them from hung loads.

    Parameters
    ----------
    trial : isobaric, of a muscle whose curves are straight; the mean of the ways up and down is taken
    """
    force, stiffness = [], []
    for k in range(len(trial.curves)):
        loop = trial.loop(k)
        pulls = loop["force"] > PULLING * loop["force"].max()
        shortening = trial.plan.muscle.nominal_length * loop["contraction"][pulls]
        slope, start = np.polyfit(shortening, loop["force"][pulls], 1)
        force.append(start)
        stiffness.append(-slope)
    pressure, contractile = trial.plan.set_points, np.array(force)
    slope, start = np.polyfit(pressure, contractile, 1) if len(pressure) > 1 else (0.0, contractile[0])
    worst = float(np.abs(start + slope * pressure - contractile).max())
    return StaticLoad(pressure, contractile, np.array(stiffness), float(start), float(slope), worst)
