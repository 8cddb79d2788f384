"""`afo-sim walk`: what it prints and writes, its pictures, and what it refuses."""

import csv
import html
import importlib
import json
import pathlib
import sys
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from command import Call

from afo_sim.show.walker_film import _beside, poses
from afo_sim.walker import (
    PICTURES,
    Response,
    asked_in_words,
    contacts,
    in_brief,
    in_words,
    populate,
    strides_of,
    table,
    walk,
    walk_body,
)
from afo_sim.walker.gait_signs import signs_of
from afo_sim.walker.search import pushes_at

SCENARIO = "walk-dropfoot-afo"
SHORT = ("walk", SCENARIO, "--patients", "one", "--duration", "4 s", "--starts", "1", "--threads", "1")
LONGER = (*SHORT, "--duration", "8 s")


@pytest.fixture(scope="module")
def found() -> Response:
    return walk(SCENARIO, duration=4.0, starts=1, threads=1)


@pytest.mark.slow
def test_a_walk_is_printed_and_written_whole(
    found: Response, call: Call, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("rerun")
    monkeypatch.setenv("COLUMNS", "200")
    folder = tmp_path / "out"
    code, out, err = call(*SHORT, "--rrd", "--out", folder)
    assert code == 0 and "Traceback" not in err, err
    for words in ("Does the wearer fall (in simulation)?", "What do they change?", "What does it cost them?"):
        assert words in out
    assert "not a patient's risk" in out and "nan" not in out.lower()
    told, asked = in_words(found), asked_in_words(found)
    order = [out.index(text) for text in (told[0], told[-1], "Does the wearer", "undisturbed walk", asked[0])]
    assert order == sorted(order) and all(line in out for line in told)
    columns = {f"{name.replace(' ', '_')}.parquet" for name in found.cases}
    assert {path.name for path in folder.iterdir()} == {"walk.json", *PICTURES, *columns}
    assert (folder / "walk.gif").stat().st_size < 2_000_000
    for name, case in found.cases.items():  # one walk, whoever asks for it
        kept = pq.read_table(folder / f"{name.replace(' ', '_')}.parquet")
        assert kept.column_names == list(case.walked.columns)
        assert all((kept[key].to_numpy() == values).all() for key, values in case.walked.columns.items())
    written = json.loads((folder / "walk.json").read_text(encoding="utf-8"))
    assert written["cases"]["patient"]["fell"] == found["patient"].walked.fell
    assert written["cases"]["healthy"]["falls"]["of"] == 1 and "mujoco" in written["versions"]
    assert {n: each["signs"] for n, each in written["cases"].items()} == {
        n: signs_of(case) for n, case in found.cases.items()
    }
    page = (folder / "walk.html").read_text(encoding="utf-8")
    plain = html.unescape(page)
    order = [plain.index(text) for text in (told[0], told[-1], "Does the wearer", "<table", asked[0])]
    assert order == sorted(order) and all(line in plain for line in told) and "{" not in plain[order[-1] :]
    assert page.count('src="data:image/') == 2  # film and figure
    assert "https://" not in page and "<script" not in page
    assert all(f">{cell}<" in page for row in table(found)[1] for cell in row[1:])
    before = (folder / "walk.json").read_bytes()
    code, _, err = call(*SHORT, "--seed", "1", "--out", folder)
    assert code == 2 and "--force" in err and (folder / "walk.json").read_bytes() == before
    code, _, err = call("run", "seated", "--out", folder)
    assert code == 2 and "responding walk" in err
    code, _, _ = call(*SHORT, "--vary", "supply.pressure=2 bar,4 bar", "--out", folder, "--force")
    assert code == 0 and {path.name for path in folder.iterdir()} == {"walk.json", "walk.csv", "walk.png"}
    rows = _rows(folder)
    assert [row["supply.pressure"] for row in rows] == ["2 bar", "2 bar", "4 bar", "4 bar"]
    own = [
        {name: cell.replace("−", "-") for name, cell in in_brief(found[case]).items()}
        for case in ("patient", "device")
    ]
    assert rows[2:] == [{"supply.pressure": "4 bar"} | each for each in own]  # the scenario's own pressure
    assert rows[0] == {"supply.pressure": "2 bar"} | own[0]  # air is nothing to who wears no device
    assert rows[1] != {"supply.pressure": "2 bar"} | own[1]


def _rows(folder: pathlib.Path) -> list[dict[str, str]]:
    return list(csv.DictReader((folder / "walk.csv").read_text(encoding="utf-8").splitlines()[1:]))


@pytest.mark.slow
def test_strength_is_varied_as_it_is_given(call: Call, tmp_path: pathlib.Path) -> None:
    folder = tmp_path / "out"
    (folder / ".afo-sim" / "other").mkdir(parents=True)  # of another walk, killed
    code, _, err = call(*LONGER, "--vary", "strength.tibialis=1,0.8,0", "--out", folder)
    assert code == 0 and not (folder / ".afo-sim").exists(), err
    rows = _rows(folder)
    assert [row["strength.tibialis"] for row in rows] == ["1", "1", "0.8", "0.8", "0", "0"]
    whole, weak, none = rows[::2]
    given = walk(SCENARIO, strength={"tibialis": 0.0}, duration=8.0, starts=1, threads=1)
    healthy = {name: cell.replace("−", "-") for name, cell in in_brief(given["healthy"]).items()}
    assert {name for name in healthy if whole[name] != healthy[name]} <= {"case"}  # it is the healthy walk
    ankle = "ankle in mid-swing [°]"
    assert float(weak[ankle]) < float(whole[ankle])  # the weaker, the lower the foot hangs
    own = in_brief(given["patient"])
    assert none == {"strength.tibialis": "0"} | {name: cell.replace("−", "-") for name, cell in own.items()}


@pytest.mark.slow
def test_the_pitch_at_contact_is_that_of_the_sole_in_the_model(found: Response) -> None:
    for case in found.cases.values():
        for side in ("right", "left"):
            strides = strides_of(case.walked, side)
            if len(strides.duration):
                heel, ball = poses(case, strides.begins[:-1])[side][:, 3:5].transpose(1, 0, 2)
                slopes = np.degrees(np.arctan2(*(ball - heel)[:, [2, 0]].T))
                assert case.numbers[f"{side}/pitch_contact"] == pytest.approx(slopes.mean(), abs=0.3)


@pytest.mark.slow
def test_the_healthy_walker_of_the_film_is_at_the_phase_of_the_case(found: Response) -> None:
    healthy = found["healthy"]
    theirs = contacts(healthy.walked, "right")
    for name in ("patient adapted", "device"):
        case = found[name]
        rows = np.append(0, contacts(case.walked, "right")[: len(theirs)])
        hips = poses(case, rows)["trunk"][:, 0, 0]
        behind = _beside(case, healthy, rows, hips)
        own = poses(healthy, np.append(0, theirs[: len(rows) - 1]))
        assert np.allclose(behind["healthy trunk"][:, 0, 0], hips)
        for limb in ("left", "trunk", "right"):
            assert np.allclose(np.diff(behind[f"healthy {limb}"], axis=1), np.diff(own[limb], axis=1))
            assert np.allclose(behind[f"healthy {limb}"][:, :, 2], own[limb][:, :, 2])


@pytest.mark.slow
def test_poses_are_those_of_the_walk(found: Response) -> None:
    for case in found.cases.values():
        seen, rows = poses(case, range(0, len(case.walked["time"]), 20)), slice(None, None, 20)
        for side in ("right", "left"):
            hip, knee, ankle = seen[side][:, 0], seen[side][:, 1], seen[side][:, 2]
            taller = case.walked.body.size.taller
            assert np.allclose(np.linalg.norm(knee - hip, axis=1), 0.396 * taller)  # the thigh's length
            low = seen[side][:, 3:7, 2].min(axis=1) - case.walked[f"{side}/clearance"][rows]
            assert abs(low).max() < 1e-3  # the column is of the step's beginning, 0.5 ms before
            thigh, shank = (
                np.arctan2(*(upper - lower)[:, [0, 2]].T) for upper, lower in ((hip, knee), (knee, ankle))
            )
            apart = (
                thigh - shank - case.walked[f"{side}/knee"][rows]
            )  # constant: the angle at which the knee is 0
            assert np.ptp(np.unwrap(apart)) < 1e-6
        assert set(seen) - {"left", "trunk", "right"} == (
            {*case.walked.body.ids.muscles} if case.walked.body.ids else set()
        )


@pytest.mark.slow
def test_a_killed_adaptation_goes_on_in_its_folder(
    call: Call, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is killed at the second value; nothing of its searches stays where there is an answer."""
    left = [10**6]

    def brief(*of: Any, **kinds: Any) -> Any:
        left[0] -= 1
        if left[0] < 0:
            raise KeyboardInterrupt
        body, vector, _, *more = of
        return walk_body(body, vector, 0.3, *more, **kinds)

    monkeypatch.setattr(sys.modules[pushes_at.__module__], "walk_body", brief)
    asked = (
        *SHORT[:4],
        "--starts",
        "0",
        "--generations",
        "1",
        "--vary",
        "supply.pressure=2 bar,4 bar",
        "--threads",
    )
    code, _, err = call(*asked, "1", "--out", tmp_path / "whole")
    assert code == 0, err
    count = 10**6 - left[0]
    left[0] = count * 3 // 4
    code, _, _ = call(*asked, "1", "--out", tmp_path / "killed")
    assert code != 0 and {path.name for path in (tmp_path / "killed").iterdir()} == {".afo-sim"}
    left[0] = 10**6
    code, _, err = call(*asked, "2", "--out", tmp_path / "killed")
    assert code == 0 and 10**6 - left[0] <= count - 6 * 16, err  # six generations at least are told
    names = {path.name for path in (tmp_path / "killed").iterdir()}
    assert names == {"walk.json", "walk.csv", "walk.png"}
    for name in ("walk.json", "walk.csv"):
        assert (tmp_path / "killed" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


@pytest.fixture
def two(tmp_path: pathlib.Path) -> pathlib.Path:
    """A condition of two patients, near the healthy."""
    file = tmp_path / "two.toml"
    source = 'source = "assumed"'
    file.write_text(f"patients = 2\n[drawn]\ntibialis = {{ from = 0.7, to = 1.0, {source} }}\n", "utf-8")
    return file


BRIEFLY = ("--duration", "4 s", "--starts", "1", "--threads", "1")


@pytest.mark.slow
def test_patients_are_printed_and_written_whole(
    call: Call, two: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    folder = tmp_path / "out"
    asked = ("walk", SCENARIO, "--patients", two, *BRIEFLY, "--out", folder)
    code, out, err = call(*asked)
    assert code == 0 and "Traceback" not in err, err
    names = {"walk.json", "walk.csv", "patients.csv", "curves.parquet", "walk.png", "walk.html"}
    assert {path.name for path in folder.iterdir()} == names
    assert "2 of 2 have not adapted" in out and "never a patient's risk" in out and "nan" not in out.lower()
    found = populate(SCENARIO, patients=two, duration=4.0, starts=1)
    rows = _rows(folder)
    assert [(row["case"], row["patient"]) for row in rows] == [
        (case, str(k)) for case in ("without", "device") for k in (1, 2)
    ]
    for row in rows:
        one = found[row["case"]][int(row["patient"]) - 1]
        assert (int(row["count"]), int(row["of"])) == (one.falls.count, one.falls.of)
        assert float(row["tibialis"]) == found.drawn[int(row["patient"]) - 1]["tibialis"]
        for name, value in one.numbers.items():
            assert float(row[name]) == pytest.approx(value, rel=1e-12, nan_ok=True)
    curves = pq.read_table(folder / "curves.parquet").to_pylist()
    for each in curves:
        angle = found[each["case"]][each["patient"] - 1].curves[each["curve"]]
        assert each["angle"] == pytest.approx(angle.tolist(), abs=1e-12)
    assert len(curves) == sum(len(one.curves) for case in found.cases.values() for one in case)
    written = json.loads((folder / "walk.json").read_text(encoding="utf-8"))
    page = html.unescape((folder / "walk.html").read_text(encoding="utf-8"))
    for reply in written["verdict"]:
        assert reply["text"] in page
    assert page.count('src="data:image/') == 1 and "<script" not in page and "https://" not in page
    before = (folder / "walk.json").read_bytes()
    code, _, err = call(*asked, "--seed", "1")
    assert code == 2 and "--force" in err and (folder / "walk.json").read_bytes() == before
    code, _, err = call(*SHORT, "--out", folder)  # one of them is another walk
    assert code == 2 and "--force" in err
    code, _, err = call(*asked[:-2], "--adapted", folder / "patients.csv", "--out", tmp_path / "again")
    assert code == 0, err  # nobody has adapted in it: the same walk
    assert _rows(tmp_path / "again") == rows


@pytest.mark.slow
def test_doses_of_patients_are_a_table(call: Call, two: pathlib.Path, tmp_path: pathlib.Path) -> None:
    briefly = ("--duration", "6 s", "--starts", "0", "--threads", "1")
    asked = ("walk", SCENARIO, "--patients", two, *briefly, "--out")
    for key, values, cases in (
        ("supply.pressure", ("2 bar", "4 bar"), ["without a device", "device, first day"]),
        (
            "spring",
            ("10 N*m/rad", "50 N*m/rad"),
            ["without a device", "device, first day", "spring, first day"],
        ),
    ):
        folder = tmp_path / key
        code, _, err = call(*asked, folder, "--vary", f"{key}={','.join(values)}")
        assert code == 0, err
        assert {path.name for path in folder.iterdir()} == {"walk.json", "walk.csv", "walk.png"}
        rows = _rows(folder)
        assert [(row[key], row["case"]) for row in rows] == [(x, case) for x in values for case in cases]
        first, second = rows[: len(cases)], rows[len(cases) :]
        assert first[0] | {key: ""} == second[0] | {key: ""}
        changed = [n for n in first[-1] if n != key and first[-1][n] != second[-1][n]]
        assert changed  # whoever wears it walks otherwise
        assert {row["starts that fall [%]"] for row in rows} == {"–"}  # nobody was pushed
        written = json.loads((folder / "walk.json").read_text(encoding="utf-8"))["command"]
        assert written["spring"] == ([10.0, 50.0] if key == "spring" else [None, None])


@pytest.fixture
def who(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Whose walk is asked for: the condition's name, or "one"."""
    asked: list[str] = []
    module = importlib.import_module("afo_sim.cli.walk")
    monkeypatch.setattr(module, "_walk", lambda _, condition, *of: asked.append(condition or "one"))
    return asked


@pytest.mark.parametrize(
    ("asked", "expected"),
    [
        ((), "drop-foot"),
        (("--spring", "30 N*m/rad"), "drop-foot"),
        (("--vary", "supply.pressure=2 bar"), "drop-foot"),
        (("--vary", "spring=10 N*m/rad"), "drop-foot"),
        (("--set", "supply.pressure=2 bar"), "drop-foot"),
        (("--set", "patient=spastic"), "spastic"),
        (("--set", "patient=drop-foot-mild"), "one"),  # of whom no others are drawn
        (("--patients", "contracture"), "contracture"),
        (("--patients", "one"), "one"),
        (("--strength", "tibialis=0.2"), "one"),
        (("--draws", "3"), "drop-foot"),
        (("--gait", "slow"), "one"),
        (("--subset", "swing"), "one"),
        (("--rrd",), "one"),
        (("--adapted-device", "drop-foot-s1"), "one"),
        (("--adapted", "drop-foot"), "one"),
        (("--vary", "strength.tibialis=1,0"), "one"),
        (("--vary", "patient.passive_scale=1,2"), "one"),
        (("--vary", "patient=drop-foot,spastic"), "one"),  # not one population under two names
        (("--vary", "leg=adult"), "one"),
        (("--set", "patient.body_mass=60 kg"), "one"),
    ],
)
def test_patients_walk_unless_one_is_described(
    asked: tuple[str, ...], expected: str, call: Call, who: list[str]
) -> None:
    code, _, err = call("walk", SCENARIO, *asked)
    assert code == 0 and who == [expected], err


@pytest.mark.parametrize(
    ("asked", "named"),
    [
        (("--patients", "drop-foot", "--strength", "tibialis=0.2"), "--strength"),
        (("--patients", "one", "--draws", "3"), "--draws"),
        (("--strength", "tibialis=0.2", "--draws", "3"), "--draws"),
        (("--patients", "drop-foot", "--vary", "supply.pressure=2 bar", "--draws", "3"), "--draws"),
        (("--patients", "drop-foot", "--gait", "slow"), "--gait"),
        (("--patients", "drop-foot", "--subset", "swing"), "--subset"),
        (("--patients", "drop-foot", "--adapted-device", "drop-foot-s1"), "--adapted-device"),
        (("--patients", "drop-foot", "--rrd"), "--rrd"),
        (("--patients", "drop-foot", "--vary", "strength.tibialis=1,0"), "--vary"),
        (("--patients", "drop-foot", "--vary", "patient=spastic"), "--vary"),
        (("--patients", "drop-foot", "--set", "patient=spastic"), "--set"),
        (("--patients", "drop-foot", "--set", "patient.body_mass=60 kg"), "--set"),
        (("--patients", "one", "--spring", "30 N*m/rad"), "--spring"),
        (("--patients", "one", "--vary", "spring=30 N*m/rad"), "--spring"),
        (("--strength", "tibialis=0.2", "--spring", "30 N*m/rad"), "--spring"),
        (("--spring", "0 N*m/rad"), "--spring"),
        (("--spring", "30"), "--spring"),
        (("--spring", "30 N/m"), "--spring"),
        (("--spring", ""), "--spring"),
        (("--vary", "spring=10 N*m/rad,-10 N*m/rad"), "--spring"),  # the second, before the first walks
        (("--vary", "spring=10"), "--spring"),
        (("--patients", "dropfoot"), "did you mean 'drop-foot'?"),
        (("--patients", ""), "drop-foot"),
        (("--starts", "-1"), "--starts"),
        (("--duration", "3 s"), "--duration"),
        (("--adapted", "none.csv", "--patients", "drop-foot"), "none.csv"),
    ],
)
def test_options_that_do_not_go_together_are_refused_in_a_sentence(
    asked: tuple[str, ...], named: str, call: Call, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.modules["afo_sim.walker.patients"], "walk_body", None)  # nobody walks
    monkeypatch.setattr(sys.modules["afo_sim.walker.respond"], "walk_body", None)
    code, _, err = call("walk", SCENARIO, *asked, "--out", tmp_path / "out")
    assert code == 2 and named in err and "Traceback" not in err, err
    assert len(err.strip().splitlines()) == 1 and not (tmp_path / "out" / "walk.json").exists(), err


def test_nobody_is_drawn_for_a_scenario_in_which_nobody_walks(call: Call, tmp_path: pathlib.Path) -> None:
    for asked in ((), ("--patients", "drop-foot")):
        code, _, err = call("walk", "seated", *asked, "--out", tmp_path / "out")
        assert code == 2 and "nobody walks" in err and "patient.toml" not in err
