"""Names of the figures that a conductance follows from, and which of them give way when one is set."""

from typing import Any

CONDUCTANCE, CRITICAL_RATIO = "conductance", "critical_ratio"
RATINGS = ("nominal_flow", "cv", "kv", "sonic_area", "orifice")  # one of them stands for a conductance


def make_room(table: dict[str, Any], key: str) -> bool:
    """Take away what a key that is being set replaces in its table."""
    rated = [name for name in RATINGS if table.get(name) is not None]
    gone: list[str] = []
    if key == CONDUCTANCE:
        gone = rated
    elif key in RATINGS:
        gone = [name for name in (CONDUCTANCE, *rated) if name != key]
    elif key == CRITICAL_RATIO and rated:
        gone = [CONDUCTANCE]
    taken = [table.pop(name, None) for name in gone]
    return any(value is not None for value in taken)
