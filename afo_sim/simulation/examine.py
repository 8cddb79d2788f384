"""Roll-out → Recording: rows become columns, columns become metrics and warnings."""

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from afo_sim.common import Mixed, Notice, identities
from afo_sim.common.versions import versions
from afo_sim.description import Scenario
from afo_sim.metrics import (
    AIR_BEFORE,
    NAMES,
    REPORTED,
    Metric,
    Run,
    WalkMetrics,
    ankle_metrics,
    energy_metrics,
    first_stride_metrics,
    from_start,
    made_of,
    of_strides,
    reference_metrics,
    run_metrics,
    sag,
    share_left,
    strides_needed,
    walk_metrics,
)
from afo_sim.model import Built, air_before, fills, steps_of_stride, with_person
from afo_sim.simulation.columns import columns_of
from afo_sim.simulation.energy_balance import Columns, balance_metrics, with_static_forces
from afo_sim.simulation.facts import facts_of, gas_of
from afo_sim.simulation.files import LABEL, parameters_of, to_binary
from afo_sim.simulation.recording import Later, Recording
from afo_sim.simulation.rollout import Rollout
from afo_sim.simulation.sensed import sensor_columns
from afo_sim.simulation.stepping import Moment, Policy, StopEarly
from afo_sim.simulation.validity_checks import (
    empty_warnings,
    limit_warnings,
    mismatch_warning,
    validity_warnings,
)

FEWEST = 3  # rows that have an energy balance


@dataclass(frozen=True)
class Examined:
    """A roll-out of a built scenario: columns at every step, metrics and warnings."""

    columns: dict[str, np.ndarray]
    found: WalkMetrics
    limits: tuple[Notice, ...]


@dataclass(frozen=True)
class Asked:
    """The request for a roll-out."""

    metrics: frozenset[str] | None = None
    doubts: bool = True
    curves: tuple[str, ...] = ()
    walkers: str | None = None  # the condition whose patients respond, instead of a roll-out

    @functools.cached_property
    def walking(self) -> frozenset[str] | None:
        """Those that a stride reports, and those that others are made of."""
        return None if self.metrics is None else of_strides(self.metrics)

    @property
    def reference(self) -> bool:
        """Whether the scenario's reference walk is requested."""
        return self.metrics is not None and not self.metrics.isdisjoint(COMPARISONS)

    @property
    def first_strides(self) -> int:
        """Strides from the start that the metrics need."""
        return strides_needed(self.metrics)

    @property
    def energy(self) -> bool:
        """Whether the energy balance is needed."""
        if self.doubts or self.metrics is None:
            return True
        return not ENERGIES.isdisjoint(self.metrics | made_of(self.metrics))


EVERYTHING = Asked()
ENERGIES = frozenset(row.name for row in REPORTED[energy_metrics])
COMPARISONS = frozenset(row.name for row in REPORTED[reference_metrics])


def make_recording(built: Built, rollout: Rollout, *, seed: int = 0) -> Recording:
    """Name the rows of a roll-out, and compute metrics and warnings."""
    examined = with_limits(built, rollout, *examine(built, rollout))
    stride = built.scenario.record_stride
    n = len(examined.columns["time"])
    whole = rollout.first_step == 0 and (bool(rollout.final) or rollout.failure is not None)
    columns = examined.columns | (
        sensor_columns(built, examined.columns, seed) if whole and len(examined.columns["time"]) else {}
    )
    return recording_of(
        lambda: built,
        built.scenario,
        # copies: the recording is its user's, while the recorded walking is shared by later runs
        columns=Later(lambda: {name: np.array(values[::stride]) for name, values in columns.items()}),
        metrics=examined.found.totals,
        strides=examined.found.strides,
        warnings=(*built.warnings, *examined.limits, *examined.found.warnings),
        status="ok" if rollout.failure is None else f"failed: {rollout.failure}",
        timing=timing_of(built, n, rollout.wall_seconds),
    )


def recording_of(
    built: Callable[[], Built], scenario: Scenario, status: str = "ok", **found: Mixed
) -> Recording:
    """The Recording of a result, with the requested scenario and the model that ran."""
    later: Mixed = Later  # than now: a field of any kind
    return Recording(
        **found,
        status=status,
        described=later(lambda: with_person(scenario).resolved()),
        model_xml=later(lambda: LABEL + built().xml),
        model_binary=later(lambda: to_binary(built().full_model)),
        versions=versions() | {name: digest[:12] for name, digest in identities().items()},
        parameters=later(lambda: parameters_of(built().model)),
    )


def timing_of(built: Built, steps: int, seconds: float) -> dict[str, float]:
    """Facts of a roll-out's speed, and how near its limits the step is."""
    numbers = {f"{name}_stability_number": number for name, number in built.stability.items()}
    rate = steps / seconds if seconds else 0.0
    return {"wall_seconds": seconds, "steps": steps, "steps_per_second": rate} | numbers


def with_limits(built: Built, rollout: Rollout, columns: Columns, found: WalkMetrics) -> Examined:
    """The result of `examine` with all columns computed and warnings of exceeded limits."""
    limits: tuple[Notice, ...] = ()
    if len(columns["time"]):
        static = None
        if _balanced(built, rollout, columns):  # a law counts as asked by the static force that it gave
            static = with_static_forces(built, rollout, columns)[1]
        limits = tuple(limit_warnings(built, columns, static))
    return Examined(dict(columns), found, limits)


