"""A metric of a user's own: a function of columns, with a unit, which stands beside those of the package."""

import dataclasses
import functools
import math
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Literal

import numpy as np

from afo_sim.common import InputError, Keywords, Mixed, Notice, place_of, register, takes, unknown
from afo_sim.metrics import metric as registry
from afo_sim.metrics.facts import Columns, Run, cut
from afo_sim.metrics.metric import METRICS, REPORTED, YOURS, Found, Metric, MetricEntry, Of
from afo_sim.metrics.strides import Stride

Function = Callable[[Mixed], float]
OWN: dict[str, "OwnMetric"] = {}  # by name
_SAID: set[tuple["OwnMetric", str]] = set()  # metrics whose failure at a place was warned of
# By name, what is said of those that fail and are NaN; None where their errors are raised
_FAILED: ContextVar[dict[str, Notice] | None] = ContextVar("failed")


@dataclass(frozen=True, kw_only=True)
class OwnMetric(MetricEntry):
    """A metric of a user's own. Called with columns [SI], it gives what its function does."""

    function: Function  # of columns [SI]

    def __call__(self, columns: Mixed) -> float:
        return self.function(columns)

    def value(self, columns: Columns) -> float:
        """Its value in its unit; where its function fails, `failures` decides."""
        try:
            found = self.function(cut(columns, np.array))  # copies: others read these rows, too
            return float(found.to(self.unit) if isinstance(found, Metric) else found)
        except Exception as error:  # of the user's code
            place, failed = place_of(error, self.function), _FAILED.get({})
            if failed is None:
                error.add_note(f"in the metric {self.name}, {place}")
                raise
            text = "the metric {subject} is undefined, since it failed at {place}: {error}"
            what = f"{type(error).__name__}: {error}"
            failed[self.name] = Notice("own-metric-failed", text, subject=self.name, place=place, error=what)
            if (self, place) not in _SAID:  # once, and not of each case
                _SAID.add((self, place))
                warnings.warn(failed[self.name], stacklevel=2)
            return math.nan


def metric(
    name: str, unit: str, label: str, meaning: str = "", *, of: Literal["stride", "run"] = "stride"
) -> Callable[[Function], OwnMetric]:
    """Make a function a metric, for `register` or the `metrics` of a run, sweep or uncertainty.

    The function gets columns by name, `columns["ankle/angle"]` [SI] (n,): those of a recording without its
    sensors, at every time step. It returns a number in `unit`, NaN if undefined.

    Parameters
    ----------
    name : letters, digits and underscores
    unit : such as "deg", "N*m", "percent"; "" of a bare number
    label, meaning : its label in tables, and an explanation for lists
    of : "stride" gets each complete stride, and a run's value is the mean of the counted ones, as of
        the package's own; "run" gets all that count, in a row. Where nobody walks, both get the whole run

    Returns
    -------
    OwnMetric; calling it with a recording calls the function

    Raises
    ------
    InputError
        At registration: its name is invalid or taken, or its unit unknown.

    Examples
    --------
    >>> @metric("mean_angle", "deg", "Ankle angle, mean")
    ... def mean_angle(columns):
    ...     return np.degrees(columns["ankle/angle"].mean())
    >>> print(run("seated", {"duration": "1 s"}, metrics=[mean_angle]).metrics["mean_angle"].unit)
    deg
    """
    facts: Keywords = {"name": name, "unit": unit, "label": label, "meaning": meaning, "of": of}
    return lambda function: OwnMetric(group=YOURS, **facts, function=function)


def named(metrics: Iterable[str | OwnMetric], field: str = "metrics") -> tuple[str, ...]:
    """The names of metrics, of which those of a user's own are registered."""
    if isinstance(metrics, str):
        raise InputError("is one text, not a list", field=field, value=metrics, allowed=f"[{metrics!r}]")
    found = tuple(metrics)
    for each in found:
        if not isinstance(each, str | OwnMetric):
            problem, allowed = "is no metric", "a name, or what afo_sim.metric(name, unit, label) makes of it"
            raise InputError(problem, field=field, value=each, allowed=allowed)
    register(*(each for each in found if isinstance(each, OwnMetric)))
    return tuple(each.name if isinstance(each, OwnMetric) else each for each in found)


@contextmanager
def failures(*, raised: bool = False) -> Iterator[dict[str, Notice]]:
    """Collect errors of users' metrics, which are then NaN; or have them raised."""
    failed: dict[str, Notice] = {}
    token = _FAILED.set(None if raised else failed)
    try:
        yield failed
    finally:
        _FAILED.reset(token)


def _add(own: OwnMetric) -> None:
    """Put a metric among those of the package, in the place of an older one of its name."""
    if own is OWN.get(own.name):
        return
    taken = own.name not in OWN and (registry.known(own.name) or registry.instead(own.name, ()))
    if taken or not own.name.isidentifier():
        problem = "names one of the package's, or did" if taken else "is no name of a metric"
        raise InputError(problem, field="name", value=own.name, allowed="letters, digits, _: my_mean_angle")
    if own.of not in ("stride", "run"):
        raise unknown(own.of, ("stride", "run"), field="of")
    Metric(1.0, own.unit).to(own.unit)  # refuses a unit that is none

    def of_run(run: Run) -> Found:
        if run.rows and not (own.of == "stride" and run.facts.walks):
            yield own.name, own.value(run.rows)

    def of_stride(stride: Stride) -> Found:
        yield own.name, own.value(cut(stride.columns, lambda values: values[stride.rows]))

    for function in [f for f, (row, *_) in REPORTED.items() if row.name == own.name]:
        del REPORTED[function]
    for function, of in ((of_run, Of.RUN), (of_stride, Of.STRIDE))[: 2 if own.of == "stride" else 1]:
        REPORTED[functools.wraps(own.function)(function)] = [dataclasses.replace(own, of=of)]
    from afo_sim.metrics.metric_words import WORDS  # which loads this module

    OWN[own.name] = METRICS[own.name] = WORDS[own.name] = own
    for cached in (registry.functions_of, registry.reporting, registry.known, registry.unit_of):
        cached.cache_clear()


takes(OwnMetric, _add)
