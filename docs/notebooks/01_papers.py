# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     name: python3
# ---

# %% [markdown]
# # A first look: one walk, four papers
#
# For anyone who starts a first simulation. A patient with a drop foot walks without and with S1's orthosis,
# and you read the verdict. Then claims of the four papers stand beside what the simulator finds.

# %%
import matplotlib.pyplot as plt

import afo_sim as afo

bare = afo.run("walk-dropfoot", {"duration": "4.9 s", "shoe": "trainer"})
worn = afo.run("walk-dropfoot-afo", {"duration": "4.9 s"})
print("toe clearance without:", bare.metrics["toe_clearance"])
print("toe clearance with:   ", worn.metrics["toe_clearance"])

# %% [markdown]
# Below zero the toe would pass under the floor: the patient trips. (Each swing is walked once more without
# a floor.) With the orthosis, whose front muscles are filled in swing, the toe clears the floor.
#
# Stance is shaded. In swing, look at the dip of the orange curve between its two peaks: the clearance.

# %% alt="Height of toe and ball of the foot over four strides; in each swing the toe's lowest point is 13 mm"
afo.figure(worn, kind="clearance")

# %% [markdown]
# A lifted toe is not the whole answer. [The verdict](../verdict.md) asks seven questions:

# %%
for answer in worn.verdict:
    print(f"{answer.word:9} {answer.question}\n   {answer.brief or answer.text}")

# %% [markdown]
# - `GOOD*` is good *as described*. S1 states no moment arms, cables or cuff: this project assumed them.
#   Varied within what is not known (`uncertainty=200`), the first two answers are no longer GOOD.
# - Push-off is DOUBTFUL: the muscles still pull when the foot should push.
#
# **Do not conclude** that this device helps a person: nobody has measured it on a leg.
#
# What would a lower pressure do? Any number is set by its dotted key and a text with its unit.

# %%
for pressure in ("2 bar", "3 bar", "4 bar"):
    run = afo.run("walk-dropfoot-afo", {"duration": "4.9 s", "supply.pressure": pressure})
    clearance, against = run.metrics["toe_clearance"], run.metrics["torque_against_push_off_per_mass"]
    print(f"{pressure}: clearance {clearance:5.1f} mm, against push-off {against:.3f} N·m/kg")

# %% [markdown]
# Less pressure hinders less, but does not lift enough.
#
# ## What S1 claims
#
# `afo.paper("S1")` computes all 32 systems, formulas, tables, figures and claims of S1. Here are three,
# with the first numbers behind each outcome. In brackets: implied by the paper, not printed.

# %%
for claim in afo.paper("S1", numbers=[13, 19, 22]).claims:
    print(f"{claim.number}: {claim.says.partition(';')[0]}\n   {claim.outcome.upper()}")
    for number in claim.numbers[:3]:
        print("     ", number)

# %% [markdown]
# - **13** S1 prints no torque and concludes that the device can be used. At 4 bar it suffices for 60 % of
#   early swing, of a need that is uncertain by a factor of two.
# - **19** sets S1's own simulation against S1's own bench. No choice of ours decides it.
#
# The figure shows what number 19 means for a design with the 12 cm muscle. Look at how far the dashed lines
# lie above the measured points: S1's model promises a stroke that the bench did not give. The law fitted
# here (solid) has seen the points, so it is no independent proof.

# %% alt="Shortening over pressure: S1's simulation lies above S1's measured points, often more than twofold"
bench, simulated = (afo.paper("S1", numbers=[number]).claims[0].rows for number in (16, 18))  # tables II, IV
figure, axes = plt.subplots(figsize=(7.0, 3.2), layout="constrained")
for colour, load in (("C0", "1 kg"), ("C1", "3 kg")):
    own, cells = ([row for row in rows if f", {load}," in row.quantity] for rows in (simulated, bench))
    axes.plot([2, 3, 4], [row.published for row in own], f"{colour}--", label=f"{load}, S1's simulation")
    axes.plot([2, 3, 4], [row.simulated for row in cells], f"{colour}-", label=f"{load}, fitted here")
    axes.plot([2, 3, 4], [row.published for row in cells], f"{colour}o", label=f"{load}, S1's bench")
axes.set(xlabel="gauge pressure [bar]", ylabel="shortening [cm]", xticks=[2, 3, 4], ylim=(0, 3))
figure.legend(loc="outside right center")
plt.show()

# %% [markdown]
# ## The timer
#
# S1 opens the valves by a clock of 8 s, a stride takes 1.09 s. Red strides trip: the clock vents, and the
# patient walks without a device.

# %% alt="Toe clearance of 22 strides: in each cycle of the timer about three strides in a row are below zero"
timer = afo.run("walk-dropfoot-afo-paper-timer")
clearance = [stride["toe_clearance"].value for stride in timer.strides.values()]
figure, axes = plt.subplots(figsize=(6.0, 2.6), layout="constrained")
axes.bar(range(len(clearance)), clearance, color=["C3" if mm < 0 else "C0" for mm in clearance])
axes.axhline(0.0, color="black", linewidth=0.8)
axes.set(xlabel="stride", ylabel="toe clearance [mm]")
plt.show()

# %% [markdown]
# ## The other three papers
#
# S2 compares four formulas of a muscle's force, S3 measures characteristics, S0 is a thesis on a stand.

# %%
for name, number in (("S2", 41), ("S2", 49), ("S3", 57), ("S0", 77)):
    (claim,) = afo.paper(name, numbers=[number]).claims
    print(f"{name}, {number}: {claim.says}\n   {claim.outcome.upper()}")

# %% [markdown]
# `CANNOT TELL` (a wrong model passes as well) and `LOST` (not in the text) are answers, too. All claims:
# [S1](../paper_s1.md), [S2](../paper_s2.md), [S3](../paper_s3.md), [S0](../paper_s0.md).
#
# `afo.report({"without": bare, "with": worn}, "report.html")` sets both walks side by side for a clinician.
