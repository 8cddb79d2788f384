"""Sweeps, searches and bands from Python: `afo_sim.sweep`, `afo_sim.optimise`, `afo_sim.uncertainty`."""

import dataclasses
import os
import pathlib
import tempfile
from collections.abc import Iterable, Mapping, Sequence

from afo_sim.common import Given, InputError, JsonDict
from afo_sim.description import load
from afo_sim.metrics import OwnMetric
from afo_sim.simulation import Recording
from afo_sim.simulation.run import run
from afo_sim.study import runner
from afo_sim.study.results import Results
from afo_sim.study.run_studies import UNCERTAINTY
from afo_sim.study.search import runner as search_runner
from afo_sim.study.search.best import BestDesign, best_design
from afo_sim.study.search.plan import search_of
from afo_sim.study.sweep_plan import plan_of
from afo_sim.study.uncertainty import running


def sweep(
    scenario: Given,
    parameters: Mapping[str, object],
    sets: Mapping[str, object] | None = None,
    *,
    out: str | os.PathLike[str] | None = None,
    cases: int | None = None,
    design: str = "",
    metrics: Sequence[str | OwnMetric] = (),
    constraints: Sequence[str] = (),
    seed: int = 0,
    threads: int = 0,
    spreads: str = "",
    walkers: str = "",
) -> Results:
    """Compute many cases of one scenario; if interrupted, the same call continues.

    Parameters
    ----------
    scenario : a shipped name, a path, or a Scenario
    parameters : {dotted key: list of values, or `span(lower, upper, n)`}
    sets : dotted keys and values that all cases share
    out : folder of the sweep, for resuming; by default nothing is kept
    cases : number of cases of a sampled design
    design : "grid", "list", "random", "latin-hypercube", "sobol", "saltelli" or "uncertainty"; by default the
        grid of all values, and "sobol" where the number of cases is given
    metrics : to keep, names or your own (`metric`); all by default
    constraints : such as "pressure < '3 bar'"; a column is named by the end of its key
    seed : of a sampled design
    threads : as many as processors if 0
    spreads : for the design "uncertainty", which has no parameters: a name or a TOML file
    walkers : condition whose patients respond instead of a recorded walk, a name or a TOML file

    Returns
    -------
    Results: `to_pandas`, `to_xarray`, columns by name [SI, or the metric's unit] (cases,)

    Raises
    ------
    InputError
        A key, value or metric does not exist; the folder holds another sweep.

    Examples
    --------
    >>> over = {"supply.pressure": ["2 bar", "4 bar"]}
    >>> found = sweep("seated", over, {"duration": "1 s"}, threads=1)
    >>> found["pressure"]  # [Pa]
    array([200000., 400000.])
    >>> found["range_of_motion"][1] > found["range_of_motion"][0]
    np.True_
    """
    stated = {"metrics": metrics, "constraints": constraints, "seed": seed, "spreads": spreads}
    plan = plan_of(scenario, parameters, sets, design=design, cases=cases, walkers=walkers, **stated)
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch, "study") if out is None else pathlib.Path(out)
        return runner.sweep(plan, folder, threads=threads)


def optimise(
    scenario: Given,
    parameters: Mapping[str, object],
    sets: Mapping[str, object] | None = None,
    *,
    lowest: str | OwnMetric = "",
    highest: str | OwnMetric = "",
    limits: Sequence[str] = (),
    patients: Mapping[str, object] | None = None,
    out: str | os.PathLike[str] | None = None,
    threads: int = 0,
    **options: Given,
) -> BestDesign:
    """Find the design with the lowest or highest value of a metric within limits.

    Parameters
    ----------
    scenario : a shipped name, a path, or a Scenario
    parameters : {dotted key: (lower, upper)}, with units
    sets : dotted keys and values that all designs share
    lowest, highest : name of the metric, or your own (`metric`); one of the two
    limits : such as "toe_clearance >= 10 mm"
    patients : that a design must serve, as [patients] in a search file
    out : folder of the search, for resuming; by default nothing is kept
    threads : as many as processors if 0
    options : method, generations, population, starts, seed, constraints, of, walkers, as in a file

    Returns
    -------
    BestDesign: `parameters` and `metrics` with units, `limits` that are kept, `starts`, `scenario` to run

    Raises
    ------
    InputError
        A key or metric does not exist, a limit is invalid; the folder holds another search; cma is missing.

    Examples
    --------
    >>> over = {"supply.pressure": ("2 bar", "4 bar")}
    >>> best = optimise("seated", over, {"duration": "0.3 s"}, highest="range_of_motion",
    ...                 generations=2, population=4, threads=1)
    >>> best.parameters["pressure"] > "2 bar", best.scenario.supply.pressure > 2e5  # [Pa]
    (True, True)
    """
    aim: JsonDict = {"lowest": lowest, "highest": highest, "limits": limits, "patients": patients}
    search = search_of(scenario, parameters, sets=sets, **aim, **options)
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch, "study") if out is None else pathlib.Path(out)
        return best_design(search, search_runner.optimise(search, folder, threads=threads))


def uncertainty(
    scenario: Given,
    sets: Mapping[str, object] | None = None,
    *,
    draws: int = 200,
    spreads: str = "usual",
    seed: int = 0,
    threads: int = 0,
    metrics: Iterable[OwnMetric] = (),
) -> Recording:
    """Run a walk with uncertainty bands: all uncertain inputs of orthosis and wearer varied together.

    Parameters
    ----------
    scenario : a shipped name, a path, a dict or a Scenario, of walking
    sets : dotted keys and values laid over it
    draws : number of draws, at least 20
    spreads : of the inputs: a shipped name, or a TOML file
    seed : of the draws
    threads : as many as processors if 0
    metrics : your own (`metric`), which get bands too, as do all registered ones

    Returns
    -------
    Recording, with the bands in `studies["uncertainty"]`

    Raises
    ------
    InputError
        The scenario does not walk, there are too few draws, or description or spreads are wrong.

    Examples
    --------
    >>> walk = uncertainty("walk-dropfoot-afo", {"timestep": "4 ms", "duration": "4 s"}, draws=20)
    >>> low, middle, high = walk.studies["uncertainty"]["metrics"]["toe_clearance"]["quantiles"]
    >>> low < middle < high
    True
    """
    description = load("scenario", scenario, sets)
    running.check_draws(description, draws, spreads)
    if not isinstance(seed, int) or seed < 0:
        raise InputError("is not a valid seed", field="seed", value=seed, allowed="0, 1, 2, …")
    recording = run(description, metrics=metrics)
    found = running.uncertainty(description, recording, draws, spreads, seed=seed, threads=threads)
    return dataclasses.replace(recording, studies=recording.studies | {UNCERTAINTY: found})
