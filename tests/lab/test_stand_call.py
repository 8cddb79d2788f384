"""The stand as a call from Python: text or SI, any way to name a muscle, tables, errors by argument."""

import pathlib

import numpy as np
import pytest
from stand_tests import isobaric

from afo_sim.common import GRAVITY, InputError, assets, find
from afo_sim.description import load
from afo_sim.lab import COLUMNS, read_measured
from afo_sim.lab.stand import stand

SHORT = {"static": True}


def forces(tests: object) -> np.ndarray:
    return tests.table()["force"]  # type: ignore[attr-defined, no-any-return]


@pytest.mark.slow
def test_text_and_numbers_in_si_are_the_same_amounts() -> None:
    text = stand("isobaric", "dmsp_20", pressure=["2 bar", "4 bar"], contraction="10 %", **SHORT)
    numbers = stand("isobaric", "dmsp_20", pressure=[2e5, 4e5], contraction=0.1, **SHORT)
    assert np.array_equal(forces(text), forces(numbers))
    hung = stand("isotonic", "dmsp_20", load="20 kg", **SHORT)
    assert hung.trials[0].plan.set_points == pytest.approx([20.0 * GRAVITY])
    array = stand("isotonic", "dmsp_20", load=np.array([100.0, 200.0]), **SHORT)
    assert array.trials[0].plan.set_points.tolist() == [100.0, 200.0]


def test_a_muscle_is_a_name_a_path_a_dict_or_itself() -> None:
    muscle = load("muscle", "dmsp_20")
    ways = ["dmsp_20", find("muscle", "dmsp_20"), muscle.model_dump(mode="json"), muscle]
    found = stand("isobaric", ways, pressure="3 bar", **SHORT)
    assert len(found.trials) == 4
    first, *others = (trial.curves[0]["force"] for trial in found.trials)
    assert all(np.array_equal(first, other) for other in others)


def test_laws_are_laid_over_a_muscle_object_and_each_trial_has_its_own() -> None:
    muscle = load("muscle", "dmsp_20")
    found = stand("isobaric", muscle, law=["sarosi_2012", "bolen_2026"], pressure="3 bar", **SHORT)
    assert [trial.plan.muscle.law for trial in found.trials] == ["sarosi_2012", "bolen_2026"]
    named = stand("isobaric", "dmsp_20", law="bolen_2026", pressure="3 bar", **SHORT)
    assert np.array_equal(found.trials[1].curves[0]["force"], named.trials[0].curves[0]["force"])


@pytest.mark.slow
def test_the_call_runs_the_rig_as_the_test_itself_does() -> None:
    called = stand("isobaric", "dmsp_20", pressure="3 bar", time="8 s")
    direct = isobaric("dmsp_20", [3e5], duration=8.0)
    assert np.array_equal(called.trials[0].curves[0]["force"], direct.curves[0]["force"])


@pytest.mark.slow
def test_all_is_three_tests_and_the_table_goes_to_pandas() -> None:
    found = stand("all", "dmsp_20", **SHORT)
    assert found.kinds == ("isobaric", "isotonic", "isometric")
    import pandas as pd

    frame = pd.DataFrame(found.table())
    assert list(frame.columns)[6:] == list(COLUMNS)
    assert set(frame["test"]) == {f"{kind}, formula" for kind in found.kinds}
    rows = sum(len(curve["time"]) for trial in found.trials for curve in trial.curves)
    assert len(frame) == rows
    assert len(found.of("isotonic").trials) == 1


def test_measured_points_are_held_against_each_trial() -> None:
    data = find("muscle", "dmsp_10").parent / "characteristic.csv"
    found = stand("isobaric", "dmsp_10", law=["sarosi_2012", "maximum_force"], compare=data, **SHORT)
    assert len(found.compared) == 2
    error = found.compared[0].predicted - found.compared[0].measured
    assert found.compared[0].rms == pytest.approx(np.sqrt(np.mean(error**2)))


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"pressure": 7e5}, "pressure"),
        ({"contraction": "x %"}, "contraction"),
        ({"test": "isometric", "length": "5 cm"}, "length"),
        ({"test": "isotonic", "load": "5 m"}, "load"),
        ({"test": "step", "load": ["100 N", "200 N"]}, "load"),
        ({"test": "step", "compare": "measured.csv"}, "compare"),
    ],
)
def test_errors_name_the_argument(arguments: dict[str, object], field: str) -> None:
    with pytest.raises(InputError) as caught:
        stand(**({"test": "isobaric", "muscle": "dmsp_20"} | arguments))  # type: ignore[arg-type]
    assert caught.value.field == field
    assert "--" not in str(caught.value)


def test_a_path_that_is_not_there_is_named(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match=r"absent\.csv"):
        stand("isobaric", "dmsp_20", compare=tmp_path / "absent.csv")


def test_a_law_is_doubted_below_its_contraction_and_not_where_the_braid_carries() -> None:
    """The pleated law holds from 5 % on; a weight stretches the other muscle, whose law is asked at 0."""
    for test, muscle, doubted in (("release", "pleated_110mm", True), ("isotonic", "reynolds_2003", False)):
        (trial,) = stand(test, muscle).trials
        assert trial.curves[0]["contraction"].min() < 0.05
        assert ("law-contraction" in {notice.code for notice in trial.warnings}) is doubted


def test_points_on_many_curves_are_compared_with_the_one_that_is_named() -> None:
    data = read_measured(assets.folder("models") / "muscles" / "dmsp_20" / "characteristic.csv")
    load = float(data.force[np.argmin(np.abs(data.force - 300.0))])
    with pytest.raises(InputError, match="isotonic curves of this muscle"):
        stand("isotonic", "dmsp_20", static=True, compare=data)
    (found,) = stand("isotonic", "dmsp_20", load=load, static=True, compare=data).compared
    assert len(found.x) == np.sum(np.abs(data.force - load) <= 0.5)
