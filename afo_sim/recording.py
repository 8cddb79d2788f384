"""The one result of a simulation: columns with units and provenance, and its files."""

import dataclasses
import importlib.metadata
import json
import os
import pathlib
import platform
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from afo_sim import native
from afo_sim.errors import InputError
from afo_sim.metrics import Metric, ankle_metrics
from afo_sim.model import Built
from afo_sim.mounting import muscle_names
from afo_sim.units import AMBIENT_PRESSURE, GAS_CONSTANT

if TYPE_CHECKING:
    import pandas

    from afo_sim.simulate import Rollout

PARQUET, SUMMARY, MODEL, RERUN = "recording.parquet", "summary.json", "model.xml", "recording.rrd"

ROW_GROUP = 8192  # rows that a reader of a long run holds at a time

# Unit and sign of every column, by the last parts of its path.
COLUMNS = {
    "time": ("s", "start of the step"),
    "ankle/angle": ("rad", "dorsiflexion positive"),
    "ankle/velocity": ("rad/s", "dorsiflexion positive"),
    "ankle/acceleration": ("rad/s^2", "dorsiflexion positive; instantaneous, not the step's mean"),
    "ankle/moment/orthosis": (
        "N*m",
        "internal, dorsiflexion positive; all muscles of the orthosis, instantaneous",
    ),
    "ankle/moment/passive": ("N*m", "internal, dorsiflexion positive; tissue, damping and stops"),
    "ankle/moment/gravity": ("N*m", "dorsiflexion positive; weight of foot, plate and muscles"),
    "force": ("N", "tension positive"),
    "length": ("m", "active braid length"),
    "velocity": ("m/s", "lengthening positive"),
    "contraction": ("", "(L0 - L)/L0, shorter is positive"),
    "moment_arm": ("m", "-dL/dtheta; positive when tension dorsiflexes"),
    "pressure": ("Pa", "gauge"),
    "mass": ("kg", "air in the chamber"),
    "volume": ("m^3", "muscles and tube"),
    "temperature": ("K", "absolute"),
    "mass_flow_in": ("kg/s", "into the chamber, through either valve"),
    "mass_flow_out": ("kg/s", "out of the chamber, through either valve"),
    "coil": ("", "command, 0 to 1"),
    "opening": ("", "seat, 0 to 1"),
    "mass_flow": ("kg/s", "supply to chamber to ambient positive"),
    "qpos": ("rad", "MuJoCo coordinate"),
}


def describe(column: str) -> tuple[str, str]:
    """(unit, sign) of a column."""
    if column in COLUMNS:
        return COLUMNS[column]
    if column.startswith("qpos/"):
        return COLUMNS["qpos"]
    return COLUMNS[column.rsplit("/", 1)[1]]


@dataclass(frozen=True, repr=False)
class Recording:
    """One simulation's result. Indexing gives a column: `run["ankle/angle"]` [SI] (n,)."""

    columns: dict[str, np.ndarray]
    metrics: dict[str, Metric]
    scenario: dict[str, Any]
    model_xml: str
    status: str
    warnings: tuple[str, ...]
    timing: dict[str, float]
    versions: dict[str, str]
    parameters: dict[str, list[float]]

    def __repr__(self) -> str:
        rows = len(self.columns.get("time", ()))
        return f"<Recording of {self.scenario['name']!r}: {self.status}, {rows} rows>"

    def __getitem__(self, column: str) -> np.ndarray:
        try:
            return self.columns[column]
        except KeyError:
            from afo_sim.errors import nearest_name

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
        """The columns as a pandas DataFrame (needs pandas)."""
        import pandas

        return pandas.DataFrame(self.columns)

    def save(
        self, folder: str | os.PathLike[str], *, rrd: bool = True, rate: float | None = None
    ) -> pathlib.Path:
        """Write recording.parquet, summary.json, model.xml and, with `rrd`, recording.rrd."""
        return save(self, pathlib.Path(folder), rrd=rrd, rate=rate)

    def view(self) -> None:
        """Open the run in the Rerun viewer."""
        from afo_sim.view import open_recordings, write_rrd

        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / RERUN
            write_rrd(self, path)
            open_recordings([path])

    def summary(self) -> dict[str, Any]:
        """What summary.json says."""
        return {
            "status": self.status,
            "scenario": self.scenario,
            "metrics": {n: {"value": m.value, "unit": m.unit} for n, m in self.metrics.items()},
            "versions": self.versions,
            "timing": self.timing,
            "warnings": list(self.warnings),
        }


