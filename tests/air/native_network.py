"""An air network of the references (`air.reference`), built with the program's compiled network and stepped.

    rig = NativeNetwork(nodes, edges, timestep)
    found = rig.run(0.1)                          # Stepped: over time, by the same names and numbers

The volumes become chambers without muscles or rigid volumes, the nodes "supply" and "ambient" what is given.
Valves between a chamber and these two stand open from the start; a chamber's other valve stays shut.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from air.reference import AMBIENT, GAMMA, GAS, Edge, Fixed, Volume

from afo_sim import native
from afo_sim.native import slots, state
from afo_sim.physics import INERTIAL, FlowEdge, flow_edge

XML = """<mujoco><option timestep="{}" integrator="implicitfast"><flag autoreset="disable"/></option>
<worldbody><body><joint name="slide" type="slide"/><geom size=".01" mass="1"/></body></worldbody></mujoco>"""
ISOTHERMAL = 1e4  # wall conductance that stands for T0 [W/K]


@dataclass(frozen=True)
class Stepped:
    """What the program stepped, as `Solution`; `flow` is each edge's mean over the step before [kg/s]."""

    times: np.ndarray
    mass: dict[str, np.ndarray]
    pressure: dict[str, np.ndarray]
    temperature: dict[str, np.ndarray]
    flow: list[np.ndarray]

    @property
    def step(self) -> float:
        """Time step [s]."""
        return float(self.times[1] - self.times[0])

    @property
    def passed(self) -> list[np.ndarray]:
        """Mass through each edge since the start [kg]."""
        return [np.concatenate([[0.0], np.cumsum(flow[1:]) * self.step]) for flow in self.flow]


