"""Safety margins of runs: against MuJoCo's own geometry, the mounting's own force, and each other."""

import pathlib
from typing import Any

import mujoco
import numpy as np
import pytest
from peaks import over_10_ms
from yielding import rigid_run, yielding_run

import afo_sim
from afo_sim import load
from afo_sim.cli.doctor.kinds import check_file
from afo_sim.description import Segment
from afo_sim.metrics import WORDS
from afo_sim.metrics.metric import SAFETY
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.simulation import Asked, Recording
from afo_sim.simulation.examine import examine
from afo_sim.simulation.facts import pull_on
from afo_sim.simulation.simulate import simulate
from afo_sim.study import engine

NEEDED = {name for name, row in WORDS.items() if row.group == SAFETY}
SHORT = {"duration": "2 s"}
WALKED = {"duration": "2.4 s", "gait.settled": "walked", "start": {"dorsiflexor": {"fill_time": "2.5 s"}}}
SKIN = ("cuff_", "plate_")


def held(recording: Recording) -> dict[str, Any]:
    return {name: metric for name, metric in recording.metrics.items() if name in NEEDED}


def without(part: str, **sets: Any) -> Any:
    """The seated scenario without a part of the orthosis."""
    scenario = load("scenario", "seated", SHORT | sets).resolved()
    del scenario["orthosis"][part]
    return scenario


@pytest.fixture(scope="module")
def walk() -> Recording:
    return afo_sim.run("walk-dropfoot-afo", {"duration": "4.4 s"})


# --- geometry


@pytest.mark.parametrize("angle", [-0.4, 0.0, 0.3])
def test_the_pull_is_that_of_mujocos_own_sites(angle: float) -> None:
    """Each tension along the line of its two sites, in the axes of shank and foot as MuJoCo turns them."""
    built = build(load("scenario", "seated"))
    model, rng = built.full_model, np.random.default_rng(1)
    data = mujoco.MjData(model)
    data.qpos[built.index.ankle_qpos] = angle
    mujoco.mj_kinematics(model, data)
    force = {name: float(rng.uniform(10.0, 200.0)) for name in built.index.muscles}
    total = np.zeros(3)  # on the shank, in the world
    for name, tension in force.items():
        path = data.site(f"{name}_insertion").xpos - data.site(f"{name}_origin").xpos
        total += tension * path / np.linalg.norm(path)
    columns = {"ankle/angle": np.array([angle])}
    columns |= {f"muscle/{name}/force": np.array([tension]) for name, tension in force.items()}
    leg = built.scenario.leg
    bodies: tuple[tuple[Segment, str, float], ...] = (("shank", leg.shank, 1.0), ("foot", leg.foot, -1.0))
    for segment, body, sign in bodies:
        axes = data.body(body).xmat.reshape(3, 3)
        expected = sign * axes.T @ total
        assert pull_on(built.scenario.orthosis, segment, columns)[0] == pytest.approx(expected, abs=1e-9)


def test_the_pull_on_the_foot_turns_it_by_the_torque_of_the_orthosis(walk: Recording) -> None:
    """The moment of the pull about the ankle, at one recorded row."""
    built = build(load("scenario", "walk-dropfoot-afo"))
    row = int(np.argmax(walk["muscle/dorsiflexor_2/force"]))
    part = {name: values[row : row + 1] for name, values in walk.columns.items()}
    silent = {f"muscle/plantarflexor_{k}/force": np.zeros(1) for k in (1, 2)}
    force = pull_on(built.scenario.orthosis, "foot", part | silent)[0]
    # all dorsiflexors end 6.5 cm ahead of the ankle and 1 cm below it: moment z × x about the rightward axis
    moment = 0.065 * force[2] + 0.010 * force[0]
    assert moment == pytest.approx(part["ankle/moment/orthosis"][0], rel=1e-6)


def test_the_mounting_carries_what_the_muscles_pull() -> None:
    """The force in the yielding cuff, solved with the muscles, is the sum of their tensions."""
    run = yielding_run()
    tensions = sum(
        values for name, values in run.columns.items() if name.startswith("muscle/") and "/force" in name
    )
    assert run["cuff/shank/force"] == pytest.approx(tensions, abs=1e-3 * float(np.max(tensions)))
    along = held(run)["cuff_pull_along"].value
    assert 0.98 * run["cuff/shank/force"].max() < along <= run["cuff/shank/force"].max() * (1.0 + 1e-3)


