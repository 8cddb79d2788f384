"""Every parameter of walking is live: changed a little, a named output of a shipped scenario moves.

The parameters are found in the resolved scenario, not listed here: a new one without an entry fails.
Muscles, chambers and cuff are those of sitting, where `test_liveness.py` moves them.
"""

from typing import Any

import pytest
from campaign import sampled
from laws_of_nature.liveness import assert_moves, is_one, nudged, parameters

import afo_sim
from afo_sim.common import InputError
from afo_sim.description import load
from afo_sim.simulation import Recording

SCENARIO = "walk-dropfoot-afo"
# On a floor, with every value told that is optional.
TOLD = {
    "duration": "2.4 s",
    "ground.mode": "contact",
    "patient.plantarflexor_strength": 0.8,
    "patient.body_mass": "70 kg",
    "patient.body_height": "1.70 m",
    "gait.variability": 0.03,
    "gait.seed": 1,
    "gait.pace": [["0.4 s", 1.1], ["1.2 s", 0.9]],
    "gait.pace_change": "0.4 s",
    "gait.sole_thickness": "10 mm",
    "start.dorsiflexor.fill_time": "0.2 s",
    "phases.plantarflexor.inlet": [[0.6, 0.9]],
    "phases.plantarflexor.outlet": [[0.0, 0.4]],
}
# What the foot stands on: the orthosis' own outsole, or the shoe's.
RUNS: dict[str, dict[str, Any]] = {
    "soled": TOLD | {"gait.stride_time": "1.05 s"},
    "shod": TOLD | {"orthosis.outsole": None, "gait.speed": "1.1 m/s"},
}

