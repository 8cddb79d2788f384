"""An orthosis on one leg of a whole model, which stays as it is; and the checks whether both go together."""

import dataclasses
import os
import pathlib
from collections.abc import Iterable, Iterator, Mapping, Sequence

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import InputError, JsonMapping, Keywords, Notice, in_unit, si
from afo_sim.description import WORN, Orthosis, Segment, Side, load
from afo_sim.legs import attached_spec
from afo_sim.legs.attached import Attached, number_of, pressure_of
from afo_sim.legs.cutting import check_masses
from afo_sim.legs.finding import Direction, Found
from afo_sim.legs.finding_joint import find_worn
from afo_sim.legs.mjcf import one_line, tree_of
from afo_sim.legs.tree import Tree, listed
from afo_sim.legs.urdf_files import Packages
from afo_sim.model import (
    add_tendons,
    check_air,
    check_friction,
    check_guides,
    check_longest,
    check_paths,
    check_stretch,
    circuit_of,
    endless,
    falling_frictions,
    mirror_shapes,
    sweep_lengths,
)
from afo_sim.native import Hold

Described = str | os.PathLike[str] | JsonMapping | Orthosis
PREFIX = "afo_"
SUPPLY = "4 bar"
ANGLE_COUNT = 41  # of the range of motion at which a muscle's path is looked at
POSTURES = 5  # of it at which the inertia that muscles move is looked at
SQUARE_TILT = np.radians(3.0)  # from which on a hinge's axis that is not square to the shank is reported
BIT = mujoco.mjtDisableBit
USER = (mujoco.mjtDyn.mjDYN_USER, mujoco.mjtGain.mjGAIN_USER, mujoco.mjtBias.mjBIAS_USER)
NAMED: tuple[str, ...] = ("bodies", "joints", "geoms", "sites", "tendons", "actuators", "meshes")
NAMED += ("materials", "textures", "sensors", "cameras", "lights")


def attach(
    model: str | os.PathLike[str] | mujoco.MjSpec | Attached,
    orthosis: Described,
    *,
    joint: str | None = None,
    proximal: str | None = None,
    distal: str | None = None,
    shank: str | None = None,
    foot: str | None = None,
    ankle: str | None = None,
    side: Side | None = None,
    zero: float | str | None = None,
    sign: float | None = None,
    forward: Direction | None = None,
    packages: Packages = (),
    supply: str | float = SUPPLY,
    timestep: str | float | None = None,
    prefix: str = PREFIX,
) -> Attached:
    """Put an orthosis' cuff, plate, muscles and air circuit on a joint of a whole MuJoCo model.

    The model keeps its bodies, joints, muscles, gravity and tissue; none are added. Step it with
    `mujoco.mj_step` within `Attached.callbacks()`.

    Parameters
    ----------
    model : MJCF or URDF file, a shipped leg's name, an MjSpec (not changed), or the result of `attach`,
        for the other leg
    orthosis : a shipped name, a path, a description as a dict, or an Orthosis
    joint : name of the hinge; by default the flexing one among those named like the joint
    proximal, distal : names of the bodies above and below it that carry the device; by default those that the
        hinges of the joint join, and the heaviest body that an ankle moves
    shank, foot, ankle : other words for proximal, distal and joint
    side : "right" or "left", if the model has both
    zero : the hinge's coordinate at which the joint's angle is zero [rad], or "5 deg"; 0 by default
    sign : 1 if the hinge's coordinate increases in flexion, else -1; by default as left and right of the
        body, its foot and the fold of the limb show. An ankle's follows from the foot
    forward : where an ankle's foot points, in the model's axes, as in `find`
    packages : folders in which the meshes of a URDF file lie
    supply : gauge pressure before the inlet valves, text or [Pa]
    timestep : text or [s]; the model's own by default
    prefix : of all added names

    Returns
    -------
    Attached

    Raises
    ------
    InputError
        The model cannot be read; a body or hinge is missing; a name would occur twice; the model has
        actuators that need another program's callbacks; the orthosis is for another joint; a muscle
        locks, or turns inside out, within the range of motion; the time step is too long (with the one that
        would do).

    Examples
    --------
    >>> leg = attach("adult_75kg", "s1")
    >>> sorted(leg.chambers)
    ['dorsiflexor', 'plantarflexor']
    >>> attach("pin_knee", "pin_knee", joint="knee").bodies
    {'proximal': 'thigh', 'distal': 'shank'}
    """
    device = orthosis if isinstance(orthosis, Orthosis) else load("orthosis", orthosis)
    spec, read, before = attached_spec.own_spec(model, packages)
    file = read.file
    allowed = 'more than 0 and at most "100 ms"'
    step = None if timestep is None else number_of(timestep, "timestep", "s", (0.0, 0.1), allowed)
    pressure = pressure_of(supply, "supply")
    _check_spec(spec, file, device, prefix, before)
    bare = attached_spec.compiled(spec, file)
    tree = dataclasses.replace(tree_of(bare), file=file)
    distal = foot if distal is None else distal
    names = ankle if joint is None else joint, shank if proximal is None else proximal, distal
    zero = None if zero is None else si(zero, "rad", "zero")
    found = find_worn(tree, device, names, side, zero, sign, forward)
    if device.joint == "ankle":
        check_masses(read if read.parts else tree, found)
    # of the bodies that an ankle moves the talus carries no shoe, the heaviest one, the calcaneus, does
    heaviest = max(tree.below(found.foot), key=lambda part: part.mass).name
    carrier = distal or (heaviest if device.joint == "ankle" else found.foot)
    bodies = dict(zip(device.words.segments, (found.shank, carrier), strict=True))
    if _named(spec, tree, bodies, found):
        bare = attached_spec.compiled(spec, file)
    changed = attached_spec.set_options(spec, step)
    joints = tuple(joint.name for part in tree.way(found.shank, carrier) for joint in part.joints)
    # where another joint turns the foot too, parallel paths are not equally long
    inverts = joints != (found.ankle,)
    circuit = circuit_of(device, found.ankle, inverts=inverts, supply=endless(pressure))
    first = max(spec.nuserdata, 0)
    mirrored = device.side != found.side
    try:
        frames = attached_spec.ankle_frames(bare, found, bodies)
        anchors, default = attached_spec.hang(spec, device, frames, prefix, mirrored)
    except ValueError as error:
        problem = f"MuJoCo cannot put cuff and plate on it: {one_line(error)}"
        raise InputError(problem, file=file, field="prefix", value=prefix, allowed="another prefix") from None
    add_tendons(spec, anchors, device, prefix=prefix, default=default)
    for body in anchors.values() if mirrored else ():
        mirror_shapes(body)
    longest = max((len(actuator.userdata) for actuator in spec.actuators), default=0)
    spec.nuser_actuator = max(native.N_USER, spec.nuser_actuator, longest)
    native.add_circuit(spec, circuit, prefix=prefix, userdata=first, default=default)
    attached_spec.grow_keyframes(spec, bare)
    whole = attached_spec.compiled(spec, file)
    ids = native.circuit_ids(whole, circuit, prefix)
    added = prefix, pressure, circuit, ids, first
    attached = Attached(whole, spec, device, found, bodies, joints, *added)
    legs = [] if before is None else before.legs.values()
    return _checked(attached, legs, bare, [*attached_spec.doubts_of_start(bare), *read.notes, *changed])


