"""Refusals to write over another run, or into a folder of another kind of output, or of another process."""

import json
import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from afo_sim.common import InputError, JsonDict, JsonMapping
from afo_sim.simulation import occupy

# A file by which a folder is known, and what the folder then is.
KNOWN_BY = {
    "sweep.json": "sweep",
    "search.json": "search",
    "both.json": "run of both legs",
    "walk.json": "responding walk",
    "differences.csv": "comparison of laws",
    "bode.json": "frequency response",
    "size.json": "sizing",
    "credibility.json": "credibility assessment",
    "electronics.json": "export for a board",
    "fit_run.json": "fit to a log",
    "fit_torque.json": "fit to static torques",
    "fit.json": "fit of a muscle's law",
    "recording.parquet": "run",
}
_OTHER = "another folder with --out"


def check_folder(folder: Path, kind: str = "") -> None:
    """Refuse a folder that cannot be written to, or holds another kind of output than `kind`."""
    _check_kind(folder, kind)
    take(folder)


def _check_kind(folder: Path, kind: str) -> None:
    for file, found in KNOWN_BY.items():
        if (folder / file).is_file():
            if found != kind:
                problem = f"holds a {found} ({file})"
                raise InputError(problem, field="out", value=str(folder), allowed=_OTHER)
            return


@contextmanager
def telling(folder: Path) -> Iterator[None]:
    """Print which files of an older run are gone, since they would stand beside new numbers."""
    before = [*folder.rglob("[!.]*")]
    yield
    if gone := sorted(str(file.relative_to(folder)) for file in before if not file.exists()):
        print(f"removed from {folder}, as they show the run before: {', '.join(gone)}")


def check_files(files: Iterable[Path], *, force: bool) -> None:
    """Refuse to overwrite files without --force."""
    for file in files:
        if file.exists() and not force:
            allowed = "--force, which replaces it, or another name"
            raise InputError("is there already", field="out", value=str(file), allowed=allowed)


def check_run_folder(folder: Path, scenario: JsonMapping, *, force: bool = False) -> None:
    """Refuse a folder that cannot be written to, or holds the run of another description."""
    before = _other(folder, "run", "recording.parquet", "summary.json", {"scenario": scenario}, force=force)
    if before is not None:
        found = before.get("scenario")
        name = found.get("name") if isinstance(found, dict) else None
        what = f"the run of another scenario, {name!r}" if name not in (None, scenario["name"]) else ""
        what = what or f"a run of {scenario['name']!r} with other values"
        raise _refused(folder, f"holds {what}", "it")
    take(folder, scenario)


def check_same(
    folder: Path, kind: str, file: str, now: JsonMapping, problem: str, *, force: bool, whom: str = "it"
) -> None:
    """Refuse a folder whose JSON `file` has other values than `now`; the problem has those in braces."""
    before = _other(folder, kind, file, file, now, force=force)
    if before is not None:
        raise _refused(folder, problem.format(**(dict.fromkeys(now) | before)), whom)
    take(folder, now)


def take(folder: Path, now: JsonMapping | None = None) -> None:
    """Take a folder for this command and what it is about; say whether it goes on."""
    # less the words that change no result
    words = re.sub(r"--force\n|--threads[\n=]\d+\n", "", "\n".join([*sys.argv[1:], ""]))
    if said := occupy(folder, (re.split("[\n=]", words), now)):
        print(f"afo-sim: {folder}: {said}", file=sys.stderr)


def _other(
    folder: Path, kind: str, there: str, file: str, now: JsonMapping, *, force: bool
) -> JsonDict | None:
    """What a folder has instead of `now`, as far as it can be read; None where nothing is in the way."""
    from afo_sim.common import as_stored, read_json, settle

    _check_kind(folder, kind)
    settle(folder)
    if force or not (folder / there).is_file():
        return None
    try:
        table = read_json(folder / file)
        before = {key: table[key] for key in now}
    except (InputError, OSError, ValueError, KeyError, TypeError):
        return {}
    asked = as_stored(json.loads(json.dumps(now)), folder)
    return None if as_stored(before, folder) == asked else before


def _refused(folder: Path, problem: str, whom: str) -> InputError:
    allowed = f"--force, which replaces {whom}, or {_OTHER}"
    return InputError(problem, field="out", value=str(folder), allowed=allowed)
