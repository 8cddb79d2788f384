"""The studio's film, made by the driver of its tests, and how fast the page answers.

    python scripts/studio_film.py [--out docs/studio.gif] [--latency EVENTS] [--session FILE ...]

The film: the pressure falls until the toe trips, an anchor is dragged, a valve opens earlier. With --latency
none is made; four controls are dragged at ten events a second instead, and the time from each event to the
drawn curves is printed. With --session a clinician's session with the files of a trial is timed step by step,
and its pictures and the printed report are written to the folder of --out. Needs Chromium.
"""

import argparse
import base64
import importlib
import io
import pathlib
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from PIL import Image

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))
SIZE, WIDE = (1280, 860), 900  # of the page, and of the film [pixel]
RESTS = "document.getElementById('verdict').ariaBusy === 'false'"
PRESSURE = '[data-key="supply.pressure"][type="range"]'
ANCHOR = '[data-key="orthosis.muscle.dorsiflexor.insertion.from_joint"]'
MASS = '[data-key="patient.body_mass"][type="range"]'
OPENS = '[data-grip="phases.dorsiflexor.inlet 0 0"]'
DRAGS = ((PRESSURE, -34.0, 0.0, 14), (ANCHOR, 14.0, 0.0, 10), (OPENS, -16.0, 0.0, 10))  # by [pixel], frames
LEAD = "document.getElementById('lead').textContent"
COLOURS, FRAME, MOST = 160, 180, 1_500_000  # of a frame, its length [ms], of the file [bytes]


@contextmanager
def studio() -> Iterator[Any]:
    """The page at rest in a browser, with a server of its own."""
    browser = importlib.import_module("browser")  # of the tests
    with tempfile.TemporaryDirectory() as folder:
        words = [sys.executable, "-m", "afo_sim", "studio", "--no-browser", "--out", f"{folder}/saved"]
        server = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
        assert server.stdout is not None
        page = browser.Browser(pathlib.Path(folder) / "profile")
        page.resize(*SIZE)
        page.open(server.stdout.readline().split()[-1])
        page.wait(RESTS, 120.0)
        yield page
        page.close()
        server.terminate()
        server.wait()


def middle(page: Any, selector: str) -> tuple[float, float]:
    """Of an element's handle, after it is scrolled into view [pixel]."""
    box = page.run(
        f"(() => {{ const one = document.querySelector({selector!r});"
        " one.scrollIntoView({block: 'center'});"
        " const box = one.getBoundingClientRect(), share = one.type === 'range'"
        " ? (one.value - one.min) / (one.max - one.min) : 0.5;"
        " return [box.x + 8 + share * (box.width - 16), box.y + box.height / 2] })()"
    )
    return box[0], box[1]


