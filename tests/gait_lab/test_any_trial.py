"""Synthetic truth: a known walker, recorded in any way a laboratory does, comes back to 0.5° and 2 %."""

import dataclasses
import itertools
import pathlib
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from campaign import NIGHTLY, size
from gait_lab.c3d_writer import write_c3d
from gait_lab.gait_truth import BOUNDS, LATERAL_ONLY, ONE_MALLEOLUS, beyond, differences, noise_bounds
from gait_lab.known_walker import Walker
from gait_lab.laboratory import Laboratory
from gait_lab.marker_sets import SETS, STANDING
from gait_lab.osim_writer import write_osim
from gait_lab.trial_files import (
    write_angles,
    write_csv_forces,
    write_csv_markers,
    write_forces,
    write_trc,
    write_trial,
)
from walking import write_table

from afo_sim.common import InputError
from afo_sim.gait_lab import Choices, Imported, import_gait

Case = dict[str, Any]
SIDES = ("right", "left")

FACTORS: dict[str, tuple[Any, ...]] = {
    "markers": tuple(SETS),
    "frame": (
        ("x", "y", 0.0, False),
        ("-x", "z", 0.0, False),
        ("y", "z", 0.0, False),
        ("-z", "y", 0.0, False),
        ("y", "-z", 0.0, False),
        ("z", "x", 0.0, False),
        ("x", "z", 33.0, False),
        ("-x", "y", -58.0, False),
    ),
    "file": ("trc", "csv", "c3d 1", "c3d 2", "c3d 3", "c3d 4", "trc, model 3", "trc, model 4"),
    "plates": ("feet", "steps", "single"),
    "side": ("right", "left"),
    "unit": ("mm", "m", "cm"),
    "ground": ("floor", "belt"),
    "toe_out": (7.0, 0.0, 15.0),
    "standing": (False, True),
    "prefix": ("", "subject:"),
}


def record(folder: pathlib.Path, case: Case) -> tuple[list[pathlib.Path], Laboratory, dict[str, Any]]:
    """A case's files, its laboratory and further choices."""
    walker = dataclasses.replace(Walker(), toe_out=np.radians(case["toe_out"]))
    forward, up, turn, mirrored = case["frame"]
    belt = walker.speed if case["ground"] == "belt" else 0.0
    rate = 100.0 if case["unit"] != "m" else 150.0
    laboratory = Laboratory(
        walker, forward, up, np.radians(turn), mirrored, belt=belt, rate=rate, plate_rate=rate * 5.0
    )
    markers = laboratory.markers(case["markers"], case["prefix"])
    kind = case["plates"]
    if belt and kind != "feet":
        kind = "feet"  # a treadmill has its plates under the belts
    plates = laboratory.plates(kind)
    more: dict[str, Any] = {}
    time, unit = laboratory.time, case["unit"]
    name, _, option = case["file"].partition(" ")
    if name == "c3d":
        files = [write_c3d(folder / "walk.c3d", time, markers, plates, int(option), unit)]
    elif name == "csv":
        files = [write_csv_markers(folder / "walk.csv", time, markers, unit)]
        files.append(write_csv_forces(folder / "plates.csv", plates, unit))
    else:
        files = [
            write_trc(folder / "walk.trc", time, markers, unit),
            write_forces(folder / "grf.mot", plates),
        ]
        if option:
            version = int(option[-1])
            knee = -1.0 if version == 3 else 1.0
            model = write_osim(folder / "scaled.osim", walker, case["markers"], version=version, knee=knee)
            files.append(model)
    if case["standing"] and case["markers"] in STANDING:
        still = laboratory.standing(case["markers"], case["prefix"])
        time = np.arange(len(next(iter(still.values())))) / rate
        more["static"] = write_trc(folder / "standing.trc", time, still, case["unit"])
    return files, laboratory, more


