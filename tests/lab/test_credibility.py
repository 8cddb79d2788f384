"""Grades by a second reading of the documented rules; numbers of the page found again in the run."""

import html
import itertools
import json
import math
import pathlib
import random
import re
import tomllib
from typing import Any

import pytest
from command import Call
from documents import PAGES, ROOT

from afo_sim import InputError, credibility
from afo_sim.description import load
from afo_sim.lab import credibility as module
from afo_sim.lab.credibility import Credibility, assess, graded, rules_of
from afo_sim.native.between_strides import AIR, ANGLE
from afo_sim.simulation.step_control import FLOORS

ASKED: dict[str, Any] = {"question": "Does it lift this patient's toe?", "context": "a choice of springs"}
ASKED |= {"metric": "toe_clearance", "influence": "low", "consequence": "low"}
LEVELS = ("low", "medium", "high")
PAGE = PAGES["credibility"]
Numbers = dict[str, Any]


def cells(heading: str) -> list[list[str]]:
    """The rows of the page's table that begins so."""
    table = PAGE[PAGE.index(heading) :].split("\n\n")[0].splitlines()[2:]
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in table]


def documented() -> list[tuple[str, str, list[tuple[str, list[float]]]]]:
    """(factor, number, [(≥ or ≤, thresholds)]) of each row of the page's rules."""
    found, factor = [], ""
    for name, _, number, bounds in cells("| factor | evidence of FDA"):
        factor = name or factor
        sides = [(part.strip()[0], part.strip()[1:]) for part in bounds.split(";")]
        steps = [(sign, [float(x) for x in numbers.split(",")]) for sign, numbers in sides]
        found.append((factor, number.strip("`"), steps))
    return found


def by_the_page(evidence: Numbers) -> dict[str, int]:
    """Grades of all factors, read from nothing but the page."""
    grades: dict[str, int] = {}
    for factor, number, sides in documented():
        if number not in evidence:
            continue
        value, grade = evidence[number], 3
        for sign, steps in sides:
            met = 0
            while value is not None and met < len(steps):
                if not (value >= steps[met] if sign == "≥" else value <= steps[met]):
                    break
                met += 1
            grade = min(grade, met)
        grades[factor] = min(grades.get(factor, 3), grade)
    return grades


# A walk without a device, known as well as can be; then what changes of it, and of its grades.
BEST: Numbers = dict.fromkeys(
    ("metrics_beyond_step", "draws_failed_share", "warnings_that_decide", "numbers_set"), 0
)
BEST |= {"test_functions": 900, "law_tests": 50, "step_error_times": 0.01, "stride_change_times": 0.01}
BEST |= {
    "own_walk": 1,
    "friction": 0.1,
    "draws_rejected": 0,
    "unsourced_share": 0.05,
    "tissue": 1.0,
    "draws": 1000,
    "explained": 0.95,
}
BEST |= {
    "band_by_limit": 1.0,
    "benches": 20,
    "values": 40,
    "worn": 12,
    "same_values": 12,
    "inside_share": 0.95,
}
BEST |= {"drawn_inputs": 0.05, "times_measured": 1.1, "limit_kept": 1}
ALL: dict[str, int] = dict.fromkeys((each["name"] for each in rules_of()["factor"]), 3)
ALL |= {"software quality assurance": 2, "numerical code verification": 2, "use error": 2, "model form": 2}
HELD = ("test samples", "test conditions", "relevance of the validation to the context of use")
BY_HAND: list[tuple[Numbers, dict[str, int]]] = [
    ({}, {}),
    ({"tissue": 0.0}, {"model inputs": 0}),
    ({"tissue": 3.0}, {"model inputs": 1}),  # between 2 and 3 deviations: ln 3 is 2.2 times 0.5
    ({"tissue": 0.3}, {"model inputs": 1}),  # ln 0.3 is −2.4 times 0.5
    ({"muscle_grade": 0, "laws_known": 1, "energy_error": 0.5}, {"model inputs": 0, "model form": 1}
     | {"numerical code verification": 1}),
    ({"worn": 0}, dict.fromkeys(HELD, 1) | {"relevance of the quantities of interest": 2}),
    ({"worn": 1}, dict.fromkeys((HELD[0], HELD[2]), 2) | {HELD[1]: 2}),
    ({"values": 0, "inside_share": None, "worn": 0}, dict.fromkeys(HELD[1:], 0) | {HELD[0]: 1}
     | {"output comparison": 0, "relevance of the quantities of interest": 2}),
    ({"step_error_times": None}, {"discretization error": 0}),
    ({"test_functions": 0, "law_tests": 0}, {"software quality assurance": 1}
     | {"numerical code verification": 1}),
    ({"warnings_that_decide": 1}, {"use error": 0}),
    ({"draws": 99, "explained": None}, {"model inputs": 0}),
    ({"times_measured": 3.01}, {"output comparison": 0}),
]  # fmt: skip


