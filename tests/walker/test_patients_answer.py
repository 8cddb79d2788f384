"""What a population says, on made-up patients: counted by hand, in closed forms, and where nobody walks."""

import json
import math
import pathlib
import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from afo_sim.description import Scenario, load
from afo_sim.show import doses_of, draw_doses, write_population
from afo_sim.walker import (
    NAMES,
    Falls,
    Population,
    Recorded,
    in_lines,
    replies,
    save_population,
    share_of_falls,
    tables,
)
from afo_sim.walker.patients import DEVICE, SPRING, WEEKS, WITHOUT, Patient
from afo_sim.walker.patients_answer import EFFECTS, changes, deciding, outcomes, told
from afo_sim.walker.population import read_condition

NAN = math.nan
WALKS = {
    "fell": 0.0,
    "speed": 1.2,
    "right/clearance": 0.02,
    "right/ankle_swing": -10.0,
    "right/knee_max": 60.0,
    "right/thigh_max": 30.0,
    "right/push_off_peak": 2.0,
    "cost_of_transport": 6.0,
    "air_per_stride": 1e-4,
}
FELL = dict.fromkeys(WALKS, NAN) | {"fell": 1.0}
Case = Sequence[tuple[dict[str, float], int]]  # numbers that differ from a whole walk, starts that fall
UNTOLD = "cannot tell, too few walk in both cases"


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return load("scenario", "walk-dropfoot-afo")


@pytest.fixture
def made(scenario: Scenario) -> Callable[..., Population]:
    condition = read_condition("drop-foot")

    def make(of: int = 2, unadapted: int = 0, **cases: Case) -> Population:
        named = {name.replace("_", " "): case for name, case in cases.items()}
        count = len(cases["without"])
        return Population(
            scenario,
            scenario,
            condition,
            condition.draw()[:count],
            {
                name: tuple(Patient(WALKS | more, Falls(fell, of), {}) for more, fell in case)
                for name, case in named.items()
            },
            {},
            {},
            {
                "duration": 4.0,
                "starts": of,
                "push": 50.0,
                "seed": 0,
                "generations": 0,
                "timestep": 1e-3,
                "unadapted": unadapted,
                "worn": {},
                "spring": None,
            },
        )

    return make


def same(count: int, more: dict[str, float] | None = None, fell: int = 0) -> Case:
    return [(more or {}, fell)] * count


def text_of(population: Population, recorded: Recorded) -> dict[str, str]:
    """Answers by their question."""
    return {reply.question: reply.text for reply in replies(population, recorded)}


