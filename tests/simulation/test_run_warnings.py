"""What a run with a settled stride warns of: each thing once, and nothing is lost for alike words."""

from types import SimpleNamespace
from typing import Any

from afo_sim.common import Notice
from afo_sim.simulation.run import _warnings


def notice(code: str, value: float, subject: str = "front", **data: float) -> Notice:
    return Notice(code, "front: the law x was asked at {value:g}", subject=subject, value=value, **data)


def test_what_was_said_of_the_settled_stride_is_not_said_again_and_all_else_is() -> None:
    settled: Any = SimpleNamespace(found=True, slowest=0.1)
    first: Any = SimpleNamespace(warnings=("of the description",))
    doubts = notice("energy-lost", 0.7, "back", beyond=0.7), notice("metric-undefined", 0.8)
    before: Any = SimpleNamespace(
        limits=(notice("law-pressure", 3.0), notice("law-contraction", 0.4)),
        found=SimpleNamespace(warnings=doubts),
    )
    after: Any = SimpleNamespace(
        limits=(notice("law-pressure", 2.0), notice("law-pressure", 2.0, "back")),
        found=SimpleNamespace(warnings=(notice("other", 1.0), notice("source-empty", 9.0))),
    )
    found = _warnings(first, before, after, settled, (notice("source-empty", 5.0),))
    assert found == (
        "of the description",
        "front: the law x was asked at 5",
        "front: the law x was asked at 2",
        "front: the law x was asked at 2",
        "front: the law x was asked at 1",
        "before it settles: front: the law x was asked at 0.4",
        "before it settles: front: the law x was asked at 0.7",
    )
    last = found[-2]
    assert isinstance(last, Notice) and (last.code, last.subject) == ("law-contraction", "front")
