"""Whole files of each kind that people bring, small, with the command that reads them, or a function."""

import functools
import os
import pathlib
import shutil
from collections.abc import Callable
from dataclasses import dataclass

from afo_sim.common import WRITTEN, assets
from afo_sim.studio.messages import MESSAGES

Make = Callable[[pathlib.Path], object]
IMPORT = ("gait", "import", "--force")
_LABORATORY = {"seconds": 2.4, "rate": 50.0, "plate_rate": 100.0}
_LENGTHS = ("--thigh", "41 cm", "--shank", "40 cm", "--ankle-height", "8 cm")
_SET = "opensim c3d"


@dataclass(frozen=True)
class Base:
    """A file in a folder with all that it needs."""

    command: tuple[str, ...]  # in the folder; none where a function reads it
    file: str  # that is damaged, or its kind where a function reads it
    make: Make  # writes the folder's files
    share: int = 4  # of a campaign, against the others'

    def path(self, folder: pathlib.Path) -> pathlib.Path:
        """The file in a folder."""
        return folder / self.file if self.command else _read(self.file, folder)[0]

    def read(self, folder: pathlib.Path) -> object:
        """What the function reads."""
        return _read(self.file, folder)[1]()


def _shipped(kind: str, name: str) -> Base:
    source = assets.find_gait(name) if kind == "gait" else assets.find(kind, name)

    def make(folder: pathlib.Path) -> None:
        for path in source.parent.iterdir():
            if path == source or (path.is_file() and source.name == f"{kind}.toml"):
                shutil.copy(path, folder)

    share = {"gait": 20, "scenario": 8, "muscle": 12, "valve": 12, "sweep": 5}.get(kind, 6)
    return Base(("check", source.name), source.name, make, share)


def _legs(folder: pathlib.Path) -> None:
    from urdf_texts import two

    limits = '<limit lower="-0.8" upper="0.5" effort="100" velocity="10"/><axis xyz="0 -1 0"/>'
    origin = '<origin xyz="0 0 -0.4" rpy="0 0 0"/><dynamics damping="0.1" friction="0.1"/>'
    (folder / "leg.urdf").write_text(two("revolute", limits + origin))
    for path in assets.find("leg", "adult_75kg").parent.iterdir():
        shutil.copy(path, folder)


def _trial(folder: pathlib.Path) -> None:
    """The known walker by markers, plates and model; and the leg of a stride by its angles."""
    import numpy as np
    from gait_lab import trial_files
    from gait_lab.laboratory import Laboratory
    from gait_lab.osim_writer import write_osim
    from walking import known_walk, write_angles, write_forces

    laboratory = Laboratory(**_LABORATORY)
    points, plates = laboratory.markers(_SET), laboratory.plates("feet")
    trial_files.write_trc(folder / "walk.trc", laboratory.time, points)
    trial_files.write_forces(folder / "grf.mot", plates)
    trial_files.write_csv_markers(folder / "markers.csv", laboratory.time, points)
    trial_files.write_csv_forces(folder / "forces.csv", plates)
    for version in (3, 4):
        write_osim(folder / f"v{version}.osim", laboratory.walker, _SET, version=version)
    time, walk = np.arange(0.0, 2.4, 0.02), known_walk()
    write_angles(folder / "ik.mot", walk, time)
    write_forces(folder / "plates.mot", walk, time)


def _c3d(folder: pathlib.Path) -> None:
    from gait_lab.c3d_writer import write_c3d
    from gait_lab.laboratory import Laboratory

    laboratory = Laboratory(**_LABORATORY)
    plates = laboratory.plates("feet")
    for kind in (2, 3, 4):
        points = laboratory.markers(_SET)
        write_c3d(folder / f"type{kind}.c3d", laboratory.time, points, plates, kind)


def _imported(file: str, *others: str, make: Make = _trial, share: int = 24) -> Base:
    return Base((*IMPORT, file, *others, "--walker", "healthy", "--out", "out.csv"), file, make, share)


