"""A walk made of formulas: its numbers by hand, and what they are beside measured ones."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from afo_sim.common import GRAVITY
from afo_sim.physics import LEG_MUSCLES
from afo_sim.walker import Walked, measured, numbers

MASS, SPEED, HEIGHT = 80.0, 1.2, (0.03, 0.03, -0.02, 0.03)  # HEIGHT: of the foot in mid-swing, by stride [m]
DROP = 0.006  # of the sole from heel to ball [m]


def walked(rows: int = 110, **changed: float) -> Walked:
    """Eight strides of rows of 10 ms, the right one from row 30; reflexes stand 50 ms after the touch."""
    of = {"ankle": 0.0, "tibialis": 0.5, "power": 10.0} | changed
    n = np.arange(30 + 8 * rows)
    columns: dict[str, Any] = {
        "time": 0.01 * n,
        "trunk/pitch": np.full(len(n), 0.1),
        "trunk/forward": SPEED * 0.01 * n,
    }
    for side, first in (("right", 30), ("left", 30 - rows // 2)):
        x, wave = ((n - first) % rows) / rows, 2.0 * math.pi * ((n - first) % rows) / rows
        late = (x >= 0.4) & (x < 0.7)
        columns |= {
            f"{side}/load": np.where(x < 0.6, MASS * GRAVITY * (0.1 + 1.1 * np.sin(math.pi * x / 0.6)), 0.0),
            f"{side}/phase": np.where(
                (0.01 * rows * x < 0.045) | (x > 0.3) | (np.abs(x - 0.2) < 0.004), 1, 0
            ),
            f"{side}/hip": 0.3 * np.sin(wave),
            f"{side}/knee": -0.5 + 0.5 * np.cos(wave),
            f"{side}/ankle": 0.2 * np.sin(wave) + of["ankle"],
            f"{side}/ankle_moment": np.full(len(n), -50.0),
            f"{side}/ankle_velocity": np.where(late, -2.0 * np.sin(math.pi * (x - 0.4) / 0.3), 1.0),
            f"{side}/toe_clearance": x,
            f"{side}/forefoot_clearance": np.take(HEIGHT, (n - first) // rows % 4)
            + np.where(np.abs(x - 0.8) < 0.13, np.abs(x - 0.8), -0.1),
            f"{side}/foot": SPEED * 0.01 * n + 0.2 * np.sin(wave - 1.6 * math.pi),
        }
        for name in LEG_MUSCLES:
            columns[f"{side}/{name}/activation"] = of["tibialis"] * (1.0 + 0.5 * np.cos(wave))
            columns[f"{side}/{name}/energy"] = of["power"] * 0.01 * n
        if side == "right":
            columns |= {"device/torque": 10.0 * x, "dorsiflexor/mass": 9e-5 * (1.0 - np.abs(2.0 * x - 1.0))}
    sole = {"sole_heel": np.array([-0.06, 0.0, -0.1]), "sole_ball": np.array([0.12, 0.0, -0.1 + DROP])}
    model = SimpleNamespace(site=lambda name: SimpleNamespace(pos=sole[name.removeprefix("left_")]))
    body: Any = SimpleNamespace(weight=MASS * GRAVITY, size=SimpleNamespace(taller=1.0), model=model)
    return Walked(body, columns, None)


def test_numbers_of_a_walk_by_hand() -> None:
    """Eight touches, of which the first two and what follows the last are not counted: five strides."""
    found = numbers(walked())
    power = 2 * len(LEG_MUSCLES) * 10.0 / MASS
    swing = np.degrees(0.2 * np.mean(np.sin(2.0 * math.pi * np.arange(0.75, 0.895, 0.01))))
    middle = np.arange(0.24, 0.365, 0.01)  # fifth of a stance of 60 %
    assert found == pytest.approx(
        found
        | {
            "strides": 5.0,
            "speed": SPEED,
            "stride_time": 1.1,
            "stride_length": 1.1 * SPEED,
            "muscle_power": power,
            "cost_of_transport": (power + 1.51) / SPEED,  # with what Wang et al. 2012 give for standing
            "air_per_stride": 9e-5,
            "device_torque_swing": 7.95,
            "trunk_forward": -math.degrees(0.1),
        }
        | {
            f"{side}/{name}": value
            for side in ("right", "left")
            for name, value in {
                "thigh_max": math.degrees(0.4),
                "thigh_min": math.degrees(-0.2),
                "knee_max": math.degrees(1.0),
                "ankle_min": math.degrees(-0.2),
                "ankle_swing": swing,
                "ankle_stance_max": math.degrees(0.2),
                "ankle_mid_stance": math.degrees(0.2 * (math.sin(0.72 * math.pi) - math.sin(0.3 * math.pi))),
                "knee_mid_stance": math.degrees(0.5 - 0.5 * np.cos(2.0 * math.pi * middle).mean()),
                "pitch_contact": math.degrees(0.1 + math.atan(DROP / 0.18)),
                "foot_fall": math.nan,  # of a foot that lands flat
                "force_peak": 1.2,
                "force_high": 0.1 + 1.1 * math.sin(0.475 * math.pi),
                "clearance": 0.03,
                "push_off_work": 100.0 / MASS * 1.1 * 0.3 * 2.0 / math.pi,
                "push_off_peak": 100.0 / MASS,
                "moment_peak": 50.0 / MASS,
            }.items()
        },
        rel=3e-3,
        abs=1e-7,
        nan_ok=True,
    )
    assert (found["right/scuffs"], found["left/scuffs"]) == (0.4, 0.2)


def test_a_walk_that_fell_before_its_third_stride_has_no_numbers_of_strides() -> None:
    whole = walked()
    short = {name: values[:200] for name, values in whole.columns.items()}
    found = numbers(Walked(whole.body, short, 1.99))
    assert {name: value for name, value in found.items() if not math.isnan(value)} == {
        "duration": 1.99,
        "fell": 1.0,
        "strides": 0.0,
    }


@pytest.mark.parametrize(("rows", "verdict"), [(110, "agrees"), (150, "disagrees")])
def test_a_step_beside_the_norms(monkeypatch: pytest.MonkeyPatch, rows: int, verdict: str) -> None:
    """Half a stride; and the norm's length times its cadence is the speed that both walk at."""
    monkeypatch.setattr(measured, "_walk", lambda gait: walked(rows))
    found = {row.quantity.partition(": ")[2]: row for row in measured.healthy()}
    length, cadence = found["step length"], found["cadence"]
    assert length.simulated == pytest.approx(0.005 * rows * SPEED)
    assert cadence.simulated == pytest.approx(60.0 / (0.005 * rows))
    assert length.measured * cadence.measured / 60.0 == pytest.approx(SPEED)
    assert (length.verdict, cadence.verdict) == (verdict, verdict)


def test_what_wearers_did_beside_what_the_walker_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """Walks that respond as was measured, but for patients' tibialis: by three times as much."""

    def worn(gait: Any, sets: Any = None, spring: float = 0.0, strength: Any = None) -> Walked:
        if sets is not None:
            return walked(ankle=math.radians(9.0), tibialis=0.5 * 0.72)
        weak = min((strength or {"": 1.0}).values())
        best = 60.0 if weak == 0.8 else 120.0
        return walked(power=10.0 + abs(spring - best), tibialis=0.5 * (0.8 if spring else 1.0))

    monkeypatch.setattr(measured, "_walk", worn)
    rows = [*measured.kao_ferris(), *measured.geboers(), *measured.waterval()]
    assert [round(row.simulated, 6) for row in rows] == [9.0, -28.0, -20.0, -20.0, 1.0]
    assert [row.verdict for row in rows] == [*["agrees"] * 3, "disagrees", "agrees"]
