"""The command line; lazily imported, since signal handlers are installed before typer is there."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
