"""The documentation's site: no warning, no broken link, and questions find their page."""

import functools
import http.server
import importlib.util
import inspect
import json
import pathlib
import re
import subprocess
import sys
import threading
from typing import Any

import pytest
from browser import CHROMIUM, Browser
from campaign import nightly, sampled
from documents import PAGES, script

import afo_sim
from afo_sim.common import errors

AXE = importlib.util.find_spec("axe_playwright_python")
ROOT = pathlib.Path(__file__).parents[1]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.py"))


class Quiet(http.server.SimpleHTTPRequestHandler):
    """Serves files, and says nothing."""

    def log_message(self, *_: object) -> None:
        """Nothing."""


# What a user would ask, and the page that answers it.
QUESTIONS = {
    "how stiff is the cuff?": "mounting.html",
    "own gait trial C3D": "gait_data.html",
    "valve data sheet": "valves.html",
    "bottle strides": "supply.html",
    "drop foot weak patient": "patients.html",
    "strap pressure on the skin": "safety.html",
    "what should I change first": "effects.html",
    "toe clearance": "metrics.html",
    "How do I fit my own muscle": "fit.html",
    "noise of a sensor": "sensors.html",
    "Gymnasium environment": "environments.html",
    "fit --hold-out": "reference/commands.html",
    "moment arm": "glossary.html",
    "McKibben muscle in MuJoCo": "questions.html",
    "Simulink FMU": "elsewhere.html",
    "custom controller in python": "controllers.html",
    "which muscle should I buy": "size.html",
    "install without internet": "installation.html",
    # Written before the search that ranks was tried on them: clinician, designer, scientist, newcomer.
    "will the brace hurt the skin of my patient": "safety.html",
    "spastic calf after a stroke": "patients.html",
    "motion capture recording of my patient": "gait_data.html",
    "how many steps does one CO2 cartridge last": "supply.html",
    "thicker tube between valve and muscle": "air.html",
    "stiffer shoe sole": "footwear.html",
    "published experiments compared with the simulation": "validation.html",
    "train a reinforcement learning agent": "environments.html",
    "confidence interval of a result": "uncertainty.html",
    "how do I start my first simulation": "notebooks/01_papers.html",
}
# As they stand in a terminal; pasted, each is to lead to the page of error messages.
PASTED = (
    "SCENARIO = 'seatd': there is no such scenario; allowed: a path to a TOML file, or one of: arm, arm-s1",
    "there is no run here (recording.parquet is missing)",
    'supply.pressure = 3: has no unit; write it like "4 bar"',
    "this needs the library rerun: pip install 'afo-sim[rerun]', or -e '.[rerun]' in a clone",
    "--out = 'r1': holds a run of 'seated' with other values; allowed: --force, which replaces it",
    "a velocity is not a number, or is too large",
    "there is no display here to open the viewer on",
    "a process was killed (exit code -9; out of memory?)",
    "this is a bug in afo-sim (ValueError: math domain error)",
)
FOUND = 26  # of these at least: that many are to stand among the first three hits
# Types a question into the search box of the page, as a person would; the addresses of the hits.
ASK = """(async question => {
  const wait = time => new Promise(done => setTimeout(done, time));
  const inside = what => [...document.querySelectorAll("*")].flatMap(
    one => one.shadowRoot ? [...one.shadowRoot.querySelectorAll(what)] : []);
  const until = async (what, some) => {
    for (let k = 0; k < 200 && inside(what).length > 0 !== some; k++) await wait(20);
    return inside(what);
  };
  const type = (box, text) => {
    box.value = text;
    box.dispatchEvent(new Event("input", { bubbles: true }));
  };
  document.querySelector(".md-search__button").click();
  const [box] = await until("input[aria-label=Search]", true);
  type(box, "");
  await until("[role=option]", false);
  type(box, question);
  const hits = await until("[role=option]", true);
  return [hits.map(hit => hit.href), hits.map(hit => hit.querySelector("u")?.textContent)];
})"""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    pytest.importorskip("zensical", reason="the site is built with zensical, of the extra docs")
    out = tmp_path_factory.mktemp("docs") / "site"
    done = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / "docs.py"), "--out", str(out)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert not done.stderr
    return out


@nightly("the whole site is built, which takes a minute")
@pytest.mark.slow
def test_the_site_has_every_page_and_every_notebook(site: pathlib.Path) -> None:
    assert all((site / f"{page}.html").is_file() for page in PAGES)
    kinds = ("html", "ipynb", "py")
    assert all((site / "notebooks" / f"{one.stem}.{kind}").is_file() for one in NOTEBOOKS for kind in kinds)
    shown = {
        "commands": "--step",
        "keys": "bladder_force",
        "columns": "ankle/angle",
        "python": "torque_map",
        "python_study": "class-results",
    }
    for page, name in shown.items():
        text = (site / "reference" / f"{page}.html").read_text(encoding="utf-8")
        assert name in text and "Undefined" not in text


