"""All pictures, reports, films and Rerun recordings. Nothing below this room draws."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
