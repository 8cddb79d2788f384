"""A dynamic fit as it is posed: a device's log, the parameters that it can identify, the scenario."""

import pathlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from afo_sim.common import (
    Given,
    InputError,
    JsonDict,
    TableLike,
    format_quantity,
    quantity_at,
    read_facts,
    scale_of,
    split_title,
    table_of,
    unknown,
)
from afo_sim.description import Scenario, field_at, load
from afo_sim.lab.measured import TEXTS, columns_of
from afo_sim.lab.solution import FitParameter
from afo_sim.model import muscle_names
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.simulation import Recording, describe, described_policy, formulas, make_recording
from afo_sim.simulation.simulate import simulate

EXAMPLE = "time [s], angle [deg], pressure dorsiflexor [bar], force dorsiflexor_1 [N]"
FEWEST = 10  # samples
Values = Mapping[str, float]
HELD_OUT = 0.3  # share of the log's time, from its end


@dataclass(frozen=True)
class Channel:
    """One measured quantity: its samples [SI], and the recording's columns whose sum it is."""

    title: str
    columns: tuple[str, ...]
    unit: str
    scale: float
    values: np.ndarray

    @property
    def si(self) -> str:
        """The SI unit of its values."""
        return describe(self.columns[0])[0]

    def simulated(self, recording: Recording, time: np.ndarray) -> np.ndarray:
        """The same quantity of a run, at times of the timer [s]; before and after the run it rests."""
        total = np.sum([recording[column] for column in self.columns], axis=0)
        return np.interp(time, recording["time"], total)

    def noise(self, time: np.ndarray) -> float:
        """Spread of the samples about their neighbours [SI], never below the log's resolution."""
        y = self.values
        share = (time[1:-1] - time[:-2]) / (time[2:] - time[:-2])
        bend = y[1:-1] - (1.0 - share) * y[:-2] - share * y[2:]
        spread = 1.4826 * float(np.median(np.abs(bend) / np.sqrt(1.0 + (1.0 - share) ** 2 + share**2)))
        levels = np.diff(np.unique(y))
        resolution = float(levels.min()) / np.sqrt(12.0) if len(levels) else 0.0
        return max(spread, resolution, 1e-5 * float(np.ptp(y)), 1e-12 * max(float(np.abs(y).max()), 1.0))


@dataclass(frozen=True)
class Log:
    """Measurements on a device, on its own clock [s]."""

    file: pathlib.Path
    time: np.ndarray
    channels: tuple[Channel, ...]
    facts: JsonDict


def read_log(data: TableLike, scenario: Scenario) -> Log:
    """A log, read for the scenario that it was recorded from."""
    table, known = table_of(data, EXAMPLE, "data"), dict(_names(scenario))
    file, units = table.file, {name: (describe(c[0])[0] if c else "s",) for name, c in known.items()}
    columns, _ = columns_of(table, units, EXAMPLE, {"a time": ("time",)})
    channels: list[Channel] = []
    for title, (name, values) in zip(table.titles, columns.items(), strict=True):
        if any(channel.columns == known[name] for channel in channels):
            raise InputError("occurs twice", file=file, field=name)
        if name != "time":
            scale, _ = scale_of(file, name, title, units[name], EXAMPLE)
            channels.append(Channel(name, known[name], split_title(title)[1], scale, values))
    if not channels:
        raise InputError("lacks anything measured", file=file, field="header", value="time", allowed=EXAMPLE)
    if len(table.rows) < FEWEST:
        raise InputError(f"holds {len(table.rows)} samples", file=file, allowed=f"at least {FEWEST}")
    time, early = columns["time"], columns["time"][0] < 0.0
    if early or time[-1] > scenario.duration:
        cure = "cut what is before the timer's start" if early else "a longer duration"
        value, allowed = f"{time[0] if early else time[-1]:g} s", f"0 s to {scenario.duration:g} s; {cure}"
        raise InputError("is outside the scenario", file=file, field="time", value=value, allowed=allowed)
    return Log(file, time, tuple(channels), read_facts(table, TEXTS))


