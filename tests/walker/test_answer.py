"""What a response says: intervals against printed ones, rules of the verdict, no number that there is not."""

import dataclasses
import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from afo_sim.description import load
from afo_sim.walker import Case, Falls, Response, difference, in_brief, in_lines, read_gait, table, verdict
from afo_sim.walker.gait_file import with_vector

NUMBERS = (
    "speed",
    "stride_time",
    "stride_length",
    "cost_of_transport",
    "air_per_stride",
    "device_torque_swing",
)
OF_LEG = ("clearance", "scuffs", "ankle_swing", "thigh_max", "knee_max", "force_peak", "push_off_work")

LEVEL = SimpleNamespace(site=lambda name: SimpleNamespace(pos=np.zeros(3)))  # no shoe's drop


def case(
    name: str,
    falls: tuple[int, int] | None = None,
    converged: bool | None = True,
    same: bool = False,
    **own: float,
) -> Case:
    """A case whose numbers are all 1, but for its own; NaN after a fall at a time."""
    fell = own.pop("fell_at", math.nan)
    names = (*NUMBERS, *(f"{side}/{each}" for side in ("right", "left") for each in OF_LEG))
    numbers = dict.fromkeys(names, 1.0 if math.isnan(fell) else math.nan)
    numbers |= {"fell": float(not math.isnan(fell)), "duration": 20.0 if math.isnan(fell) else fell}
    natural = read_gait("natural")
    apart = 0.9 if name.endswith("adapted") and not same else 1.0
    vector = dataclasses.replace(natural.vector, gains=apart * natural.vector.gains)
    gait = with_vector(natural, vector, name, "", {} if converged is None else {"converged": converged})
    walked = cast(Any, SimpleNamespace(body=SimpleNamespace(size=SimpleNamespace(taller=1.0), model=LEVEL)))
    return Case(
        name,
        gait,
        walked,
        numbers | {k.replace("__", "/"): v for k, v in own.items()},
        falls and Falls(*falls),
    )


def response(*cases: Case) -> Response:
    return Response(load("scenario", "walk-dropfoot-afo"), {each.name: each for each in cases})


# Newcombe 1998, Statistics in Medicine 17, 857, table I, method 3.
@pytest.mark.parametrize(
    ("count", "of", "low", "high"),
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_interval_of_a_share_is_the_published_one(count: int, of: int, low: float, high: float) -> None:
    assert Falls(count, of).interval == pytest.approx((low, high), abs=6e-5)


# Newcombe 1998, Statistics in Medicine 17, 873, table II, method 10.
@pytest.mark.parametrize(
    ("one", "other", "low", "high"),
    [
        ((56, 70), (48, 80), 0.0524, 0.3339),
        ((9, 10), (3, 10), 0.1705, 0.8090),
        ((6, 7), (2, 7), 0.0582, 0.8062),
        ((5, 56), (0, 29), -0.0381, 0.1926),
        ((0, 10), (0, 20), -0.1611, 0.2775),
        ((10, 10), (0, 20), 0.6791, 1.0),
        ((10, 10), (0, 10), 0.6075, 1.0),
    ],
)
def test_interval_of_a_difference_is_the_published_one(
    one: tuple[int, int], other: tuple[int, int], low: float, high: float
) -> None:
    assert difference(Falls(*other), Falls(*one)) == pytest.approx((low, high), abs=6e-5)


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        (4.0, 4.39, "not distinguishable"),
        (4.0, 4.41, "10% more (4.0 → 4.4 J/(kg·m), at "),
        (4.0, 3.61, "not distinguishable"),
        (4.0, 3.5, "12% less (4.0 → 3.5 J/(kg·m), at "),
    ],
)
def test_a_cost_that_differs_by_less_than_a_tenth_is_not_claimed(
    before: float, after: float, says: str
) -> None:
    healthy, patient = case("healthy"), case("patient", cost_of_transport=before)
    _, _, cost = verdict(response(healthy, patient, case("device", cost_of_transport=after)))
    words = cost.text.partition("With the device against without, not adapted: ")[2]
    assert words.startswith(says), cost.text
    assert "Differences below 10 % are not claimed" in cost.assumptions[0]


