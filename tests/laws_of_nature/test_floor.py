"""The foot on its registered floor, and its swing without one, against separate differential equations.

The errors go with the time step: those at 0.25 ms are a quarter of those at 1 ms.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from laws_of_nature.floor_reference import LATE, PHASE, STANDS, Walker
from laws_of_nature.toe_reference import GRAVITY

import afo_sim
from afo_sim.gait import GaitCycle
from afo_sim.simulation import Recording

ANGLE, HEIGHT = 0.02, 0.3e-3  # RMS [deg], anywhere [m]
FINE = {"timestep": "0.1 ms", "duration": "3 s"}  # of what is given to the equations
FAST, BEGUN = 0.75, 0.1  # quantile of the ankle's speed, share of the swing from which on toes may trip
KEPT, WALKED = 1e-6, 1e-3  # of the ground's moment: at the samples; between them, of its greatest [N·m/kg]


def walk(name: str, sets: dict[str, object] | None = None) -> Recording:
    """A run whose last stride is the settled one."""
    run = afo_sim.run(afo_sim.load("scenario", name).set({"reference": None} | (sets or {})))
    assert run.ok
    return run


@dataclass(frozen=True, eq=False)
class Solved:
    """A settled stride and its swing once more without a floor: states at the times of PHASE."""

    name: str
    walker: Walker
    stride: np.ndarray
    swing: np.ndarray

    @property
    def swings(self) -> np.ndarray:
        """Phases of the swing (n,)."""
        return PHASE[-self.swing.shape[1] :]

    def error(self, run: Recording, column: str, values: np.ndarray) -> np.ndarray:
        """Of a run's last stride, or of its swing where the values are of it (n,)."""
        last = run["gait/stride"] == run["gait/stride"].max()
        phase = PHASE[-len(values) :]
        within = last & (run["gait/phase"] >= phase[0])
        return run[column][within] - np.interp(run["gait/phase"][within], phase, values)

    def turns(self, run: Recording) -> dict[str, np.ndarray]:
        """Errors of the ankle and the toes in the stride [deg] (n,)."""
        states = {"ankle/angle": self.stride[2], "toe/extension": self.stride[4]}
        return {name: np.degrees(self.error(run, name, values)) for name, values in states.items()}

    def clearance(self) -> float:
        """Lowest local minimum of the sole without a floor, while the foot passes fast [m]."""
        walk, height = self.walker.walk, self.walker.heights(self.swing)["sole"]
        stands = (walk.force()[1] > STANDS) & (PHASE < LATE)
        off = PHASE[np.flatnonzero(stands)[-1]]
        speed, lean = walk.at("way", PHASE)[1], walk.at("lean", self.swings)[0]
        passes = (speed >= np.quantile(speed, FAST))[-len(height) :] & (lean > 0.0)
        passes &= self.swings >= off + BEGUN * (1.0 - off)
        turns = (height[1:-1] < height[:-2]) & (height[1:-1] <= height[2:]) & passes[1:-1]
        return float(height[1:-1][turns].min())


@pytest.fixture(scope="module", params=["walk-dropfoot", "walk-healthy"])
def solved(request: pytest.FixtureRequest) -> Solved:
    described = afo_sim.load("scenario", request.param)
    walker = Walker.of(afo_sim.build(described.set(FINE)))
    stride = walker.settled()
    off = np.searchsorted(PHASE * walker.walk.time, walker.off)
    return Solved(request.param, walker, stride, walker.walked(stride[:, off], walker.off, floored=False))


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.slow
def test_foot_toes_and_sole_walk_as_solved(solved: Solved) -> None:
    run, swing = walk(solved.name), solved.swing.shape[1]
    for error in solved.turns(run).values():
        assert rms(error) < ANGLE
        assert rms(error[-round(len(error) * swing / len(PHASE)) :]) < ANGLE
    for name, height in solved.walker.heights(solved.stride).items():
        if name in ("heel", "ball", "sole"):
            assert np.abs(solved.error(run, f"{name}/height", height)).max() < HEIGHT
    assert np.abs(solved.error(run, "shank/sink", solved.stride[0])).max() < HEIGHT


@pytest.mark.slow
def test_the_swing_without_a_floor_is_as_solved(solved: Solved) -> None:
    run, height = walk(solved.name), solved.walker.heights(solved.swing)["sole"]
    assert np.abs(solved.error(run, "sole/height_without_floor", height)).max() < HEIGHT
    assert float(run.metrics["toe_clearance"]) == pytest.approx(1e3 * solved.clearance(), abs=1e3 * HEIGHT)


