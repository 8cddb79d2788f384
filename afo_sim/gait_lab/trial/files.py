"""The files of one walking trial, recognised by what they hold."""

import pathlib
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from afo_sim.common import InputError, Notice, read_bytes
from afo_sim.gait_lab.noted import Noted, note
from afo_sim.gait_lab.readers.csv_trial import read_csv_trial
from afo_sim.gait_lab.readers.d_flow import read_d_flow
from afo_sim.gait_lab.readers.markers import Markers
from afo_sim.gait_lab.readers.opensim_table import OpenSimTable, read_opensim_table
from afo_sim.gait_lab.readers.plates import Plate, plates_of
from afo_sim.gait_lab.readers.qualisys import read_qualisys
from afo_sim.gait_lab.readers.stated import Stated
from afo_sim.gait_lab.readers.trc import read_trc
from afo_sim.gait_lab.readers.vicon import read_vicon
from afo_sim.gait_lab.trial.opencap import of_session

_STILL = 0.05  # way of a middle marker in a trial in which a person stands [m]; a step is ten times as long
_JOINTS = ("ankle_angle_", "knee_angle_")

_SUFFIXES = ".mot, .sto, .trc, .c3d, .csv, .osim"
_READ_AS = {".mot": "table", ".sto": "table", ".trc": "trc", ".c3d": "c3d", ".csv": "csv", ".osim": "model"}
_OTHERWISE = (
    f"{_SUFFIXES}; exports of Vicon Nexus, Qualisys or D-Flow; else C3D, TRC and MOT, or a CSV with units"
)
_WITH_COLUMNS = {"csv": read_csv_trial, "vicon": read_vicon, "qualisys": read_qualisys, "d-flow": read_d_flow}


@dataclass(frozen=True, eq=False)
class WalkingTrial(Noted):
    """Tables in the files of one walking trial."""

    files: tuple[pathlib.Path, ...]
    plates: tuple[Plate, ...]
    markers: Markers | None = None
    angles: OpenSimTable | None = None  # inverse kinematics
    bodies: OpenSimTable | None = None  # positions of bodies
    moments: OpenSimTable | None = None  # inverse dynamics
    model: pathlib.Path | None = None  # of OpenSim, if one stands among the files
    standing: Markers | None = None  # a second file of markers, in which nobody walks
    stated: Stated = field(default_factory=Stated)  # by the laboratory itself
    notices: tuple[Notice, ...] = ()  # of all files, each after its file's name


@dataclass(eq=False)
class _Content:
    """What one file holds."""

    file: pathlib.Path
    markers: Markers | None = None
    tables: dict[str, OpenSimTable] = field(default_factory=dict)  # by field of WalkingTrial
    plates: tuple[Plate, ...] = ()
    model: bool = False
    notices: tuple[Notice, ...] = ()
    stated: Stated | None = None
    one_plate: bool = False  # and each further plate in a file of its own


def read_trial(files: Sequence[pathlib.Path]) -> WalkingTrial:
    """Read the files of one trial, in any order, or a session's folder."""
    files, person = of_session(files)
    contents: list[_Content] = []
    problems: list[InputError] = []
    for file in files:
        try:
            contents.append(_content(file))
        except InputError as error:
            problems.append(error)
    walking, standing, more = _walking_and_standing(contents)
    problems += more
    tables, more = _tables(contents)
    problems += more
    plates, unused, more = _plates(contents, standing)
    problems += more
    models, one = [content.file for content in contents if content.model], "the model of one person"
    problems += [InputError("is a second model", file=file, allowed=one) for file in models[1:]]
    if problems:
        problems[0].others = (*problems[0].others, *problems[1:])
        raise problems[0]
    told = {c: (*c.notices, *(notice for plate in c.plates for notice in plate.notices)) for c in contents}
    return WalkingTrial(
        files=tuple(files),
        plates=plates,
        markers=walking.markers if walking else None,
        angles=tables.get("angles"),
        bodies=tables.get("bodies"),
        moments=tables.get("moments"),
        model=models[0] if models else None,
        standing=standing.markers if standing else None,
        stated=next((c.stated for c in contents if c is not standing and c.stated), person),
        notices=(*(notice.after(f"{c.file.name}: ") for c, own in told.items() for notice in own), *unused),
    )


def _content(file: pathlib.Path) -> _Content:
    kind = _kind_of(file)
    if kind == "model":
        return _Content(file, model=True)
    if kind == "setup":
        text = "is an OpenSim setup file and not needed: which foot is on which plate is found by the forces"
        return _Content(file, notices=(note("setup-unused", text),))
    if kind == "c3d":
        from afo_sim.gait_lab.readers.c3d import read_c3d

        markers, plates = read_c3d(file)
        seen = markers if markers.positions else None
        return _Content(file, seen, {}, tuple(plates), notices=markers.notices, stated=markers.stated)
    if kind == "trc":
        markers = read_trc(file)
        return _Content(file, markers, notices=markers.notices)
    if kind in _WITH_COLUMNS:
        trial = _WITH_COLUMNS[kind](file)
        parts: list[OpenSimTable | Markers] = [*trial.tables]
        parts += [trial.markers] if trial.markers else []
        tables = {name: table for table in trial.tables for name in _kinds(table)}
        notices = (*trial.notices, *(notice for part in parts for notice in part.notices))
        one = kind == "qualisys"
        return _Content(file, trial.markers, tables, trial.plates, notices=notices, one_plate=one)
    table = read_opensim_table(file)
    found = tuple(plates_of(table))
    kinds = _kinds(table)
    if not found and not kinds:
        problem = "holds neither joint angles, joint moments, body positions nor ground forces"
        allowed = "columns such as ankle_angle_r, ankle_angle_r_moment, talus_r_X, ground_force_vx; "
        allowed += f"it has {', '.join(list(table.columns)[:8])}"
        raise InputError(problem, file=table.file, allowed=allowed)
    return _Content(file, None, dict.fromkeys(kinds, table), found, notices=table.notices)