def all_pairs(factors: dict[str, tuple[Any, ...]]) -> list[Case]:
    """Cases in which each pair of values of any two factors occurs: greedily, and always the same ones."""
    names = list(factors)
    wanted = {
        ((a, i), (b, j))
        for a, b in itertools.combinations(names, 2)
        for i in range(len(factors[a]))
        for j in range(len(factors[b]))
    }
    cases = []
    while wanted:
        case = dict(min(wanted))
        for name in names:
            if name not in case:
                case[name] = max(range(len(factors[name])), key=lambda k: _gain(case, name, k, names, wanted))
        wanted -= set(_pairs(case, names))
        cases.append({name: factors[name][case[name]] for name in names})
    return cases


def _pairs(case: dict[str, int], names: list[str]) -> Iterator[Any]:
    for a, b in itertools.combinations(names, 2):
        if a in case and b in case:
            yield (a, case[a]), (b, case[b])


def _gain(case: dict[str, int], name: str, k: int, names: list[str], wanted: set[Any]) -> int:
    return sum(pair in wanted for pair in _pairs({**case, name: k}, names) if (name, k) in pair)


PAIRS = all_pairs(FACTORS)


def _each_once(cases: list[Case]) -> list[Case]:
    """A few of the cases that hold each value of each factor at least once."""
    left = {(name, value) for name, values in FACTORS.items() for value in values}
    chosen = []
    while left:
        case = max(cases, key=lambda c: len(left & set(c.items())))
        left -= set(case.items())
        chosen.append(case)
    return chosen


QUICK = _each_once(PAIRS)
OTHERS = [case for case in PAIRS if case not in QUICK]
SLICE = sorted(np.random.default_rng(7).choice(len(OTHERS), size(4, len(OTHERS)), replace=False))
# This walker's pitch falls and ankle rises evenly while the foot is flat, so that noise chooses which 20 % of
# it are the flat part; a pitch anywhere within 1 deg of another is off by 1/√3 on average (derived) [deg].
OPEN_ZERO = 1.0 / np.sqrt(3.0)


def _param(case: Case, slow: bool = False) -> Any:
    forward, up, turn, _ = case["frame"]
    words = [str(value) for name, value in case.items() if name != "frame" and value not in ("", False)]
    name = ", ".join([*words, f"{forward} {up} {turn:g}"])
    return pytest.param(case, id=name, marks=[pytest.mark.slow] if slow else [])


@pytest.mark.parametrize(
    "case", [_param(case) for case in QUICK] + [_param(OTHERS[k], slow=True) for k in SLICE]
)
def test_each_way_of_recording_and_pairs_of_them_come_back(tmp_path: pathlib.Path, case: Case) -> None:
    """What a person does first: the files, the side, nothing else."""
    files, laboratory, more = record(tmp_path, case)
    done = import_gait(files, Choices(side=case["side"], **more))
    unused = any("markers alone are" in warning for warning in done.warnings)  # a model without their thigh
    alone = case["markers"] in LATERAL_ONLY and ("model" not in case["file"] or unused)
    shaken = noise_bounds(1e3 * laboratory.noise)
    loose = {n: more + shaken.get(n, BOUNDS[n]) - BOUNDS[n] for n, more in ONE_MALLEOLUS.items()}
    wrong = beyond(differences(done, laboratory, case["side"]), loose if alone else None)
    assert not wrong, (wrong, done.warnings)
    if laboratory.belt:
        assert done.frame.belt_speed == pytest.approx(laboratory.belt, rel=0.02)
    if case["plates"] != "single" or "model" in case["file"]:
        assert done.cycle.body_mass == pytest.approx(laboratory.walker.mass, rel=0.03)


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize(
    ("degrees", "suffix", "version", "knee", "turn"),
    [(True, "mot", 3, -1.0, 0.0), (False, "sto", 4, 1.0, 0.0), (True, "sto", 4, 1.0, -40.0)],
)
def test_joint_angles_with_their_model_come_back(
    tmp_path: pathlib.Path, side: str, degrees: bool, suffix: str, version: int, knee: float, turn: float
) -> None:
    """Inverse kinematics, ground reaction and the scaled model: moments within 2 %."""
    walker = Walker()
    laboratory = Laboratory(walker, turn=np.radians(turn))
    files = [
        write_angles(tmp_path / f"ik.{suffix}", laboratory.time, laboratory.angles(knee), degrees=degrees),
        write_forces(tmp_path / "grf.mot", laboratory.plates("steps")),
        write_osim(tmp_path / "scaled.osim", walker, "gait2392", version=version, knee=knee),
    ]
    done = import_gait(files, Choices(side=side))
    assert not beyond(differences(done, laboratory, side)), done.warnings
    assert done.cycle.body_mass == pytest.approx(walker.mass, rel=0.03)


