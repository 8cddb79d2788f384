"""Refusals of tests that a muscle cannot undergo on the stand; each says what is possible."""

import math
from collections.abc import Sequence

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.description.muscle import Muscle
from afo_sim.description.quantity import provenance_note
from afo_sim.lab.bench.rest import force_at, lifting, slack

LEAST_LOAD = 1.0  # [N]: an unloaded muscle has no definite length
PULLING = 10.0  # force at zero contraction from which a muscle counts as pulling [N]


def check_contractions(muscle: Muscle, contractions: np.ndarray, pressure: float) -> None:
    """Refuse contraction ratios [-] beyond the lock, or where a muscle at a gauge pressure [Pa] is slack."""
    low, high = muscle.braid.lock, slack(muscle, pressure)
    for value in contractions:
        if not low < value <= high + 1e-9:
            worst = "the braid locks before that" if value <= low else "the muscle is slack"
            lengths = [f"{100.0 * muscle.nominal_length * (1.0 - x):.2f}" for x in (high, low)]
            raise InputError(
                f"{worst} at {pressure * 1e-5:g} bar",
                field="contraction",
                value=f"{value:.4g}",
                allowed=f"above {low:.3f} (lock) and at most {math.floor(1e4 * high) * 1e-4:.4f} (slack): "
                f"lengths of {lengths[0]} to {lengths[1]} cm",
            )


def check_loads(
    muscle: Muscle, loads: Sequence[float] | np.ndarray, pressures: Sequence[float], contraction: float = 0.0
) -> None:
    """Refuse loads beyond the muscle's strength at a contraction [-], each at its pressure [Pa]."""
    for load, pressure in zip(loads, pressures, strict=True):
        strength = force_at(muscle, contraction, pressure)
        if not LEAST_LOAD <= load < strength:
            weak = "the muscle cannot lift it" if load >= strength else "is less than the stand can hang on"
            raise InputError(
                f"{weak} at {pressure * 1e-5:g} bar",
                field="load",
                value=f"{load:g} N",
                allowed=f"{LEAST_LOAD:g} N to {math.floor(strength * 0.999):g} N",
            )


def check_pressures(muscle: Muscle, pressures: np.ndarray, supply: float | None, *, pulls: bool) -> None:
    """Refuse gauge pressures [Pa] above supply or limit, or (`pulls`) at which the muscle does not pull."""
    top, told = muscle.limits.pressure, provenance_note(muscle.limits, "pressure")
    whose = f"the muscle's limit{told}"
    if supply is not None and supply > top:
        raise _pressure_refusal(f"is more than the muscle bears{told}", "supply", supply, 0.0, top)
    if supply is not None:
        top, whose = supply, "the supply's pressure"
    for pressure in pressures:
        if not 0.0 <= pressure <= top * (1.0 + 1e-9):
            raise _pressure_refusal(f"is beyond {whose}", "pressure", pressure, 0.0, top)
        if pulls and force_at(muscle, 0.0, pressure) < PULLING:
            enough = lifting(muscle, PULLING, 0.0, top)
            raise _pressure_refusal(
                "is too little for this muscle to pull", "pressure", pressure, enough, top
            )


def _pressure_refusal(problem: str, name: str, value: float, low: float, high: float) -> InputError:
    allowed = f"{math.ceil(low * 1e-3) * 1e-2:g} bar to {high * 1e-5:.4g} bar"
    return InputError(problem, field=name, value=f"{value * 1e-5:g} bar", allowed=allowed)


def check_span(muscle: Muscle, low: float, high: float, supply: float | None) -> None:
    """Refuse a span of gauge pressures [Pa] that does not rise, or that supply or muscle do not bear."""
    check_pressures(muscle, np.array([low]), supply, pulls=False)
    check_pressures(muscle, np.array([high]), supply, pulls=True)
    if not low < high:
        raise InputError(
            "does not rise",
            field="pressure",
            value=f"{low * 1e-5:g} bar to {high * 1e-5:g} bar",
            allowed="FROM < TO",
        )