class NativeNetwork:
    """A compiled network; its volumes begin as the nodes say.

    chambers : names of the volumes that are chambers; the others are rigid volumes
    inlets : (number of an edge from the feed or to the exhaust) by chamber; they become its valves
    """

    def __init__(
        self,
        nodes: Mapping[str, Volume | Fixed],
        edges: Sequence[Edge],
        timestep: float = 1e-3,
        *,
        chambers: Sequence[str] = (),
    ):
        self.nodes, self.edges = nodes, edges
        self.volumes = {name: node for name, node in nodes.items() if isinstance(node, Volume)}
        self.supply = nodes["supply"].pressure - AMBIENT if "supply" in nodes else 5e5
        names = tuple(chambers) or (next(iter(self.volumes)),)
        taken: dict[int, str] = {}  # of edges that are valves of chambers, their keys
        shut = native.CircuitValve(1e-12, 0.3)
        made = []
        for name in names:
            valves, ends = {}, {"inlet": "supply", "outlet": "ambient"}
            for k, edge in enumerate(edges):
                side = "inlet" if edge.end == name else "outlet" if edge.origin == name else None
                open_both_ways = edge.cracking is None and edge.inertance is None
                if side and side not in valves and k not in taken and open_both_ways:
                    valves[side] = native.CircuitValve(edge.conductance, edge.critical)
                    ends[side] = edge.origin if side == "inlet" else edge.end
                    taken[k] = f"{name}_{side}"
            made.append(
                native.CircuitChamber(
                    name, "slide", self.volumes[name].volume, self._wall(name),
                    valves.get("inlet", shut), valves.get("outlet", shut),
                    feed=ends["inlet"], exhaust=ends["outlet"],
                )
            )  # fmt: skip
        self.keys = [taken.get(k, f"edge{k}") for k in range(len(edges))]
        self.circuit = native.Circuit(
            (), tuple(made),
            volumes=tuple(
                native.CircuitVolume(name, node.volume, self._wall(name), node.pressure - AMBIENT)
                for name, node in self.volumes.items() if name not in names
            ),
            restrictions=tuple(
                self._restriction(f"edge{k}", edge) for k, edge in enumerate(edges) if k not in taken
            ),
        )  # fmt: skip
        spec = mujoco.MjSpec.from_string(XML.format(repr(timestep)))
        native.add_circuit(spec, self.circuit)
        self.model = spec.compile()
        self.ids = native.fill_circuit(self.model, self.circuit)
        self.actuators = self.ids.chambers | self.ids.volumes
        self.open = set(taken.values())

    def _wall(self, name: str) -> float:
        node = self.volumes[name]
        return ISOTHERMAL if node.isothermal else node.wall

    @staticmethod
    def _restriction(name: str, edge: Edge) -> FlowEdge:
        if edge.inertance is not None:
            law = INERTIAL, (1.0 / edge.inertance,), 0.0
            return FlowEdge(name, edge.origin, edge.end, edge.conductance, edge.critical, *law)
        if edge.cracking is None:
            return FlowEdge(name, edge.origin, edge.end, edge.conductance, edge.critical)
        return flow_edge.check_valve(
            name, edge.origin, edge.end, edge.conductance, edge.critical, cracking=edge.cracking
        )

    def start(self) -> mujoco.MjData:
        """The first state; needs the callbacks."""
        data = mujoco.MjData(self.model)
        data.ctrl[list(self.ids.chambers.values())] = self.supply
        native.fill_chambers(self.model, data, 0.0)
        for name, node in self.volumes.items():
            air = state.Air(
                node.pressure * node.volume / (GAS * node.temperature), node.volume, node.pressure
            )
            actuator = self.actuators[name]
            if name in self.ids.chambers:
                native.write_air(self.model, data.act, actuator, air)
            else:
                at = self.model.actuator_actadr[actuator]
                data.act[at + slots.CHAMBER_ACT.mass] = air.mass
                data.act[at + slots.CHAMBER_ACT.sigma] = air.absolute_pressure * air.volume**GAMMA
        for key, actuator in self.ids.valves.items():
            opened = 1.0 if key in self.open else 0.0
            native.write_valve(self.model, data.act, actuator, opened, opened)
            data.ctrl[actuator] = opened
        return data

    def run(self, duration: float, switch=None) -> Stepped:
        """Step for a duration [s]; `switch(time, data, ids)` may set inputs before each step."""
        step = self.model.opt.timestep
        n = round(duration / step)
        names = list(self.volumes)
        at = np.array([self.model.actuator_actadr[self.actuators[name]] for name in names])
        places = [self._place(k) for k in range(len(self.edges))]
        mass, sigma = np.empty((n + 1, len(names))), np.empty((n + 1, len(names)))
        flow = np.zeros((n + 1, len(self.edges)))
        with native.installed():
            data = self.start()
            for k in range(n + 1):
                mass[k], sigma[k] = (
                    data.act[at + slots.CHAMBER_ACT.mass],
                    data.act[at + slots.CHAMBER_ACT.sigma],
                )
                if k == n:
                    break
                if switch is not None:
                    switch(data.time, data, self.ids)
                mujoco.mj_step(self.model, data)
                flow[k + 1] = data.userdata[places]
        size = np.array([self.volumes[name].volume for name in names])
        pressure = sigma / size**GAMMA
        temperature = pressure * size / (mass * GAS)
        found = (dict(zip(names, array.T, strict=True)) for array in (mass, pressure, temperature))
        return Stepped(np.arange(n + 1) * step, *found, list(flow.T))

    def _place(self, k: int) -> int:
        """Where the flow of an edge stands in `userdata`."""
        known = self.ids.valves | self.ids.restrictions
        return int(self.model.actuator_user[known[self.keys[k]], slots.EDGE_ROW.place])


def behind_valve(valve: dict, volume: dict, opened: list, period: str) -> dict:
    """Sets of a seated scenario whose one valve fills a rigid volume; the muscles behind it stay empty."""
    return {
        "orthosis.volume.v": volume,
        "orthosis.restriction.i": {"kind": "valve", "valve": valve, "upstream": "supply", "downstream": "v"},
        "orthosis.chamber.plantarflexor.feed": "v",
        "timer": {"period": period, "i": {"open": opened}, "plantarflexor": {"outlet": [["0 s", period]]}},
        "duration": period,
    }
