"""Bands of a run: what draws that are alike, spread or fail say of it."""

import dataclasses
import json
import pathlib
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats
from spread_tables import spread, spreads_file

import afo_sim
from afo_sim.common import InputError
from afo_sim.description import Scenario, load
from afo_sim.simulation import Recording, read_recording
from afo_sim.simulation.run import run
from afo_sim.study import with_studies
from afo_sim.study.engine import CYCLE
from afo_sim.study.uncertainty.running import (
    _notes,
    check_draws,
    quantiles,
    shares_of_one,
    uncertainty,
)

SHORT = {"timestep": "4 ms", "duration": "4 s"}
DEVICE = ["orthosis.chamber.*.inlet.conductance", "orthosis.muscle.*.type.bore"]
TISSUE = ["patient.passive_scale", "orthosis.muscle.*.type.damping"]
NOTHING = (
    spread("muscle_fit", fit="orthosis.muscle.*.type", scale=0.0)
    + spread("mounting", "lognormal", key="orthosis.anchor.*.stiffness", factor_sd=0.0)
    + spread("device", "normal", keys=DEVICE, relative_sd=0.0)
    + spread("tissue", "lognormal", keys=TISSUE, factor_sd=0.0)
    + spread("toes", "uniform", key="leg.toes.swing_extension", within="0 deg")
    + spread("pace", "normal", key="gait.stride_time", each_stride=True, relative_sd=0.0)
    + spread("path", "pearson3", height="each stride", each_stride=True, sd="0 mm", skew=0.6)
)
PATH = spread("path", "normal", height="each stride", each_stride=True, sd="{sd}")


@pytest.fixture(scope="module")
def walk() -> Scenario:
    found: Scenario = load("scenario", "walk-dropfoot-afo", SHORT)
    return found


@pytest.fixture(scope="module")
def plain(walk: Scenario) -> Recording:
    return run(walk)


@pytest.mark.slow
def test_without_spread_every_draw_is_the_plain_run_to_the_bit(
    tmp_path: pathlib.Path, walk: Scenario, plain: Recording
) -> None:
    found = uncertainty(walk, plain, 20, spreads_file(tmp_path, NOTHING), threads=1)
    assert found["failed"]["count"] == 0 and len(found["metrics"]) > 8
    for name, facts in found["metrics"].items():
        own = plain.metrics[name].value
        assert facts["own"] == own and facts["quantiles"] == [own, own, own], name
    for column, (low, _, high) in found["curves"].items():
        assert low == high, column
    assert found["measure_next"] == [] and found["rest"] == {}
    assert not any("own band" in note for note in found["notes"])


def test_curves_are_those_of_the_settled_stride(
    tmp_path: pathlib.Path, walk: Scenario, plain: Recording
) -> None:
    found = uncertainty(walk, plain, 20, spreads_file(tmp_path, NOTHING), threads=1)
    solved = plain["gait/solved"] == 1.0
    progress = (plain["gait/stride"] + plain["gait/phase"])[solved]
    last = np.floor(progress[-1] + 1e-9) if progress[-1] % 1 < 1e-9 else np.floor(progress[-1])
    angle = np.interp(last + CYCLE[::2], progress, plain["ankle/angle"][solved])
    inside = CYCLE[::2] < 0.99
    assert np.array(found["curves"]["ankle/angle"][1])[inside] == pytest.approx(angle[inside], abs=1e-3)


@pytest.mark.slow
def test_a_height_moves_clearance_and_trips_and_nothing_else(
    tmp_path: pathlib.Path, walk: Scenario, plain: Recording
) -> None:
    # far above the floor and far below it, by turns: half of the strides trip
    found = uncertainty(walk, plain, 200, spreads_file(tmp_path, PATH.format(sd="1 m")), threads=1)
    own = plain.metrics["toe_clearance"].value
    low, middle, high = found["metrics"]["toe_clearance"]["quantiles"]
    assert (low, high) == pytest.approx((own - 1644.9, own + 1644.9), abs=30.0)
    assert middle == pytest.approx(own, abs=10.0)
    air = found["metrics"]["air_per_stride"]
    assert air["quantiles"] == [air["own"]] * 3
    assert found["trips"]["touch"]["share"] == pytest.approx(0.5, abs=0.02)
    assert found["groups"][0]["explained"]["toe_clearance"] == pytest.approx(1.0, abs=1e-6)
    assert found["measure_next"] == []  # no measurement takes away what varies


