"""The studio's server as its page meets it: who gets in, and that its answers are those of a run."""

import asyncio
import contextlib
import errno
import os
import pathlib
import random
import re
import shutil
import signal
import socket
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from campaign import NIGHTLY, SEED, size
from installed import needs
from served import Tab

import afo_sim as afo
from afo_sim.common import InputError, assets, without_digests
from afo_sim.studio import Document, Studio, controls, opened, save, serve
from afo_sim.studio.controls import read, shown
from afo_sim.studio.engine import Engine, Wish

pytestmark = needs("uvicorn", "websockets")
SCENARIO = "walk-dropfoot-afo"
PRESSURE, LINK = "supply.pressure", "orthosis.muscle.dorsiflexor.link_length"
AHEAD = "orthosis.muscle.dorsiflexor.insertion.from_joint[0]"


@pytest.fixture(scope="module")
def studio(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Studio, str]]:
    import uvicorn

    made = Studio(SCENARIO, tmp_path_factory.mktemp("studio") / "saved")
    listening = socket.create_server(("127.0.0.1", 0))
    server = uvicorn.Server(
        uvicorn.Config(made.app, log_level="error", lifespan="on", ws="websockets-sansio")
    )
    thread = threading.Thread(target=server.run, args=([listening],), daemon=True)
    thread.start()
    while not server.started:
        time.sleep(0.01)
    yield made, f"http://127.0.0.1:{listening.getsockname()[1]}/{made.token}/"
    server.should_exit = True
    thread.join(20)


@pytest.fixture
def tab(studio: tuple[Studio, str]) -> Iterator[Tab]:
    with Tab.open(studio[1]) as found:
        found.until("document")
        yield found


def status(address: str, content: bytes | None = None, **headers: str) -> int:
    """Of what is asked for, or put there."""
    asked = urllib.request.Request(address, content, headers, method="GET" if content is None else "PUT")
    try:
        with urllib.request.urlopen(asked, timeout=20) as answer:
            return int(answer.status)
    except urllib.error.HTTPError as error:
        return error.code


# --- who gets in


def test_nobody_gets_in_without_the_token_or_from_elsewhere(studio: tuple[Studio, str]) -> None:
    made, address = studio
    root = address.removesuffix(f"{made.token}/")
    from websockets.exceptions import InvalidStatus

    assert status(address) == 200
    assert status(root) == status(f"{root}socket") == status(f"{root}{made.token}x/") == 404
    assert status(address, Host="attacker.example") == 403  # a name that was turned to this machine
    assert status(address, Origin="http://attacker.example") == 403
    for name in ("../server.py", "%2e%2e/server.py", "..%2fserver.py", "/etc/passwd"):
        assert status(f"{address}{name}") == 404
    with pytest.raises(InvalidStatus), Tab.open(address, origin="http://attacker.example"):
        pass
    with pytest.raises(InvalidStatus), Tab.open(root):
        pass


