"""The model that ran comes back from its folder, and from its MJCF, and steps to the same bits."""

import dataclasses
import json
import pathlib
import re
import warnings
from xml.etree import ElementTree

import mujoco
import numpy as np
import pyarrow.parquet as pq
import pytest
from changed_leg import changed_leg
from started_mjcf import started_mjcf

import afo_sim
from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, InputError, assets, parquet_writer
from afo_sim.model import (
    Built,
    as_run,
    equilibrium,
    get_state,
    two_strides,
    walking_start,
)
from afo_sim.model.build import build
from afo_sim.model.supply_and_timer import controls
from afo_sim.simulation import Recording, fixed, read_recording, to_binary
from afo_sim.simulation import files as kept_model
from afo_sim.simulation.files import LABEL, packed, unpacked

SHORT = {"duration": "1 s"}
VERSION = slice(12, 16)  # of MuJoCo, in the binary
STATE = mujoco.mjtState.mjSTATE_INTEGRATION


@pytest.fixture(scope="module")
def seated_short() -> Recording:
    return afo_sim.run("seated", SHORT)


@pytest.fixture(scope="module")
def folder(seated_short: Recording, tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    return seated_short.save(tmp_path_factory.mktemp("kept") / "a", rrd=False)


def stepped(model: mujoco.MjModel, start: np.ndarray, inputs: np.ndarray) -> dict[str, np.ndarray]:
    """MuJoCo alone, a step at a time: states before each step, forces and flows of that step."""
    data = mujoco.MjData(model)
    rows: dict[str, list[np.ndarray]] = {
        name: [] for name in ("qpos", "qvel", "act", "userdata", "actuator_force")
    }
    with native.installed():
        mujoco.mj_setState(model, data, start, STATE)
        for row in inputs:
            for name in ("qpos", "qvel", "act"):
                rows[name].append(getattr(data, name).copy())
            data.ctrl[:] = row
            mujoco.mj_step(model, data)
            for name in ("userdata", "actuator_force"):
                rows[name].append(getattr(data, name).copy())
    return {name: np.array(values) for name, values in rows.items()}


def same_as_recorded(run: Recording, built: Built, start: np.ndarray, inputs: np.ndarray) -> None:
    """Of every recorded row, whatever the number of steps between two."""
    model, kept = built.model, built.scenario.record_stride
    rows = {name: values[::kept] for name, values in stepped(model, start, inputs).items()}
    assert np.array_equal(rows["qvel"][:, model.joint("ankle").dofadr[0]], run["ankle/velocity"])
    for j in range(model.njnt):
        name = model.joint(j).name
        assert np.array_equal(rows["qpos"][:, model.jnt_qposadr[j]], run[f"qpos/{name}"]), name
    for name, i in built.index.muscles.items():
        assert np.array_equal(0.0 - rows["actuator_force"][:, i], run[f"muscle/{name}/force"]), name
    for name, i in built.index.chambers.items():
        air = native.read_air(model, rows["act"], rows["userdata"], i)
        assert np.array_equal(air.mass, run[f"chamber/{name}/mass"]), name
        assert np.array_equal(air.absolute_pressure - AMBIENT_PRESSURE, run[f"chamber/{name}/pressure"])
    for name, i in built.index.valves.items():
        opening = native.read_opening(model, rows["userdata"], i)
        assert np.array_equal(opening, run[f"valve/{name}/opening"]), name


def recorded_inputs(run: Recording, built: Built) -> np.ndarray:
    """Of a fixed shank, from the recorded columns."""
    assert built.scenario.record_stride == 1
    inputs = np.zeros((len(run["time"]), built.model.nu))
    for name in run.scenario["orthosis"]["chamber"]:
        inputs[:, built.index.chambers[name]] = run["supply/pressure"]
        for side in ("inlet", "outlet"):
            inputs[:, built.index.valves[f"{name}_{side}"]] = run[f"valve/{name}_{side}/coil"]
    inputs[:, built.index.passive] = built.scenario.shank.knee_angle or 0.0
    return inputs


def test_seated_steps_to_the_same_bits(folder: pathlib.Path) -> None:
    """Inputs are the recorded columns; the start is the kept model's own rest."""
    run = read_recording(folder)
    built = dataclasses.replace(afo_sim.build(run.scenario), model=run.model())
    inputs = recorded_inputs(run, built)
    with native.installed():
        start = equilibrium(built, inputs[0])
    same_as_recorded(run, built, start, inputs)
    assert np.ptp(run["ankle/angle"]) > np.radians(1.0)


@pytest.mark.parametrize("settled", ["solved", "walked"])
def test_walking_steps_to_the_same_bits(settled: str, tmp_path: pathlib.Path) -> None:
    """The strides that are walked from the start."""
    sets = {"duration": "0.4 s", "gait.settled": settled}
    afo_sim.run("walk-dropfoot-afo", sets).save(tmp_path, rrd=False)
    run = read_recording(tmp_path)
    built = dataclasses.replace(build(as_run(afo_sim.load("scenario", run.scenario))), model=run.model())
    with native.installed():
        start = walking_start(built, controls(built, 1)[0])
    if settled == "solved":
        walked = run["gait/solved"] == 0.0
        assert 0 < walked.sum() < len(walked)
        run = dataclasses.replace(run, columns={name: run[name][walked] for name in run.columns})
    same_as_recorded(run, built, start, controls(built))
    assert run["ankle/moment/orthosis"].max() > 1.0


def of_walked(run: Recording) -> Recording:
    """Without the settled strides that were solved for."""
    if "gait/solved" not in run.columns:
        return run
    walked = run["gait/solved"] == 0.0
    return dataclasses.replace(run, columns={name: run[name][walked] for name in run.columns})


WHOLE = set(assets.names("scenario"))


@pytest.mark.parametrize(
    ("name", "sets"),
    [
        ("seated", SHORT),
        ("walk-dropfoot-afo", {"duration": "1 s", "gait.settled": "walked"}),
        *(pytest.param(name, {}, marks=pytest.mark.slow) for name in sorted(WHOLE)),
    ],
)
def test_written_model_steps_from_its_key_to_the_same_bits(name: str, sets: dict[str, str]) -> None:
    """Nothing but the text, the callbacks, and the scenario's inputs; those of a controller as recorded."""
    run = of_walked(afo_sim.run(name, sets))
    built = build(as_run(afo_sim.load("scenario", name, sets)))
    inputs = controls(built) if built.scenario.controller is None else recorded_inputs(run, built)
    with native.installed():
        begin = equilibrium if built.walk is None else walking_start
        state = begin(built, inputs[0])
    model = mujoco.MjModel.from_xml_string(started_mjcf(built, state))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("afo_start").id)
    same_as_recorded(run, dataclasses.replace(built, model=model), get_state(model, data), inputs)


