# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     name: python3
# ---

# %% [markdown]
# # Use it elsewhere
#
# For those whose loop is not Python with this package: MuJoCo's viewer, Gymnasium, a robot's program in C,
# Simulink, a spreadsheet. A run is exported, played by MuJoCo alone and by the C library, and compared bit
# for bit. You get folders that you can give away. It needs `pip install 'afo-sim[show]'` and no compiler. All
# of it: [Use it elsewhere](../elsewhere.md).

# %%
import json
import pathlib
import subprocess
import sys
import textwrap

import matplotlib.pyplot as plt
import numpy as np

import afo_sim as afo
from afo_sim.export import export

run = afo.run("seated", {"duration": "4 s", "supply.pressure": "3 bar"})
for kind in ("plugin", "c"):
    made = export(run, f"seated_{kind}", kind, force=True)
    told = " ".join(path.name for path in made.files)
    print(textwrap.fill(f"{kind:7} {told}", 84, subsequent_indent=8 * " "))
print(textwrap.fill(" ".join(made.notes), 84))

# %% [markdown]
# ## MuJoCo alone
#
# This program knows nothing of the package: it loads the library, then the model, and plays the commands of
# the run (`inputs.bin`, one row a step).

# %%
PLAY = """
import glob, sys, mujoco, numpy
mujoco.mj_loadPluginLibrary(glob.glob("./afo_sim.*")[0])
model = mujoco.MjModel.from_xml_path("model.xml")
data, angles = mujoco.MjData(model), []
mujoco.mj_resetDataKeyframe(model, data, model.key("afo_start").id)  # air and supply
for row in numpy.fromfile("inputs.bin").reshape(-1, model.nu):
    angles.append(data.joint("ankle").qpos[0])
    data.ctrl[:] = row
    mujoco.mj_step(model, data)
numpy.save("angles.npy", angles)
assert "afo_sim" not in sys.modules
"""
folder = pathlib.Path("seated_plugin")
(folder / "play.py").write_text(PLAY)
subprocess.run([sys.executable, "play.py"], cwd=folder, check=True)
there, here = np.load(folder / "angles.npy"), run["ankle/angle"]
print(len(there), "steps; the same bits:", np.array_equal(there, here))

# %% [markdown]
# The same folder works in MuJoCo's viewer and in Gymnasium. Two traps: after `mj_resetData` instead of the
# key there is no supply and nothing fills; and a model without the library does not load, so muscles never go
# limp in silence.
#
# ## A loop of your own, in C
#
# `afo_sim.h` has twelve functions. Python's `ctypes` calls them here as C would, in a process of its own:
# fill below 0°, vent above 2°.

# %% alt="Ankle over four seconds: by the run's timer, and by a rule that holds it between 0 and 2°"
HOST = """
import ctypes, glob, json, math
lib = ctypes.CDLL(next(name for name in glob.glob("./afo_sim.*") if not name.endswith(".h")))
lib.afo_open.restype, lib.afo_get.restype = ctypes.c_void_p, ctypes.c_double
error = ctypes.create_string_buffer(400)
sim = ctypes.c_void_p(lib.afo_open(b".", error, 400))
assert sim, error.value
valve = lambda name: lib.afo_find(sim, f"valve/dorsiflexor_{name}/coil".encode())
angle, rows = lib.afo_find(sim, b"ankle/angle"), []
for _ in range(200):
    now = math.degrees(lib.afo_get(sim, angle))
    rows.append(now)
    lib.afo_set(sim, valve("inlet"), ctypes.c_double(now < 0.0))
    lib.afo_set(sim, valve("outlet"), ctypes.c_double(now > 2.0))
    if lib.afo_step(sim, STEPS):
        break
print(json.dumps(rows))
"""
steps = round(0.02 / (run["time"][1] - run["time"][0]))  # of 20 ms
program = [sys.executable, "-c", HOST.replace("STEPS", str(steps))]
own = json.loads(subprocess.run(program, cwd="seated_c", check=True, capture_output=True).stdout)

figure, axes = plt.subplots(figsize=(6.5, 3.0), layout="constrained")
axes.plot(run["time"], np.degrees(here), label="the run, and MuJoCo alone")
axes.plot(0.02 * np.arange(len(own)), own, label="C, valves by a rule of its own")
axes.set(xlabel="time [s]", ylabel="ankle, dorsiflexion positive [°]")
_ = axes.legend()

# %% [markdown]
# Blue: the scenario's timer, to the same bits in two programs. Orange: the rule fills until the foot has
# passed 0°, and again when it has sunk below it.
#
# **Nothing is judged there**: no verdict, no muscle's limit, no warning. Run a design here first, and read
# the notes above. A timer's rows end with the table: set all inputs that change, or export a longer run. The
# libraries are of the platform that exports. For a spreadsheet `run.export("seated.csv", rate="100 Hz")`
# writes rows; for Simulink `export(run, "seated.fmu", "fmu")` an FMU.
