"""Signs by their names: each appears and disappears at its published or stated bound, the norm shows none."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from afo_sim.description import load
from afo_sim.walker import Case, Response, asked_in_words, in_brief, in_words, norm_at, read_gait
from afo_sim.walker.gait_signs import SIGNS, shown, signs_of
from afo_sim.walker.strides import shape

SPEED = 1.25
DEGREE = np.pi / 180.0
EVGS = 1.5 * 6.0  # a deviation is 1.5 SD or more: Read et al. 2003; 6° between people: Bovi et al. 2011


def norm(speed: float = SPEED) -> dict[str, float]:
    curves = norm_at(speed)
    return shape(curves, float(curves["duration"]))


def changed(pace: float = 1.0, **more: Any) -> dict[str, float]:
    """Numbers of the norm's curves, of which some are lifted [deg]."""
    curves = dict(norm_at(SPEED))
    for name, lift in more.items():
        curves[name] = curves[name] + DEGREE * np.asarray(lift)
    return shape(curves, pace * float(curves["duration"]))


@pytest.mark.parametrize("speed", [0.85, 1.0, 1.25, 1.5, 1.75, 1.95])
def test_the_norm_shows_no_sign(speed: float) -> None:
    assert shown(norm(speed), norm(speed)) == []


# where each sign begins, by number: above (1) or below (-1) of what
N = norm()
BOUNDS: dict[str, dict[str, tuple[int, float]]] = {
    "steppage": {
        "thigh_max": (1, N["thigh_max"] + EVGS),
        "knee_max": (1, N["knee_max"] + EVGS),
        "ankle_swing": (-1, N["ankle_swing"] - EVGS),
    },
    "foot drop": {"ankle_swing": (-1, N["ankle_swing"] - EVGS)},
    "dorsiflexed swing": {"ankle_swing": (1, N["ankle_swing"] + EVGS)},
    "toe drag": {"scuffs": (1, 0.5)},
    "stiff knee": {"knee_max": (-1, 40.0)},  # Chantraine et al. 2022
    "equinus": {"ankle_stance_max": (-1, 0.0)},
    "crouch": {"knee_mid_stance": (1, 19.0)},  # O'Sullivan et al. 2022
    "forefoot contact": {"pitch_contact": (-1, -1.6)},  # Altman & Davis 2012
    "slap": {"foot_fall": (1, 2.0 * N["foot_fall"])},
    "vaulting": {"ankle_mid_stance": (-1, -3.0)},
    "weak push-off": {"push_off_peak": (-1, 0.5 * N["push_off_peak"])},
    "forward lean": {"trunk_forward": (1, 10.0)},
    "backward lean": {"trunk_forward": (-1, -10.0)},
}


@pytest.mark.parametrize("sign", BOUNDS)
def test_a_sign_appears_and_disappears_at_its_bound(sign: str) -> None:
    beyond = {name: limit + 0.01 * way for name, (way, limit) in BOUNDS[sign].items()}
    assert sign in shown(N | beyond, N)
    for name, (way, limit) in BOUNDS[sign].items():  # each of its numbers is needed
        assert sign not in shown(N | beyond | {name: limit - 0.01 * way}, N)
        assert sign not in shown(N | beyond | {name: np.nan}, N)


def test_where_the_forefoot_lands_decides_between_heel_flat_and_forefoot() -> None:
    contacts = {8.01: set(), 7.99: {"flat contact"}, -1.59: {"flat contact"}, -1.61: {"forefoot contact"}}
    for pitch, signs in contacts.items():
        assert set(shown(N | {"pitch_contact": pitch}, N)) == signs


