"""Sweeps and searches in which patients of a condition respond: they are those of `populate`, by hand."""

import json
import pathlib
from typing import Any

import numpy as np
import pytest
from installed import needs
from sweep_runs import assert_same, opened, table, written

import afo_sim as afo
from afo_sim.common import InputError
from afo_sim.study import cases_of, read, replay, runner, sweep_plan
from afo_sim.study.search import plan as search_plan
from afo_sim.study.search import runner as search_runner
from afo_sim.walker import Population, populate

CONDITION = """
patient = "drop-foot"
patients = 2
[drawn]
tibialis = { from = 0.1, to = 0.3, source = "the condition's definition" }
mass = { from = 0.75, to = 1.3, source = "assumed" }
"""
TEXT = """
scenario = "walk-dropfoot-afo"
design = "grid"
walkers = "two.toml"
[set]
duration = "6 s"
[parameters.pressure]
key = "supply.pressure"
values = ["1 bar", "4 bar"]
"""
SEARCH = """
scenario = "walk-dropfoot-afo"
walkers = "two.toml"
method = "cma-es"
generations = 1
population = 4
starts = 1
[set]
duration = "6 s"
[parameters.pressure]
key = "supply.pressure"
from = "1 bar"
to = "4 bar"
[objective]
metric = "walkers_air_per_stride"
goal = "lowest"
[[limits]]
metric = "walkers_falls"
at_most = "60 %"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A folder with a condition of two patients, and a sweep of two cases that has run."""
    found = tmp_path_factory.mktemp("walkers")
    (found / "two.toml").write_text(CONDITION)
    runner.run(opened(written(found, TEXT), found / "out"), threads=1)
    return found


def by_hand(folder: pathlib.Path, sets: dict[str, Any]) -> Population:
    return populate("walk-dropfoot-afo", sets, patients=folder / "two.toml", duration=6.0)


def numbers(found: Population, case: str) -> dict[str, float]:
    """What a sweep tells of a case, of patients whose strides are counted, as `numbers` has them."""
    each = found[case]
    told = {
        "falls": 100.0 * np.mean([one.falls.count / one.falls.of for one in each]),
        "toe_clearance": 1e3 * np.median([one.numbers["right/clearance"] for one in each]),
        "ankle_swing": np.median([one.numbers["right/ankle_swing"] for one in each]),
        "speed": np.median([one.numbers["speed"] for one in each]),
        "cost_of_transport": np.median([one.numbers["cost_of_transport"] for one in each]),
    }
    if case == "device":
        told["air_per_stride"] = 1e3 * np.median([one.numbers["air_per_stride"] for one in each])
    return told


