"""A trial's files, recognised by what they hold."""

import itertools
import pathlib
import re

import numpy as np
import pytest
from walking import known_walk, write_angles, write_forces, write_table, write_trc

from afo_sim.common import InputError, with_code
from afo_sim.gait_lab import read_trial

SLOW, FAST = np.arange(0.0, 1.6, 0.01), np.arange(0.0, 1.6, 0.002)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """One trial in all of its files."""
    folder, walk = tmp_path_factory.mktemp("trial"), known_walk()
    write_trc(folder / "walk.trc", walk, SLOW)
    write_angles(folder / "ik.mot", walk, SLOW)
    write_forces(folder / "grf.mot", walk, FAST)
    write_table(folder / "id.sto", SLOW, {"ankle_angle_r_moment": SLOW, "knee_angle_r_moment": SLOW})
    write_table(folder / "bodies.sto", SLOW, {"talus_r_X": SLOW, "talus_r_Y": SLOW})
    model = '<?xml version="1.0"?>\n<OpenSimDocument Version="40000"><Model name="anna"/></OpenSimDocument>\n'
    (folder / "anna.osim").write_text(model)
    (folder / "loads.xml").write_text(model.replace("Model", "ExternalLoads"))
    lines = (folder / "walk.trc").read_text().splitlines()
    rows = [line.split("\t") for line in lines[6:]]
    still = ["\t".join([*row[:2], *rows[0][2:]]) for row in rows]
    (folder / "standing.trc").write_text("\n".join([*lines[:6], *still]) + "\n")
    return folder


def paths(folder: pathlib.Path, *names: str) -> list[pathlib.Path]:
    return [folder / name for name in names]


ALL = ("walk.trc", "ik.mot", "grf.mot", "id.sto", "bodies.sto", "anna.osim", "standing.trc", "loads.xml")


