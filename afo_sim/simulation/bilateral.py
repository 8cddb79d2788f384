"""Both legs of one person on one supply, half a stride apart: `afo_sim.both`."""

import os
import pathlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace

import numpy as np

from afo_sim.common import (
    GRAVITY,
    InputError,
    JsonDict,
    JsonMapping,
    Notice,
    Shown,
    check_writable,
    shown,
    together,
    unknown,
    write_json,
)
from afo_sim.description import Scenario, Side, load
from afo_sim.gait import GaitCycle, TwoSides
from afo_sim.gait import asymmetry as compared
from afo_sim.metrics import INTERNAL, Metric
from afo_sim.model import as_recorded, person_of, persons_stride, stride_time_of, walker_of, why_walked
from afo_sim.simulation.bilateral_air import SIDES, Cycle, Worse, cycle_of, flow_of, numbers_of, worse_of
from afo_sim.simulation.examine import described_cycle
from afo_sim.simulation.files import MODEL, PARQUET, RERUN, SUMMARY
from afo_sim.simulation.recording import Recording, plain
from afo_sim.simulation.run import run_at_step
from afo_sim.simulation.validity_checks import empty_warnings

APART = 0.5  # share of a stride between the heel strikes of the two feet of a person who walks evenly [-]
SAME = 1e-9  # share by which two stride times or pressures may differ and are the same [-]
BOTH_JSON, BOTH_PNG = "both.json", "both.png"
FILES = (
    *(f"{side}/{name}" for side in SIDES for name in (PARQUET, SUMMARY, MODEL, RERUN)),
    BOTH_JSON,
    BOTH_PNG,
)
IDEAL = (
    "the supply pressure is constant, whatever is drawn from it: the legs share only air and do not disturb "
    "each other"
)
APART_ON_IT = (
    "each leg is simulated alone on the source: together they empty it faster, and the supply sags at least "
    "as far as for each of them"
)
LAST = (
    "the flow is from the last complete period; air per cycle is the mean of all periods, including the first"
)
FIRST = "the flow is from one settled stride of each leg; for strides after a stop see each leg's own run"

Description = str | os.PathLike[str] | Scenario | JsonMapping
Progress = Callable[[int, int, str], None]


