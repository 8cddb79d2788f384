"""An orthosis on one leg of a whole model, which stays as it is."""

import dataclasses
import os
import pathlib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common.errors import InputError
from afo_sim.description.attachment import Segment, Side
from afo_sim.description.orthosis import Orthosis
from afo_sim.description.reader import load
from afo_sim.legs.attached import Attached, number_of, pressure_of
from afo_sim.legs.attached_checks import check_added, check_muscles, check_spec, check_step, doubts
from afo_sim.legs.attached_spec import compiled, grow_keyframes, own_spec, place_files_whole, told_changes
from afo_sim.legs.finding import Found, find
from afo_sim.legs.hanging import hang, places_of
from afo_sim.legs.mjcf import one_line, tree_of
from afo_sim.legs.tree import Tree
from afo_sim.model.circuit import circuit_of, endless
from afo_sim.model.mirror import mirror_shapes
from afo_sim.model.tendons import add_tendons
from afo_sim.native.hold import Hold

Described = str | os.PathLike[str] | Mapping[str, Any] | Orthosis
PREFIX = "afo_"
SUPPLY = "4 bar"


def attach(
    model: str | os.PathLike[str] | mujoco.MjSpec | Attached,
    orthosis: Described,
    *,
    shank: str | None = None,
    foot: str | None = None,
    ankle: str | None = None,
    side: Side | None = None,
    zero: float | None = None,
    supply: str | float = SUPPLY,
    timestep: str | float | None = None,
    prefix: str = PREFIX,
) -> Attached:
    """Put an orthosis' cuff, plate, muscles and air circuit on a leg of a whole MuJoCo model.

    The model keeps its bodies, joints, muscles, gravity and tissue; nothing of the sort is added. It is then
    stepped by `mujoco.mj_step` within `Attached.callbacks()`.

    Parameters
    ----------
    model : MJCF or URDF file, a shipped leg's name, an MjSpec, which stays as it is, or what `attach` gave,
        for the other leg
    orthosis : a shipped name, a path, a description as a dict, or an Orthosis
    shank, foot, ankle : names of bodies and hinge; sought by default. The plate goes onto the named foot, by
        default onto the heaviest body that the ankle moves
    side : "right" or "left", where both are there
    zero : the hinge's coordinate at which the ankle's angle is zero [rad]; 0 by default
    supply : gauge pressure before the inlet valves, text or [Pa]
    timestep : text or [s]; the model's own by default
    prefix : of all names that are added

    Returns
    -------
    Attached

    Raises
    ------
    InputError
        The model cannot be read; a body or hinge is not there; a name would be there twice; the model holds
        actuators that ask for callbacks of another program; a muscle locks, or turns inside out, within the
        range of motion; the time step is too long (with the one that would do).

    Examples
    --------
    >>> leg = attach("adult_75kg", "s1")
    >>> sorted(leg.chambers)
    ['dorsiflexor', 'plantarflexor']
    """
    device = orthosis if isinstance(orthosis, Orthosis) else load("orthosis", orthosis)
    spec, file, before = own_spec(model)
    step = None if timestep is None else seconds(timestep)
    pressure = pressure_of(supply, "supply")
    check_spec(spec, file, device, prefix, before)
    place_files_whole(spec, pathlib.Path(spec.modelfiledir or ""))
    bare = compiled(spec, file)
    tree = tree_of(bare)
    found = find(tree, shank=shank, foot=foot, ankle=ankle, side=side, zero=zero)
    bodies: dict[Segment, str] = {"shank": found.shank, "foot": foot or _heaviest(tree, found.foot)}
    if _named(spec, tree, bodies, found):
        bare = compiled(spec, file)
    told = told_changes(spec, step)
    joints = _crossed(tree, found, bodies["foot"])
    # where another joint turns the foot too, parallel paths are not equally long
    inverts = joints != (found.ankle,)
    circuit = circuit_of(device, found.ankle, inverts=inverts, supply=endless(pressure))
    first = max(spec.nuserdata, 0)
    mirrored = device.side != found.side
    try:
        anchors, default = hang(spec, device, places_of(bare, found, bodies), prefix, mirrored)
    except ValueError as error:
        problem = f"MuJoCo cannot put cuff and plate on it: {one_line(error)}"
        raise InputError(problem, file=file, field="prefix", value=prefix, allowed="another prefix") from None
    add_tendons(spec, anchors, device, prefix=prefix, default=default)
    for body in anchors.values() if mirrored else ():
        mirror_shapes(body)
    spec.nuser_actuator = max(
        [native.N_USER, spec.nuser_actuator, *(len(a.userdata) for a in spec.actuators)]
    )
    native.add_circuit(spec, circuit, prefix=prefix, userdata=first, default=default)
    grow_keyframes(spec, bare)
    model_with = compiled(spec, file)
    attached = Attached(
        model=model_with,
        spec=spec,
        orthosis=device,
        found=found,
        bodies=bodies,
        joints=joints,
        prefix=prefix,
        supply=pressure,
        circuit=circuit,
        ids=native.circuit_ids(model_with, circuit, prefix),
        userdata=first,
    )
    earlier = [] if before is None else list(before.legs.values())
    legs = [dataclasses.replace(leg, model=model_with, spec=spec) for leg in earlier]
    native.fill_circuit(model_with, circuit, attached.ids, userdata=first)  # what the checks look at
    check_added(attached, bare)
    warned = [*check_muscles(attached), *check_step(attached)]
    for leg in legs:
        check_step(leg)  # which may be another now
    told += [*doubts(attached, tree), *warned]
    return completed([*legs, dataclasses.replace(attached, told=tuple(told))])[-1]


