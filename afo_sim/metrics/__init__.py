"""Numbers from columns: definitions, strides, walking. Columns are dictionaries of arrays."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
