"""The bill of the air from rows that are written down: flows, sag, exergy, and the verdict on a source."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from metrics.test_verdict import LIMITS

from afo_sim.metrics import Answer, Feed, Metric, Window, compressor_metrics, sag_of_both, words
from afo_sim.metrics.air_per_stride import bill, efficiency, sag_metrics
from afo_sim.metrics.bottle import bottle_metrics, cycle_metrics
from afo_sim.metrics.verdict import verdict

GOOD = {
    "strides_counted": 1.0,
    "stride_time": 1.2,
    "air_per_stride": 0.08,
    "free_air_per_minute": 3.4,
    "strides_per_bottle": 2500.0,
}
PUMP = Feed("the compressor small", runs=True)
BOTTLE = Feed("the bottle mine of 1 l at 200 bar")


def rows(supply: list[float], one: list[float], other: list[float]) -> dict[str, np.ndarray]:
    """Flows out of the supply and through the inlets of two chambers [g/s]."""
    n = len(supply)
    return {
        "supply/mass_flow": 1e-3 * np.array(supply),
        "valve/one_inlet/mass_flow": 1e-3 * np.array(one),
        "valve/other_inlet/mass_flow": 1e-3 * np.array(other),
        "ankle/moment/orthosis": np.linspace(-1.0, 1.0, n),
        **{f"chamber/{name}/mass": np.zeros(n) for name in ("one", "other")},
    }


def spent(columns: dict[str, np.ndarray], density: float = 1.185) -> dict[str, float]:
    """The bill of all rows, a second each."""
    return bill(columns, 1.0, Window(0.0, len(columns["supply/mass_flow"])), free_density=density)


def test_air_that_one_chamber_has_from_the_other_is_not_taken_twice() -> None:
    """Both inlets let 2 g/s through, and 2 g/s leave the supply: the other one's are the first one's."""
    found = rows([2.0, 2.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 2.0])
    told = spent(found)
    assert (told["air_per_stride_one"], told["air_per_stride_other"]) == pytest.approx((4.0, 4.0))
    assert told["air_per_stride"] == pytest.approx(4.0)
    del found["supply/mass_flow"]  # of a former recording: as if each had its own
    assert bill(found, 1.0, Window(0.0, 3.0))["air_per_stride"] == pytest.approx(8.0)


def test_air_pushed_back_into_the_supply_is_not_given_back() -> None:
    told = spent(rows([2.0, -1.0, 0.5], [2.0, -1.0, 0.5], [0.0, 0.0, 0.0]))
    assert told["air_per_hour"] == pytest.approx(2.5 * 1200.0)
    assert told["peak_flow"] == pytest.approx(60.0 * 2.0 / 1.185)  # [l/min ANR]


def test_a_gas_of_its_own_has_litres_of_its_own() -> None:
    """3.6 g an hour is 1 mg/s. Carbon dioxide of 20 °C and 1 bar: p M/(R T) = 1.806 g/l."""
    density = 1e5 * 44.0095e-3 / (8.314462 * 293.15)
    told = spent(rows([1e-3], [1e-3], [0.0]), density)
    assert told["air_per_hour"] == pytest.approx(3.6)
    assert told["free_air_per_hour"] == pytest.approx(3.6 / 1.806, rel=1e-3)
    assert told["mean_flow"] == pytest.approx(told["free_air_per_hour"] / 60.0)
    assert told["peak_flow"] == pytest.approx(60e-3 / 1.806, rel=1e-3)


def test_positive_work_is_that_of_a_torque_along_its_motion() -> None:
    """Torque from −1 to 1 N·m over 4 rad: half of it at a mean of 0.5 N·m over 2 rad is 1 J."""
    moved = {"ankle/moment/orthosis": np.linspace(-1.0, 1.0, 21), "ankle/angle": np.linspace(0.0, 4.0, 21)}
    for end, work in ((20.0, 1.0), (19.5, 0.95**2)):  # less a triangle
        assert bill(moved, 1.0, Window(0.0, end))["positive_work"] == pytest.approx(work, rel=1e-12)
    spent, none = {"exergy_taken": 4.0, "skeleton_work": -1.0, "positive_work": 2.0}, {"exergy_taken": 0.0}
    shares = dict(efficiency(SimpleNamespace(totals=spent)))
    assert shares == {"exergy_efficiency": -25.0, "exergy_efficiency_positive": 50.0}
    assert not dict(efficiency(SimpleNamespace(totals=none | {"skeleton_work": 1.0})))


def test_sag_is_the_deepest_below_what_is_set() -> None:
    columns = {
        "time": np.arange(4.0),
        "supply/pressure": np.array([4e5, 3.6e5, 3e5, 3.2e5]),
        "supply/set_pressure": np.array([4e5, 4e5, 4e5, 3.2e5]),
        "store/source/pressure": np.array([9e5, 4e5, 3e5, 3.2e5]),
    }
    told = dict(sag_metrics(columns))
    assert told == pytest.approx(
        {"lowest_supply_pressure": 3.0, "supply_sag": 25.0, "source_empty_after": 2.0}
    )
    after = {"lowest_supply_pressure": Metric(2.0, "bar"), "supply_sag": Metric(9.0, "percent")}
    assert not sag_of_both(columns, {})
    both = {name: float(value) for name, value in sag_of_both(columns, after).items()}
    assert both == pytest.approx(
        {"lowest_supply_pressure": 2.0, "supply_sag": 25.0, "source_empty_after": 2.0}
    )


def test_strides_cycles_and_hours_are_the_litres_of_a_bottle() -> None:
    walked = dict(bottle_metrics(0.08, 1.2, 136.0))
    assert walked["strides_per_bottle"] == pytest.approx(1700.0)
    assert walked["hours_per_bottle"] == pytest.approx(136.0 / (0.08 * 3000.0))  # 3000 strides an hour
    assert set(dict(bottle_metrics(0.08, 1.2, None))) == {"free_air_per_minute"}  # a compressor
    seated = dict(cycle_metrics(0.5, 0.1, 100.0))
    assert seated["cycles_per_bottle"] == pytest.approx(200.0)
    assert seated["hours_per_bottle"] == pytest.approx(200.0 * 6.0 / 3600.0)
    assert not dict(cycle_metrics(0.0, 0.1, 100.0))


# --- the verdict


def air(changes: dict[str, float], feed: Feed | None) -> Answer:
    kept = {name: value for name, value in (GOOD | changes).items() if math.isfinite(value)}
    found = {name: Metric(value, words(name).unit) for name, value in kept.items()}
    return next(answer for answer in verdict(found, {}, LIMITS, feed) if answer.name == "air")


@pytest.mark.parametrize(
    ("share", "duty", "status"),
    [(99.0, 80.0, "good"), (99.0, 100.0, "doubtful"), (100.0, 100.0, "doubtful"), (100.1, 100.0, "bad")],
)
def test_a_compressor_is_judged_by_what_it_can_give(share: float, duty: float, status: str) -> None:
    told = {name: float(m) for name, m in compressor_metrics(share, 300.0, 100.0, duty / 100.0, 20.0).items()}
    assert told["source_share"] == pytest.approx(share) and told["compressor_power"] == pytest.approx(
        0.2 * duty
    )
    answer = air(told | {"strides_per_bottle": math.nan}, PUMP)
    assert answer.status == status
    assert f"The compressor small runs {duty:.0f} % of the time" in answer.text
    assert f"{0.2 * duty:.3g} W" in answer.text and "strides" not in answer.text + answer.limit
    assert ("cannot keep up: at the set pressure it delivers 3.4 l/min" in answer.text) == (status == "bad")


def test_a_compressor_that_gives_nothing_at_the_set_pressure_is_bad() -> None:
    told = {name: float(m) for name, m in compressor_metrics(1.0, 2.0, 0.0, 1.0, None).items()}
    answer = air(told, PUMP)
    assert answer.status == "bad" and "it delivers nothing" in answer.text
    assert air({}, PUMP).status == "unknown"  # a recording without its duty


@pytest.mark.parametrize(("sag", "status"), [(10.0, "good"), (10.1, "bad")])
@pytest.mark.parametrize("feed", [None, BOTTLE])
def test_a_supply_that_sags_is_bad(sag: float, status: str, feed: Feed | None) -> None:
    answer = air({"supply_sag": sag, "lowest_supply_pressure": 3.596}, feed)
    assert answer.status == status
    assert ("falls to 3.60 bar, 10 % below its set pressure" in answer.text) == (status == "bad")
    assert ("sag at most 10 %" in answer.limit) == (status == "bad" or feed is not None)


def test_a_bottle_that_empties_within_the_run_is_bad_whatever_it_would_last() -> None:
    answer = air({"source_empty_after": 34.0, "supply_sag": 3.0, "lowest_supply_pressure": 3.88}, BOTTLE)
    assert answer.status == "bad" and "is empty after 34 s." in answer.text
    assert "The bottle mine of 1 l at 200 bar lasts 2500 strides, 50 min." in answer.text
    assert "2.8 h" in air({"strides_per_bottle": 8400.0}, BOTTLE).text  # · 1.2 s
