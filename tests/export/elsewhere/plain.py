"""Play an exported folder by MuJoCo and the plugin alone: python plain.py FOLDER LIBRARY VARIABLES OUT.

OUT gets each output that VARIABLES names, after each step, and the microseconds of a step.
"""

import pathlib
import sys
import time
from typing import Any

import mujoco
import numpy as np

folder, library, table, out = sys.argv[1:]
mujoco.mj_loadPluginLibrary(library)
model = mujoco.MjModel.from_xml_path(f"{folder}/model.xml")
data = mujoco.MjData(model)
inputs = np.fromfile(f"{folder}/inputs.bin").reshape(-1, model.nu)
arrays = ("qpos", "qvel", "act", "userdata", "actuator_force", "qfrc_actuator")
rows: dict[str, Any] = {name: np.empty((len(inputs), getattr(data, name).size)) for name in arrays}
found: dict[str, Any] = {}
for kept in (False, True):
    mujoco.mj_resetDataKeyframe(model, data, 0)
    begun = time.process_time()
    for k, row in enumerate(inputs):
        data.ctrl[:] = row
        mujoco.mj_step(model, data)
        for name in arrays if kept else ():
            rows[name][k] = getattr(data, name).ravel()
    if not kept:
        found["microseconds"] = 1e6 * (time.process_time() - begun) / len(inputs)
last = ""
for line in pathlib.Path(table).read_text(encoding="utf-8").splitlines():
    kind, array, place, scale, offset, name, _, _ = line.split("\t", 7)
    if kind == "output":
        value = float(scale) * (rows[array][:, int(place)] + float(offset))
        found[name or last] = value if name else found[last] + value
        last = name or last
assert not [name for name in sys.modules if name.startswith("afo_sim")]
np.savez(out, **{name.replace("/", "|"): value for name, value in found.items()})
