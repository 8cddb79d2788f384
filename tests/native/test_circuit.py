"""States by name, and the one builder of muscles, chambers and valves."""

import dataclasses

import mujoco
import numpy as np
import pytest
from rig import BRAID, LAW, hanging_mass, muscle_row
from scipy.optimize import brentq

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT, CallbackError
from afo_sim.native import slots
from afo_sim.physics import FRICTIONS, muscle_volume
from afo_sim.physics.law_volume import GEOMETRIC

ROW = muscle_row(return_stiffness=20.0)
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
            native.CircuitMuscle(name, (name,), ROW | {"friction": friction}, length, chamber)
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
    shape = BRAID.nominal_length, BRAID.nominal_radius, BRAID.b, 0.0
    return muscle_volume(contraction, 3e5, *shape, 1e-6, 0.0, 0.0, GEOMETRIC, 0)[0]


def test_names_are_all_places_once() -> None:
    """No state and no number of `userdata` is read for another."""
    model = hanging_mass(3.0, anchor=native.CircuitAnchor("top", stiffness=4e3))
    network, muscle, chamber, inlet, outlet = (
        model.actuator(n).id
        for n in ("network_air", "muscle", "chamber_air", "valve_air_inlet", "valve_air_outlet")
    )
    rows = model.actuator_user
    act = np.zeros(model.na)
    of_muscle = int(rows[muscle, slots.MUSCLE_ROW.state])
    act[of_muscle + slots.LEADER_ACT.contraction], act[of_muscle + slots.LEADER_ACT.carried] = 1.0, 2.0
    act[of_muscle + slots.LEADER_ACT.last_move] = 12.0
    of_anchor = int(rows[network, slots.NETWORK_ROW.state])
    act[of_anchor + slots.ANCHOR_ACT.displacement], act[of_anchor + slots.ANCHOR_ACT.last_move] = 3.0, 4.0
    native.write_air(model, act, chamber, native.Air(5.0, 6.0, 7.0))
    native.write_valve(model, act, inlet, 8.0, 9.0)
    native.write_valve(model, act, outlet, 10.0, 11.0)
    # a valve's coil and seat are what opened it
    assert sorted(act) == sorted([*map(float, range(1, 13)), *2 * (9.0, 11.0), 7.0 * 6.0**1.4])
    data = np.tile(np.arange(float(model.nuserdata)), (5, 1))
    air = native.read_air(model, np.tile(act, (5, 1)), data, chamber)
    assert air.mass.tolist() == [5.0] * 5
    own, flows = native.read_own(model, data, muscle), native.read_flows(model, data, chamber)
    yielding = native.read_anchor(model, data, network, 0)
    openings = [native.read_opening(model, data, valve) for valve in (inlet, outlet)]
    places = [*own, *flows, air.absolute_pressure, *yielding, *openings]
    assert len({float(place[0]) for place in places}) == len(places) == 11
    assert flows.volume.tolist() == air.volume.tolist()
    assert model.nuserdata == len(slots.CHAMBER_DATA) + len(slots.LEADER_DATA) + len(slots.ANCHOR_DATA)