def test_stiffer_anchors_press_ever_more_as_rigid_ones_do() -> None:
    """What a mounting gives is as one over its stiffness, and so is what is left to the rigid one."""
    rigid = held(rigid_run("3 s"))
    off = {}
    for stiffness in (1e7, 1e8):
        sets = {f"orthosis.anchor.{part}.stiffness": f"{stiffness} N/m" for part in ("shank", "foot")}
        found = held(afo_sim.run("seated", {"duration": "3 s", **sets}))
        assert found.keys() == rigid.keys()
        off[stiffness] = {name: found[name].value / value for name, value in rigid.items() if value != 0.0}
    for name, ratio in off[1e8].items():
        assert ratio == pytest.approx(1.0, abs=2e-4), name
        assert ratio - 1.0 == pytest.approx(0.1 * (off[1e7][name] - 1.0), rel=0.05, abs=1e-7), name


# --- what it hangs on


def test_without_an_interface_no_pressure_is_told() -> None:
    found = held(afo_sim.run(without("interface")))
    assert found and not any(name.startswith(SKIN) for name in found)
    cuff = {"area": "150 cm^2", "friction": 0.5}
    scenario = without("interface")
    scenario["orthosis"]["interface"] = {"shank": cuff}
    found = held(afo_sim.run(scenario))
    assert "cuff_skin_pressure" in found and not any(name.startswith("plate_") for name in found)


def test_an_orthosis_without_muscles_and_an_arm_of_pulleys_have_no_skin() -> None:
    assert held(afo_sim.run("walk-dropfoot", {"duration": "2.4 s"})) == {}
    arm = held(afo_sim.run("arm", {"duration": "0.5 s"}))
    assert arm and not any(name.startswith(SKIN) for name in arm)


def test_without_air_the_cuff_bears_only_what_stretched_bladders_pull() -> None:
    empty = held(afo_sim.run("seated", SHORT | {"supply.pressure": "1e-6 bar"}))
    assert empty["muscle_share_of_pressure"] < 1e-3
    assert empty["cuff_pull_along"] < held(afo_sim.run("seated", SHORT))["cuff_pull_along"].value / 10.0


def test_area_and_friction_change_the_pressure_and_nothing_else(walk: Recording) -> None:
    other = afo_sim.run(
        "walk-dropfoot-afo",
        {
            "duration": "4.4 s",
            "orthosis.interface.shank.area": "300 cm^2",
            "orthosis.interface.shank.friction": 0.25,
        },
    )
    for name, value in walk.metrics.items():
        if name == "cuff_holding_force":
            assert other.metrics[name].value == pytest.approx(2.0 * value.value)
        elif name == "cuff_skin_pressure_sustained" or name == "cuff_share_of_blood_flow":
            assert other.metrics[name].value == pytest.approx(value.value)
        elif not name.startswith("cuff_"):
            assert other.metrics[name] == value, name


def test_shares_are_those_of_the_recorded_rows(walk: Recording) -> None:
    """From the settled rows of the recording, and the muscle's limits, by hand."""
    built = build(load("scenario", "walk-dropfoot-afo"))
    limits = built.scenario.orthosis.muscle["dorsiflexor"].type.limits
    last = walk["gait/stride"] == walk["gait/stride"].max()
    names = [f"muscle/dorsiflexor_{k}" for k in (1, 2, 3)] + [f"muscle/plantarflexor_{k}" for k in (1, 2)]
    force, contraction = (
        max(over_10_ms(walk["time"][last], walk[f"{name}/{of}"][last]) for name in names)
        for of in ("force", "contraction")
    )
    share = 100.0 * force / limits.force
    assert walk.metrics["muscle_share_of_force"].value == pytest.approx(share, rel=1e-3)
    share = 100.0 * contraction / limits.contraction_max
    assert walk.metrics["muscle_share_of_contraction"].value == pytest.approx(share, rel=1e-3)
    assert walk.metrics["muscle_cycles_per_stride"] == 1.0
    assert walk.metrics["days_until_muscle_life"] == 500.0


# --- asked alone, and warned of


