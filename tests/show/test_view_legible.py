"""The viewer: colours that are told apart, words that fit, the answer first."""

import itertools
import pathlib
from collections.abc import Iterator
from typing import Any

import pytest
import rerun.blueprint as rrb
from colour_vision import contrast, nearest

import afo_sim
from afo_sim.metrics import words
from afo_sim.simulation import Recording

SCENARIOS = ("seated", "arm-s1", "arm", "walk-dropfoot-afo", "walk-healthy")
APART = {"all cones": 0.12, "no green": 0.08, "no red": 0.08}  # least distances in OKLab


@pytest.fixture(scope="module")
def runs(walks: dict[str, Recording]) -> dict[str, Recording]:
    known = {"seated": walks["sitting"], "walk-dropfoot-afo": walks["worn"]}
    return {name: known.get(name) or afo_sim.run(name, {"duration": "2 s"}) for name in SCENARIOS}


@pytest.mark.parametrize("name", SCENARIOS)
def test_no_two_lines_of_one_plot_are_alike(name: str, runs: dict[str, Recording]) -> None:
    from afo_sim.show.rerun.curves import curves, plots_of
    from afo_sim.show.rerun.run_rows import from_recording

    plots = plots_of(curves(from_recording(runs[name])))
    assert len(plots) >= 3
    for plot, lines in plots.items():
        if len(lines) < 2:
            continue
        for vision in APART:
            assert nearest([line.colour for line in lines], vision) >= APART[vision], (plot, vision)


def test_runs_are_told_apart_from_one_another_and_from_the_healthy_foot() -> None:
    from afo_sim.show.rerun import colours

    for level in (colours.FLOOR, colours.RANGE):
        for vision in APART:
            assert nearest([*colours.RUNS, colours.HEALTHY, level], vision) >= APART[vision]


def test_all_colours_stand_out_from_the_ground_and_have_a_word() -> None:
    from afo_sim.show.rerun import colours

    assert all(contrast(colour, colours.DARK) >= 3.0 for colour in colours.WORDS)
    for palette in (colours.DORSIFLEXOR, colours.PLANTARFLEXOR, colours.RUNS, colours.MOMENTS.values()):
        assert len({colours.WORDS[tuple(colour)] for colour in palette}) == len(palette)


def test_compared_runs_have_one_line_each_in_a_plot(runs: dict[str, Recording]) -> None:
    from afo_sim.show.rerun.curves import compared_curves, plots_of
    from afo_sim.show.rerun.run_rows import from_recording

    sources = [from_recording(runs[name]) for name in ("walk-dropfoot-afo", "walk-healthy")]
    lines = [compared_curves(source, f"run {k}", k, recorded=k == 0) for k, source in enumerate(sources)]
    for plot, drawn in plots_of(list(itertools.chain(*lines))).items():
        assert len({line.name for line in drawn}) == len(drawn), plot
        assert len({tuple(line.colour) for line in drawn}) == len(drawn), plot


def plots_in(view: Any) -> Iterator[Any]:
    """The plots below a container of the layout."""
    from rerun.blueprint.api import Container

    if isinstance(view, rrb.TimeSeriesView):
        yield view
    for below in getattr(view, "contents", ()) if isinstance(view, Container) else ():
        yield from plots_in(below)


@pytest.mark.parametrize("name", SCENARIOS)
def test_titles_tell_the_lines_and_no_legend_lies_on_them(name: str, runs: dict[str, Recording]) -> None:
    from afo_sim.show.rerun import colours
    from afo_sim.show.rerun.curves import curves, plots_of
    from afo_sim.show.rerun.layout import TITLE, blueprint
    from afo_sim.show.rerun.recording_file import RunScene, contents
    from afo_sim.show.rerun.run_rows import from_recording
    from afo_sim.show.rerun.scene import stage
    from afo_sim.show.rerun.walk_scene import Walker, carriage

    source = from_recording(runs[name])
    walker = Walker(stage(source), source, carriage(source)) if source.walks else None
    found = contents([RunScene(source, stage(source), curves(source), walker)])
    views = {view.origin: view for view in plots_in(blueprint(found).root_container)}
    for plot, lines in plots_of(curves(source)).items():
        title = str(views[plot].name)
        assert all(colours.WORDS[tuple(line.colour)] in title for line in lines), title
        assert all(line.name.split(", ")[0] in title for line in lines)
        assert len(title) <= TITLE


def test_words_stand_only_where_they_fit() -> None:
    """75 letters and more along a lane: 4 letters want an interval of a fifteenth of it."""
    from afo_sim.show.rerun.events import BLANK, _fitting

    changes = [(0.0, "shut"), (1.0, "open"), (2.0, "shut"), (6.0, "open"), (8.0, "shut")]
    assert _fitting(["open", "shut"], changes, 10.0) == ["open", BLANK]
    short = [(0.0, "shut"), (1.0, "open"), (1.4, "shut"), (6.0, "open"), (8.0, "shut")]
    assert _fitting(["open", "shut"], short, 10.0) == [BLANK, BLANK]
    strides = [(float(k), f"stride {k + 1}") for k in range(20)]
    assert _fitting([name for _, name in strides], strides, 20.0)[4] == "5"
    few = [(0.0, "stride 1"), (1.0, "stride 2, settled"), (2.0, "stride 3, settled")]
    assert _fitting([name for _, name in few], few, 3.0)[1] == "stride 2, settled"


def test_metrics_are_told_in_peoples_words_and_units(runs: dict[str, Recording]) -> None:
    from afo_sim.show.rerun import texts
    from afo_sim.show.rerun.run_rows import from_recording

    run = runs["walk-dropfoot-afo"]
    table = "\n".join(texts._metrics([("a", from_recording(run))]))
    for name in ("toe_clearance", "mid_swing_angle", "air_per_stride"):
        assert f"| {words(name).label} |" in table
        assert f"| {name} |" not in table
    assert "| N·m |" in table and "N*m" not in table
    assert f"| {run.metrics['toe_clearance'].value:.1f} | mm |".replace("-", "−") in table


def test_the_answer_stands_first_where_there_is_one(
    runs: dict[str, Recording], tmp_path: pathlib.Path
) -> None:
    import rerun as rr

    from afo_sim.show.rerun import texts, write_comparison
    from afo_sim.show.rerun.run_rows import from_recording

    answered = from_recording(runs["walk-dropfoot-afo"])
    said = texts.answer([("a", answered)])
    assert said.count("Does it") >= 2
    assert texts.answer([("a", from_recording(runs["seated"]))]) == ""
    assert texts.answer([("a", answered), ("b", answered)]).count(said) == 2
    folder = runs["walk-dropfoot-afo"].save(tmp_path / "a")
    chosen = folder / "recording.rrd"
    chunks = rr.chunk.RrdReader(str(chosen)).stream().filter(content="/answer").to_chunks()
    (document,) = (chunk.to_record_batch().column("TextDocument:text").to_pylist() for chunk in chunks)
    assert document == [[said]]
    write_comparison([folder, folder], tmp_path / "both.rrd")


def test_moments_move_into_a_tab_where_the_answer_takes_their_place() -> None:
    from afo_sim.show.rerun.layout import Contents, _tabs

    tabs = [_tabs(Contents(2, 1.0, answer=answer))[0].contents for answer in (False, True)]
    names = [[view.name for view in views] for views in tabs]
    assert "moment" not in names[0]
    assert names[1][0] == "moment"
