"""The report: one file that needs nothing else, says what was run, and compares."""

import dataclasses
import pathlib
import re
import shutil
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from command import call
from pages import Page
from synthetic_walk import AMPLITUDE, MASS, STEP, TOE_OFF, walk_columns, with_orthosis

import afo_sim
from afo_sim.common import InputError, assets
from afo_sim.description import body_mass, facts
from afo_sim.description.scenario_text import reference
from afo_sim.metrics import Metric, in_short, lift, number, walk_metrics, words
from afo_sim.metrics.metric_words import OTHER
from afo_sim.show import RUNS, RunView, report_figures, write_report
from afo_sim.show.report import page, read_runs, remarks
from afo_sim.show.run_view import PHASE
from afo_sim.show.style import plain
from afo_sim.simulation import Recording


@pytest.fixture(scope="module")
def compared(folders: dict[str, pathlib.Path]) -> str:
    return page(read_runs([folders["bare"], folders["worn"]]))


def shown(label: str = "run", columns: dict[str, np.ndarray] | None = None) -> RunView:
    """A written-down walk as a run of a known body mass."""
    recorded = afo_sim.load("scenario", "walk-dropfoot", {}).resolved()
    recorded["leg"]["body_mass"] = f"{MASS} kg"
    columns = walk_columns() if columns is None else columns
    found = walk_metrics(columns, STEP, MASS)
    recording = Recording(columns, found.totals, recorded, "", "ok", (), {}, {}, {}, found.strides)
    return RunView(label, RUNS[0], recording)


# --- one file, nothing else


@pytest.mark.slow
def test_the_page_refers_to_nothing_outside_itself(compared: str) -> None:
    reader = Page(compared)
    assert reader.open == []
    for tag, name, value in reader.attributes:
        assert tag not in ("script", "link", "img", "iframe", "object", "base"), tag
        if name in ("src", "href", "xlink:href", "srcset", "data", "action"):
            assert value.startswith("#"), (tag, name, value)
        assert not name.startswith("on"), (tag, name)
        for place in re.findall(r"url\(([^)]*)\)", value):
            assert place.startswith("#")
    assert "@import" not in compared
    assert not re.search(r"url\((?!#)", compared)


def test_figures_are_well_formed_and_every_reference_within_them_is_met(compared: str) -> None:
    figures = re.findall(r"<svg.*?</svg>", compared, flags=re.DOTALL)
    panels = [text for text in figures if 'class="key"' not in text]
    assert len(panels) == 2 + 2 + 2 + 1 + 1 + 2 + 2  # walkers, walk, moment, air, muscles, torque, work
    seen: set[str] = set()
    for text in figures:
        tree = ElementTree.fromstring(text)
        ids = [e.get("id") for e in tree.iter() if e.get("id")]
        assert len(ids) == len(set(ids))
        assert not seen & set(ids), "ids of one figure are another's"
        seen |= set(ids)
        wanted = re.findall(r'(?:href="#|url\(#)([^")]*)', text)
        assert wanted or text not in panels
        assert set(wanted) <= set(ids)
        assert tree.get("viewBox")
        assert "width" not in tree.attrib


