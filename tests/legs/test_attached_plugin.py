"""A body with orthoses for any MuJoCo: its plugin steps it to the bits of the callbacks in Python."""

import json
import pathlib
import subprocess
import sys
from typing import Any

import mujoco
import numpy as np
import pytest

import afo_sim as afo
from afo_sim import native
from afo_sim.common import CallbackError, InputError
from afo_sim.export import export_attached
from afo_sim.legs import Attached, write_attached

try:
    LIBRARY = native.library_file()
except CallbackError:
    pytest.skip("no library is built", allow_module_level=True)

# no afo_sim here: MuJoCo, the folder, one chamber that is filled and vented
ALONE = """
import json, sys, mujoco, numpy
mujoco.mj_loadPluginLibrary(sys.argv[1] + "/" + sys.argv[2])
model = mujoco.MjModel.from_xml_path(sys.argv[1] + "/model.xml")
data, rows = mujoco.MjData(model), []
if sys.argv[4] == "key":
    mujoco.mj_resetDataKeyframe(model, data, model.key("afo_start").id)
for row in numpy.load(sys.argv[3]):
    data.ctrl[:] = row
    mujoco.mj_step(model, data)
    rows.append(numpy.concatenate([data.qpos, data.qvel, data.act, data.actuator_force]))
numpy.save(sys.argv[3], rows)
print(json.dumps([n for n in sys.modules if "afo_sim" in n]))
"""
# what a model may have of its own, with names that need care
OWN = """
  <extension><plugin plugin="mujoco.elasticity.cable"><instance name="muscles"/></plugin></extension>
  <size nuserdata="3" nuser_actuator="5"/>
  <actuator>
    <muscle name="own &quot;a&quot; 'b' &lt;&gt;" joint="ankle" lengthrange="0.5 1" user="9 9.5"
      gear="0.001"/>
    <position name="held" joint="ankle" kp="0.1"/>
  </actuator>
  <keyframe><key name="start" qpos="0.1" act="0.3" ctrl="0.4 0.01"/>
    <key name="a &quot;b&quot;"/></keyframe>"""
LEG = """
  <body name="{0}shank" pos="0 {1} 0.5"><inertial pos="0 0 0.2444" mass="3.49" diaginertia="0.06 0.06 0.005"/>
    <geom type="capsule" fromto="0 0 0.02 0 0 0.4" size="0.02" contype="0" conaffinity="0"/>
    <body name="{0}foot"><inertial pos="0.039 0 -0.027" mass="0.93" diaginertia="0.002 0.004 0.004"/>
      <geom type="capsule" fromto="-0.06 0 -0.06 0.18 0 -0.06" size="0.02" contype="0" conaffinity="0"/>
      <joint name="{0}ankle" axis="0 -1 0" damping="0.3" stiffness="2"/></body></body>"""


def body_of(*legs: str, head: str = "") -> mujoco.MjSpec:
    compiler = '<compiler angle="radian" autolimits="true"/>'
    world = '<!-- <body name="c"> and <mujoco> --><worldbody><body name="bare"/>' + "".join(legs)
    return mujoco.MjSpec.from_string(f"<mujoco>{compiler}{head}{world}</worldbody></mujoco>")