@pytest.mark.parametrize(("change", "grades"), BY_HAND)
def test_grades_by_hand(change: Numbers, grades: dict[str, int]) -> None:
    evidence = _with_what_sentences_take(BEST | change)
    assert {each.name: each.grade for each in graded(evidence, 1)} == ALL | grades
    assert by_the_page(evidence) == ALL | grades


def test_grades_of_any_evidence_follow_from_the_page() -> None:
    """Values on, between and beyond all thresholds, some not known and some left out."""
    rng = random.Random(7)
    for _ in range(300):
        evidence: Numbers = dict(BEST)
        for _, number, sides in documented():
            near = rng.choice(rng.choice(sides)[1])
            evidence[number] = rng.choice([near, near * 1.001, near * 0.999, 0.0, 1e3, None])
        for number in rng.sample(sorted(evidence), 3):
            if number in ("energy_error", "law_mismatch_share", "laws_known", "muscle_grade"):
                del evidence[number]
        evidence = _with_what_sentences_take(evidence)
        assert {each.name: each.grade for each in graded(evidence, 3)} == by_the_page(evidence)


def _with_what_sentences_take(evidence: Numbers) -> Numbers:
    names = set(re.findall(r"{(\w+)}", (ROOT / "models" / "credibility" / "rules.toml").read_text("utf-8")))
    ruled = {number for _, number, _ in documented()}
    return dict.fromkeys(names - ruled, 1) | evidence


def test_the_factors_are_those_of_the_standard() -> None:
    """Galappaththige et al. 2022, table 5; samples, conditions and comparison each as one."""
    names = """software quality assurance, numerical code verification, discretization error,
        numerical solver error, use error, model form, model inputs, test samples, test conditions,
        equivalency of inputs, output comparison, relevance of the quantities of interest,
        relevance of the validation to the context of use"""
    assert list(ALL) == [name.strip() for name in names.split(",")]
    assert len(rules_of()["categories"]) == 8


def test_a_settled_stride_is_one_to_the_solver_too() -> None:
    change = rules_of()["change"]
    assert change["settled_air_change"] == change["walked_air_change"] == pytest.approx(100.0 * AIR)
    assert change["settled_angle_change"] == pytest.approx(math.degrees(ANGLE))
    assert change["walked_clearance_change"] == FLOORS["mm"]


# --- a run


@pytest.fixture(scope="module")
def bare() -> Credibility:
    """A drop foot without a device."""
    return credibility("walk-dropfoot", {"duration": "4 s"}, draws=100, **ASKED)


@pytest.fixture(scope="module")
def worn() -> Credibility:
    """With a device whose clearance the draws do not decide."""
    return credibility("walk-dropfoot-afo", {"duration": "4 s"}, draws=120, **ASKED)


def test_a_foot_that_trips_in_every_draw_is_decided_at_low_risk_alone(bare: Credibility) -> None:
    assert (bare.answer["answer"], bare.judgement, bare.short) == ("bad", "sufficient", [])
    assert bare.answer["high"] < 0.0 == bare.answer["bad"]
    for one, other in itertools.product(LEVELS, LEVELS):
        found = assess(bare.recording, ASKED | {"influence": one, "consequence": other})
        row = {name: levels for name, *levels in cells("| influence, consequence")}[one]
        assert found.risk == row[LEVELS.index(other)]
        assert found.judgement == ("sufficient" if found.risk == "low" else "insufficient")


