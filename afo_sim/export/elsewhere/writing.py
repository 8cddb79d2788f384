"""The files of a scenario that runs elsewhere, written together or not at all."""

import importlib.metadata
import pathlib
import shutil
import sys
from collections.abc import Mapping

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import Given, InputError, check_writable, together, write_bytes, write_text
from afo_sim.description import load
from afo_sim.export.elsewhere.fmu import IDENTIFIER, binaries, description_of, zipped
from afo_sim.export.elsewhere.user_library import link_user_library
from afo_sim.export.elsewhere.variables import variables_of
from afo_sim.legs import Attached, mjcf_beside
from afo_sim.model import Built, as_run, started_xml, why_walked
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.simulation import Recording, as_taken, case_of, fixed

ELSEWHERE = {
    "plugin": "MuJoCo alone: README.md says how, in Python, in its viewer and in C",
    "c": "a C compiler: README.md says how; host.c is a whole program",
    "fmu": "what imports FMI 2.0 for co-simulation: Simulink, OMSimulator, fmpy simulate {name}",
}
MUJOCO = {"win32": "mujoco.dll", "darwin": "libmujoco.dylib"}.get(sys.platform, "libmujoco.so")
SOURCES = pathlib.Path(native.__file__).with_name("library")
TEXTS = pathlib.Path(__file__).with_name("texts")
AT_REST = 100  # steps of a model that brings no inputs of its own


def write_elsewhere(
    what: Given,
    to: str,
    out: pathlib.Path,
    sets: Mapping[str, object] | None = None,
    *,
    force: bool = False,
) -> tuple[tuple[pathlib.Path, ...], tuple[str, ...]]:
    """Files and notes of a scenario, or of a run's with its commands, written as `to` of ELSEWHERE has it."""
    if to == "fmu" and out.suffix.lower() != ".fmu":
        raise InputError("is not named as an FMU is", field="out", value=str(out), allowed="NAME.fmu")
    library = native.library_file()  # refused before anything is built
    recording = what if isinstance(what, Recording) else None
    if recording is not None and not recording.ok:
        raise InputError(
            "did not end successfully", field="run", value=recording.status, allowed="a run with status ok"
        )
    if recording is None and str(what).endswith((".xml", ".urdf")):
        allowed = "a scenario; of a model: afo-sim attach MODEL --orthosis NAME --to plugin"
        raise InputError("is a model, and no scenario", field="scenario", value=str(what), allowed=allowed)
    if recording is not None and sets:
        allowed = "a scenario; of a run its commands are written"
        raise InputError("does not go with a run", field="set", value=", ".join(sets), allowed=allowed)
    scenario = load("scenario", what if recording is None else recording.described, sets)
    notes = []
    if recording is not None:
        scenario = as_taken(scenario, recording)
    else:
        steps = f"steps are of {1e3 * scenario.timestep:g} ms"
        notes.append(f"{steps}; afo-sim run may halve them: its run is exported with those it took")
    if scenario.walking and not why_walked(scenario):
        notes.append("it holds the strides from the start; afo-sim run solves for the settled one besides")
    _check_free(out, force)
    built = build(as_run(scenario))
    inputs = schedule.controls(built) if recording is None else _commanded(built, recording)
    with native.installed():
        case = case_of(built, fixed(inputs), inputs[0])
    if case.failure is not None:
        raise case.failure
    data = native.scratch(built.model)
    mujoco.mj_setState(built.model, data, case.state, mujoco.mjtState.mjSTATE_INTEGRATION)
    variables = list(variables_of(built, inputs[0]))
    with together(out.parent if to == "fmu" else out) as scratch:
        whole = scratch / "unpacked" if to == "fmu" else scratch
        place, code, beside = (
            (whole / "resources", whole / binaries(), whole / "documentation")
            if to == "fmu"
            else (whole,) * 3
        )
        for folder in (place, code, beside):
            folder.mkdir(parents=True, exist_ok=True)
        _write_model(place, built.spec, data, inputs)
        _copy_library(library, code, beside)
        link_user_library(built.model, code)
        if to != "plugin":
            write_bytes(place / "start.bin", np.ascontiguousarray(case.state, "<f8").tobytes())
            write_text(place / "variables.txt", "".join(f"{each.line}\n" for each in variables))
            shutil.copyfile(native.mujoco_library(), code / MUJOCO)
            write_text(beside / "LICENSE-mujoco", _licence("mujoco"))
        end = len(inputs) * scenario.timestep
        if to == "fmu":
            description = description_of(scenario.name, variables, scenario.timestep, end)
            write_bytes(whole / "modelDescription.xml", description)
            zipped(whole, scratch / out.name)
            shutil.rmtree(whole)
        else:
            told = f"the scenario's own {len(inputs)} steps"
            _write_readme(scratch, to, library, name=scenario.name, steps=told, prefix="")
        if to == "c":
            shutil.copyfile(SOURCES / "afo_sim.h", scratch / "afo_sim.h")
            text = (TEXTS / "host.c").read_text(encoding="utf-8")
            write_text(scratch / "host.c", text.replace("@END@", repr(end)))
        written = sorted(file.relative_to(scratch) for file in scratch.rglob("*") if file.is_file())
    folder = out.parent if to == "fmu" else out
    return tuple(folder / file for file in written), (*map(str, built.warnings), *notes)


