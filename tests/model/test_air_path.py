"""What an air path of a description begins with, and what of a regulator counts in another gas."""

import warnings
from typing import Any

import numpy as np
import pytest

import afo_sim
from afo_sim import load
from afo_sim.description import Orthosis
from afo_sim.model import AirPath, AirWay
from afo_sim.model.air_path import half_of_tubes
from afo_sim.native import CircuitVolume
from afo_sim.physics import CO2

FROM_SUPPLY: dict[str, Any] = {"upstream": "supply", "downstream": "high"}
LINE: dict[str, Any] = {
    "volume.high.volume": "100 ml",
    "volume.low.volume": "20 ml",
    "restriction.feed": {"kind": "orifice", "conductance": "1 dm^3/(s*bar)", "critical_ratio": 0.3}
    | FROM_SUPPLY,
    "restriction.to_low": {
        "kind": "regulator",
        "regulator": "droop_tenth",
        "pressure": "1.5 bar",
        "upstream": "high",
        "downstream": "low",
    },
    "chamber.dorsiflexor.feed": "low",
    "chamber.plantarflexor.feed": "high",
}
CHECK = {
    "kind": "check_valve",
    "conductance": "1 dm^3/(s*bar)",
    "critical_ratio": 0.3,
    "cracking_pressure": "0.3 bar",
}


def orthosis(**sets: Any) -> Orthosis:
    return load("orthosis", "s1", LINE | {key.replace("__", "."): value for key, value in sets.items()})


def volumes(device: Orthosis) -> dict[str, CircuitVolume]:
    supply = load("scenario", "seated").supply
    return {volume.name: volume for volume in AirPath.of(device, supply).volumes}


def test_a_volume_behind_a_regulator_begins_with_what_that_is_set_to() -> None:
    found = volumes(orthosis())
    assert found["high"].start == pytest.approx(4e5)
    assert found["low"].start == pytest.approx(1.5e5)


def test_a_volume_behind_a_check_valve_begins_below_what_opens_it() -> None:
    found = volumes(orthosis(restriction__feed=CHECK | FROM_SUPPLY))
    assert found["high"].start == pytest.approx(3.7e5)
    assert found["low"].start == pytest.approx(1.5e5)


def test_another_way_that_brings_more_decides() -> None:
    by_pass = {"kind": "orifice", "conductance": "0.01 dm^3/(s*bar)", "critical_ratio": 0.3} | FROM_SUPPLY
    found = volumes(orthosis(restriction__feed=CHECK | FROM_SUPPLY, restriction__by_pass=by_pass))
    assert found["high"].start == pytest.approx(4e5)


def test_air_at_rest_stays_where_it_begins() -> None:
    """With all valves shut nothing flows: no volume begins with more or less than its way holds."""
    sets = {f"orthosis.{key}": value for key, value in LINE.items()}
    still = {"duration": "0.2 s", "timer.dorsiflexor.inlet": [], "timer.dorsiflexor.outlet": []}
    run = afo_sim.run("seated", sets | {"orthosis.restriction.feed": CHECK | FROM_SUPPLY} | still)
    for volume in ("low", "high"):
        assert np.ptp(run[f"volume/{volume}/pressure"]) < 1.0


def test_the_outlet_of_a_regulator_between_two_nodes_has_its_air() -> None:
    device = orthosis()
    regulator = device.restriction["to_low"].regulator
    assert regulator is not None and regulator.outlet_volume == pytest.approx(5e-6)
    assert volumes(device)["low"].volume == pytest.approx(25e-6)
    assert volumes(device)["high"].volume == pytest.approx(100e-6)
    into = orthosis(restriction__to_low__downstream="dorsiflexor", volume__low__start_pressure="1 bar")
    assert half_of_tubes(into, "dorsiflexor") == pytest.approx(5e-6)


def test_every_tube_behind_a_regulator_has_all_its_air() -> None:
    device = load("orthosis", "s1_waist")
    sets = {"supply.regulator": "droop_tenth", "supply.line_pressure": "8 bar"}
    supply = load("scenario", "seated", sets).supply
    tubes = np.pi / 4.0 * (0.5 * 4e-3**2 + 2.0 * 1.0 * 2.5e-3**2)  # of the feed, of two chambers [m³]
    found = sum(each.volume for each in AirPath.of(device, supply).volumes)
    found += sum(half_of_tubes(device, name) for name in device.chamber)
    assert found == pytest.approx(10e-6 + 5e-6 + 5e-6 + tubes)  # manifold, exhaust, regulator's outlet


def test_a_regulator_that_is_as_far_open_lets_more_mass_of_carbon_dioxide_through() -> None:
    laws = {}
    for source in ("bottle_0_5l_10bar", "co2_8g"):
        supply = load(
            "scenario", "seated", {"supply.source": source, "supply.regulator": "droop_tenth"}
        ).supply
        laws[source] = {each.name: each for each in AirPath.of(orthosis(), supply).restrictions}
    for name in ("regulator", "regulator_relief", "to_low", "to_low_relief"):
        air, other = (laws[source][name] for source in ("bottle_0_5l_10bar", "co2_8g"))
        assert other.parameters[0] == air.parameters[0]  # a pressure
        assert other.parameters[1] == pytest.approx(CO2.flow_factor * air.parameters[1], rel=1e-12)
        assert other.steepest >= other.parameters[1]


def test_the_python_callback_steps_a_network_without_a_warning() -> None:
    sets = {f"orthosis.{key}": value for key, value in LINE.items()}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert afo_sim.run("seated", sets | {"duration": "6 ms", "callback": "python"}).ok


def test_conductances_in_series_add_as_inverse_squares() -> None:
    """1/√(1/3² + 1/4²) = 12/5."""
    assert AirWay((("valve", 3.0), ("tube", 4.0))).conductance == pytest.approx(2.4)
    assert AirWay(()).conductance == np.inf
