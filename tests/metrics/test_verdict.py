"""The verdict: the four questions, each status, and shipped and spoilt designs judged by hand."""

import dataclasses
import math
import re
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import pytest
from scipy.stats import binom

import afo_sim
from afo_sim.metrics import QUESTIONS, Answer, Metric, needless, percent, with_draws
from afo_sim.metrics.draws import bounds
from afo_sim.metrics.metric import measured
from afo_sim.metrics.verdict import verdict
from afo_sim.simulation import Recording

LIMITS = SimpleNamespace(
    toe_clearance=(0.010, 0.0),
    contact_pitch=(math.radians(8.0), math.radians(-1.6)),
    torque_against_push_off=(0.07, 0.14),
    work_against_push_off=(0.016, 0.032),
    strides_per_bottle=(2000.0, 1000.0),
    bottle_volume=0.5e-3,
    bottle_pressure=300e5,
    skin_pressure=(14e3, 53e3),
    blood_flow_pressure=4e3,
)
GOOD = {
    "strides_counted": 1.0,
    "strides_solved": 5.0,
    "stride_time": 1.2,
    "toe_clearance": 14.0,
    "toe_clearance_stride_1": 13.0,
    "lowest_toe_clearance_first_ten": 12.0,
    "foot_pitch_at_contact": 20.0,
    "torque_against_push_off": 4.2,
    "torque_against_push_off_per_mass": 0.06,
    "work_against_push_off": 0.015,
    "air_per_stride": 0.08,
    "free_air_per_minute": 3.4,
    "strides_per_bottle": 2500.0,
    "reference_toe_clearance": -5.0,
    "cuff_skin_pressure": 10.0,
    "cuff_skin_pressure_sustained": 3.0,
    "filled_once_pressure": 3.0,
    "filled_once_toe_clearance": 5.0,
    "filled_once_torque_against_push_off_per_mass": 0.06,
    "filled_once_work_against_push_off": 0.015,
}


def numbers(values: Mapping[str, float]) -> dict[str, Metric]:
    return {name: measured(name, value) for name, value in values.items()}


def judge(
    changes: Mapping[str, float] | None = None,
    strides: Mapping[int, Mapping[str, float]] | None = None,
    without: tuple[str, ...] = (),
    limits: Any = LIMITS,
) -> dict[str, Answer]:
    """The verdict of a good walk with some numbers changed."""
    found = {name: value for name, value in (GOOD | dict(changes or {})).items() if name not in without}
    each = {k: numbers(of) for k, of in (strides or {}).items()}
    return {answer.name: answer for answer in verdict(numbers(found), each, limits)}


def test_answers_in_their_order_and_none_of_what_does_not_walk() -> None:
    assert list(judge()) == ["help", "lift", "heel", "push_off", "air_adds", "air", "skin"] == list(QUESTIONS)
    assert all(answer.status == "good" for answer in judge().values())
    assert verdict({"range_of_motion": Metric(20.0, "deg")}, {}, LIMITS) == ()


@pytest.mark.parametrize(
    ("without", "own", "status", "words"),
    [
        (17.0, 28.7, "doubtful", "the toe does not need the device."),
        (17.0, 5.0, "bad", "the toe does not need the device, which lowers it too far."),
        (135.0, 120.0, "bad", "the toe does not need the device, which lowers it."),
        (30.0, 26.0, "doubtful", "the toe does not need the device."),
        (-26.0, 13.0, "good", "the device helps enough."),
        (-26.0, 5.0, "doubtful", "the device helps, but not enough."),
        (-26.0, -5.0, "bad", "the device helps, but not enough: the toe trips."),
        (3.0, 3.2, "doubtful", "the device changes nothing."),
        (8.0, 3.0, "bad", "the device lowers the toe."),
    ],
)
def test_the_verdict_opens_with_whether_the_toe_needs_the_device(
    without: float, own: float, status: str, words: str
) -> None:
    answer = judge({"reference_toe_clearance": without, "toe_clearance": own})["help"]
    assert answer.status == status
    assert answer.text.endswith(words)
    assert ("26.0 mm below the floor" in answer.text) is (without == -26.0)


