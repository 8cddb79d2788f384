"""What a trial was imported to: a gait cycle with all that it was cut from, and the checks that were made."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from afo_sim.common import Notice
from afo_sim.gait import GaitCycle
from afo_sim.gait_lab.noted import Noted
from afo_sim.gait_lab.trial.body_mass import BodyMass
from afo_sim.gait_lab.trial.files import WalkingTrial
from afo_sim.gait_lab.trial.ground_force import GroundForce
from afo_sim.gait_lab.trial.leg_motion import LegMotion
from afo_sim.gait_lab.trial.leg_points import LegPoints
from afo_sim.gait_lab.trial.newton import Newton
from afo_sim.gait_lab.trial.recorded_stride import RecordedStride
from afo_sim.gait_lab.trial.walking_frame import WalkingFrame


@dataclass(frozen=True)
class Check:
    """One fault that was looked for, for a table: what was found, and what is allowed."""

    fault: str
    found: str = ""
    limit: str = ""
    needs: str = ""  # what it takes to be checked, where that is not there
    notice: Notice | None = None  # where it is doubted

    @property
    def verdict(self) -> str:
        """passed, DOUBTED, or not checked with what is needed."""
        return f"not checked: needs {self.needs}" if self.needs else "DOUBTED" if self.notice else "passed"


@dataclass(frozen=True, eq=False)
class Imported(Noted):
    """A gait cycle with what it was cut from."""

    cycle: GaitCycle
    chosen: tuple[int, ...]  # which strides the cycle is; several: their mean
    strides: tuple[RecordedStride, ...]  # all that were found, the right leg's first
    cycles: tuple[GaitCycle, ...]  # one for each stride; forces are NaN where no plate lay
    band: Mapping[str, np.ndarray] | None  # standard deviation over the strides of `chosen`'s sides, by field
    legs: Mapping[str, LegPoints]
    motions: Mapping[str, LegMotion]
    grounds: Mapping[str, GroundForce]
    frame: WalkingFrame
    mass: BodyMass
    newton: Newton | str  # what Newton's law says of it, or what that needs
    zero: float  # taken out of the ankle angle [rad]
    reference: np.ndarray | None  # internal ankle moment of a given inverse-dynamics file at the cycle's
    # phases, dorsiflexion positive [N·m/kg] (n,)
    trial: WalkingTrial
    notices: tuple[Notice, ...]
    checks: tuple[Check, ...] = ()  # for faults of the laboratory

    def number(self, index: int) -> int:
        """A stride's number among its side's, from 1."""
        return sum(s.side == self.strides[index].side for s in self.strides[: index + 1])