@pytest.mark.slow
def test_the_page_is_written_whole_or_not_at_all(
    folders: dict[str, pathlib.Path], tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "new" / "mine.html"
    assert write_report([folders["sitting"]], target) == target
    before = target.read_text(encoding="utf-8")

    def broken(*_: object) -> None:
        raise RuntimeError("drawing failed")

    monkeypatch.setattr(report_figures, "draw_over_time", broken)
    with pytest.raises(RuntimeError):
        write_report([folders["sitting"]], target)
    assert target.read_text(encoding="utf-8") == before
    assert [path.name for path in target.parent.iterdir()] == ["mine.html"]


@pytest.mark.slow
def test_the_same_runs_give_the_same_page(folders: dict[str, pathlib.Path], compared: str) -> None:
    assert page(read_runs([folders["bare"], folders["worn"]])) == compared


# --- what it says


def test_it_names_runs_words_numbers_units_warnings_and_sources(compared: str) -> None:
    text = Page(compared).text
    for said in (
        "Walking with a drop foot: no orthosis, S1's orthosis",
        "drop foot, with healthy tissue",
        "dorsiflexors 0 %",
        "filled 50–95 %, vented 15–45 % of the gait cycle",
        "4 bar (gauge)",
        "Toe clearance",
        "N·m",
        "J/kg",
        "Bovi",
        "typed from the article",
        "Fukuchi",
        "CC BY 4.0",
        "mujoco",
        "Whole internal ankle moment",
        "Torque needed and torque available",
    ):
        assert said in text, said


def test_differences_are_from_the_first_run(folders: dict[str, pathlib.Path], compared: str) -> None:
    bare, worn = (run.recording.metrics for run in read_runs([folders["bare"], folders["worn"]]))
    for name in ("toe_clearance", "mid_swing_angle"):
        row = next(row for row in compared.split("\n") if f">{words(name).label}<br>" in row)
        first, second = bare[name].value, worn[name].value
        unit = bare[name].unit
        assert f">{number(first, unit)}</td>" in row
        assert f">{number(second, unit)} <small>({number(second - first, unit, signed=True)})</small>" in row
    alone = next(row for row in compared.split("\n") if words("orthosis_peak_power").label in row)
    assert ">–</td>" in alone
    assert "<small>" not in alone


def test_every_metric_has_words_of_its_own(folders: dict[str, pathlib.Path]) -> None:
    names = {name for run in read_runs(list(folders.values())) for name in run.recording.metrics}
    assert not [name for name in names if words(name).group == OTHER]
    assert len(names) > 50
    assert words("something_new").label == "something new"


@pytest.mark.usefixtures("undrawn")
def test_an_undefined_number_is_left_out_with_its_reason(folders: dict[str, pathlib.Path]) -> None:
    (sitting,) = read_runs([folders["sitting"]])
    never = sitting.recording.metrics | {"rise_time": Metric(float("nan"), "s")}
    still = never | {"range_of_motion": Metric(3e-14, "deg")}
    runs = [dataclasses.replace(sitting, recording=dataclasses.replace(sitting.recording, metrics=still))]
    text = Page(page([*runs, sitting])).text
    assert "– (never rises)" in text
    assert "– (does not move)" in text
    assert "nan" not in text.lower().split()


@pytest.mark.slow
def test_a_sitting_run_has_its_curves_over_time(folders: dict[str, pathlib.Path]) -> None:
    text = page(read_runs([folders["sitting"]]))
    said = Page(text).text
    assert said.index("ankle angle") < said.index("Scenario")
    assert "over the gait cycle" not in said
    assert "knee at 90°" in said
    assert "Fukuchi" not in said
    assert "filled 0–4 s, vented 4–8 s of every 8 s" in said
    assert len(re.findall("<svg role", text)) == 4  # angle, moments, air, muscles


@pytest.mark.slow
def test_a_walk_without_a_whole_stride_is_shown_over_time(tmp_path: pathlib.Path) -> None:
    short = {"duration": "0.5 s", "gait.settled": "walked"}
    afo_sim.run("walk-dropfoot-afo", short).save(tmp_path, rrd=False)
    said = Page(page(read_runs([tmp_path]))).text
    assert said.index("ankle angle") < said.index("Scenario")
    assert "No whole stride follows the first" in said


def test_a_failed_run_says_so(folders: dict[str, pathlib.Path]) -> None:
    run = read_runs([folders["sitting"]])[0]
    columns = {name: column[:0] for name, column in run.recording.columns.items()}
    empty = dataclasses.replace(run.recording, columns=columns, metrics={}, status="failed: <unstable>")
    text = page([dataclasses.replace(run, recording=empty)])
    assert "failed: &lt;unstable&gt;" in text
    assert "<svg role" not in text


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_names_are_escaped_wherever_they_stand(
    folders: dict[str, pathlib.Path], tmp_path: pathlib.Path
) -> None:
    evil = '<b onclick="x">$\\frac & “_ż"'
    copies = [tmp_path / evil, tmp_path / "_second$"]
    for copy in copies:
        shutil.copytree(folders["worn"], copy)
    runs = read_runs(copies)
    scenario = runs[0].recording.described | {"description": "<i>words</i>", "name": "<script>"}
    recording = dataclasses.replace(runs[0].recording, described=scenario, warnings=("<u>careful</u>",))
    text = page([dataclasses.replace(runs[0], recording=recording), runs[1]])
    reader = Page(text)
    assert not [tag for tag, name, _ in reader.attributes if name == "onclick"]
    assert evil in reader.text
    assert not re.search(r"<(b|i|u|script)[ >]", text)
    assert "<u>careful</u>" in reader.text


def test_a_name_that_no_font_has_is_drawn_as_question_marks() -> None:
    assert plain("歩行_1$") == r"??_1\$"
    assert plain("_x") == " _x"
    assert len(plain("x" * 80)) == 34


# --- the figures draw what was recorded


def drawn_panels(draw: Callable[..., None], runs: list[RunView], count: int = 2) -> list[Any]:
    """The figures of a drawing's panels."""
    from matplotlib.figure import Figure

    figures = [Figure(figsize=(report_figures.WIDTH, 2.8), layout="constrained") for _ in range(count)]
    draw(figures, runs)
    return figures


def lines(
    draw: Callable[..., None], runs: list[RunView], panel: int, count: int = 2
) -> dict[str, np.ndarray]:
    """{label: ordinates} of the first axis in a drawing's panel."""
    axis = drawn_panels(draw, runs, count)[panel].axes[0]
    return {line.get_label(): line.get_ydata() for line in axis.lines}


def test_the_angle_is_drawn_over_the_gait_cycle() -> None:
    drawn = lines(report_figures.draw_walk, [shown()], 1)
    sine = np.degrees(AMPLITUDE) * np.sin(2.0 * np.pi * PHASE)
    assert drawn["run"] == pytest.approx(sine, abs=0.01)
    assert drawn["healthy adults, mean"] == pytest.approx(sine - 3.0, abs=0.01)


def test_the_norms_moment_lies_about_a_healthy_push_off() -> None:
    """Two means: 1.18 and 1.28 N·m/kg of plantarflexion at 45 % of the stride, drawn downwards."""
    band = drawn_panels(report_figures.draw_moment, [shown()])[0].axes[0].collections[0]
    assert band.get_label() == "norm: published means"
    corners = band.get_paths()[0].vertices
    at = np.unique(corners[np.isclose(corners[:, 0], 45.0), 1])
    assert at == pytest.approx([-1.28, -1.18])


def test_the_moment_is_all_that_is_internal_per_body_mass() -> None:
    columns = walk_columns()
    columns = with_orthosis(columns, np.full_like(columns["time"], 2.0))
    columns["ankle/moment/passive"] = columns["ankle/moment/passive"] - 5.0
    drawn = lines(report_figures.draw_moment, [shown(columns=columns)], 0)
    second = columns["gait/stride"] + columns["gait/phase"] - 1.0
    expected = np.interp(PHASE, second, columns["ankle/moment/biological"]) - 3.0
    assert drawn["run"] == pytest.approx(expected / MASS, abs=1e-4)


def test_clearance_and_torque_are_drawn_in_their_units() -> None:
    columns = walk_columns()
    run = shown(columns=with_orthosis(columns, np.full_like(columns["time"], 2.0)))
    drawn = lines(report_figures.draw_walk, [run], 0)
    swing = PHASE > TOE_OFF + 0.01
    assert drawn["run"][swing].min() == pytest.approx(10.0, abs=0.05)
    (axis,) = drawn_panels(report_figures.draw_walk, [run])[0].axes
    assert "10 mm" in [text.get_text() for text in axis.texts]  # the dot's number
    drawn = lines(report_figures.draw_torque, [run], 0, 1)
    assert drawn["available: run"] == pytest.approx(np.full(201, 2.0))
    assert lines(report_figures.draw_pressures, [run], 0, 1)["front"].max() == pytest.approx(3.0)


def test_numbers_of_clearances_that_are_alike_cover_neither_each_other_nor_a_curve() -> None:
    """Four runs within 3 mm: the numbers' boxes are apart, and no curve passes through one."""
    import itertools

    from matplotlib.backends.backend_agg import FigureCanvasAgg

    runs = []
    for higher in (0.0, 0.001, 0.002, 0.003):
        columns = walk_columns()
        columns |= {name: columns[name] + higher for name in ("toe/height", "sole/height", "ball/height")}
        runs.append(shown(f"{higher}", columns))
    figure = drawn_panels(report_figures.draw_walk, runs)[0]
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    axis = figure.axes[0]
    numbers = [text for text in axis.texts if text.get_text().endswith(" mm")]
    assert {text.get_text() for text in numbers} == {"10 mm", "11 mm", "12 mm", "13 mm"}
    boxes = [text.get_window_extent(canvas.get_renderer()) for text in numbers]
    assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))
    for line in axis.lines:
        if len(line.get_xdata()) == len(PHASE):
            path = line.get_transform().transform_path(line.get_path())
            assert not any(path.intersects_bbox(box, filled=False) for box in boxes), line.get_label()


