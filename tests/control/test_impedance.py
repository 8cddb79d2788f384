"""A spring and a damper about an angle: the law, its inverse map, and the moment that comes of it."""

import math
from typing import Any

import numpy as np
import pytest
from control.samples import Sample

import afo_sim
from afo_sim.control.impedance import ImpedanceController
from afo_sim.description import Impedance, load

DRIVES = {name: {"kind": "bang_bang"} for name in ("dorsiflexor", "plantarflexor")}
DRIVEN = load("scenario", "seated", {"drive": DRIVES})
PLAIN = [["0 deg", "-1 bar", "-2 N*m"], ["0 deg", "1 bar", "2 N*m"]]  # 2 N·m/bar at any angle


def table(**more: Any) -> dict[str, Any]:
    return {
        "lowers": "plantarflexor",
        "stiffness": "10 N*m/rad",
        "mean_pressure": "2 bar",
        "half_range": "1 bar",
        "torque_map": PLAIN,
    } | more


def seen(angle: float, velocity: float) -> Sample:
    """An observation of angle and velocity [SI]."""
    return Sample(0.0, 0.01, {"ankle/angle": angle, "ankle/velocity": velocity})


@pytest.mark.parametrize(
    ("more", "angle", "velocity", "moment"),
    [
        ({}, 0.1, 0.0, -1.0),
        ({"reference": {"mean": "0.05 rad"}}, 0.0, 0.0, 0.5),
        ({"damping": "2 N*m*s/rad"}, 0.0, 0.3, -0.6),
        ({"feed_forward": "0.7 N*m"}, 0.0, 0.0, 0.7),
    ],
)
def test_spring_damper_and_feed_forward(
    more: dict[str, Any], angle: float, velocity: float, moment: float
) -> None:
    controller = ImpedanceController(Impedance.model_validate(table(**more)), DRIVEN)
    commands = controller(seen(angle, velocity))
    assert controller.tell()["reference_moment"] == pytest.approx(moment)
    apart = moment / 2.0 * 1e5  # by the plain map
    assert commands == pytest.approx({"dorsiflexor": 2e5 + apart, "plantarflexor": 2e5 - apart}, abs=1.0)


def test_no_pressure_is_beyond_its_range() -> None:
    controller = ImpedanceController(Impedance.model_validate(table()), DRIVEN)
    assert controller(seen(-2.0, 0.0)) == pytest.approx({"dorsiflexor": 3e5, "plantarflexor": 1e5})
    low = Impedance.model_validate(table(mean_pressure="0.5 bar", half_range="2 bar"))
    assert ImpedanceController(low, DRIVEN)(seen(-2.0, 0.0)) == pytest.approx(
        {"dorsiflexor": 1.5e5, "plantarflexor": 0.0}  # the map ends at 1 bar
    )


def test_the_map_is_inverted_between_its_angles() -> None:
    rows = [[f"{a} rad", f"{d} bar", f"{(1.0 + a) * d + 3.0 * a} N*m"] for a in (0, 1) for d in (-1, 0, 1)]
    controller = ImpedanceController(Impedance.model_validate(table(torque_map=rows)), DRIVEN)
    for angle, d in ((0.0, 0.4), (0.5, -0.2), (1.0, 0.9)):
        # moments run straight between the angles: ((1 + a) d + 3 a) is linear in a
        moment = (1.0 + angle) * d + 3.0 * angle
        assert controller.difference(moment, angle) == pytest.approx(d * 1e5, abs=1.0)


def test_where_cables_hang_the_least_difference_is_taken() -> None:
    rows = [["0 deg", f"{d} bar", f"{m} N*m"] for d, m in ((-1, -1), (-0.5, 0), (0.3, 0), (1, 2))]
    controller = ImpedanceController(Impedance.model_validate(table(torque_map=rows)), DRIVEN)
    assert controller.difference(0.0, 0.0) == 0.0
    assert controller.difference(0.1, 0.0) == pytest.approx(0.3e5 + 0.05 * 0.7e5, rel=1e-3)
    assert controller.difference(-0.1, 0.0) == pytest.approx(-0.5e5 - 0.1 * 0.5e5, rel=1e-3)


@pytest.fixture(scope="module")
def device_map() -> list[list[Any]]:
    angles = np.radians([-6.0, -4.0, -2.0, 0.0, 2.0, 4.0, 6.0])
    return afo_sim.pressure_map("seated", 2e5, 2e5, lowers="plantarflexor", angles=angles)  # type: ignore[arg-type]


def test_the_map_of_the_device_is_its_moment_at_rest(device_map: list[list[Any]]) -> None:
    """A chamber alone, as S1's torque map has it, where the other chamber's muscles hang slack."""
    from afo_sim.model.build import build
    from afo_sim.model.torque_map import torque_map

    found = {(float(a.split()[0]), float(d.split()[0])): float(m.split()[0]) for a, d, m in device_map}
    maps = torque_map(build(load("scenario", "seated")), np.radians([2.0]), np.array([4e5]))
    alone = {entry.chamber: entry.torque[0, 0] for entry in maps}["dorsiflexor"]
    angle = min((key[0] for key in found), key=lambda a: abs(a - math.radians(2.0)))
    assert found[angle, 2e5] == pytest.approx(alone, rel=1e-6)


def test_the_moment_that_is_asked_for_comes(device_map: list[list[Any]]) -> None:
    """At rest the orthosis gives what spring and damper ask for, but for the drives' dead band."""
    more = {"reference": {"mean": "3 deg"}, "feed_forward": "1 N*m", "damping": "0.2 N*m*s/rad"}
    described = table(torque_map=device_map, half_range="2 bar", stiffness="15 N*m/rad", **more)
    sets = {
        "timer": None,
        "drive": DRIVES,
        "duration": "10 s",
        "controller": {"rate": "100 Hz", "impedance": described},
    }
    run = afo_sim.run("seated", sets)
    assert run.ok, run.status
    late = slice(-250, None)
    asked = run["controller/reference_moment"][late].mean()
    assert run["ankle/moment/orthosis"][late].mean() == pytest.approx(asked, abs=0.1)
    spring = 15.0 * (math.radians(3.0) - run["ankle/angle"][late].mean()) + 1.0
    assert asked == pytest.approx(spring, abs=0.01)


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ({"raises": "dorsi"}, "impedance.raises.*did you mean 'dorsiflexor'"),
        ({"lowers": "dorsiflexor"}, "is the chamber that raises too"),
        ({"angle": "ankle/angel"}, "impedance.angle = 'ankle/angel'.*did you mean 'ankle/angle'"),
        ({"velocity": "ankle/angle"}, "impedance.velocity.*is in rad, where rad/s are needed"),
        ({"torque_map": PLAIN[:1]}, "torque_map"),
        ({"torque_map": [*PLAIN, ["5 deg", "1 bar", "2 N*m"]]}, "not a whole grid"),
        ({"torque_map": [PLAIN[0], ["0 deg", "1 bar", "-2 N*m"]]}, "does not rise with d"),
    ],
)
def test_what_is_refused(more: dict[str, Any], says: str) -> None:
    sets = {"timer": None, "drive": DRIVES, "controller": {"impedance": table(**more)}}
    with pytest.raises(afo_sim.InputError, match=f"(?s){says}"):
        afo_sim.run("seated", sets)


def test_without_drives_it_is_refused() -> None:
    with pytest.raises(afo_sim.InputError, match="has no drive"):
        afo_sim.run("seated", {"timer": None, "controller": {"impedance": table()}})
