"""Statics of an orthosis: against MuJoCo's at rest, and the pin knee's own geometry and roots."""

from typing import Any

import mujoco
import numpy as np
import pytest
from devices import device
from knee import knee_orthosis

from afo_sim import native
from afo_sim.common import InputError
from afo_sim.description import Orthosis, reader
from afo_sim.lab import paths, statics
from afo_sim.lab import validation_knee as pin_knee
from afo_sim.lab.torque_problem import choose_chamber
from afo_sim.model import Built, muscle_names, sweep_ankle
from afo_sim.model.build import build
from afo_sim.model.torque_map import chamber_torque

ANGLES = np.radians(np.linspace(-18.0, 18.0, 7))
YIELDING = {
    "orthosis.anchor.shank": {"stiffening": {"force": "33 N", "length": "17 mm"}},
    "orthosis.muscle.dorsiflexor.cable.stiffness": "30 kN/m",
    "orthosis.muscle.dorsiflexor.cable.offset": "3 mm",
}
UNALIKE = {"orthosis.muscle.dorsiflexor.insertion.spacing": "4 cm"}  # outer ones run aslant
BOTH_TAUT = {"orthosis.muscle.plantarflexor.slack": "0 mm"}
CASES: list[tuple[str, dict[str, Any]]] = [
    ("s1", {}),
    ("s1", YIELDING),
    ("s1_short_links", UNALIKE),
    ("s1_short_links", BOTH_TAUT),
    ("guided", {}),
]


def built(name: str, sets: dict[str, Any]) -> Built:
    return build("seated", {"orthosis": name, **sets})


def simulated(of: Built, chamber: str, gauge: float) -> np.ndarray:
    """Torque of all muscles about the ankle, from the compiled model at rest."""
    data, found = mujoco.MjData(of.model), []
    with native.installed(of.scenario.callback):
        for angle in ANGLES:
            data.qpos[of.index.ankle_qpos] = angle
            native.fill_chambers(of.model, data, {of.index.chambers[chamber]: gauge})
            mujoco.mj_forward(of.model, data)
            found.append(sum(chamber_torque(of, data, each) for each in of.index.chambers))
    return np.array(found)


@pytest.mark.parametrize(("name", "sets"), CASES)
def test_paths_and_arms_are_the_compiled_models(name: str, sets: dict[str, Any]) -> None:
    of = built(name, sets)
    orthosis = of.scenario.orthosis
    kappa, arm, _ = sweep_ankle(of.model, of.index, ANGLES)
    names = muscle_names(orthosis)
    for path in paths(orthosis, ANGLES):
        own = [k for k, muscle in enumerate(of.index.muscles) if muscle.startswith(f"{path.group}_")]
        group = names[f"{path.group}_1"]
        length = group.type.nominal_length
        expected = (length + group.series_length - path.length) / length
        assert any(kappa[:, k] == pytest.approx(expected, abs=1e-12) for k in own)
        assert any(arm[:, k] == pytest.approx(path.arm, abs=1e-12) for k in own)
    counted = {
        group: sum(p.count for p in paths(orthosis, ANGLES) if p.group == group) for group in orthosis.muscle
    }
    assert counted == {group: each.count for group, each in orthosis.muscle.items()}


@pytest.mark.parametrize(("name", "sets"), CASES)
@pytest.mark.parametrize("chamber", ["dorsiflexor", "plantarflexor"])
def test_torque_is_the_simulated_one_at_rest(name: str, sets: dict[str, Any], chamber: str) -> None:
    of = built(name, sets)
    orthosis = of.scenario.orthosis
    for gauge in (0.0, 1e5, 3e5):
        found, _ = statics(orthosis, paths(orthosis, ANGLES), chamber, np.full(7, gauge), device())
        assert found == pytest.approx(simulated(of, chamber, gauge), abs=1e-8)
        assert gauge < 3e5 or np.abs(found).max() > 1.0


def test_a_pulleys_torque_is_tension_times_radius() -> None:
    orthosis: Orthosis = reader.load("orthosis", "arm_s1")
    angle = np.radians([-10.0, 0.0, 10.0])
    found, pull = statics(orthosis, paths(orthosis, angle), "flexor", np.full(3, 3e5), device(np.inf, 2e-3))
    group = orthosis.muscle["flexor"]
    assert group.pulley is not None
    length, radius = group.type.nominal_length, group.pulley.radius
    kappa = group.pulley.initial_contraction + (radius * angle + 2e-3) / length
    expected = radius * group.count * group.type.force(3e5, contraction=kappa)
    assert found == pytest.approx(expected, rel=1e-12)
    assert (pull == 0.0).all()


@pytest.mark.parametrize("name", list(pin_knee.MUSCLES))
@pytest.mark.parametrize(("stiffness", "offset"), [(12.88e3, 0.0), (21.6e3, 7.5e-3)])
def test_the_pin_knees_torque_is_its_own_roots(name: str, stiffness: float, offset: float) -> None:
    """A second geometry and a second bisection, on the tension of the spring."""
    test = pin_knee.knee_tests()[name]
    orthosis = knee_orthosis(test)
    (path,) = geometry = paths(orthosis, -test.angle)  # extension is positive there
    length, arm = pin_knee.path(test.angle)
    assert path.length == pytest.approx(length, abs=1e-12)
    assert path.arm == pytest.approx(arm, abs=1e-12)
    found, _ = statics(orthosis, geometry, "flexor", test.pressure, device(stiffness, offset))
    assert -found == pytest.approx(pin_knee.torque(test, stiffness, offset), abs=1e-6)


def test_a_change_of_the_law_is_the_muscles_own() -> None:
    test = pin_knee.knee_tests()["48"]
    orthosis = knee_orthosis(test)
    other = reader.with_keys(orthosis, {"muscle.flexor.type.laws.bolen_2026.contraction_620": 0.2})
    geometry = paths(orthosis, -test.angle)
    found = statics(orthosis, geometry, "flexor", test.pressure, device(contraction_620=0.2))[0]
    expected = statics(other, geometry, "flexor", test.pressure, device())[0]
    assert found == pytest.approx(expected, rel=1e-12)
    assert np.abs(found - statics(orthosis, geometry, "flexor", test.pressure, device())[0]).max() > 0.1


def test_the_only_chamber_is_the_one_that_was_filled() -> None:
    """Whatever its name; of several that which is asked for, or the dorsiflexor."""
    one = reader.load("orthosis", "pin_knee")
    (name,) = one.chamber
    assert name != "dorsiflexor" and choose_chamber(one, "", ()) == name
    both = reader.load("orthosis", "arm_s1")
    assert choose_chamber(both, "extensor", ("flexor",)) == "extensor"
    assert choose_chamber(both, "", ("flexor", "flexor")) == "flexor"
    assert choose_chamber(reader.load("orthosis", "s1"), "", ()) == "dorsiflexor"
    with pytest.raises(InputError) as refused:
        choose_chamber(both, "", ())
    assert refused.value.field == "chamber"
