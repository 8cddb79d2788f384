"""Air by the minute, the strides and hours that a source lasts, and a compressor's duty."""

from collections.abc import Mapping

import numpy as np

from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT, STANDARD_DENSITY
from afo_sim.metrics.air_per_stride import sag_metrics
from afo_sim.metrics.facts import Run, Source
from afo_sim.metrics.metric import AIR, Found, Metric, Of, all_measured, reported

ANR = "ANR: at 20 °C, 1 bar, 65 % humidity (ISO 8778)"
SOURCE = (
    "on the air that the scenario's source gives as it cools, or without a source on the full bottle of its "
    "limits, down to the supply's pressure"
)
BEFORE = "air before the first step comes out of a source, not out of the limits' bottle"
MASS = "store/source/mass"
WALKED = ("free_air_per_stride", "stride_time")
FLOWS = ("mean_flow", "peak_flow")
LITRES_A_MINUTE = 60e3  # of a flow [m³/s]
# Dry air at 20 °C, computed with CoolProp 8.0 from the equation of state of Lemmon, Jacobsen, Penoncello and
# Friend 2000 (J. Phys. Chem. Ref. Data 29: 331).
COMPRESSIBILITY = {  # by absolute pressure [bar]
    0: 1.0, 50: 0.9879, 100: 0.9881, 150: 1.001, 200: 1.026, 250: 1.0612, 300: 1.1043, 400: 1.2056,
    500: 1.3183, 600: 1.436, 700: 1.5557, 800: 1.6758, 900: 1.7956, 1000: 1.9146, 1100: 2.0325,
}  # fmt: skip


@reported(
    AIR,
    ("free_air_per_minute", "l/min", "Free air per minute of walking", f"litres {ANR}"),
    ("strides_per_bottle", "", "Strides from one bottle", f"walked without a stop, {SOURCE}; {BEFORE}"),
    ("hours_per_bottle", "h", "Hours from one bottle", f"without a stop, {SOURCE}; {BEFORE}"),
    of=Of.RUN,
    made_of=WALKED,
)
@reported(AIR, ("cycles_per_bottle", "", "Cycles from one bottle", f"seated, {SOURCE}"), of=Of.RUN)
def source_life(run: Run) -> Found:
    """Air that a run takes, and how long the scenario's source lasts at that, or a bottle of its limits."""
    litres, totals = _litres(run), run.totals
    if litres is None and run.facts.supply.source is None:
        return
    if totals.keys() >= set(WALKED):
        free, duration = totals["free_air_per_stride"].value, totals["stride_time"].value
        yield from bottle_metrics(free, duration, litres)
    elif litres is not None and totals.keys() >= {"mean_flow", "air_per_cycle"}:
        free = totals["air_per_cycle"].value / run.facts.supply.free_density
        flow = totals["mean_flow"].value
        if flow > 0.0:
            yield from cycle_metrics(free, free / flow, litres)


def _litres(run: Run) -> float | None:
    """Free gas (ANR) that the source gives, or the limits' bottle [l]; None of a compressor, or neither."""
    supply, limits, totals = run.facts.supply, run.facts.limits, run.totals
    if supply.source is not None:
        flow = totals["mean_flow"].value / 60.0 if "mean_flow" in totals else 0.0  # free gas [l/s]
        if totals.keys() >= set(WALKED):
            flow = totals["free_air_per_stride"].value / totals["stride_time"].value
        if supply.source.kind == "compressor" or not flow > 0.0:
            return None
        empty = None if run.solved else dict(sag_metrics(run.columns)).get("source_empty_after")
        if empty is not None:
            return flow * empty
        litre, rows = 1e-3 * supply.free_density, {} if run.solved else run.columns  # [kg]
        # what is in it as the walk begins: full, less what was filled before
        walks = MASS in rows and rows["time"][0] <= run.facts.timestep
        content = float(rows[MASS][0]) if walks else supply.content_at_start()
        return supply.source.given_at(supply.pressure, flow * litre, content) / litre
    if limits is None:
        return None
    return 1e3 * air_given(limits.bottle_volume, limits.bottle_pressure, supply.pressure) / STANDARD_DENSITY


