# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     name: python3
# ---

# %% [markdown]
# # My muscle, from a bench
#
# For whoever has a muscle on a bench. A table of hung loads becomes a law of force, a recorded log becomes
# valve, volume and leak. Both are tested on data that the fit did not see, then moved into a device.

# %%
import matplotlib.pyplot as plt
import numpy as np

import afo_sim as afo
from afo_sim.lab import fit_replay, replay

bar = np.tile([2, 3, 4], 4)  # S1's table I, measured
load, short = np.repeat([1.0, 1.5, 2.0, 3.0], 3), [1.7, 2.7, 3.7, 1.6, 2.6, 3.2, 1.6, 2.6, 3.2, 1.3, 2.6, 3.1]
points = {"pressure [bar]": bar, "load [kg]": load, "change of length [cm]": short}  # or the path of a CSV
about = {"total_length": "21.5 cm", "bore": "11.5 mm", "hanger": "0.1 kg"}
found = afo.fit(points, law="tondu_lopez_2000_bladder", facts=about, hold_out="pressure")
unseen = found.best.held_out["pressure"].rms
print(found)
print(f"error on pressures that were left out: {100 * unseen:.2f} cm")
for name, interval in found.intervals.items():
    print(name, "95 %: {:.2g} to {:.2g} [SI]".format(*interval) if interval else "not determined")

# %% [markdown]
# Expect the error of what was left out at a pressure that you did not measure. Three of four parameters are
# *not determined*: others fit as well, if all move together. The curve is known, a single parameter is not.
# **Do not** read a bladder's force off this fit, nor change one parameter alone. [Fitting a
# muscle](../fit.md) says what to measure.
#
# Look at where the points end: at 30 N. In the grey part the lines are the law's alone.

# %% alt="Shortening over force at three pressures: fitted lines pass the measured points, which end at 30 N"
mine, force = found.muscle, np.linspace(0.0, 150.0, 61)
hung = 9.81 * (load + 0.1)  # with the hanger
figure, axes = plt.subplots(figsize=(6.0, 3.0), layout="constrained")
for colour, level in (("C0", 2), ("C1", 3), ("C2", 4)):
    contraction = mine.contraction(f"{level} bar", force=force)
    axes.plot(force, 100 * mine.nominal_length * contraction, colour, label=f"{level} bar")
    axes.plot(hung[bar == level], np.array(short)[bar == level], f"{colour}o")
axes.axvspan(hung.max(), 150.0, color="0.93")
axes.set(xlabel="force [N]", ylabel="shortening [cm]", xlim=(0, 150), ylim=(0, 4))
axes.legend()
plt.show()

# %% [markdown]
# ## A recorded log
# A log tells what a table at rest cannot: how fast air passes the valves. The muscle is held at a length,
# filled until 1 s, vented from 1.2 s. **This log is no measurement**: the next cell makes it with this
# program, from hidden values and noise. Put the path of [your CSV](../stand.md#a-measured-log) in its
# place.

# %%
afo.register(afo.load("muscle", mine, {"name": "mine"}))
time = np.arange(0.0, 2.0, 0.01)
hidden = {"conductance": "0.11 dm^3/(s*bar)", "outlet_conductance": "0.16 dm^3/(s*bar)"}
hidden |= {"tube_volume": "9 ml", "leak_conductance": "0.002 dm^3/(s*bar)"}
guess = {"conductance": "0.2 dm^3/(s*bar)", "outlet_conductance": "0.2 dm^3/(s*bar)"}
guess |= {"tube_volume": "4 ml", "leak_conductance": "0.0005 dm^3/(s*bar)"}


def made_up_log(length: str, seed: int) -> dict[str, object]:
    log = {"muscle": "mine", "length": length, "supply": "4 bar", "time [s]": time}
    log |= {"inlet": 1.0 * (time < 1.0), "outlet": 1.0 * (time >= 1.2)}
    true = replay(log | {"pressure [bar]": 0 * time}, bench=hidden).predicted
    noise = np.random.default_rng(seed).normal(size=(2, len(time)))
    return log | {"pressure [Pa]": true["pressure"] + 2e3 * noise[0], "force [N]": true["force"] + noise[1]}


shown, held_out = made_up_log("20 cm", 1), made_up_log("18.5 cm", 2)
fitted = fit_replay([shown], list(guess), bench=guess | {"timestep": "1 ms"})
print("\n".join(fitted.lines))

# %% [markdown]
# The hidden values were 0.11, 0.16, 9 ml and 0.002. Outlet and leak are found; inlet and tube only as a
# pair, since twice the volume behind twice the valve fills alike. State one of them, and the other follows.
#
# The second log, at another length, was not used: look at how the solid lines meet its dots.

# %% alt="Pressure and force of the log left out: the prediction passes the dots, the guess does not"
before, after = replay(held_out, bench=guess), replay(held_out, bench=guess | fitted.values)
figure, panels = plt.subplots(1, 2, figsize=(8.0, 2.8), layout="constrained")
for axes, name, unit in ((panels[0], "pressure", "Pa"), (panels[1], "force", "N")):
    axes.plot(time, after.log.columns[name], "k.", markersize=2, label="log, left out")
    axes.plot(time, after.predicted[name], label="predicted")
    axes.plot(time, before.predicted[name], "--", label="by the guess")
    axes.set(xlabel="time [s]", ylabel=f"{name} [{unit}]")
panels[1].legend(loc="center right", fontsize=8)
plt.show()
print(*after.warnings)

# %% [markdown]
# The warning is the grey part of the first figure: this bench pulls harder than S1's loads did. As the
# model made the log, the match shows that the fit works; only your log can show that the model does.
#
# ## Into a device
#
# Muscle, inlet and tube replace S1's in front of the shin. Look at the rise: the air path sets how fast the
# foot moves, the muscle how far.

# %% alt="Ankle angle, seated: with the fitted inlet the foot rises in half the time, to the same angle"
muscle = {"orthosis.muscle.dorsiflexor.type": mine}
chamber, value = "orthosis.chamber.dorsiflexor", fitted.values
pair = {f"{chamber}.inlet.conductance": f"{value['conductance']} m^3/(s*Pa)"}
pair[f"{chamber}.tube_volume"] = f"{value['tube_volume']} m^3"
figure, axes = plt.subplots(figsize=(6.0, 2.8), layout="constrained")
for name, sets in {"S1's own": {}, "my muscle": muscle, "my muscle and inlet": muscle | pair}.items():
    run = afo.run("seated", {"duration": "8 s", **sets})
    axes.plot(run["time"], np.degrees(run["ankle/angle"]), label=f"{name}: {run.metrics['range_of_motion']}")
axes.set(xlabel="time [s]", ylabel="ankle angle [°]")
axes.legend(loc="lower center")
plt.show()

# %% [markdown]
# `afo-sim new muscle mine` writes a muscle as a commented file for [your own device](../device.md).
