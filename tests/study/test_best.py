"""The results of sweeps, searches and fits as a notebook's user meets them."""

import dataclasses

import numpy as np
import pytest

import afo_sim as afo
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
    assert best.summary["designs"] == 16
    with pytest.raises(dataclasses.FrozenInstanceError):
        best.feasible = True  # type: ignore[misc]


def test_best_design_runs_as_it_was_found(best: BestDesign) -> None:
    again = afo.run(best.scenario)
    assert again.metrics["air_per_cycle"] == best.metrics["air_per_cycle"]
    assert np.isclose(best.scenario.supply.pressure, 1e5 * best.parameters["pressure"], rtol=1e-12)


def test_best_design_in_words(best: BestDesign) -> None:
    assert repr(best).startswith("<BestDesign: lowest air_per_cycle = ")
    assert "pressure = " in repr(best) and "not kept: peak_pressure_dorsiflexor >= 10 bar" in repr(best)
    page = best._repr_html_()
    assert "<table>" in page and "no design keeps every limit" in page


def test_results_in_words() -> None:
    over = {"supply.pressure": ["2 bar", "4 bar"]}
    found = afo.sweep("seated", over, {"duration": "0.5 s"}, metrics=["air_per_cycle"], threads=1)
    assert repr(found) == "<Results: grid of 2 cases over pressure; 1 metric>"
    page = found._repr_html_()
    assert "best cases" in page and page.count("<table>") == page.count("</table>") >= 3


def test_fit_in_words() -> None:
    found = afo.fit(FORCES, law="tondu_lopez_2000", hold_out="none")
    assert repr(found).startswith("<StaticFit: tondu_lopez_2000 with ")
    assert "over 6 points" in repr(found)
    assert all(name in repr(found) and name in found._repr_html_() for name in found.parameters)
