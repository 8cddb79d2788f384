"""The files of a run, written together or not at all, read whole or in blocks; and the model that ran."""

import base64
import functools
import json
import math
import os
import pathlib
import re
import warnings
import zlib
from collections.abc import Callable
from contextlib import suppress
from typing import Protocol

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import (
    MOST_GROUPS,
    CallbackError,
    Foreign,
    InputError,
    Json,
    JsonDict,
    Notice,
    check_writable,
    digest,
    file_digest,
    json_text,
    machine_code,
    open_parquet,
    parquet_column,
    parquet_writer,
    plausible,
    read_json,
    replacing,
    settle,
    together,
    unpack,
    write_json,
    write_text,
)
from afo_sim.description import Scenario
from afo_sim.metrics import Metric
from afo_sim.model import Built, as_run
from afo_sim.model.build import build

ENDING = ".parquet"  # of a run in one file
PARQUET, SUMMARY, MODEL, RERUN = "recording.parquet", "summary.json", "model.xml", "recording.rrd"
REPORT = "report.html"  # of the run that stood here before: it goes with it
FORMAT = 2  # of recordings; 1 had neither this number nor digests
RUN_KEY, DIGEST_KEY, MODEL_KEY = "afo_sim", "afo_sim_digest", "afo_sim_model"  # of the file's metadata
ROW_GROUP = 8192  # rows that a reader of a long run holds at a time

Write = Callable[[pathlib.Path], object]


class Run(Protocol):
    """The parts of a recording that its files hold, and from which its model comes back."""

    @property
    def columns(self) -> dict[str, np.ndarray]: ...
    @property
    def described(self) -> JsonDict: ...
    @property
    def scenario(self) -> Scenario: ...
    @property
    def model_xml(self) -> str: ...
    @property
    def model_binary(self) -> bytes: ...
    @property
    def versions(self) -> dict[str, str]: ...
    @property
    def parameters(self) -> dict[str, list[float]]: ...
    def describe(self, column: str) -> tuple[str, str]: ...
    def summary(self) -> JsonDict: ...


def write_run(recording: Run, folder: pathlib.Path, picture: Write | None) -> pathlib.Path:
    """Write the files of a run; they appear together, and an older run stays whole until then."""
    if folder.suffix == ENDING:
        with replacing(folder) as scratch:
            write_parquet(recording, scratch)
        return folder
    check_writable(folder)
    with together(folder, (PARQUET, SUMMARY, MODEL, RERUN, REPORT)) as scratch:
        write_parquet(recording, scratch / PARQUET)
        write_text(scratch / MODEL, recording.model_xml)
        if picture is not None:
            picture(scratch / RERUN)
        beside = (scratch / name for name in (MODEL, RERUN))  # the recording has its own
        digests = {file.name: file_digest(file) for file in beside if file.is_file()}
        write_json(scratch / SUMMARY, recording.summary() | {"digests": digests}, "summary")
    return folder


def intact_picture(folder: pathlib.Path) -> pathlib.Path | None:
    """A run's recording.rrd, if it is there as it was written (an older run: if it is there)."""
    path = folder / RERUN
    try:
        written = read_json(folder / SUMMARY).get("digests", {}) if (folder / SUMMARY).is_file() else {}
        return path if path.is_file() and written.get(RERUN) in (None, file_digest(path)) else None
    except (InputError, OSError, ValueError, AttributeError):
        return None


