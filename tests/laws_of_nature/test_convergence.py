"""The order of the scheme in the time step, and the rigid limit against two separate computations."""

from typing import Any

import numpy as np
import pytest
from campaign import size

import afo_sim
from afo_sim.simulation import Recording

ANGLE, PRESSURE, AIR = "ankle/angle", "chamber/dorsiflexor/pressure", "chamber/dorsiflexor/mass"
RIGID = {
    "orthosis.anchor.shank.stiffness": "1e6 kN/m",
    "orthosis.anchor.foot.stiffness": "1e6 kN/m",
    "orthosis.muscle.dorsiflexor.cable.stiffness": "1e6 N/m",
    "orthosis.muscle.plantarflexor.cable.stiffness": "1e6 N/m",
}
RECORDED = {"gait.cycle": "gatk_stride1"}
# every row from the start, at the step that is asked, without the slap, whose error hides all others
WALKED = {"gait.settled": "walked", "ground.mode": "recorded"}
FRICTIONS = ["tondu_lopez_2000_stribeck", "maxwell_slip"]


def stepped(name: str, milliseconds: float, sets: dict[str, str]) -> Recording:
    """A run whose rows are 2 ms apart at any step."""
    rate = f"{1000.0 / max(milliseconds, 2.0):g} Hz"
    return afo_sim.run(name, {"timestep": f"{milliseconds} ms", "record_rate": rate, **sets})


def worst(run: Recording, fine: Recording, column: str, after: float = 0.0) -> float:
    """Largest difference of a column after a time [its unit]."""
    n = min(len(run["time"]), len(fine["time"]))
    here = run["time"][:n] >= after
    return float(np.abs(run[column][:n] - fine[column][:n])[here].max())


def rubbing(friction: str) -> dict[str, str]:
    return {f"orthosis.muscle.{group}.type.friction": friction for group in ("dorsiflexor", "plantarflexor")}


@pytest.mark.slow
def test_seated_is_of_second_order() -> None:
    """At the shipped stiffness and without friction: a quarter of the error at half the step."""
    sets = {"duration": "5 s"}
    fine = stepped("seated", 0.05, sets)
    runs = [stepped("seated", h, sets) for h in (2.0, 1.0, 0.5, 0.25)]
    for column in (ANGLE, AIR):
        errors = np.array([worst(run, fine, column) for run in runs])
        assert np.all(errors[:-1] / errors[1:] >= 3.5), (column, errors)
    errors = np.array([worst(run, fine, PRESSURE) for run in runs])
    assert (errors[0] / errors[-1]) ** (1.0 / 3.0) >= 3.5, errors  # valves switch between the steps


@pytest.mark.slow
def test_the_first_stride_is_of_second_order() -> None:
    """Until the recorded ground moment jumps at the next heel strike, which makes the ratio two."""
    sets = WALKED | RECORDED | {"duration": "1.1 s", "start.dorsiflexor.fill_time": "0 s"}
    fine = stepped("walk-dropfoot-afo", 0.05, sets)
    errors = np.array([worst(stepped("walk-dropfoot-afo", h, sets), fine, ANGLE) for h in (2.0, 1.0, 0.5)])
    assert np.all(errors[:-1] / errors[1:] >= 3.5), errors


@pytest.mark.slow
def test_a_foot_on_the_floor_is_solved() -> None:
    """At the default step the angle is within a tenth of a degree, landing and foot slap with it."""
    sets = WALKED | {"ground.mode": "contact", "duration": "1.3 s", "start.dorsiflexor.fill_time": "0 s"}
    fine = stepped("walk-dropfoot-afo", 0.05, sets)
    errors = [np.degrees(worst(stepped("walk-dropfoot-afo", h, sets), fine, ANGLE)) for h in (2.0, 1.0)]
    assert errors[0] < 0.2 and errors[1] < 0.1, errors


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sets", "at_2_ms", "at_1_ms"),
    [
        ({}, 0.05, 0.01),
        *((rubbing(friction), 0.2, 0.1) for friction in FRICTIONS),
        (
            {f"orthosis.muscle.{g}.type.damping": "2e-3 m^2*s" for g in ("dorsiflexor", "plantarflexor")},
            0.2,
            0.1,
        ),
        (RIGID, 0.2, 0.1),
    ],
    ids=["shipped", *FRICTIONS, "R 2e-3", "cables 1e6"],
)
def test_walking_is_solved(sets: dict[str, str], at_2_ms: float, at_1_ms: float) -> None:
    """Largest error of the angle after the first stride [deg]."""
    sets = WALKED | sets | {"duration": f"{size(37, 49) / 10} s"}
    fine = stepped("walk-dropfoot-afo", size(10, 5) / 100, sets)
    for milliseconds, limit in ((2.0, at_2_ms), (1.0, at_1_ms)):
        run = stepped("walk-dropfoot-afo", milliseconds, sets)
        assert np.degrees(worst(run, fine, ANGLE, after=1.3)) <= limit


# The walker of two separate codes: rigid and flat feet, empty muscles, the malleolus lowered vertically, the
# ankle's zero of that time.
THEIRS: dict[str, Any] = {
    "patient.body_mass": "75 kg",
    "patient.body_height": "1.78 m",
    "leg.body_height": "1.78 m",
    "gait.sole_thickness": "28.2 mm",
    "gait.ankle_offset": "0.304 deg",
    "start.dorsiflexor.fill_time": "0 s",
    "orthosis.outsole": {"heel_stack": "0 mm", "ball_stack": "0 mm", "toe_stiffness": "1e4 N*m/rad"},
}
LOWERED = 28.8  # how far they lowered it [mm]
# toe clearance [mm] and air [mg] of the last of 14 strides, by them
SEPARATE = {
    "4 bar": ({}, 11.1, 99.0, 0.5),
    "3 bar": ({"supply.pressure": "3 bar"}, -5.2, 79.0, 0.5),
    "2.5 bar": ({"supply.pressure": "2.5 bar"}, -16.8, 70.0, 0.5),
    # the slack muscle's delay in its own damper decides, which the separate codes have not
    "outlet x3": (
        {"orthosis.chamber.dorsiflexor.outlet.conductance": "1.65e-9 m^3/(s*Pa)"},
        -33.4,
        169.0,
        2.0,
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize(("sets", "toe", "air", "within"), SEPARATE.values(), ids=SEPARATE)
def test_the_rigid_limit_is_that_of_separate_computations(
    sets: dict[str, str], toe: float, air: float, within: float
) -> None:
    described = afo_sim.load("scenario", "walk-dropfoot-afo")
    described = described.set(WALKED | RIGID | RECORDED | THEIRS | {"duration": "16.85 s"} | sets)
    run, walk = afo_sim.run(described), afo_sim.build(described).walk
    last = run["gait/stride"] == 13
    sunk = LOWERED + 1e3 * sum(walk.shift)  # of their ankle below this one: their flat foot had its heel up
    height = 1e3 * run["toe/height"] - sunk
    height = height[last & (run["gait/phase"] > 0.7) & (run["gait/phase"] < 0.97)]
    dips = height[1:-1][(height[1:-1] <= height[:-2]) & (height[1:-1] <= height[2:])]
    filled = np.sum(run["chamber/dorsiflexor/mass_flow_in"][last]) * 1e6 * (run["time"][1] - run["time"][0])
    assert dips.min() == pytest.approx(toe, abs=within)
    assert filled == pytest.approx(air, rel=0.02)
