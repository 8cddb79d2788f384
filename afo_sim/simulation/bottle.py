"""Air that the scenario's source gives, or a bottle, and how long walking lasts on it."""

from collections.abc import Iterator, Mapping

import numpy as np

from afo_sim.common.units import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT, STANDARD_DENSITY
from afo_sim.description.air.source import Source
from afo_sim.description.scenario import Scenario
from afo_sim.metrics.bottle import bottle_metrics as metrics_of
from afo_sim.metrics.bottle import compressor_metrics, cycle_metrics
from afo_sim.metrics.metric import Metric, measured
from afo_sim.metrics.supply import sag_metrics
from afo_sim.model.air_path import SOURCE
from afo_sim.model.build import Built
from afo_sim.model.start import content_at_start
from afo_sim.physics.gas import AIR, Gas
from afo_sim.physics.store import TRIPLE_TEMPERATURE

WALKED = frozenset({"free_air_per_stride", "stride_time"})
FLOWS = frozenset({"mean_flow", "peak_flow"})
NEEDED: dict[str, frozenset[str]] = {
    "free_air_per_minute": WALKED,
    "strides_per_bottle": WALKED,
    "hours_per_bottle": WALKED,
    "cycles_per_bottle": frozenset(),
    **dict.fromkeys(("source_share", "source_share_peak", "compressor_duty", "compressor_power"), FLOWS),
}
LITRES_A_MINUTE = 60e3  # of a flow [m³/s]
# Dry air at 20 °C, computed with CoolProp 8.0 from the equation of state of Lemmon, Jacobsen, Penoncello and
# Friend 2000 (J. Phys. Chem. Ref. Data 29: 331).
COMPRESSIBILITY = {  # by absolute pressure [bar]
    0: 1.0, 50: 0.9879, 100: 0.9881, 150: 1.001, 200: 1.026, 250: 1.0612, 300: 1.1043, 400: 1.2056,
    500: 1.3183, 600: 1.436, 700: 1.5557, 800: 1.6758, 900: 1.7956, 1000: 1.9146, 1100: 2.0325,
}  # fmt: skip


def gas_of(scenario: Scenario) -> Gas:
    """The gas that a scenario's orthosis is driven with."""
    source = None if scenario.supply is None else scenario.supply.source
    return AIR if source is None else source.real_gas


def bottle_metrics(
    built: Built,
    totals: Mapping[str, Metric],
    columns: Mapping[str, np.ndarray] | None = None,
    *,
    solved: bool = False,
) -> dict[str, Metric]:
    """Metrics of a run's air against the scenario's source; against the bottle of its limits without one.

    Notes
    -----
    A named source gives the run's mean flow and cools. Where it is empty within a run that is walked, its
    life is until then: the mean of a run on too little pressure says nothing.
    """
    scenario, rows = built.scenario, {} if columns is None or solved else columns
    source = scenario.supply.source
    litres = _litres(built, totals, rows)
    told = _of_compressor(source, scenario.supply.pressure, totals) if source is not None else {}
    if litres is None and source is None:
        return {}
    if totals.keys() >= WALKED:
        free, duration = totals["free_air_per_stride"].value, totals["stride_time"].value
        return told | metrics_of(free, duration, litres)
    if litres is None or not totals.keys() >= {"mean_flow", "air_per_cycle"}:
        return told
    free = totals["air_per_cycle"].value / gas_of(scenario).free_density
    flow = totals["mean_flow"].value
    return told | (cycle_metrics(free, free / flow, litres) if flow > 0.0 else {})


def emptied(scenario: Scenario, totals: Mapping[str, Metric], strides: int) -> dict[str, Metric]:
    """When bottle or cartridge is empty in a walk whose settled strides are solved for, with a fuller one."""
    lasts = totals.get("strides_per_bottle")
    if scenario.supply.source is None or lasts is None or lasts.value >= strides:
        return {}
    after = lasts.value * totals["stride_time"].value
    return {"source_empty_after": measured("source_empty_after", after)}


def until_empty(totals: Mapping[str, Metric]) -> dict[str, Metric]:
    """Strides and hours of a source that the run itself empties: those until then."""
    if not totals.keys() >= {"source_empty_after", "strides_per_bottle", "stride_time"}:
        return {}
    after, stride = totals["source_empty_after"].value, totals["stride_time"].value
    return {
        "strides_per_bottle": measured("strides_per_bottle", after / stride),
        "hours_per_bottle": measured("hours_per_bottle", after / 3600.0),
    }


