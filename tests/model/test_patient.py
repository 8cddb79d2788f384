"""The lag of the patient's stiffness: closed forms, an independent integration, no trace of the step."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from afo_sim import load
from afo_sim.model.build import build
from afo_sim.model.muscle_weakness import FALL, RISE, activated, crossings

MILD = {"patient": "drop-foot-mild", "duration": "3 s"}


def after(time: np.ndarray, switch: float, before: float, level: float, lag: float) -> np.ndarray:
    """Step response of a critically damped second order, 1 − (1 + t/τ) e^(−t/τ)."""
    ago = np.maximum(time - switch, 0.0) / lag
    return level + (before - level) * (1.0 + ago) * np.exp(-ago)


@pytest.mark.parametrize("step", [3e-3, 1e-3, 1e-4])
@pytest.mark.parametrize(("before", "level", "lag"), [(0.25, 1.0, RISE), (1.0, 0.25, FALL)])
def test_it_rises_as_a_twitch_and_never_jumps(step: float, before: float, level: float, lag: float) -> None:
    time = np.arange(0.0, 0.3, step)
    given = activated(time, np.array([0.0104]), np.array([before, level]))
    assert given == pytest.approx(after(time, 0.0104, before, level, lag), abs=1e-13)


def test_what_does_not_change_is_given_at_once() -> None:
    time = np.arange(50) * 1e-3
    assert np.array_equal(activated(time, np.array([0.01, 0.02]), np.full(3, 0.7)), np.full(50, 0.7))


def test_it_is_the_solution_of_its_equations() -> None:
    """Two lags that rise and fall at different speeds, integrated by another method from switch to switch."""
    switches = np.array([0.004, 0.034, 0.037, 0.052, 0.053, 0.30, 0.301, 0.35])
    levels = np.array([0.3, 1.0, 0.3, 1.0, 0.0, 1.0, 0.0, 0.6, 0.2])
    time = np.arange(0.0, 0.5, 0.7e-3)

    def rates(_: float, y: np.ndarray, target: float) -> list[float]:
        first, second = y
        return [
            (target - first) / (RISE if target > first else FALL),
            (first - second) / (RISE if first > second else FALL),
        ]

    edges, state, found = [0.0, *switches, time[-1] + 1e-9], [0.3, 0.3], np.empty(len(time))
    for begun, end, level in zip(edges[:-1], edges[1:], levels, strict=True):
        inside = (time >= begun) & (time < end)
        solved = solve_ivp(
            rates, (begun, end), state, t_eval=np.append(time[inside], end), args=(level,),
            method="LSODA", rtol=1e-10, atol=1e-12, max_step=2e-4,
        )  # fmt: skip
        found[inside], state = solved.y[1][:-1], solved.y[:, -1]
    assert activated(time, switches, levels) == pytest.approx(found, abs=1e-7)


def test_sides_change_where_the_moment_is_zero() -> None:
    phase = np.arange(1000) / 1000
    moment = np.sin(2.0 * np.pi * (phase - 0.2345))
    assert crossings(moment) == pytest.approx([0.2345, 0.7345], abs=1e-6)
    assert len(crossings(moment - 2.0)) == 0


@pytest.mark.parametrize(
    "sets",
    [
        {},
        {"gait.variability": 0.08, "gait.seed": 3},
        {"gait.start_phase": 0.7, "gait.stride_time": "0.9 s"},
        {"patient": "plantarflexor-weak"},
    ],
)
def test_half_the_step_moves_nothing_at_the_same_instants(sets: dict[str, object]) -> None:
    """Stiffness at 3, 6, 9, … ms, by steps of 3, 1.5, 1 and 0.25 ms, as shares of its range."""
    found = []
    for step in (3.0, 1.5, 1.0, 0.25):
        built = build(load("scenario", "walk-dropfoot", MILD | {"timestep": f"{step} ms"} | sets))
        found.append(built.active.stiffness[:: round(3.0 / step)][:990])
    for coarse in found[:-1]:
        assert np.abs(coarse - found[-1]).max() < 1e-4 * np.ptp(found[-1])


def test_sides_are_those_of_the_recorded_walking() -> None:
    """Mean over the last stride of what is left: each side's strength for its share of the stride."""
    built = build(load("scenario", "walk-dropfoot", MILD | {"timestep": "0.5 ms"}))
    healthy = build(load("scenario", "walk-dropfoot", MILD | {"patient": "healthy", "timestep": "0.5 ms"}))
    strength = built.active.stiffness / healthy.active.stiffness
    assert strength.min() >= 0.3 - 1e-12
    assert strength.max() <= 1.0 + 1e-12
    phase = built.walk.phase[1:-1] % 1.0
    last = built.walk.phase[1:-1] > 1.2
    push_off, swing = last & (np.abs(phase - 0.5) < 0.02), last & (np.abs(phase - 0.75) < 0.02)
    assert strength[push_off].min() > 0.95  # calf muscles since mid-stance, at full strength
    assert strength[swing].max() < 0.31  # dorsiflexors, which have 30 % left
