"""Patients who are drawn over what is not known, the corners beside them, and what decides."""

from typing import Any

import numpy as np
import pytest

from afo_sim.common import InputError
from afo_sim.walker import Falls, build_body, draw_falls, prepared, read_gait, unknown, walk
from afo_sim.walker.body import BARE

STEP = {"timestep": "1 ms"}
GAIT = read_gait("natural")
GAITS = {"patient": GAIT, "device": GAIT}


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, dict[str, float]]]:
    """What bodies are asked for; who has less of the soleus falls more, and nothing else matters."""
    asked: list[tuple[Any, dict[str, float]]] = []

    def build(*of: Any) -> Any:
        asked.append(of)
        return of

    def fall(body: Any, gait: Any, *, starts: int, **_: Any) -> Falls:
        return Falls(round(starts * 5.0 * (1.0 - body[1].get("soleus", 1.0))), starts)

    monkeypatch.setattr(unknown, "build_body", build)
    monkeypatch.setattr(unknown, "falls_of", fall)
    return asked


@pytest.mark.slow
def test_drawn_patients_are_those_of_the_seed_whatever_the_threads() -> None:
    scenario = prepared("walk-dropfoot-afo", STEP)
    one, other = (draw_falls(scenario, GAITS, draws=2, starts=1, threads=threads) for threads in (1, 2))
    assert one.falls == other.falls and one.at_corners == other.at_corners and set(one.falls) == set(GAITS)


def test_all_cases_have_the_same_patients(built: list[Any]) -> None:
    scenario = prepared("walk-dropfoot-afo", STEP)
    both = draw_falls(scenario, GAITS, draws=5, starts=1)
    for (bare, shares), (worn, same) in zip(built[::2], built[1::2], strict=True):
        assert shares == same and bare.orthosis.name == "none" and worn.orthosis.name == "s1"
        assert all(
            getattr(bare.patient, key) == getattr(worn.patient, key)
            for key in ("body_mass", "body_height", "passive_scale")
        )
    again = draw_falls(scenario, GAITS, draws=5, starts=3)
    assert all((both.draws[name] == again.draws[name]).all() for name in both.draws)
    other = draw_falls(scenario, GAITS, draws=5, starts=1, seed=1)
    assert all((both.draws[name] != other.draws[name]).all() for name in both.draws)


@pytest.mark.slow
def test_draws_keep_their_ranges(built: list[Any]) -> None:
    many = draw_falls(
        prepared("walk-dropfoot-afo", STEP), GAITS, draws=400, starts=1, strength={"tibialis": 0.3}
    ).draws
    assert many["tissue"].mean() == pytest.approx(1.0, abs=0.1)  # the mean stays that of the patient
    assert many["tissue"].std() == pytest.approx(0.57, abs=0.1)
    ranges = {
        "tibialis": (0.2, 0.4),
        "plantarflexors": (0.8, 1.0),
        "mass": (0.9, 1.1),
        "height": (0.95, 1.05),
        "cuff": (2e3, 8e3),
    }
    assert set(many) == {"tissue", *ranges}
    for name, (low, high) in ranges.items():
        assert low <= many[name].min() < many[name].max() <= high
        assert np.ptp(many[name]) > 0.95 * (high - low)
    assert (
        "cuff" not in draw_falls(prepared("walk-dropfoot", STEP), {"patient": GAIT}, draws=1, starts=1).draws
    )


