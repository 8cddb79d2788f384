"""Recorded walking: cycles, their checks, variants and norm. No MuJoCo."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
