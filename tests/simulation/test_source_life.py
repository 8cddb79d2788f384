"""What a source begins a run with, and how long it lasts: filled before is out of it, and it cools."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import afo_sim as afo
from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, with_code
from afo_sim.description import load
from afo_sim.metrics import Metric, until_empty
from afo_sim.physics import CO2, store_pressure, store_temperature_rate

WALK = "walk-dropfoot-afo"
TANK = {
    "orthosis.volume.tank.volume": "0.75 l",
    "orthosis.volume.tank.start_pressure": "4 bar",
    "orthosis.restriction.feed": {
        "kind": "check_valve",
        "conductance": "0.3 dm^3/(s*bar)",
        "critical_ratio": 0.3,
    }
    | {"upstream": "supply", "downstream": "tank", "cracking_pressure": "0.1 bar"},
    "orthosis.chamber.dorsiflexor.feed": "tank",
}
SHORT = {"duration": "1.2 s", "gait.settled": "walked"}
RT = CO2.constant * AMBIENT_TEMPERATURE


def first_mass(sets: dict[str, Any], name: str = WALK) -> tuple[float, Any]:
    run = afo.run(name, {"supply.source": "co2_12g"} | sets)
    return 1e3 * float(run["store/source/mass"][0]), run


def test_what_is_filled_before_the_first_step_is_out_of_the_cartridge() -> None:
    """12 g less what chambers hold beyond ambient air; a tank of 0.75 l at 4 bar takes p V/(R T) more."""
    plain, run = first_mass(SHORT)
    filled = float(run.metrics["air_before_first_step"])
    assert filled > 0.3 and plain == pytest.approx(12.0 - filled, rel=1e-6)
    left, with_tank = first_mass(SHORT | TANK)
    told = float(with_tank.metrics["air_before_first_step"])
    assert left == pytest.approx(12.0 - told, rel=1e-6)
    # by the time to fill the tank has given some of its air to the muscles: at told pressures it has not
    at_once = SHORT | {"start": {"dorsiflexor": {"pressure": "3 bar"}}}
    tank = first_mass(at_once)[0] - first_mass(at_once | TANK)[0]
    assert tank == pytest.approx(1e3 * 4e5 * 0.75e-3 / RT, rel=1e-9)


def test_a_seated_wearer_s_tank_is_out_of_it_too() -> None:
    left, _ = first_mass(TANK | {"duration": "0.5 s"}, "seated")
    assert left == pytest.approx(12.0 - 1e3 * 4e5 * 0.75e-3 / RT, rel=1e-9)


def test_a_source_that_the_start_empties_is_told() -> None:
    small = {"supply.source": "bottle_0_5l_10bar", "supply.source.volume": "0.2 l"}
    run = afo.run(WALK, SHORT | TANK | small)
    assert any("before the first step leaves" in warning for warning in run.warnings)
    assert float(run["store/source/pressure"][0]) < 4e5
    full = 0.2e-3 * (1e6 + AMBIENT_PRESSURE) / (287.05 * AMBIENT_TEMPERATURE)
    assert load("source", "bottle_0_5l_10bar", {"volume": "0.2 l"}).full_mass == pytest.approx(full, rel=0.01)


@pytest.mark.parametrize("flow", [0.01, 1.0, 8.0])
@pytest.mark.parametrize("name", ["co2_12g", "bottle_0_5l_10bar"])
def test_what_a_source_gives_as_it_cools_is_that_of_a_fine_solution(name: str, flow: float) -> None:
    source = load("source", name)
    row = source.real_gas.row
    rate = flow * 1e-3 / 60.0 * source.real_gas.free_density

    def rates(_: float, state: np.ndarray) -> list[float]:
        around = (source.shell, source.wall_conductance, AMBIENT_TEMPERATURE)
        return [-rate, store_temperature_rate(*state, source.volume, 0.0, rate, *around, row)]

    def too_low(_: float, state: np.ndarray) -> float:
        return store_pressure(*state, source.volume, row) - 4e5 - AMBIENT_PRESSURE

    too_low.terminal = True  # type: ignore[attr-defined]
    begun = [0.9 * source.full_mass, AMBIENT_TEMPERATURE]
    span = (0.0, 0.899 * source.full_mass / rate)
    told = solve_ivp(rates, span, begun, method="LSODA", events=too_low, rtol=1e-8, atol=1e-10)
    assert source.given_at(4e5, rate, begun[0]) == pytest.approx(rate * told.t[-1], rel=1e-4)
    assert source.given_at(4e5, rate) <= source.given(4e5)


def test_nothing_comes_out_of_what_has_too_little() -> None:
    source = load("source", "co2_12g")
    assert source.given_at(6e6, 1e-4) == source.given_at(4e5, 1e-4, 1e-4) == 0.0


@pytest.mark.slow
def test_the_life_of_a_settled_walk_is_that_of_a_long_one() -> None:
    """Solved for, and walked until it is empty; the first strides of that one take up to a fifth more."""
    source = {"supply.source": "co2_12g", "reference": None}
    solved = afo.run(WALK, source | {"duration": "4 s"})
    walked = afo.run(WALK, source | {"duration": "96 s", "gait.settled": "walked"})
    warm = load("source", "co2_12g").given(4e5) / (1e-3 * float(solved.metrics["air_per_stride"]))
    empty, stride = (float(walked.metrics[name]) for name in ("source_empty_after", "stride_time"))
    assert float(walked.metrics["strides_per_bottle"]) == pytest.approx(empty / stride)
    assert float(walked.metrics["hours_per_bottle"]) == pytest.approx(empty / 3600.0)
    assert float(solved.metrics["strides_per_bottle"]) == pytest.approx(empty / stride, rel=0.02)
    assert float(solved.metrics["strides_per_bottle"]) < 0.85 * warm
    assert f"lasts {empty / stride:.0f} strides" in walked.verdict[-2].text


def test_a_run_that_empties_its_source_tells_the_strides_until_then() -> None:
    told = {"source_empty_after": 96.0, "strides_per_bottle": 134.0, "stride_time": 1.2}
    found = until_empty({name: Metric(value, "") for name, value in told.items()})
    assert float(found["strides_per_bottle"]) == pytest.approx(80.0)
    assert float(found["hours_per_bottle"]) == pytest.approx(96.0 / 3600.0)
    assert not until_empty({"strides_per_bottle": Metric(134.0, ""), "stride_time": Metric(1.2, "s")})


def test_dry_ice_is_told() -> None:
    tiny = {"kind": "cartridge", "gas": "co2", "content": "1 g", "volume": "2 ml"}  # no shell, no heat
    leak = {"kind": "leak", "upstream": "supply", "conductance": "0.2 dm^3/(s*bar)"}
    sets = {"supply.source": tiny, "orthosis.restriction.leak": leak, "duration": "2 s"}
    frozen = afo.run("seated", sets)
    assert frozen["store/source/temperature"].min() < 216.592  # the triple point of carbon dioxide [K]
    assert any("dry ice" in warning for warning in frozen.warnings)
    warm = afo.run("seated", {"supply.source": "co2_16g", "duration": "0.5 s"})
    assert not any("dry ice" in warning for warning in warm.warnings)


SMALL = {"kind": "cartridge", "gas": "co2", "volume": "4 ml", "wall_conductance": "0.1 W/K"}


@pytest.mark.parametrize(
    ("name", "grams", "sets", "of"),
    [
        ("seated", 1.2, {"duration": "4 s"}, "the whole run"),
        (WALK, 1.2, {"duration": "5 s", "gait.settled": "walked"}, "the strides before"),
        (WALK, 0.75, {"duration": "5 s", "gait.settled": "walked"}, "strides on an empty source"),
        (WALK, 1.2, {"duration": "8 s"}, "the settled stride on a full source"),
    ],
)
def test_a_source_that_runs_empty_within_the_run_is_told_with_what_the_numbers_are_of(
    name: str, grams: float, sets: dict[str, Any], of: str
) -> None:
    run = afo.run(name, sets | {"supply.source": SMALL | {"content": f"{grams} g"}, "reference": None})
    [told] = with_code(run.warnings, "source-empty")
    below = run["time"][np.argmax(run["store/source/pressure"] < 4e5)]
    assert told.data["after"] == pytest.approx(below) and told.subject == "source"
    assert "cartridge is empty" in told and f"numbers are of {of}" in told
    if name == WALK:
        assert run.verdict[-2].status == "bad" and "is empty after" in run.verdict[-2].text
        empty = "strides_without_air" in run.metrics
        assert empty == ("empty source" in of) == ("This is from" in run.verdict[2].text)
        if of == "the strides before":  # 2.98 s: the second stride alone has air and is none of the start
            assert run.metrics["air_per_stride"] == run.strides[1]["air_per_stride"]


def test_both_legs_empty_a_source_that_lasts_for_one() -> None:
    """A leg takes 0.9 g in 4 s of filling: 2.9 g last 9.1 s for one, and the run is of 8 s."""
    legs = afo.both("seated", sets={"supply.source": SMALL | {"content": "2.9 g"}, "duration": "8 s"})
    [told] = with_code(legs.warnings, "source-empty")
    assert told.startswith("both legs together: source: cartridge is empty") and told.data["after"] < 8.0
    hours = float(legs.numbers["hours_per_bottle_both"])
    assert told.data["after"] == pytest.approx(3600.0 * hours)
