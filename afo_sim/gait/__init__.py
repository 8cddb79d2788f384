"""Recorded walking: cycles, their checks and norm, readers of laboratory files. No MuJoCo."""
