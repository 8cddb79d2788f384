"""A scenario as it is described: leg, supply, valve timing and, for walking, gait and patient.

Frozen descriptions, checked at birth, SI inside; `reader.py` reads them from TOML. Angles are
dorsiflexion positive, pressures gauge.
"""

import math
import re
from collections.abc import Callable, Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from afo_sim.common import JsonDict, JsonMapping, nearest_name
from afo_sim.description.air.supplied import check_supplied, check_switched, check_three_way
from afo_sim.description.air.supply import Supply
from afo_sim.description.attachment import Side
from afo_sim.description.control.controller import ControllerDescription
from afo_sim.description.control.drive import Drive
from afo_sim.description.control.sensor import Sensor
from afo_sim.description.control.switching import Phases, PositiveTime, Timer
from afo_sim.description.joint import a_joint
from afo_sim.description.leg import Leg, Shoe
from afo_sim.description.orthosis import Orthosis
from afo_sim.description.quantity import Described, Named, Quantity, refusal
from afo_sim.description.walking import Gait, Ground, Limits, Patient, Start

_Moment = Annotated[float, Quantity("N*m", at_least=-1e3, at_most=1e3)]

_DEFAULT_RATE = 1000.0  # rows of a recording a second, where the step allows it [Hz]
_SLIGHTLY = 0.01  # by which the highest rate may be exceeded: a step may be adjusted to a stride [-]
MAX_STEPS = 20_000_000  # steps of one run: about 10 GB of rows


class Shank(Described):
    """Fixation of the shank, or of the segment above another joint; the knee angle is the passive ankle's."""

    pose: Literal["fixed", "driven"] = "fixed"
    """Fixed in space, or driven by recorded walking."""
    knee_angle: Annotated[float, Quantity("rad", at_least=0.0, at_most=2.8)] | None = None
    """Knee flexion of a fixed shank; the tissue's moment depends on it."""

    def _must_have_a_knee(self) -> None:
        if self.pose == "driven" and self.knee_angle is not None:
            raise refusal("follows from the gait where the shank is driven", "nothing", "knee_angle")


