"""Folders of the products, models/ and gait_data/, in a checkout or in an installed wheel."""

import base64
import copy
import functools
import hashlib
import importlib.metadata
import os
import pathlib
import re
import tomllib
import warnings

from afo_sim.common.errors import InputError, nearest_name
from afo_sim.common.open_types import Json, JsonDict
from afo_sim.common.reading import LARGEST_DESCRIPTION, read_text
from afo_sim.common.sealing import check_text

KINDS = {
    "scenario": "scenarios", "leg": "legs", "orthosis": "orthoses", "muscle": "muscles", "valve": "valves",
    "tube": "tubes", "source": "sources", "regulator": "regulators", "patient": "patients", "shoe": "shoes",
    "limits": "limits", "sensor": "sensors", "sweep": "sweeps", "search": "searches",
    "uncertainty": "uncertainties", "walker": "walkers", "population": "populations",
}  # fmt: skip
LISTS = (*KINDS.values(), "laws", "frictions", "gaits", "metrics")  # of what is shipped
FOLDERS = ("models", "gait_data")
# kinds whose products are single files, not folders
FLAT = ("scenario", "sweep", "search", "uncertainty", "walker", "population")
OWN: dict[tuple[str, str], JsonDict] = {}  # by kind and name: tables of parts that a user has added
_MOST_LEVELS = 32  # of tables and lists in each other
_KEY_PART = r"""(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+"""
_LONG_KEY = re.compile(rf"(?<![\w\\-])(?:{_KEY_PART}){{{_MOST_LEVELS}}}")  # read in the cube of its length


@functools.cache
def folder(name: str) -> pathlib.Path:
    """The folder `models` or `gait_data`: beside the package in a checkout, inside it in a wheel."""
    package = pathlib.Path(__file__).resolve().parents[1]
    for candidate in (package / name, package.parent / name):
        if candidate.is_dir():
            return candidate
    raise InputError("the installation lacks this folder", file=package / name)


def names(kind: str) -> list[str]:
    """The products of a kind ("scenario", "leg", …, of KINDS): the shipped ones, then those of `OWN`."""
    root = folder("models") / KINDS[kind]
    if kind in FLAT:
        return sorted(path.stem for path in root.glob("*.toml"))
    own = [name for of, name in OWN if of == kind]
    return sorted(path.parent.name for path in root.glob(f"*/{kind}.toml")) + own


def find(kind: str, name: str, beside: pathlib.Path | None = None) -> pathlib.Path:
    """The description file that a name or a path means."""
    known = names(kind)
    if (kind, name) in OWN:
        raise InputError("was registered, and has no file", field=kind, value=name, allowed="one with a file")
    if name in known:
        root = folder("models") / KINDS[kind]
        path = root / f"{name}.toml" if kind in FLAT else root / name / f"{kind}.toml"
        for file in [path] if kind in FLAT else sorted(path.parent.iterdir()):
            _warn_of_change(file)
        return path
    bases = [beside.parent] if beside is not None else []
    for base in (*bases, pathlib.Path()):
        path = base / name
        if path.is_dir():
            path = path / f"{kind}.toml"
        if path.is_file():
            return path
    raise InputError(
        f"there {'are' if kind == 'limits' else 'is'} no such {kind}",
        file=beside,
        field=kind,
        value=name,
        allowed=f"a path to a TOML file, or one of: {', '.join(known)}",
        nearest=nearest_name(name, known),
    )


def template(kind: str, *, whole: bool = True) -> pathlib.Path:
    """The commented file that a new product of a kind starts from, with every option or the main ones."""
    path = folder("models") / "templates" / ("" if whole else "short") / f"{kind}.toml"
    _warn_of_change(path)
    return path


@functools.cache  # each file is checked once
def _warn_of_change(file: pathlib.Path) -> None:
    """Warn of a file that is not as the installed wheel brought it; a checkout's files are its owner's."""
    shipped = _shipped().get(file.relative_to(folder("models").parent.parent).as_posix())
    if shipped is not None:
        found = base64.urlsafe_b64encode(hashlib.sha256(file.read_bytes()).digest()).rstrip(b"=").decode()
        if found != shipped:
            warnings.warn(f"{file}: has changed since it was shipped", stacklevel=3)