def test_a_tiny_path_never_trips_a_foot_that_clears_the_floor(
    tmp_path: pathlib.Path, walk: Scenario, plain: Recording
) -> None:
    found = uncertainty(walk, plain, 20, spreads_file(tmp_path, PATH.format(sd="0.01 mm")), threads=1)
    passing = plain.metrics["swings_within_10mm"].value / 100.0  # of the same foot, by its own definition
    assert found["trips"]["touch"]["share"] == plain.metrics["swings_with_toe_contact"].value / 100.0
    assert found["trips"]["within_10mm"]["share"] == passing


@pytest.mark.slow
def test_bands_are_of_this_scenario_and_the_same_however_computed(walk: Scenario, plain: Recording) -> None:
    calls: list[tuple[int, int, str]] = []
    one = uncertainty(
        walk, plain, 24, threads=1, seed=5, report=lambda done, of, what: calls.append((done, of, what))
    )
    two = uncertainty(walk, plain, 24, threads=2, seed=5)
    assert json.dumps(one) == json.dumps(two)
    assert calls[-1][:2] == (24, 24)
    other = uncertainty(walk, plain, 24, threads=2, seed=6)
    assert other["metrics"]["toe_clearance"] != one["metrics"]["toe_clearance"]


@pytest.mark.slow
def test_a_cuff_that_is_known_better_gives_a_narrower_band(
    tmp_path: pathlib.Path, walk: Scenario, plain: Recording
) -> None:
    widths = []
    for sd in (0.05, 0.1, 0.4):
        cuff = spread("cuff", "lognormal", key="orthosis.anchor.shank.stiffness", factor_sd=sd)
        found = uncertainty(walk, plain, 30, spreads_file(tmp_path, cuff), threads=1)
        low, _, high = found["metrics"]["torque_against_push_off"]["quantiles"]
        widths.append(high - low)
        assert found["groups"][0]["explained"]["torque_against_push_off"] > 0.95
        assert found["measure_next"] == ["cuff"]
    assert widths[1] == pytest.approx(2.0 * widths[0], rel=0.05)  # small spreads are linear
    assert widths[2] > 3.0 * widths[1]


@pytest.mark.slow
def test_draws_that_fail_are_counted_with_their_reason(
    tmp_path: pathlib.Path, walk: Scenario, plain: Recording
) -> None:
    # at hundreds of newton metres the ankle goes through its stops; at tens it does not
    load_of = spread("load", "normal", key="load_moment", sd="200 N*m")
    found = uncertainty(walk, plain, 40, spreads_file(tmp_path, load_of), threads=1)
    failed = found["failed"]
    assert 0 < failed["count"] < 40 and len(failed["draws"]) == failed["count"]
    assert sum(one["count"] for one in failed["reasons"]) <= failed["count"]
    assert failed["reasons"][0]["reason"].startswith("unstable: ")
    column = found["drawn"][0]
    assert column["own"] == 0.0 and column["quantiles"][2] == pytest.approx(1.645 * 200.0, rel=0.1)


@pytest.mark.slow
def test_who_wears_nothing_has_bands_of_tissue_and_strides() -> None:
    walk = load("scenario", "walk-dropfoot", SHORT)
    found = uncertainty(walk, run(walk), 60, threads=1)
    assert found["failed"]["count"] == 0 and "air_per_stride" not in found["metrics"]
    assert "tissue" in found["measure_next"]
    low, _, high = found["metrics"]["toe_clearance"]["quantiles"]
    assert high - low > 10.0 and found["left_out"]


