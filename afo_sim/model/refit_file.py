"""A refitted orthosis as a folder: the original's text with its comments, and the numbers that changed."""

import os
import pathlib
from typing import Any

import tomlkit

from afo_sim.common import assets
from afo_sim.common.errors import InputError
from afo_sim.common.writing import check_writable, together
from afo_sim.description.attachment import Anchor, PathPoint
from afo_sim.description.new import reference
from afo_sim.description.orthosis import MuscleGroup, Orthosis
from afo_sim.description.portable import portable
from afo_sim.description.reader import load
from afo_sim.model.refit import Ratio, link_source, refit

ORTHOSIS = "orthosis.toml"
HEAD = 'Other comments are of the original and its numbers; a number that the refit changed says "derived".'
BESIDE = ("cuff", "plate")


def write_refit(
    source: str | os.PathLike[str], by: Ratio, folder: pathlib.Path, *, force: bool = False
) -> Orthosis:
    """Write `folder/orthosis.toml`, an orthosis refitted, and copies of the files that it names.

    Parameters
    ----------
    source : a shipped orthosis' name, or the path of its TOML file or folder
    by : ratios of the segments' lengths
    folder : made if need be
    force : replace an orthosis that is there

    Returns
    -------
    the refitted Orthosis

    Raises
    ------
    InputError
        There is no such orthosis, it does not fit the leg, or the folder is taken.
    """
    file = assets.find("orthosis", os.fspath(source)).resolve()
    target = folder / ORTHOSIS
    if target.exists() and (not force or target.resolve() == file):
        allowed = (
            "another folder" if target.resolve() == file else "--force, which replaces it, or another folder"
        )
        raise InputError("holds an orthosis", field="out", value=str(folder), allowed=allowed)
    found = refit(load("orthosis", file), by.shank, by.foot, words=by.words)
    document = tomlkit.parse(file.read_text(encoding="utf-8"))
    _tell(document, found, by)
    check_writable(folder)
    with together(folder) as scratch:
        _carry(document, file, folder, scratch)
        text = tomlkit.dumps(document)
        if found != load("orthosis", file):
            text = f"# {file.parent.name}, refitted{f': {by.words}' if by.words else ''}. {HEAD}\n" + text
        (scratch / ORTHOSIS).write_text(text, encoding="utf-8")
    return found


def _tell(document: Any, orthosis: Orthosis, by: Ratio) -> None:
    """Put the changed numbers into the text."""
    if by.shank == by.foot == 1.0:
        return
    before = str(document.get("description", "")).strip()
    document["description"] = f"{before}; refitted{f': {by.words}' if by.words else ''}".lstrip("; ")
    for name, group in orthosis.anchored.items():
        table = document["muscle"][name]
        _tell_group(table, group, by)


def _tell_group(table: Any, group: MuscleGroup, by: Ratio) -> None:
    assert group.origin is not None and group.insertion is not None and group.link_length is not None
    places: list[tuple[Any, Anchor | PathPoint]] = [
        (table["origin"], group.origin),
        (table["insertion"], group.insertion),
    ]
    places += [(table["path"][k], place) for k, place in enumerate(group.path)]
    for entry, place in places:
        if by.of(place.segment) != 1.0:
            entry["from_ankle"] = _told([_cm(x) for x in place.from_ankle], by.source(place.segment))
            surface = getattr(place, "surface", None)
            if surface is not None:
                entry["surface"]["radius"] = _told(_cm(surface.radius), by.source(place.segment))
    table["link_length"] = _told(_cm(group.link_length), link_source(by))


def _told(value: Any, source: str) -> Any:
    entry = tomlkit.inline_table()
    entry.update({"value": value, "kind": "derived", "source": source})
    return entry


def _cm(length: float) -> str:
    return f"{100.0 * length + 0.0:.12g} cm"


def _carry(document: Any, file: pathlib.Path, folder: pathlib.Path, scratch: pathlib.Path) -> None:
    """Let the text name its cuff and plate, muscles and valves from its new folder."""
    models = {
        key: str((file.parent / assets.file_beside(str(document[key]), file)).resolve())
        for key in BESIDE
        if key in document
    }
    for key, place in portable({"orthosis": models}, folder, scratch)["orthosis"].items():
        document[key] = place
    for group in document.get("muscle", {}).values():
        _refer(group, "type", "muscle", file, folder)
    for chamber in document.get("chamber", {}).values():
        for key in ("inlet", "outlet"):
            _refer(chamber, key, "valve", file, folder)


def _refer(table: Any, key: str, kind: str, file: pathlib.Path, folder: pathlib.Path) -> None:
    """A muscle or valve by its shipped name, or by its path from the new folder."""
    name = table.get(key)
    if isinstance(name, str) and name not in assets.names(kind):
        table[key] = reference(kind, str(assets.find(kind, name, file)), folder)
