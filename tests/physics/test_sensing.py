"""The sensors' kernel against computations of its own: filters, statistics, exact delays."""

import itertools
import math

import numpy as np
import pytest

from afo_sim.native import compiled_sense
from afo_sim.physics import sensing as s

TIMESTEP = 0.001
RNG = np.random.default_rng(7)


def ideal(**parameters: float) -> np.ndarray:
    """Parameters of a sensor that changes nothing, but for those given by name."""
    row = np.zeros(s.N_PARAMETER)
    row[[s.GAIN, s.SHARE, s.SLOPE, s.TAKEN_SLOPE]] = 1.0
    row[[s.LOW, s.OUT_LOW]], row[[s.HIGH, s.OUT_HIGH]] = -np.inf, np.inf
    for name, value in parameters.items():
        row[getattr(s, name)] = value
    return row


def read(row: np.ndarray, values: np.ndarray, cuts: tuple[int, ...] = (), plain: bool = False) -> np.ndarray:
    """Readings of one sensor (n,), fed in stretches between cuts."""
    memory, line = np.full(s.N_MEMORY, np.nan), np.full(max(int(row[s.DELAY]), 1), np.nan)
    readings = []
    for begin, end in itertools.pairwise((0, *cuts, len(values))):
        part = np.ascontiguousarray(values[begin:end], float)
        reading, output = np.empty_like(part), np.empty_like(part)
        arrays = (row, memory, line, part, reading, output)
        counts = (1, len(part), len(part), begin, TIMESTEP)
        if plain:
            s.sense(*arrays, *counts)
        else:
            compiled_sense()[0](*(array.ctypes.data for array in arrays), *counts)
        readings.append(reading)
    return np.concatenate(readings)


WAVE = np.sin(np.arange(400) * 0.03) + 0.3 * RNG.normal(size=400)


def line(slope: float, intercept: float) -> dict[str, float]:
    """A calibration line, which is taken for true."""
    return {"SLOPE": slope, "INTERCEPT": intercept, "TAKEN_SLOPE": slope, "TAKEN_INTERCEPT": intercept}


@pytest.mark.parametrize(
    ("parameters", "expected"),
    [
        ({}, WAVE),
        ({"GAIN": 1.5, "OFFSET": 0.25, "DRIFT": 2.0}, 1.5 * WAVE + 0.25 + 2.0 * TIMESTEP * np.arange(400)),
        ({"LOW": -0.5, "HIGH": 0.7}, np.clip(WAVE, -0.5, 0.7)),
        (line(2.0, 1.0) | {"OUT_LOW": 0.0, "OUT_HIGH": 2.0}, np.clip(WAVE, -0.5, 0.5)),
        (line(4.0, 0.3) | {"OUT_STEP": 0.1}, (np.floor((4.0 * WAVE + 0.3) / 0.1 + 0.5) * 0.1 - 0.3) / 4.0),
        (line(2.5, 0.1) | {"SLOPE": 2.0, "INTERCEPT": 0.5}, (2.0 * WAVE + 0.5 - 0.1) / 2.5),
    ],
    ids=["ideal", "gain, offset, drift", "range", "range of output", "converter", "another one's line"],
)
def test_a_wave_reads_by_its_formula(parameters: dict[str, float], expected: np.ndarray) -> None:
    found = read(ideal(**parameters), WAVE)
    assert found == pytest.approx(expected, abs=1e-12)
    if parameters.keys() <= {"LOW", "HIGH"}:
        assert (found == expected).all()


def test_lowpass_is_the_filter_of_scipy() -> None:
    from scipy.signal import lfilter

    share = 1.0 - math.exp(-2.0 * math.pi * 20.0 * TIMESTEP)
    # y[k] = (1 − a) y[k−1] + a x[k], at rest at the first value
    expected, _ = lfilter([share], [1.0, share - 1.0], WAVE, zi=[(1.0 - share) * WAVE[0]])
    assert read(ideal(SHARE=share), WAVE) == pytest.approx(expected, abs=1e-14)


