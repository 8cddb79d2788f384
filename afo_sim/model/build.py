"""Scenario → compiled model with its parameters, and what only the compiled model can show to be wrong."""

import copy
import dataclasses
import functools
import itertools
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import InputError, JsonMapping, Notice, Shown
from afo_sim.description import NOT_OF_OWN_WALK, Orthosis, Scenario, load, unapplied
from afo_sim.gait import STANCE_FORCE
from afo_sim.model import person, time_step_limits
from afo_sim.model.air_checks import check_air_path
from afo_sim.model.air_path import circuit_of, own_supply
from afo_sim.model.assemble import Geometry, assemble, compiled, geometry_of
from afo_sim.model.contact import Contact, check_sole, register
from afo_sim.model.exact_xml import exact_xml
from afo_sim.model.foot import Foot, fill_hinge
from afo_sim.model.inversion import SideArms
from afo_sim.model.leg import leg_spec
from afo_sim.model.mounting import Index
from afo_sim.model.muscle_weakness import Active, active, own_active
from afo_sim.model.path_checks import check_guides, check_paths, check_stretch
from afo_sim.model.periodic import unseen_drift, why_walked
from afo_sim.model.plausible_design import implausible
from afo_sim.model.walk import Pace, Walk, lay_out
from afo_sim.model.walk_bodies import fill_walking
from afo_sim.physics import KNEE_LIMIT

MISFIT = 0.042  # of the recorded sole from the floor in stance; the shipped walkers' is at most 36 mm [m]


@dataclass(frozen=True, repr=False)
class Built(Shown):
    """A compiled scenario: the model that runs, and the warnings of building it.

    `model` is without what only pictures need, alike muscles on one path; `full_model` has all, moves alike.
    Whoever alone has had `model` may put it into `spare`, for another scenario of its layout.
    """

    scenario: Scenario  # that it was built of
    model: mujoco.MjModel  # that runs: one actuator for alike muscles on one path
    index: Index  # where bodies, joints and columns stand in it
    stability: dict[str, float]  # rate × time step of air, friction and drives [-]
    warnings: tuple[str, ...]  # of building it
    walk: Walk | None = None  # the recorded walk that drives the shank; None of one who sits
    foot: Foot | None = None  # with the orthosis; None of one who sits
    active: Active | None = None  # the walker's own muscles; None of one who sits
    contact: Contact | None = None  # of foot and floor; None where it meets none
    side_arms: SideArms | None = None  # by which muscles turn the foot to its sides; None
    spare: list[mujoco.MjModel] = field(default_factory=list)  # models for others of this layout

    def __reduce__(self) -> tuple[object, ...]:
        return build, (self.scenario,)  # its spec cannot be pickled

    @property
    def full_model(self) -> mujoco.MjModel:
        """The model with all its shapes, to be kept and drawn."""
        return self._full[0]

    @property
    def spec(self) -> mujoco.MjSpec:
        """The spec of the full model."""
        return self._full[1]

    @functools.cached_property
    def _full(self) -> tuple[mujoco.MjModel, mujoco.MjSpec]:
        size = person.Size.of(self.scenario)
        spec = assemble(leg_spec(self.scenario, size), self.scenario, _circuit(self.scenario), size)
        model = compiled(spec, self.scenario)
        model.actuator_user[:] = self.model.actuator_user
        for actuator in spec.actuators:
            actuator.userdata = model.actuator_user[actuator.id]
        return model, spec

    @functools.cached_property
    def xml(self) -> str:
        """The full model as MJCF, which reads again as the same; files of meshes stay beside the leg's."""
        return exact_xml(self.spec)

    @functools.cached_property
    def person(self) -> person.Person:
        """Whose leg it is."""
        return person.person_of(self.scenario)

    @property
    def body_mass(self) -> float:
        """Body mass of the person [kg]."""
        return self.person.body_mass


def build(
    scenario: str | os.PathLike[str] | Scenario | JsonMapping, sets: Mapping[str, object] | None = None
) -> Built:
    """Compile a scenario: put the orthosis on the leg and check the compiled model.

    Parameters
    ----------
    scenario : a shipped name, a path to a TOML file, a dict of the same shape, or a Scenario
    sets : dotted keys and values laid over it, for example {"supply.pressure": "3 bar"}

    Returns
    -------
    Built: `model` (MuJoCo's MjModel, without shapes that only pictures need), `full_model`, `spec` and `xml`
    (MJCF) with all of them, `scenario`, `warnings`. Its muscles pull only while this package's
    callbacks are installed, as `run` does.

    Raises
    ------
    InputError
        The description is wrong; the leg lacks a body or joint, or is built differently than assumed; a
        muscle passes through the ankle, does not fit on its path, or its braid locks within the range of
        motion; air or braid would be unstable at this time step (with the step that would do).

    Examples
    --------
    >>> built = build("seated", {"timestep": "0.5 ms"})
    >>> built.model.opt.timestep, built.model.joint("ankle").name
    (0.0005, 'ankle')
    """
    scenario = load("scenario", scenario, sets)
    with person.stride_files_stay():
        return _built(scenario)


