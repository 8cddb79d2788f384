"""The leg's own spec, checked, as big and heavy as the patient, with the orthosis' rigid parts on it."""

import functools
import math
import pathlib
import re
import shlex
from collections.abc import Iterator, Mapping, Sequence

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import (
    Foreign,
    InputError,
    check_regular,
    check_text,
    plausible,
    read_bytes,
    read_text,
    shipped_name,
)
from afo_sim.description import JOINTS, WORN, Leg, Scenario
from afo_sim.model.foot import check_name, hinge_toes, spring_toes
from afo_sim.model.mirror import mirror, orthosis_mirrored
from afo_sim.model.mounting import ANKLE
from afo_sim.model.outsole import add_outsole, add_shoe
from afo_sim.model.person import Size, found_gait

REFERS = re.compile(rb"<(include|model)\s")  # to other files, whose changes are not seen in this one
IMPEDANCE = 0.9999  # the most that MuJoCo's constraint impedance can be
MOST_JOINTS = 8  # that an error names
RIGHTWARD = np.array([0.0, -1.0, 0.0])  # axis about which toe up is positive


def leg_spec(scenario: Scenario, size: Size) -> mujoco.MjSpec:
    """The leg's own spec, with its ankle named, and of a size."""
    leg = scenario.leg
    try:
        spec = _read_spec(leg.file)
    except ValueError as error:
        raise InputError(f"MuJoCo cannot read it: {error}", file=leg.file) from None
    spec.compiler.fusestatic = False  # a URDF's fixed root would lose its mass
    rule = spec.compiler.inertiafromgeom  # a file's, of its own bodies alone
    if rule == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE:
        for geom in spec.geoms:
            geom.mass = 0.0
    elif rule == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE:
        for body in (body for body in spec.bodies if body.geoms):  # as of a body that states none
            body.explicitinertial, body.ipos = False, np.full(3, np.nan)
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO
    if scenario.simulated_side != leg.side:
        _mirror(spec, leg.file, "leg.file")
    for kind, existing in (("shank", spec.bodies), ("foot", spec.bodies), ("ankle", spec.joints)):
        check_name(getattr(leg, kind), existing, leg.file, f"leg.{kind}")
    ankle = spec.joint(leg.ankle)
    if ankle.type != mujoco.mjtJoint.mjJNT_HINGE:
        raise InputError(f"the {leg.joint} is not a hinge", file=leg.file, field="leg.ankle", value=leg.ankle)
    ankle.name = ANKLE
    half = 0.5 * leg.damping  # MuJoCo takes it at the end of a step; the passive ankle adds the other half
    ankle.damping = half if np.isscalar(ankle.damping) else [half, 0.0, 0.0]
    ankle.armature += leg.inertia
    if leg.friction:
        # Coulomb friction [N·m] that holds: MuJoCo's own, by default, creeps at degrees a second
        ankle.frictionloss += leg.friction
        ankle.solimp_friction = [IMPEDANCE, IMPEDANCE, 0.001, 0.5, 2.0]
        ankle.solref_friction = [2.0 * scenario.timestep, 1.0]  # stopped within a step
    if size.taller != 1.0:
        lengthen(spec, size.taller)
    hinge_toes(spec, scenario, Size(taller=size.taller))
    _check_joints([joint.name for joint in spec.joints], leg)
    if scenario.walking:
        add_outsole(spec, scenario, size.taller)
        add_shoe(spec, scenario, size.taller)
    if size.heavier != 1.0:  # `Geometry` does the same to the compiled model
        heavier = size.heavier  # moments at the same angles and times go with mass
        for body in spec.bodies:
            _times(body, mass=heavier, inertia=heavier, fullinertia=heavier)
            for joint in body.joints:
                _times(joint, stiffness=heavier, damping=heavier, frictionloss=heavier, armature=heavier)
    spring_toes(spec, scenario, size)
    return spec


def lengthen(spec: mujoco.MjSpec, taller: float) -> None:
    """Make a leg as long as another body, all lengths alike, with the same masses."""
    damped, square = taller * math.sqrt(taller), taller**2
    for mesh in spec.meshes:
        _times(mesh, scale=taller)
    for body in spec.bodies:
        _times(body, pos=taller, ipos=taller, inertia=square, fullinertia=square)
        for element in (*body.geoms, *body.sites):
            _times(element, pos=taller, size=taller, fromto=taller)
        for joint in body.joints:
            _times(joint, pos=taller, stiffness=taller, damping=damped, frictionloss=taller, armature=square)


