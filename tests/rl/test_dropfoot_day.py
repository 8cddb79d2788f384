"""Days of patients: the reward by hand and beside the verdict, sensors, patients by number, resets."""

from typing import Any

import numpy as np
import pytest
from campaign import size

import afo_sim as afo
from afo_sim.common import InputError
from afo_sim.description import load
from afo_sim.model.build import build
from afo_sim.rl import TASKS
from afo_sim.rl.environments.day import passing
from afo_sim.rl.environments.day_episodes import DaySetting
from afo_sim.rl.environments.episodes import FIELDS, Episodes
from afo_sim.rl.environments.patients import POOLS, USUAL, patient
from afo_sim.rl.environments.reward import PARTS, WEIGHTS, Events, Strides, badness, scale_of
from afo_sim.rl.environments.tasks import setting_of
from afo_sim.simulation import Stepped, formulas, frame_of

ONE = np.zeros(1, int)


@pytest.fixture(scope="module")
def made() -> DaySetting:
    found = setting_of("dropfoot_day", patients=[0, 5, 1003])
    assert isinstance(found, DaySetting)
    return found


def event(**facts: float) -> Events:
    usual = {"height": 1.0, "pitch": 1.0}
    return Events(*(np.array([facts.get(name, usual.get(name, 0.0))]) for name in Events._fields))


def paid(*events: Events) -> dict[str, float]:
    """Parts of a stride in which the verdict's limits are the usual ones."""
    strides = Strides(1)
    strides.begin(ONE, scale_of(load("scenario", "walk-dropfoot-afo"))[None], event())
    return dict(zip(PARTS, sum(strides.pay(ONE, each) for each in events)[:, 0], strict=True))


def test_each_part_is_the_verdicts_question_between_its_limits() -> None:
    lifted = paid(event(passing=1, height=0.02), event(passing=1, height=0.004), event(height=-1.0))
    assert lifted["lift"] == pytest.approx(0.5 * 0.4)  # 4 of 10 mm, the lowest while it passes
    assert paid(event(stride=1, pitch=np.radians(3.2)))["heel"] == pytest.approx(0.5 * 0.5)  # of −1.6 to 8°
    torque = paid(event(pushing=1, torque=0.105), event())
    assert torque["push_off"] == pytest.approx(-0.5 * 0.5)  # of 0.07 to 0.14 N·m/kg
    work = paid(event(pushing=1, angle=0.3), event(pushing=1, angle=0.0, torque=0.08), event())
    assert work["push_off"] == pytest.approx(-0.5 * (0.08 * 0.3 - 0.016) / 0.016)  # the worse of both
    helping = paid(event(pushing=1, angle=0.3), event(pushing=1, torque=-1.0), event())
    assert helping["push_off"] == 0.0
    many = paid(event(switched=5), event(switched=6), event(stride=1))
    assert many["switching"] == pytest.approx(-0.1 * 0.5)  # 11 of 2 to 20
    bottle = 300.0 * 1e5 * 0.5e-3 / (287.0 * 293.0 * 1.104)  # of an ideal gas over its compressibility [kg]
    assert paid(event(air=bottle / 1333.0), event(stride=1))["air"] == pytest.approx(-0.25, abs=0.02)
    assert sum(WEIGHTS[name] for name in ("lift", "heel")) == 1.0


def test_lift_and_push_off_are_what_the_metrics_say() -> None:
    """The lowest of ball and toes as the foot passes is the clearance of the settled stride."""
    sets = {"timestep": "2 ms", "reference": None, "supply.pressure": "3 bar"}
    run, built = afo.run("walk-dropfoot-afo", sets), build("walk-dropfoot-afo", sets)
    first, last = passing(built.walk.cycle)
    there = (run["gait/stride"] == run["gait/stride"].max() - 1) & (run["gait/phase"] >= first)
    there &= run["gait/phase"] < last
    height = np.minimum(run["ball/height"], run["toe/height"])[there].min()
    assert 1e3 * height == pytest.approx(run.metrics["toe_clearance"].value, abs=0.02)


def test_what_is_seen_is_a_runs_columns(made: DaySetting) -> None:
    day, steps = made.start_of(5), made.steps
    stepped = Stepped([day.built], fields=FIELDS)
    inputs = day.inputs[:2500].copy()
    inputs[300:1200, made.valves[0]] = 1.0
    rows = {name: values[0].copy() for name, values in stepped.advance([0], inputs[None]).items()}
    stepped.close()
    frame, columns, view = frame_of(day.built, rows, inputs, 0), formulas(day.built), made.view(1)
    noiseless = np.zeros((len(day.table), 6))
    view.begin(ONE, [(day, noiseless)])
    seen, events = [], []
    for k in range(steps - 1, 2500, steps):
        row = {name: values[k][:, None] for name, values in rows.items()}
        seen.append(view.see(ONE, row, np.zeros((1, 4)))[0][0])
        events.append([float(each[0]) for each in view.events(ONE, row, ONE)])
    at, late = np.arange(steps - 1, 2500, steps), day.sensors.delay
    height, pitch, torque = np.array(events).T[4:7]
    column = {name: columns[name](frame)[at] for name in ("ball/height", "toe/height", "sole/pitch")}
    np.testing.assert_allclose(height, np.minimum(column["ball/height"], column["toe/height"]), atol=1e-12)
    np.testing.assert_allclose(pitch, column["sole/pitch"], atol=1e-12)
    moment = columns["ankle/moment/orthosis"](frame)[at]
    np.testing.assert_allclose(torque * day.built.body_mass, moment, atol=1e-9)
    for k, name in ((0, "shank/angle"), (1, "shank/velocity"), (4, "chamber/dorsiflexor/pressure")):
        expected = columns[name](frame)[at][:-late] + day.sensors.offset[k]
        np.testing.assert_allclose(np.array(seen)[late:, k], expected, rtol=1e-12, atol=1e-9)
    pressed = columns["foot/heel_load"](frame)[at][:-late]
    sure = (pressed > 40.0) | (pressed < 20.0)
    assert (np.array(seen)[late:, 2] == (pressed > 30.0))[sure].all() and sure.mean() > 0.9


