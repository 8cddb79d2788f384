"""The callbacks, compiled or as plain Python: installed for a block, and shown to act."""

import functools
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any, Literal

import mujoco
import numpy as np

from afo_sim.common.errors import CallbackError
from afo_sim.native.callbacks import define
from afo_sim.native.compiled import callbacks
from afo_sim.native.complaints import COMPLAINTS, FINE
from afo_sim.native.network import network_dyn
from afo_sim.native.refuse import marked_only
from afo_sim.native.slots import (
    CHAMBER_FIRST_MUSCLE,
    CHAMBER_INLET,
    CHAMBER_NEXT,
    CHAMBER_OUTLET,
    FRICTION_MUSCLE,
    KIND_CHAMBER,
    KIND_FRICTION,
    KIND_MOTOR,
    KIND_MUSCLE,
    KIND_NETWORK,
    KIND_PAD,
    KIND_PASSIVE,
    KIND_SPASTIC,
    KIND_VALVE,
    MARK,
    MUSCLE_CHAMBER,
    MUSCLE_FRICTION_STATES,
    MUSCLE_LEADER,
    MUSCLE_NEXT,
    MUSCLE_USERDATA,
    NETWORK_FIRST_CHAMBER,
    PAD_FLOOR,
)
from afo_sim.native.state import TENSION
from afo_sim.native.struct_layout import verify

Mode = Literal["native", "python"]


@functools.cache
def _native_callbacks() -> tuple[Any, Any]:
    verify()
    return callbacks()


class KernelFailure(Exception):
    """The complaint of a kernel in Python mode, where compiled callbacks call `mju_error`."""


@functools.cache
def _python_callbacks() -> tuple[Any, Any]:
    def fail(complaint: int, actuator: int) -> None:
        raise KernelFailure(f"{COMPLAINTS[complaint]} {actuator}")

    bias, dyn = (marked_only(kernel, fail) for kernel in define(fail))

    def total(kernel: Any) -> Any:
        def callback(m: Any, d: Any, i: int) -> float:
            try:
                return float(kernel(_flat(m), d, i))
            except (ArithmeticError, ValueError) as error:  # compiled code gives inf or NaN instead
                raise KernelFailure(f"{error} in actuator {i}") from None

        return callback

    return total(bias), total(dyn)


def _flat(m: Any) -> Any:
    """The fields of a model that the kernels read, with the rows end to end as compiled code sees them."""
    return SimpleNamespace(
        nuser_actuator=m.nuser_actuator,
        actuator_user=m.actuator_user.reshape(-1),
        actuator_actadr=m.actuator_actadr,
        opt=m.opt,
        signature=m.signature,
    )


def _current() -> tuple[Any, Any]:
    return mujoco.get_mjcb_act_bias(), mujoco.get_mjcb_act_dyn()


@contextmanager
def installed(mode: Mode = "native") -> Iterator[None]:
    """Install the callbacks for the duration of a block, and restore what was there.

    Parameters
    ----------
    mode : "native" (compiled, needed by mujoco.batch) or "python" (the same kernels, uncompiled)

    Raises
    ------
    CallbackError
        Another program's callback is installed, or this MuJoCo's structs cannot be verified.
    """
    bias, dyn = _native_callbacks() if mode == "native" else _python_callbacks()
    before = _current()
    ours = [c for f in (_native_callbacks, _python_callbacks) if f.cache_info().currsize for c in f()]
    for name, callback in zip(("mjcb_act_bias", "mjcb_act_dyn"), before, strict=True):
        if callback is not None and not any(callback is mine for mine in ours):
            raise CallbackError(
                f"another {name} is installed in this process; MuJoCo has room for one, and "
                "replacing it would change that program's simulation. Remove it "
                f"(mujoco.set_{name}(None)) and try again."
            )
    loud = mujoco.get_mju_user_warning()
    mujoco.set_mjcb_act_bias(bias)
    mujoco.set_mjcb_act_dyn(dyn)
    if loud is None:
        # the counters say the same; MuJoCo would also write a log into the user's folder
        mujoco.set_mju_user_warning(lambda text: None)
    try:
        yield
        if any(now is not mine for now, mine in zip(_current(), (bias, dyn), strict=True)):
            raise CallbackError("the muscle callbacks were replaced while the simulation ran")
    finally:
        mujoco.set_mjcb_act_bias(before[0])
        mujoco.set_mjcb_act_dyn(before[1])
        mujoco.set_mju_user_warning(loud)


