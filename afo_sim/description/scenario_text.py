"""A resolved scenario in words for people who do not read TOML."""

import pathlib
from collections.abc import Iterator

from afo_sim.common import JsonMapping, parse_quantity
from afo_sim.description.joint import JOINTS, Joint

_Scenario = JsonMapping

_REFERENCES = {  # who the same patient's other run is
    "barefoot": "the same patient barefoot",
    "shoe": "the same patient in the {shoe}, without orthosis",
    "orthosis-off": "the same patient with the orthosis and no air",
}
# of the patient: what an own walk was recorded with, and is not applied again; as healthy people have it
NOT_OF_OWN_WALK = dict.fromkeys(("dorsiflexor_strength", "plantarflexor_strength", "stiffness"), 1.0)
NOT_OF_OWN_WALK |= {"spasticity": 0.0}


def joint_words(scenario: _Scenario) -> Joint:
    """Words of the joint that a scenario is about; an older one's has none but an ankle's."""
    return JOINTS[scenario["leg"].get("joint", "ankle")]


def body_mass(scenario: _Scenario) -> float:
    """Body mass of the patient, or of the person that the leg belongs to [kg]."""
    mass = (scenario.get("patient") or {}).get("body_mass") or scenario["leg"]["body_mass"]
    return parse_quantity(mass, "kg")


def body_height(scenario: _Scenario) -> float:
    """Body height of the patient, or of the person that the leg belongs to [m]."""
    height = (scenario.get("patient") or {}).get("body_height") or scenario["leg"]["body_height"]
    return parse_quantity(height, "m")


def worn(scenario: _Scenario) -> str:
    """Footwear of a walk: "barefoot", "shoe trainer" or "outsole of s1"; "" without walking."""
    orthosis, shoe = scenario["orthosis"], scenario.get("shoe")
    if not scenario.get("gait"):
        return ""
    if orthosis.get("outsole"):
        return f"outsole of {(orthosis.get('name') or 'the orthosis').replace('_', ' ')}"
    return f"shoe {shoe.get('name') or 'without a name'}" if shoe else "barefoot"


def reference(scenario: _Scenario) -> str:
    """What a scenario's run is compared with, as it goes into a sentence; "" where nothing is stated."""
    kind, shoe = scenario.get("reference"), scenario.get("shoe") or {}
    name = shoe.get("name") or ""
    return _REFERENCES[kind].format(shoe=f"shoe {name}" if name else "same shoe") if kind else ""


def own_walk(scenario: _Scenario) -> bool:
    """Whether the recorded walk is the patient's own, without the device."""
    return (scenario.get("gait") or {}).get("walker") == "patient"


def unapplied(description: str) -> list[str]:
    """Keys that were set, alone or with the whole patient, and that a patient's own walk has no use for."""
    whole = "set patient=" in description
    return [f"patient.{key}" for key in NOT_OF_OWN_WALK if whole or f"set patient.{key}=" in description]


def facts(scenario: _Scenario) -> list[tuple[str, str]]:
    """Facts of a resolved scenario for a table: (what, in words)."""
    return [*_who(scenario), *_walking(scenario), *_device(scenario)]


def _who(scenario: _Scenario) -> Iterator[tuple[str, str]]:
    patient, leg = scenario.get("patient"), scenario["leg"]
    if not patient:
        yield "leg", str(leg.get("description") or leg["name"])
        return
    words = [str(patient.get("description") or patient.get("name"))]
    if own_walk(scenario):
        words.append("muscles as in the patient's own recorded walk")
    else:  # what is left of the muscles of a patient whom a healthy walker carries
        shares = [(side, 100.0 * patient[f"{side}flexor_strength"]) for side in ("dorsi", "plantar")]
        words.append(
            f"remaining strength: {', '.join(f'{side}flexors {share:.0f} %' for side, share in shares)}"
        )
        if spastic := parse_quantity(patient.get("spasticity") or "0 N*m*s/rad", "N*m*s/rad"):
            words.append(f"spasticity {spastic:g} N·m·s/rad")
    if (scale := float(patient.get("passive_scale", 1.0))) != 1.0:
        words.append(f"passive tissue {scale:g} times as stiff")
    if offset := parse_quantity(patient.get("passive_offset") or "0 rad", "deg"):
        words.append(f"passive tissue shifted by {offset:.3g}°")
    yield "patient", f"{'; '.join(words)}; {body_mass(scenario):g} kg, {body_height(scenario):g} m"