@pytest.mark.parametrize("name", ["arm", "walk-dropfoot-afo", "walk-healthy"])
def test_every_bit_of_the_model_comes_back(name: str, tmp_path: pathlib.Path) -> None:
    run = afo_sim.run(name, {"duration": "0.02 s"})
    run.save(tmp_path, rrd=False)
    expected = to_binary(build(as_run(afo_sim.load("scenario", name, {"duration": "0.02 s"}))).full_model)
    assert to_binary(run.model()) == to_binary(read_recording(tmp_path).model()) == expected


@pytest.mark.parametrize("start_phase", [0.0, 0.3])
def test_the_settled_strides_are_of_the_model_that_is_kept(start_phase: float) -> None:
    scenario = afo_sim.load("scenario", "walk-dropfoot-afo", SHORT | {"gait.start_phase": start_phase})
    run = afo_sim.run(scenario)
    assert run["gait/solved"].any()
    assert to_binary(run.model()) == to_binary(build(two_strides(scenario)).full_model)
    time = run["time"]
    assert run.model().opt.timestep == pytest.approx((time[-1] - time[0]) / (len(time) - 1), rel=1e-12)


def test_each_call_gives_a_model_of_its_own(seated_short: Recording) -> None:
    first = seated_short.model()
    first.actuator_user[:] = 0.0
    assert to_binary(seated_short.model()) == seated_short.model_binary


def test_the_parquet_file_alone_has_the_model(folder: pathlib.Path, seated_short: Recording) -> None:
    run = read_recording(folder / "recording.parquet")
    assert to_binary(run.model()) == seated_short.model_binary


def test_mjcf_says_in_its_first_line_what_it_is(folder: pathlib.Path, seated_short: Recording) -> None:
    text = (folder / "model.xml").read_text(encoding="utf-8")
    first, rest = text.split("\n", 1)
    assert first.startswith("<!-- ") and first.endswith(" -->")
    assert "--" not in first[4:-3]  # XML allows none in a comment
    assert all(word in first for word in ("user data", "callbacks", "afo_sim.native.installed()"))
    assert not rest.startswith("<!--")
    assert ElementTree.fromstring(text).tag == "mujoco"
    assert seated_short.model_xml == text == read_recording(folder).model_xml
    model = mujoco.MjModel.from_xml_path(str(folder / "model.xml"))
    assert np.array_equal(model.actuator_user, seated_short.model().actuator_user)


