"""The spec of a whole model: read, kept apart from its caller's, and an orthosis hung on it."""

import os
import pathlib
from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import Given, InputError, Notice, assets, in_unit
from afo_sim.description import WORN, Orthosis, Segment, load
from afo_sim.legs.attached import Attached
from afo_sim.legs.finding import Found
from afo_sim.legs.mjcf import mujoco_says, place_files_whole
from afo_sim.legs.reading import read_spec
from afo_sim.legs.tree import Tree, listed, quaternion_of
from afo_sim.legs.urdf_files import Packages
from afo_sim.model import rigid_part

DEEP, FAR = 0.002, 0.01  # [m], [rad or m]; of contacts, and of stops and equalities, in a start state
EQUALITY, LIMIT = int(mujoco.mjtConstraint.mjCNSTR_EQUALITY), int(mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT)
BOUND = {EQUALITY: mujoco.MjModel.eq, LIMIT: mujoco.MjModel.joint}
IMPLICITFAST = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
BIT = mujoco.mjtDisableBit
# {flag that the model switches off: what the user should know}
SWITCHED_OFF = {
    BIT.mjDSBL_GRAVITY: "its file switches gravity off",
    BIT.mjDSBL_CONTACT: "its file switches contacts off",
    BIT.mjDSBL_LIMIT: "its file switches the joints' stops off: nothing holds the joint within its range",
    BIT.mjDSBL_SPRING: "its file switches joints' and tendons' springs off",
    BIT.mjDSBL_DAMPER: "its file switches joints' and tendons' dampers off",
    BIT.mjDSBL_CONSTRAINT: "its file switches all constraints off: contacts, stops, equalities",
    BIT.mjDSBL_EQUALITY: "its file switches equality constraints off",
}


def own_spec(model: Given, packages: Packages = ()) -> tuple[mujoco.MjSpec, Tree, Attached | None]:
    """A spec of its caller's own, what was remarked on reading it, and the orthosis that is on it already."""
    if isinstance(model, Attached):
        return model.spec.copy(), Tree(None, {}), model
    if isinstance(model, mujoco.MjSpec):
        spec = model.copy()
        spec.compiler.fusestatic = False
        place_files_whole(spec, pathlib.Path(spec.modelfiledir or ""))
        return spec, Tree(None, {}), None
    if not isinstance(model, str | os.PathLike):
        allowed = "a path, a mujoco.MjSpec, or what attach gave"
        raise InputError("is not a valid model", field="model", value=type(model).__name__, allowed=allowed)
    file = pathlib.Path(model)
    if not file.exists() and str(model) in assets.names("leg"):
        file = load("leg", str(model)).file
    return *read_spec(file, packages=packages), None


def compiled(spec: mujoco.MjSpec, file: pathlib.Path | None) -> mujoco.MjModel:
    """A spec's model, without parameters; MuJoCo's reason in one line where it cannot be compiled."""
    with mujoco_says(file):
        return spec.compile()


def set_options(spec: mujoco.MjSpec, step: float | None) -> list[str]:
    """Set what muscles need of integrator and flags, and the time step [s] if one is given; notices of it."""
    option, notices = spec.option, list[str]()
    if option.integrator != IMPLICITFAST:
        before = mujoco.mjtIntegrator(option.integrator).name.removeprefix("mjINT_").lower()
        option.integrator = IMPLICITFAST
        words = "the integrator is implicitfast now (it was {before}): only it keeps stiff muscles stable"
        told = {"subject": "integrator", "before": before}
        notices.append(Notice("integrator-changed", words, severity="note", **told))
    if not option.disableflags & BIT.mjDSBL_AUTORESET:
        option.disableflags |= BIT.mjDSBL_AUTORESET
        words = "MuJoCo's automatic reset is off: an unstable model would silently restart without air"
        notices.append(Notice("autoreset-off", words, subject="autoreset", severity="note"))
    if step is not None and step != option.timestep:
        before_ms, after_ms = (in_unit(t, "s", "ms") for t in (option.timestep, step))
        option.timestep = step
        words = f"the time step is {after_ms:g} ms now (it was {before_ms:g} ms)"
        notices.append(Notice("timestep-changed", words, subject="timestep", severity="note", timestep=step))
    off = [bit for bit in SWITCHED_OFF if option.disableflags & bit]
    return [*notices, *(Notice("switched-off", SWITCHED_OFF[bit], subject=bit.name) for bit in off)]


