"""Exports of Vicon Nexus, Qualisys and D-Flow: the stride of the same walk in a CSV; damage is a sentence."""

import dataclasses
import pathlib
import re
from collections.abc import Callable, Mapping

import numpy as np
import pytest
from gait_lab.faulty_trials import SET
from gait_lab.known_walker import Walker
from gait_lab.laboratory import Laboratory
from gait_lab.trial_files import write_csv_forces, write_csv_markers
from kept_inputs import FOLDER, kept

from afo_sim.common import InputError
from afo_sim.gait_lab import Choices, import_gait, read_trial

Points = Mapping[str, np.ndarray]


def lines_of(table: np.ndarray, separator: str, digits: int) -> list[str]:
    return [separator.join("" if np.isnan(x) else f"{x:.{digits}f}" for x in row) for row in table]


def write_vicon(folder: pathlib.Path, lab: Laboratory, points: Points) -> list[pathlib.Path]:
    """One file of two blocks; the plates' frames are the cameras'."""
    plates, each = lab.plates(), round(lab.plate_rate / lab.rate)
    frame = 1.0 + np.arange(len(lab.time))
    table = np.column_stack([frame, 0.0 * frame, 1e3 * np.column_stack(list(points.values()))])
    lines = ["Trajectories", f"{lab.rate:g}", ",," + ",".join(f"Anna:{name},," for name in points)]
    lines += ["Frame,Sub Frame" + ",X,Y,Z" * len(points), "," + ",mm,mm,mm" * len(points)]
    lines += [*lines_of(table, ",", 3), "", "Devices", f"{lab.plate_rate:g}"]
    sample = np.arange(len(lab.plate_time))
    parts = [np.c_[p.force, 0.0 * p.force, 1e3 * p.place] for p in plates]
    table = np.column_stack([1 + sample // each, sample % each, *parts])
    lines.append(
        ",," + ",".join(f"FP {p.name} - Force,,,FP {p.name} - Moment,,,FP {p.name} - CoP,," for p in plates)
    )
    lines.append("Frame,Sub Frame" + ",Fx,Fy,Fz,Mx,My,Mz,Cx,Cy,Cz" * len(plates))
    lines.append("," + ",N,N,N,N.mm,N.mm,N.mm,mm,mm,mm" * len(plates))
    return write(folder, {"walk.csv": [*lines, *lines_of(table, ",", 3)]})


def write_qualisys(folder: pathlib.Path, lab: Laboratory, points: Points) -> list[pathlib.Path]:
    """A file of markers and one of each plate, with the foot's force on the plate."""
    table = 1e3 * np.column_stack(list(points.values()))
    head = [f"NO_OF_FRAMES\t{len(table)}", f"FREQUENCY\t{lab.rate:g}", "DESCRIPTION\t--", "DATA_INCLUDED\t3D"]
    files = {"walk.tsv": [*head, "MARKER_NAMES\t" + "\t".join(points), *lines_of(table, "\t", 3)]}
    for k, plate in enumerate(lab.plates(), 1):
        table = np.c_[-plate.force, 0.0 * plate.force, 1e3 * plate.place]
        head = [
            f"NO_OF_SAMPLES\t{len(table)}",
            f"FREQUENCY\t{lab.plate_rate:g}",
            f"FORCE_PLATE_NAME\tPlate {k}",
        ]
        for place, corner in zip(
            ("POSX_POSY", "NEGX_POSY", "NEGX_NEGY", "POSX_NEGY"), plate.corners, strict=True
        ):
            head += [
                f"FORCE_PLATE_CORNER_{place}_{axis}\t{1e3 * x:.3f}"
                for axis, x in zip("XYZ", corner, strict=True)
            ]
        titles = "\t".join(f"{kind}_{axis}" for kind in ("Force", "Moment", "COP") for axis in "XYZ")
        files[f"walk_f_{k}.tsv"] = [*head, titles, *lines_of(table, "\t", 3)]
    return write(folder, files)


CORNERS = ("POSX_POSY", "NEGX_POSY", "NEGX_NEGY", "POSX_NEGY")


def write_qualisys_local(
    folder: pathlib.Path, lab: Laboratory, points: Points, first: int = 0, mirrored: bool = False
) -> list[pathlib.Path]:
    """Each plate in its own axes, x and y from its centre towards the corners of those names, z = x × y.

    The corners are the laboratory's from `first` on, round the plate one way or the other.
    """
    files = write_qualisys(folder, lab, points)
    for file, plate in zip(files[1:], lab.plates(), strict=True):
        order = np.roll(np.arange(4)[::-1] if mirrored else np.arange(4), first)
        corners = plate.corners[order]
        x, y = corners[0] - corners[1], corners[0] - corners[3]
        axes = np.column_stack([x, y, np.cross(x, y)]) / [1.0, 1.0, np.linalg.norm(x)]
        axes /= np.linalg.norm(axes, axis=0)
        table = np.c_[
            -plate.force @ axes, 0.0 * plate.force, 1e3 * (plate.place - corners.mean(axis=0)) @ axes
        ]
        head = [line for line in file.read_text().splitlines() if re.match("[A-Z_]+\t", line)]
        head = [line for line in head if "CORNER" not in line]
        head += [
            f"FORCE_PLATE_CORNER_{place}_{axis}\t{1e3 * x:.3f}"
            for place, corner in zip(CORNERS, corners, strict=True)
            for axis, x in zip("XYZ", corner, strict=True)
        ]
        head.insert(2, "DESCRIPTION\tForce data in local (force plate) coordinates")
        titles = next(line for line in file.read_text().splitlines() if line.startswith("Force_X"))
        write(folder, {file.name: [*head, titles, *lines_of(table, "\t", 6)]})
    return files


def write_d_flow(folder: pathlib.Path, lab: Laboratory, points: Points) -> list[pathlib.Path]:
    """One file; a lost marker keeps its last place, a frame comes twice, and stamps are of its arrival."""
    held = [points[name].copy() for name in points]
    for values in held:
        for row in np.flatnonzero(np.isnan(values).any(axis=1)):
            values[row] = values[row - 1]
    late = 0.002 * np.random.default_rng(1).random(len(lab.time))
    late[[0, -1]] = 0.0
    parts = [np.c_[plate.force, plate.place] for plate in lab.plates()]
    table = np.column_stack([lab.time + late, 7.0 + np.arange(len(late)), *held, *parts])
    titles = [f"{name}.Pos{axis}" for name in points for axis in "XYZ"]
    titles += [f"FP{k}.{kind}{axis}" for k in (1, 2) for kind in ("For", "Cop") for axis in "XYZ"]
    lines = lines_of(table, "\t", 6)
    return write(
        folder, {"mocap.txt": ["TimeStamp\tFrameNumber\t" + "\t".join(titles), *lines[:9], *lines[8:]]}
    )


def write(folder: pathlib.Path, files: Mapping[str, list[str]]) -> list[pathlib.Path]:
    for name, lines in files.items():
        (folder / name).write_text("\n".join(lines) + "\n")
    return [folder / name for name in files]


# Of 0.5 µm and 0.5 mN: angles over a foot of 0.15 m, each end rounded; a moment's lever 1 µm under 10 N/kg.
ROUNDING = {
    **dict.fromkeys(("shank_angle", "knee_angle", "ankle_angle", "ankle_moment"), 1e-5),
    **dict.fromkeys(("grf_x", "grf_z"), 1e-5),
    **dict.fromkeys(("cop_x", "ankle_x", "ankle_z"), 1e-6),
}
STAMPS = 2e-4  # [s]; late by up to 2 ms, evenly spread: a line through 320 of them is off by 4e-5, five times

Writer = Callable[[pathlib.Path, Laboratory, Points], list[pathlib.Path]]
BELT = Walker().speed
CASES: dict[str, tuple[Writer, Laboratory]] = {
    "vicon": (write_vicon, Laboratory(forward="y", up="z", ideal=True)),
    "qualisys": (write_qualisys, Laboratory(forward="-x", up="z", ideal=True)),
    "d-flow": (write_d_flow, Laboratory(forward="-z", up="y", belt=BELT, plate_rate=100.0, ideal=True)),
}


def seen(lab: Laboratory) -> Points:
    """Markers, of which the first is lost for 40 ms."""
    points = {name: values.copy() for name, values in lab.markers(SET).items()}
    points[next(iter(points))][50:54] = np.nan
    return points


@pytest.mark.parametrize("kind", CASES)
def test_the_stride_is_that_of_the_same_walk_in_csv(tmp_path: pathlib.Path, kind: str) -> None:
    """Off by what rounding to 1 µm and 1 mN leaves."""
    writer, lab = CASES[kind]
    points, folder = seen(lab), tmp_path / "csv"
    folder.mkdir()
    files = [
        write_csv_markers(folder / "walk.csv", lab.time, points),
        write_csv_forces(folder / "forces.csv", lab.plates()),
    ]
    ours, theirs = (import_gait(f, Choices()) for f in (writer(tmp_path, lab, points), files))
    for name, allowed in ROUNDING.items():
        expected = np.asarray(getattr(theirs.cycle, name))
        assert getattr(ours.cycle, name) == pytest.approx(expected, rel=0.0, abs=allowed, nan_ok=True), name
    assert ours.cycle.stride_time == pytest.approx(theirs.cycle.stride_time, rel=0.0, abs=STAMPS)
    assert ours.warnings == theirs.warnings


@pytest.mark.parametrize(
    ("kind", "old", "new", "sentence"),
    [
        ("vicon", "Trajectories\n100", "Trajectories\nfast", "rate = 'fast': is not a valid rate"),
        ("vicon", "\n9.000,", "\n9.000,left", "row 9 of its table is not"),
        ("vicon", ",N,N,N,", ",V,V,V,", "has no unit"),
        ("qualisys", "\tCOP_Z", "", "has neither markers nor a whole force plate"),
        ("qualisys", "FREQUENCY\t100\n", "FREQUENCY\t0\n", "FREQUENCY = '0': is not a valid rate"),
        ("qualisys", "Plate 1", "Plate 2", "is a second file with force plates"),
        ("d-flow", "FrameNumber", "Frame", "has no TimeStamp and FrameNumber"),
        ("d-flow", "\t20.000000\t", "\t3.000000\t", "FrameNumber: time does not increase"),
    ],
)
def test_a_damaged_file_is_one_sentence(
    tmp_path: pathlib.Path, kind: str, old: str, new: str, sentence: str
) -> None:
    writer, lab = CASES[kind]
    files = writer(tmp_path, lab, seen(lab))
    file = next(file for file in files if old in file.read_text())
    file.write_text(file.read_text().replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        read_trial(files)
    assert sentence in str(caught.value) and not caught.value.others


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("first", range(4))
def test_forces_in_a_plate_s_own_axes_are_those_of_the_world(
    tmp_path: pathlib.Path, first: int, mirrored: bool
) -> None:
    """Plates turned by quarters, z down or up by the corners' way round: within what roundings leave.

    Those of 0.5 µm: of the world's place, and in two directions each of the own place, corners, their turn.
    """
    lab = dataclasses.replace(CASES["qualisys"][1], turn=0.2)
    (tmp_path / "world").mkdir()
    world = read_trial(write_qualisys(tmp_path / "world", lab, seen(lab)))
    own = read_trial(write_qualisys_local(tmp_path, lab, seen(lab), first, mirrored))
    for theirs, ours in zip(world.plates, own.plates, strict=True):
        pressed = np.linalg.norm(theirs.force, axis=1) > 20.0
        assert ours.force == pytest.approx(theirs.force, rel=0.0, abs=1e-3)
        assert ours.place[pressed] == pytest.approx(
            theirs.place[pressed], rel=0.0, abs=0.5e-6 * (1.0 + 3.0 * 2**0.5)
        )


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("CORNER_POSX_POSY_X", "CORNER", "not the four corners of a rectangle"),
        ("CORNER_NEGX_POSY", "CORNER_POSX_NEGY", "not the four corners of a rectangle"),
        ("POSX_NEGY", "NEGX_POSY", "in their order"),  # and the reverse: x and y exchanged
    ],
)
def test_own_axes_without_clear_corners_are_refused(
    tmp_path: pathlib.Path, old: str, new: str, what: str
) -> None:
    lab = CASES["qualisys"][1]
    files = write_qualisys_local(tmp_path, lab, seen(lab))
    text = files[1].read_text()
    if what == "in their order":
        text = text.replace(new, "?").replace(old, new).replace("?", old)
    else:
        text = text.replace(old, new)
    files[1].write_text(text)
    with pytest.raises(InputError) as caught:
        read_trial(files)
    assert what in str(caught.value) and "world (lab)" in str(caught.value.allowed)


@kept("qtm_local_axes")
def test_the_public_laboratory_s_kind() -> None:
    found = import_gait(sorted((FOLDER / "qtm_local_axes").glob("*.tsv")), Choices(walker="healthy"))
    assert float(np.abs(found.cycle.ankle_moment).max()) == pytest.approx(1.81, abs=0.02)
    assert found.mass.mass == pytest.approx(67.2, rel=0.01)