def _export(kind: str, folder: pathlib.Path) -> None:
    """As a laboratory's program exports it."""
    from gait_lab import test_exports
    from gait_lab.laboratory import Laboratory

    laboratory = Laboratory(**_LABORATORY)
    write = getattr(test_exports, f"write_{kind}")
    for number, file in enumerate(write(folder, laboratory, laboratory.markers(_SET))):
        file.rename(folder / f"{number}{file.suffix}")


def _recording(folder: pathlib.Path) -> None:
    import afo_sim

    afo_sim.run("seated", {"duration": "0.1 s"}).save(folder)
    (folder / "checks.toml").write_text('[[check]]\ncolumn = "ankle/angle"\nbetween = ["-1 rad", "1 rad"]\n')


def _unsealed(folder: pathlib.Path) -> None:
    """A recording as somebody else's program writes it: without digests, which would refuse all damage."""
    import json

    import pyarrow.parquet as pq

    from afo_sim.common import read_json

    _recording(folder)
    table, file = pq.read_table(folder / "recording.parquet"), folder / "summary.json"
    facts = {key: value for key, value in table.schema.metadata.items() if key == b"afo_sim"}
    pq.write_table(table.replace_schema_metadata(facts), folder / "recording.parquet")
    summary = read_json(file)
    summary.pop("digests")
    file.write_text(json.dumps(summary))


def _measured(folder: pathlib.Path) -> None:
    """Points of a muscle, a bench's torque, a log, a log of switchings and parameters by case."""
    muscle = assets.find("muscle", "dmsp_20").parent
    shutil.copy(muscle / "characteristic.csv", folder)
    bench = [f"{a},{p},{2.0 + p - 0.05 * a}" for p in (2, 3, 4) for a in range(-20, 11, 5)]
    (folder / "bench.csv").write_text("\n".join(["angle [deg], pressure [bar], torque [N*m]", *bench]) + "\n")
    log = [f"{0.02 * k:g},{-30 + 0.1 * k:g},{0.05 * k:g}" for k in range(25)]
    title = "time [s], angle [deg], pressure dorsiflexor [bar]"
    (folder / "log.csv").write_text("\n".join([title, *log]) + "\n")
    readings = [f"{p},{0.2 + 0.64 * p:.2f}" for p in (0, 1, 2, 3, 4, 3, 2, 1, 0)]
    (folder / "readings.csv").write_text("\n".join(["reference [bar], reading [V]", *readings]) + "\n")
    (folder / "table.csv").write_text("pressure [bar], opens [ml]\n2, 5\n3, 8\n4, 3\n")
    keys = {"pressure.key": "supply.pressure", "opens.key": "orthosis.chamber.dorsiflexor.tube_volume"}
    head = 'scenario = "seated"\ndesign = "list"\nfile = "table.csv"\nmetrics = ["air_per_cycle"]\n'
    texts = [f'parameters.{name} = "{key}"\n' for name, key in keys.items()]
    (folder / "sweep.toml").write_text(head + "".join(texts))


def _read(kind: str, folder: pathlib.Path) -> tuple[pathlib.Path, Callable[[], object]]:
    from fuzz import written

    return written.files(folder)[kind]


def _all(place: pathlib.Path) -> pathlib.Path:
    """The folder with a file of every kind that is written, from which all bases of a place are copied."""
    from fuzz import written

    import afo_sim

    folder = place / ".all"
    if not folder.is_dir():
        making = place / f".all.{os.getpid()}"
        making.mkdir()
        written.make(making, afo_sim.run("seated", {"duration": "2 s"}))
        making.rename(folder)
    return folder


def _own(kind: str) -> Base:
    def make(folder: pathlib.Path) -> None:
        from fuzz import written

        shutil.copytree(_all(folder.parent), folder, dirs_exist_ok=True)
        written.unseal(written.files(folder)[kind][0])

    return Base((), kind, make)