def test_gain_and_loss_are_those_counted_by_hand(made: Callable[..., Population]) -> None:
    error = {name: effect.error for name, effect in EFFECTS.items()}
    patients: list[tuple[int, dict[str, float], int, dict[str, float], int]] = [
        # outcome, without: numbers, starts that fall; with the device
        (0, {}, 0, {}, 0),
        (1, {}, 2, {}, 0),  # falls less
        (-1, {}, 0, {}, 2),
        (0, {}, 2, {}, 1),  # one start of two comes by chance
        (-1, {}, 0, {"right/clearance": 0.9}, 2),  # better in one, worse in another
        (1, {}, 0, {"speed": 1.2 + 1.01 * error["speed"]}, 0),
        (0, {}, 0, {"speed": 1.2 + 0.99 * error["speed"]}, 0),
        (-1, {}, 0, {"speed": 1.2 - 1.01 * error["speed"]}, 0),
        (1, {}, 0, {"right/clearance": 0.02 + 1.01 * error["right/clearance"]}, 0),
        (-1, {}, 0, {"right/clearance": 0.02 - 1.01 * error["right/clearance"]}, 0),
        (1, {}, 0, {"cost_of_transport": 6.0 * 0.899}, 0),  # of the walk before
        (0, {}, 0, {"cost_of_transport": 6.0 * 1.099}, 0),
        (-1, {}, 0, {"cost_of_transport": 6.0 * 1.101}, 0),
        (0, {"cost_of_transport": 8.0}, 0, {"cost_of_transport": 8.7}, 0),  # 9 %
        (0, {}, 0, {"right/ankle_swing": 20.0, "right/knee_max": 10.0, "right/thigh_max": 90.0}, 0),
        (0, {}, 0, {"right/push_off_peak": 9.0}, 0),  # neither better nor worse
        (1, FELL, 2, {}, 2),  # walks, and did not before
        (-1, {}, 2, FELL, 2),  # does no more, and has no number that tells it
        (0, FELL, 2, FELL, 2),
        (-1, FELL, 0, {}, 2),
    ]
    population = made(
        without=[(a, fell) for _, a, fell, _, _ in patients],
        device=[(b, fell) for _, _, _, b, fell in patients],
    )
    assert outcomes(population, DEVICE).tolist() == [outcome for outcome, *_ in patients]
    assert outcomes(population, WITHOUT).tolist() == [0] * len(patients)
    counts = {sign: sum(outcome == sign for outcome, *_ in patients) for sign in (1, -1, 0)}
    rows = {row[0]: row[1:] for row in tables(population)[1][2][1]}
    of = len(patients)
    assert rows["patients who gain"] == [f"{counts[1]} of {of}"]
    assert rows["who lose"] == [f"{counts[-1]} of {of}"]
    assert rows["for whom the model cannot tell"] == [f"{counts[0]} of {of}"]
    line = in_lines(population)[1]
    assert (line["gain"], line["lose"]) == (str(counts[1]), str(counts[-1]))
    assert in_lines(population)[0]["gain"] == "–"
    relative = changes(population, DEVICE, "cost_of_transport")
    assert relative[13] == pytest.approx(8.7 / 8.0 - 1.0) and np.isnan(relative[16:]).all()
    assert np.flatnonzero(np.isnan(changes(population, DEVICE, "speed"))).tolist() == [16, 17, 18, 19]


def test_cells_are_the_median_and_ends_of_those_who_walk(made: Callable[..., Population]) -> None:
    """Of 11 evenly apart the middle and half a step from the ends; a change is each patient's own."""
    steps = [(k * 4) % 11 for k in range(11)]  # in no order
    bare = [
        ({"speed": 1.0 + 0.02 * k, "cost_of_transport": 5.0, "right/clearance": 2e-3 * k}, 0) for k in steps
    ]
    worn = [
        ({"speed": 1.0 + 0.06 * k, "cost_of_transport": 5.5 - 0.1 * k, "right/clearance": -2e-3 * k}, 0)
        for k in steps
    ]
    population = made(without=[*bare, (FELL, 2)], device=[*worn, (FELL, 2)])

    def cells(row: list[str]) -> list[list[float]]:
        said = [re.findall(r"[+−]?\d+\.?\d*", cell.rpartition(":")[2]) for cell in row[1:]]
        return [[float(number.replace("−", "-")) for number in each] for each in said]

    shown, changed = (
        {row[0].partition(" [")[0]: cells(row) for row in rows} for *_, (_, rows) in tables(population)
    )
    assert shown["speed"] == [[1.1, 1.01, 1.19], [1.3, 1.03, 1.57]]
    assert changed["speed"] == [[0.2, 0.02, 0.38]]
    assert changed["cost of transport"] == [[0.0, -9.0, 9.0]]  # [%]
    clearance = "toe clearance in mid-swing, device's leg"
    assert shown[clearance] == [[10.0, 1.0, 19.0], [-10.0, -19.0, -1.0]]  # [mm]
    assert changed[clearance] == [[-20.0, -38.0, -2.0]]
    line = in_lines(population)[1]
    assert cells(["", line["speed [m/s]"]]) == [[1.3, 1.03, 1.57]]