@pytest.mark.parametrize(("scenario", "sets"), [("seated", SHORT), ("walk-dropfoot-afo", WALKED)])
def test_asked_alone_each_is_that_of_the_whole_run_to_the_bit(scenario: str, sets: dict[str, Any]) -> None:
    built = build(load("scenario", scenario, sets))
    rollout = simulate(built, schedule.controls(built))
    whole = examine(built, rollout)[1].totals
    told = {name for name in NEEDED if name in whole}
    assert {"cuff_skin_pressure", "plate_skin_pressure", "muscle_share_of_force"} <= told
    assert ("days_until_muscle_life" in told) is (built.walk is not None)
    for name in told:
        alone = examine(built, rollout, transient=False, asked=Asked(frozenset({name}), doubts=False))[
            1
        ].totals
        assert alone[name] == whole[name] and not alone.keys() & (told - {name})
    other = examine(built, rollout, transient=False, asked=Asked(frozenset({"air_per_cycle"}), doubts=False))[
        1
    ]
    assert not other.totals.keys() & told


@pytest.mark.slow
def test_a_cuff_that_hurts_is_told_with_what_it_is_held_against() -> None:
    small = {"orthosis.interface.shank.area": "30 cm^2", "duration": "2.4 s"}
    (said,) = _about_skin(afo_sim.run("walk-dropfoot-afo", small).warnings)
    assert "more than the 53 kPa at which pain begins (discomfort from 14 kPa; published)" in said
    assert "over 30 cm², at a friction of 0.5: assumed and user" in said
    wide = {"orthosis.interface.shank.area": "170 cm^2", "duration": "2.4 s"}
    assert not _about_skin(afo_sim.run("walk-dropfoot-afo", wide).warnings)


@pytest.mark.slow
def test_the_warning_follows_the_limits(walk: Recording) -> None:
    assert not _about_skin(walk.warnings)
    pressure = walk.metrics["cuff_skin_pressure"].value
    pull = float(np.max(walk["cuff/shank/force"]))  # nearly along the shank
    assert pressure == pytest.approx(pull / 0.5 / 15.0, rel=0.02)
    stricter = {"limits.skin_pressure[0]": f"{pressure - 1.0} kPa", "duration": "4.4 s"}
    said = _about_skin(afo_sim.run("walk-dropfoot-afo", stricter).warnings)[0]
    assert f"{pressure:.3g} kPa" in said and f"{pressure - 1.0:g} kPa at which discomfort begins" in said
    other = {"limits.skin_pressure[0]": f"{pressure + 1.0} kPa", "duration": "4.4 s"}
    milder = afo_sim.run("walk-dropfoot-afo", other)
    assert not _about_skin(milder.warnings)
    share = milder.metrics["cuff_share_of_discomfort"].value
    assert share == pytest.approx(100.0 * pressure / (pressure + 1.0))


def test_a_sweep_that_asks_for_one_has_it_as_the_run_does_to_the_bit(walk: Recording) -> None:
    """Also beside cases that are computed with it, and as a limit that a search may have."""
    asked = Asked(frozenset({"cuff_skin_pressure", "days_until_muscle_life"}), doubts=False)
    cases = [(0, {"duration": "4.4 s"}), (1, {"duration": "4.4 s", "supply.pressure": "2 bar"})]
    rows = dict(engine.outcomes("walk-dropfoot-afo", cases, asked=asked))
    for name in asked.metrics or ():
        assert rows[0].metrics[name] == walk.metrics[name]
    assert rows[1].metrics["cuff_skin_pressure"] < rows[0].metrics["cuff_skin_pressure"]
    assert rows[0].metrics["cuff_skin_pressure"] <= "30 kPa"


def _about_skin(warnings: tuple[str, ...]) -> list[str]:
    return [text for text in warnings if "on the skin" in text]


# --- told before any run


def test_check_tells_area_and_friction_with_their_kinds() -> None:
    told = dict(check_file(pathlib.Path(afo_sim.__file__).parents[1] / "models" / "orthoses" / "s1"))
    assert told["skin under the cuff"] == "150 cm² (assumed), friction 0.5 (assumed)"
    assert told["skin under the plate's strap"] == "60 cm² (assumed), friction 0.5 (assumed)"
