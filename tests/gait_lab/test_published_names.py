"""Names of published marker sets are read by their words, and names of other places are not read as ours."""

import pathlib

import numpy as np
import pytest

from afo_sim.gait_lab import Markers
from afo_sim.gait_lab.trial.roles import find_roles

TIME = np.arange(2) / 100.0
# Of each set, right leg: landmark → name, and names that are no landmark of the leg. Sources beside them.
PUBLISHED: dict[str, tuple[dict[str, str], str]] = {
    # rris40: markers.md
    "RRIS40": (
        {"knee_lateral": "RFLE", "knee_medial": "RFME", "ankle_medial": "RTAM", "ankle_lateral": "RFAL",
         "heel": "RFCC", "metatarsal_1": "RFMT1", "metatarsal_5": "RFMT5", "asis": "RASIS", "psis": "RPSIS"},
        "RTEMP RHEAD LHEAD RACR RHLE RHME RRSP RUSP RCAP RHMC2 STER XPRO C7 T10",
    ),
    # freemocap: Qualisys names of a prosthesis study
    "freemocap": (
        {"knee_lateral": "RLFC", "knee_medial": "RMFC", "ankle_lateral": "RLMA", "ankle_medial": "RMMA",
         "heel": "RPHE", "toe_tip": "RTOE", "asis": "RASIS", "psis": "RPSIS", "trochanter": "RGT"},
        "RIC RLTP RMTP RDHE RLHE",
    ),
    "gait cycles": (
        {"knee_lateral": "RLEP", "knee_medial": "RMEP", "ankle_lateral": "RLMA", "ankle_medial": "RMMA",
         "metatarsal_2": "RMP2", "metatarsal_5": "RMP5", "trochanter": "RGT"},
        "RFH CRS RIWG RISC RQUA",
    ),
    # C3D files of several makers, UPM
    "short": ({"knee_lateral": "R.KN", "toe_tip": "R.TO", "ankle_lateral": "RLMA", "asis": "RFWT",
               "psis": "RBWT"},
              "RTOR R_TORSO RSHN RUPA RTHUMB_TIP RLITTLE_METACARPAL RLMC RMMC RPALM R_FOOT"),
    "short, lateral and medial": ({"knee_lateral": "RLKN", "knee_medial": "RMKN"}, "RLSH RMSH"),
    # Motion Analysis Cortex, Helen Hayes with medial markers
    "Cortex": (
        {"asis": "R.ASIS", "sacrum": "V.Sacral", "knee_lateral": "R.Knee", "knee_medial": "R.Knee.Medial",
         "ankle_lateral": "R.Ankle", "ankle_medial": "R.Ankle.Medial", "heel": "R.Heel", "toe_tip": "R.Toe"},
        "Top.Head R.Shoulder R.Elbow R.Wrist R.Thigh R.Shank R.Offset",
    ),
    # BMClab: walk.trc, points that Cortex computes
    "BMClab": (
        {"hip_centre": "V_R.Hip_JC", "knee_centre": "V_R.Knee_JC", "ankle_centre": "V_R.Ankle_JC",
         "trochanter": "R.GTR", "metatarsal_1": "R.MT1", "metatarsal_2": "V_R.MT2"},
        "R.HF R.TT V_R.TT V_Mid_ASIS V_Pelvis_Origin V_Mid_Hip R.Iliac.Crest V_R.Knee_JC_Static",
    ),
    # biomech-zoo: Stief 2013
    "biomech-zoo": ({"knee_lateral": "RKNE", "knee_medial": "RKNM", "ankle_lateral": "RANK",
                     "ankle_medial": "RMMA", "heel": "RHEE"}, "RTHI RTIB"),
    "pyCGM2": (
        {"hip_centre": "RHJC", "knee_centre": "RKJC", "ankle_centre": "RAJC", "knee_lateral": "RKNE",
         "ankle_lateral": "RANK", "heel": "RHEE", "metatarsal_2": "RTOE", "metatarsal_1": "RFMH",
         "metatarsal_5": "RVMH", "asis": "RASI", "psis": "RPSI"},
        "RTHAP RTHAD RTIAP RTIAD RTHI RTIB RKneeAngles RTIP",
    ),
    # Camargo 2021
    "Camargo": (
        {"asis": "R_ASIS", "psis": "R_PSIS", "knee_lateral": "R_Knee_Lat", "ankle_lateral": "R_Ankle_Lat",
         "heel": "R_Heel", "metatarsal_1": "R_Toe_Med", "metatarsal_5": "R_Toe_Lat", "toe_tip": "R_Toe_Tip"},
        "R_Thigh_Upper R_Thigh_Front R_Shank_Rear R_Midfoot_Sup R_Midfoot_Lat",
    ),
    # Schreiber 2019 and OptiTrack Biomech: van Sint Jan's abbreviations
    "van Sint Jan": (
        {"asis": "R_IAS", "psis": "R_IPS", "trochanter": "R_FTC", "knee_lateral": "R_FLE",
         "knee_medial": "R_FME", "ankle_lateral": "R_FAL", "ankle_medial": "R_TAM", "heel": "R_FCC",
         "metatarsal_1": "R_FM1", "metatarsal_2": "R_FM2", "metatarsal_5": "R_FM5"},
        "R_FAX R_TTC R_DP1 R_CAJ R_HLE R_HME R_RSP R_USP",
    ),
    # Motek Caren's Human Body Model 2
    "HBM2": (
        {"asis": "RASIS", "psis": "RPSIS", "knee_lateral": "RLEK", "knee_medial": "RMEK",
         "ankle_lateral": "RLM", "ankle_medial": "RMM", "heel": "RHEE", "metatarsal_2": "RMT2",
         "metatarsal_5": "RMT5"},
        "RLTHI RLSHA RLEE RMEE RSHO NAVE XYPH",
    ),
    "Qualisys Sports": (
        {"asis": "WaistRFront", "psis": "WaistRBack", "knee_lateral": "RKneeOut", "knee_medial": "RKneeIn",
         "ankle_lateral": "RAnkleOut", "heel": "RHeelBack", "metatarsal_2": "RForefoot2",
         "metatarsal_5": "RForefoot5"},
        "RThighFrontLow RShinFrontHigh RElbowOut RWristIn HeadR",
    ),
    "Xsens MVN": (
        {"asis": "pRightASI", "trochanter": "pRightGreaterTrochanter", "heel": "pRightHeelFoot",
         "knee_lateral": "pRightKneeLatEpicondyle", "knee_medial": "pRightKneeMedEpicondyle",
         "ankle_lateral": "pRightLatMalleolus", "ankle_medial": "pRightMedMalleolus",
         "metatarsal_1": "pRightFirstMetatarsal", "metatarsal_5": "pRightFifthMetatarsal",
         "toe_tip": "pRightToe"},
        "pRightCSI pRightKneePatella pRightPivotFoot pRightTopOfFoot pRightElbowLatEpicondyle pRightBallHand",
    ),
    "any order": (
        {"knee_lateral": "R_KNE_LAT", "knee_medial": "MED_R_KNEE", "ankle_lateral": "R_LatMal",
         "heel": "HEEL_R", "metatarsal_1": "RTOE1", "metatarsal_5": "RTOE5",
         "toe_tip": "TO_R", "ankle_medial": "Malleolus med. right"},
        "MAL_TIB KNE_R_TUB",
    ),
    "German": (
        {"asis": "SIAS re", "knee_lateral": "Knie außen re", "knee_medial": "Knie innen re",
         "ankle_lateral": "Knöchel_außen_re", "heel": "Ferse_re", "toe_tip": "Zehe_re"},
        "Schulter_re Hand_re",
    ),
    "Dutch": ({"knee_lateral": "knie_buiten_re", "ankle_medial": "enkel_binnen_re", "heel": "hiel_re",
               "toe_tip": "teen_re"}, "schouder_re"),
    "French": ({"asis": "EIAS_D", "psis": "EIPSD", "knee_medial": "Genou_int_D",
                "ankle_lateral": "Malléole_ext_D",
                "heel": "Talon_D", "metatarsal_5": "MT5_D"}, "Epaule_D Coude_D"),
    "Italian": ({"asis": "SIAS_dx", "knee_lateral": "ginocchio_lat_dx",
                 "ankle_medial": "malleolo_interno_dx", "heel": "tallone_dx"}, "spalla_dx"),
    "Spanish": ({"knee_lateral": "rodilla_der", "ankle_lateral": "maleolo_externo_der", "heel": "talon_der"},
                "hombro_der"),
}  # fmt: skip
TWINS = {"re": "li", "_D": "_G", "PSD": "PSG", "dx": "sx", "der": "izq"}


