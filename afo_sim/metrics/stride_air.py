"""Air that a stride takes from the supply: its mass, flow and exergy, and the pressures of its chambers."""

import numpy as np

from afo_sim.common.units import NORMAL_DENSITY, STANDARD_DENSITY
from afo_sim.metrics.ankle import chambers
from afo_sim.metrics.metric import AIR, ENERGY, Found, Of, reported
from afo_sim.metrics.strides import Stride
from afo_sim.metrics.supply import beside_inlets, flow_metrics, rows_of

ANR = "litres ANR: at 20 °C, 1 bar, 65 % humidity (ISO 8778)"
NORMAL = "at 0 °C, 1.01325 bar, dry (DIN 1343)"
EACH = "per counted stride; of a fixed shank per cycle begun"


def grams_of(stride: Stride) -> float:
    """Air that a stride takes from the supply [g]: through the inlets, and what else leaves the supply."""
    total, names = 0.0, chambers(stride.columns)
    for name in names:
        inlet = np.maximum(stride[f"valve/{name}_inlet/mass_flow"], 0.0)
        total += 1e3 * float(inlet.sum()) * stride.timestep
    rest = beside_inlets(rows_of(stride.columns, stride.rows, names), names)
    return total + 1e3 * rest * stride.timestep


@reported(
    AIR,
    ("air_per_stride_{}", "g", "Air per stride, {}", "through its inlet, wherever from"),
    ("lowest_pressure_{}", "bar", "Lowest pressure, {}", "gauge"),
    ("air_per_stride", "g", "Air per stride", "taken from the supply"),
    ("free_air_per_stride", "l", "Free air per stride", ANR),
    ("normal_litres_per_stride", "l", "Normal litres per stride", NORMAL),
    of=Of.WORN,
)
def air_of(stride: Stride) -> Found:
    """Air that is taken from the supply, and the chambers' highest and lowest pressures."""
    pressures, total = [], grams_of(stride)
    for name in chambers(stride.columns):
        inlet = np.maximum(stride[f"valve/{name}_inlet/mass_flow"], 0.0)
        yield f"air_per_stride_{name}", 1e3 * float(inlet.sum()) * stride.timestep
        pressure = 1e-5 * stride[f"chamber/{name}/pressure"]
        pressures += [(f"peak_pressure_{name}", float(pressure.max()))]
        pressures += [(f"lowest_pressure_{name}", float(pressure.min()))]
    yield "air_per_stride", total
    yield "free_air_per_stride", total / stride.free_density  # 1 g/l = 1 kg/m³
    yield "normal_litres_per_stride", total / (NORMAL_DENSITY * (stride.free_density / STANDARD_DENSITY))
    yield from pressures


@reported(
    AIR,
    ("air_per_hour", "g/h", "Air per hour", "taken from the supply, walking or moving without a stop"),
    ("free_air_per_hour", "l/h", "Free air per hour", ANR),
    ("mean_flow", "l/min", "Mean flow from the supply", f"{ANR}; of what is counted, also seated"),
    ("peak_flow", "l/min", "Peak flow from the supply", f"of an instant, {ANR}"),
    of=Of.WORN,
)
@reported(
    ENERGY,
    (
        "exergy_taken",
        "J",
        "Exergy of the air taken",
        f"m R T0 ln(p/p0) at the pressure of the supply, behind its regulator; {EACH}",
    ),
    (
        "exergy_vented",
        "J",
        "Exergy of the air vented",
        f"as it is in the chamber or volume that it leaves; {EACH}",
    ),
    ("positive_work", "J", "Positive work on the ankle", f"of the orthosis' torque; {EACH}"),
    of=Of.WORN,
)
def flow_of(stride: Stride) -> Found:
    """Flow and exergy of a stride's air, by the hour and by the minute."""
    names = chambers(stride.columns)
    yield from flow_metrics(
        rows_of(stride.columns, stride.rows, names),
        names,
        grams_of(stride),
        stride.timestep,
        seconds=stride.duration,
        free_density=stride.free_density,
    )
