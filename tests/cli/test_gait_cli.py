"""`afo-sim gait import` and `gait show`: files, messages, and what they refuse."""

import os
import pathlib
import re
import shlex
import subprocess
import sys
import textwrap
from typing import Any

import numpy as np
import pytest
from campaign import nightly
from command import Call
from documents import PAGES
from gait_lab.patients import LameWalker, Patient, laboratory
from gait_lab.trial_files import write_forces as patients_forces
from gait_lab.trial_files import write_trc as patients_trc
from walking import known_walk, write_angles, write_forces, write_trc

from afo_sim import cli, show
from afo_sim.common import InputError, assets
from afo_sim.gait import KINEMATICS, GaitCycle
from afo_sim.gait import file as gait
from afo_sim.gait_lab.readers.csv_trial import read_csv_trial
from afo_sim.simulation import read_recording

ROOT = pathlib.Path(__file__).parents[2]
GAIT_DATA = ROOT / "gait_data"
IMPORT = ("gait", "import", "--walker", "healthy")


@pytest.fixture(scope="module")
def trial(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    folder = tmp_path_factory.mktemp("trial")
    walk = known_walk()
    slow, fast = np.arange(0.0, 3.2, 0.01), np.arange(0.0, 3.2, 0.001)
    files = [
        write_angles(folder / "walk_ik.mot", walk, slow),
        write_forces(folder / "walk_grf.mot", walk, fast),
        write_trc(folder / "walk.trc", walk, slow),
    ]
    return [str(file) for file in files]


@pytest.mark.slow
def test_import_writes_a_cycle_and_its_picture(trial: list[str], tmp_path: pathlib.Path, call: Call) -> None:
    out = tmp_path / "mine" / "walk.csv"
    facts = (
        "--source",
        "my laboratory, trial 3",
        "--licence",
        "CC0",
        "--height",
        "172 cm",
        "--sole",
        "25 mm",
    )
    code, printed, complaint = call(*IMPORT, *trial, "--out", str(out), "--mass", "67.2 kg", *facts)
    assert code == 0, complaint
    assert "1 of 2 right (1_ground_force)" in printed or "2 of 2 right (1_ground_force)" in printed
    assert printed.startswith("right stride 1 of ")
    assert {p.name for p in out.parent.iterdir()} == {"walk.csv", "walk.png"}
    assert (out.parent / "walk.png").read_bytes().startswith(b"\x89PNG")
    cycle = gait.read(out)
    assert (cycle.source, cycle.licence, cycle.body_mass) == ("my laboratory, trial 3", "CC0", 67.2)
    assert cycle.walker == "healthy"
    assert (cycle.body_height, cycle.sole_thickness) == (pytest.approx(1.72), pytest.approx(0.025))
    for command in (("check", str(out)), ("gait", "show", str(out))):
        code, printed, complaint = call(*command)
        assert code == 0, complaint
        assert "1.72 m" in printed and "25 mm under the ankle" in printed
    picture = tmp_path / "again.pdf"
    assert call("gait", "show", str(out), "--out", str(picture))[0] == 0
    assert picture.read_bytes().startswith(b"%PDF")


def test_whose_walk_it_is_is_asked_before_anything_is_read(call: Call) -> None:
    """In one sentence that says what each answer does; a list of markers needs no answer."""
    code, _, complaint = call("gait", "import", "not_there.c3d", "--out", "x.csv")
    assert code == 2 and complaint.count("\n") == 1
    assert "--walker" in complaint and "healthy (" in complaint and "patient (" in complaint
    both = ("--walker", "patient", "--side", "both")
    code, _, complaint = call("gait", "import", "not_there.c3d", "--out", "x.csv", *both)
    assert code == 2 and "--side = 'both'" in complaint and "each, or right or left" in complaint
    code, _, complaint = call("gait", "import", "not_there.c3d", "--write-map", "roles.toml")
    assert code == 2 and "walker" not in complaint and "not_there" in complaint


@pytest.mark.usefixtures("blank")
@pytest.mark.slow
def test_a_doubtful_mass_is_a_warning_and_none_is_an_estimate(
    trial: list[str], tmp_path: pathlib.Path, call: Call
) -> None:
    """The walk is that of 67.2 kg, and its right foot alone is seen."""
    out = str(tmp_path / "x.csv")
    code, printed, complaint = call(*IMPORT, *trial, "--out", out, "--mass", "76 kg")
    assert code == 0, complaint
    warnings = [line for line in printed.splitlines() if line.startswith("warning: ")]
    assert any("76.0 kg" in line for line in warnings)
    assert gait.read(out).warnings == tuple(line.removeprefix("warning: ") for line in warnings)
    for command in (("check", out), ("gait", "show", out)):
        code, again, complaint = call(*command)
        assert code == 0, complaint
        assert "warning 1" in again and "76.0 kg" in again
    before = (tmp_path / "x.csv").read_bytes()
    code, _, complaint = call(*IMPORT, *trial, "--out", out)
    assert code == 2 and "is there already" in complaint and "--force" in complaint
    assert (tmp_path / "x.csv").read_bytes() == before
    code, printed, complaint = call(*IMPORT, *trial, "--out", out, "--force")
    assert code == 0, complaint
    assert "the plates carry" in printed
    assert abs(gait.read(out).body_mass / 67.2 - 1.0) < 0.05


@pytest.mark.usefixtures("blank")
@pytest.mark.slow
def test_a_map_of_markers_is_written_edited_and_read(
    trial: list[str], tmp_path: pathlib.Path, call: Call
) -> None:
    markers = pathlib.Path(trial[2])
    renamed = tmp_path / "walk.trc"
    renamed.write_text(markers.read_text(encoding="utf-8").replace("RKJC", "R.Q7"), encoding="utf-8")
    arguments = (*IMPORT, str(renamed), trial[1])
    out = ("--out", str(tmp_path / "x.csv"))
    code, _, complaint = call(*arguments, *out)
    assert code == 2
    assert "--write-role roles.toml" in complaint
    map_ = tmp_path / "roles.toml"
    code, printed, complaint = call(*arguments, "--write-role", str(map_))
    assert code == 0, complaint
    assert f"written to {map_}" in printed
    code, _, complaint = call(*arguments, "--write-map", str(map_))
    assert code == 2
    assert "exists already" in complaint
    text = map_.read_text(encoding="utf-8").partition("\n")[2]
    line = next(line for line in text.splitlines() if line.startswith("# knee_lateral"))
    map_.write_text(text.replace(line, 'knee_lateral = ["R.Q7"]', 1), encoding="utf-8")
    for option in ("--role", "--map"):
        code, printed, complaint = call(*arguments, *out, option, str(map_), "--force")
        assert code == 0, complaint


@pytest.mark.usefixtures("blank")
@pytest.mark.slow
def test_second_stride_and_units_are_options(trial: list[str], tmp_path: pathlib.Path, call: Call) -> None:
    for stride in ("1", "2"):
        out = tmp_path / f"{stride}.csv"
        arguments = ("--out", str(out), "--mass", "67200 g", "--stride", stride, "--cutoff", "0 Hz")
        assert call(*IMPORT, *trial, *arguments)[0] == 0
    first, second = (gait.read(tmp_path / f"{n}.csv") for n in (1, 2))
    assert first.notes["cut"] != second.notes["cut"]
    assert np.allclose(first.shank_angle, second.shank_angle, atol=1e-3)


@pytest.mark.slow
def test_each_side_is_written_or_none(
    tmp_path: pathlib.Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorded, out = laboratory(LameWalker(right_load=0.9)), tmp_path / "mine" / "her.csv"
    files = (
        patients_trc(tmp_path / "walk.trc", recorded.time, recorded.markers("opensim c3d")),
        patients_forces(tmp_path / "grf.mot", recorded.plates()),
    )
    options = ("--side", "each", "--walker", "patient", "--out", str(out))
    command = ("gait", "import", *map(str, files), *options)
    own = show.draw_gait

    def broken(cycle: GaitCycle, *rest: Any) -> None:
        if cycle.side == "left":
            raise InputError("the disk is full")
        own(cycle, *rest)

    with monkeypatch.context() as patched:
        patched.setattr(show, "draw_gait", broken)
        assert call(*command)[0] == 2
    assert not out.parent.exists()
    code, printed, complaint = call(*command)
    assert code == 0, complaint
    written = {path.name for path in out.parent.iterdir()}
    assert written == {f"her_{side}.{kind}" for side in ("right", "left") for kind in ("csv", "png")}
    assert "right stride 1 of" in printed and "left stride 1 of" in printed and "step time [s]" in printed


REFUSED = [
    ("--mass '110 kg'", "is the body mass right"),
    ("--mass '40 kg'", "is the body mass right"),
    ("--mass 72", "--mass = '72': has no unit; write it like \"72 kg\""),
    ("--height 1.72", "--height = '1.72': has no unit; write it like \"1.72 m\""),
    ("--height '17.2 m'", "--height = 17.2: is out of range; allowed: 0.5 to 2.5 (SI)"),
    ("--sole '25 cm'", "--sole = 0.25: is out of range; allowed: 0 to 0.15 (SI)"),
    ("--cutoff 6", "--cutoff = '6': has no unit; write it like \"10 Hz\""),
    ("--cutoff '80 Hz'", "--cutoff = '80 Hz': is above 50 Hz; allowed: 10 Hz"),
    ("--mass '72 m'", "does not convert to kg"),
    ("--mass '72 kg' --stride 9", "--stride = 9: there is no such stride"),
    ("--stride first", "--stride = 'first': is not a valid stride; allowed: 1, 2, …, mean"),
    ("--side rigth", "--side = 'rigth': is not a valid choice; allowed: right, left, both, each"),
    ("--mass '72 kg' --plate 1_ground_forc", "did you mean '1_ground_force'"),
    ("--mass '72 kg' --plate ground_force", "under the right foot throughout"),
    ("--side left", "hip_flexion_l, knee_angle_l, ankle_angle_l: these coordinates are missing"),
    ("--mass '72 kg' --marker ankle", "--marker = 'ankle': is not ROLE=NAME"),
    ("--mass '72 kg' --marker ankle=RAJ", "did you mean 'RAJC'"),
    ("--mass '72 kg' --angles grad", "--angles = 'grad': is not a valid choice"),
    ("--mass '72 kg' --angles rad", "the knee reaches 64.57, which cannot be radians"),
    ("--mass '72 kg' --ankle-zero mine", "--ankle-zero = 'mine': is not a valid choice"),
    ("--mass '72 kg' --forward north", "--forward = 'north': is not a valid choice"),
    ("--model scaled.mot", "scaled.mot"),
    ("--map roles.toml", "roles.toml"),
    ("--mass '72 kg' --out walk.txt", "--out = 'walk.txt': is not a CSV file"),
]


@pytest.mark.parametrize(("line", "expected"), REFUSED, ids=[line for line, _ in REFUSED])
def test_bad_options_are_one_message_and_exit_2(
    line: str, expected: str, trial: list[str], tmp_path: pathlib.Path, call: Call
) -> None:
    out = () if "--out" in line else ("--out", tmp_path / "x.csv")
    code, printed, complaint = call(*IMPORT, *trial, *out, *shlex.split(line))
    assert code == 2 and expected in complaint
    assert complaint.strip().count("\n") == 0 and "Traceback" not in complaint + printed
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_documents_commands_run(
    trial: list[str], tmp_path: pathlib.Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    block = PAGES["gait_data"].split("draws only with `--out`:\n\n")[1].split("\n\n")[0]
    lines = re.findall(r"^    \.venv/bin/afo-sim (gait .*)$", block, flags=re.M)
    assert [line.split()[1] for line in lines] == ["import", "show"]
    assert all(
        f"`afo-sim gait {command.name}" in PAGES["commands"] for command in cli.gait_app.registered_commands
    )
    for file in trial:
        (tmp_path / pathlib.Path(file).name).symlink_to(file)
    monkeypatch.chdir(tmp_path)
    for line in lines:
        code, _, complaint = call(*shlex.split(line))
        assert code == 0, complaint
    assert (tmp_path / "walk.png").is_file() and (tmp_path / "stride.png").is_file()


@pytest.mark.usefixtures("blank")
@pytest.mark.slow
def test_documents_three_commands_go_from_opensims_files_to_a_report(
    trial: list[str], tmp_path: pathlib.Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The block as it is printed, on a synthetic trial; the leg then walks as that trial does."""
    block = PAGES["walking"].split("to a report in three commands:\n\n")[1].split("\n\n")[0]
    lines = [line.removeprefix("    .venv/bin/afo-sim ") for line in block.splitlines()]
    assert [line.split()[0] for line in lines] == ["gait", "run", "report"]
    for file in trial:
        (tmp_path / pathlib.Path(file).name).symlink_to(file)
    monkeypatch.chdir(tmp_path)
    for line in lines:
        code, _, complaint = call(*shlex.split(line))
        assert code == 0, complaint
    report = (tmp_path / "runs" / "mine" / "report.html").read_text(encoding="utf-8")
    assert "my_walk.csv" in report
    assert "More over the gait cycle" in report
    run, walk = read_recording(tmp_path / "runs" / "mine"), known_walk()
    rows = run["gait/stride"] == 2.0
    # the stride is cut where the ground force passes 20 N, a little off the known walk's own phase 0
    cut = (walk.heel_strike(0) - walk.start) / walk.cycle.stride_time
    shank = walk.cycle.signal("shank_angle", run["gait/phase"][rows] + cut)
    assert np.degrees(np.sqrt(np.mean((run["shank/angle"][rows] - shank) ** 2))) < 0.5


def test_show_knows_shipped_names(call: Call) -> None:
    code, printed, _ = call("gait", "show", "gatk_stride1")
    assert code == 0
    for words in ("peak dorsiflexion", "taken out as drift", "Apache-2.0"):
        assert words in printed


def test_list_and_check_know_the_shipped_gaits(call: Call) -> None:
    code, printed, _ = call("list", "gaits")
    assert code == 0
    for name in assets.gait_names():
        assert name in printed
        code, _, complaint = call("check", str(GAIT_DATA / f"{name}.csv"))
        assert code == 0, complaint


def test_check_refuses_a_bad_cycle(tmp_path: pathlib.Path, call: Call) -> None:
    text = (GAIT_DATA / "gatk_stride1.csv").read_text(encoding="utf-8")
    bad = tmp_path / "bad.csv"
    bad.write_text(text.replace("stride_time_s: 1.2", "stride_time_s: 12"), encoding="utf-8")
    code, _, complaint = call("check", str(bad))
    assert code == 2
    assert "stride_time_s = " in complaint


@nightly("the script that made them runs again, 14 s")
@pytest.mark.slow
def test_shipped_strides_are_what_the_script_makes(tmp_path: pathlib.Path) -> None:
    """From the package's own source distribution, which pip must be able to fetch."""
    command = [sys.executable, str(ROOT / "scripts" / "make_gait_data.py"), "--out", str(tmp_path)]
    quick = os.environ | {"PIP_RETRIES": "0", "PIP_DEFAULT_TIMEOUT": "10"}
    try:
        done = subprocess.run(command, capture_output=True, text=True, env=quick, timeout=120)
    except subprocess.TimeoutExpired:
        pytest.skip("pip takes too long to fetch the source distribution")
    if "CalledProcessError" in done.stderr:
        pytest.skip("pip cannot fetch the source distribution here")
    assert done.returncode == 0, done.stderr
    assert "belt speed 0.990" in done.stdout
    for name in ("gatk_stride1", "gatk_stride2"):
        made, shipped = gait.read(tmp_path / f"{name}.csv"), gait.read(GAIT_DATA / f"{name}.csv")
        assert made.notes == shipped.notes
        for column in ("phase", *KINEMATICS, "grf_x", "grf_z", "cop_x", "ankle_moment"):
            a, b = getattr(made, column), getattr(shipped, column)
            assert np.allclose(a, b, atol=1e-6, equal_nan=True), column


PAGE = PAGES["gait_data"]


@pytest.mark.usefixtures("blank")
@pytest.mark.parametrize("asked", [(), ("--side", "right")])
@pytest.mark.parametrize("walker", ["healthy", "patient"])
def test_without_a_side_a_healthy_walkers_left_stride_is_taken(
    tmp_path: pathlib.Path, call: Call, walker: str, asked: tuple[str, ...]
) -> None:
    """The left foot alone is on a plate."""
    recorded, out = laboratory(Patient()), tmp_path / "my_walk.csv"
    files = (
        patients_trc(tmp_path / "walk.trc", recorded.time, recorded.markers("opensim c3d")),
        patients_forces(tmp_path / "grf.mot", [plate for plate in recorded.plates() if plate.name == "l"]),
    )
    options = ("--walker", walker, *asked, "--out", str(out))
    code, printed, complaint = call("gait", "import", *map(str, files), *options)
    if walker == "healthy" and not asked:
        assert code == 0, complaint
        assert gait.read(out).side == "left" and "the left leg's stride is taken" in printed
    else:
        assert code == 2 and "--side = 'right'" in complaint and "allowed: left" in complaint


@pytest.mark.slow
def test_three_commands_go_from_a_raw_c3d_to_a_report(
    tmp_path: pathlib.Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    from gait_lab.c3d_writer import write_c3d
    from gait_lab.laboratory import Laboratory

    block = PAGE.split("to a report in three commands:\n\n")[1].split("\n\n")[0]
    lines = [line.removeprefix("    .venv/bin/afo-sim ") for line in block.splitlines()]
    assert [line.split()[0] for line in lines] == ["gait", "run", "report"]
    laboratory = Laboratory(forward="-y", up="z")
    points, plates = laboratory.markers("plug-in gait"), laboratory.plates("steps")
    write_c3d(tmp_path / "walk.c3d", laboratory.time, points, plates)
    monkeypatch.chdir(tmp_path)
    for line in lines:
        code, _, complaint = call(*shlex.split(line))
        assert code == 0, complaint
    assert (tmp_path / "my_walk.png").read_bytes().startswith(b"\x89PNG")
    assert gait.read(tmp_path / "my_walk.csv").side == "right"
    assert "my_walk.csv" in (tmp_path / "runs" / "mine" / "report.html").read_text(encoding="utf-8")


def test_the_pages_examples_of_csv_are_read(tmp_path: pathlib.Path) -> None:
    """The numbers are those that stand in the blocks."""
    blocks = [block for block in re.findall(r"(?:^    .+\n)+", PAGE, flags=re.M) if "time [s]" in block]
    found = []
    for number, block in enumerate(blocks):
        path = tmp_path / f"{number}.csv"
        path.write_text(textwrap.dedent(block), encoding="utf-8")
        found.append(read_csv_trial(path))
    markers, plates, angles = found
    assert markers.markers is not None
    assert np.isclose(markers.markers.positions["RKNE"][0, 0], 0.4123)
    assert np.isnan(markers.markers.positions["RANK"][1]).all()
    (plate,) = plates.plates
    assert np.allclose(plate.force[0], [-12.1, 310.4, 4.2])
    assert np.allclose(plate.place[0], [0.395, 0.0, 0.1152])
    assert np.allclose(angles.tables[0].columns["knee_angle_r"], [6.2, 6.9])
