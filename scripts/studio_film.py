"""The studio's film: a pressure falls until the toe trips, an anchor is dragged, the inlet opens earlier.

    python scripts/studio_film.py docs/studio.gif

A browser without a window drags on the page of `afo-sim studio`. The mouse is drawn: no screenshot shows it.
"""

import base64
import io
import json
import pathlib
import re
import subprocess
import sys
import tempfile

from PIL import Image, ImageDraw

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "helpers"))

from browser import Browser  # type: ignore[import-not-found]  # noqa: E402

PAGE, FILM, COLOURS = (1280, 860), (900, 604), 64
QUICK, SLOW = 180, 1400  # a picture stands for [ms]
ARROW = [(0, 0), (0, 17), (4, 13), (7, 20), (10, 19), (7, 12), (12, 12)]
RESTS = "document.getElementById('verdict').ariaBusy === 'false'"
PHASE = "document.getElementById('phase')"
MOUSE_AT_REST = (640.0, 850.0)
PRESSURE = '[data-key="supply.pressure"][type="range"]'
INSERTION = '[data-key="orthosis.muscle.dorsiflexor.insertion.from_joint"]'
OPENS = '[data-grip="phases.dorsiflexor.inlet 0 0"]'


class Film:
    """Pictures of a page, each with the time for which it stands [ms]."""

    def __init__(self, page: Browser) -> None:
        self.page, self.pictures, self.times = page, list[Image.Image](), list[int]()

    def shoot(self, mouse: tuple[float, float], time: int) -> None:
        """One more picture."""
        shot = base64.b64decode(self.page.ask("Page.captureScreenshot", format="png")["data"])
        picture = Image.open(io.BytesIO(shot)).convert("RGB")
        pen = ImageDraw.Draw(picture)
        pen.polygon([(mouse[0] + x, mouse[1] + y) for x, y in ARROW], fill="black", outline="white")
        self.pictures.append(picture.resize(FILM, Image.Resampling.LANCZOS))
        self.times.append(time)

    def drag(self, group: str, what: str, way: tuple[float, float], count: int) -> None:
        """Drag what is in a group by a way [CSS pixel], and wait for the verdict."""
        groups = "[...document.querySelectorAll('.group')]"
        self.page.run(f"{groups}.forEach(one => (one.open = one.id === '{group}'))")
        box = self.page.run(
            f"(() => {{ const one = document.querySelector({json.dumps(what)});"
            " one.scrollIntoView({block: 'center'}); const box = one.getBoundingClientRect();"
            " const share = one.type === 'range' ? (one.value - one.min) / (one.max - one.min) : 0.5;"
            " return [box.x + 8 + share * (box.width - 16), box.y + box.height / 2] })()"
        )
        place = (box[0], box[1])
        self.shoot(place, QUICK)
        self.page.mouse(place, release=False)
        for k in range(1, count + 1):
            place = (box[0] + way[0] * k / count, box[1] + way[1] * k / count)
            self.page.mouse_to(place)
            self.page.run("new Promise(done => setTimeout(done, 250))")
            self.page.wait("!document.body.classList.contains('computing')", 60.0)
            self.shoot(place, QUICK)
        self.page.mouse_up(place)
        self.page.wait(RESTS, 120.0)
        self.shoot(place, SLOW)

    def save(self, out: pathlib.Path) -> None:
        """Write it as a GIF, in the page's colours and those of two pictures."""
        strip = Image.new("RGB", (FILM[0], 2 * FILM[1]))
        for k, picture in enumerate((self.pictures[0], self.pictures[len(self.pictures) // 3])):
            strip.paste(picture, (0, k * FILM[1]))
        css = (ROOT / "afo_sim" / "studio" / "page" / "studio.css").read_text(encoding="utf-8")
        light = css.partition("@media")[0]  # its names for colours
        own = [int(part, 16) for hexes in re.findall(r"#(\w\w)(\w\w)(\w\w);", light) for part in hexes]
        palette = Image.new("P", (1, 1))
        palette.putpalette(own + (strip.quantize(COLOURS).getpalette() or [])[: 3 * COLOURS])
        first, *others = (one.quantize(palette=palette, dither=Image.Dither.NONE) for one in self.pictures)
        first.save(out, save_all=True, append_images=others, duration=self.times, loop=0, optimize=True)


def main(out: pathlib.Path) -> None:
    """Serve the page, film it, and write the film."""
    with tempfile.TemporaryDirectory() as folder:
        words = ["-m", "afo_sim", "studio", "--no-browser", "--out", f"{folder}/saved"]
        server = subprocess.Popen([sys.executable, *words], stdout=subprocess.PIPE, text=True)
        assert server.stdout is not None
        page = Browser(pathlib.Path(folder) / "profile")
        try:
            page.resize(*PAGE)
            page.open(server.stdout.readline().split()[-1])
            page.wait(RESTS, 120.0)
            page.run(f"(one => {{ one.value = 84; one.oninput() }})({PHASE})")
            film = Film(page)
            film.shoot(MOUSE_AT_REST, SLOW)
            film.drag("air", PRESSURE, (-48.0, 0.0), 9)
            page.run("document.getElementById('undo').click()")
            page.wait(f"document.getElementById('undo').disabled && {RESTS}", 120.0)
            film.drag("device", INSERTION, (22.0, -4.0), 9)
            film.drag("timing", OPENS, (-45.0, 0.0), 9)
            film.save(out)
        finally:
            page.close()
            server.terminate()


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
