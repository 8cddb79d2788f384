"""A run as it is shown: its name and colour, its strides, its words and groups."""

import itertools
import re
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from afo_sim.common import InputError, find_gait
from afo_sim.description import Orthosis, body_mass, load
from afo_sim.gait.file import read
from afo_sim.metrics import SOLVED, Stride, has_orthosis, settled, stance
from afo_sim.metrics.strides import strides
from afo_sim.metrics.walking import chambers
from afo_sim.model import OUTLET, SOURCE, TUBE_END, VALVE_END
from afo_sim.physics import AIR, GASES, Gas
from afo_sim.show.style import COLOURS, MARKERS, RUNS, LineStyle, plain
from afo_sim.simulation import Recording

PHASE = np.linspace(0.0, 1.0, 201)
PERCENT = 100.0 * PHASE
_MEAN_CURVE = "curve of"  # begins the note of a gait that is the mean curve of several people
_ADULTS, _TRIAL, UNKNOWN = "healthy adults, mean", "healthy trial, recorded", "recorded walking"
_PATIENT = "the patient's own walk, recorded"
ANCHOR = r"cuff/\w+/displacement"
_VOLUME = r"volume/([\w-]+)/pressure"
_OPENING = r"valve/([\w-]+)/opening"
_SIDES = {"inlet": 1.0, "outlet": 0.5}  # valves of a chamber, with the opacity of their lanes
SET_PRESSURE = "supply/set_pressure"

Over = Literal["time", "cycle"]  # the abscissa


