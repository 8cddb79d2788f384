"""The studio's page as somebody uses it: a browser drags, types and presses keys."""

import base64
import importlib.util
import json
import pathlib
import re
import subprocess
import sys
from collections.abc import Iterator

import pytest
from browser import CHROMIUM, Browser
from campaign import size
from served import Served

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="no chromium here to show the page"),
]
PRESSURE = '[data-key="supply.pressure"][type="range"]'
ORIGIN = '[data-key="orthosis.muscle.dorsiflexor.origin.from_joint"]'
INSERTION = '[data-key="orthosis.muscle.dorsiflexor.insertion.from_joint"]'
OPENS = '[data-grip="phases.dorsiflexor.inlet 0 0"]'
RESTS = "document.getElementById('verdict').ariaBusy === 'false'"
SOCKETS = """window.sockets = []; window.WebSocket = class extends WebSocket {
    constructor(url) { super(window.cut ? `${url}x` : url); sockets.push(this);
        this.addEventListener("message", event => (window.serial = JSON.parse(event.data).serial)); }
    send(text) { if (!window.deaf) super.send(text); } }"""
AXE = importlib.util.find_spec("axe_playwright_python")
FOCUSABLE = "a[href], button:enabled, input:enabled, select:enabled, summary, [tabindex='0']"


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    served = Served(tmp_path_factory.mktemp("served"))
    yield served
    served.close()


@pytest.fixture(scope="module")
def browsed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    browser = Browser(tmp_path_factory.mktemp("profile"))
    yield browser
    browser.close()


@pytest.fixture
def sockets(browsed: Browser) -> Iterator[None]:
    """The page's sockets are in `sockets`; nothing sent arrives once `deaf`, none opens once `cut`."""
    script = browsed.ask("Page.addScriptToEvaluateOnNewDocument", source=SOCKETS)
    yield
    browsed.ask("Page.removeScriptToEvaluateOnNewDocument", **script)


@pytest.fixture
def page(browsed: Browser, served: Served) -> Iterator[Browser]:
    """The page at rest; afterwards nothing was asked of another machine, and no script failed."""
    browsed.resize(1280)
    browsed.open(served.address)
    browsed.wait(RESTS, 120.0)
    browsed.run("document.querySelectorAll('details').forEach(one => one.open = true)")
    yield browsed
    browsed.ask("Emulation.setEmulatedMedia", media="", features=[])
    while not browsed.run("document.getElementById('undo').disabled"):
        click(browsed, "#undo")
        browsed.wait(RESTS)
    browsed.run("document.querySelectorAll('#compare thead button').forEach(one => one.click())")
    assert not browsed.faults
    own = served.address, served.address.replace("http", "ws")
    assert all(url.startswith(own) for url in browsed.requests)


def place(page: Browser, selector: str) -> tuple[float, float]:
    """The middle of an element that is scrolled into view."""
    box = page.run(
        f"(() => {{ const one = document.querySelector({json.dumps(selector)});"
        " one.scrollIntoView({block: 'center'}); const box = one.getBoundingClientRect();"
        " return [box.x + box.width / 2, box.y + box.height / 2] })()"
    )
    return box[0], box[1]


def text(page: Browser, selector: str) -> str:
    return str(page.run(f"document.querySelector({json.dumps(selector)}).textContent"))


def value(page: Browser, key: str) -> str:
    """What the number field of a key shows."""
    return str(page.run(f"document.querySelector('input[inputmode][data-key=\"{key}\"]').value"))


def enter(page: Browser, key: str, typed: str) -> None:
    """Type a number into the field of a key."""
    page.run(f"document.querySelector('input[inputmode][data-key=\"{key}\"]').select()")
    page.ask("Input.insertText", text=typed)
    page.press("Enter")


def click(page: Browser, selector: str) -> None:
    page.mouse(place(page, selector))


