"""Fill and vent an orthosis on a leg of a whole model, step by step."""

import mujoco

import afo_sim as afo

leg = afo.attach("adult_75kg", "s1", side="right", supply="4 bar")
print("ok:", leg)
data = leg.data()  # chambers at ambient pressure, muscles at rest
with leg.callbacks():  # without them the muscles are limp
    while data.time < 2.0:
        leg.set_valves(data, dorsiflexor="inlet" if data.time < 1.0 else "outlet")
        mujoco.mj_step(leg.model, data)
        if round(1000 * data.time) % 250 == 0:
            print(round(data.time, 2), leg.pressure(data)["dorsiflexor"], leg.angle(data))  # s, Pa, rad
