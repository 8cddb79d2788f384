"""One case of a sweep again, with its whole recording."""

import json
import math
import pathlib
from collections.abc import Callable
from dataclasses import dataclass

from afo_sim.common import InputError, SimulationError
from afo_sim.description import load
from afo_sim.simulation import Recording, run_scenario
from afo_sim.study.engine import OK
from afo_sim.study.results import OVERRIDES, read
from afo_sim.study.store import RECORDINGS, SWEEP


@dataclass(frozen=True)
class Replay:
    """A case again: its recording, what was said of it then, and the metrics that differ from its row."""

    case: int
    recording: Recording
    status: str
    different: dict[str, tuple[float, float]]

    @property
    def same(self) -> bool:
        """True if the case ends as in its row."""
        return not self.different and self.recording.ok == (self.status == OK)


def replay(folder: pathlib.Path, case: int, *, progress: Callable[[int, int], None] | None = None) -> Replay:
    """Run one case of a sweep as the sweep ran it."""
    results = read(folder)
    if results.sweep.get("walkers"):
        raise InputError(
            "has no recording, since its patients respond", field="case", allowed="`afo-sim walk`"
        )
    where = (results["case"] == case).nonzero()[0]
    if not len(where):
        late = results.unfinished and 0 <= case < results.planned
        problem = "is not computed yet" if late else "there is no such case"
        raise InputError(problem, field="case", value=case, allowed=f"0 to {results.planned - 1}")
    row = {name: column[0] for name, column in results.table.slice(int(where[0]), 1).to_pydict().items()}
    scenario = SWEEP.read(folder)["scenario"]
    try:
        description = load("scenario", scenario, json.loads(row[OVERRIDES]))
        recording = run_scenario(description, progress=progress)
    except (InputError, SimulationError):
        raise
    except Exception as error:  # as in the sweep, where it is a row's reason
        raise InputError(f"fails: {type(error).__name__}: {error}", field="case", value=case) from error
    different = {}
    for name in results.metrics if recording.ok and row["status"] == OK else ():
        now = recording.metrics[name].value if name in recording.metrics else math.nan
        now = now if math.isfinite(now) else math.nan  # as in the row
        if not (now == row[name] or (math.isnan(now) and math.isnan(row[name]))):
            different[name] = (row[name], now)
    return Replay(case, recording, row["status"], different)


def recording_folder(folder: pathlib.Path, case: int) -> pathlib.Path:
    """Folder in which a case's recording is kept."""
    return folder / RECORDINGS / f"case_{case:07d}"
