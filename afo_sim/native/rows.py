"""Rows of `actuator_user`, written by the names of their numbers, found by their kinds."""

import functools
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from afo_sim.native import slots
from afo_sim.physics import FIRST_USER_ID, LAWS, Braid

# Numbers of a row that may be missing, and are then 0: the compiled model gives them later, or only some
# parts of the kind have them.
_LOSSES = {"damper", "friction", "friction_coefficients"}
_RUBBER = {"rubber", "rubber_bore", "rubber_turn", "rubber_volume"}
_TIMES = {"closing_delay", "closing_ramp", "opening_delay", "opening_ramp"}
_TIMES |= {"threshold", "hold_decay", "hold_pressure"}
_SOME = {"bandwidth", "coil", "dead_band", "follows", "law", "parameters", *_TIMES}
MAY_LACK = {
    slots.Kind.MUSCLE: {"inverse_mass", "law_volume", "return_stiffness", "returning", *_LOSSES, *_RUBBER},
    slots.Kind.CHAMBER: {"real_gas"},
    slots.Kind.VOLUME: {"real_gas"},
    slots.Kind.STORE: {"wall_conductance_by_flow"},
    slots.Kind.VALVE: _SOME,
    slots.Kind.RESTRICTION: _SOME,
}
_PLACES = {
    kind: {name: getattr(table, name) for table in tables for name in table._fields}
    for kind, tables in slots.ROWS.items()
}
_NEEDED = {kind: found.keys() - MAY_LACK.get(kind, set()) for kind, found in _PLACES.items()}


def row(kind: slots.Kind, /, **values: float | Sequence[float]) -> np.ndarray:
    """`actuator_user` of an actuator, its numbers by the names of its kind's tables."""
    found, own = np.zeros(slots.N_USER), _PLACES[kind]
    if missing := _NEEDED[kind] - values.keys():
        raise TypeError(f"a row of kind {kind.name} lacks {', '.join(sorted(missing))}")
    found[: slots.FIRST] = slots.THIS_LAYOUT, kind
    for name, value in values.items():
        if hasattr(value, "__len__"):
            found[own[name] : own[name] + len(value)] = value
        else:
            found[own[name]] = value
    return found


def muscle_row(*, law: str, braid: Braid, contraction_scale: float = 1.0, **values: Any) -> np.ndarray:
    """`actuator_user` of a muscle, but for its `inverse_mass`, which the compiled model gives."""
    return row(
        slots.Kind.MUSCLE, law=LAWS[law].native_id, braids=float(LAWS[law].braids),
        nominal_length=braid.nominal_length, nominal_radius=braid.nominal_radius, b=braid.b, lock=braid.lock,
        contraction_scale=contraction_scale, **values,
    )  # fmt: skip


def of_kind(model: mujoco.MjModel, kind: slots.Kind) -> list[int]:
    """Ids of this project's actuators of one kind."""
    heads = model.actuator_user[:, : slots.FIRST]
    return list(_of_kind(heads.tobytes(), kind)) if model.nuser_actuator >= slots.N_USER else []


@functools.lru_cache(maxsize=64)  # models of one layout have the same
def _of_kind(heads: bytes, kind: slots.Kind) -> tuple[int, ...]:
    rows = np.frombuffer(heads).reshape(-1, slots.FIRST)
    return tuple(np.flatnonzero((rows == (slots.THIS_LAYOUT, kind)).all(axis=1)).tolist())


def user_kernels(model: mujoco.MjModel) -> set[int]:
    """Native ids of the laws and frictions of a user's own that a model's muscles ask for."""
    muscles = model.actuator_user[of_kind(model, slots.Kind.MUSCLE)]
    asked = muscles[:, (slots.MUSCLE_ROW.law, slots.MUSCLE_ROW.friction)] if len(muscles) else np.empty(0)
    return {int(each) for each in asked.ravel() if each >= FIRST_USER_ID}
