"""What of a scenario a board can do, and what the simulation commands its valves meanwhile."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common import InputError, SimulationError
from afo_sim.control import Coils, Command, Controller, Log, Observation, coils, machine_of, make
from afo_sim.description import Scenario
from afo_sim.export.electronics import board
from afo_sim.model import Built, stride_time_of
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.simulation import SENSOR, Progress, run_controlled, unit_of

_EXPORTED = "a [timer], [phases] of strides of one duration, [controller.timer] or [controller.state_machine]"
_EDGE = 1e-6  # of a step, to which a coil's share counts as none or all


def board_of(scenario: Scenario) -> board.Board:
    """The board that switches a scenario's valves."""
    _check(scenario)
    chambers = board.check_names(scenario.orthosis.chamber, "chamber", board.MOST_CHAMBERS)
    controller = scenario.controller
    name = scenario.name or "scenario"
    logic: board.Clock | board.States
    if controller is not None and controller.timer is not None:
        logic, tick, step = board.controller_clock(controller.timer, controller.rate, chambers)
        restart = controller.timer.restart
        inputs = () if restart is None else _inputs(scenario, [restart.column])
        return board.Board(name, chambers, tick, step, logic, inputs)
    if controller is not None and controller.state_machine is not None:
        machine = machine_of(controller.state_machine, scenario)
        period = 1.0 / controller.rate
        tick = board.tick_of([period])
        step = board.whole(period, tick, "controller.rate: the time between two commands")
        logic = board.states_of(machine, step * tick * board.MICROSECOND, chambers)
        return board.Board(name, chambers, tick, step, logic, _inputs(scenario, machine.columns()))
    if scenario.timer is not None:
        logic, tick = board.timer_clock(scenario.timer, chambers)
        return board.Board(name, chambers, tick, 0, logic)
    assert scenario.phases is not None and scenario.gait is not None
    gait = scenario.gait
    logic, tick = board.phases_clock(scenario.phases, stride_time_of(scenario), gait.start_phase, chambers)
    return board.Board(name, chambers, tick, 0, logic)


def _check(scenario: Scenario) -> None:
    """Refuse what no board can do alone."""
    if not scenario.orthosis.chamber:
        problem = "has no chamber, and so no valve to switch"
        raise InputError(problem, field="orthosis", value=scenario.orthosis.name, allowed=_EXPORTED)
    controller = scenario.controller
    if controller is not None and controller.kind not in ("timer", "state_machine"):
        raise InputError("is not exported as C", field="controller", value=controller.kind, allowed=_EXPORTED)
    if controller is None and scenario.timer is None and scenario.phases is None:
        problem = "switches no valve: there is nothing to export"
        raise InputError(problem, field="scenario", value=scenario.name or None, allowed=_EXPORTED)
    gait = scenario.gait
    if controller is None and scenario.phases is not None and gait is not None:
        for key, value in (("variability", gait.variability), ("pace", gait.pace)):
            if value:
                problem = "the strides vary, and a clock without sensors cannot follow them"
                raise InputError(problem, field=f"gait.{key}", value=value, allowed=_EXPORTED)


def _inputs(scenario: Scenario, columns: Sequence[str]) -> tuple[board.Input, ...]:
    """The quantities that a board reads, with the calibration lines of the scenario's sensors."""
    if len(columns) > board.MOST_NAMES:
        raise InputError("are too many inputs for a board", field="controller", value=len(columns))
    found = []
    for column in columns:
        unit = unit_of(scenario, column)
        sensor = scenario.sensor.get(column.removeprefix(SENSOR)) if column.startswith(SENSOR) else None
        calibration = getattr(sensor, "calibration", None)
        scaled: tuple[float, ...] = ()
        if calibration is not None and calibration.shape == "linear":
            line = calibration.line(unit)
            scaled = (1.0 / line.taken_slope, -line.taken_intercept / line.taken_slope)
        found.append(board.Input(column, unit, *scaled))
    return tuple(found)


@dataclass(frozen=True, eq=False)
class Commanded:
    """The simulation's commands."""

    log: Log
    inputs: Mapping[str, np.ndarray]
    times: np.ndarray

    def inputs_text(self) -> str:
        """The inputs as CSV, a row for each command, with the digits that give the same numbers again."""
        lines = [",".join(["time_ms", *self.inputs])]
        for k, time in enumerate(self.times):
            lines.append(",".join([f"{1e3 * time:.6f}", *(repr(float(v[k])) for v in self.inputs.values())]))
        return "\n".join([*lines, ""])


