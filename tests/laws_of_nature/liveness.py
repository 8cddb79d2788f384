"""Parameters of a resolved scenario by their dotted keys, and values a little beside them."""

from typing import Any

# What a parameter that is zero is changed by.
AMOUNT = {"m": 0.005, "rad": 0.035, "N*m": 0.1, "kg*m^2": 0.002, "N": 20.0, "N*s/m": 20.0, "N*m*s/rad": 0.5}


def leaves(node: Any, path: str = "") -> dict[str, Any]:
    """Every value of nested tables by its dotted key; lists stay whole. What is not told is left out."""
    if isinstance(node, dict):
        return {
            k: v for key, child in node.items() for k, v in leaves(child, f"{path}.{key}".strip(".")).items()
        }
    return {} if node is None else {path: node}


def nudged(value: Any, share: float = 0.05) -> Any:
    """A share more; where it is zero, AMOUNT of its unit, or 0.05 of a plain number."""
    if isinstance(value, int):
        return value - 1
    if isinstance(value, float):
        return value * (1.0 + share) if value else 0.05
    number, unit = value.split(" ", 1)
    amount = float(number) * (1.0 + share) if float(number) else AMOUNT[unit]
    return f"{amount!r} {unit}"
