# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     name: python3
# ---

# %% [markdown]
# # A walker that responds
#
# For those who ask how a patient may change with a device, which a recorded walk cannot say. A body of seven
# segments and fourteen muscles walks by reflexes, healthy, with a drop foot, and with S1's device on. You get
# the changes, what they contradict, and what not to conclude. **This is experimental**: it [misses measured
# gait](../walker.md#what-is-not-validated) by stated amounts. It needs `pip install 'afo-sim[show]'`.

# %%
import textwrap

import matplotlib.pyplot as plt
import numpy as np

import afo_sim as afo
from afo_sim.walker import verdict

found = afo.walk("walk-dropfoot-afo", duration="6 s", starts=5, threads=1)

# %% [markdown]
# Nothing is recorded here. *As they are* means the reflexes of the healthy walk, as on the first steps;
# *adapted* means reflexes that a search has found for this patient (shipped, also for S1's device).

# %% alt="Ankle and trunk over six seconds: the patient falls, or walks with a hanging or a lifted foot"
cases = {
    "healthy": "healthy",
    "patient": "drop foot, as they are",
    "patient adapted": "drop foot, adapted",
    "device": "with device, as they are",
}
figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.2), layout="constrained")
for name, label in cases.items():
    walked = found[name].walked
    left.plot(walked["time"], np.degrees(walked["right/ankle"]), label=label)
    right.plot(walked["time"], walked["trunk/up"], label=label)
left.set(xlabel="time [s]", ylabel="right ankle [°]", ylim=(-50, 30))
right.set(xlabel="time [s]", ylabel="height of the trunk's joint [m]", ylim=(0.0, 1.0))
_ = right.legend()

# %% [markdown]
# Left: without a device the adapted patient's foot hangs at −28° in mid-swing, with it at −8° (healthy: −2°).
# Right: before they adapt they fall after 1.2 s; with the device on they walk at once, by the healthy
# reflexes.
#
# ## The numbers, beside the recorded walk

# %%
recorded = afo.run("walk-dropfoot-afo").metrics
KEYS = {"speed": 1.0, "right/clearance": 1e3, "right/ankle_swing": 1.0, "right/thigh_max": 1.0}
print(f"{'':18} speed [m/s]  clearance [mm]  ankle in swing [°]  thigh's flexion [°]")
for name in ("healthy", "patient adapted", "device adapted"):
    values = [f"{factor * found[name].numbers[key]:.3g}" for key, factor in KEYS.items()]
    print(f"{name:18} {values[0]:>11}  {values[1]:>14}  {values[2]:>18}  {values[3]:>19}")
print(f"{'recorded, without':18} {'':11}  {recorded['reference_toe_clearance'].value:14.3g}")
print(f"{'recorded, with S1':18} {'':11}  {recorded['toe_clearance'].value:14.3g}")

# %% [markdown]
# Recorded and responding contradict each other. The recorded hip and knee are a healthy walker's: without a
# device the toe would pass 26 mm below the floor. The responding patient lifts the thigh until the toe
# clears, and lets go of that with the device. Believe the recorded walk for what the device lifts at a given
# hip and knee, and this one for the direction in which hip and knee may answer.
#
# ## Its own answer

# %%
for reply in verdict(found):
    print(textwrap.fill(f"{reply.question} {reply.text}", 84), end="\n\n")

# %% [markdown]
# What somebody could take from this wrongly:
#
# - **"Without a device this patient falls."** Five of five starts fall before they adapt, none after. The
#   falls compare walkers and are never a patient's risk.
# - **"The device costs speed."** One search tells no two speeds apart that differ by less than 0.12 m/s.
# - **"It saves energy."** All these walkers cost twice what people do; differences under 10 % are not told.
# - **"It works for drop feet."** One body is an anecdote: `afo-sim walk walk-dropfoot-afo` lets twenty
#   patients walk, and after weeks a spring does at least as well as S1's device.