@pytest.mark.parametrize(
    ("touches", "without", "own", "status", "words"),
    [
        ((True, False), 17.0, 28.7, "good", "the device helps enough."),
        ((True, False), 17.0, 5.0, "doubtful", "the device helps, but not enough."),
        ((False, True), 17.0, 28.7, "bad", "the toe does not need the device, which lowers it too far."),
        ((False, True), 3.0, 28.7, "bad", "the device lowers the toe."),
        ((True, True), 3.0, 28.7, "bad", "the device changes nothing: the toe trips."),
    ],
)
def test_a_forefoot_that_touches_earlier_in_swing_is_no_toe_that_passes(
    touches: tuple[bool, bool], without: float, own: float, status: str, words: str
) -> None:
    found = {"reference_toe_clearance": without, "toe_clearance": own}
    names = ("reference_swings_with_toe_contact", "swings_with_toe_contact")
    found |= {name: 100.0 * touch for name, touch in zip(names, touches, strict=True)}
    answer = judge(found)["help"]
    assert (answer.status, answer.text.endswith(words)) == (status, True), answer.text
    assert "touched" not in judge(found | {"reference_toe_clearance": -26.0})["help"].text.partition(",")[0]
    assert answer.text.count("after the forefoot has touched the floor") == sum(touches)


def test_a_device_that_is_not_needed_and_trips_in_the_first_stride_is_bad() -> None:
    answer = judge({"reference_toe_clearance": 17.0, "toe_clearance_stride_1": -1.0})["help"]
    assert answer.status == "bad" and "clearance is not reliable in every stride" in answer.text


def test_help_that_fails_in_the_first_stride_is_no_sure_one_and_without_a_reference_nothing_is_said() -> None:
    assert judge({"toe_clearance_stride_1": -1.0})["help"].status == "bad"
    assert "help" not in judge(without=("reference_toe_clearance",))


@pytest.mark.parametrize(
    ("peak", "sustained", "status"),
    [(14.0, 4.0, "good"), (15.0, 4.0, "doubtful"), (10.0, 4.1, "doubtful"), (53.1, 4.0, "bad")],
)
def test_the_skin_is_judged_by_its_peak_and_by_what_lasts(peak: float, sustained: float, status: str) -> None:
    values = {"cuff_skin_pressure": peak, "cuff_skin_pressure_sustained": sustained}
    assert judge(values)["skin"].status == status
    strap = {"plate_skin_pressure": peak}  # lasts as it is
    both = "bad" if peak > 53.0 else "doubtful"
    assert judge(strap)["skin"].status == both


@pytest.mark.parametrize(
    ("heights", "status"),
    [
        ((14.0, 13.0, 12.0), "good"),
        ((10.0, 10.0, 10.0), "good"),  # what is wanted is enough
        ((14.0, 13.0, 9.9), "doubtful"),
        ((9.0, 13.0, 12.0), "doubtful"),
        ((0.0, 0.0, 0.0), "doubtful"),
        ((14.0, -0.1, 12.0), "bad"),
        ((14.0, 13.0, -0.1), "bad"),
        ((-0.1, 13.0, 12.0), "bad"),
    ],
)
def test_every_stride_must_clear_the_floor(heights: tuple[float, float, float], status: str) -> None:
    names = ("toe_clearance", "toe_clearance_stride_1", "lowest_toe_clearance_first_ten")
    answer = judge(dict(zip(names, heights, strict=True)))["lift"]
    assert answer.status == status
    for height in heights[:2]:
        assert f"{height:.1f} mm".replace("-", "−") in answer.text


def test_it_says_in_which_strides_the_toe_trips() -> None:
    begun = {k: {"toe_clearance": -5.0 + 2.0 * k} for k in range(5)}  # −5, −3, −1, 1, 3 mm
    answer = judge({"toe_clearance_stride_1": -5.0, "lowest_toe_clearance_first_ten": -5.0}, begun)["lift"]
    assert answer.status == "bad" and answer.text.startswith("The toe trips in strides 1 to 3 (3 of 5).")
    apart = {k: {"toe_clearance": -1.0 if k in (1, 4, 5) else 12.0} for k in range(7)}
    assert "trips in strides 2, 5 and 6 (3 of 7)." in judge(strides=apart)["lift"].text.replace(
        " and 5 and 6", ", 5 and 6"
    )
    one = {0: {"toe_clearance": -1.0}, 1: {"toe_clearance": 12.0}}
    assert judge(strides=one)["lift"].text.startswith("The toe trips in stride 1 (1 of 2).")
    settled = judge({"toe_clearance": -9.2})["lift"]
    assert settled.text.startswith("The toe trips in the settled stride.") and "−9.2 mm" in settled.text


