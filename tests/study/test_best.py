"""The results of sweeps, searches and fits as a notebook's user meets them."""

import dataclasses
import pathlib

import numpy as np
import pytest
from campaign import nightly, size
from command import Call
from sweep_case import write_sweep

import afo_sim as afo
from afo_sim.common import assets
from afo_sim.model import fits
from afo_sim.study import human_scale, read
from afo_sim.study.search import plan
from afo_sim.study.search.best import BestDesign

FORCES = {
    "bore": "20 mm",
    "pressure [bar]": [1, 1, 2, 2, 3, 3],
    "contraction [-]": [0.0, 0.05, 0.0, 0.1, 0.0, 0.15],
    "force [N]": [253, 15, 500, 110, 755, 130],
}


@pytest.fixture(scope="module")
def best() -> BestDesign:
    return afo.optimise(
        "seated",
        {"supply.pressure": ("2 bar", "4 bar")},
        {"duration": "0.5 s"},
        lowest="air_per_cycle",
        limits=["peak_pressure_dorsiflexor >= 10 bar", "air_per_cycle <= 1 kg"],
        generations=2,
        population=4,
        starts=2,
        threads=1,
    )


def test_best_design_has_units_and_limits(best: BestDesign) -> None:
    pressure = best.parameters["pressure"]
    assert pressure.unit == "bar" and "2 bar" <= pressure <= "4 bar"
    assert best.objective == "air_per_cycle" and best.metrics["air_per_cycle"] > "0 g"
    assert list(best.limits.values()) == [False, True] and not best.feasible
    assert next(iter(best.limits)).startswith("peak_pressure_dorsiflexor >= 10")
    assert len(best.starts) == 2 and {start.unit for start in best.starts} == {"g"}
    assert best.summary["designs"] == best.summary["runs"] == 2 * (13 + 4)
    with pytest.raises(dataclasses.FrozenInstanceError):
        best.feasible = True  # type: ignore[misc]


def test_best_design_runs_as_it_was_found(best: BestDesign) -> None:
    again = afo.run(best.scenario)
    assert again.metrics["air_per_cycle"] == best.metrics["air_per_cycle"]
    assert np.isclose(best.scenario.supply.pressure, 1e5 * best.parameters["pressure"], rtol=1e-12)


def test_best_design_in_words(best: BestDesign) -> None:
    assert repr(best).startswith("<BestDesign: lowest air_per_cycle = ")
    assert "pressure = " in repr(best) and "not met: peak_pressure_dorsiflexor >= 10 bar" in repr(best)
    page = best._repr_html_()
    assert "<table>" in page and "no design meets every limit" in page


def test_results_in_words() -> None:
    over = {"supply.pressure": ["2 bar", "4 bar"]}
    found = afo.sweep("seated", over, {"duration": "0.5 s"}, metrics=["air_per_cycle"], threads=1)
    assert repr(found) == "<Results: grid of 2 cases over pressure; 1 metric>"
    page = found._repr_html_()
    assert "best cases" in page and page.count("<table>") == page.count("</table>") >= 3


def test_units_are_of_the_largest_number_whatever_its_sign() -> None:
    for unit, low, human in (
        ("m", 0.02, "mm"),
        ("m", 0.5, "cm"),
        ("m", 2.0, "m"),
        ("s", 0.3, "ms"),
        ("s", 3.0, "s"),
    ):
        for values in ([low, 0.0], [-low, 0.001], [np.nan, -low]):
            factor, found = human_scale(unit, np.array(values))
            assert found == human and afo.Metric(factor * low, found) == f"{low} {unit}", (unit, values)


@pytest.mark.parametrize("times", [1, 2])
def test_a_grid_has_each_cell_once(times: int, tmp_path: pathlib.Path) -> None:
    a, b = (np.tile(each, times) for each in ([3.0, 1.0, 3.0, 1.0], [2.0, 2.0, 5.0, 5.0]))
    write_sweep(tmp_path / "s", "grid", {"a": (a, ""), "b": (b, "")}, {"y": (a * b, "")})
    levels = read(tmp_path / "s").levels()
    assert (levels is None) == (times == 2)
    if levels is not None:
        assert {name: each.tolist() for name, each in levels.items()} == {"a": [1.0, 3.0], "b": [2.0, 5.0]}


@pytest.mark.slow
def test_fit_in_words() -> None:
    found = afo.fit(FORCES, law="tondu_lopez_2000", hold_out="none")
    assert repr(found).startswith("<StaticFit: tondu_lopez_2000 with ")
    assert "over 6 points" in repr(found)
    assert all(name in repr(found) and name in found._repr_html_() for name in found.parameters)


def test_its_limits_are_what_s1_does_at_4_bar() -> None:
    """Each bound is S1's own number, to the digits that the file has."""
    own = afo.run("seated", {"duration": "8 s"}).metrics
    bounds = {limit.metric: str(limit.bound) for limit in plan.read("placement").limits}
    for metric in ("peak_dorsiflexion_torque", "peak_dorsiflexion_angle", "peak_plantarflexion_angle"):
        number = float(bounds[metric].split()[0])
        assert number == pytest.approx(float(own[metric]), abs=0.04), metric
    assert bounds["cuff_skin_pressure"] == "14 kPa"


@nightly("a whole search of 17 s; shorter ones run by day")
@pytest.mark.slow
def test_it_finds_less_pressure_for_the_same_torque(tmp_path: pathlib.Path, call: Call) -> None:
    """A direct run of the found design keeps what is asked for, by the numbers of S1's own run."""
    text = assets.find("search", "placement").read_text(encoding="utf-8")
    file = tmp_path / "short.toml"
    file.write_text(text.replace("generations = 80", f"generations = {size(20, 30)}"), encoding="utf-8")
    assert call("optimise", file, "--out", tmp_path / "found")[0] == 0
    best = afo.load("scenario", tmp_path / "found" / "best.toml")
    own, found = afo.run("seated", {"duration": "8 s"}), afo.run(best)
    assert best.supply.pressure < 3.05e5  # docs/search.md: 3.04 bar, and 2.95 bar with the origin at its end
    # the bounds are written in four digits
    torque = "peak_dorsiflexion_torque"
    assert float(found.metrics[torque]) >= float(own.metrics[torque]) - 1e-3
    assert found["ankle/angle"].max() >= own["ankle/angle"].max() - np.radians(0.02)
    assert found["ankle/angle"][0] == pytest.approx(own["ankle/angle"][0], abs=np.radians(0.1))
    # without air it is slack where the foot rests, and taut below: with any ends that the search may choose,
    # the shortest link of its constraint is taut at -10.3 to -6.9 deg
    assert fits(best.orthosis)["dorsiflexor"].taut < found["ankle/angle"].min() - np.radians(1.0)
