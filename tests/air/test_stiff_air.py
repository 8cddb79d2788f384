"""Air that is fast against the step: no step is refused, and what it costs is what is told."""

import functools

import numpy as np
import pytest
from air.native_network import behind_valve

import afo_sim as afo
from afo_sim.common import GAS_CONSTANT, HEAT_CAPACITY_RATIO
from afo_sim.description import load
from afo_sim.model import AIR_ACCURATE, check_air
from afo_sim.native import air_block, air_step
from afo_sim.native.air_block import NODE

DELAYS = {"critical_ratio": "0.3", "opening_delay": "4 ms", "closing_delay": "4 ms"}
CHAMBERS = ("dorsiflexor", "plantarflexor")


def wide(c: float) -> dict[str, str]:
    return {"conductance": f"{c} dm^3/(s*bar)", **DELAYS}


@pytest.mark.parametrize("step", ["1 ms", "2 ms"])
@pytest.mark.parametrize("c", [0.05, 1.0, 3.7, 4.1, 4.5, 10.0, 40.0])
def test_a_filled_rigid_volume_has_its_suppliers_pressure_and_the_air_of_its_enthalpy(
    c: float, step: str
) -> None:
    """Adiabatic filling from a supply at T: m − m0 = (p − p0) V/(γ R T), whatever the valve."""
    sets = behind_valve(wide(c), {"volume": "3 ml"}, [["10 ms", "0.2 s"]], "0.2 s")
    run = afo.run("seated", sets | {"timestep": step})
    mass = run["volume/v/mass"]
    assert run["volume/v/pressure"][-1] == pytest.approx(4e5, rel=1e-3)
    assert mass[-1] - mass[0] == pytest.approx(
        4e5 * 3e-6 / (HEAT_CAPACITY_RATIO * GAS_CONSTANT * 293.15), rel=1e-3
    )


@functools.cache
def filled(c: float, step: str) -> tuple[np.ndarray, np.ndarray, float]:
    """S1's dorsiflexors through wide valves: pressure [Pa], moment [N·m] at 250 Hz, number."""
    sets: dict[str, object] = {
        f"orthosis.chamber.{n}.{v}": wide(c) for n in CHAMBERS for v in ("inlet", "outlet")
    }
    sets["timer"] = {
        "period": "0.8 s",
        "dorsiflexor": {"inlet": [["40 ms", "0.4 s"]], "outlet": [["0.5 s", "0.8 s"]]},
        "plantarflexor": {"outlet": [["0 s", "0.8 s"]]},
    }
    sets |= {"duration": "0.8 s", "timestep": step, "record_rate": "250 Hz"}
    number, _ = check_air(load("scenario", "seated", sets).orthosis, float(step.split()[0]) * 1e-3)
    run = afo.run("seated", sets)
    return run["chamber/dorsiflexor/pressure"], run["ankle/moment/orthosis"], number


@pytest.mark.parametrize(("c", "step"), [(0.86, "2 ms"), (4.0, "1 ms"), (3.5, "2 ms")])
def test_muscles_below_the_limit_are_within_one_per_cent(c: float, step: str) -> None:
    fine, coarse = filled(c, "0.04 ms"), filled(c, step)
    assert coarse[2] < AIR_ACCURATE
    assert np.abs(coarse[0] - fine[0]).max() < 0.01 * 4e5
    assert np.abs(coarse[1] - fine[1]).max() < 0.01 * np.ptp(fine[1])


def test_muscles_beyond_the_limit_are_off_by_what_is_told() -> None:
    fine, coarse = filled(20.0, "0.04 ms"), filled(20.0, "2 ms")
    assert coarse[2] > AIR_ACCURATE
    assert 0.01 * 4e5 < np.abs(coarse[0] - fine[0]).max() < 0.03 * 4e5
    assert np.abs(coarse[1] - fine[1]).max() < 0.05 * np.ptp(fine[1])


@pytest.mark.parametrize("cubic", [0, 1])
def test_the_error_of_a_part_is_nothing_of_an_even_change_and_that_of_a_cubic(cubic: int) -> None:
    """0.8 (Y0 − Y1) + 0.4 h (F0 + F1) of Y = Y0 + t is 0, and of Y = Y0 + t³ 0.4 h³, in mass or σ."""
    numbers, part, node = air_block.block(), 0.1, air_block.FIRST_BLOCK
    numbers[node + NODE.kind] = air_block.OF_VOLUME
    for k, level in enumerate((1.0, 7.0)):
        rise, rates = (part**3, (0.0, 3.0 * part**2)) if k == cubic else (part, (1.0, 1.0))
        numbers[node + NODE.first_mass + k], numbers[node + NODE.mass + k] = level, level + rise
        numbers[node + NODE.first_mass_rate + k], numbers[node + NODE.mass_rate + k] = rates
        if k == cubic:
            expected = 0.4 * part**3 / (level + rise)
    assert air_step.error(numbers, node + air_block.NODE_NUMBERS, part) == pytest.approx(expected, rel=1e-9)
