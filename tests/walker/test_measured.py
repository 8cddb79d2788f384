"""A walk made of formulas: its numbers by hand, and what they are beside measured ones."""

import csv
import math
import pathlib
import tomllib
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from afo_sim.common import GRAVITY
from afo_sim.physics import LEG_MUSCLES
from afo_sim.walker import Cost, Walked, contacts, measured, norm_at, numbers

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
    level = SimpleNamespace(ground=None)
    body: Any = SimpleNamespace(
        weight=MASS * GRAVITY, size=SimpleNamespace(taller=1.0), model=model, scenario=level
    )
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


def cut(whole: Walked, first: int, last: int, fell: float | None = None) -> Walked:
    """Some rows of a walk."""
    return Walked(whole.body, {name: values[first:last] for name, values in whole.columns.items()}, fell)


def test_a_record_that_begins_within_a_stance_has_the_same_strides() -> None:
    """Two rows after the right foot's touch, before its reflexes stand."""
    whole = walked()
    later = cut(whole, 32, 865)  # its last row is within a stance too
    for side, begun in (("right", 0), ("left", 53)):  # as far as what is recorded of that stance
        found, shifted = contacts(whole, side), contacts(later, side)
        assert shifted[0] == begun and (shifted[1:] == found[-len(shifted) + 1 :] - 32).all()
        assert (np.diff(found) == 110).all() and found[0] == {"right": 30, "left": 85}[side]
    assert numbers(later) == pytest.approx(numbers(whole) | {"duration": 8.64}, rel=1e-9, nan_ok=True)


def test_the_cost_of_a_walk_by_hand() -> None:
    """Seven whole strides after the first second, each part by its definition."""
    whole, x = walked(100, speed=SPEED), np.arange(0.0, 1.0, 0.01)
    for side in ("right", "left"):
        whole.columns[f"{side}/load"] = 1.5 * whole[f"{side}/load"]  # type: ignore[index]
    load = np.where(x < 0.6, 1.5 * (0.1 + 1.1 * np.sin(math.pi * x / 0.6)), 0.0)
    knee = math.radians(4.0) - 0.5 + 0.5 * np.cos(2.0 * math.pi * x)
    energy = 2 * len(LEG_MUSCLES) * 10.0 * 8.0  # 8 s
    expected = {
        "fall": 150.0 * (1.0 - 8.0 / 20.0),
        "speed": 300.0 * (SPEED - 1.0 - 0.02),
        "effort": 0.5 * energy / (MASS * 8.0 * SPEED),
        "activation": 20.0 * 0.5**3 * (1.0 + 3.0 * 0.5**2 / 2.0),
        "force": 200.0 * np.maximum(load - 1.25, 0.0).mean(),
        "knee": 250.0 * np.maximum(knee, 0.0).mean(),
        "lean": 300.0 * (0.13 - 0.09),
    }
    found, later = Cost(1.0).of(cut(whole, 0, 801, 8.0), 20.0), Cost(1.0).of(cut(whole, 0, 801), 20.0)
    assert found == pytest.approx(expected, rel=5e-3)
    assert later["fall"] == 0.0 and Cost(1.4).of(cut(whole, 0, 801), 20.0)["speed"] == pytest.approx(54.0)
    assert Cost(1.21).of(cut(whole, 0, 801), 20.0)["speed"] == 0.0  # as near as 0.02 m/s
    still = cut(walked(100, speed=0.01), 0, 801)
    assert Cost(1.0).of(still, 20.0)["effort"] == pytest.approx(0.5 * energy / MASS)  # as over a metre
    early = Cost(1.0, likeness=40.0).of(cut(whole, 0, 151, 1.5), 20.0)  # no strides: each is 3 bounds away
    assert early["likeness"] == pytest.approx(40.0 * (3.0**2 + 12.0 * 2.2**2))


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


WEEKS = 0.05  # by how much faster a wearer walks who has adapted to what is worn [m/s]


