"""A dynamic fit as it is posed: scenario, free parameters, log; the run at given values, and its errors."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.description.reader import load
from afo_sim.lab.fitting.log import Log, read_log, read_noise
from afo_sim.lab.fitting.run_parameter import RunParameter, find_parameters
from afo_sim.model import controls as schedule
from afo_sim.model.build import build
from afo_sim.simulation.examine import make_recording
from afo_sim.simulation.loop import described_policy
from afo_sim.simulation.recording import Recording
from afo_sim.simulation.simulate import simulate

Values = Mapping[str, float]
HELD_OUT = 0.3  # share of the log's time, from its end


@dataclass(frozen=True)
class RunProblem:
    """A scenario as plain data, its free parameters, and the log that they are fitted to; SI."""

    scenario: dict[str, Any]
    parameters: tuple[RunParameter, ...]
    log: Log
    noise: dict[str, float]
    hold_out: float

    @property
    def starts(self) -> dict[str, float]:
        """Each parameter's value before the fit [SI]."""
        return {p.name: p.start for p in self.parameters}

    @property
    def seen(self) -> np.ndarray:
        """Mask of the samples that are fitted when the rest is held out."""
        first, last = self.log.time[[0, -1]]
        return self.log.time <= last - self.hold_out * (last - first)

    def with_values(self, values: Values) -> dict[str, Any]:
        """Dotted keys that give the scenario other values."""
        source = f"fitted to {self.log.file.name}"
        return {k: v for p in self.parameters for k, v in p.sets(values[p.name], source).items()}


def pose(
    source: Any,
    data: Any,
    names: Sequence[str] = (),
    *,
    sets: Mapping[str, Any] | None = None,
    noise: Mapping[str, Any] | None = None,
    hold_out: float = HELD_OUT,
) -> RunProblem:
    """Read a log against a scenario, and find what is to be fitted."""
    if not 0.0 <= hold_out <= 0.9:
        raise InputError("is out of range", field="hold_out", value=hold_out, allowed="0 to 0.9")
    scenario = load("scenario", source, sets)
    log = read_log(data, scenario)
    parameters = find_parameters(names, scenario)
    problem = RunProblem(scenario.resolved(), parameters, log, read_noise(log, dict(noise or {})), hold_out)
    samples = int(problem.seen.sum()) * len(log.channels)
    if samples <= len(names):
        raise InputError(
            f"holds {samples} samples outside its held-out part for {len(names)} parameters",
            file=log.file,
            allowed="more samples than parameters",
        )
    return problem


def run_at(problem: RunProblem, values: Values) -> Recording:
    """The run with other values, at every step, as far as the log goes."""
    scenario = load("scenario", problem.scenario, problem.with_values(values))
    slack = max([p.kind.upper for p in problem.parameters if not p.keys], default=0.0)
    end = problem.log.time[-1] + slack + scenario.timestep
    scenario = scenario.with_values(
        duration=end if slack else min(end, scenario.duration), record_rate=1.0 / scenario.timestep
    )
    built = build(scenario)
    rollout = simulate(built, described_policy(built) or schedule.controls(built))
    if rollout.failure is not None:
        raise rollout.failure
    return make_recording(built, rollout)


def differences(problem: RunProblem, values: Values, recording: Recording) -> dict[str, np.ndarray]:
    """Run less log at the log's times, by channel [SI]."""
    time = problem.log.time - values.get("time_offset", 0.0)
    return {c.title: c.simulated(recording, time) - c.values for c in problem.log.channels}
