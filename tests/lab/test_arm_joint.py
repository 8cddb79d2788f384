"""A joint between two muscles: against formulas, itself, the compiled rig, and a measured arm."""

import pathlib
from typing import Any

import mujoco
import numpy as np
import pytest
from benches import BENCHES, SCRIPT, needed
from scipy.optimize import brentq

from afo_sim import native
from afo_sim.common import (
    AMBIENT_PRESSURE,
    AMBIENT_TEMPERATURE,
    GAS_CONSTANT,
    HEAT_CAPACITY_RATIO,
    InputError,
)
from afo_sim.description import load
from afo_sim.lab import arm_joint, bench_sets
from afo_sim.lab.arm_joint import AHEAD, Arm, windows
from afo_sim.lab.bench_log import read_bench_log
from afo_sim.physics import laminar_slope

SIDES = ("pressure [Pa]", "extensor [Pa]")
FACTS = {"muscle": "dmsp_20", "total_length": "100 cm", "radius": "37.1 mm"}
KNOWN = {"inertia": 0.12, "damping": 0.6, "cable_friction": 0.25, "contraction": 0.03, "imbalance": -0.004}
NUMBERS = np.array([*KNOWN.values()])


def log(episodes: int = 6, samples: int = 121, seed: int = 0, **more: Any) -> Any:
    """Episodes at 100 Hz with a second between, random smooth pressures; the joint rests at zero."""
    rng, n = np.random.default_rng(seed), episodes * samples
    time = np.concatenate([k * (0.01 * samples + 1.0) + 0.01 * np.arange(samples) for k in range(episodes)])
    knots = np.linspace(0.0, 0.01 * samples * episodes, 6 * episodes)
    sides = [np.interp(0.01 * np.arange(n), knots, rng.uniform(1.2e5, 3.6e5, len(knots))) for _ in range(2)]
    columns = {"time [s]": time, "pressure [Pa]": sides[0], "extensor [Pa]": sides[1]}
    return read_bench_log(
        columns | {"angle [rad]": 0.0 * time, "velocity [rad/s]": 0.0 * time} | FACTS | more
    )


def swung(read: Any, numbers: np.ndarray = NUMBERS) -> Any:
    """The log with the angles of a joint that has these numbers, and its velocities."""
    samples = int(np.argmax(np.diff(read.time) > 0.5)) + 1
    rows = {k: c.reshape(-1, samples) for k, c in read.columns.items()}
    whole = pytest.MonkeyPatch()
    whole.setattr(arm_joint, "AHEAD", samples - 1)
    angle = Arm([read]).swing(numbers, [rows])[..., 0]
    whole.undo()
    velocity = np.diff(angle, axis=1, prepend=angle[:, :1]) / 0.01
    read.columns.update(angle=angle.ravel(), velocity=velocity.ravel())
    return read


def test_a_joint_rests_where_the_torques_balance() -> None:
    """F(p_f, κ0 + δ + r q/L) = F(p_e, κ0 − δ − r q/L), without friction."""
    read, muscle = log(episodes=1, samples=60), load("muscle", "dmsp_20")
    read.columns.update({"pressure": np.full(60, 3e5), "extensor": np.full(60, 1.5e5)})

    def torque(q: float) -> float:
        kappa = 0.03 + np.array([1.0, -1.0]) * (-0.004 + 0.0371 * q)
        pull = muscle.force(np.array([3e5, 1.5e5]), contraction=kappa)
        return float(pull[0] - pull[1])

    rest = brentq(torque, -1.0, 2.0)
    for start, nearer in ((rest, 1e-3), (rest + 0.1, 0.05), (rest - 0.1, 0.05)):
        read.columns["angle"][:] = start
        told = {name: column[None, : AHEAD + 1] for name, column in read.columns.items()}
        assert Arm([read]).swing(NUMBERS * [0.1, 1, 0, 1, 1], [told])[0, -1, 0] == pytest.approx(
            rest, abs=nearer
        )


def test_friction_of_cables_holds_what_it_can() -> None:
    """Held while F_f/F_e < e^(2 μβ), whatever the tensions."""
    read, muscle = log(episodes=1, samples=60), load("muscle", "dmsp_20")
    told = {name: column[None, : AHEAD + 1].copy() for name, column in read.columns.items()}
    for level in (1.5e5, 3e5):
        pulls = muscle.force(np.array([level, 1.3 * level]), contraction=0.03)
        told["extensor"][:], told["pressure"][:] = level, 1.3 * level
        holds = 0.5 * np.log(pulls[1] / pulls[0])
        for share, moved in ((1.02, False), (0.98, True)):
            numbers = np.array([0.01, 0.1, share * holds, 0.03, 0.0])
            assert (Arm([read]).swing(numbers, [told])[0, -1, 0] > 1e-4) == moved


