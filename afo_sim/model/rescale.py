"""An orthosis on a leg of another size: what is fixed to a segment goes with the segment's length.

    p' = r p         anchors, points and surfaces of a segment that is r times as long, from the ankle
    l' = l + L' − L  link, by what the path is longer at an ankle angle of zero

The muscles stay what they are. With l' each has the contraction ratio at angle zero that it had. Over the
angle it then changes with the moment arm, dκ/dθ = a/L0. As a folder it is the original's text with its
comments, and the numbers that changed.
"""

import math
import os
import pathlib
import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import tomlkit

from afo_sim.common import InputError, assets, check_writable, together, without_digests, write_sealed
from afo_sim.description import (
    Anchor,
    Leg,
    MuscleGroup,
    Orthosis,
    PathPoint,
    Provenance,
    Segment,
    a_joint,
    load,
)
from afo_sim.description.new import reference
from afo_sim.description.portable import portable
from afo_sim.model.paths import mean_length, paths_of

SHANK, FOOT = 0.246, 0.152  # lengths as shares of body height [-] (Winter 2009, after Drillis & Contini 1966)
SMALLEST, LARGEST = 0.25, 4.0  # ratios of two people's segments: a newborn's to an adult's, and back
WIDEST = math.pi / 3.0  # angle to either side up to which a taut muscle is looked for [rad]
FILE_NAME = "orthosis.toml"
COMMENT = (
    'Other comments are of the original and its numbers; a number that the refit changed says "derived".'
)
RIGID_PARTS = ("cuff", "plate")


@dataclass(frozen=True)
class Ratio:
    """Scale factors of shank and foot from the original leg [-]; `words` for whom."""

    shank: float = 1.0
    foot: float = 1.0
    words: str = ""

    def of(self, segment: Segment) -> float:
        """The segment's ratio."""
        return self.shank if segment == "shank" else self.foot

    def source(self, segment: Segment) -> str:
        """Where a scaled coordinate comes from."""
        who = f", {self.words}" if self.words else ""
        return f"scaled by {self.of(segment):.6g} with the length of the {segment}{who}"


def lengths_of(leg: Leg) -> tuple[float, float]:
    """Length of a leg's shank and foot [m]: its own, or Winter's shares of the body's height."""
    shank = SHANK * leg.body_height if leg.shank_length is None else leg.shank_length
    return shank, (FOOT * leg.body_height if leg.foot_length is None else leg.foot_length)


def refit(orthosis: Orthosis, shank: float = 1.0, foot: float = 1.0, *, words: str = "") -> Orthosis:
    """Scale an orthosis' anchors and paths with the lengths of shank and foot.

    All three coordinates of what is fixed to a segment scale with its length, girth like height; so do
    radii of surfaces. Muscles, their spacing, pulleys, cables, valves, cuff, plate and outsole stay as they
    are. The link takes up the change in path length at an ankle angle of zero.

    Parameters
    ----------
    orthosis : as it was made
    shank, foot : scale factors of their lengths [-], 0.25 to 4
    words : for whom, in the source of each scaled number

    Returns
    -------
    Orthosis; scaled coordinates are of the kind "derived". With ratios of 1 the same orthosis

    Raises
    ------
    InputError
        A ratio is out of range, or a muscle with its fittings is longer than its path on the new leg.

    Examples
    --------
    >>> child = refit(load("orthosis", "s1"), shank=0.8, foot=0.8)
    >>> round(child.muscle["dorsiflexor"].origin.from_joint[2], 3)  # [m], of 0.3
    0.24

    Source
    ------
    Lengths of segments: Winter 2009, Biomechanics and Motor Control of Human Movement, 4th ed., fig. 4.1.
    """
    for field, ratio in (("shank", shank), ("foot", foot)):
        if not SMALLEST <= ratio <= LARGEST:  # and no NaN
            raise InputError("is out of range", field=field, value=ratio, allowed="0.25 to 4")
    by = Ratio(shank, foot, words)
    if shank == foot == 1.0:
        return orthosis
    if orthosis.joint != "ankle" and orthosis.anchored:
        problem = f"goes with shank and foot, and the orthosis is for {a_joint(orthosis.joint)}"
        raise InputError(problem, field="refit", allowed="an orthosis for an ankle")
    groups = {name: _rescaled(name, group, by) for name, group in orthosis.muscle.items()}
    changed = orthosis.model_copy(update={"muscle": groups})
    return load("orthosis", changed.model_dump(mode="json"))  # checked as a file is


