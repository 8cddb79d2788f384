"""Every parameter is live: changed a little, a named output of a shipped scenario moves.

The parameters are found in the resolved scenario, not listed here: a new one without an entry in
OUTPUTS fails.
"""

import pathlib
from typing import Any

import numpy as np
import pytest
from campaign import sampled
from laws_of_nature.liveness import assert_moves, is_one, nudged, parameters

import afo_sim
from afo_sim.common import format_quantity
from afo_sim.description import load
from afo_sim.physics import FRICTIONS
from afo_sim.simulation import Recording

SCENARIO = "seated-antagonist"
SHORT = {"duration": "8.2 s"}
# Stretched beyond the nominal length at rest: only there does the braid's own stiffness act.
STRETCHED = {
    "duration": "0.3 s",
    "orthosis.range_of_motion": ["-9 deg", "-4 deg"],
    "orthosis.muscle.dorsiflexor.link_length": "9.9 cm",
    "orthosis.muscle.plantarflexor.link_length": "8 cm",
}

LONG = {"duration": "10 s"}  # the plantarflexor vents from 8 s on, and its outlet is choked for a while
# Of muscles that were measured themselves; the pressure of that test means nothing else.
ENDS = {f"orthosis.muscle.{role}.type.blocked_force": "700 N" for role in ("dorsiflexor", "plantarflexor")}
# Each piece of a muscle has ends; where they take nothing, it is as strong in two pieces as in one.
WEAKER = {f"orthosis.muscle.{role}.type.end_loss": "5 mm" for role in ("dorsiflexor", "plantarflexor")}
RUNS = {"plain": SHORT, "stretched": SHORT | STRETCHED, "long": LONG, "ends": SHORT | ENDS}
RUNS["pieces"] = SHORT | WEAKER

# Which recorded column must move, by the parameter's key; the first pattern that fits counts.
OUTPUTS = {
    "*_delay": "valve/{role}_{side}/opening",
    "orthosis.chamber.*": "chamber/{role}/pressure",
    "orthosis.anchor.*": "cuff/{anchor}/displacement",
    "*.cable.*": "muscle/{role}_1/force",
    "*.type.mass": "ankle/moment/gravity",
    "*.type.dead_volume": "chamber/{role}/volume",
    "*.type.damping": "muscle/{role}_1/force",
    "*.type.braid_stiffness": "muscle/{role}_1/force",
    "*.type.*": "muscle/{role}_1/force",
    "*.spacing": "muscle/{role}_1/length",
    "*.from_joint": "muscle/{role}_1/moment_arm",
    "orthosis.muscle.*": "muscle/{role}_1/contraction",
    "supply.pressure": "chamber/dorsiflexor/pressure",
    "shank.knee_angle": "ankle/moment/passive",
    "leg.*": "ankle/moment/passive",
    "load_moment": "ankle/angle",
    "timer.period": "valve/dorsiflexor_inlet/coil",
    "timer.*": "valve/{role}_{side}/opening",
}
# Beside what no run depends on.
LEFT_OUT = (
    *("*.law", "*.grade", "phases", "gait", "patient", "ground", "shoe", "start", "reference"),
    # test_walking_liveness.py moves these
    *("leg.toes*", "leg.body_mass", "leg.body_height", "orthosis.outsole*", "orthosis.interface.*"),
    "limits.*",
    "worn_on",  # of the responding walker: tests/walker
    *("*_ramp", "*.threshold", "*.hold_*", "*_by_flow", "*_inertia", "*.port_volume"),  # tests/air
    *("*.friction", "*.damper"),
    *("*.path", "*.wrap_friction"),  # straight here; test_path_and_its_friction_act moves those of guided
    "*.pulley",  # none here; test_arm.py moves those of the arm
    *("*.directions", "*.frictions.*", "*_range", "*.chamber", "*.segment", "*.limits.*"),
    "*.covariance*",  # of draws, not of a run
)


def told() -> dict[str, Any]:
    """Every number of the scenario by its dotted key; lists of coordinates and events stay whole."""
    return parameters(SCENARIO, SHORT, LEFT_OUT)


def role_of(key: str) -> str:
    return "plantarflexor" if "plantarflexor" in key else "dorsiflexor"


def anchor_of(key: str) -> str:
    return "foot" if ".foot." in key else "shank"


@pytest.fixture(scope="module")
def base() -> dict[str, Recording]:
    return {name: afo_sim.run(SCENARIO, sets) for name, sets in RUNS.items()}


def cases() -> list[tuple[str, Any]]:
    found = []
    for key, value in told().items():
        if key.startswith("timer.") and key != "timer.period":
            start, end = value[0]
            changed = [[start, nudged(end)]] if end != "8.0 s" else [["4.2 s", end]]
            found.append((key, changed))
        elif isinstance(value, list):
            for axis in range(3):
                # 5 % less: a muscle mounted 5 % farther off would lock
                found.append((key, [nudged(x, -0.05) if k == axis else x for k, x in enumerate(value)]))
        else:
            found.append((key, nudged(value)))
    return found


