"""The Composer entity, which is retired."""

from afo_sim.rl.retired import ENTITY, refusing

__getattr__ = refusing(ENTITY)
