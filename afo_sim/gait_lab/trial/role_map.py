"""A file that says which marker sits on which landmark, written for a person to edit (TOML)."""

import pathlib
from collections.abc import Collection, Mapping, Sequence

import tomli_w

from afo_sim.common.assets import read_toml
from afo_sim.common.errors import InputError, unknown
from afo_sim.common.writing import write_text
from afo_sim.gait_lab.readers.markers import Markers
from afo_sim.gait_lab.trial.choices import SIDES
from afo_sim.gait_lab.trial.marker_sets import LANDMARKS
from afo_sim.gait_lab.trial.roles import Roles, candidates, find_roles

GROUPS = (*SIDES, "middle")
HEAD = """\
# Which marker sits on which landmark of the body.
# Only what stands here counts. Several names: their midpoint. A line that begins with # does not count.
# A leg needs: hip_centre, or both asis (with psis or sacrum), or trochanter; knee_centre, knee_lateral or
# knee_medial; ankle_centre, ankle_lateral or ankle_medial; heel; a metatarsal or toe_tip.
# Lateral and medial marker together place knee and ankle better than one of them.
"""


def read_role_map(path: pathlib.Path) -> dict[str, dict[str, tuple[str, ...]]]:
    """Read a map of roles.

    Units: path ["NAME", "NAME"].
    """
    found: dict[str, dict[str, tuple[str, ...]]] = {}
    for group, table in read_toml(path).items():
        if group not in GROUPS:
            raise unknown(group, GROUPS, file=path, field=group, problem="is an unknown table")
        if not isinstance(table, dict):
            raise InputError("is no table", file=path, field=group, value=table, allowed=f"[{group}]")
        found[group] = {}
        for landmark, value in table.items():
            field = f"{group}.{landmark}"
            if landmark not in _landmarks(group):
                problem = "is an unknown landmark"
                raise unknown(landmark, _landmarks(group), file=path, field=field, problem=problem)
            names = [value] if isinstance(value, str) else value
            if not isinstance(names, list) or not names or not all(isinstance(n, str) for n in names):
                allowed = '"NAME" or ["NAME", "NAME"]'
                raise InputError("is no marker", file=path, field=field, value=value, allowed=allowed)
            found[group][landmark] = tuple(names)
    return found


def mapped_roles(path: pathlib.Path, markers: Markers, others: Collection[str] = ()) -> Roles:
    """The landmarks of a map; names are not guessed."""
    sides: dict[str, dict[str, tuple[str, ...]]] = {side: {} for side in SIDES}
    for group, landmarks in read_role_map(path).items():
        for landmark, chosen in landmarks.items():
            for name in chosen:
                if name not in markers.positions and name not in others:
                    field, problem = f"{group}.{landmark}", f"there is no such marker in {markers.file}"
                    raise unknown(name, markers.positions, file=path, field=field, problem=problem)
            if all(name in markers.positions for name in chosen):
                for side in SIDES if group == "middle" else (group,):
                    sides[side][landmark] = chosen
    return Roles(sides, (f"markers as {path.name} says",))


def write_role_map(path: pathlib.Path, markers: Markers, roles: Roles | None = None) -> None:
    """Write a map of roles, whole or not at all: what is known, and names that look like what is missing.

    Parameters
    ----------
    path : to be written
    markers : of the trial
    roles : what is known; by default what the names tell

    Raises
    ------
    InputError
        The place cannot be written to.
    """
    roles = find_roles(markers) if roles is None else roles
    used = {name for side in roles.sides.values() for names in side.values() for name in names}
    free = [name for name in markers.positions if name not in used]
    lines = [HEAD, f"# The markers of {markers.file.name}:", *_wrapped(list(markers.positions))]
    for group in GROUPS:
        known = roles.sides[SIDES[0] if group == "middle" else group]
        lines += ["", f"[{group}]", *(_line(group, landmark, known, free) for landmark in _landmarks(group))]
    write_text(path, "\n".join(lines) + "\n")


def _line(group: str, landmark: str, known: Mapping[str, tuple[str, ...]], free: Sequence[str]) -> str:
    place = LANDMARKS[landmark][1]
    if landmark in known:
        return f"{landmark} = [{', '.join(map(_quoted, known[landmark]))}]  # {place}"
    near = candidates(free, "" if group == "middle" else group, [landmark])
    hint = f"; perhaps {', '.join(map(_quoted, near))}" if near else ""
    return f'# {landmark} = ["NAME"]  # {place}{hint}'


def _landmarks(group: str) -> list[str]:
    return [name for name in LANDMARKS if (name == "sacrum") == (group == "middle")]


def _quoted(name: str) -> str:
    return tomli_w.dumps({"x": name}).removeprefix("x = ").strip()


def _wrapped(names: Sequence[str]) -> list[str]:
    lines = ["#"]
    for name in map(_quoted, names):
        if len(lines[-1]) + len(name) > 100:
            lines.append("#")
        lines[-1] += f" {name}"
    return lines
