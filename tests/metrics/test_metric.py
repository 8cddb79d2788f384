"""A metric is a number with a unit, and each one is registered once, beside the function that reports it."""

import copy
import dataclasses
import json
import math
import pickle
import subprocess
import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from synthetic_walk import MASS, STEP, walk_columns, with_orthosis

from afo_sim.common import InputError, parse_quantity
from afo_sim.metrics import (
    GROUPS,
    METRICS,
    OTHER,
    REPORTED,
    WORDS,
    Facts,
    Metric,
    Skin,
    ankle_metrics,
    by_laws_metrics,
    compressor_metrics,
    energy_metrics,
    filled_once_metrics,
    first_stride_metrics,
    reference_metrics,
    settling_metrics,
    uncompensated_metrics,
    walk_metrics,
    walkers_metrics,
    walking,
    words,
)
from afo_sim.metrics.air_per_stride import air_of, efficiency, sag_metrics
from afo_sim.metrics.bottle import bottle_metrics, cycle_metrics
from afo_sim.metrics.clearance import clearances
from afo_sim.metrics.heel_contact import laid
from afo_sim.metrics.metric import all_measured, measured, reported, reporting
from afo_sim.metrics.muscle_limits import life_metrics, muscle_metrics
from afo_sim.metrics.skin_pressure import pressures, skin
from afo_sim.metrics.valves import filling
from afo_sim.metrics.valves import life_metrics as valve_metrics
from afo_sim.simulation import Energy

clearance = Metric(12.5, "mm")


def test_a_metric_computes_as_a_float() -> None:
    assert float(clearance) == clearance.value == 12.5
    for made in (clearance + 1, 2.0 * clearance, -clearance, clearance / 5, abs(clearance), clearance**2):
        assert type(made) is float
    assert sum([clearance, clearance]) == 25.0
    assert clearance - Metric(2.5, "mm") == 10.0
    assert round(clearance) == 12 and math.floor(clearance) == 12
    assert json.loads(json.dumps({"clearance": clearance})) == {"clearance": 12.5}


def test_numpy_takes_metrics_for_numbers() -> None:
    array = np.array([clearance, Metric(math.nan, "mm")])
    assert array.dtype == np.float64 and array[0] == 12.5
    assert np.isnan(Metric(math.nan, "mm")) and not np.isnan(clearance)
    assert np.array_equal(np.array([1.0, 20.0]) > clearance, [False, True])
    assert np.array_equal(np.array([12.5, 20.0]) == clearance, [True, False])
    assert np.float64(20.0) > clearance and not np.float64(10.0) > clearance


def test_it_compares_with_numbers_texts_and_metrics() -> None:
    assert clearance > 10 and not clearance > 20 and clearance <= 12.5 and not clearance < 12.5
    assert clearance > "10 mm" and clearance >= "1.25 cm" and clearance < "1 m"
    assert clearance == "12.5 mm" and clearance != "12 mm"
    assert Metric(1.25, "cm") == clearance and Metric(2.0, "cm") > clearance
    assert Metric(60.0, "percent") > "50 %" and Metric(60.0, "%") > "50 percent"
    assert Metric(5.0, "N*m") > "4 N·m" and Metric(5.0, "deg") < "0.1 rad" and Metric(3.0, "") > "2"
    assert max(clearance, Metric(2.0, "cm")).unit == "cm"


@pytest.mark.parametrize("other", ["10 deg", "10", "ten mm", Metric(1.0, "N")])
def test_an_order_between_dimensions_is_refused_and_equality_is_false(other: object) -> None:
    with pytest.raises(InputError, match="mm"):
        clearance > other  # noqa: B015
    assert clearance != other and other != clearance


def test_it_is_written_with_its_unit_and_formatted_as_a_number() -> None:
    assert (str(clearance), f"{clearance}", repr(clearance)) == ("12.5 mm", "12.5 mm", "<12.5 mm>")
    assert (f"{clearance:.2f}", format(clearance, "6.1f")) == ("12.50", "  12.5")
    assert str(Metric(3.0, "")) == "3"
    assert str(clearance.to("cm")) == "1.25 cm"
    with pytest.raises(InputError, match="deg"):
        clearance.to("deg")


def test_it_is_fixed_copied_and_hashed() -> None:
    with pytest.raises(AttributeError, match="fixed"):
        clearance.unit = "m"  # type: ignore[misc]
    for twin in (copy.deepcopy(clearance), pickle.loads(pickle.dumps(clearance))):
        assert (type(twin), twin, twin.unit) == (Metric, clearance, "mm")
    assert len({clearance, Metric(12.5, "mm"), 12.5}) == 1
    nothing = Metric(math.nan, "s")
    assert nothing != nothing and not nothing > 0


# --- the registry


