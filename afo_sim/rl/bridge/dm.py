"""dm_control's modules, or one sentence where it is missing: it has no wheel for Python 3.13."""

MISSING = (
    "dm_control is not installed, and its interface here needs it: pip install 'dm-control>=1.0.50,<2' "
    "(on Python 3.13 its part labmaze has no wheel: take Python 3.11 or 3.12)"
)

try:
    from dm_control import composer, mjcf, mujoco
    from dm_control.composer.observation import observable
    from dm_control.rl.control import PhysicsError
except ImportError as error:
    if (error.name or "").split(".")[0] not in ("dm_control", "labmaze", "dm_env"):
        raise
    raise ImportError(MISSING) from None

__all__ = ["PhysicsError", "composer", "mjcf", "mujoco", "observable"]
