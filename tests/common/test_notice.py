"""Notices are recognised by what they are about, and read like text."""

import copy
import json
import pickle

import pytest

from afo_sim.common import Notice, unique, with_code

TEXT = "{subject} is empty after {time:.1f} s"


def empty(source: str, time: float) -> Notice:
    return Notice("source-empty", TEXT, subject=source, severity="error", time=time)


def test_a_notice_reads_as_its_sentence() -> None:
    notice = empty("supply", 2.84)
    assert notice == "supply is empty after 2.8 s"
    assert json.loads(json.dumps([notice])) == ["supply is empty after 2.8 s"]
    assert notice.as_json()["data"] == {"time": 2.84}


def test_a_notice_survives_copies_and_processes() -> None:
    notice = empty("supply", 2.84)
    for other in (pickle.loads(pickle.dumps(notice)), copy.deepcopy(notice)):
        assert (other, other.as_json()) == (notice, notice.as_json())


def test_one_notice_a_subject_whatever_its_words() -> None:
    first, again, other = empty("a", 1.0), empty("a", 2.0), empty("b", 1.0)
    assert unique([first, "plain", again, other, "plain"]) == [first, "plain", other]
    assert with_code(["plain", first, other], "source-empty") == [first, other]
    assert with_code([first], "another") == []


def test_braces_in_data_stay_as_they_are() -> None:
    assert Notice("odd-name", "{subject} is odd", subject="{muscle}") == "{muscle} is odd"


def test_data_that_a_sentence_lacks_is_a_fault_of_the_code() -> None:
    with pytest.raises(KeyError):
        Notice("source-empty", TEXT, subject="supply")


def test_a_worse_one_is_said_beside_a_milder_one_of_the_same_thing() -> None:
    """The start-up of a walk may pass a limit further than the settled stride does."""

    def passed(muscle: str, value: float) -> Notice:
        text = "{subject} reaches {value:.3g}"
        return Notice("muscle-contraction", text, subject=muscle, value=value, beyond=value - 0.25)

    settled = passed("dorsiflexor_1", 0.29)
    assert passed("dorsiflexor_1", 0.29).repeats(settled)
    assert passed("dorsiflexor_1", 0.27).repeats(settled)
    assert not passed("dorsiflexor_1", 0.31).repeats(settled)
    assert not passed("dorsiflexor_2", 0.27).repeats(settled)
