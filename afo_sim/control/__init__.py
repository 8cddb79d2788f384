"""Controllers: what the device's electronics see, and what they command, at a control rate."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