@pytest.mark.parametrize("side", ["right", "left"])
def test_inverse_dynamics_is_the_moment_or_its_reference(tmp_path: pathlib.Path, side: str) -> None:
    """Newton and Euler of a foot with mass differ from the ground force's moment by about 1 %."""
    laboratory = Laboratory()
    walker = laboratory.walker
    files = [
        write_angles(tmp_path / "ik.mot", laboratory.time, laboratory.angles()),
        write_forces(tmp_path / "grf.mot", laboratory.plates("feet")),
        write_osim(tmp_path / "scaled.osim", walker, "rajagopal"),
        write_table(tmp_path / "id.sto", laboratory.time, laboratory.moments()),
    ]
    done = import_gait(files, Choices(side=side))
    assert not beyond(differences(done, laboratory, side, foot=True)), done.warnings
    assert done.cycle.notes["ankle_moment"] == "as in id.sto"
    (chosen,) = done.chosen
    stride = done.strides[chosen]
    time = stride.start + done.cycle.phase * (stride.end - stride.start)
    assert done.reference is not None
    expected = walker.moment(side, time) / walker.mass
    assert np.sqrt(np.mean((done.reference - expected) ** 2)) < 0.02
    assert not any("inverse dynamics" in warning for warning in done.warnings)


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("form", ["markers", "angles"])
def test_a_trial_of_0_96_of_a_period_is_closed(tmp_path: pathlib.Path, side: str, form: str) -> None:
    """No whole stride from heel strike to heel strike, a gap of 4 % of the period."""
    long = Laboratory(seconds=3.6, ideal=True)
    walker = long.walker
    late = walker.heel_strike(side, 1) - 0.1  # so that this side's stance is whole
    laboratory = dataclasses.replace(long, began=round(late, 2), seconds=round(0.96 * walker.stride_time, 2))
    forces = write_forces(tmp_path / "grf.mot", long.plates("feet"))
    if form == "markers":
        motion = [write_trc(tmp_path / "walk.trc", laboratory.time, laboratory.markers("rajagopal"))]
    else:
        motion = [
            write_angles(tmp_path / "ik.mot", laboratory.time, laboratory.angles()),
            write_osim(tmp_path / "scaled.osim", walker, "rajagopal"),
        ]
    done = import_gait([*motion, forces], Choices(side=side))
    assert not beyond(differences(done, laboratory, side)), done.warnings
    (chosen,) = done.chosen
    assert done.strides[chosen].closed is not None
    assert done.strides[chosen].closed.gap == pytest.approx(0.04 * walker.stride_time, abs=0.02)


@pytest.mark.parametrize("side", ["right", "left"])
def test_one_plate_strike_a_side_ends_by_the_motion(tmp_path: pathlib.Path, side: str) -> None:
    laboratory = Laboratory()
    files = write_trial(tmp_path, laboratory, "opensim c3d", "single")
    done = import_gait(files, Choices(side=side))
    assert not beyond(differences(done, laboratory, side)), done.warnings
    (chosen,) = done.chosen
    assert done.strides[chosen].by != "force"
    others = [s for s in done.strides if not s.loaded]
    assert others, "the strides without a plate are listed, too"
    for stride in done.strides:
        strikes = np.array([laboratory.walker.heel_strike(stride.side, k) for k in range(-1, 4)])
        assert np.abs(strikes - stride.start).min() < 0.045  # kinematic events are 0–40 ms early
        assert np.abs(strikes - stride.end).min() < 0.045