def told() -> dict[str, Metric]:
    """Everything that walking, its settled stride, a fixed shank and a balance of energy tell."""
    plain = walk_columns(4.2)
    for how in ("less", "more"):
        plain[f"sole/height_{how}_extended"] = plain["sole/height"]
    columns = with_orthosis(plain, np.where(plain["gait/phase"] > 0.6, 3.0, -1.0))
    columns = {**columns, "ankle/moment/inversion": np.sin(columns["time"])}
    columns |= {"gait/ground_force_z": columns["ground/force/z"], "foot/toe_load": columns["ground/force/z"]}
    terms = {field.name: 1.0 for field in dataclasses.fields(Energy) if field.name != "turnover"}
    balance = energy_metrics(terms, 2, 1e-4)
    walking = walk_metrics(columns, STEP, MASS).totals | settling_metrics(5, 1e-6, 1e-5)
    compared = reference_metrics(walking, walking) | uncompensated_metrics(walking, walking)
    compared |= by_laws_metrics(9.0)
    compared |= filled_once_metrics(walking | {"pressure": Metric(3.0, "bar")})
    first, _ = first_stride_metrics([walking] * 10, walking, 1e-3)
    supply = {
        "time": np.arange(3.0),
        "supply/pressure": np.array([4e5, 3.9e5, 3.5e5]),
        "supply/set_pressure": np.full(3, 4e5),
        "store/source/pressure": np.array([5e5, 4e5, 3e5]),
    }
    turns = {
        "time": np.arange(4.0),
        "chamber/front/mass": np.ones(4),
        "chamber/front/pressure": np.array([0.0, 4e5, 4e5, 0.0]),
        "valve/front_inlet/coil": np.array([1.0, 1.0, 0.0, 0.0]),
        "valve/front_outlet/coil": np.array([0.0, 0.0, 1.0, 1.0]),
        "valve/front_outlet/opening": np.array([0.0, 0.0, 1.0, 1.0]),
        "supply/pressure": np.full(4, 4e5),
    }
    totals = {"exergy_taken": 12.0, "skeleton_work": 1.0, "positive_work": 3.0}
    spent: Any = SimpleNamespace(totals=totals)
    late: Any = [SimpleNamespace(rows=slice(1, 3))]
    fed = dict(filling(turns)) | dict(sag_metrics(supply, late)) | dict(efficiency(spent))
    pull = np.ones((3, 3)), STEP, 0.01, 0.5, (14e3, 53e3), 4e3
    shares = {key: [0.5] for key in ("pressure", "force", "contraction", "stretch")}
    margins = *pressures("cuff", *pull), *pressures("plate", *pull), *muscle_metrics(shares)
    lasts = *bottle_metrics(0.08, 1.1, 140.0), *cycle_metrics(0.8, 0.1, 140.0), *life_metrics(1.0, 1e6, 2e3)
    under = Skin(pull[2], pull[3], lambda rows: rows["pull"])
    facts = Facts(STEP, MASS, True, skins={"cuff": under, "plate": under}, laid=0.02)
    worn: Any = SimpleNamespace(facts=facts, rows={"pull": np.outer([2.0, 1.0], np.ones(3))})
    chamber = {"mass": np.zeros(4), "pressure": np.array([0.0, 1.0, 1.0, 0.0])}
    filled = {"time": np.arange(4.0), "supply/pressure": np.ones(4)}
    filled |= {f"chamber/front/{name}": values for name, values in chamber.items()}
    coils = {"inlet": np.array([1.0, 0.0, 0.0, 0.0]), "outlet": np.array([0.0, 0.0, 1.0, 0.0])}
    filled |= {
        f"valve/front_{side}/{name}": coil for side, coil in coils.items() for name in ("coil", "opening")
    }
    worth = (*margins, *lasts, *skin(worn), *laid(worn), *valve_metrics({"front": 1.0}, {"front": 1e8}))
    return {
        **all_measured(filling(filled)),
        **walking,
        **compared,
        **first,
        **ankle_metrics(columns, STEP, 1.0),
        **balance,
        **all_measured(worth),
        **compressor_metrics(2.0, 6.0, 3.0, 0.8, 20.0),
        **walkers_metrics({row.name: 1.0 for row in REPORTED[walkers_metrics]}),
        **all_measured(fed.items()),
    }


@pytest.mark.slow
def test_every_registered_metric_is_told_by_its_function() -> None:
    rows = {name for name, row in METRICS.items() if not any(row.fill(one) for one in told())}
    assert rows == set()


def test_every_metric_told_has_its_row_and_unit() -> None:
    for name, metric in told().items():
        assert words(name).group in GROUPS and words(name).group != OTHER
        assert metric.unit == words(name).unit
        if metric.unit not in ("", "percent"):
            parse_quantity(f"1 {metric.unit}", metric.unit)


def test_a_process_that_simulates_nothing_has_all_words() -> None:
    """A report is written of runs that another process has simulated."""
    code = "from afo_sim.metrics.metric_words import METRICS; print(*METRICS)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert set(done.stdout.split()) == set(METRICS)


def test_names_with_a_chamber_or_a_direction_are_filled_in() -> None:
    assert words("air_per_stride_front").label == "Air per stride, front"
    assert words("air_per_stride").label == "Air per stride"
    assert words("peak_push_off_torque").label == "Push off torque, peak over 10 ms"
    assert words("lowest_pressure_front").meaning == "gauge"
    assert "air_per_stride" in WORDS and not any("{" in name for name in WORDS)
    assert words("something_new") == words("something_new")
    assert words("something_new").group == OTHER


def test_a_metric_without_a_row_is_refused_and_a_row_stands_once() -> None:
    with pytest.raises(KeyError, match="something_new"):
        measured("something_new", 1.0)
    with pytest.raises(AssertionError, match="twice"):
        reported(OTHER, ("rise_time", "s", "Rise time"))(lambda: None)


def test_what_is_asked_for_is_what_is_told_beside_it() -> None:
    parts: tuple[Any, ...] = (walking._timing, clearances, air_of)
    assert reporting(parts, None) == parts
    assert reporting(parts, frozenset({"toe_clearance", "stance"})) == parts[:2]
    assert reporting(parts, frozenset({"air_per_stride_dorsiflexor"})) == parts[2:]
    assert reporting(parts, frozenset({"known_to_nobody"})) == parts
    assert reporting(parts, frozenset()) == ()
