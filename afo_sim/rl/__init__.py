"""The simulation behind other libraries' interfaces: dm_control, Gymnasium and their tasks."""

import lazy_loader

from afo_sim.rl.retired import ENTITY, refusing

_attached, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> object:
    return refusing(ENTITY)(name) if name == "OrthosisEntity" else _attached(name)
