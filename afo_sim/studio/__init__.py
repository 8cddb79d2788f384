"""A local page to try a design with the mouse: the settled stride answers while a slider moves."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
