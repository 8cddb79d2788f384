"""The one result of a simulation: columns with units and provenance, metrics, warnings."""

import functools
import importlib.metadata
import os
import pathlib
import platform
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from afo_sim import native
from afo_sim.common.errors import InputError, nearest_name
from afo_sim.common.units import AMBIENT_PRESSURE, GAS_CONSTANT
from afo_sim.description.muscle import Muscle
from afo_sim.description.scenario import Scenario
from afo_sim.metrics.ankle import ankle_metrics
from afo_sim.metrics.metric import Metric
from afo_sim.metrics.walking import WalkMetrics, walk_metrics
from afo_sim.model.build import Built
from afo_sim.model.mounting import chamber_of, muscle_names
from afo_sim.physics.hill import braid_force
from afo_sim.physics.laws import LAWS
from afo_sim.physics.static_force import static_force
from afo_sim.simulation.exchange import dataset, frame
from afo_sim.simulation.shown import shown
from afo_sim.simulation.walk_columns import WALKING, walking_columns

if TYPE_CHECKING:
    import pandas
    import xarray

    from afo_sim.simulation.rollout import Rollout

NEGLIGIBLE = 0.01  # share of a muscle's force limit below which its law's range does not matter

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
    "ankle/moment/passive": ("N*m", "internal, dorsiflexion positive; tissue, damping, friction and stops"),
    "ankle/moment/load": ("N*m", "dorsiflexion positive; the scenario's constant load moment"),
    "ankle/moment/gravity": ("N*m", "dorsiflexion positive; weight of foot, plate and muscles"),
    **WALKING,
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
    """One simulation's result. Indexing gives a column: `run["ankle/angle"]` [SI] (n,).

    Angles are dorsiflexion positive, pressures gauge. `metrics` are numbers that know their unit; `strides`
    holds those of each whole stride of walking, by the stride's number. `status` is "ok" or says why the
    simulation stopped; `warnings` tell what to mind. A notebook shows a recording with figures.

    Raises
    ------
    InputError
        There is no such column.

    Examples
    --------
    >>> seated = run("seated", {"duration": "1 s"})
    >>> seated["time"].shape, seated["ankle/angle"].shape
    ((1000,), (1000,))
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

    def __repr__(self) -> str:
        rows, told = len(self.columns.get("time", ())), len(self.warnings)
        counted = f"{rows} rows × {len(self.columns)} columns, {len(self.metrics)} metrics"
        more = f", {told} warning{'s' if told > 1 else ''}" if told else ""
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

        Parameters
        ----------
        folder : made if need be
        rrd : also write recording.rrd
        rate : samples a second in it [Hz]; the run's own by default

        Returns
        -------
        the folder
        """
        from afo_sim.simulation.files import save

        return save(self, pathlib.Path(folder), rrd=rrd, rate=rate)

    def view(self) -> None:
        """Open the run in the Rerun viewer."""
        from afo_sim.show.rerun import open_recordings, write_rrd
        from afo_sim.simulation.files import RERUN

        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / RERUN
            write_rrd(self, path)
            open_recordings([path])

    def summary(self) -> dict[str, Any]:
        """What summary.json says; of walking, `strides` too."""
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
    columns, found = examine(built, control, rollout)
    n, stride = len(columns["time"]), scenario.record_stride
    return Recording(
        # copies: the recording is its user's, while the recorded walking is shared by later runs
        columns={name: np.array(values[::stride]) for name, values in columns.items()},
        metrics=found.totals,
        strides=found.strides,
        scenario=scenario.resolved(),
        model_xml=built.xml,
        status="ok" if rollout.failure is None else f"failed: {rollout.failure}",
        warnings=(*built.warnings, *(_limit_warnings(built, columns) if n else ()), *found.warnings),
        timing={
            "wall_seconds": rollout.wall_seconds,
            "steps": n,
            "steps_per_second": n / rollout.wall_seconds if rollout.wall_seconds else 0.0,
            **{f"{name}_stability_number": number for name, number in built.stability.items()},
        },
        versions=versions(),
        parameters={
            built.model.actuator(i).name: built.model.actuator_user[i].tolist() for i in range(built.model.nu)
        },
    )


def examine(
    built: Built, control: np.ndarray, rollout: "Rollout", *, transient: bool = True
) -> tuple[dict[str, np.ndarray], WalkMetrics]:
    """Columns of every step of a roll-out, and what they say in numbers; the transient's strides if asked."""
    columns = _columns(built, control, rollout.rows, rollout.first_step)
    return columns, _metrics(built, columns, transient) if len(columns["time"]) else WalkMetrics({}, {}, ())


def _metrics(built: Built, columns: dict[str, np.ndarray], transient: bool) -> WalkMetrics:
    """Of walking for each stride and over all; of a fixed shank over all only."""
    scenario = built.scenario
    if built.walk is not None:
        return walk_metrics(columns, scenario.timestep, built.body_mass, transient=transient)
    words = scenario.leg.directions
    return WalkMetrics(ankle_metrics(columns, scenario.timestep, _period(scenario), words), {}, ())


