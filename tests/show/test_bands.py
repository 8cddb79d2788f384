"""Bands on the terminal, in the viewer and in the report: what they say, and that it is what was found."""

import dataclasses
import html
import json
import pathlib
import re
from typing import Any

import pytest
from matplotlib.figure import Figure

from afo_sim.cli.printed_run import print_run
from afo_sim.metrics import NO_RATE, worth
from afo_sim.show import RunView, bands, panels, report_figures, verdict_texts
from afo_sim.show.panels import UNKNOWN_LABEL
from afo_sim.show.report import page
from afo_sim.show.run_view import alone
from afo_sim.simulation import Recording

DRAWS = 120


def changed(studied: Recording, **facts: Any) -> Recording:
    study = studied.studies["uncertainty"] | facts
    return dataclasses.replace(studied, studies={"uncertainty": study})


def numbers(line: str) -> list[float]:
    return [float(x.replace("−", "-")) for x in re.findall(r"−?\d+\.?\d*", line)]


def test_the_terminal_has_clearance_trips_and_what_to_measure(studied: Recording) -> None:
    study = studied.studies["uncertainty"]
    lines = bands.lines(studied)
    assert len(lines) <= 6 and f"{DRAWS} draws" in lines[0]
    clearance = next(line for line in lines if "toe clearance" in line)
    own, low, _, high = (
        study["metrics"]["toe_clearance"]["own"],
        *study["metrics"]["toe_clearance"]["quantiles"],
    )
    told = numbers(clearance)
    assert told[0] == pytest.approx(own, abs=0.05)
    assert (told[-2], told[-1]) == pytest.approx((low, high), abs=0.5)
    trips = next(line for line in lines if "trip" in line)
    share = study["trips"]["touch"]["share"]
    assert numbers(trips)[:3] == pytest.approx([DRAWS, DRAWS * share, 100.0 * share], abs=0.5)
    measure = next(line for line in lines if "measure next" in line)
    assert [name.replace("_", " ") in measure for name in study["measure_next"]] == [True] * 3


def test_what_to_measure_is_told_with_what_it_leaves(studied: Recording) -> None:
    study = studied.studies["uncertainty"]
    groups = {group["name"]: group for group in study["groups"]}
    left = [groups[name] for name in study["measure_next"]]
    told = numbers(bands.brief(studied)[-1])
    n, whole = len(left), 100.0 * study["wrong"]
    assert told[:n] == pytest.approx([100.0 * group["band_left"]["toe_clearance"] for group in left], abs=0.5)
    expected = [*(100.0 * group["wrong_left"] for group in left), whole]
    assert told[n:] == pytest.approx(expected, abs=0.5)
    older = [{k: v for k, v in group.items() if "left" not in k} for group in study["groups"]]
    names = ", ".join(name.replace("_", " ") for name in study["measure_next"])
    without = {key: value for key, value in study.items() if "wrong" not in key} | {"groups": older}
    assert bands.brief(dataclasses.replace(studied, studies={"uncertainty": without}))[-1].endswith(names)


def test_in_short_the_bands_are_those_of_the_whole(studied: Recording) -> None:
    study = studied.studies["uncertainty"]
    bands_line, measure = bands.brief(studied)
    assert numbers(bands_line)[:2] == [5.0, 95.0] and measure in [
        line.strip() for line in bands.lines(studied)
    ]
    for name, words in (("toe_clearance", "toe clearance"), ("air_per_stride", "air")):
        low, _, high = study["metrics"][name]["quantiles"]
        (part,) = [each for each in re.split(r"[:;] ", bands_line) if each.startswith(words)]
        assert numbers(part) == pytest.approx([low, high], abs=0.5 if words != "air" else 5e-4)
    assert "trip" in bands_line


def test_in_short_the_draws_that_a_band_lacks_are_counted(studied: Recording) -> None:
    study = studied.studies["uncertainty"]
    clearance = study["metrics"]["toe_clearance"] | {"undefined": 9}
    lacking = changed(studied, metrics=study["metrics"] | {"toe_clearance": clearance}, draws=200)
    failed = changed(lacking, failed={"count": 3, "reasons": [{"count": 3, "reason": "it fell"}]})
    short = " ".join(bands.brief(failed))
    assert "undefined in 9 draws" in short and "3 of 200 draws failed" in short


