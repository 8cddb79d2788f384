"""The Composer entity, which is retired."""

from afo_sim.common import refuse_retired

__getattr__ = refuse_retired
