"""Measurements: the virtual test stand, fits to measured data, and published tables compared with runs."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