OWN = (
    *WRITTEN, "variant", "population", "walker", "uncertainty", "gaits", "checks", "bench set", "ledger",
    "air log", "bench log", *(f"message {op}" for op in MESSAGES),
)  # fmt: skip
BASES: dict[str, Base] = {
    f"{kind} {name}": _shipped(kind, name)
    for kind, names in {
        "scenario": ("seated", "walk-dropfoot-afo", "arm"), "muscle": ("dmsp_20", "s1_215mm"),
        "orthosis": ("s1",), "leg": ("adult_75kg",), "valve": ("mh1", "mpye_m5"), "patient": ("drop-foot",),
        "search": ("placement",), "sweep": ("patients", "pressure-and-timing"), "source": ("co2_16g",),
        "tube": ("pun_4x2_6",), "regulator": ("ir2010",), "shoe": ("leather",), "limits": ("usual",),
        "sensor": ("as5048",), "uncertainty": ("usual",), "gait": ("gatk_stride1", "norm_adult"),
    }.items()
    for name in names
} | {
    "urdf": Base(("check", "leg.urdf"), "leg.urdf", _legs, 30),
    "mjcf": Base(("check", "leg.xml"), "leg.xml", _legs, 30),
    "leg and its mjcf": Base(("check", "leg.toml"), "leg.xml", _legs, 6),
    "trc": _imported("walk.trc", "grf.mot"),
    "grf.mot": _imported("grf.mot", "walk.trc"),
    "ik.mot": _imported("ik.mot", "plates.mot", *_LENGTHS),
    "osim 4": _imported("v4.osim", "walk.trc", "grf.mot", share=12),
    "osim 3": _imported("v3.osim", "walk.trc", "grf.mot", share=12),
    "osim and angles": _imported("v4.osim", "ik.mot", "plates.mot", share=12),
    "markers.csv": _imported("markers.csv", "forces.csv"),
    "forces.csv": _imported("forces.csv", "markers.csv"),
    **{f"c3d type {kind}": _imported(f"type{kind}.c3d", make=_c3d, share=3) for kind in (2, 3, 4)},
    "vicon": _imported("0.csv", make=functools.partial(_export, "vicon"), share=6),
    "qualisys": _imported("0.tsv", "1.tsv", "2.tsv", make=functools.partial(_export, "qualisys"), share=6),
    "d-flow": _imported("0.txt", make=functools.partial(_export, "d_flow"), share=6),
    "recording": Base(("check-run", ".", "checks.toml"), "recording.parquet", _unsealed, 16),
    "sealed recording": Base(("check-run", ".", "checks.toml"), "recording.parquet", _recording, 4),
    "recording's export": Base(
        ("export", ".", "--out", "out.csv", "--force"), "recording.parquet", _unsealed, 8
    ),
    "recording's report": Base(("report", ".", "--out", "out.html"), "recording.parquet", _unsealed, 1),
    "summary": Base(("check-run", ".", "checks.toml"), "summary.json", _unsealed, 2),
    "points": Base(
        ("fit", "characteristic.csv", "--law", "tondu_lopez_2000", "--hold-out", "none", "--out", "out"),
        "characteristic.csv", _measured, 8,
    ),
    "bench": Base(
        ("fit", "bench.csv", "--orthosis", "arm_s1", "--chamber", "flexor"), "bench.csv", _measured, 4
    ),
    "calibration": Base(("calibrate", "readings.csv", "--out", "own"), "readings.csv", _measured, 4),
    "log": Base(("fit", "log.csv", "--scenario", "seated"), "log.csv", _measured, 8),
    **{f"read: {kind}": _own(kind) for kind in OWN},
    "parameters.csv": Base(("check", "sweep.toml"), "table.csv", _measured, 8),
}  # fmt: skip