def test_the_band_is_lowest_to_highest_stride() -> None:
    columns = walk_columns()
    columns["ankle/angle"] = columns["ankle/angle"] + np.radians(columns["gait/stride"])  # 1, 2, 3
    (axis,) = drawn_panels(report_figures.draw_walk, [shown(columns=columns)])[1].axes
    norm, band = axis.collections[:2]
    middle = band.get_paths()[0].vertices
    at_quarter = middle[np.isclose(middle[:, 0], 25.0), 1]
    assert np.ptp(at_quarter) == pytest.approx(2.0, abs=0.01)
    assert norm.get_label() == "norm: published means"


# --- words


def test_numbers_are_written_with_their_digits_and_a_true_minus() -> None:
    assert number(-12.345, "mm") == "−12.3"
    assert number(-0.04, "mm") == "0.0"
    assert number(3.0, "mm", signed=True) == "+3.0"
    assert number(-0.001, "mm", signed=True) == "0.0"
    assert number(float("nan"), "mm") == "–"
    assert number(12345.6, "furlong") == "1.235e+04"


def test_a_lift_is_told_over_whom() -> None:
    found = {"lift_over_reference": Metric(12.3, "mm"), "reference_toe_clearance": Metric(-20.0, "mm")}
    (said,) = lift(found, reference({"reference": "barefoot"}))
    assert (
        said == "the toe passes 12 mm higher than that of the same patient barefoot (20 mm below the floor)"
    )
    other = reference({"reference": "shoe", "shoe": {"name": "trainer"}})
    (said,) = lift(found | {"lift_over_reference": Metric(-12.3, "mm")}, other)
    assert "12 mm lower than that of the same patient in the shoe trainer, without orthosis" in said
    assert lift({}, other) == lift(found, "") == []