@reported(
    AIR,
    ("source_share", "percent", "Mean flow of what the compressor gives",
     "of its delivery against the set pressure; beyond 100 it cannot keep up"),
    ("source_share_peak", "percent", "Peak flow of what the compressor gives",
     "of its delivery against the set pressure; what is beyond 100 comes out of its tank"),
    ("compressor_duty", "percent", "Duty of the compressor",
     "by the mean flow, filling its tank from one switching pressure to the other; bursts that pull the "
     "tank lower make it less: the run's own is the mean of supply/running"),
    ("compressor_power", "W", "Mean electric power of the compressor", "while it runs, times its duty"),
    of=Of.RUN,
    made_of=FLOWS,
)  # fmt: skip
def compressor(run: Run) -> Found:
    """Demand on a compressor; nothing for other sources."""
    supply = run.facts.supply
    if supply.source is None or supply.source.kind != "compressor" or not run.totals.keys() >= set(FLOWS):
        return
    mean, peak = (run.totals[name].value for name in FLOWS)
    flow = mean / LITRES_A_MINUTE * STANDARD_DENSITY
    delivery = supply.source.delivery(supply.pressure) * LITRES_A_MINUTE / STANDARD_DENSITY
    duty, power = supply.source.duty(flow), supply.source.electric_power
    yield from compressor_metrics(mean, peak, delivery, duty, power).items()


def emptied(source: Source | None, totals: Mapping[str, Metric], strides: int) -> dict[str, Metric]:
    """When bottle or cartridge is empty in a walk whose settled strides are solved for, with a fuller one."""
    lasts = totals.get("strides_per_bottle")
    if source is None or lasts is None or lasts.value >= strides:
        return {}
    return all_measured([("source_empty_after", lasts.value * totals["stride_time"].value)])


def until_empty(totals: Mapping[str, Metric]) -> dict[str, Metric]:
    """Strides and hours of a source that the run itself empties: those until then."""
    if not totals.keys() >= {"source_empty_after", "strides_per_bottle", "stride_time"}:
        return {}
    after, stride = totals["source_empty_after"].value, totals["stride_time"].value
    return all_measured([("strides_per_bottle", after / stride), ("hours_per_bottle", after / 3600.0)])


def bottle_metrics(free_air: float, stride_time: float, bottle: float | None) -> Found:
    """What walking takes from a bottle of air."""
    yield "free_air_per_minute", free_air * 60.0 / stride_time
    if free_air > 0.0 and bottle is not None:
        yield "strides_per_bottle", bottle / free_air
        yield "hours_per_bottle", bottle / free_air * stride_time / 3600.0


def cycle_metrics(free_air: float, minutes: float, bottle: float) -> Found:
    """What seated cycles take from a bottle of air."""
    if free_air > 0.0:
        yield "cycles_per_bottle", bottle / free_air
        yield "hours_per_bottle", bottle / free_air * minutes / 60.0


def compressor_metrics(
    mean_flow: float, peak_flow: float, delivery: float, duty: float, power: float | None
) -> dict[str, Metric]:
    """Demand on a compressor."""
    found = {"compressor_duty": 100.0 * duty}
    if delivery > 0.0:
        found["source_share"] = 100.0 * mean_flow / delivery
        found["source_share_peak"] = 100.0 * peak_flow / delivery
    if power is not None:
        found["compressor_power"] = duty * power
    return all_measured(found.items())


def air_given(volume: float, pressure: float, supply: float) -> float:
    """Air that a full bottle gives until it is down to the supply's pressure [kg]."""
    full, left = pressure + AMBIENT_PRESSURE, supply + AMBIENT_PRESSURE
    full, left = full / compressibility(full), left / compressibility(left)
    return max(0.0, volume / (GAS_CONSTANT * AMBIENT_TEMPERATURE) * (full - left))


def compressibility(pressure: float) -> float:
    """Z = p V/(m R T) of dry air at 20 °C [-], within 0.2 %."""
    return float(np.interp(1e-5 * pressure, list(COMPRESSIBILITY), list(COMPRESSIBILITY.values())))
