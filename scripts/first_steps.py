# %% [markdown]
# # First steps
#
# From a muscle on paper to an orthosis that walks. Each cell stands on those above it. Run the file as a
# script, or open it as a notebook (VS Code, Spyder and Jupytext know the `# %%` cells).

# %%
import pathlib

import matplotlib.pyplot as plt
import numpy as np

import afo_sim as afo

OUT = pathlib.Path("runs/first_steps")
OUT.mkdir(parents=True, exist_ok=True)

# %% [markdown]
# ## A muscle
#
# `load` reads what is shipped; `afo-sim list muscles` names it. A muscle knows its own curves: force over
# contraction at a pressure, and back. Pressures are gauge. Quantities are texts with units, or numbers in SI.

# %%
muscle = afo.load("muscle", "dmsp_20")
contraction = np.linspace(0.0, 0.3, 61)
figure, axes = plt.subplots(figsize=(5.0, 3.2), layout="constrained")
for pressure in ("2 bar", "4 bar", "6 bar"):
    axes.plot(contraction, muscle.force(pressure, contraction=contraction), label=pressure)
axes.set(xlabel="contraction [-]", ylabel="force [N]")
axes.legend()
figure.savefig(OUT / "muscle.png", dpi=150)
print(f"20 kg hang from it at 4 bar when it is shorter by {muscle.contraction('4 bar', force='196 N'):.1%}")

# %% [markdown]
# The law matters more than its decimals. `using` takes another law that the muscle has parameters for.

# %%
for law in ("sarosi_2012", "kerscher_2006", "tondu_lopez_2000"):
    print(f"{law:18s} {muscle.using(law=law).force('4 bar', contraction=0.1):5.0f} N at 4 bar and 10 %")

# %% [markdown]
# ## A run
#
# `run` simulates a scenario. Here a patient without dorsiflexors walks four strides, bare at first.
# Columns are NumPy arrays in SI; metrics are numbers that know their unit. In a notebook, `bare` alone in a
# cell shows its status, numbers and figures.

# %%
bare = afo.run("walk-dropfoot", {"duration": "4.9 s"})
print(bare)
print("least height of the toe in swing:", bare.metrics["toe_clearance"])

# %% [markdown]
# ## Two runs compared
#
# The same walk with an orthosis. `set` changes any number by its dotted key, and checks it.

# %%
walk = afo.load("scenario", "walk-dropfoot-afo-short").set({"duration": "4.9 s"})
try:
    walk.set({"supply.presure": "3 bar"})
except afo.InputError as error:
    print(error)
worn = afo.run(walk, {"supply.pressure": "3 bar"})
for name, run in (("without", bare), ("with", worn)):
    angle, slap = run.metrics["mid_swing_angle"], run.metrics["foot_slap_velocity"]
    print(f"{name:8s} mid-swing {angle:6.1f} {angle.unit}, slap {slap:4.0f} {slap.unit}")
gained = worn.metrics["toe_clearance"] - bare.metrics["toe_clearance"]
print(
    f"the orthosis lifts the toe by {gained:.0f} mm with {worn.metrics['air_per_stride']} of air per stride"
)

# %% [markdown]
# These are numbers of the settled stride. The wearer walks the first ones after every stop, too. The scenario
# fills the muscles before the first step (`[start]`); without that the first stride is another one.

# %%
empty = afo.run(walk, {"supply.pressure": "3 bar", "start.dorsiflexor.fill_time": "0 s"})
for name, run in (("filled", worn), ("empty", empty)):
    first, before = run.metrics["toe_clearance_stride_1"], run.metrics["air_before_first_step"]
    print(f"{name:6s} at the start: toe at {first:.0f} mm in the first stride, {before} of air before it")

# %%
figure, axes = plt.subplots(figsize=(6.0, 3.2), layout="constrained")
for name, run in (("without", bare), ("with orthosis", worn)):
    axes.plot(run["time"], np.degrees(run["ankle/angle"]), label=name)
axes.set(xlabel="time [s]", ylabel="ankle angle [deg], dorsiflexion +")
figure.legend(loc="outside upper center", ncols=2)
figure.savefig(OUT / "angles.png", dpi=150)

# %% [markdown]
# A claim about a run can be checked, and several runs stand side by side in one HTML file.

# %%
print("stays below 30 degrees:", bool(afo.expect(worn, "ankle/angle").below("30 deg")))
print("written to", afo.report({"without": bare, "with": worn}, OUT / "report.html"))

# %% [markdown]
# ## A sweep
#
# Many cases of one scenario: here each pressure with each time of filling. The result is a table, and also an
# xarray Dataset. With `out="runs/a"` the sweep stands in a folder and goes on there when it is stopped.

# %%
over = {
    "supply.pressure": afo.span("2 bar", "4 bar", 3),
    "phases.dorsiflexor.inlet[0][0]": [0.45, 0.60],
}
cases = afo.sweep(walk, over, {"duration": "2.6 s"})
print(cases.to_pandas()[[*cases.parameters, "toe_clearance", "air_per_stride"]].to_string(index=False))

# %% [markdown]
# ## A fit
#
# Measured points become a muscle that runs. They stand in a CSV, or in columns whose titles carry units. Here
# they are S1's printed table: loads on a muscle, and by how much it shortens at three pressures.

# %%
points = {
    "pressure [bar]": [2, 3, 4] * 4,
    "load [kg]": np.repeat([1.0, 1.5, 2.0, 3.0], 3),
    "change of length [cm]": [1.7, 2.7, 3.7, 1.6, 2.6, 3.2, 1.6, 2.6, 3.2, 1.3, 2.6, 3.1],
}
about = {"total_length": "21.5 cm", "bore": "11.5 mm", "hanger": "0.1 kg"}
found = afo.fit(points, law="tondu_lopez_2000_bladder", facts=about)
print(f"{found.best.problem.law.name}: {100 * found.best.rms:.2f} cm RMS")
for name, value in found.parameters.items():
    interval = found.intervals[name]
    sure = "the table does not tell it" if interval is None else "95 %: {:.2g} to {:.2g}".format(*interval)
    print(f"  {name:18s} {value:8.3g}  {sure}")
lifted = afo.run("seated", {"orthosis.muscle.dorsiflexor.type": found.muscle, "duration": "8 s"})
print("on S1's device it moves the foot by", lifted.metrics["range_of_motion"])
