"""The pin knee in MuJoCo, on the compiled muscle: its path, rigid anchors, and a cable of 12.9 kN/m."""

import mujoco
import numpy as np
import pytest

from afo_sim import native
from afo_sim.lab import FEMUR_ANCHOR, FITTINGS, PIN, TIBIA_ANCHOR, KneeTest, knee_tests
from afo_sim.lab.validation_knee import path, posture, torque

SOFT = 12.9e3  # fitted to the measured torques [N/m]
DEFAULT = 1e6  # of a muscle's cable [N/m]
VALVE = native.CircuitValve(5.5e-10, 0.3, 4e-3, 4e-3)
HELD = 1e12  # inertia that keeps a knee where it is put [kg·m²]
DURATION, TIMESTEP = 10.0, 1e-3  # [s]


def some(test: KneeTest, stiffness: float) -> list[int]:
    """Four of a test's points at which the muscle shortens and pulls."""
    tension = np.abs(torque(test, stiffness) / path(test.angle)[1])
    good = np.flatnonzero((posture(test)[0] > 0.01) & (tension > 20.0))
    return [int(k) for k in good[np.linspace(0, len(good) - 1, 4).astype(int)]]


def knees(test: KneeTest, points: list[int]) -> mujoco.MjSpec:
    """A knee for each point, side by side, each with a tendon along the muscle's path."""
    bodies, tendons = [], []
    for k in points:
        z = 0.2 * k
        femur, pin, tibia = (f'pos="{x} {y}' for x, y in (FEMUR_ANCHOR, PIN, TIBIA_ANCHOR))
        bodies.append(
            f'<site name="femur{k}" {femur} {z}"/><body {pin} {z}">'
            f'<joint name="{k}" axis="0 0 1" armature="{HELD}"/>'
            f'<geom size=".01" mass="1"/><site name="tibia{k}" {tibia} 0"/></body>'
        )
        tendons.append(f'<spatial name="{k}"><site site="femur{k}"/><site site="tibia{k}"/></spatial>')
    return mujoco.MjSpec.from_string(
        f'<mujoco><option timestep="{TIMESTEP}" integrator="implicitfast" gravity="0 0 0">'
        '<flag autoreset="disable" contact="disable"/></option>'
        f"<worldbody>{''.join(bodies)}</worldbody><tendon>{''.join(tendons)}</tendon></mujoco>"
    )


def held(test: KneeTest, points: list[int], **cable: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Tendon lengths [m], moment arms [m] and torques [N·m] of held knees whose muscles are filled."""
    spec = knees(test, points)
    names, ends = [str(k) for k in points], FITTINGS + test.tendon
    circuit = native.Circuit(
        tuple(native.CircuitMuscle(name, (name,), test.muscle.row, ends, name, **cable) for name in names),
        tuple(native.CircuitChamber(name, name, 4e-6, 0.5, VALVE, VALVE) for name in names),
    )
    native.add_circuit(spec, circuit)
    model = spec.compile()
    ids = native.fill_circuit(model, circuit)
    with native.installed():
        data = mujoco.MjData(model)
        data.qpos[:] = test.angle[points]
        native.fill_chambers(model, data, 0.0)
        for k, name in zip(points, names, strict=True):
            data.ctrl[ids.chambers[name]] = test.pressure[k]
            data.ctrl[ids.valves[f"{name}_inlet"]] = 1.0
        mujoco.mj_step(model, data, round(DURATION / TIMESTEP))
        mujoco.mj_forward(model, data)
    assert data.qpos == pytest.approx(test.angle[points], abs=1e-6)
    muscles = [ids.muscles[name] for name in names]
    arm = data.qfrc_actuator / data.actuator_force[muscles]
    return data.ten_length.copy(), arm, data.qfrc_actuator.copy()


@pytest.mark.parametrize("name", ["48", "46", "47", "40t", "41"])
@pytest.mark.parametrize(("stiffness", "cable"), [(DEFAULT, {}), (SOFT, {"cable_stiffness": SOFT})])
def test_a_muscle_on_its_cable_gives_the_torque_of_one_stiffness(
    name: str, stiffness: float, cable: dict[str, float]
) -> None:
    """The same equilibrium twice: by MuJoCo's steps to rest, and by a root."""
    test = knee_tests()[name]
    points = some(test, SOFT)
    length, arm, found = held(test, points, **cable)
    assert length == pytest.approx(path(test.angle)[0][points], abs=1e-6)
    assert arm == pytest.approx(path(test.angle)[1][points], abs=1e-6)
    assert found == pytest.approx(torque(test, stiffness)[points], rel=2e-4)
