"""The one result of a simulation: columns with units and provenance, metrics, warnings."""

import os
import pathlib
import tempfile
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from afo_sim.common.errors import InputError, nearest_name
from afo_sim.metrics.metric import Metric
from afo_sim.metrics.renamed import Metrics
from afo_sim.simulation.columns import describe
from afo_sim.simulation.exchange import dataset, frame
from afo_sim.simulation.files import RERUN, read_header, read_run, write_run
from afo_sim.simulation.kept_model import model_of
from afo_sim.simulation.shown import shown

if TYPE_CHECKING:
    import mujoco
    import pandas
    import xarray


@dataclass(frozen=True, repr=False, eq=False)  # two runs are two, whatever they hold
class Recording:
    """One simulation's result. Indexing gives a column: `run["ankle/angle"]` [SI] (n,).

    Angles are dorsiflexion positive, pressures gauge. `metrics` are numbers that know their unit; `strides`
    holds those of each whole stride of walking, by the stride's number. `status` is "ok" or says why the
    simulation stopped; `warnings` tell what to mind. A notebook shows a recording with figures.

    Raises
    ------
    InputError
        There is no such column, or no such metric.

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
    scenario: dict[str, Any]
    model_xml: str
    status: str
    warnings: tuple[str, ...]
    timing: dict[str, float]
    versions: dict[str, str]
    parameters: dict[str, list[float]]
    strides: dict[int, dict[str, Metric]] = field(default_factory=dict)
    model_binary: bytes = b""

    def __post_init__(self) -> None:
        object.__setattr__(self, "metrics", Metrics(self.metrics))

    def __repr__(self) -> str:
        rows, warned = len(self.columns.get("time", ())), len(self.warnings)
        counted = f"{rows} rows × {len(self.columns)} columns, {len(self.metrics)} metrics"
        more = f", {warned} warning{'s' if warned > 1 else ''}" if warned else ""
        return f"<Recording of {self.scenario['name']!r}: {self.status}, {counted}{more}>"

    def _repr_html_(self) -> str:  # asked for by Jupyter
        return shown().html(self)

    def _ipython_key_completions_(self) -> list[str]:  # of run["…
        return list(self.columns)

    def __getitem__(self, column: str) -> np.ndarray:
        try:
            return self.columns[column]
        except KeyError:
            raise InputError(
                "the recording has no such column",
                field="column",
                value=column,
                nearest=nearest_name(column, self.columns),
            ) from None

    @property
    def ok(self) -> bool:
        """Whether the simulation ran to its end."""
        return self.status == "ok"

    def to_pandas(self) -> "pandas.DataFrame":
        """The columns [SI] as a pandas DataFrame, their units in `attrs["units"]` (needs pandas)."""
        return frame(self.columns, describe)

    def to_xarray(self) -> "xarray.Dataset":
        """The columns [SI] as an xarray Dataset over `time` (needs xarray).

        Each variable's `attrs` hold its `units` and `sign`; those of the Dataset the scenario's name, the
        status, and the metrics as texts with their units.
        """
        facts = {"scenario": self.scenario["name"], "status": self.status}
        return dataset(self.columns, describe, facts | {n: str(m) for n, m in self.metrics.items()})

    def save(
        self, folder: str | os.PathLike[str], *, rrd: bool = True, rate: float | None = None
    ) -> pathlib.Path:
        """Write recording.parquet, summary.json, model.xml and, with `rrd`, recording.rrd.

        The files appear together; an older run in the folder stays whole until then.

        Parameters
        ----------
        folder : made if need be
        rrd : also write recording.rrd
        rate : samples a second in it [Hz]; the run's own by default

        Returns
        -------
        the folder
        """
        drawn = rrd and len(self["time"]) > 0
        picture = (lambda path: shown().write(self, path, rate)) if drawn else None
        return write_run(self, pathlib.Path(folder), picture)

    def model(self) -> "mujoco.MjModel":
        """The model that ran, to the last bit: from the same state, the same inputs give the same steps.

        Its muscles pull inside `afo_sim.native.installed()` only. `model_xml` is to look at: its numbers are
        cut to six digits. A run that holds no model, or that of another MuJoCo, has its scenario built
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
        """Contents of summary.json; of walking, `strides` too."""
        found: dict[str, Any] = {
            "status": self.status,
            "scenario": self.scenario,
            "metrics": _as_json(self.metrics),
            "versions": self.versions,
            "timing": self.timing,
            "warnings": list(self.warnings),
        }
        if self.strides:
            found["strides"] = [{"stride": k, "metrics": _as_json(m)} for k, m in self.strides.items()]
        return found


def _as_json(metrics: dict[str, Metric]) -> dict[str, dict[str, Any]]:
    return {name: {"value": metric.value, "unit": metric.unit} for name, metric in metrics.items()}


def read_recording(folder: str | os.PathLike[str]) -> Recording:
    """The recording in a run's folder (or of a Parquet file).

    Raises
    ------
    InputError
        No run is there, or the file is damaged.

    Examples
    --------
    >>> folder = run("seated", {"duration": "1 s"}).save("runs/short", rrd=False)
    >>> read_recording(folder).status
    'ok'
    """
    return Recording(**read_run(folder))


def recording_header(file: Any, folder: str | os.PathLike[str]) -> Recording:
    """A run's Recording without its rows, from its opened Parquet file."""
    return Recording(columns={}, **read_header(file, folder))