def export_attached(attached: Attached, out: pathlib.Path, *, force: bool = False) -> list[pathlib.Path]:
    """Write a model with its orthoses for MuJoCo alone; its key is the state at rest."""
    _check_free(out, force)
    library = native.library_file()
    with together(out) as scratch:
        data = attached.data()
        _write_model(scratch, attached.spec, data, np.tile(data.ctrl, (AT_REST, 1)))
        _copy_library(library, scratch, scratch)
        link_user_library(attached.model, scratch)
        name, told = attached.spec.modelname, f"{AT_REST} steps at rest"
        _write_readme(scratch, "plugin", library, name=name, steps=told, prefix=attached.prefix)
        written = sorted(file.relative_to(scratch) for file in scratch.rglob("*") if file.is_file())
    return [out / file for file in written]


def _write_model(folder: pathlib.Path, spec: mujoco.MjSpec, data: mujoco.MjData, inputs: np.ndarray) -> None:
    text = mjcf_beside(spec, "model", folder)
    write_text(folder / "model.xml", started_xml(text, data, plugin=True))
    write_bytes(folder / "inputs.bin", np.ascontiguousarray(inputs, "<f8").tobytes())


def _copy_library(library: pathlib.Path, folder: pathlib.Path, licences: pathlib.Path) -> None:
    shutil.copyfile(library, folder / library.name.replace("afo_sim", IDENTIFIER))
    write_text(licences / "LICENSE", _licence("afo-sim"))


def _licence(package: str) -> str:
    files = importlib.metadata.files(package) or ()
    file = next((each for each in files if each.name == "LICENSE"), None)
    return file.read_text(encoding="utf-8") if file else "Apache-2.0\n"


def _check_free(out: pathlib.Path, force: bool) -> None:
    if out.exists() and not force:
        allowed = "`force`, which replaces it, or another name with `out`"
        raise InputError("exists", field="out", value=str(out), allowed=allowed)
    check_writable(out.parent)


def _write_readme(folder: pathlib.Path, to: str, library: pathlib.Path, **facts: object) -> None:
    text = (TEXTS / f"{to}.md").read_text(encoding="utf-8")
    for key, value in (facts | {"library": library.name, "mujoco": MUJOCO}).items():
        text = text.replace(f"@{key.upper()}@", str(value))
    write_text(folder / "README.md", text)


def _commanded(built: Built, recording: Recording) -> np.ndarray:
    """Inputs of the steps of a run: the scenario's, with what a controller commanded in it."""
    inputs, index, stride = schedule.controls(built), built.index, built.scenario.record_stride
    asked = {f"chamber/{name}/target": i for name, i in index.drives.items()}
    for name, i in index.valves.items():
        if not native.is_driven(built.model, i) and native.first_way(built.model, i) is None:
            asked[f"valve/{name}/coil"] = i
    in_python = any(getattr(told, "code", "") == "controller-in-python" for told in recording.warnings)
    for column, i in asked.items():
        told = np.where(np.isnan(recording.columns[column]), schedule.OFF, recording.columns[column])
        told = told[: len(inputs[::stride])]
        if stride == 1:
            inputs[: len(told), i] = told
        elif (
            in_python
            or built.scenario.controller
            or not np.array_equal(told, inputs[::stride, i][: len(told)])
        ):
            problem, allowed = "holds commands of only some steps", "a run with --step fixed and all rows"
            raise InputError(problem, field="run", value=column, allowed=allowed)
    return inputs