def test_no_trip_among_few_draws_is_not_told_as_none_at_all(studied: Recording) -> None:
    trips = studied.studies["uncertainty"]["trips"]
    dry = trips | {"touch": trips["touch"] | {"share": 0.0}}
    for draws, at_most in ((20, 0.139), (500, 0.006)):  # 1 - 0.05^(1/n), where chance hides it once in 20
        [told] = [x for x in bands.lines(changed(studied, trips=dry, draws=draws)) if "trip" in x]
        assert numbers(told)[1] == pytest.approx(100.0 * at_most, rel=0.04)
        assert "none trips" in told


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("share", [0.0, 0.09])
def test_draws_give_trips_no_confidence_and_numbers_stand_beside_what_was_measured(
    studied: Recording, share: float, tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trips = studied.studies["uncertainty"]["trips"]
    run = changed(studied, draws=200, trips=trips | {"touch": trips["touch"] | {"share": share}})
    told = worth(run.metrics)
    places = [page([alone(run)]), bands.markdown(run) + verdict_texts.markdown(run)]
    for whole in (False, True):
        print_run(run, tmp_path, numbers=whole)
        places.append(capsys.readouterr().out)
    for place in places:
        text = " ".join(html.unescape(place).split())
        assert "confidence" not in place
        assert told in text and NO_RATE in text, text
    assert told and "confidence" not in json.dumps(run.summary()["verdict"])


def test_nothing_is_told_where_nothing_was_drawn(studied: Recording) -> None:
    plain = dataclasses.replace(studied, studies={})
    assert bands.lines(plain) == [] and bands.markdown(plain) == "" and bands.of_report([]) == []


def test_bands_of_which_many_draws_failed_say_so_first(studied: Recording) -> None:
    failed = {"count": 30, "draws": [], "reasons": [{"reason": "unstable: it fell", "count": 30}]}
    lines = bands.lines(changed(studied, failed=failed))
    assert f"30 of {DRAWS} draws failed" in lines[0] and "it fell" in lines[0] and len(lines) <= 6
    few = failed | {"count": 2}
    lines = bands.lines(changed(studied, failed=few))
    assert "failed" not in lines[0] and any(f"2 of {DRAWS} draws failed" in line for line in lines)
    assert f"30 of {DRAWS}" in bands.markdown(changed(studied, failed=failed))


def test_numbers_that_some_draws_do_not_have_are_told(studied: Recording) -> None:
    metrics = studied.studies["uncertainty"]["metrics"]
    short = metrics | {"toe_clearance": metrics["toe_clearance"] | {"undefined": 12}}
    told = "Toe clearance is undefined in 12 draws"
    assert any(told in line for line in bands.lines(changed(studied, metrics=short)))
    assert not any("is undefined in" in line for line in bands.lines(changed(studied, metrics=metrics)))


def test_all_draws_failed_is_told(studied: Recording) -> None:
    failed = {"count": DRAWS, "draws": [], "reasons": [{"reason": "unstable: it fell", "count": DRAWS}]}
    empty: dict[str, Any] = {"metrics": {}, "curves": {}, "trips": {}, "groups": [], "measure_next": []}
    lines = bands.lines(changed(studied, failed=failed, **empty))
    assert f"{DRAWS} of {DRAWS} draws failed" in lines[0]


def test_the_viewer_has_a_row_for_each_number(studied: Recording) -> None:
    text = bands.markdown(studied)
    rows = [line for line in text.splitlines() if line.startswith("| ")]
    assert len(rows) == len(studied.studies["uncertainty"]["metrics"]) + 1


@pytest.mark.usefixtures("undrawn")
def test_the_report_has_table_bars_and_bands_of_curves(studied: Recording) -> None:
    plain = alone(dataclasses.replace(studied, studies={}))
    both = [RunView("with", "#1054DA", studied), dataclasses.replace(plain, label="without")]
    with_bands, without = page(both), page([plain])
    assert "<h2>Uncertainty</h2>" in with_bands and "<h2>Uncertainty</h2>" not in without
    for runs, count in ((both[:1], 2), (both[1:], 0)):
        figures = [Figure(), Figure()]
        report_figures.draw_walk(figures, runs)
        assert sum(UNKNOWN_LABEL in panels.keys(figure.axes) for figure in figures) == count
    assert "no calf cuff was measured" in with_bands  # the source of a spread
    for name, *_ in bands.of_report(both[:1])[0]["bars"]:
        assert name in with_bands
    assert with_bands.count("What the bands come from") == 1


@pytest.mark.usefixtures("undrawn")
def test_a_name_from_a_file_cannot_break_the_page(studied: Recording) -> None:
    study = studied.studies["uncertainty"]
    groups = [study["groups"][0] | {"measure": "<script>alert(1)</script>"}, *study["groups"][1:]]
    assert "<script>" not in page([alone(changed(studied, groups=groups))])


@pytest.mark.parametrize(("share", "told"), [(1.0, "100 %"), (0.38, "38 %"), (0.085, "8.5 %")])
def test_answer_and_band_tell_the_same_share_of_trips(studied: Recording, share: float, told: str) -> None:
    touch = {"height": 0.0, "share": share, "of_one": [0.0, 0.0, 1.0]}
    run = changed(studied, trips={"touch": touch, "within_10mm": touch | {"height": 0.01}})
    answer = run.verdict[1].text
    assert f"({told}) touch the floor" in answer
    assert any(f"({told}) trip" in line for line in bands.lines(run))
