"""Could this person and device exist? Names the fields of implausible values.

Bounds of single keys are wide, since a leg may be a robot's and a muscle a prototype. Here person, leg and
device are looked at together. A limit without a source is this project's own: it lies beyond all that is
shipped or was read of.
"""

import functools
import math
import operator
from collections.abc import Iterator
from types import SimpleNamespace

import mujoco

from afo_sim.common import Notice
from afo_sim.description import MASS_SHARES, Anchor, Described, Orthosis, Scenario
from afo_sim.model.person import person_of
from afo_sim.model.walk import stride_time_of

IMPLAUSIBLE = "design-implausible"
BMI = (13.0, 80.0)  # mass over squared height: thin children to the heaviest [kg/m²]
_LEGS_BMI = (16.0, 38.0)  # of the body that a leg was made for
_APART = 0.5  # how far a segment's mass may be off its share
_FOOT_LENGTH, _SHANK_LENGTH = 0.152, 0.246  # share of the body's height (Winter 2009)
_TALL = (0.7, 2.3)  # of people who walk [m]
_BESIDE = 0.13  # of an anchor from the shank's axis [m]
_ABOVE, _UNDER, _BEHIND = 0.06, 0.1, 0.12  # of an anchor on the foot, from the ankle [m]
_BEYOND = 0.05  # a muscle that is longer than the shank by more has no place on it [m]
_LIMITS = (  # (table of parts or "", key, lowest, highest, factor to the unit in words, unit)
    ("orthosis.muscle", "count", 1.0, 8.0, 1.0, ""),
    ("orthosis.muscle", "link_length", 0.0, 0.4, 1e2, " cm"),
    ("orthosis.muscle", "slack", 0.0, 0.1, 1e2, " cm"),
    ("orthosis.muscle", "cable.stiffness", 1e3, 1e7, 1e-3, " kN/m"),
    ("orthosis.muscle", "type.bore", 3e-3, 0.06, 1e3, " mm"),
    ("orthosis.muscle", "type.limits.pressure", 5e4, 1.2e6, 1e-5, " bar"),
    ("orthosis.anchor", "stiffness", 200.0, 1e6, 1e-3, " kN/m"),
    ("orthosis.interface", "area", 5e-4, 0.08, 1e4, " cm²"),
    ("orthosis.interface", "friction", 0.1, 1.0, 1.0, ""),
    ("orthosis.chamber", "inlet.conductance", 0.0, 2e-7, 1e8, " dm³/(s·bar)"),
    ("orthosis.chamber", "outlet.conductance", 0.0, 2e-7, 1e8, " dm³/(s·bar)"),
    ("orthosis.chamber", "tube_volume", 0.0, 5e-4, 1e6, " ml"),
    ("", "orthosis.outsole.heel_stack", 0.0, 0.08, 1e3, " mm"),
    ("", "orthosis.outsole.ball_stack", 0.0, 0.08, 1e3, " mm"),
    ("", "supply.pressure", 0.0, 1.2e6, 1e-5, " bar"),
    ("", "supply.source.volume", 0.0, 0.02, 1e3, " l"),
    ("", "supply.source.filling_pressure", 0.0, 3.6e7, 1e-5, " bar"),
    ("", "limits.bottle_volume", 0.0, 0.02, 1e3, " l"),
    ("", "limits.bottle_pressure", 0.0, 3.6e7, 1e-5, " bar"),
)
# both in C: cases of a sweep ask them all
_PARTS = {part: operator.attrgetter(part) for part, *_ in _LIMITS if part}
_VALUES = {key: operator.attrgetter(key) for _, key, *_ in _LIMITS}


def implausible(scenario: Scenario, model: mujoco.MjModel) -> Iterator[Notice]:
    """A warning for each key whose value no person or worn device has, and for keys that change nothing."""
    for name in ("orthosis", "supply", "limits"):
        yield from _beyond(name, getattr(scenario, name))
    if scenario.leg.joint != "ankle":
        return
    leg, person = scenario.leg, person_of(scenario)
    for of, mass, height, (low, high) in (
        ("patient", person.body_mass, person.body_height, BMI),
        ("leg", leg.body_mass, leg.body_height, _LEGS_BMI),
    ):
        if not _TALL[0] <= height <= _TALL[1]:
            yield _doubt(f"{of}.body_height", f"{height:.3g} m", f"{_TALL[0]:g} to {_TALL[1]:g} m")
        if not low <= mass / height**2 <= high:
            least, most = (bound * height**2 for bound in (low, high))
            pair = f"{of}.body_mass beside {of}.body_height"
            yield _doubt(pair, f"{mass:.4g} kg", f"{least:.0f} to {most:.0f} kg at {height:.3g} m")
    yield from _leg(scenario, model)
    yield from _mounted(scenario.leg.body_height, scenario.orthosis)
    if scenario.gait is not None and not 0.55 <= (time := stride_time_of(scenario)) <= 3.5:
        yield _doubt("gait.stride_time", f"{time:.3g} s", "0.55 to 3.5 s")


