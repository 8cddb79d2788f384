# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     name: python3
# ---

# %% [markdown]
# # Attach an orthosis to a body
#
# For those who have a whole-body MuJoCo model (MJCF, URDF or an `MjSpec`) and want a pneumatic orthosis on
# one of its ankles: what is added, what torque it gives there, and how to step both together from your own
# controller. A body of two legs is made here; yours goes in by its path. It needs `pip install
# 'afo-sim[legs,show]'`. All options: [Attach](../attach.md).

# %%
import matplotlib.pyplot as plt
import mujoco
import numpy as np

import afo_sim as afo

LEG = """<body name="thigh_{side}" pos="0 {y} 0"> <geom fromto="0 0 0 0 0 -.42" size=".06" mass="7.5"/>
  <joint name="hip_{side}" axis="0 -1 0" range="-30 60" damping="2"/>
  <body name="shank_{side}" pos="0 0 -.42"> <geom fromto="0 0 0 0 0 -.42" size=".045" mass="3.5"/>
    <joint name="knee_{side}" axis="0 1 0" range="0 90" damping="2"/>
    <body name="foot_{side}" pos="0 0 -.42"> <geom fromto="-.05 0 -.06 .18 0 -.06" size=".025" mass="1.1"/>
      <joint name="ankle_{side}" axis="0 -1 0" range="-50 30" damping=".5" stiffness="8" springref="-15"/>
    </body> </body> </body>"""
MOTORS = """<position name="hip_{side}" joint="hip_{side}" kp="400" kv="20"/>
  <position name="knee_{side}" joint="knee_{side}" kp="200" kv="10"/>"""
SIDES = {"right": -0.09, "left": 0.09}
legs = "".join(LEG.format(side=side, y=y) for side, y in SIDES.items())
BODY = f"""<mujoco> <option timestep="0.001"/>
  <default> <geom type="capsule" contype="0" conaffinity="0"/> </default>
  <worldbody> <body name="pelvis" pos="0 0 1"> {legs} </body> </worldbody>
  <actuator> {"".join(MOTORS.format(side=side) for side in SIDES)} </actuator> </mujoco>"""

# %% [markdown]
# The pelvis hangs in a harness; masses are about a person's of 75 kg. The spring at the ankle (8 N·m/rad
# about −15°) stands for relaxed tissue and is **assumed**: `attach` adds none.
#
# ## Attach

# %%
worn = afo.attach(mujoco.MjSpec.from_string(BODY), "s1", side="right", supply="4 bar")
print(worn, *worn.notices, f"controls of your own: {worn.own_controls}", sep="\n")

# %% [markdown]
# ## The torque at the ankle
#
# Hold the foot at each angle, fill the muscles, and read `qfrc_actuator` of the ankle: no other actuator
# pulls there.

# %% alt="Torque of the device over the ankle's angle at 1 to 4 bar: 8 N·m at −25° and 4 bar, 0.3 at 15°"
joint = worn.model.joint("ankle_right")
angles = np.linspace(-25, 15, 41)  # °, dorsiflexion positive
data, posture = worn.data(), worn.model.qpos0.copy()
figure, axes = plt.subplots(figsize=(5.5, 3.0), layout="constrained")
for bar in (1, 2, 3, 4):
    torque = []
    for posture[joint.qposadr[0]] in np.radians(angles):
        worn.reset(data, posture)
        worn.fill(data, {"dorsiflexor": f"{bar} bar"})
        torque.append(data.qfrc_actuator[joint.dofadr[0]])
    axes.plot(angles, torque, label=f"{bar} bar")
axes.set(xlabel="ankle, dorsiflexion positive [°]", ylabel="torque of the device [N·m]")
_ = axes.legend()

# %% [markdown]
# The device pulls hardest where the foot hangs, and less with every degree of lift, down to nearly nothing at
# 15°: its muscles have shortened as far as they can. So ask for the torque at the angle where you need it.
#
# ## Step both together
#
# Your controller writes `ctrl[own_controls]`, here hips and knees; `set_valves` is for the orthosis.

# %% alt="The body with five muscles at its right shank; ankle angles, torque and pressure over one step"
PERIOD = 1.2  # s


def swing(stiffness):
    """Right and left ankle [°], torque [N·m] and pressure [bar] (1200, 4) of the last of five steps."""
    for side in SIDES:
        worn.model.joint(f"ankle_{side}").stiffness[:] = stiffness
    data, rows = worn.data(), []
    worn.fill(data, {"dorsiflexor": "3 bar"})
    with worn.callbacks():  # without them the muscles are limp
        while data.time < 5 * PERIOD:
            for side, ahead in zip(SIDES, (0.0, 0.5), strict=True):
                turn = 2 * np.pi * (data.time / PERIOD + ahead)
                data.actuator(f"hip_{side}").ctrl = np.radians(8 + 20 * np.cos(turn))
                data.actuator(f"knee_{side}").ctrl = np.radians(30 - 30 * np.sin(turn))
            worn.set_valves(data, dorsiflexor="inlet" if data.time / PERIOD % 1 > 0.5 else "outlet")
            mujoco.mj_step(worn.model, data)
            now = [np.degrees(data.joint(f"ankle_{side}").qpos[0]) for side in SIDES]
            rows.append([*now, data.qfrc_actuator[joint.dofadr[0]], worn.pressure(data)["dorsiflexor"] / 1e5])
    return np.array(rows[-round(PERIOD / 0.001) :]), data


found, data = swing(8.0)
figure, (picture, left, right) = plt.subplots(1, 3, figsize=(9.0, 3.2), layout="constrained")
for k in np.flatnonzero(worn.model.geom_type == mujoco.mjtGeom.mjGEOM_CAPSULE):
    along = data.geom_xmat[k].reshape(3, 3)[:, 2] * worn.model.geom_size[k, 1]
    ends = np.array([data.geom_xpos[k] - along, data.geom_xpos[k] + along])
    picture.plot(ends[:, 0], ends[:, 2], "0.75", lw=150 * worn.model.geom_size[k, 0], solid_capstyle="round")
for first, count in zip(data.ten_wrapadr, data.ten_wrapnum, strict=True):
    points = data.wrap_xpos.reshape(-1, 3)[first : first + count]
    picture.plot(points[:, 0], points[:, 2], "tab:red")
picture.set(aspect="equal", xlabel="forward [m]", ylabel="up [m]")
time = np.linspace(0, PERIOD, len(found))
left.plot(time, found[:, :2], label=["right ankle, worn [°]", "left ankle, bare [°]"])
right.plot(time, found[:, 2:], label=["torque [N·m]", "pressure [bar]"])
right.set(ylim=(0, 4.2))
for axes in (left, right):
    axes.set(xlabel="time [s]")
    axes.legend(fontsize=8)
for stiffness in (4.0, 8.0, 16.0):
    lift = -np.diff(swing(stiffness)[0][:, :2].mean(axis=0)).item()
    print(f"mean lift with a spring of {stiffness:4.0f} N·m/rad: {lift:.1f}°")

# %% [markdown]
# Left: the body at the end of a step, S1's five muscles in red. Middle: the worn ankle stays between −7 and
# 1°, the bare one hangs some 15° lower. Right: S1's valves are slow, so pressure falls by a quarter only
# while the outlet is open.
#
# **The lift is that of the spring that you gave the ankle**: four times its stiffness halves it. Know the
# tissue before you choose a device by such a number. The device touches nothing and is not fitted to this
# leg, and the wearer's muscles do only what your controller says.