def test_nobody_of_twenty_is_not_nobody(made: Callable[..., Population]) -> None:
    """Nobody of n: at most 1.96² / (n + 1.96²) of people, after Wilson 1927; of changes Newcombe 1998."""
    most = 100.0 * 1.96**2 / (20.0 + 1.96**2)
    none, every = made(without=same(20)), made(without=same(20, fell=2))
    assert share_of_falls(none, WITHOUT) == pytest.approx((0.0, 0.0, most))
    assert share_of_falls(every, WITHOUT) == pytest.approx((100.0, 100.0 - most, 100.0))
    both = made(without=same(20), device=same(20))
    assert share_of_falls(both, DEVICE, change=True) == pytest.approx((0.0, -most, most))
    better = made(without=same(20, fell=2), device=same(20))
    assert share_of_falls(better, DEVICE, change=True) == pytest.approx(
        (-100.0, -100.0, math.hypot(most, most) - 100.0)
    )
    assert (told(both, DEVICE, "falls"), told(better, DEVICE, "falls")) == ("cannot tell", "less")


@pytest.mark.parametrize("count", [3, 5, 10, 17])
def test_the_interval_of_a_share_is_the_wider_of_the_binomials_and_wilsons(
    count: int, made: Callable[..., Population]
) -> None:
    """A mean of n redrawn zeros and ones is binomial; its quantile is drawn to three standard errors."""
    from scipy.stats import binom, binomtest

    wilson = binomtest(count, 20).proportion_ci(method="wilson")
    population = made(of=1, without=[({}, int(k < count)) for k in range(20)])
    mean, low, high = share_of_falls(population, WITHOUT)
    assert mean == pytest.approx(5.0 * count)
    for found, share, end, wider in ((low, 0.025, wilson.low, min), (high, 0.975, wilson.high, max)):
        apart = 3.0 * math.sqrt(share * (1.0 - share) / 2000.0)  # of the share below a drawn quantile
        ends = [5.0 * binom.ppf(share + way * apart, 20, count / 20.0) for way in (-1.0, 1.0)]
        least, most = (wider(each, 100.0 * end) for each in ends)
        assert least - 1e-3 <= found <= most + 1e-3  # 1.96 is of three digits


@pytest.mark.parametrize(
    ("alike", "word"), [(20, "more"), (15, "more"), (14, "cannot tell, patients differ")]
)
def test_alike_are_fifteen_of_twenty(alike: int, word: str, made: Callable[..., Population]) -> None:
    """A sign test of 15 of 20 has p = 0.041, of 14 p = 0.115: tails of a fair coin."""
    tail = 2.0 * sum(math.comb(20, k) for k in range(alike, 21)) / 2.0**20
    assert (tail <= 0.05) == (word == "more")
    worn = [({"right/clearance": 0.05 if k < alike else 0.01}, 0) for k in range(20)]
    population = made(without=same(20), device=worn)
    assert told(population, DEVICE, "right/clearance") == word
    turned = made(without=worn, device=same(20))
    assert told(turned, DEVICE, "right/clearance") == word.replace("more", "less")
    assert told(population, DEVICE, "speed") == "cannot tell"


def test_falls_are_told_of_no_fewer_than_anything_else(made: Callable[..., Population]) -> None:
    """Four of twenty who fall less, and none more, come by chance in one of eight times."""
    few = made(without=same(2, fell=2), device=[({}, 1), ({}, 0)])
    assert told(few, DEVICE, "falls").startswith("cannot tell")
    for count, word in ((4, "cannot tell"), (5, "cannot tell"), (6, "less")):  # 2 / 2⁶ = 0.03
        before = [({}, 2 * int(k < count)) for k in range(20)]
        assert told(made(without=before, device=same(20)), DEVICE, "falls") == word
        assert told(made(without=same(20), device=before), DEVICE, "falls") == word.replace("less", "more")


def test_nothing_is_told_of_fewer_than_eight(made: Callable[..., Population]) -> None:
    for walking, word in ((7, UNTOLD), (8, "more")):
        worn = [({"speed": 1.5} if k < walking else FELL, 0) for k in range(20)]
        assert told(made(without=same(20), device=worn), DEVICE, "speed") == word


def test_no_starts_are_no_falls_of_none(made: Callable[..., Population], tmp_path: pathlib.Path) -> None:
    population = made(of=0, without=same(20), device=same(20, {"speed": 1.5}))
    assert np.isnan(population.values(WITHOUT, "falls")).all()
    assert np.isnan(share_of_falls(population, DEVICE)).all()
    assert told(population, DEVICE, "falls") == "cannot tell"
    assert outcomes(population, DEVICE).tolist() == [1] * 20
    assert tables(population)[0][2][1][0][1:] == ["–", "–"] and in_lines(population)[0][FALLS_ROW] == "–"
    answers = text_of(population, Recorded(NAN, NAN, NAN, NAN))
    assert not any("fall" in question for question in answers)
    assert doses_of(population)[0].falls is None