def test_the_mean_of_all_strides_is_the_stride(tmp_path: pathlib.Path) -> None:
    laboratory = Laboratory(seconds=5.0, ideal=True)
    files = write_trial(tmp_path, laboratory, "cast")
    done = import_gait(files, Choices(mean=True))
    assert len(done.chosen) == 3
    assert done.band is not None
    assert np.degrees(done.band["ankle_angle"].max()) < 0.5  # all strides are alike
    one = dataclasses.replace(done, chosen=done.chosen[:1])
    assert not beyond(differences(one, laboratory, "right")), done.warnings


@pytest.mark.parametrize("name", SETS)
def test_a_clean_trial_is_not_doubted(tmp_path: pathlib.Path, name: str) -> None:
    """A warning for each good trial is one that nobody reads."""
    laboratory = Laboratory()
    files = write_trial(tmp_path, laboratory, name, "steps")
    assert import_gait(files, Choices()).warnings == ()


@pytest.mark.parametrize(
    "samples", [slice(350, 1350), slice(700, None)], ids=["stop in swing", "start in the other foot's stance"]
)
def test_plates_of_a_part_of_the_trial_are_enough(tmp_path: pathlib.Path, samples: slice) -> None:
    """0.7 to 2.7 s: a whole stance, its swing cut by 0.1 s. From 1.4 s: the stride 1.60 to 2.80 s."""
    laboratory = Laboratory()
    plates = [
        dataclasses.replace(p, time=p.time[samples], force=p.force[samples], place=p.place[samples])
        for p in laboratory.plates("feet")
    ]
    files = write_trial(tmp_path, laboratory, "cast", plates)
    done = import_gait(files, Choices())
    assert not beyond(differences(done, laboratory, "right")), done.warnings


