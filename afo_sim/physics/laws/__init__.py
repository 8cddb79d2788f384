"""The registry LAWS of static force laws: one file a family, found here.

A new law is a new file in this folder: its kernel, its parameters, and a `Law` at the top level with a native
id that no other kernel has. LAWS and the dispatcher of `static_force` follow.
"""

from afo_sim.physics.law import MAX_COEFFICIENTS, Law
from afo_sim.physics.registry import check_coefficients, collect

LAWS: dict[str, Law] = collect(__name__, Law)

for _law in LAWS.values():
    check_coefficients(_law, 2, MAX_COEFFICIENTS)
