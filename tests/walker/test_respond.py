"""A responding walk as it is asked for: its cases by hand, its time steps, its starts, its files."""

import json
import pathlib
import sys
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from afo_sim.common import InputError
from afo_sim.walker import (
    Body,
    Falls,
    build_body,
    falls_of,
    numbers,
    prepared,
    read_gait,
    save,
    strengths_of,
    walk,
    walk_body,
)
from afo_sim.walker.body import BARE
from afo_sim.walker.respond import FROM, HORIZON, NOISE, UNTIL, stronger

SCENARIO, STEP = "walk-dropfoot-afo", {"timestep": "2 ms"}
MODULE = sys.modules["afo_sim.walker.respond"]


def test_each_case_walks_as_by_hand_and_is_written_as_it_walked(tmp_path: pathlib.Path) -> None:
    """Healthy, bare and worn, by the healthy gait and by those that are given; starts by one seed."""
    gaits = {"": "natural", "patient adapted": "drop-foot", "device adapted": "drop-foot-s1"}
    given = {"adapted": gaits["patient adapted"], "adapted_device": gaits["device adapted"]}
    found = walk(SCENARIO, STEP, duration=4.5, starts=2, seed=3, **given)  # type: ignore[arg-type]
    worn = prepared(SCENARIO, STEP)
    bodies = {
        "healthy": build_body(worn.set(BARE | {"patient": "healthy"})),
        "patient": build_body(worn.set(BARE), strengths_of(worn)),
        "device": build_body(worn, strengths_of(worn)),
    }
    assert list(found.cases) == ["healthy", "patient", "patient adapted", "device", "device adapted"]
    save(found, tmp_path / "out")
    written = json.loads((tmp_path / "out" / "walk.json").read_text(encoding="utf-8"))["cases"]
    for name, case in found.cases.items():
        body, vector = bodies[name.partition(" ")[0]], read_gait(gaits.get(name, gaits[""])).vector
        walked, falls = walk_body(body, vector, 4.5), falls_of(body, vector, starts=2, seed=3)
        assert case.numbers == pytest.approx(numbers(walked), rel=1e-12, nan_ok=True), name
        assert case.falls == falls and written[name]["falls"]["count"] == falls.count
        assert written[name]["fell"] == walked.fell and written[name]["gait"] == case.gait.name
        kept = pq.read_table(tmp_path / "out" / f"{name.replace(' ', '_')}.parquet")
        assert set(kept.column_names) == set(walked.columns)
        assert all((kept[key].to_numpy() == values).all() for key, values in walked.columns.items())
    assert found["patient"].falls == Falls(2, 2) and found["device adapted"].walked.fell is None


def test_starts_are_disturbed_either_way_at_drawn_moments(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 200: half are pushed back, evenly over two seconds, by poses with the stated spread."""
    body, seen = build_body(prepared("walk-healthy", STEP)), list[tuple[float, float, Any]]()

    def walked(_: Body, vector: Any, lasts: float, pushes: Any, noise: Any, rows: bool) -> Any:
        assert lasts == HORIZON and not rows and len(pushes) == 1
        seen.append((pushes[0].time, pushes[0].force, noise))
        return walk_body(body, vector, 0.01, pushes, noise, rows)

    monkeypatch.setattr(MODULE, "walk_body", walked)
    assert falls_of(body, read_gait("natural").vector, starts=200, push=30.0, seed=5) == Falls(0, 200)
    time, force, noise = (np.array(each) for each in zip(*seen, strict=True))
    assert set(force) == {-30.0, 30.0} and abs(force.sum()) < 30.0 * 4.0 * np.sqrt(200.0)
    assert FROM <= time.min() < FROM + 0.1 and UNTIL - 0.1 < time.max() <= UNTIL
    assert noise.std() == pytest.approx(NOISE, rel=0.1) and abs(noise.mean()) < 0.1 * NOISE


def test_a_gait_is_searched_through_the_stronger_and_nobody_is_weakened() -> None:
    left = {"tibialis": 0.0, "soleus": 0.7, "left_soleus": 1.0, "glutei": 1.4}
    stages = stronger(left)
    for one, weaker in zip(stages, [*stages[1:], left], strict=True):
        assert all(one[name] >= weaker[name] for name in left) and one["tibialis"] > weaker["tibialis"]
        assert (one["left_soleus"], one["glutei"]) == (1.0, 1.4) and one["soleus"] <= 1.0


@pytest.mark.parametrize(
    ("step", "taken"),
    [
        ("0.5 ms", True),
        ("1.25 ms", True),
        ("2 ms", True),
        ("1.9 ms", False),
        ("1.8 ms", False),
        ("2.5 ms", False),
    ],
)
def test_a_whole_number_of_steps_makes_a_tick_of_10_ms(step: str, taken: bool) -> None:
    if taken:
        assert prepared("walk-healthy", {"timestep": step}).timestep == pytest.approx(1e-3 * float(step[:-3]))
        return
    with pytest.raises(InputError) as error:
        prepared("walk-healthy", {"timestep": step})
    assert error.value.field == "timestep"