def test_chambers_are_filled_with_the_gas_that_fits() -> None:
    """m = p V/(R T) with the volume of all its muscles, which rest at their own lengths."""
    model, ids = two_chambers()
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0163, 0.0, 0.008
    with native.installed():
        native.fill_chambers(model, data, {ids.chambers["left"]: 3e5})
        mujoco.mj_forward(model, data)
    length, area = BRAID.nominal_length, np.pi * BRAID.nominal_radius**2
    a, b = 3.0 * (BRAID.b - 1.0), BRAID.b

    def resting(path: float) -> float:
        """κ at which 3 bar pulls as much as a cable of 1 MN/m."""

        def left(kappa: float) -> float:
            law = 3e5 * area * (a * (1.0 - kappa) ** 2 - b) - LAW["bladder_force"]
            return law - LAW["bladder_stiffness"] * kappa - 1e6 * (path - length * (1.0 - kappa))

        return float(brentq(left, 0.0, 0.4, xtol=1e-15))

    # b: 1 cm of its tendon does not contract, so that its braid is shorter by as much
    contractions = {"a": resting(length - 0.0163), "b": resting(length - 0.01)}
    for name, expected in contractions.items():
        own = native.read_own(model, data.userdata, ids.muscles[name])
        assert own.contraction == pytest.approx(expected, abs=1e-12)
    # c has no air and hangs through: its bladder pushes it out to just beyond its nominal length
    own = native.read_own(model, data.userdata, ids.muscles["c"])
    assert -5e-4 < own.contraction < 0.0
    assert own.tension == 0.0
    volume = TUBE + volume_of(contractions["a"]) + volume_of(contractions["b"])
    air = native.read_air(model, data.act, data.userdata, ids.chambers["left"])
    assert air.volume == pytest.approx(volume, rel=1e-10)
    assert air.absolute_pressure == pytest.approx(3e5 + AMBIENT_PRESSURE, rel=1e-12)
    for name, gauge in (("left", 3e5), ("right", 0.0)):
        air = native.read_air(model, data.act, data.userdata, ids.chambers[name])
        mass = (gauge + AMBIENT_PRESSURE) * air.volume / (GAS_CONSTANT * AMBIENT_TEMPERATURE)
        assert air.mass == pytest.approx(mass, rel=1e-12)


def test_valve_fills_its_own_chamber_only() -> None:
    model, ids = two_chambers()
    with native.installed():
        data = mujoco.MjData(model)
        native.fill_chambers(model, data, 0.0)
        before, filled = data.act.copy(), data.userdata.copy()
        data.ctrl[list(ids.chambers.values())] = 4e5
        data.ctrl[ids.valves["right_inlet"]] = 1.0
        for _ in range(50):
            mujoco.mj_step(model, data)
    left, right = (
        native.read_air(model, data.act, data.userdata, ids.chambers[n]).mass for n in ("left", "right")
    )
    at_first = {n: native.read_air(model, before, filled, ids.chambers[n]).mass for n in ("left", "right")}
    assert right > 1.5 * at_first["right"]
    assert left == at_first["left"]
    flows = native.read_flows(model, data.userdata, ids.chambers["right"])
    assert flows.inlet > 0.0
    assert flows.outlet == 0.0
    assert native.read_opening(model, data.userdata, ids.valves["right_inlet"]) == 1.0
    assert native.read_opening(model, data.userdata, ids.valves["left_inlet"]) == 0.0


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


def test_chambers_whose_muscles_share_anchors_are_one_network() -> None:
    def circuit(*anchors: tuple[str, ...]) -> native.Circuit:
        chambers = tuple(
            native.CircuitChamber(f"{k}", "slide", TUBE, 0.5, VALVE, VALVE) for k in range(len(anchors))
        )
        muscles = tuple(
            native.CircuitMuscle(f"m{k}", (f"m{k}",), ROW, 0.0, f"{k}", anchors=names)
            for k, names in enumerate(anchors)
        )
        known = tuple(native.CircuitAnchor(name, 4e3) for name in ("cuff", "plate"))
        return native.Circuit(muscles, chambers, known)

    both = ("cuff", "plate")
    assert [n.chambers for n in circuit((), ()).networks()] == [("0",), ("1",)]
    assert [n.chambers for n in circuit(both, both).networks()] == [("0", "1")]
    assert [n.chambers for n in circuit(("cuff",), (), ("plate",)).networks()] == [("0",), ("1",), ("2",)]
    with pytest.raises(ValueError, match="anchor is shared"):
        circuit(both, ("cuff",)).networks()
    one_chamber = circuit(both, ())
    muscles = tuple(dataclasses.replace(muscle, chamber="0") for muscle in one_chamber.muscles)
    with pytest.raises(ValueError, match="pull on different anchors"):
        dataclasses.replace(one_chamber, muscles=muscles).networks()


def test_a_row_that_lacks_a_number_or_has_a_strange_one_is_refused() -> None:
    full = {"gain": 1.0}
    assert native.row(slots.Kind.SPASTIC, **full)[slots.FIRST :].max() == 1.0
    with pytest.raises(TypeError, match="lacks gain"):
        native.row(slots.Kind.SPASTIC)
    with pytest.raises(KeyError, match="gian"):
        native.row(slots.Kind.SPASTIC, gian=1.0, **full)