def make_recording(built: Built, control: np.ndarray, rollout: "Rollout") -> Recording:
    """Name the rows of a roll-out, and compute metrics and warnings.

    Parameters
    ----------
    built : compiled scenario
    control : inputs (n_step, nu)
    rollout : aligned rows

    Returns
    -------
    Recording at the scenario's record rate; the metrics are of every step.
    """
    scenario = built.scenario
    columns = _columns(built, control, rollout.rows, rollout.first_step)
    n = len(columns["time"])
    metrics = ankle_metrics(columns, scenario.timestep, scenario.timer.period) if n else {}
    stride = scenario.record_stride
    warnings = (*built.warnings, *(_limit_warnings(built, columns) if n else ()))
    return Recording(
        columns={name: np.ascontiguousarray(values[::stride]) for name, values in columns.items()},
        metrics=metrics,
        scenario=scenario.resolved(),
        model_xml=built.xml,
        status="ok" if rollout.failure is None else f"failed: {rollout.failure}",
        warnings=warnings,
        timing={
            "wall_seconds": rollout.wall_seconds,
            "steps": n,
            "steps_per_second": n / rollout.wall_seconds if rollout.wall_seconds else 0.0,
            **{f"{name}_stability_number": number for name, number in built.stability.items()},
        },
        versions=_versions(),
        parameters={
            built.model.actuator(i).name: built.model.actuator_user[i].tolist() for i in range(built.model.nu)
        },
    )


def _columns(
    built: Built, control: np.ndarray, rows: dict[str, np.ndarray], first_step: int
) -> dict[str, np.ndarray]:
    model, index = built.model, built.index
    n = len(rows["time"])
    dof, qpos = index.ankle_dof, index.ankle_qpos
    passive_tissue = rows["actuator_force"][:, index.passive]
    columns = {
        "time": (first_step + np.arange(n)) * built.scenario.timestep,
        "ankle/angle": rows["qpos"][:, qpos],
        "ankle/velocity": rows["qvel"][:, dof],
        "ankle/acceleration": rows["qacc"][:, dof],
        "ankle/moment/orthosis": rows["qfrc_actuator"][:, dof] - passive_tissue,
        "ankle/moment/passive": passive_tissue
        + rows["qfrc_passive"][:, dof]
        + rows["qfrc_constraint"][:, dof],
        "ankle/moment/gravity": 0.0 - rows["qfrc_bias"][:, dof],
    }
    for name, i in index.muscles.items():
        parameters = model.actuator_user[i]
        nominal = parameters[native.MUSCLE_NOMINAL_LENGTH]
        length = rows["actuator_length"][:, i] - parameters[native.MUSCLE_SERIES_LENGTH]
        tendon = int(model.actuator_trnid[i, 0])
        adr = int(model.ten_J_rowadr[tendon])
        dofs = list(model.ten_J_colind[adr : adr + model.ten_J_rownnz[tendon]])
        columns[f"muscle/{name}/force"] = 0.0 - rows["actuator_force"][:, i]  # and never −0.0
        columns[f"muscle/{name}/length"] = length
        columns[f"muscle/{name}/velocity"] = rows["actuator_velocity"][:, i]
        columns[f"muscle/{name}/contraction"] = (nominal - length) / nominal
        columns[f"muscle/{name}/moment_arm"] = -rows["ten_J"][:, adr + dofs.index(dof)]
    for number, (name, i) in enumerate(index.chambers.items()):
        columns |= _chamber_columns(built, control[:n], rows, name, number, i)
    if index.chambers:
        columns["supply/pressure"] = control[:n, next(iter(index.chambers.values()))]
    for joint in range(model.njnt):
        columns[f"qpos/{model.joint(joint).name}"] = rows["qpos"][:, model.jnt_qposadr[joint]]
    return columns