def _checked(
    attached: Attached, before: Iterable[Attached], bare: mujoco.MjModel, changed: list[str]
) -> Attached:
    """The orthosis on its compiled model, with those that were there before, and its notices."""
    legs = [dataclasses.replace(leg, model=attached.model, spec=attached.spec) for leg in before]
    native.fill_circuit(attached.model, attached.circuit, attached.ids, userdata=attached.userdata)
    _check_added(attached, bare)
    warned = [*_check_muscles(attached), *_check_step(attached)]
    for leg in legs:
        _check_step(leg)  # which may be another now
    notices = (*changed, *_doubts(attached), *warned)
    return completed([*legs, dataclasses.replace(attached, notices=notices)])[-1]


def completed(legs: Sequence[Attached]) -> list[Attached]:
    """Orthoses on one compiled model, which know each other, with all parameters, and shown to pull."""
    by_prefix: dict[str, Attached] = {}
    for leg in legs:
        by_prefix[leg.prefix] = dataclasses.replace(leg, legs=by_prefix)
        native.fill_circuit(leg.model, leg.circuit, leg.ids, userdata=leg.userdata)
    _check_live(list(by_prefix.values()))
    model, last = legs[-1].model, by_prefix[legs[-1].prefix]
    first = int(model.actuator_actadr[last.own_controls.stop])
    for actuator in last.spec.actuators:  # what is written is never limp beside the callbacks
        actuator.userdata = model.actuator_user[actuator.id]
    for key in range(model.nkey):  # which begins with air at ambient pressure, and with supply
        model.key_act[key, first:] = last.data(model.key_qpos[key]).act[first:]
        for leg in by_prefix.values():
            model.key_ctrl[key, list(leg.chambers.values())] = leg.supply
        last.spec.keys[key].act, last.spec.keys[key].ctrl = model.key_act[key], model.key_ctrl[key]
    return list(by_prefix.values())


