"""Metrics of a run from columns and facts that are written down."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from afo_sim.metrics import Facts, Metric, MuscleLimits, Run, Skin, Supply, made_of, of_strides, run_metrics
from afo_sim.metrics.metric import Of, functions_of

LIMITS: Any = SimpleNamespace(
    skin_pressure=(14e3, 53e3),
    blood_flow_pressure=4e3,
    bottle_volume=0.5e-3,
    bottle_pressure=300e5,
    muscle_life=1e6,
    strides_per_day=2000.0,
)
COLUMNS = {
    "time": np.arange(4) * 0.5,
    "chamber/front/mass": np.ones(4),
    "chamber/front/pressure": np.array([0.0, 2e5, 3e5, 1e5]),
    "muscle/front_1/force": np.array([0.0, 50.0, 100.0, 20.0]),
    "muscle/front_1/contraction": np.array([0.0, 0.1, 0.05, 0.0]),
    "valve/front_inlet/coil": np.array([0.0, 1.0, 0.0, 1.0]),
    "valve/front_outlet/coil": np.array([1.0, 0.0, 0.0, 0.0]),
    "valve/front_outlet/opening": np.zeros(4),
    "supply/pressure": np.full(4, 4e5),
    "supply/set_pressure": np.full(4, 5e5),
}


def run(**known: float) -> Run:
    """Two seconds of a seated wearer with one muscle, whose cuff bears its force along the shank."""
    facts = Facts(
        timestep=0.5,
        supply=Supply(pressure=4e5, sags=True),
        limits=LIMITS,
        skins={"cuff": Skin(0.015, 0.5, lambda c: np.outer(c["muscle/front_1/force"], [0.0, 0.0, 1.0]))},
        muscles={"front_1": MuscleLimits("front", 6e5, 400.0, 0.25, 0.0)},
        rated_switches={"front_inlet": 3.6e6},
    )
    return Run(COLUMNS, facts, {name: Metric(value) for name, value in known.items()})


def test_each_is_of_the_columns_and_the_facts() -> None:
    found = {
        name: metric.value for name, metric in run_metrics(run(switches_per_minute_front_inlet=60.0)).items()
    }
    assert found["muscle_share_of_pressure"] == pytest.approx(50.0)
    assert found["muscle_share_of_force"] == pytest.approx(99.5 / 4.0)  # over 10 ms to its peak
    assert found["muscle_share_of_contraction"] == pytest.approx(9.95 / 0.25)  # from its peak on
    assert "muscle_share_of_stretch" not in found  # it may not be stretched
    assert found["cuff_holding_force"] == pytest.approx(199.0)
    assert found["supply_sag"] == pytest.approx(20.0)
    assert found["hours_until_valve_life"] == pytest.approx(1000.0)  # one a second
    assert not any("plate" in name or "stride" in name for name in found)


def test_those_that_are_wanted_come_alone() -> None:
    assert set(run_metrics(run(), {"cuff_holding_force"})) == {"cuff_holding_force"}
    assert not run_metrics(run(), set()) and not run_metrics(run(), {"toe_clearance"})
    known = run(exergy_taken=10.0, skeleton_work=1.0, positive_work=3.0)
    assert run_metrics(known, {"exergy_efficiency"}) == {"exergy_efficiency": 10.0}


def test_a_walk_without_a_whole_stride_has_no_margins() -> None:
    way = {"gait/stride": np.zeros(4), "gait/phase": np.linspace(0.0, 0.2, 4)}
    walked = Run(COLUMNS | way, Facts(0.5, 70.0, walks=True, limits=LIMITS, muscles=run().facts.muscles), {})
    assert walked.rows == {} and not run_metrics(walked)


def test_what_strides_report_is_known_by_name() -> None:
    assert of_strides({"strides_per_bottle", "toe_clearance"}) == {
        "free_air_per_stride",
        "stride_time",
        "toe_clearance",
    }
    assert of_strides({"air_first_stride", "fill_time_front", "energy_error"}) == {"air_per_stride"}
    assert of_strides({"known_to_nobody"}) == {"known_to_nobody"} and not made_of({"known_to_nobody"})


def test_functions_come_in_the_order_of_the_groups() -> None:
    names = [function.__name__ for function in functions_of(Of.STRIDE, Of.WORN)]
    assert names.index("clearances") < names.index("push_off") < names.index("torque_deficit")
    assert names.index("torque_deficit") < names.index("against_push_off") < names.index("air_of")