def left_of(name: str) -> str:
    """The left side's name of a right one."""
    for right, left in TWINS.items():
        if name.endswith(right):
            return name.removesuffix(right) + left
    for right, left in (("Right", "Left"), ("right", "left"), ("V_R.", "V_L."), ("_R_", "_L_")):
        if right in name:
            return name.replace(right, left)
    if name.startswith("Waist"):
        return name.replace("WaistR", "WaistL")
    return f"{name[:-1]}L" if name.endswith("_R") else f"L{name[1:]}"


def roles_of(names: list[str]) -> dict[str, dict[str, tuple[str, ...]]]:
    found = find_roles(Markers(pathlib.Path("x.c3d"), TIME, {n: np.zeros((2, 3)) for n in names}))
    return {side: dict(found.sides[side]) for side in ("right", "left")}


@pytest.mark.parametrize("known", PUBLISHED)
def test_a_published_set_is_read_and_nothing_else_of_it(known: str) -> None:
    names, others = PUBLISHED[known]
    pairs = {mark: (name, name if mark == "sacrum" else left_of(name)) for mark, name in names.items()}
    found = roles_of([*(name for pair in pairs.values() for name in pair), *others.split(" ")])
    assert found["right"] == {mark: (right,) for mark, (right, _) in pairs.items()}
    assert found["left"] == {mark: (left,) for mark, (_, left) in pairs.items()}


def test_a_word_that_may_be_a_side_counts_by_its_twin_only() -> None:
    """D is right in French where there is a G, and else distal; KNEL is lateral but beside KNER."""
    assert roles_of(["MT5_D", "MT5_P"]) == {"right": {}, "left": {}}
    assert roles_of(["KNEL", "KNER"]) == {
        "right": {"knee_lateral": ("KNER",)},
        "left": {"knee_lateral": ("KNEL",)},
    }
    assert roles_of(["RKNEL", "RKNEM"])["right"] == {"knee_lateral": ("RKNEL",), "knee_medial": ("RKNEM",)}