def _times(element: Foreign, **factors: float) -> None:
    """Multiply what an element of a spec has."""
    for name, factor in factors.items():
        setattr(element, name, np.array(getattr(element, name)) * factor)


def _check_joints(names: Sequence[str], leg: Leg) -> None:
    """Refuse a leg that has joints beside the ankle and the toes' hinge."""
    own = {ANKLE} if leg.toes is None else {ANKLE, leg.toes.joint}
    found = [name or "one without a name" for name in names if name not in own]
    if not found:
        return
    joints = f"{'is the joint' if len(found) == 1 else 'are the joints'} {', '.join(found[:MOST_JOINTS])}"
    more = f" and {len(found) - MOST_JOINTS} more" if len(found) > MOST_JOINTS else ""
    problem = f"beside the {leg.joint} there {joints}{more} in the leg's file; the toes' hinge is described "
    problem += "by [toes] in the leg's TOML file"
    raise InputError(problem, file=leg.file, field="leg", allowed=_cut_out(leg))


def check_leg(model: mujoco.MjModel, scenario: Scenario) -> None:
    """Refuse a leg that is put together otherwise than everything here assumes."""
    leg = scenario.leg
    joint, toes, words = model.joint(ANKLE), leg.toes, JOINTS[leg.joint]
    forward, left, up = words.axis
    hinges = [model.joint(toes.joint).id] if toes is not None and scenario.walking else []
    foot, shank = model.body(leg.foot).id, model.body(leg.shank).id
    data = native.scratch(model)
    data.qpos[joint.qposadr[0]] = 0.0
    mujoco.mj_kinematics(model, data)
    turned = max(np.abs(data.xmat[body].reshape(3, 3) - np.eye(3)).max() for body in (foot, shank))
    for wrong, problem in (
        (joint.bodyid[0] != foot, f"the {leg.joint} is not the joint of the body {leg.foot!r}"),
        (model.body_parentid[foot] != shank, f"{leg.foot!r} does not hang on {leg.shank!r} directly"),
        (
            any(np.abs(data.xaxis[k] - RIGHTWARD).max() > 1e-6 for k in hinges),
            'the toes\' axis is not axis="0 -1 0", about which extension is positive',
        ),
        (
            turned > 1e-6,
            f"{words.above} or {words.below} is turned against x forward, y left, z up at zero {leg.joint} "
            "angle",
        ),
        (
            np.abs(data.xaxis[joint.id] - words.axis).max() > 1e-6,
            f'the {leg.joint}\'s axis is not axis="{forward:g} {left:g} {up:g}", about which '
            f"{leg.directions[0]} is positive",
        ),
        (
            not model.jnt_limited[joint.id] or not np.isfinite(model.jnt_range[joint.id]).all(),
            f"the {leg.joint} has no range: it needs stops",
        ),
    ):
        if wrong:
            raise InputError(problem, file=leg.file, field="leg", allowed=_cut_out(leg))


def _cut_out(leg: Leg) -> str:
    """The command that mends a leg; none cuts out another joint."""
    if leg.joint != "ankle":
        return f"two bodies with one hinge between them, as docs/joints.md has the {leg.joint}"
    return f"a leg cut out and turned by: afo-sim leg import {shlex.quote(str(leg.file))}"


def attach_parts(spec: mujoco.MjSpec, scenario: Scenario) -> dict[str, mujoco.MjsBody]:
    """Cuff and plate, if there are any, each a spec of its own with its own prefix, on shank and foot."""
    leg, orthosis = scenario.leg, scenario.orthosis
    shank, foot, ankle = spec.body(leg.shank), spec.body(leg.foot), spec.joint(ANKLE)
    joint_in_foot = np.array(ankle.pos)
    joint_in_shank = np.array(foot.pos) + joint_in_foot  # parallel axes at zero ankle angle
    mirrored = orthosis_mirrored(scenario)
    anchors: dict[str, mujoco.MjsBody] = {}
    places = ((shank, joint_in_shank), (foot, joint_in_foot))
    for segment, (body, position) in zip(orthosis.words.segments, places, strict=True):
        prefix = WORN[segment]
        file: pathlib.Path | None = getattr(orthosis, prefix)
        if file is not None:
            body.add_frame(pos=position).attach_body(rigid_part(file, prefix, mirrored), f"{prefix}_", "")
        # a body of their own: the segment's stated inertia would swallow their mass
        anchors[segment] = body.add_body(name=f"{segment}_anchors", pos=position)
    return anchors


