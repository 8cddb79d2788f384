"""Print the shipped gaits beside measured adults, as docs/validation.md has it; what is missed is bold.

python scripts/gait_table.py
"""

import math

from afo_sim.walker.likeness import TABLE, Held
from afo_sim.walker.measured import GAITS, healthy


def main() -> None:
    """Walk the gaits, and print a row of the page for each row of the table."""
    rows = {row.quantity: row for row in healthy()}
    print("| | people | held to | " + " | ".join(GAITS) + " | |")
    print("|---" * (len(GAITS) + 4) + "|")
    for row in TABLE:
        found = [rows[f"{name}: {row.quantity}"] for name in GAITS]
        people = ", ".join(dict.fromkeys(number(of.measured) for of in found))
        own = [number(of.simulated) for of in found]
        marked = [f"**{x}**" if of.verdict == "disagrees" else x for x, of in zip(own, found, strict=True)]
        what = f"{row.quantity} [{row.unit}]".replace("[deg]", "[°]").removesuffix(" [-]")
        cost = "in the cost" if row.in_cost else "not in the cost"
        print(f"| {' | '.join([what, people, bound(row, found[1].measured), *marked, cost])} |")


def number(value: float) -> str:
    """A number to two or three digits."""
    return f"{value:.{2 if abs(value) < 2.0 else 1 if abs(value) < 100.0 else 0}f}".replace("-", "−")


def bound(row: Held, measured: float) -> str:
    """What a natural gait is held to."""
    if row.half == math.inf:
        return "only shown"
    if row.centre is not None:
        return f"{row.centre - row.half:.3g} to {row.centre + row.half:.3g}"
    if round(measured, 9) in (0.0, 1.0):
        return f"≥ {1.0 - row.half:.3g}" if measured > 0.5 else f"≤ {row.half:.3g}"
    return f"± {100.0 * row.half:.3g} %" if row.share else f"± {row.half:.3g}"


if __name__ == "__main__":
    main()
