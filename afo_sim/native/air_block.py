"""Numbers of an air network while its step is taken: one block for each node, one for each restriction.

They lie on the stack of compiled code, so that nothing is kept from step to step and threads do not meet.
Node 0 is the ambient air, node 1 the supply; after these come chambers, volumes and stores.
"""

from typing import Any

MOST_NODES, MOST_EDGES = 34, 64  # of one network, ambient air and supply included
AMBIENT, SUPPLY, FIRST_NODE = 0, 1, 2

# Of a node, in lines of the cache: what every part of a step asks for; room, wall and the state that a part
# began with; what only stiff air and volumes need (stage before, first rates).
(
    NODE_KIND,
    NODE_PRESSURE,
    NODE_TEMPERATURE,
    NODE_ENTHALPY,
    NODE_MASS,
    NODE_SIGMA,
    NODE_MASS_RATE,
    NODE_SIGMA_RATE,
    NODE_VOLUME,
    NODE_VOLUME_CHANGE,
    NODE_WALL,
    NODE_STEEPNESS,
    NODE_POWER,
    NODE_ACTUATOR,
    NODE_FIRST_MASS,
    NODE_FIRST_SIGMA,
    NODE_FIRST_MASS_RATE,
    NODE_FIRST_SIGMA_RATE,
    NODE_LAST_MASS,
    NODE_LAST_SIGMA,
    NODE_POWER_RATE,
) = range(21)
NODE_NUMBERS = 24
# Of a restriction: ends, law, flow and where that goes; parameters of other laws, what stiff air needs.
(
    EDGE_ORIGIN,
    EDGE_END,
    EDGE_LAW,
    EDGE_OPENING,
    EDGE_CONDUCTANCE,
    EDGE_CRITICAL,
    EDGE_FLOW,
    EDGE_PLACE,
    EDGE_1,
    EDGE_2,
    EDGE_3,
    EDGE_4,
    EDGE_STEEPNESS,
    EDGE_MOVED,
    EDGE_FIRST_FLOW,
    EDGE_LAST_MOVED,
    EDGE_TOTAL,
) = range(17)
EDGE_NUMBERS = 24
FIRST_EDGE = MOST_NODES * NODE_NUMBERS
BLOCK = FIRST_EDGE + MOST_EDGES * EDGE_NUMBERS

OF_FIXED, OF_VOLUME, OF_STORE = 0.0, 1.0, 2.0


def block() -> Any:
    """Room for a network's numbers; compiled code takes it from its own stack."""
    return [0.0] * BLOCK
