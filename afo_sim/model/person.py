"""Whose leg walks: the patient's size, or the recorded walker's, or the leg's; the tissue of that size."""

import functools
import math
import os
import pathlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import TypeVar

from afo_sim.common import InputError, JsonMapping, Mixed, Notice, assets
from afo_sim.description import Gait, Ground, Provenance, Scenario, load
from afo_sim.gait import Chain, GaitCycle, Walker, as_healthy, family, scaled, signs, stepped, uncompensated
from afo_sim.gait import file as gait_file

T = TypeVar("T")
# What nothing switches, measures or compares: of a scenario of the leg alone.
UNDRIVEN: JsonMapping = {
    **dict.fromkeys(("reference", "start", "timer", "phases", "controller")),
    "drive": {},
    "sensor": {},
}


@dataclass(frozen=True)
class Person:
    """Whose leg it is."""

    body_mass: float  # [kg]
    body_height: float  # [m]


_KNOWN: ContextVar[dict[object, Mixed] | None] = ContextVar("known", default=None)


@contextmanager
def stride_files_stay() -> Iterator[None]:
    """A block in which a scenario's person and walk are found once: a case asks for them fifty times."""
    token = None if _KNOWN.get() is not None else _KNOWN.set({})
    try:
        yield
    finally:
        if token is not None:
            _KNOWN.reset(token)


def _once(of: Callable[[Scenario], T]) -> Callable[[Scenario], T]:
    """A function of a scenario, which in such a block is not asked again."""

    @functools.wraps(of)
    def asked(scenario: Scenario) -> T:
        known = _KNOWN.get()
        if known is None:
            return of(scenario)
        if (key := (of, id(scenario))) not in known:
            known[key] = of(scenario), scenario  # which lives on, and nothing else has its number
        return known[key][0]

    return asked


@dataclass(frozen=True)
class Size:
    """Factors on a leg's masses and lengths, of the body that it was made for."""

    # Source: Hof 1996, Gait Posture 4(3), doi 10.1016/0966-6362(95)01057-2: moments by m g l, times by √(l/g)
    heavier: float = 1.0
    taller: float = 1.0

    @staticmethod
    @_once
    def of(scenario: Scenario) -> "Size":
        """The person's."""
        leg, person = scenario.leg, person_of(scenario)
        return Size(person.body_mass / leg.body_mass, person.body_height / leg.body_height)

    @property
    def slower(self) -> float:
        """Factor on times: √length."""
        return math.sqrt(self.taller)

    @property
    def springy(self) -> float:
        """Factor on the stiffness about a joint: moments go with mass × length at the same angles."""
        return self.heavier * self.taller

    @property
    def damped(self) -> float:
        """Factor on the damping about a joint: moment × time."""
        return self.springy * self.slower


@_once
def person_of(scenario: Scenario) -> Person:
    """The patient's own mass and height; what is not stated is the recorded walker's, else the leg's."""
    leg, patient = scenario.leg, scenario.patient
    mass = None if patient is None else patient.body_mass
    height = None if patient is None else patient.body_height
    if scenario.gait is not None and (mass is None or height is None):
        walker = recorded_stride(scenario.gait)
        mass = walker.body_mass if mass is None else mass
        height = walker.body_height if height is None else height
    return Person(leg.body_mass if mass is None else mass, leg.body_height if height is None else height)


@_once
def walker_of(scenario: Scenario) -> Walker:
    """Whose walk drives the shank: a healthy walker's, or the patient's own without the device."""
    gait = scenario.gait
    assert gait is not None
    walker = gait.walker or recorded_stride(gait).walker
    if walker is None:
        allowed = 'a header line "# walker: healthy" or "# walker: patient" in the file, or '
        allowed += "gait.walker = healthy or patient in the scenario"
        problem = "does not state whose walk it is"
        raise InputError(problem, file=gait.cycle, field="walker", allowed=allowed)
    return walker


USUAL_GROUND = Ground()  # of who walks, where nothing else is described


def in_contact(scenario: Scenario) -> bool:
    """Whether the foot is on a floor, instead of under the recorded force."""
    ground = scenario.ground
    return scenario.gait is not None and (ground is None or ground.mode == "contact")


def as_recorded(scenario: Scenario) -> Scenario:
    """The scenario in what the recorded walker wore: nothing, or the shoe where the recording has a sole."""
    gait = scenario.gait
    assert gait is not None
    sole = recorded_stride(gait).sole_thickness if gait.sole_thickness is None else gait.sole_thickness
    worn = {"orthosis": load("orthosis", "none"), "shoe": scenario.shoe if sole else None}
    return scenario.with_values(**UNDRIVEN, **worn)


@_once
def taller_than_recorded(scenario: Scenario) -> float:
    """Factor by which the scenario's person is taller than the recorded walker [-]."""
    assert scenario.gait is not None
    trial = recorded_stride(scenario.gait).body_height or scenario.leg.body_height
    return person_of(scenario).body_height / trial


@_once
def persons_stride(scenario: Scenario) -> GaitCycle:
    """The recorded stride as the scenario's person walks it; a walker of unknown height is of the leg's."""
    gait = scenario.gait
    assert gait is not None
    stride = recorded_stride(gait, taller_than_recorded(scenario))
    if gait.compensation == "removed":
        return uncompensated(stride, person_of(scenario).body_height)
    return _stepped(stride, gait.steppage_hip, gait.steppage_knee, person_of(scenario).body_height)


