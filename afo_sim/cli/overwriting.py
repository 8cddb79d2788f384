"""Refusals to write over another run, or into a folder of another kind of output."""

import json
import pathlib
from collections.abc import Mapping
from typing import Any

from afo_sim.common.errors import InputError

# A file by which a folder is known, and what the folder then is.
KINDS = {
    "sweep.json": "sweep",
    "search.json": "search",
    "both.json": "run of both legs",
    "differences.csv": "comparison of laws",
    "bode.json": "frequency response",
    "size.json": "sizing",
    "electronics.json": "export for a board",
    "fit_run.json": "fit to a log",
    "fit_torque.json": "fit to static torques",
    "fit.json": "fit of a muscle's law",
    "recording.parquet": "run",
}
OTHER = "another folder with --out"


def check_folder(folder: pathlib.Path, kind: str = "") -> None:
    """Refuse a folder that holds another kind of output; any kind if `kind` is ""."""
    for file, found in KINDS.items():
        if (folder / file).is_file():
            if found != kind:
                problem = f"holds a {found} ({file})"
                raise InputError(problem, field="out", value=str(folder), allowed=OTHER)
            return


def check_run_folder(folder: pathlib.Path, scenario: Mapping[str, Any], *, force: bool = False) -> None:
    """Refuse a folder that holds the run of another description."""
    from afo_sim.common.writing import settle

    check_folder(folder, "run")
    settle(folder)
    if force or not (folder / "recording.parquet").is_file():
        return
    try:
        before = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["scenario"]
    except (OSError, ValueError, KeyError, TypeError):
        before = None
    if before != json.loads(json.dumps(scenario)):
        name = before.get("name") if isinstance(before, dict) else None
        what = f"the run of another scenario, {name!r}" if name not in (None, scenario["name"]) else ""
        what = what or f"a run of {scenario['name']!r} with other values"
        raise InputError(
            f"holds {what}",
            field="out",
            value=str(folder),
            allowed=f"--force, which replaces it, or {OTHER}",
        )