# Which recorded column must move, by the parameter's key; the first pattern that fits counts.
OUTPUTS = {
    "leg.passive.*": "ankle/moment/passive",
    "leg.body_*": "ankle/moment/passive",
    "leg.toes.stiffness": "toe/extension",
    "leg.toes.damping": "toe/extension",
    "leg.toes.swing_extension": "gait/toe_extension",
    "leg.toes.swing_extension_range": "sole/height_{extended}_extended",
    "leg.*": "ankle/angle",
    "*.heel_stack": "heel/height",
    "*.ball_stack": "ball/height",
    "*.toe_spring": "toe/height",
    "*.tip_ahead": "toe/height",
    "*.heel_behind": "heel/height",
    "*.toe_stiffness": "toe/extension",
    "shoe.*": "gait/needed_moment",
    "patient.*_strength": "ankle/moment/biological",
    "patient.stiffness": "ankle/moment/biological",
    "patient.spasticity": "ankle/moment/biological",
    "patient.*": "ankle/moment/passive",
    "ground.body_*": "shank/sink",
    "ground.*": "ground/force/z",
    "gait.ankle_offset": "gait/ankle_angle",
    "gait.speed": "gait/ankle_angle",
    "gait.sole_thickness": "ankle/position/z",
    "gait.steppage_*": "ankle/position/z",
    "gait.*": "gait/phase",
    "start.*": "chamber/dorsiflexor/pressure",
    "supply.pressure": "chamber/dorsiflexor/pressure",
    "load_moment": "ankle/angle",
    "phases.*": "chamber/{chamber}/pressure",
}
# Changed as a whole, and what of the run must move.
CHOICES = {
    "gait.cycle": ("gatk_stride1", "gait/ankle_angle"),
    "gait.settled": ("walked", "toe_clearance"),
    "ground.mode": ("recorded", "ground/force/z"),
    "reference": ("barefoot", "reference_toe_clearance"),
}
# What has no meaning where toes bend, the gait drives the shank, phases switch the valves, air is let in
# for a time.
REFUSED = {
    "ground.toe_stiffness": "30 N*m/rad",
    "shank.knee_angle": "10 deg",
    "timer": {"period": "1.1 s", "dorsiflexor.inlet": [["0 s", "1 s"]]},
    "start.dorsiflexor.pressure": "2 bar",
}
# What only metrics are made of: key, place in a list, changed value, metric that must move.
HELD: tuple[tuple[str, int | None, str, str], ...] = (
    ("orthosis.interface.shank.area", None, "160 cm^2", "cuff_skin_pressure"),
    ("orthosis.interface.shank.friction", None, "0.6", "cuff_holding_force"),
    ("orthosis.interface.foot.area", None, "70 cm^2", "plate_skin_pressure"),
    ("orthosis.interface.foot.friction", None, "0.12", "plate_holding_force"),
    ("limits.bottle_volume", None, "0.6 l", "strides_per_bottle"),
    ("limits.bottle_pressure", None, "200 bar", "strides_per_bottle"),
    ("limits.skin_pressure", 0, "15 kPa", "cuff_share_of_discomfort"),
    ("limits.skin_pressure", 1, "50 kPa", "cuff_share_of_pain"),
    ("limits.blood_flow_pressure", None, "5 kPa", "cuff_share_of_blood_flow"),
    ("limits.muscle_life", None, "2e6", "strides_until_muscle_life"),
    ("limits.strides_per_day", None, "3000", "days_until_muscle_life"),
)
# Pairs that the verdict is held against: one that everything keeps, and one that nothing does.
JUDGED: dict[str, tuple[str, list[str], list[str]]] = {
    "limits.toe_clearance": ("lift", ["-100 mm", "-100 mm"], ["200 mm", "200 mm"]),
    "limits.contact_pitch": ("heel", ["-45 deg", "-45 deg"], ["45 deg", "45 deg"]),
    "limits.torque_against_push_off": ("push_off", ["10 N*m/kg", "10 N*m/kg"], ["0 N*m/kg", "0 N*m/kg"]),
    "limits.work_against_push_off": ("push_off", ["10 J/kg", "10 J/kg"], ["0 J/kg", "0 J/kg"]),
    "limits.strides_per_bottle": ("air", ["0", "0"], ["1e8", "1e8"]),
}
SITTING = ("orthosis.muscle.*", "orthosis.chamber.*", "orthosis.anchor.*")
# Beside what no run depends on.
LEFT_OUT = (
    "gait.compensation",  # test_compensation.py removes it; this walker has none
    "leg.*_length",  # of a refit, not of a run
    *("leg.directions", "leg.toes.body"),
    "controller",  # none here
    *("worn_on", "ground.slope", "ground.uneven", "ground.seed"),  # of the responding walker: tests/walker
    *("limits.drawn_trips", "orthosis.outsole"),
    *(*SITTING, *REFUSED, *CHOICES, *(key for key, *_ in HELD), *JUDGED),
)


def told() -> dict[str, Any]:
    """Every value of the scenario by its dotted key, in either sole; lists stay whole."""
    soled, shod = (parameters(SCENARIO, sets, LEFT_OUT) for sets in RUNS.values())
    return shod | soled


def cases() -> list[Any]:
    """Key, place in a list, and changed value; of a list, every entry in its turn."""
    found = []
    for key, value in told().items():
        if key.startswith("phases."):
            changed = [(0, [[a + 0.02, b - 0.02] for a, b in value])]
        elif key == "gait.pace":  # every time, then every factor
            changed = [(0, [[nudged(a), b] for a, b in value]), (1, [[a, nudged(b)] for a, b in value])]
        elif isinstance(value, list):
            changed = [
                (place, [nudged(x) if k == place else x for k, x in enumerate(value)])
                for place in range(len(value))
            ]
        else:
            changed = [(0, nudged(value))]
        found += [pytest.param(key, place, new, id=f"{key}-{place}") for place, new in changed]
    return found


def output(key: str, place: int) -> str:
    """The column that a parameter moves."""
    pattern = is_one(key, OUTPUTS)
    assert pattern is not None, f"{key} has no declared output"
    parts = key.split(".")
    return OUTPUTS[pattern].format(chamber=parts[1:2] and parts[1], extended=("less", "more")[place])


@pytest.fixture(scope="module")
def base() -> dict[str, Recording]:
    return {name: afo_sim.run(SCENARIO, sets) for name, sets in RUNS.items()}


