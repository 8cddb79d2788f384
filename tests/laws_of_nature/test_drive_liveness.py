"""Every field of a pressure drive is live in the kinds that have it, and idle in those that have not.

The fields are found in the description, not listed here: a new one without an entry fails.
"""

from typing import Any

import numpy as np
import pytest
from campaign import sampled

import afo_sim
from afo_sim.description import Drive
from afo_sim.description.control.drive import WITHOUT

KINDS = ("bang_bang", "pwm", "regulator")
BASE: dict[str, dict[str, Any]] = {
    "bang_bang": {"dead_band": "0.1 bar"},
    "pwm": {"full_at": "0.5 bar", "integral_time": "0.5 s"},
    "regulator": {"full_at": "0.5 bar", "integral_time": "0.5 s"},
}
# What a field is changed to, and the column that must move; beside it what it needs to have a say.
INLET, PRESSURE = "valve/dorsiflexor_inlet/coil", "chamber/dorsiflexor/pressure"
CHANGED: dict[str, tuple[Any, str]] = {
    "dead_band": ("0.15 bar", PRESSURE),
    "release": ("0.02 bar", INLET),
    "period": ("31 ms", INLET),
    "least_on": ("19 ms", INLET),
    "least_off": ("15 ms", INLET),
    "full_at": ("0.8 bar", PRESSURE),
    "integral_time": ("0.3 s", PRESSURE),
    "derivative_time": ("20 ms", PRESSURE),
    "bandwidth": ("8 Hz", "valve/dorsiflexor_inlet/opening"),
    "filter_time": ("30 ms", PRESSURE),
}
# With a stout valve each opening overshoots, so that least times have a say.
STOUT = {
    f"orthosis.chamber.dorsiflexor.{side}.conductance": "0.4 dm^3/(s*bar)" for side in ("inlet", "outlet")
}


def run(kind: str, **drive: Any) -> afo_sim.Recording:
    table = BASE[kind] | {"kind": kind} | drive
    sets = {"duration": "1.5 s", "timestep": "1 ms", "drive.dorsiflexor": table} | STOUT
    made = afo_sim.run(
        "seated-antagonist",
        sets,
        controller=lambda seen: {"dorsiflexor": 2e5 if seen.time < 0.8 else 1e5},
        rate=50,
    )
    assert made.ok
    return made


@pytest.fixture(scope="module")
def base() -> dict[str, afo_sim.Recording]:
    return {kind: run(kind) for kind in KINDS}


def test_every_field_is_declared() -> None:
    assert set(Drive.model_fields) - {"kind", "provenance"} == set(CHANGED)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("field", sampled(CHANGED, 4))
def test_a_field_moves_its_column_or_is_said_to_be_idle(
    kind: str, field: str, base: dict[str, afo_sim.Recording]
) -> None:
    value, column = CHANGED[field]
    after = run(kind, **{field: value})
    moved = np.abs(after[column] - base[kind][column]).max()
    idle = field in WITHOUT[kind]
    assert any(f"{field} changes nothing" in w for w in after.warnings) == idle
    assert moved == 0.0 if idle else moved > 1e-3 * np.abs(base[kind][column]).max(), f"{field} of {kind}"


def test_kinds_differ(base: dict[str, afo_sim.Recording]) -> None:
    for first, second in (("bang_bang", "pwm"), ("pwm", "regulator")):
        assert np.abs(base[first][INLET] - base[second][INLET]).max() > 0.1


def test_rated_switchings_move_the_life() -> None:
    key = "orthosis.chamber.dorsiflexor.inlet.rated_switches"
    once, twice = (
        afo_sim.run("seated", {"duration": "1 s", key: rated}).metrics["hours_until_valve_life"].value
        for rated in (1e6, 2e6)
    )
    assert twice == pytest.approx(2.0 * once)
