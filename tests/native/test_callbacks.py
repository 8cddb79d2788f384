"""The callbacks: in force, ours alone, and the same compiled as uncompiled."""

import ctypes
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from rig import BRAID, LAW, charged, hanging_mass

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, CallbackError, assets
from afo_sim.description import load
from afo_sim.description.law_set import LawSet
from afo_sim.model.build import build
from afo_sim.native import slots, struct_layout
from afo_sim.native.callbacks import define
from afo_sim.physics import LAWS
from afo_sim.physics.static_force import muscle_static_force

NETWORK, MUSCLE, CHAMBER = 0, 1, 2  # actuators of the hanging mass; then inlet and outlet
ANCHOR = native.CircuitAnchor("top", stiffness=4e4)
AIR = len(slots.LEADER_ACT) + len(slots.ANCHOR_ACT)  # first place of the chamber's states in `act`


def test_layout_is_compared_field_by_field() -> None:
    assert struct_layout.verify() > 300


def test_wrong_layout_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    real = struct_layout.c_struct("mjModel")
    members = list(real._fields_)
    at = [name for name, _ in members].index("nuser_actuator")
    shifted = type(
        "mjModel", (ctypes.Structure,), {"_fields_": [*members[:at], ("pad", ctypes.c_int64), *members[at:]]}
    )
    monkeypatch.setattr(struct_layout, "c_struct", lambda name: shifted if name == "mjModel" else real)
    with pytest.raises(CallbackError, match=r"MuJoCo \d+\.\d+.*mjModel"):
        struct_layout.verify.__wrapped__()


def test_code_for_numbers_of_another_size_has_another_key(monkeypatch: pytest.MonkeyPatch) -> None:
    before = struct_layout.kinds()
    monkeypatch.setitem(struct_layout._C_TYPES, "mjtNum", ctypes.c_float)
    assert struct_layout.kinds() != before


def test_callback_lost_during_a_run_is_noticed() -> None:
    with pytest.raises(CallbackError, match="replaced"), native.installed():
        mujoco.set_mjcb_act_bias(None)
    assert mujoco.get_mjcb_act_bias() is None


def test_limp_muscle_is_noticed() -> None:
    model = hanging_mass(3.0)
    with native.installed():
        data = charged(model, 3e5)
        mujoco.mj_forward(model, data)
        native.assert_live(model, data, [MUSCLE])
    mujoco.mj_forward(model, data)  # without callbacks: MuJoCo says nothing
    assert data.actuator_force[MUSCLE] == 0.0
    with pytest.raises(CallbackError, match="carries"):
        native.assert_live(model, data, [MUSCLE])


def test_network_stands_before_what_it_solves() -> None:
    """MuJoCo calls the actuators in their order: a chamber before its network would read the last step."""
    model = hanging_mass(3.0)
    kinds = model.actuator_user[:, slots.KIND].tolist()
    assert kinds.index(slots.Kind.NETWORK) < min(
        kinds.index(slots.Kind.MUSCLE), kinds.index(slots.Kind.CHAMBER)
    )


def test_a_start_in_motion_has_the_past_that_its_velocity_implies() -> None:
    """One step back along q̇: volume and contraction of a state at rest there, at the same pressure."""
    model, speed = hanging_mass(3.0, anchor=ANCHOR), 0.4
    with native.installed():
        data, still = charged(model, 3e5, 0.02), charged(model, 3e5, 0.02)
        there = charged(model, 3e5, 0.02 - speed * model.opt.timestep)
        data.qvel[0] = speed
        native.step_back(model, data)
    assert data.qpos[0] == 0.02
    for place in (slots.LEADER_ACT.contraction, AIR + slots.CHAMBER_ACT.last_volume):
        assert data.act[place] == pytest.approx(there.act[place], rel=1e-12)
        assert abs(there.act[place] / still.act[place] - 1.0) > 1e-4