def test_a_forefoot_that_touches_the_floor_early_in_swing_trips_too() -> None:
    touched = {k: {"toe_clearance": 14.0, "swings_with_toe_contact": 100.0 * (k == 1)} for k in range(3)}
    answer = judge(strides=touched)["lift"]
    assert answer.status == "bad" and "stride 2" in answer.text and "earlier in swing" in answer.text
    assert judge({"swings_with_toe_contact": 100.0})["lift"].status == "bad"
    allowed = SimpleNamespace(**(vars(LIMITS) | {"toe_clearance": (0.010, -0.005)}))
    assert judge(strides=touched, limits=allowed)["lift"].status == "good"  # whoever allows it may


def test_an_open_lift_is_not_called_good() -> None:
    answer = judge({"toe_clearance_less_extended": -0.5})["lift"]
    assert answer.status == "doubtful" and "−0.5 mm if the toes extend less" in answer.text
    assert judge({"toe_clearance_less_extended": 3.0})["lift"].status == "doubtful"  # 10 mm are wanted
    assert judge({"toe_clearance_less_extended": 10.5})["lift"].status == "good"


@pytest.mark.parametrize(
    ("trips", "draws", "status"),
    [
        *((0, 100, "unknown"), (1, 100, "unknown"), (0, 149, "good"), (3, 500, "good"), (30, 200, "bad")),
        *((25, 500, "doubtful"), (20, 200, "doubtful"), (10, 500, "doubtful"), (55, 500, "unknown")),
    ],
)
def test_a_share_of_draws_is_judged_by_the_exact_bounds_of_every_count(
    trips: int, draws: int, status: str
) -> None:
    """They are where the binomial distribution leaves 5 %; 20 of 200 and 10 of 500 lie on a limit."""
    low, high = bounds(trips / draws, draws)
    assert binom.cdf(trips, draws, high) == pytest.approx(0.05)
    assert low == 0.0 if not trips else binom.sf(trips - 1, draws, low) == pytest.approx(0.05)
    told = tuple(judge({}).values())
    found = with_draws(told, trips / draws, draws, (0.02, 0.1), {})
    help_, lift = found[:2]
    assert help_.status == lift.status == status and found[2:] == told[2:]
    assert ("enough" in help_.text) is (status == "good") and f"to {percent(high)})" in lift.text
    assert (f"{trips} ({percent(trips / draws)}) touch" if trips else "none touches") in lift.text
    needed = re.search(r"draw (\d+)", lift.text)
    assert (needed is not None) == (status == "unknown")
    if needed and not trips:
        assert int(needed[1]) == math.ceil(math.log(0.05) / math.log(0.98))
    elif needed:  # where the share that was seen is decided
        enough = int(needed[1])
        low, high = bounds(trips / draws, enough)
        assert not any(low <= limit < high for limit in (0.02, 0.1))
        low, high = bounds(trips / draws, enough - 1)
        assert any(low <= limit < high for limit in (0.02, 0.1))


@pytest.mark.parametrize(("share", "status"), [(0.0, "good"), (0.02, "doubtful"), (0.05, "doubtful")])
def test_as_many_draws_as_may_be_made_decide_no_share_on_a_limit(share: float, status: str) -> None:
    """Half of all such sets of draws of a share that lies on a limit have more, half less."""
    (lift,) = with_draws([judge({})["lift"]], share, 100_000, (0.02, 0.1), {})
    assert lift.status == status and ("no number" in lift.text) is (share == 0.02)


def test_draws_make_no_answer_better() -> None:
    bad = dataclasses.replace(judge({})["lift"], status="bad")
    assert with_draws([bad], 0.0, 500, (0.02, 0.1), {})[0].status == "bad"