@pytest.mark.parametrize("what", [PRESSURE, INSERTION, OPENS, ORIGIN][: size(2, 4)])
def test_what_is_dragged_is_drawn_and_taken_back_in_one_step(page: Browser, what: str) -> None:
    curve = "document.querySelector('#plots figure > svg .curve.with').getAttribute('d')"
    each = "[...document.querySelectorAll('[data-key]')].map(one => one.value ?? one.textContent)"
    shown = f"JSON.stringify({each})"
    before, numbers = page.run(curve), page.run(shown)
    steps = 6
    x, y = place(page, what)
    if what == PRESSURE:
        width = page.run(f"document.querySelector({json.dumps(PRESSURE)}).getBoundingClientRect().width")
        x += (4.0 - 4.25) / 7.5 * (width - 16.0)  # 4 bar between 0.5 and 8
    page.mouse(*((x + 4 * k, y + 2 * k) for k in range(steps)))
    page.wait(f"{curve} !== {json.dumps(before)} && {RESTS}")
    assert page.run(shown) != numbers
    assert page.run("window.studioLatency.length") > 0
    assert page.run("document.querySelectorAll('#plots figure > svg .curve.before').length") == 4
    page.press("z", control=True)
    page.wait(f"{curve} === {json.dumps(before)} && {RESTS}")
    assert page.run(shown) == numbers
    assert page.run("document.getElementById('undo').disabled")
    page.press("z", control=True, shift=True)
    page.wait(f"{curve} !== {json.dumps(before)} && {RESTS}")
    click(page, "#undo")
    page.wait(f"{curve} === {json.dumps(before)} && {RESTS}")


def test_a_bar_is_added_and_removed_by_keys(page: Browser) -> None:
    grips = "document.querySelectorAll('[data-grip^=\"phases.dorsiflexor.outlet\"]').length"
    for word, count in (("add a", 4), ("remove the last", 2), ("remove the last", 0)):
        page.run(f"document.querySelector('[aria-label=\"dorsiflexor outlet: {word} bar\"]').focus()")
        page.press("Enter")
        page.wait(f"{grips} === {count} && {RESTS}")
    for _ in range(3):
        click(page, "#undo")
    page.wait(f"{grips} === 2 && document.getElementById('undo').disabled && {RESTS}")


def test_nonsense_stays_in_its_field_and_is_answered_beside_it(page: Browser) -> None:
    fields = page.run("[...document.querySelectorAll('input[inputmode]:enabled')].map(one => one.id)")
    assert len(fields) > 20
    for field in fields[:: size(5, 1)]:
        page.run(f"document.getElementById('{field}').select()")
        page.ask("Input.insertText", text="<b>plenty")
        page.press("Tab")
        page.wait(f"!document.getElementById('{field}-problem').hidden")
        one = f"document.getElementById('{field}')"
        assert page.run(f"[{one}.value, {one}.ariaInvalid]") == ["<b>plenty", "true"]
        assert page.run(f"{one}.getAttribute('aria-describedby')") == f"{field}-problem"
        assert "<b>plenty" in text(page, f"#{field}-problem")
    assert page.run("document.getElementById('undo').disabled && document.getElementById('wrong').hidden")
    enter(page, "patient.body_mass", "81,5")
    page.wait(f"document.getElementById('{fields[0]}-problem').hidden && {RESTS}")
    assert value(page, "patient.body_mass") == "81.5"
    click(page, "#undo")
    page.wait(f"document.getElementById('undo').disabled && {RESTS}")
    assert value(page, "patient.body_mass") == "68.5"  # of the recorded walker, whose mass is in use


def test_two_tabs_and_a_reload_show_one_design_and_its_numbers_are_those_of_a_run(
    page: Browser, served: Served, tmp_path: pathlib.Path
) -> None:
    other = Browser(tmp_path / "profile")
    other.open(served.address)
    other.wait(RESTS)
    key = "supply.pressure"
    enter(page, key, "3.5")
    for tab in (other, page):
        tab.wait(f"document.querySelector('input[inputmode][data-key=\"{key}\"]').value === '3.5' && {RESTS}")
    assert text(other, "#answers") == text(page, "#answers")
    other.close()
    click(page, "#save button")
    page.wait("document.getElementById('saved').textContent.includes('afo-sim run')")
    page.open(served.address)
    page.wait(RESTS)
    assert value(page, key) == "3.5"
    out = str(tmp_path / "run")
    words = [sys.executable, "-m", "afo_sim", "run", str(served.folder), "--no-rrd", "--out", out]
    printed = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    briefs = page.run("[...document.querySelectorAll('.answer > p + p')].map(one => one.textContent)")
    assert len(briefs) == 7 and all(brief in printed for brief in briefs)
    run = json.loads((tmp_path / "run" / "summary.json").read_text())
    clearance = f"{run['metrics']['toe_clearance']['value']:.1f} mm"
    assert f"swing: {clearance.removeprefix('-')} " in text(page, "#with .lowest")


