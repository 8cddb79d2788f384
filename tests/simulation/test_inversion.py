"""Moments to the foot's sides: cross products of the muscles' lines, worked out without MuJoCo."""

import numpy as np
import pytest
from peaks import over_10_ms
from sideways import Talus, inversion_moment

import afo_sim
from afo_sim.description import Scenario, load
from afo_sim.metrics import ankle_metrics
from afo_sim.model import muscle_names
from afo_sim.simulation import Recording

INSIDE = {"orthosis.muscle.dorsiflexor.insertion.from_joint": ["6.5 cm", "1.5 cm", "-1 cm"]}
CROSSING = INSIDE | {"orthosis.muscle.plantarflexor.origin.from_joint": ["-6 cm", "-2 cm", "30 cm"]}
BOTH_FILLED = {
    "timer.plantarflexor": {"inlet": [["0 s", "1 s"]], "outlet": [["1 s", "8 s"]]},
    "orthosis.muscle.plantarflexor.slack": "5 mm",
}
INVERSION = "ankle/moment/inversion"


def seated(sets: dict[str, object]) -> tuple[Scenario, Recording]:
    scenario = load("scenario", "seated", {"duration": "5 s"} | sets)
    return scenario, afo_sim.run(scenario)


def by_cross_products(scenario: Scenario, run: Recording, rows: range) -> np.ndarray:
    names = list(muscle_names(scenario.orthosis))
    return np.array(
        [
            inversion_moment(scenario, {n: run[f"muscle/{n}/force"][k] for n in names}, run["ankle/angle"][k])
            for k in rows
        ]
    )


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("described", ["right", "left"])
def test_moment_is_that_of_the_muscles_lines(side: str, described: str) -> None:
    scenario, run = seated(CROSSING | BOTH_FILLED | {"side": side, "orthosis.side": described})
    rows = range(0, len(run["time"]), 25)
    expected = by_cross_products(scenario, run, rows)
    assert np.ptp(expected) > 0.3
    # arms are interpolated between angles 0.1° apart: h²/8 of a curvature of 6 cm is 2e-8 m, of up to 100 N
    np.testing.assert_allclose(run[INVERSION][rows.start : rows.stop : rows.step], expected, atol=3e-6)


@pytest.mark.parametrize("side", ["right", "left"])
def test_a_path_pulls_the_foot_from_its_last_point_on_the_shank(side: str) -> None:
    """Of a path through a point on either segment only the piece between them pulls the one to the other."""
    upper, lower = np.array([0.07, 0.02, 0.10]), np.array([0.065, 0.01, 0.02])
    path = [
        {"segment": segment, "from_joint": [f"{x} m" for x in place]}
        for segment, place in (("shank", upper), ("foot", lower))
    ]
    group = "orthosis.muscle.dorsiflexor"
    scenario, run = seated({f"{group}.path": path, f"{group}.link_length": "10.5 cm", "side": side})
    inside = np.array([1.0, 1.0 if side == "right" else -1.0, 1.0])
    expected = []
    for k in range(0, len(run["time"]), 25):
        talus = Talus(scenario, run["ankle/angle"][k])
        at = talus.placed(lower * inside)
        line = (upper * inside - at) / np.linalg.norm(upper * inside - at)
        pull = sum(run[f"muscle/dorsiflexor_{number}/force"][k] for number in (1, 2, 3))
        expected.append(talus.forward @ np.cross(at, pull * line))
    assert np.ptp(expected) > 0.1
    np.testing.assert_allclose(run[INVERSION][::25], expected, atol=3e-6)


def test_muscle_on_the_inside_inverts_and_on_the_outside_everts() -> None:
    """A right leg's inside is to the left; lifted there, the sole turns to the inside."""
    for y, sign in (("1.5 cm", 1.0), ("-1.5 cm", -1.0)):
        insertion = {"orthosis.muscle.dorsiflexor.insertion.from_joint": ["6.5 cm", y, "-1 cm"]}
        _, run = seated(insertion)
        assert sign * run[INVERSION].sum() > 0.0
        of_inside, of_outside = (run.metrics[f"peak_{way}_moment"] for way in ("inversion", "eversion"))
        assert (of_inside > 0.4) == (sign > 0.0) and (of_outside > 0.4) == (sign < 0.0)


def test_orthosis_of_the_other_side_turns_the_other_way() -> None:
    _, right = seated(INSIDE)
    _, left = seated(INSIDE | {"side": "left"})
    _, crossed = seated(INSIDE | {"orthosis.side": "left"})
    np.testing.assert_array_equal(left[INVERSION], right[INVERSION])
    np.testing.assert_array_equal(crossed[INVERSION], -right[INVERSION])


def test_symmetric_orthosis_has_no_such_column() -> None:
    """S1's muscles stand on both sides of the midline and pull alike: by cross products nothing is left."""
    scenario, run = seated({})
    assert INVERSION not in run.columns and "peak_inversion_moment" not in run.metrics
    assert np.abs(by_cross_products(scenario, run, range(0, len(run["time"]), 100))).max() < 1e-13


def test_metrics_of_walking_are_means_over_the_counted_strides() -> None:
    run = afo_sim.run("walk-dropfoot-afo", INSIDE | {"duration": "3.7 s", "record_rate": "1 kHz"})
    stride = run["gait/stride"] == 2
    peak = over_10_ms(run["time"][stride], run[INVERSION][stride])
    assert peak > 0.5
    assert run.strides[2]["peak_inversion_moment"] == pytest.approx(peak, rel=1e-3)
    assert run.metrics["peak_eversion_moment"] == 0.0


def test_peaks_of_known_moments() -> None:
    moment = np.array([0.0, 2.0, 2.0, 2.0, -3.0, -3.0, -3.0, 0.0])
    others = dict.fromkeys(("ankle/angle", "ankle/moment/orthosis"), np.zeros(8)) | {
        "time": 5e-3 * np.arange(8)
    }
    found = ankle_metrics(others | {INVERSION: moment}, 5e-3, 1.0)
    assert found["peak_inversion_moment"] == 2.0 and found["peak_eversion_moment"] == 3.0
    assert not any("version" in name for name in ankle_metrics(others, 5e-3, 1.0))