def test_hostile_requests_are_refused_and_tabs_go_on(
    studio: tuple[Studio, str], tab: Tab, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, address = studio
    assert status(address, Host="127.0.0.1\xff") == 403
    assert status(f"{address}{'a' * 5000}") == status(f"{address}%00") == 404
    assert status(f"{address}files/{'a' * 300}", b"x") == status(f"{address}files/%00", b"x") == 400
    for asked in (b"\x00\xff", '{"op": "rename", "slot": "A", "name": "\\ud800"}', "[" * 100_000):
        tab.socket.send(asked)
        assert tab.until("problem")
    with Tab.open(address) as other:
        assert other.until("document")["kind"] == "document"
    monkeypatch.setattr("afo_sim.studio.server._MOST", 100)
    assert [status(f"{address}files/{name}", b"x" * 60) for name in "aab"] == [200, 200, 413]
    for file in (made.engine.folder / "trial").iterdir():
        file.unlink()


def test_the_page_asks_no_other_machine(studio: tuple[Studio, str]) -> None:
    folder = pathlib.Path(afo.__file__).parent / "studio" / "page"
    for file in folder.iterdir():
        text = file.read_text(encoding="utf-8").replace("http://www.w3.org/2000/svg", "")
        assert "http:" not in text and "https:" not in text and "//cdn" not in text, file
    with urllib.request.urlopen(studio[1], timeout=20) as answer:
        assert "default-src 'self'" in answer.headers["content-security-policy"]


# --- what is answered


@pytest.mark.slow
def test_a_saved_design_runs_to_the_numbers_of_the_page(
    studio: tuple[Studio, str], tab: Tab, tmp_path: pathlib.Path
) -> None:
    tab.ask("change", sets={PRESSURE: 3.45, AHEAD: 60, "patient.body_mass": 92})
    serial = tab.until("document")["serial"]
    quick, whole = tab.until("settled", serial), tab.until("run", serial)
    tab.ask("save", folder=str(tmp_path / "mine"))
    folder = tab.until("saved")["folder"]
    run = afo.run(f"{folder}/scenario.toml")
    assert quick["clearance"] == run.metrics["toe_clearance"].value
    assert ["Toe clearance", str(run.metrics["toe_clearance"]), ""] in whole["results"]
    assert [answer["text"] for answer in whole["verdict"]] == [answer.text for answer in run.verdict]
    again = opened(folder).design
    assert again.scenario.orthosis == studio[0].document.design.scenario.orthosis


@pytest.mark.slow
def test_only_the_newest_of_many_changes_is_answered_to_the_end(tab: Tab) -> None:
    begun = len(tab.heard)
    for k in range(30):
        tab.ask("change", sets={PRESSURE: 3.0 + 0.01 * k}, join=True)
    while tab.until("document")["sets"].get(PRESSURE) != "3.29 bar":
        pass
    serial = tab.heard[-1]["serial"]
    tab.until("run", serial)
    later = tab.heard[begun:]
    numbers = [message["serial"] for message in later if message["kind"] != "problem"]
    assert numbers == sorted(numbers)
    assert [m["serial"] for m in later if m["kind"] == "run"][-1] == serial
    assert sum(message["kind"] == "settled" for message in later) < 30


@pytest.mark.parametrize(
    ("sets", "says"),
    [
        ({PRESSURE: -1}, "supply.pressure"),
        ({PRESSURE: "much"}, "much"),
        ({"patient.body_mass": 1e30}, "body_mass"),
        ({"orthosis.muscle.dorsiflexor.count": 2.5}, "count"),
        ({"phases.dorsiflexor.inlet": [[0.9, "x"]]}, "inlet"),
        ({"patient": "../../etc/passwd"}, "patient"),
        ({"leg.file": "/etc/passwd"}, "leg.file"),
        ({PRESSURE: {"a": 1}}, "not a valid value"),
    ],
)
def test_nonsense_is_one_sentence_and_changes_nothing(
    studio: tuple[Studio, str], tab: Tab, sets: dict[str, Any], says: str
) -> None:
    before = studio[0].document.design
    tab.ask("change", sets=sets, key="asked")
    problem = tab.until("problem")
    assert says in problem["text"] and problem["key"] == "asked" and "Traceback" not in problem["text"]
    assert studio[0].document.design == before


def test_what_no_page_sends_ends_nothing(tab: Tab) -> None:
    for text in (
        "[1]",
        '{"op": "shutdown"}',
        '{"op": "change"}',
        '{"op": "import", "files": ["../x"]}',
        "null",
    ):
        tab.socket.send(text)
        tab.until("problem")


def test_two_tabs_show_one_design(studio: tuple[Studio, str], tab: Tab) -> None:
    with Tab.open(studio[1]) as other:
        other.until("document")
        tab.ask("change", sets={PRESSURE: 2.9})
        while other.until("document")["sets"].get(PRESSURE) != "2.9 bar":
            pass
        serial = other.heard[-1]["serial"]
        assert other.until("settled", serial)["clearance"] == tab.until("settled", serial)["clearance"]
    tab.ask("undo")
    assert tab.until("document", serial + 1)["redo"] == 1


@pytest.mark.slow
def test_a_variants_answer_is_that_of_its_own_design(studio: tuple[Studio, str], tab: Tab) -> None:
    tab.ask("change", sets={PRESSURE: 3.1})
    tab.ask("keep")
    tab.ask("change", sets={PRESSURE: 3.9})  # before the kept one was answered
    answer = tab.until("variant")
    kept = studio[0].document.variants["A"].design
    expected = afo.run(kept.scenario).metrics["toe_clearance"]
    assert dict(row[:2] for row in answer["results"])["Toe clearance"] == str(expected)
    assert answer["values"][PRESSURE][1] == "3.1 bar" and kept != studio[0].document.design
    with Tab.open(studio[1]) as other:
        assert other.until("variant")["curves"] == answer["curves"]
    tab.ask("rename", slot="A", name="B")
    assert "another" in tab.until("problem")["text"]
    tab.ask("keep")
    while len(tab.until("document")["variants"]) < 2:
        pass
    assert tab.until("variant")["values"][PRESSURE][1] == "3.9 bar"  # of the present design's own answers
    for slot in "AB":
        tab.ask("remove", slot=slot)


def test_the_lines_of_variants_are_seen_and_told_apart_without_colours() -> None:
    css = (pathlib.Path(afo.__file__).parent / "studio" / "page" / "studio.css").read_text(encoding="utf-8")
    lines = re.findall(r"\.curve\.[ABC] { stroke: #(\w{6}); stroke-dasharray: ([\d. ]+);", css)
    assert len({dashes for _, dashes in lines}) == 3
    linear = [[((c / 255 + 0.055) / 1.055) ** 2.4 for c in bytes.fromhex(colour)] for colour, _ in lines]
    assert np.all(1.05 / (np.array(linear) @ [0.2126, 0.7152, 0.0722] + 0.05) >= 3.0)  # WCAG 2.2, 1.4.11


@pytest.mark.skipif(not NIGHTLY, reason="half a minute of studies that have tests of their own: at night")
def test_what_to_change_bands_search_and_report(tab: Tab, studio: tuple[Studio, str]) -> None:
    tab.ask("change", sets={PRESSURE: 3.6})
    serial = tab.until("document")["serial"]
    steps = tab.until("effects", serial)["steps"]
    assert steps and all(step["text"] and step["sets"] for step in steps)
    tab.ask("bands")
    tab.until("progress")
    tab.ask("stop")
    tab.ask("bands")
    curves, design = tab.until("bands")["curves"], studio[0].document.design
    study = afo.run(design.scenario, uncertainty=200).studies["uncertainty"]["curves"]
    assert curves["toe"]["low"] == pytest.approx(
        1e3 * np.array(study["toe/height_without_floor"][0]), abs=1e-3
    )
    assert curves["ankle"]["high"] == pytest.approx(np.degrees(study["ankle/angle"][2]), abs=1e-3)
    tab.ask("search", keys={PRESSURE: [2.0, 4.2]})
    found = tab.until("found")
    low, high = (afo.load("scenario", SCENARIO, {PRESSURE: p}).supply.pressure for p in ("2 bar", "4.2 bar"))
    best = afo.load("scenario", SCENARIO, found["sets"])
    assert low <= best.supply.pressure <= high and "air" in found["text"].lower()
    tab.ask("report")
    assert status(f"{studio[1]}{tab.until('report')['file']}") == 200


@pytest.mark.slow
def test_strides_that_do_not_repeat_have_curves_with_the_run(tmp_path: pathlib.Path) -> None:
    document = opened(SCENARIO)
    document.change({"gait.variability": 0.03, "duration": "6 s"})
    told: list[dict[str, Any]] = []

    async def ask() -> None:
        engine = Engine(told.append)
        hearing = asyncio.create_task(engine.run())
        engine.want(Wish(1, document.design))
        while not told or told[-1]["kind"] != "run":
            await asyncio.sleep(0.02)
        hearing.cancel()
        engine.child.close()

    asyncio.run(ask())
    kinds = [message["kind"] for message in told]
    assert "do not repeat" in told[kinds.index("unsettled")]["text"]
    run = afo.run(document.design.scenario)
    assert told[kinds.index("settled")]["clearance"] == run.metrics["toe_clearance"].value


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="signals as on Linux and macOS")
def test_an_answer_that_crashes_or_hangs_is_told_and_the_next_one_comes(
    studio: tuple[Studio, str], tab: Tab, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, _ = studio
    tab.ask("change", sets={PRESSURE: 3.31})
    tab.until("run", tab.until("document")["serial"])
    tab.ask("search", keys={PRESSURE: [2.0, 4.2]})
    tab.until("progress")
    made.engine.child.process.send_signal(signal.SIGSEGV)
    assert "SIGSEGV" in tab.until("problem")["text"]
    tab.ask("change", sets={PRESSURE: 3.32})
    serial = tab.until("document")["serial"]
    tab.until("run", serial)
    monkeypatch.setattr("afo_sim.studio.engine._OBEYS", 1.0)
    hung = made.engine.child.process
    hung.send_signal(signal.SIGSTOP)
    tab.ask("change", sets={PRESSURE: 3.33})
    tab.until("settled", serial + 1)
    assert hung.poll() == -signal.SIGKILL and made.engine.child.process is not hung


# --- the design itself


def test_the_link_follows_its_anchor_and_a_drag_is_one_step_back() -> None:
    document = opened(SCENARIO)
    start = document.design.scenario
    for x in (64.0, 62.0, 60.0):
        document.change({AHEAD: f"{x} mm"}, join=x < 64.0)
    moved = document.design.scenario.orthosis.muscle["dorsiflexor"]
    # 60 mm ahead and 300 mm up; the insertion 10 mm below the ankle: the path at angle zero is √(Δx² + 310²)
    longer = (0.0**2 + 310.0**2) ** 0.5 - (5.0**2 + 310.0**2) ** 0.5
    link = start.orthosis.muscle["dorsiflexor"].link_length
    assert moved.link_length is not None and link is not None
    assert 1e3 * (moved.link_length - link) == pytest.approx(longer, abs=1e-3)
    document.undo()
    assert document.design.scenario == start and document.steps == (0, 1)
    document.redo()
    assert document.design.scenario.orthosis.muscle["dorsiflexor"] == moved


def test_variants_and_their_folder(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    document = opened(SCENARIO)
    document.change({PRESSURE: "3 bar"})
    document.keep()
    document.rename("A", ' "low"\n\u202e<b>\\ ')
    document.change({PRESSURE: "3.5 bar"})
    save(document, tmp_path / "mine")
    again = opened(str(tmp_path / "mine"))
    assert again.variants["A"].name == '"low" <b>\\'
    assert again.design.scenario.supply.pressure == pytest.approx(3.5e5)
    again.change({PRESSURE: "2.5 bar"})
    save(again, tmp_path / "mine")
    again.undo()  # what was saved over is not what is gone back to
    assert again.design.scenario.supply.pressure == pytest.approx(3.5e5)
    again.show("A")
    assert again.design.scenario.supply.pressure == pytest.approx(3e5)
    for name in ("thesis.txt", "scenario.toml"):  # a scenario of somebody's own hand, too
        (tmp_path / name[0]).mkdir()
        (tmp_path / name[0] / name).write_text("# mine")
        with pytest.raises(InputError, match="something else"):
            save(document, tmp_path / name[0])
    (tmp_path / "file").write_text("mine")
    before = {file: file.read_bytes() for file in (tmp_path / "mine").rglob("*") if file.is_file()}
    for wrong in (
        tmp_path / "file",
        tmp_path / "file" / "x",
        tmp_path / ("a" * 300),
        pathlib.Path("/dev/null"),
    ):
        with pytest.raises(InputError, match="cannot be written"):
            save(document, tmp_path / wrong)
    with monkeypatch.context() as full, pytest.raises(InputError, match="full"):
        full.setattr(os, "fsync", lambda _: (_ for _ in ()).throw(OSError(errno.ENOSPC, "")))
        save(document, tmp_path / "mine")
    assert before == {file: file.read_bytes() for file in (tmp_path / "mine").rglob("*") if file.is_file()}
    for wrong in ("seated", "walk-dropfoot-afoo"):
        with pytest.raises(InputError):
            opened(wrong)


@pytest.mark.parametrize("name", ["scenario.toml", "variant_A.toml", "files/gait_cycle/own.csv"])
@pytest.mark.parametrize("sealed", [True, False])
def test_a_damaged_file_of_a_saved_folder_is_named(tmp_path: pathlib.Path, name: str, sealed: bool) -> None:
    saved, own, draw = tmp_path / "saved", tmp_path / "own.csv", random.Random(SEED)
    shutil.copyfile(assets.find_gait("bovi2011_natural"), own)
    document = opened(SCENARIO)
    document.change({"gait.cycle": str(own)})
    document.keep()
    save(document, saved)
    for file in [] if sealed else saved.glob("*.toml"):
        file.write_text(without_digests(file.read_text(encoding="utf-8")), encoding="utf-8")
    content = (saved / name).read_bytes()
    for _ in range(size(4, 40)):
        at = draw.randrange(len(content))
        damaged = content[:at] + bytes([content[at] ^ 1 << draw.randrange(8)]) + content[at + 1 :]
        (saved / name).write_bytes(damaged)
        try:
            opened(str(saved))
        except InputError as error:
            assert (str(saved) if sealed else name.rpartition("/")[2]) in str(error)
        else:  # what no seal protects may be another number
            assert not sealed


def test_controls_show_what_the_scenario_says_in_the_pages_unit() -> None:
    document: Document = opened(SCENARIO)
    found = {control["key"]: control for control in controls(document.design)}
    assert (found[PRESSURE]["value"], found[PRESSURE]["unit"]) == (4.0, "bar")
    assert (found[LINK]["value"], found[LINK]["unit"]) == (112.0, "mm")
    assert found["orthosis.anchor.shank.stiffness"]["kind"] == "assumed"
    known = {key: control for key, control in found.items() if control["value"] is not None}
    sent = {key: read(key, control["value"]) for key, control in known.items()}
    again = {control["key"]: control for control in controls(document.design.changed(sent))}
    for key, control in known.items():  # what a page sends back unchanged changes nothing but who says so
        value = control["value"]
        assert again[key]["value"] == value and again[key]["source"] == "set"
        assert not isinstance(value, float) or control["low"] <= value <= control["high"]
    assert shown(PRESSURE, "335756.28 Pa") == "3.358 bar"


@pytest.mark.parametrize("port", [70000, None])
def test_a_port_that_cannot_be_had_is_one_sentence(
    studio: tuple[Studio, str], tmp_path: pathlib.Path, port: int | None
) -> None:
    taken = int(studio[1].split(":")[2].split("/")[0])
    with pytest.raises(InputError, match="port"):
        serve(SCENARIO, [], tmp_path, port=port or taken)


@pytest.mark.slow
def test_ports_are_of_this_machine_alone(studio: tuple[Studio, str]) -> None:
    port = int(studio[1].split(":")[2].split("/")[0])
    own = {info[4][0] for info in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)}
    for other in own - {"127.0.0.1"}:
        with contextlib.closing(socket.socket()) as knocking:
            assert other.startswith("127.") or knocking.connect_ex((other, port)) != 0
