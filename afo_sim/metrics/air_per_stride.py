"""What a device takes from its supply: air of a stride and by the hour, flow, exergy, how far it sags."""

import operator
from collections.abc import Mapping, Sequence

import numpy as np

from afo_sim.common import NORMAL_DENSITY, STANDARD_DENSITY
from afo_sim.metrics import peak
from afo_sim.metrics.facts import Run, cut
from afo_sim.metrics.metric import AIR, ENERGY, Found, Metric, Of, all_measured, reported
from afo_sim.metrics.strides import ORTHOSIS, SET_PRESSURE, Stride, chambers, emptied_at
from afo_sim.metrics.window import Window, increments

CYCLE = "per whole cycle, the first filling in it, or over a run that is shorter"
EACH = f"per counted stride; of a fixed shank {CYCLE}"
FLOW, PRESSURE, SET = "supply/mass_flow", "supply/pressure", SET_PRESSURE
EXERGY, VENTED = "supply/exergy_flow", "exhaust/exergy_flow"
INLET = "valve/{}_inlet/mass_flow"

Rows = Mapping[str, np.ndarray]


def taken(rows: Rows, chambers: Sequence[str]) -> np.ndarray:
    """Flow out of the supply [kg/s] (n,); what is pushed back into it is not given back."""
    if FLOW in rows:
        return np.maximum(rows[FLOW], 0.0)
    inlets = [np.maximum(rows[INLET.format(name)], 0.0) for name in chambers]
    return np.sum([np.zeros(len(rows[ORTHOSIS])), *inlets], axis=0)


def grams_through(rows: Rows, chamber: str, steps: np.ndarray) -> float:
    """Air through a chamber's inlet over the rows' steps [s] (n,), what runs back left out [g]."""
    return 1e3 * float(np.maximum(rows[INLET.format(chamber)], 0.0) @ steps)


def grams_taken(rows: Rows, chambers: Sequence[str], steps: np.ndarray) -> float:
    """Air that is taken from the supply over the rows' steps [s] (n,) [g]."""
    return 1e3 * float(taken(rows, chambers) @ steps)


def positive_work(columns: Rows, part: Window) -> float:
    """Positive work of the orthosis on the ankle in a stretch of a recording [J]."""
    work = increments(part.of(columns[ORTHOSIS]), part.of(columns["ankle/angle"]))
    return float(np.maximum(work, 0.0).sum())


def flow_metrics(
    rows: Rows,
    chambers: Sequence[str],
    steps: np.ndarray,
    timestep: float,
    *,
    cycles: int = 1,
    free_density: float = STANDARD_DENSITY,
) -> Found:
    """Flow and exergy of what is taken from the supply."""
    seconds, grams = float(steps.sum()), grams_taken(rows, chambers, steps)
    litres = grams / free_density  # 1 g/l = 1 kg/m³
    yield "air_per_hour", 3600.0 * grams / seconds
    yield "free_air_per_hour", 3600.0 * litres / seconds
    yield "mean_flow", 60.0 * litres / seconds
    yield "peak_flow", 60e3 / free_density * peak.flow_peak(taken(rows, chambers), timestep)
    if EXERGY in rows:
        for name, column in (("exergy_taken", EXERGY), ("exergy_vented", VENTED)):
            yield name, float(np.maximum(rows[column], 0.0) @ steps) / cycles


@reported(
    AIR,
    (
        "lowest_supply_pressure",
        "bar",
        "Lowest pressure of the supply",
        "gauge, over the run; a sweep of settled walks has their settled strides alone",
    ),
    (
        "supply_sag",
        "percent",
        "Sag of the supply",
        "at most below its set pressure, of that; over the run as its lowest pressure",
    ),
    (
        "source_empty_after",
        "s",
        "Source empty after",
        "from the run's start until bottle or cartridge has less than the set pressure; only where it does",
    ),
    ("strides_without_air", "", "Counted strides on an empty source", "only where no stride before counts"),
    of=Of.RUN,
)
def sag(run: Run) -> Found:
    """How far the supply's pressure falls, over all rows; nothing of endless air."""
    if run.facts.supply.sags:
        yield from sag_metrics(run.columns, run.counted)


def sag_metrics(columns: Rows, counted: Sequence[Stride] = ()) -> Found:
    """How far the supply's pressure falls, over all rows, and how many strides that count have no air."""
    if PRESSURE not in columns or SET not in columns:
        return
    pressure, wanted = columns[PRESSURE], columns[SET]
    yield "lowest_supply_pressure", 1e-5 * float(pressure.min())
    if wanted.min() > 0.0:
        yield "supply_sag", 100.0 * max(0.0, float(((wanted - pressure) / wanted).max()))
    if (empty := emptied_at(columns)) is not None:
        yield "source_empty_after", float(columns["time"][empty])
        if without := sum(stride.rows.stop > empty for stride in counted):
            yield "strides_without_air", float(without)


def sag_of_both(before: Rows, after: Mapping[str, Metric]) -> dict[str, Metric]:
    """The sag of a run in two parts: of a walk from the start, and of the settled strides behind it."""
    if "lowest_supply_pressure" not in after:
        return {}
    found = all_measured(sag_metrics(before))
    for name, worse in (("lowest_supply_pressure", min), ("supply_sag", max)):
        if name in found and name in after:
            found[name] = worse(found[name], after[name])
    return found


@reported(
    ENERGY,
    (
        "exergy_efficiency",
        "percent",
        "Efficiency of the air",
        "net work of the muscles on the skeleton, as a share of the exergy taken",
    ),
    (
        "exergy_efficiency_positive",
        "percent",
        "Efficiency of the air, positive work",
        "positive work on the joint, of the exergy taken",
    ),
    of=Of.RUN,
    made_of=("exergy_taken", "positive_work", "skeleton_work"),
)
def efficiency(run: Run) -> Found:
    """What becomes of the exergy taken; nothing where none is taken or it is not known."""
    totals = run.totals
    exergy = float(totals.get("exergy_taken", 0.0))
    if exergy <= 0.0:
        return
    if "skeleton_work" in totals:
        yield "exergy_efficiency", 100.0 * float(totals["skeleton_work"]) / exergy
    if "positive_work" in totals:
        yield "exergy_efficiency_positive", 100.0 * float(totals["positive_work"]) / exergy


ANR = "litres ANR: at 20 °C, 1 bar, 65 % humidity (ISO 8778)"
NORMAL = "at 0 °C, 1.01325 bar, dry (DIN 1343)"


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
    pressures, names = [], chambers(stride.columns)
    rows = cut(stride.columns, operator.itemgetter(stride.rows))
    total = grams_taken(rows, names, stride.steps)
    for name in names:
        yield f"air_per_stride_{name}", grams_through(rows, name, stride.steps)
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
    peak.row("peak_flow", "Flow from the supply", ANR, "l/min"),
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
    ("positive_work", "J", "Positive work on the joint", f"of the orthosis' torque; {EACH}"),
    of=Of.WORN,
)
def flow_of(stride: Stride) -> Found:
    """Flow and exergy of a stride's air, by the hour and by the minute."""
    names = chambers(stride.columns)
    rows = cut(stride.columns, operator.itemgetter(stride.rows))
    yield from flow_metrics(rows, names, stride.steps, stride.timestep, free_density=stride.free_density)
    yield "positive_work", positive_work(stride.columns, stride.whole)
