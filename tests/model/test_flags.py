"""Flags for what a model does not have: the states stay the same to the bit, and what there is acts."""

import mujoco
import numpy as np
import pytest

from afo_sim.description.reader import load
from afo_sim.model.assemble import unused
from afo_sim.model.build import build

BITS = mujoco.mjtDisableBit
PARTS = {
    "joint spring": (BITS.mjDSBL_SPRING, 'stiffness="3" springref="20"', "", ""),
    "polynomial spring": (BITS.mjDSBL_SPRING, 'stiffness="0 2" springref="20"', "", ""),
    "tendon spring": (BITS.mjDSBL_SPRING, "", 'stiffness="300" springlength="0.1"', ""),
    "joint friction": (BITS.mjDSBL_FRICTIONLOSS, 'frictionloss="0.2"', "", ""),
    "tendon friction": (BITS.mjDSBL_FRICTIONLOSS, "", 'frictionloss="2"', ""),
    "input limit": (BITS.mjDSBL_CLAMPCTRL, "", "", 'ctrllimited="true" ctrlrange="0 0.1"'),
}


def pendulum(joint: str = "", tendon: str = "", motor: str = "") -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(f"""<mujoco><option integrator="implicitfast"/><worldbody>
        <site name="a" pos="0.1 0 0.1"/>
        <body><joint name="j" axis="0 1 0" damping="0.01" {joint}/>
        <geom size="0.02" pos="0 0 -0.2"/><site name="b" pos="0 0 -0.1"/></body></worldbody>
        <tendon><spatial name="t" {tendon}><site site="a"/><site site="b"/></spatial></tendon>
        <actuator><motor joint="j" {motor}/></actuator></mujoco>""")


def states(model: mujoco.MjModel, flags: int) -> np.ndarray:
    model.opt.disableflags = flags
    data = mujoco.MjData(model)
    data.ctrl[:], found = 0.3, []
    for _ in range(200):
        mujoco.mj_step(model, data)
        found.append([*data.qpos, *data.qvel, *data.qfrc_actuator])
    return np.array(found)


@pytest.mark.parametrize("part", [None, *PARTS])
def test_what_a_model_has_acts_and_what_it_has_not_is_passed_over(part: str | None) -> None:
    bit, *attributes = PARTS[part] if part else (0,)
    model = pendulum(*attributes)
    flags = unused(model)
    everything = BITS.mjDSBL_SPRING | BITS.mjDSBL_FRICTIONLOSS | BITS.mjDSBL_CLAMPCTRL
    assert flags == int(everything) & ~int(bit)
    with_all = states(model, 0)
    np.testing.assert_array_equal(states(model, flags), with_all)
    if part:
        assert not np.array_equal(states(model, int(bit)), with_all)  # there is something to switch off


def test_the_model_that_runs_carries_the_flags_and_the_saved_one_does_not() -> None:
    built = build(load("scenario", "seated"))
    assert built.model.opt.disableflags & BITS.mjDSBL_SPRING
    assert not mujoco.MjModel.from_xml_string(built.xml).opt.disableflags & BITS.mjDSBL_SPRING
