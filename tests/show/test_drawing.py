"""The design picture: its words are the facts, they stand apart on the page, its views are to scale."""

import itertools
import pathlib
from typing import Any

import numpy as np
import pytest
from command import call
from figures import leave_blank
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import afo_sim as afo
from afo_sim.cli.doctor.kinds import check_file
from afo_sim.common import InputError
from afo_sim.model import Design, rows
from afo_sim.model.design import design
from afo_sim.model.path_facts import path_facts
from afo_sim.show import style
from afo_sim.show.drawing import PAGE, SIDE, page, table
from afo_sim.show.drawing_views import Pose, lever, parts, scale_of, stacked

ROOT = pathlib.Path(__file__).parents[2]
SMALLEST = 5.5  # letters [points]


def own_orthosis(folder: pathlib.Path) -> pathlib.Path:
    """An orthosis of long names, many unlike muscles, and guides."""
    text = (ROOT / "models/orthoses/s1/orthosis.toml").read_text(encoding="utf-8")
    for part in ("cuff", "plate"):
        text = text.replace(f'"{part}.xml"', f'"{ROOT / "models/orthoses/s1" / part}.xml"')
    text = text.replace("dorsiflexor", "front_of_the_shin_above_the_instep_$1")
    text = text.replace("$1", "one").replace('-1 cm"], spacing = "2.5 cm"', '-1 cm"], spacing = "4 cm"')
    text = text.replace('description = "S1', f'description = "{"a $brace$ that lifts " * 9}')
    link = 'link_length = "11.2 cm"'
    guide = '{ segment = "shank", from_joint = ["7 cm", "0 cm", "9 cm"], spacing = "3 cm" }'
    assert link in text
    (folder / "orthosis.toml").write_text(text.replace(link, f"path = [{guide}]\n{link}"))
    return folder


@pytest.fixture(scope="module", params=["s1", "s1_short_links", "arm_s1", "arm", "own"])
def drawn(request: Any, tmp_path_factory: pytest.TempPathFactory) -> tuple[Design, Figure]:
    name = request.param
    found = design(own_orthosis(tmp_path_factory.mktemp("own")) if name == "own" else name)
    with rc_context(style.STYLE):
        figure = Figure(figsize=PAGE)
        FigureCanvasAgg(figure)
        page(figure, found)
        figure.canvas.draw()
    return found, figure


def words(figure: Figure) -> list[tuple[str, Any]]:
    """Every text that is shown, with its box [pixel]."""
    found = []
    for holder in (figure, *figure.axes):
        texts = list(holder.texts)
        if holder is not figure:
            texts += [holder.title, holder._left_title]  # type: ignore[union-attr]
            if holder.axison:  # type: ignore[union-attr]
                axes = (holder.xaxis, holder.yaxis)  # type: ignore[union-attr]
                texts += [axis.label for axis in axes]
                texts += [t for axis in axes for t in axis.get_ticklabels() if _in(axis, t)]
        found += [(t.get_text(), t) for t in texts if t.get_text().strip() and t.get_visible()]
    return [(text, t.get_window_extent()) for text, t in found]


def _in(axis: Any, label: Any) -> bool:
    low, high = sorted(axis.get_view_interval())
    x, y = label.get_position()
    value = x if axis.axis_name == "x" else y
    shown = axis.axis_name == "y" or axis.get_tick_params()["labelbottom"]
    return bool(shown) and low - 1e-9 <= value <= high + 1e-9


@pytest.mark.slow
def test_every_word_is_within_the_page(drawn: tuple[Design, Figure]) -> None:
    _, figure = drawn
    width, height = figure.canvas.get_width_height()  # type: ignore[attr-defined]
    found = words(figure)
    assert len(found) > 40
    for text, box in found:
        assert box.x0 >= 0 and box.y0 >= 0 and box.x1 <= width and box.y1 <= height, text


def test_no_two_words_lie_on_each_other(drawn: tuple[Design, Figure]) -> None:
    found = [(text, box.padded(-0.5)) for text, box in words(drawn[1])]
    for (one, a), (other, b) in itertools.combinations(found, 2):
        assert not a.overlaps(b), (one, other)


def test_no_letter_is_too_small_to_read(drawn: tuple[Design, Figure]) -> None:
    for holder in (drawn[1], *drawn[1].axes):
        for text in holder.texts:
            assert text.get_fontsize() >= SMALLEST, text.get_text()


