"""The one result of a simulation: columns with units and provenance, metrics, warnings, verdict.

`Any` is a field's value, an index or a range of rows: `Recording` and its columns examine which.
"""

import dataclasses
import functools
import os
import pathlib
import tempfile
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from numbers import Integral
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from afo_sim.common import Brief, InputError, Notice, Shown, as_stored, installed, nearest_name, shown, titles
from afo_sim.description import USUAL_LIMITS, Limits, Scenario, as_found, load
from afo_sim.metrics import Answer, Feed, Metric, Metrics, capped, seated_answers, undecided, with_draws
from afo_sim.metrics.covered import counts
from afo_sim.metrics.validity import RESTS_ON
from afo_sim.metrics.verdict import verdict
from afo_sim.simulation.columns import describe
from afo_sim.simulation.criterion import seconds
from afo_sim.simulation.files import ENDING, RERUN, model_of, read_header, read_run, read_undamaged, write_run

if TYPE_CHECKING:
    import mujoco
    import pandas
    import xarray


SLIGHTLY = 1e-9  # that a row may stand before a time [s]


class Columns(Brief[str, np.ndarray]):
    """Columns by name; a slice has some rows of all. A column that is not there is an `InputError`."""

    def __missing__(self, column: str) -> np.ndarray:
        problem, nearest = "the recording has no such column", nearest_name(str(column), self)
        raise InputError(problem, field="column", value=column, nearest=nearest)

    def __getitem__(self, which: Any) -> Any:
        if not isinstance(which, slice):
            return super().__getitem__(which)
        if not (which.step is None or isinstance(which.step, Integral)):
            problem, allowed = "is not a valid step", "a whole number, as in [::10]"
            raise InputError(problem, field="step", value=which.step, allowed=allowed)
        rows = slice(self._row(which.start), self._row(which.stop), which.step)
        return Columns({name: values[rows] for name, values in self.items()})

    def _row(self, bound: Any) -> Any:
        """The first row at a time; a number is a row itself."""
        if bound is None or isinstance(bound, Integral):
            return bound
        return int(np.searchsorted(self["time"], seconds(bound, "rows") - SLIGHTLY))


class Strides(Brief[int, dict[str, Metric]]):
    """Metrics of each stride by its number; a slice is of the strides in their order, by their numbers."""

    def __getitem__(self, which: Any) -> Any:
        if isinstance(which, slice):
            return Strides(list(self.items())[which])
        return super().__getitem__(which)


class Later:
    """A field of a recording that is computed once, when it is read."""

    def __init__(self, compute: Callable[[], Any]):
        self._compute, self._lock, self._found = compute, threading.RLock(), list[Any]()

    def __call__(self) -> Any:
        """The value."""
        with self._lock:
            if not self._found:
                self._found.append(self._compute())
                del self._compute
            return self._found[0]