def commanded(scenario: Scenario, progress: Progress | None = None) -> Commanded:
    """The simulation's commands over a scenario's duration."""
    if scenario.controller is None:
        return Commanded(_scheduled(build(scenario)), {}, np.zeros(0))
    witness = _Witness(make(scenario.controller, scenario), list(scenario.orthosis.chamber))
    recording = run_controlled(scenario, witness, scenario.controller.rate, progress=progress)
    if not recording.ok:
        raise SimulationError(f"there is nothing to compare with: {recording.status}")
    log = Log.of(witness.rows, scenario.n_step * scenario.timestep, list(scenario.orthosis.chamber))
    values = {name: np.array(seen_values) for name, seen_values in witness.values.items()}
    return Commanded(log, values, np.array(witness.times))


class _Witness:
    """A controller that writes down what another one sees and commands."""

    def __init__(self, controller: Controller, chambers: Sequence[str]) -> None:
        self.controller, self.chambers = controller, chambers
        self.asks = getattr(controller, "asks", [])
        self.columns = list(dict.fromkeys(ask.column for ask in self.asks if ask.column != "state_time"))
        self.reset()

    def reset(self) -> None:
        """Forget all that was seen."""
        getattr(self.controller, "reset", lambda: None)()
        self.rows: list[tuple[float, str, Coils]] = []
        self.values: dict[str, list[float]] = {column: [] for column in self.columns}
        self.times: list[float] = []
        self.in_force: dict[str, tuple[float, float]] = dict.fromkeys(self.chambers, (0.0, 0.0))

    def __call__(self, seen: Observation) -> Mapping[str, Command]:
        time = round(seen.time, 9)  # to a nanosecond, as a log has it
        self.times.append(time)
        for column, seen_values in self.values.items():
            seen_values.append(seen[column])
        commands = self.controller(seen)
        self.in_force |= coils(commands, self.chambers)
        for chamber, (inlet, outlet) in self.in_force.items():
            self.rows.append((time, chamber, (inlet > 0.0, outlet > 0.0)))
        return commands


def _scheduled(built: Built) -> Log:
    """Switchings of a scenario's timing, from the shares of each step for which a coil has current."""
    inputs = schedule.controls(built)
    timestep = built.scenario.timestep
    rows: list[tuple[float, str, Coils]] = []
    chambers = list(built.scenario.orthosis.chamber)
    for chamber in chambers:
        events = []
        for k, side in enumerate(("inlet", "outlet")):
            shares = inputs[:, built.index.valves[f"{chamber}_{side}"]]
            events += [(time, k, on) for time, on in switchings(shares, timestep, f"{chamber}.{side}")]
        state = [False, False]
        for time, k, on in sorted(events):
            state[k] = on
            if rows and rows[-1][:2] == (time, chamber):
                rows.pop()
            rows.append((time, chamber, (state[0], state[1])))
    return Log.of(sorted(rows, key=lambda row: row[0]), len(inputs) * timestep, chambers)


def switchings(shares: np.ndarray, timestep: float, name: str) -> list[tuple[float, bool]]:
    """Times at which a coil is switched, from the share of each step for which it has current."""
    found: list[tuple[float, bool]] = []
    on = False
    part = (shares > _EDGE) & (shares < 1.0 - _EDGE)
    differs = np.concatenate([[True], np.abs(np.diff(shares)) > _EDGE])
    for k in np.flatnonzero(part | differs).tolist():  # no other step may switch
        share = float(shares[k])
        if not part[k]:
            after, time = share > 0.5, k * timestep
            if found and after == on:
                continue
        else:
            following = float(shares[k + 1]) if k + 1 < len(shares) else float(not on)
            after = not on if _EDGE < following < 1.0 - _EDGE else following > 0.5  # at the step's end
            if after == on and k > 0:
                problem = f"is switched more than once within the step at {k * timestep:g} s"
                allowed = "longer events, or a shorter timestep"
                raise InputError(problem, field=name, allowed=allowed)
            if k == 0:
                found.append((0.0, not after))
            time = (k + (1.0 - share if after else share)) * timestep
        found.append((round(time, 9), after))
        on = after
    return found
