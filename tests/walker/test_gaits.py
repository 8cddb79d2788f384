"""The shipped gaits against measured adults: what they miss is what docs/validation.md says they miss."""

import itertools
import math
import pathlib

import numpy as np
import pytest

from afo_sim.walker import build_body, falls_of, norm_at, numbers, prepared, read_gait, sole_tilt, walk_body
from afo_sim.walker.body import BARE
from afo_sim.walker.likeness import TABLE, in_numbers
from afo_sim.walker.measured import GAITS, _walk, held
from afo_sim.walker.strides import EMG, emg

PAGE = pathlib.Path(__file__).parents[2] / "docs" / "validation.md"
EACH = np.arange(101.0)


def on_the_page(name: str) -> dict[str, str]:
    """A gait's cells of the page's table, by the row's name without its unit; bold: missed."""
    lines = [line.strip("| \n").split(" | ") for line in PAGE.read_text().splitlines()]
    head = next(k for k, cells in enumerate(lines) if cells[-len(GAITS) :] == list(GAITS))
    place = lines[head].index(name) + 1
    found: dict[str, str] = {}
    for cells in lines[head + 2 :]:
        if len(cells) < place:
            return found
        found[cells[0].partition(" [")[0]] = cells[place].replace("−", "-")
    return found


@pytest.mark.parametrize("name", GAITS)
def test_a_shipped_gait_misses_what_the_page_marks_and_no_more(name: str) -> None:
    rows = {row.quantity.removeprefix(f"{name}: "): row for row in held(name, _walk(read_gait(name)))}
    cells = on_the_page(name)
    assert rows.keys() == cells.keys() == {row.quantity for row in TABLE}
    assert {what for what, row in rows.items() if row.verdict == "disagrees"} == {
        what for what, cell in cells.items() if cell.startswith("**")
    }
    for what, cell in cells.items():
        rounded = 0.5 * 10.0 ** -len(cell.strip("*").partition(".")[2])
        assert float(cell.strip("*")) == pytest.approx(rows[what].simulated, rel=0.02, abs=1.1 * rounded)


@pytest.mark.parametrize("name", GAITS)
def test_cost_of_transport_is_what_another_fit_of_measurements_has(name: str) -> None:
    """Ralston 1958, 29 + 0.0053 v² cal/(kg·min) with v in m/min, within a tenth."""
    walked = _walk(read_gait(name))
    row = next(row for row in held(name, walked) if row.quantity == f"{name}: cost of transport")
    speed = float(np.ptp(walked["trunk/forward"]) / np.ptp(walked["time"]))
    ralston = (29.0 + 0.0053 * (60.0 * speed) ** 2) * 4.184 / 60.0 / speed
    assert row.measured == pytest.approx(ralston, rel=0.1)


def people() -> dict[str, np.ndarray]:
    norm = dict(norm_at(1.22)) | emg()
    return norm | {"barefoot": norm["ankle"], "clearance": np.array(13.0), "cost": np.array(3.4)}


def test_the_norm_in_numbers_is_the_published_table() -> None:
    """Bovi et al. 2011 at 1.22 m/s: least −3.6 in loading, most 15.3, least −17.0°; forces 1.05 and 1.14."""
    found = in_numbers(people(), people())
    assert found["ankle, least in loading"] == pytest.approx(-3.6, abs=0.3)
    assert found["ankle, greatest in stance"] == pytest.approx(15.3, abs=0.3)
    assert found["ankle, fall in push-off"] == pytest.approx(32.3, abs=0.5)
    assert found["vertical force, first peak"] == pytest.approx(1.05, abs=0.02)
    assert found["vertical force, second peak"] == pytest.approx(1.14, abs=0.02)
    assert found["cadence"] == pytest.approx(109.7, abs=1.0)
    assert max(value for name, value in found.items() if "RMS" in name) == 0.0


def test_activity_is_the_published_one() -> None:
    """Perry & Burnfield 2010: soleus 86 % at 43 % of the stride, gastrocnemius 78 % at 40 %; 3 % later."""
    found = in_numbers(people(), people())
    assert found["soleus, greatest in push-off"] == pytest.approx(0.86, abs=0.03)
    assert found["gastrocnemius, greatest in push-off"] == pytest.approx(0.78, abs=0.03)
    assert found["soleus, when greatest"] == pytest.approx(46.0, abs=3.0)
    assert found["gastrocnemius, when greatest"] == pytest.approx(43.0, abs=3.0)
    assert found["tibialis, mean"] == pytest.approx(0.15, abs=0.01)
    first = {name: row[0] / 100.0 for name, row in EMG.items()}
    assert {name: float(curve[3]) for name, curve in emg().items()} == pytest.approx(first)


