"""Slopes of a chamber's air over a stride, against finite differences of an integration of its own."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import block_diag

from afo_sim.common import (
    AMBIENT_PRESSURE,
    AMBIENT_TEMPERATURE,
    GAS_CONSTANT,
    HEAT_CAPACITY_RATIO,
    STANDARD_DENSITY,
)
from afo_sim.native.air_slopes import air_slopes, giving
from afo_sim.native.slots import CHAMBER_ACT, CHAMBER_DATA
from afo_sim.native.stride_numbers import AMBIENT, AT, FIRST_NODE, SUPPLY, WAY_NUMBERS
from afo_sim.physics import TWO_WAY
from afo_sim.simulation.stride_search import _blank

STRIDE, ROWS = 0.2, 800  # [s], rows of it
BAR, C, CRITICAL = 1e5, 5.5e-10, 0.3
VOLUME, REFERENCE = 3e-4, 3e5  # V = VOLUME (p/REFERENCE)^give
PUFF = 1e-5  # change of ln m and ln σ for the differences


def flow(p_from: float, p_to: float, temperature: float, conductance: float) -> float:
    """ISO 6358 written down once more: choked, elliptic, and a straight end from a ratio of 0.98."""
    if p_to > p_from:
        raise ValueError("runs back")
    choked = conductance * STANDARD_DENSITY * p_from * np.sqrt(AMBIENT_TEMPERATURE / temperature)
    ratio = p_to / p_from
    share = min(max(ratio - CRITICAL, 0.0) / (1.0 - CRITICAL), (0.98 - CRITICAL) / (1.0 - CRITICAL))
    return choked * np.sqrt(1.0 - share**2) * min((1.0 - ratio) / 0.02, 1.0)


class Chamber:
    """Mass and σ = p V^γ of a chamber whose volume follows its pressure, by the first law."""

    def __init__(self, supply: float, inlet: float, outlet: float, wall: float, give: float):
        self.supply, self.inlet, self.outlet = supply, inlet, outlet
        self.wall, self.give = wall, give

    def state(self, pressure: float, temperature: float) -> np.ndarray:
        """(ln m, ln σ) at absolute pressure [Pa] and temperature [K]."""
        volume = VOLUME * (pressure / REFERENCE) ** self.give
        mass = pressure * volume / (GAS_CONSTANT * temperature)
        return np.log([mass, pressure * volume**HEAT_CAPACITY_RATIO])

    def air(self, state: np.ndarray) -> tuple[float, float, float, float, float]:
        """Mass, absolute pressure, volume, inward flow of the inlet, outward flow of the outlet."""
        mass, sigma = np.exp(state)
        power = 1.0 + HEAT_CAPACITY_RATIO * self.give
        p = (sigma / VOLUME**HEAT_CAPACITY_RATIO * REFERENCE ** (HEAT_CAPACITY_RATIO * self.give)) ** (
            1.0 / power
        )
        volume = VOLUME * (p / REFERENCE) ** self.give
        temperature = p * volume / (mass * GAS_CONSTANT)
        if self.supply >= p:
            enters = flow(self.supply, p, AMBIENT_TEMPERATURE, self.inlet)
        else:
            enters = -flow(p, self.supply, temperature, self.inlet)
        if p >= AMBIENT_PRESSURE:
            leaves = flow(p, AMBIENT_PRESSURE, temperature, self.outlet)
        else:
            leaves = -flow(AMBIENT_PRESSURE, p, AMBIENT_TEMPERATURE, self.outlet)
        return mass, p, volume, enters, leaves

    def rates(self, _: float, state: np.ndarray) -> np.ndarray:
        """d(ln m, ln σ)/dt: what flows carries γ R T of where it comes from."""
        mass, p, volume, enters, leaves = self.air(state)
        temperature = p * volume / (mass * GAS_CONSTANT)
        gamma = HEAT_CAPACITY_RATIO
        hot = enters * (AMBIENT_TEMPERATURE if enters >= 0.0 else temperature)
        hot -= leaves * (temperature if leaves >= 0.0 else AMBIENT_TEMPERATURE)
        heat = (gamma - 1.0) * self.wall * (AMBIENT_TEMPERATURE - temperature)
        return np.array([(enters - leaves) / mass, (gamma * GAS_CONSTANT * hot + heat) / (p * volume)])

    def walked(self, start: np.ndarray) -> np.ndarray:
        """States after each row of a stride (ROWS, 2)."""
        times = np.linspace(0.0, STRIDE, ROWS + 1)[1:]
        done = solve_ivp(self.rates, (0.0, STRIDE), start, "LSODA", times, rtol=1e-11, atol=1e-13)
        assert done.success
        return done.y.T

    def differences(self, start: np.ndarray) -> np.ndarray:
        """∂(ln m, ln σ) at the end by those at the start, by central differences."""
        columns = [
            (self.walked(start + puff)[-1] - self.walked(start - puff)[-1]) / (2.0 * PUFF)
            for puff in PUFF * np.eye(2)
        ]
        return np.stack(columns, axis=1)


def slopes(*walks: tuple[Chamber, np.ndarray]) -> np.ndarray:
    """∂(ln m, ln σ) of chambers on one supply at the end of a stride by those at its start."""
    count = len(walks)
    s = _blank(0, count, count, 2 * count, 0, ROWS, 0).copy()
    s[[AT.steps, AT.every, AT.interval]] = ROWS, 1, STRIDE / ROWS
    s[[AT.gas, AT.gamma, AT.control]] = GAS_CONSTANT, HEAT_CAPACITY_RATIO, 1
    s[[AT.act, AT.userdata]] = count * len(CHAMBER_ACT), count * len(CHAMBER_DATA)
    act, data = np.zeros((ROWS, count, len(CHAMBER_ACT))), np.zeros((ROWS, count, len(CHAMBER_DATA)))
    giving_rows = s[int(s[AT.giving]) : int(s[AT.past])].reshape(ROWS, count)
    nodes = s[int(s[AT.node]) : int(s[AT.way])].reshape(count, -1)
    ways = s[int(s[AT.way]) :][: 2 * count * WAY_NUMBERS].reshape(count, 2, -1)
    for k, (chamber, start) in enumerate(walks):
        airs = np.array([chamber.air(state)[:3] for state in chamber.walked(start)])
        act[:, k, CHAMBER_ACT.mass], data[:, k, CHAMBER_DATA.pressure] = airs[:, 0], airs[:, 1]
        data[:, k, CHAMBER_DATA.volume], giving_rows[:, k] = airs[:, 2], chamber.give
        nodes[k] = k * len(CHAMBER_ACT), k * len(CHAMBER_DATA), 0, 0.0, chamber.wall
        for way, origin, end, conductance in (
            (0, SUPPLY, FIRST_NODE + k, chamber.inlet),
            (1, FIRST_NODE + k, AMBIENT, chamber.outlet),
        ):
            ways[k, way, :6] = origin, end, -1, TWO_WAY, conductance, CRITICAL
    control = np.full(ROWS, walks[0][0].supply - AMBIENT_PRESSURE)
    air_slopes(s, 0, act.ravel(), data.ravel(), control, 0)
    return s[int(s[AT.own]) : int(s[AT.slopes])].reshape(2 * count, 2 * count)


AIRS = {
    # supply, inlet, outlet, wall, give, pressure and temperature at the start
    "filled, choked": (Chamber(8 * BAR, C, 0.0, 0.5, 0.0), 1.2 * BAR, 285.0),
    "filled, subsonic": (Chamber(5 * BAR, C, 0.0, 0.5, 0.2), 3.5 * BAR, 300.0),
    "filled to the end": (Chamber(3 * BAR, 20 * C, 0.0, 0.5, 0.3), 2.0 * BAR, 293.15),
    "vented, choked": (Chamber(5 * BAR, 0.0, C, 0.5, 0.2), 5.0 * BAR, 310.0),
    "vented, subsonic": (Chamber(5 * BAR, 0.0, C, 0.0, 0.3), 1.8 * BAR, 280.0),
    "vented to the end": (Chamber(5 * BAR, 0.0, 10 * C, 0.5, 0.1), 2.0 * BAR, 293.15),
    "back through the inlet": (Chamber(2 * BAR, C, 0.0, 0.5, 0.2), 4.0 * BAR, 320.0),
    "sucked through the outlet": (Chamber(2 * BAR, 0.0, C, 0.5, 0.0), 0.5 * BAR, 290.0),
    "through both valves": (Chamber(5 * BAR, C, 0.5 * C, 0.5, 0.3), 2.5 * BAR, 300.0),
    "sealed, warm": (Chamber(5 * BAR, 0.0, 0.0, 0.5, 0.3), 2.0 * BAR, 330.0),
    "sealed, adiabatic": (Chamber(5 * BAR, 0.0, 0.0, 0.0, 0.3), 2.0 * BAR, 330.0),
}


@pytest.mark.parametrize("name", AIRS)
def test_the_slopes_are_those_of_the_stride_that_was_walked(name: str) -> None:
    chamber, pressure, temperature = AIRS[name]
    start = chamber.state(pressure, temperature)
    # rows are the states after each step: half a step of the rates is the error
    assert slopes((chamber, start)) == pytest.approx(chamber.differences(start), abs=0.01)


def test_a_sealed_chamber_without_a_wall_keeps_what_it_holds() -> None:
    chamber, pressure, temperature = AIRS["sealed, adiabatic"]
    found = slopes((chamber, chamber.state(pressure, temperature)))
    assert found == pytest.approx(np.eye(2), abs=1e-12)


def test_a_chamber_that_comes_to_the_supply_and_the_wall_forgets_what_it_held() -> None:
    """Pressure and temperature are then those of supply and wall, whatever they were."""
    chamber = Chamber(3 * BAR, 100 * C, 0.0, 50.0, 0.0)
    found = slopes((chamber, chamber.state(2.8 * BAR, AMBIENT_TEMPERATURE)))
    assert found == pytest.approx(np.zeros((2, 2)), abs=1e-3)


def test_each_chamber_has_its_own_slopes() -> None:
    chosen = [AIRS[name] for name in ("through both valves", "vented, subsonic", "sealed, warm")]
    walks = [(chamber, chamber.state(pressure, temperature)) for chamber, pressure, temperature in chosen]
    assert slopes(*walks) == pytest.approx(block_diag(*map(slopes, walks)), abs=1e-12)


def test_two_strides_tell_how_the_volume_follows_the_pressure() -> None:
    chamber, pressure, temperature = AIRS["through both valves"]
    one, other = (chamber.walked(chamber.state(p, temperature)) for p in (pressure, 1.05 * pressure))
    for state, before in zip(one, other, strict=True):
        here, there = chamber.air(state)[1:3], chamber.air(before)[1:3]
        assert giving(*here, *there, 0.9) == pytest.approx(chamber.give, abs=1e-9)


def test_strides_that_are_alike_tell_nothing_of_the_volume() -> None:
    assert giving(2 * BAR, VOLUME, 2 * BAR * (1.0 + 4e-4), 1.1 * VOLUME, 0.123) == 0.123