@pytest.mark.slow
def test_a_case_is_the_population_by_hand_to_the_last_digit(
    folder: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    results = read(folder / "out")
    assert results.ok.all() and results.sweep["walkers"] == "two"
    for row, pressure in enumerate(("1 bar", "4 bar")):
        found = by_hand(folder, {"supply.pressure": pressure})
        wanted = numbers(found, "device") | {f"{k}_without": x for k, x in numbers(found, "without").items()}
        assert {name: results[f"walkers_{name}"][row] for name in wanted} == wanted
        assert results["walkers_gain"][row] + results["walkers_lose"][row] <= 1.0
    assert results["walkers_air_per_stride"][0] < results["walkers_air_per_stride"][1]
    assert np.ptp(results["walkers_speed_without"]) == 0.0
    assert not any(name.endswith("_adapted") for name in results.metrics)  # no such gaits are known
    assert all("walkers-unadapted" in told for told in results.notices)


@pytest.mark.slow
def test_a_sweep_that_is_stopped_goes_on_to_the_same_rows(
    folder: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    class Stopped(Exception):
        pass

    def stop(_: Any) -> None:
        raise Stopped

    store = opened(folder / "sweep.toml", tmp_path / "out")
    assert store.jobs.count == 2  # a case is a chunk
    with pytest.raises(Stopped):
        runner.run(store, report=stop)
    assert store.pending() == [1]
    state = runner.run(opened(folder / "sweep.toml", tmp_path / "out"))
    assert (state.done, state.new, state.failed) == (2, 1, 0)
    assert_same(table(tmp_path / "out"), table(folder / "out"))


@pytest.mark.slow
def test_processes_beside_this_one_tell_the_same(folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    runner.run(opened(folder / "sweep.toml", tmp_path / "out"), workers=2)
    assert_same(table(tmp_path / "out"), table(folder / "out"))


@pytest.mark.slow
@needs("distributed")
@pytest.mark.filterwarnings("ignore")
def test_a_cluster_tells_the_same(folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    import distributed

    options = {"n_workers": 1, "threads_per_worker": 1, "host": "127.0.0.1", "dashboard_address": None}
    with distributed.LocalCluster(processes=True, **options) as local:
        store = opened(folder / "sweep.toml", tmp_path / "out")
        runner.run(store, scheduler=local.scheduler_address)
    assert_same(table(tmp_path / "out"), table(folder / "out"))


@pytest.mark.slow
def test_other_patients_are_another_sweep(folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    (tmp_path / "two.toml").write_text(CONDITION.replace("0.1", "0.0"))
    with pytest.raises(InputError, match="another sweep"):
        opened(written(tmp_path, TEXT), folder / "out")
    with pytest.raises(InputError, match="no recording"):
        replay.replay(folder / "out", 0)


@pytest.mark.slow
def test_a_recorded_walks_metric_is_refused_with_the_patients_one(
    folder: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    (tmp_path / "two.toml").write_text(CONDITION)
    text = TEXT.replace('"two.toml"', '"two.toml"\nmetrics = ["speed_of_walking", "toe_clearance"]')
    with pytest.raises(InputError) as refused:
        sweep_plan.read(written(tmp_path, text))
    assert refused.value.field.startswith("metrics")
    with pytest.raises(InputError) as refused:
        opened(written(tmp_path, text.replace('"speed_of_walking", ', "")), tmp_path / "out")
    assert (refused.value.field, refused.value.nearest) == ("metrics", "walkers_toe_clearance")


@pytest.mark.slow
@needs("cma")
def test_a_search_keeps_a_limit_on_falls(folder: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "search.toml").write_text(SEARCH)
    found = search_plan.read(folder / "search.toml")
    best = search_runner.optimise(found, folder / "search", threads=1)
    assert (best["walkers"], best["patients"], best["runs"], best["half_step"]) == ("two", 1, 4, None)
    hand = numbers(by_hand(folder, best["sets"]), "device")
    assert best["objective"]["value"] == hand["air_per_stride"]
    assert best["limits"][0]["level"] == hand["falls"]
    assert best["feasible"] == (hand["falls"] <= 60.0)
    assert search_runner.optimise(found, folder / "search") == json.loads(json.dumps(best))


@pytest.mark.parametrize(
    ("was", "becomes", "field", "nearest"),
    [
        ('"two.toml"', '"drop-fot"', "population", "drop-foot"),
        ('"two.toml"', '"two.toml"\nmetrics = ["walkers_fals"]', "metrics.0", "walkers_falls"),
        ('"two.toml"', '"two.toml"\nkeep = [0]', "keep", None),
        ('"supply.pressure"', '"patient.body_mass"', "parameters.pressure.key", None),
        ("[set]", '[set]\ngait.settled = "walked"', "set.gait.settled", None),
        ('duration = "6 s"', 'patient = "healthy"', "set.patient", None),
        ('"grid"', '"uncertainty"\ncases = 4\nspreads = "usual"', "parameters", None),
    ],
)
def test_what_does_not_go_together_is_refused(
    tmp_path: pathlib.Path, was: str, becomes: str, field: str, nearest: str | None
) -> None:
    (tmp_path / "two.toml").write_text(CONDITION)
    values = ["70 kg", "80 kg"] if "body_mass" in becomes else ["1 bar", "4 bar"]
    text = TEXT.replace(was, becomes).replace('["1 bar", "4 bar"]', json.dumps(values))
    with pytest.raises(InputError) as refused:
        sweep_plan.read(written(tmp_path, text))
    assert (refused.value.field, refused.value.nearest) == (field, nearest)


def test_bands_plain_strides_and_a_searchs_own_patients_are_refused(tmp_path: pathlib.Path) -> None:
    (tmp_path / "two.toml").write_text(CONDITION)
    with pytest.raises(InputError, match="walkers"):
        sweep_plan.read(written(tmp_path, TEXT)).walked()
    joint = TEXT.split("[parameters")[0].replace('"grid"', '"uncertainty"\ncases = 4\nspreads = "usual"')
    with pytest.raises(InputError, match="uncertainty") as refused:
        sweep_plan.read(written(tmp_path, joint))
    assert refused.value.field == "walkers"
    own = '[patients]\ndesign = "grid"\n[patients.parameters.load]\nkey = "load_moment"\nvalues = ["0 N*m"]'
    (tmp_path / "search.toml").write_text(SEARCH + own)
    with pytest.raises(InputError) as refused:
        search_plan.read(tmp_path / "search.toml")
    assert refused.value.field == "patients"


def test_a_scenario_in_which_nobody_wears_a_device_is_no_case(tmp_path: pathlib.Path) -> None:
    (tmp_path / "two.toml").write_text(CONDITION)
    plan = sweep_plan.read(written(tmp_path, TEXT.replace("walk-dropfoot-afo", "walk-dropfoot")))
    with pytest.raises(InputError, match="no device"):
        runner.open_store(plan, cases_of(plan), tmp_path / "out")


def afo_cases(plan: Any) -> Any:
    from afo_sim.study import cases_of

    return cases_of(plan)


@pytest.mark.slow
def test_from_python(folder: pathlib.Path) -> None:
    over = {"supply.pressure": ["1 bar", "4 bar"]}
    asked = ["walkers_falls", "walkers_falls_adapted"]
    where = str(folder / "two.toml")
    found = afo.sweep("walk-dropfoot-afo", over, {"duration": "6 s"}, walkers=where, metrics=asked, threads=1)
    assert list(found.metrics) == asked
    assert np.array_equal(found["walkers_falls"], read(folder / "out")["walkers_falls"])
    assert np.isnan(found["walkers_falls_adapted"]).all()
