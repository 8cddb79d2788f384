"""A builder's own log of a device: a CSV of time, angle, pressures, forces, as columns of a recording."""

import pathlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.common.csv_table import Table, number, read_facts, scale_of, split_title, table_of
from afo_sim.common.errors import InputError, nearest_name, unknown
from afo_sim.common.units import AMBIENT_PRESSURE, parse_quantity
from afo_sim.description.scenario import Scenario
from afo_sim.model.air_path import AirPath
from afo_sim.model.mounting import muscle_names, valve_names
from afo_sim.simulation.columns import describe
from afo_sim.simulation.recording import Recording

EXAMPLE = "time [s], angle [deg], pressure dorsiflexor [bar], force dorsiflexor_1 [N]"
HEADER: dict[str, str | None] = {"source": None, "licence": None, "note": None}
FEWEST = 10  # samples
ANKLE = ("angle", "velocity", "acceleration", "moment/orthosis", "moment/passive", "moment/gravity")
LOAD = "moment/load"  # where the scenario has one
MUSCLE = ("force", "length", "velocity", "contraction", "path_length", "moment_arm")
CUFF = ("force", "displacement")
CHAMBER = ("pressure", "mass", "volume", "temperature", "mass_flow_in", "mass_flow_out")
VALVE = ("coil", "opening", "mass_flow")
HELD = ("pressure", "mass", "temperature")  # of a volume or a store
SUPPLY = ("pressure", "set_pressure", "mass_flow", "exergy_flow")
EXHAUST = ("mass_flow", "exergy_flow")


@dataclass(frozen=True)
class Channel:
    """One measured quantity: its samples [SI], and the recording's columns whose sum it is.

    `title` is what the log calls it, `unit` the log's own, `scale` takes that unit to SI.
    """

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
        """Spread of the samples about their neighbours [SI], never below the log's resolution.

        The median deviation from the line through both neighbours, as a standard deviation: where the
        signal is smooth against the sampling, that is the sensor's noise.
        """
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
    facts: dict[str, Any]

    def channel(self, name: str, field: str) -> Channel:
        """A channel by its title or by its column; `field` names the argument in the message."""
        for channel in self.channels:
            if name == channel.title or (name,) == channel.columns:
                return channel
        titles = [channel.title for channel in self.channels]
        raise unknown(name, titles, field=field, problem="the log has no such channel")


def read_log(data: Any, scenario: Scenario) -> Log:
    """A log, read against the scenario that it was taken of.

    Titles are `time`, `angle`, `pressure CHAMBER`, `absolute pressure CHAMBER`, `force MUSCLE` (a group's
    name means all its muscles together), or paths of a recording's columns, each with its unit.
    """
    table = table_of(data, EXAMPLE, "log")
    file = table.file
    titles = [_meaning(table, title, scenario) for title in table.titles]
    _require(table, titles)
    columns = []
    for k, (name, _, scale, offset) in enumerate(titles):
        cells = [number(file, line, name, row[k]) for line, row in table.rows]
        columns.append(np.array(cells) * scale + offset)
    clock = [name for name, *_ in titles].index("time")
    _check_time(table, columns[clock], scenario)
    channels = [
        Channel(name, paths, split_title(title)[1], scale, values)
        for (name, paths, scale, _), title, values in zip(titles, table.titles, columns, strict=True)
        if name != "time"
    ]
    return Log(file, columns[clock], tuple(channels), read_facts(table, HEADER))


Meaning = tuple[str, tuple[str, ...], float, float]  # name, columns, factor and summand to SI


def _meaning(table: Table, title: str, scenario: Scenario) -> Meaning:
    """The columns that a title stands for, and its unit."""
    name = " ".join(split_title(title)[0].split())
    known = dict(_names(scenario))
    if name not in known:
        shown = [other for other in known if "/" not in other]
        raise InputError(
            "is an unknown column",
            file=table.file,
            field="header",
            value=title,
            allowed=f"{', '.join(shown)}, or a recording's column such as ankle/velocity",
            nearest=nearest_name(name, known),
        )
    paths = known[name]
    si = "s" if name == "time" else describe(paths[0])[0]
    scale, _ = scale_of(table.file, name, title, (si,), EXAMPLE)
    return name, paths, scale, -AMBIENT_PRESSURE if name.startswith("absolute ") else 0.0


