"""Columns of what comes out of the supply and what goes to the ambient air: flow, pressure, exergy."""

from operator import attrgetter

import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE
from afo_sim.model import OUTLET, SOURCE, Built
from afo_sim.simulation.frame import Column, Frame, edge_flow, volume_pressure

COMPRESSOR = "compressor"  # the restriction by which it fills its tank


_worn = attrgetter("index.chambers")  # of what is built: none where nothing takes air


def _set_pressure(f: Frame) -> np.ndarray:
    supply = f.built.scenario.supply
    if supply.regulator is not None:  # the input is what stands before it
        return np.full(f.n, supply.pressure)
    return f.control[:, next(iter(f.built.index.chambers.values()))]


def _pressure(f: Frame) -> np.ndarray:
    """Behind the regulator; with an ideal one the set pressure, or that of a source that has less."""
    index, supply = f.built.index, f.built.scenario.supply
    if supply.regulator is not None:
        return volume_pressure(f, index.volumes[OUTLET])
    if supply.source is not None:
        return np.minimum(_set_pressure(f), volume_pressure(f, _source(f.built)))
    return _set_pressure(f)


def _source(built: Built) -> int:
    """Actuator of the bottle, the cartridge or the compressor's tank."""
    return (built.index.stores | built.index.volumes)[SOURCE]


def _taken(f: Frame) -> np.ndarray:
    """Sum over all that draws on the supply; behind a regulator's source on that source."""
    model, supply = f.built.model, f.built.scenario.supply
    drawing = [(end.edge, end.sign) for end in native.ends_at_supply(model)]
    if supply.source is not None and supply.regulator is not None:
        at_source = native.touching(model, _source(f.built))
        drawing = [(edge, -sign) for edge, sign in at_source if not native.is_compressor(model, edge)]
    total = np.zeros(f.n)
    for edge, sign in drawing:
        total = total + sign * edge_flow(f, edge)
    return total


def _specific_of_supply(f: Frame) -> np.ndarray:
    """Flow exergy of what stands at the supply's pressure and ambient temperature, R T0 ln(p/p0) [J/kg]."""
    ratio = (_pressure(f) + AMBIENT_PRESSURE) / AMBIENT_PRESSURE
    gas = native.gas_of(f.built.model, next(iter(f.built.index.chambers.values())))
    return gas.constant * AMBIENT_TEMPERATURE * np.log(ratio)


def _exergy_vented(f: Frame) -> np.ndarray:
    """Σ ṁ [h − h0 − T0 (s − s0)] of the nodes that vent; air that comes in from outside has none."""
    total, model = np.zeros(f.n), f.built.model
    for end in native.ends_at_ambient(model):
        out = np.maximum(end.sign * edge_flow(f, end.edge), 0.0)
        if end.node < 0:
            held = _specific_of_supply(f)
        else:  # c_p (T − T0) − T0 [c_p ln(T/T0) − R ln(p/p0)] of its gas [J/kg]
            gas = native.gas_of(model, end.node)
            heat = gas.heat_capacity_ratio / (gas.heat_capacity_ratio - 1.0) * gas.constant
            mass, volume, pressure = native.read_node(model, f.rows["act"], f.rows["userdata"], end.node)
            warm = pressure * volume / (mass * gas.constant) / AMBIENT_TEMPERATURE
            pressed = gas.constant * np.log(pressure / AMBIENT_PRESSURE)
            held = AMBIENT_TEMPERATURE * (heat * (warm - 1.0 - np.log(warm)) + pressed)
        total = total + out * 0.5 * (held + np.append(held[1:], held[-1:]))
    return total


SUPPLY_COLUMNS = (
    Column("supply/pressure", "Pa", "gauge; that the device really has", _pressure, where=_worn),
    Column("supply/set_pressure", "Pa", "gauge", _set_pressure, where=_worn),
    Column("supply/mass_flow", "kg/s",
        "out of the supply: of endless air, or of bottle, cartridge or compressor's tank", _taken,
        where=_worn),
    Column("supply/exergy_flow", "W", "out of the supply; of gas at its pressure and ambient temperature",
        lambda f: _taken(f) * _specific_of_supply(f), where=_worn),
    Column("supply/running", "", "whether the compressor runs, 1 or 0",
        lambda f: native.read_running(f.built.model, f.rows["act"], f.built.index.restrictions[COMPRESSOR]),
        where=lambda built: _worn(built) and getattr(built.scenario.supply.source, "kind", "") == COMPRESSOR),
    Column("exhaust/mass_flow", "kg/s", "to the ambient air, from all nodes",
        lambda f: sum((end.sign * edge_flow(f, end.edge) for end in native.ends_at_ambient(f.built.model)),
            start=np.zeros(f.n)), where=_worn),
    Column("exhaust/exergy_flow", "W", "to the ambient air; of gas as it is in the nodes that vent",
        _exergy_vented, where=_worn),
)  # fmt: skip