def test_the_table_tells_the_facts(drawn: tuple[Design, Figure]) -> None:
    found, figure = drawn
    shown = {text for text, _ in words(figure)}
    head, lines = table(found)
    assert len(lines) == len(found.facts)
    for line in lines:
        assert set(line) <= shown
    for entry, line in zip(found.facts, lines, strict=True):
        cells = dict(zip(head, line, strict=True))
        own = next(cells[title] for title in head if title.startswith("own contraction"))
        low, high = (float(part.replace("−", "-")) for part in own.split(" to "))
        within = entry.own[entry.inside, -1]
        assert (low, high) == pytest.approx((within.min(), within.max()), abs=6e-4)
        if entry.group.pulley is None:
            assert float(cells["path at\n0 deg [mm]"]) == pytest.approx(
                1e3 * entry.length[entry.at(0.0)], abs=0.51
            )
        peak = cells[head[-1]].split(" N·m")[0].replace("−", "-")
        assert float(peak) == pytest.approx(entry.peak()[0], abs=0.051)


def test_kinds_of_sources_are_marked() -> None:
    _, ((*_, link, slack, cable), *_) = table(design("s1"))[0], [r[:6] for r in table(design("s1"))[1]]
    assert (link, slack, cable) == ("112", "0", "100 (a)")  # of its link no source is told


@pytest.mark.slow
def test_check_tells_the_numbers_of_the_picture() -> None:
    told = check_file(ROOT / "models/orthoses/s1/orthosis.toml")
    found = design("s1")
    for entry in found.facts:
        for row in rows(entry):
            assert row in told
    assert told == check_file(pathlib.Path("s1"))
    assert [text for what, text in told if what == "warning"][: len(found.warnings)] == found.warnings
    _, lines = table(found)
    texts = " | ".join(text for _, text in told)
    for line in lines:
        for cell in line[6:]:
            assert cell in texts


def test_the_side_view_is_to_scale() -> None:
    """A distance of the model is drawn 1/ratio as long on the page."""
    found = design("s1")
    with rc_context(style.STYLE):
        figure = Figure(figsize=PAGE)
        page(figure, found)
    axis = figure.axes[0]
    ratio = scale_of(found, SIDE).ratio
    inches = np.diff(axis.transData.transform([[0.0, 0.0], [0.1, 0.1]]), axis=0)[0] / figure.dpi
    assert inches * 0.0254 * ratio == pytest.approx([0.1, 0.1])
    assert f"1:{ratio:g} on A4" in axis.get_title(loc="left")
    assert pytest.approx((0.297, 0.210)) == np.array(PAGE) * 0.0254


def test_everything_that_is_drawn_of_the_leg_is_within_its_view(drawn: tuple[Design, Figure]) -> None:
    axis = drawn[1].axes[0]
    for patch in axis.patches:
        box = patch.get_window_extent()
        assert axis.bbox.x0 - 1 <= box.x0 and box.x1 <= axis.bbox.x1 + 1
        assert axis.bbox.y0 - 1 <= box.y0 and box.y1 <= axis.bbox.y1 + 1


def test_outlines_are_those_of_the_shapes() -> None:
    pose = Pose.at(afo.build("seated"), 0.0)
    knee, box = (pose.outline(pose.model.geom(name).id) for name in ("knee", "forefoot"))
    assert np.linalg.norm(knee - [0.0, 0.431], axis=1) == pytest.approx(np.full(72, 0.055))
    assert [*box.min(axis=0), *box.max(axis=0)] == pytest.approx([0.09, -0.065, 0.12, -0.041])
    turned = Pose.at(afo.build("seated"), np.radians(20.0))
    before, after = (p.outlines()["foot"][0].mean(axis=0) for p in (pose, turned))
    turn = np.array([[np.cos(0.349066), -np.sin(0.349066)], [np.sin(0.349066), np.cos(0.349066)]])
    assert after == pytest.approx(turn @ before, abs=2e-4)  # toe up is towards +z ahead


def test_the_drawn_lever_is_the_moment_arm() -> None:
    built = afo.build("seated")
    pose = Pose.at(built, 0.0)
    for entry in path_facts(built):
        arm = lever(pose, entry)
        path = pose.flat(pose.path(entry.muscles[0]))
        assert np.linalg.norm(arm) == pytest.approx(abs(entry.arm[entry.at(0.0)]), abs=1e-9)
        assert arm @ (path[-1] - path[0]) == pytest.approx(0.0, abs=1e-12)


