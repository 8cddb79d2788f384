"""The files of a run: complete, readable by others, whole or absent."""

import copy
import dataclasses
import json
import pathlib
import pickle
import shutil
import tomllib
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import mujoco
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import afo_sim
from afo_sim.common import InputError, Lazy, Notice, SimulationError, assets, replacing
from afo_sim.common import display_hooks as shown
from afo_sim.description import as_found
from afo_sim.simulation import RERUN, Recording, read_recording, reference_walk
from afo_sim.simulation import run as running


@pytest.fixture(scope="module")
def folder(seated: Recording, tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    return seated.save(tmp_path_factory.mktemp("run") / "a")


def test_all_files_are_there_and_nothing_else(folder: pathlib.Path) -> None:
    assert {p.name for p in folder.iterdir()} == {"recording.parquet", "summary.json", "model.xml", RERUN}


def test_columns_have_the_promised_names_units_and_signs(folder: pathlib.Path, seated: Recording) -> None:
    schema = pq.read_schema(folder / "recording.parquet")
    promised = {
        "time",
        "ankle/angle",
        "ankle/velocity",
        "ankle/acceleration",
        "supply/pressure",
        "qpos/ankle",
    }
    promised |= {f"ankle/moment/{x}" for x in ("orthosis", "passive", "gravity")}
    promised |= {f"cuff/{anchor}/{x}" for anchor in ("shank", "foot") for x in ("force", "displacement")}
    for role, count in (("dorsiflexor", 3), ("plantarflexor", 2)):
        for k in range(1, count + 1):
            own = ("force", "length", "velocity", "contraction")
            promised |= {f"muscle/{role}_{k}/{x}" for x in (*own, "path_length", "moment_arm")}
        promised |= {
            f"chamber/{role}/{x}"
            for x in ("pressure", "mass", "volume", "temperature", "mass_flow_in", "mass_flow_out")
        }
        promised |= {f"valve/{role}_{side}/{x}" for side in ("inlet", "outlet") for x in ("coil", "opening")}
    assert promised <= set(schema.names)
    assert schema.field("ankle/angle").metadata == {b"unit": b"rad", b"sign": b"dorsiflexion positive"}
    assert schema.field("chamber/dorsiflexor/pressure").metadata == {b"unit": b"Pa", b"sign": b"gauge"}
    run = json.loads(schema.metadata[b"afo_sim"])
    assert as_found(run["scenario"], folder) == seated.described
    assert run["versions"]["mujoco"] == mujoco.__version__
    assert run["parameters"]["dorsiflexor_1"] == seated.parameters["dorsiflexor_1"]


def test_what_is_read_is_what_was_written(folder: pathlib.Path, seated: Recording) -> None:
    read = read_recording(folder)
    assert all(np.array_equal(read[name], seated[name]) for name in seated.columns)
    assert read.metrics == seated.metrics
    assert (read.described, read.status, read.warnings) == (seated.described, seated.status, seated.warnings)
    assert read.to_pandas().shape == (8000, len(seated.columns))


def test_a_run_is_a_mapping_of_its_columns(seated: Recording) -> None:
    assert list(seated) == list(seated.keys()) == list(seated.columns) and len(seated) == len(seated.columns)
    assert all(values is seated.columns[name] for name, values in seated.items())
    assert "ankle/angle" in seated and "joint/angle" in seated  # as indexing takes both
    assert "ankle/angel" not in seated and 0 not in seated
    assert seated.get("ankle/angel") is None and seated.get("time") is seated["time"]
    with pytest.raises(InputError) as wrong:
        seated["ankle/angel"]
    assert wrong.value.nearest == "ankle/angle" and "\n" not in str(wrong.value)


def test_a_run_is_true_and_equal_to_itself_alone(seated: Recording) -> None:
    bare = dataclasses.replace(seated, columns={})
    assert bare and len(bare) == 0
    again = dataclasses.replace(seated)
    assert again != seated and len({again, seated, seated}) == 2


def test_a_slice_has_the_rows_from_its_start_to_before_its_end(seated: Recording) -> None:
    time, angle = seated["time"], seated["ankle/angle"]
    for rows, expected in (
        (slice(10, 200), (time >= time[10]) & (time < time[200])),
        (slice("1 s", "2 s"), (time > 0.9999) & (time < 1.9999)),
        (slice("1500 ms", None), time > 1.4999),
        (slice(None, None, 7), np.arange(len(time)) % 7 == 0),
        (slice("2 s", "1 s"), time < 0.0),
    ):
        assert seated[rows].keys() == set(seated)
        assert np.array_equal(seated[rows]["ankle/angle"], angle[expected])
    assert np.array_equal(seated["1 s":"3 s"]["2 s":]["time"], seated["2 s":"3 s"]["time"])
    assert not hasattr(seated[10:200], "metrics")
    for bound in (1.0, "1 m", "soon", [1]):
        with pytest.raises(InputError) as wrong:
            seated[bound:]
        assert wrong.value.field == "rows"


def test_a_mistyped_attribute_is_told_the_nearest(seated: Recording) -> None:
    for thing, name, nearest in (
        (seated, "metric", "metrics"),
        (seated, "colums", "columns"),
        (afo_sim.load("scenario", "seated"), "suply", "supply"),
        (afo_sim.load("muscle", "dmsp_20"), "using_", "using"),
    ):
        with pytest.raises(AttributeError) as wrong:
            getattr(thing, name)
        assert str(wrong.value).endswith(f"did you mean {nearest!r}?")
        assert wrong.value.__context__ is None or wrong.value.__suppress_context__
    assert "columns" in dir(seated) and not hasattr(seated, "_repr_mimebundle_")


def test_a_run_is_no_description(seated: Recording) -> None:
    for use in (afo_sim.build, afo_sim.run):
        with pytest.raises(InputError) as wrong:
            use(seated)
        assert wrong.value.field == "scenario" and not wrong.value.others
    with pytest.raises(TypeError, match="Recording"):
        afo_sim.sweep(seated, {"supply.pressure": ("2 bar", "4 bar")})


def test_a_parquet_file_is_a_whole_run(seated: Recording, tmp_path: pathlib.Path) -> None:
    leg = tmp_path / "leg.xml"
    shutil.copy(assets.folder("models") / "legs" / "adult_75kg" / "leg.xml", leg)
    described = seated.described | {"leg": seated.described["leg"] | {"file": str(leg)}}
    run = dataclasses.replace(seated, described=described)
    path = run.save(tmp_path / "new" / "run.parquet")
    assert [file.name for file in path.parent.iterdir()] == ["run.parquet"] and path.is_file()
    read = read_recording(path)
    assert (read.metrics, read.status, read.described) == (seated.metrics, seated.status, described)
    assert np.array_equal(read.model().actuator_user, seated.model().actuator_user)
    frame = pytest.importorskip("pandas").read_parquet(path)
    assert {name: frame[name].tolist() for name in ("time", "ankle/angle")} == {
        name: seated[name].tolist() for name in ("time", "ankle/angle")
    }
    run.save(path)  # again
    (tmp_path / "old.parquet").mkdir()
    with pytest.raises(InputError, match="is a folder"):
        run.save(tmp_path / "old.parquet")


def test_summary_is_strict_json(folder: pathlib.Path, seated: Recording) -> None:
    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    summary = json.loads((folder / "summary.json").read_text(), parse_constant=refuse)
    assert summary["status"] == "ok"
    assert summary["metrics"]["range_of_motion"] == {
        "value": seated.metrics["range_of_motion"].value,
        "unit": "deg",
    }
    assert summary["timing"]["steps"] == 8000
    content = {"status", "scenario", "metrics", "versions", "timing", "warnings", "notices", "studies"}
    content |= {"coverage"}
    assert set(summary) == content | {"digests", "digest"}


def test_summary_counts_measured_values_in_their_bands(folder: pathlib.Path) -> None:
    """As the file has them that the ledger's comparison writes; of a metric without a kind nothing."""
    summary = json.loads((folder / "summary.json").read_text())
    file = assets.folder("models") / "coverage.toml"
    counts = tomllib.loads(file.read_text(encoding="utf-8"))
    told = summary["coverage"]
    assert told["range_of_motion"] == counts["joint angle"] | {"kind": "joint angle"}
    assert told["air_per_cycle"] == counts["air"] | {"kind": "air"}
    assert told.keys() < summary["metrics"].keys() and "cuff_skin_pressure" not in told


def test_model_loads_again_with_one_joint_called_ankle(folder: pathlib.Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(folder / "model.xml"))
    assert (model.njnt, model.joint(0).name, model.ntendon, model.nu) == (1, "ankle", 5, 13)
    assert model.body_subtreemass[model.body("foot").id] > model.body("foot").mass[0] + 0.161  # toes, plate
    assert model.body("foot").mass[0] + model.body("toes").mass[0] == pytest.approx(1.09)
    assert model.joint(0).damping[0] == 0.25  # half of 0.5 N·m·s/rad: the passive ankle adds the other half


def test_warnings_keep_their_codes_and_older_files_have_texts(
    tmp_path: pathlib.Path, seated: Recording
) -> None:
    coded = Notice("muscle-force", "{subject}: {value:.1f} N {{too}} strong", subject="front_1", value=12.0)
    saved = dataclasses.replace(seated, warnings=(coded, "a text"))
    read = read_recording(saved.save(tmp_path / "coded", rrd=False)).warnings
    assert read == ("front_1: 12.0 N {too} strong", "a text")
    assert isinstance(read[0], Notice) and not isinstance(read[1], Notice)
    assert (read[0].code, read[0].subject, read[0].data) == ("muscle-force", "front_1", {"value": 12.0})


def test_interrupted_writing_leaves_the_old_file(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "summary.json"
    path.write_text("old")
    with pytest.raises(KeyboardInterrupt), replacing(path) as temporary:
        temporary.write_text("half")
        raise KeyboardInterrupt
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def short(seated: Recording) -> Recording:
    """Another run: the first second alone."""
    columns = {name: values[:500] for name, values in seated.columns.items()}
    return dataclasses.replace(seated, columns=columns, status="failed: cut off")


def test_run_that_cannot_be_written_whole_leaves_the_old_one(
    seated: Recording, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seated.save(tmp_path, rrd=False)
    (tmp_path / "notes.txt").write_text("mine")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    class Broken:
        def write(self, *given: object) -> None:
            raise KeyboardInterrupt

    monkeypatch.setattr(shown, "_shows", [Broken()])
    with pytest.raises(KeyboardInterrupt):
        short(seated).save(tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


@pytest.mark.slow
def test_run_whose_files_were_on_their_way_is_read_whole(
    seated: Recording, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Killed after all files were complete, before the first or after some had reached their places."""
    replace, moved = pathlib.Path.replace, []

    def dying(path: pathlib.Path, target: pathlib.Path) -> pathlib.Path:
        if pathlib.Path(target).parent != tmp_path / str(lives):
            return replace(path, target)  # of a file that is being written
        if len(moved) == lives:
            raise KeyboardInterrupt
        moved.append(target)
        return replace(path, target)

    for lives in (0, 1, 2):
        folder = tmp_path / str(lives)
        seated.save(folder)
        moved.clear()
        with monkeypatch.context() as patch:
            patch.setattr(pathlib.Path, "replace", dying)
            with pytest.raises(KeyboardInterrupt):
                short(seated).save(folder, rrd=False)
        assert read_recording(folder).status == "failed: cut off"
        assert {p.name for p in folder.iterdir()} == {"recording.parquet", "summary.json", "model.xml"}
        assert json.loads((folder / "summary.json").read_text())["status"] == "failed: cut off"


def test_without_rrd_no_other_runs_rrd_stays(seated: Recording, tmp_path: pathlib.Path) -> None:
    (tmp_path / "recording.rrd").write_text("another run's")
    seated.save(tmp_path, rrd=False)
    assert not (tmp_path / "recording.rrd").exists()


def test_unknown_column_names_the_nearest(seated: Recording) -> None:
    with pytest.raises(InputError, match="did you mean 'ankle/angle'"):
        seated["ankle/angel"]


@pytest.mark.parametrize("damage", ["absent", "truncated", "foreign"])
def test_what_is_no_recording_is_said(damage: str, folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    path = tmp_path / "recording.parquet"
    if damage == "truncated":
        path.write_bytes((folder / "recording.parquet").read_bytes()[:5000])
    elif damage == "foreign":
        pq.write_table(pa.table({"x": [1.0]}), path)
    with pytest.raises(InputError, match="recording"):
        read_recording(tmp_path)


@pytest.fixture(scope="module")
def walk() -> Recording:
    return afo_sim.run("walk-dropfoot-afo", {"duration": "3 s", "timestep": "2 ms"})


@pytest.mark.parametrize(("share", "status"), [(0.0, "good"), (0.05, "doubtful"), (0.2, "bad")])
def test_drawn_strides_are_held_against_the_limits_of_the_scenario(
    walk: Recording, share: float, status: str
) -> None:
    assert [answer.status for answer in walk.verdict[:2]] == ["good", "good"]  # it helps, and lifts
    assert dataclasses.replace(walk, studies={"uncertainty": {"trips": {}}}).verdict == walk.verdict
    trips = {"touch": {"share": share}}
    study = {"draws": 510, "failed": {"count": 10}, "trips": trips}
    drawn = dataclasses.replace(walk, studies={"uncertainty": study})
    assert [answer.status for answer in drawn.verdict[:2]] == [status, status]  # wanted 2 %, bad beyond 10 %
    limits = walk.described["limits"] | {"drawn_trips": [0.5, 0.6]}
    lenient = dataclasses.replace(drawn, described=walk.described | {"limits": limits})
    assert lenient.verdict[1].status == "good"
    assert drawn.verdict[2:] == walk.verdict[2:]


def test_a_recording_without_limits_is_held_against_the_usual_ones(walk: Recording) -> None:
    older = {key: value for key, value in walk.described.items() if key != "limits"}
    assert dataclasses.replace(walk, described=older).verdict == walk.verdict


def test_of_what_failed_nothing_is_known(walk: Recording) -> None:
    answers = dataclasses.replace(walk, status="failed: unstable").verdict
    assert [answer.status for answer in answers] == 6 * ["unknown"]
    assert [answer.question for answer in answers] == [answer.question for answer in walk.verdict[1:]]
    assert all("stopped early" in answer.text and answer.limit for answer in answers)


@pytest.fixture
def solved(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What is walked from here on: "start", or "stride" where one is solved for."""
    walked: list[str] = []
    for module, name, word in (
        (running, "simulate", "start"),
        (running, "settle", "stride"),
        (reference_walk, "settle", "stride"),
    ):
        own = getattr(module, name)

        def noted(*given: Any, own: Any = own, word: str = word, **named: Any) -> Any:
            walked.append(word)
            return own(*given, **named)

        monkeypatch.setattr(module, name, noted)
    return walked


WALK = ("walk-dropfoot-afo", {"timestep": "4 ms"})


def test_a_run_walks_what_is_read(solved: list[str]) -> None:
    run = afo_sim.run(*WALK, step="fixed")
    settled = run.metrics["toe_clearance"], run.metrics.get("air_per_stride")
    assert run.ok and "toe_clearance" in run.metrics and solved == ["stride", "start"]  # until it is near
    assert run.metrics["toe_clearance_stride_1"] < 100.0 and solved == ["stride", "start", "start"]
    whole = dict(run.metrics)
    assert solved.count("start") == 2 and solved.count("stride") > 2  # the reference and others beside
    solved.clear()
    assert (whole["toe_clearance"], whole["air_per_stride"]) == settled
    assert whole["lift_over_reference"] == whole["toe_clearance"] - whole["reference_toe_clearance"]
    assert len(run["time"]) == len(run["gait/solved"]) > 0 and len(run.strides) > 2
    assert run.warnings == ()
    assert not solved  # nothing twice


def test_of_a_pair_of_steps_one_start_is_walked(solved: list[str]) -> None:
    run = afo_sim.run("walk-healthy", step="controlled")
    assert run.metrics["toe_clearance"] > 0.0 and solved == ["stride", "start", "stride"]
    step = run.studies["time_step"]
    assert step["step"] == step["asked"] and solved == ["stride", "start", "stride"]
    assert step["metrics"].keys() >= {"toe_clearance", "toe_clearance_stride_1"} and len(solved) > 3


def test_a_start_that_fails_is_known_when_the_run_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    own = running.simulate

    def fails(*given: Any, **named: Any) -> Any:
        return dataclasses.replace(own(*given, **named), failure=SimulationError("too stiff"))

    monkeypatch.setattr(running, "simulate", fails)
    assert "too stiff" in afo_sim.run(*WALK, step="fixed").status


def test_what_is_read_later_is_of_the_files_of_the_run(tmp_path: pathlib.Path) -> None:
    cycle = tmp_path / "walk.csv"
    shutil.copy("gait_data/bovi2011_natural.csv", cycle)
    run = afo_sim.run(WALK[0], WALK[1] | {"gait.cycle": str(cycle)}, step="fixed")
    shutil.copy("gait_data/bovi2011_s.csv", cycle)
    shipped = afo_sim.run(*WALK, step="fixed")
    assert run.metrics["lift_over_reference"] == shipped.metrics["lift_over_reference"]
    cycle.unlink()
    assert run.metrics == shipped.metrics and run.scenario["gait"]["cycle"] == str(cycle)


def test_a_copy_of_a_run_is_whole(solved: list[str]) -> None:
    run = afo_sim.run("walk-healthy", {"timestep": "4 ms"}, step="fixed")
    copies = pickle.loads(pickle.dumps(run)), run.changed(status="ok"), dataclasses.replace(run)
    count = len(solved)
    for other in copies:
        assert list(other.metrics) == list(run.metrics) and other.metrics == run.metrics
        assert other.summary() == run.summary() and list(other.columns) == list(run.columns)
        assert all(np.array_equal(other[name], run[name], equal_nan=True) for name in run.columns)
    assert len(solved) == count


def test_a_lazy_dict_is_the_dict_that_it_will_be() -> None:
    computed: list[int] = []

    def lazy() -> Lazy[str, int]:
        return Lazy({"b": 2}, lambda: computed.append(1) or {"a": 1}, lambda: {"c": 3})  # type: ignore[func-returns-value]

    whole = {"b": 2, "a": 1, "c": 3}
    assert lazy()["b"] == lazy().get("b") == 2 and "b" in lazy() and lazy().known == {"b": 2}
    assert not computed
    for look in (
        *(dict, lambda of: {**of}, lambda of: of | {}, lambda of: {} | of, lambda of: dict(of.items())),
        *(lambda of: json.loads(json.dumps(of)), copy.deepcopy, lambda of: dict(**of), lambda of: of),
    ):
        assert look(lazy()) == whole == look(lazy()) and list(look(lazy())) == list(whole)
    assert len(lazy()) == 3 and lazy().get("d") is None and "d" not in lazy() and lazy() == lazy()
    with pytest.raises(KeyError):
        lazy()["d"]
    computed.clear()
    shared = lazy()
    with ThreadPoolExecutor(8) as threads:
        assert set(threads.map(lambda name: shared[name], "abc" * 20)) == {1, 2, 3} and computed == [1]


def test_the_scenario_of_a_run_is_what_load_gives(folder: pathlib.Path, seated: Recording) -> None:
    own = afo_sim.load("scenario", "seated")
    for run in (seated, read_recording(folder)):
        assert type(run.scenario) is type(own) and run.scenario is run.scenario
        assert run.scenario["supply.pressure"] == own.supply.pressure
        assert run.scenario["orthosis"]["muscle"]["dorsiflexor"]["count"] == 3  # as of a dict before
        assert "supply.pressure" in run.scenario and "supply.presure" not in run.scenario
    assert seated.scenario == afo_sim.load("scenario", seated.described)


def test_a_run_whose_scenario_is_of_no_use_any_more_opens_but_for_it(seated: Recording) -> None:
    table = {"impedance": {"stiffness": "20 N*m/rad"}, "rate": "100 Hz"}
    old = dataclasses.replace(seated, described=seated.described | {"controller": table, "timer": None})
    assert "seated" in repr(old) and old.summary()["scenario"]["controller"] == table
    assert len(old.to_pandas()) == len(seated["time"])
    with pytest.raises(InputError) as refused:
        _ = old.scenario
    assert refused.value.field == "controller.impedance"