def test_lowpass_has_its_corner_where_it_is_asked_for() -> None:
    time = np.arange(4000) * TIMESTEP
    reading = read(
        ideal(SHARE=-math.expm1(-2.0 * math.pi * 5.0 * TIMESTEP)), np.sin(2.0 * np.pi * 5.0 * time)
    )
    assert reading[2000:].max() == pytest.approx(1.0 / math.sqrt(2.0), rel=0.01)


def test_noise_is_white_and_normal() -> None:
    from scipy.stats import kstest

    noise = read(ideal(NOISE=2.0, SEED=3.0, NUMBER=5.0), np.zeros(40000)) / 2.0
    n = len(noise)
    assert abs(noise.mean()) < 4.0 / math.sqrt(n)
    assert abs(noise.std() - 1.0) < 4.0 / math.sqrt(2.0 * n)
    assert kstest(noise, "norm").pvalue > 1e-3
    for lag in (1, 2, 3, 16, 256):  # correlation of white noise: 0 ± 1/√n
        assert abs(np.mean(noise[lag:] * noise[:-lag])) < 4.5 / math.sqrt(n)
        assert abs(np.mean(noise[lag:] ** 2 * noise[:-lag] ** 2) - 1.0) < 4.5 * math.sqrt(8.0 / n)


@pytest.mark.parametrize("other", [{"SEED": 4.0}, {"NUMBER": 6.0}])
def test_other_seed_or_sensor_has_other_noise(other: dict[str, float]) -> None:
    zeros, usual = np.zeros(20000), {"NOISE": 1.0, "SEED": 3.0, "NUMBER": 5.0}
    one, again, another = (read(ideal(**w), zeros) for w in (usual, usual, usual | other))
    assert (one == again).all()
    assert not (one == another).any()
    for lag in range(8):
        assert abs(np.mean(one[lag:] * another[: len(another) - lag])) < 4.5 / math.sqrt(len(one))


def test_readings_do_not_depend_on_how_a_run_is_cut_nor_on_the_compiler() -> None:
    row = ideal(
        GAIN=1.1, OFFSET=0.2, DRIFT=0.3, PLAY=0.2, SHARE=0.3, RATE=300.0, NOISE=0.1, OUT_NOISE=0.01, LOW=-1.0,
        HIGH=1.2, SLOPE=2.0, INTERCEPT=0.5, OUT_STEP=0.01, TAKEN_SLOPE=2.1, TAKEN_INTERCEPT=0.4, STEP=0.003,
        DELAY=7, SEED=11.0, NUMBER=4e9,
    )  # fmt: skip
    whole = read(row, WAVE)
    assert (whole == read(row, WAVE, (1, 3, 17, 18, 200))).all()
    assert (whole == read(row, WAVE, tuple(range(1, 400)))).all()
    assert (whole == read(row, WAVE, plain=True)).all()


@pytest.mark.parametrize("delay", [1, 2, 13])
def test_delay_is_exact(delay: int) -> None:
    reading = read(ideal(DELAY=delay), WAVE, (5, 9))
    assert (reading[delay:] == WAVE[:-delay]).all()
    assert (reading[:delay] == WAVE[0]).all()


def test_delayed_sensors_keep_lines_of_their_own() -> None:
    """Three of them, fed in two stretches."""
    delays, values = (3, 0, 5), np.array([WAVE, 2.0 * WAVE, 3.0 * WAVE])
    rows = np.concatenate([ideal(DELAY=delays[k], LINE=line) for k, line in enumerate((0, 3, 3))])
    memory, line, readings = np.full(3 * s.N_MEMORY, np.nan), np.full(8, np.nan), []
    for begin, end in ((0, 150), (150, 400)):
        part, reading = np.ascontiguousarray(values[:, begin:end]).ravel(), np.empty(3 * (end - begin))
        s.sense(
            rows, memory, line, part, reading, reading.copy(), 3, end - begin, end - begin, begin, TIMESTEP
        )
        readings.append(reading.reshape(3, -1))
    for true, found, delay in zip(values, np.hstack(readings), delays, strict=True):
        assert (found[delay:] == true[: 400 - delay]).all() and (found[:delay] == true[0]).all()


