"""Geometric similarity: who is by a factor l taller moves alike at equal Froude number.

Hof 1996, Gait Posture 4(3), doi 10.1016/0966-6362(95)01057-2. Without air any mass will do, since every force
goes with it. Air has a pressure of its own: there the forces go with l², and so must the masses.
"""

import pathlib
from typing import Any

import pytest
from laws_of_nature.similar import Similar

from afo_sim.description import load
from afo_sim.model import muscle_weakness
from afo_sim.simulation import Recording
from afo_sim.simulation.run import run

MASS, HEIGHT = 75.0, 1.75  # of the leg's own body [kg], [m]
EXACT = 1e-3  # of a column's range
# as the person grows by itself: with the mass and height that are told
OF_THE_PERSON = ("leg", "gait", "ground", "shoe")


def walked(
    name: str,
    similar: Similar,
    folder: pathlib.Path,
    monkeypatch: pytest.MonkeyPatch,
    strides: float = 1.6,
    **sets: Any,
) -> Recording:
    """A scenario at a size, of a person of that size; lags of the muscles, which no size changes, as well."""
    own = {"patient.body_mass": f"{MASS} kg", "patient.body_height": f"{HEIGHT} m"}
    own |= {"record_rate": "1000 Hz", "gait.settled": "walked", "duration": f"{1.20325 * strides} s"}
    table = load("scenario", name, own | sets).resolved()
    scaled = {key: item if key in OF_THE_PERSON else similar.table(item) for key, item in table.items()}
    scaled["patient"]["spasticity"] = table["patient"]["spasticity"]
    for part in ("cuff", "plate"):
        if file := table["orthosis"][part]:
            scaled["orthosis"][part] = similar.part(file, folder)
    with monkeypatch.context() as patch:
        for lag in ("RISE", "FALL"):
            patch.setattr(muscle_weakness, lag, getattr(muscle_weakness, lag) * similar.units["s"])
        return run(_without_none(scaled))


def _without_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    return [_without_none(item) for item in value] if isinstance(value, list) else value


PEOPLE = [(45.0, 1.5), (110.0, 1.95), (MASS * (1.5 / HEIGHT) ** 3, 1.5), (MASS * (1.95 / HEIGHT) ** 3, 1.95)]


@pytest.mark.parametrize("mass, height", PEOPLE)
@pytest.mark.parametrize(
    "name, sets",
    [
        ("walk-healthy", {}),
        ("walk-dropfoot", {}),
        ("walk-dropfoot", {"patient": "spastic"}),
        ("walk-dropfoot", {"ground.mode": "contact"}),
        ("walk-dropfoot", {"shoe": "trainer"}),
        ("walk-dropfoot", {"leg.friction": "0.5 N*m", "leg.inertia": "0.01 kg*m^2"}),
    ],
    ids=["healthy", "drop-foot", "spastic", "contact", "shoe", "friction"],
)
def test_without_air_a_person_of_another_size_walks_alike(
    name: str,
    sets: dict[str, Any],
    mass: float,
    height: float,
    tmp_path: pathlib.Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    base = walked(name, Similar(1.0, 1.0), tmp_path, monkeypatch, **sets)
    similar = Similar(height / HEIGHT, mass / MASS)
    found = similar.departure(base, walked(name, similar, tmp_path, monkeypatch, **sets))
    assert {key: value for key, value in found.items() if value > EXACT} == {}


@pytest.mark.slow
@pytest.mark.parametrize("height", [1.5, 1.95])
@pytest.mark.parametrize("pressure", ["4 bar", "2 bar"])
def test_with_air_they_walk_alike_where_masses_go_with_area_and_the_orthosis_with_them(
    height: float, pressure: str, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At equal pressure forces go with l²: each number of the orthosis by its dimension.

    The muscles start empty: filling them before the first step is only exact to 0.1 %.
    """
    sets: dict[str, Any] = {"supply.pressure": pressure, "start": {"dorsiflexor": {"fill_time": "0 s"}}}
    name = "walk-dropfoot-afo-short"
    base = walked(name, Similar(1.0, 1.0), tmp_path, monkeypatch, **sets)
    taller = height / HEIGHT
    similar = Similar(taller, taller**2)
    assert similar.factor("Pa") == 1.0
    found = similar.departure(base, walked(name, similar, tmp_path, monkeypatch, **sets))
    assert {key: value for key, value in found.items() if value > EXACT} == {}


def clearance(mass: float, height: float, cycle: str) -> float:
    """Toe clearance of the healthy walker [mm]."""
    own = {"patient.body_mass": f"{mass} kg", "patient.body_height": f"{height} m", "gait.cycle": cycle}
    return float(run("walk-healthy", own).metrics["toe_clearance"].value)


@pytest.mark.parametrize(("mass", "height"), [(45.0, 1.5), (75.0, 1.75), (110.0, 1.95)])
@pytest.mark.parametrize(
    ("cycle", "low", "high"),
    [
        ("gatk_stride1", 0.0, 15.0),  # Winter 13, Schulz 11 ± 6 mm
        ("gatk_mean", 0.0, 15.0),
        ("bovi2011_natural", 9.0, 31.0),  # balls of three barefoot adults: 9 to 17, 14 to 21, 24 to 31 mm
    ],
)
def test_healthy_people_of_all_sizes_clear_the_floor_as_measured(
    cycle: str, low: float, high: float, mass: float, height: float
) -> None:
    """Barefoot, in proportion to their height."""
    found = clearance(mass, height, cycle)
    assert low < found * HEIGHT / height < high
    assert found == pytest.approx(clearance(MASS, HEIGHT, cycle) * height / HEIGHT, rel=1e-3)