@dataclass(frozen=True, repr=False, eq=False)  # two runs are two, whatever they hold
class Recording(Shown, Mapping[str, np.ndarray]):
    """One simulation's result, a mapping of its columns: `run["ankle/angle"]` [SI] (n,).

    `run[10:200]` and `run["1 s":"2 s"]` are a dict of those rows of all columns, without the end. It has no
    metrics, which belong to the whole run. Angles are dorsiflexion positive, pressures gauge. A notebook
    shows a recording with figures.

    columns : each column by name [SI] (n,)
    metrics : numbers of the whole run with units, by name
    described : the scenario that ran, as summary.json has it: numbers are texts with units
    model_xml : the model that ran, as MJCF
    status : "ok", or why the simulation stopped
    warnings : reasons to doubt the numbers
    timing : time for building and stepping [s], and speed
    versions : of this package, MuJoCo and all else that affects the numbers
    parameters : of the muscles' actuators, by name, as MuJoCo's `actuator_user` has them
    strides : metrics of each complete stride, by its number or a slice
    model_binary : the model that ran, to the bit; `model()` loads it
    studies : further results: what to change first, uncertainty bands
    labels : unit and sign of each column, as its file has them

    Raises
    ------
    InputError
        No such column or metric; or this version cannot read an older run's scenario.

    Examples
    --------
    >>> seated = run("seated", {"duration": "1 s"})
    >>> seated["time"].shape, seated["ankle/angle"].shape
    ((500,), (500,))
    >>> seated.metrics["range_of_motion"].unit
    'deg'
    >>> seated.to_xarray()["ankle/angle"].attrs["units"]
    'rad'
    """

    columns: dict[str, np.ndarray]
    metrics: dict[str, Metric]
    described: dict[str, Any]
    model_xml: str
    status: str
    warnings: tuple[str, ...]
    timing: dict[str, float]
    versions: dict[str, str]
    parameters: dict[str, list[float]]
    strides: dict[int, dict[str, Metric]] = field(default_factory=dict)
    model_binary: bytes = field(default_factory=bytes)
    studies: dict[str, Any] = field(default_factory=dict)
    labels: dict[str, tuple[str, str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        given = dict(vars(self))
        vars(self).clear()
        vars(self)["_later"] = {name: value for name, value in given.items() if isinstance(value, Later)}
        for name in given.keys() - vars(self)["_later"].keys():
            vars(self)[name] = _KINDS.get(name, lambda same: same)(given[name])

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:  # of what nobody has read yet
            if name not in vars(self).get("_later", ()):
                return super().__getattr__(name)
            found = _KINDS.get(name, lambda same: same)(vars(self)["_later"][name]())
            return vars(self).setdefault(name, found)

    def __getstate__(self) -> dict[str, Any]:
        return {each.name: getattr(self, each.name) for each in dataclasses.fields(self)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Take what was pickled, also of the former version, whose `scenario` was the dict."""
        if "described" not in state:
            state = state | {"described": state.pop("scenario"), "labels": {}}
        vars(self).update(state | {"_later": {}})

    def whole(self) -> "Recording":
        """The same with everything computed that was to be when it is read."""
        for each in dataclasses.fields(self):
            found = getattr(self, each.name)
            if isinstance(found, Metrics):
                found.whole()
        return self

    def changed(self, **changes: Any) -> "Recording":
        """The recording with other fields; none is computed for it."""
        kept = vars(self).get("_later", {}) | vars(self)
        return Recording(**{each.name: kept[each.name] for each in dataclasses.fields(self)} | changes)

    def __repr__(self) -> str:
        rows, warned = len(self.columns.get("time", ())), len(self.warnings)
        counted = f"{rows} rows × {len(self.columns)} columns, {len(self.metrics)} metrics"
        more = f", {warned} warning{'s' if warned > 1 else ''}" if warned else ""
        return f"<Recording of {self.described['name']!r}: {self.status}, {counted}{more}>"

    def _ipython_key_completions_(self) -> list[str]:  # of run["…
        return list(self.columns)

    @overload
    def __getitem__(self, which: str) -> np.ndarray: ...
    @overload
    def __getitem__(self, which: slice) -> dict[str, np.ndarray]: ...
    def __getitem__(self, which: Any) -> Any:
        return self.columns[self._own(which) if isinstance(which, str) else which]

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __len__(self) -> int:
        return len(self.columns)

    def __bool__(self) -> bool:  # also without columns
        return True

    def __contains__(self, column: object) -> bool:
        return isinstance(column, str) and self._own(column) in self.columns

    def get(self, column: str, default: Any = None) -> Any:
        """As of a dict."""
        return self.columns.get(self._own(column), default)

    __eq__, __hash__ = object.__eq__, object.__hash__  # a Mapping's would compare all rows

    def __dir__(self) -> list[str]:  # also what is not computed yet
        return [*super().__dir__(), *self.__dataclass_fields__]

    def describe(self, column: str) -> tuple[str, str]:
        """(unit, sign) of one of its columns."""
        own = self._own(column)
        return self.labels.get(own) or describe(own, self.described)

    def _own(self, column: str) -> str:
        """The column that is meant: "knee/angle" of a knee, "joint/angle" of any, is "ankle/angle"."""
        kind, _, rest = column.partition("/")
        named = column not in self.columns and kind in ("joint", self.described["leg"].get("joint"))
        return f"ankle/{rest}" if named else column

    @functools.cached_property
    def scenario(self) -> Scenario:
        """What was simulated, as `load` reads it; `described` is the dict of it that files hold."""
        return load("scenario", self.described)

    @property
    def ok(self) -> bool:
        """Whether the simulation ran to its end."""
        return self.status == "ok"

    @property
    def verdict(self) -> tuple[Answer, ...]:
        """The answers of a walking run, judged by the scenario's limits; none for others."""
        if not self.described.get("gait"):
            return ()
        limits = limits_of(self)
        if not self.ok:
            return undecided(limits, "the simulation stopped early")
        over = self.described.get("reference") or "shoe"
        gait = self.described["gait"]
        own = gait.get("walker") == "patient" and gait.get("compensation", "kept") == "kept"
        found = verdict(self.metrics, self.strides, limits, feed_of(self), over, own)
        study = self.studies.get("uncertainty", {})
        if study.get("trips"):
            draws = study["draws"] - study["failed"]["count"]
            touch = study["trips"]["touch"]["share"]
            found = with_draws(found, touch, draws, limits.drawn_trips, study.get("kept", {}))
        return capped(found, self.warnings)

    def to_pandas(self) -> "pandas.DataFrame":
        """The columns [SI] as a pandas DataFrame, each with its unit: "ankle/angle [rad]" (needs pandas).

        `attrs["units"]` holds the units by the columns' names in the recording.
        """
        import pandas

        units = {name: self.describe(name)[0] for name in self.columns}
        made = pandas.DataFrame(self.columns).rename(columns=titles(units))
        made.attrs = {"units": units}
        return made

    def to_xarray(self) -> "xarray.Dataset":
        """The columns [SI] as an xarray Dataset over `time` (needs xarray).

        Each variable's `attrs` hold its `units` and `sign`; those of the Dataset the scenario's name, the
        status, and the metrics as texts with their units.
        """
        import xarray

        facts = {"scenario": self.described["name"], "status": self.status}
        facts |= {name: str(metric) for name, metric in self.metrics.items()}
        variables = {}
        for name, values in self.columns.items():
            unit, sign = self.describe(name)
            variables[name] = ("time", values, {"long_name": name, "units": unit, "sign": sign})
        time = variables.pop("time")
        return xarray.Dataset(variables, coords={"time": time}, attrs=facts)

    def save(
        self, folder: str | os.PathLike[str], *, rrd: bool | None = None, rate: float | str | None = None,
        place: pathlib.Path | None = None,
    ) -> pathlib.Path:  # fmt: skip
        """Write recording.parquet, summary.json, model.xml and, with `rrd`, recording.rrd.

        The files appear together; an older run in the folder stays whole until then. Into "run.parquet" goes
        recording.parquet alone, which holds the whole run.

        Parameters
        ----------
        folder : made if need be; or a file that ends in .parquet
        rrd : also write recording.rrd; by default where the library rerun is installed
        rate : samples a second in it [Hz], or "200 Hz"; the run's own by default
        place : where the folder will stand, if it moves afterwards: the scenario's files are named from it

        Returns
        -------
        the folder, or the file
        """
        target = pathlib.Path(folder)
        drawn = (installed("rerun") if rrd is None else rrd) and len(self["time"]) > 0
        picture = (lambda path: shown().write(self, path, rate)) if drawn else None
        stored = as_stored(self.described, place or (target.parent if target.suffix == ENDING else target))
        return write_run(replace(self, described=stored), target, picture)

    def export(
        self, out: str | os.PathLike[str], to: str | None = None, *, rate: float | str | None = None,
        columns: Iterable[str] = (), force: bool = False,
    ) -> tuple[pathlib.Path, ...]:  # fmt: skip
        """Write the run for another program, with warnings of what differs from the run or the request.

        Parameters
        ----------
        out : file to write, whole or not at all; metrics and, of walking as mot, ground forces go beside it;
            of plugin and c a folder
        to : "sto" or "mot" (OpenSim), "csv", "mat" (MATLAB, Octave) or "mjb" (MuJoCo); or what runs again
            elsewhere, with the run's commands: "plugin" (MuJoCo alone), "c", "fmu"; that of `out`'s ending by
            default
        rate : rows a second [Hz], or "100 Hz", up to the run's own, which is the default; every k-th row is
            kept as it is
        columns : names or patterns such as "ankle/*", for sto, csv and mat; all by default
        force : replace files that are there

        Returns
        -------
        the files written, `out` first

        Raises
        ------
        InputError
            There is no such format, a file is there already, the run has no rows, or its leg no ankle (mot).

        Examples
        --------
        >>> short = run("seated", {"duration": "1 s"})
        >>> [file.name for file in short.export("short.csv", rate=100, columns=["ankle/*"])]
        ['short.csv', 'short_metrics.csv']
        """
        return shown().export(self, out, to, rate, columns, force)

    def model(self) -> "mujoco.MjModel":
        """The model that ran, to the last bit: from the same state, the same inputs give the same steps.

        Its muscles pull inside `afo_sim.native.installed()` only. `model_xml` is its MJCF; of older runs it
        has limp muscles. A run that holds no model, or that of another MuJoCo, has its scenario built
        anew, which must give the same parameters; an installed MuJoCo other than the run's is warned of.

        Returns
        -------
        MuJoCo's MjModel, a new one at each call

        Raises
        ------
        InputError
            The run is of other versions of MuJoCo or this package, or its leg's files have changed, and no
            model is the same.

        Examples
        --------
        >>> short = run("seated", {"duration": "1 s"})
        >>> short.model().actuator("dorsiflexor_1").user.tolist() == short.parameters["dorsiflexor_1"]
        True
        """
        return model_of(self)

    def view(self) -> None:
        """Open the run in the Rerun viewer."""
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / RERUN
            shown().write(self, path)
            shown().open([path])

    def summary(self) -> dict[str, Any]:
        """Contents of summary.json; of walking `verdict` and `strides`, of known kinds `coverage`, too."""
        found: dict[str, Any] = {
            "status": self.status,
            "scenario": self.described,
            "metrics": plain(self.metrics),
            "versions": self.versions,
            "timing": self.timing,
            "warnings": list(self.warnings),
            "notices": [warning.as_json() for warning in self.warnings if isinstance(warning, Notice)],
        }
        if answers := self.verdict:
            rest = [{"rests_on": list(RESTS_ON[answer.name])} for answer in answers]
            found["verdict"] = [asdict(answer) | on for answer, on in zip(answers, rest, strict=True)]
        if known := counts(self.metrics):
            found["coverage"] = known  # what bands of such metrics were worth so far
        if self.strides:
            found["strides"] = [{"stride": k, "metrics": plain(m)} for k, m in self.strides.items()]
        if self.studies:
            found["studies"] = self.studies
        return found


_KINDS: dict[str, Callable[[Any], Any]] = {"columns": Columns, "described": Brief, "parameters": Brief}
_KINDS["strides"] = Strides
_KINDS["metrics"] = lambda given: given if isinstance(given, Metrics) else Metrics(given)


def plain(metrics: Mapping[str, Metric]) -> dict[str, dict[str, Any]]:
    """Metrics as JSON has them."""
    return {name: {"value": metric.value, "unit": metric.unit} for name, metric in metrics.items()}


def read_recording(folder: str | os.PathLike[str]) -> Recording:
    """Read the recording in a run's folder (or a Parquet file).

    Raises
    ------
    InputError
        There is no run, or the file is damaged.

    Examples
    --------
    >>> folder = run("seated", {"duration": "1 s"}).save("runs/short", rrd=False)
    >>> read_recording(folder).status
    'ok'
    """
    return _found(Recording(**read_run(folder)), pathlib.Path(folder))


def recover_recording(folder: str | os.PathLike[str]) -> Recording:
    """What is whole of a damaged recording: lost rows of a column are NaN, and a warning names them."""
    return _found(Recording(**read_undamaged(folder)), pathlib.Path(folder))


def recording_header(file: Any, folder: str | os.PathLike[str]) -> Recording:
    """A run's Recording without its rows, from its opened Parquet file."""
    return _found(Recording(columns={}, **read_header(file, folder)), pathlib.Path(folder))


def _found(recording: Recording, folder: pathlib.Path) -> Recording:
    """A recording from a run's folder, or its Parquet file, with the whole paths of its scenario's files."""
    place = folder if folder.is_dir() else folder.parent
    return replace(recording, described=as_found(recording.described, place))


def limits_of(recording: Recording) -> Limits:
    """The limits of a recording's scenario; the usual ones of a recording that is older than limits are."""
    return load("limits", recording.described.get("limits") or USUAL_LIMITS)


def feed_of(recording: Recording) -> Feed | None:
    """The source that a recording's scenario names, in words; None of endless air."""
    described = (recording.described.get("supply") or {}).get("source")
    if not described:
        return None
    source = load("source", described)
    name = f" {source.name}" if source.name else ""
    if source.kind == "compressor":
        return Feed(f"the compressor{name}", runs=True)
    gas = "CO2" if source.gas == "co2" else "air"
    if source.content is not None:
        return Feed(f"the cartridge{name} of {1e3 * source.content:g} g {gas}")
    full = 1e-5 * (source.filling_pressure or 0.0)
    return Feed(f"the bottle{name} of {1e3 * source.volume:g} l at {full:g} bar")


def answers_of(recording: Recording) -> tuple[Answer, ...]:
    """The verdict of a walk; of another run the answers about a joint that is moved."""
    if recording.described.get("gait") or not recording.ok:
        return recording.verdict
    return capped(seated_answers(recording.metrics, limits_of(recording)), recording.warnings)
