"""Findings on bodies of other programs, and on the leg that could be cut out of them: MJCF, URDF."""

import pathlib
import shlex

import numpy as np

from afo_sim.cli.doctor.kinds import Findings
from afo_sim.common import InputError
from afo_sim.description import Leg, Side
from afo_sim.legs import LegNumbers, Tree, cut, doubtful_notes, find, read_body


def body(path: pathlib.Path) -> Findings:
    """Masses and joints as `leg import` and `attach` read them, and what a leg of it would be."""
    tree = read_body(path)
    findings = [("mass", f"{sum(part.mass for part in tree.parts.values()):.4g} kg")]
    findings += [(f"body {part.name}", f"{part.mass:.4g} kg") for part in tree.parts.values() if part.mass]
    for name, (_, joint) in tree.joints().items():
        span = ""
        if joint.range is not None and joint.kind == "hinge":
            lower, upper = np.degrees(joint.range)
            span = f", {lower:g} to {upper:g} deg"
        findings.append((f"joint {name}", joint.kind + span))
    findings += [("note", note) for note in tree.notes]
    return findings + (_leg_in(tree, path) if tree.joints() else [])


def leg(leg: Leg) -> Findings:
    """What is in a leg's model."""
    return body(leg.file)


def _leg_in(tree: Tree, path: pathlib.Path) -> Findings:
    """The leg that `leg import` would cut out of a body, or both."""
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
    return f"no leg can be cut out: {error.problem}{allowed}"


def _found(tree: Tree, side: Side | None, path: pathlib.Path) -> Findings:
    """What the import would find and note; InputError where it would refuse."""
    leg = find(tree, side=side)
    alone = cut(tree, leg)
    axis = "" if leg.sign > 0.0 else ", axis to be reversed"
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
