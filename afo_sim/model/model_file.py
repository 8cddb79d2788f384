"""A model file of MuJoCo's, MJCF or URDF, examined before MuJoCo reads it: sizes, counts, numbers, files.

MuJoCo takes infinite numbers, reads a device without end, and makes as many copies as a file asks for. A
model may name files anywhere, as MJCF has it: MuJoCo refuses what is no model, mesh or picture, and shows
nothing of it.
"""

import math
import pathlib
import re
from collections.abc import Iterator, Mapping

from afo_sim.common import InputError, check_regular, check_text, plausible, read_bytes, read_text

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
    """Refuse a model file that MuJoCo could not take in bounded time and memory, or whose numbers are
    none."""
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
            _check_numbers(file, tag, name, value)
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


def _check_numbers(file: pathlib.Path, tag: str, name: str, value: str) -> None:
    numbers = _numbers(value)
    if name in _NAMES or not numbers or (name in _ENDLESS and math.inf in map(abs, numbers)):
        return
    field = f"<{tag}> {name}"
    plausible(numbers, file=file, field=field)
    most = _COUNTS.get(f"{tag} {name}", _COUNTS.get(name, math.inf))
    if max(numbers) > most:
        raise InputError("is too many", file=file, field=field, value=value, allowed=f"at most {most:g}")
