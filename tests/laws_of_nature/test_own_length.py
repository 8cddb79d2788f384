"""The program against separate differential equations in which the muscles' own length is a state."""

import numpy as np
import pytest
from campaign import nightly, size
from laws_of_nature.own_length_case import device_of, rest, start_at, state_at, timed, walked
from laws_of_nature.own_length_reference import Solution, solve

import afo_sim
from afo_sim.description import Scenario
from afo_sim.model import Built
from afo_sim.simulation import Recording

CHAMBERS = ("dorsiflexor", "plantarflexor")
ANGLE, PRESSURE, MOMENT = np.radians(0.02), 200.0, 0.005  # [rad], [Pa], of the largest torque
SETTLED = 10  # strides, after which the air has settled
WALKED = size(1, SETTLED)  # strides that the separate equations walk before the one that is compared

# Cable of each muscle, cuff, and the step; the scenario's own where none is told. In the rigid limit the
# torque at the instant at which a muscle becomes taut errs by 8 % at 1 ms, and by 0.2 % at 0.1 ms.
MOUNTINGS: dict[str, tuple[str, str | None, str | None]] = {
    "rigid": ("1e6 N/m", None, "0.1 ms"),
    "soft": ("1e5 N/m", "5 kN/m", None),
}


def mounted(name: str, mounting: str) -> Scenario:
    """A shipped scenario on one of the mountings."""
    cable, cuff, timestep = MOUNTINGS[mounting]
    scenario = afo_sim.load("scenario", name, {"reference": None})
    if scenario.walking:  # as the separate equations have it
        scenario = scenario.set({"ground.mode": "recorded"})
    for muscle in scenario.orthosis.muscle:
        scenario = scenario.set({f"orthosis.muscle.{muscle}.cable": {"stiffness": cable}})
    scenario = scenario.with_values(orthosis=scenario.orthosis.with_values(anchor={}))
    if cuff is not None:
        scenario = scenario.set({"orthosis.anchor.shank": {"stiffness": cuff}})
    return scenario if timestep is None else scenario.set({"timestep": timestep})


def assert_alike(found: Solution, run: Recording, rows: slice) -> None:
    """Angle to 0.02°, pressures to 200 Pa, and the torque to 0.5 % of its largest."""
    assert found.angle == pytest.approx(run["ankle/angle"][rows], abs=ANGLE)
    for number, chamber in enumerate(CHAMBERS):
        assert found.pressure(number) == pytest.approx(run[f"chamber/{chamber}/pressure"][rows], abs=PRESSURE)
    moment = found.moment()
    tolerance = MOMENT * np.abs(moment).max()
    assert moment == pytest.approx(run["ankle/moment/orthosis"][rows], abs=tolerance)


def seated(built: Built, time: np.ndarray, method: str = "LSODA", rtol: float = 1e-8) -> Solution:
    device, drive = device_of(built), timed(built)
    return solve(device, drive, rest(device, drive.around(0.0)), time, method, rtol)


def walking(built: Built, time: np.ndarray, method: str = "LSODA", rtol: float = 1e-8) -> Solution:
    """From the start of recorded walking, with muscles that hang without air."""
    device, drive = device_of(built), walked(built, 0.0, time[-1])
    return solve(device, drive, start_at(built, drive), time, method, rtol)


@pytest.mark.slow
@pytest.mark.parametrize("mounting", MOUNTINGS)
def test_seated(mounting: str) -> None:
    scenario = mounted("seated", mounting)
    run = afo_sim.run(scenario)
    assert_alike(seated(afo_sim.build(scenario), run["time"]), run, slice(None))


@pytest.mark.slow
@pytest.mark.parametrize("mounting", MOUNTINGS)
def test_a_settled_stride(mounting: str) -> None:
    """From the recorded state shortly after a heel strike, for a whole stride."""
    scenario = mounted("walk-dropfoot-afo", mounting).set({"duration": "3.6 s"})
    built, run = afo_sim.build(scenario), afo_sim.run(scenario)
    time, stride = run["time"], built.walk.cycle.stride_time
    first = int(np.searchsorted(time, 2.0 * stride)) + 2  # the velocity's four neighbours are this stride's
    rows = slice(first, first + round(stride / (time[1] - time[0])) + 1)
    assert run["gait/solved"][rows][:-1].all()
    device, drive = device_of(built), walked(built, time[rows][0], time[rows][-1])
    assert_alike(solve(device, drive, state_at(built, run, first), time[rows]), run, rows)


@nightly("10 s; a settled stride and a seated run are solved by day")
@pytest.mark.slow
def test_a_stride_of_a_walk_of_its_own() -> None:
    """As above, but the strides before are walked separately too; ten at night, until the air has settled."""
    empty = {"gait.settled": "walked", "start.dorsiflexor.fill_time": "0 s"}  # as the separate walk begins
    scenario = mounted("walk-dropfoot-afo", "soft").set(empty)
    built, run = afo_sim.build(scenario), afo_sim.run(scenario)
    time, stride = run["time"], built.walk.cycle.stride_time
    rows = slice(*np.searchsorted(time, [WALKED * stride, (WALKED + 1) * stride]))
    whole = walking(built, time[: rows.stop])
    assert_alike(Solution(whole.device, time[rows], whole.states[rows], 0), run, rows)


@pytest.mark.slow
@pytest.mark.parametrize("mounting", MOUNTINGS)
def test_two_methods_agree_with_each_other(mounting: str) -> None:
    """Adams and BDF steps at one tolerance, Runge and Kutta's at another: to a twentieth of what is asked."""
    for name, case, duration in (
        ("seated", seated, size(9, 18) / 2),
        ("walk-dropfoot-afo", walking, size(3, 15) / 10),
    ):
        built = afo_sim.build(mounted(name, mounting))
        time = np.arange(0.0, duration, 1e-3)
        one, other = case(built, time), case(built, time, "Radau", 1e-7)
        assert one.angle == pytest.approx(other.angle, abs=0.05 * ANGLE)
        for chamber in range(len(CHAMBERS)):
            assert one.pressure(chamber) == pytest.approx(other.pressure(chamber), abs=0.05 * PRESSURE)
        moment = one.moment()
        assert moment == pytest.approx(other.moment(), abs=0.05 * MOMENT * np.abs(moment).max())
