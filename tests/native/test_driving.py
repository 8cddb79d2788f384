"""Pressure drives on a rigid chamber: against a second computation, closed forms, and what they promise."""

import dataclasses
import itertools
import math
from typing import Any

import mujoco
import numpy as np
import pytest
from rig import charged, hanging_mass

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT, STANDARD_DENSITY
from afo_sim.description import Drive
from afo_sim.model.air_path import drive_of
from afo_sim.native import slots

STEP = 1e-3
SUPPLY = 6e5
SHARED = {"tube_volume": 3e-5, "wall_conductance": 0.5, "timestep": STEP}
KINDS: dict[str, dict[str, Any]] = {
    "bang_bang": {"dead_band": 1e4, "least_on": 7e-3, "least_off": 3e-3},
    "bang_bang, filtered": {"dead_band": 2e4, "release": 5e3, "filter_time": 4e-3},
    "pwm": {"full_at": 8e4, "integral_time": 0.5, "least_on": 1.3e-3, "period": 11.3e-3},
    "pwm, both ends": {
        "full_at": 1e5,
        "derivative_time": 5e-3,
        "filter_time": 3e-3,
        "least_on": 4.2e-3,
        "least_off": 3.1e-3,
        "period": 0.0204,
        "dead_band": 500.0,
    },
    "regulator": {"full_at": 2e5, "integral_time": 0.4, "bandwidth": 30.0, "dead_band": 0.0},
}


def drive(name: str, **changed: Any) -> Drive:
    kind: Any = name.partition(",")[0]
    return Drive(kind=kind).with_values(**(KINDS.get(name, {}) | changed))


def rigid(described: Drive | None, **changed: Any) -> mujoco.MjModel:
    """A chamber that is its tube alone."""
    made = None if described is None else drive_of(described)
    return hanging_mass(3.0, muscles=0, drive=made, **(SHARED | changed))


@dataclasses.dataclass
class Traces:
    """What each step saw and gave (n,): gauge pressure [Pa], coils, openings, counted switchings after it."""

    pressure: np.ndarray
    coils: np.ndarray
    openings: np.ndarray
    switches: np.ndarray
    mass: np.ndarray


def stepped(
    model: mujoco.MjModel,
    targets: np.ndarray,
    *,
    supply: float = SUPPLY,
    start: float = 0.0,
    coils: np.ndarray | None = None,
    mode: native.Mode = "native",
) -> Traces:
    """A run whose valves have these inputs (n, 2) beside the targets (n,)."""
    chamber = model.actuator("chamber_air").id
    valves = [model.actuator(f"valve_air_{side}").id for side in native.SIDES]
    names = {model.actuator(i).name for i in range(model.nu)}
    driven = model.actuator("drive_air").id if "drive_air" in names else None
    rows = []
    with native.installed(mode):
        data = charged(model, start)
        data.qvel[:] = 0.0
        for k, target in enumerate(targets):
            data.ctrl[chamber] = supply
            data.ctrl[valves] = 0.0 if coils is None else coils[k]
            if driven is not None:
                data.ctrl[driven] = target
            mujoco.mj_step(model, data)
            opening = [float(native.read_opening(model, data.userdata, v)) for v in valves]
            air = native.read_air(model, data.act, data.userdata, chamber)
            given = list(data.ctrl[valves])
            counts = [0.0, 0.0]
            if driven is not None:
                given = [float(native.read_coil(model, data.userdata, v)) for v in valves]
                counts = [float(native.read_switches(model, data.act, driven, out)) for out in (False, True)]
            rows.append((float(air.absolute_pressure) - AMBIENT_PRESSURE, given, opening, counts, air.mass))
    return Traces(*(np.array(column) for column in zip(*rows, strict=True)))


def staircase() -> np.ndarray:
    """Targets up, down, off, and up again [Pa]."""
    return np.repeat([1.5e5, 3e5, 1e5, -1.0, 2.2e5, 1.9e5], 500)


