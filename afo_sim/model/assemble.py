"""Description → MjSpec → MjModel: leg, orthosis, circuit and walking put together, without parameters."""

import mujoco

from afo_sim import native
from afo_sim.common.errors import InputError
from afo_sim.common.units import GRAVITY
from afo_sim.description.scenario import Scenario
from afo_sim.model.flags import unused
from afo_sim.model.leg import attach_parts
from afo_sim.model.mirror import mirror_shapes, orthosis_mirrored
from afo_sim.model.mounting import ANKLE
from afo_sim.model.person import Size
from afo_sim.model.tendons import add_tendons
from afo_sim.model.walk_bodies import add_walking

PASSIVE = "passive_ankle"


def assemble(spec: mujoco.MjSpec, scenario: Scenario, circuit: native.Circuit, size: Size) -> mujoco.MjSpec:
    """The orthosis on the leg, its circuit, and walking: everything that is compiled."""
    anchors = attach_parts(spec, scenario)
    add_tendons(spec, anchors, scenario.orthosis)
    if orthosis_mirrored(scenario):
        for body in anchors.values():
            mirror_shapes(body)
    native.add_muscles(spec, circuit)
    _add_passive_ankle(spec)
    native.add_chambers(spec, circuit)
    if scenario.walking:
        add_walking(spec, scenario, size)
    option = spec.option
    option.timestep = scenario.timestep
    option.gravity = [0.0, 0.0, -GRAVITY]
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    # an unstable simulation must stop, not start again from zero
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    return spec


def compiled(spec: mujoco.MjSpec, scenario: Scenario) -> mujoco.MjModel:
    """A spec's model, without parameters, which looks for contacts only where geoms may touch."""
    try:
        model = spec.compile()
    except ValueError as error:
        raise InputError(f"MuJoCo cannot compile it: {error}", file=scenario.leg.file) from None
    if not collides(model):
        # on the spec too, so that the saved model is the one that ran
        for option in (model.opt, spec.option):
            option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    model.opt.disableflags |= unused(model)
    return model


def collides(model: mujoco.MjModel) -> bool:
    """Whether any two geoms may touch; where none may, no step needs to look for contacts."""
    able = model.geom_contype[:, None] & model.geom_conaffinity[None, :]
    return bool(able.any()) or model.npair > 0


def _add_passive_ankle(spec: mujoco.MjSpec) -> None:
    spec.add_actuator(
        name=PASSIVE,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        target=ANKLE,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        gainprm=[0.0] * 10,
        biastype=mujoco.mjtBias.mjBIAS_USER,
        userdata=[0.0] * native.N_USER,
    )