@pytest.mark.slow
def test_errors_go_with_the_time_step(solved: Solved) -> None:
    coarse, fine = (solved.turns(walk(solved.name, {"timestep": step})) for step in ("1 ms", "0.25 ms"))
    for name, error in fine.items():
        assert np.abs(error).max() < 0.35 * np.abs(coarse[name]).max()
    assert np.abs(fine["ankle/angle"]).max() < ANGLE


@pytest.mark.slow
def test_only_a_healthy_foot_walks_as_recorded_on_the_registered_floor(solved: Solved) -> None:
    """In the separate equations: floor, support and flexors are registered as the program's are."""
    apart = np.degrees(np.abs(solved.stride[2] - solved.walker.walk.at("ankle", PHASE)[0]).max())
    sunk = np.abs(solved.stride[0]).max()
    if solved.name == "walk-healthy":
        assert apart < 1e-3 and sunk < 1e-6
    else:
        assert apart > 5.0 and sunk > 1e-3


def test_a_swing_that_touches_nothing_is_the_same_without_a_floor(monkeypatch: pytest.MonkeyPatch) -> None:
    """Walked a second time though it need not be."""
    monkeypatch.setattr("afo_sim.simulation.free_swing._touched", lambda *_: True)
    run = walk("walk-healthy")
    aloft = (run["gait/phase"] > 0.635) & (run["ground/force/z"] == 0.0)
    assert aloft.sum() > 2 * 300
    for point in ("ball", "toe", "sole"):
        free = run[f"{point}/height_without_floor"]
        assert free[aloft] == pytest.approx(run[f"{point}/height"][aloft], abs=1e-9)


def test_the_swing_without_a_floor_goes_on_from_the_walk() -> None:
    """In its shoe the drop foot leaves the floor before the recorded one, and comes back to it in swing."""
    run = walk("walk-dropfoot", {"shoe": "trainer"})
    last = run["gait/stride"] == run["gait/stride"].max()
    apart = np.abs(run["sole/height_without_floor"] - run["sole/height"])[last]
    off = np.flatnonzero((run["gait/phase"][last] > 0.635) & (run["ground/force/z"][last] == 0.0))[0]
    touched = off + np.flatnonzero(run["ground/force/z"][last][off:])[0]
    assert apart[: touched + 1].max() < 1e-9
    assert touched - off > 100
    assert apart.max() > 0.01


def test_pads_and_leg_carry_what_was_recorded() -> None:
    """On average over a stride: what a weak foot presses less than the recorded one hangs on its leg."""
    found = []
    for name in ("walk-healthy", "walk-dropfoot"):
        run = walk(name)
        last = run["gait/stride"] == run["gait/stride"].max()
        found.append([run[c][last].mean() for c in ("ground/force/z", "gait/ground_force_z", "shank/sink")])
    (healthy, recorded, high), (weak, _, low) = found
    assert healthy == pytest.approx(recorded, rel=0.01)
    model = afo_sim.build("walk-healthy").model
    spring = float(model.jnt_stiffness[model.joint("sink").id])
    assert weak - healthy == pytest.approx(spring * (low - high), abs=1e-3 * recorded)


def moment(cycle: GaitCycle) -> np.ndarray:
    """Of the recorded force about the ankle where it stands, per body mass [N·m/kg] (n,)."""
    on = (cycle.grf_z > STANDS) & np.isfinite(cycle.cop_x)
    return GRAVITY * (cycle.cop_x * cycle.grf_z + cycle.ankle_z * cycle.grf_x)[on]


def test_laid_on_the_floor_the_force_keeps_its_moment() -> None:
    scenario = afo_sim.load("scenario", "walk-healthy")
    laid, left = (afo_sim.build(scenario.set({"ground.mode": m})).walk for m in ("contact", "recorded"))
    assert laid.laid > 0.01 and left.laid == 0.0
    assert moment(laid.cycle) == pytest.approx(moment(left.cycle), abs=KEPT)
    # a run has the ankle's height by its harmonics, and straight lines between samples
    walked = GRAVITY * (laid.ground_lever - left.ground_lever)
    assert np.abs(walked).max() < WALKED * np.abs(moment(left.cycle)).max()
