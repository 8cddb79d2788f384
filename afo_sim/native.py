"""Muscles, chambers, valves and the passive ankle as MuJoCo actuator callbacks.

Every actuator of this project carries its parameters in `actuator_user`, behind a mark and a kind;
its states are in `act`, its input in `ctrl`:

    kind     transmission   ctrl                    act
    muscle   tendon           none (see below)        –
    chamber  ankle, no force  supply pressure, gauge  air mass, volume, absolute pressure
    valve    ankle, no force  coil                    armature, opening
    passive  ankle            knee angle              –

Per chamber, `userdata` receives what MuJoCo has no field for: inlet flow, outlet flow [kg/s],
volume [m³] of the same step.

The callbacks are process-global in MuJoCo. They act only on marked actuators, are installed and
restored by `installed`, and never displace somebody else's. The same two functions run compiled
(function pointers, which `mujoco.batch` requires) or as plain Python.

Two numerical matters:

* The Hill damper is stiff, and MuJoCo integrates user forces explicitly. The bias therefore leaves the
  damper's coefficient in the muscle's own `ctrl`, where an affine gain of −1 × tendon velocity makes
  it the force's derivative for the integrator `implicitfast`; what that gain adds to the force (from a
  `ctrl` that the last step left) the bias takes away. The force is exactly the law's, and only its
  dependence on velocity is integrated implicitly. Parallel muscles are alike, so the first of a group
  carries the derivative of all.
* Pressure integrated with the volume rate of the *old* velocity feeds energy into the joint. The
  chamber therefore keeps the volume that its pressure has been integrated to, and makes up the
  difference in the next step (midpoint rule): the sum of the volume changes is the volume, and a
  sealed chamber is nearly as good a spring as a metal one.
"""

import ctypes
import functools
import pathlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any, Literal

import mujoco
import numpy as np
from numba.extending import register_jitable

from afo_sim.errors import CallbackError
from afo_sim.physics.hill import hill_force
from afo_sim.physics.law import Braid
from afo_sim.physics.passive_ankle import passive_moment
from afo_sim.physics.pneumatics import muscle_volume, pressure_rate, valve_flow, valve_rates
from afo_sim.physics.static_force import LAWS, MAX_COEFFICIENTS, muscle_static_force
from afo_sim.units import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT

MARK = 2826.0  # tells this project's actuators from anybody else's
FLOWS_PER_CHAMBER = 3  # userdata: inlet flow, outlet flow, volume

Mode = Literal["native", "python"]


KIND_MUSCLE, KIND_CHAMBER, KIND_VALVE, KIND_PASSIVE = 1.0, 2.0, 3.0, 4.0


# Where a parameter stands within its actuator's row (after the mark and the kind)
(
    MUSCLE_LAW,
    MUSCLE_CHAMBER,
    MUSCLE_NEXT,
    MUSCLE_SERIES_LENGTH,
    MUSCLE_NOMINAL_LENGTH,
    MUSCLE_NOMINAL_RADIUS,
    MUSCLE_B,
    MUSCLE_DAMPING,
    MUSCLE_BRAID_STIFFNESS,
    MUSCLE_DEAD_VOLUME,
    MUSCLE_IMPLICIT_COUNT,
    MUSCLE_LOWEST_PRESSURE,
    MUSCLE_COEFFICIENTS,
) = range(2, 15)
(
    CHAMBER_FIRST_MUSCLE,
    CHAMBER_INLET,
    CHAMBER_OUTLET,
    CHAMBER_TUBE_VOLUME,
    CHAMBER_WALL_CONDUCTANCE,
    CHAMBER_USERDATA,
) = range(2, 8)
VALVE_CONDUCTANCE, VALVE_CRITICAL_RATIO, VALVE_OPENING_DELAY, VALVE_CLOSING_DELAY = range(2, 6)
PASSIVE_SCALE, PASSIVE_OFFSET = range(2, 4)
N_USER = MUSCLE_COEFFICIENTS + MAX_COEFFICIENTS  # slots per actuator


