"""Balances, limits and convergence of whole simulations."""

import mujoco
import numpy as np
import pytest
from air.reference import Edge, Fixed, Volume, network_reference
from mujoco.batch import Batch
from rig import charged, hanging_mass

import afo_sim
from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT
from afo_sim.description import load
from afo_sim.model import equilibrium, muscle_names
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.simulation import Recording

RUNS = ["seated", "antagonist"]
HEAVY_DAMPER = {
    f"orthosis.muscle.{role}.type.damping": "2e-3 m^2*s" for role in ("dorsiflexor", "plantarflexor")
}


@pytest.fixture(params=RUNS)
def recording(request: pytest.FixtureRequest) -> Recording:
    return request.getfixturevalue(request.param)


def muscles(recording: Recording) -> list[str]:
    return [c.split("/")[1] for c in recording.columns if c.startswith("muscle/") and c.endswith("/force")]


def test_orthosis_moment_is_force_times_arm(recording: Recording) -> None:
    total = sum(
        recording[f"muscle/{m}/force"] * recording[f"muscle/{m}/moment_arm"] for m in muscles(recording)
    )
    moment = recording["ankle/moment/orthosis"]
    assert np.abs(total - moment).max() <= 1e-9 * np.abs(moment).max()


def step_of(recording: Recording) -> float:
    """Its time step [s]; every step is a row."""
    step = float(recording["time"][1] - recording["time"][0])
    assert len(recording["time"]) == recording.timing["steps"]
    return step


def test_moment_arm_is_minus_path_length_by_angle(recording: Recording) -> None:
    """Recorded path over recorded angle from row to row, against the mean arm of the two rows."""
    turn = np.diff(recording["ankle/angle"])
    moving = np.abs(turn) > 5e-5
    assert moving.sum() > 500
    for name in muscles(recording):
        slope = np.diff(recording[f"muscle/{name}/path_length"])[moving] / turn[moving]
        arm = recording[f"muscle/{name}/moment_arm"]
        assert -slope == pytest.approx((0.5 * (arm[1:] + arm[:-1]))[moving], abs=2e-7)


def test_moments_accelerate_the_foot(recording: Recording) -> None:
    model = mujoco.MjModel.from_xml_string(recording.model_xml)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    inertia = data.M[0]
    total = sum(recording[f"ankle/moment/{part}"] for part in ("orthosis", "passive", "gravity"))
    scale = np.abs(recording["ankle/moment/orthosis"]).max()
    assert np.abs(inertia * recording["ankle/acceleration"] - total).max() <= 1e-6 * scale


@pytest.mark.slow
def test_row_is_the_state_before_its_step(recording: Recording) -> None:
    """Velocity is the angle's difference since the row before, and a muscle's that of its own length."""
    h = step_of(recording)
    angle, velocity = recording["ankle/angle"], recording["ankle/velocity"]
    assert angle[1:] - angle[:-1] == pytest.approx(h * velocity[1:], abs=1e-14)
    for name in muscles(recording):
        change = np.diff(recording[f"muscle/{name}/length"])
        assert change == pytest.approx(h * recording[f"muscle/{name}/velocity"][1:], abs=1e-14)


def test_air_in_less_air_out_is_air_stored(recording: Recording) -> None:
    h = step_of(recording)
    for chamber in ("dorsiflexor", "plantarflexor"):
        mass = recording[f"chamber/{chamber}/mass"]
        flow_in = recording[f"chamber/{chamber}/mass_flow_in"]
        flow_out = recording[f"chamber/{chamber}/mass_flow_out"]
        assert flow_in.min() >= 0.0
        assert flow_out.min() >= 0.0
        moved = h * np.sum(flow_in + flow_out)
        stored = h * np.cumsum(flow_in - flow_out)[:-1]
        assert np.abs(mass[1:] - mass[0] - stored).max() <= 1e-9 * moved + 1e-12 * mass[0]


