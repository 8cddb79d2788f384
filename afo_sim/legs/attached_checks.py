"""Checks of a whole model that an orthosis is put on: names, masses, paths of the muscles, the time step."""

import pathlib
from collections.abc import Iterator

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common.errors import InputError
from afo_sim.common.units import in_unit
from afo_sim.description.attachment import Segment
from afo_sim.description.orthosis import Orthosis
from afo_sim.legs.attached import Attached
from afo_sim.legs.hanging import KINDS, Place, hang
from afo_sim.legs.names import listed
from afo_sim.legs.tree import Tree
from afo_sim.model.guide_checks import check_guides
from afo_sim.model.mounting import check_stretch, sweep_lengths
from afo_sim.model.path_checks import check_paths
from afo_sim.model.stability import check_air, check_friction, check_longest, falling_frictions
from afo_sim.model.tendons import add_tendons

ANGLES = 41  # of the range of motion at which a muscle's path is looked at
POSTURES = 5  # of it at which the inertia that muscles move is looked at
OBLIQUE = np.radians(3.0)  # from which on a hinge's axis that is not square to the shank is told
BIT = mujoco.mjtDisableBit
ELEMENTS = (
    "bodies",
    "joints",
    "geoms",
    "sites",
    "tendons",
    "actuators",
    "meshes",
    "materials",
    "textures",
    "sensors",
    "cameras",
    "lights",
)


def check_spec(
    spec: mujoco.MjSpec, file: pathlib.Path | None, orthosis: Orthosis, prefix: str, before: Attached | None
) -> None:
    """Refuse a model or an orthosis that do not go together, before anything is added."""
    if not (isinstance(prefix, str) and prefix.isidentifier()):
        allowed = "letters, digits and _, a letter first, as afo_left_"
        raise InputError("begins no name", field="prefix", value=prefix, allowed=allowed)
    if not orthosis.muscle:
        allowed = "an orthosis with muscles"
        raise InputError("has no muscle", field="orthosis", value=orthosis.name, allowed=allowed)
    for name, group in orthosis.muscle.items():
        if group.pulley is not None:
            problem = "runs over a pulley on the joint's axis, which a leg does not have"
            field = f"orthosis.muscle.{name}.pulley"
            raise InputError(problem, file=orthosis.name or None, field=field, allowed="origin and insertion")
    for kind in ELEMENTS:
        for element in getattr(spec, kind):
            if element.name.startswith(prefix):
                problem = f"begins names that are in the model, as of the {kind} {element.name!r}"
                raise InputError(problem, file=file, field="prefix", value=prefix, allowed="another prefix")
    ours = before.own_controls.stop if before is not None else len(spec.actuators)
    for actuator in list(spec.actuators)[:ours]:
        _check_foreign(actuator, file)
    if spec.option.disableflags & BIT.mjDSBL_ACTUATION:
        problem = "switches all actuators off: the muscles would be limp"
        raise InputError(problem, file=file, field='flag actuation="disable"', allowed="actuation on")
    if spec.option.disableactuator & 1:
        problem = "switches the actuators of group 0 off: the muscles would be limp"
        raise InputError(problem, file=file, field="actuatorgroupdisable", allowed="groups 1 to 30")


def _check_foreign(actuator: mujoco.MjsActuator, file: pathlib.Path | None) -> None:
    """Refuse an actuator of the model's that another program's callbacks would move."""
    user = (
        actuator.dyntype == mujoco.mjtDyn.mjDYN_USER
        or actuator.gaintype == mujoco.mjtGain.mjGAIN_USER
        or actuator.biastype == mujoco.mjtBias.mjBIAS_USER
    )
    if user:
        problem = (
            f"the actuator {actuator.name!r} asks for callbacks of another program, and MuJoCo has room for "
            "one program's"
        )
        allowed = "a model without such actuators; what attach gave is passed on itself, not its spec"
        raise InputError(problem, file=file, field="actuator", allowed=allowed)


def masses(model: mujoco.MjModel, prefix: str) -> dict[str, float]:
    """Mass of every body that an orthosis has added [kg], by name."""
    begin = tuple(f"{prefix}{kind}_" for pair in KINDS for kind in pair)
    names = [model.body(number).name for number in range(model.nbody)]
    return {n: float(model.body_mass[k]) for k, n in enumerate(names) if n.startswith(begin)}


