"""Notes of a run say where a muscle's force was never measured."""

import pytest

from afo_sim.description.reader import load
from afo_sim.show.numbers import doubts

GROUP = "orthosis.muscle.dorsiflexor"


@pytest.mark.parametrize(
    ("muscle", "law", "word"),
    [
        ("handmade_10mm", "chou_hannaford_1996", "upper bound"),
        ("dmsp_40", "sarosi_2012", "derived, not measured"),
        ("s1_215mm", "tondu_lopez_2000_bladder", ""),
        ("dmsp_20", "sarosi_2012", ""),
    ],
)
def test_a_force_that_nobody_measured_is_told(muscle: str, law: str, word: str) -> None:
    sets = {f"{GROUP}.type": muscle, f"{GROUP}.type.law": law}
    notes = [n for n in doubts(load("scenario", "seated", sets).resolved(), {}, {}) if "dorsiflexor's" in n]
    assert len(notes) == bool(word)
    assert all(word in note for note in notes)
