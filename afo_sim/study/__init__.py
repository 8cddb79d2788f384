"""Studies of a scenario: sweeps of many cases, searches, sizes, effects, and looking at what came out."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
