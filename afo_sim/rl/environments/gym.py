"""Gymnasium, or one sentence where it is missing."""

MISSING = "gymnasium is not installed, and its environments here need it: pip install 'afo-sim[gym]'"

try:
    import gymnasium
except ImportError as error:
    if (error.name or "").split(".")[0] != "gymnasium":
        raise
    raise ImportError(MISSING) from None

__all__ = ["gymnasium"]