def _rescaled(name: str, group: MuscleGroup, by: Ratio) -> MuscleGroup:
    """A group between two anchors; over a pulley it stays."""
    if group.origin is None or group.insertion is None or group.link_length is None:
        return group
    ends = {"origin": _moved(group.origin, by), "insertion": _moved(group.insertion, by)}
    moved = group.model_copy(update={**ends, "path": tuple(_moved(place, by) for place in group.path)})
    link = group.link_length + (mean_length(moved) - mean_length(group))
    if link < 0.0:
        path, rest = mean_length(moved), group.series_length - group.link_length + group.type.nominal_length
        problem = f"is too long for this leg: its path is {100.0 * path:.3g} cm at an angle of zero, and "
        problem += f"muscle, fittings and slack are {100.0 * rest:.3g} cm"
        field, value = f"muscle.{name}.type", group.type.name
        raise InputError(problem, field=field, value=value, allowed="a shorter muscle")
    derived = Provenance(kind="derived", source=_link_source(by))
    sources = group.provenance | {"link_length": derived}
    return moved.model_copy(update={"link_length": link, "provenance": sources})


def _link_source(by: Ratio) -> str:
    """Where a refitted link's length comes from."""
    who = f" ({by.words})" if by.words else ""
    return f"so that the muscle's contraction at an ankle angle of zero is that before the refit{who}"


def _moved(place: object, by: Ratio) -> Anchor:
    """An anchor or point, with its surface, scaled with its segment."""
    assert isinstance(place, Anchor)
    ratio = by.of(place.segment)
    if ratio == 1.0:
        return place
    derived = Provenance(kind="derived", source=by.source(place.segment))
    changed: dict[str, object] = {
        "from_joint": tuple(ratio * x for x in place.from_joint),
        "provenance": place.provenance | {"from_joint": derived},
    }
    if isinstance(place, PathPoint) and place.surface is not None:
        surface = place.surface
        update = {"radius": ratio * surface.radius, "provenance": surface.provenance | {"radius": derived}}
        changed["surface"] = surface.model_copy(update=update)
    return place.model_copy(update=changed)


@dataclass(frozen=True)
class Fit:
    """How one group fits its leg."""

    arm: float  # moment arm at angle zero, dorsiflexion positive [m]
    contraction: tuple[float, float]  # that the path leaves over the range of motion, least and most [-]
    taut: float  # angle from which on the muscle is taut without air [rad]; NaN where none is


def fits(orthosis: Orthosis) -> Mapping[str, Fit]:
    """How each group of muscles between two anchors fits; of unlike parallel muscles the mean."""
    paths = paths_of(orthosis)
    if not paths.tendons:
        return {}
    angles = np.linspace(*orthosis.range_of_motion, 81)
    wide = np.linspace(-WIDEST, WIDEST, 1201)
    owners = [name.rsplit("_", 1)[0] for name in paths.tendons]
    found = {}
    arms, lengths, far = paths.moment_arms(np.zeros(1)), paths.lengths(angles), paths.lengths(wide)
    for name, group in orthosis.anchored.items():
        own = [k for k, owner in enumerate(owners) if owner == name]
        length = group.type.nominal_length
        left = 1.0 - (lengths[:, own].mean(axis=1) - group.series_length) / length
        over = 1.0 - (far[:, own].mean(axis=1) - group.series_length) / length
        taut, crossings = math.nan, np.flatnonzero(np.diff(np.signbit(over)))
        if len(crossings):  # the one nearest to zero
            k = crossings[np.argmin(np.abs(wide[crossings]))]
            taut = float(wide[k] + over[k] / (over[k] - over[k + 1]) * (wide[k + 1] - wide[k]))
        found[name] = Fit(float(arms[0, own].mean()), (float(left.min()), float(left.max())), taut)
    return found


