"""Inside `installed()` no user actuator is limp in silence: without this project's mark it is refused."""

import re
from typing import Any

import mujoco
import numpy as np
import pytest
from rig import charged, hanging_mass

import afo_sim
from afo_sim import native
from afo_sim.common import CallbackError
from afo_sim.native import slots

FAILURES = (mujoco.FatalError, native.KernelFailure)
MODES = pytest.mark.parametrize("mode", ["native", "python"])


def one_actuator(kind: str, user: str = "") -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><worldbody><body><joint name="j"/><geom size=".1"/></body></worldbody>
        <actuator><general name="filler" joint="j"/><general name="mine" joint="j" {kind} {user}/>
        </actuator></mujoco>"""
    )


@MODES
@pytest.mark.parametrize("kind", ['biastype="user"', 'dyntype="user" actdim="2"'])
@pytest.mark.parametrize("user", ["", 'user="1 2 3"', f'user="{"7 " * native.N_USER}"'])
def test_actuator_without_mark_is_refused(mode: native.Mode, kind: str, user: str) -> None:
    model = one_actuator(kind, user)
    data = mujoco.MjData(model)
    with native.installed(mode), pytest.raises(FAILURES, match=r"read_recording.* in actuator 1$"):
        mujoco.mj_step(model, data)


@MODES
def test_other_actuators_are_left_alone(mode: native.Mode) -> None:
    """MuJoCo's own kinds ask no callback; a gain of another program is not among those installed."""
    model = one_actuator('gaintype="user"')
    data = mujoco.MjData(model)
    data.ctrl[:] = 1.0, 0.0
    with native.installed(mode):
        mujoco.mj_forward(model, data)
    assert data.actuator_force.tolist() == [1.0, 0.0]


def test_without_the_callbacks_a_foreign_actuator_is_its_owners() -> None:
    model = one_actuator('biastype="user"')
    data = mujoco.MjData(model)
    with native.installed():
        pass
    mujoco.mj_step(model, data)
    assert data.actuator_force[1] == 0.0


def limp() -> mujoco.MjModel:
    """Read from its text as an earlier version wrote it, with neither mark nor parameters of an actuator."""
    return mujoco.MjModel.from_xml_string(re.sub(r' user="[^"]*"', "", afo_sim.build("seated").xml))


@MODES
def test_model_without_parameters_is_refused(mode: native.Mode) -> None:
    """Inside the block it cannot run limp."""
    model = limp()
    with native.installed(mode), pytest.raises(FAILURES, match=r"model\.xml"):
        mujoco.mj_forward(model, mujoco.MjData(model))


@MODES
def test_a_muscle_that_loses_its_mark_is_refused_at_once(mode: native.Mode) -> None:
    model = hanging_mass(3.0)
    with native.installed(mode):
        data = charged(model, 3e5)
        mujoco.mj_step(model, data)
        before = np.copy(data.qpos)
        model.actuator_user[0, 0] += 1.0
        with pytest.raises(FAILURES, match="actuator 0"):
            mujoco.mj_step(model, data)
    assert before != 0.0


@MODES
@pytest.mark.parametrize("place", [slots.LAYOUT, slots.KIND])
@pytest.mark.parametrize("value", [np.nan, np.inf, 0.0, 1.5, len(slots.Kind) + 1.0])
def test_a_row_of_no_layout_or_kind_is_refused_at_once(mode: native.Mode, place: int, value: float) -> None:
    """Of a network, a muscle, a chamber, valves; `int` of no number is undefined in compiled code."""
    for actuator in range(hanging_mass(3.0).nu):
        model = hanging_mass(3.0)
        with native.installed(mode):
            data = charged(model, 3e5)
            model.actuator_user[actuator, place] = value
            with pytest.raises(FAILURES, match=rf"parameters are missing.* in actuator {actuator}$"):
                mujoco.mj_step(model, data)
        with pytest.raises(CallbackError, match="lost its parameters"):
            native.assert_rows(model)


def test_models_are_compiled_inside_the_block() -> None:
    """As a sweep does while others of its threads step; MuJoCo tries each model before it has parameters."""
    with native.installed():
        built = afo_sim.build("seated")
        assert mujoco.MjModel.from_xml_string(built.xml).nu == built.model.nu


TUBE = {
    "orthosis.chamber.dorsiflexor.tube": "pun_4x2_5",
    "orthosis.chamber.dorsiflexor.tube_length": "2 m",
    "orthosis.chamber.dorsiflexor.tube_volume": "0 ml",
}
AIR: dict[str, dict[str, Any]] = {
    "tube": TUBE,
    "guides": {"orthosis": "guided"},
    "regulator": {"supply.source": "bottle_0_5l", "supply.regulator": "droop_tenth"},
    "carbon dioxide": {"supply.source": "co2_16g"},
    "drive": {"drive.dorsiflexor": {"kind": "regulator", "integral_time": "0.5 s"}},
}


@pytest.mark.parametrize("sets", AIR)
def test_model_with_parameters_is_tried_without_air_and_then_refused_until_it_has_some(sets: str) -> None:
    built = afo_sim.build("walk-dropfoot-afo", AIR[sets] | {"duration": "0.1 s"})
    with native.installed():
        model = mujoco.MjModel.from_xml_string(built.xml)
        data = mujoco.MjData(model)
        with pytest.raises(FAILURES, match="not positive"):
            mujoco.mj_step(model, data)
        mujoco.mj_resetData(model, data)
        native.fill_chambers(model, data, 0.0)
        mujoco.mj_step(model, data)
    assert np.isfinite([*data.qpos, *data.act, *data.userdata]).all()


def test_limp_model_from_a_binary_is_refused_in_its_second_step() -> None:
    """It has no signature, as a model that is being compiled: only its time tells."""
    text = limp()
    binary = np.empty(mujoco.mj_sizeModel(text), np.uint8)
    mujoco.mj_saveModel(text, None, binary)
    model = mujoco.MjModel.from_binary_path("limp.mjb", {"limp.mjb": binary.tobytes()})
    data = mujoco.MjData(model)
    with native.installed():
        mujoco.mj_step(model, data)
        with pytest.raises(FAILURES, match="read_recording"):
            mujoco.mj_step(model, data)
