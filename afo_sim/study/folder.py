"""The folder of a study, sweep or search: its manifest, and the rules for continuing it."""

import hashlib
import json
import pathlib
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from afo_sim.common import (
    InputError,
    Json,
    JsonDict,
    JsonMapping,
    as_stored,
    check_writable,
    code_fingerprint,
    disk,
    identities,
    keeping,
    read_json,
    settle,
    write_json,
)
from afo_sim.common.versions import versions
from afo_sim.description import as_found, expand

if TYPE_CHECKING:
    from afo_sim.study.sweep_plan import Plan

Changed = Literal["refuse", "restart", "continue"]
AGAIN = "free space and run the same command again; computed cases are kept"
PARTS = {"fingerprint": dict, "scenario": dict, "metrics": dict, "seconds_per_case": float}


@dataclass(frozen=True)
class FolderKind:
    """A kind of study."""

    name: str
    manifest: str
    cases: str
    digits: int
    computed: tuple[str, ...]
    parts: Mapping[str, type]

    def part(self, folder: pathlib.Path, number: int) -> pathlib.Path:
        """The file of a part of the cases, for continuing the study."""
        return folder / self.cases / f"{number:0{self.digits}d}.parquet"

    def read(self, folder: pathlib.Path) -> JsonDict:
        """The manifest of a folder."""
        path, allowed = folder / self.manifest, "`changed=restart`, which deletes the folder's results"
        manifest = told_in(path, allowed)
        if manifest is None:
            raise InputError(f"there is no {self.name} here ({self.manifest} is missing)", file=folder)
        parts = self.parts.items()
        if not (isinstance(manifest, dict) and all(isinstance(manifest.get(k), kind) for k, kind in parts)):
            raise InputError("is damaged: it lacks a part", file=path, allowed=allowed)
        return manifest | {"scenario": as_found(manifest["scenario"], folder)}

    def open(
        self, folder: pathlib.Path, changed: Changed, plan: "Plan", now: JsonMapping,
        first: Callable[[JsonDict], JsonMapping], **further: Json,
    ) -> JsonDict:  # fmt: skip
        """The manifest of the folder for this plan: a new one by `first`, or an existing one."""
        scenario = json.loads(json.dumps(expand("scenario", plan.scenario)))
        known = {"fingerprint": now, "scenario": scenario, f"{self.name}_file": plan.file.name} | further
        check_writable(folder)
        settle(folder)
        manifest = self._continued(folder, now, changed)
        if manifest is None:
            new = _holds_nothing(folder)  # of two processes that begin at once the later one clears nothing
            manifest = dict(first(scenario))
            if not new:
                self.clear(folder)
        mixed = {"mixed": True} if manifest.get("fingerprint", now) != now else {}
        if manifest | known | mixed != manifest:  # where the files of the scenario lie may have changed
            manifest = manifest | known | mixed
            with disk(folder, AGAIN):
                write_json(folder / self.manifest, as_stored(manifest, folder), "manifest", keeping)
        return manifest

    def _continued(self, folder: pathlib.Path, now: JsonMapping, changed: Changed) -> JsonDict | None:
        """The manifest of the study that goes on in the folder; None where a new one begins."""
        if _holds_nothing(folder):
            return None

        def refused(problem: str, allowed: str) -> InputError:
            return InputError(problem, field="out", value=str(folder), allowed=allowed)

        if not (folder / self.manifest).is_file():
            problem = f"holds something else than a {self.name} ({self.manifest} is missing)"
            raise refused(problem, "an empty folder")
        try:
            manifest = self.read(folder)
        except InputError:
            if changed == "restart":
                return None
            raise
        before = manifest["fingerprint"]
        if before == now:
            return manifest
        finished = any((folder / name).is_file() for name in self.computed)
        if changed == "restart" or not (finished or any((folder / self.cases).glob("*.parquet"))):
            return None
        throws = "`changed=restart`, which deletes its results"
        if before.get(self.name) != now[self.name]:
            problem = f"the folder holds another {self.name}, or this one before a change"
            raise refused(problem, f"another folder, or {throws}")
        if changed == "refuse":  # results of other code may be mixed, if asked for
            old = before.get("versions")
            old = old if isinstance(old, dict) else {}
            changes = [f"{k} {old.get(k)} → {v}" for k, v in now["versions"].items() if old.get(k) != v]
            own, other = now.get("registered", {}), before.get("registered", {})
            changes += [f"{k} registered" for k in own | other if own.get(k) != other.get(k)]
            which = f" ({', '.join(changes)})" if changes else ""
            problem = f"the folder's results were computed by other code{which}"
            raise refused(problem, f"{throws}, or `changed=continue`, which mixes")
        return manifest

    def clear(self, folder: pathlib.Path) -> None:
        """Delete all results; the manifest stays until it is replaced."""
        with disk(folder, AGAIN):
            for path in (folder / name for name in (self.cases, *self.computed)):
                if path.is_dir():
                    shutil.rmtree(path)
                else:
                    path.unlink(missing_ok=True)


def told_in(path: pathlib.Path, allowed: str) -> Json:
    """What a JSON file of a folder holds; None where there is none."""
    try:
        return read_json(path)
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        raise InputError(f"is damaged: {error}", file=path, allowed=allowed) from None


def _holds_nothing(folder: pathlib.Path) -> bool:
    """True where a folder is new; unfinished files of a killed process, `.NAME`, do not count."""
    return not folder.is_dir() or all(path.name.startswith(".") for path in folder.iterdir())


def fingerprint(kind: str, canonical: JsonMapping, *libraries: str) -> JsonDict:
    """Everything that decides the results: the study's description, this program's code, its libraries."""
    text = json.dumps(canonical, sort_keys=True)
    found = {kind: hashlib.sha256(text.encode()).hexdigest(), **program()}
    found |= {"registered": own} if (own := identities()) else {}
    return found | {"versions": found["versions"] | versions(libraries)}


def program() -> JsonDict:
    """This program's code and the libraries below it: with the same on two machines, so are the results."""
    return {"code": code_fingerprint(), "versions": versions()}