@pytest.mark.parametrize("rate", [100.0, 333.0, 60.6])
def test_samples_are_held(rate: float) -> None:
    reading = read(ideal(RATE=rate), WAVE)
    due = np.ceil(np.arange(400) / rate / TIMESTEP - 1e-6).astype(int)  # first step at or after k/rate
    due = due[due < len(WAVE)]
    expected = WAVE[due[np.searchsorted(due, np.arange(len(WAVE)), side="right") - 1]]
    assert (reading == expected).all()


def test_noise_is_new_at_each_sample_only() -> None:
    reading = read(ideal(RATE=100.0, NOISE=1.0), np.zeros(1000))
    assert len(np.unique(reading)) == 100


def test_resolution_errs_by_half_a_step_at_most() -> None:
    reading = read(ideal(STEP=0.05), WAVE)
    assert np.abs(reading - WAVE).max() <= 0.025 * (1.0 + 1e-9)
    assert reading / 0.05 == pytest.approx(np.round(reading / 0.05), abs=1e-9)
    # the error of a busy signal is spread evenly over a step: standard deviation step/√12
    assert np.std(reading - WAVE) == pytest.approx(0.05 / math.sqrt(12.0), rel=0.1)


def test_noise_does_not_leave_the_range() -> None:
    assert read(ideal(NOISE=1.0, LOW=-0.5, HIGH=0.5), np.zeros(1000)).max() == 0.5


def test_inverse_line_goes_both_ways() -> None:
    distance = np.linspace(0.04, 0.3, 50)
    row = ideal(SLOPE=0.1, INTERCEPT=0.05, TAKEN_SLOPE=0.1, TAKEN_INTERCEPT=0.05, INVERSE=1.0, OUT_STEP=0.01)
    error = np.abs(read(row, distance) - distance)
    # a step in V is dx = x²/slope dV: coarse far off, fine near by
    assert (error <= 0.005 * 1.1 * distance**2 / 0.1).all()
    assert error[-10:].max() > 10.0 * error[:10].max()


def test_play_lags_behind_by_half_its_width() -> None:
    time = np.arange(4000) * TIMESTEP
    values = np.sin(2.0 * np.pi * time)
    reading = read(ideal(PLAY=0.2), values)[1000:]
    rising, falling = np.gradient(values[1000:]) > 0.0, np.gradient(values[1000:]) < 0.0
    middle = np.abs(values[1000:]) < 0.5  # past the turning points
    assert (reading - values[1000:])[rising & middle] == pytest.approx(-0.1, abs=1e-12)
    assert (reading - values[1000:])[falling & middle] == pytest.approx(0.1, abs=1e-12)


def test_switch_has_two_thresholds() -> None:
    up_and_down = np.concatenate([np.linspace(0.0, 10.0, 1001), np.linspace(10.0, 0.0, 1001)])
    reading = read(ideal(SWITCH=1.0, THRESHOLD=5.0, HYSTERESIS=2.0), up_and_down)
    on, off = np.flatnonzero(np.diff(reading)) + 1
    assert set(reading) == {0.0, 1.0}
    assert up_and_down[on] == pytest.approx(6.0, abs=0.011)
    assert up_and_down[off] == pytest.approx(4.0, abs=0.011)


def test_debounce_waits_and_overlooks_what_is_short() -> None:
    values = np.zeros(100)
    values[20:23] = 1.0  # shorter than the debounce
    values[50:] = 1.0
    reading = read(ideal(SWITCH=1.0, THRESHOLD=0.5, DEBOUNCE=5), values, (22, 52))
    assert np.flatnonzero(np.diff(reading)).tolist() == [54]  # 5 steps after it went over at 50


@pytest.mark.parametrize("more", [{}, {"SHARE": 0.2}, {"PLAY": 0.1}, {"STEP": 0.1}, {"SWITCH": 1.0}])
def test_no_number_reads_as_no_number_and_is_forgotten(more: dict[str, float]) -> None:
    values = WAVE.copy()
    values[100:110] = np.nan
    reading = read(ideal(**more), values)
    assert (np.isnan(reading) == np.isnan(values)).all()
