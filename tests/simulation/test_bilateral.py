"""Two legs on one supply: their air adds up, the left stride is shifted, what does not fit is refused."""

import dataclasses
import json
import pathlib
from typing import Any

import numpy as np
import pytest

import afo_sim as afo
from afo_sim.common import STANDARD_DENSITY
from afo_sim.simulation import Both, described
from afo_sim.simulation.bilateral import laid_together
from afo_sim.simulation.bilateral_air import Cycle, mean_over

WALK = "walk-dropfoot-afo"
OTHER = {"patient.dorsiflexor_strength": 0.5, "phases.dorsiflexor.inlet[0][1]": 0.8}


@pytest.fixture(scope="module")
def legs() -> Both:
    return afo.both(WALK, left_sets=OTHER)


@pytest.fixture(scope="module")
def alike() -> Both:
    return afo.both(WALK)


@pytest.mark.slow
def test_the_air_of_both_is_the_sum_of_two_runs_alone(legs: Both) -> None:
    """Each leg is simulated here by itself: an ideal supply lets neither disturb the other."""
    alone = [afo.run(WALK).metrics["air_per_stride"], afo.run(WALK, OTHER).metrics["air_per_stride"]]
    found = [float(legs.numbers[f"air_per_stride_{who}"]) for who in ("right", "left", "both")]
    assert found == [*map(float, alone), sum(map(float, alone))]
    assert alone[0] != alone[1]


def test_the_flow_over_a_stride_is_its_air(legs: Both) -> None:
    """∫ ṁ dt over the stride, by the rectangle rule on the run's own step, is the air per stride."""
    for who in ("right", "left", "both"):
        grams = 1e3 * legs.cycle * float(np.mean(legs.flow[who]))
        assert grams == pytest.approx(float(legs.numbers[f"air_per_stride_{who}"]), rel=1e-9)
        litres = float(legs.numbers[f"mean_flow_{who}"])
        assert litres == pytest.approx(grams / STANDARD_DENSITY * 60.0 / legs.cycle, rel=1e-9)


