"""The verdict in report, notebook, viewer and terminal: the same answers, told by more than a colour."""

import dataclasses
import html
import os
import pathlib
import re
import subprocess
import sys

import pytest
from colour_vision import contrast
from command import call

import afo_sim
from afo_sim import simulation, study
from afo_sim.cli.printed_run import print_run
from afo_sim.common import Notice
from afo_sim.metrics import Metric, seated_answers
from afo_sim.show import RUNS, RunView
from afo_sim.show import verdict_texts as verdict
from afo_sim.show.report import page
from afo_sim.simulation import Recording, limits_of
from afo_sim.study import EFFECTS

pytestmark = pytest.mark.usefixtures("undrawn")


@pytest.fixture(scope="module")
def shipped(walks: dict[str, Recording]) -> Recording:
    return walks["worn"]


@pytest.fixture(scope="module")
def short_links(walks: dict[str, Recording]) -> Recording:
    return walks["short"]


@pytest.fixture(scope="module")
def sitting(walks: dict[str, Recording]) -> Recording:
    return walks["sitting"]


def text_of(found: str) -> str:
    """The words of a page, without its tags and styles."""
    bare = re.sub(r"<style>.*?</style>|<svg.*?</svg>|<[^>]+>", " ", found, flags=re.S)
    return " ".join(html.unescape(bare).split())


def views(*runs: Recording) -> list[RunView]:
    return [RunView(run.scenario["name"], colour, run) for run, colour in zip(runs, RUNS, strict=False)]


def test_each_place_opens_with_the_answers(shipped: Recording) -> None:
    text = text_of(page(views(shipped)))
    assert "trips below 0 mm; assumed" in text and "bad above 0.14 or 0.032; derived" in text
    assert "mm (published)" not in text
    assert text.index("Does it work?") < text.index("What to keep in mind")
    for place in (
        text,
        str(shipped._repr_html_()),
        verdict.markdown(shipped),
        "\n".join(verdict.lines(shipped)),
    ):
        places = [place.index(answer.question) for answer in shipped.verdict]
        assert places == sorted(places) and len(places) == 7
        for answer in shipped.verdict:
            assert answer.status.upper() in place and answer.text in place and answer.limit in place


def test_a_mark_and_a_word_tell_what_a_colour_tells() -> None:
    badges = {status: verdict.MARKS[status] for status in ("good", "doubtful", "bad", "unknown")}
    assert len(set(badges.values())) == 4 and all(len(mark) == 1 for mark in badges.values())


def test_runs_stand_side_by_side_with_their_own_limits(shipped: Recording, short_links: Recording) -> None:
    rows = verdict.of_report(views(shipped, short_links))
    assert [len(row["cells"]) for row in rows] == [2] * 7
    assert [bool(row["limit"]) for row in rows] == [
        True,
        True,
        False,
        True,
        True,
        True,
        True,
    ]  # another pitch is wanted
    found = page(views(shipped, short_links))
    table = found.partition('<table class="verdict-table">')[2].partition("</table>")[0]
    assert table.count('scope="row"') == 7 and table.count('scope="col"') == 3
    assert table.count("heel first from 8°") == table.count("heel first from 5°") == 1
    assert len(re.findall(r'<td class="verdict-(good|doubtful|bad|unknown)">', table)) == 14


def test_what_does_not_walk_has_none(shipped: Recording, sitting: Recording) -> None:
    assert verdict.lines(sitting) == [] and verdict.markdown(sitting) == ""
    assert verdict.of_report(views(sitting)) == []
    assert len(verdict.of_report(views(shipped, sitting))[0]["cells"]) == 1
    both = page(views(shipped, sitting)).partition('<section class="verdict"')[2].partition("</section>")[0]
    assert "walk-dropfoot-afo" in both  # whose answers these are, beside a run that has none
    assert "verdict" not in sitting.summary() and "Does it work?" not in page(views(sitting))


def test_a_run_that_failed_stands_beside_the_others(shipped: Recording) -> None:
    failed = dataclasses.replace(shipped, status="failed: it fell")
    *answers, _, last = verdict.lines(failed)  # between them what such numbers were worth
    assert all(line.startswith("? UNKNOWN") and "stopped early" in line for line in answers)
    assert "not a medical device" in last
    row = verdict.of_report(views(shipped, failed))[0]
    assert [cell["answer"].status for cell in row["cells"]] == ["good", "unknown"]


def test_the_colours_have_contrast_enough() -> None:
    """AA: text 4.5, edges 3, each upon its own ground."""
    style = (pathlib.Path(verdict.__file__).parent / "report_verdict.html.j2").read_text(encoding="utf-8")
    for status in verdict.MARKS:
        rule = re.search(rf"\.verdict-{status} {{ background: (#\w+); border-color: (#\w+);", style)
        badge = re.search(rf"\.verdict-{status} \.verdict-badge {{ color: (#\w+)", style)
        assert rule and badge
        ground, edge = (c if len(c) == 7 else "#" + "".join(2 * x for x in c[1:]) for c in rule.groups())
        word = badge[1] if len(badge[1]) == 7 else "#" + "".join(2 * x for x in badge[1][1:])
        assert contrast(word, ground) > 4.5 and contrast("#4a4a4a", ground) > 4.5
        assert contrast(edge, "#ffffff") > 3.0


