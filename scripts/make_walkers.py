"""Make gait_data/bovi2011_*.csv and gait_data/opensim_walk.csv, and draw all shipped walkers.

    python scripts/make_walkers.py [FOLDER] [--opensim FOLDER] [--out gait_data] [--picture walkers.png]

FOLDER holds the typed figures of Bovi 2011, `bovi2011_adult_{xs,s,natural,m,l}.csv`. Without it the published
columns are taken from the files that are shipped, and what is derived is derived anew. --opensim names the
folder of OpenSim's example of overground walking (OpenSim/Examples/Moco/example3DWalking), for that stride.
The strides of GaitAnalysisToolKit are made by make_gait_data.py.
"""

import argparse
import dataclasses
import pathlib
from typing import Any

import numpy as np
from derived_path import FootShape, resampled, with_derived_path

from afo_sim.gait import (
    DEGREE,
    STANCE_FORCE,
    Chain,
    GaitCycle,
    at_speed,
    examine,
    findings,
    stance,
    write,
)
from afo_sim.gait import norm as gait_norm
from afo_sim.gait.file import read

GAIT_DATA = pathlib.Path(__file__).resolve().parents[1] / "gait_data"
HEIGHT = 1.71  # of the mean adult, by speed over speed per height [m]
ANKLE_HEIGHT = 0.080  # midpoint of the malleoli, 79 to 82 mm of four recorded strides of one adult [m]
MASS = 68.5  # of the mean adult [kg]
# By task: words, stride length over height [-], cadence [steps/min], as published.
TASKS = {
    "xs": ("very slow", 0.675, 87.7),
    "s": ("slow", 0.764, 109.7),
    "natural": ("natural", 0.777, 109.8),
    "m": ("fast", 0.851, 123.2),
    "l": ("very fast", 0.981, 141.2),
}
SOURCE = "Bovi, Rabuffetti, Mazzoleni, Ferrarin 2011, Gait Posture 33(1):6-13"
LICENCE = "figures typed from the article's supplement (mmc3.xls; © Elsevier), as facts with the citation"
# Typed column: (field, factor to the field's unit and sign).
TYPED = {
    "shank_deg": ("shank_angle", DEGREE),
    "knee_deg": ("knee_angle", DEGREE),
    "ankle_df_deg": ("ankle_angle", DEGREE),
    "grf_ap_bw": ("grf_x", 1.0),
    "grf_v_bw": ("grf_z", 1.0),
    "ankle_pf_moment_nm_kg": ("ankle_moment", -1.0),
}
NOTES = {
    "family": "bovi2011",
    "published": "mean curves every 2 %, splines between them: shank, knee and ankle angle (their difference "
    "between 0 and 100 % taken out; ankle zero where the foot is flat), ground force, ankle moment; stride "
    "length per body height, cadence",
    "derived": "ankle_x_m and ankle_z_m (foot on the floor in stance, leg chain from the hip in swing), "
    "cop_x_m (moment and force), body_height_m, walking_speed_m_per_s",
    "assumed": f"body_mass_kg (forces and moments are per mass), ankle_height_m (measured on one adult), "
    f"thigh {0.245 * HEIGHT:.3f} m and shank {0.246 * HEIGHT:.3f} m (Winter 2009), the derived foot is bare",
    "error": "of the path's method on recorded strides of three adults, mean difference apart: height 4 to "
    "6 mm RMS, 16 mm at most; way 3 to 12 mm RMS, 24 mm at most",
}
MOCO = ("markers_walk.trc", "grf_walk.mot", "subject_walk_scaled.osim")
WALKERS = ("gatk_mean", "opensim_walk", *(f"bovi2011_{task}" for task in TASKS))  # of the picture
ANKLE_SD = 6.0  # between people: the article's is some 4 to 8 [deg]
MOMENT_SD = 0.2  # between people, assumed [N·m/kg]
SHADES = (0.92, 0.72, 0.5, 0.28, 0.0)  # of the mean curves, slow to fast [-]
ONE_PERSON = ("#D55E00", "#000000")


def typed(file: pathlib.Path) -> dict[str, np.ndarray]:
    """Columns of a typed table, smooth and closed, in the units of `GaitCycle`."""
    table = np.genfromtxt(file, delimiter=",", names=True)
    curves = {field: table[name] * factor for name, (field, factor) in TYPED.items()}
    return resampled(table["pct"] / 100.0, curves)


