"""Older name of `afo_sim.rl`, for what imports `physics` of it; its entities are retired."""

from afo_sim.common import Mixed, older


def __getattr__(name: str) -> Mixed:
    return older(f"bridge.{name}")