def test_keys_alone_reach_all_and_move_a_slider(page: Browser) -> None:
    every = f"[...document.querySelectorAll({json.dumps(FOCUSABLE)})]"
    reached = "one => one.checkVisibility() && !one.closest('[inert]')"
    count = page.run(f"(window.all = {every}.filter({reached})).length")
    page.run("window.met = new Set(), document.addEventListener('focusin', event => met.add(event.target))")
    page.run("document.activeElement.blur()")
    for _ in range(count + 5):
        page.press("Tab")
    missed = (
        "all.filter(one => !met.has(one) && one.name !== 'walker').map(one => one.outerHTML.slice(0, 120))"
    )
    assert page.run(missed) == []
    page.run(f"document.querySelector({json.dumps(PRESSURE)}).focus()")
    page.press("ArrowRight")
    page.wait(f"!document.getElementById('undo').disabled && {RESTS}")
    assert value(page, "supply.pressure") == "4.05"
    page.run(f"document.querySelector({json.dumps(ORIGIN)}).focus()")
    page.press("ArrowUp", shift=True)
    page.wait(
        f"document.querySelector('{ORIGIN}').getAttribute('aria-valuetext').includes('305 mm up') && {RESTS}"
    )


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [400, 1280])
def test_nothing_bars_a_reader(page: Browser, width: int, scheme: str) -> None:
    page.resize(width)
    feature = {"name": "prefers-color-scheme", "value": scheme}
    page.ask("Emulation.setEmulatedMedia", features=[feature])
    paper = page.run("getComputedStyle(document.body).backgroundColor")
    assert (sum(map(int, re.findall(r"\d+", paper))) < 300) is (scheme == "dark")
    click(page, "#keep")
    page.wait("document.querySelectorAll('.curve.A').length > 3")
    assert page.run("document.documentElement.scrollWidth") <= width
    if AXE is None or AXE.origin is None:
        pytest.skip("no axe-core here")
    page.run((pathlib.Path(AXE.origin).parent / "axe.min.js").read_text(encoding="utf-8") + "; 0")
    found = page.run("axe.run(document, {resultTypes: ['violations']})")["violations"]
    assert [(each["id"], each["nodes"][0]["html"]) for each in found] == []


@pytest.mark.parametrize("width", [400, 1280])
def test_the_verdict_stands_in_the_first_screen(page: Browser, width: int) -> None:
    page.resize(width, 800)
    page.open(page.run("location.href"))
    page.wait(RESTS)
    boxes = "['#lead', '#answers', '#design'].map(one => document.querySelector(one).getBoundingClientRect())"
    lead, answers, design = page.run(f"{boxes}.map(box => [box.top + scrollY, box.bottom + scrollY])")
    assert lead[0] < answers[0] < 400 and lead[1] > lead[0] + 15
    assert width > 900 or design[0] > answers[1]  # of one column the controls come after it


def test_it_prints_on_two_pages_with_nothing_that_is_for_the_screen_alone(page: Browser) -> None:
    page.run("document.querySelectorAll('details').forEach(one => one.open = false)")
    pdf = base64.b64decode(page.ask("Page.printToPDF", paperWidth=8.27, paperHeight=11.69)["data"])
    assert len(re.findall(rb"/Type\s*/Page\b", pdf)) == 2
    page.ask("Emulation.setEmulatedMedia", media="print")
    shown = "['#design', '#further', '#saving', '#undo', '#play', '#answers', '#notes', '#plots']"
    seen = page.run(f"{shown}.filter(one => document.querySelector(one).checkVisibility())")
    page.ask("Emulation.setEmulatedMedia", media="")
    assert seen == ["#answers", "#notes", "#plots"]


