"""A separate computation of a tube: one-dimensional compressible flow, and the lumped tube in its place.

    found = tube_1d(Tube(2.5e-3, 0.8), Valve(0.4e-8, 0.3), 30e-6)  # Filled: times, pressure, …

A valve leads from a constant source into a tube, the tube into a rigid volume. The tube is cut into finite
volumes: mass and energy at the nodes (halves at both ends, the last one of them part of the rigid volume),
mass flow per area G between them, upwind convection, Darcy friction:

    ∂ρ/∂t + ∂G/∂x = 0        ∂G/∂t + ∂(G²/ρ)/∂x + ∂p/∂x + f G|G|/(2 d ρ) = 0

What leaves the tube is a jet at the volume's pressure, of whose speed nothing is recovered; where that
pressure is low the end chokes, at p = G √(R T). What enters it comes from rest and loses K_in ρu²/2.

The friction inside Eckersten's formula
---------------------------------------
C = 0.029 d²/√(L/d^1.25 + 510) [m³/(s·Pa)], b = 474 C/d² (Eckersten; d, L in m). Isothermal friction alone is
p1² − p2² = G² R T (f L/d + K), so that a tube into vacuum has C ρ0 = (π d²/4)/√(R T0 (f L/d + K)). So

    f L/d + K = (π/4/(0.029 ρ0 √(R T0)))² (L/d^1.25 + 510):   f = 0.00621 d^(−1/4),   K = f 510 d^(1/4) = 3.17

for any bore. K is not an inlet loss: the acceleration has its part in it. With acceleration
p1² − p2² = G² R T (f L/d + 2 ln(p1/p2)), the end chokes at p2 = G √(R T), and behind an entry from rest
ln(p0/p1) = (1 + K_in)/2 · G² R T/p1². So a tube into vacuum has about p0²/(G² R T) = f L/d + 2 + K_in +
2 ln(p1/p2). This is 3.17 for L = 0 and K_in = 0.15, but more than f L/d + 3.17 for a tube: with that friction
and no loss at the entry the flow is up to 8 % below Eckersten's (`steady_flow`). So his formula is that of a
tube with less friction. `matched_friction` is the one at which the choked flow is his: 3 to 19 % below
0.00621 d^(−1/4) for 0.3 to 10 m of 2 to 8 mm. With it the whole characteristic, C and b, is his within −3.1
and +1.6 %.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from air.reference import DENSITY, GAMMA, GAS, LAMINAR, WARMTH, Edge, Fixed, Volume, network_reference
from numba import njit
from scipy.optimize import brentq

# (π/4/(0.029 ρ0 √(R T0)))²: what turns L/d^1.25 + 510 into f L/d + K
FRICTION = (math.pi / 4.0 / (0.029 * DENSITY * math.sqrt(GAS * WARMTH))) ** 2
ENTRY = 510.0


@dataclass(frozen=True)
class Tube:
    """Inner diameter and length [m]."""

    bore: float
    length: float

    @property
    def area(self) -> float:
        """Of its bore [m²]."""
        return math.pi / 4.0 * self.bore**2

    @property
    def volume(self) -> float:
        """[m³]."""
        return self.area * self.length

    def eckersten(self, share: float = 1.0, entry: float = 1.0) -> tuple[float, float]:
        """C [m³/(s·Pa)] and b of a share of its length, with a share of the term 510."""
        c = 0.029 * self.bore**2 / math.sqrt(share * self.length / self.bore**1.25 + entry * ENTRY)
        return c, 474.0 * c / self.bore**2

    @property
    def friction(self) -> float:
        """Darcy's f, as it stands in Eckersten's formula if the acceleration is left out."""
        return FRICTION * self.bore**-0.25


@dataclass(frozen=True)
class Valve:
    """C [m³/(s·Pa)] and b."""

    conductance: float
    critical: float = 0.3


# Steady


@cache
def steady_flow(tube: Tube, ratio: float, friction: float, entry_loss: float = 0.0) -> float:
    """Isothermal flow at T0 through a tube from rest into a jet, as C ψ(r) in m³/(s·Pa), at r = p_out/p_in.

    In units of G √(R T): with the Mach number m = 1/P1 behind the entry, P0 = P1 exp((1 + K_in)/(2 P1²)) and
    P1² − P2² = f L/d + 2 ln(P1/P2), P2 ≥ 1.
    """
    resistance = friction * tube.length / tube.bore

    def inner(p2: float) -> float:
        return brentq(
            lambda p1: p1 * p1 - p2 * p2 - resistance - 2.0 * math.log(p1 / p2), p2, p2 + 9.0 + resistance
        )

    def outer(p2: float) -> float:
        p1 = inner(p2)
        return p1 * math.exp(0.5 * (1.0 + entry_loss) / (p1 * p1))

    def left(p2: float) -> float:
        return p2 / outer(p2) - ratio

    end = 1.0 if left(1.0) >= 0.0 else brentq(left, 1.0, 1e4)
    return tube.area / (outer(end) * DENSITY * math.sqrt(GAS * WARMTH))


def matched_friction(tube: Tube, entry_loss: float = 0.0) -> float:
    """Darcy's f with which the choked isothermal tube passes as much as Eckersten's C says."""
    c = tube.eckersten()[0]
    return brentq(lambda f: steady_flow(tube, 1e-6, f, entry_loss) / c - 1.0, 1e-6, 2.0 * tube.friction)


# Over time


@njit(cache=False)
def _iso(p1, t1, p2, t2, conductance, critical, laminar):  # pragma: no cover - compiled
    if p1 < p2:
        return -_iso_down(p2, t2, p1, conductance, critical, laminar)
    return _iso_down(p1, t1, p2, conductance, critical, laminar)


@njit(cache=False)
def _iso_down(p1, t1, p2, conductance, critical, laminar):  # pragma: no cover - compiled
    ratio = p2 / p1
    x = max(0.0, (min(ratio, laminar) - critical) / (1.0 - critical))
    share = math.sqrt(1.0 - x * x) * min(1.0, (1.0 - ratio) / (1.0 - laminar))
    return conductance * DENSITY * p1 * math.sqrt(WARMTH / t1) * share


@njit(cache=False)
def _run(
    n, bore, length, friction, entry_loss, conductance, critical, laminar, volume, source, start,
    isothermal, wall_tube, wall_volume, level, longest, every,
):  # fmt: skip
    cv, cp = GAS / (GAMMA - 1.0), GAMMA * GAS / (GAMMA - 1.0)
    area, dx = math.pi / 4.0 * bore**2, length / n
    size = np.full(n + 1, area * dx)
    size[0], size[n] = 0.5 * area * dx, 0.5 * area * dx + volume
    wall = np.full(n + 1, wall_tube / n)
    wall[0], wall[n] = 0.5 * wall_tube / n, 0.5 * wall_tube / n + wall_volume
    rho = np.full(n + 1, start / (GAS * WARMTH))
    energy = rho * cv * WARMTH
    p, t = np.full(n + 1, start), np.full(n + 1, WARMTH)
    flux, flow, head = np.zeros(n), np.zeros(n), np.zeros(n + 1)
    # sound and flow through a cell; the valve's steepest slope on the first node
    x = (laminar - critical) / (1.0 - critical)
    slope = conductance * DENSITY * math.sqrt(1.0 - x * x) / (1.0 - laminar) * GAMMA * GAS * WARMTH / size[0]
    dt = min(0.4 * dx / (2.0 * math.sqrt(GAMMA * GAS * WARMTH)), 0.4 / slope)
    kept = [(0.0, start, start, 0.0)]
    now, k, passed, entering = 0.0, 0, 0.0, 0.0
    while p[n] < level and now < longest:
        entering = _iso(source, WARMTH, p[0], t[0], conductance, critical, laminar)
        # momentum: what passes the node between two faces, and at the ends
        head[0] = (
            0.5 * (1.0 - entry_loss) * flux[0] * flux[0] / rho[0] if flux[0] > 0.0 else flux[0] ** 2 / rho[1]
        )
        for i in range(1, n):
            g = 0.5 * (flux[i - 1] + flux[i])
            head[i] = g * (flux[i - 1] / rho[i - 1] if g > 0.0 else flux[i] / rho[i + 1])
        # the jet is at the volume's pressure, or chokes above it, where p + G² R T/p is least
        g = flux[n - 1]
        jet = max(p[n], g * math.sqrt(GAS * t[n - 1]))
        head[n] = jet - p[n] + (g * g * GAS * t[n - 1] / jet if g > 0.0 else 0.0)
        for i in range(n):
            g = flux[i]
            push = (p[i] - p[i + 1] + head[i] - head[i + 1]) / dx
            mean = 0.5 * (rho[i] + (rho[i + 1] if i < n - 1 else jet / (GAS * t[i])))
            flow[i] = (g + dt * push) / (1.0 + dt * friction * abs(g) / (2.0 * bore * mean))
        for i in range(n):
            flux[i] = flow[i]
        passed += dt * entering
        for i in range(n + 1):
            gain = entering if i == 0 else area * flux[i - 1]
            loss = 0.0 if i == n else area * flux[i]
            rho[i] += dt * (gain - loss) / size[i]
        if isothermal:
            for i in range(n + 1):
                p[i] = rho[i] * GAS * WARMTH
        else:
            for i in range(n + 1):
                speed = 0.0 if i == 0 or i == n else 0.5 * (flux[i - 1] + flux[i]) / rho[i]
                head[i] = cp * t[i] + 0.5 * speed * speed  # total enthalpy
            for i in range(n + 1):
                gain = entering * cp * WARMTH if entering > 0.0 else entering * head[0]
                if i > 0:
                    gain = area * flux[i - 1] * (head[i - 1] if flux[i - 1] > 0.0 else head[i])
                loss = 0.0
                if i < n:
                    loss = area * flux[i] * (head[i] if flux[i] > 0.0 else head[i + 1])
                energy[i] += dt * (gain - loss + wall[i] * (WARMTH - t[i])) / size[i]
            for i in range(n + 1):
                speed = 0.0 if i == 0 or i == n else 0.5 * (flux[i - 1] + flux[i]) / rho[i]
                t[i] = (energy[i] / rho[i] - 0.5 * speed * speed) / cv
                p[i] = rho[i] * GAS * t[i]
        now += dt
        k += 1
        if k % every == 0:
            kept.append((now, p[n], p[0], entering))
    kept.append((now, p[n], p[0], entering))
    return np.array(kept), passed, np.sum(rho * size)


@dataclass(frozen=True)
class Filled:
    """How a volume filled: over `times` [s] absolute pressures [Pa] in it and behind the valve, and the flow.

    entered, contained : mass through the valve, and in tube and volume at the end [kg]
    """

    times: np.ndarray
    pressure: np.ndarray
    behind_valve: np.ndarray
    inflow: np.ndarray  # [kg/s]
    entered: float
    contained: float


def tube_1d(
    tube: Tube,
    valve: Valve,
    volume: float,
    *,
    source: float = 7e5,
    start: float = 1e5,
    cells: int = 60,
    friction: float | None = None,
    entry_loss: float = 0.0,
    isothermal: bool = True,
    wall_tube: float = 0.0,
    wall_volume: float = 0.0,
    upto: float = 0.95,
    longest: float = 60.0,
) -> Filled:
    """Fill a volume behind a tube behind a valve, from `start` until `upto` of the step or `longest` [s].

    Parameters
    ----------
    volume : [m³]; all air begins at `start` [Pa] and T0, at rest
    source : absolute pressure before the valve [Pa], at T0
    cells : the tube is cut into
    friction : Darcy's f; by default the one with which its choked flow is Eckersten's
    entry_loss : K_in of ρu²/2 at the entry
    isothermal : all air is at T0; else it takes heat from the walls by `wall_tube`, `wall_volume` [W/K]
    """
    f = matched_friction(tube, entry_loss) if friction is None else friction
    kept, entered, contained = _run(
        cells, tube.bore, tube.length, f, entry_loss, valve.conductance, valve.critical, LAMINAR, volume,
        source, start, isothermal, wall_tube, wall_volume, start + upto * (source - start), longest, 20,
    )  # fmt: skip
    return Filled(kept[:, 0], kept[:, 1], kept[:, 2], kept[:, 3], entered, contained)


# The lumped tube


@dataclass(frozen=True)
class Lumping:
    """How a tube becomes nodes and restrictions between them.

    volumes : shares of the tube's volume at the nodes, from the valve's end on
    parts : of each restriction between them, the share of its length and the share of the term 510
    """

    volumes: tuple[float, ...] = (0.5, 0.5)
    parts: tuple[tuple[float, float], ...] = ((1.0, 1.0),)


HALVES = Lumping()


def segments(n: int) -> Lumping:
    """n alike lengths, halves of the outer volumes; the term 510 stands in the last one alone."""
    volumes = (0.5 / n, *[1.0 / n] * (n - 1), 0.5 / n)
    return Lumping(volumes, tuple((1.0 / n, 1.0 if k == n - 1 else 0.0) for k in range(n)))


def lumped(
    tube: Tube,
    valve: Valve,
    volume: float,
    times: Sequence[float] | np.ndarray,
    *,
    lumping: Lumping = HALVES,
    source: float = 7e5,
    start: float = 1e5,
    isothermal: bool = True,
    wall_tube: float = 0.0,
    wall_volume: float = 0.0,
) -> np.ndarray:
    """Pressure of the volume behind a tube of ISO 6358 restrictions by Eckersten's formula [Pa].

    Shares s of the length and e of the term 510 have C = 0.029 d²/√(s L/d^1.25 + 510 e), b = 474 C/d²;
    b = 0 where e = 0, since friction alone is p1² − p2², an ellipse with b = 0.
    """
    last = len(lumping.volumes) - 1
    nodes: dict[str, Volume | Fixed] = {"source": Fixed(source)}
    for k, share in enumerate(lumping.volumes):
        size = share * tube.volume + (volume if k == last else 0.0)
        wall = share * wall_tube + (wall_volume if k == last else 0.0)
        nodes[str(k)] = Volume(size, start, WARMTH, wall, isothermal)
    edges = [Edge("source", "0", valve.conductance, valve.critical)]
    for k, (length, entry) in enumerate(lumping.parts):
        c, b = tube.eckersten(length, entry)
        edges.append(Edge(str(k), str(k + 1), c, b if entry else 0.0))
    found = network_reference(nodes, edges, times, method="LSODA", rtol=1e-8)
    return found.pressure[str(last)]
