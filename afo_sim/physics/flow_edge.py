"""What air flows through: flow laws, as kernels of compiled code, and edges that have them.

law            flow                                              made by
TWO_WAY        ISO 6358 both ways                                `FlowEdge`
ONE_WAY        a check valve, beside a throttle or alone         `check_valve`
QUICK_EXHAUST  a quick exhaust's way out, which a pilot shuts    `quick_exhaust`
REGULATED      a pressure regulator with droop                   `regulator`
RELIEF         a regulator's relief                              `relief`
COMPRESSOR     a compressor that switches on and off             `compressor`
INERTIAL       a tube whose air has inertia: its flow is a state `line`
"""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from afo_sim.common import AMBIENT_PRESSURE, STANDARD_DENSITY
from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.pneumatics import iso_6358_flow, laminar_slope, valve_flow
from afo_sim.physics.tube import tube_conductance, tube_critical_ratio

TWO_WAY, ONE_WAY, QUICK_EXHAUST, REGULATED, RELIEF, COMPRESSOR, INERTIAL = 0, 1, 2, 3, 4, 5, 6
PILOTED = (QUICK_EXHAUST,)  # need the pressure of a third node, whose number is their first parameter
AMBIENT, SUPPLY = "ambient", "supply"  # nodes whose pressures are given
LEAST_BAND = 500.0  # of a check valve without a spring: the pressure over which it opens [Pa]
HIGHEST = 12e5  # pressure for which a check valve's steepness holds [Pa]


@register_jitable
def edge_flow(
    law: float, p1: float, t1: float, p2: float, t2: float, opening: float, conductance: float,
    critical: float, numbers: Any, k: int, first: int, stride: int,
) -> float:  # fmt: skip
    """Mass flow of an edge from its origin to its end [kg/s].

    Parameters
    ----------
    law : TWO_WAY, ONE_WAY, …
    p1, t1, p2, t2 : absolute pressure [Pa] and temperature [K] at origin and end
    opening : of a valve, or whether a compressor runs [-]
    conductance, critical : C [m³/(s·Pa)], b [-]
    numbers, k : the law's parameters stand in `numbers` from k on
    first, stride : the absolute pressure of node i stands in `numbers` at first + stride × i [Pa]
    """
    if law == TWO_WAY:
        return valve_flow(p1, t1, p2, t2, opening, conductance, critical)
    if law == ONE_WAY:
        return one_way_flow(
            p1, t1, p2, t2, conductance, critical, numbers[k], numbers[k + 1], numbers[k + 2], numbers[k + 3]
        )
    if law == QUICK_EXHAUST:
        pilot = numbers[first + stride * int(numbers[k])]
        opens = ramp(p1 - pilot - numbers[k + 1], numbers[k + 2])
        return valve_flow(p1, t1, p2, t2, opens, conductance, critical)
    if law == REGULATED:
        return regulator_flow(p1, p2, t1, numbers[k], numbers[k + 1], conductance, critical)
    if law == RELIEF:
        return relief_flow(p1, p2, t1, numbers[k], numbers[k + 1], conductance, critical)
    if law == INERTIAL:
        return numbers[k + 1]
    if law == COMPRESSOR and opening > 0.5:
        return compressor_flow(p2 - AMBIENT_PRESSURE, numbers[k], 0.0, numbers[k + 1])
    return 0.0 * (p1 - p2)  # a NaN stays one


@register_jitable
def ramp(excess: float, band: float) -> float:
    """Opening of a spring-loaded seat [-]: 0 below zero excess pressure, 1 beyond the band.

    Parameters
    ----------
    excess : pressure beyond the one that cracks it [Pa]
    band : over which it opens, above 0 [Pa]
    """
    if excess <= 0.0:
        return 0.0
    if excess >= band:
        return 1.0
    return excess / band


@register_jitable
def one_way_flow(
    pressure_1: float, temperature_1: float, pressure_2: float, temperature_2: float, conductance: float,
    critical: float, free: float, free_critical: float, cracking: float, band: float,
) -> float:  # fmt: skip
    """Mass flow of a throttle with a check valve beside it; free from side 1 to side 2 [kg/s].

    Parameters
    ----------
    conductance, critical : of the throttle, open both ways; C = 0 for a check valve alone
    free, free_critical : C and b of the open check valve, which lets air from 1 to 2
    cracking, band : pressure difference that begins to open it, and over which it opens [Pa]
    """
    flow = 0.0
    if conductance > 0.0:
        flow = valve_flow(pressure_1, temperature_1, pressure_2, temperature_2, 1.0, conductance, critical)
    opening = ramp(pressure_1 - pressure_2 - cracking, band)
    if opening > 0.0:
        flow += iso_6358_flow(pressure_1, pressure_2, temperature_1, opening * free, free_critical)
    return flow


