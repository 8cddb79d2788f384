"""Pictures of the seated scenarios and of the arms: what the viewer shows, and the figures of a run.

    python scripts/viewer_pictures.py [--out models]

Needs what `afo-sim view --screenshot` needs.
"""

import argparse
import pathlib
import tempfile

import small_png
from PIL import Image

import afo_sim
from afo_sim.show.rerun import screenshot

TIMES = (1.0, 3.5, 6.0)  # of the seated scenarios [s]
SIZE = (960, 540)  # of each picture in a row [pixel]
SCENARIOS = ("seated", "seated-antagonist", "arm", "arm-s1")


def taken(folder: pathlib.Path, at: float, size: tuple[int, int]) -> Image.Image:
    """The viewer's picture of a run at an instant."""
    place = folder / "taken.png"
    screenshot(folder / "recording.rrd", place, at)
    return Image.open(place).convert("RGB").resize(size, Image.Resampling.LANCZOS)


def in_a_row(folder: pathlib.Path) -> Image.Image:
    """The run at each of TIMES, side by side."""
    row = Image.new("RGB", (len(TIMES) * SIZE[0], SIZE[1]))
    for column, at in enumerate(TIMES):
        row.paste(taken(folder, at, SIZE), (column * SIZE[0], 0))
    return row


def overview(run: afo_sim.Recording, place: pathlib.Path) -> Image.Image:
    """The run's own overview figure."""
    afo_sim.figure(run, place, kind="overview")
    return Image.open(place).convert("RGB")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    models = pathlib.Path(__file__).resolve().parents[1] / "models"
    parser.add_argument("--out", type=pathlib.Path, default=models)
    out = parser.parse_args().out
    with tempfile.TemporaryDirectory() as name:
        runs = {scenario: afo_sim.run(scenario) for scenario in SCENARIOS}
        folders = {scenario: run.save(pathlib.Path(name) / scenario) for scenario, run in runs.items()}
        scratch = pathlib.Path(name) / "figure.png"
        pictures = {
            "scenarios/pictures/seated": in_a_row(folders["seated"]),
            "scenarios/pictures/seated-antagonist": in_a_row(folders["seated-antagonist"]),
            "orthoses/s1/seated": taken(folders["seated"], 3.5, (1280, 720)),
            "scenarios/pictures/arm": taken(folders["arm"], 4.0, (1280, 720)),
            "scenarios/pictures/overview": overview(runs["seated-antagonist"], scratch),
            "orthoses/arm_s1/arm-s1": overview(runs["arm-s1"], scratch),
        }
    for title, picture in pictures.items():
        small_png.save(picture, out / f"{title}.png")


if __name__ == "__main__":
    main()
