"""The registry LAWS of static force laws: one file a family, found here.

A new law is a new file in this folder: its kernel, its parameters, and a `Law` at the top level with a native
id that no other kernel has. LAWS and the dispatcher of `static_force` follow.
"""

from afo_sim.physics.law import MAX_COEFFICIENTS, Law
from afo_sim.physics.registry import check_coefficients, collect


def collected() -> dict[str, Law]:
    """The laws of this folder by name, as their native ids rise; a wrong entry is a ValueError."""
    laws = collect(__name__, Law)
    for law in laws.values():
        number = check_coefficients(law, 2, MAX_COEFFICIENTS)
        if law.force_powers and len(law.force_powers) != number:
            raise ValueError(f"{law.name!r} has {number} coefficients and {len(law.force_powers)} powers")
    return laws


LAWS: dict[str, Law] = collected()
