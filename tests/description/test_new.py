"""Templates: written by `afo-sim new`, complete, and running as they are."""

import pathlib
import re
import tomllib
from typing import Any

import pytest
from command import call

import afo_sim
from afo_sim.cli.doctor.kinds import check_file
from afo_sim.common import InputError, assets
from afo_sim.description import fields_of, load, of_chambers, tables, toml_text
from afo_sim.description.air.source import MAY_HAVE, NEEDED, OF_ONE_KIND
from afo_sim.description.new import new, reference
from afo_sim.description.schema import KINDS, SPECS, Leaf, allowed, is_table, type_below, unit_of
from afo_sim.description.tree import FILES
from afo_sim.study import new_study
from afo_sim.study import sweep_plan as sweeps
from afo_sim.study.parameter_table import ParameterTable
from afo_sim.study.search import plan as searches


def every_field(kind: Any) -> dict[str, list[Leaf]]:
    """All fields of a description by name, also of its tables, not of what it refers to by name."""
    found: dict[str, list[Leaf]] = {}
    below = [of_chambers(kind)] if is_table(of_chambers(kind)) else []
    for name, leaf in fields_of(kind).items():
        inner, many = tables(leaf.annotation)
        found.setdefault(name, []).append(leaf)
        if many in ("one", "named") and inner not in KINDS:
            below.append(inner)
    for table in below:
        for name, several in every_field(table).items():
            found.setdefault(name, []).extend(several)
    return found


@pytest.mark.parametrize("kind", SPECS)
def test_template_holds_every_field_as_it_is_allowed_and_is_good(kind: str, tmp_path: pathlib.Path) -> None:
    file = new(kind, "mine", tmp_path, whole=True)
    text = file.read_text()
    written = set(re.findall(r"^(?:# )?\[?([\w.]+)(?:\]| = )", text, re.MULTILINE))
    parts = {part for key in written for part in key.split(".")}
    fields = every_field(SPECS[kind])
    assert fields.keys() - parts == set()
    told = " ".join(text.replace("\n# ", " ").split())
    for leaf in (leaf for several in fields.values() for leaf in several if not tables(leaf.annotation)[1]):
        unit = f"[{unit_of(leaf.annotation)}] " if unit_of(leaf.annotation) else ""
        end = "needed" if leaf.required else "default"
        assert f"{' '.join(leaf.meaning.split())} {unit}{allowed(leaf.annotation)}; {end}" in told, leaf.key
    assert load(kind, assets.template(kind)).description
    assert load(kind, file).description.startswith("mine, begun from ")
    assert check_file(file)[0] == ("kind", kind)


@pytest.mark.parametrize("kind", SPECS)
def test_template_is_valid_with_each_comment_undone(kind: str, tmp_path: pathlib.Path) -> None:
    """A commented key that is taken in is read as a value of its field."""
    lines = new(kind, "mine", tmp_path, whole=True).read_text().splitlines()
    if kind == "valve":  # each of the two needs the other
        lines = [line for line in lines if not line.startswith("# hold_")]
    if kind == "source":  # refuses the keys of other kinds than the bottle that it begins with
        others = tuple(f"# {key} = " for key in OF_ONE_KIND)
        lines = [line for line in lines if not line.startswith(others)]
    undone = [
        line.removeprefix("# ") if re.match(r"# (\[[\w.]+\]$|\w+ = )", line) else line for line in lines
    ]
    table = tomllib.loads("\n".join(undone))  # TOML refuses a key that is there twice
    others = OF_ONE_KIND - {*NEEDED["bottle"], *MAY_HAVE["bottle"]} if kind == "source" else set()
    # the segments' names go with a joint, and a bandwidth or a dead band bars the delays
    alone = {*others, "name", "patient", "shoe", "reference", "bandwidth", "dead_band", "joint"}
    for key, value in table.items():
        if not isinstance(value, dict) and key not in alone:
            load(kind, tmp_path / ("mine.toml" if kind == "scenario" else f"mine/{kind}.toml"), {key: value})


