"""A design that is being tried: a scenario, the values laid over it, its variants, and the way back."""

import atexit
import dataclasses
import os
import pathlib
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from afo_sim.common import (
    InputError,
    check_text,
    disk,
    read_text,
    settle,
    together,
    unknown,
    without_digests,
    write_sealed,
)
from afo_sim.description import Scenario, load, toml_text
from afo_sim.description.keys import Key, keys
from afo_sim.description.portable import FILES, portable
from afo_sim.model import mean_length, two_strides, with_person
from afo_sim.model.build import build

VARIANTS = ("A", "B", "C")
SCENARIO, _VARIANT = "scenario.toml", "variant_{}.toml"  # in a saved folder
_MARK = "# saved by afo-sim studio"  # first line of what may be replaced
_NAMED, _LONGEST = "# variant ", 40  # second line of a variant, and letters of its name
_STEPS = 500  # of the way back that are kept


@dataclass(frozen=True)
class Design:
    """A scenario by its name or file, and the values laid over it, as `--set` takes them."""

    base: str
    sets: Mapping[str, object] = field(default_factory=dict)

    @cached_property
    def scenario(self) -> Scenario:
        """The description that is simulated; in words it begins with all that was set."""
        own = {key: self.sets[key] for key in ("description",) if key in self.sets}
        found: Scenario = load("scenario", self.base, {**own, **self.sets})
        return found

    @cached_property
    def keys(self) -> dict[str, Key]:
        """All keys that can be set, with the values of this design; mass and height are those in use."""
        found = {key.key: key for key in keys(self.base, sets=dict(self.sets))}
        patient = with_person(self.scenario).patient
        assert patient is not None  # all of them walk
        for part in ("body_mass", "body_height"):
            key = found[f"patient.{part}"]
            if not key.value:
                told, origin = f"{getattr(patient, part):g} {key.unit}", patient.provenance[part]
                told_by = {"kind": origin.kind, "reference": origin.source}
                found[key.key] = dataclasses.replace(key, value=told, **told_by)
        return found

    def changed(self, sets: Mapping[str, object], *, follow: bool = True) -> "Design":
        """The same design with other values, None for those taken back; links `follow` moved anchors."""
        values = {key: value for key, value in {**self.sets, **sets}.items() if value is not None}
        moved = {key.split(".")[2] for key in sets if ".from_joint[" in key}
        design = dataclasses.replace(self, sets=values)
        if follow and moved:
            before, after = self.scenario.orthosis.muscle, design.scenario.orthosis.muscle
            for name in moved:
                link = before[name].link_length
                if link is not None:
                    longer = mean_length(after[name]) - mean_length(before[name])
                    values[f"orthosis.muscle.{name}.link_length"] = f"{1e3 * (link + longer):.6g} mm"
            design = dataclasses.replace(self, sets=values)
        _ = design.scenario
        return design


@dataclass(frozen=True)
class Variant:
    """A design that is kept under a name of the user's own."""

    name: str
    design: Design


