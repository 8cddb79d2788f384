"""What push-off loses, against a sine; and the parts of swing in which torque is needed."""

import math

import numpy as np
import pytest
from synthetic_walk import MASS, STEP, UPRIGHT, walk_columns, with_orthosis

import afo_sim
from afo_sim.metrics import AGAINST, walk_metrics, words


def values(columns: dict[str, np.ndarray]) -> dict[str, float]:
    found = walk_metrics(columns, STEP, MASS).totals
    return {name: metric.value for name, metric in found.items()}


def test_a_torque_elsewhere_or_the_other_way_is_not_against_push_off() -> None:
    columns = walk_columns()
    phase = columns["gait/phase"]
    for torque in (np.where((phase > 0.4) & (phase < 0.6), -3.0, 3.0), np.full_like(phase, -3.0)):
        found = values(with_orthosis(columns, torque))
        assert found["work_against_push_off"] == pytest.approx(0.0, abs=1e-4)
        assert found["torque_against_push_off"] == pytest.approx(0.0, abs=0.4)  # a row at each end


def test_a_torque_elsewhere_or_the_other_way_gives_nothing_to_push_off() -> None:
    columns = walk_columns()
    phase = columns["gait/phase"]
    for torque in (np.where((phase > 0.4) & (phase < 0.6), 3.0, -3.0), np.full_like(phase, 3.0)):
        found = values(with_orthosis(columns, torque))
        assert found["push_off_work"] == pytest.approx(0.0, abs=1e-4)
        assert found["push_off_torque"] == pytest.approx(0.0, abs=0.4)  # a row at each end
        assert found["share_of_push_off_work"] == pytest.approx(0.0, abs=0.1)


def test_what_the_ankle_loses_is_the_recorded_ones_more() -> None:
    """The recorded sine is 3 degrees lower: less dorsiflexed, more plantarflexed at toe-off."""
    found = values(walk_columns())
    assert found["ankle_range_lost"] == pytest.approx(0.0, abs=1e-9)
    assert found["dorsiflexion_lost"] == pytest.approx(-3.0, abs=1e-9)
    assert found["plantarflexion_at_toe_off"] == pytest.approx(-12.0 * math.sin(1.2 * math.pi), abs=0.05)
    assert found["plantarflexion_lost_at_toe_off"] == pytest.approx(3.0, abs=1e-9)


def test_the_meaning_names_the_limits_and_repeats_none() -> None:
    for name in AGAINST:
        before, limits, _ = words(name).meaning.partition("scenario's limits")
        assert limits and not any(digit in before.rpartition("verdict")[2] for digit in "0123456789")


def test_the_need_is_told_until_the_shank_is_upright_and_after_it() -> None:
    columns = walk_columns()
    phase = columns["gait/phase"]
    late = phase > UPRIGHT + 0.01
    columns["gait/needed_moment"] = np.where(late, 9.0, columns["gait/needed_moment"])
    columns["gait/passive_moment"] = np.where(late, -20.0, columns["gait/passive_moment"])
    found = values(columns)
    assert found["needed_swing_torque"] == 4.0
    assert found["needed_swing_torque_tissue"] == 2.5
    assert found["needed_terminal_swing_torque"] == 9.0
    assert found["needed_terminal_swing_torque_tissue"] == 9.0  # tissue that own strength holds is no need
    assert found["needed_dorsiflexion_torque"] == 9.0


def test_what_filled_plantarflexors_give_is_force_by_arm_over_the_angle() -> None:
    """Of the settled stride, by trapezoids of the muscles' own columns; the lift is that without them."""
    sets = {"reference": None, "duration": "2.5 s", "timestep": "2 ms"}
    both, lift = (afo_sim.run(name, sets) for name in ("walk-dropfoot-afo-both", "walk-dropfoot-afo"))
    last = both["gait/stride"] == both["gait/stride"][both["gait/solved"] > 0.5][-2]
    torque = sum(
        both[f"muscle/{name}/force"] * both[f"muscle/{name}/moment_arm"]
        for name in ("dorsiflexor_1", "dorsiflexor_2", "dorsiflexor_3", "plantarflexor_1", "plantarflexor_2")
    )
    angle, phase, torque = (each[last] for each in (both["ankle/angle"], both["gait/phase"], torque))
    assert phase[0] < 0.01 and phase[-1] > 0.99
    work = 0.5 * np.diff(angle) * (np.minimum(torque, 0.0)[1:] + np.minimum(torque, 0.0)[:-1]) / 68.5
    toe_off = both.metrics["stance"].value / 100.0
    pushing = (phase[1:] > 0.4) & (phase[1:] < toe_off)
    found = {name: metric.value for name, metric in both.metrics.items()}
    assert found["push_off_work"] == pytest.approx(np.maximum(work[pushing], 0.0).sum(), rel=0.02)
    assert found["work_against_dorsiflexion"] == pytest.approx(np.maximum(-work, 0.0).sum(), rel=0.02)
    assert found["push_off_torque"] == pytest.approx(-torque[phase > 0.4].min(), rel=0.02)
    assert found["push_off_work"] > found["work_against_dorsiflexion"] > 0.0
    assert found["toe_clearance"] == pytest.approx(lift.metrics["toe_clearance"].value, abs=0.1)
    assert found["air_per_stride"] > 2.0 * lift.metrics["air_per_stride"].value


def test_loading_response_and_push_off_have_needs_of_their_own() -> None:
    """To 12 % of the stride, and from 40 % to toe-off at 60 %; what is needed between them is in neither."""
    columns = walk_columns()
    phase = columns["gait/phase"]
    parts = [phase < 0.1, (phase > 0.13) & (phase < 0.38), (phase > 0.38) & (phase < 0.39), phase < 0.55]
    needed = np.select([*parts[:3], (phase > 0.41) & parts[3]], [7.0, 20.0, -50.0, -30.0], 0.0)
    columns["gait/needed_moment"] = needed
    found = values(columns)
    assert found["needed_loading_torque"] == pytest.approx(7.0)
    assert found["needed_push_off_torque"] == pytest.approx(30.0)
    assert found["needed_plantarflexion_torque"] == pytest.approx(50.0)
    assert found["needed_swing_torque"] == pytest.approx(0.0, abs=1e-9)
    assert found["needed_dorsiflexion_torque"] == pytest.approx(20.0)