@pytest.mark.slow
@pytest.mark.parametrize(("key", "place", "changed"), sampled(cases(), 20))
def test_parameter_moves_its_output(key: str, place: int, changed: Any, base: dict[str, Recording]) -> None:
    run = "soled" if key.startswith(("orthosis.outsole.", "gait.stride_time")) else "shod"
    assert_moves(base[run], afo_sim.run(SCENARIO, RUNS[run] | {key: changed}), output(key, place), 1e-6, key)


@pytest.mark.slow
@pytest.mark.parametrize("key", CHOICES)
def test_choice_moves_its_output(key: str) -> None:
    sets = {"duration": "2.4 s", "start.dorsiflexor.fill_time": "0.2 s"}
    other, name = CHOICES[key]
    if "/" in name:  # row by row
        sets |= {"gait.settled": "walked"}
    before, after = (afo_sim.run(SCENARIO, sets | more) for more in ({}, {key: other}))
    if "/" in name:
        assert_moves(before, after, name, 1e-3, key)
    else:
        assert abs(after.metrics[name].value - before.metrics[name].value) > 0.01


SLIPPERY = {"duration": "3 s", "orthosis.interface.foot.friction": 0.1}  # so that the plate needs its strap


@pytest.fixture(scope="module")
def slippery() -> Recording:
    return afo_sim.run(SCENARIO, SLIPPERY)


@pytest.mark.slow
@pytest.mark.parametrize(("key", "place", "changed", "metric"), HELD)
def test_what_metrics_are_held_against_moves_them(
    key: str, place: int | None, changed: str, metric: str, slippery: Recording
) -> None:
    value: Any = changed if " " in changed else float(changed)
    at = key if place is None else f"{key}[{place}]"
    after = afo_sim.run(SCENARIO, SLIPPERY | {at: value})
    before = slippery.metrics[metric].value
    assert before > 0.0
    assert abs(after.metrics[metric].value - before) > 0.01 * before, f"{at} does not move {metric}"


@pytest.mark.slow
@pytest.mark.parametrize("key", JUDGED)
def test_a_limit_decides_the_verdict(key: str) -> None:
    name, kept, missed = JUDGED[key]
    others = {k: pair[1] for k, pair in JUDGED.items() if pair[0] == name}
    told = []
    for pair in (kept, missed):
        sets = {k: [v if " " in v else float(v) for v in p] for k, p in (others | {key: pair}).items()}
        run = afo_sim.run(SCENARIO, {"duration": "3 s"} | sets)
        told += [answer.status for answer in run.verdict if answer.name == name]
    assert told == ["good", "bad"]


@pytest.mark.parametrize("key", REFUSED)
def test_what_has_no_meaning_here_is_refused(key: str) -> None:
    with pytest.raises(InputError):
        load("scenario", SCENARIO, TOLD | {key: REFUSED[key]})


@pytest.mark.slow
def test_pressure_before_the_first_step_acts() -> None:
    sets = {k: v for k, v in TOLD.items() if not k.startswith("start.")}
    low, high = (
        afo_sim.run(SCENARIO, sets | {"start": {"dorsiflexor": {"pressure": pressure}}})
        for pressure in ("2 bar", "2.1 bar")
    )
    column = "chamber/dorsiflexor/pressure"
    assert high[column][0] - low[column][0] == pytest.approx(1e4, rel=0.01)


def test_every_parameter_is_found() -> None:
    keys = set(told())
    for expected in (
        "leg.toes.damping",
        "leg.body_height",
        "orthosis.outsole.toe_spring",
        "shoe.centre",
        "patient.passive_offset",
        "patient.body_mass",
        "ground.body_damping",
        "gait.seed",
        "gait.sole_thickness",
        "start.dorsiflexor.fill_time",
        "supply.pressure",
        "phases.plantarflexor.inlet",
    ):
        assert expected in keys
    assert len(keys) > 45
    assert all(output(key, 0) for key in keys)
