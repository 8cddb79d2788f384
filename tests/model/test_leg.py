"""Friction and inertia about the ankle: Coulomb's law, and the moments over the inertia."""

import pathlib

import mujoco
import numpy as np
import pytest

import afo_sim
from afo_sim import native
from afo_sim.description import load
from afo_sim.model import Built, equilibrium, get_state
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.simulation import Recording, make_recording
from afo_sim.simulation.simulate import simulate

FRICTION = 0.005  # [N·m]
# The foot swings on its tissue alone: no damper, valves to the air, muscles slack about the angle of rest.
FREE = {
    "leg.damping": "0 N*m*s/rad",
    "duration": "5 s",
    "timer.dorsiflexor.inlet": [],
    "timer.dorsiflexor.outlet": [["0 s", "8 s"]],
}


def swing(displaced: float, **leg: str) -> tuple[Built, Recording, float]:
    """A foot let go `displaced` [rad] from its rest: (model, run, angle of rest)."""
    built = build(load("scenario", "seated", FREE | {f"leg.{key}": value for key, value in leg.items()}))
    control = schedule.controls(built)
    data = mujoco.MjData(built.model)
    with native.installed():
        rest = equilibrium(built, control[0])
        mujoco.mj_setState(built.model, data, rest, mujoco.mjtState.mjSTATE_INTEGRATION)
        angle = float(data.qpos[0])
        data.qpos[0] += displaced
        state = get_state(built.model, data)
    return built, make_recording(built, simulate(built, control, state=state)), angle


def stiffness(built: Built, rest: float) -> tuple[float, float]:
    """Slope of the ankle's moment about its rest [N·m/rad], and its inertia [kg·m²], from the engine."""
    data = mujoco.MjData(built.model)
    moments = []
    with native.installed():
        mujoco.mj_setState(
            built.model,
            data,
            equilibrium(built, schedule.controls(built, 1)[0]),
            mujoco.mjtState.mjSTATE_INTEGRATION,
        )
        for way in (-0.02, 0.02):
            data.qpos[0] = rest + way
            mujoco.mj_forward(built.model, data)
            moments.append(float(data.qfrc_smooth[0]))
    return (moments[0] - moments[1]) / 0.04, float(data.M[0])


def extremes(run: Recording, rest: float) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and heights above rest [rad] of the turning points."""
    velocity = run["ankle/velocity"]
    turns = np.flatnonzero(velocity[1:-1] * velocity[2:] < 0.0) + 2
    return run["time"][turns], run["ankle/angle"][turns] - rest


def test_coulomb_friction_takes_the_same_from_every_swing() -> None:
    """Amplitude falls by 4 f/k a swing, until the spring no longer overcomes the friction."""
    built, run, rest = swing(0.03, friction=f"{FRICTION} N*m")
    slope, _ = stiffness(built, rest)
    _, heights = extremes(run, rest)
    swings = np.abs(np.r_[0.03, heights])
    moving = swings[swings > 4.0 * FRICTION / slope]
    assert len(moving) > 3
    # from one side to the same side again: the tissue is stiffer on one
    assert moving[:-2] - moving[2:] == pytest.approx(4.0 * FRICTION / slope, rel=0.05)
    end = run["ankle/angle"][-1] - rest
    assert abs(end) <= 1.02 * FRICTION / slope
    assert np.ptp(run["ankle/angle"][-200:]) < 1e-6


def test_without_friction_it_goes_on_swinging() -> None:
    _, run, rest = swing(0.03)
    _, heights = extremes(run, rest)
    assert np.abs(heights[-1]) > 0.8 * 0.03


def test_friction_opposes_the_motion_with_its_full_size() -> None:
    """Against the same run's moments without it, at each state that the rubbed foot passes."""
    _, run, _ = swing(0.03, friction=f"{FRICTION} N*m")
    bare = build(load("scenario", "seated", FREE))
    data = mujoco.MjData(bare.model)
    moving = np.flatnonzero(np.abs(run["ankle/velocity"]) > 0.02)[::20]
    assert len(moving) > 5
    with native.installed():
        state = equilibrium(bare, schedule.controls(bare, 1)[0])
        mujoco.mj_setState(bare.model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        for k in moving:
            data.qpos[0], data.qvel[0] = run["ankle/angle"][k], run["ankle/velocity"][k]
            mujoco.mj_forward(bare.model, data)
            tissue = float(data.actuator_force[bare.index.passive])
            rub = run["ankle/moment/passive"][k] - tissue
            assert rub == pytest.approx(-FRICTION * np.sign(data.qvel[0]), rel=1e-6)


@pytest.mark.parametrize(("share", "moves"), [(0.9, False), (1.1, True)])
def test_static_friction_holds_up_to_its_size(share: float, moves: bool) -> None:
    built, _, rest = swing(0.0)
    slope, _ = stiffness(built, rest)
    displaced = 0.02
    _, run, _ = swing(displaced, friction=f"{slope * displaced / share!r} N*m")
    crept = np.abs(run["ankle/angle"] - rest - displaced).max()
    assert crept > 1e-4 if moves else crept < 1e-5


def test_inertia_adds_up_and_slows_the_swing_by_its_root() -> None:
    """T = 2π √((I + J)/k)."""
    inertias = []
    for added in ("0 kg*m^2", "0.01 kg*m^2"):
        built, run, rest = swing(0.01, inertia=added)
        slope, inertia = stiffness(built, rest)
        times, _ = extremes(run, rest)
        period = 2.0 * float(np.mean(np.diff(times)))
        assert period == pytest.approx(2.0 * np.pi * np.sqrt(inertia / slope), rel=0.01)
        inertias.append(inertia)
    assert inertias[1] - inertias[0] == pytest.approx(0.01, rel=1e-9)


def test_moments_accelerate_the_rubbed_and_heavier_foot() -> None:
    run = afo_sim.run("seated", {"leg.friction": "0.3 N*m", "leg.inertia": "5 g*m^2"})
    model = mujoco.MjModel.from_xml_string(run.model_xml)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    total = sum(run[f"ankle/moment/{part}"] for part in ("orthosis", "passive", "gravity"))
    scale = np.abs(run["ankle/moment/orthosis"]).max()
    assert np.abs(data.M[0] * run["ankle/acceleration"] - total).max() <= 1e-6 * scale


def test_the_files_own_friction_and_inertia_stay(tmp_path: pathlib.Path) -> None:
    text = load("leg", "adult_75kg").file.read_text(encoding="utf-8")
    file = tmp_path / "leg.xml"
    own = 'armature="0.01" frictionloss="0.1" name="ankle" type="hinge"'
    file.write_text(text.replace('name="ankle" type="hinge"', own), encoding="utf-8")
    sets = {"leg.file": str(file), "leg.inertia": "0.002 kg*m^2", "leg.friction": "0.2 N*m"}
    model = build(load("scenario", "seated", sets)).model
    assert model.dof_armature[0] == pytest.approx(0.012)
    assert model.dof_frictionloss[0] == pytest.approx(0.3)