@dataclass(frozen=True, repr=False, eq=False)
class Both(Shown):
    """Runs of both legs of one person on one supply, and the air that they draw from it together.

    right, left : recordings, each from its own heel strike
    apart : share of a stride by which the left leg is behind the right one
    cycle : time of one stride, or the period of the timer or of what a controller follows [s]
    phase : of the right leg's stride, 0 at its heel strike (n,)
    flow : drawn from the source at these phases by "right", "left" and "both" [kg/s] (n,)
    numbers : air and flow of either leg and of both, with their units
    verdict : of each question the worse leg; what the air of both costs
    warnings : of both legs, each begins with the leg's name
    notes : what the numbers rest on
    affected : side that wears the device, while the other walks as recorded; None where both wear one
    asymmetry : of legs that walk, both sides "as recorded" and "with the device"

    Examples
    --------
    >>> legs = both("seated", sets={"duration": "8 s"})
    >>> legs.numbers["air_per_cycle_both"] == 2 * legs.right.metrics["air_per_cycle"]
    True
    """

    right: Recording
    left: Recording
    apart: float
    cycle: float
    phase: np.ndarray
    flow: dict[str, np.ndarray]
    numbers: dict[str, Metric]
    verdict: tuple[Worse, ...]
    warnings: tuple[str, ...]
    notes: tuple[str, ...]
    affected: Side | None = None
    asymmetry: Mapping[str, list[TwoSides]] = field(default_factory=dict)

    def __repr__(self) -> str:
        what = f"{self.right.described['name']!r} right, {self.left.described['name']!r} left"
        return f"<Both legs: {what}, {self.apart:g} of a stride apart, {self.status}>"

    @property
    def legs(self) -> dict[Side, Recording]:
        """The two recordings by side."""
        return {"right": self.right, "left": self.left}

    @property
    def status(self) -> str:
        """ "ok", or which leg's simulation stopped and why."""
        return "; ".join(f"{side}: {leg.status}" for side, leg in self.legs.items() if not leg.ok) or "ok"

    @property
    def ok(self) -> bool:
        """Whether both simulations ran to their ends."""
        return self.right.ok and self.left.ok

    def over_stride(self, side: Side, column: str) -> np.ndarray:
        """A leg's column at the phases of the right leg's stride [SI] (n,)."""
        return cycle_of(self.legs[side]).at(column, self.phase, self.apart if side == "left" else 0.0)

    def summary(self) -> JsonDict:
        """Contents of both.json."""
        return {
            "status": self.status,
            "apart": self.apart,
            "affected": self.affected,
            "asymmetry": {kind: [asdict(row) for row in rows] for kind, rows in self.asymmetry.items()},
            "cycle": {"value": self.cycle, "unit": "s"},
            "numbers": plain(self.numbers),
            "metrics": {side: plain(leg.metrics) for side, leg in self.legs.items()},
            "verdict": [asdict(worse) for worse in self.verdict],
            "warnings": list(self.warnings),
            "notes": list(self.notes),
            "flow": {"phase": self.phase.tolist(), "unit": "kg/s"}
            | {name: values.tolist() for name, values in self.flow.items()},
        }

    def save(
        self, folder: str | os.PathLike[str], *, rrd: bool | None = None, rate: float | str | None = None
    ) -> pathlib.Path:
        """Write the runs to right/ and left/, both.json and, of legs that ran to their ends, both.png.

        The files appear together; older ones in the folder stay whole until then.

        Parameters
        ----------
        folder : made if need be
        rrd : also write each leg's recording.rrd; by default where the library rerun is installed
        rate : samples a second in it [Hz]; the run's own by default

        Returns
        -------
        the folder
        """
        target = pathlib.Path(folder)
        check_writable(target)
        with together(target, FILES) as scratch:
            for side, leg in self.legs.items():
                leg.save(scratch / side, rrd=rrd, rate=rate, place=target / side)
            write_json(scratch / BOTH_JSON, self.summary(), "both legs")
            if len(self.phase):
                shown().both(self, scratch / BOTH_PNG)
        return target


def both(
    right: Description,
    left: Description | None = None,
    *,
    sets: Mapping[str, object] | None = None,
    left_sets: Mapping[str, object] | None = None,
    apart: float | None = None,
    affected: Side | None = None,
    progress: Progress | None = None,
) -> Both:
    """Simulate both legs of a person on one supply, with an orthosis on both or on the affected one.

    Each leg runs as if alone: the pressure of endless air is constant; for a named source or
    regulator a note says that two legs lower it further. The left leg's settled stride
    starts `apart` of a stride after the right one's; then their flows from the source are added.

    Parameters
    ----------
    right : scenario of the right leg: a shipped name, a path, a dict or a Scenario
    left : of the left leg; the right leg's by default
    sets : dotted keys and values laid over both
    left_sets : further ones, laid over the left leg's
    apart : delay of the left leg as a share of a stride, 0 to below 1; half a stride by default. Legs
        of a seated person are switched by one timer, together: 0
    affected : "right" or "left", the only side that wears the device. The other one has the same scenario
        without device and weakness, as it was recorded, unless `left` describes the left leg
    progress : called with (legs done, 2, current task)

    Returns
    -------
    Both

    Raises
    ------
    InputError
        A description is wrong, the two legs do not belong to one person on one supply (other pressures, or
        stride times that differ by more than 5 %, or were not recorded), or their strides vary.

    Examples
    --------
    >>> legs = both("walk-dropfoot-afo", left_sets={"patient.dorsiflexor_strength": 0.5})
    >>> legs.numbers["air_per_stride_both"].unit
    'g'
    """
    pair = described(right, left, sets=sets, left_sets=left_sets, affected=affected)
    shift = checked(*pair, apart)
    recordings = []
    for k, (side, scenario) in enumerate(zip(SIDES, pair, strict=True)):
        if progress is not None:
            progress(k, 2, f"simulating the {side} leg")
        recordings.append(run_at_step(scenario))
    return laid_together(recordings[0], recordings[1], pair, shift, affected)


