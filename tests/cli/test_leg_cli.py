"""`afo-sim leg import`, `leg export`, `attach` and `refit`: messages, files, exit codes."""

import pathlib

import mujoco
import pytest
from command import Call
from documents import ROOT
from person import person

import afo_sim as afo
from afo_sim import native
from afo_sim.common import CallbackError
from afo_sim.common import find as asset
from afo_sim.legs import read_attached, write_attached

LEG = asset("leg", "adult_75kg").parent / "leg.xml"
TWO = """<mujoco><worldbody><body name="pelvis" pos="0 0 1"><freejoint/>
  <inertial pos="0 0 0" mass="8" diaginertia=".1 .1 .1"/>{legs}</body></worldbody>
  <actuator><motor joint="left_ankle"/></actuator></mujoco>"""
ONE = """<body name="{s}_shin" pos="0 {y} -.4"><joint name="{s}_knee" axis="0 1 0" range="-100 0"/>
  <inertial pos="0 0 -.2" mass="3" diaginertia=".05 .05 .01"/>
  <body name="{s}_foot" pos="0 0 -.4"><joint name="{s}_ankle" axis="0 1 0" range="-30 50"/>
  <joint name="{s}_slide" type="slide" axis="0 0 1" range="0 .01"/>
  <inertial pos=".05 0 -.03" mass="1" diaginertia=".001 .004 .004"/>
  <geom type="box" pos=".05 0 -.05" size=".12 .04 .02"/></body></body>"""


@pytest.fixture
def body(tmp_path: pathlib.Path) -> pathlib.Path:
    legs = ONE.format(s="left", y=0.1) + ONE.format(s="right", y=-0.1)
    file = tmp_path / "my body.xml"
    file.write_text(TWO.format(legs=legs), encoding="utf-8")
    return file


@pytest.mark.slow
def test_import_tells_and_draws_what_was_found(
    body: pathlib.Path, tmp_path: pathlib.Path, call: Call
) -> None:
    out = tmp_path / "leg"
    code, told, _ = call("leg", "import", body, "--side", "left", "--out", out)
    assert code == 0
    for words in (
        "left_shin",
        "left_ankle",
        "-50 to 30 deg",
        "left_slide",
        "0.4 m",
        "turned round",
        "pelvis",
    ):
        assert words in told
    assert {path.name for path in out.iterdir()} == {"leg.toml", "leg.xml", "leg.png", "README.md"}
    assert (out / "leg.png").read_bytes()[:4] == b"\x89PNG"
    assert afo.load("leg", str(out)).side == "left"
    code, _, complaint = call("leg", "import", body, "--side", "right", "--out", out)
    assert code == 2 and "--force" in complaint
    assert call("leg", "import", body, "--side", "right", "--out", out, "--force")[0] == 0
    assert afo.load("leg", str(out)).side == "right"