def test_a_fall_is_a_result_and_no_number_that_there_is_not_is_printed() -> None:
    fallen = case("patient", (50, 50), fell_at=1.64)
    found = response(case("healthy", (0, 50)), fallen, case("device", (3, 50)))
    header, rows = table(found)
    assert header[1:] == ["healthy", "patient, not adapted", "with device, not adapted"]
    assert rows[0] == ["undisturbed walk", "walks 20 s", "fell after 1.6 s", "walks 20 s"]
    assert rows[1][1:3] == ["0 of 50 (0 to 7 %)", "50 of 50 (93 to 100 %)"]
    assert all(row[2] == "–" for row in rows[2:])
    replies = verdict(found)
    assert "nan" not in f"{header}{rows}{replies}{in_brief(fallen)}".lower()
    assert "fewer falls" in replies[0].text and "not a patient's risk" in replies[0].assumptions[0]
    assert all("not comparable; “patient, not adapted” fell after 1.6 s" in each.text for each in replies[1:])


def test_falls_that_chance_explains_are_not_distinguishable() -> None:
    found = response(case("healthy"), case("patient", (5, 10)), case("device", (2, 10)))
    low, high = difference(Falls(5, 10), Falls(2, 10))
    assert low < 0.0 < high
    assert "no distinguishable difference in falls" in verdict(found)[0].text
    assert "fall" not in verdict(response(case("healthy"), case("patient")))[0].text.replace("fall (", "")


def test_adapted_is_compared_with_adapted_and_a_search_that_did_not_converge_is_named() -> None:
    three = case("healthy"), case("patient", right__ankle_swing=-10.0), case("device", right__ankle_swing=5.0)
    only = case("device adapted", converged=False, right__ankle_swing=7.0)
    half = verdict(response(*three, only))[1]
    assert (
        "not adapted: on the device's leg" in half.text
        and "−10.0 → 5.0°" in half.text
        and "7.0" not in half.text
    )
    assert "drawn patients" in half.assumptions[1]
    assert half.assumptions[2] == (
        "The search of “with device, adapted” did not converge: a longer search may find another walk."
    )
    both = verdict(response(*three, only, case("patient adapted", converged=None, right__ankle_swing=-8.0)))
    assert "without, adapted: on the device's leg" in both[1].text and "−8.0 → 7.0°" in both[1].text
    assert "is not known to have converged" in both[2].assumptions[3]
    sure = verdict(response(*three, case("patient adapted"), case("device adapted")))
    assert all(len(reply.assumptions) == 2 for reply in sure)


def test_who_keeps_the_healthy_gait_is_named_and_is_no_search_that_did_not_converge() -> None:
    cases = case("healthy"), case("patient"), case("device"), case("device adapted", None, False, True)
    doubts = verdict(response(*cases))[1].assumptions
    assert len(doubts) == 3 and "keeps the healthy gait" in doubts[2] and "device, adapted" in doubts[2]


def test_a_healthy_walker_who_falls_is_named_beside_each_answer() -> None:
    fallen = case("healthy", fell=1.0, duration=6.01)  # after strides that were counted
    replies = verdict(response(fallen, case("patient"), case("device")))
    assert all("The healthy walker falls too" in reply.assumptions[1] for reply in replies)
    assert "healthy, not adapted: not comparable; “healthy” fell after 6.0 s." in replies[2].text
    assert "without, not adapted: not distinguishable" in replies[2].text


def test_cells_have_their_units() -> None:
    found = response(
        case("healthy"),
        case("device", right__clearance=0.0183, left__clearance=-0.0004, air_per_stride=9.6e-5),
    )
    rows = {name: cells for name, *cells in table(found)[1]}
    assert rows["toe clearance in mid-swing, device's leg [mm]"] == ["1000", "18"]
    assert rows["toe clearance in mid-swing, other leg [mm]"][1] == "0"  # not −0
    assert rows["air per stride [g]"][1] == "0.096"
    assert rows["device's torque in swing [N·m]"] == ["–", "1.00"]  # nobody healthy wears it
    brief = in_brief(found["device"])
    assert in_lines(found) == [brief]  # of one patient without the healthy
    assert brief["case"] == "with device, not adapted" and brief["toe clearance in mid-swing [mm]"] == "18"
    assert np.isfinite(float(brief["speed [m/s]"]))
