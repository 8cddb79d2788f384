"""The steps of a design's own parameters: from the description, such as a builder could make."""

import math

import pytest

import afo_sim as afo
from afo_sim.description import Scenario
from afo_sim.study.effect import Effect
from afo_sim.study.effects_parameters import steps, takes_air

WALK = "walk-dropfoot-afo"
# a second pair of dorsiflexors with valves of its own
TWO = {
    "orthosis.muscle.helper": {
        "count": 2,
        "type": "s1_215mm",
        "origin": {"segment": "shank", "from_joint": ["6 cm", "0 cm", "30 cm"]},
        "insertion": {"segment": "foot", "from_joint": ["6.5 cm", "0 cm", "-1 cm"]},
        "link_length": "11.2 cm",
    },
    "orthosis.chamber.helper": {
        "inlet": "mh1",
        "outlet": "mh1",
        "tube_volume": "4 ml",
        "wall_conductance": "0.3 W/K",
    },
    "phases.helper": {"inlet": [[0.5, 0.6], [0.7, 0.95]], "outlet": [[0.9, 0.2]]},
}


def walk(**sets: object) -> Scenario:
    return afo.load("scenario", WALK, sets)


def named(found: list[Effect], name: str) -> list[Effect]:
    return [step for step in found if step.name == name]


@pytest.mark.parametrize("scenario", [WALK, "walk-dropfoot-afo-short", "walk-dropfoot-afo-timer"])
def test_every_step_that_is_offered_changes_the_description(scenario: str) -> None:
    description = afo.load("scenario", scenario)
    for step in steps(description):
        if step.status == "run":
            changed = description.set(step.sets)
            assert changed.resolved() != description.resolved(), step.name


def test_a_step_up_and_a_step_down_stand_together() -> None:
    found = steps(walk())
    assert [(step.before, step.after) for step in named(found, "dorsiflexor link length")] == [
        ("11.2 cm", "10.7 cm"),
        ("11.2 cm", "11.7 cm"),
    ]
    assert [step.after for step in named(found, "cuff stiffness")] == ["2 kN/m", "8 kN/m"]
    assert [step.sets["orthosis.muscle.dorsiflexor.count"] for step in named(found, "dorsiflexor count")] == [
        2,
        4,
    ]


def test_an_anchor_moves_at_the_same_tautness() -> None:
    """Path less muscle and link, at an ankle angle of zero, from the places alone."""
    before = walk().orthosis.muscle["dorsiflexor"]
    for step in steps(walk()):
        if step.name.startswith("dorsiflexor") and step.name.endswith("link to match"):
            group = walk().set(step.sets).orthosis.muscle["dorsiflexor"]
            lengths = []
            for each in (before, group):
                assert each.origin and each.insertion and each.link_length is not None
                ends = zip(each.origin.from_joint, each.insertion.from_joint, strict=True)
                path = math.sqrt(sum((a - b) ** 2 for a, b in ends))
                lengths.append(path - each.type.total_length - each.link_length)
            assert lengths[0] == pytest.approx(lengths[1], abs=1e-6), step.name


def test_what_a_limit_forbids_is_told_with_the_limit() -> None:
    pressure = named(steps(walk()), "supply pressure")
    assert [step.status for step in pressure] == ["run", "forbidden"]
    assert "4.2 bar" in pressure[1].reason
    for begun in ("3.5 bar", "3.7 bar"):  # to 4.2 bar is not beyond it
        low = named(steps(walk(**{"supply.pressure": begun})), "supply pressure")
        assert [step.status for step in low] == ["run", "run"]