def test_a_patient_is_the_same_by_number_and_no_pool_holds_another_pools(made: DaySetting) -> None:
    again, other = patient(7), patient(8)
    assert again[0] == patient(7)[0] and again[0] != other[0]
    assert not set(POOLS["training"]) & set(POOLS["held-out"])
    assert (
        made.start_of(5).sensors.delay >= 1
        and made.start_of(USUAL).built.body_mass != made.start_of(5).built.body_mass
    )


def test_one_that_begins_again_is_another_patient_and_the_others_go_on(made: DaySetting) -> None:
    """Simulation 1 is taken to a new episode while 0 walks: both have the numbers of who is alone."""
    actions = np.random.default_rng(4).uniform(-1.0, 1.0, (160, 1, 2))
    draws = [(made.start_of(k), np.zeros((len(made.start_of(k).table), 6))) for k in (0, 5, 1003)]

    def alone(which: int, steps: np.ndarray) -> list[np.ndarray]:
        episodes = Episodes(made)
        found = [episodes.begin_drawn([0], [draws[which]])]
        found += [episodes.step([0], action).observation for action in steps]
        episodes.close()
        return found

    together = Episodes(made, 2)
    found = [together.begin_drawn([0, 1], draws[:2])]
    found += [together.step([0, 1], np.repeat(action, 2, axis=0)).observation for action in actions[:80]]
    began = together.begin_drawn([1], [draws[2]])
    found += [together.step([0, 1], np.repeat(action, 2, axis=0)).observation for action in actions[80:]]
    together.close()
    np.testing.assert_array_equal([one[0] for one in found], np.array(alone(0, actions))[:, 0])
    later = alone(2, actions[80:])
    np.testing.assert_array_equal([began[0], *(one[1] for one in found[81:])], np.array(later)[:, 0])


def test_shut_valves_do_not_lift_and_filled_muscles_hinder(made: DaySetting) -> None:
    numbers = [0, *POOLS["held-out"][: size(1, 8)]] * 2  # shut, and filled
    n, days = len(numbers), [made.start_of(number) for number in numbers]
    episodes, total = Episodes(made, n), np.zeros((len(PARTS), n))
    episodes.begin_drawn(range(n), [(day, np.zeros((len(day.table), 6))) for day in days])
    action = np.stack([np.repeat([0.0, 1.0], n // 2), -np.ones(n)], axis=1)
    for _ in range(made.task.periods):
        outcome = episodes.step(range(n), action)
        total += np.array(list(outcome.parts.values()))
    episodes.close()
    assert outcome.over.all()
    total /= np.array([day.strikes for day in days])
    shut, filled = total[:, : n // 2], total[:, n // 2 :]
    lift, push_off, air = (PARTS.index(name) for name in ("lift", "push_off", "air"))
    assert (shut[lift] < 0.1).all() and not shut[[push_off, air]].any()
    assert (filled[lift] > 0.4).all() and (filled[push_off] < -0.3).all()
    assert (filled.sum(axis=0) < 0.7).all() and (filled[lift] <= 0.5).all()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"sets": {"gait.pace": [["1 s", 0.0]]}}, "gait.pace"),
        ({"sets": {"phases": None, "controller": {"rate": "100 Hz", "toe_load": {}}}}, "controller"),
        ({"sets": {"drive": {"dorsiflexor": {"kind": "bang_bang"}}}}, "drive"),
        ({"sets": {"ground.mode": "contact"}}, "recorded"),
        ({"patients": "train"}, "held-out"),
        ({"patients": []}, "patients"),
        ({"patients": [0, -2]}, "patients"),
    ],
)
def test_what_no_day_can_be_of_is_refused(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        setting_of("dropfoot_day", **arguments)


def test_tasks_without_patients_draw_none() -> None:
    for name in set(TASKS) - {"dropfoot_day"}:
        with pytest.raises(InputError, match="patients"):
            setting_of(name, patients="training")


def test_equal_limits_have_the_whole_price_beyond_and_none_below() -> None:
    """Of a bottle that is not above the supply's 4 bar any air is too much, as the verdict says."""
    sets = {"limits.bottle_pressure": "4 bar", "limits.toe_clearance": ["5 mm"] * 2}
    sets |= {"limits.work_against_push_off": ["0 J/kg"] * 2}
    toe, _, _, *others = scale_of(load("scenario", "walk-dropfoot-afo", sets))
    assert badness(np.array([0.005 - 1e-6, 0.005, 0.006]), toe).tolist() == [1.0, 0.0, 0.0]
    assert [badness(np.array([0.0, 1e-6]), pair).tolist() for pair in others] == [[0.0, 1.0]] * 2


def test_badness_falls_and_rises() -> None:
    assert badness(np.array([-1.0, 0.0, 5.0, 10.0]), (10.0, 0.0)).tolist() == [1.0, 1.0, 0.5, 0.0]
    assert badness(np.array([1.0, 3.0, 4.0]), (2.0, 4.0)).tolist() == [0.0, 0.5, 1.0]
