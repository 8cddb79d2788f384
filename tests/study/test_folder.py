"""The folder of a study: code fingerprint, what may go on, results that move, studies without a file."""

import json
import pathlib
import shutil

import numpy as np
import pytest
from command import Call
from sweep_runs import SEATED, opened, own_scenario
from sweep_runs import written as written_sweep

import afo_sim
from afo_sim.common import InputError, assets, versions
from afo_sim.description import load
from afo_sim.description.portable import portable
from afo_sim.study import folder
from afo_sim.study.runner import sweep
from afo_sim.study.search import plan as search_plan
from afo_sim.study.search import store
from afo_sim.study.search.best import spread_over_starts
from afo_sim.study.search.runner import open_search

PACKAGE = pathlib.Path(afo_sim.__file__).parent
SEARCH = """
scenario = "seated"
generations = 1
starts = 2
population = 4
[set]
duration = "0.2 s"
[parameters.pressure]
key = "supply.pressure"
from = "2 bar"
to = "4 bar"
[objective]
metric = "air_per_cycle"
goal = "lowest"
"""


@pytest.fixture(scope="module")
def copied(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A copy of the package, whose fingerprint is the package's."""
    copy = tmp_path_factory.mktemp("copied") / "afo_sim"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    assert versions.code_fingerprint.__wrapped__(copy) == versions.code_fingerprint()
    return copy


def changed(copy: pathlib.Path, file: str, old: str, new: str) -> bool:
    """Whether the fingerprint of a copied package is another while a line of it is another."""
    path = copy / file
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    try:
        return versions.code_fingerprint.__wrapped__(copy) != versions.code_fingerprint()
    finally:
        path.write_text(text, encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("show/sweep_figures.py", "MOST_DOTS = 3000", "MOST_DOTS = 4000"),
        ("cli/common.py", "_EVERY = 10.0", "_EVERY = 20.0"),
    ],
)
def test_what_no_row_depends_on_is_no_other_code(copied: pathlib.Path, file: str, old: str, new: str) -> None:
    assert not changed(copied, file, old, new)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("common/units.py", "GRAVITY = 9.80665", "GRAVITY = 9.81"),
        ("study/design.py", "BLOCK = 1 << 16", "BLOCK = 1 << 15"),
        ("metrics/ankle.py", "((0.1, -1.0), (0.9, 1.0))", "((0.2, -1.0), (0.8, 1.0))"),
        ("study/analysis.py", "# at least, at most", "# at most, at least"),
    ],
)
def test_what_rows_may_depend_on_is_other_code(copied: pathlib.Path, file: str, old: str, new: str) -> None:
    assert changed(copied, file, old, new)


def test_the_rooms_that_compute_are_rooms_of_the_package() -> None:
    assert all((PACKAGE / room / "__init__.py").is_file() for room in versions.COMPUTING)
    assert not {"show", "cli"} & set(versions.COMPUTING)


def searched(folder: pathlib.Path, text: str = SEARCH) -> search_plan.SearchPlan:
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "small.toml"
    file.write_text(text, encoding="utf-8")
    return search_plan.read(file)


# -- what may go on ---------------------------------------------------------------------------------------


def test_a_sweep_s_folder_is_no_search_s(tmp_path: pathlib.Path) -> None:
    opened(written_sweep(tmp_path, SEATED), tmp_path / "out")
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("*")}
    for option in ("refuse", "restart", "continue"):
        with pytest.raises(InputError, match="something else than a search"):
            open_search(searched(tmp_path), tmp_path / "out", option)  # type: ignore[arg-type]
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("*")} == before


@pytest.mark.slow
@pytest.mark.parametrize("damage", ["", "{", "[]", "{}", '{"fingerprint": {}}'])
def test_a_search_s_damaged_manifest_is_said_and_restart_begins_anew(
    tmp_path: pathlib.Path, damage: str
) -> None:
    search, out = searched(tmp_path), tmp_path / "out"
    open_search(search, out)
    (out / store.MANIFEST).write_text(damage)
    with pytest.raises(InputError, match=r"is damaged.*restart"):
        open_search(search, out)
    open_search(search, out, "restart")
    assert store.SEARCH.read(out)["fingerprint"] == search.fingerprint()