def test_risk_changes_what_is_required_and_nothing_that_is_found(worn: Credibility) -> None:
    high = assess(worn.recording, ASKED | {"influence": "high", "consequence": "high"})
    assert (high.evidence, high.answer, high.comparators) == (worn.evidence, worn.answer, worn.comparators)
    for one, other in zip(worn.factors, high.factors, strict=True):
        assert (one.grade, one.says, one.numbers) == (other.grade, other.says, other.numbers)
        assert (one.required, other.required) == (1, 3)
    missing = [each.required - each.grade for each in high.short]
    assert missing == sorted(missing, reverse=True) and missing[0] == 2
    assert [each.name for each in high.short] == high.to_json()["short"]
    assert (high.plan[0]["what"], high.plan[1:]) == ("comparison", worn.plan)  # no draw covers it


def test_an_answer_that_the_draws_do_not_decide_is_never_sufficient(worn: Credibility) -> None:
    assert worn.answer["low"] < worn.answer["wanted"] < worn.answer["high"]
    assert (worn.short, worn.answer["answer"], worn.judgement) == ([], "undecided", "insufficient")


@pytest.mark.parametrize("name", ["bare", "worn"])
def test_evidence_is_found_again_in_the_run(name: str, request: pytest.FixtureRequest) -> None:
    found: Credibility = request.getfixturevalue(name)
    told, evidence = json.loads(json.dumps(found.recording.summary())), found.evidence
    study, steps = told["studies"]["uncertainty"], told["studies"]["time_step"]
    band = study["metrics"]["toe_clearance"]
    assert [found.answer[key] for key in ("low", "median", "high")] == band["quantiles"]
    assert found.answer["wanted"] == 10.0  # of the limits that are shipped: 1 cm
    step = steps["metrics"]["toe_clearance"]
    assert evidence["step_error_times"] == pytest.approx(abs(step["error"]) / step["bound"])
    assert evidence["band_by_limit"] == pytest.approx((band["quantiles"][2] - band["quantiles"][0]) / 10.0)
    assert evidence["explained"] == 1.0 - study["rest"]["toe_clearance"]
    if "energy_error" in told["metrics"]:
        assert evidence["energy_error"] == abs(told["metrics"]["energy_error"]["value"])
    coverage = tomllib.loads((ROOT / "models" / "coverage.toml").read_text("utf-8"))
    assert {key: evidence[key] for key in coverage["toe clearance"]} == coverage["toe clearance"]
    # kinds, counted in the text: but for friction, which no muscle here has in use, and the verdict's limits
    scenario = {key: part for key, part in told["scenario"].items() if key != "limits"}
    for group in scenario["orthosis"].get("muscle", {}).values():
        assert group["type"]["friction"] == "none" and group["type"].pop("frictions")
    text = json.dumps(scenario)
    for kind in ("published", "fitted", "derived", "assumed"):
        assert evidence[f"numbers_{kind}"] == text.count(f'"kind": "{kind}"')
    assert evidence["muscle_grade" if name == "worn" else "tissue"] == 1


def test_every_number_of_the_page_is_found_again(worn: Credibility, tmp_path: pathlib.Path) -> None:
    files = worn.save(tmp_path)
    assert [file.name for file in files] == ["credibility.html", "credibility.json"]
    told = json.loads(files[1].read_text("utf-8"))
    assert told == json.loads(json.dumps(worn.to_json()))
    page = re.sub(r"<style>.*?</style>|<[^>]*>", " ", files[0].read_text("utf-8"), flags=re.S)
    texts, numbers = list[str](), list[float]()
    _gather(
        told | {"factors": [each | {"says": ""} for each in told["factors"]], "because": []}, texts, numbers
    )
    _gather(worn.recording.summary()["metrics"], [], numbers)
    numbers += [100.0 * share for share in numbers] + [float(len(told["short"])), float(len(told["factors"]))]
    fixed = "V&V 40; 5 to 95 %; 90 %; (1: yes)"  # of the words
    number = r"[−-]?(?<![\w.])\d+(?:\.\d+)*(?:e-?\d+)?"
    stated = {one.strip("−-") for one in re.findall(number, " ".join([fixed, *texts]))}
    tokens = re.findall(number, html.unescape(page))
    assert len(tokens) > 100
    lost = [one for one in tokens if one.strip("−-") not in stated and not _is_one_of(one, numbers)]
    assert lost == []