def check_added(attached: Attached, bare: mujoco.MjModel) -> None:
    """Refuse a model whose compiler gives the orthosis, or the model itself, other masses than stated."""
    plain = mujoco.MjSpec()
    places: dict[Segment, Place] = {}
    for segment, _ in KINDS:
        plain.worldbody.add_body(name=f"on_{segment}")
        places[segment] = Place(f"on_{segment}", np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    anchors, default = hang(plain, attached.orthosis, places, attached.prefix, mirrored=False)
    add_tendons(plain, anchors, attached.orthosis, prefix=attached.prefix, default=default)
    stated = masses(plain.compile(), attached.prefix)
    given = masses(attached.model, attached.prefix)
    whole = float(attached.model.body_mass.sum()) - sum(given.values())
    was = float(bare.body_mass.sum())
    for name, mass in [*stated.items(), ("the model", was)]:
        found = given.get(name, whole)
        if not abs(found - mass) <= 1e-9 * max(1.0, mass):
            raise InputError(
                f"the model's <compiler> makes {found:.4g} kg of {name!r}, which has {mass:.4g} kg",
                field="model",
                allowed="a model without settotalmass, boundmass, inertiagrouprange",
            )


def check_muscles(attached: Attached) -> list[str]:
    """Refuse a muscle that locks or turns inside out in the range of motion; warn of one stretched too far.

    The other joints stand in the model's own posture.
    """
    found, orthosis, model = attached.found, attached.orthosis, attached.model
    angles = np.linspace(*orthosis.range_of_motion, ANGLES)
    joint, ids = model.joint(found.ankle), list(attached.muscles.values())
    lengths = sweep_lengths(model, ids, int(joint.qposadr[0]), found.zero + found.sign * angles)
    stops = orthosis.range_of_motion
    if model.jnt_limited[joint.id]:
        ends = sorted(found.sign * (float(end) - found.zero) for end in joint.range)
        stops = ends[0], ends[1]
    where = f"between the bodies {attached.bodies['shank']!r} and {attached.bodies['foot']!r}"
    try:
        check_paths(angles, lengths, attached.muscles, orthosis)
        warned = check_stretch(model, angles, lengths, attached.muscles, orthosis)
        warned += check_guides(orthosis, stops)
    except InputError as error:
        raise InputError(
            f"{error.problem} ({where})",
            file=error.file,
            field=error.field,
            value=error.value,
            allowed=error.allowed,
        ) from None
    return [f"{words} ({where})" for words in warned]


def check_step(attached: Attached) -> list[str]:
    """Refuse a time step that is too long for air or friction (with the one that would do), or warn of it.

    Friction that falls with speed, of −dF/dv = d_i, grows at the rate of the largest eigenvalue of
    √d J M⁻¹ Jᵀ √d, J the muscles' paths by the joints: with one joint, Σ d r²/I.
    """
    model, found, step = attached.model, attached.found, float(attached.model.opt.timestep)
    check_longest(step)
    _, warned = check_air(attached.orthosis, step)
    falling = falling_frictions(attached.orthosis, attached.supply)
    if falling.any():
        ids, number = list(attached.muscles.values()), 0.0
        for angle in np.linspace(*attached.orthosis.range_of_motion, POSTURES):
            inverse = np.sqrt(falling) * inverse_masses(
                model, ids, found.ankle, found.zero + found.sign * angle
            )
            number = max(number, step * float(np.linalg.eigvalsh(inverse * np.sqrt(falling)[:, None])[-1]))
        check_friction(number, step)
    return warned


def inverse_masses(model: mujoco.MjModel, muscles: list[int], ankle: str, coordinate: float) -> np.ndarray:
    """J M⁻¹ Jᵀ of the muscles' paths [1/kg] (n, n), with the ankle at a coordinate [rad]."""
    data = native.scratch(model)
    data.qpos[model.joint(ankle).qposadr[0]] = coordinate
    mujoco.mj_fwdPosition(model, data)
    jacobian, moved = np.zeros((model.nu, model.nv)), np.zeros((len(muscles), model.nv))
    mujoco.mju_sparse2dense(
        jacobian, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind
    )
    mujoco.mj_solveM(model, data, moved, jacobian[muscles])
    found: np.ndarray = moved @ jacobian[muscles].T
    return found


def doubts(attached: Attached, tree: Tree) -> Iterator[str]:
    """What a user should know of an orthosis on this leg."""
    found, orthosis, bodies = attached.found, attached.orthosis, attached.bodies
    yield from found.notes
    if found.tilt > OBLIQUE:
        yield (
            f"the axis of {found.ankle!r} leans by {np.degrees(found.tilt):.0f} deg: cuff and plate hang "
            "square to it, not to the shank"
        )
    if attached.joints != (found.ankle,):
        others = [joint for joint in attached.joints if joint != found.ankle]
        yield f"the muscles cross {listed(others)} too, and move what moves there"
    if bodies["foot"] != found.foot:
        yield f"the plate is on {bodies['foot']!r}; the ankle {found.ankle!r} moves it by {found.foot!r}"
    total = sum(masses(attached.model, attached.prefix).values())
    yield f"the orthosis adds {total:.3g} kg; no tissue is added, the model has its own or none"
    highest = max(
        (
            anchor.from_ankle[2]
            for g in orthosis.muscle.values()
            for anchor in (g.origin, g.insertion)
            if anchor
        ),
        default=0.0,
    )
    if found.shank_length is not None and highest > found.shank_length:
        yield (
            f"the shank {found.shank!r} is {in_unit(found.shank_length, 'm', 'cm'):.3g} cm long, and muscles "
            f"begin {in_unit(highest, 'm', 'cm'):.3g} cm above the ankle: the orthosis is too long for it"
        )
    joint = attached.model.joint(found.ankle)
    if not attached.model.jnt_limited[joint.id]:
        yield f"the hinge {found.ankle!r} has no stops: nothing but its muscles' braids ends its motion"
