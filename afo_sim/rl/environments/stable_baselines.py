"""The adapter for Stable-Baselines3, which is retired."""

from afo_sim.rl.retired import refusing

__getattr__ = refusing("stable_baselines3's own DummyVecEnv or SubprocVecEnv around gymnasium.make")