FALLS_ROW = "starts that fall [%]"


@pytest.mark.slow
def test_where_all_fall_there_are_dashes_and_files(
    made: Callable[..., Population], tmp_path: pathlib.Path
) -> None:
    """No number is made up, and no warning comes of none (the tests' warnings are errors)."""
    cases = dict.fromkeys(
        ("without", "device", "device_adapted", "spring", "spring_adapted"), same(20, FELL, 2)
    )
    population = made(**cases)
    assert list(population.cases) == list(NAMES)
    recorded = Recorded(-0.02, 0.02, 1e-4, 800.0)
    answers = text_of(population, recorded)
    assert not any("contradict" in text or "nan" in text for text in answers.values())
    assert "How long does a bottle last?" not in answers
    for name in EFFECTS:
        assert told(population, DEVICE, name) == UNTOLD
    cells = [cell for _, _, (_, rows) in tables(population) for row in rows for cell in row[1:]]
    assert not any("nan" in cell for cell in cells) and outcomes(population, DEVICE).tolist() == [0] * 20
    save_population(population, recorded, tmp_path / "out", {}, write_population)
    assert pq.read_table(tmp_path / "out" / "curves.parquet").num_rows == 0
    written = json.loads((tmp_path / "out" / "walk.json").read_text(encoding="utf-8"))
    assert written["recorded"]["air"] == 1e-4 and len(written["tables"]) == 2
    draw_doses("spring", ["1", "2"], [doses_of(population)] * 2, tmp_path / "walk.png")


def test_a_population_without_a_device_is_only_described(made: Callable[..., Population]) -> None:
    population = made(without=same(20))
    assert len(tables(population)) == 1
    answers = text_of(population, Recorded(NAN, NAN, NAN, NAN))
    assert list(answers) == ["Do they fall (in simulation)?"]


def test_who_has_not_adapted_is_counted(made: Callable[..., Population]) -> None:
    def said(count: int) -> str:
        found = made(unadapted=count, without=same(20), device=same(20))
        return text_of(found, Recorded(NAN, NAN, NAN, NAN))["Who gains, and who loses?"]

    assert "1 of 20 have not adapted" in said(1) and "20 of 20 have not adapted" in said(20)
    assert "adapted" not in said(0)


RECORDED = "What does the recorded walk show, and which to believe?"


@pytest.mark.parametrize(
    ("recorded", "bare", "worn", "contradictions"),
    [
        ((-0.02, 0.02), 0.02, 0.06, 1),  # drags without, recorded; the patients do not
        ((-0.02, 0.02), -0.02, 0.02, 0),
        ((0.02, 0.06), -0.02, 0.02, 1),  # the other way round
        ((0.02, 0.06), 0.02, 0.06, 0),
        ((0.02, 0.06), 0.02, 0.02, 1),  # lifted, recorded; theirs is not
        ((0.02, 0.06), 0.06, 0.02, 1),  # theirs is lowered
        ((0.06, 0.02), 0.02, 0.06, 1),  # lowered, recorded; theirs is lifted
        ((0.06, 0.02), 0.06, 0.02, 0),
        ((-0.02, 0.02), 0.06, 0.02, 2),
        ((0.02, 0.029), 0.02, 0.06, 0),  # within the error: nothing is recorded that they could contradict
        ((0.02, NAN), 0.02, 0.06, 0),  # nobody wears a device, recorded
    ],
)
@pytest.mark.parametrize("case", ["device", "device_adapted"])
def test_the_recorded_walk_is_contradicted_where_signs_differ(
    case: str,
    recorded: tuple[float, float],
    bare: float,
    worn: float,
    contradictions: int,
    made: Callable[..., Population],
) -> None:
    cases = {"device": same(20, {"right/clearance": NAN})} | {case: same(20, {"right/clearance": worn})}
    population = made(without=same(20, {"right/clearance": bare}), **cases)
    text = text_of(population, Recorded(*recorded, 1e-4, 800.0))[RECORDED]
    assert text.count("The two contradict") == contradictions
    assert ("patients agree" in text) == (contradictions == 0)
    assert text.count("Trust") == contradictions  # each is told whom
    assert "nan" not in text and "-" not in text  # a minus is written as one