class Second:
    """A drive computed a second time, plainly: pulses are a list of intervals in time."""

    def __init__(self, described: Drive):
        self.d = described
        self.reading: float | None = None
        self.forget()

    def forget(self) -> None:
        self.integral, self.side, self.since = 0.0, 0, -math.inf
        self.next_period: float | None = None
        self.pulses: list[tuple[float, float, int]] = []
        self.on = False

    def coils(self, time: float, pressure: float, target: float) -> tuple[float, float]:
        d = self.d
        before = pressure if self.reading is None else self.reading
        share = 1.0 if d.filter_time == 0.0 else 1.0 - math.exp(-STEP / d.filter_time)
        self.reading = before + share * (pressure - before)
        if target < 0.0:
            self.forget()
            return 0.0, 0.0
        error, slope = target - self.reading, (self.reading - before) / STEP
        if d.kind == "bang_bang":
            return self.switched(time, error)
        output = self.controlled(error, slope)
        if d.kind == "regulator":
            return max(output, 0.0), max(-output, 0.0)
        return self.pulsed(time, output)

    def switched(self, time: float, error: float) -> tuple[float, float]:
        d, held = self.d, time - self.since + 1e-9
        released = 0.75 * d.dead_band if d.release is None else d.release
        wanted = self.side
        if self.side and held >= (d.least_on or 0.0) and self.side * error <= released:
            wanted = 0
        elif not self.side and held >= d.least_off and abs(error) > d.dead_band:
            wanted = 1 if error > 0.0 else -1
        if wanted != self.side:
            self.side, self.since = wanted, time
        return float(self.side == 1), float(self.side == -1)

    def controlled(self, error: float, slope: float) -> float:
        d = self.d
        if abs(error) <= d.dead_band:
            self.integral = 0.0
            return 0.0
        risen = self.integral + (STEP * error / (d.integral_time * d.full_at) if d.integral_time else 0.0)
        output = (error - d.derivative_time * slope) / d.full_at + risen
        if abs(output) <= 1.0 or output * error < 0.0:
            self.integral = risen
        return max(-1.0, min(1.0, output))

    def pulsed(self, time: float, output: float) -> tuple[float, float]:
        d, end = self.d, time + STEP
        if self.next_period is None:
            self.next_period = time
        while self.next_period < end - 1e-9:
            width = abs(output) * d.period
            width = (
                0.0 if width < (d.least_on or 0.0) else d.period if d.period - width < d.least_off else width
            )
            if width:
                self.pulses.append((self.next_period, self.next_period + width, 1 if output > 0.0 else -1))
            self.next_period += d.period
        shares = {1: 0.0, -1: 0.0}
        for a, b, side in self.pulses:
            shares[side] += max(0.0, min(b, end) - max(a, time)) / STEP
        return shares[1], shares[-1]


@pytest.mark.parametrize("name", KINDS)
def test_coils_are_those_of_a_second_computation(name: str) -> None:
    described, targets = drive(name), staircase()
    found, second = stepped(rigid(described), targets), Second(described)
    expected = [
        second.coils(k * STEP, p, t) for k, (p, t) in enumerate(zip(found.pressure, targets, strict=True))
    ]
    assert np.abs(found.coils - np.array(expected)).max() < 1e-6
    assert found.coils.sum(axis=0).min() > 0.2  # both valves had to work


@pytest.mark.parametrize("name", ["pwm", "pwm, both ends"])
def test_pulses_are_counted_once_each(name: str) -> None:
    """Also those within one step, and those that go over into the next step."""
    described, targets = drive(name), staircase()
    found, second = stepped(rigid(described), targets), Second(described)
    starts: list[list[tuple[float, float]]] = [[], []]
    for k, (p, t) in enumerate(zip(found.pressure, targets, strict=True)):
        known = len(second.pulses) if t >= 0.0 else 0
        second.coils(k * STEP, p, t)
        for a, b, side in second.pulses[known:]:
            starts[0 if side > 0 else 1].append((a, b))
    joined = [
        len(pulses) - sum(b[0] - a[1] < 1e-9 for a, b in itertools.pairwise(pulses)) for pulses in starts
    ]
    assert found.switches[-1].tolist() == joined
    assert joined[0] > 20


def test_bang_bang_settles_within_its_band() -> None:
    """Isothermal, so that nothing moves the pressure once the valves are shut."""
    described = drive("bang_bang", dead_band=5e4, least_on=0.0, least_off=0.0)
    found = stepped(rigid(described, wall_conductance=2.0), np.full(1500, 2e5))
    late = found.pressure[500:]
    assert np.abs(late - 2e5).max() < 5e4
    assert found.coils[500:].sum() == 0.0 and found.switches[-1].tolist() == [1.0, 0.0]


@pytest.mark.parametrize("target", [1e5, 3.3e5])
def test_pulses_bring_the_mean_pressure_that_is_asked_for(target: float) -> None:
    described = drive("pwm", dead_band=1e3, period=0.02, least_on=0.0, full_at=1e5, integral_time=0.05)
    found = stepped(rigid(described, wall_conductance=2.0), np.full(6000, target))
    assert np.abs(found.pressure[-1000:] - target).max() < 1e3
    loose = drive("pwm", dead_band=1e3, period=0.02, least_on=0.0, full_at=1e5, integral_time=None)
    short = stepped(rigid(loose, wall_conductance=2.0), np.full(6000, target))
    # without an integral it ends where a pulse is too short to open the valve: 4 ms of 20; the last one that
    # did left it open for the closing delay, 4 ms, with choked flow at most
    choked = 5.5e-10 * STANDARD_DENSITY * (SUPPLY + AMBIENT_PRESSURE)
    rise = 4e-3 * 1.4 * GAS_CONSTANT * AMBIENT_TEMPERATURE * choked / SHARED["tube_volume"]
    assert 1e5 * 4e-3 / 0.02 - rise < target - short.pressure[-1] <= 1e5 * 4e-3 / 0.02


