"""Anybody's leg: read from MJCF and URDF, cut out of a body, turned, attached to, and written again."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
