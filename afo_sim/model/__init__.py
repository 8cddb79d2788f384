"""Description → MjSpec → MjModel: leg, orthosis, walking, contact, controls and starting state."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
