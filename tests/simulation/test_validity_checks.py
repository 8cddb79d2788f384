"""Warnings of runs that are not to be believed, and the energy balance among the metrics of a run."""

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import afo_sim
from afo_sim import load
from afo_sim.common import Notice, with_code
from afo_sim.metrics import words
from afo_sim.model import Built
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.simulation import balance, make_recording
from afo_sim.simulation.columns import columns_of
from afo_sim.simulation.energy_balance import law_forces, with_static_forces
from afo_sim.simulation.run import _warnings
from afo_sim.simulation.simulate import simulate
from afo_sim.simulation.validity_checks import _law_warnings, limit_warnings, validity_warnings

TERMS = ("skeleton_work", "damper_loss", "friction_loss", "spring_change", "bladder_change")
Rows = dict[str, np.ndarray]


@pytest.fixture(scope="module")
def seated() -> tuple[Built, Rows, Rows]:
    """A second and a half at 2 ms, filled for half of it: compiled scenario, columns, static forces."""
    times = {"period": "1 s", "dorsiflexor": {"inlet": [["0 s", "0.5 s"]], "outlet": [["0.5 s", "1 s"]]}}
    built = build(load("scenario", "seated", {"duration": "1.5 s", "timer": times}))
    rollout = simulate(built, schedule.controls(built))
    columns, static = with_static_forces(built, rollout, columns_of(built, rollout))
    return built, dict(columns), dict(static)


def doubts(case: tuple[Built, Rows, Rows], **changed: np.ndarray) -> list[str]:
    built, columns, static = case
    columns = columns | {name.replace("__", "/"): values for name, values in changed.items()}
    return list(validity_warnings(built, columns, static, balance(built, columns, static)))


def test_a_run_that_is_fine_has_no_warning(seated: tuple[Built, Rows, Rows]) -> None:
    assert doubts(seated) == []


def test_the_forces_that_the_run_kept_are_those_of_the_law(seated: tuple[Built, Rows, Rows]) -> None:
    built, columns, static = seated
    assert set(static) == {"dorsiflexor_1", "plantarflexor_1"}
    muscle = built.scenario.orthosis.muscle["dorsiflexor"].type
    asked = law_forces(
        muscle, columns["muscle/dorsiflexor_1/contraction"], columns["chamber/dorsiflexor/pressure"]
    )
    assert np.ptp(asked) > 10.0
    assert static["dorsiflexor_1"] == pytest.approx(asked, abs=1e-9)


@pytest.mark.parametrize(
    ("stretch", "share"), [(0.003, 9e-4), (0.02, 0.0175)]
)  # of its stiffness: the braid's
@pytest.mark.parametrize(("pull", "warned"), [(0.009, False), (0.011, True)])  # of the force limit: the law's
def test_what_a_stretched_braid_carries_is_not_asked_of_its_law(
    seated: tuple[Built, Rows, Rows], stretch: float, share: float, pull: float, warned: bool
) -> None:
    """Its stiffness rises over the first 0.5 % of stretch; above the law's range the braid may pull alone."""
    built, columns, static = seated
    muscle = built.scenario.orthosis.muscle["dorsiflexor"].type
    values = {"contraction": (-stretch, 0.0), "pressure": (2.0 * muscle.law_set.pressure_range[1], 0.0)}
    force = share * muscle.braid_stiffness + pull * muscle.limits.force
    here = np.arange(len(columns["time"])) == 300
    names = ("muscle/dorsiflexor_1/contraction", "chamber/dorsiflexor/pressure")
    changed = {name: np.where(here, *values[name.split("/")[-1]]) for name in names}
    forces = static | {"dorsiflexor_1": np.where(here[: len(static["dorsiflexor_1"])], force, 0.0)}
    found = limit_warnings(built, columns | changed, forces)
    told = [notice for notice in with_code(found, "law-outside-its-pressure") if "dorsi" in notice]
    assert len(told) == warned
    assert all(notice.data["time"] == columns["time"][300] for notice in told)


@pytest.mark.parametrize(("pull", "warned"), [(0.0, False), (0.009, False), (0.011, True)])
def test_what_a_stretched_tube_carries_is_not_asked_of_its_law(pull: float, warned: bool) -> None:
    """Without air a stretched muscle pulls by tube and braid alone, however much; its law begins at 1 bar."""
    own = {"orthosis.muscle.dorsiflexor.type": "handmade_10mm"}
    group = load("scenario", "seated", own).orthosis.muscle["dorsiflexor"]
    muscle, limit = group.type, group.type.limits.force
    kappa, gauge = np.array([0.0, -0.01]), np.zeros(2)
    alone = law_forces(muscle.with_values(return_stiffness=0.0), kappa, gauge)
    without = law_forces(muscle.with_values(return_stiffness=0.0, tube=None), kappa, gauge)
    assert alone[1] - without[1] > 0.05 * limit  # far more than what is negligible
    columns = {"muscle/dorsiflexor_1/contraction": kappa, "chamber/dorsiflexor/pressure": gauge}
    columns["time"] = np.arange(2.0)
    found = [*_law_warnings("dorsiflexor_1", group, columns, alone + pull * limit * np.array([0.0, 1.0]))]
    assert bool(with_code(found, "law-outside-its-pressure")) is warned