def test_gas_law_and_volume(recording: Recording) -> None:
    """T from the columns, within what compressed air and a warm wall can do."""
    for chamber in ("dorsiflexor", "plantarflexor"):
        absolute = recording[f"chamber/{chamber}/pressure"] + AMBIENT_PRESSURE
        mass, volume = (recording[f"chamber/{chamber}/{x}"] for x in ("mass", "volume"))
        temperature = recording[f"chamber/{chamber}/temperature"]
        assert absolute * volume == pytest.approx(mass * GAS_CONSTANT * temperature, rel=1e-12)
        assert 230.0 < temperature.min() <= temperature.max() < 1.4 * AMBIENT_TEMPERATURE


def shortened(outlet: float) -> np.ndarray:
    """(pressure, outlet flow, air mass) of a muscle without air whose outlet is open or shut.

    It hangs stretched by its load and is let go: its braid draws it back to its nominal length.
    """
    model = hanging_mass(0.5, damper=0.0, return_stiffness=20.0)
    chamber, valve = model.actuator("chamber_air").id, model.actuator("valve_air_outlet").id
    rows = []
    with native.installed():
        data = charged(model, 0.0, shortening=-0.0045)
        native.write_valve(model, data.act, valve, outlet, outlet)
        data.ctrl[valve] = outlet
        for _ in range(500):
            data.qpos[0], data.qvel[0] = 0.0, 0.0  # the load is gone, the cable hangs through
            mujoco.mj_step(model, data)
            air = native.read_air(model, data.act, data.userdata, chamber)
            flow = native.read_flows(model, data.userdata, chamber).outlet
            rows.append((float(air.absolute_pressure) - AMBIENT_PRESSURE, float(flow), float(air.mass)))
    return np.array(rows)


def test_vented_muscle_that_shortens_breathes_in() -> None:
    """One-way flow through the outlet would draw the chamber below ambient pressure, and keep it there."""
    open_, shut = shortened(outlet=1.0), shortened(outlet=0.0)
    assert open_[:, 1].min() < 0.0
    assert open_[-1, 0] == pytest.approx(0.0, abs=100.0)
    assert open_[-1, 2] > 1.05 * open_[0, 2]
    assert shut[-1, 0] < -0.1e5
    assert np.ptp(shut[:, 2]) == 0.0 == np.abs(shut[:, 1]).max()


def test_muscles_only_pull(recording: Recording) -> None:
    for name in muscles(recording):
        assert recording[f"muscle/{name}/force"].min() >= 0.0


def rigid_fill(wall: float, timestep: float, duration: float) -> np.ndarray:
    """(time, mass, absolute pressure) of a rigid 130 ml chamber filled from 4 bar."""
    model = hanging_mass(1.0, muscles=0, tube_volume=130e-6, wall_conductance=wall, timestep=timestep)
    model.opt.gravity[:] = 0.0
    rows, chamber = [], model.actuator("chamber_air").id
    with native.installed():
        data = charged(model, 0.0)
        native.write_valve(model, data.act, model.actuator("valve_air_inlet").id, armature=1.0, opening=1.0)
        data.ctrl[chamber : chamber + 2] = 4e5, 1.0
        for _ in range(round(duration / timestep)):
            time, mass = data.time, float(data.act[model.actuator_actadr[chamber]])
            mujoco.mj_step(model, data)
            pressure = native.read_air(model, data.act, data.userdata, chamber).absolute_pressure
            rows.append((time, mass, float(pressure)))  # userdata is that of the step's start
    return np.array(rows)


def independent_fill(wall: float, times: np.ndarray) -> np.ndarray:
    """The same by the references' ISO 6358 and energy balance."""
    nodes = {"supply": Fixed(4e5 + AMBIENT_PRESSURE), "v": Volume(130e-6, wall=wall)}
    found = network_reference(nodes, [Edge("supply", "v", 5.5e-10, 0.3)], times)
    return np.column_stack([times, found.mass["v"], found.pressure["v"]])


