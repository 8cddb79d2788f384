"""Marker sets are known by their names, whatever their prefix, case and punctuation."""

import re

import numpy as np
import pytest
from skin_markers import body, markers_of

from afo_sim.common import InputError
from afo_sim.gait_lab import Choices, Markers
from afo_sim.gait_lab.trial.marker_legs import legs_from_markers
from afo_sim.gait_lab.trial.roles import find_roles

TIME = np.arange(0.0, 1.5, 0.01)

# Names as the sets' own guides and example files have them; {S} and {s} are the side's letter.
SETS = {
    "Plug-in Gait / Helen Hayes": {
        "asis": "{S}ASI", "psis": "{S}PSI", "knee_lateral": "{S}KNE", "ankle_lateral": "{S}ANK",
        "heel": "{S}HEE", "metatarsal_2": "{S}TOE", "thigh_0": "{S}THI", "shank_0": "{S}TIB",
    },
    "gait2354 / gait2392": {
        "asis": "{S}.ASIS", "sacrum": "V.Sacral", "knee_lateral": "{S}.Knee.Lat",
        "knee_medial": "{S}.Knee.Med", "ankle_lateral": "{S}.Ankle.Lat", "ankle_medial": "{S}.Ankle.Med",
        "heel": "{S}.Heel", "metatarsal_1": "{S}.Toe.Med", "metatarsal_5": "{S}.Toe.Lat",
        "toe_tip": "{S}.Toe.Tip", "thigh_0": "{S}.Thigh.Upper", "shank_0": "{S}.Shank.Rear",
    },
    "Rajagopal model": {
        "asis": "{S}ASI", "psis": "{S}PSI", "knee_lateral": "{S}LFC", "knee_medial": "{S}MFC",
        "ankle_lateral": "{S}LMAL", "ankle_medial": "{S}MMAL", "heel": "{S}CAL", "metatarsal_5": "{S}MT5",
        "toe_tip": "{S}TOE", "thigh_0": "{S}TH1", "shank_0": "{S}TB1",
    },
    "OpenSim walking example": {
        "asis": "{S}.ASIS", "psis": "{S}.PSIS", "sacrum": "S2", "knee_lateral": "{S}.Knee",
        "ankle_lateral": "{S}.Ankle", "heel": "{S}.Heel", "metatarsal_5": "{S}.MT5", "toe_tip": "{S}.Toe",
        "shank_0": "{S}.SH1",
    },
    "OpenCap": {
        "asis": "{s}.ASIS_study", "psis": "{s}.PSIS_study", "hip_centre": "{S}HJC_study",
        "knee_lateral": "{s}_knee_study", "knee_medial": "{s}_mknee_study",
        "ankle_lateral": "{s}_ankle_study", "ankle_medial": "{s}_mankle_study", "heel": "{s}_calc_study",
        "metatarsal_5": "{s}_5meta_study", "toe_tip": "{s}_toe_study", "thigh_0": "{s}_thigh1_study",
    },
    "video keypoints (BODY_25, HALPE_26)": {
        "hip_centre": "{S}Hip", "knee_centre": "{S}Knee", "ankle_centre": "{S}Ankle", "heel": "{S}Heel",
        "metatarsal_5": "{S}SmallToe", "toe_tip": "{S}BigToe",
    },
    "CAST": {
        "asis": "{S}_IAS", "psis": "{S}_IPS", "trochanter": "{S}_FTC", "knee_lateral": "{S}_FLE",
        "knee_medial": "{S}_FME", "ankle_lateral": "{S}_FAL", "ankle_medial": "{S}_TAM", "heel": "{S}_FCC",
        "metatarsal_1": "{S}_FM1", "metatarsal_2": "{S}_FM2", "metatarsal_5": "{S}_FM5", "shank_0": "{S}_TTC",
        "shank_1": "{S}_FAX",
    },
    "IOR / ISB landmarks": {
        "asis": "{S}ASIS", "psis": "{S}PSIS", "trochanter": "{S}GT", "knee_lateral": "{S}LE",
        "knee_medial": "{S}ME", "ankle_lateral": "{S}LM", "ankle_medial": "{S}MM", "heel": "{S}CA",
        "metatarsal_1": "{S}FM", "metatarsal_2": "{S}SM", "metatarsal_5": "{S}VM", "shank_0": "{S}TT",
        "shank_1": "{S}HF",
    },
    "Human Body Model": {
        "asis": "{S}ASIS", "sacrum": "SACR", "trochanter": "{S}GTRO", "knee_lateral": "{S}LEK",
        "knee_medial": "{S}MEK", "ankle_lateral": "{S}LM", "ankle_medial": "{S}MM", "heel": "{S}HEE",
        "metatarsal_5": "{S}MT5", "toe_tip": "{S}TOE",
    },
    "BMClab (Fukuchi)": {
        "asis": "{S}.ASIS", "psis": "{S}.PSIS", "trochanter": "{S}.GTR", "knee_lateral": "{S}.Knee",
        "knee_medial": "{S}.Knee.Medial", "ankle_lateral": "{S}.Ankle", "ankle_medial": "{S}.Ankle.Medial",
        "heel": "{S}.Heel", "metatarsal_1": "{S}.MT1", "metatarsal_2": "{S}.MT2", "metatarsal_5": "{S}.MT5",
        "thigh_0": "{S}.Thigh.Top.Lateral",
    },
    "Visual3D": {
        "asis": "{S}ASIS", "psis": "{S}PSIS", "trochanter": "{S}GT", "knee_lateral": "{S}LK",
        "knee_medial": "{S}MK", "ankle_lateral": "{S}LA", "ankle_medial": "{S}MA", "heel": "{S}HL",
        "metatarsal_1": "{S}1MH", "metatarsal_5": "{S}5MH", "thigh_0": "{S}TH1", "shank_0": "{S}SK1",
    },
}  # fmt: skip
# Sets with names that mean something in them alone; those of the others are spelled.
RECOGNISED = {"Plug-in Gait / Helen Hayes", "OpenCap", "video keypoints (BODY_25, HALPE_26)", "Visual3D"}
LANDMARKS_ONLY = {
    known: {k: v for k, v in names.items() if not k.startswith(("thigh_", "shank_"))}
    for known, names in SETS.items()
}


