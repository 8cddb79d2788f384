"""Two torque benches: a made one, whose planted numbers come back, and a published knee, whose do not.

The made one is S1's orthosis with numbers that this script plants, and the noise of a lever and a scale. It
was never measured. The knee is B. Bolen's: 185 torques of five muscles at one pressure.

    python scripts/fit_torque_bench.py [--out DIR] [--picture models/muscles/pictures/torque_knee.png]
"""

import argparse
import pathlib

import numpy as np
import small_png
from PIL import Image

import afo_sim
from afo_sim.common import assets
from afo_sim.description import Orthosis, reader, toml_text
from afo_sim.lab import (
    FEMUR_ANCHOR,
    FITTINGS,
    PIN,
    TIBIA_ANCHOR,
    Change,
    KneeTest,
    TorqueFit,
    knee_tests,
    paths,
    statics,
    torque_report,
)
from afo_sim.show import write_torque_figure

PLANTED = Change(offset=3e-3, cuff=6e3)  # [m], [N/m]
NOISE, CUFF_NOISE = 0.1, 0.5e-3  # of a reading [N·m], [m]
NOTE = (
    "# note: made by scripts/fit_torque_bench.py with a cuff of 6 kN/m and 3 mm of offset; never measured\n"
)


def made(file: pathlib.Path) -> pathlib.Path:
    """Torques of S1's orthosis at 11 angles and 3 pressures, as a CSV."""
    orthosis, rng = reader.load("orthosis", "s1"), np.random.default_rng(1)
    degrees, bar = np.tile(np.linspace(-18.0, 12.0, 11), 3), np.repeat([2.0, 3.0, 4.0], 11)
    geometry = paths(orthosis, np.radians(degrees))
    torque, pull = statics(orthosis, geometry, "dorsiflexor", 1e5 * bar, PLANTED)
    assert PLANTED.cuff is not None
    cuff = 1e3 * (pull / PLANTED.cuff + rng.normal(0.0, CUFF_NOISE, len(pull)))
    columns = (degrees, bar, torque + rng.normal(0.0, NOISE, len(torque)), cuff)
    rows = [f"{a:g},{p:g},{m:.2f},{z:.1f}" for a, p, m, z in zip(*columns, strict=True)]
    title = "angle [deg],pressure [bar],torque [N*m],cuff [mm]"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text("\n".join([NOTE + title, *rows]) + "\n", encoding="utf-8")
    return file


def knee(test: KneeTest) -> Orthosis:
    """A test of the pin knee as an orthosis: the pin stands for the ankle, the tibia for the foot."""
    forward, up = map(float, np.subtract(FEMUR_ANCHOR, PIN))
    flexor = {
        "count": 1,
        "type": test.muscle.model_dump(mode="json", exclude_none=True),
        "origin": {"segment": "shank", "from_joint": [f"{forward} m", "0 m", f"{up} m"]},
        "insertion": {
            "segment": "foot",
            "from_joint": [f"{x} m" for x in (TIBIA_ANCHOR[0], 0, TIBIA_ANCHOR[1])],
        },
        "link_length": f"{FITTINGS + test.tendon} m",
    }
    air = {"inlet": "mh1", "outlet": "mh1", "tube_volume": "4 ml", "wall_conductance": "0.5 W/K"}
    table = {"name": f"knee_{test.name}", "range_of_motion": ["-120 deg", "20 deg"]}
    return reader.load("orthosis", table | {"muscle": {"flexor": flexor}, "chamber": {"flexor": air}})


def tell(name: str, found: TorqueFit, out: pathlib.Path) -> None:
    """Print and write a fit."""
    print(f"{name}: {found!r}")
    for line in torque_report.remarks(found):
        print(f"  {line}")
    place = out / name
    place.mkdir(parents=True, exist_ok=True)
    torque_report.write(found, place, place)
    write_torque_figure(found, place)


WIDTH = 1400  # of the picture in the documents [pixel]


def main() -> None:
    """Make, fit, tell."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("runs/fit_torque_bench"))
    parser.add_argument("--picture", type=pathlib.Path)
    given = parser.parse_args()
    out = given.out
    tell("made", afo_sim.fit_torque(made(out / "made.csv"), "s1", ("offset", "cuff_stiffness")), out)
    orthoses = {name: knee(test) for name, test in knee_tests().items()}
    for name, orthosis in orthoses.items():
        place = out / "orthoses" / name
        place.mkdir(parents=True, exist_ok=True)
        text = toml_text(orthosis.model_dump(mode="json", exclude_none=True))
        (place / "orthosis.toml").write_text(text, encoding="utf-8")
    data = assets.folder("models") / "muscles" / "dmsp_10" / "pin_knee.csv"
    for name, names in (("knee", ("series_stiffness", "offset")), ("knee_stiffness", ("series_stiffness",))):
        tell(name, afo_sim.fit_torque(data, orthoses, names, hold_out="group"), out)
    if given.picture:
        drawn = Image.open(out / "knee" / "fit_torque.png").convert("RGB")
        height = round(drawn.height * WIDTH / drawn.width)
        small_png.save(drawn.resize((WIDTH, height), Image.Resampling.LANCZOS), given.picture)


if __name__ == "__main__":
    main()