@dataclass
class Document:
    """What the pages of a studio show and change together; variants by their slots, of `VARIANTS`."""

    design: Design
    variants: dict[str, Variant] = field(default_factory=dict)
    _back: list[Design] = field(default_factory=list)
    _forth: list[Design] = field(default_factory=list)

    def change(self, sets: Mapping[str, object], *, follow: bool = True, join: bool = False) -> None:
        """Lay values over the design; `join` makes it one step back with the change before it."""
        self.take(self.design.changed(sets, follow=follow), join=join)

    def take(self, design: Design, *, join: bool = False) -> None:
        """Go on with another design; with the very same one nothing happens."""
        if design == self.design:
            return
        if not (join and self._back):
            self._back = [*self._back, self.design][-_STEPS:]
        for described in ("scenario", "keys"):  # again, if it is gone back to
            vars(self.design).pop(described, None)
        self._forth.clear()
        self.design = design

    def undo(self) -> None:
        """One step back; none where there is none."""
        if self._back:
            self._forth.append(self.design)
            self.design = self._back.pop()

    def redo(self) -> None:
        """The step again that was taken back."""
        if self._forth:
            self._back.append(self.design)
            self.design = self._forth.pop()

    @property
    def steps(self) -> tuple[int, int]:
        """How many steps go back and forth."""
        return len(self._back), len(self._forth)

    def keep(self) -> None:
        """Keep the design as a variant, in the first slot that is free."""
        free = [slot for slot in VARIANTS if slot not in self.variants]
        if not free:
            raise InputError(f"{len(VARIANTS)} variants are kept: remove one first", field="variant")
        self.variants[free[0]] = Variant(free[0], self.design)
        self.variants = dict(sorted(self.variants.items()))

    def rename(self, slot: str, name: str) -> None:
        """Give a variant a name of one line; its letter where nothing of the name can be read."""
        name, own = _plain(name) or slot, self._kept(slot)
        others = {kept.name for kept in self.variants.values() if kept is not own}
        if name in others | set(VARIANTS) - {slot}:
            raise InputError("is the name of another variant", field="name", value=name)
        self.variants[slot] = Variant(name, own.design)

    def remove(self, slot: str) -> None:
        """Keep a variant no longer."""
        self._kept(slot)
        del self.variants[slot]

    def show(self, slot: str) -> None:
        """Go on with a variant that is kept."""
        self.take(self._kept(slot).design)

    def _kept(self, slot: str) -> Variant:
        if slot not in self.variants:
            raise unknown(slot, self.variants, field="variant", problem="is not kept")
        return self.variants[slot]


def _plain(name: str) -> str:
    """A name as one short line without signs that steer a text."""
    return " ".join("".join(c if c.isprintable() else " " for c in name).split())[:_LONGEST].strip()


def save(document: Document, folder: str | os.PathLike[str]) -> pathlib.Path:
    """Write the design and its variants as scenarios that `afo-sim run` takes, all or none."""
    target, kept = pathlib.Path(folder), document.variants
    with disk(target, "a new or saved folder"):
        before = target / SCENARIO
        saved = before.is_file() and without_digests(read_text(before)).startswith(_MARK)
        if target.exists() and not saved and any(target.iterdir()):  # someone's own work
            allowed = "a new or saved folder"
            raise InputError(
                "holds files of something else", field="folder", value=str(target), allowed=allowed
            )
        named = {SCENARIO: ("", document.design)} | {
            _VARIANT.format(slot): (f"{_NAMED}{one.name}\n", one.design) for slot, one in kept.items()
        }
        with together(target, (SCENARIO, *map(_VARIANT.format, VARIANTS))) as scratch:
            for name, (line, design) in named.items():
                table = portable(design.scenario.resolved(), target, scratch)
                write_sealed(scratch / name, f"{_MARK}\n{line}{toml_text(table)}", "scenario", scratch)
    return target / SCENARIO


def session_folder() -> pathlib.Path:
    """A new folder for files of this session, which goes when the program ends."""
    folder = pathlib.Path(tempfile.mkdtemp(prefix="afo-sim-studio-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def opened(source: str) -> Document:
    """The document of a shipped scenario, a TOML file or a saved folder; none with a damaged variant."""
    saved, folder, base = pathlib.Path(source), pathlib.Path(source), source
    if (saved / SCENARIO).is_file():
        settle(saved)
        # a copy for this session: what is saved over a folder must not change what is gone back to
        folder = session_folder()
        base = str(folder / SCENARIO)
        for part in (SCENARIO, *map(_VARIANT.format, VARIANTS)):
            if (saved / part).is_file():
                load("scenario", str(saved / part))  # or the refusal, which names the file
                shutil.copyfile(saved / part, folder / part)
        if (saved / FILES).is_dir():
            shutil.copytree(saved / FILES, folder / FILES)
    document = Document(Design(base))
    if not document.design.scenario.walking:
        problem = "does not walk, and the studio shows a walk: use `afo-sim run` and `afo-sim report`"
        raise InputError(problem, field="scenario", value=source, allowed="such as walk-dropfoot-afo")
    build(two_strides(document.design.scenario))  # or the refusal of what cannot be simulated
    for slot in VARIANTS:
        if base != source and (file := folder / _VARIANT.format(slot)).is_file():
            name = check_text(read_text(file), file).partition(f"{_MARK}\n{_NAMED}")[2].partition("\n")[0]
            document.variants[slot] = Variant(_plain(name) or slot, Design(str(file)))
    return document