def letters(pattern: str, side: str) -> str:
    return pattern.format(s=side[0], S=side[0].upper(), side=side, Side=side.capitalize())


@pytest.mark.parametrize("known", SETS)
def test_every_marker_of_a_set_is_known_by_name(known: str) -> None:
    roles = find_roles(markers_of(body(TIME), SETS[known], TIME))
    if known in RECOGNISED:
        assert any(known in remark for remark in roles.remarks)
    for side in ("right", "left"):
        expected = {mark: (letters(name, side),) for mark, name in LANDMARKS_ONLY[known].items()}
        assert dict(roles.sides[side]) == expected
    assert not roles.warnings


@pytest.mark.parametrize("known", SETS)
def test_a_sets_centres_come_back(known: str) -> None:
    """Exact where lateral and medial marker, a centre, or the whole pelvis is there."""
    true = body(TIME)
    legs = legs_from_markers(markers_of(true, SETS[known], TIME), Choices())
    names = SETS[known]
    for side in ("right", "left"):
        points = legs[side].points
        for role in ("knee", "ankle"):
            off = np.linalg.norm((points[role].path - true[side][f"{role}_centre"])[:, :2], axis=1)
            exact = f"{role}_centre" in names or f"{role}_medial" in names
            assert off.max() < (1e-9 if exact else points[role].error), (role, points[role].how)
        hip = points["hip"].path - true[side]["hip_centre"]
        assert np.abs(hip).max() < 1e-9, points["hip"].how
        assert np.array_equal(points["heel"].path, true[side]["heel"])
        forefoot = "metatarsal_1", "metatarsal_5"
        if all(mark in names for mark in forefoot):
            expected = 0.5 * (true[side][forefoot[0]] + true[side][forefoot[1]])
        else:
            expected = true[side][next(m for m in ("metatarsal_2", "metatarsal_5", "toe_tip") if m in names)]
        assert np.allclose(points["toe"].path, expected)


@pytest.mark.parametrize(
    "pattern",
    ["Subject 3:{}", "sub01_{}", "Walk1.{}", "{}"],
)
@pytest.mark.parametrize("known", ["Plug-in Gait / Helen Hayes", "CAST", "OpenSim walking example"])
def test_prefixes_case_and_punctuation_do_not_matter(known: str, pattern: str) -> None:
    for change in (str, str.lower, str.upper, lambda name: name.replace("_", " ").replace(".", "-")):
        names = {mark: f"{{S}}{n[3:]}" if n.startswith("{S}") else n for mark, n in SETS[known].items()}
        plain = markers_of(body(TIME), names, TIME)
        renamed = {pattern.format(change(name)): path for name, path in plain.positions.items()}
        found = find_roles(Markers(plain.file, TIME, renamed))
        for side in ("right", "left"):
            assert set(found.sides[side]) == set(LANDMARKS_ONLY[known]), renamed


@pytest.mark.parametrize(
    ("name", "landmark"),
    [
        ("right_heel", "heel"),
        ("Right Lateral Malleolus", "ankle_lateral"),
        ("RKNEL", "knee_lateral"),
        ("RKNEM", "knee_medial"),
        ("R_Med_Knee", "knee_medial"),
        ("Knee_Lat_R", "knee_lateral"),
        ("HeelR", "heel"),
        ("R HEEL", "heel"),
        ("r_ankle_study", "ankle_lateral"),
        ("RMT1", "metatarsal_1"),
        ("RMT2", "metatarsal_2"),
        ("R_5th_Met", "metatarsal_5"),
        ("R GTROCH", "trochanter"),
        ("RAJC", "ankle_centre"),
        ("RLFC", "knee_lateral"),
        ("R_FLE", "knee_lateral"),
        ("SACRUM", "sacrum"),
        ("V.Sacral", "sacrum"),
    ],
)
def test_single_names(name: str, landmark: str) -> None:
    markers = Markers(
        markers_of(body(TIME), {"heel": "x"}, TIME).file, TIME, {name: np.zeros((len(TIME), 3))}
    )
    roles = find_roles(markers)
    assert dict(roles.sides["right"]) == {landmark: (name,)}


