"""A design to be looked at: an orthosis on a leg, the facts of its muscles, and what is wrong with them."""

import os
import pathlib
from collections.abc import Mapping
from dataclasses import dataclass

from afo_sim.common import InputError, JsonDict, Shown, assets, gauge, unique, unknown
from afo_sim.description import Orthosis, Scenario, load
from afo_sim.model.build import Built, build, check_description
from afo_sim.model.leg_shapes import ThroughLeg, through_leg
from afo_sim.model.path_facts import PathFacts, path_facts
from afo_sim.model.torque_map import beyond_pressure

Source = str | os.PathLike[str] | Orthosis | Scenario
SITTING = "seated"  # scenario into which an orthosis is put that is given alone


@dataclass(frozen=True, eq=False, repr=False)
class Design(Shown):
    """An orthosis on a leg."""

    built: Built  # the compiled scenario
    facts: list[PathFacts]  # of every group of alike muscles
    through: list[ThroughLeg]  # whose path passes through the leg

    @property
    def warnings(self) -> list[str]:
        """Everything that is wrong: paths through the leg, pressures beyond a limit, what building found."""
        worst: dict[tuple[str, str, bool], ThroughLeg] = {}  # of the muscles of a group, the deepest
        for path in self.through:
            key = path.role, path.part, path.bone
            sign = -1.0 if path.bone else 1.0  # of bone the distance is given
            if key not in worst or sign * path.depth > sign * worst[key].depth + 1e-9:
                worst[key] = path
        found: list[str] = [path.notice for path in worst.values()]
        for entry in self.facts:
            found += beyond_pressure(entry.name, entry.group, float(entry.pressures[-1]))
        of_the_run = list(check_description(self.built.scenario))
        found += [warning for warning in self.built.warnings if warning not in of_the_run]
        return unique(found)


def design(source: Source, *, leg: str | None = None, pressure: float | str | None = None) -> Design:
    """Put an orthosis on a leg, and compute the facts of its muscles."""
    return design_of(build(scenario_of(source, leg)), None if pressure is None else gauge(pressure))


def design_of(built: Built, pressure: float | None = None) -> Design:
    """The facts of a compiled scenario's muscles; parameters and errors as of `design`."""
    return Design(built, path_facts(built, pressure), through_leg(built))


def scenario_of(source: Source, leg: str | None = None) -> Scenario:
    """The scenario of an orthosis: its own where a scenario is given, else one of sitting with it."""
    sets: JsonDict = {} if leg is None else {"leg": leg}
    if isinstance(source, Scenario):
        return source.set(sets) if sets else source
    if isinstance(source, Orthosis):
        return _around(source, source, sets)
    text = os.fspath(source)
    path = pathlib.Path(text)
    if text in assets.names("orthosis"):
        return _around(text, load("orthosis", text), sets, _home(text))
    if text in assets.names("scenario"):
        return load("scenario", text, sets)
    if not path.exists():
        names = [*assets.names("orthosis"), *assets.names("scenario")]
        raise unknown(text, names, field="orthosis", problem="there is no such orthosis, scenario or file")
    if path.is_dir():
        found = [path / name for name in ("orthosis.toml", "scenario.toml") if (path / name).is_file()]
        if not found:
            raise InputError("the folder holds no orthosis", file=path, allowed="one with orthosis.toml")
        path = found[0]
    table = assets.read_toml(path)
    if "orthosis" in table or "duration" in table:
        return load("scenario", str(path), sets)
    name = path.resolve().parent.name
    home = _home(name) if assets.shipped_name(path.resolve()) else SITTING
    return _around(str(path.resolve()), load("orthosis", str(path)), sets, home)


def _around(
    value: str | Orthosis, orthosis: Orthosis, sets: Mapping[str, object] = {}, home: str = SITTING
) -> Scenario:
    """A scenario with an orthosis that cannot run alone; every chamber is filled for 4 s of 8."""
    timer = {"period": "8 s"} | {name: {"inlet": [["0 s", "4 s"]]} for name in orthosis.chamber}
    return load("scenario", home, {"orthosis": value, "timer": timer, **sets})


def _home(name: str) -> str:
    """The shipped scenario in which an orthosis sits: on its own rig, where it has one."""
    for scenario in (SITTING, *assets.names("scenario")):
        table = assets.read_toml(assets.find("scenario", scenario))
        if table.get("orthosis") == name and "gait" not in table:
            return scenario
    return SITTING