def rigid_part(file: pathlib.Path, name: str, mirrored: bool) -> mujoco.MjsBody:
    """The one rigid body of a cuff or plate, `name` of them, of the simulated side."""
    try:
        part = _read_spec(file)
    except ValueError as error:
        problem = "there is no such file" if not file.is_file() else f"MuJoCo cannot read it: {error}"
        raise InputError(problem, file=file, field=f"orthosis.{name}") from None
    world = part.worldbody
    if len(world.bodies) != 1 or world.geoms or part.joints:
        allowed = "exactly one body below the world, with all geoms inside it, and no joints"
        raise InputError("is not one rigid part", file=file, allowed=allowed)
    if mirrored:
        _mirror(part, file, f"orthosis.{name}")
    body = world.first_body()
    body.name = body.name or name
    return body


def _mirror(spec: mujoco.MjSpec, file: pathlib.Path, field: str) -> None:
    """Make a file's spec the other side's; what has no mirror image is refused by the file's name."""
    try:
        mirror(spec)
    except InputError as error:
        raise InputError(error.problem, file=file, field=field, allowed=error.allowed) from None


def _read_spec(file: pathlib.Path) -> mujoco.MjSpec:
    """A model file as a spec of its caller's own; ValueError where MuJoCo cannot read it."""
    if not file.is_file():
        raise ValueError("there is no such file")
    if REFERS.search(file.read_bytes()):
        examine(file)
        return mujoco.MjSpec.from_file(str(file))
    return _parsed(file, file.stat().st_mtime_ns).copy()


def times_of_change(file: pathlib.Path) -> tuple[int, ...] | None:
    """Of a model file and its meshes; None where they do not show every change that MuJoCo would see."""
    try:
        when = file.stat().st_mtime_ns
        return when, *(mesh.stat().st_mtime_ns for mesh in _meshes(file, when))
    except (OSError, ValueError):
        return None


def brings_files(scenario: Scenario) -> bool:
    """Whether model or walk are read from files that no installation has."""
    orthosis, gait = scenario.orthosis, scenario.gait
    cycle = None if gait is None else pathlib.Path(found_gait(gait.cycle))
    files = [each for each in (scenario.leg.file, orthosis.cuff, orthosis.plate, cycle) if each is not None]
    return not all(shipped_name(file.resolve()) for file in files)


# A changed file has another time of change.
@functools.lru_cache(maxsize=16)
def _parsed(file: pathlib.Path, when: int) -> mujoco.MjSpec:
    examine(file)
    return mujoco.MjSpec.from_file(str(file))


@functools.lru_cache(maxsize=16)
def _meshes(file: pathlib.Path, when: int) -> tuple[pathlib.Path, ...]:
    if REFERS.search(file.read_bytes()):
        raise ValueError(f"{file} reads other model files")
    spec = _parsed(file, when)
    folder = file.parent / (spec.meshdir or "")
    return tuple(folder / element.file for element in (*spec.meshes, *spec.hfields) if element.file)


@functools.lru_cache(maxsize=16)
def weighed_later(file: pathlib.Path, times: tuple[int, ...]) -> bool:
    """Whether a person's mass can be written into the compiled leg."""
    try:
        spec = _parsed(file, times[0])
    except ValueError:
        return False
    compiler, statistic = spec.compiler, spec.stat
    bounds = compiler.settotalmass, compiler.boundmass, compiler.boundinertia, compiler.balanceinertia
    stated = np.isfinite([statistic.meaninertia, statistic.meanmass]).any()
    from_shapes = compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    if max(bounds) > 0.0 or stated or from_shapes or spec.actuators:
        return False
    bodies = spec.bodies[1:]
    if not all(joint.name for joint in spec.joints):
        return False
    return all(b.name and b.explicitinertial and np.isnan(b.fullinertia[0]) for b in bodies)


