"""What a mistyped name most likely means, and that a strange one means nothing."""

import re
import time

import pytest

from afo_sim.common import assets, likeness, nearest_name
from afo_sim.description.keys import keys

KEYS = [each.key for each in keys("walk-dropfoot-afo")]
VALID = {
    "kind": list(assets.KINDS),
    "product": [name for kind in assets.KINDS for name in assets.names(kind)],
    "key": KEYS,
    "word": sorted({part for key in KEYS for part in re.findall(r"\w+", key)}),
    "column": [
        *("time", "ankle/angle", "ankle/velocity", "shank/angle", "qpos/ankle", "toe/height", "heel/height"),
        *("gait/phase", "foot/heel_load", "supply/mass", "muscle/dorsiflexor_1/force"),
        *("muscle/dorsiflexor_2/force", "chamber/dorsiflexor/pressure", "chamber/plantarflexor/pressure"),
    ],
    "metric": [
        *("toe_clearance", "foot_slap_velocity", "air_per_stride", "cuff_skin_pressure", "exergy_taken"),
        *(
            "orthosis_peak_dorsiflexion_torque",
            "peak_flow",
            "hours_per_bottle",
            "stance",
            "contacts_with_heel",
        ),
    ],
}
MISTYPED = {
    "kind": {
        "muscel": "muscle", "orthosys": "orthosis", "scenaro": "scenario", "regualtor": "regulator",
        "sensors": "sensor", "vale": "valve", "Muscle": "muscle", "pateint": "patient", "limit": "limits",
    },
    "product": {
        "seatd": "seated", "seeted": "seated", "walk-drop-foot": "walk-dropfoot", "dropfoot": "drop-foot",
        "drop_foot": "drop-foot", "dmsp20": "dmsp_20", "s1-215mm": "s1_215mm", "MH1": "mh1",
        "adult": "adult_75kg", "walk_dropfoot_afo": "walk-dropfoot-afo", 
        "afo-walk-dropfoot": "walk-dropfoot-afo",
    },
    "key": {
        "supply.presure": "supply.pressure", "supply_pressure": "supply.pressure",
        "orthosis.muscle.dorsiflexor.cuont": "orthosis.muscle.dorsiflexor.count",
    },
    "word": {
        "conducktance": "conductance", "dorsiflexer": "dorsiflexor", "knee_angel": "knee_angle",
        "presliding": "presliding_contraction",
    },
    "column": {
        "angle": "ankle/angle", "ankle/angel": "ankle/angle", "ankel/angle": "ankle/angle",
        "ankle_angle": "ankle/angle", "ankle.angle": "ankle/angle", "angle/ankle": "ankle/angle",
        "tiem": "time",
        "muscle/dorsiflexor/force": "muscle/dorsiflexor_1/force", "phase": "gait/phase",
        "dorsiflexor/presure": "chamber/dorsiflexor/pressure",
        "chamber/dorsiflexors/pressure": "chamber/dorsiflexor/pressure",
    },
    "metric": {
        "toe_clearence": "toe_clearance", "clearance": "toe_clearance", "air_per_strid": "air_per_stride",
        "peak_torqe": "orthosis_peak_dorsiflexion_torque", "foot_slap": "foot_slap_velocity",
        "max_toe_clearance": "toe_clearance", "skin_presure": "cuff_skin_pressure",
    },
}  # fmt: skip
UNRELATED = [
    "bar",
    "baz",
    "banana",
    "xyz",
    "hello",
    "world",
    "python",
    "abc",
    "data",
    "main",
    "thing",
    "house",
    "river",
    "guitar",
    "window",
    "yellow",
    "monday",
    "elephant",
    "quantum",
    "keyboard",
    "coffee",
    "blanket",
    "engine",
    "server",
    "cloud",
    "kernel",
    "camera",
    "pencil",
    "foobar",
    "qwerty",
    "lorem",
    "ipsum",
    "zebra",
    "violin",
    "market",
    "cottage",
    "sugar",
    "thunder",
    "carpet",
    "??",
    "mountain",
]


@pytest.mark.parametrize(
    ("of", "name", "meant"), [(of, *pair) for of, pairs in MISTYPED.items() for pair in pairs.items()]
)
def test_a_mistyped_name_finds_the_one_that_is_meant(of: str, name: str, meant: str) -> None:
    assert nearest_name(name, VALID[of]) == meant


@pytest.mark.parametrize("name", UNRELATED)
def test_an_unrelated_word_finds_nothing(name: str) -> None:
    assert {of: found for of, names in VALID.items() if (found := nearest_name(name, names))} == {}


def test_a_word_of_a_longer_name_does_not_carry_what_is_wrong() -> None:
    """Of a path's last part nothing is right: that the others are is not enough."""
    assert nearest_name("muscle/dorsiflexor_1/xyz", VALID["column"]) is None
    assert likeness("orthosis.muscle.dorsiflexor.xyz", "orthosis.muscle.dorsiflexor.count") == 0.0


def test_two_swapped_letters_are_one_mistake() -> None:
    assert likeness("vavle", "valve") == likeness("valvs", "valve") > 0.0


@pytest.mark.parametrize("name", ["x" * 60_000, "orthosis." * 11, "abc" * 33, "muscle/" * 14])
def test_a_long_name_takes_no_long_time(name: str) -> None:
    before = time.process_time()
    nearest_name(name, KEYS)
    assert (
        time.process_time() - before < 2.0
    )  # 0.1 s for 400 keys; compared letter by letter 60,000 take 10 s
