"""A map of roles is written for editing, read back, and refuses what it cannot mean."""

import pathlib

import numpy as np
import pytest
from skin_markers import body, markers_of

from afo_sim.common import InputError
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


def test_a_map_speaks_first_and_names_complete_it(markers: Markers, tmp_path: pathlib.Path) -> None:
    file = tmp_path / "roles.toml"
    file.write_text('[right]\nheel = ["RHEE", "RANK"]\n[l]\ntoe_tip = "LHEE"\n')
    legs = legs_from_markers(markers, Choices(map=file))
    assert legs["right"].points["heel"].how == "midpoint of RHEE and RANK"
    assert legs["right"].points["toe"].source == "RTOE"
    assert legs["left"].points["toe"].source == "LHEE"  # instead of LTOE, and the heel's no longer
    assert legs["left"].points["heel"].source != "LHEE"


LABORATORY = """
[both]
heel = "{S}CAL or {S}HEE"
ankle_lateral = "{S}ANK or {s}-mall-x"
ankle_medial = "{S}INNER"
[middle]
sacrum = "SACR or L5S1"
"""


def test_one_map_serves_all_trials_of_a_laboratory(tmp_path: pathlib.Path) -> None:
    """Two namings, a standing trial that has the medial malleolus, walks that have not."""
    file = tmp_path / "lab.toml"
    file.write_text(LABORATORY)
    time = np.arange(0.0, 1.0, 0.01)
    for new in ({}, {"heel": "{S}CAL", "ankle_lateral": "{s}-mall-x", "sacrum": "L5S1"}):
        worn = NAMES | new | {"shank_0": "{S}A", "shank_2": "{S}B"}
        walk = markers_of(body(TIME), worn, TIME)
        legs = legs_from_markers(walk, Choices(map=file))
        for side in ("right", "left"):
            assert legs[side].points["heel"].source == worn["heel"].format(S=side[0].upper())
            assert (
                worn["ankle_lateral"].format(S=side[0].upper(), s=side[0]) in legs[side].points["ankle"].how
            )
        assert any("RINNER, LINNER, which the trial lacks" in remark for remark in legs["right"].remarks)
        still = markers_of(body(time, walks=False), worn | {"ankle_medial": "{S}INNER"}, time)
        ankle = legs_from_markers(walk, Choices(map=file), still)["left"].points["ankle"]
        assert np.allclose(ankle.path, body(TIME)["left"]["ankle_centre"], atol=1e-9)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[rigth]\nheel = 'RHEE'", "rigth.*did you mean 'right'"),
        ("[right]\nheal = 'RHEE'", "right.heal.*did you mean 'heel'"),
        ("[right]\nheel = 'RHEEL'", "right.heel.*did you mean 'RHEE'"),
        ("[r]\nheel = 'RHEEL or CAL'", "right.heel = 'RHEEL'.*did you mean 'RHEE'"),
        ("[both]\nheel = '{S}HEEL'", "right.heel = 'RHEEL'.*did you mean 'RHEE'"),
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


def test_an_old_map_stays_where_writing_fails(markers: Markers, tmp_path: pathlib.Path) -> None:
    folder = tmp_path / "roles.toml"
    folder.mkdir()
    with pytest.raises(InputError, match="is a folder"):
        write_role_map(folder, markers)
    assert list(tmp_path.iterdir()) == [folder]
