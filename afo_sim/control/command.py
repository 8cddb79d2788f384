"""Commands to chambers by name: two valves' coils, or a pressure that a drive makes of them."""

import numbers
from collections.abc import Iterable, Mapping

from afo_sim.common import InputError, gauge, nearest_name, si, unknown

Command = str | float | tuple[float, float]  # a word, a gauge pressure [Pa] or with its unit, or two coils
COILS = {"inlet": (1.0, 0.0), "outlet": (0.0, 1.0), "both": (1.0, 1.0), "shut": (0.0, 0.0)}
TIMED = "timed"
HIGHEST = 2e6  # pressure that may be asked for, gauge [Pa]
WORDS = "inlet, outlet, both, shut, or the two coils (inlet, outlet) from 0 to 1"


def coils(
    commands: Mapping[str, Command],
    chambers: Iterable[str],
    allowed: str = WORDS,
    three_way: Iterable[str] = (),
) -> dict[str, tuple[float, float]]:
    """Coils (inlet, outlet) [-] of the commanded chambers; a refusal states `allowed`."""
    known, one_coil = list(chambers), set(three_way)
    found = {}
    for chamber, command in commands.items():
        if chamber not in known:
            raise unknown(chamber, known, field="chamber", problem="the orthosis has no such chamber")
        if isinstance(command, str):
            if command not in COILS:
                nearest, problem = nearest_name(command, COILS), "is not a valid command"
                raise InputError(problem, field=chamber, value=command, allowed=allowed, nearest=nearest)
            found[chamber] = COILS[command]
            if chamber in one_coil and command in ("shut", "both"):
                raise _one_coil(chamber, command)
            continue
        try:
            inlet, outlet = (float(coil) for coil in command)  # type: ignore[union-attr]  # or refused below
        except (TypeError, ValueError):
            problem = "is not a valid command"
            raise InputError(problem, field=chamber, value=command, allowed=allowed) from None
        if not (0.0 <= inlet <= 1.0 and 0.0 <= outlet <= 1.0):
            raise InputError("is outside a coil's range", field=chamber, value=command, allowed=allowed)
        if chamber in one_coil and min(inlet, outlet) > 0.0:
            raise _one_coil(chamber, command)
        found[chamber] = (inlet, outlet)
    return found


def _one_coil(chamber: str, command: object) -> InputError:
    problem = "is impossible for a 3/2 valve: it fills with current and vents without"
    allowed = "inlet, outlet, or two coils, one of them 0"
    return InputError(problem, field=chamber, value=command, allowed=allowed)


def checked_pressure(pressure: float | str) -> float:
    """A supply's gauge pressure [Pa]; InputError unless it is not negative."""
    found = gauge(pressure, "supply_pressure")
    if not 0.0 <= found <= HIGHEST:
        raise InputError("is out of range", field="supply_pressure", value=pressure, allowed="0 to 20 bar")
    return found


def checked(
    commands: object, chambers: Iterable[str], driven: Iterable[str] = (), three_way: Iterable[str] = ()
) -> dict[str, tuple[float, float] | float | None]:
    """Commands of a control period: coils (inlet, outlet), pressure [Pa], or None for the timing."""
    if not isinstance(commands, Mapping):
        allowed = 'a mapping of chambers, such as {"dorsiflexor": "inlet"}'
        raise InputError("is not a valid command", field="command", value=commands, allowed=allowed)
    known, drives, one_coil = list(chambers), set(driven), set(three_way)
    found: dict[str, tuple[float, float] | float | None] = {}
    for chamber, command in commands.items():
        if chamber not in known:
            raise unknown(chamber, known, field="chamber", problem="the orthosis has no such chamber")
        if isinstance(command, str) and command == TIMED:
            found[chamber] = None
        elif _is_pressure(command):
            pressure = si(command, "Pa", chamber)
            if chamber not in drives:
                problem = f"is a pressure, but the chamber has no drive: describe [drive.{chamber}]"
                raise InputError(problem, field=chamber, value=pressure, allowed=WORDS)
            if not 0.0 <= pressure <= HIGHEST:
                allowed = f"a gauge pressure from 0 to {HIGHEST:g} Pa"
                raise InputError("is out of range", field=chamber, value=pressure, allowed=allowed)
            found[chamber] = pressure
        else:
            asks = f"{WORDS}; {TIMED}"
            if chamber in drives:
                asks += f'; or a gauge pressure from 0 to {HIGHEST:g} Pa, a number or "3 bar"'
            found |= coils({chamber: command}, known, asks, one_coil)
    return found


def _is_pressure(command: object) -> bool:
    if isinstance(command, str):
        return command.lstrip(" +-.")[:1].isdigit()
    return isinstance(command, numbers.Real) and not isinstance(command, bool)


def switched(on: bool, value: float, low: float, high: float) -> bool:
    """Whether it is on: from `high` on, off below `low`, as it was between them."""
    return value >= high or (on and value >= low)
