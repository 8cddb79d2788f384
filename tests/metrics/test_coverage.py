"""How much bands were worth so far: counts of the ledger's file, in words for each kind of number."""

import re
import tomllib

import pytest

from afo_sim.common import assets
from afo_sim.metrics import Coverage, coverage, coverages, worth
from afo_sim.metrics.covered import KINDS

FILE = assets.folder("models") / "coverage.toml"
COUNTS = tomllib.loads(FILE.read_text(encoding="utf-8"))


def numbers(text: str) -> list[int]:
    return [int(found) for found in re.findall(r"\d+", text)]


def test_a_kind_of_which_nobody_measured_a_value_has_no_count() -> None:
    assert Coverage("air", 0, 0, 0, 0).text == "air (none measured)"
    assert numbers(Coverage("muscle force", 18, 6, 4, 0).text) == [6, 18]


@pytest.mark.parametrize(("values", "benches", "alone"), [(3, 1, True), (3, 2, False), (1, 1, False)])
def test_values_of_one_test_alone_are_told_apart(values: int, benches: int, alone: bool) -> None:
    assert ("one test" in Coverage("joint torque", values, 1, benches, 0).text) is alone


def test_each_kind_of_a_metric_is_one_of_the_file_and_no_more_lie_in_a_band_than_were_measured() -> None:
    assert set(KINDS.values()) <= set(COUNTS) == set(coverages())
    for found in map(coverage, KINDS):
        assert found is not None and max(found.inside, found.worn, found.benches) <= found.values


def test_a_metric_without_a_kind_says_nothing() -> None:
    assert coverage("cuff_skin_pressure") is None and worth(["cuff_skin_pressure", "stride_time"]) == ""


@pytest.mark.parametrize("metrics", [["toe_clearance"], ["toe_clearance", "air_per_stride"], [*KINDS]])
def test_the_sentence_has_the_counts_of_every_kind_once(metrics: list[str]) -> None:
    kinds = dict.fromkeys(KINDS[name] for name in metrics)
    told = worth(metrics)
    counted = [
        f"{kind} {COUNTS[kind]['inside']} of {COUNTS[kind]['values']}"
        for kind in kinds
        if COUNTS[kind]["values"]
    ]
    assert numbers(told) == [90, 9, 10, *(n for each in counted for n in numbers(each))]
    assert all(each in told for each in counted)
    worn = [kind for kind in kinds if COUNTS[kind]["worn"]]
    assert ("; none on a worn" in told) is (not worn) and told.endswith("on a worn orthosis.")
    assert all(kind in told.partition(";")[2] for kind in worn)
