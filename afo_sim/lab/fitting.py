"""`afo_sim.fit`: laws to points of a muscle, a scenario to a log, a worn orthosis to torques."""

import os
from collections.abc import Mapping, Sequence
from typing import overload

from afo_sim.common import Given, InputError, JsonMapping, Keywords, Mixed, TableLike
from afo_sim.description import Orthosis, Scenario
from afo_sim.lab.law_result import StaticFit, fit_laws
from afo_sim.lab.run_fit import FitRun, fit_run
from afo_sim.lab.solution import Progress
from afo_sim.lab.torque_fit import USUAL_FIT, TorqueFit, fit_torque

Described = str | os.PathLike[str] | JsonMapping
OPTIONS = {  # of each fit, beside `data`, `free`, `hold_out` and `progress`
    "law": ("law", "test", "fixed", "facts", "loss", "like"),
    "scenario": ("scenario", "sets", "noise"),
    "orthosis": ("orthosis", "chamber", "torque", "rates"),
}


@overload
def fit(
    data: TableLike, *, law: str = ..., free: Sequence[str] = ..., hold_out: str | None = ...,
    test: TableLike = ..., fixed: Mapping[str, object] | None = ..., facts: Mapping[str, object] | None = ...,
    loss: str | None = ..., like: str | None = ..., progress: Progress | None = ...,
) -> StaticFit: ...  # fmt: skip
@overload
def fit(
    data: TableLike, *, scenario: Described | Scenario, free: Sequence[str] = ...,
    hold_out: float | None = ..., sets: Mapping[str, object] | None = ...,
    noise: Mapping[str, object] | None = ..., progress: Progress | None = ...,
) -> FitRun: ...  # fmt: skip
@overload
def fit(
    data: TableLike, *, orthosis: Described | Orthosis, free: Sequence[str] = ...,
    hold_out: str | TableLike = ..., chamber: str | None = ..., torque: str | None = ...,
    rates: Mapping[str, object] | None = ..., progress: Progress | None = ...,
) -> TorqueFit: ...  # fmt: skip
def fit(
    data: TableLike, *, law: str | None = None, scenario: Given = None, orthosis: Given = None,
    free: Sequence[str] | None = None, hold_out: Mixed = None, test: TableLike = None,
    fixed: Mapping[str, object] | None = None, facts: Mapping[str, object] | None = None,
    loss: str | None = None, like: str | None = None, sets: Mapping[str, object] | None = None,
    noise: Mapping[str, object] | None = None, chamber: str | None = None, torque: str | None = None,
    rates: Mapping[str, object] | None = None, progress: Progress | None = None,
) -> StaticFit | FitRun | TorqueFit:  # fmt: skip
    """Fit muscle laws to measured points, a `scenario` to its log, or an `orthosis` to static torques.

    Parameters
    ----------
    data : path to a CSV, {title with unit: array}, a pandas DataFrame of such titles; but for a scenario also
        a list of these. Of a law one for each muscle. Of an orthosis with columns `angle`, `pressure`
        (gauge), `torque`; also `group`, `chamber`, `cuff` (displacement along the pull), `time` (a log: still
        samples are taken), `path length` and `moment arm` in place of the orthosis' geometry
    scenario : the one that was logged: a shipped name, a path, or a description
    orthosis : the one that was measured: name, path or description; or {group: orthosis} if groups differ
    free : parameters to fit. Of a law beside those that it usually is fitted by; of a scenario those of
        docs/fit_run.md, without any the log is only laid over the run; of an orthosis `series_stiffness` and
        `offset` (these by default), `cuff_stiffness`, `plate_stiffness`, or a parameter of the muscle's law
    hold_out : left out to estimate the error on unseen data. For a law "all", "none", "pressure", "load",
        "curve" or "muscle"; of a scenario the share of the log's end, 0.3 by default, 0 for none; of an
        orthosis "all", "none", "group", "angle" or "pressure", or further data, only predicted
    law : name, or "all"; the default
    test : further data that are predicted, not fitted (law)
    fixed : parameters to keep, for example {"braid_angle": "24 deg"} (law)
    facts : facts on the muscle that the data lack, for example {"bore": "20 mm"} (law)
    loss : "linear", "soft_l1", "huber" or "cauchy"; the last three tolerate outliers (law)
    like : muscle that supplies what the data lack (law)
    sets : dotted keys and values laid over it (scenario)
    noise : by channel, for example {"angle": "0.5 deg"}; estimated from the log by default (scenario)
    chamber : the filled one, or its group; by default as the data state, the only one, or `dorsiflexor`
    torque : "device", the pull of the muscles alone, without the limb's weight and tissue; or "difference":
        less what is read without air, at the angles of the readings without air where there are such
    rates : of a log's still samples, by default {"angle": "2 deg/s", "pressure": "0.05 bar/s"}
    progress : called with the current task

    Returns
    -------
    StaticFit, of a scenario FitRun, of an orthosis TorqueFit

    Raises
    ------
    InputError
        A file, column, unit, name or argument is wrong or of another fit, or the data do not suffice.
    SimulationError
        The run with the start values becomes unstable.

    Examples
    --------
    >>> muscle = load("muscle", "dmsp_20")
    >>> share, bar = np.tile(np.linspace(0.0, 0.2, 9), 3), np.repeat([2.0, 3.0, 4.0], 9)
    >>> force = muscle.force(1e5 * bar, contraction=share)
    >>> data = {"pressure [bar]": bar, "contraction [-]": share, "force [N]": force}
    >>> facts = {"total_length": "30 cm", "end_length": "0 cm", "bore": "20 mm"}
    >>> fitted = fit(data, law="sarosi_2012", facts=facts, hold_out="none")
    >>> again = fitted.muscle.force("3.5 bar", contraction=0.1)
    >>> bool(abs(again - muscle.force("3.5 bar", contraction=0.1)) < 5.0)  # [N]
    True
    """
    asked = {"law": law, "test": test, "fixed": fixed, "facts": facts, "loss": loss, "like": like}
    asked |= {"scenario": scenario, "sets": sets, "noise": noise}
    asked |= {"orthosis": orthosis, "chamber": chamber, "torque": torque, "rates": rates}
    given: Keywords = {name: value for name, value in asked.items() if value is not None}
    kind = next((name for name in ("scenario", "orthosis") if name in given), "law")
    for name, value in given.items():
        whose = next(other for other, names in OPTIONS.items() if name in names)
        if whose != kind:
            problem, allowed = f"goes with a fit of `{whose}`, not of `{kind}`", ", ".join(OPTIONS[kind])
            raise InputError(problem, field=name, value=str(value), allowed=allowed)
    further = {"hold_out": hold_out, "report": progress}
    given |= {name: value for name, value in further.items() if value is not None}
    if kind == "scenario":
        return fit_run(given.pop(kind), data, free or (), **given)
    if kind == "orthosis":
        return fit_torque(data, given.pop(kind), USUAL_FIT if free is None else free, **given)
    return fit_laws(data, free=free or (), **given)