@register_jitable
def compressor_flow(
    pressure: float, delivery: float, delivery_pressure: float, stall_pressure: float
) -> float:
    """Mass flow of a running compressor, falling linearly with the pressure that it works against [kg/s].

    ṁ = ρ0 Q (p_stall − p)/(p_stall − p_Q), none above p_stall

    Parameters
    ----------
    pressure : gauge, behind the compressor [Pa]
    delivery : free air delivery Q [m³/s] (ANR)
    delivery_pressure : gauge pressure p_Q at which it delivers Q [Pa]
    stall_pressure : gauge pressure at which it delivers nothing [Pa], above p_Q
    """
    share = (stall_pressure - pressure) / (stall_pressure - delivery_pressure)
    return STANDARD_DENSITY * delivery * max(0.0, share)


@register_jitable
def compressor_runs(runs: float, pressure: float, switch_on: float, switch_off: float) -> float:
    """Whether a compressor runs, 1 or 0: on up to one pressure, off from another, between them as before.

    Parameters
    ----------
    runs : whether it ran before, 1 or 0
    pressure : gauge, in its tank [Pa]
    switch_on, switch_off : gauge [Pa], the first below the second
    """
    if pressure <= switch_on:
        return 1.0
    if pressure >= switch_off:
        return 0.0
    return runs + 0.0 * pressure  # a NaN stays one


@register_jitable
def regulator_flow(
    upstream: float, downstream: float, temperature: float, setpoint: float, gain: float, conductance: float,
    critical: float,
) -> float:  # fmt: skip
    """Mass flow through a pressure regulator with droop: it opens as the outlet's pressure falls [kg/s].

    ṁ = the lesser of k (p_set − p) and the flow of the fully open seat (ISO 6358); none at p ≥ p_set, and
    none back

    Parameters
    ----------
    upstream, downstream : absolute, before and behind it [Pa]
    temperature : before it [K]
    setpoint : p_set, absolute [Pa]
    gain : k [kg/(s·Pa)], flow by droop
    conductance, critical : C [m³/(s·Pa)] and b [-] of the fully open seat
    """
    if downstream >= setpoint or upstream <= downstream:
        return 0.0
    most = iso_6358_flow(upstream, downstream, temperature, conductance, critical)
    return min(gain * (setpoint - downstream), most)


@register_jitable
def relief_flow(
    downstream: float, ambient: float, temperature: float, opens: float, gain: float, conductance: float,
    critical: float,
) -> float:  # fmt: skip
    """Mass flow that a relieving regulator lets out of its outlet to the ambient [kg/s].

    ṁ = the lesser of k (p − p_opens) and the flow of the fully open relief; none at p ≤ p_opens

    Parameters
    ----------
    downstream : absolute, behind the regulator [Pa]
    ambient : absolute [Pa]
    temperature : behind it [K]
    opens : absolute pressure at which it opens [Pa]: the set pressure and the relief's distance from it
    gain, conductance, critical : as in `regulator_flow`, of the relief
    """
    if downstream <= opens or downstream <= ambient:
        return 0.0
    most = iso_6358_flow(downstream, ambient, temperature, conductance, critical)
    return min(gain * (downstream - opens), most)


@dataclass(frozen=True)
class FlowEdge:
    """What air flows through from `origin` to `end`, nodes by name: all or one way of a part.

    conductance, critical_ratio : C [m³/(s·Pa)], b [-]
    law : TWO_WAY, ONE_WAY, …
    parameters : up to four, of the law
    steepness : largest slope of the flow by a pressure difference [kg/(s·Pa)]; below 0 that of ISO 6358
    valve : a valve's own parameters, where a coil opens it
    pilot : node whose pressure the law needs too
    """

    name: str
    origin: str
    end: str
    conductance: float
    critical_ratio: float
    law: int = TWO_WAY
    parameters: tuple[float, ...] = ()
    steepness: float = -1.0
    valve: Mapping[str, Any] | None = None
    pilot: str = ""

    @property
    def forth(self) -> float:
        """Sonic conductance from `origin` to `end`, all open [m³/(s·Pa)]."""
        return self.conductance + self.parameters[0] if self.law == ONE_WAY else self.conductance

    @property
    def ratio_forth(self) -> float:
        """Critical pressure ratio from `origin` to `end` [-]; of a throttle's check valve."""
        return self.parameters[1] if self.law == ONE_WAY else self.critical_ratio

    @property
    def back(self) -> float:
        """Sonic conductance from `end` to `origin`, all open [m³/(s·Pa)]."""
        return self.conductance if self.law in (TWO_WAY, ONE_WAY, INERTIAL) else 0.0

    @property
    def steepest(self) -> float:
        """Largest slope of the flow by a pressure difference [kg/(s·Pa)], as given or of its ISO 6358 law."""
        if self.steepness >= 0.0:
            return self.steepness
        return laminar_slope(self.conductance, self.critical_ratio) if self.conductance > 0.0 else 0.0

    def times(self, factor: float) -> "FlowEdge":
        """The same for a gas of which so many times as much flows."""
        parameters, steepness, valve = self.parameters, self.steepness, self.valve
        if self.law == ONE_WAY:
            parameters = (factor * parameters[0], *parameters[1:])
        elif self.law in (REGULATED, RELIEF):  # a seat that is as far open
            parameters = (parameters[0], factor * parameters[1])
        if valve is not None:
            valve = {**valve, "conductance": factor * valve["conductance"]}
        return dataclasses.replace(
            self,
            conductance=factor * self.conductance,
            parameters=parameters,
            steepness=steepness if steepness < 0.0 else max(factor, 1.0) * steepness,
            valve=valve,
        )


