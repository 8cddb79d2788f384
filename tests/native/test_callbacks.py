"""The callbacks: in force, ours alone, and the same compiled as uncompiled."""

import ctypes

import mujoco
import numpy as np
import pytest
from rig import charged, hanging_mass

from afo_sim import native
from afo_sim.common import assets
from afo_sim.common.errors import CallbackError
from afo_sim.common.units import AMBIENT_PRESSURE
from afo_sim.description.muscle import LawSet
from afo_sim.description.reader import load
from afo_sim.model.build import build
from afo_sim.native import slots, struct_layout


def test_layout_is_compared_field_by_field() -> None:
    assert struct_layout.verify() > 300


def test_wrong_layout_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    real = struct_layout._struct("mjModel")
    members = list(real._fields_)
    at = [name for name, _ in members].index("nuser_actuator")
    shifted = type(
        "mjModel", (ctypes.Structure,), {"_fields_": [*members[:at], ("pad", ctypes.c_int64), *members[at:]]}
    )
    monkeypatch.setattr(struct_layout, "_struct", lambda name: shifted if name == "mjModel" else real)
    with pytest.raises(CallbackError, match=r"MuJoCo 3\.\d+.*mjModel"):
        struct_layout.verify.__wrapped__()


@pytest.mark.parametrize("mode", ["native", "python"])
def test_callbacks_are_restored(mode: native.Mode) -> None:
    assert mujoco.get_mjcb_act_bias() is None
    with native.installed(mode):
        assert mujoco.get_mjcb_act_bias() is not None
        with native.installed(mode):
            pass
        assert mujoco.get_mjcb_act_dyn() is not None
    assert mujoco.get_mjcb_act_bias() is None
    with pytest.raises(RuntimeError, match="mine"), native.installed(mode):
        raise RuntimeError("mine")
    assert mujoco.get_mjcb_act_dyn() is None


def test_foreign_callback_is_not_displaced() -> None:
    def foreign(model: object, data: object, i: int) -> float:
        return 0.0

    mujoco.set_mjcb_act_bias(foreign)
    try:
        with pytest.raises(CallbackError, match="another mjcb_act_bias"), native.installed():
            pass
        assert mujoco.get_mjcb_act_bias() is foreign
    finally:
        mujoco.set_mjcb_act_bias(None)


def test_callback_lost_during_a_run_is_noticed() -> None:
    with pytest.raises(CallbackError, match="replaced"), native.installed():
        mujoco.set_mjcb_act_bias(None)
    assert mujoco.get_mjcb_act_bias() is None


def test_limp_muscle_is_noticed() -> None:
    model = hanging_mass(3.0)
    with native.installed():
        data = charged(model, 3e5)
        mujoco.mj_forward(model, data)
        native.assert_live(model, data, [0])
    mujoco.mj_forward(model, data)  # without callbacks: MuJoCo says nothing
    assert data.actuator_force[0] == 0.0
    with pytest.raises(CallbackError, match="carries"):
        native.assert_live(model, data, [0])


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (
            lambda m, d: m.actuator_user.__setitem__((0, slots.MUSCLE_COEFFICIENTS), np.nan),
            "force is not a number in actuator 0",
        ),
        (lambda m, d: d.act.__setitem__(2, -1.0), "absolute pressure is not positive in actuator 1"),
        (lambda m, d: d.act.__setitem__(2, np.nan), "absolute pressure is not positive in actuator 1"),
        (lambda m, d: d.act.__setitem__(0, 0.0), "air mass is not positive in actuator 1"),
        (
            lambda m, d: m.actuator_user.__setitem__((1, slots.CHAMBER_TUBE_VOLUME), -1.0),
            "volume is not positive in actuator 1",
        ),
    ],
)
@pytest.mark.parametrize("mode", ["native", "python"])
def test_bad_states_are_raised(mode: native.Mode, spoil: object, message: str) -> None:
    model = hanging_mass(3.0)
    with native.installed(mode):
        data = charged(model, 3e5)
        spoil(model, data)  # type: ignore[operator]
        with pytest.raises((mujoco.FatalError, native.KernelFailure), match=message):
            mujoco.mj_step(model, data)


SETS = {
    f"{law_set.law}-{name}": law_set
    for name in assets.names("muscle")
    for law_set in load("muscle", name).laws.values()
}


@pytest.mark.slow
@pytest.mark.parametrize("law_set", SETS.values(), ids=SETS)
def test_native_equals_python_in_every_regime(law_set: LawSet) -> None:
    """Forces and rates over stretched, taut and slack muscles, both directions of flow and motion."""
    rng = np.random.default_rng(1)
    model = hanging_mass(
        3.0, law=law_set.law, law_parameters=law_set.parameters, lowest_pressure=law_set.pressure_range[0]
    )
    rows = [
        (
            rng.uniform(-0.02, 0.06),
            rng.uniform(-1, 1),
            rng.uniform(-5e4, 5e5),
            rng.uniform(0, 1, 4),
            rng.uniform(0, 1, 2),
        )
        for _ in range(100)
    ]

    def evaluate(mode: native.Mode) -> np.ndarray:
        out = []
        with native.installed(mode):
            for shortening, speed, gauge, valves, coils in rows:
                data = charged(model, gauge, shortening)
                data.qvel[0] = speed
                for side, places in zip(("inlet", "outlet"), valves.reshape(2, 2), strict=True):
                    native.write_valve(model, data.act, model.actuator(f"valve_air_{side}").id, *places)
                data.ctrl[1], data.ctrl[2:] = 4e5, coils
                mujoco.mj_forward(model, data)
                out.append(np.r_[data.actuator_force, data.act_dot, data.userdata, data.ctrl[0]])
        return np.array(out)

    compiled, plain = evaluate("native"), evaluate("python")
    scale = np.abs(plain).max(axis=0) + 1e-300
    assert np.abs(compiled - plain).max(axis=0) / scale == pytest.approx(0.0, abs=1e-12)
    assert (plain[:, 0] == 0.0).any()
    assert (plain[:, 0] < -100.0).any()


def test_force_is_the_law_whatever_ctrl_holds() -> None:
    """The coefficient left in a muscle's ctrl is for the integrator; it must not show in the force."""
    model = hanging_mass(3.0, damping=2e-3)
    with native.installed():
        data = charged(model, 3e5)
        data.qvel[0] = -0.02
        forces = []
        for left in (0.0, 123.0, 4567.0):
            data.ctrl[0] = left
            mujoco.mj_forward(model, data)
            forces.append(data.actuator_force[0])
            # −dF/dL̇ = R p_abs/L0
            assert data.ctrl[0] == pytest.approx(2e-3 * (3e5 + AMBIENT_PRESSURE) / 0.1631, rel=1e-12)
    assert forces == pytest.approx([forces[0]] * 3, rel=1e-12)


def test_parameters_reach_the_model_exactly() -> None:
    """MJCF text keeps six digits; the compiled model must not."""
    built = build(load("scenario", "seated", {"supply.pressure": "3 bar"}))
    row = built.model.actuator_user[built.index.muscles["dorsiflexor_2"]]
    muscle = built.scenario.orthosis.muscle["dorsiflexor"].type
    assert row[slots.MUSCLE_B] == 1.0 / np.sin(muscle.braid_angle) ** 2
    assert row[slots.MUSCLE_NOMINAL_LENGTH] == muscle.total_length - muscle.end_length