def test_strides_on_an_empty_source_tell_nothing_good() -> None:
    found = judge({"strides_without_air": 2.0, "toe_clearance": -9.0})
    assert [answer.status for answer in found.values()][:4] == ["bad", "bad", "unknown", "unknown"]
    assert all("on an empty source" in answer.text for answer in found.values())


def test_a_stride_without_a_clearance_is_no_good_one() -> None:
    assert judge(strides={0: {"toe_clearance": 12.0}, 1: {"stride_time": 1.0}})["lift"].status == "doubtful"
    unknown = judge({"toe_clearance": math.nan})["lift"]
    assert unknown.status == "unknown" and "undefined" in unknown.text and "nan" not in unknown.text


@pytest.mark.parametrize(
    ("pitch", "status"),
    [(8.0, "good"), (7.9, "doubtful"), (-1.6, "doubtful"), (-1.7, "bad"), (math.nan, "unknown")],
)
def test_the_pitch_at_contact_tells_heel_flat_and_forefoot(pitch: float, status: str) -> None:
    assert judge({"foot_pitch_at_contact": pitch})["heel"].status == status


def test_landings_are_counted_and_the_one_that_the_walk_starts_with_is_none() -> None:
    pitches = {0: -9.0, 1: 20.0, 2: 5.0, 3: 20.0, 4: 20.0}
    strides = {k: {"foot_pitch_at_contact": pitch, "toe_clearance": 14.0} for k, pitch in pitches.items()}
    answer = judge(strides=strides)["heel"]
    assert (
        answer.status == "doubtful"
        and "of 4 landings 75 % on the heel and 25 % on a flat foot" in answer.text
    )
    strides[4]["foot_pitch_at_contact"] = -9.0
    assert judge(strides=strides)["heel"].status == "bad"
    other = SimpleNamespace(**(vars(LIMITS) | {"contact_pitch": (math.radians(4.0), math.radians(-10.0))}))
    answer = judge(strides=strides, limits=other)["heel"]
    assert "75 % on the heel" in answer.text and answer.status == "doubtful"  # by these limits, not others


@pytest.mark.parametrize(
    ("torque", "work", "status", "decides"),
    [
        (0.07, 0.016, "good", ""),
        (0.08, 0.015, "doubtful", "torque"),
        (0.06, 0.020, "doubtful", "work"),
        (0.08, 0.040, "bad", "work"),
        (0.15, 0.001, "bad", "torque"),
        (math.nan, 0.001, "unknown", ""),
        (math.nan, 0.050, "bad", "work"),
        (math.nan, math.nan, "unknown", ""),
    ],
)
def test_the_worse_of_torque_and_work_decides(torque: float, work: float, status: str, decides: str) -> None:
    changes = {"torque_against_push_off_per_mass": torque, "work_against_push_off": work}
    answer = judge(changes)["push_off"]
    assert answer.status == status
    assert (f"The {decides} decides." in answer.text) == bool(decides)
    if math.isfinite(torque):
        assert f"4.2 N·m ({torque:.3f} N·m/kg" in answer.text and f"{work:.4f} J/kg" in answer.text


@pytest.mark.parametrize(
    ("strides", "status"), [(2000.0, "good"), (1999.0, "doubtful"), (1000.0, "doubtful"), (999.0, "bad")]
)
def test_the_strides_of_a_bottle_judge_the_air(strides: float, status: str) -> None:
    answer = judge({"strides_per_bottle": strides})["air"]
    assert answer.status == status
    assert "0.08 g" in answer.text and "204 l/h (ANR)" in answer.text and "0.5 l at 300 bar" in answer.text
    assert f"{strides:.0f} strides, {strides * 1.2 / 60.0:.0f} min" in answer.text


def test_who_wears_nothing_is_hindered_by_nothing_and_takes_no_air() -> None:
    bare = tuple(
        name for name in GOOD if name.startswith(("air", "free_air", "torque", "work", "strides_per"))
    )
    found = judge(without=bare)
    assert found["air"].status == found["push_off"].status == "good"
    assert "nothing is worn" in found["air"].text and "Nothing is worn" in found["push_off"].text
    off = judge({"air_per_stride": 0.0}, without=("strides_per_bottle",))
    assert off["air"].status == "good" and "no stride" in off["air"].text
    before = judge(without=("strides_per_bottle",))["air"]  # a recording of an older version
    assert before.status == "unknown" and "run it again" in before.text


