"""The periodic steady state of walking (the settled stride): whether there is one, and two such strides.

A stride is seldom a whole number of steps. So the step is adjusted to stride/N, by less than half a step in a
stride: then every stride takes the same inputs, and the state at its start maps to the state at its end.
"""

import math

from afo_sim.common import Notice
from afo_sim.description import AMBIENT, SUPPLY, Scenario
from afo_sim.model.walk import stride_time_of

WHOLE = 0.02  # of a stride, by which a duration may fall short of whole strides [-]
AFTER = 2  # steps beyond the second stride: balances look a row ahead
SAME = 1e-9  # of a stride, to which a timer's period must fit


def why_walked(scenario: Scenario) -> str:
    """The reason for which a scenario's strides cannot be solved and are walked; "" where there is none."""
    gait = scenario.gait
    if gait is None or gait.settled == "walked":
        return "the scenario asks for it"
    if scenario.controller is not None:
        return "a controller closes the loop, so strides may not repeat"
    if gait.variability > 0.0:
        return "the stride time varies (gait.variability)"
    if gait.pace:
        return "the cadence changes or the walker stops (gait.pace)"
    source = scenario.supply.source
    if source is not None and source.kind == "compressor":
        return "the compressor starts and stops at its own times, so strides may not repeat"
    if drift(scenario):
        assert scenario.timer is not None
        stride, period = stride_time_of(scenario), scenario.timer.period
        return f"the timer's period of {period:g} s does not fit the stride of {stride:.6g} s"
    return ""


def beyond_chambers(scenario: Scenario) -> bool:
    """Whether air is elsewhere than in chambers between endless air and the surroundings."""
    orthosis, supply = scenario.orthosis, scenario.supply
    led = any(
        c.tube is not None or (c.feed, c.exhaust) != (SUPPLY, AMBIENT) for c in orthosis.chamber.values()
    )
    return bool(led or orthosis.volume or orthosis.restriction or supply.source or supply.regulator)


def drift(scenario: Scenario) -> float:
    """Share of its period by which a timer of valves drifts in each stride [-]; 0 where it fits."""
    timer = scenario.timer
    if timer is None or not any(times.inlet or times.outlet for times in timer.chambers.values()):
        return 0.0
    periods = stride_time_of(scenario) / timer.period
    off = abs(periods - round(periods))
    return off if off > SAME * periods else 0.0


def unseen_drift(scenario: Scenario) -> Notice | None:
    """A warning where a run ends before its timer has come round to the same phase of the stride."""
    share = drift(scenario)
    stride = stride_time_of(scenario) if share else 0.0
    if scenario.duration * share >= stride * (1.0 - WHOLE):
        return None
    seen = scenario.duration * share / stride
    text = (
        f"the {{subject}} drifts by {100.0 * share:.2g} % of its period in each stride: this run covers "
        f"{100.0 * seen:.2g} % of a full cycle of the drift, and verdict and numbers hold for that part "
        "only; a duration of {enough:.0f} s covers all of it"
    )
    return Notice("timer-drifts", text, subject="timer", drift=share, seen=seen, enough=stride / share)


def steps_of_stride(scenario: Scenario) -> int:
    """Steps of one stride, of about the scenario's own time step."""
    assert scenario.gait is not None
    return max(round(stride_time_of(scenario) / scenario.timestep), 1)


def as_run(scenario: Scenario) -> Scenario:
    """The scenario with the time step that it runs with."""
    return start_up(scenario) if scenario.walking and not why_walked(scenario) else scenario


def two_strides(scenario: Scenario) -> Scenario:
    """The scenario over two strides from heel strike, and `AFTER` steps."""
    n = steps_of_stride(scenario)
    return _over(scenario, n, 0, 2 * n + AFTER)


def start_up(scenario: Scenario) -> Scenario:
    """The scenario over the strides that are walked from the start, before the two of `two_strides`."""
    assert scenario.gait is not None
    n = steps_of_stride(scenario)
    begun = round(scenario.gait.start_phase * n)
    whole = math.floor((begun + scenario.n_step) / n + WHOLE)
    return _over(scenario, n, begun, max(whole - 2, 2 if 2 * begun > n else 1) * n - begun)


def _over(scenario: Scenario, n: int, begun: int, n_step: int) -> Scenario:
    """The scenario over so many steps, each an n-th of a stride, from so many after heel strike."""
    gait = scenario.gait
    assert gait is not None
    step = stride_time_of(scenario) / n
    changed: dict[str, object] = {"timestep": step, "duration": n_step * step}
    changed["gait"] = gait.model_copy(update={"start_phase": begun / n})
    if scenario.record_rate is not None:
        changed["record_rate"] = 1.0 / (scenario.record_stride * step)
    # a copy is not checked again: nothing has changed that a check looks at
    return scenario.model_copy(update=changed)
