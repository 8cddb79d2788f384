"""Commands to the valves of chambers, by name."""

import numbers
from collections.abc import Iterable, Mapping

from afo_sim.common.errors import InputError, unknown
from afo_sim.common.units import LEAST_NUMBER

Command = str | tuple[float, float]
COILS = {"inlet": (1.0, 0.0), "outlet": (0.0, 1.0), "both": (1.0, 1.0), "shut": (0.0, 0.0)}
WORDS = "inlet, outlet, both, shut, or the two coils (inlet, outlet) from 0 to 1"


def coils(commands: Mapping[str, Command], chambers: Iterable[str]) -> dict[str, tuple[float, float]]:
    """Coils (inlet, outlet) [-] of the chambers that are commanded.

    Raises
    ------
    InputError
        There is no such chamber, or it is no command.
    """
    known = list(chambers)
    found = {}
    for chamber, command in commands.items():
        if chamber not in known:
            raise unknown(chamber, known, field="chamber", problem="the orthosis has no such chamber")
        if isinstance(command, str):
            if command not in COILS:
                raise InputError("is no command", field=chamber, value=command, allowed=WORDS)
            found[chamber] = COILS[command]
            continue
        try:
            inlet, outlet = (float(coil) for coil in command)
        except (TypeError, ValueError):
            raise InputError("is no command", field=chamber, value=command, allowed=WORDS) from None
        if not (0.0 <= inlet <= 1.0 and 0.0 <= outlet <= 1.0):
            raise InputError("is outside a coil's range", field=chamber, value=command, allowed=WORDS)
        found[chamber] = (inlet, outlet)
    return found


def checked_pressure(pressure: float) -> float:
    """A supply's gauge pressure [Pa]; InputError unless it is a number that is not negative."""
    if not isinstance(pressure, numbers.Real) or not 0.0 <= pressure <= 2e6:
        allowed = "a number from 0 to 2e6 Pa, gauge"
        raise InputError("is no supply pressure", field="supply_pressure", value=pressure, allowed=allowed)
    if 0.0 < pressure < LEAST_NUMBER:
        problem = "is a number of Pa: was it meant in bar?"
        raise InputError(problem, field="supply_pressure", value=pressure, allowed="4e5, which is 4 bar")
    return float(pressure)
