"""Two sides of one walk: the affected one in the device and the other as recorded, and what differs."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from afo_sim.common import GRAVITY, InputError, Notice
from afo_sim.description import Scenario, Side, load
from afo_sim.gait import GaitCycle, TwoSides, asymmetry
from afo_sim.metrics import INTERNAL
from afo_sim.model import as_recorded, person_of, persons_stride, stride_time_of, walker_of
from afo_sim.simulation.bilateral_air import SIDES, Cycle

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


def at_one_pace(pair: Sequence[Scenario], lead: Side) -> tuple[Scenario, Scenario]:
    """Both legs at the recorded stride time of one, where those of two recorded sides differ by little."""
    found = dict(zip(SIDES, pair, strict=True))
    if all(s.gait and s.gait.stride_time is None and s.gait.speed is None for s in pair):
        own = {side: stride_time_of(scenario) for side, scenario in found.items()}
        for side, time in own.items():
            if time != own[lead] and abs(time / own[lead] - 1.0) <= PACES:
                found[side] = found[side].set({"gait.stride_time": f"{own[lead]!r} s"})
    return found["right"], found["left"]


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
    text = (
        "the {subject} side has no recording of its own and walks as the affected side's shows it: what "
        "differs between the sides is the device alone (gait import --side each records both)"
    )
    return [Notice("side-copied", text, subject=other)]


def sides_of(cycles: Mapping[Side, Cycle], pair: Sequence[Scenario]) -> dict[str, list[TwoSides]]:
    """Both sides as recorded and as simulated, by `asymmetry`."""
    own = {side: persons_stride(scenario) for side, scenario in zip(SIDES, pair, strict=True)}
    walked = {side: _walked(own[side], cycles[side], pair[k]) for k, side in enumerate(SIDES)}
    return {RECORDED: asymmetry(**own), WALKED: asymmetry(**walked)}


def _walked(own: GaitCycle, cycle: Cycle, scenario: Scenario) -> GaitCycle:
    """The recorded stride with what the run's cycle changes of it: pace, ankle angle and moment, load."""
    mass = person_of(scenario).body_mass
    angle, moment, load, *moments = (cycle.at(name, own.phase) for name in _COLUMNS)
    return dataclasses.replace(
        own,
        stride_time=stride_time_of(scenario),
        ankle_angle=own.ankle_angle + cycle.at("ankle/angle", own.phase) - angle,
        ankle_moment=own.ankle_moment + (np.sum(moments, axis=0) - moment) / mass,
        grf_z=load / (mass * GRAVITY),
    )
