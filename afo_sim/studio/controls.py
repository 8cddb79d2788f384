"""What a page has to change: keys of the scenario with their values, units, sources and ranges."""

import functools
import re
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace

from afo_sim.common import InputError, Json, JsonDict, assets, in_unit, parse_quantity
from afo_sim.description import NOT_OF_OWN_WALK, load
from afo_sim.description.keys import Key
from afo_sim.model import walker_of
from afo_sim.studio.design import Design


@dataclass(frozen=True)
class _Row:
    """A control for a key; `{group}` and `{chamber}` stand for each of the orthosis'."""

    key: str
    label: str
    unit: str = ""
    low: float = 0.0
    high: float = 1.0
    step: float = 0.01
    choices: str = ""
    more: bool = False


_PATIENT = (
    _Row("patient", "patient", choices="patient"),
    _Row("patient.body_mass", "body mass", "kg", 30.0, 130.0, 1.0),
    _Row("patient.body_height", "body height", "m", 1.1, 2.1, 0.01),
    _Row("patient.dorsiflexor_strength", "remaining dorsiflexor strength, healthy = 1"),
    _Row("patient.passive_scale", "stiffness of the ankle's tissue, healthy = 1", "", 0.1, 3.0, 0.05),
    _Row("patient.spasticity", "spasticity", "N*m*s/rad", 0.0, 5.0, 0.1),
    _Row("patient.plantarflexor_strength", "remaining plantarflexor strength, healthy = 1", more=True),
    _Row("patient.passive_offset", "angle at which the tissue is slack", "deg", -20.0, 20.0, 0.5, more=True),
    _Row("shoe", "shoe without the device", choices="shoe", more=True),
)
_DEVICE = (
    _Row("orthosis.muscle.{group}.type", "muscle", choices="muscle"),
    _Row("orthosis.muscle.{group}.count", "number of muscles", "", 1.0, 6.0, 1.0),
    _Row("orthosis.muscle.{group}.link_length", "link", "mm", 20.0, 200.0, 1.0),
    _Row("orthosis.muscle.{group}.slack", "slack", "mm", 0.0, 40.0, 1.0, more=True),
    _Row("orthosis.anchor.shank.stiffness", "cuff stiffness", "kN/m", 1.0, 20.0, 0.5),
    _Row("orthosis.anchor.foot.stiffness", "foot plate stiffness", "kN/m", 10.0, 200.0, 5.0, more=True),
)
_AIR = (
    _Row("supply.pressure", "supply pressure, gauge", "bar", 0.5, 8.0, 0.05),
    _Row("supply.source", "bottle or compressor", choices="source"),
    _Row("orthosis.chamber.{chamber}.inlet", "inlet valve", choices="valve"),
    _Row("orthosis.chamber.{chamber}.outlet", "outlet valve", choices="valve", more=True),
    _Row("orthosis.chamber.{chamber}.tube", "tube", choices="tube", more=True),
    _Row("orthosis.chamber.{chamber}.tube_length", "tube length", "m", 0.05, 3.0, 0.05, more=True),
    _Row("start.{chamber}.fill_time", "filled before the first step for", "s", 0.0, 10.0, 0.1, more=True),
)
_ROWS: dict[str, tuple[_Row, ...]] = {"patient": _PATIENT, "device": _DEVICE, "air": _AIR}
_ROWS["timing"] = (_Row("timer.period", "the timer's period", "s", 0.5, 20.0, 0.05),)


def idle(design: Design) -> dict[str, str]:
    """Why a key, or a whole group of them, changes no number of a design."""
    scenario, orthosis = design.scenario, design.scenario.orthosis
    own = [f"patient.{key}" for key in NOT_OF_OWN_WALK]
    switched, begun = scenario.timer or scenario.phases, scenario.start.chambers if scenario.start else {}
    chambers, closed = switched.chambers if switched else {}, dict[str, str]()
    for name in orthosis.chamber if switched and [*orthosis.switched] == [*orthosis.chamber] else ():
        valve, times = f"orthosis.chamber.{name}", chambers.get(name)
        if not getattr(times, "inlet", ()) and name not in begun:
            shut = (f"{valve}.inlet", f"{valve}.outlet", f"phases.{name}.outlet", f"timer.{name}.outlet")
            closed |= dict.fromkeys(shut, "nothing fills this chamber")
        elif not getattr(times, "outlet", ()):
            closed[f"{valve}.outlet"] = "never opened (Timing)"
    rules = (
        (not orthosis.muscle, ["device"], "Nothing is worn: open a scenario with a device."),
        (not orthosis.chamber, ["air", "timing"], "Nothing takes air."),
        (orthosis.chamber and not switched, ["timing"], "A controller switches the valves."),
        (walker_of(scenario) == "patient", own, "not applied: the walk is the patient's own, as recorded"),
        (orthosis.outsole and scenario.reference != "shoe", ["shoe"], "the device has a sole of its own"),
    )
    return closed | {key: why for holds, keys, why in rules if holds for key in keys}