def test_nothing_of_the_angle_but_its_start_is_told() -> None:
    read = swung(log())
    before = Arm([read]).swing(NUMBERS, [windows(read, 1)])
    told = windows(read, 1)
    told["angle"][:, 1:], told["velocity"][:, 1:] = 7.0, -3.0
    assert (Arm([read]).swing(NUMBERS, [told]) == before).all()
    told["angle"][:, 0] += 0.1
    assert (Arm([read]).swing(NUMBERS, [told]) != before).any()


def test_windows_lie_in_every_second_episode() -> None:
    read = log(episodes=5, samples=121)
    for half, episodes in ((0, 3), (1, 2)):
        told = windows(read, half)
        assert told["time"].shape == (8 * episodes, AHEAD + 1)  # starts at 0 to 0.7 s
        assert np.ptp(told["time"], axis=1) == pytest.approx(0.5)
    assert not set(windows(read, 0)["time"].ravel()) & set(windows(read, 1)["time"].ravel())


def test_an_arm_with_known_numbers_is_found() -> None:
    read = swung(log(episodes=16))
    found = dict(zip(KNOWN, Arm([read]).fit([windows(read, 0)]), strict=True))
    assert found == pytest.approx(KNOWN, rel=0.1, abs=2e-3)


def test_a_log_that_lacks_what_a_joint_needs_is_refused() -> None:
    read = read_bench_log({"time [s]": np.arange(20.0), "pressure [Pa]": np.ones(20)} | FACTS)
    with pytest.raises(InputError, match="angle, extensor, velocity"):
        next(arm_joint.joints([read]))


def rig(read: Any, told: dict[str, np.ndarray], numbers: dict[str, float]) -> np.ndarray:
    """Angles at the end of windows by the compiled muscles and chambers: two tendons around a pulley.

    A cable turns by 1 rad at a guide before it reaches the pulley. A regulator keeps each chamber's pressure,
    one step late, which is short: half a millisecond at 1 MPa/s are some 4 mrad.
    """
    step, radius, length = 1e-4, read.bench["radius"], read.bench["total_length"]
    muscle, spec = load("muscle", "dmsp_20", {"total_length": f"{length} m"}), mujoco.MjSpec()
    spec.option.timestep, spec.option.gravity = step, [0.0, 0.0, 0.0]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    body = spec.worldbody.add_body(name="body", mass=1e-3, inertia=[1e-9] * 3, explicitinertial=True)
    hinge = {"name": "hinge", "axis": [0.0, 1.0, 0.0], "armature": numbers["inertia"]}
    damping = (
        numbers["damping"] if np.isscalar(body.add_joint(**hinge).damping) else [numbers["damping"], 0, 0]
    )
    spec.joint("hinge").damping = damping
    cylinder = mujoco.mjtGeom.mjGEOM_CYLINDER
    drum = {"type": cylinder, "fromto": [0, -0.01, 0, 0, 0.01, 0], "size": [radius, 0, 0], "mass": 0.0}
    body.add_geom(name="drum", contype=0, conaffinity=0, **drum)
    body.add_site(name="end", pos=[1.0001 * radius, 0.0, 0.0])
    room, ends, chambers = 2e-4, [], []
    smallest = room + float(muscle.volume(contraction=0.0))
    slope = HEAT_CAPACITY_RATIO * GAS_CONSTANT * AMBIENT_TEMPERATURE / smallest * laminar_slope(1.0, 0.3)
    valve = native.CircuitValve(0.6 / step / slope, 0.3)
    for name, z, side in (("flexor", -radius, 1.0), ("extensor", radius, -1.0)):
        guide = np.array([-0.3, 0.0, z])
        spec.worldbody.add_site(name=f"{name} guide", pos=guide)
        spec.worldbody.add_site(
            name=f"{name} origin", pos=guide - 0.5 * np.array([np.cos(1.0), np.sin(1.0), 0.0])
        )
        spec.worldbody.add_site(name=f"{name} side", pos=[radius, 0.0, 3.0 * z])
        tendon = spec.add_tendon(name=name)
        for site in ("origin", "guide"):
            tendon.wrap_site(f"{name} {site}")
        tendon.wrap_geom("drum", f"{name} side")
        tendon.wrap_site("end")
        kappa = numbers["contraction"] + side * numbers["imbalance"]
        series = 0.8 + 0.5 * np.pi * radius - muscle.nominal_length * (1.0 - kappa)
        ends.append(
            native.CircuitMuscle(
                name, (name,), muscle.row, series, f"air {name}", 1e7, (), numbers["cable_friction"]
            )
        )
        chambers.append(native.CircuitChamber(f"air {name}", "hinge", room, 1e3, valve, valve))
    circuit = native.Circuit(tuple(ends), tuple(chambers))
    native.add_circuit(spec, circuit)
    model = spec.compile()
    ids = native.fill_circuit(model, circuit)
    native.fill_inverse_masses(model)
    places = [ids.chambers[f"air {name}"] for name in ("flexor", "extensor")]
    inlets = [ids.valves[f"air {name}_inlet"] for name in ("flexor", "extensor")]
    found = []
    with native.installed():
        for k in range(len(told["time"])):
            data, clock = mujoco.MjData(model), told["time"][k] - told["time"][k, 0]
            gauges = [told[name][k] for name in ("pressure", "extensor")]
            data.qpos[0], data.qvel[0] = told["angle"][k, 0], told["velocity"][k, 0]
            native.fill_chambers(model, data, {c: float(g[0]) for c, g in zip(places, gauges, strict=True)})
            for inlet in inlets:
                native.write_valve(model, data.act, inlet, 1.0, 1.0)
                data.ctrl[inlet] = 1.0
            for n in range(round(clock[-1] / step)):
                for place, gauge in zip(places, gauges, strict=True):
                    data.ctrl[place] = np.interp((n + 1) * step, clock, gauge)
                mujoco.mj_step(model, data)
            found.append(data.qpos[0])
    return np.array(found)


