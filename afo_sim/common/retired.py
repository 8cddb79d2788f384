"""Older names of the library and its commands: led on with one notice, or refused by what to use instead."""

import functools
import importlib
import sys
import warnings
from collections.abc import Callable
from typing import NoReturn, ParamSpec, TypeVar, cast

from afo_sim.common.errors import InputError
from afo_sim.common.open_types import Keywords, Mixed

P = ParamSpec("P")
R = TypeVar("R")
_ATTACH = "afo_sim.attach, which puts an orthosis on any MuJoCo model or MjSpec"
RETIRED = {  # refused
    "bode": "a sweep over the frequency of the controller's reference",
    "pressure_map": "`afo-sim torque-map`; an impedance is a controller of a few lines, docs/controllers.md",
    "OrthosisEntity": _ATTACH,
    "entity": _ATTACH,
    "leg_entity": _ATTACH,
    "OrthosisVecEnv": "stable_baselines3's own DummyVecEnv or SubprocVecEnv around gymnasium.make",
    "dropfoot_day": "dropfoot_walk, with `sets` for other patients",
    "walk(kept)": "`afo-sim walk`, which goes on after a kill; simulation.occupy(folder, NAME) in Python",
}
RENAMED = {  # answered by this version: what it is now
    "Both": "afo_sim.simulation:Both",
    "attached": "afo_sim.legs:read_attached",
    "bridge.physics": "afo_sim.rl.physics",
    "dm_control_physics": "afo_sim.rl:dm_control_physics",
    "environments": "afo_sim.rl.environments",
    "fit_run": "afo_sim:fit",
    "fit_torque": "afo_sim:fit",
    "respond": "afo_sim:walk",
    # arguments
    "effects(report)": "progress",
    "fit(report)": "progress",
    "optimise(over)": "parameters",
    "paper(report)": "progress",
    "size(report)": "progress",
    "stand(report)": "progress",
    "validate(report)": "progress",
    # commands and their options
    "afo-sim both --set-left": "--left-set",
    "afo-sim fit --fix": "--fixed",
    "afo-sim fit --tell": "--fact",
    "afo-sim fit-run": "afo-sim fit",
    "afo-sim fit-run --fit": "--free",
    "afo-sim fit-torque": "afo-sim fit",
    "afo-sim fit-torque --fit": "--free",
    "afo-sim stand --fit": "--free",
    "afo-sim walk --adapt": "--generations",
}
ANSWERS = {"fit_run": "afo_sim.lab:fit_run", "fit_torque": "afo_sim.lab:fit_torque"}  # by their own arguments


def older(name: str) -> Mixed:
    """What an older name stands for now, with a FutureWarning; else as `refuse_retired`."""
    if name not in RENAMED:
        refuse_retired(name.rpartition(".")[2])
    warnings.warn(notice(f"afo_sim.{name}", RENAMED[name].replace(":", ".")), FutureWarning, stacklevel=3)
    module, _, attribute = ANSWERS.get(name, RENAMED[name]).partition(":")
    found = importlib.import_module(module)
    return getattr(found, attribute) if attribute else found


def newer(program: str, args: list[str]) -> list[str]:
    """A command and what follows it, as they are called now; a line on stderr of each older word."""
    asked, words = f"{program} {args[0]}", list[str]()
    for number, word in enumerate(args):
        option, equals, value = word.partition("=")
        name = f"{asked} {option}" if number else asked
        if name in RENAMED:
            print(f"warning: {notice(name, RENAMED[name])}", file=sys.stderr)
            word = RENAMED[name].removeprefix(f"{program} ") + equals + value
        words.append(word)
    return words


def notice(name: str, now: str) -> str:
    """What is said of an older name."""
    return f"{name} is {now} now; the older name ends with this version"


def takes_older(function: Callable[P, R]) -> Callable[P, R]:
    """A function that takes its older arguments, too, with a FutureWarning each."""

    @functools.wraps(function)
    def call(*args: P.args, **given: P.kwargs) -> R:
        name, now = function.__name__, Keywords()
        for argument, value in given.items():
            if (entry := f"{name}({argument})") in RETIRED:
                refuse_retired(entry)
            new = RENAMED.get(entry)
            if new and new in given:
                raise TypeError(f"{name}() got {argument}, and {new}, which is its newer name")
            if new:
                warnings.warn(notice(f"{name}({argument}=)", f"{new}="), FutureWarning, stacklevel=2)
            now[new or argument] = value
        return cast(Callable[..., R], function)(*args, **now)

    return call


def refuse_retired(name: str) -> NoReturn:
    """A module's `__getattr__`: InputError of a retired name, AttributeError of any other."""
    if name not in RETIRED:
        raise AttributeError(name)
    raise InputError("is retired", field=name, allowed=RETIRED[name])
