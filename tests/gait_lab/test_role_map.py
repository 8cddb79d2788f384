"""A map of roles is written for editing, read back, and refuses what it cannot mean."""

import pathlib

import numpy as np
import pytest
from skin_markers import body, markers_of

from afo_sim.common import InputError, without_digests
from afo_sim.gait_lab import Choices, Markers, write_role_map
from afo_sim.gait_lab.trial.marker_legs import legs_from_markers
from afo_sim.gait_lab.trial.roles import find_roles, read_role_map

TIME = np.arange(0.0, 1.5, 0.01)
NAMES = {
    "asis": "{S}ASI",
    "psis": "{S}PSI",
    "sacrum": "SACR",
    "knee_lateral": "{S}KNE",
    "ankle_lateral": "{S}ANK",
    "heel": "{S}HEE",
    "metatarsal_2": "{S}TOE",
}


@pytest.fixture
def markers() -> Markers:
    return markers_of(body(TIME), NAMES, TIME)


def test_what_is_written_is_read_back(markers: Markers, tmp_path: pathlib.Path) -> None:
    file = tmp_path / "roles.toml"
    write_role_map(file, markers)
    guessed = find_roles(markers)
    table = read_role_map(file)
    for side in ("right", "left"):
        assert table[side] == {k: v for k, v in guessed.sides[side].items() if k != "sacrum"}
    assert table["middle"] == {"sacrum": ("SACR",)}
    with_map = legs_from_markers(markers, Choices(map=file))
    by_name = legs_from_markers(markers, Choices())
    for role, point in by_name["right"].points.items():
        assert np.array_equal(with_map["right"].points[role].path, point.path)
    assert "markers as roles.toml says" in with_map["right"].remarks


def test_what_is_missing_is_a_commented_line_with_candidates(tmp_path: pathlib.Path) -> None:
    names = NAMES | {"ankle_lateral": '{S}"Malleollus', "knee_medial": "{S}Knii.Med"}
    write_role_map(tmp_path / "roles.toml", markers_of(body(TIME), names, TIME))
    lines = (tmp_path / "roles.toml").read_text().splitlines()
    right = lines[lines.index("[right]") : lines.index("[left]")]
    (ankle,) = [line for line in right if line.startswith("# ankle_lateral =")]
    assert ankle.startswith('# ankle_lateral = ["NAME"]  # lateral malleolus; perhaps "R\\"Malleollus"')
    (knee,) = [line for line in right if line.startswith("# knee_medial =")]
    assert '"RKnii.Med"' in knee
    edited = "\n".join(lines[1:]).replace(ankle, 'ankle_lateral = "R\\"Malleollus"')
    (tmp_path / "roles.toml").write_text(edited)
    assert read_role_map(tmp_path / "roles.toml")["right"]["ankle_lateral"] == ('R"Malleollus',)


def test_a_map_replaces_all_guessing(markers: Markers, tmp_path: pathlib.Path) -> None:
    file = tmp_path / "roles.toml"
    write_role_map(file, markers)
    text = without_digests(file.read_text()).replace('heel = ["RHEE"]', 'heel = ["RHEE", "RANK"]')
    file.write_text("".join(line for line in text.splitlines(True) if "LTOE" not in line or line[0] == "#"))
    legs = legs_from_markers(markers, Choices(map=file))
    assert legs["right"].points["heel"].how == "midpoint of RHEE and RANK"
    assert list(legs) == ["right"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[rigth]\nheel = 'RHEE'", "rigth.*did you mean 'right'"),
        ("[right]\nheal = 'RHEE'", "right.heal.*did you mean 'heel'"),
        ("[right]\nheel = 'RHEEL'", "right.heel.*did you mean 'RHEE'"),
        ("[right]\nheel = 3", "right.heel.*is not a valid marker"),
        ("[right]\nheel = []", "right.heel.*is not a valid marker"),
        ("right = 3", "is not a valid table"),
        ("[middle]\nheel = 'RHEE'", "middle.heel.*is an unknown landmark"),
        ("[right", "is not valid TOML"),
    ],
)
def test_what_cannot_be_meant_is_refused(
    markers: Markers, tmp_path: pathlib.Path, text: str, words: str
) -> None:
    (tmp_path / "roles.toml").write_text(text)
    with pytest.raises(InputError, match=words):
        legs_from_markers(markers, Choices(map=tmp_path / "roles.toml"))


def test_a_map_may_name_a_standing_trials_markers(markers: Markers, tmp_path: pathlib.Path) -> None:
    time = np.arange(0.0, 1.0, 0.01)
    names = NAMES | {"ankle_medial": "{S}INNER", "shank_0": "{S}A", "shank_2": "{S}B"}
    walk = markers_of(body(TIME), {k: v for k, v in names.items() if k != "ankle_medial"}, TIME)
    still = markers_of(body(time, walks=False), names, time)
    file = tmp_path / "roles.toml"
    write_role_map(file, walk)
    file.write_text(without_digests(file.read_text()).replace("[left]", 'ankle_medial = "RINNER"\n[left]'))
    with pytest.raises(InputError, match="no such marker"):
        legs_from_markers(walk, Choices(map=file))
    ankle = legs_from_markers(walk, Choices(map=file), still)["right"].points["ankle"]
    assert np.allclose(ankle.path, body(TIME)["right"]["ankle_centre"], atol=1e-9)


def test_an_old_map_stays_where_writing_fails(markers: Markers, tmp_path: pathlib.Path) -> None:
    folder = tmp_path / "roles.toml"
    folder.mkdir()
    with pytest.raises(InputError, match="is a folder"):
        write_role_map(folder, markers)
    assert list(tmp_path.iterdir()) == [folder]
