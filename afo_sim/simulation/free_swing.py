"""Each swing once more without a floor: how high the foot passes, or how far below the floor it would.

A floor catches a foot that hangs, and hides what it lacks. So a swing is walked a second time, from the
walk's state where the recorded force has ended to the next heel strike, with the same inputs. The foot is
never put back on the floor: under one that is 26 mm deep it would push with more than the body's weight.
"""

from typing import TYPE_CHECKING

import numpy as np

from afo_sim import native
from afo_sim.gait import LATE_SWING, STANCE_SHARE
from afo_sim.model import JOINTS, PADS, get_state
from afo_sim.simulation.rollout import STATE
from afo_sim.simulation.stepping import Rows, stepper_of

if TYPE_CHECKING:
    from afo_sim.model import Built

AWAY = -1.0  # height of a floor that no foot meets [m]


def free_swing(built: "Built", rows: Rows, control: np.ndarray, first_step: int) -> np.ndarray:
    """`qpos` of aligned rows (n, nq), with the swings as they are without a floor; NaN where one fails."""
    found, forward = rows["qpos"], built.index.joints[JOINTS[0]][0]
    alike: dict[bytes, list[slice]] = {}  # the rows of a settled stride stand there twice
    for swing in _swings(built, first_step, len(found)):
        if _touched(built, rows, first_step, swing):  # else there is nothing to take away
            begun = np.delete(rows["qpos"][swing.start], forward), rows["act"][swing.start]
            alike.setdefault(np.concatenate(begun).tobytes(), []).append(swing)
    if not alike:
        return found
    found = found.copy()
    walked = _walked(built, rows, control, [swings[0] for swings in alike.values()])
    for qpos, swings in zip(walked, alike.values(), strict=True):
        for swing in swings:
            found[swing][1:] = qpos[: swing.stop - swing.start - 1]
            found[swing, forward] = rows["qpos"][swing, forward]
    return found


def _walked(built: "Built", rows: Rows, control: np.ndarray, swings: list[slice]) -> np.ndarray:
    """`qpos` after each step of some swings, side by side (n_swing, n, nq)."""
    model, index, mode = built.model, built.index.walking, built.scenario.callback
    longest = max(swing.stop - swing.start for swing in swings)
    inputs = np.stack([np.resize(control[swing], (longest, model.nu)) for swing in swings])
    inputs[:, :, [index[name] for name in PADS if name in index]] = AWAY
    states, qpos = [], np.empty((len(swings), longest, model.nq))
    for swing in swings:  # from which their first rows were stepped
        data = native.scratch(model)
        for name in STATE[1:]:
            getattr(data, name)[:] = rows[name][swing.start]
        data.time = rows["time"][swing.start, 0]
        states.append(get_state(model, data))
    with native.installed(mode), native.without_clock():
        stepper = stepper_of([model] * len(swings), states, mode)
        for stopped in stepper.advance(range(len(swings)), inputs, {"qpos": qpos}):
            qpos[stopped] = np.nan
    return qpos


def _swings(built: "Built", first_step: int, n: int) -> list[slice]:
    """Rows from where nothing recorded presses any more to the next heel strike."""
    assert built.walk is not None and built.contact is not None
    steps = slice(first_step, first_step + n)
    phase = built.walk.phase[1:-1][steps]
    stride = np.floor(phase)
    pressed = built.contact.load[steps].any(axis=1) & (phase - stride < LATE_SWING)
    swings = []
    for number in np.unique(stride):
        of = np.flatnonzero(stride == number)
        down = np.flatnonzero(pressed[of])
        start = int(of[0]) + (int(down[-1]) + 1 if len(down) else 0)
        if start <= of[-1] and phase[start] - number > STANCE_SHARE[0]:
            swings.append(slice(start, int(of[-1]) + 1))
    return swings


def _touched(built: "Built", rows: Rows, first_step: int, swing: slice) -> bool:
    """Whether the floor carries anything in a swing, but the heel that comes down to it at the end."""
    assert built.walk is not None
    index = built.index.walking
    force = rows["actuator_force"][swing][:, [index[name] for name in PADS if name in index]]
    landing = built.walk.phase[1:-1][first_step:][swing] % 1.0 >= LATE_SWING
    return bool(force[:, 1:].any() or force[~landing, 0].any())