def test_a_leg_is_named_and_its_zero_and_stops_are_told(
    body: pathlib.Path, tmp_path: pathlib.Path, call: Call
) -> None:
    """The file's ankle is plantarflexion positive: its zero at 10 deg moves the stops up by 10 deg."""
    names = ("--shank", "left_shin", "--foot", "left_foot", "--ankle", "left_ankle")
    _, told, _ = call("leg", "import", body, *names, "--zero", "10 deg", "--out", "-")
    assert "-40 to 40 deg" in told and "written" not in told
    _, told, _ = call("leg", "import", body, *names, "--range", "-45 deg", "25 deg", "--out", "-")
    assert "-45 to 25 deg" in told
    assert [path.name for path in tmp_path.iterdir()] == ["my body.xml"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "there are two legs"),
        (["--side", "lft"], "did you mean 'left'"),
        (["--shank", "left_shn"], "did you mean 'left_shin'"),
        (["--foot", "left_fot"], "did you mean 'left_foot'"),
        (["--ankle", "left_ankl"], "did you mean 'left_ankle'"),
        (["--ankle", "left_slide"], "is a slide joint, and an ankle is a hinge"),
        (["--shank", "left_foot", "--foot", "left_shin"], "swapped"),
        (["--shank", "left_shin", "--foot", "right_foot"], "does not hang on 'left_shin'"),
        (["--shank", "left_shin", "--foot", "left_shin"], "is also given as the foot"),
        (["--side", "left", "--ankle", "left_knee", "--foot", "right_foot"], "does not"),
        (["--side", "left", "--zero", "10"], "--zero"),
        (["--side", "left", "--zero", "nan deg"], "--zero"),
        (["--side", "left", "--range", "30 deg", "-50 deg"], "--range"),
        (["--side", "left", "--toes", "left_knee"], "is not a hinge below the foot"),
        (["--side", "left", "--body-mass", "5 kg"], "10 to 300 kg"),
        (["--side", "left", "--body-height", "175"], "--body-height"),
        (["--side", "left", "--out", "{body}"], "is a file"),
        (["--side", "left", "--out", "{body}/leg"], "not a folder|is a file|cannot be written"),
    ],
)
def test_wrong_options_are_told_in_a_sentence(
    body: pathlib.Path,
    tmp_path: pathlib.Path,
    call: Call,
    options: list[str],
    words: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    given = [option.replace("{body}", str(body)) for option in options]
    code, told, complaint = call("leg", "import", body, *given)
    assert code == 2 and told == ""
    assert len(complaint.strip().splitlines()) == 1
    assert any(word in complaint for word in words.split("|")), complaint
    assert [path.name for path in tmp_path.iterdir()] == [body.name]


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("none.xml", None),
        ("empty.xml", b""),
        ("binary.xml", bytes(range(256))),
        ("cut.xml", LEG.read_bytes()[:700]),
        ("leg.stl", b"solid"),
        ("bare.urdf", b"<robot name='a'><link name='shank'/></robot>"),
        ("nan.xml", LEG.read_bytes().replace(b'mass="3.49"', b'mass="nan"')),
        ("free.xml", LEG.read_bytes().replace(b'range="-50 30"', b"")),
        ("radians.xml", LEG.read_bytes().replace(b'range="-50 30"', b'range="-0.9 0.5"')),
        ("turns.xml", LEG.read_bytes().replace(b'range="-50 30"', b'range="-900 900"')),
        ("aside.xml", LEG.read_bytes().replace(b'range="-50 30"', b'range="5 30"')),
        ("along.xml", LEG.read_bytes().replace(b'axis="0 -1 0"', b'axis="0 0 1"')),
        ("include.xml", LEG.read_bytes().replace(b"<worldbody>", b'<include file="a.xml"/><worldbody>')),
    ],
)
def test_wrong_files_are_told_in_a_sentence(
    tmp_path: pathlib.Path, call: Call, name: str, content: bytes | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    if content is not None:
        (tmp_path / name).write_bytes(content)
    before = sorted(tmp_path.iterdir())
    code, told, complaint = call("leg", "import", tmp_path / name, "--out", tmp_path / "leg")
    assert code == 2 and told == "", told
    assert "bug" not in complaint and "Traceback" not in complaint
    # MuJoCo itself logs a warning of NaN in the working directory
    assert [path for path in sorted(tmp_path.iterdir()) if path.name != "MUJOCO_LOG.TXT"] == before


def test_the_missing_range_names_its_option(tmp_path: pathlib.Path, call: Call) -> None:
    (tmp_path / "a.xml").write_bytes(LEG.read_bytes().replace(b'range="-50 30"', b""))
    _, _, complaint = call("leg", "import", tmp_path / "a.xml", "--out", "-")
    assert '--range "-50 deg" "30 deg"' in complaint


def test_check_tells_both_legs_of_a_body(body: pathlib.Path, call: Call) -> None:
    code, told, _ = call("check", body)
    joined = " ".join(told.split())
    assert code == 0
    assert "shank left_shin, foot left_foot, ankle left_ankle" in joined
    assert "shank right_shin, foot right_foot, ankle right_ankle" in joined


def test_a_whole_body_as_a_leg_is_told_the_way(
    body: pathlib.Path, tmp_path: pathlib.Path, call: Call
) -> None:
    names = 'shank = "left_shin"\nfoot = "left_foot"\nankle = "left_ankle"\ndamping = "0.5 N*m*s/rad"\n'
    (tmp_path / "leg.toml").write_text(f'file = "{body.name}"\n{names}', encoding="utf-8")
    code, _, complaint = call("run", "seated", "--set", f"leg={tmp_path}", "--out", tmp_path / "run")
    assert code == 2
    assert "beside the ankle there are the joints" in complaint
    assert f"afo-sim leg import '{body}'" in complaint


def test_export_writes_urdf_and_tells_what_it_lacks(tmp_path: pathlib.Path, call: Call) -> None:
    code, told, notes = call("leg", "export", "adult_75kg", "--orthosis", "s1", "--to", tmp_path / "a.urdf")
    assert code == 0 and "a.urdf" in told
    assert "no muscles" in notes and "no passive tissue" in notes
    code, _, complaint = call("leg", "export", "seated", "--to", tmp_path / "a.urdf")
    assert code == 2 and "--force" in complaint


def _body(low: float, high: float, mesh: str = "") -> str:
    """A URDF of a pelvis, a massless link, shank and foot, one with a mesh of a package that is not there."""
    inertia = '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'
    links = "".join(
        f'<link name="{name}"><inertial><origin xyz="{at}"/><mass value="{mass}"/>{inertia}</inertial>'
        f"{look}</link>"
        for name, mass, at, look in (
            ("pelvis", 9, "0 0 0", mesh),
            ("r_shank", 3.5, "0 0 -0.2", ""),
            ("r_foot", 1.1, "0.05 0 -0.04", ""),
        )
    )
    joints = "".join(
        f'<joint name="{name}" type="revolute"><origin xyz="0 0 {z}"/><parent link="{above}"/>'
        f'<child link="{below}"/><axis xyz="0 1 0"/><limit lower="{lower}" upper="{upper}" effort="1" '
        'velocity="1"/></joint>'
        for name, above, below, z, lower, upper in (
            ("r_hip", "pelvis", "r_thigh", 0, -1, 1),
            ("r_knee", "r_thigh", "r_shank", -0.4, 0, 2),
            ("r_ankle", "r_shank", "r_foot", -0.4, low, high),
        )
    )
    return f'<robot name="body">{links}<link name="r_thigh"/>{joints}</robot>'


def test_check_finds_what_the_import_would(tmp_path: pathlib.Path, call: Call) -> None:
    """ROS files name meshes by packages, and links without mass: MuJoCo's importer refuses both."""
    file = tmp_path / "body.urdf"
    mesh = '<visual><geometry><mesh filename="package://nowhere/pelvis.stl"/></geometry></visual>'
    file.write_text(_body(-0.5, 0.8, mesh))
    code, told, complaint = call("check", file)
    assert code == 0, complaint
    assert all(word in told for word in ("13.6 kg", "r_shank", "r_ankle", "leg import"))
    file.write_text(_body(-40, 30))
    code, told, complaint = call("check", file)
    assert "degrees" in told + complaint and "leg import" not in told


LEG_OF_ATTACH = str(ROOT / "models" / "legs" / "adult_75kg" / "leg.xml")


def test_attach_tells_what_it_found_and_writes_it(tmp_path: pathlib.Path, call: Call) -> None:
    out = tmp_path / "new folder" / "leg.xml"
    worn = ("attach", LEG_OF_ATTACH, "--orthosis", "s1", "--side", "right")
    code, said, noted = call(*worn, "--out", out, "--mjb")
    assert code == 0, noted
    for words in ("afo_valve_plantarflexor_outlet", "supply, gauge [Pa]", "12 actuators added", "0 to 45"):
        assert words in said
    for words in ("implicitfast now", "automatic reset is off", "adds 1.2 kg"):
        assert words in noted
    leg = read_attached(out)
    assert (leg.found.shank, leg.found.foot, leg.found.ankle) == ("shank", "foot", "ankle")
    assert leg.supply == 4e5
    assert mujoco.MjModel.from_binary_path(str(out.with_suffix(".mjb"))).nu == 12


@pytest.mark.slow
def test_attach_goes_on_with_the_other_leg(tmp_path: pathlib.Path, call: Call) -> None:
    suite = pytest.importorskip("dm_control.suite")
    humanoid = str(pathlib.Path(suite.__file__).parent / "humanoid.xml")
    one, two = str(tmp_path / "one.xml"), str(tmp_path / "two.xml")
    given = ("--orthosis", "s1", "--timestep", "1 ms")
    assert call("attach", humanoid, *given, "--side", "left", "--out", one)[0] == 0
    given = ("attach", one, *given, "--side", "right", "--out", two)
    code, _, refused = call(*given)
    assert code == 2
    assert "--prefix" in refused
    assert call(*given, "--prefix", "afo_right_")[0] == 0
    assert {leg.found.side for leg in read_attached(two).legs.values()} == {"left", "right"}


def test_attach_says_how_a_knees_sign_was_found(tmp_path: pathlib.Path, call: Call) -> None:
    said = call("attach", "pin_knee", "--orthosis", "pin_knee", "--out", tmp_path / "knee.xml")[1]
    assert "its own fold" in " ".join(said.split())


def test_a_knee_that_folds_forward_asks_for_its_sign(tmp_path: pathlib.Path, call: Call) -> None:
    (tmp_path / "bird.xml").write_text(person(backward=True))
    given = "attach", tmp_path / "bird.xml", "--orthosis", "pin_knee", "--out", tmp_path / "worn.xml"
    code, _, said = call(*given, "--joint", "left_knee")
    assert code == 2 and "--sign: is needed" in " ".join(said.split())
    assert call(*given, "--joint", "left_knee", "--sign", "1")[0] == 0
    assert read_attached(tmp_path / "worn.xml").found.sign == 1.0


def test_the_model_that_is_read_stays(tmp_path: pathlib.Path, call: Call) -> None:
    own = tmp_path / "own.xml"
    own.write_bytes(pathlib.Path(LEG_OF_ATTACH).read_bytes())
    before = own.read_bytes()
    code, _, refused = call("attach", own, "--orthosis", "s1", "--side", "right", "--out", own, "--force")
    assert code == 2 and "is the model that is read" in refused
    assert own.read_bytes() == before


@pytest.mark.parametrize("content", [b"", b"\x00\xff\xfe", b"<mujoco><worldbody>", b'{"a": 1}', b"<mujoco/>"])
def test_any_file_is_refused_in_words(content: bytes, tmp_path: pathlib.Path, call: Call) -> None:
    file = tmp_path / "a model.xml"
    file.write_bytes(content)
    code, _, refused = call("attach", file, "--orthosis", "s1", "--out", tmp_path / "out.xml")
    assert code == 2
    assert "Traceback" not in refused and refused.strip().count("\n") == 0
    assert [path.name for path in tmp_path.iterdir()] == ["a model.xml"]


def test_what_is_there_is_replaced_only_with_force(tmp_path: pathlib.Path, call: Call) -> None:
    given = ("attach", LEG_OF_ATTACH, "--orthosis", "s1", "--out", str(tmp_path / "leg.xml"))
    assert call(*given)[0] == 0
    before = (tmp_path / "leg.toml").read_bytes()
    code, _, refused = call(*given, "--supply", "3 bar")
    assert code == 2 and "--force" in refused
    assert (tmp_path / "leg.toml").read_bytes() == before
    assert call(*given, "--supply", "3 bar", "--force")[0] == 0
    assert read_attached(tmp_path / "leg.xml").supply == 3e5


def test_attach_to_plugin_writes_a_folder(tmp_path: pathlib.Path, call: Call) -> None:
    given = ("attach", LEG_OF_ATTACH, "--orthosis", "s1", "--to")
    for wrong in (("fmu",), ("plugin", "--mjb")):
        code, _, refused = call(*given, *wrong, "--out", tmp_path / "out")
        assert code == 2 and "--to" in refused and not (tmp_path / "out").exists()
    try:
        library = native.library_file()
    except CallbackError:
        pytest.skip("no library is built")
    code, out, _ = call(*given, "plugin", "--out", tmp_path / "out")
    assert code == 0 and "README.md" in out
    assert {"model.xml", library.name, "README.md"} <= {file.name for file in (tmp_path / "out").iterdir()}
    code, _, refused = call(*given, "plugin", "--out", tmp_path / "out")
    assert code == 2 and "exists" in refused


def test_a_damaged_sidecar_is_refused_in_words(tmp_path: pathlib.Path) -> None:
    leg = afo.attach(LEG_OF_ATTACH, "s1", side="right")
    write_attached(leg, tmp_path / "leg.xml")
    sidecar = tmp_path / "leg.toml"
    text = sidecar.read_text(encoding="utf-8")
    for damaged in (
        "",
        "version = 1",
        text.replace("version = 2", "version = 9"),
        text[: len(text) // 2],
        "\x00",
    ):
        sidecar.write_text(damaged, encoding="utf-8")
        with pytest.raises(afo.InputError) as caught:
            read_attached(tmp_path / "leg.xml")
        assert "\n" not in str(caught.value)
    sidecar.unlink()
    with pytest.raises(afo.InputError, match="is missing"):
        read_attached(tmp_path / "leg.xml")
    with pytest.raises(afo.InputError):
        read_attached(LEG_OF_ATTACH)  # with a leg's own TOML beside it


def test_refit_to_lengths_and_run(call: Call, tmp_path: pathlib.Path) -> None:
    lengths = ("--shank-length", "35 cm", "--foot-length", "22 cm")
    code, out, err = call("refit", "s1", *lengths, "--out", tmp_path / "mine")
    assert (code, err) == (0, "")
    assert "shank × 0.813, foot × 0.8271" in out  # 35/(0.246·175), 22/(0.152·175)
    worn = ("--set", f"orthosis={tmp_path / 'mine'}", "--set", "duration=1 s", "--no-rrd")
    code, _, err = call("run", "seated", *worn, "--out", tmp_path / "run")
    assert (code, err) == (0, "")