def without_sources(node: Any) -> Any:
    """A description without its name, and with the kinds of its numbers' sources alone."""
    if isinstance(node, dict):
        return {key: without_sources(value) for key, value in node.items() if key not in ("name", "source")}
    return [without_sources(item) for item in node] if isinstance(node, list | tuple) else node


@pytest.mark.parametrize("kind", SPECS)
def test_the_short_form_is_the_same_thing(kind: str, tmp_path: pathlib.Path) -> None:
    """In 60 lines; each value with its kind; each comment behind a key as the field is allowed."""
    file = new(kind, "mine", tmp_path / "short")
    lines = file.read_text().splitlines()
    assert len(lines) <= 60
    assert f"afo-sim new {kind} NAME --all" in lines[-1] and "afo-sim keys" in lines[-1]
    whole = new(kind, "mine", tmp_path / "whole", whole=True)
    short, full = (without_sources(load(kind, f).model_dump(mode="json")) for f in (file, whole))
    copied = dict.fromkeys(FILES.get(kind, ()))  # beside each
    assert short | copied == full | copied
    assert check_file(file)[0] == ("kind", kind)
    table: tuple[str, ...] = ()
    for line in lines:
        if opened := re.match(r"(?:# )?\[([\w.]+)\]", line):
            table = tuple(opened[1].split("."))
        told = re.match(r"(?:# )?([\w.]+) = .*  # .*?: (.+)$", line)
        if told and "afo-sim" not in line:
            at: Any = SPECS[kind]
            for name in (*table, *told[1].split(".")):
                at = type_below(at, name, table[-1] if table else "")
            assert line.endswith(f": {allowed(at)}"), line


def test_every_option_does_not_go_with_anothers_file(tmp_path: pathlib.Path) -> None:
    for more in (
        {"like": "dmsp_20"},
        {"braid": {"bore": "10 mm", "braid_angle": "25 deg", "length": "20 cm"}},
    ):
        with pytest.raises(InputError) as refused:
            new("muscle", "mine", tmp_path, whole=True, **more)  # type: ignore[arg-type]
        assert refused.value.field == "whole"
    assert list(tmp_path.iterdir()) == []