@functools.lru_cache(maxsize=8)  # cases of a sweep share it
def _stepped(stride: GaitCycle, hip: float, knee: float, body_height: float) -> GaitCycle:
    return stepped(stride, hip, knee, Chain.of_height(body_height))


def signs_of_compensation(scenario: Scenario) -> tuple[Notice, ...]:
    """Signs of a drop foot in a walk; if they contradict the stated walker, a doubt about it."""
    gait, own = scenario.gait, walker_of(scenario) == "patient"
    assert gait is not None
    stride = recorded_stride(gait, taller_than_recorded(scenario))
    seen = signs(stride, person_of(scenario).body_height)
    if own and not seen and scenario.orthosis.muscle:  # what is worn is judged on that walk
        return as_healthy(stride)
    if gait.compensation == "removed":
        return ()
    if not seen or own:
        return seen
    text = "the walk is described as a healthy walker's, but {seen}: if it is the patient's own, set "
    text += "gait.walker=patient, or the weakness counts twice"
    return tuple(Notice("walker-not-usual", text, subject="gait.walker", seen=str(each)) for each in seen)


def doubts_of_trial(scenario: Scenario) -> tuple[Notice, ...]:
    """Doubts of the walk's import about its trial, from its file: plates, clock, mass, a foot."""
    gait = scenario.gait
    assert gait is not None
    said = recorded_stride(gait).notes.get("quality", "")
    found = [part.removeprefix("doubted: ") for part in said.split("; ") if part.startswith("doubted: ")]
    text = "the walk's trial is doubtful: {faults}; the ankle moment may be wrong (see `afo-sim gait show`)"
    return tuple(Notice("trial-doubted", text, subject="gait.cycle", faults=each) for each in found)


def recorded_stride(gait: Gait, taller: float = 1.0) -> GaitCycle:
    """The recorded stride scaled to a person taller by a factor."""
    try:
        now = os.stat(file := found_gait(gait.cycle))  # noqa: PTH116
    except OSError:  # it has gone since
        found_gait.cache_clear()
        now = os.stat(file := found_gait(gait.cycle))  # noqa: PTH116
    return _similar(file, (now.st_mtime_ns, now.st_size, now.st_ino), gait.speed, taller)


@functools.lru_cache(maxsize=64)
def found_gait(cycle: str) -> str:
    """The file of a recorded walk, by its name or path."""
    return str(assets.find_gait(cycle))


_Stamp = tuple[int, int, int]  # time of change [ns], size and number of a file: a changed one has another


# Cases of a sweep share most of this.
@functools.lru_cache(maxsize=8)
def _read(file: str, stamp: _Stamp, speed: float | None, taller: float) -> GaitCycle:
    path = pathlib.Path(file)
    return gait_file.read(path) if speed is None else family.at_speed(path, speed, taller)


@functools.lru_cache(maxsize=8)
def _similar(file: str, stamp: _Stamp, speed: float | None, taller: float) -> GaitCycle:
    return scaled(_read(file, stamp, speed, 1.0 if speed is None else taller), taller)


def with_person(scenario: Scenario) -> Scenario:
    """The scenario with the person's mass and height, whose walk it is, and the ground, stated."""
    patient, gait = scenario.patient, scenario.gait
    if patient is None or gait is None:
        return scenario
    recorded = f"of the recorded walker, gait {pathlib.Path(gait.cycle).name}"
    sources = dict(patient.provenance)
    if patient.body_mass is None:
        sources["body_mass"] = Provenance(kind="derived", source=recorded)
    if patient.body_height is None and recorded_stride(gait).body_height is not None:
        sources["body_height"] = Provenance(kind="derived", source=recorded)
    elif patient.body_height is None:
        source = "from the leg: the recorded walker's is not known"
        sources["body_height"] = Provenance(kind="assumed", source=source)
    person, walker = person_of(scenario), walker_of(scenario)
    stated: dict[str, object] = {"body_mass": person.body_mass, "body_height": person.body_height}
    stated["provenance"] = sources
    # a copy is not checked again: a gait file's mass is checked where it is read
    told = {"patient": patient.model_copy(update=stated), "gait": gait.model_copy(update={"walker": walker})}
    return scenario.model_copy(update=told | {"ground": scenario.ground or USUAL_GROUND})


@dataclass(frozen=True)
class Tissue:
    """scale of Riener & Edrich's healthy mean [-], offset of its zero [rad], damping [N·m·s/rad]."""

    scale: float
    offset: float
    damping: float


def healthy_tissue(scenario: Scenario) -> Tissue:
    """The leg's, at the person's size, without what the patient's ails."""
    leg, size = scenario.leg, Size.of(scenario)
    return Tissue(leg.passive.scale * size.springy, leg.passive.offset, leg.damping * size.damped)


def own_tissue(scenario: Scenario) -> Tissue:
    """The patient's own; where there is none, the leg's."""
    healthy, patient = healthy_tissue(scenario), scenario.patient
    if patient is None:
        return healthy
    scale = healthy.scale * patient.passive_scale
    return Tissue(scale, healthy.offset + patient.passive_offset, healthy.damping)


def reflex_gain(scenario: Scenario) -> float:
    """Gain of the spastic plantarflexors at the person's size [N·m·s/rad]; of a patient's own walk none."""
    assert scenario.patient is not None
    if walker_of(scenario) == "patient":
        return 0.0
    return scenario.patient.spasticity * Size.of(scenario).damped