def controls(design: Design) -> list[JsonDict]:
    """The controls of a design as a page draws them, in its order."""
    found, reasons = [], idle(design)
    for group, row in ((group, row) for group, row in _rows(design) if row.key in design.keys):
        key = design.keys[row.key]
        if not key.value and ".tube" in key.key:  # goes with its length, both in the orthosis' file
            continue
        own = {
            "group": group,
            "value": round(_number(key, row.unit), 6) if not row.choices and key.value else key.value or None,
            "choices": _choices(row.choices) if row.choices else (),
            "reference": key.reference or key.source,
            "idle": reasons.get(row.key, ""),
        }
        found.append(asdict(key) | asdict(row) | own)
    return found


def values(design: Design) -> dict[str, tuple[str, str, bool]]:
    """By key: its label, its value in the unit of the page or else in SI, and whether it was set here."""
    labels = {row.key: row.label for _, row in _rows(design)}
    return {
        name: (labels.get(name) or _label(name), _in_words(key), key.source == "set")
        for name, key in design.keys.items()
        if not name.endswith(("description", "name"))
    }


def _label(name: str) -> str:
    """A key in words where it is an anchor's or a time of a valve, else as it is."""
    if place := re.fullmatch(r"orthosis\.muscle\.([\w-]+)\.(\w+)\.from_joint\[(\d)\]", name):
        return f"{place[1]} {place[2]}, {('forward', 'sideways', 'up')[int(place[3])]}"
    if time := re.fullmatch(r"(?:phases|timer)\.([\w-]+)\.(\w+)\[(\d+)\]\[([01])\]", name):
        return f"{time[1]} {time[2]}, bar {int(time[3]) + 1} {('opens', 'shuts')[int(time[4])]}"
    return name


def _in_words(key: Key) -> str:
    """A value with its unit, so that equal values read alike."""
    if key.value in ("", "[]") or not key.unit:
        return key.value.replace("[]", "") or "none"
    unit = _unit_of(key.key) or key.unit
    return f"{_number(key, unit):.6g} {unit}".replace("*", "·")


def _number(key: Key, unit: str) -> float:
    return in_unit(parse_quantity(key.value, key.unit), key.unit, unit) if key.unit else float(key.value)


def _rows(design: Design) -> Iterator[tuple[str, _Row]]:
    """The rows with their group, once for each muscle group or chamber, whose name the label begins with."""
    orthosis = design.scenario.orthosis
    names = {"{group}": list(orthosis.muscle), "{chamber}": list(orthosis.chamber)}
    for group, row in ((group, row) for group, rows in _ROWS.items() for row in rows):
        part = next((part for part in names if part in row.key), "")
        for name in names.get(part, [""]):
            label = f"{name}: {row.label}" if part else row.label
            yield group, replace(row, key=row.key.replace(part, name), label=label)


@functools.cache
def _choices(kind: str) -> tuple[tuple[str, str], ...]:
    """(name, what it is) of all that is shipped of a kind."""
    return tuple((name, str(getattr(load(kind, name), "description", ""))) for name in assets.names(kind))


_UNITS = {  # in which the page shows a number, by its key
    **{
        re.sub(r"\\{\w+\\}", r"[\\w-]+", re.escape(row.key)): row.unit
        for rows in _ROWS.values()
        for row in rows
    },
    r"phases\.[\w-]+\.(inlet|outlet)(\[\d+\]\[[01]\])?": "",
    r"timer\.[\w-]+\.(inlet|outlet)(\[\d+\]\[[01]\])?": "s",
    r"orthosis\.muscle\.[\w-]+\.(origin|insertion)\.from_joint\[[012]\]": "mm",
}


def _unit_of(key: str) -> str | None:
    return next((unit for pattern, unit in _UNITS.items() if re.fullmatch(pattern, key)), None)


def shown(key: str, value: Json) -> Json:
    """A value as `--set` takes it, in the page's unit and with four digits."""
    unit = _unit_of(key)
    if unit and isinstance(value, str):
        return f"{in_unit(parse_quantity(value, unit), unit, unit):.4g} {unit}"
    return f"{float(value):.4g}" if unit == "" and re.fullmatch(r"-?[\d.e-]+", str(value)) else value


def read(key: str, value: Json) -> Json:
    """A page's value as `--set` takes it: a number with the unit in which the page shows it."""
    unit = _unit_of(key)
    if unit is None and not key.startswith(("orthosis.", "supply.", "phases.", "timer.", "start.")):
        raise InputError("is not changed by this page", field=key, value=value)
    if isinstance(value, list) and unit:
        return [read(key, each) for each in value]
    return f"{value:.9g} {unit}" if unit and isinstance(value, int | float) else value
