"""A scenario as a file that may move with its folder: its paths, and its text in TOML."""

import copy
import pathlib
import re
import shutil
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping

import tomli_w

from afo_sim.common import Given, JsonDict, JsonMapping, assets
from afo_sim.description.tree import SCENARIO_FILES

_QUANTITY = re.compile(r"^-?\d+\.\d+(?:e[+-]?\d+)?(?= \S+$)")  # the number before a unit
FILES = "files"  # folder of what is copied
_ASSETS = {"mesh": ("meshdir", "assetdir"), "hfield": ("assetdir",), "texture": ("texturedir", "assetdir")}


def portable(scenario: JsonMapping, folder: pathlib.Path, scratch: pathlib.Path | None = None) -> JsonDict:
    """The same scenario with paths that hold wherever its folder goes."""
    found = copy.deepcopy(dict(scenario))
    for table, key in SCENARIO_FILES:
        holder = found.get(table)
        if isinstance(holder, dict) and holder.get(key) and pathlib.Path(holder[key]).is_file():
            holder[key] = _placed(
                pathlib.Path(holder[key]).resolve(), folder.resolve(), scratch or folder, f"{table}_{key}"
            )
    return found


def as_found(scenario: JsonMapping, folder: pathlib.Path) -> JsonDict:
    """A scenario that was written into a folder's files by way of `as_stored`, with whole paths again."""
    found = copy.deepcopy(dict(scenario))
    for table, key in SCENARIO_FILES:
        holder = found.get(table)
        if isinstance(holder, dict) and isinstance(holder.get(key), str):
            holder[key] = assets.file_beside(holder[key], folder / "scenario")
    return found


def _placed(file: pathlib.Path, folder: pathlib.Path, scratch: pathlib.Path, name: str) -> str:
    """The text that refers to a file; copies a file that is not shipped."""
    if shipped := assets.shipped_name(file):
        return shipped
    if file.is_relative_to(folder):
        return file.relative_to(folder).as_posix()
    parts = _parts(file)
    if parts is None:
        return str(file)
    for part in parts:
        copied = scratch / FILES / name / part.relative_to(file.parent)
        copied.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(part, copied)
    return f"{FILES}/{name}/{file.name}"


def _parts(file: pathlib.Path, above: tuple[pathlib.Path, ...] = ()) -> list[pathlib.Path] | None:
    """A file and what it needs, if all of it lies in the file's folder; None where it does not."""
    found = [file]
    if file.suffix.lower() not in (".xml", ".mjcf", ".urdf") or file in above:
        return found
    root = ElementTree.parse(file).getroot()
    compiler = {k: v for node in root.iter("compiler") for k, v in node.attrib.items()}
    for node in root.iter():
        named = node.get("file") or node.get("filename")
        if not named:
            continue
        place = next((compiler[d] for d in _ASSETS.get(node.tag, ()) if d in compiler), "")
        part = (file.parent / place / named).resolve()
        if not part.is_file() or not part.is_relative_to(file.parent):
            return None
        more = _parts(part, (*above, file)) if node.tag == "include" else [part]
        if more is None:
            return None
        found += more
    return found


def toml_text(table: JsonMapping, *, exact: bool = True) -> str:
    """A description as TOML; without what conversions leave behind the twelfth digit, unless `exact`."""
    return tomli_w.dumps(_plain(table, exact))


def _plain(node: Given, exact: bool) -> Given:
    """A table, also in a list, without None, with the sources beside their values."""
    if isinstance(node, list | tuple):
        return [_plain(item, exact) for item in node]
    if not isinstance(node, Mapping):
        if exact or not isinstance(node, float | str):
            return node
        if isinstance(node, float):
            return float(f"{node:.12g}")
        return _QUANTITY.sub(lambda found: repr(float(f"{float(found[0]):.12g}")), node)
    sources = node.get("provenance", {})
    found = {k: _plain(value, exact) for k, value in node.items() if value is not None and k != "provenance"}
    return {k: {"value": value, **sources[k]} if k in sources else value for k, value in found.items()}
