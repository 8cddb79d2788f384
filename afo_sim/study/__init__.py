"""Parameter sweeps: many cases of one scenario, and looking at what came out.

import afo_sim.study
frame = afo_sim.study.read("sweeps/a").to_pandas()
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
