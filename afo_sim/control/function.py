"""A controller of a user's own, which a scenario names: `[controller] function = "mine"`."""

import functools
import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

from afo_sim.common import Function, Given, InputError, Mixed, nearest_name, takes, unknown
from afo_sim.control.controller import Controller
from afo_sim.description import Scenario

OWN: dict[str, "OwnController"] = {}  # by name


@dataclass(frozen=True)
class OwnController:
    """A controller of a user's own; called, it is the function or class that it was made of."""

    name: str  # by which a scenario names it
    made_of: Function  # the function or class

    def __call__(self, *given: Given, **named: Given) -> Mixed:
        return self.made_of(*given, **named)

    def fresh(self, scenario: Scenario) -> Controller:
        """The controller of one simulation, with the parameters of the scenario."""
        described = scenario.controller
        parameters = {} if described is None else dict(described.parameters)
        known = list(inspect.signature(self.made_of).parameters.values())[1:]
        names, at = [each.name for each in known], "controller.parameters."
        for name in parameters.keys() - {*names}:
            raise unknown(name, names, field=at + name, problem="is none of its parameters")
        for each in known:
            if each.default is each.empty and each.name not in parameters:
                raise InputError("is missing", field=at + each.name, allowed="a number")
        if isinstance(self.made_of, type):
            return cast(Controller, self(scenario, **parameters))
        return functools.partial(self.made_of, **parameters) if parameters else self.made_of


def controller(name: str) -> Callable[[Function], OwnController]:
    """Make a function or a class a controller that scenarios can name after `register`.

    A function is called with the observation at every command and keeps no state. A class is called with
    the scenario, once per simulation; its instance is called with the observation. Further arguments are
    numbers, `[controller.parameters]` of the scenario.

    Parameters
    ----------
    name : that `[controller] function` gives

    Returns
    -------
    OwnController; calling it calls the function or class

    Examples
    --------
    >>> @controller("fill_below")
    ... def fill_below(seen, pressure=2e5):
    ...     return {"dorsiflexor": "inlet" if seen["chamber/dorsiflexor/pressure"] < pressure else "shut"}
    >>> register(fill_below)
    >>> mine = {"function": "fill_below", "parameters": {"pressure": 1e5}}
    >>> run("seated", {"controller": mine, "timer": None, "duration": "1 s"}).ok
    True
    """
    return lambda made_of: OwnController(name, made_of)


def CONTROLLER(name: str, scenario: Scenario) -> Controller:
    """The controller that a scenario names."""
    if name not in OWN:
        allowed = "a name that afo_sim.register took, or --extension FILE with it on the command line"
        problem, nearest = "is not registered", nearest_name(name, OWN)
        raise InputError(problem, field="controller.function", value=name, allowed=allowed, nearest=nearest)
    return OWN[name].fresh(scenario)


def _add(own: OwnController) -> None:
    if not isinstance(own.name, str) or not own.name or not callable(own.made_of):
        raise InputError("is no controller", field="controller", value=own.name, allowed="a name, a function")
    OWN[own.name] = own


takes(OwnController, _add)
