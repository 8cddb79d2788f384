"""What a device takes from its supply: air of a stride and by the hour, flow, exergy, how far it sags."""

from collections.abc import Mapping, Sequence

import numpy as np

from afo_sim.common import NORMAL_DENSITY, STANDARD_DENSITY, Doubles
from afo_sim.metrics import peak
from afo_sim.metrics.facts import Run
from afo_sim.metrics.kernel import SILENT, R, S, base, block, has, kernel, plan, told
from afo_sim.metrics.metric import AIR, ENERGY, Found, Metric, Of, all_measured, reported
from afo_sim.metrics.needed_torque import work
from afo_sim.metrics.strides import ORTHOSIS, SET_PRESSURE, Stride, emptied_at
from afo_sim.metrics.window import Window, rectified
from afo_sim.physics import register_jitable

CYCLE = "per whole cycle, the first filling in it, or over a run that is shorter"
EACH = f"per counted stride; of a fixed shank {CYCLE}"
FLOW, PRESSURE, SET = "supply/mass_flow", "supply/pressure", SET_PRESSURE

Rows = Mapping[str, np.ndarray]


@register_jitable
def _taken(b: Doubles) -> int:
    """Write the flow out of the supply [kg/s]; what is pushed back into it is not given back. Where to."""
    to, first, end = base(b, R.one), int(b[S.first]), int(b[S.end])
    for k in range(first, end):
        b[to + k] = 0.0
    for source in range(1 if has(b, R.flow) else int(b[S.chambers])):
        flow = base(b, R.flow) if has(b, R.flow) else base(b, R.chambers + 2 * source)
        for k in range(first, end):
            b[to + k] += rectified(b[flow + k])
    return to


def bill(
    columns: Rows, timestep: float, part: Window, cycles: int = 1, free_density: float = STANDARD_DENSITY
) -> dict[str, float]:
    """Air, flow, exergy and work of a run's stretch of some cycles, by the names that a stride has."""
    planned, rows = plan((air_of, flow_of), tuple(columns)), len(columns[ORTHOSIS])
    given = 0, rows, 0, timestep, 1.0, free_density, cycles, part.start, part.end
    made = block(columns, slice(None), planned.reads, given)
    steps = base(made, R.steps)
    made[steps : steps + rows] = timestep * part.shares(0, rows)
    found = told(planned.calls, made, len(planned.names))
    return {name: value for name, value in zip(planned.names, found, strict=True) if value != SILENT}


@reported(
    AIR,
    ("lowest_supply_pressure", "bar", "Lowest pressure of the supply",
     "gauge, over the run; a sweep of settled walks has their settled strides alone"),
    ("supply_sag", "percent", "Sag of the supply",
     "at most below its set pressure, of that; over the run as its lowest pressure"),
    ("source_empty_after", "s", "Source empty after",
     "from the run's start until bottle or cartridge has less than the set pressure; only where it does"),
    ("strides_without_air", "", "Counted strides on an empty source", "only where no stride before counts"),
    of=Of.RUN,
)  # fmt: skip
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
    ("exergy_efficiency", "percent", "Efficiency of the air",
     "net work of the muscles on the skeleton, as a share of the exergy taken"),
    ("exergy_efficiency_positive", "percent", "Efficiency of the air, positive work",
     "positive work on the joint, of the exergy taken"),
    of=Of.RUN,
    made_of=("exergy_taken", "positive_work", "skeleton_work"),
)  # fmt: skip
def efficiency(run: Run) -> Found:
    """What becomes of the exergy taken; nothing where none is taken or it is not known."""
    totals = run.totals
    exergy = float(totals.get("exergy_taken", 0.0))
    if exergy <= 0.0:
        return
    of = {"exergy_efficiency": "skeleton_work", "exergy_efficiency_positive": "positive_work"}
    yield from ((name, 100.0 * float(totals[part]) / exergy) for name, part in of.items() if part in totals)


ANR = "litres ANR: at 20 °C, 1 bar, 65 % humidity (ISO 8778)"
NORMAL = "at 0 °C, 1.01325 bar, dry (DIN 1343)"


@reported(
    AIR,
    ("air_per_stride_{}", "g", "Air per stride, {}", "through its inlet, wherever from"),
    ("peak_pressure_{}", "bar", "Peak pressure, {}", "gauge"),
    ("lowest_pressure_{}", "bar", "Lowest pressure, {}", "gauge"),
    ("air_per_stride", "g", "Air per stride", "taken from the supply"),
    ("free_air_per_stride", "l", "Free air per stride", ANR),
    ("normal_litres_per_stride", "l", "Normal litres per stride", NORMAL),
    of=Of.WORN,
)
@kernel(R.flow, R.chambers)
def air_of(b: Doubles, out: Doubles) -> float:
    """Air that is taken from the supply, and the chambers' highest and lowest pressures."""
    first, end, steps, grams, total = int(b[S.first]), int(b[S.end]), base(b, R.steps), 1e3 / b[S.cycles], 0.0
    flow = _taken(b)
    for k in range(first, end):
        total += grams * b[flow + k] * b[steps + k]
    out[0], out[1] = total, total / b[S.density]  # 1 g/l = 1 kg/m³
    out[2] = total / (NORMAL_DENSITY * (b[S.density] / STANDARD_DENSITY))
    for chamber in range(int(b[S.chambers])):
        inlet, pressure = base(b, R.chambers + 2 * chamber), base(b, R.chambers + 2 * chamber + 1) + first
        through, to = 0.0, 3 + 3 * chamber
        for k in range(first, end):
            through += grams * rectified(b[inlet + k]) * b[steps + k]
        out[to], out[to + 1] = through, 1e-5 * peak.greatest(b, pressure, end - first, 1.0)
        out[to + 2] = -1e-5 * peak.greatest(b, pressure, end - first, -1.0)
    return 0.0


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
    ("exergy_taken", "J", "Exergy of the air taken",
     f"m R T0 ln(p/p0) at the pressure of the supply, behind its regulator; {EACH}"),
    ("exergy_vented", "J", "Exergy of the air vented",
     f"as it is in the chamber or volume that it leaves; {EACH}"),
    ("positive_work", "J", "Positive work on the joint", f"of the orthosis' torque; {EACH}"),
    of=Of.WORN,
)  # fmt: skip
@kernel(R.flow, R.exergy, R.vented, R.chambers, R.orthosis, R.angle)
def flow_of(b: Doubles, out: Doubles) -> float:
    """Exergy and positive work of a stride's air, and its flow by the hour and by the minute."""
    first, end, steps, flow = int(b[S.first]), int(b[S.end]), base(b, R.steps), _taken(b)
    taken, given = base(b, R.exergy), base(b, R.vented)
    seconds = grams = exergy = vented = 0.0
    for k in range(first, end):
        seconds, grams = seconds + b[steps + k], grams + 1e3 * b[flow + k] * b[steps + k]
        exergy += rectified(b[taken + k]) * b[steps + k]
        vented += rectified(b[given + k]) * b[steps + k]
    if has(b, R.exergy):
        out[0], out[1] = exergy / b[S.cycles], vented / b[S.cycles]
    litres, length = grams / b[S.density], peak.WINDOW / b[S.timestep]
    out[3], out[4], out[5] = 3600.0 * grams / seconds, 3600.0 * litres / seconds, 60.0 * litres / seconds
    out[6] = 60e3 / b[S.density] * peak.highest_step(b, flow + first, end - first, length, 1.0)
    done, _, _ = work(b, R.orthosis, R.angle, b[S.start], b[S.stop])
    out[2] = done * b[S.mass] / b[S.cycles]
    return 0.0
