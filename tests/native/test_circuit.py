"""States by name, and the one builder of muscles, chambers and valves."""

import mujoco
import numpy as np
import pytest
from rig import BRAID, LAW, hanging_mass

from afo_sim import native
from afo_sim.common.errors import CallbackError
from afo_sim.common.units import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT
from afo_sim.native import state
from afo_sim.physics.friction import FRICTIONS
from afo_sim.physics.laws import LAWS
from afo_sim.physics.pneumatics import muscle_volume

ROW = {
    "law": "tondu_lopez_2000_bladder",
    "coefficients": LAWS["tondu_lopez_2000_bladder"].coefficients(BRAID, LAW),
    "lowest_pressure": 0.0,
    "braid": BRAID,
    "damping": 2e-4,
    "braid_stiffness": 2e4,
    "dead_volume": 1e-6,
}
VALVE = native.CircuitValve(5.5e-10, 0.3, 4e-3, 4e-3)
TUBE = 4e-6


def two_chambers(friction: int = 0) -> tuple[mujoco.MjModel, native.CircuitIds]:
    """Muscles a and b on chamber "left", c on chamber "right", on slides of their own."""
    bodies = "".join(
        f'<site name="top{n}" pos="0 0 0.1631"/><body><joint name="slide{n}" type="slide" axis="0 0 1"/>'
        f'<geom size=".01" mass="2"/><site name="hook{n}"/></body>'
        for n in "abc"
    )
    tendons = "".join(
        f'<spatial name="{n}"><site site="top{n}"/><site site="hook{n}"/></spatial>' for n in "abc"
    )
    spec = mujoco.MjSpec.from_string(
        '<mujoco><option integrator="implicitfast"><flag contact="disable"/></option>'
        f"<worldbody>{bodies}</worldbody><tendon>{tendons}</tendon></mujoco>"
    )
    circuit = native.Circuit(
        tuple(
            native.CircuitMuscle(name, ROW | {"friction": friction}, length, chamber)
            for name, chamber, length in (("a", "left", 0.0), ("b", "left", 0.01), ("c", "right", 0.0))
        ),
        tuple(
            native.CircuitChamber(name, joint, TUBE, 0.5, VALVE, VALVE)
            for name, joint in (("left", "slidea"), ("right", "slidec"))
        ),
    )
    native.add_circuit(spec, circuit)
    model = spec.compile()
    return model, native.fill_circuit(model, circuit)


def volume_of(contraction: float) -> float:
    return muscle_volume(contraction, BRAID.nominal_length, BRAID.nominal_radius, BRAID.b, 1e-6)[0]


def test_names_are_all_places_once() -> None:
    model = hanging_mass(3.0)
    chamber, inlet, outlet = (
        model.actuator(n).id for n in ("chamber_air", "valve_air_inlet", "valve_air_outlet")
    )
    act = np.zeros(model.na)
    native.write_air(model, act, chamber, native.Air(1.0, 2.0, 3.0))
    native.write_valve(model, act, inlet, 4.0, 5.0)
    native.write_valve(model, act, outlet, 6.0, 7.0)
    assert sorted(act) == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]
    assert native.read_air(model, np.tile(act, (5, 1)), chamber).absolute_pressure.tolist() == [3.0] * 5
    assert native.read_opening(model, act, outlet) == 7.0
    assert model.nuserdata == state.FLOWS_PER_CHAMBER
    assert native.read_flows(model, np.arange(3.0), chamber) == (0.0, 1.0, 2.0)


def test_chambers_are_filled_with_the_gas_that_fits() -> None:
    """m = p V/(R T) with the volume of all its muscles, where they stand."""
    model, ids = two_chambers()
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0163, 0.0, 0.008
    with native.installed():
        native.fill_chambers(model, data, {ids.chambers["left"]: 3e5})
    expected = {
        # b: 1 cm of its tendon does not contract, so that its braid is shorter by as much
        "left": (3e5, TUBE + volume_of(0.0163 / 0.1631) + volume_of(0.01 / 0.1631)),
        "right": (0.0, TUBE + volume_of(0.008 / 0.1631)),
    }
    for name, (gauge, volume) in expected.items():
        air = native.read_air(model, data.act, ids.chambers[name])
        assert air.volume == pytest.approx(volume, rel=1e-12)
        assert air.absolute_pressure == gauge + AMBIENT_PRESSURE
        mass = (gauge + AMBIENT_PRESSURE) * volume / (GAS_CONSTANT * AMBIENT_TEMPERATURE)
        assert air.mass == pytest.approx(mass, rel=1e-12)


def test_valve_fills_its_own_chamber_only() -> None:
    model, ids = two_chambers()
    with native.installed():
        data = mujoco.MjData(model)
        native.fill_chambers(model, data, 0.0)
        before = data.act.copy()
        data.ctrl[list(ids.chambers.values())] = 4e5
        data.ctrl[ids.valves["right_inlet"]] = 1.0
        for _ in range(50):
            mujoco.mj_step(model, data)
    left, right = (native.read_air(model, data.act, ids.chambers[n]) for n in ("left", "right"))
    assert right.mass > 1.5 * native.read_air(model, before, ids.chambers["right"]).mass
    assert left.mass == native.read_air(model, before, ids.chambers["left"]).mass
    flows = native.read_flows(model, data.userdata, ids.chambers["right"])
    assert flows.inlet > 0.0
    assert flows.outlet == 0.0
    assert native.read_opening(model, data.act, ids.valves["right_inlet"]) == 1.0
    assert native.read_opening(model, data.act, ids.valves["left_inlet"]) == 0.0


@pytest.mark.parametrize("name", FRICTIONS)
def test_friction_that_remembers_has_states_of_its_own(name: str) -> None:
    friction = FRICTIONS[name]
    model, ids = two_chambers(friction=friction.native_id)
    assert set(ids.frictions) == (set("abc") if friction.n_state else set())
    for muscle, holder in ids.frictions.items():
        assert model.actuator_actnum[holder] == friction.n_state
        assert model.actuator(holder).name == f"friction_{muscle}"
    native.assert_rows(model)


def test_limp_muscles_are_refused() -> None:
    model, ids = two_chambers()
    row = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION))
    data = mujoco.MjData(model)
    with native.installed():
        native.fill_chambers(model, data, 0.0)
        mujoco.mj_getState(model, data, row, mujoco.mjtState.mjSTATE_INTEGRATION)
        native.assert_muscles_pull(model, row)
        model.actuator_biastype[ids.muscles["b"]] = mujoco.mjtBias.mjBIAS_NONE
        with pytest.raises(CallbackError, match="carries"):
            native.assert_muscles_pull(model, row)
