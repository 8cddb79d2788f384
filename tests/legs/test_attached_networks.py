"""An orthosis with tubes and a manifold on a whole model, against its run."""

import pathlib
from typing import Any

import mujoco
import numpy as np
import pytest
from documents import ROOT

import afo_sim as afo
from afo_sim.common import GRAVITY
from afo_sim.description import Orthosis
from afo_sim.legs import write_attached
from afo_sim.legs.attached_files import attached
from afo_sim.model.supply_and_timer import controls

LEG = ROOT / "models" / "legs" / "adult_75kg" / "leg.xml"
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


def shipped_leg() -> mujoco.MjSpec:
    """The shipped leg without its toes' hinge, as a seated scenario has it."""
    spec = mujoco.MjSpec.from_file(str(LEG))
    spec.delete(spec.joint("toe"))
    spec.option.gravity = [0.0, 0.0, -GRAVITY]
    return spec


def test_a_network_on_a_leg_moves_as_in_its_scenario(tmp_path: pathlib.Path) -> None:
    damping = 0.5
    sets = {"leg.passive.scale": 0.0, "leg.damping": f"{damping} N*m*s/rad", "duration": "3 s"}
    sets |= {f"orthosis.{key}": value for key, value in NETWORK.items()}
    scenario = afo.load("scenario", "seated", sets)
    run, built = afo.run(scenario), afo.build(scenario)
    control = controls(built)
    spec = shipped_leg()
    spec.joint("ankle").damping = [0.5 * damping, 0.0, 0.0]
    leg = afo.attach(spec, device(), shank="shank", foot="foot", ankle="ankle", side="right", timestep="2 ms")
    write_attached(leg, tmp_path / "worn.xml")
    leg = attached(tmp_path / "worn.xml")  # with all that the files keep
    inputs = {**leg.valves, **leg.chambers}
    theirs = {**built.index.valves, **built.index.chambers}
    data = leg.data(run["ankle/angle"][:1])
    angle, fed, pressed = [], [], []
    with leg.callbacks():
        for row in control:
            data.ctrl[list(inputs.values())] = row[[theirs[name] for name in inputs]]
            data.qfrc_applied[:] = -0.5 * damping * data.qvel  # the half that the passive ankle takes
            angle.append(leg.angle(data))
            mujoco.mj_step(leg.model, data)
            fed.append(leg.flow(data)["feed"])
            pressed.append(leg.volume_pressure(data)["manifold"])
    assert np.ptp(run["ankle/angle"]) > 0.2
    assert np.allclose(angle, run["ankle/angle"], rtol=0.0, atol=1e-10)
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