def _named(spec: mujoco.MjSpec, tree: Tree, bodies: Mapping[Segment, str], found: Found) -> bool:
    """Give bodies and ankle that have no name the one that they are known by; whether any had none."""
    part, joint = tree.joints()[found.ankle]
    owners = dict(zip(tree.parts, sorted(spec.bodies, key=lambda body: body.id)[1:], strict=True))
    added = False
    for name in bodies.values():
        if not owners[name].name:
            owners[name].name, added = name, True
    hinge = owners[part.name].joints[part.joints.index(joint)]
    if not hinge.name:
        hinge.name, added = joint.name, True
    return added


def _check_live(legs: Sequence[Attached]) -> None:
    """Refuse limp muscles: in the zero posture of the ankles each must pull by its law."""
    model = legs[0].model
    data = mujoco.MjData(model)
    for leg in legs:
        data.qpos[model.joint(leg.found.ankle).qposadr[0]] = leg.found.zero
    state = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION))
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    with Hold():
        native.assert_muscles_pull(model, state)


def _check_spec(
    spec: mujoco.MjSpec, file: pathlib.Path | None, orthosis: Orthosis, prefix: str, before: Attached | None
) -> None:
    """Refuse a model or an orthosis that do not go together, before anything is added."""
    if not (isinstance(prefix, str) and prefix.isidentifier()):
        allowed = "letters, digits and _, a letter first, as afo_left_"
        raise InputError("begins no name", field="prefix", value=prefix, allowed=allowed)
    if not orthosis.muscle:
        allowed = "an orthosis with muscles"
        raise InputError("has no muscle", field="orthosis", value=orthosis.name, allowed=allowed)
    if orthosis.joint_centre:
        problem = "goes with a fit of torques alone: the model's joint is a hinge"
        raise InputError(problem, field="orthosis.joint_centre")
    for name, group in orthosis.muscle.items():
        if group.pulley is not None:
            problem = "runs over a pulley on the joint's axis, which a leg does not have"
            field = f"orthosis.muscle.{name}.pulley"
            raise InputError(problem, file=orthosis.name or None, field=field, allowed="origin and insertion")
    for kind in NAMED:
        for element in getattr(spec, kind):
            if element.name.startswith(prefix):
                problem = f"begins names that are in the model, as of the {kind} {element.name!r}"
                raise InputError(problem, file=file, field="prefix", value=prefix, allowed="another prefix")
    ours = before.own_controls.stop if before is not None else len(spec.actuators)
    for actuator in list(spec.actuators)[:ours]:
        kinds = actuator.dyntype, actuator.gaintype, actuator.biastype
        if any(kind == user for kind, user in zip(kinds, USER, strict=True)):
            problem = f"the actuator {actuator.name!r} asks for callbacks of another program, and MuJoCo "
            problem += "takes one program's alone"
            allowed = "a model without such actuators; what attach gave is passed on itself, not its spec"
            raise InputError(problem, file=file, field="actuator", allowed=allowed)
    if spec.option.disableflags & BIT.mjDSBL_ACTUATION:
        problem = "switches all actuators off: the muscles would be limp"
        raise InputError(problem, file=file, field='flag actuation="disable"', allowed="actuation on")
    if spec.option.disableactuator & 1:
        problem = "switches the actuators of group 0 off: the muscles would be limp"
        raise InputError(problem, file=file, field="actuatorgroupdisable", allowed="groups 1 to 30")


def masses(model: mujoco.MjModel, prefix: str) -> dict[str, float]:
    """Mass of every body that an orthosis has added [kg], by name."""
    begin = tuple(f"{prefix}{kind}_" for pair in WORN.items() for kind in pair)
    names = [model.body(number).name for number in range(model.nbody)]
    return {n: float(model.body_mass[k]) for k, n in enumerate(names) if n.startswith(begin)}