def examine(
    built: Built, rollout: Rollout, *, transient: bool = True, solved: bool = False, asked: Asked = EVERYTHING
) -> tuple[Columns, WalkMetrics]:
    """Columns of every step of a roll-out, computed when read, and their metrics."""
    columns = columns_of(built, rollout)
    if not len(columns["time"]):
        return columns, WalkMetrics({}, {}, ())
    found = _metrics(built, columns, transient, solved, asked)
    energy: dict[str, Metric] = {}
    doubts: list[Notice] = []
    if asked.energy and _balanced(built, rollout, columns):
        rows, static = with_static_forces(built, rollout, columns)
        period = described_cycle(built.scenario) or built.scenario.duration
        whole, energy = balance_metrics(built, rows, static, period)
        if asked.doubts:
            doubts += [*validity_warnings(built, rows, static, whole), *mismatch_warning(energy)]
    from_rest = rollout.first_step == 0 and not solved
    run = Run(columns, facts_of(built), found.totals | energy, solved, from_rest)
    further = run_metrics(run, asked.metrics) if found.totals else {}
    if asked.doubts:
        doubts += empty_warnings(built.scenario, dict(sag(run)))
    begins = built.walk is not None and not solved and rollout.first_step == 0
    first, left_out = first_strides(built, rollout, columns, None, asked) if begins else ({}, ())
    warnings = (*doubts, *found.warnings, *left_out)
    return columns, WalkMetrics(found.totals | further | energy | first, found.strides, warnings)


def first_strides(
    built: Built, rollout: Rollout, columns: Columns | None, settled: Mapping[str, Metric] | None,
    asked: Asked = EVERYTHING, near: Rollout | None = None,
) -> tuple[dict[str, Metric], tuple[Notice, ...]]:  # fmt: skip
    """Metrics of the strides after a stop, and warnings of missing ones."""
    wanted = NAMES if asked.metrics is None else asked.metrics & NAMES
    if not wanted:
        return {}, ()
    if columns is None:
        columns = columns_of(built, rollout)
    filled = fills(built.scenario) and AIR_BEFORE in wanted and len(columns["time"]) > 0
    before = air_before(built, rollout.rows["act"][0]) if filled else None
    strides = from_start(columns, built.scenario.timestep, built.body_mass, wanted)
    gait, share = built.scenario.gait, None
    if near is not None:
        angles, settled_swing = swing_of(built, rollout), swing_of(built, near)[-1]
        for k in range(1, len(angles) + 1):
            share = share_left(angles[:k], settled_swing)
            if share is not None:  # what follows need not be walked
                strides = strides[:k]
                break
    if gait is not None and gait.start_phase > 0.0:  # the first swing belongs to no whole stride
        wanted, strides = wanted & {AIR_BEFORE}, []
    found, left_out = first_stride_metrics(strides, settled, before, wanted, share)
    # who asks for all of them is not warned of the few that this run cannot tell
    return found, () if asked.metrics is None else left_out


def swing_of(built: Built, rollout: Rollout) -> np.ndarray:
    """Ankle angle in the later half of each whole stride from the first row on [rad] (k, n)."""
    return _swings(rollout.rows["qpos"][:, built.index.ankle_qpos], steps_of_stride(built.scenario))


def _swings(angle: np.ndarray, n: int) -> np.ndarray:
    whole: np.ndarray = angle[: len(angle) // n * n].reshape(-1, n)
    return whole[:, n // 2 :]


def until_near(built: Built, control: np.ndarray, settled: Rollout) -> Policy | None:
    """The inputs of the first strides, until these show how they near the settled one."""
    n, ankle = steps_of_stride(built.scenario), built.index.ankle_qpos
    if settled.failure is not None or len(control) % n:
        return None
    near, angle = swing_of(built, settled)[-1], np.empty(0)

    def choose(moment: Moment) -> np.ndarray:
        nonlocal angle
        if moment.steps.start:  # since the last choice: less than a stride, where the step is fine
            angle = np.concatenate([angle, moment.last["qpos"][:, ankle]])
        if share_left(_swings(angle, n), near) is not None:
            raise StopEarly
        return control[moment.steps.start : moment.steps.stop]

    return Policy(choose, period=n)


def _balanced(built: Built, rollout: Rollout, columns: Columns) -> bool:
    """Whether a roll-out has an energy balance; a stretch that somebody watches has no end."""
    enough = len(columns["time"]) >= FEWEST
    return bool(rollout.final) and enough and bool(built.scenario.orthosis.muscle)


def _metrics(built: Built, columns: Columns, transient: bool, solved: bool, asked: Asked) -> WalkMetrics:
    """Of walking for each stride and over all; of a fixed shank over all only."""
    scenario = built.scenario
    if built.walk is not None:
        return walk_metrics(
            columns,
            scenario.timestep,
            built.body_mass,
            transient=transient,
            solved=solved,
            wanted=asked.walking,
            free_density=gas_of(scenario).free_density,
        )
    words, period = scenario.leg.directions, described_cycle(scenario) or scenario.duration
    density = gas_of(scenario).free_density
    return WalkMetrics(ankle_metrics(columns, scenario.timestep, period, words, density), {}, ())


def described_cycle(scenario: Scenario) -> float | None:
    """Time after which the valves' commands repeat [s]; None if none is described."""
    if scenario.timer is not None:
        return scenario.timer.period
    return None if scenario.controller is None else scenario.controller.cycle