def test_variants_are_drawn_and_compared_and_gone_back_to(page: Browser) -> None:
    plot = "[...document.querySelectorAll('#plots figure > svg')]"
    drawn = f"JSON.stringify({plot}.map(one => one.querySelector('.curve.A:not(.thin)')?.getAttribute('d')))"
    own = f"JSON.stringify({plot}.map(one => one.querySelector('.curve.with')?.getAttribute('d')))"
    click(page, "#keep")
    page.wait(f"document.getElementById('keep').disabled && {drawn} === {own}")
    page.run("document.getElementById('name-A').select()")
    page.ask("Input.insertText", text="<img src=x onerror=document.title=1>\u202e")
    page.press("Tab")
    page.wait("document.getElementById('show-A').textContent === '<img src=x onerror=document.title=1>'")
    assert page.run("document.querySelectorAll('#compare img, #plots img').length") == 0
    enter(page, "supply.pressure", "3.5")
    page.wait(f"!document.getElementById('undo').disabled && {RESTS} && {drawn} !== {own}")
    rows = "[...document.querySelectorAll('#compare tbody tr')].map(one => one.innerText.split('\\t'))"
    page.wait(f"!JSON.stringify({rows}).includes('computing')")
    table = {row[0]: row[1:] for row in page.run(rows)}
    kept, asked = page.run(drawn), [row for row in table.values() if row[0].endswith("bar")]
    assert asked == [["3.5 bar", "4 bar"]]  # what differs, and nothing else of the design
    assert table["Toe clearance"][0].split()[0][:3] == text(page, "#with .lowest").split(": ")[1][:3]
    page.open(page.run("location.href"))
    page.wait(f"{RESTS} && {drawn} === {json.dumps(kept)}")
    page.run("document.getElementById('show-A').focus()")
    page.press("Enter")
    page.wait(f"document.getElementById('show-A').ariaPressed === 'true' && {RESTS} && {drawn} === {own}")
    assert page.run("document.activeElement.id") == "show-A"
    click(page, "#undo")
    page.wait(f"document.getElementById('show-A').ariaPressed === 'false' && {RESTS}")
    click(page, "#compare thead button")
    page.wait("document.getElementById('compare').hidden && !document.querySelector('.curve.A')")


def test_changes_while_the_socket_is_lost_are_sent_when_it_is_back(sockets: None, page: Browser) -> None:
    page.run("deaf = true")
    enter(page, "supply.pressure", "3.4")  # sent, and never heard
    page.run("cut = true, sockets.at(-1).close()")
    page.wait("document.getElementById('lost').textContent.includes('tries again every second')")
    assert page.run("['undo', 'keep', 'report'].every(one => document.getElementById(one).disabled)")
    enter(page, "patient.body_mass", "92")
    page.run("cut = deaf = false")
    page.wait(f"document.getElementById('lost').hidden && document.querySelector('.curve.before') && {RESTS}")
    assert (value(page, "supply.pressure"), value(page, "patient.body_mass")) == ("3.4", "92")
    page.faults.clear()  # of the sockets that were refused


def test_bands_are_drawn_for_their_own_design_alone(sockets: None, page: Browser) -> None:
    band = json.dumps({name: {"low": [-5.0] * 101, "high": [20.0] * 101} for name in ("ankle", "toe")})
    hear = f"""sockets.at(-1).onmessage({{data: JSON.stringify(
        {{kind: 'bands', lines: [], serial: serial + older, curves: {band}}})}})"""
    drawn = "document.querySelectorAll('#plots figure > svg .band.drawn').length"
    assert [page.run(f"older = {k}, {hear}, {drawn}") for k in (-1, 0)] == [0, 2]
    label = "document.querySelectorAll('#plots figure > svg')[1].ariaLabel"
    assert "of what is not known from −5 to 20" in page.run(label)
    enter(page, "supply.pressure", "3.6")
    page.wait(f"{drawn} === 0 && !document.getElementById('undo').disabled && {RESTS}")


@pytest.mark.slow
def test_a_file_of_a_hostile_name_is_text(page: Browser, tmp_path: pathlib.Path) -> None:
    file = tmp_path / "<img src=x onerror=document.title=1>.csv"
    file.write_text("phase\n0\n")
    root = page.ask("DOM.getDocument")["root"]["nodeId"]
    node = page.ask("DOM.querySelector", nodeId=root, selector="#files")["nodeId"]
    page.ask("DOM.setFileInputFiles", nodeId=node, files=[str(file)])
    page.wait("document.querySelectorAll('#dropped li').length === 1")
    click(page, "#import")
    assert "whose walk" in text(page, "#trial-problem")
    click(page, "[name=walker][value=patient]")
    click(page, "#import")
    page.wait("document.getElementById('trial-problem').textContent.includes('<img')")
    assert page.run("document.querySelectorAll('#trial img').length") == 1
    assert page.run("document.title") == "afo-sim studio"


def test_the_end_of_the_studio_is_one_sentence(browsed: Browser, tmp_path: pathlib.Path) -> None:
    served = Served(tmp_path)
    browsed.open(served.address)
    browsed.wait("document.querySelector('#with .toe').textContent", 60.0)
    served.close()
    browsed.wait("document.getElementById('lost').textContent.startsWith('The connection')")
    browsed.wait("document.getElementById('lost').textContent.startsWith('The studio has ended')")
    assert browsed.run("document.getElementById('wrong').hidden")
    browsed.faults.clear()  # of the socket that was refused
    browsed.requests.clear()
    browsed.open("about:blank")