def muscle_row(
    *,
    law: str,
    coefficients: Sequence[float],
    lowest_pressure: float,
    braid: Braid,
    series_length: float,
    damping: float,
    braid_stiffness: float,
    dead_volume: float,
    chamber: int,
    next_muscle: int,
    implicit_count: int = 1,
) -> np.ndarray:
    """`actuator_user` of a muscle.

    `series_length` is all of the tendon that does not contract; `implicit_count` is the number of
    parallel muscles whose damping this one's gain stands for: all for a group's first, else none.
    """
    row = _row(
        KIND_MUSCLE,
        LAWS[law].native_id,
        chamber,
        next_muscle,
        series_length,
        braid.nominal_length,
        braid.nominal_radius,
        braid.b,
        damping,
        braid_stiffness,
        dead_volume,
        implicit_count,
        lowest_pressure,
    )
    row[MUSCLE_COEFFICIENTS : MUSCLE_COEFFICIENTS + len(coefficients)] = coefficients
    return row


def chamber_row(
    *,
    first_muscle: int,
    inlet: int,
    outlet: int,
    tube_volume: float,
    wall_conductance: float,
    userdata: int,
) -> np.ndarray:
    """`actuator_user` of a chamber; its first muscle and its valves are actuator ids."""
    return _row(KIND_CHAMBER, first_muscle, inlet, outlet, tube_volume, wall_conductance, userdata)


def valve_row(
    *, conductance: float, critical_ratio: float, opening_delay: float, closing_delay: float
) -> np.ndarray:
    """`actuator_user` of a solenoid valve."""
    return _row(KIND_VALVE, conductance, critical_ratio, opening_delay, closing_delay)


def passive_row(*, scale: float, offset: float) -> np.ndarray:
    """`actuator_user` of the passive ankle."""
    return _row(KIND_PASSIVE, scale, offset)


def _row(kind: float, *values: float) -> np.ndarray:
    row = np.zeros(N_USER)
    row[: 2 + len(values)] = MARK, kind, *values
    return row


# What a callback can object to; the text that MuJoCo reports is "<complaint> <actuator id>".
COMPLAINTS = (
    "the force is not a number in actuator",
    "the absolute pressure is not positive in actuator",
    "the volume is not positive in actuator",
    "the air mass is not positive in actuator",
    "the supply's absolute pressure is not positive in actuator",
)
_TEXT_LENGTH, _MAX_ACTUATORS = 64, 256