class Scenario(Named):
    """One complete simulation: leg, orthosis, patient, supply, valve times, duration; SI inside.

    `load("scenario", …)` reads one, `set` changes it, `run` simulates it.

    Examples
    --------
    >>> seated = load("scenario", "seated")
    >>> seated.duration, list(seated.orthosis.muscle)
    (16.0, ['dorsiflexor', 'plantarflexor'])
    """

    name: str = ""
    """Name of the run's folder; the file's by default."""
    duration: PositiveTime
    """Simulated time."""
    leg: Leg
    """Leg: a shipped name, or the path of a leg's TOML file or folder."""
    orthosis: Orthosis
    """Orthosis: a shipped name, or the path of an orthosis' TOML file or folder."""
    side: Side | None = None
    """Leg that is simulated; the leg's own side by default. Leg and orthosis of the other side are
    mirrored."""
    worn_on: Literal["one", "both"] = "one"
    """Legs that wear the orthosis; both, each with air of its own, of the responding walker alone."""
    timestep: Annotated[float, Quantity("s", at_least=1e-6, at_most=0.01)] = 0.001
    """Step of the integration."""
    record_rate: Annotated[float, Quantity("Hz", above=0.0, at_most=1e6)] | None = None
    """Rows of the recording a second, a whole fraction of the step rate; the highest one up to 1 kHz by
    default."""
    callback: Literal["native", "python"] = "native"
    """Compiled muscles, or the same in plain Python, much slower, to look inside."""
    supply: Supply
    """Compressed air."""
    shank: Shank = Shank()
    """Fixation of the shank; that of the segment above another joint is fixed."""
    load_moment: _Moment = 0.0
    """Constant moment about the joint, against positive angles."""
    timer: Timer | None = None
    """Valves switched by a clock; or phases."""
    phases: Phases | None = None
    """Valves switched by gait phase; or a timer. Walking only."""
    controller: ControllerDescription | None = None
    """Electronics that close the loop; instead of timer and phases."""
    drive: dict[str, Drive] = Field(default={})
    """Pressure drives by chamber; without one its valves are switched directly."""
    sensor: dict[str, Sensor] = Field(default={})
    """Sensors by name; a controller reads them as "sensor/<name>"."""
    gait: Gait | None = None
    """Recorded walking that drives the shank. Walking only."""
    patient: Patient | None = None
    """Patient: a shipped name, or the path of a patient's TOML file or folder. Walking only."""
    ground: Ground | None = None
    """Ground under the foot. Walking only."""
    shoe: Shoe | None = None
    """Shoe: a shipped name, or the path of a shoe's TOML file or folder; barefoot by default. An orthosis
    with an outsole of its own is worn instead of it. Walking only."""
    start: Start | None = None
    """Air before the first step; none by default. Walking only."""
    reference: Literal["barefoot", "shoe", "orthosis-off"] | None = None
    """What the same patient's run is compared with: barefoot, in the shoe, or with the orthosis and no air.
    Walking only."""
    limits: Limits | None = None
    """Limits of verdict and safety margins: a shipped name, or the path of a limits TOML file or folder; the
    usual ones by default."""

    # filled by `reader`, which follows names; a description reads no files
    with_keys: ClassVar[Callable[["Scenario", JsonMapping], "Scenario"]]

    def set(self, sets: Mapping[str, object]) -> "Scenario":
        """A copy with dotted keys set, checked like a file.

        Parameters
        ----------
        sets : keys as `--set` takes them ("supply.pressure", "phases.dorsiflexor.inlet[0][1]") and their
            values: text with a unit, a bare number where there is none, a name, or a description such as
            a Muscle

        Raises
        ------
        InputError
            There is no such key, or the value is out of range, has no unit or another dimension.

        Examples
        --------
        >>> walk = load("scenario", "walk-dropfoot-afo")
        >>> walk.set({"supply.pressure": "3 bar"}).supply.pressure
        300000.0
        >>> muscle = load("muscle", "s1_215mm")
        >>> walk.set({"orthosis.muscle.dorsiflexor.type": muscle}).orthosis.muscle["dorsiflexor"].type.name
        's1_215mm'
        """
        return type(self).with_keys(self, sets)

    @property
    def walking(self) -> bool:
        """Whether recorded walking drives the shank."""
        return self.shank.pose == "driven"

    @property
    def simulated_side(self) -> Side:
        """Simulated leg: as in the scenario, else the leg's own."""
        return self.side or self.leg.side

    def _must_walk_or_sit(self) -> None:
        if self.leg.joint == "ankle" and not self.walking and self.shank.knee_angle is None:
            raise refusal("is missing; a fixed shank needs it", 'such as "90 deg"', "shank.knee_angle")
        if self.leg.joint != "ankle" and self.walking:
            problem = f"is recorded walking, and the leg's joint is {a_joint(self.leg.joint)}"
            raise refusal(problem, 'a leg with joint = "ankle", or pose = "fixed"', "shank.pose")
        for key in ("gait", "patient"):
            there = getattr(self, key) is not None
            if there and not self.walking:
                raise refusal("needs a driven shank", 'shank.pose = "driven"', key)
            if self.walking and not there:
                raise refusal("is missing; a driven shank needs it", f"a table or name for {key}", key)
        for key in ("phases", "ground", "shoe", "start", "reference"):
            if getattr(self, key) is not None and not self.walking:
                raise refusal("needs a driven shank", 'shank.pose = "driven"', key)
        if self.timer is not None and self.phases is not None:
            problem = "conflicts with timer: only one of them may switch the valves"
            raise refusal(problem, "phases or timer", "phases")
        for kind in ("timer", "phases"):
            if self.controller is not None and getattr(self, kind) is not None:
                problem = f"conflicts with {kind}: only one of them may switch the valves"
                raise refusal(problem, f"controller or {kind}", "controller")
        if self.orthosis.chamber and not (self.timer or self.phases or self.controller):
            raise refusal("is missing: nothing switches the valves", "timer, or phases when walking", "timer")

    def _must_fit_together(self) -> None:
        if self.orthosis.anchored and self.orthosis.joint != self.leg.joint:
            own, other = a_joint(self.leg.joint), a_joint(self.orthosis.joint)
            problem = f"is for {other}, and the leg's joint is {own}"
            raise refusal(problem, f'an orthosis with joint = "{self.leg.joint}"', "orthosis.joint")
        if self.orthosis.joint_centre:
            problem = (
                "goes with a fit of torques alone: the leg's ankle is a hinge, whose centre does not move"
            )
            raise refusal(problem, "[], for a run about the hinge", "orthosis.joint_centre")
        tables = [(kind, getattr(self, kind)) for kind in ("timer", "phases", "start")]
        named = [(kind, switched.chambers) for kind, switched in tables if switched]
        check_switched(self.orthosis, named)
        for kind, chambers in (*named, ("drive", self.drive)):
            switched = self.orthosis.switched if kind in ("timer", "phases") else tuple(self.orthosis.chamber)
            for name in chambers:
                if name not in switched:
                    known = ", ".join(switched) or "an orthosis with chambers"
                    nearest = nearest_name(name, switched) or ""
                    raise refusal("the orthosis has no such chamber", known, f"{kind}.{name}", nearest)
        check_supplied(self.orthosis, self.supply)
        check_three_way(self.orthosis, self.drive, self.controller)
        if self.controller is not None:
            self.controller.check_chambers(self.orthosis.chamber, self.drive)
        if self.ground is not None and self.ground.toe_stiffness is not None and self.leg.toes is not None:
            problem = "is for a leg without toes, but this leg's toes have a hinge with its own stiffness"
            raise refusal(problem, "leg.toes.stiffness", "ground.toe_stiffness")
        for name, begun in (self.start.chambers if self.start else {}).items():
            if begun.pressure is not None and begun.pressure > self.supply.pressure * (1.0 + 1e-12):
                problem = "exceeds the supply, from which the chamber is filled"
                most = f"at most the supply's {1e-5 * self.supply.pressure:g} bar (supply.pressure)"
                raise refusal(problem, most, f"start.{name}.pressure")
        if self.name and not re.fullmatch(r"\w[\w .-]*", self.name):
            raise refusal("is not a valid name for a folder", "letters, digits, space, . - and _", "name")
        if self.n_step < 1:
            raise refusal("is shorter than one time step", f"at least {self.timestep:g} s", "duration")
        if self.n_step > MAX_STEPS:
            problem = f"is {self.n_step:.3g} steps of {self.timestep:g} s, more than one run can hold"
            raise refusal(problem, f"at most {MAX_STEPS * self.timestep:g} s", "duration")
        stride = 1.0 if self.record_rate is None else 1.0 / (self.record_rate * self.timestep)
        if stride < 1.0 - 1e-9 or abs(stride - round(stride)) > 1e-6 * stride:
            problem = "is not a whole fraction of the step rate"
            raise refusal(problem, f"{1.0 / self.timestep:g} Hz divided by 1, 2, 3, …", "record_rate")

    @property
    def n_step(self) -> int:
        """Steps of the run."""
        return round(self.duration / self.timestep)

    @property
    def record_stride(self) -> int:
        """Steps per recorded row."""
        if self.record_rate is None:
            return max(1, math.ceil(1.0 / (_DEFAULT_RATE * self.timestep) - _SLIGHTLY))
        return round(1.0 / (self.record_rate * self.timestep))

    def resolved(self) -> JsonDict:
        """The whole scenario as plain data that `reader.py` reads again, exactly."""
        return self.model_dump(mode="json", exclude_defaults=False)