def test_a_bottle_below_the_supply_gives_nothing() -> None:
    answer = judge({"strides_per_bottle": 0.0})["air"]
    assert answer.status == "bad" and "lasts no stride: its pressure is not above the supply's" in answer.text


def test_a_walk_too_short_to_count_is_unknown_in_every_answer() -> None:
    """What its first stride wears is seen there: it is not told as nothing."""
    first = {0: numbers({"toe_clearance": 14.0, "air_per_stride": 0.08, "foot_pitch_at_contact": 20.0})}
    assert {answer.status for answer in verdict({}, first, LIMITS)} == {"unknown"}


def test_limits_are_told_as_they_are_and_minus_signs_are_true_ones() -> None:
    found = judge({"toe_clearance": -3.0, "foot_pitch_at_contact": -5.0})
    assert found["lift"].limit == "target ≥ 10 mm, trips below 0 mm"
    assert found["heel"].limit == "heel first from 8°, forefoot first below −1.6°"
    assert "≤ 0.07 N·m/kg and ≤ 0.016 J/kg" in found["push_off"].limit
    assert found["air"].limit == "target ≥ 2000 strides, bad below 1000"
    for answer in found.values():
        assert not re.search(r"-\d", str(answer)) and "nan" not in str(answer)
    assert "toes 5.0° down" in found["heel"].text


# --- designs

DESIGNS: dict[str, tuple[str, dict[str, Any]]] = {
    "as shipped": ("walk-dropfoot-afo", {}),
    "trips": ("walk-dropfoot-afo", {"supply.pressure": "2 bar"}),
    "trips at first": ("walk-dropfoot-afo", {"start.dorsiflexor.fill_time": "0 s"}),
    "hinders": ("walk-dropfoot-afo-short", {}),
    "wastes air": (
        "walk-dropfoot-afo",
        {"phases.dorsiflexor.inlet": [[0.30, 0.95]], "phases.dorsiflexor.outlet": [[0.0, 1.0]]},
    ),
    "nothing": ("walk-dropfoot", {}),
    "healthy": ("walk-healthy", {}),
}
# By the device's physics, before any number: what each design was spoilt to do.
MEANT = {"trips": ("lift", "bad"), "trips at first": ("lift", "bad"), "hinders": ("push_off", "bad")}
MEANT |= {"wastes air": ("air", "bad"), "nothing": ("lift", "bad"), "healthy": ("lift", "good")}


@pytest.fixture(scope="module")
def designs() -> dict[str, Recording]:
    return {name: afo_sim.run(*design) for name, design in DESIGNS.items()}


def band(value: float, wanted: float, bad: float) -> str:
    """A second way to judge: on a line from bad to wanted."""
    share = (value - bad) / (wanted - bad)
    return "bad" if share < 0.0 else "good" if share >= 1.0 else "doubtful"


def expected(run: Recording) -> dict[str, str]:
    """The statuses by hand: of strides and columns, limits in figures, litres of a bottle from a text."""
    heights = [stride["toe_clearance"].value for stride in run.strides.values()]
    touched = any(stride["swings_with_toe_contact"].value > 0.0 for stride in run.strides.values())
    pitches = [s["foot_pitch_at_contact"].value for k, s in run.strides.items() if k > 0]
    found = {
        "lift": "bad" if touched else band(min(heights), 10.0, 0.0),
        "heel": band(min(pitches), 8.0, -1.6),
        "push_off": "good",
        "air": "good",
        "skin": "good",
    }
    if "air_per_stride" in run.metrics:
        pressure = max(value.value for name, value in run.metrics.items() if name.endswith("_skin_pressure"))
        found["skin"] = band(-pressure, -4.0, -53.0)  # a strap is as tight all the time as at its peak
        kinds = ["good", "doubtful", "bad"]
        both = [
            band(-run.metrics["torque_against_push_off"].value / 68.5, -0.07, -0.14),
            band(-run.metrics["work_against_push_off"].value, -0.016, -0.032),
        ]
        found["push_off"] = max(both, key=kinds.index)
        once = {
            n.removeprefix("filled_once_"): float(m) for n, m in run.metrics.items() if "filled_once" in n
        }
        if once:
            own = run.metrics
            ratio = max(
                once["torque_against_push_off_per_mass"] / 0.07, once["work_against_push_off"] / 0.016
            ) / max(own["torque_against_push_off_per_mass"] / 0.07, own["work_against_push_off"] / 0.016)
            pays = once["toe_clearance"] < 10.0 or ratio > 1.1
            found["air_adds"] = "good" if own["toe_clearance"] >= 10.0 and pays else "doubtful"
        supply = run.scenario["supply.pressure"] * 1e-5
        litres = 136.0 - 0.5 * (supply + 1.0)  # of 0.5 l at 300 bar: some 136 l ANR, less what stays in it
        found["air"] = band(litres * 1.185 / run.metrics["air_per_stride"].value, 2000.0, 1000.0)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", DESIGNS)
