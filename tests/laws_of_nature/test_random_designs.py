"""Random legal designs: each number is that of an eighth of the step, or the run names it."""

import json
import pathlib
from types import ModuleType

import documents
import pytest
from campaign import size


@pytest.fixture(scope="module")
def script() -> ModuleType:
    return documents.script("step_campaign")


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_random_legal_designs_run_right_or_name_what_is_not(script: ModuleType) -> None:
    """At the default step, against an eighth of it."""
    seeds = range(size(10, 60))
    steps = {seed: script.design(seed)[1]["timestep"] for seed in seeds}
    found = [script.examined(seed) for seed in seeds if steps[seed] in ("1.0 ms", "2.0 ms")]
    assert len([each for each in found if each.outcome in ("within", "warned")]) >= len(found) // 2
    assert not [each for each in found if each.outcome == "silent"]
    assert all(0.12 * each.step < each.taken <= 1.01 * each.step for each in found if each.taken)


def test_a_campaign_goes_on_where_it_was_stopped(
    script: ModuleType, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, asked = tmp_path / "found.jsonl", []
    bad = script.Outcome(0, "seated", 2.0, True, "silent", 2.0, {"rise_time": None}, {"rise_time": None})
    out.write_text(json.dumps(vars(bad)) + "\n")
    monkeypatch.setattr(script, "ProcessPoolExecutor", _Here)
    monkeypatch.setattr(
        script, "examined", lambda k: asked.append(k) or script.Outcome(k, "s", 1.0, False, "within")
    )
    found = script.campaign(out, range(3), 1)
    assert asked == [1, 2] and len(out.read_text().splitlines()) == 3
    assert script.campaign(out, range(3), 1) == found and asked == [1, 2]
    lines = list(script.report(found))
    assert "default step: 1 designs: 1 silent" in lines and "other steps: 2 designs: 2 within" in lines
    assert any("seed 0" in line and "rise_time" in line for line in lines)


class _Here:
    """A pool of no other process."""

    def __init__(self, processes: int) -> None: ...

    def __enter__(self) -> "_Here":
        return self

    def __exit__(self, *_: object) -> None: ...

    map = staticmethod(map)
