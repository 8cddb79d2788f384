"""Dynamic parameters that a log can tell: short names, the keys that they set, bounds, units."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from afo_sim.common.errors import InputError, unknown
from afo_sim.common.units import format_quantity, in_unit
from afo_sim.description.keys import field_at
from afo_sim.description.scenario import Scenario


@dataclass(frozen=True)
class RunParameterKind:
    """A dynamic parameter in general. SI; `shown` is the unit for people's eyes.

    `key` is the dotted key that it sets, with {} for each muscle group or chamber (`each`); without a key
    it belongs to the log. `lower` and `upper` are searched, within what the key's field allows; the unit of a
    key is its field's. A `logarithmic` one is searched, and its interval given, as a ratio; `typical`
    is its size, from which the search starts where the scenario says zero.
    """

    name: str
    meaning: str
    key: str
    each: str
    shown: str
    lower: float
    upper: float
    typical: float
    logarithmic: bool
    unit: str = ""


_CONDUCTANCE = ("chamber", "dm^3/(s*bar)", 1e-12, 1e-7, 5e-10, True)
KINDS = {
    kind.name: kind
    for kind in (
        RunParameterKind(
            "damping",
            "R of the muscles' damper",
            "orthosis.muscle.{}.type.damping",
            *("muscle", "m^2*s", 1e-7, 1e-1, 1e-4, True),
        ),
        RunParameterKind(
            "inlet_conductance", "C of the inlets", "orthosis.chamber.{}.inlet.conductance", *_CONDUCTANCE
        ),
        RunParameterKind(
            "outlet_conductance", "C of the outlets", "orthosis.chamber.{}.outlet.conductance", *_CONDUCTANCE
        ),
        RunParameterKind(
            "wall_conductance",
            "heat from the air to the wall, hA",
            "orthosis.chamber.{}.wall_conductance",
            *("chamber", "W/K", 1e-3, 1e2, 0.3, True),
        ),
        RunParameterKind(
            "tube_volume",
            "between valves and muscles",
            "orthosis.chamber.{}.tube_volume",
            *("chamber", "ml", 1e-8, 1e-3, 4e-6, True),
        ),
        RunParameterKind(
            "friction",
            "Coulomb friction about the ankle",
            *("leg.friction", "", "N*m", 0.0, 20.0, 0.1, False),
        ),
        RunParameterKind(
            "inertia",
            "about the ankle, on top of the model's",
            *("leg.inertia", "", "kg*m^2", 0.0, 1.0, 5e-3, False),
        ),
        RunParameterKind(
            "time_offset",
            "what the log's clock reads when the timer starts",
            *("", "", "ms", -0.5, 0.5, 0.05, False, "s"),
        ),
    )
}


@dataclass(frozen=True)
class RunParameter:
    """A dynamic parameter of one scenario: its value there, and the keys that it sets.

    `keys` holds each key's share: the value of the first is the parameter's, the others keep the ratio to
    it that they have in the scenario.
    """

    name: str
    kind: RunParameterKind
    start: float
    keys: dict[str, float]

    @property
    def size(self) -> float:
        """Unit of the search's steps and uncertainties [SI]."""
        return (self.start or self.kind.typical) if self.kind.logarithmic else self.kind.typical

    def search(self, value: float) -> float:
        """A value [SI] as the number that is searched: a logarithm, or a multiple of the typical size."""
        return math.log(value / self.size) if self.kind.logarithmic else value / self.size

    def value(self, x: float) -> float:
        """The value [SI] of a searched number."""
        if self.kind.logarithmic:  # bounded before the exponential, which an interval's end may overflow
            x = min(x, self.search(self.kind.upper))
        inside = self.size * math.exp(x) if self.kind.logarithmic else self.size * x
        return float(min(max(inside, self.kind.lower), self.kind.upper))

    def sets(self, value: float, source: str) -> dict[str, Any]:
        """Dotted keys and values that give a scenario this value."""
        first = next(iter(self.keys), "")
        found = {}
        for key, share in self.keys.items():
            origin = source if share == 1.0 else f"{source}; {share:.4g} times {first}, as before"
            text = format_quantity(share * value, self.kind.unit)
            found[key] = {"value": text, "source": origin, "kind": "fitted"}
        return found

    def shown(self, value: float) -> float:
        """A value in the unit for people's eyes."""
        return in_unit(value, self.kind.unit, self.kind.shown)


def find_parameters(names: Sequence[str], scenario: Scenario) -> tuple[RunParameter, ...]:
    """The parameters of a scenario by name."""
    found = [_find(name, scenario) for name in names]
    taken: dict[str, str] = {}
    for parameter in found:
        for key in parameter.keys or {parameter.name: 1.0}:
            if key in taken:
                raise InputError(
                    f"sets what {taken[key]!r} sets already", field="names", value=parameter.name
                )
            taken[key] = parameter.name
    return tuple(found)


def _find(name: str, scenario: Scenario) -> RunParameter:
    general, dot, one = name.partition(".")
    kind = KINDS.get(general)
    members = list(getattr(scenario.orthosis, kind.each)) if kind is not None and kind.each else []
    if kind is None or (dot and one not in members):
        allowed = [*KINDS] if kind is None else [general, *(f"{general}.{member}" for member in members)]
        raise unknown(
            name,
            allowed,
            field="names",
            problem="is no dynamic parameter" if kind is None else f"there is no such {kind.each or 'part'}",
        )
    if not kind.key:
        return RunParameter(name, kind, 0.0, {})
    keys = [kind.key.format(member) for member in ([one] if dot else members)] if members else [kind.key]
    fields = [field_at(key, scenario) for key in keys]
    low, high = fields[0].bounds
    kind = replace(kind, unit=fields[0].unit, lower=max(kind.lower, low), upper=min(kind.upper, high))
    values = [float(field.value) for field in fields]
    start = values[0]
    # from zero no ratio can be kept
    shares = [value / start for value in values] if all(values) else [1.0] * len(values)
    if start and not kind.lower <= start <= kind.upper:
        low, high = (in_unit(limit, kind.unit, kind.shown) for limit in (kind.lower, kind.upper))
        raise InputError(
            "starts beyond what is searched",
            field=keys[0],
            value=format_quantity(start, kind.unit),
            allowed=f"{low:g} to {high:g} {kind.shown}",
        )
    return RunParameter(name, kind, start, dict(zip(keys, shares, strict=True)))