def _walking(scenario: _Scenario) -> Iterator[tuple[str, str]]:
    gait = scenario.get("gait")
    if not gait:
        joint, knee = joint_words(scenario), (scenario.get("shank") or {}).get("knee_angle")
        fixed = f"{joint.above} fixed"
        if knee is not None and joint is JOINTS["ankle"]:
            fixed += f", knee at {parse_quantity(knee, 'deg'):.0f}°"
        yield "motion", fixed
        return
    yield "worn", worn(scenario)
    if scenario.get("reference"):
        yield "compared with", reference(scenario)
    words = f"stride {pathlib.Path(gait['cycle']).stem.replace('_', ' ')}"
    words += ", the patient's own walk without the device" if own_walk(scenario) else ""
    if gait.get("stride_time"):
        words += f", played at {parse_quantity(gait['stride_time'], 's'):g} s per stride"
    if gait.get("variability"):
        words += f", stride time varied by {100.0 * gait['variability']:g} %"
    if gait.get("pace"):
        changes = (f"{float(factor):g} from {parse_quantity(at, 's'):g} s on" for at, factor in gait["pace"])
        words += f", cadence times {', '.join(changes)} (0: standing)"
    yield "walking", words
    if (scenario.get("ground") or {}).get("mode") != "contact":
        yield (
            "ground",
            "the recorded force whatever the foot does: the foot can pass through the floor (a trip)",
        )
    else:
        yield "ground", "contact of this foot with the floor"


def _device(scenario: _Scenario) -> Iterator[tuple[str, str]]:
    orthosis = scenario["orthosis"]
    if not orthosis.get("muscle"):
        yield "orthosis", "none"
        return
    yield "orthosis", str(orthosis.get("description") or orthosis["name"])
    for name, group in orthosis["muscle"].items():
        muscle = group["type"]
        words = f"{group['count']} × {muscle.get('description') or muscle['name']}"
        yield f"muscles, {name}", words + _guides(group)
    yield "supply", f"{parse_quantity(scenario['supply']['pressure'], 'bar'):g} bar (gauge)"
    yield from _valves(scenario)


def _guides(group: _Scenario) -> str:
    """What a path runs through and around, as a part of a sentence."""
    path = group.get("path") or ()
    surfaces = sum(1 for place in path if place.get("surface"))
    points = len(path) - surfaces
    parts = [
        f"{number} {word}{'s' if number > 1 else ''}"
        for number, word in ((points, "point"), (surfaces, "surface"))
        if number
    ]
    friction = float(group.get("wrap_friction") or 0.0)
    words = f"; path over {' and '.join(parts)}" if parts else ""
    return words + (f", friction {friction:g}" if friction else "")


def _valves(scenario: _Scenario) -> Iterator[tuple[str, str]]:
    """The times at which each chamber is filled and vented."""
    phases, timer = scenario.get("phases"), scenario.get("timer")
    for chamber in scenario["orthosis"].get("chamber", {}):
        if phases:
            table = phases.get(chamber) or {}
            when = "of the gait cycle"
        elif timer:
            table = timer.get(chamber) or {}
            when = f"of every {parse_quantity(timer['period'], 's'):g} s"
        else:
            continue
        parts = [
            f"{verb} {' and '.join(_span(a, b) for a, b in table[side])}"
            for side, verb in (("inlet", "filled"), ("outlet", "vented"))
            if table.get(side)
        ]
        yield f"valves, {chamber}", f"{', '.join(parts)} {when}" if parts else "shut"


def _span(start: float | str, end: float | str) -> str:
    if isinstance(start, str) or isinstance(end, str):
        return f"{parse_quantity(str(start), 's'):g}–{parse_quantity(str(end), 's'):g} s"
    return f"{100.0 * start:g}–{100.0 * end:g} %"