def test_designs_are_judged_as_their_strides_are(designs: dict[str, Recording], name: str) -> None:
    run = designs[name]
    told = {answer.name: answer.status for answer in run.verdict if answer.name != "help"}
    assert told == expected(run)
    if name in MEANT:
        what, status = MEANT[name]
        assert told[what] == status


@pytest.mark.slow
def test_the_limits_of_the_scenario_decide(designs: dict[str, Recording]) -> None:
    """The very same walk, held against other limits."""
    usual = designs["as shipped"]
    changed = {
        "limits.toe_clearance": ["30 mm", "20 mm"],
        "limits.work_against_push_off": ["0.5 J/kg", "1 J/kg"],
        "limits.torque_against_push_off": ["0.5 N*m/kg", "1 N*m/kg"],
        "limits.bottle_volume": "2 l",
    }
    run = afo_sim.run("walk-dropfoot-afo", changed)
    assert run.metrics["toe_clearance"] == usual.metrics["toe_clearance"]
    told = {answer.name: answer for answer in run.verdict}
    assert [told[name].status for name in ("lift", "push_off", "air")] == ["bad", "good", "good"]
    assert "≥ 30 mm, trips below 20 mm" in told["lift"].limit and "2 l at 300 bar" in told["air"].text
    four = run.metrics["strides_per_bottle"].value / usual.metrics["strides_per_bottle"].value
    assert four == pytest.approx(4.0, rel=1e-9)


@pytest.mark.slow
def test_the_summary_holds_the_verdict(designs: dict[str, Recording]) -> None:
    run = designs["hinders"]
    (told,) = [each for each in run.summary()["verdict"] if each["name"] == "push_off"]
    assert (
        set(told) == {"name", "question", "status", "text", "limit", "brief", "kept", "rests_on"}
        and told["status"] == "bad"
    )
    assert f"{run.metrics['torque_against_push_off'].value:.1f} N·m" in told["text"]


def test_the_verdict_names_what_it_is_compared_with() -> None:
    """A walk in the device without air is not one without the device."""
    found = verdict(numbers(GOOD), {}, LIMITS, reference="orthosis-off")[0].text
    assert found.startswith("With the device and no air the toe ") and ", with air " in found


@pytest.mark.parametrize(("by_others", "status"), [(9.9, "doubtful"), (10.0, "good"), (40.0, "good")])
def test_another_law_that_lifts_too_little_is_said(by_others: float, status: str) -> None:
    answer = judge({"toe_clearance_by_other_laws": by_others})["lift"]
    assert answer.status == status and ("another force law" in answer.text) is (status != "good")


# --- what the air adds


