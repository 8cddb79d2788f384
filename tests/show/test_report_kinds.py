"""Reports of one, two and three walks with bands and effects, and of a seated run: words, layout, print."""

import dataclasses
import functools
import html
import importlib.util
import math
import pathlib
import re
import shutil
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from campaign import NIGHTLY, size

from afo_sim.metrics import Metric
from afo_sim.show.report import page, read_runs
from afo_sim.show.report_walkers import walkers
from afo_sim.show.run_names import apart
from afo_sim.show.run_view import alone
from afo_sim.show.walking_figure import DEVICE
from afo_sim.simulation import Recording

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
AXE = importlib.util.find_spec("axe_playwright_python")
browsed = pytest.mark.skipif(not (CHROMIUM and AXE), reason="no chromium or axe-playwright-python here")
KINDS = ("one", "two", "three", "seated")
WIDTHS = (400, 1280)  # of a telephone's and a desk's page [CSS pixel]


@pytest.fixture(scope="module")
def folders(
    walks: dict[str, Recording], studied: Recording, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, list[pathlib.Path]]:
    """The runs of each kind of report."""
    base = tmp_path_factory.mktemp("kinds")
    runs = {
        "bare_walk": walks["bare"],
        "worn_walk": studied,
        "short_walk": walks["short"],
        "sitting": walks["sitting"],
    }
    bare, worn, other, sitting = (run.save(base / name, rrd=False) for name, run in runs.items())
    return {"one": [worn], "two": [bare, worn], "three": [bare, worn, other], "seated": [sitting]}


@pytest.fixture(scope="module")
def pages(
    folders: dict[str, list[pathlib.Path]], tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str], pathlib.Path]:
    """The page of a kind, written when it is first asked for."""
    base = tmp_path_factory.mktemp("pages")

    @functools.cache
    def written(kind: str) -> pathlib.Path:
        (base / f"{kind}.html").write_text(page(read_runs(folders[kind])), encoding="utf-8")
        return base / f"{kind}.html"

    return written


# --- words

ALLOWED = {
    *("walk-dropfoot", "walk-dropfoot-afo", "walk-dropfoot-afo-short"),  # by which a scenario is run again
    "mmc3.xls",  # the publisher's name of a supplement, in the source of the recorded walk
}
KEY = re.compile(r"\w*[A-Za-z]\w*_\w+|\b[a-z]\w+\.[a-z]\w+(?:\.\w+)*|--[a-z]+|\b(?:walk|seated|arm)-\w[\w-]*")


def words_of(text: str) -> str:
    """What a reader sees or hears of a page: its words, the descriptions of its figures, its labels."""
    heard = re.findall(r"<(?:title|desc)[^>]*>([^<]*)<|aria-label=\"([^\"]*)\"", text)
    seen = re.sub(r"<style>.*?</style>|<svg.*?</svg>|<[^>]+>", " ", text, flags=re.DOTALL)
    return html.unescape(" ".join([seen, *(" ".join(each) for each in heard)]))


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS if NIGHTLY else ("three", "seated"))  # the others' are in the three
def test_no_page_shows_a_key_or_a_name_of_a_file(pages: Callable[[str], pathlib.Path], kind: str) -> None:
    found = set(KEY.findall(words_of(pages(kind).read_text(encoding="utf-8"))))
    assert found - ALLOWED == set()


@pytest.mark.parametrize(
    ("texts", "names"),
    [
        (["limp, no orthosis", "limp and S1's, timed"], ("limp", ["no orthosis", "S1's"])),
        (["limp, timed: late", "limp, timed: early"], ("limp, timed", ["late", "early"])),
        (["limp mild", "limp moderate"], ("limp", ["mild", "moderate"])),
        (["run", "walk, slow"], ("", ["run", "walk"])),
        (["limp", "set a.cuff_x=3 N; limp"], ("limp", ["as described", "a cuff x 3 N"])),
        (["limp", "limp"], ("limp", [])),
        (["limp", "limp, slow"], ("", [])),
    ],
)
def test_runs_are_named_by_what_sets_their_descriptions_apart(
    texts: list[str], names: tuple[str, list[str]]
) -> None:
    assert apart([{"description": text} for text in texts]) == names


# --- the walkers