@pytest.mark.parametrize(
    ("numbers", "signs"),
    [
        (changed(ankle=-20.0), {"foot drop", "equinus", "forefoot contact"}),
        (changed(ankle=-10.0), {"foot drop", "flat contact"}),
        (changed(ankle=-8.0), set()),  # the heel lands at 8.1°
        (changed(thigh=20.0, knee=20.0), {"high step", "crouch"}),
        (
            changed(thigh=20.0, knee=20.0, ankle=-20.0),
            {"steppage", "foot drop", "equinus", "crouch", "forefoot contact"},
        ),
        (changed(thigh=9.1, knee=8.9), set()),
        (changed(thigh=9.1, knee=9.1), {"high step"}),
        (changed(pace=0.49), {"slap"}),  # the sole falls twice as fast
        (changed(pace=0.51), set()),
    ],
)
def test_curves_off_the_norm_are_called_what_they_are(numbers: dict[str, float], signs: set[str]) -> None:
    assert set(shown(numbers, N)) == signs


def test_half_of_the_power_at_push_off_is_a_weak_one() -> None:
    curves = norm_at(SPEED)
    for share, signs in ((0.49, ["weak push-off"]), (0.51, [])):
        less = dict(curves) | {"power": share * curves["power"]}
        assert shown(shape(less, float(curves["duration"])), N) == signs


def test_a_knee_that_hardly_bends_in_swing_is_stiff_and_one_that_is_held_so_in_stance_is_not() -> None:
    curves = norm_at(SPEED)
    for most, signs in ((39.9, ["stiff knee"]), (40.1, [])):
        held = dict(curves) | {"knee": np.minimum(curves["knee"], most * DEGREE)}
        assert shown(shape(held, float(curves["duration"])), N) == signs


def test_the_fall_of_the_sole_is_that_of_a_straight_line() -> None:
    # from 20° to the floor in a twentieth of a second-and-a-fifth
    curves, duration, flat = dict(norm_at(SPEED)), 1.2, np.linspace(0.0, 1.0, 101)
    pitch = np.maximum(20.0 - 20.0 * flat / 0.05, 0.0) * DEGREE
    curves["ankle"] = pitch - curves["thigh"] + curves["knee"]
    assert shape(curves, duration)["foot_fall"] == pytest.approx(20.0 / (0.05 * duration))
    # a shoe's drop lifts the sole's pitch, and no angle of the ankle
    plain, shod = shape(curves, duration), shape(curves, duration, 3.1)
    assert shod["pitch_contact"] == pytest.approx(plain["pitch_contact"] + 3.1)
    assert shod["ankle_swing"] == plain["ankle_swing"]


def test_a_foot_that_never_leaves_the_floor_has_no_sign_of_stance() -> None:
    drags = dict(norm_at(SPEED)) | {"ankle": np.full(101, -10.0 * DEGREE)}
    assert "equinus" in shown(shape(drags, 1.0), N)
    drags["load"] = np.maximum(drags["load"], 0.06)
    found = shape(drags, 1.0)
    assert np.isnan([found["ankle_stance_max"], found["ankle_mid_stance"], found["knee_mid_stance"]]).all()
    assert not {"equinus", "crouch"} & set(shown(found, N))


def test_an_ankle_that_sinks_in_mid_stance_vaults() -> None:
    risen = N["ankle_mid_stance"]
    assert risen > 0.0  # people's shank leans forward over a foot that stands
    phase = np.linspace(0.0, 1.0, 101)
    for sunk, signs in ((-3.1, ["vaulting"]), (-2.9, [])):
        ramp = (sunk - risen) * np.interp(phase, [0.16, 0.36, 0.45, 0.6], [0.0, 1.0, 1.0, 0.0])
        assert shown(changed(ankle=ramp), N) == signs


def case(
    name: str, right: dict[str, float], left: dict[str, float], speed: float = SPEED, tilt: float = 0.0
) -> Case:
    """The left sole tilts [rad], as of a shoe beside a device; the right one is flat."""
    numbers = {f"right/{key}": x for key, x in right.items()} | {f"left/{key}": x for key, x in left.items()}
    numbers |= {"speed": speed, "fell": float(np.isnan(speed)), "duration": 1.5 if np.isnan(speed) else 20.0}

    def site(name: str) -> SimpleNamespace:
        ahead = 0.2 * name.endswith("ball")
        return SimpleNamespace(pos=(ahead, 0.0, ahead * np.tan(tilt) * name.startswith("left_")))

    body = SimpleNamespace(size=SimpleNamespace(taller=1.0), model=SimpleNamespace(site=site))
    walked = SimpleNamespace(body=body)
    return Case(name, read_gait("natural"), cast(Any, walked), numbers)