def short_warning(built: Built, columns: Mapping[str, np.ndarray]) -> Iterator[str]:
    """A warning where bottle or cartridge has too little left when the walk begins."""
    name, source = f"store/{SOURCE}/pressure", built.scenario.supply.source
    if name not in columns or source is None or columns["time"][0] > built.scenario.timestep:
        return
    left, needed = float(columns[name][0]), built.scenario.supply.pressure
    if left < needed:
        yield (
            f"source: filling chambers and volumes before the first step takes so much out of "
            f"{source.name or source.kind} that {1e-5 * left:.2g} bar are left of the {1e-5 * needed:g} bar "
            "that are needed: a larger source, smaller volumes, or volumes filled from elsewhere"
        )


def cold_warning(built: Built, columns: Mapping[str, np.ndarray]) -> Iterator[str]:
    """A warning where carbon dioxide would freeze, of which the store's kernels know nothing."""
    name, source = f"store/{SOURCE}/temperature", built.scenario.supply.source
    if name not in columns or source is None or not source.real_gas.liquefies:
        return
    frozen = columns[name] < TRIPLE_TEMPERATURE
    if frozen.any():
        begun = float(columns["time"][np.argmax(frozen)])
        yield (
            f"source: {source.name or source.kind} is below {TRIPLE_TEMPERATURE:g} K from {begun:.3g} s on, "
            "where carbon dioxide is dry ice: its pressure and what follows from it hold no more"
        )


def _litres(built: Built, totals: Mapping[str, Metric], rows: Mapping[str, np.ndarray]) -> float | None:
    """Free gas (ANR) that the source gives, or the limits' bottle [l]; None of a compressor, or neither."""
    scenario = built.scenario
    source, limits, pressure = scenario.supply.source, scenario.limits, scenario.supply.pressure
    if source is not None:
        flow = _mean_flow(totals)  # [l/s]
        if source.kind == "compressor" or not flow > 0.0:
            return None
        empty = dict(sag_metrics(rows)).get("source_empty_after")
        if empty is not None:
            return flow * empty
        litre = 1e-3 * source.real_gas.free_density  # [kg]
        return source.given_at(pressure, flow * litre, _content(built, rows)) / litre
    if limits is None:
        return None
    return 1e3 * air_given(limits.bottle_volume, limits.bottle_pressure, pressure) / STANDARD_DENSITY


def _mean_flow(totals: Mapping[str, Metric]) -> float:
    """Free gas that a run takes in a second [l/s]; 0 where it is not told."""
    if totals.keys() >= WALKED:
        return totals["free_air_per_stride"].value / totals["stride_time"].value
    return totals["mean_flow"].value / 60.0 if "mean_flow" in totals else 0.0


def _content(built: Built, rows: Mapping[str, np.ndarray]) -> float:
    """What bottle or cartridge holds as the walk begins [kg]: full, less what was filled before."""
    name = f"store/{SOURCE}/mass"
    if name in rows and rows["time"][0] <= built.scenario.timestep:
        return float(rows[name][0])
    source = built.scenario.supply.source
    assert source is not None
    return content_at_start(built) if built.walk is not None else source.full_mass


def _of_compressor(source: Source, pressure: float, totals: Mapping[str, Metric]) -> dict[str, Metric]:
    """What is asked of a compressor; nothing of other sources."""
    if source.kind != "compressor" or not totals.keys() >= FLOWS:
        return {}
    mean, peak = totals["mean_flow"].value, totals["peak_flow"].value
    flow = mean / LITRES_A_MINUTE * STANDARD_DENSITY
    delivery = source.delivery(pressure) * LITRES_A_MINUTE / STANDARD_DENSITY
    return compressor_metrics(mean, peak, delivery, source.duty(flow), source.electric_power)


def air_given(volume: float, pressure: float, supply: float) -> float:
    """Air that a full bottle gives until it is down to the supply's pressure [kg].

    Notes
    -----
    m = V/(R T) · (p₁/Z(p₁) − p₂/Z(p₂)), absolute pressures, at 20 °C: it is emptied slowly enough to stay
    warm.

    Units: volume [m³], pressure [Pa], supply [Pa].
    """
    full, left = (p / compressibility(p) for p in (pressure + AMBIENT_PRESSURE, supply + AMBIENT_PRESSURE))
    return max(0.0, volume / (GAS_CONSTANT * AMBIENT_TEMPERATURE) * (full - left))


def compressibility(pressure: float) -> float:
    """Z = p V/(m R T) of dry air at 20 °C [-], within 0.2 %.

    Units: pressure [Pa].
    """
    return float(np.interp(1e-5 * pressure, list(COMPRESSIBILITY), list(COMPRESSIBILITY.values())))