def _define(fail: Callable[[int, int], None]) -> tuple[Any, Any]:
    """The two callbacks, over a `fail(complaint, actuator)` that does not return."""

    @register_jitable
    def muscle_bias(m: Any, d: Any, i: int, j: int) -> float:
        u, act = m.actuator_user, d.act
        per_length = 1.0 / u[j + MUSCLE_NOMINAL_LENGTH]
        velocity = d.actuator_velocity[i]
        contraction = 1.0 - (d.actuator_length[i] - u[j + MUSCLE_SERIES_LENGTH]) * per_length
        absolute = act[m.actuator_actadr[int(u[j + MUSCLE_CHAMBER])] + 2]
        static = muscle_static_force(
            u[j + MUSCLE_LAW],
            contraction,
            absolute - AMBIENT_PRESSURE,
            u[j + MUSCLE_LOWEST_PRESSURE],
            u,
            j + MUSCLE_COEFFICIENTS,
        )
        force, coefficient = hill_force(
            static,
            contraction,
            -velocity * per_length,
            absolute,
            u[j + MUSCLE_DAMPING],
            u[j + MUSCLE_BRAID_STIFFNESS],
        )
        if force != force:
            fail(0, i)
        ctrl = d.ctrl
        gained = velocity * ctrl[i]  # the affine gain takes this off
        ctrl[i] = coefficient * per_length * u[j + MUSCLE_IMPLICIT_COUNT]
        return gained - force

    @register_jitable
    def chamber_dyn(m: Any, d: Any, i: int, j: int) -> None:
        u, act, act_dot = m.actuator_user, d.act, d.act_dot
        lengths, velocities = d.actuator_length, d.actuator_velocity
        addresses, width = m.actuator_actadr, m.nuser_actuator
        adr = addresses[i]
        mass, integrated_volume, pressure = act[adr], act[adr + 1], act[adr + 2]
        if not pressure > 0.0:
            fail(1, i)
        if not mass > 0.0:
            fail(3, i)
        volume, volume_rate = u[j + CHAMBER_TUBE_VOLUME], 0.0
        k = int(u[j + CHAMBER_FIRST_MUSCLE])
        while k >= 0:
            q = width * k
            length = u[q + MUSCLE_NOMINAL_LENGTH]
            per_length = 1.0 / length
            contraction = 1.0 - (lengths[k] - u[q + MUSCLE_SERIES_LENGTH]) * per_length
            part, slope = muscle_volume(
                contraction, length, u[q + MUSCLE_NOMINAL_RADIUS], u[q + MUSCLE_B], u[q + MUSCLE_DEAD_VOLUME]
            )
            volume += part
            volume_rate -= slope * velocities[k] * per_length
            k = int(u[q + MUSCLE_NEXT])
        if not volume > 0.0:
            fail(2, i)
        step = m.opt.timestep
        # from the volume that the pressure belongs to, to the one at the end of this step
        volume_rate += (volume - integrated_volume) / step
        temperature = pressure * integrated_volume / (mass * GAS_CONSTANT)
        inlet, outlet = int(u[j + CHAMBER_INLET]), int(u[j + CHAMBER_OUTLET])
        q = width * inlet
        supply = d.ctrl[i] + AMBIENT_PRESSURE
        if not supply > 0.0:
            fail(4, i)
        inlet_flow = valve_flow(
            supply,
            AMBIENT_TEMPERATURE,
            pressure,
            temperature,
            act[addresses[inlet] + 1],
            u[q + VALVE_CONDUCTANCE],
            u[q + VALVE_CRITICAL_RATIO],
        )
        q = width * outlet
        outlet_flow = valve_flow(
            pressure,
            temperature,
            AMBIENT_PRESSURE,
            AMBIENT_TEMPERATURE,
            act[addresses[outlet] + 1],
            u[q + VALVE_CONDUCTANCE],
            u[q + VALVE_CRITICAL_RATIO],
        )
        flow_in, flow_out = 0.0, 0.0
        if inlet_flow < 0.0:
            flow_out -= inlet_flow
        else:
            flow_in += inlet_flow
        if outlet_flow < 0.0:
            flow_in -= outlet_flow
        else:
            flow_out += outlet_flow
        act_dot[adr] = flow_in - flow_out
        act_dot[adr + 1] = volume_rate
        # midpoint rule: the explicit one loses pressure whichever way the volume moves
        wall = u[j + CHAMBER_WALL_CONDUCTANCE]
        half = 0.5 * step
        rate = pressure_rate(pressure, temperature, integrated_volume, volume_rate, flow_in, flow_out, wall)
        pressure += half * rate
        integrated_volume += half * volume_rate
        mass += half * (flow_in - flow_out)
        temperature = pressure * integrated_volume / (mass * GAS_CONSTANT)
        act_dot[adr + 2] = pressure_rate(
            pressure, temperature, integrated_volume, volume_rate, flow_in, flow_out, wall
        )
        row = int(u[j + CHAMBER_USERDATA])
        userdata = d.userdata
        userdata[row], userdata[row + 1], userdata[row + 2] = inlet_flow, outlet_flow, volume

    @register_jitable
    def valve_dyn(m: Any, d: Any, i: int, j: int) -> None:
        u = m.actuator_user
        adr = m.actuator_actadr[i]
        d.act_dot[adr], d.act_dot[adr + 1] = valve_rates(
            d.ctrl[i],
            d.act[adr],
            d.act[adr + 1],
            u[j + VALVE_OPENING_DELAY],
            u[j + VALVE_CLOSING_DELAY],
            m.opt.timestep,
        )

    def bias(m: Any, d: Any, i: int) -> float:
        j = m.nuser_actuator * i
        if m.nuser_actuator < N_USER or m.actuator_user[j] != MARK:
            return 0.0
        u = m.actuator_user
        kind = u[j + 1]
        if kind == KIND_MUSCLE:
            return muscle_bias(m, d, i, j)
        if kind == KIND_PASSIVE:
            moment = passive_moment(
                d.actuator_length[i], d.ctrl[i], u[j + PASSIVE_SCALE], u[j + PASSIVE_OFFSET]
            )
            if moment != moment:
                fail(0, i)
            return moment
        return 0.0

    def dyn(m: Any, d: Any, i: int) -> float:
        j = m.nuser_actuator * i
        if m.nuser_actuator < N_USER or m.actuator_user[j] != MARK:
            return 0.0
        kind = m.actuator_user[j + 1]
        if kind == KIND_CHAMBER:
            chamber_dyn(m, d, i, j)
        elif kind == KIND_VALVE:
            valve_dyn(m, d, i, j)
        return 0.0

    return bias, dyn


