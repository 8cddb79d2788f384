"""Events over time: lanes of valves, stance and strides, and the list of events."""

import numpy as np
import rerun as rr

from afo_sim.metrics import SOLVED, stance, stance_force
from afo_sim.show.rerun.colours import of_muscle
from afo_sim.show.rerun.run_rows import GAIT, Columns, Source, send, strides

_KNOTS = 50  # rows from one remembered pair of time and strides to the next
SHUT = [55, 58, 64]
STANCE, _SWING = [60, 125, 85], [70, 95, 150]
_STRIDES = ([88, 92, 102], [62, 66, 74])  # in turn

BLANK = " "  # the viewer shows the state itself where a label is empty
_LANE_LETTERS = 85  # along a lane in the smallest usual window, 1280 pixels wide
_MARGIN = 1.5  # letters kept free

_SETTLED = "settled: from here the strides are solved for, before it they are walked from the start"

_Change = tuple[float, str]  # time [s], the state from then on


class EventFinder:
    """Collects the changes of state and the peaks of a run, block by block."""

    def __init__(self, source: Source):
        self.valves, self.walks = source.named("valve"), source.walks
        self._stance = stance_force(source.columns)
        self._body_mass = source.body_mass
        self.lanes: dict[str, list[_Change]] = {}
        self._peaks: dict[str, tuple[float, float]] = {}
        self._solved = (SOLVED,) if source.solved else ()
        self._settled: float | None = None  # time from which strides are solved for [s]
        self._knots: list[tuple[float, float]] = []  # time [s], strides
        self._torque = bool(source.named("muscle"))
        self.positive, self.negative = source.scenario.leg.directions

    @property
    def columns(self) -> list[str]:
        """The columns that `see` reads."""
        walking = (*GAIT, self._stance, "toe/height") if self.walks else ()
        valves = (f"valve/{valve}/opening" for valve in self.valves)
        return ["time", "ankle/angle", "ankle/moment/orthosis", *valves, *walking, *self._solved]

    def see(self, block: Columns) -> None:
        """Take in a block of rows."""
        time = block["time"]
        for valve in self.valves:
            is_open = block[f"valve/{valve}/opening"] > 0.5
            self._lane(f"valves/{valve}", time, np.where(is_open, "open", "shut"))
        angle = block["ankle/angle"]
        peaks = {f"greatest {self.positive}": angle, f"greatest {self.negative}": -angle}
        if self._torque:
            peaks[f"greatest {self.positive} torque of the orthosis"] = block["ankle/moment/orthosis"]
        if self.walks:
            stands = stance({self._stance: block[self._stance]}, self._body_mass)
            self._lane("gait/support", time, np.where(stands, "stance", "swing"))
            names = np.char.mod("stride %d", block["gait/stride"] + 1.0)
            if self._solved:
                names = np.where(block[SOLVED] == 1.0, np.char.add(names, ", settled"), names)
            self._lane("gait/stride", time, names)
            self._knots += zip(time[::_KNOTS], strides(block)[::_KNOTS], strict=True)
            self._knots.append((time[-1], strides(block)[-1]))
            peaks["toe lowest in swing"] = np.where(stands, -np.inf, -block["toe/height"])
        if self._solved and self._settled is None and block[SOLVED].any():
            self._settled = float(time[block[SOLVED].argmax()])
        for name, values in peaks.items():
            top = int(np.argmax(values))
            if np.isfinite(values[top]) and values[top] > self._peaks.get(name, (0.0, -np.inf))[1]:
                self._peaks[name] = (float(time[top]), float(values[top]))

    def _lane(self, name: str, time: np.ndarray, states: np.ndarray) -> None:
        changes = self.lanes.setdefault(name, [])
        before = changes[-1][1] if changes else ""
        for k in np.flatnonzero(np.r_[states[0] != before, states[1:] != states[:-1]]):
            changes.append((float(time[k]), str(states[k])))

    def rows(self, times: list[float]) -> Columns:
        """Times [s] as rows to be sent: in walking with their strides."""
        rows = {"time": np.array(times)}
        if self.walks:
            walked = np.interp(times, *np.transpose(self._knots))
            rows |= {"gait/stride": np.floor(walked), "gait/phase": walked % 1.0}
        return rows

    def events(self, source: Source) -> list[tuple[float, str, str]]:
        """(time [s], level, text), in order."""
        found = [(0.0, "WARN", warning) for warning in source.header.warnings]
        if not source.header.ok:
            found.append((source.n_row / source.rate, "ERROR", source.header.status))
        if self._settled is not None:
            found.append((self._settled, "INFO", _SETTLED))
        for valve in self.valves:
            for time, state in self.lanes[f"valves/{valve}"]:
                if time > 0.0 or state == "open":
                    done = "opens" if state == "open" else "shuts"
                    found.append((time, "INFO", f"{valve.replace('_', ' ')} {done}"))
        for name, (time, value) in self._peaks.items():
            told = f"{abs(np.degrees(value)):.2f} deg"
            if name.endswith("torque of the orthosis"):
                told = f"{value:.2f} N·m"
            elif name.startswith("toe"):
                told = f"{-1e3 * value:.0f} mm above the floor"
            found.append((time, "INFO", f"{name}: {told}"))
        return sorted(found)


def log_events(stream: rr.RecordingStream, finder: EventFinder, source: Source, prefix: str = "") -> None:
    """Lanes of valves, stance and strides, and the list of events."""
    for name, changes in finder.lanes.items():
        kind, what = name.split("/")
        states = [state for _, state in changes]
        # listed even where they do not occur
        usual = {"stride": (), "support": ("stance", "swing")}.get(what, ("open", "shut"))
        values = list(dict.fromkeys([*usual, *states]))
        own = {"stance": STANCE, "swing": _SWING, "shut": SHUT}
        colours = [own.get(value) or of_muscle(f"{what.rsplit('_', 1)[0]}_1") for value in values]
        if what == "stride":
            colours = [_STRIDES[k % 2] for k in range(len(values))]
        words = _fitting(values, changes, source.n_row / source.rate)
        lane = rr.StateConfiguration(values=values, labels=words, colors=colours)
        stream.log(f"{kind}/{prefix}{what}", lane, static=True)
        at = finder.rows([time for time, _ in changes])
        send(stream, f"{kind}/{prefix}{what}", at, rr.StateChange.columns(state=states))
    events = finder.events(source)
    if events:
        times, level, words = map(list, zip(*events, strict=True))
        texts = rr.TextLog.columns(text=[f"{prefix.replace('/', ': ')}{w}" for w in words], level=level)
        send(stream, f"events/{prefix.rstrip('/') or 'run'}", finder.rows(times), texts)


def _fitting(values: list[str], changes: list[_Change], end: float) -> list[str]:
    """Words on a lane's intervals: of each state the longest that fits all of its intervals, or none."""
    times = [time for time, _ in changes] + [end]
    lasts = dict.fromkeys(values, end)
    states = [state for _, state in changes]
    for k, (time, state) in enumerate(changes):
        cut = k in (0, len(changes) - 1) and states.count(state) > 1
        lasts[state] = lasts[state] if cut else min(lasts[state], times[k + 1] - time)
    found = []
    for value in values:
        room = _LANE_LETTERS * lasts[value] / end if end > 0.0 else 0.0
        words = [value, value.split(",")[0], value.removeprefix("stride ").split(",")[0]]
        fits = [word for word in words if len(word) + _MARGIN <= room]
        found.append(fits[0] if fits and value != "shut" else BLANK)
    return found