def described(
    right: Description, left: Description | None, *, sets: Mapping[str, object] | None = None,
    left_sets: Mapping[str, object] | None = None, affected: Side | None = None,
) -> tuple[Scenario, Scenario]:  # fmt: skip
    """The two legs' scenarios, at one pace; parameters as of `both`."""
    if affected not in (None, *SIDES):
        raise unknown(affected, SIDES, field="affected")
    for name, values in (("sets", sets), ("left_sets", left_sets)):
        if "side" in (values or {}):
            raise InputError("is each leg's own here: there is one of either side", field=f"{name}: side")
    pairs = ((right, sets or {}), (right if left is None else left, {**(sets or {}), **(left_sets or {})}))
    found = [
        load("scenario", which, {**values, "side": side})
        for side, (which, values) in zip(SIDES, pairs, strict=True)
    ]
    if affected == "right" and left is None:
        found[1] = other_side(found[1]).set(left_sets or {})  # what is said of it alone holds
    elif affected == "left":
        found[0] = other_side(found[0])
    lead = SIDES.index(affected or "right")  # at whose pace two recorded sides walk that differ by little
    if all(s.gait and s.gait.stride_time is None and s.gait.speed is None for s in found):
        own = [stride_time_of(scenario) for scenario in found]
        for k, time in enumerate(own):
            if time != own[lead] and abs(time / own[lead] - 1.0) <= PACES:
                found[k] = found[k].set({"gait.stride_time": f"{own[lead]!r} s"})
    return found[0], found[1]


def laid_together(
    right: Recording,
    left: Recording,
    pair: tuple[Scenario, Scenario],
    apart: float,
    affected: Side | None = None,
) -> Both:
    """Two legs' runs as those of one person; `pair` are their scenarios."""
    legs: dict[Side, Recording] = {"right": right, "left": left}
    # why a leg stopped and its warnings, with its name; what both legs say stands once
    told = {side: [*([] if leg.ok else [leg.status]), *leg.warnings] for side, leg in legs.items()}
    common = [w for w in told["right"] if w in told["left"]]
    named = [_of_leg("both legs", warning) for warning in common]
    named += [_of_leg(side, w) for side, said in told.items() for w in said if w not in common]
    warnings = (*named, *_doubts(*pair), *copied(pair, affected))
    phase = np.empty(0)
    flow: dict[str, np.ndarray] = {}
    numbers: dict[str, Metric] = {}
    verdict: tuple[Worse, ...] = ()
    asymmetry: dict[str, list[TwoSides]] = {}
    if right.ok and left.ok:
        cycles: dict[Side, Cycle] = {side: cycle_of(leg) for side, leg in legs.items()}
        phase = cycles["right"].phase
        for side in SIDES:
            flow[side] = flow_of(cycles[side], phase, apart if side == "left" else 0.0)
        flow["both"] = flow["right"] + flow["left"]
        numbers = numbers_of(legs, cycles, phase, flow)
        both_sag = {name.removesuffix("_both"): value for name, value in numbers.items()}
        of_both = empty_warnings(pair[0], both_sag, "each leg alone on it, with more air than both have")
        warnings += tuple(one.after("both legs together: ") for one in of_both)
        if affected is None:
            verdict = worse_of(right, left, numbers)
        else:
            own = legs[affected].verdict
            verdict = tuple(Worse(a.name, a.question, a.status, affected, {affected: a}) for a in own)
        if pair[0].walking:
            strides = {side: persons_stride(scenario) for side, scenario in zip(SIDES, pair, strict=True)}
            walked = {side: _walked(strides[side], cycles[side], pair[k]) for k, side in enumerate(SIDES)}
            asymmetry = {RECORDED: compared(**strides), WALKED: compared(**walked)}
    supply = pair[0].supply
    sags = supply.source is not None or supply.regulator is not None
    notes = (APART_ON_IT if sags else IDEAL, FIRST if pair[0].walking else LAST, *paced(pair))
    period = _period(pair[0])
    return Both(
        right, left, apart, period, phase, flow, numbers, verdict, warnings, notes, affected, asymmetry
    )