def _names(scenario: Scenario) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Every title that a log of this scenario may have, and the recording's columns that it is about."""
    muscles, chambers = muscle_names(scenario.orthosis), scenario.orthosis.chamber
    yield "time", ()
    yield "angle", ("ankle/angle",)
    for chamber in chambers:
        yield f"pressure {chamber}", (f"chamber/{chamber}/pressure",)
    for chamber in chambers:
        yield f"absolute pressure {chamber}", (f"chamber/{chamber}/pressure",)
    for group, described in scenario.orthosis.muscle.items():
        yield f"force {group}", tuple(f"muscle/{group}_{k + 1}/force" for k in range(described.count))
    for muscle in muscles:
        yield f"force {muscle}", (f"muscle/{muscle}/force",)
    for path in recorded_columns(scenario):
        yield path, (path,)


def recorded_columns(scenario: Scenario) -> list[str]:
    """The columns that a run of a scenario records, but its time and its coordinates."""
    orthosis = scenario.orthosis
    paths = [f"ankle/{part}" for part in (*ANKLE, *([LOAD] if scenario.load_moment else []))]
    paths += [f"muscle/{name}/{part}" for name in muscle_names(orthosis) for part in MUSCLE]
    paths += [f"cuff/{name}/{part}" for name in orthosis.anchor for part in CUFF]
    paths += [f"chamber/{name}/{part}" for name in orthosis.chamber for part in CHAMBER]
    air = AirPath.of(orthosis, scenario.supply)
    between = [each.name for each in air.restrictions if each.valve is not None]
    paths += [f"valve/{name}/{part}" for name in (*valve_names(orthosis), *between) for part in VALVE]
    paths += [f"restriction/{each.name}/mass_flow" for each in air.restrictions if each.valve is None]
    paths += [f"volume/{each.name}/{part}" for each in air.volumes for part in HELD]
    paths += [f"store/{each.name}/{part}" for each in air.stores for part in HELD]
    source = scenario.supply.source
    running = ("running",) if source is not None and source.kind == "compressor" else ()
    paths += [f"supply/{part}" for part in (*SUPPLY, *running)]
    return paths + [f"exhaust/{part}" for part in EXHAUST]


def _require(table: Table, titles: list[Meaning]) -> None:
    """Time, something measured, nothing twice, enough of it."""
    names, seen = [name for name, *_ in titles], list[tuple[str, ...]]()
    for name, paths, *_ in titles:
        if paths in seen:
            raise InputError("stands there twice", file=table.file, field=name)
        seen.append(paths)
    if "time" not in names or len(names) < 2:
        lacking = "a time" if "time" not in names else "anything measured"
        raise InputError(
            f"lacks {lacking}", file=table.file, field="header", value=", ".join(names), allowed=EXAMPLE
        )
    if len(table.rows) < FEWEST:
        raise InputError(f"holds {len(table.rows)} samples", file=table.file, allowed=f"at least {FEWEST}")


def _check_time(table: Table, time: np.ndarray, scenario: Scenario) -> None:
    late = np.flatnonzero(np.diff(time) <= 0.0)
    if len(late):
        line = table.rows[late[0] + 1][0]
        raise InputError(
            f"line {line}: time does not increase",
            file=table.file,
            field="time",
            value=f"{time[late[0] + 1]:g} s",
        )
    if time[0] < 0.0 or time[-1] > scenario.duration:
        early = time[0] < 0.0
        cure = "cut what is before the timer's start" if early else "a longer duration"
        raise InputError(
            "is outside the scenario",
            file=table.file,
            field="time",
            value=f"{time[0] if early else time[-1]:g} s",
            allowed=f"0 s to {scenario.duration:g} s; {cure}",
        )


def read_noise(log: Log, texts: dict[str, Any]) -> dict[str, float]:
    """The noise of each channel [SI], by title: as told ({"angle": "0.5 deg"}), else estimated."""
    for channel in log.channels:
        if np.ptp(channel.values) == 0.0 and channel.title not in texts:
            raise InputError(
                "is constant, so its noise cannot be estimated, and it would outweigh all else",
                file=log.file,
                field=channel.title,
                allowed="its noise told, or a log without this column",
            )
    noise = {channel.title: channel.noise(log.time) for channel in log.channels}
    for name, text in texts.items():
        channel = log.channel(name, "noise")
        try:
            deviation = parse_quantity(text, channel.si)
        except ValueError as error:
            raise InputError(str(error), field=f"noise.{name}", value=text) from None
        if deviation <= 0.0:
            raise InputError("is out of range", field=f"noise.{name}", value=text, allowed="more than 0")
        noise[channel.title] = deviation
    return noise