def test_parts_of_a_muscle_fill_its_path() -> None:
    group = afo.load("orthosis", "s1").muscle["dorsiflexor"]
    found = parts(group, 0.215, 0.31)
    assert [kind for kind, *_ in found] == ["fitting", "braid", "fitting", "cable"]
    lengths = {kind: end - start for kind, start, end in found}
    assert lengths["braid"] == pytest.approx(group.type.nominal_length)
    assert lengths["cable"] == pytest.approx(0.31 - 0.215)
    assert found[0][1] == 0.0 and found[-1][2] == 0.31


def test_stacked_labels_keep_their_order_and_their_room() -> None:
    tops = stacked([0.9, 0.88, 0.2, 0.1], [0.2, 0.1, 0.3, 0.2], 1.0, 0.0)
    for k in range(3):
        assert tops[k] - [0.2, 0.1, 0.3][k] >= tops[k + 1] - 1e-12
    assert tops[0] <= 1.0 and tops[3] - 0.2 >= -1e-12


def test_the_viewers_file_holds_the_facts(tmp_path: pathlib.Path) -> None:
    from rerun_files import read

    found = afo.draw("s1", tmp_path / "s1.rrd")
    assert (tmp_path / "s1.rrd").read_bytes()[-64:].count(b"RRF2FOOT") == 1
    entry = found.facts[0]
    time, values = read(tmp_path / "s1.rrd", "/torque/dorsiflexor/4_bar", "Scalars:scalars")
    assert len(time) == 81  # whole degrees from −50 to 30
    degrees = -50.0 + 10.0 * time * 1e-9
    expected = np.interp(np.radians(degrees), entry.angles, entry.torque[:, -1])
    assert values[:, 0] == pytest.approx(expected, abs=1e-9)


@pytest.mark.slow
def test_the_command_writes_all_that_is_asked_for(
    tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    leave_blank(monkeypatch)
    code, printed, said = call(
        capsys, "draw", "s1", "--out", "a.png", "--out", "sub/b.pdf", "--pressure", "3 bar"
    )
    assert code == 0, said
    assert {p.name for p in tmp_path.rglob("*") if p.is_file()} == {"a.png", "b.pdf"}
    assert "plantarflexor_1 passes" in printed
    code, _, said = call(capsys, "draw", "s1", "--out", "c.pdf", "--out", "a.png")
    assert (code, "is there already" in said, "--force" in said) == (2, True, True)
    assert not (tmp_path / "c.pdf").exists()
    code, printed, _ = call(capsys, "draw", "s1", "--out", "a.png", "--force")
    assert code == 0
    code, _, said = call(capsys, "draw", "seated")
    assert code == 0 and (tmp_path / "s1-design.pdf").is_file()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["s1", "--out", "a.docx"], ".png, .pdf, .svg, .rrd"),
        (["s1", "--out", "."], "not a format"),
        (["s1", "--pressure", "4 m"], "does not convert"),
        (["s1", "--pressure", "0 bar"], "above 0, to 20 bar"),
        (["s_1"], "did you mean 's1'"),
        (["none"], "has no muscle"),
        (["s1", "--leg", "adlut_75kg"], "did you mean 'adult_75kg'"),
        (["s1", "--out", "/proc/nowhere/a.pdf"], "cannot be written to"),
        (["s1", "--view", "airy"], "did you mean 'air'"),
        (["s1", "--view", "air", "--out", "a.rrd"], ".png, .pdf, .svg"),
        (["s1", "--view", "air", "--leg", "adult_75kg"], "has no effect"),
        (["none", "--view", "air"], "has no muscle"),
        (["s_1", "--view", "air"], "did you mean 's1'"),
    ],
)
def test_wrong_input_is_told_and_nothing_is_written(
    arguments: list[str],
    says: str,
    tmp_path: pathlib.Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    code, _, said = call(capsys, "draw", *arguments)
    assert code == 2
    assert says in said
    assert not list(tmp_path.iterdir())


def test_an_orthosis_object_is_drawn_and_an_unknown_file_is_refused(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    leave_blank(monkeypatch)
    orthosis = afo.load("orthosis", "s1", {"muscle.dorsiflexor.slack": "3 mm"})
    found = afo.draw(orthosis, tmp_path / "a.pdf")
    assert found.facts[0].group.slack == pytest.approx(0.003)
    (tmp_path / "empty.toml").write_text("")
    (tmp_path / "binary.toml").write_bytes(bytes(range(256)))
    for name in ("empty.toml", "binary.toml", "nowhere.toml"):
        with pytest.raises(InputError):
            afo.draw(tmp_path / name)
    with pytest.raises(InputError, match="is not a valid view"):
        afo.draw("s1", view="water")  # type: ignore[call-overload]