def test_what_is_carried_over_is_the_laws_force_beyond_the_tension() -> None:
    """Of a damped muscle in motion at the end of a step, by its law at that contraction and pressure."""
    model, law = hanging_mass(3.0, damping=2e-3), LAWS["tondu_lopez_2000_bladder"]
    with native.installed():
        data = charged(model, 3e5, 0.02)
        data.qvel[0] = -0.3
        mujoco.mj_step(model, data, 5)
    own = native.read_own(model, data.userdata, MUSCLE)
    gauge = data.act[len(slots.LEADER_ACT) + slots.CHAMBER_ACT.last_pressure] - AMBIENT_PRESSURE
    expected = law.kernel(float(own.contraction), gauge, *law.coefficients(BRAID, LAW)) - own.tension
    assert abs(expected) > 1.0
    assert native.read_carried(model, data.act, MUSCLE) == pytest.approx(expected, rel=1e-9)


def test_a_motor_brakes_against_its_velocity() -> None:
    row = np.zeros(slots.N_USER)
    row[: slots.FIRST], row[slots.SPASTIC_ROW.gain] = (slots.THIS_LAYOUT, slots.Kind.MOTOR), 2.5
    model = SimpleNamespace(actuator_user=row, nuser_actuator=len(row))
    bias, _ = define(lambda complaint, actuator: None)
    assert bias(model, SimpleNamespace(actuator_velocity=[0.3]), 0) == -0.75


def spoiled(
    mode: native.Mode, array: str, place: int | tuple[int, int], value: float, steps: int = 4
) -> None:
    """Step a muscle under load after one number of its model's rows, its states or its inputs was set."""
    model = hanging_mass(3.0, return_stiffness=20.0, anchor=ANCHOR)
    with native.installed(mode):
        data = charged(model, 3e5)
        getattr(model if array == "actuator_user" else data, array)[place] = value
        for _ in range(steps):
            mujoco.mj_step(model, data)


SIGMA, LAW_FIRST = AIR + slots.CHAMBER_ACT.sigma, slots.MUSCLE_ROW.coefficients


@pytest.mark.parametrize(
    ("array", "place", "value", "message"),
    [
        ("actuator_user", (MUSCLE, LAW_FIRST), np.nan, "force is not a number in actuator 1"),
        ("act", SIGMA, -1.0, "absolute pressure is not positive in actuator 2"),
        ("act", SIGMA, np.nan, "absolute pressure is not positive in actuator 2"),
        ("act", AIR + slots.CHAMBER_ACT.mass, 0.0, "air mass is not positive in actuator 2"),
        ("act", AIR + slots.CHAMBER_ACT.last_volume, np.nan, "volume is not positive in actuator 2"),
        ("ctrl", CHAMBER, np.nan, "supply's absolute pressure is not positive in actuator 2"),
        ("ctrl", NETWORK, np.nan, "force is not a number in actuator 0"),
        ("actuator_user", (CHAMBER, slots.AIR_ROW.volume), -1.0, "volume is not positive in actuator 2"),
        ("qpos", 0, np.nan, "no length of its muscles balances their forces in actuator 0"),
    ],
)
@pytest.mark.parametrize("mode", ["native", "python"])
def test_bad_states_are_raised(mode: native.Mode, array: str, place: int, value: float, message: str) -> None:
    with pytest.raises((mujoco.FatalError, native.KernelFailure), match=message):
        spoiled(mode, array, place, value, steps=1)


# of a taut muscle at 3 bar
USED = (
    "law series_length cable_stiffness inverse_mass nominal_length nominal_radius b lock damping dead_volume "
)
USED += "lowest_pressure friction damper coefficients"
SPOILT = [
    # of the muscle and its anchor, σ, mass, last volume and pressure, armature, opening
    *(("act", number) for number in range(hanging_mass(3.0, anchor=ANCHOR).na)),
    *(("ctrl", number) for number in (NETWORK, CHAMBER, CHAMBER + 1, CHAMBER + 2)),
    *(("actuator_user", (MUSCLE, getattr(slots.MUSCLE_ROW, name))) for name in USED.split()),
    *(("actuator_user", (MUSCLE, LAW_FIRST + k)) for k in range(1, 5)),
]