def as_formerly(run: Recording) -> str:
    """MJCF of an earlier version: under its label MuJoCo's own six digits, and no parameters."""
    spec = mujoco.MjSpec.from_string(run.model_xml)
    for actuator in spec.actuators:
        actuator.userdata = [0.0] * native.N_USER
    spec.compile()
    return f"<!-- Written by afo_sim, to look at: its numbers have six digits. -->\n{spec.to_xml()}"


def test_former_mjcf_cannot_run_limp(seated_short: Recording) -> None:
    model = mujoco.MjModel.from_xml_string(as_formerly(seated_short))
    with native.installed(), pytest.raises(mujoco.FatalError, match=r"read_recording\(folder\)\.model"):
        mujoco.mj_step(model, mujoco.MjData(model))


@pytest.mark.parametrize("name", ["seated", "walk-dropfoot-afo", "arm"])
def test_former_run_is_built_anew_where_only_its_digits_are_fewer(name: str, tmp_path: pathlib.Path) -> None:
    run = afo_sim.run(name, {"duration": "0.02 s"})
    former = dataclasses.replace(of_mujoco(run, "3.1.0"), model_xml=as_formerly(run))
    assert len(former.model_xml) < 0.6 * len(run.model_xml)
    former.save(tmp_path, rrd=False)
    assert (tmp_path / "model.xml").read_text() == former.model_xml
    with pytest.warns(UserWarning, match="built anew"):
        assert to_binary(read_recording(tmp_path).model()) == run.model_binary


@pytest.mark.parametrize("fewer", [True, False])
def test_another_library_may_have_computed_other_last_digits(fewer: bool, seated_short: Recording) -> None:
    """But no other sixth one."""
    run = of_mujoco(seated_short, "3.1.0")
    text = as_formerly(run) if fewer else run.model_xml
    place = re.search(r'diaginertia="([\d.]+)', text)
    assert place is not None
    for more, same in ((1e-13, True), (1e-4, False)):
        inertia = float(place[1]) * (1.0 + more)
        other = text[: place.start(1)] + repr(inertia) + text[place.end(1) :]
        changed = dataclasses.replace(run, model_xml=other)
        said = pytest.warns(UserWarning, match="built anew") if same else pytest.raises(InputError)
        with said:
            assert to_binary(changed.model()) == seated_short.model_binary


def of_mujoco(run: Recording, version: str) -> Recording:
    """The run as another MuJoCo would have kept it."""
    binary = bytearray(run.model_binary)
    binary[VERSION] = (int.from_bytes(binary[VERSION], "little") - 1000).to_bytes(4, "little")
    return dataclasses.replace(run, model_binary=bytes(binary), versions=run.versions | {"mujoco": version})


def test_version_stands_where_it_is_expected(seated_short: Recording) -> None:
    stored = int.from_bytes(seated_short.model_binary[VERSION], "little")
    major, minor, patch = (int(part) for part in mujoco.__version__.split(".")[:3])
    assert stored == (major * 1000 + minor) * 1000 + patch


