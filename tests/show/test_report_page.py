"""The report as a page: read on a telephone, on paper, by ear, and without colours."""

import html
import itertools
import pathlib
import re

import pytest
from colour_vision import contrast
from pages import Page

from afo_sim.show import STYLE, WIDTH, headed
from afo_sim.show.report import page, read_runs

POINT = 96.0 / 72.0  # [CSS pixel]
NARROW = 400  # width of a telephone's page [CSS pixel]


@pytest.fixture(scope="module")
def text(folders: dict[str, pathlib.Path]) -> str:
    return page(read_runs(list(folders.values())))


@pytest.mark.slow
def test_every_table_scrolls_in_a_named_box_and_has_heads(text: str) -> None:
    seen = Page(text).seen
    tables = [about for tag, _, about in seen if tag == "table"]
    assert len(tables) >= 3
    for about in tables:
        box = next(found for tag, found in reversed(about) if tag == "div")
        assert "scroll" in box["class"].split()
        assert (box["role"], box["tabindex"]) == ("region", "0")
        assert box["aria-label"]
    assert text.count("<thead>") == len(tables)
    for found in (found for tag, found, _ in seen if tag == "th"):
        assert found.get("scope") in ("col", "row", "rowgroup"), found


def test_headings_go_down_one_step_at_a_time(text: str) -> None:
    levels = [int(tag[1]) for tag, _, _ in Page(text).seen if re.fullmatch(r"h[1-6]", tag)]
    assert levels[0] == 1 and levels.count(1) == 1
    assert all(after - before <= 1 for before, after in itertools.pairwise(levels))


def test_every_figure_tells_what_it_shows(text: str) -> None:
    panels = re.findall(r"<svg role.*?</svg>", text, flags=re.DOTALL)
    assert len(panels) == 2 + 2 + 2 + 1 + 1 + 2 + 2 + 2 + 1 + 1
    for panel in panels:
        names = re.search(r'aria-labelledby="(\S+) (\S+)"', panel)
        assert names
        assert re.search(rf'<title id="{names[1]}">[^<]+</title>', panel)
        assert re.search(rf'<desc id="{names[2]}">', panel)
    angle = next(panel for panel in panels if "ankle angle" in panel)
    assert re.search(r"drop foot −\d.* to \d", html.unescape(angle))
    assert '<html lang="en">' in text


def test_letters_of_figures_are_large_enough_on_a_telephone() -> None:
    """A panel takes the page's whole width, less the margins of 12 pixels."""
    scale = (NARROW - 24) / (72.0 * WIDTH)  # CSS pixels for a point of the figure
    smallest = min(size for name, size in STYLE.items() if name.endswith("size"))
    assert scale >= POINT, "a panel is not drawn smaller than it is"
    assert smallest * scale >= 11.0


def test_all_text_has_contrast_enough(text: str) -> None:
    """Each colour of text in the style sheets, on white and on the grounds that the page has."""
    sheets = " ".join(re.findall(r"<style>(.*?)</style>", text, flags=re.DOTALL))
    inks = set(re.findall(r"[{;]\s*color:\s*(#[0-9a-f]{3,6})", sheets))
    grounds = set(re.findall(r"background:\s*(#[0-9a-f]{3,6})", sheets))
    assert {"#222", "#444", "#555"} <= inks and {"#f3f3f3", "#fff6df"} <= grounds
    for ink in inks:
        assert contrast(ink) >= 4.5, ink
    for ground in grounds:
        assert contrast("#222", ground) >= 4.5, ground
    assert contrast("#555", "#f3f3f3") >= 4.5


def test_letters_in_figures_have_contrast_enough(text: str) -> None:
    """Matplotlib draws letters as paths in groups named text_…; their fill is black where none is told."""
    fills = re.findall(r'<g id="[^"]*text_\d+">\s*<g (?:style="fill: (#[0-9a-f]{6}))?', text)
    assert len(fills) > 50
    for colour in {fill for fill in fills if fill}:
        assert contrast(colour) >= 4.5 or contrast(colour, "#f3dede") >= 4.5, colour


def test_paper_repeats_heads_and_parts_no_row(text: str) -> None:
    for rule in (
        "@page { size: A4",
        "thead { display: table-header-group; }",
        "tr { break-inside: avoid; }",
        "details:not([open]) { display: none; }",
    ):
        assert rule in text
    assert "A part that is closed on the page is not printed" in text


def test_a_note_keeps_every_word_behind_its_head() -> None:
    for note in (
        "the cuff gives: run half and double",
        "no clause",
        "a (b, c) d, e",
        f"{'long ' * 30}(x) y",
        f"short ({'long ' * 30}), y",
    ):
        head, rest = headed(note)
        assert (head + rest).lower() == note.lower()
    assert headed("a (b, c) d, e") == ("A (b, c) d", ", e")
    assert headed(f"short ({'long ' * 30}), y")[0] == "Short"
    assert headed(f"{'long ' * 30}, y")[0] == ""