def test_own_orthosis_with_own_muscle_in_four_commands(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for arguments in (
        ("new", "muscle", "mine"),
        ("new", "orthosis", "brace", "--muscle", "mine"),
        ("new", "scenario", "first", "--orthosis", "brace"),
        ("run", "first.toml", "--set", "duration=0.2 s", "--no-rrd"),
    ):
        code, _, complaint = call(capsys, *arguments)
        assert code == 0, complaint
    scenario = load("scenario", "first.toml")
    assert scenario.orthosis.name == "brace"
    assert {group.type.name for group in scenario.orthosis.muscle.values()} == {"mine"}
    run = afo_sim.read_recording("runs/first")
    assert run.ok
    assert "muscle/dorsiflexor_1/force" in run.columns


@pytest.mark.parametrize("length", ["24 cm", "15 cm"])
def test_the_link_fits_another_muscle(length: str, tmp_path: pathlib.Path) -> None:
    """Muscle, fittings and link together stay as long as those of the orthosis that it begins from."""
    braid = {"bore": "10 mm", "braid_angle": "25 deg", "length": length}
    muscle = new("muscle", "mine", tmp_path, braid=braid)
    own = load("orthosis", new("orthosis", "brace", tmp_path, uses={"muscle": str(muscle.parent)}))
    for name, shipped in load("orthosis", "s1").muscle.items():
        before, after = ((g.link_length or 0.0) + g.type.total_length for g in (shipped, own.muscle[name]))
        assert after == pytest.approx(before, abs=1e-6)


def test_a_link_that_says_where_it_comes_from_fits_another_muscle_too(tmp_path: pathlib.Path) -> None:
    file = new("orthosis", "mine", out=tmp_path, like="pin_knee", uses={"muscle": "dmsp_10"})
    before, after = (load("orthosis", each).muscle["flexor"] for each in ("pin_knee", file))
    lengths = [group.link_length + group.type.total_length for group in (before, after)]
    assert lengths[0] == pytest.approx(lengths[1], abs=1e-6)  # written to five digits of a millimetre


@pytest.mark.parametrize(
    ("length", "said"), [("24 cm", "link of dorsiflexor: 87 mm"), ("60 cm", "no link is left")]
)
def test_the_fitted_link_is_said(
    length: str, said: str, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    """S1's muscle is 21.5 cm long between its ends, its link 11.2 cm; one of 24 cm leaves 2.5 cm less."""
    monkeypatch.chdir(tmp_path)
    new("muscle", "mine", tmp_path, braid={"bore": "10 mm", "braid_angle": "25 deg", "length": length})
    code, printed, _ = call(capsys, "new", "orthosis", "brace", "--muscle", "mine")
    assert code == 0 and said in printed


@pytest.mark.slow
def test_a_slack_design_is_checked_as_slack_with_its_number(tmp_path: pathlib.Path) -> None:
    """A link that is longer by 10 mm hangs through by 10 mm more, and one that is shorter by that is taut."""
    file = new("orthosis", "brace", tmp_path)
    text = file.read_text()

    def least(link: float) -> float | None:
        file.write_text(re.sub(r'(?<=link_length = ")[\d.]+ cm', f"{link} cm", text, count=1))
        notices = [said for _, said in check_file(file) if getattr(said, "code", "") == "slack-everywhere"]
        return next((n.data["least"] for n in notices if n.subject == "dorsiflexor"), None)

    long, longer = least(15.2), least(16.2)
    assert long is not None and longer is not None and longer - long == pytest.approx(10.0)
    assert least(15.2 - 0.1 * long) is None


@pytest.mark.parametrize("like", ["", "arm-s1", "walk-dropfoot-afo", "walk-healthy"])
def test_scenario_like_another(like: str, tmp_path: pathlib.Path) -> None:
    own = load("scenario", new("scenario", "mine", tmp_path, like=like)).resolved()
    shipped = load("scenario", like or "seated").resolved()
    assert own | {name: shipped[name] for name in ("name", "description")} == shipped


def test_timing_goes_over_to_the_chambers_of_another_orthosis(tmp_path: pathlib.Path) -> None:
    uses = {"orthosis": "arm_s1", "leg": "arm"}
    scenario = load("scenario", new("scenario", "mine", tmp_path, uses=uses))
    assert scenario.timer is not None
    assert {name: times.inlet for name, times in scenario.timer.chambers.items()} == {
        "flexor": ((0.0, 4.0),),
        "extensor": (),
    }
    assert afo_sim.run(scenario.with_values(duration=0.2)).ok


def test_patient_and_leg_of_ones_own(tmp_path: pathlib.Path) -> None:
    patient, leg = new("patient", "someone", tmp_path), new("leg", "limb", tmp_path)
    uses = {"patient": str(patient.parent), "leg": str(leg)}
    file = new("scenario", "walk", tmp_path / "deep" / "er", like="walk-dropfoot", uses=uses)
    scenario = load("scenario", file)
    assert scenario.patient is not None
    assert (scenario.patient.name, scenario.leg.name) == ("someone", "limb")
    assert tomllib.loads(file.read_text())["patient"] == "../../someone"


def test_nothing_is_overwritten(tmp_path: pathlib.Path) -> None:
    file = new("orthosis", "brace", tmp_path)
    before = file.read_text()
    with pytest.raises(InputError, match="not overwritten"):
        new("orthosis", "brace", tmp_path, uses={"muscle": "s1_120mm"})
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "cuff.xml").write_text("mine")
    with pytest.raises(InputError, match=r"cuff\.xml: already exists"):
        new("orthosis", "other", tmp_path)
    assert file.read_text() == before
    assert [path.name for path in (tmp_path / "other").iterdir()] == ["cuff.xml"]
    assert (tmp_path / "other" / "cuff.xml").read_text() == "mine"


@pytest.mark.parametrize(
    ("kind", "name", "uses", "like", "expected"),
    [
        ("muscle", "s1_215mm", {}, "", "shipped muscle"),
        ("muscle", "../up", {}, "", "is not a valid name"),
        ("muscle", "mine", {"leg": "arm"}, "", "is not an option of a new muscle"),
        ("scenario", "mine", {"patient": "healthy"}, "", "scenario that walks"),
        ("scenario", "mine", {"orthosis": "s"}, "", "no such orthosis"),
        ("scenario", "mine", {"orthosis": "none", "leg": "nowhere"}, "", "no such leg"),
        ("scenario", "mine", {}, "seatd", "did you mean 'seated'"),
    ],
)
def test_what_does_not_fit_leaves_nothing(
    kind: str, name: str, uses: dict[str, str], like: str, expected: str, tmp_path: pathlib.Path
) -> None:
    with pytest.raises(InputError, match=expected):
        new(kind, name, tmp_path, like=like, uses=uses)
    assert list(tmp_path.iterdir()) == []


def test_path_that_reads_like_a_shipped_name(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    own = new("muscle", "mine", tmp_path).parent.rename(tmp_path / "dmsp_20")
    assert reference("muscle", "dmsp_20", tmp_path) == "dmsp_20"
    assert reference("muscle", str(own), tmp_path) == "./dmsp_20"


def options(*kinds: Any) -> set[str]:
    return {info.alias or name for kind in kinds for name, info in kind.model_fields.items()}


def test_sweep_and_search_hold_every_option() -> None:
    of_search = (searches.SearchFile, searches.ObjectiveTable, searches.LimitTable, searches.PatientsTable)
    for kind, kinds in (("sweep", (sweeps.SweepFile, ParameterTable)), ("search", of_search)):
        text = assets.template(kind).read_text(encoding="utf-8")
        for option in options(*kinds):
            assert re.search(rf"^(# )?(\[+{option}[.\]]|{option} = )", text, re.MULTILINE), option


@pytest.mark.parametrize("scenario", ["seated", "walk-dropfoot-afo"])
@pytest.mark.parametrize("whole", [False, True])
def test_sweep_and_search_are_good(scenario: str, whole: bool, tmp_path: pathlib.Path) -> None:
    sweep = sweeps.read(new_study("sweep", "mine", tmp_path, uses={"scenario": scenario}, whole=whole))
    assert (sweep.scenario, [p.keys for p in sweep.parameters]) == (scenario, [("supply.pressure",)])
    search = searches.read(new_study("search", "mine2", tmp_path, uses={"scenario": scenario}, whole=whole))
    assert search.designs.scenario == scenario
    for name in ("mine", "mine2"):
        assert whole or len((tmp_path / f"{name}.toml").read_text().splitlines()) <= 60
        assert check_file(tmp_path / f"{name}.toml")[0][1] in ("sweep", "search")


def test_sweep_of_ones_own_scenario_runs(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    new("scenario", "first", tmp_path)
    new_study("sweep", "many", tmp_path, uses={"scenario": "first.toml"})
    code, printed, complaint = call(capsys, "sweep", "many.toml", "--threads", "1")
    assert code == 0, complaint
    assert "3 of 3 are done" in printed


def test_what_conversions_leave_behind_the_twelfth_digit_is_not_written() -> None:
    table = {"a": 0.030000000000000002, "b": "0.11199999999999999 m", "name": "1.50", "told": "0.1 of 0.3 m"}
    assert tomllib.loads(toml_text(table, exact=False)) == table | {"a": 0.03, "b": "0.112 m"}
    assert tomllib.loads(toml_text(table)) == table
