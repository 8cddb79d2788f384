"""The adapter for Stable-Baselines3, which is retired."""

from afo_sim.common import refuse_retired

__getattr__ = refuse_retired
