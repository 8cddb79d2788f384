"""Slopes of the air of a network over one stride: how what its nodes end with follows from their start.

As `air_slopes`, for chambers and volumes that tubes, restrictions and valves join:

    d(ln m)/dt = Σ w/m              d(ln σ)/dt = E/(p V),    E = γ R Σ w T_w + (γ − 1) hA (T_a − T)

Pressures of the ambient air, of the supply and of stores are given. A step between two rows is
(1 − z + z²/2)⁻¹, of second order, in which the air of a tube's end, faster than the rows, comes to rest. The
slopes serve a search, whose result does not depend on them.
"""

from dataclasses import dataclass

import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE
from afo_sim.model import Built
from afo_sim.physics import edge_flows
from afo_sim.simulation.stepping import Rows

NOTHING = 1e-3  # of a node's air, that flows in over a stride: less tells nothing of what brings it back [-]
NUDGE = 1e-6  # of ln p, by which flows are differentiated [-]


@dataclass(frozen=True)
class WayRows:
    """A valve or restriction in n rows."""

    way: native.Way
    origin: int
    end: int
    pressures: tuple[np.ndarray, np.ndarray, np.ndarray]
    opening: np.ndarray


@dataclass(frozen=True)
class NetworkRows:
    """Air of k nodes in n rows that are `step` apart."""

    mass: np.ndarray
    pressure: np.ndarray
    volume: np.ndarray
    wall: np.ndarray
    ways: tuple[WayRows, ...]
    gas: native.GasOf
    step: float

    @property
    def temperature(self) -> np.ndarray:
        """Of the air [K] (k, n)."""
        found: np.ndarray = self.pressure * self.volume / (self.mass * self.gas.constant)
        return found

    def entering(self) -> np.ndarray:
        """Air that flows into each node over the rows, by what it has at first [-] (k,)."""
        found, warm = np.zeros(len(self.mass)), self.temperature
        reached = np.zeros(len(self.mass) + 1, dtype=bool)
        flowing: list[list[int]] = []
        reached[-1] = True  # what is given
        for each in self.ways:
            flow = _flow(each, warm)
            if flow.any():
                flowing.append([each.origin, each.end])
            for node, inward in ((each.origin, -flow), (each.end, flow)):
                if node >= 0:
                    found[node] += np.maximum(inward, 0.0).sum()
        for _ in flowing:
            for ends in flowing:
                reached[ends] = reached[ends].any()
        entered = found * self.step / self.mass[:, 0]
        return np.where(reached[:-1] & (entered > NOTHING), entered, 0.0)


def network_slopes(rows: NetworkRows, giving: np.ndarray) -> np.ndarray:
    """∂(ln m, ln σ) of all nodes at the end of a stride by those at its start."""
    z = rows.step * _rates(rows, giving)
    one = np.eye(z.shape[-1])
    steps = np.linalg.inv(one - z + 0.5 * z @ z)
    while len(steps) > 1:
        if len(steps) % 2:
            steps = np.concatenate([steps, one[np.newaxis]])
        steps = steps[1::2] @ steps[0::2]
    found: np.ndarray = steps[0]
    return found


def _rates(rows: NetworkRows, giving: np.ndarray) -> np.ndarray:
    """Slopes of the rates of (ln m, ln σ) by these in each row [1/s] (n, 2k, 2k)."""
    count, n = rows.mass.shape
    gamma, enthalpy = rows.gas.heat_capacity_ratio, rows.gas.heat_capacity_ratio * rows.gas.constant
    warm, energy = rows.temperature, rows.pressure * rows.volume
    of_p = 1.0 / (1.0 + gamma * giving)  # of ln p by ln σ; of ln m only ln T follows, by −1
    of_t = (1.0 + giving) * of_p
    heat = ((gamma - 1.0) * rows.wall)[:, np.newaxis]
    power = heat * (AMBIENT_TEMPERATURE - warm)
    mass_rate = np.zeros((count, n))
    found = np.zeros((n, 2 * count, 2 * count))
    for k in range(count):
        _add(found, 2 * k + 1, k, 0.0, -heat[k] * warm[k] / energy[k], of_p, of_t)
    for each in rows.ways:
        flow = _flow(each, warm)
        by_origin, by_end = (_flow(each, warm, k) for k in (0, 1))
        up = np.where(flow >= 0.0, each.origin, each.end)  # (n,)
        carried = _warm_of(each.origin, warm) * (flow >= 0.0) + _warm_of(each.end, warm) * (flow < 0.0)
        for node, sign in ((each.origin, -1.0), (each.end, 1.0)):
            if node < 0:
                continue
            mass_rate[node] += sign * flow
            power[node] += sign * enthalpy * carried * flow
            share, work = sign / rows.mass[node], sign * enthalpy * carried / energy[node]
            for other, by_p in ((each.origin, by_origin), (each.end, by_end)):
                if other < 0:
                    continue
                lifts = up == other  # whose temperature the flow has
                _add(found, 2 * node, other, share * by_p, -0.5 * share * flow * lifts, of_p, of_t)
                _add(found, 2 * node + 1, other, work * by_p, 0.5 * work * flow * lifts, of_p, of_t)
    for k in range(count):
        found[:, 2 * k, 2 * k] -= mass_rate[k] / rows.mass[k]
        found[:, 2 * k + 1, 2 * k + 1] -= power[k] / energy[k] * of_t[k]  # ln (p V) follows as ln T does
    return found


def _add(
    found: np.ndarray,
    row: int,
    node: int,
    by_p: np.ndarray | float,
    by_t: np.ndarray,
    of_p: np.ndarray,
    of_t: np.ndarray,
) -> None:
    """Add slopes by ln p and ln T of a node, as slopes by its ln m and ln σ."""
    found[:, row, 2 * node] -= by_t
    found[:, row, 2 * node + 1] += by_p * of_p[node] + by_t * of_t[node]


def _warm_of(node: int, warm: np.ndarray) -> np.ndarray | float:
    return warm[node] if node >= 0 else AMBIENT_TEMPERATURE


def _flow(each: WayRows, warm: np.ndarray, by: int | None = None) -> np.ndarray:
    """Mass flow in each row (n,); `by` 0 or 1: its slope by ln p at the origin or the end."""
    p, way = list(each.pressures), each.way
    law = (way.law, way.conductance, way.critical_ratio, way.parameters)
    t1, t2 = _warm_of(each.origin, warm), _warm_of(each.end, warm)
    if by is None:
        return edge_flows(*law, p[0], t1, p[1], t2, p[2], each.opening)
    sides = []
    for sign in (1.0, -1.0):
        q = p.copy()
        q[by] = p[by] * np.exp(sign * NUDGE)
        sides.append(edge_flows(*law, q[0], t1, q[1], t2, q[2], each.opening))
    return (sides[0] - sides[1]) / (2.0 * NUDGE)


def network_rows(built: Built, nodes: list[int], rows: Rows, inputs: np.ndarray, step: float) -> NetworkRows:
    """The air of nodes in some rows of a stride."""
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
    ways = []
    for way in native.ways_of(model):
        known[native.TO_SUPPLY] = np.minimum(supply, known.get(way.upstream, supply))
        opening = native.read_opening(model, userdata, way.actuator) if way.valve else np.ones(len(act))
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
