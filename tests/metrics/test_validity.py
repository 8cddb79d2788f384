"""What warnings do to answers: each row of the table, runs beyond a limit, draws that a good one survives."""

import pathlib
import re

import pytest

import afo_sim
from afo_sim.common import Notice
from afo_sim.metrics import QUESTIONS, Answer, capped, decides, with_draws
from afo_sim.metrics.validity import CAPS, RESTS_ON
from afo_sim.simulation import answers_of

NAMES = (*QUESTIONS, "move")
ALL = tuple(Answer(name, "?", "good", "Fine.", "") for name in NAMES)
HARMLESS = {  # warnings that cap no answer: an answer says them itself, or no number of it is in doubt
    "said": "skin-pressure source-empty not-compared compensation-unknown no-stride-counts metric-undefined",
    "a warning of the run says it where it happens": "muscle-stretched muscle-too-short muscle-too-slack",
    "the description may be meant so": "muscle-never-pulls drive-never-asked drive-asked-too-little "
    "drive-asked-too-much slack-everywhere air-blows-off inlet-bypassed volume-never-vents "
    "volume-above-supply valve-never-opens valves-open-together stride-not-solved "
    "cadence-change-after-end controller-in-python heel-strike-assumed "
    "no-cycle timer-cycle leg-paced side-copied leg-walked leg-timer legs-exchanged legs-persons "
    "legs-bottles",
    "the numbers are those of the end": "air-settles-slowly metric-left-out",
    "the pads' loss in push-off moves the settled clearance by 0.05 mm": "ground-force-lost",
    "where the height is taken": "no-swing-minimum",
    "of a gait file, before a run": "stride-open",
    "of a metric of the user's, of which no answer is made": "own-metric-failed",
    "what was set is not simulated, and nothing that is simulated is in doubt": "strength-not-applied",
    "of the torque map": "pressure-limit device-of-another-size",
}


def test_every_warning_of_a_run_caps_an_answer_or_is_known_not_to() -> None:
    package = pathlib.Path(afo_sim.__file__).parent
    rooms = (
        path for room in ("simulation", "model", "metrics", "gait") for path in (package / room).rglob("*.py")
    )
    codes = {code for path in rooms for code in re.findall(r'Notice\(\s*f?"([a-z-]+)"', path.read_text())}
    assert len(codes) > 40
    assert codes - CAPS.keys() - {code for each in HARMLESS.values() for code in each.split()} == set()


@pytest.mark.parametrize("code", CAPS)
def test_a_warning_caps_what_rests_on_the_columns_that_it_doubts(code: str) -> None:
    """What passes a limit so that a muscle bursts is BAD for the toe, and in doubt for all else."""
    cap, columns = CAPS[code]
    found = {answer.name: answer for answer in capped(ALL, ["words", Notice(code, "it is off")])}
    for name in NAMES:
        rests = bool(set(columns) & set(RESTS_ON[name]))
        beside = "doubtful" if cap == "bad" else "good"
        assert found[name].status == (cap if rests else beside)
        assert ("it is off" in found[name].text) is (rests or cap == "bad")
    assert decides(Notice(code, "")) and not decides(code)
    worst = tuple(Answer(name, "?", "bad", "", "") for name in NAMES)
    assert capped(worst, [Notice(code, "it is off")]) == worst


def test_a_capped_answers_short_form_has_the_number_and_its_limit() -> None:
    """And what the warning says to do of a contraction holds: less pressure, or a longer muscle."""
    muscle = "orthosis.muscle.dorsiflexor"
    sets: dict[str, object] = {"duration": "2 s", f"{muscle}.type.limits.contraction_max": 0.12}
    longer = {f"{muscle}.type.total_length": "25 cm", f"{muscle}.link_length": "7.7 cm"}
    runs = [afo_sim.run("seated", sets | more) for more in ({}, {"supply.pressure": "3 bar"}, longer)]
    most, *less = (float(run["muscle/dorsiflexor_1/contraction"].max()) for run in runs)
    assert max(less) < most
    (moves, _) = answers_of(runs[0])
    assert moves.status == "unknown" and f"{most:.3g}" in moves.brief and "0.12" in moves.brief


@pytest.mark.parametrize(("beyond", "status"), [(0.08, "doubtful"), (0.09, "bad")])
def test_two_per_cent_over_a_limit_are_in_doubt(beyond: float, status: str) -> None:
    warning = Notice("muscle-pressure", "", limit=4.2, beyond=beyond)
    assert {answer.name: answer.status for answer in capped(ALL, [warning])}["lift"] == status


def test_every_code_of_the_table_is_of_a_warning_that_somebody_gives() -> None:
    package = pathlib.Path(afo_sim.__file__).parent
    source = "".join(file.read_text() for file in package.rglob("*.py") if file.name != "validity.py")
    made = {f"muscle-{word}" for word in ("pressure", "force", "contraction", "stretch")}
    made |= {f"law-outside-its-{word}" for word in ("pressure", "contraction")}
    made |= {"path-jumps-below-range", "path-jumps-above-range"}
    assert [code for code in CAPS if code not in made and f'"{code}"' not in source] == []


@pytest.mark.parametrize(
    ("scenario", "sets", "rests"),
    [
        ("walk-dropfoot-afo", {"supply.pressure": "12 bar"}, NAMES),  # the muscles burst above 4.2 bar
        ("walk-dropfoot-afo", {"supply.pressure": "4.4 bar"}, NAMES),
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
    assert bool(re.search(r"89 % of 1000", found.text)) is (share < 0.9)