def completed(legs: Sequence[Attached]) -> list[Attached]:
    """Orthoses on one compiled model, which know each other, with all parameters, and shown to pull."""
    by_prefix: dict[str, Attached] = {}
    for leg in legs:
        by_prefix[leg.prefix] = dataclasses.replace(leg, legs=by_prefix)
        native.fill_circuit(leg.model, leg.circuit, leg.ids, userdata=leg.userdata)
    _check_live(by_prefix.values())
    _fill_keyframes(legs[-1].model, by_prefix[legs[-1].prefix])
    return list(by_prefix.values())


def seconds(value: str | float) -> float:
    """A time step given as text with a unit or as [s]."""
    return number_of(value, "timestep", "s", (0.0, 0.1), 'more than 0 and at most "100 ms"')


def _heaviest(tree: Tree, foot: str) -> str:
    """The heaviest of the bodies that the ankle moves: the talus carries no shoe, the calcaneus does."""
    return max(tree.below(foot), key=lambda part: part.mass).name


def _crossed(tree: Tree, found: Found, carrier: str) -> tuple[str, ...]:
    """Names of the joints between the shank and the body that carries the plate."""
    joints: list[str] = []
    part = tree.parts[carrier]
    while part.name != found.shank:
        joints = [joint.name for joint in part.joints] + joints
        if part.parent is None:
            break
        part = tree.parts[part.parent]
    return tuple(joints)


def _named(spec: mujoco.MjSpec, tree: Tree, bodies: Mapping[Segment, str], found: Found) -> bool:
    """Give bodies and ankle that have no name the one that they are known by; whether any had none."""
    names, added = list(tree.parts), False
    part, joint = tree.joints()[found.ankle]
    owners = {name: next(b for b in spec.bodies if b.id == names.index(name) + 1) for name in tree.parts}
    for name in bodies.values():
        if not owners[name].name:
            owners[name].name, added = name, True
    hinge = owners[part.name].joints[part.joints.index(joint)]
    if not hinge.name:
        hinge.name, added = joint.name, True
    return added


def _check_live(legs: Iterable[Attached]) -> None:
    """Refuse limp muscles: in the zero posture of the ankles each must pull as its law says."""
    legs = list(legs)
    model = legs[0].model
    data = mujoco.MjData(model)
    for leg in legs:
        data.qpos[model.joint(leg.found.ankle).qposadr[0]] = leg.found.zero
    state = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION))
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    with Hold():
        native.assert_muscles_pull(model, state)


def _fill_keyframes(model: mujoco.MjModel, attached: Attached) -> None:
    """Let each keyframe of the model begin with air at ambient pressure, and with supply."""
    first = min(
        int(model.actuator_actadr[i]) for leg in attached.legs.values() for i in leg.ids.networks.values()
    )
    for key in range(model.nkey):
        data = attached.data(model.key_qpos[key])
        model.key_act[key, first:] = data.act[first:]
        for leg in attached.legs.values():
            model.key_ctrl[key, list(leg.chambers.values())] = leg.supply