def _names(scenario: Scenario) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Every title that a log of this scenario may have, and the recording's columns that it is about."""
    muscles, chambers = muscle_names(scenario.orthosis), scenario.orthosis.chamber
    yield "time", ()
    yield "angle", ("ankle/angle",)
    for words in ("pressure", "absolute pressure"):
        yield from ((f"{words} {chamber}", (f"chamber/{chamber}/pressure",)) for chamber in chambers)
    for group, described in scenario.orthosis.muscle.items():
        yield f"force {group}", tuple(f"muscle/{group}_{k + 1}/force" for k in range(described.count))
    for muscle in muscles:
        yield f"force {muscle}", (f"muscle/{muscle}/force",)
    for path in recorded_columns(scenario):
        yield path, (path,)


def recorded_columns(scenario: Scenario) -> list[str]:
    """The columns that a run of a scenario records, but its time and its coordinates."""
    return [name for name in formulas(build(scenario)) if name != "time" and not name.startswith("qpos/")]


def read_noise(log: Log, texts: JsonDict) -> dict[str, float]:
    """The noise of each channel [SI], by title: as stated ({"angle": "0.5 deg"}), else estimated."""
    for channel in log.channels:
        if np.ptp(channel.values) == 0.0 and channel.title not in texts:
            problem = "is constant, so its noise cannot be estimated and it would outweigh everything else"
            allowed = "its noise stated, or a log without this column"
            raise InputError(problem, file=log.file, field=channel.title, allowed=allowed)
    noise = {channel.title: channel.noise(log.time) for channel in log.channels}
    for name, text in texts.items():
        meant = next((c for c in log.channels if name == c.title or (name,) == c.columns), None)
        if meant is None:
            raise unknown(name, noise, field="noise", problem="the log has no such channel")
        deviation = quantity_at(f"noise.{name}", text, meant.si)
        if deviation <= 0.0:
            raise InputError("is out of range", field=f"noise.{name}", value=text, allowed="more than 0")
        noise[meant.title] = deviation
    return noise


_CONDUCTANCE = ("chamber", ("", "dm^3/(s*bar)"), (1e-12, 1e-7), 5e-10, True)
_WALL, _TUBE = "orthosis.chamber.{}.wall_conductance", "orthosis.chamber.{}.tube_volume"
# Name, key, of each, SI unit and that for people's eyes, what is searched, usual size, as a ratio.
_ALL: tuple[tuple[str, str, str, tuple[str, str], tuple[float, float], float, bool], ...] = (
    # R of the muscles' damper
    ("damping", "orthosis.muscle.{}.type.damping", "muscle", ("", "m^2*s"), (1e-7, 1e-1), 1e-4, True),
    ("inlet_conductance", "orthosis.chamber.{}.inlet.conductance", *_CONDUCTANCE),
    ("outlet_conductance", "orthosis.chamber.{}.outlet.conductance", *_CONDUCTANCE),
    # heat from the air to the wall, hA; between valves and muscles
    ("wall_conductance", _WALL, "chamber", ("", "W/K"), (1e-3, 1e2), 0.3, True),
    ("tube_volume", _TUBE, "chamber", ("", "ml"), (1e-8, 1e-3), 4e-6, True),
    # Coulomb friction about the ankle; inertia on top of the model's
    ("friction", "leg.friction", "", ("", "N*m"), (0.0, 20.0), 0.1, False),
    ("inertia", "leg.inertia", "", ("", "kg*m^2"), (0.0, 1.0), 5e-3, False),
    # what the log's clock reads when the timer starts
    ("time_offset", "", "", ("s", "ms"), (-0.5, 0.5), 0.05, False),
)
# name → the key that it sets, of each chamber or muscle, and the parameter in general
KINDS = {
    name: (key, each, FitParameter(name, unit, shown, low, high, 0.0, 0.0, size, logarithmic=ratio))
    for name, key, each, (unit, shown), (low, high), size, ratio in _ALL
}


def sets_of(parameter: FitParameter, value: float, source: str) -> JsonDict:
    """Dotted keys and values that give a scenario a value of a parameter."""
    first, found = next(iter(parameter.keys), ""), {}
    for key, share in parameter.keys.items():
        origin = source if share == 1.0 else f"{source}; {share:.4g} times {first}, as before"
        text = format_quantity(share * value, parameter.unit)
        found[key] = {"value": text, "source": origin, "kind": "fitted"}
    return found


def find_parameters(names: Sequence[str], scenario: Scenario) -> tuple[FitParameter, ...]:
    """The parameters of a scenario by name."""
    found = [_find(name, scenario) for name in names]
    taken: dict[str, str] = {}
    for parameter in found:
        for key in parameter.keys or {parameter.name: 1.0}:
            if key in taken:
                problem = f"sets what {taken[key]!r} sets already"
                raise InputError(problem, field="free", value=parameter.name)
            taken[key] = parameter.name
    return tuple(found)