@functools.cache
def _shipped() -> dict[str, str]:
    """SHA-256 of every file that the installed wheel brought, by its path, as the wheel's RECORD has it."""
    try:
        files = importlib.metadata.files("afo-sim") or ()
    except importlib.metadata.PackageNotFoundError:
        return {}
    return {path.as_posix(): path.hash.value for path in files if path.hash and path.hash.mode == "sha256"}


def file_beside(name: str, beside: pathlib.Path) -> str:
    """The whole path of a file that lies beside another, or is shipped as `models/…`; else the name."""
    root, _, rest = name.partition("/")
    shipped = [folder(root) / rest] if root in FOLDERS and rest else []
    for path in (beside.parent / name, *shipped):
        if path.is_file():
            return str(path.resolve())
    return name


def shipped_name(file: pathlib.Path) -> str:
    """A file of this installation by the name that every one has, `models/…`; "" of any other."""
    for root in FOLDERS:
        if file.is_relative_to(shipped := folder(root).resolve()):
            return f"{root}/{file.relative_to(shipped).as_posix()}"
    return ""


def as_stored(data: Json, place: pathlib.Path) -> Json:
    """Plain data to be written into a folder: it names files as seen from there."""
    if isinstance(data, dict):
        return {key: as_stored(value, place) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [as_stored(item, place) for item in data]
    if not (isinstance(data, str) and os.path.isabs(data) and pathlib.Path(data).is_file()):  # noqa: PTH117
        return data
    try:
        seen = os.path.relpath(pathlib.Path(data).resolve(), place.resolve())
    except ValueError:  # on another drive of Windows
        seen = pathlib.Path(data).name
    return shipped_name(pathlib.Path(data).resolve()) or pathlib.Path(seen).as_posix()


def gait_names() -> list[str]:
    """The shipped gait files: cycles, and what to compare them with."""
    return sorted(path.stem for path in folder("gait_data").glob("*.csv"))


def find_gait(name: str) -> pathlib.Path:
    """The gait file that a shipped name or a path means."""
    if pathlib.Path(name).name == name and (own := folder("gait_data") / f"{name}.csv").is_file():
        _warn_of_change(own)
        return own
    if (path := pathlib.Path(name)).is_file():
        return path
    shipped = gait_names()
    allowed = f"a path to a CSV file, or one of: {', '.join(shipped)}"
    problem = "there is no such gait"
    raise InputError(problem, field="gait", value=name, allowed=allowed, nearest=nearest_name(name, shipped))


def checks_of(scenario: str) -> pathlib.Path:
    """The checks file that a shipped scenario carries."""
    path = folder("models") / "checks" / f"{scenario}.toml"
    if not path.is_file():
        allowed = "a checks file, named on the command line"
        raise InputError("this scenario carries no checks", field="checks", value=scenario, allowed=allowed)
    return path


def read_toml(path: pathlib.Path) -> JsonDict:
    """A TOML file as a dict; what is wrong with it as an `InputError`."""
    text = read_text(path, LARGEST_DESCRIPTION)
    try:
        return copy.deepcopy(_parsed(check_text(text, path)))
    except ValueError as error:
        raise InputError(f"is not valid TOML: {error}", file=path) from None


def parse_toml(text: str) -> JsonDict:
    """A TOML text as a dict."""
    try:
        table = None if _LONG_KEY.search(text) else tomllib.loads(text)
    except RecursionError:
        table = None
    if table is None or _is_deep(table):
        raise ValueError("it is nested too deeply")
    return table


_parsed = functools.lru_cache(maxsize=32)(parse_toml)  # runs read the same texts again


def _is_deep(value: Json, levels: int = _MOST_LEVELS) -> bool:
    parts = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return levels < 0 or any(_is_deep(part, levels - 1) for part in parts)
