"""Measured points and logs → parameters with intervals."""