def _chamber_columns(
    built: Built, control: np.ndarray, rows: dict[str, np.ndarray], name: str, number: int, i: int
) -> dict[str, np.ndarray]:
    adr = built.model.actuator_actadr[i]
    mass, pressure = rows["act"][:, adr], rows["act"][:, adr + 2]
    first = native.FLOWS_PER_CHAMBER * number
    inlet, outlet, volume = rows["userdata"][:, first : first + 3].T
    columns = {
        f"chamber/{name}/pressure": pressure - AMBIENT_PRESSURE,
        f"chamber/{name}/mass": mass,
        f"chamber/{name}/volume": volume,
        f"chamber/{name}/temperature": pressure * volume / (mass * GAS_CONSTANT),
        f"chamber/{name}/mass_flow_in": np.maximum(inlet, 0.0) + np.maximum(-outlet, 0.0),
        f"chamber/{name}/mass_flow_out": np.maximum(outlet, 0.0) + np.maximum(-inlet, 0.0),
    }
    for side, flow in (("inlet", inlet), ("outlet", outlet)):
        valve = f"{name}_{side}"
        actuator = built.index.valves[valve]
        columns[f"valve/{valve}/coil"] = control[:, actuator]
        columns[f"valve/{valve}/opening"] = rows["act"][:, built.model.actuator_actadr[actuator] + 1]
        columns[f"valve/{valve}/mass_flow"] = flow
    return columns


def _limit_warnings(built: Built, columns: dict[str, np.ndarray]) -> Iterator[str]:
    """Where a muscle leaves its stated limits of pressure, force or contraction."""
    time = columns["time"]
    groups = muscle_names(built.scenario.orthosis)
    for name, group in groups.items():
        limits = group.type.limits
        chamber = group.chamber or name.rsplit("_", 1)[0]
        pressure = columns[f"chamber/{chamber}/pressure"]
        force = columns[f"muscle/{name}/force"]
        contraction = columns[f"muscle/{name}/contraction"]
        # a slack muscle is shorter on paper only: its cable hangs through
        pulling = np.where(force > 0.0, contraction, np.minimum(contraction, limits.contraction_max))
        for word, values, limit, unit in (
            ("gauge pressure", pressure * 1e-5, limits.pressure * 1e-5, " bar"),
            ("force", force, limits.force, " N"),
            ("contraction", pulling, limits.contraction_max, ""),
            ("stretch", -contraction, -limits.contraction_min, ""),
        ):
            worst = int(np.argmax(values))
            if values[worst] > limit:
                yield (
                    f"{name}: {word} reaches {values[worst]:.3g}{unit} at {time[worst]:.3f} s, "
                    f"beyond its limit of {limit:.3g}{unit}"
                )
        filled = float(pressure.max())
        if filled > 1e5 and force.max() < 1.0:
            yield (
                f"{name} never pulls, although its chamber reaches {filled * 1e-5:.2g} bar: "
                "its cable hangs through; shorten link_length or slack"
            )
    lower, upper = built.model.joint("ankle").range
    angle = columns["ankle/angle"]
    if angle.min() <= lower or angle.max() >= upper:
        yield "the ankle reaches a stop of the joint"


def _versions() -> dict[str, str]:
    packages = ("afo-sim", "mujoco", "numpy", "numba", "rerun-sdk")
    found = {"python": platform.python_version()}
    for package in packages:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            found[package] = "not installed"
    return found


