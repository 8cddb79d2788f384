"""An orthosis with tubes and a manifold on a whole model, against its run."""

import pathlib
from typing import Any

import mujoco
import numpy as np
import pytest
from turned_leg import beside_its_scenario

import afo_sim as afo
from afo_sim.description import Orthosis
from afo_sim.legs import Attached, write_attached
from afo_sim.legs import read_attached as attached

NETWORK: dict[str, Any] = {
    f"chamber.{name}.{key}": value
    for name in ("dorsiflexor", "plantarflexor")
    for key, value in (
        ("tube", "pun_4x2_5"),
        ("tube_length", "0.8 m"),
        ("tube_volume", "0 ml"),
        ("feed", "manifold"),
    )
} | {
    "volume.manifold.volume": "20 ml",
    "restriction.feed.kind": "tube",
    "restriction.feed.tube": "pun_4x2_5",
    "restriction.feed.length": "1 m",
    "restriction.feed.upstream": "supply",
    "restriction.feed.downstream": "manifold",
}


def device() -> Orthosis:
    found: Orthosis = afo.load("orthosis", "s1", NETWORK)
    return found


def test_a_network_on_a_leg_moves_as_in_its_scenario(tmp_path: pathlib.Path) -> None:
    def with_all_that_files_keep(leg: Attached) -> Attached:
        write_attached(leg, tmp_path / "worn.xml")
        return attached(tmp_path / "worn.xml")

    sets = {"duration": "3 s"} | {f"orthosis.{key}": value for key, value in NETWORK.items()}
    run, (found, fed, pressed) = beside_its_scenario(
        device(),
        sets,
        lambda leg, data: (leg.flow(data)["feed"], leg.volume_pressure(data)["manifold"]),
        with_all_that_files_keep,
    )
    assert np.ptp(run["ankle/angle"]) > 0.2
    assert np.allclose(found, run["ankle/angle"], rtol=0.0, atol=1e-10)
    assert np.ptp(fed) > 1e-4
    assert np.allclose(fed, run["restriction/feed/mass_flow"], rtol=0.0, atol=1e-10)
    assert np.allclose(pressed, run["volume/manifold/pressure"], rtol=1e-9)


def test_either_side_fills_alike() -> None:
    pressure = {}
    for side in ("right", "left"):
        leg = afo.attach("adult_75kg", afo.load("orthosis", "s1", {**NETWORK, "side": side}), timestep="1 ms")
        data = leg.data()
        leg.set_valves(data, dorsiflexor="inlet")
        with leg.callbacks():
            mujoco.mj_step(leg.model, data, 200)
        pressure[side] = leg.pressure(data)["dorsiflexor"]
    assert pressure["right"] > 2e4
    assert pressure["left"] == pytest.approx(pressure["right"], rel=1e-9)
