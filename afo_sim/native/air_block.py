"""Numbers of an air network while its step is taken: one block for each node, one for each restriction.

They lie on the stack of compiled code, so that nothing is kept from step to step and threads do not meet.
Node 0 is the ambient air, node 1 the supply; after these come chambers, volumes and stores.
"""

from typing import Any, NamedTuple

from afo_sim.native.slots import LAW_PARAMETERS, places

MOST_NODES, MOST_EDGES = 34, 64  # of one network, ambient air and supply included
AMBIENT, SUPPLY, FIRST_NODE = 0, 1, 2


class NodeBlock(NamedTuple):
    """Of a node, in lines of the cache."""

    kind: int  # these eight: what every part of a step asks for
    pressure: int
    temperature: int
    enthalpy: int
    mass: int
    sigma: int
    mass_rate: int
    sigma_rate: int
    volume: int  # volume, wall, and the state that a part began with
    volume_change: int
    wall: int
    steepness: int
    power: int
    actuator: int
    first_mass: int
    first_sigma: int
    first_mass_rate: int
    first_sigma_rate: int
    last_mass: int  # what only stiff air and volumes need: stage before, first rates
    last_sigma: int
    wall_by_flow: int
    inflow: int


class EdgeBlock(NamedTuple):
    """Of a restriction."""

    origin: int
    end: int
    law: int
    opening: int
    conductance: int
    critical: int
    flow: int
    place: int  # of the flow, where it goes
    parameters: int  # of the law; of a line A/L, its flow now and before
    first: int  # share of the step at which a valve's seat switches once
    second: int  # and again
    steepness: int  # from here what stiff air needs
    moved: int
    first_flow: int
    last_moved: int
    total: int


NODE: NodeBlock = places(NodeBlock)
EDGE: EdgeBlock = places(EdgeBlock, parameters=LAW_PARAMETERS)
NODE_NUMBERS, EDGE_NUMBERS = 24, 24
FIRST_BLOCK, FIRST_EDGE = FIRST_NODE * NODE_NUMBERS, MOST_NODES * NODE_NUMBERS
BLOCK = FIRST_EDGE + MOST_EDGES * EDGE_NUMBERS

OF_FIXED, OF_VOLUME, OF_STORE = 0.0, 1.0, 2.0


def block() -> Any:
    """Room for a network's numbers; compiled code takes it from its own stack."""
    return [0.0] * BLOCK
