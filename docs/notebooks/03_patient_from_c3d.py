# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     name: python3
# ---

# %% [markdown]
# # My patient, from a raw C3D
#
# For a gait laboratory or a clinician with a recorded walk: markers and force plates go in, out come a
# check of the trial, the stride that was taken, and what an orthosis would do in it. The last section says
# what would be wrong to conclude.

# %%
import textwrap

import matplotlib.pyplot as plt
import numpy as np

import afo_sim as afo
from afo_sim.common import assets
from afo_sim.gait import write
from afo_sim.gait_lab import import_gait, read_options, ten_lines

file = assets.folder("gait_data") / "drop_foot_made_up.c3d"  # yours: file = "walk.c3d"
trial = import_gait([file], read_options({"walker": "patient"}))
for what, found in ten_lines(trial):
    print(textwrap.fill(f"{what:14} {found}", 84, subsequent_indent=15 * " "))

# %% [markdown]
# The shipped file is **made up**: nobody's walk, with a drop foot who steps high. Read these lines for your
# own trial before anything else:
#
# - `walker` is yours to say: `patient` is the patient's own walk, `healthy` somebody else's who then
#   carries the described patient. No file states it.
# - *estimated*: what the marker set costs, here ±0.07 N·m/kg in the moment. *better with*: what would help.
#
# Then, whether the trial can be believed. Each fault was looked for, and is passed, DOUBTED or not checked:

# %%
for check in trial.checks:
    print(f"{check.fault:28} {check.found:42} {check.verdict[:11]}")
print(textwrap.fill(f"warning: {trial.warnings[0]}", 84))

# %% [markdown]
# The warning is what a clinician sees, too: the ankle hangs, and hip and knee make up for it. The figure
# shows the stride that was taken. Look at swing, right of the line: the ankle hangs 20° below the band of
# healthy adults, and the knee bends further. (In stance this walker's knee is bent throughout, and the
# ankle with it.)

# %% alt="Ankle and knee over the stride: in swing the ankle hangs below healthy adults, the knee bends more"
from afo_sim.gait.norm import read as read_norm

cycle, norm = trial.cycle, read_norm()
percent, toe_off = 100 * cycle.phase, 100 * cycle.phase[np.flatnonzero(cycle.grf_z > 0.05)[-1]]
figure, (ankle, knee) = plt.subplots(1, 2, figsize=(8.0, 2.8), layout="constrained", sharex=True)
low, high = (np.degrees(norm.at(name, cycle.phase)) for name in ("ankle_low", "ankle_high"))
ankle.fill_between(percent, low, high, color="0.85", label="healthy adults")
ankle.plot(percent, np.degrees(cycle.ankle_angle), label="this patient")
knee.plot(percent, np.degrees(norm.at("knee_angle", cycle.phase)), color="0.6", label="healthy adults, mean")
knee.plot(percent, np.degrees(cycle.knee_angle), label="this patient")
for axes, name in ((ankle, "ankle"), (knee, "knee")):
    axes.axvline(toe_off, color="black", linewidth=0.8)
    axes.set(xlabel="stride [%]", ylabel=f"{name} angle [°]")
    axes.legend(fontsize=8)
plt.show()

# %% [markdown]
# ## Walk it with a device
#
# The stride becomes a file that every walk takes. Mass and height come from the C3D.

# %%
write("my_walk.csv", cycle)
run = afo.run("walk-dropfoot-afo", {"gait.cycle": "my_walk.csv", "duration": "4.9 s"})
for answer in run.verdict:
    told = f"{answer.word:9} {answer.question} {answer.brief or answer.text}"
    print(textwrap.fill(told, 84, subsequent_indent=10 * " "))

# %% [markdown]
# The first answer is judged twice. As the patient walks, high steps already clear the floor, by 2 mm. With
# the same ankle on healthy people's hip and knee, the toe would pass 32 mm below it: the device is needed,
# and lifts it to 12 mm.
#
# What are such numbers worth? Of the values that others measured and this program predicted with a band of
# 90 %, this many lay in it:

# %%
for metric in ("toe_clearance", "torque_against_push_off", "air_per_stride"):
    told = run.summary()["coverage"][metric]
    print("{kind:14} {inside} of {values}, {worn} of these values on a worn orthosis".format(**told))

# %% [markdown]
# ## What would be wrong to conclude
#
# - **"The toe clears by 45 mm."** Shank, hip and pace stay as recorded: this patient goes on stepping high
#   with the device. Who stops has 9 to 12 mm, by how far the toes extend: DOUBTFUL. How a person adapts, no
#   stride tells.
# - **"The patient is weak, so I describe a weak patient."** A patient's walk imported as `healthy` is
#   weakened twice:

# %%
twice = afo.run(run.scenario, {"gait.walker": "healthy"})
print(textwrap.fill(twice.warnings[0], 84))
for name, each in (("patient", run), ("healthy", twice)):
    print(f"walker {name}: lands with its toes up by {each.metrics['foot_pitch_at_contact']}")

# %% [markdown]
# - **"Passed" means right.** A trial passes where no fault was found. A pressure that is 20 mm off along
#   the walk was found in 37 % of trials only; [the table](../gait_data.md#can-i-believe-this-trial) says
#   what is seen and what is not.
# - **"GOOD for this stride is good for this patient."** One stride of one leg in the sagittal plane was
#   walked, on one day.
#
# From the shell the same is `afo-sim gait import walk.c3d --walker patient --out my_walk.csv`, which also
# draws what was understood: [your own walking data](../gait_data.md). Whose strength and tissue is assumed:
# [patients](../patients.md).