def dressed(label: str, changes: dict[str, object], outsole: bool = False) -> RunView:
    """The written-down walk in something."""
    run = shown(label)
    scenario = run.recording.described | changes
    if outsole:
        scenario["orthosis"] = scenario["orthosis"] | {"name": "s1", "outsole": {"heel_stack": "22 mm"}}
    return dataclasses.replace(run, recording=dataclasses.replace(run.recording, described=scenario))


def test_runs_that_wear_different_things_say_so() -> None:
    bare = dressed("bare", {})
    shod = dressed("shod", {"shoe": {"name": "trainer"}, "reference": "barefoot"})
    braced = dressed("braced", {"shoe": {"name": "trainer"}, "reference": "orthosis-off"}, outsole=True)
    assert remarks([bare, bare]) == remarks([shod]) == []
    (said,) = remarks([bare, shod])
    assert "bare: barefoot; shod: shoe trainer" in said
    worn, compared = remarks([shod, braced])
    assert "shod: shoe trainer; braced: outsole of s1" in worn
    assert (
        "shod: the same patient barefoot; braced: the same patient with the orthosis and no air" in compared
    )


def test_the_short_sentences_say_what_the_metrics_say() -> None:
    found = shown().recording.metrics | {"toe_clearance_to_recorded": Metric(-7.6, "mm")}
    said = " ".join(in_short(found))
    recorded = "that of this same foot with the recorded ankle angle of this walk"
    assert f"The toe passes 8 mm lower than {recorded}." in said
    assert f"ball of the foot passes 20 mm above the floor, as high as {recorded}" in said
    assert in_short({}) == []


def test_the_short_sentences_do_not_praise_what_covers_the_need_and_hinders_push_off() -> None:
    """The torque covered is told as a share of the need, and as nothing else."""
    said = " ".join(in_short({"torque_covered": Metric(100.0, "percent")}))
    assert "provides 100 % of the torque that this patient lacks" in said and "gives" not in said
    assert "does not show what it hinders" in said


def test_a_ball_that_is_the_lowest_point_is_not_told_twice() -> None:
    both = {f"{p}_clearance{e}": Metric(5.0, "mm") for p in ("toe", "ball") for e in ("", "_to_recorded")}
    assert "ball" not in " ".join(in_short(both))
    assert "ball" in " ".join(in_short(both | {"ball_clearance": Metric(6.0, "mm")}))


def test_the_scenario_is_told_in_words() -> None:
    scenario = afo_sim.load("scenario", "walk-dropfoot-afo-timer", {"gait.variability": 0.03}).resolved()
    told = dict(facts(scenario))
    assert told["valves, dorsiflexor"] == "filled 0.55–1.05 s, vented 0.16–0.5 s of every 1.1 s"
    assert "varied by 3 %" in told["walking"]
    assert body_mass(scenario) == 75.0
    scenario = afo_sim.load("scenario", "walk-healthy", {"patient.body_mass": "90 kg"}).resolved()
    assert body_mass(scenario) == 90.0
    assert dict(facts(scenario))["orthosis"] == "none"