def test_the_norm_of_a_leg_stands_on_its_own_sole() -> None:
    numbers = changed(ankle=-10.0)  # beyond 9° of a bare foot's, not of one that a sole tilts by 3°
    found = signs_of(case("device", numbers, numbers, tilt=3.0 * DEGREE)) or []
    assert [each["leg"] for each in found if each["sign"] == "foot drop"] == ["right"]


def test_words_have_the_case_the_leg_and_each_number_beside_the_norm_and_healthy() -> None:
    steps = changed(thigh=9.1, knee=9.1)
    healthy = case("healthy", N, steps)
    patient = case("patient", changed(thigh=20.0, knee=20.0, ankle=-20.0) | {"scuffs": 1.0}, steps)
    lean = case("patient adapted", N, N)
    cast(dict[str, float], lean.numbers)["trunk_forward"] = 12.34
    cases = (healthy, patient, case("device", {}, {}, np.nan), lean)
    asked = {"gait": "natural", "strength": {"tibialis": 0.2, "left_soleus": 0.0}, "starts": 7, "push": 50.0}
    asked |= {"generations": 3, "subset": "swing", "seed": 1, "timestep": 0.0005}
    found = Response(load("scenario", "walk-dropfoot-afo"), {each.name: each for each in cases}, asked)
    told = signs_of(patient)
    assert told is not None and signs_of(case("device", {}, {}, np.nan)) is None
    assert [(each["sign"], each["leg"]) for each in told] == [
        ("steppage", "right"),
        ("foot drop", "right"),
        ("toe drag", "right"),
        ("equinus", "right"),
        ("crouch", "right"),
        ("forefoot contact", "right"),
        ("high step", "left"),
    ]
    assert told[0]["numbers"]["thigh_max"] == {
        "own": pytest.approx(N["thigh_max"] + 20.0),
        "norm": pytest.approx(N["thigh_max"]),
    }
    lines = in_words(found)
    both = [line for line in lines if line.startswith("Patient, not adapted")]
    assert both[0].partition(":")[2].partition(";")[0] == (
        " steppage, foot drop, toe drag, equinus, crouch, forefoot contact"
    )
    for name in ("thigh_max", "ankle_swing"):
        own, healthy_s = told[0]["numbers"][name], healthy.numbers[f"right/{name}"]
        text = f"{own['own']:.1f}° (norm {own['norm']:.1f}, healthy {healthy_s:.1f})".replace("-", "−")
        assert both[0].count(text) == 1  # once, though it makes two signs
    assert "high step (as healthy)" in both[1]
    assert sum(line.startswith("Healthy") for line in lines) == 1 and "as healthy" not in lines[0]
    assert any(line.startswith("With device") and "steppage" not in line for line in lines)
    assert any("trunk: forward lean" in line and "12.3°" in line for line in lines)
    assert "plane" in lines[-2] and "nan" not in " ".join(lines)
    assert in_brief(cases[2])["signs, device's leg"] == "–"  # the wearer fell before there were strides
    assert in_brief(patient)["signs, device's leg"].split(", ") == [
        x["sign"] for x in told if x["leg"] == "right"
    ]
    asked_for = asked_in_words(found)
    assert len(asked_for) == 1 and "tibialis 0.2, left_soleus 0;" in asked_for[0] and "0.5 ms" in asked_for[0]
    assert not set("{}'[]") & set(" ".join(asked_for))


def test_every_number_of_a_sign_has_a_row_of_the_table() -> None:
    from afo_sim.walker.answer import ROWS

    assert {name for rules in SIGNS.values() for name, *_ in rules} <= set(ROWS)
