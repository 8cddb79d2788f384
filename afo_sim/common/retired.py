"""Names of the library, its rooms and commands that are no more, and what to use instead."""

from typing import NoReturn

from afo_sim.common.errors import InputError

_ATTACH = "afo_sim.attach, which puts an orthosis on any MuJoCo model or MjSpec"
RETIRED = {
    "bode": "a sweep over the frequency of the controller's reference",
    "pressure_map": "`afo-sim torque-map`; an impedance is a controller of a few lines, docs/controllers.md",
    "OrthosisEntity": _ATTACH,
    "LegEntity": _ATTACH,
    "OrthosisVecEnv": "stable_baselines3's own DummyVecEnv or SubprocVecEnv around gymnasium.make",
    "dropfoot_day": "dropfoot_walk, with `sets` for other patients",
}


def refuse_retired(name: str) -> NoReturn:
    """A module's `__getattr__`: InputError of a retired name, AttributeError of any other."""
    if name not in RETIRED:
        raise AttributeError(name)
    raise InputError("is retired", field=name, allowed=RETIRED[name])
