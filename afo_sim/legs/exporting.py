"""A leg with the rigid parts of its orthosis → URDF, for other programs."""

import dataclasses
import os
import pathlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from afo_sim.common import InputError, Notice, Shown, assets, nearest_name
from afo_sim.description import Scenario, load
from afo_sim.legs.leg_numbers import Segment
from afo_sim.legs.mjcf import tree_of
from afo_sim.legs.tree import Tree, reading_note
from afo_sim.model import ANKLE, Size, leg_spec
from afo_sim.model.build import build


@dataclass(frozen=True, eq=False, repr=False)
class Exported(Shown):
    """What was written: its tree, files, a table, and what the format does not hold.

    tree : bodies and joints as written
    files : that were written
    rows : what, and how much: a table in words
    notes : what the format does not hold
    """

    tree: Tree
    files: tuple[pathlib.Path, ...]
    rows: tuple[tuple[str, str], ...]
    notes: tuple[str, ...]


def export_leg(
    source: str, to: str | os.PathLike[str], *, orthosis: str | None = None, force: bool = False
) -> Exported:
    """Write a leg as URDF, with the orthosis' cuff and plate and the muscles' ends.

    Parameters
    ----------
    source : a leg or scenario, a shipped name or a path; a scenario's person sets the size
    to : `.urdf` file; meshes go into a folder beside it
    orthosis : worn on it; by default the scenario's, or none on a leg
    force : replace a file that is there

    Raises
    ------
    InputError
        A leg, scenario or orthosis does not exist, they do not fit, or the file exists.

    Examples
    --------
    >>> export_leg("adult_75kg", "worn.urdf", orthosis="s1").files[0].name
    'worn.urdf'
    """
    from afo_sim.legs.urdf_out import write_urdf  # its libraries take half a second

    to = pathlib.Path(to)
    if to.suffix.lower() != ".urdf":
        raise InputError("is not a URDF file", field="to", value=str(to), allowed="a name that ends in .urdf")
    if to.is_dir():
        raise InputError("is a folder", field="to", value=str(to), allowed="a file")
    if to.exists() and not force:
        raise InputError("is there already", field="to", value=str(to), allowed="another, or `force`")
    scenario, worn = _scenario(source, orthosis)
    tree = _leg_tree(scenario, worn=worn)
    remarks = write_urdf(tree, to, name=scenario.leg.name or "leg")
    meshes = to.parent / f"{to.stem}_meshes"
    files = (to, *([meshes] if any(s.kind == "mesh" for p in tree.parts.values() for s in p.shapes) else []))
    rows = []
    for name, parts in zip(("shank", "foot"), tree.split(scenario.leg.shank, scenario.leg.foot), strict=True):
        mass = Segment.of(tree, parts, scenario.leg.shank).mass
        rows.append((f"mass of the {name}{' with the orthosis' if worn else ''}", f"{mass:.4g} kg"))
    hinges = [name for name, (_, joint) in tree.joints().items() if joint.kind == "hinge"]
    points = sum(len(part.points) for part in tree.parts.values())
    rows += [("hinges", ", ".join(hinges)), ("points, as links without mass", str(points))]
    return Exported(tree, files, tuple(rows), (*remarks, *_lost(scenario, worn)))


def _leg_tree(scenario: Scenario, *, worn: bool = True) -> Tree:
    """Shank and all that hangs on it, of the compiled model of a scenario."""
    model = build(scenario).full_model if worn else leg_spec(scenario, Size.of(scenario)).compile()
    whole, shank = tree_of(model), scenario.leg.shank
    parts = {part.name: part for part in whole.below(shank)}
    hinged, ankle = whole.joints()[ANKLE]
    # whole damping: in the compiled model the passive ankle adds the half
    twice = [dataclasses.replace(j, damping=2.0 * j.damping) if j is ankle else j for j in hinged.joints]
    parts[hinged.name] = dataclasses.replace(hinged, joints=tuple(twice))
    # the shank stands in the world's origin, without what drives it in walking
    parts[shank] = dataclasses.replace(parts[shank], parent=None, pose=np.eye(4), joints=())
    return Tree(file=None, parts=parts)


def _scenario(source: str, orthosis: str | None) -> tuple[Scenario, bool]:
    """The scenario of a leg or of a scenario, and whether its orthosis is worn."""
    sets, path = {} if orthosis is None else {"orthosis": orthosis}, pathlib.Path(source)
    is_leg = source in assets.names("leg") or (path / "leg.toml").is_file()
    if is_leg or (path.is_file() and path.suffix == ".toml" and "file" in assets.read_toml(path)):
        return load("scenario", "seated", {"leg": source} | sets), orthosis is not None
    try:
        return load("scenario", source, sets), True
    except InputError as error:
        if error.field != "scenario" or error.value != source:
            raise
    known = sorted({*assets.names("leg"), *assets.names("scenario")})
    allowed, near = f"a path, or one of: {', '.join(known)}", nearest_name(source, known)
    problem = "there is no such leg or scenario"
    raise InputError(problem, field="source", value=source, allowed=allowed, nearest=near)


def _lost(scenario: Scenario, worn: bool) -> Iterator[Notice]:
    if scenario.simulated_side == "left":
        words = "URDF has no side: import this left leg with --side left"
        yield Notice("side-left-out", words, subject="side", severity="note")
    if worn and scenario.orthosis.muscle:
        words = "URDF has no muscles: of {names} it holds the ends as points, not the pull or the air"
        yield reading_note("muscles-left-out", words, scenario.orthosis.muscle)
    if scenario.leg.passive.scale > 0.0:
        words = "URDF has no passive tissue: the ankle's moment of Riener & Edrich is left out"
        yield Notice("tissue-left-out", words, subject="leg.passive", severity="note")