def _built(scenario: Scenario) -> Built:
    if scenario.worn_on == "both":
        problem, allowed = "one leg is simulated", '"one"; then `afo-sim both`, or `afo-sim walk` with "both"'
        raise InputError(problem, field="worn_on", value="both", allowed=allowed)
    floor = scenario.ground or person.USUAL_GROUND
    for key, unit, value in (("slope", "deg", np.degrees(floor.slope)), ("uneven", "mm", 1e3 * floor.uneven)):
        if value:
            problem, allowed = "recorded walks are of a level floor", f"0 {unit}, or `afo-sim walk`"
            raise InputError(problem, field=f"ground.{key}", value=f"{value:.3g} {unit}", allowed=allowed)
    circuit, size = _circuit(scenario), person.Size.of(scenario)
    geometry = geometry_of(scenario, circuit, size)
    model, index = geometry.of(size.heavier), geometry.index
    foot, bare = geometry.feet(size.heavier) if scenario.walking else (None, None)
    model.actuator_user[:] = _rows(geometry, circuit)
    native.fill_inverse_masses(model)
    if foot is not None:
        fill_walking(model, index.walking, scenario, foot)
    tissue = person.own_tissue(scenario)
    model.actuator_user[index.passive] = native.row(
        native.Kind.PASSIVE,
        scale=tissue.scale,
        offset=tissue.offset,
        load=scenario.load_moment,
        damping=0.5 * tissue.damping,
    )
    fill_hinge(model, scenario, size)
    stretch = _stretched(geometry, circuit, scenario.orthosis)
    numbers, coarse = time_step_limits.check_stability(model, index, scenario)
    stops = tuple(model.jnt_range[model.dof_jntid[index.ankle_dof]].tolist())
    guided = check_guides(scenario.orthosis, stops)
    described = (*check_description(scenario), *implausible(scenario, model), *check_air_path(scenario))
    walked: list[Notice] = []  # though a stride was to be solved for, or too few
    if scenario.gait is not None and scenario.gait.settled == "solved" and (why := why_walked(scenario)):
        text = "strides are walked until they settle, not solved for: {why}"
        walked.append(Notice("stride-not-solved", text, subject="gait.settled", why=why))
    if scenario.gait is not None and (unseen := unseen_drift(scenario)) is not None:
        walked.append(unseen)
    warnings = (*described, *stretch, *coarse, *guided, *walked)
    built = Built(
        scenario, model, index, numbers, warnings, foot=foot, side_arms=geometry.side_arms,
        spare=geometry.spare,
    )  # fmt: skip
    if foot is None or bare is None:
        return built
    return _with_walking(built, foot, bare)


# Cases of a sweep share both.
@functools.lru_cache(maxsize=4)
def _rows(geometry: Geometry, circuit: native.Circuit) -> np.ndarray:
    """The circuit's parameters (nu, n)."""
    model = copy.copy(geometry.model)
    native.fill_circuit(model, circuit, geometry.circuit)
    return model.actuator_user.copy()


@functools.lru_cache(maxsize=4)
def _stretched(geometry: Geometry, circuit: native.Circuit, orthosis: Orthosis) -> tuple[Notice, ...]:
    """Warnings of muscles on their paths; refuses those that cannot work there."""
    angles, lengths, muscles = geometry.angles, geometry.lengths, geometry.index.muscles
    check_paths(angles, lengths, muscles, orthosis)
    return tuple(check_stretch(_rows(geometry, circuit), angles, lengths, muscles, orthosis))


def _circuit(scenario: Scenario) -> native.Circuit:
    drives = tuple(scenario.drive.items())
    return circuit_of(scenario.orthosis, drives=drives, supply=own_supply(scenario))


