"""Findings on bodies of other programs, and on the leg that could be cut out of them: MJCF, URDF."""

import pathlib
import shlex

import mujoco
import numpy as np

from afo_sim.cli.doctor.kinds import Findings
from afo_sim.common import InputError
from afo_sim.description import Side
from afo_sim.legs import LegNumbers, Tree, compile_file, cut, doubtful_notes, find, read_tree


def mjcf(path: pathlib.Path) -> Findings:
    """Masses and joints as MuJoCo reads them."""
    model, _ = compile_file(path)
    findings = [("mass", f"{model.body_subtreemass[0]:.4g} kg")]
    for body in range(1, model.nbody):
        findings.append((f"body {model.body(body).name}", f"{model.body_mass[body]:.4g} kg"))
    for joint in range(model.njnt):
        kind = mujoco.mjtJoint(int(model.jnt_type[joint])).name.removeprefix("mjJNT_").lower()
        lower, upper = np.degrees(model.jnt_range[joint])
        span = f", {lower:g} to {upper:g} deg" if model.jnt_limited[joint] and kind == "hinge" else ""
        findings.append((f"joint {model.joint(joint).name}", kind + span))
    return findings + (_leg_in(path) if model.njnt else [])


def urdf(path: pathlib.Path) -> Findings:
    """As `leg import` reads it: MuJoCo's own importer knows no packages and no links without mass."""
    tree = read_tree(path)
    findings = [("mass", f"{sum(part.mass for part in tree.parts.values()):.4g} kg")]
    findings += [(f"link {part.name}", f"{part.mass:.4g} kg") for part in tree.parts.values() if part.mass]
    for name, (_, joint) in tree.joints().items():
        span = ""
        if joint.range is not None and joint.kind == "hinge":
            lower, upper = np.degrees(joint.range)
            span = f", {lower:g} to {upper:g} deg"
        findings.append((f"joint {name}", joint.kind + span))
    findings += [("note", note) for note in tree.notes]
    return findings + (_leg_in(path) if tree.joints() else [])


def _leg_in(path: pathlib.Path) -> Findings:
    """The leg that `leg import` would cut out of a model, or both."""
    try:
        tree = read_tree(path)
    except InputError as error:
        return [("leg", f"cannot be cut out: {error.problem}")]
    try:
        return _found(tree, None, path)
    except InputError as error:
        if error.field != "side":
            return [("leg", _refused(error))]
    rows = []
    sides: tuple[Side, ...] = ("right", "left")
    for side in sides:
        try:
            rows += _found(tree, side, path)
        except InputError as error:
            rows.append((f"{side} leg", _refused(error)))
    return rows


def _refused(error: InputError) -> str:
    allowed = f"; allowed: {error.allowed}" if error.allowed else ""
    return f"none can be cut out: {error.problem}{allowed}"


def _found(tree: Tree, side: Side | None, path: pathlib.Path) -> Findings:
    """What the import would find and note; InputError where it would refuse."""
    leg = find(tree, side=side)
    alone = cut(tree, leg)
    axis = "" if leg.sign > 0.0 else ", its axis to be turned round"
    sole = "" if leg.sole is None else f", sole {np.degrees(leg.sole):+.0f} deg at zero"
    parts = f"shank {leg.shank}, foot {leg.foot}, ankle {leg.ankle}"
    return [
        (f"{leg.side} leg", f"{parts}: tilt {np.degrees(leg.tilt):.0f} deg{axis}{sole}"),
        *(
            (f"note on the {leg.side} leg", note)
            for note in (*leg.notes, *doubtful_notes(alone, LegNumbers.of(alone)))
        ),
        ("cut it out with", f"afo-sim leg import {shlex.quote(str(path))} --side {leg.side}"),
    ]