def test_a_heel_strike_just_before_the_first_frame(tmp_path: pathlib.Path) -> None:
    laboratory = Laboratory(began=1.0, seconds=1.6, ideal=True)
    walker = laboratory.walker
    assert 0.0 < laboratory.began - walker.heel_strike("left", 0) < 0.01
    files = write_trial(tmp_path, laboratory, "cast", Laboratory(walker, seconds=3.6).plates("feet"))
    done = import_gait(files, Choices(side="left"))
    assert not beyond(differences(done, laboratory, "left")), done.warnings


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "side"),
    [(k, side) for k in range(10) for side in SIDES if NIGHTLY or side == SIDES[(k // 2) % 2]],
)
def test_a_trial_as_laboratories_have_it(tmp_path: pathlib.Path, seed: int, side: str) -> None:
    """All at once, by chance: person, set, axes, direction, rates, plates, 1 mm of noise and gaps."""
    rng = np.random.default_rng(seed)
    walker = Walker(
        mass=float(rng.uniform(45.0, 110.0)),
        toe_out=float(np.radians(rng.uniform(0.0, 15.0))),
        start=float(rng.uniform(0.0, 1.2)),
    )
    laboratory = Laboratory(
        walker,
        ("x", "-y", "y", "-x")[seed % 4],
        "z",
        turn=float(rng.uniform(-0.5, 0.5)),
        origin=(float(rng.uniform(-2.0, 2.0)), 1.0, 0.0),
        seconds=3.5,
        rate=(100.0, 120.0, 200.0, 250.0, 60.0)[seed % 5],
        plate_rate=(1000.0, 1080.0, 1000.0, 500.0, 1020.0)[seed % 5],
    )
    name = list(SETS)[seed % len(SETS)]
    points = {n: p + rng.normal(0.0, 0.001, p.shape) for n, p in laboratory.markers(name).items()}
    for point in points.values():
        start, length = int(rng.integers(0, len(point) - 20)), int(rng.integers(2, 15))
        if rng.uniform() < 0.3:
            point[start : start + length] = np.nan
    plates = [
        dataclasses.replace(p, force=p.force + rng.normal(0.0, 2.0, p.force.shape))
        for p in laboratory.plates("steps")
    ]
    file = write_c3d(tmp_path / "walk.c3d", laboratory.time, points, plates, 1 + seed % 4)
    done = import_gait([file], Choices(side=side))
    bounds = noise_bounds(1.0)
    if name in LATERAL_ONLY:
        bounds = {n: v + ONE_MALLEOLUS[n] - BOUNDS[n] for n, v in bounds.items()}
    bounds["ankle [deg]"] = float(np.hypot(bounds["ankle [deg]"], OPEN_ZERO))
    assert not beyond(differences(done, laboratory, side), bounds), done.warnings
    assert done.cycle.body_mass == pytest.approx(walker.mass, rel=0.03)


SET = "gait2392"
RECORDED = Laboratory()


def imported(folder: pathlib.Path, without: tuple[str, ...] = (), **choices: Any) -> Imported:
    points = {n: p for n, p in RECORDED.markers(SET).items() if not n.startswith(without)}
    return import_gait(write_trial(folder, RECORDED, SET, points=points), Choices(**choices))


def test_markers_make_no_use_of_lengths(tmp_path: pathlib.Path) -> None:
    done = imported(tmp_path, thigh=0.4, shank=0.4, hip=(-0.06, -0.07), degrees=True)
    assert [w for w in done.warnings if w.startswith("thigh, shank, hip, degrees: not used")]


def test_a_model_makes_no_use_of_named_markers(tmp_path: pathlib.Path) -> None:
    model = write_osim(tmp_path / "scaled.osim", RECORDED.walker, SET)
    done = imported(tmp_path, model=model, markers={"ankle": ("R.Heel",)})
    assert [w for w in done.warnings if w.startswith("markers: not used")]


def test_no_choice_no_word(tmp_path: pathlib.Path) -> None:
    assert imported(tmp_path, markers={"ankle": ("R.Ankle.Lat",)}).warnings == ()


def test_both_legs_need_both(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match="left foot") as caught:
        imported(tmp_path, without=("L.Knee", "L.Ankle", "L.Heel"), both=True)
    assert (caught.value.field, caught.value.value, caught.value.allowed) == ("side", "both", "right")


def test_one_stride_is_no_mean() -> None:
    for mean in ({"mean": True}, {"both": True}):
        with pytest.raises(InputError, match="a mean is asked for"):
            Choices(stride=2, **mean)


@pytest.mark.slow
@pytest.mark.parametrize("millimetres", [0.5, 1.0, 3.0])
def test_the_default_cut_off_is_near_the_moments_least_error(
    tmp_path: pathlib.Path, millimetres: float
) -> None:
    rng, walker, noise = np.random.default_rng(5), RECORDED.walker, 1e-3 * millimetres
    points = {n: p + rng.normal(0.0, noise, p.shape) for n, p in RECORDED.markers("cast").items()}
    files = write_trial(tmp_path, RECORDED, "cast", points=points)
    errors = {}
    for cutoff in (4.0, 6.0, 8.0, Choices().cutoff, 15.0, 20.0):
        cycle = (done := import_gait(files, Choices(cutoff=cutoff))).cycle
        time = done.strides[done.chosen[0]].start + cycle.phase * cycle.stride_time
        off = cycle.ankle_moment - walker.moment("right", time, foot=False) / walker.mass
        errors[cutoff] = float(np.sqrt(np.mean(off[cycle.phase < 0.6] ** 2)))
    assert errors[Choices().cutoff] < 1.3 * min(errors.values())