def _gather(node: Any, texts: list[str], numbers: list[float]) -> None:
    if isinstance(node, dict | list):
        for each in node.values() if isinstance(node, dict) else node:
            _gather(each, texts, numbers)
    elif isinstance(node, str):
        texts.append(node)
    elif node is not None:
        numbers.append(float(node))


def _is_one_of(token: str, numbers: list[float]) -> bool:
    """Whether a number, rounded to the token's digits, is the token."""
    value = float(token.replace("−", "-"))
    decimals = len(token.partition("e")[0].partition(".")[2]) - int(token.partition("e")[2] or 0)
    return any(abs(each - value) <= 0.501 * 10.0**-decimals for each in numbers)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sets", "factor", "number"),
    [
        ({"leg.passive.scale": 0.0}, "model inputs", "tissue"),
        ({"patient.stiffness": 0.0}, "model inputs", "tissue"),
        ({"orthosis.muscle.dorsiflexor.type": "pleated_110mm"}, "model inputs", "muscle_grade"),
        ({"gait.steppage_hip": "30 deg"}, "output comparison", "times_measured"),
        ({"supply.pressure": "10 bar"}, "use error", "warnings_that_decide"),
    ],
)
def test_an_absurd_walk_is_never_sufficient(sets: Numbers, factor: str, number: str) -> None:
    found = credibility("walk-dropfoot-afo-short", {"duration": "4 s", **sets}, draws=100, **ASKED)
    graded_by = {each.name: each.numbers for each in found.factors}[factor]
    assert (graded_by[number], found.judgement) == (0, "insufficient")


def test_a_foot_that_clears_in_every_draw_suffices_at_low_risk(worn: Credibility) -> None:
    """A band above what is wanted; touching it counts, a draw below it and a trip do not."""
    study = worn.recording.studies["uncertainty"]

    def found(low: float, trips: float) -> Credibility:
        band = study["metrics"]["toe_clearance"] | {"quantiles": [low, 20.0, 30.0]}
        bands = study | {"draws": 500, "metrics": study["metrics"] | {"toe_clearance": band}}
        bands |= {"kept": study["kept"] | {"lift": 0.97}}
        bands["trips"] = study["trips"] | {"touch": study["trips"]["touch"] | {"share": trips}}
        return assess(worn.recording.changed(studies=worn.recording.studies | {"uncertainty": bands}), ASKED)

    assert (found(10.0, 0.0).answer["answer"], found(10.0, 0.0).judgement) == ("good", "sufficient")
    assert found(9.99, 0.0).judgement == found(10.0, 0.2).judgement == "insufficient"