# --- the terminal


def ran(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    kept: Recording,
    folder: pathlib.Path,
    width: str,
    *more: str,
) -> list[str]:
    """What the command says of a walk; what a change does is kept."""
    kept = dataclasses.replace(kept, studies={EFFECTS: kept.studies[EFFECTS]})
    monkeypatch.setattr(simulation, "run_scenario", lambda *a, **o: kept)
    monkeypatch.setattr(study, "with_studies", lambda *a, **o: kept)
    monkeypatch.setenv("COLUMNS", width)
    code, said, _ = call(capsys, "run", "walk-dropfoot-afo", "--no-rrd", "--force", "--out", folder, *more)
    assert code == 0
    return said.splitlines()


@pytest.mark.slow
@pytest.mark.parametrize(("width", "most"), [("100", 23), ("80", 23)])
def test_a_walk_is_told_on_one_screen(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: pathlib.Path,
    studied: Recording,
    width: str,
    most: int,
) -> None:
    folder = pathlib.Path("run")
    monkeypatch.chdir(tmp_path)
    lines = ran(capsys, monkeypatch, studied, folder, width)
    assert len(lines) <= most and max(map(len, lines)) <= int(width)
    assert lines[0].startswith("walk-dropfoot-afo")
    assert [line[:1] for line in lines[1:] if line[:1] in "✓!✗?"] == ["✓", "✓", "✓", "!", "!", "!", "!"]
    assert "air_per_stride" not in "\n".join(lines) and lines[-1].startswith("written to run")


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"source_empty_after": Metric(7.0, "s")}, "The source is empty after 7.0 s."),
        ({"swings_with_toe_contact": Metric(1.0, "")}, "The forefoot touches the floor earlier in swing."),
        ({"strides_without_air": Metric(1.0, "")}, "This is from strides on an empty source."),
        ({"toe_clearance": Metric(-3.0, "mm")}, "The toe trips in the settled stride."),
    ],
)
def test_a_short_line_hides_nothing_that_is_bad(
    shipped: Recording, changed: dict[str, Metric], said: str
) -> None:
    run = dataclasses.replace(shipped, metrics={**shipped.metrics, **changed})
    assert any(said in line for line in verdict.brief([(run, a) for a in run.verdict]))
    assert not any(said in line for line in verdict.brief([(shipped, a) for a in shipped.verdict]))


def test_the_sentence_of_a_report_names_what_is_bad(short_links: Recording) -> None:
    answers = {answer.name: answer for answer in short_links.verdict}
    assert answers["help"].status == "good" and answers["push_off"].status == "bad"
    assert verdict.lead(short_links).startswith(answers["help"].text)
    assert "BAD: push-off." in verdict.lead(short_links)


@pytest.mark.parametrize(("rise", "status"), [(0.3, "good"), (1.5, "doubtful"), (float("nan"), "doubtful")])
def test_seated_what_is_slower_than_a_swing_is_not_good(sitting: Recording, rise: float, status: str) -> None:
    numbers = {
        **sitting.metrics,
        "rise_time": Metric(rise, "s"),
        "peak_dorsiflexion_angle": Metric(2.0, "deg"),
    }
    assert seated_answers(numbers, limits_of(sitting))[0].status == status


def test_what_stopped_early_has_no_answer_when_seated_and_is_said_before_its_curves(
    sitting: Recording, capsys: pytest.CaptureFixture[str]
) -> None:
    failed = dataclasses.replace(sitting, status="failed: it fell")
    print_run(failed, pathlib.Path("run"))
    assert not any(word in capsys.readouterr().out for word in ("GOOD", "DOUBTFUL", "BAD"))
    shown = page(views(failed))
    assert shown.index("the simulation failed: it fell") < shown.index('class="panels"')


def test_warnings_that_do_not_fit_are_counted(
    sitting: Recording, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    many = tuple(Notice(f"kind-{k}", "number {k} is wrong", k=k) for k in range(20))
    print_run(dataclasses.replace(sitting, warnings=many), pathlib.Path("run"))
    lines = capsys.readouterr().out.splitlines()
    shown = sum(line.startswith("warning: ") for line in lines)
    assert len(lines) <= 23 and f"({20 - shown} of warnings)" in "".join(lines)


@pytest.mark.slow
def test_every_number_is_printed_when_asked_for(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: pathlib.Path,
    studied: Recording,
) -> None:
    lines = ran(capsys, monkeypatch, studied, tmp_path / "run", "200", "--numbers")
    run = afo_sim.read_recording(tmp_path / "run")
    printed = {line.split()[0] for line in lines if line}
    assert set(run.metrics) <= printed


@pytest.mark.slow
def test_a_terminal_without_the_marks_gets_others(tmp_path: pathlib.Path) -> None:
    done = subprocess.run(
        [
            *(sys.executable, "-m", "afo_sim", "run", "walk-dropfoot-afo-short", "--no-change", "--no-rrd"),
            *("--set", "duration=4 s", "--out", str(tmp_path / "run")),
        ],
        env=os.environ | {"PYTHONIOENCODING": "ascii"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert "+ GOOD*     lift " in done.stdout and "x BAD       push-off " in done.stdout
    assert "N*m/kg" in done.stdout and "... " in done.stdout and done.stdout.isascii()