def test_tibial_tuberosity_and_fibula_are_no_joint() -> None:
    markers = Markers(
        markers_of(body(TIME), {"heel": "x"}, TIME).file,
        TIME,
        {name: np.zeros((len(TIME), 3)) for name in ("R_TTC", "R_FAX", "RKneeAngles", "LAnkleMoment", "L4")},
    )
    roles = find_roles(markers)
    assert not roles.sides["right"] and not roles.sides["left"]


def test_toe_has_the_meaning_of_its_set() -> None:
    """RTOE is the second metatarsal head in Plug-in Gait, and the tip of the toes in Rajagopal's model."""
    hayes = find_roles(markers_of(body(TIME), SETS["Plug-in Gait / Helen Hayes"], TIME))
    assert hayes.sides["right"]["metatarsal_2"] == ("RTOE",)
    assert any(re.match("RTOE.* on the second metatarsal head", remark) for remark in hayes.remarks)
    rajagopal = find_roles(markers_of(body(TIME), SETS["Rajagopal model"], TIME))
    assert rajagopal.sides["right"]["toe_tip"] == ("RTOE",)


def test_computed_markers_of_opencap_go_before_its_video_keypoints() -> None:
    both = SETS["OpenCap"] | {"knee_centre": "{S}Knee", "ankle_centre": "{S}Ankle", "thigh_1": "{S}BigToe"}
    roles = find_roles(markers_of(body(TIME), both, TIME))
    assert roles.sides["left"]["knee_lateral"] == ("l_knee_study",)
    assert "knee_centre" not in roles.sides["left"] and "ankle_centre" not in roles.sides["left"]


def test_a_label_that_occurs_twice_is_told() -> None:
    markers = markers_of(body(TIME), SETS["Plug-in Gait / Helen Hayes"], TIME)
    markers.positions["RHEE.2"] = markers.positions["RHEE"] + [0.03, 0.04, 0.0]
    assert find_roles(markers).warnings == (
        "the label RHEE occurs twice, up to 50 mm apart; the first is taken",
    )


def test_all_that_is_missing_is_told_at_once() -> None:
    names = {
        "asis": "{S}.ASIS",
        "psis": "{S}.PSIS",
        "knee_lateral": "{S}.Kneee.Latt",
        "ankle_lateral": "{S}.Mallleolus",
        "heel": "{S}.Heeel.Back",
        "shank_0": "{S}.SH1",
    }
    with pytest.raises(InputError) as caught:
        legs_from_markers(markers_of(body(TIME), names, TIME), Choices())
    problem = caught.value.problem
    for role, near in (
        ("knee", "R.Kneee.Latt"),
        ("ankle", "R.Mallleolus"),
        ("heel", "R.Heeel.Back"),
        ("toe", ""),
    ):
        assert role in problem and near in problem
    assert "L." not in problem  # the other side's markers are no candidates
    assert "`marker=knee=NAME`" in caught.value.allowed and "`map`" in caught.value.allowed
    assert "\n" not in str(caught.value)


def test_the_other_side_may_be_missing() -> None:
    markers = markers_of(body(TIME), SETS["CAST"], TIME)
    without = {
        name: path for name, path in markers.positions.items() if name not in ("L_FCC", "L_FAL", "L_TAM")
    }
    legs = legs_from_markers(Markers(markers.file, TIME, without), Choices())
    assert list(legs) == ["right"]
    assert "the left leg is left out: no marker of its ankle, heel is known" in legs["right"].remarks


def test_markers_that_a_person_names_go_first() -> None:
    markers = markers_of(body(TIME), SETS["CAST"], TIME)
    chosen = Choices(markers={"ankle": ("R_FAL",), "toe": ("R_FM1", "R_FM2")})
    points = legs_from_markers(markers, chosen)["right"].points
    assert np.array_equal(points["ankle"].path, markers.positions["R_FAL"])
    assert points["toe"].how == "midpoint of R_FM1 and R_FM2, as chosen"
    with pytest.raises(InputError, match="did you mean 'R_FAL'"):
        legs_from_markers(markers, Choices(markers={"ankle": ("R_FALL",)}))


def test_five_named_markers_are_enough() -> None:
    """Names that mean nothing, and no pelvis."""
    names = {"trochanter": "M1", "knee_lateral": "M2", "ankle_lateral": "M3", "heel": "M4", "toe_tip": "M5"}
    markers = markers_of(body(TIME), names, TIME, sides=("left",))
    roles = {role: (f"M{k}",) for k, role in enumerate(("hip", "knee", "ankle", "heel", "toe"), start=1)}
    legs = legs_from_markers(markers, Choices(side="left", markers=roles))
    assert list(legs) == ["left"] and legs["left"].pelvis is None
    assert np.array_equal(legs["left"].points["knee"].path, markers.positions["M2"])
