"""Settled strides of networks, solved for and walked to, and the slopes behind the search."""

from typing import Any

import numpy as np
import pytest

from afo_sim import native
from afo_sim.description import Scenario, load
from afo_sim.model import Built, steps_of_stride, two_strides, why_walked
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.native.between_strides import AIR, ANGLE
from afo_sim.simulation import Settled
from afo_sim.simulation.settle import settle
from afo_sim.simulation.simulate import simulate

CHAMBER = "orthosis.chamber"
TUBES: dict[str, Any] = {
    f"{CHAMBER}.{name}.{key}": value
    for name in ("dorsiflexor", "plantarflexor")
    for key, value in (("tube", "pun_4x2_5"), ("tube_length", "0.8 m"), ("tube_volume", "0 ml"))
}
FEED = "orthosis.restriction.feed"
MANIFOLD = TUBES | {
    "orthosis.volume.manifold.volume": "20 ml",
    f"{FEED}.kind": "tube",
    f"{FEED}.tube": "pun_4x2_5",
    f"{FEED}.length": "1 m",
    f"{FEED}.upstream": "supply",
    f"{FEED}.downstream": "manifold",
    f"{CHAMBER}.dorsiflexor.feed": "manifold",
    f"{CHAMBER}.plantarflexor.feed": "manifold",
}
NETWORKS = {
    "tubes": TUBES,
    "manifold": MANIFOLD,
    "bottle": TUBES | {"supply.source": "bottle_0_5l"},
    "carbon dioxide": {"supply.source": "co2_16g"},
    "regulator": MANIFOLD | {"supply.source": "bottle_0_5l", "supply.regulator": "droop_tenth"},
    "regulator on a line": {"supply.regulator": "droop_tenth", "supply.line_pressure": "8 bar"},
}


def described(sets: dict[str, Any]) -> Scenario:
    return load("scenario", "walk-dropfoot-afo", sets)


def solved(scenario: Scenario) -> tuple[Built, Settled]:
    built = build(two_strides(scenario))
    return built, settle([built], [schedule.controls(built)])[0]


def held(built: Built, act: np.ndarray) -> np.ndarray:
    """ln m and ln σ of all that holds air, in rows of `act` (n, na): (nodes, n, 2)."""
    nodes = (*built.index.chambers.values(), *built.index.volumes.values())
    return np.log([native.read_held(built.model, act, node) for node in nodes])


@pytest.mark.parametrize("network", NETWORKS)
def test_a_network_is_what_forty_strides_walk_to(network: str) -> None:
    scenario = described(NETWORKS[network])
    assert why_walked(scenario) == ""
    built, settled = solved(scenario)
    assert settled.found and settled.strides <= 6
    n = steps_of_stride(scenario)
    long = build(built.scenario.model_copy(update={"duration": 40 * n * built.scenario.timestep}))
    walked = simulate(long, schedule.controls(long)).rows
    found, last = settled.rollout.rows, slice(38 * n, 40 * n)
    assert np.abs(held(built, found["act"][: 2 * n]) - held(long, walked["act"][last])).max() <= AIR
    ankle = built.index.ankle_qpos
    assert np.abs(found["qpos"][: 2 * n, ankle] - walked["qpos"][last, ankle]).max() <= ANGLE


def test_a_slow_reservoir_is_told_to_be_slow() -> None:
    """Half a litre behind 60 m of tube: walking has not settled where the search has found it."""
    slow = MANIFOLD | {"orthosis.volume.manifold.volume": "500 ml", f"{FEED}.length": "60 m"}
    built, settled = solved(described(slow))
    assert settled.found and settled.slowest > 0.9
    n = steps_of_stride(built.scenario)
    change = held(built, settled.rollout.rows["act"][[0, n]])
    assert np.abs(change[:, 1] - change[:, 0]).max() <= 0.1 * AIR


def test_air_that_is_shut_in_is_not_called_slow() -> None:
    """The plantarflexor is never filled: what lies in it and in its tube stays as it is."""
    settled = solved(described(TUBES))[1]
    plain = solved(described({}))[1]
    assert settled.slowest == pytest.approx(plain.slowest, abs=0.05)


def test_a_store_is_nearly_full_in_the_settled_strides() -> None:
    built, settled = solved(described({"supply.source": "co2_16g"}))
    store = built.index.stores["source"]
    assert built.scenario.supply.source is not None
    full = built.scenario.supply.source.full_mass
    left = native.read_content(built.model, settled.rollout.rows["act"], store) / full
    n = steps_of_stride(built.scenario)
    assert left[0] > 0.97 and np.diff(left).max() <= 0.0
    assert left[n] - left[2 * n] == pytest.approx(left[0] - left[n], rel=1e-3)


def test_a_compressor_is_walked_and_why_is_told() -> None:
    assert "compressor" in why_walked(described({"supply.source": "vn_c4", "supply.pressure": "1 bar"}))
