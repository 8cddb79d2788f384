"""The value of a reference signal at a time."""

import bisect
import math

from afo_sim.control.observation import Observation
from afo_sim.description.control.feedback import MomentReference, PressureReference, Reference

AnyReference = Reference | MomentReference | PressureReference


def value_at(reference: AnyReference, time: float) -> float:
    """What a reference without a column asks for at a time, in its own SI unit.

    Units: time [s].
    """
    if reference.table:
        return _in_table(reference, time)
    return reference.mean + reference.amplitude * math.sin(2.0 * math.pi * cycles(reference, time))


def cycles(reference: AnyReference, time: float) -> float:
    """Cycles that the sine has made since the start.

    f(t) = f0 (f1/f0)^(t/T), so that ∫ f dt = f0 T/ln(f1/f0) ((f1/f0)^(t/T) − 1) up to T; f1 after it.
    """
    first, last, duration = reference.frequency, reference.end_frequency, reference.sweep_time
    if last is None or duration is None or last == first:
        return first * time
    growth = math.log(last / first)
    swept = first * duration / growth * math.expm1(growth * min(time, duration) / duration)
    return swept + last * max(time - duration, 0.0)


def asked(reference: AnyReference, seen: Observation) -> float:
    """What is asked for now; of a column its last sample, which is a step old."""
    return value_at(reference, seen.time) if reference.column is None else seen[reference.column]


def _in_table(reference: AnyReference, time: float) -> float:
    rows = reference.table
    after = bisect.bisect_right([row[0] for row in rows], time)
    if after in (0, len(rows)):
        return rows[max(after - 1, 0)][1]
    (start, value), (end, following) = rows[after - 1], rows[after]
    if reference.between == "hold":
        return value
    return value + (following - value) * (time - start) / (end - start)