@pytest.mark.slow
@pytest.mark.parametrize(("key", "changed"), sampled(cases(), 24))
def test_parameter_moves_its_output(key: str, changed: Any, base: dict[str, Recording]) -> None:
    pattern = is_one(key, OUTPUTS)
    assert pattern is not None, f"{key} has no declared output"
    side = "outlet" if "outlet" in key else "inlet"
    column = OUTPUTS[pattern].format(role=role_of(key), side=side, anchor=anchor_of(key))
    run = "stretched" if key.endswith("braid_stiffness") else "plain"
    run = "ends" if key.endswith("test_pressure") else run
    run = "pieces" if key.endswith("pieces") else run
    run = "long" if key.endswith("outlet.critical_ratio") else run
    assert_moves(base[run], afo_sim.run(SCENARIO, RUNS[run] | {key: changed}), column, 1e-7, key)


LOSSES = {
    name: [str(format_quantity(p.typical, p.unit)) for p in friction.parameters]
    for name, friction in FRICTIONS.items()
}
DAMPER = {
    "contracting": ["500 N*s/m", "1e-3 N*s/(m*Pa)"],
    "relaxing": ["200 N*s/m", "1e-3 N*s/(m*Pa)"],
    "switch_pressure": "2.5 bar",
    "relaxing_above": ["300 N*s/m", "1e-3 N*s/(m*Pa)"],
}


@pytest.mark.slow
@pytest.mark.parametrize("friction", FRICTIONS)
def test_friction_and_each_of_its_parameters_act(friction: str) -> None:
    muscle, force = "orthosis.muscle.dorsiflexor.type", "muscle/dorsiflexor_1/force"
    names = [p.name for p in FRICTIONS[friction].parameters]
    table = dict(zip(names, LOSSES[friction], strict=True))
    sets = {"duration": "6 s", f"{muscle}.friction": friction, f"{muscle}.frictions.{friction}": table}
    with_friction = afo_sim.run("seated", sets)[force]
    without = afo_sim.run("seated", {"duration": "6 s"})[force]
    assert np.abs(with_friction - without).max() > 1.0
    for name in names:
        changed = nudged(table[name] if " " in table[name] else float(table[name]), 0.3)
        moved = afo_sim.run("seated", sets | {f"{muscle}.frictions.{friction}": table | {name: changed}})[
            force
        ]
        assert np.abs(moved - with_friction).max() > 1e-3, name


@pytest.mark.slow
@pytest.mark.parametrize("key", DAMPER)
def test_three_element_damper_acts(key: str) -> None:
    damper, force = "orthosis.muscle.dorsiflexor.type.damper", "muscle/dorsiflexor_1/force"
    before = afo_sim.run("seated", {"duration": "6 s", damper: DAMPER})[force]
    for k in range(2 if isinstance(DAMPER[key], list) else 1):
        value = DAMPER[key]
        if isinstance(value, list):
            changed: Any = [nudged(x, 0.5) if i == k else x for i, x in enumerate(value)]
        else:
            changed = nudged(value, 0.5)
        after = afo_sim.run("seated", {"duration": "6 s", damper: DAMPER | {key: changed}})[force]
        assert np.abs(after - before).max() > 1e-3, (key, k)


GUIDED: dict[str, Any] = {"orthosis": "guided", "duration": "8 s"}
FRONT, SIDE, HEEL = (
    f"orthosis.muscle.{name}" for name in ("dorsiflexor", "dorsiflexor_side", "plantarflexor")
)
PATHS: dict[str, tuple[Any, str]] = {
    f"{FRONT}.wrap_friction": (0.15, "muscle/dorsiflexor_1/joint_force"),
    f"{FRONT}.path[0].from_joint[0]": ("4.0 cm", "muscle/dorsiflexor_1/moment_arm"),
    f"{FRONT}.path[0].from_joint[2]": ("5.5 cm", "muscle/dorsiflexor_1/moment_arm"),
    f"{FRONT}.path[0].surface.radius": ("3.4 cm", "muscle/dorsiflexor_1/moment_arm"),
    f"{FRONT}.path[0].surface.axis[0]": (0.6, "muscle/dorsiflexor_1/moment_arm"),
    f"{FRONT}.path[0].surface.shape": ("sphere", "muscle/dorsiflexor_1/moment_arm"),
    f"{FRONT}.path[0].segment": ("foot", "muscle/dorsiflexor_1/moment_arm"),
    f"{SIDE}.path[0].from_joint[0]": ("5.2 cm", "muscle/dorsiflexor_side_1/moment_arm"),
    f"{SIDE}.path[0].from_joint[1]": ("1 cm", "muscle/dorsiflexor_side_1/moment_arm"),
    f"{SIDE}.path[0].from_joint[2]": ("6.5 cm", "muscle/dorsiflexor_side_1/moment_arm"),
    f"{SIDE}.path[0].spacing": ("7 cm", "muscle/dorsiflexor_side_1/moment_arm"),
    f"{HEEL}.path[0].surface.radius": ("4.7 cm", "muscle/plantarflexor_1/moment_arm"),
}


