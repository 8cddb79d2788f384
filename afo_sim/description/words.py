"""A resolved scenario in words for people who do not read TOML."""

from collections.abc import Iterator, Mapping
from typing import Any

from afo_sim.common.units import parse_quantity

Scenario = Mapping[str, Any]


def body_mass(scenario: Scenario) -> float:
    """Body mass of the patient, or of the person that the leg belongs to [kg]."""
    mass = (scenario.get("patient") or {}).get("body_mass") or scenario["leg"]["body_mass"]
    return parse_quantity(mass, "kg")


def facts(scenario: Scenario) -> list[tuple[str, str]]:
    """Facts of a resolved scenario for a table: (what, in words)."""
    return [*_who(scenario), *_walking(scenario), *_device(scenario)]


def _who(scenario: Scenario) -> Iterator[tuple[str, str]]:
    patient, leg = scenario.get("patient"), scenario["leg"]
    if not patient:
        yield "leg", str(leg.get("description") or leg["name"])
        return
    strengths = ", ".join(
        f"{side}flexors {100.0 * patient[f'{side}flexor_strength']:.0f} %" for side in ("dorsi", "plantar")
    )
    words = f"{patient.get('description') or patient.get('name')}; strength left: {strengths}"
    spastic = parse_quantity(patient.get("spasticity") or "0 N*m*s/rad", "N*m*s/rad")
    if spastic > 0.0:
        words += f"; spasticity {spastic:g} N·m·s/rad"
    yield "patient", f"{words}; {body_mass(scenario):g} kg"


def _walking(scenario: Scenario) -> Iterator[tuple[str, str]]:
    gait = scenario.get("gait")
    if not gait:
        knee = (scenario.get("shank") or {}).get("knee_angle")
        fixed = "shank held still"
        if knee is not None:
            fixed += f", knee at {_in(knee, 'deg'):.0f}°"
        yield "motion", fixed
        return
    words = f"recorded stride {gait['cycle']}"
    if gait.get("stride_time"):
        words += f", played at {_in(gait['stride_time'], 's'):g} s per stride"
    if gait.get("variability"):
        words += f", stride time varied by {100.0 * gait['variability']:g} %"
    yield "walking", words
    if (scenario.get("ground") or {}).get("mode", "recorded") == "recorded":
        yield "ground", "the recorded force, whatever the foot does: it can pass through the floor (a trip)"
    else:
        yield "ground", "contact of this foot with the floor"


def _device(scenario: Scenario) -> Iterator[tuple[str, str]]:
    orthosis = scenario["orthosis"]
    if not orthosis.get("muscle"):
        yield "orthosis", "none"
        return
    yield "orthosis", str(orthosis.get("description") or orthosis["name"])
    for name, group in orthosis["muscle"].items():
        muscle = group["type"]
        yield f"muscles, {name}", f"{group['count']} × {muscle.get('description') or muscle['name']}"
    yield "supply", f"{_in(scenario['supply']['pressure'], 'bar'):g} bar (gauge)"
    yield from _valves(scenario)


def _valves(scenario: Scenario) -> Iterator[tuple[str, str]]:
    """The times at which each chamber is filled and vented."""
    phases, timer = scenario.get("phases"), scenario.get("timer")
    for chamber in scenario["orthosis"].get("chamber", {}):
        if phases:
            table = phases.get(chamber) or {}
            when = "of the gait cycle"
        elif timer:
            table = timer.get(chamber) or {}
            when = f"of every {_in(timer['period'], 's'):g} s"
        else:
            continue
        parts = [
            f"{verb} {' and '.join(_span(a, b) for a, b in table[side])}"
            for side, verb in (("inlet", "filled"), ("outlet", "vented"))
            if table.get(side)
        ]
        yield f"valves, {chamber}", f"{', '.join(parts)} {when}" if parts else "shut"


def _span(start: float | str, end: float | str) -> str:
    """An interval of gait phase or of time."""
    if isinstance(start, str) or isinstance(end, str):
        return f"{_in(str(start), 's'):g}–{_in(str(end), 's'):g} s"
    return f"{100.0 * start:g}–{100.0 * end:g} %"


def _in(text: str, unit: str) -> float:
    return parse_quantity(text, unit)
