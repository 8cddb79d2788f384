"""A walk made of formulas: its numbers by hand, and what they are beside measured ones."""

import csv
import math
import pathlib
import tomllib
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from afo_sim.common import GRAVITY
from afo_sim.physics import LEG_MUSCLES
from afo_sim.walker import Walked, measured, norm_at, numbers

MASS, SPEED, HEIGHT = 80.0, 1.2, (0.03, 0.03, -0.02, 0.03)  # HEIGHT: of the foot in mid-swing, by stride [m]
ROOT = pathlib.Path(__file__).parents[2]
DROP = 0.006  # of the sole from heel to ball [m]


def walked(rows: int = 110, **changed: float) -> Walked:
    """Eight strides of rows of 10 ms, the right one from row 30; reflexes stand 50 ms after the touch."""
    of = {"ankle": 0.0, "tibialis": 0.5, "power": 10.0, "torque": 10.0, "speed": SPEED} | changed
    n = np.arange(30 + 8 * rows)
    columns: dict[str, Any] = {
        "time": 0.01 * n,
        "trunk/pitch": np.full(len(n), 0.1),
        "trunk/forward": of["speed"] * 0.01 * n,
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
            columns |= {
                "device/torque": of["torque"] * x,
                "dorsiflexor/mass": 9e-5 * (1.0 - np.abs(2.0 * x - 1.0)),
            }
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


class Formula:
    """A wearer whose walks are formulas of pressure and spring; `moment` is their device's [N·m/kg] a bar."""

    gait: Any = None

    def __init__(self, moment: float = 0.02):
        self.moment = moment

    def walk(self, sets: Any = None, spring: float = 0.0) -> Walked:
        bar, worn = float((sets or {}).get("supply.pressure", "0 bar").split()[0]), sets is not None
        lifted, less = math.radians(2.0 * bar + 3.0 * spring), 1.0 - 0.05 * bar - 0.1 * spring
        torque, faster = self.moment * MASS * bar / 0.99, SPEED + 0.1 * worn + 0.02 * spring  # x ends at 0.99
        return walked(ankle=lifted, tibialis=0.5 * less, torque=torque, speed=faster)

    def body(self, sets: Any = None) -> int:
        """The falls of its starts."""
        return 8 if sets is None else 2


def people(wearer: Formula) -> Any:
    return {who: [wearer, wearer] for who in ("healthy", "drop foot", "no dorsiflexors")}


def test_a_dorsiflexor_is_compared_at_the_published_moment() -> None:
    """0.83 and 1.29 of the norm's peak at 0.02 N·m/kg a bar; 2° more and 5 % less a bar."""
    found = dict(measured.kao_ferris(people(Formula())))
    bars = np.array([0.83, 1.29]) * -float(norm_at(1.25)["moment"].min()) / 0.02
    assert (bars > 1.0).all() and (bars < 5.0).all()
    for name, each in (("swing", 2.0), ("burst", -5.0), ("swing_burst", -5.0)):
        assert found[f"dorsiflexor_{name}"] == pytest.approx(np.tile(each * bars, (2, 1)))


def test_a_moment_that_no_pressure_gives_tells_nothing() -> None:
    own = dict(measured.kao_ferris(people(Formula(moment=0.2))))["dorsiflexor_swing"]
    row = measured.beside("dorsiflexor_swing", own)
    assert np.isnan(own).all() and math.isnan(row.simulated) and row.verdict == "cannot tell"


def test_springs_and_lifts_are_compared_within_each_wearer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measured, "falls_of", lambda body, gait, starts: SimpleNamespace(count=body))
    found = dict(measured.leaves(people(Formula()))) | dict(measured.lifted(people(Formula())))
    leaves = np.tile([0.58, 1.46, 3.66], 2)
    expected = {
        "leaf_healthy": -10.0 * leaves,
        "leaf_drop_foot": -10.0 * leaves,
        "leaf_loading": 3.0 * leaves,
        "leaf_speed": 0.02 * leaves,
        "elastic_soleus": np.full(2, -10.0 * 0.873),  # 50 N·m/rad
        "elastic_moment": np.zeros(2),
        "lifting_speed": np.full(2, 0.1),
        "lifting_falls": np.full(2, -75.0),
    }
    assert found.keys() == expected.keys()
    for name, own in expected.items():
        assert found[name] == pytest.approx(own, abs=1e-3)


@pytest.mark.parametrize(
    ("name", "own", "verdict"),
    [
        ("leaf_loading", [2.8, 5.0, 8.2], "agrees"),  # published 5.5, 2.7 to 8.3
        ("leaf_loading", [7.0, 9.0, 9.0], "sign agrees"),
        ("leaf_loading", [-5.0, -5.0, -5.0], "disagrees"),
        ("leaf_loading", [5.0, 5.0, 5.0, -1.0], "cannot tell"),
        ("leaf_loading", [5.0, 5.0, math.nan], "cannot tell"),
        ("leaf_loading", [5.0] * 4 + [math.nan], "agrees"),
        ("leaf_speed", [0.14, 0.14], "sign agrees"),  # without a published spread
        ("dorsiflexor_swing_burst", [-3.0, -3.0], "disagrees"),  # published: none
        ("plantarflexor_cost", [-9.0, -9.0], "sign agrees"),  # below what is claimed of a cost
    ],
)
def test_a_verdict_follows_its_rule(name: str, own: list[float], verdict: str) -> None:
    row = measured.beside(name, own)
    known = [each for each in own if not math.isnan(each)]
    assert (row.verdict, row.between) == (verdict, (min(known), max(known)))


def test_drawn_people_are_whole_or_have_the_stated_share() -> None:
    found = measured.drawn_people(3)
    shares = {who: [wearer.strength["tibialis"] for wearer in of] for who, of in found.items()}
    assert shares == {
        "healthy": [1.0, 1.0, 1.0],
        "drop foot": pytest.approx([0.2, 0.4, 0.6]),
        "no dorsiflexors": pytest.approx([0.0, 0.05, 0.1]),
    }
    assert len({wearer.scenario.patient.body_height for wearer in found["healthy"]}) == 3  # type: ignore[union-attr]


def test_adapted_responses_are_those_of_the_walks_that_are_kept() -> None:
    """Slopes anew as covariance over variance, over the measured stiffnesses, from 2.8 to 6.6 N·m/deg."""
    told, shown = (
        tomllib.loads((ROOT / "models" / f"responses{name}.toml").read_text()) for name in ("_adapted", "")
    )
    with (ROOT / "models" / "validation" / "adapted_wearers.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["study"] == "stiffness" and not row["fell"]]
    for name, column in (("spring_dorsiflexion", "most_dorsiflexion"), ("spring_power", "peak_power")):
        points: dict[tuple[str, str], list[tuple[float, float]]] = {}
        for row in rows:
            if float(row["setting"]) > 2.0:
                points.setdefault((row["wearer"], row["left"]), []).append(
                    (float(row["setting"]), float(row[column]))
                )
        each = [np.cov(np.transpose(of)) for of in points.values() if len(of) > 1]
        assert sorted(told[name]) == pytest.approx(sorted(c[0, 1] / c[0, 0] for c in each), abs=1e-4)
    assert told.keys() == dict(measured.adapted({})).keys() <= shown.keys()
