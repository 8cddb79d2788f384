"""A metric that has another name now is refused with that name, wherever one is asked for."""

import pathlib

import pytest

import afo_sim
from afo_sim.common import InputError
from afo_sim.metrics import Metric, Metrics
from afo_sim.metrics.metric import RENAMED
from afo_sim.metrics.metric_words import METRICS
from afo_sim.simulation.checks import check_metric

OLD, NEW = "share_of_dorsiflexion_moment", "orthosis_swing_torque_mean"


def test_a_new_name_is_registered_and_an_old_one_is_not() -> None:
    for old, (new, why) in RENAMED.items():
        assert old not in METRICS and new in METRICS and why


def test_metrics_refuse_what_they_have_not() -> None:
    found = Metrics({"toe_clearance": Metric(3.0, "mm")})
    assert found == {"toe_clearance": 3.0} and found.get(OLD) is None and OLD not in found
    with pytest.raises(InputError, match=r"any more.*push-off") as refused:
        found[OLD]
    assert refused.value.nearest == NEW
    with pytest.raises(InputError, match="did you mean 'toe_clearance'"):
        found["toe_clearence"]


def test_a_run_and_its_checks_refuse_an_old_name() -> None:
    run = afo_sim.run("seated", {"duration": "0.2 s"})
    for ask in (lambda: run.metrics[OLD], lambda: check_metric(run, OLD, 0.0, 1.0)):
        with pytest.raises(InputError, match="any more") as refused:
            ask()
        assert refused.value.nearest == NEW


def test_a_sweep_and_a_search_refuse_an_old_name(tmp_path: pathlib.Path) -> None:
    over = {"supply.pressure": afo_sim.span("3 bar", "4 bar", 2)}
    with pytest.raises(InputError, match=f"any more.*did you mean '{NEW}'"):
        afo_sim.sweep("walk-dropfoot-afo", over, out=tmp_path / "a", metrics=[OLD])
    range_of = {"supply.pressure": ("3 bar", "4 bar")}
    with pytest.raises(InputError, match=f"any more.*did you mean '{NEW}'"):
        afo_sim.optimise("walk-dropfoot-afo", parameters=range_of, lowest=OLD, out=tmp_path / "b")