@dataclass(frozen=True)
class Formula:
    """A wearer whose walks are formulas of pressure and spring; `moment` is their device's [N·m/kg] a bar.

    Their cost has a least at the stiffness `best`, from which it rises by `steep`.
    """

    moment: float = 0.02
    strength: Any = field(default_factory=lambda: {"soleus": 1.0, "tibialis": 0.5})
    best: float = 0.0  # [N·m/deg]
    steep: float = 0.0  # [1/(N·m/deg)]
    gaits: Any = field(default_factory=lambda: {"nothing": 0, "device": 1})

    def walk(self, sets: Any = None, spring: float = 0.0, *, weeks: bool = False) -> Walked:
        bar, worn = float((sets or {}).get("supply.pressure", "0 bar").split()[0]), sets is not None
        lifted, less = math.radians(2.0 * bar + 3.0 * spring), 1.0 - 0.05 * bar - 0.1 * spring
        torque = self.moment * MASS * bar / 0.99  # x ends at 0.99
        faster = SPEED + 0.1 * worn + 0.02 * spring + WEEKS * weeks
        cost = 3.0 * (1.0 + self.steep * abs(spring - self.best))
        power = (cost * faster - 1.51) * MASS / (2 * len(LEG_MUSCLES))
        return walked(ankle=lifted, tibialis=0.5 * less, torque=torque, speed=faster, power=power)

    def body(self, sets: Any = None) -> int:
        """The falls of its starts by its own gait."""
        return 3 - 2 * (sets is not None) if self.strength["tibialis"] else 8 - 7 * (sets is not None)


def people(*who: Formula) -> Any:
    return {name: [*who, *who] for name in ("healthy", "drop foot", "weak plantarflexors")}


def test_a_dorsiflexor_is_compared_at_the_published_moment() -> None:
    """0.83 and 1.29 of the norm's peak at 0.02 N·m/kg a bar; 2° more and 5 % less a bar."""
    found: dict[str, Any] = dict(measured.kao_ferris(people(Formula())))
    bars = np.array([0.83, 1.29]) * -float(norm_at(1.25)["moment"].min()) / 0.02
    assert (bars > 1.0).all() and (bars < 5.0).all()
    for name, each in (("swing", 2.0), ("burst", -5.0), ("swing_burst", -5.0)):
        assert found[f"dorsiflexor_{name}"] == pytest.approx(np.tile(each * bars, (2, 1)))


def test_a_moment_that_no_pressure_gives_tells_nothing() -> None:
    own = next(own for _, own in measured.kao_ferris(people(Formula(moment=0.2))))
    row = measured.beside("dorsiflexor_swing", own)
    assert np.isnan(own).all() and math.isnan(row.simulated) and row.verdict == "cannot tell"


def test_springs_and_lifts_are_compared_within_each_wearer(monkeypatch: pytest.MonkeyPatch) -> None:
    """After weeks where people had weeks; falls are those of who has no tibialis, by the adapted gaits."""
    fallen = lambda body, gait, starts: SimpleNamespace(count=body + gait)  # noqa: E731
    monkeypatch.setattr(measured, "falls_of", fallen)
    found: dict[str, Any] = dict([*measured.leaves(people(Formula())), *measured.lifted(people(Formula()))])
    leaves, thirty = np.tile([0.58, 1.46, 3.66], 2), np.full(2, math.radians(30.0))  # 30 N·m/rad
    expected = {
        "leaf_healthy": -10.0 * leaves,
        "leaf_drop_foot": -10.0 * leaves,
        "leaf_loading": 3.0 * thirty,
        "leaf_speed": 0.02 * thirty + WEEKS,
        "elastic_soleus": np.full(2, -10.0 * 0.873),  # 50 N·m/rad
        "elastic_moment": np.zeros(2),
        "lifting_speed": np.full(2, 0.1 + WEEKS),
        "lifting_falls": np.full(2, -75.0),
    }
    assert found.keys() == expected.keys()
    for name, own in expected.items():
        assert found[name] == pytest.approx(own, abs=1e-3)


def test_springs_on_weak_plantarflexors_by_hand() -> None:
    """Slopes as covariance over variance: 3° a N·m/deg, and the power of 50 N·m at 2 rad/s and a spring."""
    found = {name: own for name, own, *_ in measured.springs(people(Formula()))}
    stiffness, x = np.radians([0.0, 60.0, 120.0, 240.0]), np.arange(0.35, 0.7, 0.01)
    late = np.where((x >= 0.4) & (x < 0.7 - 1e-9), 100.0 * np.sin(math.pi * (x - 0.4) / 0.3), -50.0)
    peaks = []
    for k in stiffness:
        ankle, rate = 0.2 * np.sin(2.0 * math.pi * x), 0.2 * 2.0 * math.pi / 1.1 * np.cos(2.0 * math.pi * x)
        peaks.append(np.max(late - math.degrees(k) * (ankle + math.radians(3.0 * k)) * rate) / MASS)
    for name, each in (("dorsiflexion", 3.0 * stiffness), ("power", peaks)):
        together = np.cov(stiffness, each)
        assert found[f"spring_{name}"] == pytest.approx(np.full(2, together[0, 1] / together[0, 0]), rel=0.02)