@pytest.mark.parametrize("column", ["ankle/angle", "chamber/dorsiflexor/pressure"])
def test_the_left_stride_is_the_same_half_a_stride_later(legs: Both, column: str) -> None:
    """Of 1093 rows a half is none: half-way between two rows a smooth curve is their mean."""
    last = legs.left["gait/stride"] == legs.left["gait/stride"][-2]
    alone, found = legs.left[column][last], legs.over_stride("left", column)
    middle = 0.5 * (alone + np.roll(alone, -1))
    assert len(alone) == 1093
    assert found == pytest.approx(np.roll(middle, 547), abs=1e-9 * np.abs(alone).max())
    assert legs.over_stride("right", column) == pytest.approx(legs.right[column][last], rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("apart", [0.0, 0.25, 0.5, 0.9])
def test_a_cosine_shifted_is_a_cosine_with_another_phase(apart: float) -> None:
    phase = np.arange(1000) / 1000
    cycle = Cycle(phase, {"wave": np.cos(2.0 * np.pi * phase)})
    expected = np.cos(2.0 * np.pi * (phase - apart))
    assert cycle.at("wave", phase, apart) == pytest.approx(expected, abs=1e-9)
    assert mean_over(phase, expected**2) == pytest.approx(0.5, abs=1e-12)


@pytest.mark.slow
def test_together_the_peaks_add_up_and_apart_they_do_not(alike: Both) -> None:
    """Each leg's inlet is open for less than half a stride: half a stride apart the flows never overlap."""
    together, apart = afo.both(WALK, apart=0.0), alike
    one = float(together.numbers["peak_flow_right"])
    assert float(together.numbers["peak_flow_both"]) == pytest.approx(2.0 * one, rel=1e-12)
    assert float(apart.numbers["peak_flow_both"]) == pytest.approx(one, rel=1e-9)
    assert float(apart.numbers["mean_flow_both"]) == pytest.approx(
        float(together.numbers["mean_flow_both"]), rel=1e-9
    )


def test_a_bottle_lasts_half_as_far_for_two_like_legs(alike: Both) -> None:
    """A stride is 1.21573 m/s · 1.0929 s long (Bovi et al. 2011, as the gait's file has them)."""
    found = alike.numbers
    assert float(found["strides_per_bottle_both"]) == pytest.approx(
        0.5 * float(found["strides_per_bottle_right"])
    )
    assert float(found["stride_length"]) == pytest.approx(1.21573 * 1.0929, rel=1e-3)
    assert float(found["way_per_bottle_both"]) == pytest.approx(
        float(found["strides_per_bottle_both"]) * 1.21573 * 1.0929, rel=1e-3
    )


@pytest.mark.slow
def test_strides_on_one_bottle_are_a_runs_own_for_one_leg() -> None:
    """A left leg without an orthosis takes no air: then both last as long as the right one's run tells."""
    found = afo.both(WALK, "walk-dropfoot", sets={"shoe": "trainer"})
    own = float(afo.run(WALK).metrics["strides_per_bottle"])
    assert float(found.numbers["strides_per_bottle_both"]) == pytest.approx(own, rel=1e-12)
    assert float(found.numbers["air_per_stride_left"]) == 0.0
    lift = next(worse for worse in found.verdict if worse.name == "lift")
    assert (lift.leg, lift.status) == ("left", "bad")  # a drop foot without orthosis trips


def test_the_air_of_both_is_judged_together(alike: Both) -> None:
    """875 strides of one bottle are bad, where 1750 of either leg alone are doubtful (limits `usual`)."""
    air = next(worse for worse in alike.verdict if worse.name == "air")
    assert {who: answer.status for who, answer in air.answers.items()} == {
        "right": "doubtful", "left": "doubtful", "both": "bad",
    }  # fmt: skip
    assert air.status == "bad"


def test_a_seated_pair_is_switched_together() -> None:
    legs = afo.both("seated", left_sets={"timer.dorsiflexor.inlet": [["0 s", "2 s"]]})
    last = legs.right["time"] >= 8.0 - 1e-9  # of 16 s, period 8 s
    expected = sum(
        np.maximum(leg["valve/dorsiflexor_inlet/mass_flow"][last], 0.0) for leg in (legs.right, legs.left)
    )
    assert legs.apart == 0.0 and legs.flow["both"] == pytest.approx(expected, abs=1e-15)
    assert not legs.verdict and "strides_per_bottle_both" not in legs.numbers


def pid(reference: dict[str, str]) -> dict[str, Any]:
    """Scenario values of a seated person whose PID controller follows a reference angle."""
    angle = {"proportional_band": "2 deg", "reference": reference}
    controller = {"rate": "100 Hz", "pid": {"lowers": "plantarflexor", "angle": angle}}
    return {"timer": None, "controller": controller, "duration": "4 s"}


def test_a_seated_pair_is_laid_together_by_the_sine_that_its_controllers_follow() -> None:
    legs = afo.both("seated", sets=pid({"amplitude": "3 deg", "frequency": "0.5 Hz"}))
    inlets = ("valve/dorsiflexor_inlet/mass_flow", "valve/plantarflexor_inlet/mass_flow")
    last = legs.right["time"] >= 2.0 - 1e-9  # of 4 s, two periods of 2 s
    expected = sum(np.maximum(legs.right[name][last], 0.0) for name in inlets)
    assert legs.cycle == 2.0 and expected.max() > 0.0
    assert legs.flow["both"] == pytest.approx(2.0 * expected, abs=1e-15)
    assert np.array_equal(legs.left["controller/output"], legs.right["controller/output"])


def test_a_seated_pair_that_repeats_nothing_is_refused_with_what_it_needs() -> None:
    with pytest.raises(afo.InputError, match=r"^controller: .*a timer, or a controller that follows a sine"):
        afo.both("seated", sets=pid({"mean": "2 deg"}))


def test_each_leg_that_walks_has_a_controller_of_its_own() -> None:
    """A state that was kept from the right leg would switch the left one otherwise."""
    toes = {"rate": "100 Hz", "toe_load": {"peak": "750 N"}}
    sets = {"phases": None, "reference": None, "controller": toes, "duration": "2.3 s"}
    legs = afo.both(WALK, sets=sets)
    assert legs.ok, legs.status
    for name, values in legs.right.columns.items():
        assert np.array_equal(values, legs.left[name], equal_nan=True), name
    assert legs.right["controller/toe_load"].max() > 0.0


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"left_sets": {"gait.stride_time": "1.2 s"}}, "left leg is 1.2 s and the right one's 1.0929 s"),
        ({"left_sets": {"supply.pressure": "3 bar"}}, "3 bar and the right one's 4 bar"),
        ({"left_sets": {"supply.source": "bottle_0_5l"}}, "different sources or regulators"),
        ({"left_sets": {"gait.variability": 0.02}}, "stride time varies"),
        ({"left_sets": {"supply.presure": "3 bar"}}, "did you mean"),
        ({"left_sets": {"side": "right"}}, "is each leg's own here"),
        ({"left": "seated"}, "the left leg's person sits"),
        ({"apart": 1.0}, "apart = 1.0: is out of range"),
        ({"apart": float("nan")}, "is out of range"),
        ({"right": "walk-healthy"}, "neither leg's orthosis has a chamber"),
        ({"right": "seated", "apart": 0.5}, "no strides"),
    ],
)
def test_legs_that_are_not_one_persons_are_refused(given: dict[str, Any], says: str) -> None:
    with pytest.raises(afo.InputError, match=says):
        afo.both(**{"right": WALK} | given)


