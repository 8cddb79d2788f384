# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     name: python3
# ---

# %% [markdown]
# # A controller in Python
#
# For whoever programs the electronics. The shipped walk opens its valves by the recorded gait phase, which
# no electronics know. Here a rule of your own commands them by what it senses: first on a perfect signal,
# then on a noisy one, then when the wearer stops.

# %%
import matplotlib.pyplot as plt

import afo_sim as afo


def lift(seen):
    unloaded = seen["foot/toe_load"] < 400.0  # N
    return {"dorsiflexor": "inlet" if unloaded else "outlet", "plantarflexor": "outlet"}


walk = afo.load("scenario", "walk-dropfoot-afo").set({"duration": "8.5 s", "reference": None})
loaded = afo.run(walk, controller=lift, rate="100 Hz")
timed = afo.run(walk, {"gait.settled": "walked"})
for name, run in (("gait phase", timed), ("toe load", loaded)):
    clearance, against = run.metrics["toe_clearance"], run.metrics["torque_against_push_off_per_mass"]
    print(f"{name:10} clearance {clearance}, against push-off {against}, air {run.metrics['air_per_stride']}")

# %% [markdown]
# The function is called 100 times a second with the columns of the run, and answers with commands for the
# valves. This one fills the front muscles while the forefoot bears less than 400 N, and vents them
# otherwise. (`settled: walked` makes the comparison fair: with a controller, strides are walked from the
# start and not solved for.)
#
# Look at where the pressure turns in the figure: the rule begins to fill later than the gait phase, and to
# vent later. So more air stays in.

# %% alt="Pressure in the front muscles over two strides: by toe load it turns later and stays higher"
figure, axes = plt.subplots(figsize=(6.0, 2.8), layout="constrained")
for name, run in (("gait phase", timed), ("toe load", loaded)):
    last = run["time"] > run["time"][-1] - 2.4
    axes.plot(run["time"][last], 1e-5 * run["chamber/dorsiflexor/pressure"][last], label=name)
axes.set(xlabel="time [s]", ylabel="gauge pressure [bar]")
axes.legend()
plt.show()

# %% [markdown]
# The threshold is a compromise. A higher one fills earlier and lifts more, while the foot still pushes off:

# %%
for threshold in (100.0, 200.0, 400.0, 600.0):

    def rule(seen, threshold=threshold):
        return lift({"foot/toe_load": seen["foot/toe_load"] + 400.0 - threshold})

    found = afo.run(walk, controller=rule).metrics
    clearance, against = found["toe_clearance"], found["torque_against_push_off_per_mass"]
    print(f"{threshold:.0f} N: clearance {clearance!s:>8}, against push-off {against}")

# %% [markdown]
# ## On a real signal
#
# A sensor adds what the electronics get: here 40 N of noise and 20 ms of delay, assumed. Two thresholds
# instead of one keep the valves from chattering; the rule now remembers, so it is a class.

# %%
noisy = walk.set({"sensor": {"toe": {"column": "foot/toe_load", "noise": "40 N", "delay": "20 ms"}}})


class Lift:
    def __init__(self, low=300.0, high=500.0, longest=100.0):
        self.low, self.high, self.longest = low, high, longest  # N, N, s
        self.filling, self.since = True, 0.0

    def __call__(self, seen):
        before, load = self.filling, seen["sensor/toe"]
        self.filling = load < (self.high if before else self.low)
        self.since = seen.time if self.filling != before else self.since
        fill = self.filling and seen.time - self.since < self.longest
        return {"dorsiflexor": "inlet" if fill else "outlet", "plantarflexor": "outlet"}


for name, rule in (("one threshold", Lift(400.0, 400.0)), ("two thresholds", Lift())):
    found = afo.run(noisy, controller=rule).metrics
    switches, clearance = found["switches_per_stride_dorsiflexor_inlet"].value, found["toe_clearance"]
    print(f"{name:15} {switches:.1f} switches of the inlet per stride, clearance {clearance}")

# %% [markdown]
# ## When the wearer stops
#
# **This is where a controller that walks well can hurt.** The wearer stops at 5 s. The rule sees a lightly
# loaded forefoot and goes on filling: the foot is pulled up at 4 bar for as long as the wearer stands, and
# pushes the shin forward. The second rule vents after a second of filling; through this valve that takes
# four more. Look at the lines after 5 s.

# %% alt="Pressure over time: after the stop at 5 s one rule holds 4 bar, the other vents within five seconds"
figure, axes = plt.subplots(figsize=(6.0, 2.8), layout="constrained")
stop = noisy.set({"gait.pace": [["5 s", 0.0]], "duration": "10 s"})
for name, rule in (("fills while unloaded", Lift()), ("for a second at most", Lift(longest=1.0))):
    run = afo.run(stop, controller=rule)
    axes.plot(run["time"], 1e-5 * run["chamber/dorsiflexor/pressure"], label=name)
axes.axvline(5.0, color="black", linewidth=0.8)
axes.set(xlabel="time [s]", ylabel="gauge pressure [bar]")
axes.legend(loc="lower left")
plt.show()

# %% [markdown]
# **Do not** take a rule to a wearer because it walks here. Hip, knee and pace are recorded, level walking;
# stairs, turns and falls are in none of these runs, and no rule was tried on a person.
#
# Without Python, the same is the kind `toe_load`, beside timers, state machines and PID:
# [controllers](../controllers.md). [Sensors](../sensors.md) have noise, delay and calibration; `afo-sim
# electronics` writes [the microcontroller's code](../electronics.md).
