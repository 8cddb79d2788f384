"""A patient's own walk, recorded and then simulated with a device, against separate differential equations.

Most of the angle's error is where her foot slaps down, at 2 to 6 % of the stride: a recording's twelve
harmonics hold no more of it, and the floor that is registered to them is not hers there.
"""

import numpy as np
import pytest
from campaign import nightly
from laws_of_nature.patient_case import Her
from laws_of_nature.patient_truth import PHASE

import afo_sim
from afo_sim.description import Scenario
from afo_sim.gait import file as gait_file

ANGLE, TOE, MOMENT = np.radians(0.3), 1e-3, 0.03  # [rad], [m], of the device's largest
STRIDE, PRESSURE = 2, "2 bar"  # that is compared; of the dorsiflexors
ALWAYS = {"inlet": [[0.0, 1.0]], "outlet": []}
WORN = {
    "none": {},
    "s1": {
        "supply.pressure": PRESSURE,
        "start.dorsiflexor": {"pressure": PRESSURE},
        "phases.dorsiflexor": ALWAYS,
    },
}
SWINGS, PASSES = PHASE > 0.64, (PHASE > 0.70) & (PHASE < 0.95)
Recorded = tuple[Her, dict[str, object]]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    """Her, and a scenario's values for her walk, barefoot."""
    own_size = {"patient.body_mass": "75 kg", "patient.body_height": "1.75 m"}
    her = Her.of(afo_sim.build(afo_sim.load("scenario", "walk-dropfoot", own_size)))
    path = tmp_path_factory.mktemp("laboratory") / "her.csv"
    gait_file.write(path, her.recording)
    walk = {"gait.cycle": str(path), "duration": "3.4 s", "gait.settled": "walked"}
    return her, walk | {"shoe": None, "reference": None}


def scenario(device: str, sets: dict[str, object]) -> Scenario:
    """Of a device whose dorsiflexors are at one pressure, and which has no sole."""
    name = "walk-dropfoot" if device == "none" else "walk-dropfoot-afo"
    described = afo_sim.load("scenario", name, sets | WORN[device])
    return described.with_values(orthosis=described.orthosis.with_values(outsole=None))


def simulated(her: Her, described: Scenario) -> list[np.ndarray]:
    """Ankle angle [rad], height of the toe [m] and the device's moment [N·m] over a stride."""
    run = afo_sim.run(described)
    phase = run["time"] / her.bare.truth.time - STRIDE
    columns = ("ankle/angle", "toe/height", "ankle/moment/orthosis")
    return [np.interp(PHASE, phase, run[name]) for name in columns]


def rms(error: np.ndarray) -> float:
    return float(np.sqrt(np.mean(error**2)))


@pytest.mark.slow
@pytest.mark.parametrize(
    "device",
    [
        pytest.param(d, marks=[nightly("equations of another program, 47 s")] if d == "s1" else [])
        for d in WORN
    ],
)
def test_she_walks_as_solved(recorded: Recorded, device: str) -> None:
    her, described = recorded[0], scenario(device, recorded[1])
    truth = her.wearing(afo_sim.build(described), 2e5, STRIDE + 1)
    if device == "none":  # the equations' own walk comes back
        assert truth.states[0] == pytest.approx(her.bare.states[0], abs=0.1 * ANGLE)
    else:
        assert truth.toe[PASSES].min() > her.bare.toe[PASSES].min() + 15.0 * TOE
    angle, toe, moment = simulated(her, described)
    assert rms(angle - truth.states[0]) < ANGLE
    assert np.abs(angle - truth.states[0])[PASSES].max() < ANGLE
    assert rms((toe - truth.toe)[SWINGS]) < TOE
    assert toe[PASSES].min() == pytest.approx(truth.toe[PASSES].min(), abs=TOE)
    assert rms(moment - truth.moment) < MOMENT * np.abs(truth.moment).max() + 1e-9


@pytest.mark.slow
def test_taken_for_healthy_she_is_weakened_twice(recorded: Recorded) -> None:
    """Her toe hangs lower without a device by more than 5 mm, which a device then seems to lift."""
    her, walk = recorded
    _, toe, _ = simulated(her, scenario("none", walk | {"gait.walker": "healthy"}))
    assert toe[PASSES].min() < her.bare.toe[PASSES].min() - 5.0 * TOE