# --- the command


@pytest.mark.usefixtures("undrawn")
def test_the_command_writes_beside_the_first_run(
    folders: dict[str, pathlib.Path], tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = tmp_path / "mine"
    shutil.copytree(folders["sitting"], copy)
    code, out, _ = call(capsys, "report", copy)
    assert code == 0
    assert str(copy / "report.html") in out
    words = "foot free in the air: dorsiflexors filled for 4 s, vented for 4 s (S1, Fig. 6) (2 changed)"
    assert words in (copy / "report.html").read_text(encoding="utf-8")


def test_runs_of_one_name_are_told_apart_by_their_folders(
    folders: dict[str, pathlib.Path], tmp_path: pathlib.Path
) -> None:
    copies = [tmp_path / "a" / "run", tmp_path / "b" / "run"]
    for copy in copies:
        shutil.copytree(folders["sitting"], copy)
    assert [run.label for run in read_runs(copies)] == [str(copy) for copy in copies]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere"], "there is no run here"),
        (["empty"], "empty: there is no run here"),
        (["sitting", "empty"], "empty: there is no run here"),
        (["sitting", "sitting"], "given twice"),
        (["sitting", "--out", "report.pdf"], "ending in .html"),
        (["sitting"] * 7, "too many"),
        ([], "missing argument"),
    ],
)
def test_mistakes_are_told_with_exit_code_2(
    folders: dict[str, pathlib.Path],
    arguments: list[str],
    said: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(folders["sitting"].parent)
    pathlib.Path("empty").mkdir(exist_ok=True)
    code, _, err = call(capsys, "report", *arguments)
    assert code == 2
    assert said.lower() in err.lower()
    assert "Traceback" not in err
    assert not list(pathlib.Path("empty").iterdir())


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_a_gait_that_has_vanished_is_told_once_and_the_report_is_whole(
    tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copy(assets.find_gait("gatk_stride2"), "mine.csv")
    walk = {"gait.cycle": "mine.csv", "duration": "2.5 s"}
    for name in ("a", "b"):
        afo_sim.run("walk-dropfoot", walk).save(tmp_path / name, rrd=False)
    assert call(capsys, "report", "a", "b")[::2] == (0, "")
    assert "GaitAnalysisToolKit" in pathlib.Path("a/report.html").read_text(encoding="utf-8")
    pathlib.Path("mine.csv").unlink()
    code, _, err = call(capsys, "report", "a", "b")
    assert code == 0
    assert err.startswith("note: the gait file mine.csv no longer exists")
    assert err.count("\n") == 1
    text = pathlib.Path("a/report.html").read_text(encoding="utf-8")
    assert Page(text).text.count("mine.csv no longer exists") == 1
    assert text.count("<svg role") == 6  # its curves are the recording's


def test_what_the_terminal_notes_stands_in_the_report(compared: str) -> None:
    """A derived path, a cuff that is assumed: each beside the run that it is of."""
    text = Page(compared).text
    assert text.count("ankle path is derived") == 1  # of both runs
    assert "cuff's compliance is assumed" in text


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_walking_beside_sitting_is_told_once(
    folders: dict[str, pathlib.Path], tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "both.html"
    code, _, err = call(capsys, "report", folders["sitting"], folders["worn"], "--out", out)
    assert code == 0
    note = "note: walking and non-walking runs: each kind has its own figures"
    assert [note in line for line in err.splitlines() if "note:" in line] == [True]  # beside it, progress
    shown = Page(out.read_text(encoding="utf-8")).text
    assert (
        shown.count("Walking and non-walking runs: each kind has its own figures") == 2
    )  # in short and in full
    assert "More over time" in shown and "More over the gait cycle" in shown
    said = call(capsys, "report", folders["bare"], folders["worn"], "--out", out)[2]
    note = "note: the runs wear different footwear"
    assert [note in line for line in said.splitlines() if "note:" in line] == [True]


def test_a_recording_of_another_making_is_refused(
    folders: dict[str, pathlib.Path], tmp_path: pathlib.Path
) -> None:
    (tmp_path / "recording.parquet").write_bytes(b"not a table")
    with pytest.raises(InputError, match="not a valid Parquet file"):
        write_report([tmp_path])


def test_what_the_runs_wear_differently_is_said_before_their_curves(compared: str) -> None:
    assert 0 < compared.index("wear different footwear") < compared.index('class="panels"')