def mean_adult(task: str, columns: dict[str, np.ndarray]) -> GaitCycle:
    """The mean adult of Bovi 2011 in one task, with the ankle's path and the centre of pressure derived."""
    words, length, cadence = TASKS[task]
    stride_time = 120.0 / cadence
    speed = length * HEIGHT / stride_time
    nothing = np.zeros_like(columns["phase"])
    facts: dict[str, Any] = dict.fromkeys(("ankle_x", "ankle_z", "cop_x"), nothing) | columns
    cycle = GaitCycle(
        source=SOURCE,
        licence=LICENCE,
        side="right",
        stride_time=stride_time,
        body_mass=MASS,
        walking_speed=speed,
        ankle_height=ANKLE_HEIGHT,
        body_height=HEIGHT,
        sole_thickness=0.0,
        walker="healthy",
        notes={
            "description": f"mean curve of 20 adults, {words}, {speed:.2f} m/s; ankle path derived",
            "mean": f"curve of 20 adults, {words}; ankle path and centre of pressure derived",
            **NOTES,
        },
        **facts,
    )
    return with_derived_path(cycle, FootShape.of_height(HEIGHT, ANKLE_HEIGHT), Chain.of_height(HEIGHT))


def overground(folder: pathlib.Path) -> GaitCycle:
    """The right stride of OpenSim's example of overground walking, its model posed over its markers."""
    from afo_sim.gait_lab import Choices, import_gait

    source = "opensim-org/opensim-core, OpenSim/Examples/Moco/example3DWalking, commit 0435b081"
    done = import_gait(
        [folder / name for name in MOCO],
        Choices(side="right", walker="healthy", cutoff=6.0, source=source, licence="Apache-2.0"),
    )
    points = done.legs["right"].points
    hip, knee, ankle = (points[name].path for name in ("hip", "knee", "ankle"))
    lengths = [float(np.nanmean(np.linalg.norm(a - b, axis=1))) for a, b in ((hip, knee), (knee, ankle))]
    height = (sum(lengths) + done.cycle.ankle_height) / 0.530
    notes = {
        "description": f"healthy adult overground at {done.cycle.walking_speed:.2f} m/s, right stride",
        **done.cycle.notes,
        "published": "markers, ground force and the scaled model, which the columns are derived from",
        "height_from": "derived, ±0.06 m: the model's hip over straight legs / 0.530",
    }
    return dataclasses.replace(done.cycle, notes=notes, body_height=round(height, 2))


def save(name: str, cycle: GaitCycle, folder: pathlib.Path) -> None:
    """Examine and write a stride, and print what it is."""
    examine(cycle)
    path = folder / f"{name}.csv"
    write(path, cycle)
    print(f"\n{path}")
    for what, found in findings(cycle):
        print(f"  {what}: {found}")


def share_between(values: np.ndarray, low: np.ndarray, high: np.ndarray) -> str:
    """In per cent."""
    return f"{100.0 * np.mean((values >= low) & (values <= high)):.0f} %"


def compare(folder: pathlib.Path) -> None:
    """Print where each walker lies: in the norm's band, and about the mean adult at its own speed."""
    norm, phase = gait_norm.read(), np.linspace(0.0, 1.0, 401)[:-1]
    low, high = (norm.at(name, phase) for name in ("ankle_low", "ankle_high"))
    about = f"moment in stance about it: RMS, share in ±{MOMENT_SD:g}, peaks"
    print("\nankle in the norm's band; mean offset to the norm, and the share without it; the same about the")
    print(f"mean adult at that speed ±{ANKLE_SD:g} deg; {about}")
    for name in ("gatk_stride1", "gatk_stride2", *WALKERS):
        cycle = read(folder / f"{name}.csv")
        angle = cycle.signal("ankle_angle", phase)
        offset = float(np.mean(angle - norm.at("ankle_angle", phase)))
        told = [share_between(angle, low, high), f"{np.degrees(offset):+.1f} deg"]
        told.append(share_between(angle - offset, low, high))
        if name.startswith("bovi"):
            print(name, *told, sep=" | ")
            continue
        adult = at_speed(folder / "bovi2011_s.csv", cycle.walking_speed)
        mean = adult.signal("ankle_angle", phase)
        offset = float(np.mean(angle - mean))
        band = np.radians(ANKLE_SD)
        told += [share_between(angle, mean - band, mean + band), f"{np.degrees(offset):+.1f} deg"]
        told.append(share_between(angle - offset, mean - band, mean + band))
        on = cycle.grf_z > STANCE_FORCE
        found = -cycle.ankle_moment[on]
        expected = -np.interp(cycle.phase, adult.phase, adult.ankle_moment)[on]
        told.append(f"{np.sqrt(np.mean((found - expected) ** 2)):.2f} N·m/kg")
        told.append(share_between(found, expected - MOMENT_SD, expected + MOMENT_SD))
        told.append(f"{found.max():.2f} for {expected.max():.2f}")
        print(name, *told, sep=" | ")