@pytest.mark.slow
def test_the_compiled_muscles_say_the_same() -> None:
    """Within 1 % of the spread, friction of cables and all."""
    read = swung(log(episodes=8))
    told = windows(read, 0)
    some = {name: column[::4] for name, column in told.items()}
    expected = Arm([read]).swing(NUMBERS, [some])[:, -1, 0]
    error = rig(read, some, KNOWN) - expected
    assert np.sqrt(np.mean(error**2)) < 0.01 * told["angle"][:, -1].std()


def test_a_link_makes_a_double_pendulum() -> None:
    """Without air, friction and muscles' damping it is MuJoCo's, with a point mass beyond the link."""
    read, steps = [log(episodes=1, samples=60, **more) for more in ({}, {"link": "40 cm"})], 500
    inertia, far, start = (0.15, 0.05), 0.25, np.array([[-0.6, 0.9], [2.0, -4.0]])
    for each, angle, velocity in zip(read, *start, strict=True):
        empty = np.full(60, -AMBIENT_PRESSURE)
        each.columns.update(
            pressure=empty, extensor=empty, angle=0 * empty + angle, velocity=0 * empty + velocity
        )
    told = [{name: column[None, : AHEAD + 1] for name, column in each.columns.items()} for each in read]
    numbers = np.array([*inertia, 0.0, 0.0, 0.0, 0.0, 0.3, 0.3, 0.0, 0.0, far])
    found = Arm(read).swing(numbers, told)[0, -1]
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.integrator = 0.5 / steps, mujoco.mjtIntegrator.mjINT_RK4
    tiny = {"mass": 1e-9, "inertia": [1e-12] * 3, "explicitinertial": True}
    mass = inertia[1] / far**2
    upper = spec.worldbody.add_body(name="upper", **tiny)
    lower = upper.add_body(name="lower", pos=[0, 0, 0.4], **(tiny | {"mass": mass, "ipos": [0, 0, far]}))
    for body, armature in ((upper, inertia[0]), (lower, 0.0)):
        body.add_joint(axis=[0.0, 1.0, 0.0], armature=armature)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = start
    for _ in range(steps):
        mujoco.mj_step(model, data)
    assert found == pytest.approx(data.qpos, abs=5e-3) and np.abs(found - start[0]).max() > 0.5


@needed
@pytest.mark.slow
def test_joints_of_a_measured_arm_are_told_better_than_by_a_linear_model(tmp_path: pathlib.Path) -> None:
    """PAMY (ALRhub/action-conditional-rkn, MIT): all four joints; with swapped muscles the angle is lost."""
    found = [SCRIPT.arm_joint(BENCHES, joint) for joint in range(4)]
    (folder := tmp_path / "pamy_acrkn").mkdir()
    for joint, each in enumerate(found):
        SCRIPT.write(each, folder / f"{joint + 1}.csv")
    rows = list(bench_sets.bench(tmp_path))
    assert [row.verdict for row in rows] == ["agrees"] * 4
    assert ["at a bound" in row.fitted[1] for row in rows] == [
        False,
        False,
        False,
        True,
    ]  # the wrist's cables
    assert all(row.held_out[1] < row.simpler < row.as_given for row in rows[:3])
    for joint in (0, 3):
        sides = {name: found[joint][other] for name, other in zip(SIDES, SIDES[::-1], strict=True)}
        (swapped,) = arm_joint.joints([read_bench_log({**found[joint], **sides})])
        assert swapped.held > swapped.linear
