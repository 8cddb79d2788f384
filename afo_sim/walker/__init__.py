"""A walker that responds: body, muscles, reflexes, gaits found by search, patients who adapt."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
