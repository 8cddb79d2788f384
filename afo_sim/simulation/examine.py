"""Roll-out → Recording: rows become columns, columns become metrics and warnings."""

from collections.abc import Iterator

import numpy as np

from afo_sim.common.versions import versions
from afo_sim.description.scenario import Scenario
from afo_sim.metrics.ankle import ankle_metrics
from afo_sim.metrics.metric import Metric
from afo_sim.metrics.walking import WalkMetrics, walk_metrics
from afo_sim.model.build import Built
from afo_sim.simulation.columns import columns_of
from afo_sim.simulation.energy import balance
from afo_sim.simulation.energy_told import told_energy, with_static_forces
from afo_sim.simulation.frame import Frame
from afo_sim.simulation.kept_model import labelled, parameters_of, to_binary
from afo_sim.simulation.limits import limit_warnings
from afo_sim.simulation.recording import Recording
from afo_sim.simulation.rollout import Rollout
from afo_sim.simulation.trust import trust_warnings

FEWEST = 3  # rows that have an energy balance


def make_recording(built: Built, rollout: Rollout) -> Recording:
    """Name the rows of a roll-out, and compute metrics and warnings.

    Parameters
    ----------
    built : compiled scenario
    rollout : aligned rows and inputs

    Returns
    -------
    Recording at the scenario's record rate; the metrics are of every step.
    """
    scenario = built.scenario
    columns, found = examine(built, rollout)
    n, stride = len(columns["time"]), scenario.record_stride
    return Recording(
        # copies: the recording is its user's, while the recorded walking is shared by later runs
        columns={name: np.array(values[::stride]) for name, values in columns.items()},
        metrics=found.totals,
        strides=found.strides,
        scenario=scenario.resolved(),
        model_xml=labelled(built.xml),
        model_binary=to_binary(built.model),
        status="ok" if rollout.failure is None else f"failed: {rollout.failure}",
        warnings=(*built.warnings, *(_limits(built, rollout, columns) if n else ()), *found.warnings),
        timing={
            "wall_seconds": rollout.wall_seconds,
            "steps": n,
            "steps_per_second": n / rollout.wall_seconds if rollout.wall_seconds else 0.0,
            **{f"{name}_stability_number": number for name, number in built.stability.items()},
        },
        versions=versions(),
        parameters=parameters_of(built.model),
    )


def examine(
    built: Built, rollout: Rollout, *, transient: bool = True
) -> tuple[dict[str, np.ndarray], WalkMetrics]:
    """Columns of every step of a roll-out, and what they say in numbers; the transient's strides if asked."""
    columns = columns_of(Frame(built, rollout.rows, rollout.control, rollout.first_step))
    if not len(columns["time"]):
        return columns, WalkMetrics({}, {}, ())
    found = _metrics(built, columns, transient)
    energy, doubts = _energy(built, rollout, columns)
    return columns, WalkMetrics(found.totals | energy, found.strides, (*doubts, *found.warnings))


def _energy(
    built: Built, rollout: Rollout, columns: dict[str, np.ndarray]
) -> tuple[dict[str, Metric], list[str]]:
    """Energy balance of a whole run's every step: its metrics, and warnings of what is not to be believed."""
    if not _balanced(built, rollout, columns):
        return {}, []
    rows, static = with_static_forces(built, rollout, columns)
    whole = balance(built, rows, static)
    told = told_energy(built, rows, static, whole, _period(built.scenario))
    return told, list(trust_warnings(built, rows, static, whole))


def _limits(built: Built, rollout: Rollout, columns: dict[str, np.ndarray]) -> Iterator[str]:
    """Warnings of muscles beyond their limits; a law counts as asked by the static force that it gave."""
    static = with_static_forces(built, rollout, columns)[1] if _balanced(built, rollout, columns) else None
    return limit_warnings(built, columns, static)


def _balanced(built: Built, rollout: Rollout, columns: dict[str, np.ndarray]) -> bool:
    """Whether a roll-out has an energy balance; a stretch that somebody watches has no end."""
    enough = len(columns["time"]) >= FEWEST
    return bool(rollout.final) and enough and bool(built.scenario.orthosis.muscle)


def _metrics(built: Built, columns: dict[str, np.ndarray], transient: bool) -> WalkMetrics:
    """Of walking for each stride and over all; of a fixed shank over all only."""
    scenario = built.scenario
    if built.walk is not None:
        return walk_metrics(columns, scenario.timestep, built.body_mass, transient=transient)
    words = scenario.leg.directions
    return WalkMetrics(ankle_metrics(columns, scenario.timestep, _period(scenario), words), {}, ())


def _period(scenario: Scenario) -> float:
    """Period of one cycle: the timer's, or all of the run [s]."""
    if scenario.timer is not None:
        return scenario.timer.period
    return scenario.duration