@pytest.mark.slow
def test_a_walk_opens_with_the_toe_without_and_with_the_device(
    folders: dict[str, list[pathlib.Path]],
) -> None:
    """The heights drawn are those of the answers; a walker without the device has no muscle."""
    runs = read_runs(folders["one"])
    own: dict[str, Metric] = runs[0].recording.metrics
    without, worn = walkers(runs)
    for walker, height in (
        (without, own["reference_toe_clearance"].value),
        (worn, own["toe_clearance"].value),
    ):
        assert f"toe {abs(height):.0f} mm {'below' if height < 0.0 else 'above'} the floor" in walker.drawing
    assert (without.name, worn.name) == ("Without the device", "with it")
    assert DEVICE in worn.drawing and DEVICE not in without.drawing
    several = read_runs(folders["three"])
    assert [walker.run for walker in walkers(several)] == several
    assert walkers(read_runs(folders["seated"])) == []


def test_the_height_at_a_walker_is_the_mean_that_the_answers_state(walks: dict[str, Recording]) -> None:
    lower = {"toe_clearance": Metric(-7.0, "mm"), "reference_toe_clearance": Metric(math.nan, "mm")}
    run = dataclasses.replace(walks["worn"], metrics={**walks["worn"].metrics, **lower})
    (walker,) = walkers([alone(run)])
    assert "toe 7 mm below the floor" in walker.drawing
    columns = {name: values for name, values in run.columns.items() if not name.startswith("qpos/")}
    assert walkers([alone(dataclasses.replace(run, columns=columns))]) == []  # a report stands without it


@pytest.mark.slow
def test_the_reference_of_one_run_stands_beside_no_run_that_has_another(walks: dict[str, Recording]) -> None:
    """A milder patient's toe is higher without the device: the first run's says nothing of it."""
    worn = walks["worn"]
    milder = {"reference_toe_clearance": Metric(13.0, "mm")}
    other = dataclasses.replace(worn, metrics={**worn.metrics, **milder})
    assert [walker.run is None for walker in walkers([alone(worn), alone(worn)])] == [True, False, False]
    assert [walker.run is None for walker in walkers([alone(worn), alone(other)])] == [False, False]


# --- in a browser


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play:
        yield play.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])


def shown(browser: Any, file: pathlib.Path, width: int) -> Any:
    view = browser.new_page(viewport={"width": width, "height": 900}, bypass_csp=True)
    view.goto(file.as_uri())
    return view


@browsed
@pytest.mark.slow
@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("kind", KINDS)
def test_the_walkers_and_the_first_curves_are_on_the_first_screen(
    browser: Any, pages: Callable[[str], pathlib.Path], kind: str, width: int
) -> None:
    view = shown(browser, pages(kind), width)
    ends = "all => all.map(one => one.getBoundingClientRect().bottom)"
    curves = view.eval_on_selector_all(".first .panels svg", ends)
    walkers = view.eval_on_selector_all(".walkers svg[role]", ends)
    assert len(curves) == 2 and len(walkers) == {"one": 2, "two": 2, "three": 3, "seated": 0}[kind]
    assert 0.0 < max([*curves, *walkers]) < 1000.0
    assert view.evaluate("document.documentElement.scrollWidth") <= width
    view.close()


@browsed
@pytest.mark.slow
@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("kind", ["one", "two", "seated"][: size(1, 3)])
def test_nothing_bars_a_reader(
    browser: Any, pages: Callable[[str], pathlib.Path], kind: str, width: int
) -> None:
    """axe-core finds nothing, with parts folded and opened. Figures are pictures with a text each."""
    assert AXE and AXE.origin
    view = shown(browser, pages(kind), width)
    view.add_script_tag(path=pathlib.Path(AXE.origin).parent / "axe.min.js")
    for opened in (False, True):
        view.evaluate(
            f"document.querySelectorAll('details').forEach(one => one.open = {str(opened).lower()})"
        )
        found = view.evaluate("axe.run({exclude: ['svg[role] > g']}, {resultTypes: ['violations']})")
        assert [(each["id"], each["nodes"][0]["html"]) for each in found["violations"]] == []
    view.close()


@browsed
@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_report_prints_on_four_pages(browser: Any, pages: Callable[[str], pathlib.Path], kind: str) -> None:
    view = shown(browser, pages(kind), 1280)
    printed = view.pdf(prefer_css_page_size=True)
    assert 1 <= len(re.findall(rb"/Type\s*/Page\b", printed)) <= 4
    view.close()
