"""What to change first: the effect of each of a design's own parameters on a walk, from runs, ranked."""

import dataclasses
import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

from afo_sim.common.errors import InputError, SimulationError
from afo_sim.description.reader import load
from afo_sim.description.scenario import Scenario
from afo_sim.metrics.metric import Metric
from afo_sim.model.periodic import as_run
from afo_sim.model.person import with_person
from afo_sim.simulation.examine import Asked
from afo_sim.simulation.recording import Recording, limits_of, verdict_of
from afo_sim.simulation.run import run_scenario
from afo_sim.study.effect import METRICS, SHARES, Effect, Run
from afo_sim.study.effects_parameters import Step, steps
from afo_sim.study.effects_ranking import Aim, aim_of, rank, wanted_of
from afo_sim.study.engine import INFEASIBLE, OK, Outcome, in_order
from afo_sim.study.pool import processors

if TYPE_CHECKING:
    import pandas

Report = Callable[[int, int, str], None]
DOING = "trying what to change first"
PULLS = 1.0  # [N]
WORSE = 1.0  # by which a share of a limit that is left already must grow to be told [percent]
BATCH = 8  # cases a batch: few enough that both threads and the progress have something to do


@dataclass(frozen=True, repr=False)
class Effects:
    """The effects of one step of each parameter, what helps most first.

    aim : what the ranking is for: "lift", "heel", "push_off", "air", or "spare" where all is good
    base : metrics of the walk as it is, by name, with their units
    ranked : Effect of every step, also of those that could not be run
    timestep : of all runs [s]

    Each step was run alone; nothing is told of two steps together, nor of a step twice as large.
    """

    aim: Aim
    base: dict[str, Metric]
    ranked: tuple[Effect, ...]
    timestep: float

    @property
    def helping(self) -> tuple[Effect, ...]:
        """The steps that help, the better one of each parameter, the best first."""
        best: dict[str, Effect] = {}
        for effect in self.ranked:
            if effect.helps:
                best.setdefault(effect.name, effect)
        return tuple(best.values())

    @property
    def idle(self) -> tuple[str, ...]:
        """Names of the parameters of which no step makes a noticed difference."""
        done = [effect for effect in self.ranked if effect.status in ("run", "no air")]
        noticed = {effect.name for effect in done if effect.noticed}
        return tuple(dict.fromkeys(effect.name for effect in done if effect.name not in noticed))

    def to_json(self) -> dict[str, Any]:
        """As plain data; what is not defined is None."""
        return {
            "aim": self.aim,
            "timestep": self.timestep,
            "base": {name: [_defined(metric.value), metric.unit] for name, metric in self.base.items()},
            "ranked": [_table(effect) for effect in self.ranked],
        }

    @classmethod
    def from_json(cls, table: Mapping[str, Any]) -> Self:
        """Of what `to_json` gave."""
        return cls(
            aim=table["aim"],
            base={name: Metric(_number(value), unit) for name, (value, unit) in table["base"].items()},
            ranked=tuple(_effect(row) for row in table["ranked"]),
            timestep=table["timestep"],
        )

    def to_pandas(self) -> "pandas.DataFrame":
        """A row for each step, ranked; columns of differences in the metrics' units (needs pandas).

        The units stand in `attrs["units"]`.
        """
        import pandas

        told = ("name", "before", "after", "status", "reason", "helps")
        rows = [{key: getattr(e, key) for key in told} | e.differences for e in self.ranked]
        found = pandas.DataFrame(rows, columns=[*told, *self.base])
        found.attrs["units"] = {name: metric.unit for name, metric in self.base.items()}
        return found

    def __repr__(self) -> str:
        run = sum(effect.status == "run" for effect in self.ranked)
        best = [f"{effect.name} {effect.before} → {effect.after}" for effect in self.helping[:3]]
        told = "; ".join(best) or "no single step helps"
        return f"<Effects for {self.aim!r}, {run} steps run: {told}>"


