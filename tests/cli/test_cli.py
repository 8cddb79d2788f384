"""The command line as a person meets it: exit codes, one message, nothing half-written."""

import json
import pathlib
import re
import shlex
import subprocess
import sys
import threading

import numpy as np
import pytest
from command import Call

import afo_sim
from afo_sim.cli import common
from afo_sim.common import assets, read_json
from afo_sim.model import supply_and_timer as schedule

ROOT = pathlib.Path(__file__).parents[2]


@pytest.mark.slow
def test_run_without_arguments_writes_the_seated_run(
    tmp_path: pathlib.Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    code, printed, complaint = call("run")
    assert code == 0, complaint
    assert "Does it" not in printed and "range_of_motion" not in printed and len(printed.splitlines()) <= 10
    summary = json.loads((tmp_path / "runs" / "seated" / "summary.json").read_text())
    assert summary["status"] == "ok"
    assert 10.0 < summary["metrics"]["range_of_motion"]["value"] < 45.0
    angle = f"{summary['metrics']['peak_dorsiflexion_angle']['value']:.1f}° of dorsiflexion"
    assert any(line.startswith("! DOUBTFUL  move") and angle in line for line in printed.splitlines())


def test_a_foot_that_is_not_lifted_to_neutral_is_bad(call: Call, tmp_path: pathlib.Path) -> None:
    weak = ("--set", "supply.pressure=0.2 bar", "--set", "duration=1 s")
    code, printed, _ = call("run", *weak, "--no-rrd", "--out", tmp_path / "run")
    angle = afo_sim.read_recording(tmp_path / "run").metrics["peak_dorsiflexion_angle"].value
    assert code == 0 and angle < 0.0 and "✗ BAD       move" in printed


def test_a_run_in_a_pipe_reports_while_it_takes_time(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(common, "_EVERY", 1e-3)
    said, before = "", threading.active_count()
    with common.progress("reading") as report:
        while "afo-sim: reading" not in said:
            said += capsys.readouterr().err
        report(1, 4, "simulating")
        while "afo-sim: simulating, 25%" not in said:
            said += capsys.readouterr().err
    assert threading.active_count() == before


def test_a_table_folds_by_column_and_not_within_words(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    words = ["of the antagonistic pair", "repeatability", "plantarflexor", "characteristics", "extrapolated"]
    row = [f"{word}{k}" for k, word in enumerate(words * 2)][:9]
    common.print_table("t", [f"column {k}" for k in range(9)], [row])
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    shown = {word for line in lines for word in line.split()}
    assert shown >= {"antagonistic", *row[1:5], *row[6:]}
    assert sum("pair0" in line for line in lines) == 2  # the first column stands beside each block


HEAVY = {"mujoco", "numba", "llvmlite", "scipy", "pint", "rerun", "pyarrow", "pandas", "matplotlib", "glfw"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "absent"),
    [
        ("--help", HEAVY | {"numpy", "pydantic", "rich"}),
        ("run --help", HEAVY | {"numpy", "rich"}),
        ("list", HEAVY | {"numpy", "afo_sim.description.reader"}),
        ("list seated", HEAVY),
        ("run --no-rrd --set duration='0.1 s'", HEAVY - {"mujoco", "llvmlite", "pyarrow"}),
    ],
)
def test_a_command_loads_and_starts_nothing_that_it_does_not_need(
    arguments: str, absent: set[str], tmp_path: pathlib.Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    call(*shlex.split(arguments))  # from here on the machine code is in the cache
    code = (
        f"import atexit, sys\nsys.argv = {['afo-sim', *shlex.split(arguments)]}\nstarted = []\n"
        "sys.addaudithook(lambda event, _: started.append(event) if event in ('subprocess.Popen', 'os.fork', "
        "'os.posix_spawn') else None)\n"
        f"atexit.register(lambda: print([*started, *({absent} & set(sys.modules))]))\n"
        "from afo_sim.cli import main\nmain()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "[]"
    assert ("torque-map" if arguments == "--help" else "seated") in done.stdout


def test_bad_files_name_file_and_field(tmp_path: pathlib.Path, call: Call) -> None:
    scenario = tmp_path / "mine.toml"
    shipped = pathlib.Path(__file__).parents[2] / "models" / "scenarios" / "seated.toml"
    text = shipped.read_text()
    for broken, expected in (
        ("duration =", "not valid TOML"),
        (text.replace('"4 bar"', '"4 bag"'), "supply.pressure = '4 bag'"),
        (text.replace('"s1"', '"s9"'), "orthosis = 's9'"),
        (text.replace("[supply]", "[suply]"), "suply"),
        ("", "missing"),
    ):
        scenario.write_text(broken)
        code, _, complaint = call("run", str(scenario), "--out", str(tmp_path / "x"))
        assert code == 2
        assert "mine.toml" in complaint
        assert expected in complaint
    scenario.write_bytes(b"\xff\xfe")
    assert call("run", str(scenario))[0] == 2


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('["0 mm", "10 mm"]', "toe_clearance = ['0 mm', '10 mm']: the second value is on the wrong side"),
        ('["10 deg", "0 mm"]', "toe_clearance.0 = '10 deg': is in degree"),
        ('"10 mm"', "toe_clearance = '10 mm': is not a list"),
        ("", "toe_clearance: is missing; allowed: two of"),
        ("", "drawn_trips: is missing; allowed: two of"),  # its meaning stands on two lines
    ],
)
def test_limits_of_your_own_are_refused_with_their_file(
    text: str, said: str, tmp_path: pathlib.Path, call: Call
) -> None:
    """As a scenario's limits, and as those that `--set` names."""
    shipped = (ROOT / "models" / "limits" / "usual" / "limits.toml").read_text(encoding="utf-8")
    file, scenario = tmp_path / "limits.toml", tmp_path / "scenario.toml"
    name = said.split(" ", 1)[0].split(".")[0].rstrip(":")
    line = f"{name} = {text}" if text else ""
    file.write_text(re.sub(rf"(?m)^{name} = .*$", line, shipped), encoding="utf-8")
    walk = (ROOT / "models" / "scenarios" / "walk-dropfoot.toml").read_text(encoding="utf-8")
    scenario.write_text(walk.replace('limits = "usual"', 'limits = "limits.toml"'), encoding="utf-8")
    out = tmp_path / "run"
    for words in (("walk-dropfoot", "--set", f"limits={file}"), (scenario,)):
        code, _, complaint = call("run", *words, "--out", out)
        assert code == 2 and complaint.startswith(f"afo-sim: {file}: {said}")
        assert len(complaint.strip().splitlines()) == 1 and not out.exists()
    code, _, complaint = call("run", "walk-dropfoot", "--set", f"limits={tmp_path / 'no'}", "--out", out)
    assert code == 2 and "there are no such limits" in complaint


def test_inlet_and_outlet_open_together_warns(tmp_path: pathlib.Path, call: Call) -> None:
    sets = ["--set", 'timer.dorsiflexor.outlet=[["3.5 s", "8 s"]]', "--set", "duration=1 s"]
    code, printed, _ = call("run", *sets, "--out", str(tmp_path / "a"))
    assert code == 0
    assert "'dorsiflexor'" in printed and "from 3.5 s to 4 s" in printed
    notices = read_json(tmp_path / "a" / "summary.json")["notices"]
    told = [each["data"]["overlaps"] for each in notices if each["code"] == "valves-open-together"]
    assert told == [[[3.5, 4.0]]]


def test_unwritable_folder_is_refused_before_the_work(tmp_path: pathlib.Path, call: Call) -> None:
    (tmp_path / "file").write_text("in the way")
    code, _, complaint = call("run", "--out", str(tmp_path / "file" / "run"))
    assert code == 2
    assert "cannot be written to" in complaint


def test_failed_simulation_is_exit_3_with_its_rows(
    tmp_path: pathlib.Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = schedule.controls

    def lost_supply(built):
        control = whole(built)
        control[250:, built.index.chambers["dorsiflexor"]] = float("nan")
        return control

    monkeypatch.setattr(schedule, "controls", lost_supply)
    monkeypatch.chdir(tmp_path)
    out = tmp_path / "a"
    code, _, complaint = call("run", "--set", "duration=1 s", "--out", str(out))
    assert code == 3
    assert "simulation 0 stopped at t = 0.5" in complaint
    summary = json.loads((out / "summary.json").read_text())
    assert summary["status"].startswith("failed: simulation 0")
    assert [path.name for path in tmp_path.iterdir()] == ["a"]  # no engine's log beside it
    assert 250 <= summary["timing"]["steps"] <= 252


@pytest.mark.slow
def test_torque_map_answers_the_question(tmp_path: pathlib.Path, call: Call) -> None:
    asked = ("--angle", "-10 deg", "20 deg", "5 deg", "--uncertainty", "20")
    code, printed, complaint = call("torque-map", "--out", tmp_path, *asked)
    assert code == 0, complaint
    assert "by 68.5 kg (5 to 95 %)" in printed
    needs = {phase: float(peak) for phase, peak in re.findall(r"^([a-z -]+?) +(\d+\.\d+) \(", printed, re.M)}
    assert needs == {
        "initial and mid swing": 5.22,
        "terminal swing": 5.24,
        "loading response": 8.45,
        "push-off": 0.0,
    }
    assert {p.name for p in tmp_path.iterdir()} == {"torque_map.csv", "torque_map.png", "torque_map.pdf"}
    header, *rows = (tmp_path / "torque_map.csv").read_text().splitlines()
    assert header == "chamber,ankle_angle [deg],pressure [bar],orthosis_torque [N*m]"
    assert len(rows) == 2 * 7 * 4


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ("seated", "the needed torque is unknown without walking; name another walk, such as --walk"),
        (
            "walk-dropfoot-afo --set gait.walker=patient",
            "the needed torque is unknown for a patient's own walk",
        ),
        ("knee", ""),
    ],
)
def test_torque_map_asks_for_a_walk_where_no_need_is_known(
    arguments: str, says: str, tmp_path: pathlib.Path, call: Call
) -> None:
    angles = () if arguments == "knee" else ("--angle", "-5 deg", "5 deg", "5 deg")
    code, printed, complaint = call("torque-map", *arguments.split(), "--out", tmp_path, *angles)
    assert code == 0, complaint
    assert says in printed and ("--walk" in printed) is bool(says) and "needed by" not in printed


@pytest.fixture
def no_display(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.usefixtures("no_display")
def test_view_without_a_display_says_so(tmp_path: pathlib.Path, call: Call) -> None:
    if not sys.platform.startswith("linux"):
        pytest.skip("displays are found otherwise here")
    (tmp_path / "recording.rrd").write_bytes(b"")
    code, _, complaint = call("view", tmp_path)
    assert code == 2
    assert "no display" in complaint


def test_list_names_everything(call: Call) -> None:
    code, printed, _ = call("list")
    assert code == 0
    for name in ("s1_215mm", "tondu_lopez_2000_bladder", "seated-antagonist", "adult_75kg", "mh1", "natural"):
        assert name in printed
    assert all(name in printed for kind in ("sweep", "search", "uncertainty") for name in assets.names(kind))


@pytest.mark.parametrize(
    "path",
    [
        "scenarios/seated.toml",
        "orthoses/s1/orthosis.toml",
        "muscles/s1_120mm/muscle.toml",
        "legs/adult_75kg/leg.toml",
        "legs/adult_75kg/leg.xml",
        "valves/mh1/valve.toml",
        "checks/seated.toml",
    ],
)
def test_check_understands_every_kind(path: str, call: Call) -> None:
    code, printed, complaint = call("check", str(pathlib.Path(__file__).parents[2] / "models" / path))
    assert code == 0, complaint
    assert printed.splitlines()[-1].startswith(("good", "readable; "))


@pytest.mark.slow
def test_check_reads_a_urdf(tmp_path: pathlib.Path, call: Call) -> None:
    urdf = tmp_path / "leg.urdf"
    inertia = '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'
    links = "".join(
        f'<link name="{name}"><inertial><mass value="{mass}"/>{inertia}</inertial></link>'
        for name, mass in (("shank", 3.5), ("foot", 1.1))
    )
    limit = '<limit lower="-0.8" upper="0.5" effort="1" velocity="1"/>'
    ends = '<parent link="shank"/><child link="foot"/><axis xyz="0 -1 0"/>'
    joint = f'<joint name="ankle" type="revolute">{ends}{limit}</joint>'
    urdf.write_text(f'<robot name="leg">{links}{joint}</robot>')
    code, printed, complaint = call("check", str(urdf))
    assert code == 0, complaint
    assert "ankle" in printed
    assert "4.6 kg" in printed  # the root link's mass is not lost
    urdf.write_text("<robot><joint/></robot>")
    code, _, complaint = call("check", str(urdf))
    assert code == 2
    assert "has no type" in complaint


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory, seated, antagonist) -> list[pathlib.Path]:
    base = tmp_path_factory.mktemp("runs")
    return [run.save(base / run.scenario["name"], rrd=False) for run in (seated, antagonist)]


def test_shipped_scenarios_keep_their_checks(runs: list[pathlib.Path], call: Call) -> None:
    for folder in runs:
        code, printed, complaint = call("check-run", str(folder))
        assert code == 0, printed + complaint
        assert "13 passed, 0 failed" in printed


def test_failing_check_is_exit_1_and_says_where(
    runs: list[pathlib.Path], tmp_path: pathlib.Path, call: Call, seated
) -> None:
    checks = tmp_path / "checks.toml"
    checks.write_text('[[check]]\ncolumn = "ankle/angle"\nbelow = "5 deg"\nafter = "1 s"\nwhy = "a stair"\n')
    code, printed, _ = call("check-run", str(runs[0]), str(checks))
    assert code == 1
    top = np.degrees(seated["ankle/angle"].max())
    where = seated["time"][np.argmax(seated["ankle/angle"])]
    assert f"FAILED  ankle/angle: {top:.4g} deg at {where:.6g} s is {top - 5:.4g} deg above" in printed
    assert "the limit of 5 deg" in printed
    assert "why: a stair" in printed
    for broken, expected in (
        ('column = "ankle/angel"\nbelow = "1 deg"', "did you mean 'ankle/angle'"),
        ('column = "ankle/angle"\nbelow = "1 bar"', "does not convert to rad"),
        ('column = "ankle/angle"\nbelow = 10', "has no unit"),
        ('column = "ankle/angle"\nbelwo = "1 deg"', "did you mean 'below'"),
        ('metric = "strides_per_bottle"\nabove = 1000', "strides_per_bottle"),
        ('metric = "strides_per_botle"\nabove = 1000', "the run has no such metric"),
    ):
        checks.write_text(f"[[check]]\n{broken}\n")
        code, _, complaint = call("check-run", str(runs[0]), str(checks))
        assert code == 2
        assert expected in complaint
        assert "check[1]" in complaint


@pytest.mark.slow
@pytest.mark.parametrize("at", ["-3 s", "99 s"])
def test_time_outside_the_run_is_refused(
    at: str, runs: list[pathlib.Path], tmp_path: pathlib.Path, call: Call
) -> None:
    picture = str(tmp_path / "x.png")
    code, _, complaint = call("view", str(runs[0]), "--screenshot", picture, "--at", at)
    assert code == 2
    assert "0 s to 15.998 s" in complaint


@pytest.mark.parametrize("command", ["view", "figure", "check-run"])
def test_damaged_run_is_one_message(
    command: str, runs: list[pathlib.Path], tmp_path: pathlib.Path, call: Call
) -> None:
    (tmp_path / "recording.parquet").write_bytes((runs[0] / "recording.parquet").read_bytes()[:9000])
    extra = ["--screenshot", str(tmp_path / "x.png")] if command == "view" else []
    code, _, complaint = call(command, str(tmp_path), *extra)
    assert code == 2
    assert "recording.parquet: is not a valid Parquet file" in complaint
    assert {p.name for p in tmp_path.iterdir()} == {"recording.parquet"}


def test_run_without_checks_of_its_own_wants_a_file(tmp_path: pathlib.Path, seated, call: Call) -> None:
    import dataclasses

    other = dataclasses.replace(seated, described=seated.described | {"name": "mine"})
    other.save(tmp_path, rrd=False)
    code, _, complaint = call("check-run", str(tmp_path))
    assert (code, "carries no checks" in complaint) == (2, True)


@pytest.mark.usefixtures("no_display")
def test_live_needs_a_display(tmp_path: pathlib.Path, call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    if not sys.platform.startswith("linux"):
        pytest.skip("displays are found otherwise here")
    monkeypatch.chdir(tmp_path)
    code, _, complaint = call("run", "--live")
    assert code == 2
    assert "no display" in complaint
    assert not (tmp_path / "runs").exists()


def test_check_takes_the_folder_of_a_description(call: Call) -> None:
    root = pathlib.Path(__file__).parents[2] / "models"
    folder = root / "valves" / "mh1"
    (one, by_folder, _), (other, by_file, _) = (
        call("check", str(path)) for path in (folder, folder / "valve.toml")
    )
    assert one == other == 0
    assert by_folder.split("kind", 1)[1] == by_file.split("kind", 1)[1]
    code, _, said = call("check", str(root))
    assert code == 2
    assert "the folder holds no description" in said
    assert "orthosis.toml" in said


@pytest.mark.slow
def test_run_says_which_strides_and_which_cuff_its_numbers_are_of(call: Call, tmp_path: pathlib.Path) -> None:
    short = ["--set", "duration=3.4 s", "--no-rrd", "--out"]
    empty = ["--set", "start.dorsiflexor.fill_time=0 s"]
    heavier = ["--set", "patient.body_mass=75 kg"]
    _, said, _ = call("run", "walk-dropfoot-afo", "--no-change", *short, str(tmp_path / "a"))
    assert "GOOD*     lift" in said and "note: the numbers are" not in said
    call("report", tmp_path / "a")
    text = (tmp_path / "a" / "report.html").read_text(encoding="utf-8")
    assert "The numbers are from the settled stride" in text
    _, said, _ = call(
        "run",
        "walk-dropfoot-afo",
        "--plain",
        "--no-change",
        "--numbers",
        *empty,
        *heavier,
        *short,
        str(tmp_path / "b"),
    )
    assert "note: the numbers are from stride 2 alone, which does not show whether it repeats" in said
    assert "note: the cuff's compliance is assumed (orthosis.anchor.shank)" in said
    assert "note: the recorded walker weighs 68.5 kg, the patient 75 kg" in said
    own = ["--set", "orthosis.anchor.shank.stiffness=2 kN/m"]
    _, said, _ = call("run", "seated", "--set", "duration=1 s", *own, "--no-rrd", "--out", str(tmp_path))
    assert "note:" not in said
