"""Pictures of walking in the viewer: a drop foot without orthosis, with S1's, and with it on shorter links.

    python scripts/walk_pictures.py [--out models/scenarios/pictures]

Needs what `afo-sim view --screenshot` needs.
"""

import argparse
import pathlib
import tempfile

from PIL import Image

import afo_sim
from afo_sim.show.rerun import screenshot, write_comparison

SCENARIOS = ("walk-dropfoot", "walk-dropfoot-afo", "walk-dropfoot-afo-short")
STRIDE_TIME = 1.2033  # of the recorded stride [s]
STRIDE = 9.0  # strides walked before the one that is shown
PHASES = (0.01, 0.24, 0.50, 0.82)  # of that stride
SCENE = (0, 66, 800, 584)  # of the viewer's picture: left, top, right, bottom [pixel]
GAP = 6  # between pictures [pixel]


def moments(folders: list[pathlib.Path], scratch: pathlib.Path) -> Image.Image:
    """The scenes of each run at each phase: a row for each run."""
    wide, high = (SCENE[2] - SCENE[0]) // 2, (SCENE[3] - SCENE[1]) // 2
    size = len(PHASES) * (wide + GAP) - GAP, len(folders) * (high + GAP) - GAP
    picture = Image.new("RGB", size, "white")
    for row, folder in enumerate(folders):
        for column, phase in enumerate(PHASES):
            taken = scratch / "moment.png"
            screenshot(folder / "recording.rrd", taken, (STRIDE + phase) * STRIDE_TIME)
            scene = (
                Image.open(taken).convert("RGB").crop(SCENE).resize((wide, high), Image.Resampling.LANCZOS)
            )
            picture.paste(scene, (column * (wide + GAP), row * (high + GAP)))
    return picture


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    place = pathlib.Path(__file__).resolve().parents[1] / "models" / "scenarios" / "pictures"
    parser.add_argument("--out", type=pathlib.Path, default=place)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        scratch = pathlib.Path(name)
        folders = [
            afo_sim.run(scenario, {"duration": "14.4 s"}).save(scratch / scenario) for scenario in SCENARIOS
        ]
        drawn = moments(folders, scratch)
        both = scratch / "both.rrd"
        write_comparison([folders[-1], folders[0]], both)
        screenshot(both, scratch / "both.png", (STRIDE + 0.80) * STRIDE_TIME)
        compared = (
            Image.open(scratch / "both.png").convert("RGB").resize((1280, 720), Image.Resampling.LANCZOS)
        )
    for title, picture in (("walk-moments", drawn), ("walk-compared", compared)):
        few = picture.quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
        few.save(given.out / f"{title}.png", optimize=True)
        print(f"written to {given.out / title}.png")


if __name__ == "__main__":
    main()
