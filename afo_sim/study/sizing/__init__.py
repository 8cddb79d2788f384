"""The smallest component, or the least pressure, that meets stated limits."""
