"""The simulation behind other libraries' interfaces: dm_control, Gymnasium and their tasks."""

import lazy_loader

from afo_sim.common import refuse_retired

_attached, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> object:
    return refuse_retired(name) if name == "OrthosisEntity" else _attached(name)