def _of_leg(leg: str, warning: str) -> str:
    return warning.after(f"{leg}: ") if isinstance(warning, Notice) else f"{leg}: {warning}"


def _period(scenario: Scenario) -> float:
    """The stride time, or that of the timer or of what a controller follows [s]."""
    period = stride_time_of(scenario) if scenario.walking else described_cycle(scenario)
    if period is None:
        problem = (
            "has no strides, and its valves follow no repeating pattern: two legs have no common air cycle"
        )
        allowed = "a scenario that walks, a timer, or a controller that follows a sine or a clock"
        field = "timer" if scenario.controller is None else "controller"
        raise InputError(problem, field=field, allowed=allowed)
    return period


def checked(right: Scenario, left: Scenario, apart: float | None) -> float:
    """The share of a stride that the left leg is behind."""
    if right.walking != left.walking:
        seated = next(side for side, s in zip(SIDES, (right, left), strict=True) if not s.walking)
        problem = f"the {seated} leg's person sits and the other's walks"
        raise InputError(problem, field="left", value=left.name, allowed="two that walk, or two that sit")
    for side, scenario in zip(SIDES, (right, left), strict=True):
        if scenario.gait is not None and scenario.gait.variability > 0.0:
            problem = f"the {side} leg's stride time varies: its strides do not match the other leg's"
            raise InputError(problem, field="gait.variability", allowed="0, for both legs")
        if scenario.gait is not None and scenario.gait.pace:
            problem = f"the {side} leg's cadence changes: no single stride represents all"
            raise InputError(problem, field="gait.pace", allowed="none, for both legs")
    if not (right.orthosis.chamber or left.orthosis.chamber):
        problem = "neither leg's orthosis has a chamber: no air is used"
        raise InputError(problem, field="orthosis", allowed="one with muscles, at least on one leg")
    what = "stride" if right.walking else "period"
    sentence = f"the {what} of the left leg is {{}} s and the right one's {{}} s"
    _same(_period(right), _period(left), sentence, left)
    pressures = 1e-5 * right.supply.pressure, 1e-5 * left.supply.pressure
    _same(
        *pressures,
        "the left leg's supply has {} bar and the right one's {} bar, but one supply feeds both",
        left,
    )
    if _feeding(right) != _feeding(left):
        problem = "the two legs name different sources or regulators, but one supply feeds both"
        raise InputError(problem, field="left", value=left.name, allowed="the same for both legs")
    shift = (APART if right.walking else 0.0) if apart is None else float(apart)
    if not 0.0 <= shift < 1.0:
        raise InputError("is out of range", field="apart", value=apart, allowed="0 to below 1 (of a stride)")
    if shift and not right.walking:
        problem = "the valves of both legs of a seated person switch together, since there are no strides"
        raise InputError(problem, field="apart", value=apart, allowed="0, or a scenario that walks")
    return shift


def _feeding(scenario: Scenario) -> tuple[object, ...]:
    """What a leg's supply comes from."""
    supply = scenario.supply
    return supply.source, supply.regulator, supply.line_pressure


def _same(right: float, left: float, sentence: str, scenario: Scenario) -> None:
    if abs(right - left) > SAME * abs(right):
        problem = sentence.format(f"{left:.6g}", f"{right:.6g}")
        raise InputError(problem, field="left", value=scenario.name, allowed="the same for both legs")


