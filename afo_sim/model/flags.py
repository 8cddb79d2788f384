"""Flags of MuJoCo that spare a step the search for what a model does not have."""

import mujoco


def unused(model: mujoco.MjModel) -> int:
    """Bits of `disableflags` that change no number of a compiled model, which has nothing of their kind.

    They belong to the compiled model alone. A spring that somebody adds to a saved model is to act.
    """
    bits = mujoco.mjtDisableBit
    friction = (model.dof_frictionloss, model.tendon_frictionloss)
    springs = (
        model.jnt_stiffness,
        model.jnt_stiffnesspoly,
        model.tendon_stiffness,
        model.tendon_stiffnesspoly,
        model.flex_stiffness,
        model.flex_edgestiffness,
    )
    parts = {
        bits.mjDSBL_FRICTIONLOSS: friction,
        bits.mjDSBL_SPRING: springs,
        bits.mjDSBL_CLAMPCTRL: (model.actuator_ctrllimited,),
    }
    return sum(int(bit) for bit, arrays in parts.items() if not any(array.any() for array in arrays))