def test_a_walk_that_is_off_by_known_amounts() -> None:
    """3° everywhere, 8° more in swing; activity half as high, or where others are silent."""
    norm = people()
    swing = EACH >= 65
    off = norm | {
        "thigh": norm["thigh"] - math.radians(3.0),
        "ankle": norm["ankle"] + np.radians(3.0 + 8.0 * swing),
        "barefoot": norm["barefoot"],
        "tibialis": 1.0 - norm["tibialis"],
        "soleus": 0.5 * norm["soleus"],
        "gastrocnemius": np.interp(EACH - 10.0, EACH, norm["gastrocnemius"], period=100.0),
    }
    found, shod = in_numbers(off, norm), norm | {"ankle": norm["ankle"] - math.radians(3.0)}
    assert found["thigh, RMS off the norm"] == pytest.approx(3.0)
    assert found["knee, RMS off the norm"] == 0.0
    assert found["ankle in swing, RMS off the norm"] == pytest.approx(11.0)
    whole = math.sqrt((65.0 * 9.0 + 36.0 * 121.0) / 101.0)
    assert found["ankle, RMS off the norm"] == pytest.approx(whole)
    held_still = norm | {"ankle": np.full(101, norm["ankle"].mean())}
    assert in_numbers(held_still, norm)["ankle, over that of a joint held at its mean"] == pytest.approx(1.0)
    assert found["tibialis, correlation with EMG"] == pytest.approx(-1.0)
    assert found["soleus, correlation with EMG"] == pytest.approx(1.0)
    assert found["soleus, greatest in push-off"] == pytest.approx(0.42)
    later = in_numbers(norm, norm)["gastrocnemius, when greatest"] + 10.0
    assert found["gastrocnemius, when greatest"] == later
    against = in_numbers(off, shod)
    assert against["ankle in swing, RMS off the norm"] == pytest.approx(14.0)
    assert against["ankle beside bare feet in swing, RMS off the norm"] == pytest.approx(11.0)


def test_a_flat_sole_points_the_foot_down_by_its_drop() -> None:
    """A drop of 10 mm from heel to ball, 5 mm behind the bare heel, on a foot of the wearer's size."""
    trainer = build_body(prepared("walk-dropfoot-afo", {"patient": "healthy"} | BARE))
    bare = build_body(prepared("walk-dropfoot-afo", {"patient": "healthy", "shoe": None} | BARE))
    size, places = trainer.size.taller, [bare.model.site(f"sole_{name}").pos[0] for name in ("heel", "ball")]
    drop = math.atan2(0.010 * size, places[1] - places[0] + 0.005 * size)
    assert sole_tilt(trainer) - sole_tilt(bare) == pytest.approx(drop, rel=1e-3)
    assert abs(sole_tilt(bare)) < math.radians(0.2)


def test_an_unadapted_weak_foot_answers_by_degrees() -> None:
    """Strength of the tibialis left, then S1's pressure at a fifth of it: no more falls, no lower ankle."""
    bare, worn = prepared("walk-dropfoot-afo", {"patient": "healthy"} | BARE), prepared("walk-dropfoot-afo")
    gait = read_gait("natural")
    doses = [(bare, share) for share in (0.2, 0.4, 0.7, 1.0)]
    doses += [(worn.set({"supply.pressure": f"{bar} bar"}), 0.2) for bar in (1, 4)]
    falls, ankles = [], []
    for scenario, share in doses:
        body = build_body(scenario, {"tibialis": share})
        falls.append(falls_of(body, gait.vector, starts=16))
        ankles.append(numbers(walk_body(body, gait.vector, 12.0))["right/ankle_swing"])
    assert (np.diff(ankles[:4]) > 1.0).all() and ankles[5] - ankles[4] > 4.0
    for weaker, stronger in itertools.pairwise(falls[:4]):
        assert stronger.interval[0] <= weaker.interval[1]
    assert max(each.count for each in (*falls[1:4], falls[5])) <= 2  # no cliff above 0.2; S1 at 4 bar