@pytest.mark.parametrize(
    ("changes", "status", "says"),
    [
        ({}, "good", "only switched air lifts the toe enough"),
        ({"filled_once_toe_clearance": 12.0}, "doubtful", "a spring that is set once would do"),
        (
            {"filled_once_toe_clearance": 12.0, "filled_once_torque_against_push_off_per_mass": 0.0771},
            "good",  # 1.1 times 0.07 N·m/kg, from which on push-off meets that much more
            "switched air relieves push-off",
        ),
        (
            {"filled_once_toe_clearance": 12.0, "filled_once_work_against_push_off": 0.0177},
            "good",
            "relieves push-off",
        ),
        ({"toe_clearance": 4.0}, "doubtful", "neither is enough"),
        ({"toe_clearance": 9.0, "filled_once_toe_clearance": 11.0}, "doubtful", "one filling is enough"),
        ({"toe_clearance": 10.0, "filled_once_toe_clearance": 9.9}, "doubtful", "a spring that is set once"),
        ({"reference_toe_clearance": 12.0}, "doubtful", "needs neither"),
        ({"toe_clearance": 7.0}, "doubtful", "air lifts the toe higher, but not enough"),
    ],
)
def test_what_air_adds_over_one_filling(changes: dict[str, float], status: str, says: str) -> None:
    base = {"torque_against_push_off_per_mass": 0.07, "work_against_push_off": 0.016}
    answer = judge(base | changes)["air_adds"]
    assert answer.status == status and says in answer.text


def test_nothing_is_said_of_air_that_nobody_compared() -> None:
    assert "air_adds" not in judge(without=("filled_once_toe_clearance",))
    assert "air_adds" not in judge(without=("toe_clearance",))


@pytest.mark.parametrize(
    ("heights", "expected"),
    [
        ((12.0, None), True),
        ((9.0, None), False),
        ((30.0, -5.0), False),
        ((30.0, 14.0), True),
        ((None, None), False),
    ],
)
def test_nothing_is_to_change_where_no_device_is_needed(heights: tuple[Any, Any], expected: bool) -> None:
    names = ("reference_toe_clearance", "uncompensated_reference_toe_clearance")
    told = {name: height for name, height in zip(names, heights, strict=True) if height is not None}
    assert needless(numbers(told), LIMITS) is expected


# --- an own walk


@pytest.mark.parametrize(
    ("walked", "alone", "status", "lift"),
    [
        # without and with the device: as she walks, and on healthy hip, knee and path
        ((44.0, 60.0), (-35.7, 9.4), "doubtful", "doubtful"),  # helps, and not enough
        ((44.0, 60.0), (-35.7, 12.0), "good", "good"),
        ((44.0, 60.0), (-35.7, -2.0), "bad", "doubtful"),
        ((44.0, 60.0), (14.0, 25.0), "doubtful", "good"),  # not needed, either way
        ((-5.0, 30.0), (-20.0, 8.0), "doubtful", "doubtful"),
        ((-5.0, 30.0), (-20.0, 12.0), "good", "good"),
        ((-5.0, 30.0), (12.0, 25.0), "good", "good"),  # a weak hip: what she does counts
        ((44.0, 20.0), (14.0, 12.0), "bad", "good"),  # lowers the toe, though it is not needed
    ],
)
def test_an_own_walk_is_judged_without_compensation_too(
    walked: tuple[float, float], alone: tuple[float, float], status: str, lift: str
) -> None:
    heights = {"toe_clearance": walked[1], "toe_clearance_stride_1": walked[1]}
    heights |= {"lowest_toe_clearance_first_ten": walked[1], "reference_toe_clearance": walked[0]}
    without = {"uncompensated_reference_toe_clearance": alone[0], "uncompensated_toe_clearance": alone[1]}
    known = numbers(GOOD | heights | without)

    def own(of: dict[str, Metric]) -> dict[str, Answer]:
        return {answer.name: answer for answer in verdict(of, {}, LIMITS, own_walk=True)}

    found = own(known)
    assert (found["help"].status, found["lift"].status) == (status, lift)
    tripping = own(known | numbers({"toe_clearance_stride_1": -5.0}))
    assert (tripping["help"].status, tripping["lift"].status) != ("good", "good")
    assert tripping["lift"].status == "bad" and tripping["help"].status in ("bad", "doubtful")
    shorter = own(known | numbers({"uncompensated_toe_clearance_less_extended": 9.0}))
    assert "good" not in (shorter["help"].status, shorter["lift"].status)
    touching = own(known | numbers({"uncompensated_swings_with_toe_contact": 100.0}))
    assert alone[0] >= 10.0 or touching["help"].status == "bad"
    unknown = own(numbers(GOOD | heights))
    assert {unknown["help"].status, unknown["lift"].status} <= {"unknown", "bad"}