def test_model_of_another_mujoco_is_built_anew(
    seated_short: Recording, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.warns(UserWarning, match=rf"kept by MuJoCo 3\.1\.0, and {mujoco.__version__} is installed"):
        model = of_mujoco(seated_short, "3.1.0").model()
    assert to_binary(model) == seated_short.model_binary
    assert list(tmp_path.iterdir()) == []  # MuJoCo was not made to complain into its log


@pytest.mark.parametrize("chosen", [False, True])
def test_model_of_walking_is_built_anew_at_the_step_that_it_ran_with(chosen: bool) -> None:
    """A solved run's is a whole part of a stride; a policy's is the scenario's own."""
    scenario = afo_sim.load("scenario", "walk-dropfoot-afo", {"duration": "0.05 s"})
    policy = fixed(controls(build(scenario))) if chosen else None
    run = afo_sim.run(scenario, policy=policy)
    assert (run.model().opt.timestep == scenario.timestep) == chosen
    with pytest.warns(UserWarning, match="built anew"):
        model = of_mujoco(run, "3.1.0").model()
    assert to_binary(model) == run.model_binary


def test_model_built_anew_must_be_the_same(seated_short: Recording) -> None:
    rows = dict(seated_short.parameters)
    rows["dorsiflexor_1"] = [*rows["dorsiflexor_1"][:5], np.nextafter(rows["dorsiflexor_1"][5], 1.0)]
    rows["dorsiflexor_1"] += seated_short.parameters["dorsiflexor_1"][6:]
    changed = dataclasses.replace(of_mujoco(seated_short, "3.1.0"), parameters=rows)
    with pytest.raises(InputError, match=r"'dorsiflexor_1' has other parameters.*allowed: .*mujoco 3\.1\.0"):
        changed.model()


def test_run_saved_before_models_were_kept_is_read(folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    """Its file has no such key, and its model.xml no label, of which it stays without."""
    table = pq.read_table(folder / "recording.parquet")
    run = json.loads(table.schema.metadata[b"afo_sim"])
    run["model_xml"] = run["model_xml"].removeprefix(LABEL)
    old = table.replace_schema_metadata({"afo_sim": json.dumps(run)})
    pq.write_table(old, tmp_path / "recording.parquet")
    assert b"afo_sim_model" not in pq.read_metadata(tmp_path / "recording.parquet").metadata
    read, before = read_recording(tmp_path), read_recording(folder)
    assert read.model_binary == b""
    assert all(np.array_equal(read[name], before[name]) for name in before.columns)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert to_binary(read.model()) == before.model_binary
    read.save(tmp_path / "again", rrd=False)
    assert (tmp_path / "again" / "model.xml").read_text() == run["model_xml"]


def test_model_of_another_layout_of_parameters_is_refused(seated_short: Recording) -> None:
    model = seated_short.model()
    model.actuator_user[:, 0] += 1.0
    other = dataclasses.replace(
        seated_short, model_binary=to_binary(model), versions=seated_short.versions | {"afo-sim": "0.0.1"}
    )
    with pytest.raises(InputError, match=r"another version of this package.*0\.0\.1"):
        other.model()


def test_damaged_model_is_said(folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    table = pq.read_table(folder / "recording.parquet")
    with parquet_writer(tmp_path / "recording.parquet", table.schema) as file:
        file.write_table(table)
        file.add_key_value_metadata({"afo_sim_model": "AAAA"})
    with pytest.raises(InputError, match="is not a recording"):
        read_recording(tmp_path)


OBJ = "v 0 0 0\nv .1 0 0\nv 0 .02 0\nv 0 0 .013\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def own_leg(folder: pathlib.Path) -> dict[str, str]:
    """The shipped leg, with a mesh on its foot."""
    asset = '<asset><mesh name="shoe" file="shoe.obj"/></asset>'
    shoe = '<geom type="mesh" mesh="shoe" mass="0" contype="0" conaffinity="0"/>'
    (folder / "shoe.obj").write_text(OBJ, encoding="utf-8")
    foot = '<body name="foot">'
    return changed_leg(
        folder, lambda text: text.replace("<worldbody>", f"{asset}<worldbody>").replace(foot, foot + shoe)
    )


@pytest.fixture
def meshed(tmp_path: pathlib.Path) -> Recording:
    """A run of a leg of the user's own."""
    return afo_sim.run("seated", {"duration": "0.02 s"} | own_leg(tmp_path))


def test_model_needs_none_of_the_legs_files(meshed: Recording, tmp_path: pathlib.Path) -> None:
    meshed.save(tmp_path / "run", rrd=False)
    for name in ("leg.toml", "leg.xml", "shoe.obj"):
        (tmp_path / name).unlink()
    model = read_recording(tmp_path / "run").model()
    assert model.nmesh == 1
    assert to_binary(model) == meshed.model_binary


def test_leg_that_has_changed_is_not_the_one_that_ran(meshed: Recording, tmp_path: pathlib.Path) -> None:
    other, leg = of_mujoco(meshed, "3.1.0"), tmp_path / "leg.xml"
    with pytest.warns(UserWarning, match="built anew"):
        other.model()
    text = leg.read_text(encoding="utf-8")
    for old, new, what in (
        ('mass="0.929"', 'mass="0.9291"', "another model: "),
        ('mesh="shoe"', 'mesh="shoe" pos="0 0 0.001"', "a body, a joint or a path is another one"),
    ):
        assert old in text
        leg.write_text(text.replace(old, new, 1), encoding="utf-8")
        with pytest.raises(InputError, match=what):
            other.model()
    leg.unlink()
    with pytest.raises(InputError, match="its scenario cannot be built"):
        other.model()


def test_model_too_large_for_metadata_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    some = bytes(range(256))
    assert unpacked(packed(some)) == some
    monkeypatch.setattr(kept_model, "LARGEST", 100)
    assert packed(some) == "" and unpacked("") == b""


def test_a_function_as_policy_is_told_where_it_belongs() -> None:
    with pytest.raises(InputError, match="controller=") as refused:
        afo_sim.run("seated", {"duration": "0.1 s"}, policy=lambda time, measured: {})  # type: ignore[arg-type]
    assert refused.value.field == "policy"