def inputs(leg: Attached, count: int = 600) -> np.ndarray:
    """The commands of the steps: dorsiflexors are filled and vented (count, nu)."""
    data, rows = leg.data(), []
    for k in range(count):
        for each in leg.legs.values():
            each.set_valves(data, dorsiflexor="inlet" if k < count // 2 else "outlet")
        data.ctrl[leg.own_controls] = 0.2 * np.sin(0.01 * k)
        rows.append(data.ctrl.copy())
    return np.array(rows)


def stepped(model: mujoco.MjModel, data: mujoco.MjData, rows: np.ndarray) -> np.ndarray:
    found = []
    for row in rows:
        data.ctrl[:] = row
        mujoco.mj_step(model, data)
        found.append(np.concatenate([data.qpos, data.qvel, data.act, data.actuator_force]))
    return np.array(found)


def alone(folder: pathlib.Path, rows: np.ndarray, begin: str = "key") -> np.ndarray:
    """The same by MuJoCo and the folder, in another process without afo_sim."""
    np.save(folder.parent / "rows.npy", rows)
    told = [str(folder), LIBRARY.name, str(folder.parent / "rows.npy"), begin]
    ran = subprocess.run([sys.executable, "-I", "-c", ALONE, *told], capture_output=True, text=True)
    assert (ran.returncode, ran.stderr) == (0, "")
    assert json.loads(ran.stdout) == []
    return np.asarray(np.load(folder.parent / "rows.npy"))


def two_legs() -> Attached:
    spec = body_of(LEG.format("left_", 0.1), LEG.format("right_", -0.1))
    left = afo.attach(spec, "s1", side="left", timestep="1 ms")
    return afo.attach(left, "s1", side="right", prefix="afo_right_", supply="3 bar")


BODIES: dict[str, Any] = {
    "shipped": lambda: afo.attach("adult_75kg", "s1", side="right", timestep="1 ms"),
    "its own muscles, keys, plugin": lambda: afo.attach(
        body_of(LEG.format("", 0.0), head=OWN), "s1", side="right"
    ),
    "two legs": two_legs,
}


@pytest.mark.parametrize("body", BODIES)
def test_plugin_alone_steps_to_the_bits_of_the_callbacks(body: str, tmp_path: pathlib.Path) -> None:
    leg = BODIES[body]()
    rows = inputs(leg)
    with leg.callbacks():
        ours = stepped(leg.model, leg.data(), rows)
    for each in leg.legs.values():
        angle = ours[:, leg.model.joint(each.found.ankle).qposadr[0]]
        assert np.ptp(angle) > 0.1 and np.isfinite(ours).all()
    export_attached(leg, tmp_path / "body")
    assert np.array_equal(alone(tmp_path / "body", rows), ours)
    assert np.array_equal(alone(tmp_path / "body", rows, "reset"), ours)  # its air is the key's


def test_files_and_keys_of_the_model_go_with_it(tmp_path: pathlib.Path) -> None:
    (tmp_path / "shapes").mkdir()
    corners = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\n"
    (tmp_path / "shapes" / "a b.obj").write_text(corners + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n")
    text = body_of(LEG.format("", 0.0), head=OWN).to_xml()
    mesh = '<asset><mesh name="m" file="shapes/a b.obj"/></asset><worldbody><geom type="mesh" mesh="m"/>'
    (tmp_path / "leg.xml").write_text(text.replace("<worldbody>", mesh), encoding="utf-8")
    leg = afo.attach(tmp_path / "leg.xml", "s1", side="right")
    files = {file.relative_to(tmp_path / "out").as_posix() for file in export_attached(leg, tmp_path / "out")}
    written = {"model.xml", "inputs.bin", LIBRARY.name, "README.md", "LICENSE", "model_files/1_a b.obj"}
    assert files == written
    (tmp_path / "shapes" / "a b.obj").unlink()
    (tmp_path / "out").rename(tmp_path / "moved")
    rows = inputs(leg, 50)
    with leg.callbacks():
        assert np.array_equal(alone(tmp_path / "moved", rows), stepped(leg.model, leg.data(), rows))
    native.Hold().close()  # the library of this process has the plugin now
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "moved" / "model.xml"))
    assert [model.key(k).name for k in range(model.nkey)] == ["start", 'a "b"', "afo_start"]
    assert np.array_equal(model.key_act[:2], leg.model.key_act) and (model.key_act[0] != 0.0).sum() > 8
    assert model.key_act[0, 0] == 0.3 and list(model.key_ctrl[0, :2]) == [0.4, 0.01]
    assert model.actuator(0).name == "own \"a\" 'b' <>"
    assert list(model.actuator_user[0, :3]) == [9.0, 9.5, 0.0]
    assert np.array_equal(model.actuator_user, leg.model.actuator_user) and model.nplugin == 2
    data, begun = mujoco.MjData(model), leg.data()
    mujoco.mj_resetDataKeyframe(model, data, model.key("afo_start").id)
    for name in ("qpos", "qvel", "act", "ctrl"):
        assert np.array_equal(getattr(data, name), getattr(begun, name)), name


def test_what_was_exported_or_is_there_is_refused(tmp_path: pathlib.Path) -> None:
    leg = BODIES["shipped"]()
    export_attached(leg, tmp_path / "out")
    with pytest.raises(InputError, match="exists"):
        export_attached(leg, tmp_path / "out")
    export_attached(leg, tmp_path / "out", force=True)
    with pytest.raises(
        InputError, match="asks for callbacks"
    ):  # what is attached to is the file without --to
        afo.attach(tmp_path / "out" / "model.xml", "s1", side="right", prefix="second_")


def test_a_written_model_steps_beside_the_callbacks_as_it_is(tmp_path: pathlib.Path) -> None:
    """Its muscles' parameters stand in it: without the sidecar it steps to the same bits."""
    leg = BODIES["its own muscles, keys, plugin"]()
    write_attached(leg, tmp_path / "leg.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "leg.xml"))
    data, begun = mujoco.MjData(model), leg.data()
    mujoco.mj_resetDataKeyframe(model, data, 0)
    leg.reset(begun, model.key_qpos[0])
    begun.act[0] = model.key_act[0, 0]
    rows = inputs(leg, 100)
    with leg.callbacks():
        assert np.array_equal(stepped(model, data, rows), stepped(leg.model, begun, rows))