def picture(page: Any) -> Image.Image:
    """What the window shows, as wide as the film."""
    shot = Image.open(io.BytesIO(base64.b64decode(page.ask("Page.captureScreenshot")["data"]))).convert("RGB")
    return shot.resize((WIDE, WIDE * shot.height // shot.width), Image.Resampling.LANCZOS)


def film(out: pathlib.Path) -> None:
    """Write the film."""
    with studio() as page:
        frames = [picture(page)] * 5
        for selector, across, down, steps in DRAGS:
            x, y = middle(page, selector)
            page.mouse((x, y), release=False)
            for share in np.linspace(0.0, 1.0, steps):
                page.mouse_to((x + share * across, y + share * down))
                time.sleep(0.15)
                frames.append(picture(page))
            page.mouse_up((x + across, y + down))
            page.wait(RESTS, 60.0)
            frames += [picture(page)] * 8
    palette = frames[12].quantize(COLOURS)
    first, *others = (frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    first.save(out, save_all=True, append_images=others, duration=FRAME, loop=0, optimize=True)
    if out.stat().st_size > MOST:
        raise SystemExit(f"{out} is too large: {out.stat().st_size} bytes, allowed {MOST}")


def latency(events: int) -> None:
    """Print median and 95th percentile from event to drawn curves."""
    with studio() as page:
        for selector in (PRESSURE, ANCHOR, OPENS, MASS):
            page.run("window.studioLatency.length = 0")
            x, y = middle(page, selector)
            page.mouse((x, y), release=False)
            for k in range(events):
                page.mouse_to((x - 20.0 + 40.0 * abs((k / 25.0) % 2.0 - 1.0), y))
                time.sleep(0.1)
            page.mouse_up((x, y))
            page.wait(RESTS, 60.0)
            found = np.array(page.run("window.studioLatency"))
            half, most = np.percentile(found, [50, 95])
            print(f"{selector}: {len(found)} answers, median {half:.0f} ms, 95 % {most:.0f} ms")


def enter(page: Any, key: str, typed: str) -> None:
    """Type a number into the field of a key, and wait for the verdict."""
    page.run(f"document.querySelector('input[inputmode][data-key=\"{key}\"]').select()")
    page.ask("Input.insertText", text=typed)
    page.press("Enter")
    page.wait("document.getElementById('verdict').ariaBusy === 'true'")
    page.wait(RESTS, 60.0)


def session(files: list[pathlib.Path], out: pathlib.Path) -> None:
    """Print the seconds of each step of a clinician's session; write pictures and the printed report."""
    out.mkdir(parents=True, exist_ok=True)
    begun = time.perf_counter()

    def step(words: str) -> None:
        nonlocal begun
        print(f"{time.perf_counter() - begun:6.1f} s  {words}", flush=True)
        begun = time.perf_counter()

    def shoot(page: Any, name: str) -> None:
        (out / name).write_bytes(base64.b64decode(page.ask("Page.captureScreenshot")["data"]))

    with studio() as page:
        step("the studio starts, and the first design is judged")
        root = page.ask("DOM.getDocument")["root"]["nodeId"]
        node = page.ask("DOM.querySelector", nodeId=root, selector="#files")["nodeId"]
        page.ask("DOM.setFileInputFiles", nodeId=node, files=[str(file.resolve()) for file in files])
        page.run("document.querySelector('[name=walker][value=healthy]').checked = true")
        page.run("document.getElementById('import').click()")
        page.wait(
            "!document.getElementById('imported').hidden || !document.getElementById('trial-problem').hidden",
            120.0,
        )
        assert page.run("document.getElementById('trial-problem').hidden"), "the trial was not read"
        page.wait(RESTS, 60.0)
        step("the trial is read, and its walk is judged")
        for key, typed in (("patient.body_mass", "92"), ("supply.pressure", "3.5")):
            enter(page, key, typed)
            step(f"{key} is {typed}, and the verdict is there: {page.run(LEAD)}")
        page.run("document.getElementById('report').click()")
        page.wait("!document.getElementById('open-report').hidden", 120.0)
        step("the report is there, after one click")
        for pressure in ("3.8", "4.2", "4.6"):
            page.run("document.getElementById('keep').click()")
            page.wait("document.getElementById('keep').disabled")
            enter(page, "supply.pressure", pressure)
        step("three variants are kept, and another design is judged")
        page.run("document.getElementById('bands').click()")
        page.wait("document.querySelector('.band.drawn')", 200.0)
        step("bands are drawn")
        for width in (400, 1280):
            page.resize(width)
            for part in ("walk", "plots", "compare", "verdict"):
                page.run(f"document.getElementById('{part}').scrollIntoView()")
                time.sleep(0.2)
                shoot(page, f"{width}_{part}.png")
        begun = time.perf_counter()
        page.open(page.run("new URL('report.html', location.href).href"))
        printed = page.ask("Page.printToPDF", preferCSSPageSize=True, printBackground=True)
        (out / "report.pdf").write_bytes(base64.b64decode(printed["data"]))
        step("the report is printed")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "docs" / "studio.gif")
    parser.add_argument("--latency", type=int, default=0)
    parser.add_argument("--session", type=pathlib.Path, nargs="+", default=[], metavar="FILE")
    given = parser.parse_args()
    if given.session:
        session(given.session, given.out)
    elif given.latency:
        latency(given.latency)
    else:
        film(given.out)


if __name__ == "__main__":
    main()