def _check_added(attached: Attached, bare: mujoco.MjModel) -> None:
    """Refuse a model whose compiler gives the orthosis, or the model itself, other masses than stated."""
    plain, at = mujoco.MjSpec(), (np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    names = {segment: f"on_{segment}" for segment in attached.orthosis.words.segments}
    for name in names.values():
        plain.worldbody.add_body(name=name)
    places = {segment: attached_spec.AnkleFrame(name, *at) for segment, name in names.items()}
    anchors, default = attached_spec.hang(plain, attached.orthosis, places, attached.prefix, mirrored=False)
    add_tendons(plain, anchors, attached.orthosis, prefix=attached.prefix, default=default)
    stated = masses(plain.compile(), attached.prefix)
    given = masses(attached.model, attached.prefix)
    whole = float(attached.model.body_mass.sum()) - sum(given.values())
    for name, mass in [*stated.items(), ("the model", float(bare.body_mass.sum()))]:
        found = given.get(name, whole)
        if not abs(found - mass) <= 1e-9 * max(1.0, mass):
            problem = f"the model's <compiler> makes {found:.4g} kg of {name!r}, which has {mass:.4g} kg"
            allowed = "a model without settotalmass, boundmass, inertiagrouprange"
            raise InputError(problem, field="model", allowed=allowed)


def _check_muscles(attached: Attached) -> list[Notice]:
    """Refuse muscles that lock or turn inside out in the range of motion; warn of those stretched too far."""
    found, orthosis, model = attached.found, attached.orthosis, attached.model
    angles = np.linspace(*orthosis.range_of_motion, ANGLE_COUNT)
    joint, ids = model.joint(found.ankle), list(attached.muscles.values())
    lengths = sweep_lengths(model, ids, int(joint.qposadr[0]), found.zero + found.sign * angles)
    stops = orthosis.range_of_motion
    if model.jnt_limited[joint.id]:
        ends = sorted(found.sign * (float(end) - found.zero) for end in joint.range)
        stops = ends[0], ends[1]
    where = f"between the bodies {' and '.join(map(repr, attached.bodies.values()))}"
    try:
        check_paths(angles, lengths, attached.muscles, orthosis)
        warned = list(check_stretch(model.actuator_user, angles, lengths, attached.muscles, orthosis))
        warned += check_guides(orthosis, stops)
    except InputError as error:
        raise error.replaced(problem=f"{error.problem} ({where})") from None
    return [
        Notice(one.code, "{words} ({where})", subject=one.subject, words=str(one), where=where, **one.data)
        for one in warned
    ]


def _check_step(attached: Attached) -> list[Notice]:
    """Refuse a time step that is too long for air or friction (with the one that would do), or warn of it."""
    # Friction that falls with speed, of −dF/dv = d_i, grows at the rate of the largest eigenvalue of √d J M⁻¹
    # Jᵀ √d, J the muscles' paths by the joints: with one joint, Σ d r²/I.
    model, found, step = attached.model, attached.found, float(attached.model.opt.timestep)
    check_longest(step)
    _, warned = check_air(attached.orthosis, step)
    falling = falling_frictions(attached.orthosis, attached.supply)
    if falling.any():
        ids, number = list(attached.muscles.values()), 0.0
        for angle in np.linspace(*attached.orthosis.range_of_motion, POSTURES):
            data = native.scratch(model)
            data.qpos[model.joint(found.ankle).qposadr[0]] = found.zero + found.sign * angle
            mujoco.mj_fwdPosition(model, data)
            arms, moved = native.jacobian(model, data)[ids], np.zeros((len(ids), model.nv))
            mujoco.mj_solveM(model, data, moved, arms)
            inverse = np.sqrt(falling) * (moved @ arms.T)
            number = max(number, step * float(np.linalg.eigvalsh(inverse * np.sqrt(falling)[:, None])[-1]))
        check_friction(number, step)
    return list(warned)


def _doubts(attached: Attached) -> Iterator[str]:
    """Notices of what is doubtful about an orthosis on this leg."""
    found, orthosis, carrier = attached.found, attached.orthosis, list(attached.bodies.values())[1]
    yield from found.notes
    if found.tilt > SQUARE_TILT:
        words = f"the axis of {{subject!r}} leans by {np.degrees(found.tilt):.0f} deg: cuff and plate hang "
        words += "square to it, not to the limb"
        yield Notice("ankle-oblique", words, subject=found.ankle, tilt=found.tilt)
    if attached.joints != (found.ankle,):
        others = [joint for joint in attached.joints if joint != found.ankle]
        words = "the muscles also cross {joints} and move them"
        yield Notice("joints-crossed", words, subject=found.ankle, joints=listed(others))
    if carrier != found.foot:
        words = f"the plate is on {{plate!r}}; the {orthosis.joint} {{subject!r}} moves it by {{foot!r}}"
        yield Notice("plate-body", words, subject=found.ankle, plate=carrier, foot=found.foot)
    total = sum(masses(attached.model, attached.prefix).values())
    words = "the orthosis adds {mass:.3g} kg; no tissue is added, the model has its own or none"
    yield Notice("mass-added", words, subject=attached.prefix, severity="note", mass=total)
    ends = [end for group in orthosis.muscle.values() for end in (group.origin, group.insertion) if end]
    highest = max((end.from_joint[2] for end in ends), default=0.0)
    if found.shank_length is not None and highest > found.shank_length:
        words = f"the shank {{subject!r}} is {in_unit(found.shank_length, 'm', 'cm'):.3g} cm long, and "
        words += f"muscles begin {in_unit(highest, 'm', 'cm'):.3g} cm above the ankle: the orthosis is too "
        far: Keywords = {"shank_length": found.shank_length, "highest": highest}
        yield Notice("orthosis-too-long", f"{words}long for it", subject=found.shank, **far)
    joint = attached.model.joint(found.ankle)
    if not attached.model.jnt_limited[joint.id]:
        words = "the hinge {subject!r} has no stops: nothing but its muscles' braids ends its motion"
        yield Notice("ankle-without-stops", words, subject=found.ankle)