def doubts_of_start(model: mujoco.MjModel) -> list[Notice]:
    """Notices of a start state that drives apart: deep in contact, beyond stops, off an equality."""
    data, found = native.scratch(model), list[Notice]()
    mujoco.mj_fwdPosition(model, data)
    met = [contact for contact in data.contact if contact.dist < -DEEP and min(contact.geom) >= 0]
    if deep := sorted((contact.dist, *model.geom_bodyid[contact.geom]) for contact in met):
        one, other = (model.body(body).name or f"body {body}" for body in deep[0][1:])
        words = (
            "the initial state has {count} contacts deeper than 2 mm, up to {depth:.0f} mm of {subject!r} "
        )
        words += "in {other!r}: they push the bodies apart when stepped"
        count, depth = len(deep), -1000.0 * deep[0][0]
        found.append(Notice("start-in-contact", words, subject=one, count=count, depth=depth, other=other))
    excess = np.where(data.efc_type == EQUALITY, np.abs(data.efc_pos), -data.efc_pos)
    rows = sorted(row for row in zip(excess, data.efc_type, data.efc_id, strict=True) if row[0] > FAR)
    if off := {BOUND[kind](model, k).name or f"number {k}": x for x, kind, k in rows if kind in BOUND}:
        words = "the initial state violates stops or equalities: {names}; {subject!r} by {most:.2g} rad or m"
        *_, worst = off
        names = listed(reversed(off))
        found.append(Notice("start-out-of-bounds", words, subject=worst, names=names, most=off[worst]))
    return found


def grow_keyframes(spec: mujoco.MjSpec, bare: mujoco.MjModel) -> None:
    """Lengthen the model's keyframes by the inputs and states of the actuators that were added."""
    added = list(spec.actuators)[bare.nu :]
    states = sum(max(actuator.actdim, 0) for actuator in added)  # of each its own number
    for key in spec.keys:
        if len(key.ctrl):
            key.ctrl = [*key.ctrl, *[0.0] * len(added)]
        if len(key.act):
            key.act = [*key.act, *[0.0] * states]


@dataclass(frozen=True, eq=False)
class AnkleFrame:
    """The ankle on a body, by name: position [m] (3,) and turn of the leg's axes (4,), in the body's axes."""

    body: str
    position: np.ndarray
    quaternion: np.ndarray


def hang(
    spec: mujoco.MjSpec, orthosis: Orthosis, places: Mapping[Segment, AnkleFrame], prefix: str, mirrored: bool
) -> tuple[dict[str, mujoco.MjsBody], mujoco.MjsDefault]:
    """Attach an orthosis' rigid parts to two bodies, in frames at the ankle: x forward, y left, z up."""
    anchors: dict[str, mujoco.MjsBody] = {}
    for segment in orthosis.words.segments:
        kind = WORN[segment]
        place = places[segment]
        frame = spec.body(place.body).add_frame(pos=place.position, quat=place.quaternion)
        file = getattr(orthosis, kind)
        if file is not None:
            frame.attach_body(rigid_part(file, kind, mirrored), f"{prefix}{kind}_", "")
            place_files_whole(spec, file.parent)
        # a spec of its own: elements added to it take MuJoCo's defaults, not the model's
        blank = mujoco.MjSpec()
        body = blank.worldbody.add_body(name="anchors")
        anchors[segment] = frame.attach_body(body, f"{prefix}{segment}_", "")
        anchors[segment].childclass = f"{prefix}{segment}_main"
    return anchors, spec.find_default(f"{prefix}{orthosis.words.segments[0]}_main")


def ankle_frames(
    model: mujoco.MjModel, found: Found, bodies: Mapping[Segment, str]
) -> dict[Segment, AnkleFrame]:
    """The ankle, in the leg's axes, on the bodies that carry the device, by segment."""
    data = native.scratch(model)
    data.qpos[model.joint(found.ankle).qposadr[0]] = found.zero
    mujoco.mj_kinematics(model, data)
    places: dict[Segment, AnkleFrame] = {}
    for segment, name in bodies.items():
        body = model.body(name).id
        turn = data.xmat[body].reshape(3, 3)
        position = turn.T @ (found.centre - data.xpos[body])
        places[segment] = AnkleFrame(name, position, quaternion_of(turn.T @ found.axes))
    return places
