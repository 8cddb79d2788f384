"""What controllers of walking read: loads under heel and toes, and the shank's velocity."""

import numpy as np
import pytest

import afo_sim
from afo_sim.description import load
from afo_sim.model import Built
from afo_sim.model.build import build
from afo_sim.simulation import Recording

SETS = {"duration": "2.4 s", "gait.settled": "walked"}
CASES = ("recorded", "contact")


@pytest.fixture(scope="module")
def built() -> dict[str, Built]:
    return {mode: build(load("scenario", "walk-healthy", SETS | {"ground.mode": mode})) for mode in CASES}


@pytest.fixture(scope="module")
def runs() -> dict[str, Recording]:
    return {mode: afo_sim.run("walk-healthy", SETS | {"ground.mode": mode}) for mode in CASES}


def places(built: Built, run: Recording) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Heel, ball, and centre of pressure ahead of the ankle [m], from the foot's drawing and the angles."""
    pitch = run["ankle/angle"] - run["shank/angle"]
    heel, ball = (
        x * np.cos(pitch) - z * np.sin(pitch) for x, z in map(built.foot.points.get, ("heel", "ball"))
    )
    return heel, ball, run["ground/position/x"] - run["ankle/position/x"]


def test_the_two_loads_press_as_the_recorded_force_does(
    built: dict[str, Built], runs: dict[str, Recording]
) -> None:
    run = runs["recorded"]
    heel, ball, centre = places(built["recorded"], run)
    within = (centre > heel) & (centre < ball)
    assert within.mean() > 0.3
    force, back, front = (run[name][within] for name in ("ground/force/z", "foot/heel_load", "foot/toe_load"))
    assert back + front == pytest.approx(force, abs=1e-9)
    assert back * heel[within] + front * ball[within] == pytest.approx(force * centre[within], abs=1e-9)
    ahead = centre >= ball
    assert ahead.any()
    assert run["foot/heel_load"][ahead] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("mode", CASES)
def test_they_sum_to_the_force_and_push_upward(mode: str, runs: dict[str, Recording]) -> None:
    run = runs[mode]
    total = run["foot/heel_load"] + run["foot/toe_load"]
    assert total == pytest.approx(run["ground/force/z"], abs=1e-9)
    for name in ("foot/heel_load", "foot/toe_load"):
        assert run[name].min() > -1e-9
        assert run[name].max() > 300.0  # of a body of 75 kg


@pytest.mark.parametrize("mode", CASES)
def test_the_heel_is_loaded_before_the_toes(mode: str, runs: dict[str, Recording]) -> None:
    run = runs[mode]
    stride = run["gait/stride"] == 1.0
    phase, heel, toe = (run[name][stride] for name in ("gait/phase", "foot/heel_load", "foot/toe_load"))
    loaded = heel + toe > 100.0
    front = toe[loaded] / (heel + toe)[loaded]
    assert front[phase[loaded] < 0.04].max() < 0.5
    assert front[(phase[loaded] > 0.45) & (phase[loaded] < 0.58)].min() > 0.95
    assert phase[np.argmax(heel)] < 0.25 < 0.4 < phase[np.argmax(toe)] < 0.6
    swing = (phase > 0.75) & (phase < 0.95)
    assert heel[swing].max() < 5.0 and toe[swing].max() < 5.0


@pytest.mark.parametrize("mode", CASES)
def test_the_shanks_velocity_is_the_mean_of_the_step_before(
    mode: str, built: dict[str, Built], runs: dict[str, Recording]
) -> None:
    run = runs[mode]
    steps = np.diff(run["shank/angle"]) / np.diff(run["time"])
    assert run["shank/velocity"][1:] == pytest.approx(steps, abs=1e-9)
    walk = built[mode].walk
    middle = walk.phase[1:-1] - 0.5 * (walk.phase[1:-1] - walk.phase[:-2])  # half a step before
    exact = walk.cycle.signal("shank_angle", middle, 1) * walk.cycle.stride_time * np.diff(walk.phase)[0]
    assert run["shank/velocity"] == pytest.approx(exact / walk.timestep, abs=1e-3)
    phase = run["gait/phase"]
    assert run["shank/velocity"][(phase > 0.15) & (phase < 0.4)].min() > 0.0  # rolls over the foot
    assert run["shank/velocity"][(phase > 0.75) & (phase < 0.9)].max() < 0.0  # swings forward under the knee