def test_regulator_follows_the_first_order_of_its_loop() -> None:
    """Choked flow from 12 bar is linear in the opening: ṗ = R T C ρ0 p_s u/V, u = e/full_at.

    With valves far faster than the loop the pressure goes to its target as 1 − e^(−K t).
    """
    conductance, volume, full, target, supply = 5.5e-9, 2e-3, 2e5, 1e5, 12e5
    speed = GAS_CONSTANT * AMBIENT_TEMPERATURE * conductance * STANDARD_DENSITY * (supply + AMBIENT_PRESSURE)
    rate = speed / volume / full
    described = drive("regulator", full_at=full, integral_time=None, bandwidth=500.0)
    model = rigid(described, tube_volume=volume, wall_conductance=500.0, conductance=conductance)
    found = stepped(model, np.full(1500, target), supply=supply)
    time = STEP * np.arange(1500)
    expected = target * (1.0 - np.exp(-rate * time))
    assert 0.9 < rate * time[-1] < 10.0
    assert np.abs(found.pressure - expected).max() < 0.01 * target


def test_a_proportional_valve_opens_as_its_bandwidth_says() -> None:
    """Full output from the start: 1 − e^(−2π f t), of which each step has the mean."""
    found = stepped(rigid(drive("regulator", full_at=1e3, bandwidth=12.0)), np.full(40, 4e5))
    turn = 2.0 * math.pi * 12.0 * STEP
    expected = 1.0 + np.exp(-turn * np.arange(40)) * math.expm1(-turn) / turn
    assert np.abs(found.openings[:, 0] - expected).max() < 1e-9
    assert found.coils[:, 0].min() == 1.0


def stretches(shares: np.ndarray) -> tuple[list[float], list[float]]:
    """Durations of pulses and of gaps between them, from the shares of the steps [s]; whole ones only."""
    on = shares > 1e-9
    pulses, gaps, length, gap = [], [], 0.0, math.inf
    for share, is_on in zip(shares, on, strict=True):
        if is_on:
            if length == 0.0:
                gaps.append(gap)
            length += share * STEP
            gap = 0.0
            continue
        if length > 0.0:
            pulses.append(length)
        length, gap = 0.0, gap + STEP
    return pulses, gaps[1:]


@pytest.mark.parametrize("name", ["bang_bang", "pwm, both ends"])
def test_least_times_are_kept(name: str) -> None:
    """Of pulses whose steps are apart; a gap is as long as the steps without current, or longer."""
    described = drive(name)
    found = stepped(rigid(described), np.repeat([1.5e5, 3e5, 1e5, 2.2e5, 1.9e5], 500))
    for side in (0, 1):
        pulses, gaps = stretches(found.coils[:, side])
        assert len(pulses) > 1
        assert min(pulses) > (described.least_on or 0.0) - 1e-9
        assert min(gaps, default=math.inf) > described.least_off - 2.0 * STEP
    loose = drive(name, least_on=0.0, least_off=0.0)
    free = stepped(rigid(loose), np.repeat([1.5e5, 3e5, 1e5, 2.2e5, 1.9e5], 500))
    assert min(min(stretches(free.coils[:, side])[0]) for side in (0, 1)) < (described.least_on or 0.0)


def test_a_drive_that_is_off_is_as_none() -> None:
    """To the bit, through all that two coils can do."""
    chance = np.random.default_rng(3)
    coils = np.repeat(chance.choice([0.0, 0.3, 1.0], (60, 2)), 10, axis=0)
    off = np.full(600, -1.0)
    with_drive = stepped(rigid(drive("pwm")), off, coils=coils)
    without = stepped(rigid(None), off, coils=coils)
    assert np.array_equal(with_drive.pressure, without.pressure)
    assert np.array_equal(with_drive.mass, without.mass)
    assert np.array_equal(with_drive.coils, coils)


@pytest.mark.parametrize("name", KINDS)
def test_compiled_and_plain_drives_agree(name: str) -> None:
    described, targets = drive(name), np.repeat([1.5e5, -1.0, 1e5], 60)
    compiled = stepped(rigid(described), targets)
    plain = stepped(rigid(described), targets, mode="python")
    assert np.abs(compiled.coils - plain.coils).max() < 1e-9
    assert compiled.pressure == pytest.approx(plain.pressure, rel=1e-9, abs=1e-3)
    assert np.array_equal(compiled.switches, plain.switches)


@pytest.mark.parametrize("mode", ["native", "python"])
def test_a_target_that_is_no_number_is_refused(mode: native.Mode) -> None:
    model = rigid(drive("pwm"))
    with pytest.raises(
        (mujoco.FatalError, native.KernelFailure), match="asked for is not a number in actuator 2"
    ):
        stepped(model, np.array([1e5, np.nan]), mode=mode)


def test_places_are_a_drive_s_own() -> None:
    model = rigid(drive("pwm"))
    assert model.nuserdata == len(slots.CHAMBER_DATA) + len(slots.LEADER_DATA) + len(slots.DRIVE_DATA)
    inlet, outlet = (model.actuator(f"valve_air_{side}").id for side in native.SIDES)
    places = {int(model.actuator_user[v, slots.VALVE_ROW.coil]) - 1 for v in (inlet, outlet)}
    assert places == {model.nuserdata - 2, model.nuserdata - 1}
    assert native.is_driven(model, inlet) and not native.is_driven(rigid(None), 3)
