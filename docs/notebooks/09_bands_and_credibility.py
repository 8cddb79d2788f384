# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     name: python3
# ---

# %% [markdown]
# # Bands, and whether a walk may decide
#
# For those who have a promising number and want to act on it. What is not known of orthosis and wearer is
# drawn together, so that the number gets a band; you see what the band is made of, what to measure next, what
# such bands were worth when others measured, and whether this walk may decide your question. It needs `pip
# install 'afo-sim[show]'`.
#
# ## One call
#
# The question, the context of use and the two levels of risk are yours: the program cannot know them. 108
# draws are few; use 200 or more for your own.

# %%
import textwrap

import matplotlib.pyplot as plt

import afo_sim as afo

found = afo.credibility(
    "walk-dropfoot-afo",
    question="Does it lift this patient's toe?",
    context="one of two devices is chosen before a fitting",
    influence="medium",
    consequence="medium",
    draws=108,
)
bands = found.recording.studies["uncertainty"]
for name in ("toe_clearance", "torque_against_push_off", "air_per_stride"):
    of = bands["metrics"][name]
    low, middle, high = of["quantiles"]
    print(f"{name:24} {of['own']:7.3g}  band {low:.3g} to {high:.3g}, median {middle:.3g} {of['unit']}")
touch, missed = bands["trips"]["touch"]["share"], 1.0 - bands["kept"]["lift"]
print(f"{touch:.0%} of the drawn strides touch the floor; {missed:.0%} of the draws miss the wanted 10 mm")

# %% [markdown]
# The single run says 13 mm, a clear success. In the draws it is anything between a trip and twice as much.
# **A share of draws is no accident rate**: the draws mix wearers and strides.
#
# ## What the band is made of

# %% alt="Shares of the variance: tissue and own walking for clearance, cuff for torque, valves for air"
groups = [group for group in bands["groups"] if max(group["explained"].values()) > 0.03]
figure, axes = plt.subplots(figsize=(7.5, 3.4), layout="constrained")
for k, name in enumerate(("toe_clearance", "torque_against_push_off", "air_per_stride")):
    shares = [100 * group["explained"].get(name, 0.0) for group in groups]
    rows = [row + 0.27 * (k - 1) for row in range(len(groups))]
    axes.barh(rows, shares, 0.25, label=name.replace("_", " "))
axes.set_yticks(range(len(groups)), [group["name"].replace("_", " ") for group in groups])
axes.set(xlabel="share of the variance [%]", xlim=(0, 100))
axes.invert_yaxis()
_ = axes.legend()

# %%
for step in found.plan[1:5]:
    told = f"{step['what']:12} known leaves {step['band_left']:.0%} of the band: {step['measure']}"
    print(textwrap.fill(told, 84, subsequent_indent=13 * " "))

# %% [markdown]
# Each number has a weak point of its own: tissue and walking decide the toe, the cuff the torque, the valves
# the air. Measuring the cuff hardly narrows the toe's band. The shares hold only if the spreads are about
# right, and most spreads are **assumed**: `afo-sim list usual` says why each has its width.
#
# ## What such bands were worth
#
# The [ledger](../accuracy.md#what-you-can-rely-on-within-what) has what others measured. Good bands of 90 %
# hold nine of ten.

# %%
print(f"{found.evidence['inside']} of {found.evidence['values']} measured toe clearances lay in their band;")
print(f"{found.evidence['worn']} of them were of a worn orthosis:")
for each in found.comparators:
    print(f"  {each['measured']:8} ± {each['error']:7} {each['device']}")

# %% [markdown]
# All four are of healthy walkers: no band here was ever compared with a toe under one of these devices.
#
# ## May it decide?

# %% alt="The grade of each factor beside grade 2, which medium risk requires; seven of thirteen reach 1"
figure, axes = plt.subplots(figsize=(7.5, 3.6), layout="constrained")
names = [factor.name for factor in found.factors]
colours = ["tab:green" if factor.grade >= factor.required else "tab:red" for factor in found.factors]
axes.barh(names, [factor.grade for factor in found.factors], color=colours)
axes.axvline(found.factors[0].required, color="black", label=f"required at {found.risk} risk")
axes.set(xlabel="grade", xticks=range(4))
axes.invert_yaxis()
axes.legend(loc="lower right")
for told in (found.judgement.upper(), *found.because):
    print(textwrap.fill(told, 84, subsequent_indent="  "))

# %% [markdown]
# Green factors suffice, red ones do not: the numerics are good enough, measurements are missing. So this walk
# may not decide, however high the toe passed. Do not lower the stated risk to get a "sufficient": the band
# stays as wide, and undecided is never sufficient. What the walk may do is rank what to measure before you
# ask again.
#
# Thresholds and grades are [this program's own](../credibility.md), assumed. The first two factors count the
# tests that stand beside the code; an installed package has none, and reaches grade 1 there.
# `found.save("judged")` writes a page with all evidence.