def test_too_few_contradict_nobody(made: Callable[..., Population]) -> None:
    """One of them walks without the device, lower than with it: that tells nothing of the others."""
    bare = [({"right/clearance": 0.06}, 0), *same(19, FELL, 2)]
    population = made(without=bare, device=same(20, {"right/clearance": 0.02}))
    text = text_of(population, Recorded(-0.02, 0.02, 1e-4, 800.0))[RECORDED]
    assert "contradict" not in text and "oo few" in text
    apart = [({"right/clearance": 0.05 if k < 14 else 0.01}, 0) for k in range(20)]
    text = text_of(made(without=same(20), device=apart), Recorded(0.02, 0.06, 1e-4, 800.0))[RECORDED]
    assert "The two contradict" not in text and "patients differ" in text


def test_steps_are_said_to_be_lower_only_where_they_are(made: Callable[..., Population]) -> None:
    def said(thigh: float) -> bool:
        worn = same(20, {"right/thigh_max": thigh})
        return (
            "lower" in text_of(made(without=same(20), device=worn), Recorded(0.02, 0.06, 0.0, 0.0))[RECORDED]
        )

    assert said(20.0) and not said(30.0) and not said(40.0)


def test_a_bottle_is_shared_by_what_each_stride_takes(made: Callable[..., Population]) -> None:
    """A patient who takes no air walks for ever, which is no number of strides."""
    worn = [({"air_per_stride": air}, 0) for air in (2e-4,) * 19 + (0.0,)]
    population = made(without=same(20, {"air_per_stride": NAN}), device=worn)
    text = text_of(population, Recorded(0.02, 0.06, 1e-4, 800.0))["How long does a bottle last?"]
    assert "400 strides (median; 400 to 400), 0.200 g" in text


def test_what_decides_is_what_was_made_to(made: Callable[..., Population]) -> None:
    """The tibialis decides here; no cuff does where none is worn, and a number that all have does not."""
    drawn = made(without=same(20)).drawn
    worn = [({"speed": 1.5 if one["tibialis"] < 0.15 else 1.0}, 0) for one in drawn]
    population = made(without=same(20), device=worn)
    assert list(deciding(population, DEVICE)) == ["tibialis"]
    assert deciding(population, DEVICE)["tibialis"] < -0.8
    worn = [({"speed": 1.5 if one["cuff"] < 5e3 else 1.0}, 0) for one in drawn]
    population = made(without=same(20), device=worn, spring=worn)
    assert list(deciding(population, DEVICE)) == ["cuff"] and "cuff" not in deciding(population, SPRING)
    for one in population.drawn:
        one["mass"] = 1.0
    assert "mass" not in deciding(population, DEVICE)
    assert deciding(made(without=same(20), device=same(20)), DEVICE) == {}
    few: dict[str, Any] = {"without": same(7), "device": worn[:7]}
    assert deciding(made(**few), DEVICE) == {}
    eight = [
        ({"speed": 1.5 if k < 4 else 1.0}, 0)
        for k in np.argsort(np.argsort([one["tibialis"] for one in drawn[:8]]))
    ]
    assert list(deciding(made(without=same(8), device=eight), DEVICE)) == ["tibialis"]


def test_every_case_has_a_name_and_a_look(made: Callable[..., Population]) -> None:
    cases = [WITHOUT, DEVICE, DEVICE + WEEKS, SPRING, SPRING + WEEKS]
    assert list(NAMES) == cases
    population = made(**{case.replace(" ", "_"): same(20) for case in cases})
    looks = [(dose.look["color"], dose.look["ls"]) for dose in doses_of(population)]
    assert len(set(looks)) == len(cases)