def _kinds(table: OpenSimTable) -> list[str]:
    names = list(table.columns)
    moments = [name for name in names if name.startswith(_JOINTS) and name.endswith("_moment")]
    angles = [name for name in names if name.startswith(_JOINTS) and not name.endswith(("_moment", "_force"))]
    bodies = [name for name in names if name.startswith("talus_")]
    kinds = {"moments": moments, "bodies": bodies, "angles": [] if moments else angles}
    return [kind for kind, found in kinds.items() if found]


def _walking_and_standing(
    contents: Sequence[_Content],
) -> tuple[_Content | None, _Content | None, list[InputError]]:
    """The file with the walker's markers, a standing trial, and surplus files."""
    marked = [content for content in contents if content.markers is not None]
    if len(marked) < 2:
        return (marked[0] if marked else None), None, []
    still = [content for content in marked if _stands_still(content.markers)]
    moving = [content for content in marked if content not in still]
    walking, standing = (moving or still)[0], still[0] if moving and still else None
    many = [content for content in marked if content not in (walking, standing)]
    allowed = "the files of one trial, and a standing trial with the same markers"
    problem = "is a second file with markers"
    return walking, standing, [InputError(problem, file=c.file, allowed=allowed) for c in many]


def _stands_still(markers: Markers | None) -> bool:
    if markers is None or not markers.positions:
        return False
    ways = []
    for points in markers.positions.values():
        known = points[np.isfinite(points).all(axis=1)]
        if len(known):
            low, high = np.quantile(known, [0.05, 0.95], axis=0)
            ways.append(float(np.linalg.norm(high - low)))
    return bool(ways) and float(np.median(ways)) < _STILL


def _tables(contents: Sequence[_Content]) -> tuple[dict[str, OpenSimTable], list[InputError]]:
    found: dict[str, OpenSimTable] = {}
    problems = []
    for content in contents:
        for kind, table in content.tables.items():
            if kind in found:
                problem = f"is a second file with {kind}"
                problems.append(InputError(problem, file=content.file, allowed="the files of one trial"))
            found.setdefault(kind, table)
    return found, problems


def _plates(
    contents: Sequence[_Content], standing: _Content | None
) -> tuple[tuple[Plate, ...], list[Notice], list[InputError]]:
    """The plates of the file that has them; a copy beside joint angles counts if there is no other."""
    holders = [content for content in contents if content.plates and content is not standing]
    copies = [content for content in holders if "angles" in content.tables]
    first = [content for content in holders if content not in copies] or copies
    text = "{subject}: its ground forces are not used, since {other} has them"
    unused = [
        note("plates-unused", text, subject=content.file.name, other=first[0].file.name)
        for content in copies
        if content is not first[0]
    ]
    if standing and standing.plates and not first:
        text = "the plates of {subject} were left out: nobody walks in that trial"
        unused.append(Notice("plate-left-out", text, subject=standing.file.name))
    taken = list(first[0].plates) if first else []
    problems = []
    for content in first[1:]:
        doubled = {plate.name for plate in content.plates} & {plate.name for plate in taken}
        if doubled or not (content.one_plate and first[0].one_plate):
            problem = "is a second file with force plates"
            problems.append(InputError(problem, file=content.file, allowed="the files of one trial"))
        else:
            taken += content.plates
    return tuple(taken), unused, problems


def _kind_of(file: pathlib.Path) -> str:
    """What a file is, by its first lines, and by its name if they do not show it."""
    if file.is_dir():
        raise InputError("is a folder", file=file, allowed=f"the files of one trial: {_SUFFIXES}")
    if file.suffix.lower() == ".b3d":
        instead = "AddBiomechanics' OpenSim results: IK/NAME_ik.mot, ID/NAME_grf.mot, Models/final.osim"
        raise InputError("is read by nimblephysics alone", file=file, allowed=instead)
    by_name = _READ_AS.get(file.suffix.lower(), "")
    head = read_bytes(file)[:20_000]
    if head[1:2] == b"\x50" and by_name in ("c3d", "") and not head.startswith(b"\x89PNG"):
        return "c3d"
    text = head.replace(b"\0", b"").decode("latin-1").lower()
    if "<opensimdocument" in text or text.lstrip("ï»¿ \r\n\t").startswith("<?xml"):
        return "model" if re.search(r"<model[ >]", text) else by_name or "setup"
    if re.search(r"^[ \t;,]*endheader", text, re.MULTILINE):
        return "table"
    if re.search(r'^"?frame"?\s*[,;\t]\s*"?sub ?frame', text, re.MULTILINE):
        return "vicon"
    if re.match(r"[^\n\t]*no_of_(frames|samples)\t", text):
        return "qualisys"
    if re.search(r"^[^\n]*\btimestamp\t[^\n]*\.(pos|for)x\b", text, re.MULTILINE):
        return "d-flow"
    if re.match(r"[^\n]*pathfiletype", text) or re.search(r"^ *frame ?#?\s+time\s", text, re.MULTILINE):
        return "trc"
    if by_name:
        return by_name
    if re.search(r"^[^#\n]*\btime ?[\[(]", text, re.MULTILINE):
        return "csv"
    raise InputError("is not a supported file type", file=file, allowed=_OTHERWISE)