@pytest.mark.slow
def test_a_search_of_other_code_goes_on_where_told_and_says_so(
    tmp_path: pathlib.Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    searched(tmp_path)
    file, out = tmp_path / "small.toml", tmp_path / "out"
    code, printed, err = call("optimise", file, "--out", out)
    assert code == 0, err
    assert "2 starts from different seeds" in printed and (out / store.FIGURE).stat().st_size > 1000
    designs = (out / store.DESIGNS).read_bytes()
    monkeypatch.setattr(folder, "code_fingerprint", lambda: "0" * 64)
    searched(tmp_path, SEARCH.replace("generations = 1", "generations = 2"))
    code, _, err = call("optimise", file, "--out", out)
    assert code == 2 and "computed by other code" in err
    assert (out / store.DESIGNS).read_bytes() == designs
    code, printed, err = call("optimise", file, "--out", out, "--if-changed", "continue")
    assert code == 0, err
    assert "more than one version of the code" in printed
    assert json.loads((out / store.BEST).read_text())["mixed"] is True
    table = store.read_table(out / store.DESIGNS)
    assert len(table["design"]) == 34 and np.array_equal(table["design"], np.arange(34))
    assert sorted({*table["start"].tolist()}) == [0, 1]
    assert (table["start"] == 1).sum() == 17


def test_the_spread_over_starts_is_told_of_feasible_ones() -> None:
    goal = {"metric": "air_per_stride", "unit": "g"}
    starts = [{"feasible": True, "objective": v} for v in (0.9, 1.0)]
    (line,) = spread_over_starts({"objective": goal, "starts": starts})
    assert "2 starts" in line and "10 % apart" in line
    starts.append({"feasible": False, "objective": 0.1})
    (line,) = spread_over_starts({"objective": goal, "starts": starts})
    assert "3 starts" in line and "10 % apart" in line and "1 found none" in line
    assert spread_over_starts({"objective": goal, "starts": starts[:1]}) == []


# -- results that move ------------------------------------------------------------------------------------


def test_the_best_design_runs_wherever_its_folder_goes(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own_scenario(tmp_path / "before")
    search = searched(tmp_path / "before", SEARCH.replace('"seated"', '"mine.toml"'))
    from afo_sim.study.search.runner import optimise

    best = optimise(search, tmp_path / "before" / "out", threads=1)
    expected = afo_sim.run(str(tmp_path / "before" / "mine.toml"), best["sets"]).metrics
    text = (tmp_path / "before" / "out" / store.SCENARIO).read_text(encoding="utf-8")
    assert str(tmp_path) not in text
    shutil.move(tmp_path / "before" / "out", tmp_path / "elsewhere")
    shutil.rmtree(tmp_path / "before")
    monkeypatch.chdir(tmp_path)
    assert repr(afo_sim.run("elsewhere/best.toml").metrics) == repr(expected)


@pytest.mark.parametrize("name", assets.names("scenario"))
def test_shipped_scenarios_are_portable_without_a_copy(tmp_path: pathlib.Path, name: str) -> None:
    from afo_sim.description import toml_text

    scenario = load("scenario", name)
    moved = portable(scenario.resolved(), tmp_path)
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "it.toml").write_text(toml_text(moved), encoding="utf-8")
    assert str(assets.folder("models")) not in (tmp_path / "it.toml").read_text(encoding="utf-8")
    assert load("scenario", tmp_path / "it.toml") == scenario


def test_a_model_that_needs_files_from_elsewhere_stays_where_it_is(tmp_path: pathlib.Path) -> None:
    (tmp_path / "a").mkdir()
    leg = tmp_path / "a" / "leg.xml"
    (tmp_path / "bone.stl").write_bytes(b"mesh")
    leg.write_text('<mujoco><asset><mesh name="m" file="../bone.stl"/></asset></mujoco>')
    assert portable({"leg": {"file": str(leg)}}, tmp_path / "out")["leg"]["file"] == str(leg)
    (tmp_path / "a" / "meshes").mkdir()
    (tmp_path / "bone.stl").rename(tmp_path / "a" / "meshes" / "bone.stl")
    leg.write_text(
        '<mujoco><compiler meshdir="meshes"/><asset><mesh name="m" file="bone.stl"/></asset></mujoco>'
    )
    told = portable({"leg": {"file": str(leg)}}, tmp_path / "out")["leg"]["file"]
    assert (tmp_path / "out" / told).read_bytes() == leg.read_bytes()
    assert (tmp_path / "out" / told).parent.joinpath("meshes", "bone.stl").read_bytes() == b"mesh"


# -- from Python objects ----------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("base", ["name", "dict", "scenario"])
def test_a_sweep_without_a_file_is_its_file_s(tmp_path: pathlib.Path, base: str) -> None:
    from afo_sim.study.parameter import span
    from afo_sim.study.sweep_plan import plan_of, read

    seated = load("scenario", "seated")
    scenario = {"name": "seated", "dict": seated.resolved(), "scenario": seated}[base]
    over = {"supply.pressure": span("2 bar", "4 bar", 3), "orthosis.muscle.dorsiflexor.count": [1, 2]}
    made = plan_of(scenario, over, sets={"duration": "0.2 s"})
    text = SEATED.replace("0.3 s", "0.2 s").replace("steps = 12", "steps = 3")
    text += '[parameters.count]\nkey = "orthosis.muscle.dorsiflexor.count"\nvalues = [1, 2]\n'
    of_file = read(written_sweep(tmp_path, text))
    assert made.canonical() == of_file.canonical()
    if base == "name":
        return
    results = sweep(made, tmp_path / "made", threads=1)
    same = sweep(of_file, tmp_path / "file", threads=1)
    assert len(results) == 6 and set(results["status"]) == {"ok"}
    for name in results.metrics:
        assert np.array_equal(results[name], same[name], equal_nan=True)
    assert results.to_xarray()["air_per_cycle"].shape == (3, 2)
    assert list(results.to_pandas()["count [-]"]) == [1, 2] * 3


def test_columns_are_named_by_the_end_of_their_key() -> None:
    from afo_sim.study.sweep_plan import column_names

    keys = [
        "supply.pressure",
        "phases.dorsiflexor.inlet[0][0]",
        "phases.plantarflexor.inlet[0][0]",
        "gait.seed",
    ]
    assert list(column_names(keys).values()) == [
        "pressure",
        "dorsiflexor_inlet_0_0",
        "plantarflexor_inlet_0_0",
        "gait_seed",  # seed is another column of the results
    ]

    for key, name in (
        ("phases.dorsiflexor.inlet[0][1]", "inlet_0_1"),
        ("orthosis.range_of_motion[1]", "range_of_motion_1"),
    ):
        assert column_names([key]) == {key: name}  # a number alone is no name


def test_a_search_without_a_file_is_its_file_s(tmp_path: pathlib.Path) -> None:
    text = SEARCH + '[[limits]]\nmetric = "range_of_motion"\nat_least = "2 deg"\nshare = 0.5\n'
    of_file = searched(tmp_path, text)
    made = search_plan.search_of(
        load("scenario", "seated"),
        {"supply.pressure": ("2 bar", "4 bar")},
        lowest="air_per_cycle",
        limits=["range_of_motion >= 2 deg in 50 %"],
        generations=1,
        starts=2,
        population=4,
        sets={"duration": "0.2 s"},
    )
    assert made.fingerprint() == of_file.fingerprint()
    with pytest.raises(InputError, match="is not a valid limit"):
        search_plan.search_of("seated", {}, lowest="air_per_cycle", limits=["range_of_motion"])
    with pytest.raises(InputError, match="lowest or highest"):
        search_plan.search_of("seated", {"supply.pressure": ("2 bar", "4 bar")})