def _with_walking(built: Built, foot: Foot, bare: Foot) -> Built:
    """Lay the recorded walking out, and compute what the patient's own ankle does in it."""
    scenario = built.scenario
    walk, idle = lay_out(scenario, foot), list[Notice]()
    if person.walker_of(scenario) == "patient":  # as in what was worn when the walk was recorded
        recorded, size = person.as_recorded(scenario), person.Size.of(scenario)
        bare = geometry_of(recorded, _circuit(recorded), size).feet(size.heavier)[1]
        own = own_active(lay_out(recorded, bare), bare, person.own_tissue(recorded), built.body_mass)
        text = "{subject} is not applied: the walk is the patient's own, whose muscles act as recorded"
        patient, set_here = scenario.patient, unapplied(scenario.description)
        for key, healthy in NOT_OF_OWN_WALK.items():  # by hand: a preset tells where its values are from
            if patient and key not in patient.provenance and getattr(patient, key) != healthy:
                set_here.append(f"patient.{key}")
        idle = [Notice("strength-not-applied", text, subject=key) for key in dict.fromkeys(set_here)]
    else:
        own = active(walk, bare, scenario, built.body_mass)
    doubts = (*idle, *person.signs_of_compensation(scenario), *person.doubts_of_trial(scenario))
    contact, warnings = None, (*built.warnings, *doubts, *_paced(scenario, walk))
    if person.in_contact(scenario):
        check_sole(foot, scenario)
        contact = register(walk, foot, built.model, scenario, built.body_mass)
        warnings = (*warnings, *contact.warnings)
        if walk.laid > MISFIT * person.Size.of(scenario).taller:
            text = "the recorded sole is {laid:.0f} mm off the floor under load: motion and force differ"
            warnings = (*warnings, Notice("sole-off-floor", text, subject="gait.cycle", laid=1e3 * walk.laid))
    else:
        text = "the foot gets the recorded force whatever it does: trust results in swing only"
        warnings = (*warnings, Notice("ground-recorded", text, subject="ground.mode"))
    found = dataclasses.replace(built, warnings=warnings, walk=walk, active=own, contact=contact)
    _ = found.person  # now: later the gait's file may be another
    return found


def check_description(scenario: Scenario) -> Iterator[Notice]:
    """Warnings that follow from the description alone."""
    knee = scenario.shank.knee_angle
    if knee is not None and knee > KNEE_LIMIT and scenario.leg.passive.scale > 0.0:
        text = (
            "the passive ankle moment is extrapolated: Riener & Edrich measured up to 60 deg of knee angle, "
            f"here it is {np.degrees(knee):g} deg"
        )
        yield Notice("passive-ankle-extrapolated", text, subject="shank.knee_angle", knee_angle=knee)
    for name, times in scenario.timer.chambers.items() if scenario.timer else ():
        pairs = itertools.product(times.inlet, times.outlet)
        overlaps = [(max(a, c), min(b, d)) for (a, b), (c, d) in pairs if max(a, c) < min(b, d)]
        if overlaps:
            text = (
                "inlet and outlet of chamber {subject!r} are open at the same time {spans}: the supply vents"
            )
            spans = ", ".join(f"from {start:g} s to {end:g} s" for start, end in overlaps)
            yield Notice("valves-open-together", text, subject=name, spans=spans, overlaps=overlaps)
    if scenario.walking and scenario.orthosis.plate is not None and scenario.orthosis.outsole is None:
        text = "the orthosis' plate has no [outsole]: the foot walks as if {on}, whatever is under it"
        on = "in the shoe" if scenario.shoe is not None else "barefoot"
        yield Notice("plate-without-outsole", text, subject="orthosis.outsole", on=on)


def _paced(scenario: Scenario, walk: Walk) -> Iterator[Notice]:
    """Warnings of changes of cadence that come after the end, and of stops on the other leg alone."""
    assert scenario.gait is not None
    late = [at for at, _ in scenario.gait.pace if at >= scenario.duration]
    if late:
        text = "{subject}: the change at {at:g} s is after the end of the run at {end:g} s"
        yield Notice("cadence-change-after-end", text, subject="gait.pace", at=late[0], end=scenario.duration)
    for begun, _ in Pace.of(scenario.gait).stands:
        if begun < scenario.duration:
            phase = float(np.interp(begun, walk.time, walk.phase)) % 1.0
            if walk.cycle.ground(phase)[1] <= STANCE_FORCE:
                text = f"gait.pace: the walker stops at {begun:g} s with this foot in the air, at "
                text += f"{100.0 * phase:.0f} % of the stride"
                subject = f"gait.pace at {begun:g} s"
                yield Notice("stop-in-the-air", text, subject=subject, at=begun, phase=phase)
