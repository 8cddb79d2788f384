"""What to change first, as lines, a table and in the report: numbers with units, told without colour, too."""

import dataclasses

import pytest

from afo_sim.metrics import Metric
from afo_sim.show import RunView
from afo_sim.show import effects as shown
from afo_sim.show.report import page
from afo_sim.simulation import Recording
from afo_sim.study import AIR, CLEARANCE, EFFECTS, FIRST, LEFT_OUT, TORQUE, Effects
from afo_sim.study.effect import Effect

pytestmark = pytest.mark.usefixtures("undrawn")

BASE = {
    CLEARANCE: Metric(4.0, "mm"),
    FIRST: Metric(4.0, "mm"),
    TORQUE: Metric(5.0, "N*m"),
    AIR: Metric(0.09, "g"),
}


def effect(k: int, **told: object) -> Effect:
    differences = {CLEARANCE: 6.1 - k, FIRST: 6.1 - k, TORQUE: 0.9, AIR: -0.01}
    made = Effect(f"link {k}", "11.2 cm", "10.7 cm", differences=differences, helps=True)
    return dataclasses.replace(made, **told)  # type: ignore[arg-type]


def effects(*ranked: Effect) -> Effects:
    return Effects("lift", BASE, ranked, 0.001)


@pytest.fixture
def walked(walks: dict[str, Recording]) -> Recording:
    return walks["bare"]


def told(walked: Recording, found: Effects | dict[str, str]) -> Recording:
    table = found.to_json() if isinstance(found, Effects) else found
    return dataclasses.replace(walked, studies={EFFECTS: table})


def test_a_line_tells_the_step_and_all_that_it_does(walked: Recording) -> None:
    title, line = shown.lines(told(walked, effects(effect(0))))
    assert "the toe needs more clearance" in title
    steps = ("from 11.2 to 10.7 cm", "+6.1 mm", "+0.90 N·m", "−0.010 g")
    assert line.strip().startswith("change link 0 ") and all(step in line for step in steps)


def test_no_more_than_seven_lines(walked: Recording) -> None:
    assert len(shown.lines(told(walked, effects(*map(effect, range(20)))))) <= 7


def test_the_first_stride_is_told_where_it_gains_otherwise(walked: Recording) -> None:
    apart = effect(0, differences={CLEARANCE: 0.0, FIRST: 3.0, TORQUE: 0.0, AIR: 0.0})
    assert "first stride +3.0 mm" in shown.lines(told(walked, effects(apart)))[1]


def test_no_help_is_said(walked: Recording) -> None:
    none = told(walked, effects(effect(0, helps=False)))
    assert "no single change helps" in shown.lines(none)[1]
    assert "No single change helps" in shown.markdown(none)
    assert "No single change helps" in page([RunView("one", "#000000", none)])


def test_nothing_to_tell_is_nothing(walked: Recording) -> None:
    assert shown.lines(walked) == [] and shown.markdown(walked) == ""
    assert shown.of_report([RunView("one", "#000000", walked)]) == []
    assert "What to change first" not in page([RunView("one", "#000000", walked)])


def test_what_is_left_out_is_told_with_the_reason(walked: Recording) -> None:
    late = told(walked, {LEFT_OUT: "60 runs would take 30 min"})
    assert "30 min" in shown.lines(late)[0] and "30 min" in shown.markdown(late)
    assert "30 min" in page([RunView("one", "#000000", late)])


def test_the_report_has_every_step_and_why_some_were_not_run(walked: Recording) -> None:
    lost = effect(1, helps=False, reason="the toe clears 3.0 mm, 10 mm are wanted")
    back = effect(0, after="11.7 cm", helps=False, differences={CLEARANCE: -5.5, TORQUE: -0.8})
    refused = Effect("count", "1", "0", status="refused", reason="out of range")
    dead = Effect("cable", "1", "2", differences=dict.fromkeys(BASE, 0.0))
    text = page([RunView("one", "#000000", told(walked, effects(effect(0), back, lost, dead, refused)))])
    for part in ("11.2 → 10.7 cm ✓", "11.2 → 11.7 cm", "+6.1", "−5.5", "10 mm are wanted"):
        assert part in text
    assert "count 1 → 0: out of range" in text and "No noticeable difference: cable" in text
    assert 'class="bar more"' in text and 'class="bar less"' in text  # told apart without colour


def test_the_table_of_the_viewer_has_units(walked: Recording) -> None:
    text = shown.markdown(told(walked, effects(effect(0))))
    assert "toe clearance [mm]" in text and "against push-off [N·m]" in text and "| +6.1 |" in text
