"""Which supply pressures muscles and valves are allowed."""

from afo_sim.description.air.air_graph import highest_pressures
from afo_sim.description.scenario import Scenario
from afo_sim.model.air_checks import valves_of

ALLOWED = "allowed pressure"  # what a pressure beyond it fails
ALIKE = 1.0 + 1e-9
Limit = tuple[float, str]  # gauge pressure [Pa], who is allowed no more


def exceeded(scenario: Scenario, pressure: float) -> Limit | None:
    """The lowest limit that a supply pressure exceeds: of a muscle, or of what a valve's maker allows.

    Regulators in the air path count: what is behind one gets no more than it holds.

    Units: pressure [Pa], returns [Pa].
    """
    orthosis = scenario.orthosis
    highest = highest_pressures(orthosis, pressure)
    found: list[Limit] = []
    for name, group in orthosis.muscle.items():
        limit = group.type.limits.pressure
        if highest.get(group.chamber or name, pressure) > limit * ALIKE:
            found.append((limit, "the muscles are"))
    for name, valve, before in valves_of(orthosis):
        if (
            valve.working_pressure is not None
            and highest.get(before, 0.0) > valve.working_pressure[1] * ALIKE
        ):
            found.append((valve.working_pressure[1], f"valve {name} ({valve.name or 'unnamed'}) is"))
    return min(found, default=None)


def highest_allowed(scenario: Scenario, pressure: float) -> float:
    """The pressure, or the highest below it that all muscles and valves are allowed [Pa]."""
    limit = exceeded(scenario, pressure)
    while limit is not None and limit[0] < pressure:
        pressure = limit[0]
        limit = exceeded(scenario, pressure)
    return pressure
