"""The studio's film, made by the driver of its tests, and how fast the page answers.

    python scripts/studio_film.py [--out docs/studio.gif] [--latency EVENTS]

The film: the pressure falls until the toe trips, an anchor is dragged, a valve opens earlier. With --latency
none is made; three controls are dragged at ten events a second instead, and the time from each event to the
drawn curves is printed. Needs Chromium.
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
ANCHOR = '[data-key="orthosis.muscle.dorsiflexor.insertion.from_ankle"]'
OPENS = '[data-grip="phases.dorsiflexor.inlet 0 0"]'
DRAGS = ((PRESSURE, -34.0, 0.0, 14), (ANCHOR, 14.0, 0.0, 10), (OPENS, -16.0, 0.0, 10))  # by [pixel], frames
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
        for selector in (PRESSURE, ANCHOR, OPENS):
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "docs" / "studio.gif")
    parser.add_argument("--latency", type=int, default=0)
    given = parser.parse_args()
    if given.latency:
        latency(given.latency)
    else:
        film(given.out)


if __name__ == "__main__":
    main()