def test_a_balance_that_does_not_close_is_placed(seated: tuple[Built, Rows, Rows]) -> None:
    """The path jumps by 5 cm without the muscle, where it pulls most: n T 5 cm is missing."""
    built, columns, _ = seated
    path = columns["muscle/dorsiflexor_1/path_length"].copy()
    tension = columns["muscle/dorsiflexor_1/force"]
    at = int(np.argmax(tension))
    path[at:] += 0.05
    found = doubts(seated, muscle__dorsiflexor_1__path_length=path)
    energy = balance(built, columns)
    work = 3.0 * 0.5 * (tension[at] + tension[at - 1]) * 0.05
    share = 100.0 * work / (energy.turnover + energy.damper_loss + abs(energy.law_mismatch))
    assert share > 1.0
    assert len(found) == 1
    assert f"{share:.1f} % of the work is unaccounted for" in found[0]
    near = re.search(r"near ([0-9.]+) s, where dorsiflexor_1 moves", found[0])
    assert near is not None and float(near[1]) == pytest.approx(columns["time"][at], abs=0.04)


@pytest.mark.parametrize(
    ("name", "sets"),
    [
        ("seated", {"duration": "3 s"}),
        ("arm", {"duration": "3 s"}),
        ("walk-dropfoot-afo", {"duration": "5 s"}),
    ],
)
def test_the_balance_stands_among_the_metrics(name: str, sets: dict[str, Any]) -> None:
    """What the air and the law give is what the other terms take, to the error."""
    run = afo_sim.run(name, sets)
    metrics = run.metrics
    given = metrics["air_work"] + metrics["law_mismatch"]
    assert given == pytest.approx(sum(metrics[term] for term in TERMS), abs=1e-3 * abs(metrics["air_work"]))
    assert "-0.1 %" < metrics["energy_error"] < "0.1 %"
    for term in ("air_work", "law_mismatch", *TERMS):
        assert metrics[term].unit == "J" and words(term).meaning
    assert run.summary()["metrics"]["energy_error"]["unit"] == "percent"


def test_a_run_without_muscles_or_of_two_rows_has_no_balance() -> None:
    assert "air_work" not in afo_sim.run("walk-healthy", {"duration": "3 s"}).metrics
    assert "air_work" not in afo_sim.run("seated", {"duration": "4 ms"}).metrics


def test_a_stretch_that_is_watched_has_none() -> None:
    built = build(load("scenario", "seated", {"duration": "1 s"}))
    seen: list[Any] = []
    whole = simulate(built, schedule.controls(built), see=seen.append)
    assert seen and "air_work" not in make_recording(built, seen[0]).metrics
    assert "air_work" in make_recording(built, whole).metrics


def notice(code: str, value: float, subject: str = "front", **data: float) -> Notice:
    return Notice(code, "front: the law x was asked at {value:g}", subject=subject, value=value, **data)


def test_what_was_said_of_the_settled_stride_is_not_said_again_and_all_else_is() -> None:
    settled: Any = SimpleNamespace(found=True, slowest=0.1)
    first: Any = SimpleNamespace(warnings=("of the description",))
    doubts = notice("energy-lost", 0.7, "back", beyond=0.7), notice("metric-undefined", 0.8)
    before: Any = SimpleNamespace(
        limits=(notice("law-pressure", 3.0), notice("law-contraction", 0.4)),
        found=SimpleNamespace(warnings=doubts),
    )
    after: Any = SimpleNamespace(
        limits=(notice("law-pressure", 2.0), notice("law-pressure", 2.0, "back")),
        found=SimpleNamespace(warnings=(notice("other", 1.0), notice("source-empty", 9.0))),
    )
    found = _warnings(first, before, after, settled, (notice("source-empty", 5.0),))
    assert found == (
        "of the description",
        "front: the law x was asked at 5",
        "front: the law x was asked at 2",
        "front: the law x was asked at 2",
        "front: the law x was asked at 1",
        "before it settles: front: the law x was asked at 0.4",
        "before it settles: front: the law x was asked at 0.7",
    )
    last = found[-2]
    assert isinstance(last, Notice) and (last.code, last.subject) == ("law-contraction", "front")
