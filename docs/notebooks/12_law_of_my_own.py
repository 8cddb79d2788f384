# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     name: python3
# ---

# %% [markdown]
# # A law of my own
#
# For those who have a formula for a muscle's force that is not among the shipped ones. You register it, see
# what is refused, fit it to a measured table beside shipped laws, and walk with it. At the end stands what
# such a run is worth. It needs `pip install 'afo-sim[show,compile]'`. Other parts of your own:
# [Extending](../extending.md).
#
# ## The formula
#
# Force rises with pressure and falls straight with contraction κ; the bladder takes a constant: F = A p (1 −
# s κ) − F0.

# %%
import textwrap

import matplotlib.pyplot as plt
import numpy as np

import afo_sim as afo
from afo_sim.physics import Law, LawParameter

PARAMETERS = (  # name, symbol, unit, least, most, meaning, where fits begin
    LawParameter("area", "A", "m^2", 0.0, 0.01, "area that the pressure pulls on", (5e-4, 3e-3)),
    LawParameter("slope", "s", "", 0.0, 20.0, "share of the force lost per contraction", (2.0, 5.0)),
    LawParameter("bladder", "F0", "N", 0.0, 500.0, "force that the bladder takes", (5.0, 80.0)),
)


def straight(contraction, pressure, area, slope, bladder):
    return area * pressure * (1.0 - slope * contraction) - bladder


def wrong(contraction, pressure, area, slope, bladder):
    return area * pressure * (1.0 - slope * contraction) ** 2 - bladder


afo.register(Law("straight", straight, PARAMETERS, contraction_range=(0.0, 0.3)))
try:
    afo.register(Law("wrong", wrong, PARAMETERS, contraction_range=(0.0, 0.6)))
except afo.InputError as error:
    print(error)

# %% [markdown]
# The first is compiled now and a law like the others. The second would pull again beyond its free
# contraction, as no muscle does.
#
# ## Beside shipped laws, against a measurement
#
# S1's table I, published: how far a muscle of 21.5 cm lifts four loads at three pressures. Each load is also
# left out of the fit in turn: the error there tells how well a law predicts, the fit's own error does not.

# %% alt="Change of length over load at three pressures: measured points, own law and shipped laws"
pressures, loads = np.tile([2.0, 3.0, 4.0], 4), np.repeat([1.0, 1.5, 2.0, 3.0], 3)
lifted = np.array([1.7, 2.7, 3.7, 1.6, 2.6, 3.2, 1.6, 2.6, 3.2, 1.3, 2.6, 3.1])
table = {"pressure [bar]": pressures, "load [kg]": loads, "change of length [cm]": lifted}
facts = {"total_length": "21.5 cm", "bore": "11.5 mm", "hanger": "0.1 kg"}
fits = {
    law: afo.fit(table, law=law, facts=facts, hold_out="load", like="s1_215mm")
    for law in ("straight", "tondu_lopez_2000_bladder", "chou_hannaford_1996")
}
figure, axes = plt.subplots(figsize=(6.5, 3.2), layout="constrained")
axes.plot([0, 4], [0, 4], "0.7")
for (law, fit), mark in zip(fits.items(), "os^", strict=True):
    left_out = fit.fits[0].held_out["load"]
    print(f"{law:25} {len(fit.parameters)} parameters, {100 * left_out.rms:.2f} cm on loads left out")
    axes.plot(lifted, lifted + 100 * np.ravel(fit.residuals), mark, alpha=0.6, label=law)
print(textwrap.fill(repr(fits["straight"]), 84))
axes.set(xlabel="measured change of length [cm]", ylabel="by the law [cm]")
_ = axes.legend()

# %% [markdown]
# On the grey line a law says what was measured. The own law does as well as the shipped one with its bladder,
# with one parameter less; Chou's ideal braid, without a bladder, lifts too far at 2 bar. But an area of 12
# cm² is ten times that of a bore of 11.5 mm: the formula describes these points, and A is no area. Do not use
# it at another pressure or for another bore.
#
# ## Walk with it
#
# Take the fitted muscle, not its numbers: they count from the length that *this* fit found. Set on the
# shipped muscle, whose ends are counted apart, the same three numbers lift the toe by half as much.

# %%
muscle = "orthosis.muscle.dorsiflexor.type"
chosen = ("tondu_lopez_2000_bladder", "straight")
walks = {name: afo.run("walk-dropfoot-afo", {muscle: fits[name].muscle}) for name in chosen}
for name, walk in walks.items():
    print(name, walk.metrics["toe_clearance"], walk.metrics["torque_against_push_off"], sep="  ")
for answer in walks["straight"].verdict:
    told = f"{answer.word:9} {answer.question} {answer.brief or answer.text}"
    print(textwrap.fill(told, 84, subsequent_indent=10 * " "))
print(*(textwrap.fill(warning, 84) for warning in walks["straight"].warnings), sep="\n")

# %% [markdown]
# Both laws lift the toe to 13 mm, and still no answer of the own one is GOOD: the program has no measurement
# that stands behind it, and a fit to one table at rest is none of a walking muscle. Two laws that agree on
# twelve points show that these points cannot choose between them, not that both are right.