def _library() -> pathlib.Path:
    """The MuJoCo shared library that the bindings have loaded."""
    folder = pathlib.Path(mujoco.__file__).parent
    for pattern in ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll"):
        for found in sorted(folder.glob(pattern)):
            return found
    raise CallbackError(f"no MuJoCo library is found in {folder}")


@functools.cache
def _native_callbacks() -> tuple[Any, Any]:
    from afo_sim.struct_layout import actuator_callback, verify

    verify()
    mju_error = ctypes.CDLL(str(_library())).mju_error
    mju_error.argtypes, mju_error.restype = [ctypes.c_void_p], None
    table = (
        f"{c} {i}".encode().ljust(_TEXT_LENGTH, b"\0") for c in COMPLAINTS for i in range(_MAX_ACTUATORS)
    )
    texts = ctypes.create_string_buffer(b"".join(table))
    base = ctypes.addressof(texts)

    @register_jitable
    def fail(complaint: int, actuator: int) -> None:
        # mju_error jumps out of the step; MuJoCo's bindings turn it into an exception
        mju_error(base + (complaint * _MAX_ACTUATORS + min(actuator, _MAX_ACTUATORS - 1)) * _TEXT_LENGTH)

    bias, dyn = _define(fail)
    bias_pointer, dyn_pointer = actuator_callback(bias), actuator_callback(dyn)
    bias_pointer.texts = texts
    return bias_pointer, dyn_pointer


class KernelFailure(Exception):
    """What `mju_error` is to the compiled callbacks, in Python mode."""


@functools.cache
def _python_callbacks() -> tuple[Any, Any]:
    def fail(complaint: int, actuator: int) -> None:
        raise KernelFailure(f"{COMPLAINTS[complaint]} {actuator}")

    bias, dyn = _define(fail)

    def flat(m: Any) -> Any:
        return SimpleNamespace(
            nuser_actuator=m.nuser_actuator,
            actuator_user=m.actuator_user.reshape(-1),
            actuator_actadr=m.actuator_actadr,
            opt=m.opt,
        )

    def total(kernel: Any) -> Any:
        def callback(m: Any, d: Any, i: int) -> float:
            try:
                return float(kernel(flat(m), d, i))
            except (ArithmeticError, ValueError) as error:  # compiled code gives inf or NaN instead
                raise KernelFailure(f"{error} in actuator {i}") from None

        return callback

    return total(bias), total(dyn)


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
        KIND_MUSCLE: {MUSCLE_CHAMBER: KIND_CHAMBER, MUSCLE_NEXT: KIND_MUSCLE},
        KIND_CHAMBER: {
            CHAMBER_FIRST_MUSCLE: KIND_MUSCLE,
            CHAMBER_INLET: KIND_VALVE,
            CHAMBER_OUTLET: KIND_VALVE,
        },
        KIND_VALVE: {},
        KIND_PASSIVE: {},
    }
    rows = model.actuator_user
    for i, row in enumerate(rows):
        if row[0] != MARK or row[1] not in kinds:
            raise CallbackError(f"actuator {model.actuator(i).name!r} has lost its parameters")
        for slot, kind in kinds[row[1]].items():
            other = row[slot]
            last = slot == MUSCLE_NEXT and row[1] == KIND_MUSCLE and other == -1.0
            if not last and not (other in range(model.nu) and rows[int(other), 1] == kind):
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
    for i in muscles:
        row = model.actuator_user[i]
        length = row[MUSCLE_NOMINAL_LENGTH]
        kappa = (length + row[MUSCLE_SERIES_LENGTH] - data.actuator_length[i]) / length
        absolute = data.act[model.actuator_actadr[int(row[MUSCLE_CHAMBER])] + 2]
        gauge = absolute - AMBIENT_PRESSURE
        static = muscle_static_force(
            row[MUSCLE_LAW], kappa, gauge, row[MUSCLE_LOWEST_PRESSURE], row, MUSCLE_COEFFICIENTS
        )
        rate = -data.actuator_velocity[i] / length
        expected, _ = hill_force(
            static, kappa, rate, absolute, row[MUSCLE_DAMPING], row[MUSCLE_BRAID_STIFFNESS]
        )
        found = -data.actuator_force[i]
        if not abs(found - expected) <= 1e-9 * max(1.0, abs(expected)):
            raise CallbackError(
                f"muscle actuator {i} carries {found:.6g} N where its law gives {expected:.6g} N: "
                "the muscle callbacks are not the ones in force"
            )