@pytest.fixture(scope="module")
def guided() -> Recording:
    return afo_sim.run(SCENARIO, GUIDED)


@pytest.mark.slow
@pytest.mark.parametrize("key", PATHS)
def test_path_and_its_friction_act(key: str, guided: Recording) -> None:
    changed, column = PATHS[key]
    own: dict[str, Any] = {}
    if key.endswith("segment"):  # nothing slides on the foot
        own = {f"{FRONT}.wrap_friction": 0}
    if key.endswith("shape"):  # in the plane of its axis a sphere is passed as a cylinder is
        own = {f"{FRONT}.path[0].from_joint[1]": "1 cm"}
    before = afo_sim.run(SCENARIO, GUIDED | own) if key.endswith("shape") else guided
    assert_moves(before, afo_sim.run(SCENARIO, GUIDED | own | {key: changed}), column, 1e-3, key)


@pytest.mark.parametrize("key", ["force", "length"])
def test_stiffening_cuff_acts(key: str) -> None:
    cuff, column = "orthosis.anchor.shank", "cuff/shank/displacement"
    without = {"duration": "6 s", f"{cuff}.stiffness": None}
    table = {"force": "33 N", "length": "17 mm"}
    before = afo_sim.run("seated", without | {f"{cuff}.stiffening": table})[column]
    changed = table | {key: nudged(table[key], 0.3)}
    after = afo_sim.run("seated", without | {f"{cuff}.stiffening": changed})[column]
    assert np.abs(after - before).max() > 1e-4


INSIDE = {"orthosis.muscle.dorsiflexor.insertion.from_joint": ["6.5 cm", "1 cm", "-1 cm"]}


@pytest.mark.parametrize("key", ["orthosis.side", "side", "leg.side"])
def test_sides_act(key: str, tmp_path: pathlib.Path) -> None:
    """A foot whose mass stands aside, under an orthosis that pulls aside: a mirrored one turns otherwise.

    The simulated side turns all over: what turns the foot inside stays, and the model that ran is the mirror
    image.
    """
    shipped = pathlib.Path(load("leg", "adult_75kg").file)
    text = shipped.read_text().replace('pos="0.0386054 0 ', 'pos="0.0386054 0.01 ')
    (tmp_path / "leg.xml").write_text(text)
    fixed = {} if key == "side" else {"side": "right"}
    sets = {"duration": "1 s", "leg.file": str(tmp_path / "leg.xml")} | INSIDE | fixed
    runs = [afo_sim.run("seated", sets | changed) for changed in ({}, {key: "left"})]
    moments = [run["ankle/moment/inversion"] for run in runs]
    muscle = [run.model().site("dorsiflexor_2_insertion").pos[1] for run in runs]
    mass = [run.model().body("foot").ipos[1] for run in runs]
    turned = key == "orthosis.side"
    assert np.ptp(moments[0]) > 0.05
    np.testing.assert_allclose(moments[1], -moments[0] if turned else moments[0], atol=1e-12)
    assert muscle[1] == (muscle[0] if key == "leg.side" else -muscle[0]) != 0.0
    assert mass[1] == (mass[0] if turned else -mass[0]) != 0.0


def test_every_parameter_is_found() -> None:
    keys = set(told())
    for expected in (
        "orthosis.muscle.dorsiflexor.type.laws.tondu_lopez_2000_bladder.bladder_force",
        "orthosis.chamber.plantarflexor.outlet.closing_delay",
        "leg.passive.offset",
        "supply.pressure",
        "timer.plantarflexor.inlet",
    ):
        assert expected in keys
    assert len(keys) > 60


@pytest.mark.parametrize(
    ("limit", "low", "word", "sets"),
    [
        ("pressure", "1 bar", "gauge pressure", {}),
        ("force", "5 N", "force", {}),
        ("contraction_max", 0.1, "contraction", {}),
        ("contraction_min", -0.001, "stretch", STRETCHED),
    ],
)
def test_limits_speak(limit: str, low: Any, word: str, sets: dict[str, Any]) -> None:
    lower = {f"orthosis.muscle.dorsiflexor.type.limits.{limit}": low}
    assert any(word in warning for warning in afo_sim.run("seated", SHORT | sets | lower).warnings)