@pytest.mark.parametrize(
    ("interval", "name", "expected"),
    [
        ((0.5, 0.95), "inlet opens", [0.45, 0.55]),
        ((0.5, 0.95), "inlet closes", [0.9, 1.0]),
        ((0.02, 0.3), "inlet opens", [0.97, 0.07]),  # over heel strike
        ((0.5, 0.98), "inlet closes", [0.93, 0.03]),
        ((0.0, 1.0), "inlet opens", [None, 0.05]),  # open all the time cannot be more
        ((0.0, 1.0), "inlet closes", [0.95, None]),
        ((0.5, 0.55), "inlet closes", [None, 0.6]),  # would be shut all the time
        ((0.1, 0.07), "inlet closes", [0.02, None]),  # would be open all the time
    ],
)
def test_gait_phases_go_round(interval: tuple[float, float], name: str, expected: list[float | None]) -> None:
    found = steps(walk(**{"phases.dorsiflexor.inlet": [list(interval)]}))
    told = [
        None if step.status != "run" else next(iter(step.sets.values()))
        for step in named(found, f"dorsiflexor {name}")
    ]
    assert told == [value if value is None else pytest.approx(value) for value in expected]


def test_every_interval_of_every_chamber_has_its_steps() -> None:
    found = steps(walk(**TWO))
    told = {step.name for step in found if step.name.startswith("helper")}
    for name in (
        "inlet 1 opens",
        "inlet 2 closes",
        "outlet opens",
        "count",
        "tube volume",
        "inlet conductance",
    ):
        assert f"helper {name}" in told
    assert "helper fill time" not in told  # it is not filled before the first step
    assert not any(step.status == "no air" for step in found if step.name.startswith("helper"))


def test_without_air_the_valves_are_not_tried_and_that_is_told() -> None:
    scenario = walk()
    assert takes_air(scenario, "dorsiflexor") and not takes_air(scenario, "plantarflexor")
    found = [step for step in steps(scenario) if step.name.startswith("plantarflexor")]
    valves = [
        step for step in found if any(w in step.name for w in ("conductance", "tube", "opens", "closes"))
    ]
    assert valves and all(step.status in ("no air", "forbidden") for step in valves)
    cable, count = (
        {step.status for step in named(steps(scenario, ["plantarflexor"]), f"plantarflexor {name}")}
        for name in ("cable stiffness", "count")
    )
    assert (cable, count) == ({"no air"}, {"run"})
    assert {step.status for step in named(found, "plantarflexor cable stiffness")} == {"run"}


def test_an_inlet_or_a_start_lets_air_in() -> None:
    assert takes_air(walk(**{"start.plantarflexor.pressure": "1 bar"}), "plantarflexor")
    assert takes_air(walk(**{"phases.plantarflexor.inlet": [[0.4, 0.6]]}), "plantarflexor")


def test_a_start_is_changed_as_it_is_described() -> None:
    """By its time or its pressure, whichever it states."""
    found = steps(
        walk(**{"start.plantarflexor": {"pressure": "1 bar"}, "start.dorsiflexor": {"fill_time": "2 s"}})
    )
    for chamber, name, expected in (
        ("plantarflexor", "pressure at the start", ["0.5 bar", "1.5 bar"]),
        ("plantarflexor", "fill time", []),
        ("dorsiflexor", "pressure at the start", []),
        ("dorsiflexor", "fill time", ["1.5 s", "2.5 s"]),
    ):
        assert [step.after for step in named(found, f"{chamber} {name}")] == expected


def test_what_is_not_described_is_not_offered() -> None:
    bare = walk(**{"phases.dorsiflexor.outlet": [], "orthosis.anchor": {}, "start": {}})
    names = {step.name for step in steps(bare)}
    assert not names & {
        "cuff stiffness",
        "plate stiffness",
        "dorsiflexor outlet opens",
        "dorsiflexor fill time",
    }


def test_slack_is_told_where_the_link_cannot_be_shortened() -> None:
    sets = {"orthosis.muscle.dorsiflexor.link_length": "0 cm", "orthosis.muscle.dorsiflexor.slack": "11.2 cm"}
    names = {step.name for step in steps(walk(**sets))}
    assert "dorsiflexor slack" in names and "dorsiflexor link length" not in names


def test_a_cuff_that_stiffens_has_its_force_scaled() -> None:
    sets = {"orthosis.anchor": {"shank": {"stiffening": {"force": "33 N", "length": "17 mm"}}}}
    found = named(steps(walk(**sets)), "cuff stiffness, its force")
    assert [step.after for step in found] == ["16.5 N", "66 N"]