@dataclass(frozen=True, eq=False)
class RunView:
    """A run in a figure or report."""

    label: str
    colour: str
    recording: Recording
    most_points: int | None = None
    style: LineStyle = "-"

    @property
    def name(self) -> str | None:
        """Its label as a figure can show it; None where it has none."""
        return plain(self.label) if self.label else None

    @property
    def dashes(self) -> str:
        """Lengths of dash and gap of its lines, in widths of the line; "" of a solid line."""
        return "" if isinstance(self.style, str) else " ".join(f"{part:g}" for part in self.style[1])

    @property
    def walks(self) -> bool:
        """True where recorded walking drove this run."""
        return "gait/phase" in self.recording.columns

    @property
    def body_mass(self) -> float:
        """Of the patient [kg]."""
        return float(body_mass(self.recording.described))

    @cached_property
    def whole_strides(self) -> list[Stride]:
        """Every stride from heel strike to heel strike."""
        time = self.recording["time"]
        step = float(time[1] - time[0]) if len(time) > 1 else 1.0
        return strides(self.recording.columns, step, self.body_mass)

    @property
    def strides(self) -> list[Stride]:
        """The strides that count; if there are none, whatever is whole."""
        return settled(self.recording.columns, self.whole_strides) or self.whole_strides

    @property
    def stands(self) -> np.ndarray:
        """Mask of the rows in stance (n,)."""
        return stance(self.recording.columns, self.body_mass)

    @cached_property
    def first_solved(self) -> int | None:
        """The first row of the settled strides that were solved for; None where there are none."""
        solved = self.recording.columns.get(SOLVED)
        return None if solved is None or not solved.any() else int(solved.argmax())

    @property
    def toe_off(self) -> float:
        """Mean gait phase of toe-off [-]."""
        return float(np.mean([stride.toe_off for stride in self.strides]))

    @property
    def has_orthosis(self) -> bool:
        """True where the run has muscles."""
        return has_orthosis(self.recording.columns)

    @property
    def joint(self) -> str:
        """The joint's name for people."""
        return plain(self.recording.described["leg"]["ankle"])

    @property
    def positive(self) -> str:
        """The joint's positive direction."""
        return plain(self.recording.described["leg"].get("directions", ["dorsiflexion"])[0])

    @property
    def chambers(self) -> list[str]:
        """The chambers of the orthosis."""
        return chambers(self.recording.columns)

    @property
    def groups(self) -> dict[str, str]:
        """{muscle group: its chamber}."""
        muscles = self.recording.described["orthosis"].get("muscle", {})
        return {name: group.get("chamber") or name for name, group in muscles.items()}

    @property
    def volumes(self) -> dict[str, str]:
        """{volume of its air path: its name for people}; neither chambers nor the source's tank."""
        found = [m[1] for name in self.recording.columns if (m := re.fullmatch(_VOLUME, name))]
        names = {VALVE_END.format(chamber): f"{chamber}, valve end" for chamber in self.chambers}
        names |= {TUBE_END.format(chamber): f"{chamber}, tube end" for chamber in self.chambers}
        names[OUTLET] = "regulator's outlet"
        hidden = {SOURCE, OUTLET} if SET_PRESSURE in self.recording.columns else {SOURCE}
        return {name: names.get(name, name) for name in found if name not in hidden}

    @property
    def lanes(self) -> list[tuple[str, str, float]]:
        """(valve, its chamber or "", opacity) of every valve: chambers' in their order, then all others."""
        found = [(f"{c}_{side}", c, shade) for c in self.chambers for side, shade in _SIDES.items()]
        valves = [m[1] for name in self.recording.columns if (m := re.fullmatch(_OPENING, name))]
        named = {valve for valve, _, _ in found}
        return [*found, *((valve, "", 1.0) for valve in valves if valve not in named)]

    @property
    def source(self) -> str:
        """Prefix of the columns of its bottle, cartridge or tank, "store/source"; "" without one."""
        kinds = (f"{kind}/{SOURCE}" for kind in ("store", "volume"))
        return next((kind for kind in kinds if f"{kind}/pressure" in self.recording.columns), "")

    @property
    def gas(self) -> Gas:
        """The gas that drives it."""
        source = (self.recording.described.get("supply") or {}).get("source") or {}
        return GASES[source.get("gas") or AIR.name]

    @property
    def anchors(self) -> list[str]:
        """The segments whose cuff or plate gives."""
        return [name.split("/")[1] for name in self.recording.columns if re.fullmatch(ANCHOR, name)]

    @property
    def colours(self) -> dict[str, str]:
        """{chamber or muscle group: its colour}; a group named as a chamber has that chamber's."""
        return dict(zip(dict.fromkeys([*self.chambers, *self.groups]), itertools.cycle(COLOURS)))

    @property
    def markers(self) -> dict[str, str | None]:
        """{chamber or muscle group: the marker on its lines}, as `colours`."""
        return dict(zip(self.colours, itertools.cycle(MARKERS)))

    @cached_property
    def recorded(self) -> str:
        """The recorded walker drawn with it: a trial, the mean of adults, the patient."""
        if self.recording.described["gait"].get("walker") == "patient":
            return _PATIENT
        try:
            mean = read(find_gait(str(self.recording.described["gait"]["cycle"]))).notes.get("mean", "")
        except InputError:
            return UNKNOWN
        return _ADULTS if mean.startswith(_MEAN_CURVE) else _TRIAL

    def cycles(self, column: str) -> np.ndarray:
        """A column over PHASE, one row for each stride (strides, 201)."""
        return np.array([stride.at(column, PHASE) for stride in self.strides])

    def path_contraction(self, group: str, muscle: str, over: Over) -> np.ndarray:
        """Contraction that a muscle would have on rigid cable, cuff and plate (curves, n)."""
        mounted = self._orthosis.muscle[group]
        length = mounted.type.nominal_length
        _, path = self.curves(f"muscle/{muscle}/path_length", over)
        return (length - (path - mounted.series_length)) / length

    @cached_property
    def _orthosis(self) -> Orthosis:
        return load("orthosis", self.recording.described["orthosis"])

    def curves(self, column: str, over: Over) -> tuple[np.ndarray, np.ndarray]:
        """Abscissa, time [s] or gait cycle [%] (n,), and a column's curves over it (curves, n)."""
        if over == "cycle":
            return PERCENT, self.cycles(column)
        time = self.recording["time"]
        every = 1 if self.most_points is None else max(1, len(time) // self.most_points)
        return time[::every], self.recording[column][::every][None, :]


def alone(recording: Recording) -> RunView:
    """A run that is shown by itself, every row of it."""
    return RunView("", RUNS[0], recording)