@functools.lru_cache(maxsize=16)  # cases of a sweep share them
def _beyond(of: str, described: Described | None) -> tuple[Notice, ...]:
    """The keys of one table of a scenario that are beyond their limits."""
    scenario, found = SimpleNamespace(**{of: described}), []
    for part, key, low, high, factor, unit in _LIMITS:
        if (part or key).partition(".")[0] != of:
            continue
        held = _PARTS[part](scenario) if part else scenario
        for name, each in held.items() if isinstance(held, dict) else (("", held),):
            try:
                value = _VALUES[key](each)
            except AttributeError:  # what is not there, such as a source
                continue
            if value is not None and not low <= value <= high:
                field = ".".join(filter(None, (part, name, key)))
                allowed = f"{factor * low:g} to {factor * high:g}{unit}"
                found.append(_doubt(field, f"{factor * value:.4g}{unit}", allowed))
    return tuple(found)


def _leg(scenario: Scenario, model: mujoco.MjModel) -> Iterator[Notice]:
    """A leg whose masses or lengths are not those of the body that it is said to be of."""
    leg, person = scenario.leg, person_of(scenario)
    for name, share in (("shank", MASS_SHARES["shank"]), ("foot", MASS_SHARES["foot"])):
        body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
        times = float(model.body_mass[body]) / (share * person.body_mass) if body >= 0 else 1.0
        if not 1.0 - _APART <= times <= 1.0 + _APART:
            fits = f"about {times * leg.body_mass:.0f} kg, whose {name} it is; patient.body_mass scales it"
            yield _doubt("leg.body_mass", f"{leg.body_mass:g} kg", fits)
            break
    for key, share in (("foot_length", _FOOT_LENGTH), ("shank_length", _SHANK_LENGTH)):
        told, usual = getattr(leg, key), share * leg.body_height
        if told is not None and not 0.8 <= told / usual <= 1.25:
            wanted = f"about {1e2 * usual:.3g} cm; it changes nothing here, afo-sim leg rescale does"
            yield _doubt(f"leg.{key}", f"{1e2 * told:.3g} cm", wanted)


@functools.lru_cache(maxsize=4)
def _mounted(size: float, orthosis: Orthosis) -> tuple[Notice, ...]:
    """Anchors that are not on a leg of that size [m]: beside it, above the knee, off the foot."""
    knee, toe, found = _SHANK_LENGTH * size, _FOOT_LENGTH * size, []
    places = {
        "shank": f"up to {1e2 * _BESIDE:g} cm from the shank's axis, 0 to {1e2 * knee:.0f} cm above it",
        "foot": f"{-1e2 * _BEHIND:g} to {1e2 * toe:.0f} cm ahead of the ankle, {-1e2 * _UNDER:g} to "
        f"{1e2 * _ABOVE:g} cm above it",
    }
    for name, group in orthosis.muscle.items():
        for end in ("origin", "insertion"):
            anchor: Anchor | None = getattr(group, end)
            if anchor is None:
                continue
            x, y, z = anchor.from_joint
            on = {
                "shank": math.hypot(x, y) <= _BESIDE and -0.02 <= z <= knee,
                "foot": -_BEHIND <= x <= toe and abs(y) <= 0.1 and -_UNDER <= z <= _ABOVE,
            }
            if not on.get(anchor.segment, True):
                at = ", ".join(f"{1e2 * each:.3g}" for each in anchor.from_joint)
                field = f"orthosis.muscle.{name}.{end}.from_joint"
                found.append(_doubt(field, f"{at} cm", places[anchor.segment]))
        long = group.type.total_length
        if group.pulley is None and long > knee + _BEYOND:
            field = f"orthosis.muscle.{name}.type.total_length"
            fits = f"up to {1e2 * (knee + _BEYOND):.0f} cm on this shank"
            found.append(_doubt(field, f"{1e2 * long:.3g} cm", fits))
    return tuple(found)


def _doubt(field: str, value: str, allowed: str) -> Notice:
    text = "{subject} = {value} is implausible for a person or a worn device; expected {allowed}"
    return Notice(IMPLAUSIBLE, text, subject=field, value=value, allowed=allowed)
