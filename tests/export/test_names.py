"""Labels that OpenSim and MATLAB take."""

import re

from hypothesis import given
from hypothesis import strategies as st

from afo_sim.export.rows import LONGEST, legal_names


def test_paths_become_words() -> None:
    assert legal_names(["ankle/angle", "muscle/dorsiflexor_1/force"]) == {
        "ankle/angle": "ankle_angle",
        "muscle/dorsiflexor_1/force": "muscle_dorsiflexor_1_force",
    }


@given(st.lists(st.text(max_size=90), unique=True, max_size=40))
def test_names_are_legal_and_different(names: list[str]) -> None:
    legal = legal_names(names)
    assert list(legal) == names
    assert len({name.lower() for name in legal.values()}) == len(names)
    assert all(re.fullmatch(rf"[A-Za-z][A-Za-z0-9_]{{0,{LONGEST - 1}}}", name) for name in legal.values())


def test_names_that_only_their_slashes_tell_apart() -> None:
    assert sorted(legal_names(["a/b_c", "a_b/c", "a/b/c"]).values()) == ["a_b_c", "a_b_c_2", "a_b_c_3"]
