"""What the source of two legs is asked for: how long a bottle lasts, whether a compressor keeps up."""

from collections.abc import Mapping

import numpy as np

from afo_sim.description.air.source import Source
from afo_sim.description.air.supply import Supply
from afo_sim.description.attachment import Side
from afo_sim.description.reader import load
from afo_sim.metrics.bottle import compressor_metrics
from afo_sim.metrics.metric import Metric
from afo_sim.metrics.strides import SOLVED
from afo_sim.model.air_path import SOURCE
from afo_sim.physics.gas import AIR
from afo_sim.simulation.bottle import air_given
from afo_sim.simulation.judged import limits_of
from afo_sim.simulation.recording import Recording

SAGGING = {"lowest_supply_pressure": min, "supply_sag": max, "source_empty_after": min}  # the worse leg's

Legs = Mapping[Side, Recording]


def supply_of(legs: Legs) -> Supply:
    """The supply that both legs hang on."""
    return load("scenario", legs["right"].scenario).supply


def litres_a_minute(legs: Legs) -> float:
    """Free gas (ANR) per mass flow [(l/min)/(kg/s)]."""
    source = supply_of(legs).source
    return 60.0 * 1e3 / (AIR if source is None else source.real_gas).free_density


def on_source(
    legs: Legs,
    air: Mapping[str, float],
    means: Mapping[str, float],
    flows: Mapping[str, Metric],
    length: float | None,
) -> dict[str, Metric]:
    """What either leg and both ask of the source.

    Units: air [g], means [kg/s], length [m].
    """
    supply = supply_of(legs)
    found: dict[str, Metric] = {}
    if supply.source is not None or supply.regulator is not None:
        for name, worse in SAGGING.items():  # together it falls at least as far
            told = [leg.metrics[name] for leg in legs.values() if name in leg.metrics]
            found |= {f"{name}_alone": worse(told)} if told else {}
    if supply.source is not None and supply.source.kind == "compressor":
        return found | _on_a_compressor(supply.source, supply.pressure, means, flows)
    if length is not None:  # of whole strides; the means are of some phases of one
        stride_time = legs["right"].metrics["stride_time"].value
        means = {who: 1e-3 * grams / stride_time for who, grams in air.items()}
    seconds = {} if supply.source is None else _lasting(legs, supply.source, supply.pressure, means)
    if length is not None:
        return found | _strides(legs["right"], supply, air, length, seconds)
    return found | {f"hours_per_bottle_{who}": Metric(each / 3600.0, "h") for who, each in seconds.items()}


def _lasting(legs: Legs, source: Source, pressure: float, means: Mapping[str, float]) -> dict[str, float]:
    """How long the source lasts for either leg and for both, cooling [s]; no entry of who takes nothing.

    What a leg fills before its first step is out of it. A leg that empties it alone counts with its flow
    until then.
    """
    flow, filled, starved = dict(means), dict.fromkeys(means, 0.0), False
    for side, leg in legs.items():
        mass = leg.columns.get(f"store/{SOURCE}/mass")
        if mass is None:
            continue
        filled[side] = source.full_mass - float(mass[0])
        if "source_empty_after" in leg.metrics and not np.any(leg.columns.get(SOLVED, 0.0)):
            after, starved = float(leg.metrics["source_empty_after"]), True
            left = float(np.interp(after, leg["time"], mass))
            flow[side] = (float(mass[0]) - left) / after if after > 0.0 else 0.0
    if starved:
        flow["both"] = sum(flow[side] for side in legs)
    filled["both"] = sum(filled[side] for side in legs)
    return {
        who: source.given_at(pressure, mean, source.full_mass - filled[who]) / mean
        for who, mean in flow.items()
        if mean > 0.0
    }


def _on_a_compressor(
    source: Source, pressure: float, means: Mapping[str, float], flows: Mapping[str, Metric]
) -> dict[str, Metric]:
    found: dict[str, Metric] = {}
    delivery = source.delivery(pressure) * 60e3 / AIR.free_density
    for who, mean in means.items():
        flow, peak = flows[f"mean_flow_{who}"].value, flows[f"peak_flow_{who}"].value
        asked = compressor_metrics(flow, peak, delivery, source.duty(mean), source.electric_power)
        found |= {f"{name}_{who}": metric for name, metric in asked.items()}
    return found


def _strides(
    recording: Recording,
    supply: Supply,
    air: Mapping[str, float],
    length: float,
    seconds: Mapping[str, float],
) -> dict[str, Metric]:
    """Strides, way and hours that the source, or a bottle of the limits, lasts."""
    stride_time = recording.metrics["stride_time"].value
    hours = stride_time / 3600.0
    if supply.source is not None:
        lasts = {who: each / stride_time for who, each in seconds.items()}
    else:
        limits = limits_of(recording)
        given = 1e3 * air_given(limits.bottle_volume, limits.bottle_pressure, supply.pressure)
        lasts = {who: given / grams for who, grams in air.items() if grams > 0.0}
    found = {f"strides_per_bottle_{who}": Metric(strides, "") for who, strides in lasts.items()}
    found |= {f"way_per_bottle_{who}": Metric(strides * length, "m") for who, strides in lasts.items()}
    found |= {f"hours_per_bottle_{who}": Metric(strides * hours, "h") for who, strides in lasts.items()}
    return found | {"stride_length": Metric(length, "m")}