@pytest.mark.slow
def test_what_is_worth_most_to_know_is_measured_next(walk: Scenario, plain: Recording) -> None:
    found = uncertainty(walk, plain, 120, threads=2)
    measured = {group["name"]: group for group in found["groups"] if not group["each_stride"]}
    for name, group in measured.items():
        assert 0.0 < group["wrong_left"] <= found["wrong"] <= 0.5 and group["wrong_left_error"] > 0.0, name
        for metric, share in group["explained"].items():  # of a normal metric, width² goes as the variance
            assert group["band_left"][metric] ** 2 == pytest.approx(1.0 - max(share, 0.0), abs=1e-9)
    assert not any("band_left" in group for group in found["groups"] if group["each_stride"])
    told = [measured[name] for name in found["measure_next"]]
    gains = [found["wrong"] - group["wrong_left"] for group in told]
    sure = [gain > group["wrong_left_error"] for gain, group in zip(gains, told, strict=True)]
    assert sure == sorted(sure, reverse=True) and sure[0]  # gains beyond their error first, the largest ...
    assert gains[: sum(sure)] == sorted(gains[: sum(sure)], reverse=True)
    left = [group["band_left"]["toe_clearance"] for group in told]
    assert left[sum(sure) :] == sorted(left[sum(sure) :]) and max(left) < 0.99  # ... and then the band
    assert found["wrong"] == pytest.approx(1.0 - found["kept"]["lift"], abs=3.0 * found["wrong_error"])


@pytest.mark.parametrize("count", [-3, 1, 19, 10**7, "20", 20.5])
def test_a_number_of_draws_that_tells_nothing_is_refused(walk: Scenario, count: Any) -> None:
    with pytest.raises(InputError, match="20 to 100000"):
        check_draws(walk, count, "usual")


def test_a_gait_that_is_not_there_is_no_fault_of_the_spreads(walk: Scenario) -> None:
    with pytest.raises(InputError, match="no such gait") as caught:
        check_draws(walk.set({"gait.cycle": "nothere.csv"}), 20, "usual")
    assert (caught.value.value, caught.value.file) == ("nothere.csv", None)


@pytest.mark.slow
def test_a_run_keeps_its_bands(tmp_path: pathlib.Path, walk: Scenario, plain: Recording) -> None:
    told = with_studies(plain, walk, draws=20)
    kept = read_recording(told.save(tmp_path / "run", rrd=False))
    assert kept.studies["uncertainty"] == json.loads(json.dumps(told.studies["uncertainty"]))
    assert plain.studies.keys() == {"time_step"}


def test_a_run_that_failed_has_no_bands(walk: Scenario, plain: Recording) -> None:
    failed = dataclasses.replace(plain, status="failed: a test")
    assert with_studies(failed, walk, draws=20).studies == plain.studies


@pytest.mark.slow
def test_the_library_tells_the_same() -> None:
    found = afo_sim.uncertainty("walk-dropfoot-afo", SHORT, draws=20, seed=7)
    again = afo_sim.uncertainty(load("scenario", "walk-dropfoot-afo"), SHORT, draws=20, seed=7)
    assert found.studies == again.studies and found.studies["uncertainty"]["seed"] == 7


def test_quantiles_of_a_normal() -> None:
    even = stats.norm.ppf((np.arange(100_000) + 0.5) / 100_000)
    assert quantiles(3.0 + 2.0 * even) == pytest.approx([3.0 - 3.2897, 3.0, 3.0 + 3.2897], abs=1e-3)


def test_quantiles_of_curves_are_those_of_each_point() -> None:
    curves = np.array([[0.0, 10.0], [1.0, 30.0], [2.0, 20.0]])
    assert quantiles(curves)[1] == [1.0, 20.0]


def test_share_of_one_wearer_is_that_of_the_path_alone() -> None:
    # a wearer 6 mm above the floor whose path varies by 3 mm: Φ(−2) of the strides touch it
    path = 0.003 * stats.norm.ppf((np.arange(20_000) + 0.5) / 20_000)
    found = shares_of_one(np.array([0.006, 0.0, -0.1, 0.1]), path, 0.0)
    assert found == pytest.approx([stats.norm.cdf(-2.0), 0.5, 1.0, 0.0], abs=1e-3)


@pytest.mark.parametrize(("own", "beside"), [(0.5, 0), (-0.1, 1), (1.1, 1), (np.nan, 0)])
def test_a_run_beside_its_own_band_is_noted(own: float, beside: int) -> None:
    """Draws from 0 to 1; of those that are all alike nothing is said."""
    values = np.linspace(0.0, 1.0, 101)
    found: Any = SimpleNamespace(
        outcomes=[], ok=values >= 0.0, draws=SimpleNamespace(groups=[]), metric=lambda _: values
    )
    walked: Any = SimpleNamespace(metrics={"toe_clearance": own})
    assert len(_notes(found, walked)) == beside
    values = np.full(101, 2.0)
    assert _notes(found, walked) == []