def assert_rows(model: mujoco.MjModel) -> None:
    """Check that every actuator is one of this project's, and names actuators that exist.

    Raises
    ------
    CallbackError
        A row without mark or kind would be passed over by the callbacks in silence.
    """
    kinds = {
        KIND_MUSCLE: {
            MUSCLE_LEADER: KIND_MUSCLE,
            MUSCLE_CHAMBER: KIND_CHAMBER,
            MUSCLE_NEXT: KIND_MUSCLE,
            MUSCLE_FRICTION_STATES: KIND_FRICTION,
        },
        KIND_CHAMBER: {
            CHAMBER_FIRST_MUSCLE: KIND_MUSCLE,
            CHAMBER_NEXT: KIND_CHAMBER,
            CHAMBER_INLET: KIND_VALVE,
            CHAMBER_OUTLET: KIND_VALVE,
        },
        KIND_VALVE: {},
        KIND_PASSIVE: {},
        KIND_FRICTION: {FRICTION_MUSCLE: KIND_MUSCLE},
        KIND_MOTOR: {},
        KIND_SPASTIC: {},
        KIND_PAD: {PAD_FLOOR: KIND_MOTOR},
        KIND_NETWORK: {NETWORK_FIRST_CHAMBER: KIND_CHAMBER},
    }
    optional = (
        (KIND_MUSCLE, MUSCLE_NEXT),
        (KIND_MUSCLE, MUSCLE_FRICTION_STATES),
        (KIND_CHAMBER, CHAMBER_NEXT),
        (KIND_CHAMBER, CHAMBER_FIRST_MUSCLE),
    )
    rows = model.actuator_user
    for i, row in enumerate(rows):
        if row[0] != MARK or row[1] not in kinds:
            raise CallbackError(f"actuator {model.actuator(i).name!r} has lost its parameters")
        for slot, kind in kinds[row[1]].items():
            other = row[slot]
            none = (row[1], slot) in optional and other == -1.0
            if not none and not (other in range(model.nu) and rows[int(other), 1] == kind):
                raise CallbackError(f"actuator {model.actuator(i).name!r} refers to actuator {other:g}")


def assert_live(model: mujoco.MjModel, data: mujoco.MjData, muscles: Sequence[int]) -> None:
    """Check, against the kernels run as plain Python, that every muscle really pulls.

    Parameters
    ----------
    model, data : MuJoCo model and a forwarded state whose chambers are pressurised
    muscles : actuator ids

    Raises
    ------
    CallbackError
        A muscle is limp or carries another force than its law's.
    """
    plain, found = _flat(model), data.userdata.copy()
    data.userdata[:] = 0.0
    for network in map(int, np.flatnonzero(model.actuator_user[:, 1] == KIND_NETWORK)):
        complaint, actuator = network_dyn(plain, data, network, model.nuser_actuator * network)
        if complaint != FINE:
            raise CallbackError(f"{COMPLAINTS[complaint]} {actuator}")
    expected = data.userdata.copy()
    data.userdata[:] = found
    for i in muscles:
        leader = int(model.actuator_user[i, MUSCLE_LEADER])
        pulls = expected[int(model.actuator_user[leader, MUSCLE_USERDATA]) + TENSION]
        carries = -data.actuator_force[i]
        if not abs(carries - pulls) <= 1e-9 * max(1.0, abs(pulls)):
            raise CallbackError(
                f"muscle actuator {i} carries {carries:.6g} N where its law gives {pulls:.6g} N: "
                "the muscle callbacks are not the ones in force"
            )
