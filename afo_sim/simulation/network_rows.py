"""The air of a network along a stride that was walked, as its slopes are taken from it."""

import numpy as np

from afo_sim import native
from afo_sim.common.units import AMBIENT_PRESSURE
from afo_sim.model.build import Built
from afo_sim.simulation.network_slopes import NetworkRows, WayRows
from afo_sim.simulation.policy import Rows


def network_rows(built: Built, nodes: list[int], rows: Rows, inputs: np.ndarray, step: float) -> NetworkRows:
    """The air of nodes in some rows of a stride.

    Units: rows (n, …), inputs (n, nu), step [s].
    """
    model, index = built.model, built.index
    act, userdata = rows["act"], rows["userdata"]
    chambers = [native.read_air(model, act, userdata, c) for c in index.chambers.values()]
    volumes = list(index.volumes.values())
    given = {native.TO_AMBIENT: np.full(len(act), AMBIENT_PRESSURE)}
    for store in index.stores.values():
        given[store] = native.read_volume(model, userdata, store)
    supply = inputs[:, next(iter(index.chambers.values()))] + AMBIENT_PRESSURE
    pressures = [air.absolute_pressure for air in chambers]
    pressures += [native.read_volume(model, userdata, volume) for volume in volumes]
    known = given | dict(zip(nodes, pressures, strict=True))
    numbers = {node: k for k, node in enumerate(nodes)}
    numbers = {node: k for k, node in enumerate(nodes)}
    ways = []
    for way in native.ways_of(model):
        known[native.TO_SUPPLY] = np.minimum(supply, known.get(way.upstream, supply))
        opening = native.read_opening(model, act, way.actuator) if way.valve else np.ones(len(act))
        ends = (known[way.origin], known[way.end], known.get(way.pilot, supply))
        origin, end = numbers.get(way.origin, -1), numbers.get(way.end, -1)
        ways.append(WayRows(way, origin, end, ends, opening))
    return NetworkRows(
        mass=np.stack([native.read_held(model, act, node)[..., 0] for node in nodes]),
        pressure=np.stack(pressures),
        volume=np.stack(
            [a.volume for a in chambers] + [np.full(len(act), native.room_of(model, v)) for v in volumes]
        ),
        wall=np.array([native.wall_of(model, node) for node in nodes]),
        ways=tuple(ways),
        gas=native.gas_of(model, nodes[0]),
        step=step,
    )