def line(name: str, origin: str, end: str, bore: float, length: float, parts: int = 1) -> FlowEdge:
    """A tube whose air has inertia, that of 5 cm at least, by its inner diameter and length [m].

    Of one of some equal parts in series: each has its share of the friction, C goes with √parts.
    """
    c, b = parts**0.5 * tube_conductance(bore, length * parts), tube_critical_ratio(bore, length * parts)
    return FlowEdge(name, origin, end, c, b, INERTIAL, (0.25 * math.pi * bore**2 / max(length, 0.05),), 0.0)


def check_valve(
    name: str, origin: str, end: str, conductance: float, critical_ratio: float, *, cracking: float,
    throttle: float = 0.0, throttle_ratio: float = 0.3,
) -> FlowEdge:  # fmt: skip
    """A check valve that lets air from origin to end, with a throttle beside it that is open both ways.

    It opens over a band as wide as its cracking pressure, at least `LEAST_BAND`.
    """
    band = max(cracking, LEAST_BAND)
    # at a difference Δp in the band: C ρ p Δp/band, and the elliptic flow's slope; p up to the highest supply
    opening = conductance * STANDARD_DENSITY * HIGHEST / band
    steep = opening + laminar_slope(conductance, critical_ratio)
    if throttle > 0.0:
        steep += laminar_slope(throttle, throttle_ratio)
    parameters = (conductance, critical_ratio, cracking, band)
    return FlowEdge(name, origin, end, throttle, throttle_ratio, ONE_WAY, parameters, steep)


def quick_exhaust(
    name: str, origin: str, pilot: str, conductance: float, critical_ratio: float, *, cracking: float
) -> FlowEdge:
    """The way out of a quick exhaust: from origin to ambient air while the pilot's pressure is lower."""
    band = max(cracking, LEAST_BAND)
    # two pressures open it: its own node's and the pilot's
    steep = 2.0 * conductance * STANDARD_DENSITY * HIGHEST / band + laminar_slope(conductance, critical_ratio)
    parameters = (0.0, cracking, band)
    return FlowEdge(
        name, origin, AMBIENT, conductance, critical_ratio, QUICK_EXHAUST, parameters, steep, pilot=pilot
    )


def regulator(
    name: str, origin: str, end: str, conductance: float, critical_ratio: float, *, setting: float,
    per_droop: float,
) -> FlowEdge:  # fmt: skip
    """A pressure regulator whose outlet is at `setting` (gauge) without flow; per_droop [kg/(s·Pa)]."""
    steep = per_droop + laminar_slope(conductance, critical_ratio)
    parameters = (setting + AMBIENT_PRESSURE, per_droop)
    return FlowEdge(name, origin, end, conductance, critical_ratio, REGULATED, parameters, steep)


def relief(
    name: str, origin: str, conductance: float, critical_ratio: float, *, limit: float, per_excess: float
) -> FlowEdge:
    """A relief from origin to ambient air that opens above a gauge pressure; per_excess [kg/(s·Pa)]."""
    steep = per_excess + laminar_slope(conductance, critical_ratio)
    parameters = (limit + AMBIENT_PRESSURE, per_excess)
    return FlowEdge(name, origin, AMBIENT, conductance, critical_ratio, RELIEF, parameters, steep)


def compressor(
    name: str, end: str, *, free_air: float, stall: float, starts: float, stops: float
) -> FlowEdge:
    """A compressor into a tank: free air delivery at no gauge pressure [m³/s], and gauge pressures [Pa]."""
    parameters = (free_air, stall, starts, stops)
    return FlowEdge(name, AMBIENT, end, 0.0, 0.0, COMPRESSOR, parameters, STANDARD_DENSITY * free_air / stall)