_LARGEST_MODEL = 2**26  # of a model's text [bytes]; meshes may stand in it
_MOST = {  # of a model, its copies counted: several times a whole body's with its muscles
    "elements": 30_000,
    "bodies": 3_000,
    "included files": 200,
    "elements in each other": 200,
}
_BODIES = {"body", "flexcomp", "composite"}  # each copy of which is one
_COUNTS = {  # {attribute, or element and attribute: the most that memory and time allow}
    **dict.fromkeys(("nrow", "ncol", "width", "height", "nkey", "dim", "actdim", "nsample"), 1e4),
    **dict.fromkeys((f"nuser_{kind}" for kind in ("body", "jnt", "geom", "site", "cam", "tendon")), 1e3),
    **dict.fromkeys(("nuser_actuator", "nuser_sensor"), 1e3),
    **dict.fromkeys(("nuserdata", "numeric size"), 1e6),
}
_ENDLESS = {"effort", "velocity"}  # a URDF's joint may be without such a limit
_NAMES = {"name", "class"}
_FOLDERS = ("meshdir", "texturedir", "assetdir")  # of files that a model names
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_TAG = re.compile(r"""<(/?)([\w:.-]++)((?:"[^"]*"|'[^']*'|[^"'<>])*+)>""")
_ATTRIBUTE = re.compile(r"""([\w:.-]+)\s*=\s*(?:"([^"]*)"|'([^']*)')""")


def examine(file: pathlib.Path) -> None:
    """Refuse a model file that would take MuJoCo unbounded time or memory, or whose numbers are none."""
    beside = file.with_suffix(".toml")
    if beside.is_file():  # of a leg, or of a worn model: it may hold this file's digest
        check_text(read_text(beside), beside)
    counted = dict.fromkeys(_MOST, 0.0)
    known, todo = {file}, [file]
    while todo:
        included = set(_examined(todo.pop(), file.parent, counted)) - known
        known |= included
        todo += included


def _examined(file: pathlib.Path, folder: pathlib.Path, counted: dict[str, float]) -> Iterator[pathlib.Path]:
    """Examine one file of a model that lies in a folder; yields the files that it includes."""
    text = _COMMENT.sub("", read_bytes(file, _LARGEST_MODEL).decode("utf-8", errors="replace"))
    folders = {folder}
    for tag, attributes, levels, copies in _elements(text):
        counted["elements"] += copies
        counted["bodies"] += copies * (tag in _BODIES)
        counted["included files"] += tag == "include"
        counted["elements in each other"] = levels
        for what, most in _MOST.items():
            if counted[what] > most:
                raise InputError(f"has too many {what}", file=file, field=tag, allowed=f"at most {most}")
        folders |= {folder / attributes[name] for name in _FOLDERS if name in attributes}
        for name, value in attributes.items():
            numbers, field = _numbers(value), f"<{tag}> {name}"
            if numbers and name not in _NAMES and not (name in _ENDLESS and math.inf in map(abs, numbers)):
                plausible(numbers, file=file, field=field)
                limit = _COUNTS.get(f"{tag} {name}", _COUNTS.get(name, math.inf))
                if max(numbers) > limit:
                    allowed = f"at most {limit:g}"
                    raise InputError("is too many", file=file, field=field, value=value, allowed=allowed)
            if name.startswith("file") and value:
                words = {value, pathlib.PurePath(value).name}  # which MuJoCo takes alone, if a file says so
                named = [path for each in folders for word in words if (path := each / word).exists()]
                for path in named:
                    check_regular(path)
                if tag == "include":
                    yield from named


def _elements(text: str) -> Iterator[tuple[str, Mapping[str, str], int, float]]:
    """Each element's name and attributes, how many are open around it, and how often it will be there."""
    copies = [1.0]
    for closing, tag, rest in _TAG.findall(text):
        if closing:
            copies = copies[:-1] or [1.0]
            continue
        attributes = {name: first or second for name, first, second in _ATTRIBUTE.findall(rest)}
        own = copies[-1] * max(1.0, math.prod(_numbers(attributes.get("count", ""))))
        yield tag, attributes, len(copies), own
        if not rest.endswith("/"):
            copies.append(own)


def _numbers(text: str) -> list[float]:
    """The numbers of an attribute; none where it is something else."""
    try:
        return [float(word) for word in text.split()]
    except ValueError:
        return []
