"""The state that a simulation starts from: at rest, or in the middle of walking."""

from collections.abc import Callable, Mapping

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, InputError
from afo_sim.description import Scenario
from afo_sim.model.build import Built
from afo_sim.model.prefill import ambient_mass, held_mass, prefill
from afo_sim.model.supply_and_timer import controls
from afo_sim.model.walk import JOINTS
from afo_sim.model.walk_bodies import SINK
from afo_sim.physics import gas_mass, root


def equilibrium(built: Built, control: np.ndarray) -> np.ndarray:
    """The state at rest: chambers at ambient pressure, valves shut, the ankle's moments in balance."""
    model, index = built.model, built.index
    data = native.scratch(model)
    data.ctrl[:] = control

    def imbalance(angle: float) -> float:
        data.qpos[index.ankle_qpos] = angle
        native.fill_chambers(model, data, 0.0)
        mujoco.mj_forward(model, data)
        return float(data.qacc[index.ankle_dof])

    if imbalance(0.0) == 0.0:  # also of muscles that all hang through: nothing moves them
        _take_from_source(built, data)
        return get_state(model, data)
    lower, upper = model.joint(int(np.flatnonzero(model.jnt_qposadr == index.ankle_qpos)[0])).range
    if imbalance(lower) * imbalance(upper) > 0.0:
        raise InputError("the ankle has no rest position between its stops", field="orthosis")
    data.qpos[index.ankle_qpos] = root(imbalance, lower, upper, 1e-14)
    native.fill_chambers(model, data, 0.0)
    _take_from_source(built, data)
    return get_state(model, data)


SAME_AIR = 1e-9  # relative difference of masses that rounding makes [-]
Guess = Callable[[Built, mujoco.MjData], Mapping[int, float]]  # gauge pressures [Pa] by actuator


def walking_start(built: Built, control: np.ndarray, air: Guess | None = None) -> np.ndarray:
    """The state at the first step of recorded walking: pose, velocity, air."""
    model, ankle, toes = built.model, built.index.ankle_dof, built.scenario.leg.toes
    data = _at_first_posture(built)
    data.ctrl[:] = control
    if air is None:
        prefill(built, data)
        _take_from_source(built, data)
    else:
        native.fill_chambers(model, data, air(built, data))
    native.step_back(model, data)
    mujoco.mj_forward(model, data)
    joints = [*([] if toes is None else [toes.joint]), *([] if built.contact is None else [SINK])]
    turning = [ankle, *(built.index.joints[name][1] for name in joints)]
    data.qvel[turning] -= 0.5 * model.opt.timestep * data.qacc[turning]
    data.ctrl[:] = 0.0
    return get_state(model, data)


def _at_first_posture(built: Built) -> mujoco.MjData:
    """Pose and velocity of recorded walking at its first step; the callbacks must be installed."""
    assert built.walk is not None
    data, ankle = native.scratch(built.model), built.index.ankle_dof
    place, velocity, ankle_velocity = built.walk.start()
    places, joints = np.array([built.index.joints[name] for name in JOINTS]).T
    data.qpos[[*places, built.index.ankle_qpos]] = place
    data.qvel[joints], data.qvel[ankle] = velocity, ankle_velocity
    toe, toes = built.walk.toe, built.scenario.leg.toes
    if toe is not None and toes is not None:
        at, dof = built.index.joints[toes.joint]
        data.qpos[at], data.qvel[dof] = toe[1], (toe[2] - toe[0]) / (2.0 * built.walk.timestep)
    return data


def fills(scenario: Scenario) -> bool:
    """Whether air is filled before the first step: into chambers, volumes, or behind a regulator."""
    return bool(scenario.start is not None or scenario.orthosis.volume or scenario.supply.regulator)


def _take_from_source(built: Built, data: mujoco.MjData) -> None:
    """Take what volumes and chambers hold beyond ambient air out of bottle or cartridge."""
    stores, source = built.index.stores, built.scenario.supply.source
    if not stores or source is None:
        return
    empty = mujoco.MjData(built.model)  # `data` may be the scratch one
    empty.qpos[:] = data.qpos
    taken = held_mass(built, data.act) - ambient_mass(built, empty)
    least = gas_mass(source.real_gas, source.volume, AMBIENT_PRESSURE)
    for store in stores.values():
        native.write_content(built.model, data.act, store, max(source.full_mass - max(taken, 0.0), least))


def content_at_start(built: Built) -> float:
    """Gas and liquid in the bottle or cartridge as the walk from a stop begins [kg]."""
    with native.installed(built.scenario.callback):
        data = _at_first_posture(built)
        data.ctrl[:] = controls(built, 1)[0]
        prefill(built, data)
        _take_from_source(built, data)
    store = next(iter(built.index.stores.values()))
    return float(native.read_content(built.model, data.act, store))


def air_before(built: Built, act: np.ndarray) -> float:
    """Air that was filled before the first step, beyond ambient air in chambers and volumes [kg]."""
    with native.installed(built.scenario.callback):
        held, empty = held_mass(built, act), ambient_mass(built, _at_first_posture(built))
    return held - empty if held > empty * (1.0 + SAME_AIR) else 0.0


def get_state(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """The mjSTATE_INTEGRATION row of an MjData."""
    spec = mujoco.mjtState.mjSTATE_INTEGRATION
    row = np.empty(mujoco.mj_stateSize(model, spec))
    mujoco.mj_getState(model, data, row, spec)
    return row
