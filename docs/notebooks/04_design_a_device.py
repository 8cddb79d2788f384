# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     name: python3
# ---

# %% [markdown]
# # Design a device
#
# For whoever lays out an orthosis: pick a muscle, anchors, valve and supply; draw it; see what torque it
# gives and what the patient needs; walk; then change one thing and see what it costs. The device here is
# S1's, with parts that can be bought.

# %%
import textwrap

import matplotlib.pyplot as plt
import numpy as np

import afo_sim as afo

front = "orthosis.muscle.dorsiflexor"
design = afo.load("scenario", "walk-dropfoot-afo").set(
    {
        f"{front}.type": "dmsp_10",  # a fluidic muscle, sold by the metre; others: afo.list("muscles")
        f"{front}.type.total_length": "21.5 cm",
        f"{front}.count": 2,
        f"{front}.origin.from_joint": ["6 cm", "0 cm", "30 cm"],  # forward, left, up of the ankle
        f"{front}.insertion.from_joint": ["6.5 cm", "0 cm", "-1 cm"],
        f"{front}.link_length": "11.2 cm",
        "orthosis.chamber.dorsiflexor.inlet": "mh1",
        "supply.pressure": "4 bar",
        "duration": "4.9 s",
        "timestep": "2 ms",
    }
)

# %% [markdown]
# Draw it before you run it, to scale: left the leg with the paths, right what they do over the ankle angle.
# Letters say which numbers are published, derived or assumed; the curves are as sure as the least sure, the
# assumed cuff.

# %% alt="The device on the leg to scale, and over the ankle angle contraction, length, moment arm and torque"
drawing = afo.draw(design, "design.png")
group = drawing.facts[0]
print(f"moment arm {1000 * group.arm[group.at(0.0)]:.0f} mm at 0°")
print(textwrap.fill(drawing.warnings[0], 84))
plt.figure(figsize=(8.0, 5.6), layout="constrained")
plt.imshow(plt.imread("design.png"))
plt.axis("off")
plt.show()

# %% [markdown]
# ## Is it strong enough?
#
# Lines are the torque that the muscles give at rest, thick paths what this patient lacks in a stride. Where
# a path lies above the line of the supply's pressure, torque is missing. The need is uncertain by a factor
# of two, and valves leave less than the static lines.

# %% alt="Torque over ankle angle at 2, 3, 4 bar; needs pass 4 bar in swing beyond 2°, at loading near 0°"
maps = afo.torque_map(design, pressures=["2 bar", "3 bar", "4 bar"])
figure, axes = plt.subplots(figsize=(7.0, 3.0), layout="constrained")
for level, torque in zip(maps.maps[0].pressures, maps.maps[0].torque.T, strict=True):
    axes.plot(np.degrees(maps.maps[0].angles), torque, color="0.4", alpha=level / 4e5)
    axes.annotate(f"{1e-5 * level:.0f} bar", (-20.0, torque[0]))
for need in maps.needs[:3]:
    axes.plot(np.degrees(need.angle), need.torque, linewidth=3, label=f"needed in {need.phase}")
axes.set(xlabel="ankle angle [°]", ylabel="dorsiflexion torque [N·m]", xlim=(-20, 20))
axes.legend(fontsize=8)
plt.show()

# %% [markdown]
# ## Walk
#
# **Area and friction of the cuff are assumed**: this finds a device that is likely to hurt, never one that
# is safe to wear ([safety margins](../safety.md)).

# %%
run = afo.run(design)
for answer in run.verdict:
    told = f"{answer.word:9} {answer.question} {answer.brief or answer.text}"
    print(textwrap.fill(told, 84, subsequent_indent=10 * " "))
print({name: run.metrics[name] for name in ("cuff_pull_along", "muscle_share_of_contraction")})

# %% [markdown]
# The lift is doubted for a reason: *with another force law it is 5.2 mm*. Nobody measured this piece of
# muscle, so the formula decides. [Fit your own](02_muscle_from_a_bench_log.md) before you rely on it.
#
# What is the least pressure that lifts the foot of a seated person to 5°? The same question about a walk
# takes longer, and there a size suffices only where the verdict does not doubt it.

# %%
seated = {"orthosis": design.orthosis, "duration": "4 s"}
sizing = afo.size("pressure", "seated", seated, limits="peak_dorsiflexion_angle >= 5 deg", threads=1)
print(textwrap.fill(sizing.answer, 84))

# %% [markdown]
# ## Change one thing
#
# One change at a time, and beside it the same device without air:

# %%
no_air = {"phases.dorsiflexor.inlet": [], "start": None}
short = {f"{front}.link_length": "9.2 cm"}
changes = {
    "as above": {},
    "the same, no air": no_air,
    "insertion 1 cm forward": {f"{front}.insertion.from_joint[0]": "7.5 cm"},
    "cuff of 8 kN/m": {"orthosis.anchor.shank.stiffness": "8 kN/m"},
    "2 cm shorter link": short,
    "2 cm shorter, no air": short | no_air,
}
rows = ("toe_clearance", "torque_against_push_off", "cuff_skin_pressure", "air_per_stride")
print(f"{'':24}{'clearance':>14}{'against push-off':>18}{'skin':>14}{'air a stride':>16}")
for name, sets in changes.items():
    clearance, against, skin, air = (afo.run(design, sets).metrics[row] for row in rows)
    print(f"{name:24}{clearance!s:>14}{against!s:>18}{skin!s:>14}{air!s:>16}")

# %% [markdown]
# A shorter link lifts most, and is the trap: it holds the foot up as a strap does, at push-off as well, and
# does so without air. Compare each design with itself **without air**. Twice the stiffness of the cuff,
# which nobody has measured, does more than a centimetre at the insertion.
#
# `afo.effects(design)` ranks [what to change first](../effects.md); a design as a file: [your own
# device](../device.md).
