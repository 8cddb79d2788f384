"""Which strides a run's numbers are of, in words."""

import afo_sim
from afo_sim.metrics.metric import Metric
from afo_sim.show.numbers import cautions, doubts


def told(totals: dict[str, Metric], strides: int) -> str:
    scenario = afo_sim.load("scenario", "walk-dropfoot").resolved()
    each = {k: {"toe_clearance": Metric(float(k), "mm")} for k in range(strides)}
    return cautions(scenario, {"toe_clearance": Metric(1.0, "mm"), **totals}, each)[0]


def test_walked_strides_are_told_with_what_they_still_change() -> None:
    changes = {"walked_clearance_change": Metric(0.72, "mm"), "walked_air_change": Metric(-2.4, "percent")}
    said = told({"strides_counted": Metric(5.0, ""), **changes}, 11)
    assert (
        "means of strides 6 to 10, which still change by +0.7 mm of toe clearance and −2.4 % of air" in said
    )


def test_one_walked_stride_tells_no_change_and_a_solved_one_needs_none() -> None:
    counted = {"strides_counted": Metric(1.0, "")}
    assert "of stride 2 alone, which does not tell whether it repeats" in told(counted, 3)
    assert "settled" in told({**counted, "strides_solved": Metric(4.0, "")}, 3)


def test_a_foot_that_slaps_through_the_floor_is_told_with_what_catches_it() -> None:
    """Healthy feet come down at some 90 deg/s; where the floor catches the foot there is nothing to say."""
    walk = afo_sim.load("scenario", "walk-dropfoot")
    on_a_floor = walk.set({"ground.mode": "contact"}).resolved()
    for speed, scenario, said in (
        (90.0, walk.resolved(), False),
        (465.0, walk.resolved(), True),
        (465.0, on_a_floor, False),
    ):
        notes = doubts(scenario, {"foot_slap_velocity": Metric(speed, "deg/s")}, {})
        assert any("ground.mode=contact" in note for note in notes) == said
