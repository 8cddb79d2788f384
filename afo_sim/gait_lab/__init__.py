"""Files of gait laboratories become a stride: readers of their formats, and what a trial holds."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