@pytest.mark.parametrize("wall", [0.0, 0.5])
def test_rigid_chamber_fills_as_an_ode_solver_says(wall: float) -> None:
    errors = []
    for timestep in (4e-3, 2e-3):
        rows = rigid_fill(wall, timestep, 3.0)
        exact = independent_fill(wall, rows[:, 0])
        errors.append(np.abs(rows[:, 1:] / exact[:, 1:] - 1.0).max())
    assert errors[1] < 1e-6
    assert errors[0] / errors[1] > 3.5  # second order in the time step


def test_adiabatic_and_isothermal_fill_in_closed_form() -> None:
    """m = m0 + V (p − p0)/(γ R T0) without heat, m = p V/(R T0) with a perfect wall."""
    adiabatic = rigid_fill(0.0, 1e-3, 3.0)
    rise = (adiabatic[:, 2] - adiabatic[0, 2]) * 130e-6 / (1.4 * GAS_CONSTANT * AMBIENT_TEMPERATURE)
    assert adiabatic[:, 1] - adiabatic[0, 1] == pytest.approx(rise, rel=1e-9, abs=1e-12)
    isothermal = rigid_fill(20.0, 1e-4, 1.0)
    mass = isothermal[:, 2] * 130e-6 / (GAS_CONSTANT * AMBIENT_TEMPERATURE)
    assert isothermal[:, 1] == pytest.approx(mass, rel=5e-3)


def test_stiff_damper_slows_and_does_not_chatter() -> None:
    """R = 2e-3 m²s at 1 ms: an explicit step would change the force's sign at most samples."""
    heavy, light = (
        afo_sim.run("seated", {"duration": "4 s", **HEAVY_DAMPER}),
        afo_sim.run("seated", {"duration": "4 s"}),
    )
    assert heavy.metrics["rise_time"].value > light.metrics["rise_time"].value + 0.1
    force = heavy["muscle/dorsiflexor_1/force"]
    turns = np.sum(np.diff(np.sign(np.diff(force[force > 0.5]))) != 0)
    assert turns < 20


def test_batch_is_a_plain_loop_at_any_thread_count() -> None:
    """Bit for bit: 1 and 2 threads, and mj_step by hand; four supplies side by side."""
    built = build(load("scenario", "seated"))
    control = np.repeat(schedule.controls(built, 1500)[None], 4, axis=0)
    chambers = list(built.index.chambers.values())
    control[:, :, chambers] = np.array([2e5, 3e5, 4e5, 5e5])[:, None, None]
    with native.installed():
        state = equilibrium(built, control[0, 0])
        results = []
        for threads in (1, 2):
            batch = Batch(built.model, nsim=4, nthread=threads)
            batch.state[:] = state
            out = batch.rollout(1500, control, record=["qpos", "act"])
            results.append(np.concatenate([out["qpos"], out["act"]], axis=-1))
        data = mujoco.MjData(built.model)
        mujoco.mj_setState(built.model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        for row in control[2]:
            data.ctrl[:] = row
            mujoco.mj_step(built.model, data)
    assert np.array_equal(results[0], results[1])
    assert np.array_equal(results[0][2, -1], np.r_[data.qpos, data.act])
    assert len({*results[0][:, -1, 0].tolist()}) == 4


def test_fill_stays_at_rest_without_air() -> None:
    """From static equilibrium nothing moves until a valve opens."""
    run = afo_sim.run("seated", {"duration": "1 s", "timer": {"period": "8 s"}})
    assert np.abs(run["ankle/angle"] - run["ankle/angle"][0]).max() < 1e-10
    groups = muscle_names(build(load("scenario", "seated")).scenario.orthosis)
    assert all(run[f"muscle/{name}/force"].max() == 0.0 for name in groups)