@nightly("the whole site is built, which takes a minute")
@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium, which would run the site's search")
def test_questions_find_their_page_and_no_page_asks_for_anything_outside(
    site: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    browser = Browser(tmp_path)
    try:
        for page in ("walking", "reference/keys", "notebooks/01_papers", "index"):
            browser.open((site / f"{page}.html").as_uri())
        asked = {question: browser.run(f"{ASK}({json.dumps(question)})") for question in QUESTIONS}
        pasted = {text: browser.run(f"{ASK}({json.dumps(text)})")[0][:3] for text in PASTED}
        [misspelt], marked = browser.run(f"{ASK}('kompensation')")[0][:1], asked["moment arm"][1]
        browser.open(asked["Gymnasium environment"][0][0])
        browser.wait("document.querySelector('mark')?.textContent.match(/gymnasium|environment/i)")
    finally:
        browser.close()
    first = {
        question: [link.partition("?")[0].removeprefix(f"{site.as_uri()}/") for link in links[:3]]
        for question, (links, _) in asked.items()
    }
    missed = [question for question, page in QUESTIONS.items() if page not in first[question]]
    assert len(missed) <= len(QUESTIONS) - FOUND, {question: first[question] for question in missed}
    assert all("/errors.html" in " ".join(links) for links in pasted.values()), pasted
    assert "ompensation" in misspelt and {word.lower() for word in marked[:3]} <= {"moment", "arm"}
    assert len(browser.requests) > 10
    assert not [address for address in browser.requests if not address.startswith(site.as_uri())]


@nightly("the whole site is built, which takes 20 s")
@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium, which would run the site's search")
def test_a_static_host_serves_the_site_and_its_search_below_a_path(
    site: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    handler = functools.partial(Quiet, directory=site.parent)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_port}/site/"
        browser = Browser(tmp_path)
        try:
            browser.open(f"{address}reference/keys.html")
            links, _ = browser.run(f"{ASK}('bottle strides')")
        finally:
            browser.close()
            server.shutdown()
    assert links[0].startswith(f"{address}supply.html")
    assert not [each for each in browser.requests if not each.startswith(address)]


@nightly("the whole site is built, which takes 20 s")
@pytest.mark.slow
@pytest.mark.skipif(not (CHROMIUM and AXE), reason="no Chromium or axe-playwright-python here")
@pytest.mark.parametrize("width", [400, 1280])  # of a telephone's and a desk's page [CSS pixel]
def test_nothing_bars_a_reader(site: pathlib.Path, tmp_path: pathlib.Path, width: int) -> None:
    """axe-core finds nothing on pages of each kind: first page, notebook, reference, tables and code."""
    assert AXE and AXE.origin
    script = pathlib.Path(AXE.origin).with_name("axe.min.js").read_text(encoding="utf-8")
    found, browser = {}, Browser(tmp_path)
    try:
        browser.resize(width)
        for page in (
            "index",
            "notebooks/01_papers",
            "reference/keys",
            "reference/python_study",
            "patients",
        ):
            browser.open((site / f"{page}.html").as_uri())
            browser.run(f"{script}; 0")
            browser.run("new Promise(done => setTimeout(done, 500))")  # scripts of the page look at its size
            told = "axe.run(document, { resultTypes: ['violations'] })"
            found[page] = browser.run(f"{told}.then(({{ violations }}) => violations.map(each => each.id))")
    finally:
        browser.close()
    assert not any(found.values()), found


@pytest.fixture
def docs() -> Any:
    """The script that builds the site."""
    pytest.importorskip("jupytext", reason="notebooks are read by jupytext, of the extra docs")
    return script("docs")


NOTEBOOK = """# %% [markdown]
# # Two
#
# From [there](../index.md).

# %%
x = 2
print(x)
x + 1

# %% alt="A line"
import matplotlib.pyplot as plt
plt.plot([0, 1]);
"""


def test_a_notebook_shows_what_it_prints_draws_and_ends_with(docs: Any, tmp_path: pathlib.Path) -> None:
    file, folder = tmp_path / "two.py", tmp_path / "made"
    file.write_text(NOTEBOOK)
    docs.ROOT = tmp_path
    assert docs.notebook(file, folder) == "two.py"
    page = (folder / "two.md").read_text()
    assert page.startswith("# Two\n") and "[there](../index.md)" in page
    assert page.index("x + 1") < page.index("    2\n") < page.index("    3\n")
    (picture,) = re.findall(r'<img alt="A line" src="(two/\w+\.png)" width="\d+">', page)
    assert (folder / picture).is_file() and (folder / "two.py").is_file()
    cells = json.loads((folder / "two.ipynb").read_text())["cells"]
    assert [len(cell.get("outputs", [])) for cell in cells] == [0, 2, 1]


@pytest.mark.parametrize(
    "cell",
    ["1 / 0", "import warnings; warnings.warn('w')", "import matplotlib.pyplot as plt; plt.plot([1]);"],
)
def test_a_notebook_that_fails_warns_or_lacks_a_text_makes_no_page(
    docs: Any, tmp_path: pathlib.Path, cell: str
) -> None:
    (tmp_path / "bad.py").write_text(f"# %% [markdown]\n# # Bad\n\n# %%\n{cell}\n")
    docs.ROOT = tmp_path
    with pytest.raises(SystemExit, match=r"^bad.py: "):
        docs.notebook(tmp_path / "bad.py", tmp_path / "made")
    assert not (tmp_path / "made").exists()


@pytest.mark.slow
@pytest.mark.parametrize("file", sampled(NOTEBOOKS, 2), ids=lambda file: file.stem)
def test_each_notebook_runs(docs: Any, tmp_path: pathlib.Path, file: pathlib.Path) -> None:
    docs.notebook(file, tmp_path)
    assert "\n    " in (tmp_path / f"{file.stem}.md").read_text(encoding="utf-8")


def test_whatever_a_public_name_returns_has_an_entry_that_says_what_it_holds(docs: Any) -> None:
    made = dict(docs.docs_python.pages(lambda text: None))
    text = "\n".join(made.values())
    entries = set(re.findall(r"^## (?:class )?(\w+)$", text, re.M))
    assert set(afo_sim.__all__) <= entries and {"Results", "Effect", "Answer", "Sizing"} <= entries
    found = set()
    for one in map(functools.partial(getattr, afo_sim), afo_sim.__all__):
        known = vars(inspect.getmodule(one))
        for name, call in vars(one).items() if inspect.isclass(one) else [(one.__name__, one)]:
            words = re.findall(r"\w+", str(getattr(call, "__annotations__", {}).get("return", "")))
            ours = [known[word] for word in words if inspect.isclass(known.get(word)) and name[0] != "_"]
            found |= {each.__name__ for each in ours if each.__module__.startswith("afo_sim.")}
    assert len(found) > 20 and found <= entries, found - entries
    assert not re.findall(r"^\| `[^|]*\| [^|]*\|\s*\|$", text, re.M)
    assert sorted(docs.docs_python.PUBLIC) == sorted(afo_sim.__all__)


def test_every_exit_code_and_every_notice_is_on_a_page(docs: Any) -> None:
    waiting, exits = [errors.AfoSimError], {0, 1, 70, 130, 143}  # of the command line itself
    while waiting:
        exits.add(waiting[-1].exit_code)
        waiting += waiting.pop().__subclasses__()
    rows = re.findall(r"^\| ([\d, ]+) \|", PAGES["errors"], re.M)
    assert {int(code) for row in rows for code in row.split(",")} == exits
    sources = [path.read_text(encoding="utf-8") for path in (ROOT / "afo_sim").rglob("*.py")]
    codes = {code for text in sources for code in re.findall(r'Notice\(\s*"([a-z0-9-]+)"', text)}
    told = dict(re.findall(r"^\| `([^`]+)` \| (.+) \|$", docs.docs_reference.notices(), re.M))
    assert len(codes) > 200 and codes <= told.keys(), codes - told.keys()
    assert "{length:.3g} m" in told["tube-long"]


def test_a_folder_that_is_not_a_site_is_not_replaced(docs: Any, tmp_path: pathlib.Path) -> None:
    (tmp_path / "own.txt").write_text("mine")
    with pytest.raises(SystemExit, match="is not a site"):
        docs.build(tmp_path)
    assert (tmp_path / "own.txt").read_text() == "mine"


def test_broken_links_and_outside_addresses_are_found(docs: Any, tmp_path: pathlib.Path) -> None:
    (tmp_path / "a.html").write_text(
        '<h1 id="here"></h1><a href="#here"></a><a href="b.html#there"></a><a href="https://a.org"></a>'
        '<a href="#gone"></a><a href="b.html#gone"></a><img src="gone.png"><script src="https://a.org/x.js">'
    )
    (tmp_path / "b.html").write_text('<h1 id="there"></h1><link rel="stylesheet" href="s.css">')
    (tmp_path / "s.css").write_text("@font-face { src: url(https://a.org/font.woff) }")
    assert sorted(docs.faults(tmp_path)) == [
        "a.html: #gone has no such anchor",
        "a.html: b.html#gone has no such anchor",
        "a.html: fetches https://a.org/x.js",
        "a.html: gone.png leads nowhere",
        "s.css: fetches https://a.org/font.woff",
    ]