def write_parquet(recording: Run, path: pathlib.Path) -> None:
    """One row per sample; unit and sign in each column's metadata, the run in the schema's."""
    import pyarrow as pa

    fields = []
    for name in recording.columns:
        unit, sign = recording.describe(name)
        fields.append(pa.field(name, pa.float64(), metadata={"unit": unit, "sign": sign}))
    run = {"format": FORMAT, "columns": list(recording.columns)} | recording.summary()
    run |= {"model_xml": recording.model_xml, "parameters": recording.parameters}
    header = json_text(run)
    schema = pa.schema(fields, metadata={RUN_KEY: header, DIGEST_KEY: digest(header.encode())})
    table = pa.table(
        [parquet_column(np.asarray(v, float)) for v in recording.columns.values()], schema=schema
    )
    model = packed(recording.model_binary)
    with parquet_writer(path, schema, "recording") as file:
        file.write_table(table, row_group_size=max(ROW_GROUP, -(-len(table) // MOST_GROUPS)))
        if model:
            file.add_key_value_metadata({MODEL_KEY: model})


def open_run(folder: str | os.PathLike[str], *, damaged: bool = False) -> Foreign:
    """The Parquet file of a run's folder, checked but not read; `damaged` as of `open_parquet`."""
    path = pathlib.Path(folder)
    with suppress(InputError):  # a folder that may only be read stays as it is
        settle(path)
    path = path / PARQUET if path.is_dir() else path
    if not path.is_file():
        raise InputError(f"there is no run here ({PARQUET} is missing)", file=folder)
    return open_parquet(path, damaged=damaged)


_STRANGE = (AttributeError, KeyError, TypeError, ValueError, OverflowError, RecursionError, zlib.error)


def read_header(file: Foreign, folder: str | os.PathLike[str]) -> JsonDict:
    """Header of a run's opened Parquet file, by field of Recording; all but its rows."""
    run: Json = {}
    try:
        run = json.loads(file.schema_arrow.metadata[RUN_KEY.encode()])
        model = (file.metadata.metadata or {}).get(MODEL_KEY.encode(), b"")
        texts = run["warnings"]
        known = {one["text"]: Notice.from_json(one) for one in run.get("notices", ())}
        return {
            "metrics": _metrics(run["metrics"]),
            "strides": {row["stride"]: _metrics(row["metrics"]) for row in run.get("strides", ())},
            "described": run["scenario"],
            "model_xml": run["model_xml"],
            "model_binary": unpacked(model.decode()),
            "status": run["status"],
            "warnings": tuple(known.get(text, text) for text in texts),
            "timing": run["timing"],
            "versions": run["versions"],
            "parameters": run["parameters"],
            "studies": run.get("studies", {}),
            "labels": {each.name: _label(each.metadata or {}) for each in file.schema_arrow},
        }
    except _STRANGE as error:
        problem = f"is not a recording of this program: {type(error).__name__} {error}"
        stated = run.get("format") if isinstance(run, dict) else None
        if isinstance(stated, int) and stated > FORMAT:  # this program is too old for it
            by = run["versions"] if isinstance(run.get("versions"), dict) else {}
            problem = f"was written by afo-sim {by.get('afo-sim', 'unknown')} in format {stated}, but this "
            problem += f"program reads up to {FORMAT}"
        raise InputError(problem, file=folder) from None


def _label(metadata: dict[bytes, bytes]) -> tuple[str, str]:
    """(unit, sign) of a column."""
    return metadata.get(b"unit", b"").decode(), metadata.get(b"sign", b"").decode()


def _metrics(table: JsonDict) -> dict[str, Metric]:
    return {
        name: Metric(math.nan if metric["value"] is None else metric["value"], metric["unit"])
        for name, metric in table.items()
    }


def read_run(folder: str | os.PathLike[str]) -> JsonDict:
    """A run's files, by field of Recording."""
    import pyarrow as pa

    file = open_run(folder)
    header = read_header(file, folder)
    try:
        table = file.read()
    except (pa.ArrowException, OSError) as error:
        raise InputError(f"is not a recording of this program: {error}", file=folder) from None
    columns = {name: table[name].to_numpy() for name in table.column_names}
    plausible(columns.get("time", ()), file=folder, field="time")
    return header | {"columns": columns}


def read_undamaged(folder: str | os.PathLike[str]) -> JsonDict:
    """The intact part of a damaged run, by field of Recording; lost rows are NaN, with a notice."""
    import pyarrow as pa

    file = open_run(folder, damaged=True)
    stated = file.schema_arrow.metadata or {}
    if digest(stated.get(RUN_KEY.encode(), b"")) != stated.get(DIGEST_KEY.encode(), b"").decode():
        raise InputError("its header is damaged, so its rows cannot be interpreted", file=folder)
    header, columns, lost = read_header(file, folder), {}, []
    for name in file.schema_arrow.names:
        parts, rows = [], 0
        for group in range(file.num_row_groups):
            count = file.metadata.row_group(group).num_rows
            try:
                parts.append(file.read_row_group(group, columns=[name])[name].to_numpy())
            except (pa.ArrowException, OSError):
                parts.append(np.full(count, np.nan))
                lost.append(f"{name} (rows {rows} to {rows + count - 1})")
            rows += count
        columns[name] = np.concatenate(parts)
    plausible(columns.get("time", ()), file=folder, field="time")  # without it no row means anything
    text, named = "recovered from a damaged file; lost: {lost}", ", ".join(lost) or "nothing"
    notice = Notice("recovered", text, severity="error", lost=named)
    told = header["described"].get("description", "")  # which is the title of every picture
    header["described"] |= {"description": "; ".join(filter(None, [str(notice), told]))}
    return header | {"columns": columns, "warnings": (*header["warnings"], notice)}


LABEL = (
    "<!-- Written by afo_sim: muscles, valves and passive joint, whose parameters stand in the actuators' "
    "user data, act only with afo_sim's callbacks: step it inside afo_sim.native.installed(). -->\n"
)  # of model.xml
LARGEST = 32 * 2**20  # of a kept model as text; the Parquet format allows 100 MB [bytes]
UNPACKED = 8 * LARGEST  # of a kept model [bytes]
ROUNDING = 1e-12  # up to which a number in MJCF counts as zero; MuJoCo with six digits writes 0
_HEADER = 5 * 4  # of a binary: what it is, its floating point, MuJoCo's version and layout [bytes]
_NAME = "model.mjb"


def to_binary(model: mujoco.MjModel) -> bytes:
    """A model in MuJoCo's binary form, which keeps every bit."""
    buffer = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer.tobytes()


def packed(binary: bytes) -> str:
    """A binary as short text for a file's metadata; "" where it is too large for them."""
    text = base64.b64encode(zlib.compress(binary)).decode() if len(binary) <= UNPACKED else ""
    return text if len(text) <= LARGEST else ""


def unpacked(text: str) -> bytes:
    """The binary of a text that `packed` has made; ValueError or zlib.error where it is none."""
    return unpack(base64.b64decode(text, validate=True), UNPACKED) if text else b""


def model_of(run: Run) -> mujoco.MjModel:
    """The model that ran: as kept, or rebuilt from the scenario if that gives the same."""
    if run.model_binary[:_HEADER] == _own_header():
        model = mujoco.MjModel.from_binary_path(_NAME, {_NAME: run.model_binary})
        try:  # parameters in other places than this package's callbacks read them at are refused
            if model.nuser_actuator != native.N_USER:
                problem = f"its actuators have {model.nuser_actuator} parameters instead of {native.N_USER}"
                raise CallbackError(problem)
            native.assert_rows(model)
        except CallbackError as error:
            problem = f"the model that ran is of another version of this package: {error}"
            by = f"the version that made the run ({run.versions.get('afo-sim', 'unknown')})"
            raise InputError(problem, allowed=f"{by}, or run its scenario again") from None
        if native.user_kernels(model) - {number for number, _ in machine_code.USER_CODES}:
            problem = "moves by a law or friction of one's own, which is not registered here as it was then"
            raise InputError(problem, field="model", allowed="afo_sim.register(law) before")
        return model
    model = _built_anew(run)
    if run.model_binary:
        warnings.warn(
            f"{_reason(run)}: it is built anew from the run's scenario, with equal parameters, but another "
            "MuJoCo may step it to other last digits",
            stacklevel=3,
        )
    return model


@functools.cache
def _own_header() -> bytes:
    """The first bytes of every model that the installed MuJoCo writes."""
    return to_binary(mujoco.MjModel.from_xml_string("<mujoco/>"))[:_HEADER]


def _built_anew(run: Run) -> mujoco.MjModel:
    """The model of the run's scenario, if it is the one that ran."""
    try:
        # Where its settled stride was solved for, a run has a step of its own; where a policy chose, not.
        builts = [build(description) for description in (as_run(run.scenario), run.scenario)]
    except InputError as error:
        raise _lost(run, f"its scenario cannot be built: {error}") from None
    changes = [_change(built, run) for built in builts]
    if all(changes):
        raise _lost(run, f"what its scenario builds now is another model: {changes[0]}")
    return builts[changes.index("")].full_model


def _change(built: Built, run: Run) -> str:
    """What is not the same: a parameter to the last digit, the rest to six digits; or ""."""
    rows = json.loads(json_text(parameters_of(built.model)))
    before = json.loads(json_text(run.parameters))
    for name in {**before, **rows}:
        if rows.get(name) != before.get(name):
            return f"actuator {name!r} has other parameters"
    now, then = _six_digits(built.xml), _six_digits(run.model_xml)
    if now == then:
        return ""
    with suppress(ValueError):  # perhaps another version of MuJoCo wrote the one model
        if to_binary(mujoco.MjModel.from_xml_string(now)) == to_binary(mujoco.MjModel.from_xml_string(then)):
            return ""
    return "a body, a joint or a path is another one"


def _six_digits(xml: str) -> str:
    """MJCF without its label and parameters, and with six digits: as earlier versions wrote it."""
    bare = re.sub(r' user="[^"]*"', "", xml[xml.find("<mujoco ") :])
    number = r'(?<=[" ])-?\d+(\.\d+)?(e[+-]?\d+)?(?=[" ])'
    return re.sub(number, lambda found: f"{x:g}" if abs(x := float(found[0])) > ROUNDING else "0", bare)


def parameters_of(model: mujoco.MjModel) -> dict[str, list[float]]:
    """The rows of `actuator_user` by the actuators' names."""
    return {model.actuator(i).name: model.actuator_user[i].tolist() for i in range(model.nu)}


def _reason(run: Run) -> str:
    """Why the kept model cannot be read."""
    if not run.model_binary:
        return "the run holds no model (it was saved before models were kept, or its meshes are too large)"
    kept, own = run.versions.get("mujoco", "unknown"), mujoco.__version__
    where = "on another kind of machine" if kept == own else f"by MuJoCo {kept}, and {own} is installed"
    return f"the model that ran was kept {where}"


def _lost(run: Run, problem: str) -> InputError:
    """The refusal where no model is the one that ran."""
    kept = ", ".join(f"{name} {run.versions.get(name, 'unknown')}" for name in ("mujoco", "afo-sim"))
    return InputError(f"{_reason(run)}; {problem}", allowed=f"the versions of the run: {kept}")
