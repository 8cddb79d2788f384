"""A run's export: its files, written together or not at all."""

import filecmp
import os
import pathlib
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from afo_sim.common import InputError, check_writable, nearest_name, place_of, si, together, unknown
from afo_sim.export.elsewhere.writing import ELSEWHERE, write_elsewhere
from afo_sim.export.formats import FORMATS, SHIPPED, Format, Order
from afo_sim.simulation import Recording


@dataclass(frozen=True)
class Exported:
    """What was written."""

    files: tuple[pathlib.Path, ...]  # the one asked for first
    opens: str  # how to open it
    minds: str  # what then to mind
    notes: tuple[str, ...]  # what is not as in the run, or not as was asked for


def export(
    recording: Recording | str | os.PathLike[str],
    out: str | os.PathLike[str],
    to: str | None = None,
    *,
    rate: float | str | None = None,
    columns: Iterable[str] = (),
    force: bool = False,
    sets: Mapping[str, object] | None = None,
    report: Callable[[int, int], object] = lambda done, total: None,
) -> Exported:
    """Write a run, or a scenario, for another program; `Recording.export` describes the arguments."""
    path, patterns = pathlib.Path(out), (columns,) if isinstance(columns, str) else tuple(columns)
    named = (path.suffix if to is None else to).removeprefix(".").lower()
    if named in ELSEWHERE:
        for field, value in (("rate", rate), ("columns", patterns)):
            if value:
                raise InputError(f"does not go with {named}, which has no rows", field=field, value=value)
        files, notes = write_elsewhere(recording, named, path, sets, force=force)
        return Exported(files, ELSEWHERE[named].format(name=path.name), "", notes)
    if not isinstance(recording, Recording) or sets:
        allowed = f"a run's folder; of a scenario: {', '.join(ELSEWHERE)}"
        raise InputError(f"does not go with {named}", field="scenario", value=str(recording), allowed=allowed)
    path, kind = _target(path, to)
    rate = None if rate is None else si(rate, "Hz", "rate")
    if rate is not None and not kind.rows:
        problem = f"does not go with {kind.name}, which has no rows"
        raise InputError(problem, field="rate", value=f"{rate:g} Hz")
    if patterns and not kind.chosen:
        problem = f"does not go with {kind.name}, whose content is its own"
        raise InputError(problem, field="columns", value=", ".join(patterns))
    group = [path.name, *(path.stem + ending for ending in kind.beside)]
    if path.exists() and not force:
        raise _there(path, path)
    check_writable(path.parent)
    with together(path.parent, group) as scratch, warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            order = Order(recording, rate, patterns, report, path.parent)
            notes = tuple(kind.write(order, scratch / path.name) or ())
        except Exception as error:  # which goes on, with its place
            if kind.name not in SHIPPED:  # of the user's code
                error.add_note(f"in the format {kind.name}, {place_of(error, kind.write)}")
            raise
        written = [name for name in group if (scratch / name).is_file()]
        if path.name not in written:
            raise InputError("writes another file than it is asked for", field="to", value=kind.name)
        for name in group if not force else ():  # the same metrics may stand there, as of a .sto and a .csv
            beside, new = path.with_name(name), scratch / name
            same = beside.is_file() and new.is_file() and filecmp.cmp(beside, new, shallow=False)
            if beside.exists() and not same:
                raise _there(path, beside)
    if not recording.ok and kind.rows:
        notes = (f"the run stopped early, and its rows up to there are written: {recording.status}", *notes)
    notes = (*(str(warning.message) for warning in warned), *notes)
    files = tuple(path.with_name(name) for name in written)
    return Exported(files, kind.opens.replace("{name}", path.name), kind.minds, notes)


def format_of(to: str) -> Format:
    """The format of a name."""
    if to.removeprefix(".").lower() not in FORMATS:
        raise unknown(to, {**FORMATS, **ELSEWHERE}, field="to", problem="is not a valid format")
    return FORMATS[to.removeprefix(".").lower()]


def _target(path: pathlib.Path, to: str | None) -> tuple[pathlib.Path, Format]:
    """The file to write, and its format: as requested, or by the file's ending."""
    if path.is_dir():
        problem, allowed = "is a folder", f"a file in it, such as {path / 'recording.csv'}"
        raise InputError(problem, field="out", value=str(path), allowed=allowed)
    if to is None and path.suffix.removeprefix(".").lower() not in FORMATS:
        endings = [f".{name}" for name in FORMATS]
        problem, allowed = "has no ending of a format", f"{', '.join(endings)}; or `to`"
        near = nearest_name(path.suffix, endings)
        raise InputError(problem, field="out", value=str(path), allowed=allowed, nearest=near)
    kind = format_of(path.suffix if to is None else to)
    if not path.suffix:
        path = path.with_name(f"{path.name}.{kind.name}")
    if path.suffix.lower() != f".{kind.name}":
        problem = f"is not named as {kind.name} is"
        raise InputError(problem, field="out", value=str(path), allowed=f"a name ending in .{kind.name}")
    return path, kind


def _there(path: pathlib.Path, file: pathlib.Path) -> InputError:
    problem = (
        "exists" if file == path else f"would overwrite {file.name} beside it, which holds something else"
    )
    allowed = "`force`, which replaces it, or another file with `out`"
    return InputError(problem, field="out", value=str(path), allowed=allowed)
