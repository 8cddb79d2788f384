"""Every field of PID and references is live: changed, a named column of a run moves."""

from typing import Any

import pytest
from campaign import sampled
from laws_of_nature.liveness import assert_moves

import afo_sim
from afo_sim.description import MomentReference, Pid, PressureReference, Reference, fields_of
from afo_sim.description.control.feedback import AngleLoop, MomentLoop, PairPressures, PressureLoop

SINE = {"mean": "1 deg", "amplitude": "4 deg", "frequency": "1 Hz"}
CHIRP = SINE | {"end_frequency": "3 Hz", "sweep_time": "1 s"}
ANGLE = {"proportional_band": "6 deg", "dead_band": "0.2 deg", "reference": CHIRP}
PID = {
    "lowers": "plantarflexor",
    "integral_time": "0.5 s",
    "derivative_time": "0.05 s",
    "derivative_filter": "0.02 s",
    "output_limit": 0.9,
    "least_output": 0.05,
    "angle": ANGLE,
}
TABLE = {"table": [["0 s", "-1 deg"], ["1 s", "3 deg"]]}
PRESSURE = {
    "column": "chamber/dorsiflexor/pressure",
    "proportional_band": "0.5 bar",
    "dead_band": "0.05 bar",
    "reference": {"mean": "1 bar", "amplitude": "0.5 bar"},
}
MOMENT = {
    "column": "ankle/moment/orthosis",
    "proportional_band": "1 N*m",
    "dead_band": "0.05 N*m",
    "reference": {"mean": "1 N*m", "amplitude": "0.5 N*m"},
}
PAIR = {"mean": "1.5 bar", "half_range": "1.5 bar"}
DRIVES = {name: {"kind": "bang_bang"} for name in ("dorsiflexor", "plantarflexor")}
SENSOR = {"late": {"column": "ankle/angle", "gain": 0.5}, "rate": {"column": "ankle/velocity", "gain": 0.5}}
BASES: dict[str, dict[str, Any]] = {
    "pid": {"pid": PID},
    "table": {"pid": PID | {"angle": ANGLE | {"reference": TABLE}}},
    "moment": {"pid": PID | {"angle": None, "moment": MOMENT}},
    "pressure": {"pid": PID | {"angle": None, "lowers": None, "pressure": PRESSURE}},
    "pair": {"pid": PID | {"least_output": 0.0, "pressures": PAIR}},
}
OUTPUT, MOVED = "controller/output", "chamber/dorsiflexor/pressure"
# (base, key below the controller, changed value, column that must move)
CHANGES = [
    ("pid", "pid.raises", None, MOVED),
    ("pid", "pid.lowers", None, "chamber/plantarflexor/pressure"),
    ("pid", "pid.integral_time", "1 s", OUTPUT),
    ("pid", "pid.derivative_time", "0.1 s", OUTPUT),
    ("pid", "pid.derivative_filter", "0.1 s", OUTPUT),
    ("pid", "pid.output_limit", 0.3, OUTPUT),
    ("pid", "pid.least_output", 0.3, MOVED),
    ("pid", "pid.angle.column", "sensor/late", OUTPUT),
    ("pid", "pid.angle.proportional_band", "8 deg", OUTPUT),
    ("pid", "pid.angle.dead_band", "1 deg", OUTPUT),
    ("pid", "pid.angle.reference.mean", "2 deg", OUTPUT),
    ("pid", "pid.angle.reference.amplitude", "3 deg", OUTPUT),
    ("pid", "pid.angle.reference.frequency", "1.2 Hz", OUTPUT),
    ("pid", "pid.angle.reference.end_frequency", "4 Hz", OUTPUT),
    ("pid", "pid.angle.reference.sweep_time", "2 s", OUTPUT),
    ("table", "pid.angle.reference.table[1][1]", "2 deg", OUTPUT),
    ("table", "pid.angle.reference.between", "line", OUTPUT),
    ("table", "pid.angle.reference", {"column": "qpos/ankle"}, OUTPUT),
    ("moment", "pid.moment.column", "sensor/moment", OUTPUT),
    ("moment", "pid.moment.proportional_band", "2 N*m", OUTPUT),
    ("moment", "pid.moment.dead_band", "0.2 N*m", OUTPUT),
    ("moment", "pid.moment.reference.mean", "1.3 N*m", OUTPUT),
    ("moment", "pid.moment.reference.amplitude", "0.7 N*m", OUTPUT),
    ("moment", "pid.moment.reference", {"table": [["0 s", "1 N*m"]]}, OUTPUT),
    ("pressure", "pid.pressure.column", "sensor/pressure", OUTPUT),
    ("pressure", "pid.pressure.proportional_band", "1 bar", OUTPUT),
    ("pressure", "pid.pressure.dead_band", "0.2 bar", OUTPUT),
    ("pressure", "pid.pressure.reference.mean", "1.2 bar", OUTPUT),
    ("pressure", "pid.pressure.reference.amplitude", "0.3 bar", OUTPUT),
    ("pressure", "pid.pressure.reference", {"table": [["0 s", "1 bar"]]}, OUTPUT),
    ("pair", "pid.pressures.mean", "1.2 bar", MOVED),
    ("pair", "pid.pressures.half_range", "1 bar", MOVED),
]
TABLES = {
    "pid": Pid,
    "pid.angle": AngleLoop,
    "pid.moment": MomentLoop,
    "pid.pressure": PressureLoop,
    "pid.pressures": PairPressures,
    "pid.angle.reference": Reference,
    "pid.moment.reference": MomentReference,
    "pid.pressure.reference": PressureReference,
}
# These are moved in the angle's reference: they are one class's.
SHARED = ("frequency", "end_frequency", "sweep_time", "between", "column")


def sets(base: str) -> dict[str, Any]:
    sensor = SENSOR | {
        "moment": {"column": "ankle/moment/orthosis", "gain": 0.5},
        "pressure": {"column": "chamber/dorsiflexor/pressure", "gain": 0.5},
    }
    found = {
        "timer": None,
        "duration": "2 s",
        "sensor": sensor,
        "controller": {"rate": "100 Hz"} | BASES[base],
    }
    return found | ({"drive": DRIVES} if base == "pair" else {})


@pytest.fixture(scope="module")
def bases() -> dict[str, afo_sim.Recording]:
    return {name: afo_sim.run("seated", sets(name)) for name in BASES}


def test_every_field_is_changed_somewhere() -> None:
    changed = {key for _, key, _, _ in CHANGES}
    for table, kind in TABLES.items():
        for name in fields_of(kind):
            key = f"{table}.{name}"
            covered = any(each == key or each.startswith((f"{key}.", f"{key}[")) for each in changed)
            alone = table.endswith("reference") and (name in SHARED or f"{table}" in changed)
            assert covered or alone, f"{key} has no declared output"


@pytest.mark.parametrize(("base", "key", "changed", "column"), sampled(CHANGES, 12))
def test_a_field_moves_its_output(
    base: str, key: str, changed: Any, column: str, bases: dict[str, afo_sim.Recording]
) -> None:
    more: dict[str, Any] = {f"controller.{key}": changed}
    if key.endswith("raises"):
        more = {"controller.pid.raises": "plantarflexor", "controller.pid.lowers": "dorsiflexor"}
    before, after = bases[base], afo_sim.run("seated", sets(base) | more)
    assert before.ok, before.status
    assert_moves(before, after, column, 1e-3, key)