@pytest.mark.parametrize(("array", "place"), SPOILT)
def test_nothing_that_is_not_a_number_stays_silent(array: str, place: int | tuple[int, int]) -> None:
    with pytest.raises(mujoco.FatalError):
        spoiled("native", array, place, np.nan)


def test_no_lowest_pressure_passes_for_none() -> None:
    """A pressure is never below one that is not a number."""
    assert np.isnan(muscle_static_force(1.0, 0.1, 3e5, np.nan, [0.0] * 8, 0)[0])


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
        3.0,
        law=law_set.law,
        law_parameters=law_set.parameters,
        lowest_pressure=law_set.pressure_range[0],
        return_stiffness=20.0,
        anchor=ANCHOR,
    )
    rows = [
        (
            rng.uniform(-0.02, 0.06),
            rng.uniform(-1, 1),
            rng.uniform(-5e4, 5e5),
            rng.uniform(0, 1, 4),
            rng.uniform(0, 1, 2),
            rng.normal(0.0, (2e-3, 5.0, 1e-3, 1e-3, 1e-4)),
        )
        for _ in range(100)
    ]

    def evaluate(mode: native.Mode) -> np.ndarray:
        out = []
        with native.installed(mode):
            for shortening, speed, gauge, valves, coils, past in rows:
                data = charged(model, gauge, shortening)
                data.qvel[0] = speed
                data.act[:AIR] += past
                for side, places in zip(("inlet", "outlet"), valves.reshape(2, 2), strict=True):
                    native.write_valve(model, data.act, model.actuator(f"valve_air_{side}").id, *places)
                data.ctrl[CHAMBER], data.ctrl[CHAMBER + 1 :] = 4e5, coils
                mujoco.mj_forward(model, data)
                out.append(np.r_[data.actuator_force, data.act_dot, data.userdata, data.ctrl[MUSCLE]])
        return np.array(out)

    compiled, plain = evaluate("native"), evaluate("python")
    scale = np.abs(plain).max(axis=0) + 1e-300
    assert np.abs(compiled - plain).max(axis=0) / scale == pytest.approx(0.0, abs=1e-12)
    assert (plain[:, MUSCLE] == 0.0).any()
    assert (plain[:, MUSCLE] < -100.0).any()


def test_force_is_the_tension_whatever_ctrl_holds() -> None:
    """The coefficient left in a muscle's ctrl is for the integrator; it must not show in the force."""
    model = hanging_mass(3.0, damping=2e-3)
    with native.installed():
        data = charged(model, 3e5)
        data.qvel[0] = -0.02
        forces, coefficients = [], []
        for left in (0.0, 123.0, 4567.0):
            data.ctrl[MUSCLE] = left
            mujoco.mj_forward(model, data)
            forces.append(data.actuator_force[MUSCLE])
            coefficients.append(data.ctrl[MUSCLE])
        assert forces == [forces[0]] * 3
        # ¼ h dT/dx, by tensions half a micrometre to either side
        tensions = []
        for shortening in (-5e-7, 5e-7):
            data.qpos[0] = shortening
            mujoco.mj_forward(model, data)
            tensions.append(-data.actuator_force[MUSCLE])
    slope = (tensions[0] - tensions[1]) / 1e-6
    assert coefficients == [pytest.approx(0.25 * 1e-3 * slope, rel=1e-5)] * 3


def test_parameters_reach_the_model_exactly() -> None:
    """MJCF text keeps six digits; the compiled model must not."""
    built = build(load("scenario", "seated", {"supply.pressure": "3 bar"}))
    row = built.model.actuator_user[built.index.muscles["dorsiflexor_2"]]
    muscle = built.scenario.orthosis.muscle["dorsiflexor"].type
    assert row[slots.MUSCLE_ROW.b] == 1.0 / np.sin(muscle.braid_angle) ** 2
    assert row[slots.MUSCLE_ROW.nominal_length] == muscle.total_length - muscle.end_length
