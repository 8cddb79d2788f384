"""What warnings do to answers: each row of the table, runs beyond a limit, draws that a good one survives."""

import pathlib
import re

import pytest

import afo_sim
from afo_sim.common import Notice
from afo_sim.metrics import QUESTIONS, Answer, capped, decides, with_draws
from afo_sim.metrics.validity import CAPS, RESTS_ON

ORDER = ("good", "doubtful", "unknown", "bad")
NAMES = (*QUESTIONS, "move")
ALL = tuple(Answer(name, "?", "good", "Fine.", "") for name in NAMES)


@pytest.mark.parametrize("code", CAPS)
def test_a_warning_caps_what_rests_on_the_columns_that_it_doubts(code: str) -> None:
    cap, columns = CAPS[code]
    found = {answer.name: answer for answer in capped(ALL, ["words", Notice(code, "it is off")])}
    for name in NAMES:
        rests = bool(set(columns) & set(RESTS_ON[name]))
        assert found[name].status == (cap if rests else "good")
        assert ("it is off" in found[name].text) is rests
    assert decides(Notice(code, "")) and not decides(code)
    worst = tuple(Answer(name, "?", "bad", "", "") for name in NAMES)
    assert capped(worst, [Notice(code, "it is off")]) == worst


def test_every_code_of_the_table_is_of_a_warning_that_somebody_gives() -> None:
    package = pathlib.Path(afo_sim.__file__).parent
    source = "".join(file.read_text() for file in package.rglob("*.py") if file.name != "validity.py")
    made = {f"muscle-{word}" for word in ("pressure", "force", "contraction", "stretch")}
    made |= {f"law-outside-its-{word}" for word in ("pressure", "contraction")}
    made |= {"torque-jumps", "power-jumps"}
    assert [code for code in CAPS if code not in made and f'"{code}"' not in source] == []


@pytest.mark.parametrize(
    ("scenario", "sets", "rests"),
    [
        ("walk-dropfoot-afo", {"supply.pressure": "12 bar"}, NAMES),  # the muscles burst above 4.2 bar
        ("walk-dropfoot-afo", {"supply.pressure": "4.4 bar"}, NAMES),
        ("walk-dropfoot-afo", {"timestep": "10 ms"}, ("push_off", "skin")),
        ("walk-dropfoot-afo-timer", {}, NAMES),  # trips in strides 40 to 62, which 14.4 s do not show
        ("walk-dropfoot-afo", {}, ()),
    ],
)
def test_no_answer_is_good_beyond_a_limit(
    scenario: str, sets: dict[str, str], rests: tuple[str, ...]
) -> None:
    walk = afo_sim.run(scenario, sets)
    statuses = {answer.name: answer.status for answer in walk.verdict}
    assert len(statuses) == 7 and any(map(decides, walk.warnings)) is bool(rests)
    assert {name for name in rests if statuses.get(name) == "good"} == set()
    if not rests:  # no false alarm
        assert statuses["help"] == statuses["lift"] == "good"


@pytest.mark.parametrize(("share", "status"), [(0.89, "doubtful"), (0.9, "good"), (1.0, "good")])
def test_a_good_answer_survives_nine_draws_of_ten(share: float, status: str) -> None:
    heel = Answer("heel", "?", "good", "Lands.", "")
    assert heel.word == "GOOD*"
    (found,) = with_draws([heel], 0.0, 1000, (0.02, 0.1), {"heel": share})
    assert found.status == status and found.kept == share and "*" not in found.word
    assert bool(re.search(r"89 % of 1000 draws", found.text)) is (share < 0.9)