def write_rescaled(
    source: str | os.PathLike[str], by: Ratio, folder: pathlib.Path, *, force: bool = False
) -> Orthosis:
    """Write `folder/orthosis.toml`, an orthosis refitted, and copies of the files that it names."""
    file = assets.find("orthosis", os.fspath(source)).resolve()
    target = folder / FILE_NAME
    if target.exists() and (not force or target.resolve() == file):
        allowed = (
            "another folder" if target.resolve() == file else "--force, which replaces it, or another folder"
        )
        raise InputError("holds an orthosis", field="out", value=str(folder), allowed=allowed)
    found = refit(load("orthosis", file), by.shank, by.foot, words=by.words)
    former = re.compile(r"\bfrom_ankle(?=,|['\"]?\s*=)")  # a key, in a comment too
    before = former.sub("from_joint", file.read_text(encoding="utf-8"))
    document = tomlkit.parse(without_digests(before))
    if by.shank != 1.0 or by.foot != 1.0:
        text = str(document.get("description", "")).strip()
        document["description"] = f"{text}; refitted{f': {by.words}' if by.words else ''}".lstrip("; ")
        for name, group in found.anchored.items():
            table = document["muscle"][name]
            assert group.link_length is not None
            entries = (table["origin"], *table.get("path", ()), table["insertion"])
            for entry, place in zip(entries, group.places, strict=True):
                if by.of(place.segment) != 1.0:
                    why, surface = by.source(place.segment), place.surface
                    entry["from_joint"] = _derived([_cm(x) for x in place.from_joint], why)
                    if surface is not None:
                        entry["surface"]["radius"] = _derived(_cm(surface.radius), why)
            table["link_length"] = _derived(_cm(group.link_length), _link_source(by))
    check_writable(folder)
    with together(folder) as scratch:
        _carry(document, file, folder, scratch)
        text = tomlkit.dumps(document)
        if found != load("orthosis", file):
            text = f"# {file.parent.name}, refitted{f': {by.words}' if by.words else ''}. {COMMENT}\n" + text
        write_sealed(scratch / FILE_NAME, text, "orthosis", scratch)
    return found


def _derived(value: object, source: str) -> tomlkit.items.InlineTable:
    entry = tomlkit.inline_table()
    entry.update({"value": value, "kind": "derived", "source": source})
    return entry


def _cm(length: float) -> str:
    return f"{100.0 * length + 0.0:.12g} cm"


def _carry(
    document: tomlkit.TOMLDocument, file: pathlib.Path, folder: pathlib.Path, scratch: pathlib.Path
) -> None:
    """Let the text name its cuff and plate, muscles and valves from its new folder."""
    models = {
        key: str((file.parent / assets.file_beside(str(document[key]), file)).resolve())
        for key in RIGID_PARTS
        if key in document
    }
    for key, place in portable({"orthosis": models}, folder, scratch)["orthosis"].items():
        document[key] = place
    for group in document.get("muscle", {}).values():
        _refer(group, "type", "muscle", file, folder)
    for chamber in document.get("chamber", {}).values():
        for key in ("inlet", "outlet"):
            _refer(chamber, key, "valve", file, folder)


def _refer(table: dict[str, object], key: str, kind: str, file: pathlib.Path, folder: pathlib.Path) -> None:
    """A muscle or valve by its shipped name, or by its path from the new folder."""
    name = table.get(key)
    if isinstance(name, str) and name not in assets.names(kind):
        table[key] = reference(kind, str(assets.find(kind, name, file)), folder)