@contextmanager
def replacing(path: pathlib.Path) -> Iterator[pathlib.Path]:
    """A temporary path beside `path` that takes its place when the block ends well."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    os.close(handle)
    temporary = pathlib.Path(name)
    try:
        yield temporary
        temporary.chmod(0o644)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def check_writable(folder: pathlib.Path) -> None:
    """Say so if an output folder cannot be made or written to; nothing is left behind."""
    try:
        existing = folder.absolute()
        while not existing.exists():
            existing = existing.parent
        with tempfile.TemporaryDirectory(dir=existing):
            pass
    except OSError as error:
        raise InputError(
            f"cannot be written to: {error.strerror or error}", field="--out", value=str(folder)
        ) from None


def save(
    recording: Recording, folder: pathlib.Path, *, rrd: bool = True, rate: float | None = None
) -> pathlib.Path:
    """Write the files of a run; each appears whole or not at all.

    Parameters
    ----------
    recording : what to write
    folder : made if need be
    rrd : also write recording.rrd
    rate : samples a second in it [Hz]; the run's own by default

    Returns
    -------
    the folder
    """
    check_writable(folder)
    folder.mkdir(parents=True, exist_ok=True)
    writers: dict[str, Callable[[pathlib.Path], object]] = {
        PARQUET: lambda path: write_parquet(recording, path),
        MODEL: lambda path: path.write_text(recording.model_xml, encoding="utf-8"),
        SUMMARY: lambda path: path.write_text(
            json.dumps(_json_numbers(recording.summary()), indent=2, ensure_ascii=False) + "\n",
            encoding="utf-8",
        ),
    }
    if rrd and len(recording["time"]):
        from afo_sim.view import write_rrd

        writers[RERUN] = lambda path: write_rrd(recording, path, rate=rate)
    else:
        (folder / RERUN).unlink(missing_ok=True)  # not another run's
    for name, write in writers.items():
        with replacing(folder / name) as path:
            write(path)
    return folder


def _json_numbers(value: Any) -> Any:
    """NaN is no JSON: null instead."""
    if isinstance(value, dict):
        return {key: _json_numbers(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_json_numbers(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


def write_parquet(recording: Recording, path: pathlib.Path) -> None:
    """One row per sample; unit and sign in each column's metadata, the run in the schema's."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields = []
    for name in recording.columns:
        unit, sign = describe(name)
        fields.append(pa.field(name, pa.float64(), metadata={"unit": unit, "sign": sign}))
    run = recording.summary() | {"model_xml": recording.model_xml, "parameters": recording.parameters}
    schema = pa.schema(fields, metadata={"afo_sim": json.dumps(_json_numbers(run))})
    table = pa.table([pa.array(v) for v in recording.columns.values()], schema=schema)
    pq.write_table(table, path, row_group_size=ROW_GROUP)


def open_parquet(folder: str | os.PathLike[str]) -> Any:
    """The Parquet file of a run's folder (or itself), opened but not read.

    Raises
    ------
    InputError
        No run is there, or the file is damaged.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = pathlib.Path(folder)
    path = path / PARQUET if path.is_dir() else path
    if not path.is_file():
        raise InputError(f"there is no run here ({PARQUET} is missing)", file=folder)
    try:
        return pq.ParquetFile(path, pre_buffer=False)
    except (pa.ArrowException, OSError) as error:
        raise InputError(f"is not a recording of this program: {error}", file=path) from None


def recording_header(file: Any, folder: str | os.PathLike[str]) -> Recording:
    """A run's Recording without its rows, from its opened Parquet file."""
    try:
        run = json.loads(file.schema_arrow.metadata[b"afo_sim"])
        return Recording(
            columns={},
            metrics={
                n: Metric(m["value"] if m["value"] is not None else float("nan"), m["unit"])
                for n, m in run["metrics"].items()
            },
            scenario=run["scenario"],
            model_xml=run["model_xml"],
            status=run["status"],
            warnings=tuple(run["warnings"]),
            timing=run["timing"],
            versions=run["versions"],
            parameters=run["parameters"],
        )
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"is not a recording of this program: {error}", file=folder) from None


def read_recording(folder: str | os.PathLike[str]) -> Recording:
    """The recording in a run's folder (or of a Parquet file).

    Raises
    ------
    InputError
        No run is there, or the file is damaged.
    """
    import pyarrow as pa

    file = open_parquet(folder)
    header = recording_header(file, folder)
    try:
        table = file.read()
    except (pa.ArrowException, OSError) as error:
        raise InputError(f"is not a recording of this program: {error}", file=folder) from None
    return dataclasses.replace(header, columns={name: table[name].to_numpy() for name in table.column_names})