def _find(name: str, scenario: Scenario) -> FitParameter:
    general, dot, one = name.partition(".")
    if general not in KINDS:
        raise unknown(name, KINDS, field="free", problem="is not a dynamic parameter")
    key, each, kind = KINDS[general]
    members = list(getattr(scenario.orthosis, each)) if each else []
    if dot and one not in members:
        allowed = [general, *(f"{general}.{member}" for member in members)]
        raise unknown(name, allowed, field="free", problem=f"there is no such {each or 'part'}")
    if not key:
        return kind
    paths = [key.format(member) for member in ([one] if dot else members)] or [key]
    fields = [field_at(path, scenario) for path in paths]
    values = [float(field.value) for field in fields]
    (low, high), start, unit = fields[0].bounds, values[0], fields[0].unit
    low, high = max(kind.lower, low), min(kind.upper, high)
    size = start if start and kind.logarithmic else kind.size
    # from zero no ratio can be kept
    shares = [value / start for value in values] if all(values) else [1.0] * len(values)
    kind = replace(kind, unit=unit, lower=low, upper=high, low=start, high=start, size=size)
    if start and not low <= start <= high:
        problem, value = "starts beyond what is searched", format_quantity(start, unit)
        allowed_range = f"{kind.number(low):g} to {kind.number(high):g} {kind.shown}"
        raise InputError(problem, field=paths[0], value=value, allowed=allowed_range)
    return replace(kind, name=name, keys=dict(zip(paths, shares, strict=True)))


@dataclass(frozen=True)
class RunProblem:
    """A scenario as plain data, its free parameters, and the log that they are fitted to; SI."""

    scenario: JsonDict
    free: tuple[FitParameter, ...]
    log: Log
    noise: dict[str, float]
    hold_out: float

    @property
    def starts(self) -> dict[str, float]:
        """Each parameter's value before the fit [SI]."""
        return {p.name: p.low for p in self.free}

    @property
    def seen(self) -> np.ndarray:
        """Mask of the samples that are fitted when the rest is held out."""
        first, last = self.log.time[[0, -1]]
        return self.log.time <= last - self.hold_out * (last - first)


def pose(
    source: Given, data: TableLike, names: Sequence[str] = (), *, sets: Mapping[str, object] | None = None,
    noise: Mapping[str, object] | None = None, hold_out: float = HELD_OUT,
) -> RunProblem:  # fmt: skip
    """Read a log for a scenario, and find the parameters to fit."""
    if not 0.0 <= hold_out <= 0.9:
        raise InputError("is out of range", field="hold_out", value=hold_out, allowed="0 to 0.9")
    scenario = load("scenario", source, sets)
    log = read_log(data, scenario)
    parameters = find_parameters(names, scenario)
    problem = RunProblem(scenario.resolved(), parameters, log, read_noise(log, dict(noise or {})), hold_out)
    samples = int(problem.seen.sum()) * len(log.channels)
    if samples <= len(names):
        few = f"contains {samples} samples outside its held-out part for {len(names)} parameters"
        raise InputError(few, file=log.file, allowed="more samples than parameters")
    return problem


def run_at(problem: RunProblem, values: Values) -> Recording:
    """The run with other values, at every step, as far as the log goes."""
    source = f"fitted to {problem.log.file.name}"
    sets = {k: v for p in problem.free for k, v in sets_of(p, values[p.name], source).items()}
    scenario = load("scenario", problem.scenario, sets)
    slack = max([p.upper for p in problem.free if not p.keys], default=0.0)
    end = problem.log.time[-1] + slack + scenario.timestep
    end = end if slack else min(end, scenario.duration)
    built = build(scenario.with_values(duration=end, record_rate=1.0 / scenario.timestep))
    rollout = simulate(built, described_policy(built) or schedule.controls(built))
    if rollout.failure is not None:
        raise rollout.failure
    return make_recording(built, rollout)


def differences(problem: RunProblem, values: Values, recording: Recording) -> dict[str, np.ndarray]:
    """Run less log at the log's times, by channel [SI]."""
    time = problem.log.time - values.get("time_offset", 0.0)
    return {c.title: c.simulated(recording, time) - c.values for c in problem.log.channels}