def _period(scenario: Scenario) -> float:
    """What one cycle is: the timer's, or all of the run [s]."""
    if scenario.timer is not None:
        return scenario.timer.period
    return scenario.duration


def _columns(
    built: Built, control: np.ndarray, rows: dict[str, np.ndarray], first_step: int
) -> dict[str, np.ndarray]:
    model, index = built.model, built.index
    n = len(rows["time"])
    dof, qpos = index.ankle_dof, index.ankle_qpos
    passive_tissue = rows["actuator_force"][:, index.passive]
    load = built.scenario.load_moment
    columns = {
        "time": (first_step + np.arange(n)) * built.scenario.timestep,
        "ankle/angle": rows["qpos"][:, qpos],
        "ankle/velocity": rows["qvel"][:, dof],
        "ankle/moment/orthosis": rows["qfrc_actuator"][:, dof] - passive_tissue,
    }
    whole = "qacc" in rows  # else recorded for metrics alone
    if whole:
        held = load + rows["qfrc_passive"][:, dof] + rows["qfrc_constraint"][:, dof]
        columns["ankle/acceleration"] = rows["qacc"][:, dof]
        columns["ankle/moment/passive"] = passive_tissue + held
        columns["ankle/moment/gravity"] = 0.0 - rows["qfrc_bias"][:, dof]
    if load:
        columns["ankle/moment/load"] = np.full(n, -load)
    if built.walk is not None:
        columns |= walking_columns(built, rows, control[:n], first_step)
    for name, i in index.muscles.items():
        columns[f"muscle/{name}/force"] = 0.0 - rows["actuator_force"][:, i]  # and never −0.0
        if not whole:
            continue
        parameters = model.actuator_user[i]
        nominal = parameters[native.MUSCLE_NOMINAL_LENGTH]
        length = rows["actuator_length"][:, i] - parameters[native.MUSCLE_SERIES_LENGTH]
        tendon = int(model.actuator_trnid[i, 0])
        adr = int(model.ten_J_rowadr[tendon])
        dofs = list(model.ten_J_colind[adr : adr + model.ten_J_rownnz[tendon]])
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
    inlet, outlet, volume = rows["userdata"][:, first : first + native.FLOWS_PER_CHAMBER].T
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
        chamber = chamber_of(name, group)
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
        if name.endswith("_1"):  # its neighbours say the same
            yield from _law_warnings(name, group.type, time, pressure, contraction, force)
        filled = float(pressure.max())
        if filled > 1e5 and force.max() < 1.0:
            strongest = static_force(
                LAWS[group.type.law].native_id, 0.0, filled, [*group.type.coefficients], 0
            )
            reason = (
                "its cable hangs through; shorten link_length or slack"
                if strongest > 1.0
                else f"its law, {group.type.law}, gives no force at that pressure"
            )
            yield f"{name} never pulls, although its chamber reaches {filled * 1e-5:.2g} bar: {reason}"
    lower, upper = built.model.joint("ankle").range
    angle = columns["ankle/angle"]
    if angle.min() <= lower or angle.max() >= upper:
        yield "the ankle reaches a stop of the joint"


def _law_warnings(
    name: str,
    muscle: Muscle,
    time: np.ndarray,
    pressure: np.ndarray,
    contraction: np.ndarray,
    force: np.ndarray,
) -> Iterator[str]:
    """Where a pulling muscle's law was asked outside the range that it is known to hold in."""
    law = muscle.law_set
    # stretched, the braid carries; the law is asked at zero contraction
    braid = np.zeros_like(force)
    for k in np.flatnonzero(contraction < 0.0):
        braid[k] = braid_force(contraction[k], muscle.braid_stiffness)
    pulling = force - braid > NEGLIGIBLE * muscle.limits.force
    for word, values, (lower, upper), unit in (
        ("gauge pressure", pressure * 1e-5, np.multiply(law.pressure_range, 1e-5), " bar"),
        ("contraction", np.maximum(contraction, 0.0), law.contraction_range, ""),
    ):
        beyond = np.where(pulling, np.maximum(lower - values, values - upper), -np.inf)
        worst = int(np.argmax(beyond))
        if beyond[worst] > 1e-9:
            yield (
                f"{name.rsplit('_', 1)[0]}: the law {muscle.law} was asked at a {word} of "
                f"{values[worst]:.3g}{unit} at {time[worst]:.3f} s, outside its range of "
                f"{lower:g} to {upper:g}{unit}"
            )


@functools.cache
def versions() -> dict[str, str]:
    """What this result was computed with."""
    packages = ("afo-sim", "mujoco", "numpy", "numba", "rerun-sdk")
    found = {"python": platform.python_version()}
    for package in packages:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            found[package] = "not installed"
    return found
