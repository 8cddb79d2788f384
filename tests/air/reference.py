"""A separate computation of air networks: rigid volumes joined by ISO 6358 restrictions, and closed forms.

    found = network_reference(nodes, edges, times)  # by name: Volume or Fixed; Edge: a Solution

Nothing here is shared with the program but numbers: the flow, the balances of mass and energy and the
constants are written again, and scipy integrates them. States: of each volume its air's mass and internal
energy, and the heat that the wall has given; of each edge the mass and the enthalpy that have passed.

Units are SI, pressures are absolute. Conductances C [m³/(s·Pa)] are 1e-8 of those in dm³/(s·bar).
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp

GAS, GAMMA = 287.05, 1.4  # of dry air [J/(kg·K)], [-]
AMBIENT, WARMTH = 101_325.0, 293.15  # [Pa], [K]
DENSITY = 1.185  # ISO 8778 (ANR) [kg/m³]
LAMINAR = 0.98  # pressure ratio from which a flow is linear
BAR = 1e5
LITRE = 1e-8  # dm³/(s·bar) [m³/(s·Pa)]


def iso_flow(
    p1: float, t1: float, p2: float, t2: float, conductance: float, critical: float, laminar: float = LAMINAR
) -> float:
    """Mass flow from side 1 to side 2, negative when it runs back [kg/s].

    ISO 6358-1:2013: ṁ = C ρ0 p_up √(T0/T_up) ψ(r), r = p_down/p_up; ψ = 1 for r ≤ b, else
    √(1 − ((r − b)/(1 − b))²), and from r = `laminar` a straight line to 0 at r = 1.
    """
    forwards = p1 >= p2
    up, down, warm = (p1, p2, t1) if forwards else (p2, p1, t2)
    ratio = down / up
    x = max(0.0, (min(ratio, laminar) - critical) / (1.0 - critical))
    share = math.sqrt(1.0 - x * x) * min(1.0, (1.0 - ratio) / (1.0 - laminar))
    flow = conductance * DENSITY * up * math.sqrt(WARMTH / warm) * share
    return flow if forwards else -flow


def line_loss(
    flow: float, p1: float, t1: float, p2: float, t2: float, conductance: float, critical: float
) -> float:
    """Pressure difference p1 − p2 that `iso_flow` needs for a flow, by the side that it leaves [Pa]."""
    up, warm = (p1, t1) if flow > 0.0 else (p2, t2)
    share = min(1.0, abs(flow) / (conductance * DENSITY * up * math.sqrt(WARMTH / warm)))
    straight = math.sqrt(1.0 - ((LAMINAR - critical) / (1.0 - critical)) ** 2)
    if share < straight:
        ratio = 1.0 - (1.0 - LAMINAR) * share / straight
    else:
        ratio = critical + (1.0 - critical) * math.sqrt(1.0 - share * share)
    return math.copysign(up * (1.0 - ratio), flow)


# Closed forms of a rigid volume behind one choked restriction


def choked_rate(pressure: float, temperature: float, conductance: float) -> float:
    """ṁ = C ρ0 p √(T0/T) [kg/s]."""
    return conductance * DENSITY * pressure * math.sqrt(WARMTH / temperature)


def isothermal_fill(time, volume, start, source, conductance):
    """Pressure while a source at T0 fills a volume held at T0: p = p0 + R T0 ṁ t/V, while p ≤ b p_s."""
    return start + GAS * WARMTH * choked_rate(source, WARMTH, conductance) * time / volume


def adiabatic_fill(time, volume, start, source, conductance):
    """Pressure of an adiabatic volume: V ṗ/(γ − 1) = c_p T0 ṁ, so p = p0 + γ R T0 ṁ t/V, while p ≤ b p_s."""
    return start + GAMMA * GAS * WARMTH * choked_rate(source, WARMTH, conductance) * time / volume


def isothermal_vent(time, volume, start, conductance):
    """Pressure of a volume held at T0: p = p0 exp(−t C ρ0 R T0/V), while p_down ≤ b p."""
    return start * np.exp(-time * conductance * DENSITY * GAS * WARMTH / volume)


def adiabatic_vent(time, volume, start, conductance, temperature=WARMTH, gas=GAS, gamma=GAMMA):
    """Pressure of an adiabatic volume that starts at p_i, T_i, while p_down ≤ b p.

    What stays expands isentropically, T = T_i π^((γ−1)/γ) with π = p/p_i, and V ṗ = −γ R T ṁ. So
    π̇ = −k π^(1+a), a = (γ − 1)/(2γ), k = γ R C ρ0 √(T0 T_i)/V, hence π = (1 + a k t)^(−1/a).
    """
    a = (gamma - 1.0) / (2.0 * gamma)
    k = gamma * gas * conductance * DENSITY * math.sqrt(WARMTH * temperature) / volume
    return start * (1.0 + a * k * time) ** (-1.0 / a)


# Networks


@dataclass(frozen=True)
class Volume:
    """Rigid: volume [m³], start pressure [Pa] and temperature [K], wall conductance hA [W/K] to T0.

    isothermal : it is held at T0, whatever the wall
    """

    volume: float
    pressure: float = AMBIENT
    temperature: float = WARMTH
    wall: float = 0.0
    isothermal: bool = False


@dataclass(frozen=True)
class Fixed:
    """A node that keeps its pressure [Pa] and temperature [K], whatever flows."""

    pressure: float = AMBIENT
    temperature: float = WARMTH


Law = Callable[[float, float, float, float, float], float]  # p1, T1, p2, T2, opening → kg/s


@dataclass(frozen=True)
class Edge:
    """A restriction from `origin` to `end`, ISO 6358 or of a law of its own.

    conductance, critical : C [m³/(s·Pa)], b [-]
    opening : 0…1 over time [s] → [-], scales C
    breaks : times at which `opening` jumps [s]
    cracking, band : of a check valve [Pa]: it passes nothing back; its C grows linearly from 0 to all of it
        while the pressure difference goes from `cracking` to `cracking + band`; none of an open restriction
    law : flow by p1, T1, p2, T2 and opening, instead of ISO 6358
    inertance : L/A of a line whose flow follows dṁ/dt = (p1 − p2 − loss)/(L/A) [1/m]; none without inertia
    """

    origin: str
    end: str
    conductance: float = 0.0
    critical: float = 0.3
    opening: Callable[[float], float] | float = 1.0
    breaks: tuple[float, ...] = ()
    cracking: float | None = None
    band: float | None = None  # as much as `cracking` by default
    law: Law | None = None
    laminar: float = LAMINAR
    inertance: float | None = None

    def flow(self, time: float, p1: float, t1: float, p2: float, t2: float) -> float:
        """From origin to end [kg/s]."""
        opening = self.opening if isinstance(self.opening, (int, float)) else self.opening(time)
        if self.law is not None:
            return self.law(p1, t1, p2, t2, opening)
        c = opening * self.conductance
        if self.cracking is not None:
            band = self.cracking if self.band is None else self.band
            c *= min(1.0, max(0.0, (p1 - p2 - self.cracking) / band))
        return iso_flow(p1, t1, p2, t2, c, self.critical, self.laminar)


@dataclass(frozen=True)
class Solution:
    """What `network_reference` found, by name of the volume or number of the edge, over `times`."""

    times: np.ndarray
    mass: dict[str, np.ndarray]  # [kg]
    energy: dict[str, np.ndarray]  # internal [J]
    pressure: dict[str, np.ndarray]  # [Pa]
    temperature: dict[str, np.ndarray]  # [K]
    heat: dict[str, np.ndarray]  # from the wall since the first time [J]
    passed: list[np.ndarray]  # mass, from origin to end since the first time [kg]
    enthalpy: list[np.ndarray]  # that went with it [J]
    evaluations: int = field(default=0, compare=False)


def network_reference(
    nodes: Mapping[str, Volume | Fixed],
    edges: Sequence[Edge],
    times: Sequence[float] | np.ndarray,
    *,
    method: str = "LSODA",
    rtol: float = 1e-10,
    gas: float = GAS,
    gamma: float = GAMMA,
) -> Solution:
    """Volumes and what passes between them, from the first to the last of `times`.

    ṁ = Σ ṁ_in − Σ ṁ_out; U̇ = Σ c_p T_up ṁ + hA (T0 − T); p = (γ − 1) U/V, T = U/(m c_v). A volume that is
    isothermal gets the heat that holds it at T0.

    Raises
    ------
    RuntimeError
        scipy could not integrate.
    """
    times = np.asarray(times, dtype=float)
    cv, cp = gas / (gamma - 1.0), gamma * gas / (gamma - 1.0)
    volumes = {name: node for name, node in nodes.items() if isinstance(node, Volume)}
    names, count = list(volumes), len(volumes)
    place = {name: k for k, name in enumerate(names)}
    size = np.array([v.pressure * v.volume / (gas * v.temperature) for v in volumes.values()])
    unit_mass, unit_energy = size.max(), size.max() * cv * WARMTH
    scale = np.concatenate(
        [size, size * cv * WARMTH, np.full(count, unit_energy)]
        + [np.full(len(edges), unit) for unit in (unit_mass, unit_energy, unit_mass)]
    )
    start = np.zeros(len(scale))
    start[:count] = 1.0
    start[count : 2 * count] = [v.temperature / WARMTH for v in volumes.values()]
    calls = 0

    def at(name: str, y: np.ndarray) -> tuple[float, float]:
        node = nodes[name]
        if isinstance(node, Fixed):
            return node.pressure, node.temperature
        k = place[name]
        if node.isothermal:
            return y[k] * gas * WARMTH / node.volume, WARMTH
        return (gamma - 1.0) * y[count + k] / node.volume, y[count + k] / (y[k] * cv)

    def rates(time: float, scaled: np.ndarray) -> np.ndarray:
        nonlocal calls
        calls += 1
        y, rate = scaled * scale, np.zeros(len(scale))
        for k, edge in enumerate(edges):
            (p1, t1), (p2, t2) = at(edge.origin, y), at(edge.end, y)
            state = 3 * count + 2 * len(edges) + k
            flow = edge.flow(time, p1, t1, p2, t2) if edge.inertance is None else y[state]
            if edge.inertance is not None:
                loss = line_loss(flow, p1, t1, p2, t2, edge.conductance, edge.critical)
                rate[state] = (p1 - p2 - loss) / edge.inertance
            enthalpy = cp * flow * (t1 if flow >= 0.0 else t2)
            for name, sign in ((edge.origin, -1.0), (edge.end, 1.0)):
                if name in place:
                    rate[place[name]] += sign * flow
                    rate[count + place[name]] += sign * enthalpy
            rate[3 * count + k] = flow
            rate[3 * count + len(edges) + k] = enthalpy
        for name, node in volumes.items():
            k = place[name]
            if node.isothermal:
                heat = cv * WARMTH * rate[k] - rate[count + k]
            else:
                heat = node.wall * (WARMTH - at(name, y)[1])
            rate[count + k] += heat
            rate[2 * count + k] = heat
        return rate / scale

    stops = sorted({t for edge in edges for t in edge.breaks if times[0] < t < times[-1]})
    found = np.empty((len(scale), len(times)))
    here, now = start, times[0]
    for stop in [*stops, times[-1]]:
        inside = np.flatnonzero((times >= now) & (times <= stop))
        asked = np.unique(np.append(times[inside], stop))
        # a jump belongs to what follows: just before it, just after it
        span = (now + 1e-13, stop - 1e-13) if stops else (now, stop)
        run = solve_ivp(
            rates, span, here, method=method, rtol=rtol, atol=1e-3 * rtol, t_eval=np.clip(asked, *span)
        )
        if not run.success:
            raise RuntimeError(run.message)
        found[:, inside] = run.y[:, np.searchsorted(asked, times[inside])]
        here, now = run.y[:, -1], stop
    y = found * scale[:, None]
    mass = {name: y[k] for name, k in place.items()}
    energy = {name: y[count + k] for name, k in place.items()}
    return Solution(
        times,
        mass,
        energy,
        {name: (gamma - 1.0) * energy[name] / volumes[name].volume for name in names},
        {name: energy[name] / (mass[name] * cv) for name in names},
        {name: y[2 * count + k] for name, k in place.items()},
        list(y[3 * count : 3 * count + len(edges)]),
        list(y[3 * count + len(edges) : 3 * count + 2 * len(edges)]),
        calls,
    )


def time_to(times: np.ndarray, values: np.ndarray, level: float) -> float:
    """When rising values first reach a level, between the samples by a straight line [s]."""
    k = int(np.argmax(values >= level))
    return float(np.interp(level, values[k - 1 : k + 1], times[k - 1 : k + 1]))