def test_a_picture_is_not_read_as_a_c3d(tmp_path: pathlib.Path) -> None:
    (tmp_path / "walk.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(600))
    with pytest.raises(InputError, match="is not a supported file type"):
        read_trial([tmp_path / "walk.png"])


@pytest.mark.parametrize("turn", range(8))
def test_any_order(folder: pathlib.Path, turn: int) -> None:
    trial = read_trial(paths(folder, *ALL[turn:], *ALL[:turn]))
    assert trial.angles is not None and trial.angles.file.name == "ik.mot"
    assert trial.moments is not None and trial.moments.file.name == "id.sto"
    assert trial.bodies is not None and trial.bodies.file.name == "bodies.sto"
    assert trial.markers is not None and trial.markers.file.name == "walk.trc"
    assert trial.standing is not None and trial.standing.file.name == "standing.trc"
    assert trial.model == folder / "anna.osim"
    assert len(trial.plates) == 2
    assert trial.remarks == (
        "loads.xml: is an OpenSim setup file and not needed: "
        "which foot is on which plate is found by the forces",
    )
    assert trial.warnings == ()


def test_names_do_not_matter(folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    """A .trc called .txt, forces called .csv, a model called .xml."""
    renamed = {"walk.trc": "walk.txt", "grf.mot": "grf.csv", "anna.osim": "anna.xml", "ik.mot": "ik"}
    for name, new in renamed.items():
        (tmp_path / new).write_bytes((folder / name).read_bytes())
    trial = read_trial([tmp_path / new for new in renamed.values()])
    assert trial.markers is not None and trial.angles is not None
    assert trial.model == tmp_path / "anna.xml"
    assert len(trial.plates) == 2


def test_one_standing_file_alone_is_the_trial(folder: pathlib.Path) -> None:
    trial = read_trial(paths(folder, "standing.trc"))
    assert trial.standing is None and trial.markers is not None


def test_forces_beside_joint_angles_count_if_there_are_no_others(
    folder: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    both = {f"ground_force_{n}": 700.0 + 0.0 * SLOW for n in ("vx", "vy", "px")}
    file = write_table(tmp_path / "ik.mot", SLOW, {"knee_angle_r": 30.0 * SLOW, **both})
    trial = read_trial([file])
    assert trial.angles is not None and len(trial.plates) == 1
    trial = read_trial([file, folder / "grf.mot"])
    assert len(trial.plates) == 2
    assert trial.remarks == ("ik.mot: its ground forces are not used, since grf.mot has them",)


def test_a_table_of_csv_is_recognised_by_its_columns(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("time [s],knee_angle_r [deg],ankle_angle_r_moment [N*m]\n0,1,2\n0.01,2,3\n0.02,3,4\n")
    trial = read_trial([path])
    assert trial.angles is not None and list(trial.angles.columns) == ["knee_angle_r"]
    assert trial.moments is not None and list(trial.moments.columns) == ["ankle_angle_r_moment"]


def test_all_problems_are_told_at_once(folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    (tmp_path / "notes.txt").write_text("nothing\n")
    (tmp_path / "broken.trc").write_text("hello\n" * 9)
    more = [tmp_path / "notes.txt", tmp_path / "broken.trc", tmp_path, tmp_path / "nowhere.mot"]
    with pytest.raises(InputError) as caught:
        read_trial([*paths(folder, "ik.mot", "ik.mot", "anna.osim", "anna.osim"), *more])
    for line, sentence in itertools.zip_longest(
        str(caught.value).splitlines(),
        (
            "notes.txt: is not a supported file type; allowed: .mot, .sto, .trc, .c3d",
            "broken.trc: is not laid out as a .trc file",
            "is a folder; allowed: the files of one trial",
            "nowhere.mot: cannot be read: there is no such file",
            "ik.mot: is a second file with angles",
            "anna.osim: is a second model",
        ),
    ):
        assert sentence in line


def test_what_is_read_elsewhere_is_refused_with_the_way_out(tmp_path: pathlib.Path) -> None:
    (tmp_path / "subject.b3d").write_bytes(bytes(64))
    with pytest.raises(InputError) as caught:
        read_trial([tmp_path / "subject.b3d"])
    assert "final.osim" in str(caught.value.allowed) and "_grf.mot" in str(caught.value.allowed)


def test_forces_without_their_place_are_named(folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    text = (folder / "grf.mot").read_text()
    path = tmp_path / "grf.mot"
    path.write_text(re.sub(r"_p([xyz])\b", r"_q\1", text))
    with pytest.raises(InputError, match="and not its place") as caught:
        read_trial([path])
    assert "_px, _py, _pz" in str(caught.value.allowed)


def test_plates_of_a_standing_trial_alone_are_told(folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    """Nobody walks over them; the same file's plates count where it is all there is."""
    markers = read_trial(paths(folder, "standing.trc")).markers
    assert markers is not None
    time, points = markers.time, markers.positions
    still = np.column_stack(
        [time, np.column_stack(list(points.values())), np.tile([0.0, 700.0, 0.3], (len(time), 1))]
    )
    titles = ["time [s]", *(f"{name} {axis} [m]" for name in points for axis in "xyz")]
    titles += ["plate1 fx [N]", "plate1 fy [N]", "plate1 px [m]"]
    rows = [",".join("" if np.isnan(x) else f"{x:.6f}" for x in row) for row in still]
    (tmp_path / "standing.csv").write_text("\n".join([",".join(titles), *rows]) + "\n")
    trial = read_trial([folder / "walk.trc", tmp_path / "standing.csv"])
    assert not trial.plates
    assert [notice.subject for notice in with_code(trial.notices, "plate-left-out")] == ["standing.csv"]


def test_two_walks_are_refused_and_so_are_two_files_of_plates(folder: pathlib.Path) -> None:
    with pytest.raises(InputError, match=r"walk\.trc: is a second file with markers"):
        read_trial(paths(folder, "walk.trc", "walk.trc"))
    with pytest.raises(InputError, match=r"grf\.mot: is a second file with force plates"):
        read_trial(paths(folder, "grf.mot", "grf.mot"))


def test_warnings_stand_after_the_files_name(folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    text = (folder / "walk.trc").read_text().replace("\tmm\t", "\tm\t").replace("\t160\t", "\t200\t")
    (tmp_path / "walk.trc").write_text(text)
    warnings = read_trial([tmp_path / "walk.trc"]).warnings
    assert warnings[0] == "walk.trc: has 160 frames, its header says 200: cut short?"
    assert warnings[1].startswith("walk.trc: its markers span") and "read as mm" in warnings[1]