def test_limits_count_where_they_are_at_least_as_strict_as_the_usual(
    worn: Credibility, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A clearance may be higher, work against push-off and trips lower."""
    usual = load("limits", "usual")

    def kept(metric: str, key: str, share: float) -> int:
        limits = usual.model_copy(update={key: tuple(share * x for x in getattr(usual, key))})
        monkeypatch.setattr(module, "limits_of", lambda _: limits)
        return int(assess(worn.recording, ASKED | {"metric": metric}).evidence["limit_kept"])

    for metric, key, stricter in (
        ("toe_clearance", "toe_clearance", 1.1),
        ("work_against_push_off", "work_against_push_off", 0.9),
        ("work_against_push_off", "drawn_trips", 0.9),
    ):
        assert [kept(metric, key, share) for share in (1.0, stricter, 2.0 - stricter)] == [1, 1, 0]


def test_what_a_measurement_leaves_ranks_the_plan(worn: Credibility) -> None:
    """By shares where nothing else is known: √(1 − S) of the width; else by wrong guesses."""
    study = worn.recording.studies["uncertainty"]
    plain = [{key: group[key] for key in ("name", "measure", "explained")} for group in study["groups"]]
    shares = {one["name"].replace("_", " "): one["explained"]["toe_clearance"] for one in plain}

    def plan(groups: list[Numbers]) -> tuple[Numbers, ...]:
        bands = study | {"groups": groups, "wrong": 0.3}
        return assess(
            worn.recording.changed(studies=worn.recording.studies | {"uncertainty": bands}), ASKED
        ).plan

    left = {one["what"]: one["band_left"] for one in plan(plain)}
    assert list(left.values()) == sorted(left.values()) and len(left) > 2
    assert left == pytest.approx({name: math.sqrt(1.0 - shares[name]) for name in left})
    first, second, *_, last = left
    guesses = {last: 0.1, second: 0.2, first: 0.29}  # the third by less than its error, as the rest
    known = [
        group
        | {"band_left": {"toe_clearance": 0.5 if group["name"].replace("_", " ") == first else 0.6}}
        | {"wrong_left": guesses.get(group["name"].replace("_", " "), 0.3), "wrong_left_error": 0.02}
        for group in plain
    ]
    assert [one["what"] for one in plan(known)][:3] == [last, second, first]
    assert all(one["measure"] for one in plan(known))


def test_numbers_that_are_not_known_grade_nothing(worn: Credibility) -> None:
    """Of too few draws nobody knows what explains the band; a fixed step tells no error."""
    study = worn.recording.studies["uncertainty"]
    bare_groups = [{**group, "explained": {}, "band_left": {}} for group in study["groups"]]
    few = {key: value for key, value in study.items() if key not in ("rest", "wrong")} | {
        "groups": bare_groups
    }
    steps = dict(worn.recording.studies["time_step"]) | {"metrics": {}}
    studies = {"uncertainty": few, "time_step": steps}
    found = assess(worn.recording.changed(studies=studies), ASKED)
    assert (found.evidence["explained"], found.evidence["step_error_times"], found.plan) == (None, None, ())
    assert {each.name for each in found.short} == {"model inputs", "discretization error"}


def test_air_has_no_limit_and_no_measured_value(worn: Credibility, bare: Credibility) -> None:
    found = assess(worn.recording, ASKED | {"metric": "air_per_stride"})
    assert (found.evidence["values"], found.evidence["limit_kept"], found.judgement) == (
        0,
        0,
        "insufficient",
    )
    with pytest.raises(InputError) as refused:
        assess(bare.recording, ASKED | {"metric": "air_per_stride"})
    assert refused.value.field == "metric" and "toe_clearance" in str(refused.value)


def test_an_installed_package_has_no_tests_beside_it(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where others have put theirs into the same folder."""
    counted = module._tests.__wrapped__
    assert counted()["test_functions"] > counted()["law_tests"] > 20
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "test_other.py").write_text("\ndef test_other(): ...\n")
    monkeypatch.setattr(module, "__file__", str(tmp_path / "afo_sim" / "lab" / "credibility.py"))
    assert set(counted().values()) == {0}


def test_the_command_writes_and_prints_the_same(call: Call, tmp_path: pathlib.Path) -> None:
    words = [
        "credibility",
        "walk-dropfoot",
        "--set",
        "duration=4 s",
        "--draws",
        "20",
        "--out",
        tmp_path / "c",
    ]
    words += [word for key, text in ASKED.items() for word in (f"--{key}", text)]
    code, said, _ = call(*words)
    told = json.loads((tmp_path / "c" / "credibility.json").read_text("utf-8"))
    assert code == 0 and "\nINSUFFICIENT\n" in said and all(line in said for line in told["because"])
    code, said, _ = call(*words, "--json")
    assert code == 0 and json.loads(said) == told
    code, _, wrong = call("run", "seated", "--out", tmp_path / "c")
    assert code == 2 and "credibility assessment" in wrong
