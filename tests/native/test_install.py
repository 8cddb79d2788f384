"""The callbacks for good, and beside the library's plugin in one process: neither leaves muscles limp.

Each case runs in a Python of its own, since what is installed for good stays.
"""

import os
import pathlib
import subprocess
import sys

import pytest

from afo_sim import native
from afo_sim.common import CallbackError
from afo_sim.export import export_attached
from afo_sim.legs import attach

try:
    LIBRARY = native.library_file()
except CallbackError:
    pytest.skip("no library is built", allow_module_level=True)

HEAD = """
import ctypes, gc, sys, threading
import mujoco, numpy as np
import afo_sim as afo
from afo_sim import native
from afo_sim.common import CallbackError
folder, library = sys.argv[1:]
mujoco_ = ctypes.CDLL(str(native.mujoco_library()))

def pointers():
    return [ctypes.c_void_p.in_dll(mujoco_, n).value for n in ("mjcb_act_bias", "mjcb_act_dyn")]

def opened():
    return mujoco.MjModel.from_xml_path(folder + "/model.xml")

def begun(model):
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("afo_start").id)
    data.ctrl[model.actuator("afo_valve_dorsiflexor_inlet").id] = 1.0
    return data

def moves(model, data):  # the air comes in, and muscles pull; not in every step, since the foot swings
    before, pulls = data.act.copy(), 0
    for _ in range(600):
        mujoco.mj_step(model, data)
        pulls += data.actuator_force.any()
    return (data.act != before).any() and pulls > 50

def run(**more):
    found = afo.run("seated", {"duration": "0.05 s", **more})
    assert found.status == "ok", found.status
    return found

def refused(call, words):
    try:
        call()
    except (CallbackError, mujoco.FatalError) as error:
        assert words in str(error), error
    else:
        raise AssertionError("not refused")

C = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)
FOREIGN = C(lambda m, d, i: 7.0)
OTHER = '''<mujoco><worldbody><body><joint name="j"/><geom size=".1"/></body></worldbody>
<actuator><general joint="j" biastype="user"/></actuator></mujoco>'''
load = "import mujoco; mujoco.mj_loadPluginLibrary(folder + '/' + library)"
"""

CASES = {
    "for good, again and again": """
afo.install(); there = pointers(); assert None not in there
afo.install(); assert pointers() == there
model = opened(); assert moves(model, begun(model))
run(); assert pointers() == there
assert moves(model, begun(model))
""",
    "a run's own model.xml": """
afo.install()
found = run(); found.save("run")
model = mujoco.MjModel.from_xml_path("run/model.xml"); data = mujoco.MjData(model)
native.fill_chambers(model, data, 0.0)
data.ctrl[model.actuator("chamber_dorsiflexor").id] = 4e5
data.ctrl[model.actuator("valve_dorsiflexor_inlet").id] = 1.0
assert moves(model, data)
""",
    "beside Python's pair": """
afo.install(); there = pointers()
run(callback="python"); assert pointers() == there
told = []
def elsewhere():
    refused(native.installed("python").__enter__, "held in the mode")
    told.append(1)
thread = threading.Thread(target=elsewhere)
thread.start(); thread.join(); assert told and pointers() == there
other = afo.Simulator("seated"); other.close(); assert pointers() == there
""",
    "Python's pair was first": """
native.Hold().close()
with native.Hold("python"):
    refused(afo.install, "held in the mode 'python'")
assert pointers() == [None, None]
afo.install(); assert None not in pointers()
""",
    "plugin within for good": """
afo.install(); there = pointers(); model = opened()
one, two = begun(model), begun(model)
assert pointers() == there and moves(model, one) and moves(model, two)
del one; assert moves(model, two); del two
gc.collect(); assert pointers() == there
""",
    "plugin around a run": """
native.Hold().close(); assert pointers() == [None, None]
model = opened(); data = begun(model); there = pointers()
assert None not in there and moves(model, data)
run(); assert pointers() == there and moves(model, data)
with native.installed(): assert pointers() != there and moves(model, data)
assert pointers() == there
run(callback="python"); assert pointers() == there and moves(model, data)
del data; gc.collect(); assert pointers() == [None, None]
""",
    "data made in a block and kept": """
with native.installed():
    model = opened(); data = begun(model)
    assert moves(model, data)
assert None not in pointers() and moves(model, data)
run(); assert moves(model, data)
del data; gc.collect(); assert pointers() == [None, None]
""",
    "data freed in a block": """
native.Hold().close(); model = opened(); data = begun(model)
with native.installed():
    del data; gc.collect()
    assert None not in pointers()
assert pointers() == [None, None]
""",
    "data made in a block of Python's pair": """
native.Hold().close(); model = opened()
hold = native.Hold(); there = pointers()
with native.installed("python"): data = mujoco.MjData(model)
assert pointers() == there; hold.check()
hold.close(); data = begun(model); assert moves(model, data)
""",
    "another program in C": """
native.Hold().close()
address = ctypes.cast(FOREIGN, ctypes.c_void_p).value
place = ctypes.c_void_p.in_dll(mujoco_, "mjcb_act_bias"); place.value = address
refused(afo.install, "another mjcb_act_bias"); assert pointers() == [address, None]
other = mujoco.MjModel.from_xml_string(OTHER); theirs = mujoco.MjData(other)
model = opened(); data = begun(model)
assert moves(model, data)
mujoco.mj_step(other, theirs); assert theirs.actuator_force[0] == 7.0  # passed on
run(); mujoco.mj_step(other, theirs); assert theirs.actuator_force[0] == 7.0 and moves(model, data)
with native.installed(): refused(lambda: mujoco.mj_step(other, theirs), "parameters")
del data; gc.collect(); assert pointers() == [address, None]
""",
    "a copy of the library came first": """
exec(load); model = opened(); data = begun(model); there = pointers()
assert moves(model, data)
refused(afo.install, "another mjcb_act_bias"); assert pointers() == there and moves(model, data)
del data; gc.collect(); assert pointers() == [None, None]
afo.install(); ours = pointers(); data = begun(model)
assert moves(model, data); run(); assert moves(model, data)
del data; gc.collect(); assert pointers() == ours
""",
    "a copy of the library comes later": """
afo.install(); exec(load); there = pointers(); model = opened(); data = begun(model)
assert moves(model, data); run(); assert moves(model, data)
del data; gc.collect(); assert pointers() == there
""",
    "a user's own key comes first": """
afo.install(); model = opened(); data = mujoco.MjData(model)
data.ctrl[model.actuator("afo_chamber_dorsiflexor").id] = 4e5
data.ctrl[model.actuator("afo_valve_dorsiflexor_inlet").id] = 1.0
assert model.key(0).name == "start" and not model.key_act[0].any()
assert moves(model, data) and (data.act != 0.0).sum() > 8
""",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    out = tmp_path_factory.mktemp("plugin") / "leg"
    export_attached(attach("adult_75kg", "s1", side="right", timestep="1 ms"), out)
    file = out / "model.xml"  # a key of no air before ours
    own = "<keyframe><key name='start'/></keyframe><keyframe>"
    file.write_text(file.read_text(encoding="utf-8").replace("<keyframe>", own, 1), encoding="utf-8")
    return out


@pytest.mark.parametrize("case", CASES)
def test_callbacks_and_plugin_in_one_process(case: str, folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    command = [sys.executable, "-c", HEAD + CASES[case], str(folder), LIBRARY.name]
    ran = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=os.environ)
    assert ran.returncode == 0, ran.stderr
    assert ran.stderr == ""
