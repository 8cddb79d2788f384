"""Somebody's body or leg → a folder with a leg that runs here."""

import dataclasses
import os
import pathlib
import re
from collections.abc import Callable
from dataclasses import dataclass

from afo_sim.common import InputError, Notice, Shown, check_writable, si, together, write_sealed, write_text
from afo_sim.description import Side, load
from afo_sim.legs.cutting import cut, left_behind, with_sole
from afo_sim.legs.finding import Direction, Found, find
from afo_sim.legs.leg_description import leg_readme, leg_toml, person_notes, table, tissue_notes
from afo_sim.legs.leg_numbers import LegNumbers, doubtful_notes
from afo_sim.legs.mjcf_out import MESHES, write_leg_file
from afo_sim.legs.reading import read_body
from afo_sim.legs.tree import Tree
from afo_sim.legs.urdf_files import Packages

OWN = ("leg.toml", "leg.xml", "README.md", "leg.png")

SOLE_NOTE = Notice(
    "sole-derived",
    "heel, ball, pulp and tip are derived from the foot's shapes, and toe clearance in walking is that of "
    "these points: measure them on the shoe, and give the file sites of these names",
    subject="sole",
)


@dataclass(frozen=True, eq=False, repr=False)
class Imported(Shown):
    """A leg, cut out of a file and turned.

    name : of the leg
    leg : tree of the leg alone, with the sole's points
    found : where it was in the file
    numbers : masses, lengths and inertias, SI
    sole : where the sole's points come from, in words
    left_behind : {kind: names} of what the file holds beside the leg
    toes : name of the file's hinge that was kept
    notes : what is doubtful
    folder : it was written to; None where it was not
    """

    name: str
    leg: Tree
    found: Found
    numbers: LegNumbers
    sole: str
    left_behind: dict[str, tuple[str, ...]]
    toes: str | None
    notes: tuple[str, ...]
    folder: pathlib.Path | None = None

    @property
    def rows(self) -> list[tuple[str, str, str]]:
        """A table: what, how much, how it was found."""
        return table(self.leg, self.found, self.numbers, self.sole, self.toes, self.left_behind)


Picture = Callable[[Imported, pathlib.Path], None]


def import_leg(
    file: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    shank: str | None = None,
    foot: str | None = None,
    ankle: str | None = None,
    side: Side | None = None,
    zero: float | str | None = None,
    forward: Direction | None = None,
    range: tuple[float | str, float | str] | None = None,
    toes: str | None = None,
    body_mass: float | str | None = None,
    body_height: float | str | None = None,
    packages: Packages = (),
    name: str | None = None,
    force: bool = False,
    picture: Picture | None = None,
) -> Imported:
    """Cut a leg out of MJCF or URDF, and write a folder for `load("leg", …)` and a scenario's `leg`.

    Parameters
    ----------
    file : of a leg, or of a whole body
    out : the leg's folder; by default nothing is written
    shank, foot, ankle, side, forward : as in `find`
    zero : the file's coordinate of the ankle at which its angle is zero [rad], or "5 deg"
    range : stops of the ankle, dorsiflexion positive [rad], or as "20 deg"; the file's by default
    toes : the file's hinge of the toes, which is kept; all other joints are welded
    body_mass, body_height : of the person whose leg it is [kg], [m], or "75 kg", "1.75 m"
    packages : folders in which the meshes of a URDF file lie
    name : of the leg; by default the folder's
    force : replace a leg that is in the folder
    picture : draws the leg into a file

    Returns
    -------
    Imported

    Raises
    ------
    InputError
        The file cannot be read, does not have exactly one leg, the leg is impossible, or the folder is taken.

    Examples
    --------
    >>> imported = import_leg(load("leg", "adult_75kg").file, "legs/mine")
    >>> imported.found.ankle, round(imported.numbers.about_ankle, 4)  # [kg·m²]
    ('ankle', 0.0104)
    >>> run("seated", {"leg": "legs/mine", "duration": "1 s"}).ok
    True
    """
    file = pathlib.Path(file)
    folder = None if out is None else pathlib.Path(out)
    if folder is not None:
        _check_folder(folder, file, force)
    tree = read_body(file, packages)
    zero = None if zero is None else si(zero, "rad", "zero")
    body_mass = None if body_mass is None else si(body_mass, "kg", "body_mass")
    body_height = None if body_height is None else si(body_height, "m", "body_height")
    found = find(tree, shank=shank, foot=foot, ankle=ankle, side=side, zero=zero, forward=forward)
    stops = None if range is None else (si(range[0], "rad", "range"), si(range[1], "rad", "range"))
    leg, sole = with_sole(cut(tree, found, range=stops, toes=toes))
    numbers = LegNumbers.of(leg)
    notes = [*tree.notes, *found.notes, *tissue_notes(leg)]
    notes += [SOLE_NOTE] if sole.startswith("derived") else []
    notes += (*person_notes(numbers, found, body_mass, body_height), *doubtful_notes(leg, numbers))
    name = name or (folder.resolve().name if folder is not None else _plain(file.stem))
    imported = Imported(name, leg, found, numbers, sole, left_behind(tree, found), toes, tuple(notes))
    if folder is None:
        return imported
    text = leg_toml(imported.name, leg, found, file.name, body_mass, body_height)
    _write(imported, folder, text, file.name, picture)
    return dataclasses.replace(imported, folder=folder)


def default_folder(file: pathlib.Path, name: str | None, side: str | None) -> pathlib.Path:
    """Where a leg is written that no folder is given for: legs/NAME."""
    return pathlib.Path("legs") / (name or "_".join(filter(None, [_plain(file.stem), side])))


def _plain(name: str) -> str:
    return re.sub(r"[^\w.-]+", "_", name).strip("._-") or "leg"


def _check_folder(folder: pathlib.Path, file: pathlib.Path, force: bool) -> None:
    """Refuse a folder that holds a leg, or the file itself under a name that is written."""
    if folder.exists() and not folder.is_dir():
        raise InputError("is a file, and a folder is to be written", field="out", value=str(folder))
    there = [name for name in OWN if (folder / name).exists()]
    same = [name for name in there if file.exists() and (folder / name).samefile(file)]
    if same:
        problem = f"its {same[0]} is the file that is read"
        raise InputError(problem, field="out", value=str(folder), allowed="another folder")
    if there and not force:
        allowed = "another folder, or `force` to replace it"
        raise InputError(f"holds {there[0]}", field="out", value=str(folder), allowed=allowed)
    check_writable(folder)


def _write(imported: Imported, folder: pathlib.Path, text: str, source: str, picture: Picture | None) -> None:
    """Write the folder's files together, once the leg in them is one that the simulator takes."""
    from afo_sim.model.build import build  # its compiled muscles take a second

    before = [path.relative_to(folder).as_posix() for path in (folder / MESHES).glob("*") if path.is_file()]
    with together(folder, (*OWN, *before)) as scratch:
        comment = f"Cut out of {source} by afo-sim; x forward, y left, z up from the ankle joint."
        write_leg_file(imported.leg, scratch / "leg.xml", imported.name, comment)
        write_sealed(scratch / "leg.toml", text, "leg", scratch)
        build(load("scenario", "seated", {"leg": str(scratch)}))
        readme = leg_readme(imported.name, imported.rows, imported.notes, source, picture is not None)
        write_text(scratch / "README.md", readme)
        if picture is not None:
            picture(imported, scratch / "leg.png")