@pytest.mark.parametrize(
    ("left", "corners"),
    [
        ({}, [(0.0, 1.0), (0.1, 1.0), (0.0, 0.8)]),  # as stated first: tibialis, plantarflexors
        ({"tibialis": 0.3}, [(0.3, 1.0), (0.0, 1.0), (0.2, 1.0), (0.4, 1.0), (0.3, 0.8)]),
        ({"tibialis": 0.95}, [(0.95, 1.0), (0.0, 1.0), (0.85, 1.0), (1.0, 1.0), (0.95, 0.8)]),
        ({"tibialis": 1.0}, [(1.0, 1.0), (0.9, 1.0), (1.0, 0.8)]),
        ({"tibialis": 0.0, "gastrocnemius": 0.5}, [(0.0, 1.0), (0.1, 1.0), (0.0, 0.8)]),
    ],
)  # fmt: skip
def test_corners_are_walked_exactly_and_stand_beside_the_band(
    built: list[Any], left: dict[str, float], corners: list[tuple[float, float]]
) -> None:
    scenario = prepared("walk-dropfoot-afo", STEP)
    band = draw_falls(scenario, {"patient": GAIT}, draws=3, starts=10, strength=left)
    names = ("tibialis", "soleus", "gastrocnemius")  # who is not named is whole
    walked = [tuple(shares.get(name, 1.0) for name in names) for _, shares in built]
    calf = left.get("gastrocnemius", 1.0)
    for found, (tibialis, plantarflexors) in zip(walked, corners, strict=False):
        asked = (tibialis, plantarflexors, calf * plantarflexors)
        assert found == pytest.approx(asked, abs=1e-12)
        assert all(a == b for a, b in zip(found, asked, strict=True) if b in (0.0, 1.0))  # exactly
    assert walked[0][0] == left.get("tibialis", 0.0)
    assert len(band.corners) == len(band.at_corners["patient"]) == len(corners)
    assert len(built) == len(corners) + 3 and len(band.falls["patient"]) == 3  # the band has none of them
    stated = built[0][0].patient
    assert stated.passive_scale == scenario.patient.passive_scale  # all else is as stated
    assert [f.count for f in band.at_corners["patient"]] == [round(50 * (1.0 - b)) for _, b in corners]


@pytest.mark.slow
def test_what_decides_is_found_and_chance_is_not(built: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = prepared("walk-dropfoot-afo", STEP)
    band = draw_falls(scenario, GAITS, draws=40, starts=1000)
    for case in GAITS:
        assert list(band.deciding(case)) == ["plantarflexors"]  # as `built` has it
        assert band.deciding(case)["plantarflexors"] == pytest.approx(-1.0)
    low, high = band.halves("patient", "plantarflexors")
    drawn = np.sort(5.0 * (1.0 - band.draws["plantarflexors"]))
    assert (low, high) == pytest.approx((drawn[20:].mean(), drawn[:20].mean()), abs=1e-3)
    header, rows = band.table()
    assert len(header) == 3 and all(len(row) == 3 for row in rows)
    assert [row[1] for row in rows if row[0].startswith("cuff")] == ["–"]  # nobody wears one
    draw = np.random.default_rng(0)
    monkeypatch.setattr(
        unknown, "falls_of", lambda *_, starts, **__: Falls(int(draw.integers(starts + 1)), starts)
    )
    blind = [draw_falls(scenario, {"patient": GAIT}, draws=20, starts=30, seed=k) for k in range(60)]
    told = sum(bool(each.deciding("patient")) for each in blind)
    assert told <= 9  # 5 % of 60 are 3; more than 9 come by chance once in 2,000 times
    monkeypatch.setattr(unknown, "falls_of", lambda *_, starts, **__: Falls(starts, starts))
    assert draw_falls(scenario, GAITS, draws=20, starts=30).deciding("patient") == {}  # all fall


def test_a_bare_walk_is_the_same_at_any_mass_and_one_with_a_device_is_not() -> None:
    """Dynamic similarity: all forces and masses of a bare walker grow alike, but air does not."""
    scenario = prepared("walk-dropfoot-afo", STEP)
    ankles = {}
    for name, wearing in (("bare", scenario.set(BARE)), ("worn", scenario)):
        for mass in (60.0, 75.0, 90.0):
            body = build_body(wearing.set({"patient.body_mass": f"{mass} kg"}), {"tibialis": 0.7})
            walked = walk(body, GAIT.vector, 3.0)
            assert walked.fell is None
            ankles[name, mass] = np.degrees(walked["right/ankle"])
    for mass in (60.0, 90.0):
        assert abs(ankles["bare", mass] - ankles["bare", 75.0]).max() < 1e-6
        assert abs(ankles["worn", mass] - ankles["worn", 75.0]).max() > 1.0


@pytest.mark.parametrize("draws", [0, 1001])
def test_a_number_of_draws_is_within_what_is_taken(draws: int) -> None:
    with pytest.raises(InputError, match="draws"):
        draw_falls(prepared("walk-dropfoot-afo", STEP), GAITS, draws=draws, starts=1)