def effects(
    scenario: str | os.PathLike[str] | Scenario | Mapping[str, Any],
    sets: Mapping[str, Any] | None = None,
    *,
    recording: Recording | None = None,
    report: Report | None = None,
    threads: int = 0,
) -> Effects:
    """Try one step of each of an orthosis' own parameters on a walk, to either side, one at a time.

    Parameters
    ----------
    scenario : a shipped name, a path, a dict of the same shape, or a Scenario; walking with muscles
    sets : dotted keys and values laid over it
    recording : of the walk as it is, where it has run already
    report : called with (done, in all, what)
    threads : as many as processors if 0

    Returns
    -------
    Effects. Each difference is that between two runs with the scenario's own time step.

    Raises
    ------
    InputError
        The description is wrong, does not walk, or has no muscles; the recording is of another one.
    SimulationError
        The walk as it is fails.

    Examples
    --------
    >>> found = effects("walk-dropfoot-afo", {"timestep": "4 ms"})
    >>> found.aim in ("lift", "heel", "push_off", "air", "spare"), found.base["toe_clearance"].unit
    (True, 'mm')
    >>> shorter = [e for e in found.ranked if e.name == "dorsiflexor link_length" and e.after == "10.7 cm"]
    >>> shorter[0].differences["toe_clearance"] > 0.0  # [mm]
    True
    """
    description = scenario if isinstance(scenario, Scenario) else load("scenario", scenario)
    description = description.set(sets) if sets else description
    if not description.walking or not description.orthosis.muscle:
        missing = "does not walk" if not description.walking else "has no muscles: there is nothing to change"
        raise InputError(
            missing, field="scenario", value=description.name, allowed="walking with an orthosis"
        )
    walk = recording or run_scenario(description)
    if walk.scenario != with_person(description).resolved():
        raise InputError("is of another scenario", field="recording", value=walk.scenario["name"])
    if not walk.ok:
        raise SimulationError(f"the walk as it is {walk.status}")
    offered = steps(description, _hanging(description, walk))
    cases = [step.sets for step in offered if not step.barred]
    outcome = iter(_run(description, cases, report, threads or processors()))
    base = {name: walk.metrics[name] for name in METRICS if name in walk.metrics}
    tried = [_effect_of(step, None if step.barred else next(outcome), base, walk) for step in offered]
    limits = limits_of(walk)
    aim = aim_of({answer.name: answer.status for answer in verdict_of(walk)})
    ranked = rank(tried, {name: metric.value for name, metric in base.items()}, wanted_of(limits), aim)
    return Effects(aim, base, tuple(ranked), as_run(description).timestep)


def _hanging(scenario: Scenario, walk: Recording) -> list[str]:
    """Muscle groups that never pull."""
    return [
        name
        for name, group in scenario.orthosis.muscle.items()
        if all(walk[f"muscle/{name}_{k}/force"].max() < PULLS for k in range(1, group.count + 1))
    ]


def _run(
    scenario: Scenario, cases: Sequence[Mapping[str, Any]], report: Report | None, threads: int
) -> list[Outcome]:
    """Outcomes of cases, in order."""
    asked = Asked(frozenset({*METRICS, *SHARES}), doubts=False)

    def told(done: int, count: int) -> None:
        if report is not None:
            report(done, count, DOING)

    return in_order(scenario, cases, asked, threads, BATCH, told)


def _effect_of(step: Step, outcome: Outcome | None, base: Mapping[str, Metric], walk: Recording) -> Effect:
    """What a step does; why it was not run where it has no outcome."""
    effect = Effect(step.name, step.before, step.after, dict(step.sets), assumed=step.assumed)
    if outcome is None:
        assert step.barred
        return dataclasses.replace(effect, status=step.barred, reason=step.reason)
    if outcome.status != OK:
        status: Run = "refused" if outcome.status == INFEASIBLE else "failed"
        return dataclasses.replace(effect, status=status, reason=outcome.reason)
    undefined = Metric(math.nan)
    differences = {name: outcome.metrics.get(name, undefined).value - was.value for name, was in base.items()}
    beyond = tuple(
        f"{outcome.metrics[name].value:.0f} % of {limit}"
        for name, limit in SHARES.items()
        if name in outcome.metrics and outcome.metrics[name] > max(100.0, walk.metrics[name].value + WORSE)
    )
    notes = tuple(warning for warning in outcome.warnings if warning not in walk.warnings)
    return dataclasses.replace(effect, differences=differences, beyond=beyond, notes=notes)


def _table(effect: Effect) -> dict[str, Any]:
    table = dataclasses.asdict(effect) | {key: list(getattr(effect, key)) for key in ("beyond", "notes")}
    return table | {"differences": {name: _defined(value) for name, value in effect.differences.items()}}


def _effect(row: Mapping[str, Any]) -> Effect:
    differences = {name: _number(value) for name, value in row["differences"].items()}
    lists = {key: tuple(row[key]) for key in ("beyond", "notes")}
    return Effect(**{**row, **lists, "differences": differences})


def _defined(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _number(value: float | None) -> float:
    return math.nan if value is None else value