def _doubts(right: Scenario, left: Scenario) -> list[Notice]:
    """What to mind of two legs' scenarios."""
    found: list[Notice] = []
    for side, scenario in zip(SIDES, (right, left), strict=True):
        if scenario.walking and (why := why_walked(scenario)):
            text = "{subject}: its strides are walked, not solved for, and the last one represents all: {why}"
            found.append(Notice("leg-walked", text, subject=side, why=why))
        if scenario.walking and scenario.timer is not None:
            text = (
                "{subject}: a timer switches its valves; it is assumed to keep pace with this leg's strides"
            )
            found.append(Notice("leg-timer", text, subject=side))
    if right.walking and (persons_stride(right).side, persons_stride(left).side) == SIDES[::-1]:
        found.append(Notice("legs-exchanged", "each leg walks with the recorded stride of the other side"))
    if right.walking and person_of(right) != person_of(left):
        text = "the two legs belong to persons of different mass or height"
        found.append(Notice("legs-persons", text))
    if right.walking and _bottle(right) != _bottle(left):
        text = "the legs' limits name different bottles; that of the right leg is used"
        found.append(Notice("legs-bottles", text))
    return found


def _bottle(scenario: Scenario) -> tuple[float, float] | None:
    limits = scenario.limits
    return None if limits is None else (limits.bottle_volume, limits.bottle_pressure)


# --- the affected side in the device, the other one as recorded

PACES = 0.05  # share by which stride times of two sides of one walk may differ, assumed [-]
RECORDED, WALKED = "as recorded", "with the device"
_COLUMNS = ("gait/ankle_angle", "gait/ankle_moment", "ground/force/z", *INTERNAL)


def other_side(scenario: Scenario) -> Scenario:
    """The same person's leg without device and weakness, as it was recorded."""
    if scenario.patient is None:
        problem = "is one side of a walk, and the person sits"
        raise InputError(problem, field="affected", allowed="a scenario that walks")
    size = {name: getattr(scenario.patient, name) for name in ("body_mass", "body_height")}
    healthy = load("patient", "healthy").model_copy(update=size)
    return as_recorded(scenario).with_values(patient=healthy, description="the other side, without device")


def paced(pair: Sequence[Scenario]) -> list[Notice]:
    """A note for a leg that walks at the other one's pace."""
    text = (
        "the {subject} side's stride, recorded in {recorded:.4f} s, is walked in the other's {walked:.4f} s"
    )
    found = []
    for side, own, other in zip(SIDES, pair, pair[::-1], strict=True):
        if own.gait and other.gait and own.gait.stride_time and other.gait.stride_time is None:
            data = {"recorded": persons_stride(own).stride_time, "walked": own.gait.stride_time}
            found.append(Notice("leg-paced", text, subject=side, severity="note", **data))
    return found


def copied(pair: Sequence[Scenario], affected: Side | None) -> list[Notice]:
    """A warning where a patient's other side has no recording and walks as the affected one's."""
    cycles = [scenario.gait.cycle for scenario in pair if scenario.gait]
    if affected is None or len(cycles) < 2 or cycles[0] != cycles[1] or walker_of(pair[0]) != "patient":
        return []
    other = SIDES[1 - SIDES.index(affected)]
    text = "the {subject} side has no recording of its own and copies the affected side's: "
    text += "only the device differs between the sides (gait import --side each records both)"
    return [Notice("side-copied", text, subject=other)]


def _walked(own: GaitCycle, cycle: Cycle, scenario: Scenario) -> GaitCycle:
    """The recorded stride with what the run's cycle changes of it: pace, ankle angle and moment, load."""
    mass = person_of(scenario).body_mass
    angle, moment, load, *moments = (cycle.at(name, own.phase) for name in _COLUMNS)
    return replace(
        own,
        stride_time=stride_time_of(scenario),
        ankle_angle=own.ankle_angle + cycle.at("ankle/angle", own.phase) - angle,
        ankle_moment=own.ankle_moment + (np.sum(moments, axis=0) - moment) / mass,
        grf_z=load / (mass * GRAVITY),
    )
