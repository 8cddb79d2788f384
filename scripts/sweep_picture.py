"""The sweep's picture in the README: what pressure and valve timing do to a drop foot's clearance and air.

Runs the shipped sweep `pressure-and-timing` and keeps its figure of main effects.

    python scripts/sweep_picture.py [--sweep FILE] [--runs DIR] [--out models/scenarios/pictures/sweep.png]
"""

import argparse
import pathlib
import tempfile

import small_png
from PIL import Image

from afo_sim.show import sweep_figures as show
from afo_sim.study import design, processors, read, runner, sweep_plan

METRICS = ("toe_clearance", "air_per_stride")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    place = pathlib.Path(__file__).resolve().parents[1] / "models" / "scenarios" / "pictures"
    parser.add_argument("--sweep", default="pressure-and-timing")
    parser.add_argument("--runs", type=pathlib.Path, default=pathlib.Path("runs/pressure-and-timing"))
    parser.add_argument("--out", type=pathlib.Path, default=place / "sweep.png")
    given = parser.parse_args()
    chosen = sweep_plan.read(given.sweep)
    store = runner.open_store(chosen, design.cases_of(chosen), given.runs)
    state = runner.run(store, threads=processors())
    with tempfile.TemporaryDirectory() as folder:
        drawn = show.show(read(given.runs), pathlib.Path(folder), metrics=list(METRICS))
        picture = next(path for path in drawn if path.stem.startswith("main_effects"))
        small_png.save(Image.open(picture), given.out)
    print(f"{state.cases} cases")


if __name__ == "__main__":
    main()
