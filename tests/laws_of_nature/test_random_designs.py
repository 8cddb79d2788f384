"""Random legal designs: each runs as it does at a fine step, or a message says that it does not."""

import functools
import math
from typing import Any

import numpy as np
import pytest
from campaign import size

import afo_sim
from afo_sim import load
from afo_sim.common import InputError, assets

pytestmark = pytest.mark.slow

DESIGNS = {"seated": size(11, 25), "walk-dropfoot-afo": size(6, 15)}
STEP, FINE = 1e-3, 2.5e-4  # [s]
NEAR = 0.5  # of the angle at a fine step [deg]
COLDEST, HOTTEST = 150.0, 600.0  # [K]
PATHS = {"dorsiflexor": 0.310, "plantarflexor": 0.330}  # between S1's anchors [m]
Draw = np.random.Generator


def spread(draw: Draw, low: float, high: float, none: float = 0.0) -> float:
    """Evenly over the decades, and with a probability nothing."""
    return 0.0 if draw.random() < none else float(10.0 ** draw.uniform(math.log10(low), math.log10(high)))


@functools.cache
def muscle(name: str) -> Any:
    return load("muscle", name)


def group(draw: Draw, name: str) -> dict[str, Any]:
    """Muscles, cable, valves, tube and wall of one side."""
    kind = str(draw.choice(assets.names("muscle")))
    own = muscle(kind)
    length = own.total_length
    if draw.random() < 0.5:
        least = 0.0 if own.lengths is None else own.lengths.shortest
        length = float(draw.uniform(max(0.08, own.end_length + 0.03, least), 0.30))
    at, air = f"orthosis.muscle.{name}", f"orthosis.chamber.{name}"
    sets: dict[str, Any] = {
        f"{at}.type": kind,
        f"{at}.type.law": str(draw.choice([*own.laws])),
        f"{at}.type.friction": str(draw.choice(["none", "none", *own.frictions])),
        f"{at}.type.total_length": f"{length} m",
        f"{at}.count": int(draw.integers(1, 6)),
        f"{at}.link_length": f"{max(PATHS[name] - length + draw.uniform(-0.02, 0.02), 0.0)} m",
        f"{at}.cable.stiffness": f"{spread(draw, 1e4, 1e7)} N/m",
        f"{air}.tube_volume": f"{spread(draw, 1e-6, 1e-3, 0.15)} m^3",
        f"{air}.wall_conductance": f"{spread(draw, 0.01, 100.0, 0.15)} W/K",
    }
    if draw.random() < 0.5:
        sets[f"{at}.type.bore"] = f"{spread(draw, 0.005, 0.04)} m"
    if draw.random() < 0.5:
        sets[f"{at}.type.damping"] = f"{spread(draw, 1e-6, 5e-3, 0.15)} m^2*s"
    for valve in ("inlet", "outlet"):
        sets[f"{air}.{valve}.conductance"] = f"{5.5e-10 * spread(draw, 0.1, 10.0)} m^3/(s*Pa)"
    return sets


def mounting(draw: Draw) -> dict[str, Any]:
    """Cuff and plate: rigid, linear or stiffening, damped or not."""
    found: dict[str, Any] = {}
    for name in ("shank", "foot"):
        kind = draw.random()
        if kind < 0.15:
            continue
        law: dict[str, Any] = {"stiffness": f"{spread(draw, 2e3, 1e7)} N/m"}
        if kind > 0.6:
            a, x0 = spread(draw, 5.0, 200.0), spread(draw, 0.002, 0.03)
            law = {"stiffening": {"force": f"{a} N", "length": f"{x0} m"}}
        damped = {"damping": f"{spread(draw, 1.0, 2000.0)} N*s/m"} if draw.random() < 0.5 else {}
        found[name] = law | damped
    return found


def design(scenario: str, seed: int) -> dict[str, Any]:
    draw = np.random.default_rng([seed, len(scenario)])
    sets: dict[str, Any] = {"duration": "1.5 s", "supply.pressure": f"{draw.uniform(0.5, 8.0)} bar"}
    if scenario == "seated":
        sets["timer"] = {
            "period": "0.8 s",
            "dorsiflexor": {"inlet": [["0 s", "0.4 s"]], "outlet": [["0.4 s", "0.8 s"]]},
            "plantarflexor": {"inlet": [["0.4 s", "0.7 s"]], "outlet": [["0 s", "0.4 s"]]},
        }
    else:
        sets["gait.settled"] = "walked"  # the same rows at both steps
    for name in PATHS:
        sets |= group(draw, name)
    return sets | {"orthosis.anchor": mounting(draw)}


def told(scenario: str, sets: dict[str, Any], step: float) -> afo_sim.Recording | None:
    """The run at a step; None where it is refused, which must say what would do."""
    rate = {"timestep": f"{step * 1e3:g} ms", "record_rate": f"{1.0 / step:g} Hz"}
    try:
        return afo_sim.run(scenario, sets | rate)
    except InputError as error:
        assert "allowed: at " in str(error), error
        return None


@pytest.mark.parametrize("scenario", DESIGNS)
def test_random_legal_designs_run_right_or_say_that_they_do_not(scenario: str) -> None:
    ran = 0
    for seed in range(DESIGNS[scenario]):
        sets = design(scenario, seed)
        coarse = told(scenario, sets, STEP)
        fine = None if coarse is None else told(scenario, sets, FINE)
        if coarse is None or fine is None:
            continue
        ran += 1
        assert coarse.ok, (seed, coarse.status)
        doubted = any("time step" in warning for warning in coarse.warnings)
        stride = round(STEP / FINE)
        off = np.degrees(np.abs(coarse["ankle/angle"] - fine["ankle/angle"][::stride]).max())
        assert off < NEAR or doubted, (seed, off)
        for name, values in coarse.columns.items():
            if name.endswith("/temperature") and not doubted:
                assert values.min() > COLDEST and values.max() < HOTTEST, (seed, name)
    assert ran > DESIGNS[scenario] // 2