def draw(folder: pathlib.Path, path: pathlib.Path) -> None:
    """All walkers: ankle angle and moment with the norm's band, height and way of the ankle."""
    import matplotlib.pyplot as plt
    import small_png
    from PIL import Image

    from afo_sim.show import NORM

    figure, axes = plt.subplots(2, 2, figsize=(9.0, 7.2), layout="constrained")
    norm, fine = gait_norm.read(), np.linspace(0.0, 1.0, 401)
    band = {"color": NORM, "lw": 0.0, "label": "published means"}
    angles = (np.degrees(norm.at(name, fine)) for name in ("ankle_low", "ankle_high"))
    axes[0, 0].fill_between(100 * fine, *angles, **band)
    thin = {"color": NORM, "lw": 2.5}  # two means, often alike
    moments = (-norm.at(name, fine) for name in ("moment_low", "moment_high"))
    axes[0, 1].fill_between(100 * fine, *moments, **thin)
    for number, name in enumerate(WALKERS):
        cycle = read(folder / f"{name}.csv")
        family = name.startswith("bovi")
        colour = plt.get_cmap("viridis")(SHADES[number - 2]) if family else ONE_PERSON[number]
        default = name == "bovi2011_natural"
        look = {"color": colour, "lw": 2.4 if default else 1.4, "ls": "-" if family else "--"}
        percent, label = 100.0 * cycle.phase, f"{name}, {cycle.walking_speed:.2f} m/s"
        axes[0, 0].plot(percent, np.degrees(cycle.ankle_angle), label=label, **look)
        axes[0, 1].plot(percent, -cycle.ankle_moment, **look)
        axes[1, 0].plot(percent, 1e3 * (cycle.ankle_z - cycle.ankle_height), **look)
        length = cycle.ankle_x[-1]
        lead = 100.0 * (cycle.ankle_x - np.interp(0.25, cycle.phase, cycle.ankle_x)) / length
        axes[1, 1].plot(percent, lead, **look)
        off = stance(cycle)
        height = np.interp(off, cycle.phase, cycle.ankle_z) - cycle.ankle_height
        axes[1, 0].plot(100 * off, 1e3 * height, "o", ms=3, color=colour)
    axes[0, 0].set_ylabel("ankle angle [deg]\ndorsiflexion +")
    axes[0, 1].set_ylabel("ankle moment [N·m/kg]\nplantarflexion +")
    axes[1, 0].set_ylabel("ankle above where it is\nwith the foot flat [mm]")
    axes[1, 1].set_ylabel("ankle's way from 25 % on\n[% of stride length]")
    titles = {(0, 0): "dashed: one person; full: mean curves", (1, 1): "likewise"}
    titles[1, 0] = "dashed: recorded; full: derived; dot: toe-off"
    for place, what in titles.items():
        axes[place].set_title(what, fontsize=9, loc="right")
    for axis in axes.flat:
        axis.set(xlabel="stride [%]", xlim=(0, 100))
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=8)
    figure.savefig(path, dpi=110, format="png")
    small_png.save(Image.open(path), path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folder", nargs="?", type=pathlib.Path, help="of the typed figures")
    parser.add_argument("--opensim", type=pathlib.Path, help="folder of OpenSim's overground walk")
    parser.add_argument("--out", type=pathlib.Path, default=GAIT_DATA)
    parser.add_argument("--picture", type=pathlib.Path, help="draw the walkers of --out")
    given = parser.parse_args()
    for task in TASKS:
        if given.folder is not None:
            columns = typed(given.folder / f"bovi2011_adult_{task}.csv")
        else:
            cycle = read(GAIT_DATA / f"bovi2011_{task}.csv")
            columns = {
                name: getattr(cycle, name) for name in ("phase", *(field for field, _ in TYPED.values()))
            }
        save(f"bovi2011_{task}", mean_adult(task, columns), given.out)
    if given.opensim is not None:
        save("opensim_walk", overground(given.opensim), given.out)
    if given.picture is not None:
        compare(given.out)
        draw(given.out, given.picture)


if __name__ == "__main__":
    main()
