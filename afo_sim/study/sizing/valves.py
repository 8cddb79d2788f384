"""The smallest valve of the catalogue for one chamber, in the order of sonic conductance."""

from typing import Any

from afo_sim.common import assets
from afo_sim.common.errors import InputError
from afo_sim.description.air.valve import Valve
from afo_sim.description.reader import load
from afo_sim.description.scenario import Scenario
from afo_sim.study.sizing.candidate import Candidate
from afo_sim.study.sizing.pressures import bar
from afo_sim.study.sizing.result import Sizing
from afo_sim.study.sizing.schedule import times_for
from afo_sim.study.sizing.table import ASSUMED
from afo_sim.study.sizing.trial import Trials
from afo_sim.study.sizing.words import larger_is_worse, smallest

SIDES = ("both", "inlet", "outlet")
DM3 = 1e8  # of C: dm³/(s·bar) in one m³/(s·Pa)
UNIT = "dm³/(s·bar)"
MEANING = f"C: sonic conductance [{UNIT}]; b: critical pressure ratio; *: assumed"
HELD = "3/2: its coil stays on until the outlet would open"


def size_valve(trials: Trials, chamber: str, side: str = "both", proportional: bool = False) -> Sizing:
    """The smallest valve."""
    if trials.scenario.orthosis.chamber[chamber].three_way and side != "both":
        problem = f"is of two valves, and chamber {chamber!r} has one 3/2 valve"
        raise InputError(problem, field="side", value=side, allowed="both")
    valves = {name: load("valve", name) for name in assets.names("valve")}
    ordered = sorted(valves.items(), key=lambda item: (item[1].conductance, item[0]))
    candidates = [_candidate(trials.scenario, chamber, side, proportional, *each) for each in ordered]
    tried = trials.run(candidates)
    best = next((each for each in tried if each.meets), None)
    what = f"valve for {chamber}'s {'inlet and outlet' if side == 'both' else side}"
    return Sizing(
        kind="valve",
        scenario=trials.scenario.name,
        requirements=trials.requirements,
        air=trials.air,
        axis=("sonic conductance C", UNIT, DM3),
        tried=tuple(tried),
        best=best,
        answer=smallest(tried, trials.requirements, what, "valve"),
        notes=(MEANING, *larger_is_worse(tried, "valve")),
    )


def _candidate(
    scenario: Scenario, chamber: str, side: str, proportional: bool, name: str, valve: Valve
) -> Candidate:
    ratio = f"{valve.critical_ratio:.3g}"
    told = valve.provenance.get("critical_ratio")
    facts = {
        "C": f"{DM3 * valve.conductance:.3g}",
        "b": f"{ratio}{ASSUMED}" if told is None or told.kind == "assumed" else ratio,
        "ways": "3/2" if valve.three_way else "2/2",
    }
    reason = why_not(scenario, side, proportional, valve)
    sets = {} if reason else _sets(scenario, chamber, side, name, valve)
    notes = (HELD,) if not reason and f"phases.{chamber}.outlet" in sets and valve.three_way else ()
    return Candidate(name, valve.conductance, sets, facts, reason, notes)


def why_not(scenario: Scenario, side: str, proportional: bool, valve: Valve) -> str:
    """Why a valve is not tried; "" where it is."""
    if valve.proportional and not proportional:
        return "a proportional valve, which is tried with --proportional"
    if valve.three_way and side != "both":
        return "a 3/2 valve is inlet and outlet in one, which is tried with --side both"
    if valve.working_pressure is None:
        return ""
    (low, high), pressure = valve.working_pressure, scenario.supply.pressure
    if pressure < low:
        return f"its pilot needs at least {bar(low)}, and the supply has {bar(pressure)}"
    return f"is made for {bar(high)} at most, and the supply has {bar(pressure)}" if pressure > high else ""


def _sets(scenario: Scenario, chamber: str, side: str, name: str, valve: Valve) -> dict[str, Any]:
    """What lays a valve over a chamber."""
    key, now = f"orthosis.chamber.{chamber}", scenario.orthosis.chamber[chamber]
    if not valve.three_way and not now.three_way:
        sides = ("inlet", "outlet") if side == "both" else (side,)
        return {f"{key}.{each}": name for each in sides}
    table = scenario.resolved()["orthosis"]["chamber"][chamber]
    kept = {field: value for field, value in table.items() if field not in ("inlet", "outlet")}
    valves = {"inlet": name} if valve.three_way else {"inlet": name, "outlet": name}
    times = (
        {} if valve.three_way == now.three_way else times_for(scenario, chamber, three_way=valve.three_way)
    )
    return {key: kept | valves, **times}