@pytest.mark.slow
def test_the_right_leg_may_have_no_orthosis(tmp_path: pathlib.Path) -> None:
    """Its supply is drawn whichever leg has it; with none at all there is no air to tell of."""
    legs = afo.both("walk-dropfoot", WALK)
    legs.save(tmp_path, rrd=False)
    assert (tmp_path / "both.png").is_file()
    assert legs.numbers["air_per_stride_right"].value == 0.0


def test_a_leg_that_fails_is_named_and_nothing_is_added_up(legs: Both, tmp_path: pathlib.Path) -> None:
    failed = dataclasses.replace(legs.left, status="failed: a velocity is too large")
    found = laid_together(legs.right, failed, described(WALK, None, left_sets=OTHER), 0.5)
    assert not found.ok and found.status == "left: failed: a velocity is too large"
    assert (
        not found.numbers and not found.verdict and "left: failed" in found.warnings[-2] + found.warnings[-1]
    )
    found.save(tmp_path, rrd=False)
    assert not (tmp_path / "both.png").exists() and (tmp_path / "right/recording.parquet").exists()


def test_saved_legs_are_read_again(legs: Both, tmp_path: pathlib.Path) -> None:
    legs.save(tmp_path / "out", rrd=False)
    for side in ("right", "left"):
        again = afo.read_recording(tmp_path / "out" / side)
        assert again.scenario["side"] == side
        assert np.array_equal(again["ankle/angle"], legs.legs[side]["ankle/angle"])
    told = json.loads((tmp_path / "out/both.json").read_text(encoding="utf-8"))
    grams = [told["numbers"][f"air_per_stride_{who}"]["value"] for who in ("right", "left", "both")]
    assert grams[0] + grams[1] == grams[2]
    assert (tmp_path / "out/both.png").read_bytes().startswith(b"\x89PNG")


def test_warnings_name_their_leg(legs: Both) -> None:
    assert all(w.split(":")[0] in ("right", "left", "both legs") for w in legs.warnings)
    for side, leg in legs.legs.items():
        for warning in leg.warnings:
            assert {f"{side}: {warning}", f"both legs: {warning}"} & set(legs.warnings)