@pytest.mark.parametrize(
    ("rising", "steep", "verdict"),
    [(-1, 0.5, "sign agrees"), (1, 0.5, "disagrees"), (-1, 0.005, "cannot tell"), (0, 0.5, "cannot tell")],
)
def test_the_best_spring_is_told_beyond_chance_and_scatter(rising: int, steep: float, verdict: str) -> None:
    """Published: stiffer with less left. A cost that differs by less than two searches do tells nothing."""
    best = np.radians([0.0, 60.0, 120.0, 240.0])[[0, 1, 2, 3][:: rising or 1]]
    best = best if rising else best[[1, 3, 0, 2]]  # no rank by what is left
    weak = [Formula(strength={"soleus": 0.4 + 0.1 * k, "tibialis": 1.0}, best=b, steep=steep)
            for k, b in enumerate(best)]  # fmt: skip
    *_, (name, own, sure) = measured.springs(people(*weak))
    assert measured.beside(name, own, sure).verdict == verdict
    assert own == pytest.approx([float(rising)])


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
        ("plantarflexor_cost", [-9.0, -9.0], "sign agrees"),
    ],
)
def test_a_verdict_follows_its_rule(name: str, own: list[float], verdict: str) -> None:
    row = measured.beside(name, own)
    known = [each for each in own if not math.isnan(each)]
    assert (row.verdict, row.between) == (verdict, (min(known), max(known)))


def test_wearers_walk_by_the_gaits_that_they_have_adapted_to() -> None:
    """Of 20 patients each by its number: shares within the condition's, gaits as the file has them."""
    shown = {"drop-foot": measured.SCENARIO, "plantarflexor-weak": "walk-dropfoot"}
    for name, muscle, low, high in (
        ("drop-foot", "tibialis", 0.0, 0.3),
        ("plantarflexor-weak", "soleus", 0.85 * 0.4, 0.8),
    ):
        found = measured.wearers(name, shown[name])
        shares = [wearer.strength[muscle] for wearer in found]
        assert len(set(shares)) == 20 and low <= min(shares) <= max(shares) <= high
        text = (ROOT / "models" / "populations" / f"{name}.csv").read_text().splitlines()
        for row in csv.DictReader(line for line in text if not line.startswith("#")):
            worn = row["worn"].partition(" in ")[0]
            own = found[int(row["patient"]) - 1].gaits["device" if worn.startswith("s1 ") else worn]
            assert own.speed == float(row["gait speed"])
    sprung, bare = found[0].walk(spring=math.radians(240.0), weeks=True), found[0].walk()
    assert (sprung.fell, bare.fell) == (None, None)
    assert numbers(sprung)["right/ankle_stance_max"] < numbers(bare)["right/ankle_stance_max"] - 5.0


def test_pushed_wearers_are_those_of_the_walks_that_are_kept() -> None:
    """Costs anew from the file: at the best published onset, at the pressure of most power, over no air."""
    told, shown = (
        tomllib.loads((ROOT / "models" / f"responses{name}.toml").read_text()) for name in ("_adapted", "")
    )
    with (ROOT / "models" / "validation" / "adapted_wearers.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if not row["fell"]]
    cost = {(row["wearer"], row["onset"], row["bar"]): float(row["cost_of_transport"]) for row in rows}
    power = {key: float(row["push_power"]) for key, row in zip(cost, rows, strict=True)}
    each = []
    for who, onset, bar in cost:
        if onset == "0":
            most = max((key for key in cost if key[:2] == (who, "42")), key=power.__getitem__)
            each.append(100.0 * (cost[most] / cost[who, onset, bar] - 1.0))
    assert told["plantarflexor_cost"] == pytest.approx(each, abs=0.05)
    assert told.keys() <= shown.keys()
