"""The model that ran, kept with its run to the last bit; and what its MJCF says of itself.

MJCF text cuts every number to six digits and holds no parameter of a muscle, so a model that is read from
it is another one. MuJoCo's own binary form is exact, but only one version of MuJoCo reads it: for another
one the model is built anew from the run's scenario, and must be the same.
"""

import base64
import functools
import json
import warnings
import zlib
from collections.abc import Mapping
from typing import Any, Protocol

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common.errors import CallbackError, InputError
from afo_sim.common.writing import json_text
from afo_sim.description.reader import load
from afo_sim.model.build import Built, build
from afo_sim.model.periodic import as_run

LABEL = (
    "<!-- Written by afo_sim, to look at: its numbers have six digits, and its muscles, valves and passive "
    "joint act only with afo_sim's callbacks. To simulate, take afo_sim.read_recording(FOLDER).model() and "
    "step it inside afo_sim.native.installed(). -->\n"
)
LARGEST = 32 * 2**20  # of a kept model as text; the Parquet format allows 100 MB [bytes]
_HEADER = 5 * 4  # of a binary: what it is, its floating point, MuJoCo's version and layout [bytes]
_NAME = "model.mjb"


class Kept(Protocol):
    """The parts of a recording from which its model comes back."""

    @property
    def model_binary(self) -> bytes: ...
    @property
    def model_xml(self) -> str: ...
    @property
    def parameters(self) -> dict[str, list[float]]: ...
    @property
    def scenario(self) -> dict[str, Any]: ...
    @property
    def versions(self) -> dict[str, str]: ...


def labelled(xml: str) -> str:
    """MJCF whose first line says that it is not the model that ran."""
    return xml if not xml or xml.startswith(LABEL) else LABEL + xml


def to_binary(model: mujoco.MjModel) -> bytes:
    """A model in MuJoCo's binary form, which keeps every bit."""
    buffer = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer.tobytes()


def packed(binary: bytes) -> str:
    """A binary as short text for a file's metadata; "" where it is too large for them."""
    text = base64.b64encode(zlib.compress(binary)).decode()
    return text if len(text) <= LARGEST else ""


def unpacked(text: str) -> bytes:
    """The binary of a text that `packed` has made; ValueError or zlib.error where it is none."""
    return zlib.decompress(base64.b64decode(text, validate=True)) if text else b""


def model_of(run: Kept) -> mujoco.MjModel:
    """The model that ran: as it was kept, or built anew from the scenario if only this gives the same."""
    if run.model_binary[:_HEADER] == _own_header():
        model = mujoco.MjModel.from_binary_path(_NAME, {_NAME: run.model_binary})
        _check_rows(model, run)
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


def _check_rows(model: mujoco.MjModel, run: Kept) -> None:
    """Refuse parameters that stand in other places than this package's callbacks read them at."""
    try:
        if model.nuser_actuator != native.N_USER:
            raise CallbackError(
                f"its actuators have {model.nuser_actuator} parameters instead of {native.N_USER}"
            )
        native.assert_rows(model)
    except CallbackError as error:
        raise InputError(
            f"the model that ran is of another version of this package: {error}",
            allowed=f"the version that made the run ({run.versions.get('afo-sim', 'unknown')}), or run its "
            "scenario again",
        ) from None


def _built_anew(run: Kept) -> mujoco.MjModel:
    """The model of the run's scenario, if it is the one that ran."""
    try:
        scenario = load("scenario", run.scenario)
        # Where its settled stride was solved for, a run has a step of its own; where a policy chose, not.
        builts = [build(description) for description in (as_run(scenario), scenario)]
    except InputError as error:
        raise _lost(run, f"its scenario cannot be built: {error}") from None
    changes = [_change(built, run) for built in builts]
    if all(changes):
        raise _lost(run, f"what its scenario builds now is another model: {changes[0]}")
    return builts[changes.index("")].full_model


def _change(built: Built, run: Kept) -> str:
    """What is not the same: a parameter to the last digit, the rest to the six digits of MJCF; or ""."""
    rows = json.loads(json_text(parameters_of(built.model)))
    before = json.loads(json_text(run.parameters))
    for name in {**before, **rows}:
        if rows.get(name) != before.get(name):
            return f"actuator {name!r} has other parameters"
    return "" if _same_text(built.xml, run.model_xml) else "a body, a joint or a path is another one"


def _same_text(now: str, before: str) -> bool:
    """Whether two MJCF texts, perhaps written by two versions of MuJoCo, are one model."""
    if labelled(now) == labelled(before):
        return True
    try:
        first, second = (to_binary(mujoco.MjModel.from_xml_string(xml)) for xml in (now, before))
    except ValueError:
        return False
    return first == second


def parameters_of(model: mujoco.MjModel) -> dict[str, list[float]]:
    """The rows of `actuator_user` by the actuators' names."""
    return {model.actuator(i).name: model.actuator_user[i].tolist() for i in range(model.nu)}


def _reason(run: Kept) -> str:
    """Why the kept model cannot be read."""
    if not run.model_binary:
        return "the run holds no model (it was saved before models were kept, or its meshes are too large)"
    kept, own = run.versions.get("mujoco", "unknown"), mujoco.__version__
    where = "on another kind of machine" if kept == own else f"by MuJoCo {kept}, and {own} is installed"
    return f"the model that ran was kept {where}"


def _lost(run: Kept, problem: str) -> InputError:
    """The refusal where no model is the one that ran."""
    kept = _facts(run.versions)
    return InputError(f"{_reason(run)}; {problem}", allowed=f"the versions of the run: {kept}")


def _facts(versions: Mapping[str, str]) -> str:
    return ", ".join(f"{name} {versions.get(name, 'unknown')}" for name in ("mujoco", "afo-sim"))
