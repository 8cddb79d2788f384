"""The simulation behind other libraries' interfaces: dm_control, Gymnasium and their tasks."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
