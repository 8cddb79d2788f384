"""The command attach: what it prints and writes, and one sentence for any bad input."""

import pathlib

import mujoco
import pytest
from command import call
from documents import ROOT

import afo_sim as afo
from afo_sim.legs.attached_files import write_attached

Capture = pytest.CaptureFixture[str]
LEG = str(ROOT / "models" / "legs" / "adult_75kg" / "leg.xml")


def test_attach_tells_what_it_found_and_writes_it(tmp_path: pathlib.Path, capsys: Capture) -> None:
    out = tmp_path / "new folder" / "leg.xml"
    code, said, noted = call(
        capsys, "attach", LEG, "--orthosis", "s1", "--side", "right", "--out", out, "--mjb"
    )
    assert code == 0, noted
    for words in ("afo_valve_plantarflexor_outlet", "supply, gauge [Pa]", "12 actuators added", "0 to 31"):
        assert words in said
    for words in ("implicitfast now", "automatic reset is off", "adds 1.2 kg"):
        assert words in noted
    leg = afo.attached(out)
    assert (leg.found.shank, leg.found.foot, leg.found.ankle) == ("shank", "foot", "ankle")
    assert leg.supply == 4e5
    assert mujoco.MjModel.from_binary_path(str(out.with_suffix(".mjb"))).nu == 12


def test_attach_goes_on_with_the_other_leg(tmp_path: pathlib.Path, capsys: Capture) -> None:
    suite = pytest.importorskip("dm_control.suite")
    humanoid = str(pathlib.Path(suite.__file__).parent / "humanoid.xml")
    one, two = str(tmp_path / "one.xml"), str(tmp_path / "two.xml")
    given = ("--orthosis", "s1", "--timestep", "1 ms")
    assert call(capsys, "attach", humanoid, *given, "--side", "left", "--out", one)[0] == 0
    given = ("attach", one, *given, "--side", "right", "--out", two)
    code, _, refused = call(capsys, *given)
    assert code == 2
    assert "--prefix" in refused
    assert call(capsys, *given, "--prefix", "afo_right_")[0] == 0
    assert {leg.found.side for leg in afo.attached(two).legs.values()} == {"left", "right"}


def test_the_model_that_is_read_stays(tmp_path: pathlib.Path, capsys: Capture) -> None:
    own = tmp_path / "own.xml"
    own.write_bytes(pathlib.Path(LEG).read_bytes())
    before = own.read_bytes()
    code, _, refused = call(
        capsys, "attach", str(own), "--orthosis", "s1", "--side", "right", "--out", str(own), "--force"
    )
    assert code == 2 and "is the model that is read" in refused
    assert own.read_bytes() == before


BAD = {
    "no such file": (("nowhere.xml",), "there is no such file"),
    "a folder": ((str(ROOT),), "is a folder"),
    "no such orthosis": ((LEG, "--orthosis", "s2"), "did you mean 's1'"),
    "no such side": ((LEG, "--side", "rihgt"), "did you mean 'right'"),
    "no such body": ((LEG, "--shank", "shnak"), "did you mean 'shank'"),
    "no number": ((LEG, "--supply", "much"), "--supply"),
    "no angle": ((LEG, "--zero", "3"), "--zero"),
    "too long a step": ((LEG, "--timestep", "50 ms"), "at most"),
    "no name": ((LEG, "--prefix", "x y"), "--prefix"),
    "no MJCF name": ((LEG, "--out", "leg.toml"), "NAME.xml"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_sentence(
    case: str, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    monkeypatch.chdir(tmp_path)
    given, words = BAD[case]
    orthosis = () if "--orthosis" in given else ("--orthosis", "s1")
    code, _, refused = call(capsys, "attach", *given, *orthosis)
    assert code == 2
    assert words in refused
    assert "Traceback" not in refused and refused.strip().count("\n") == 0
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("content", [b"", b"\x00\xff\xfe", b"<mujoco><worldbody>", b'{"a": 1}', b"<mujoco/>"])
def test_any_file_is_refused_in_words(content: bytes, tmp_path: pathlib.Path, capsys: Capture) -> None:
    file = tmp_path / "a model.xml"
    file.write_bytes(content)
    code, _, refused = call(capsys, "attach", file, "--orthosis", "s1", "--out", tmp_path / "out.xml")
    assert code == 2
    assert "Traceback" not in refused and refused.strip().count("\n") == 0
    assert [path.name for path in tmp_path.iterdir()] == ["a model.xml"]


def test_what_is_there_is_replaced_only_with_force(tmp_path: pathlib.Path, capsys: Capture) -> None:
    given = ("attach", LEG, "--orthosis", "s1", "--out", str(tmp_path / "leg.xml"))
    assert call(capsys, *given)[0] == 0
    before = (tmp_path / "leg.toml").read_bytes()
    code, _, refused = call(capsys, *given, "--supply", "3 bar")
    assert code == 2 and "--force" in refused
    assert (tmp_path / "leg.toml").read_bytes() == before
    assert call(capsys, *given, "--supply", "3 bar", "--force")[0] == 0
    assert afo.attached(tmp_path / "leg.xml").supply == 3e5


def test_a_damaged_sidecar_is_refused_in_words(tmp_path: pathlib.Path) -> None:
    leg = afo.attach(LEG, "s1", side="right")
    write_attached(leg, tmp_path / "leg.xml")
    sidecar = tmp_path / "leg.toml"
    text = sidecar.read_text(encoding="utf-8")
    for damaged in (
        "",
        "version = 1",
        text.replace("version = 1", "version = 9"),
        text[: len(text) // 2],
        "\x00",
    ):
        sidecar.write_text(damaged, encoding="utf-8")
        with pytest.raises(afo.InputError) as caught:
            afo.attached(tmp_path / "leg.xml")
        assert "\n" not in str(caught.value)
    sidecar.unlink()
    with pytest.raises(afo.InputError, match="is missing"):
        afo.attached(tmp_path / "leg.xml")
    with pytest.raises(afo.InputError):
        afo.attached(LEG)  # with a leg's own TOML beside it
