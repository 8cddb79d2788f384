"""What a map says that a walk needs: the walk's own numbers, laws of nature, and what is refused."""

from typing import Any

import numpy as np
import pytest

import afo_sim as afo
from afo_sim.common import InputError
from afo_sim.model import own_tissue
from afo_sim.simulation import needs_of
from afo_sim.study.uncertainty.draw import draw
from afo_sim.study.uncertainty.running import check_draws, need_bands

WALK = "walk-dropfoot-afo"


def body(kilograms: float, metres: float, **others: str) -> dict[str, Any]:
    """The keys of a patient's body, and others with "__" for each dot."""
    own = {"patient.body_mass": f"{kilograms} kg", "patient.body_height": f"{metres} m"}
    return {key.replace("__", "."): text for key, text in others.items()} | own


PATIENTS = [
    body(20, 1.15),
    body(26, 1.28),
    body(35, 1.42, patient="spastic"),
    body(45, 1.55, patient="drop-foot-mild", gait__speed="1 m/s"),
    body(55, 1.62, patient="drop-foot-flaccid"),
    {},  # the recorded walkers', 68.5 kg
    body(75, 1.75, patient="plantarflexor-weak"),
    body(92, 1.80),
    body(105, 1.85, patient="contracture"),
    body(120, 1.90, gait__cycle="opensim_walk"),
]


def assert_needs_of_the_run(sets: dict[str, Any]) -> None:
    found = afo.torque_map(WALK, sets, angles=[0.0])
    run = afo.run(WALK, sets)
    assert run.ok and len(found.needs) == 4
    for need in found.needs:
        assert need.peak == pytest.approx(float(run.metrics[need.metric]), rel=0.01, abs=1e-9)
    assert max(need.peak for need in found.needs) > 1.0


@pytest.mark.parametrize("number", [1, 4, 6])
def test_the_need_is_that_of_the_walks_metrics(number: int) -> None:
    assert_needs_of_the_run(PATIENTS[number])


@pytest.mark.parametrize(("metres", "other"), [(1.28, True), (1.71, False), (1.80, False), (1.90, True)])
def test_a_device_on_another_persons_leg_is_told(metres: float, other: bool) -> None:
    """The leg that it is fitted to is of 1.75 m; its moment arms go with the height."""
    found = afo.torque_map(WALK, body(70, metres), angles=[0.0])
    assert ("device-of-another-size" in {notice.code for notice in found.warnings}) == other


@pytest.mark.parametrize(
    ("sets", "code"),
    [
        ({"patient.body_mass": "10 kg"}, "design-implausible"),
        ({"supply.pressure": "1 bar"}, "law-outside-its-pressure"),  # S1's law holds from 1.2 bar on
        ({"supply.pressure": "12 bar"}, "pressure-limit"),
    ],
)
def test_what_a_run_doubts_the_map_doubts_too(sets: dict[str, str], code: str) -> None:
    found, usual = (afo.torque_map(WALK, each, angles=[0.0], pressures=[1e5]) for each in (sets, None))
    assert code in {notice.code for notice in found.warnings} and not usual.warnings


@pytest.mark.slow
@pytest.mark.parametrize("sets", PATIENTS)
def test_ten_patients_need_what_their_walks_report(sets: dict[str, Any]) -> None:
    assert_needs_of_the_run(sets)


@pytest.mark.parametrize(("heavier", "taller"), [(0.4, 0.7), (2.0, 1.15)])
def test_the_need_goes_with_mass_times_height(heavier: float, taller: float) -> None:
    """Moments scale by m g l (Hof 1996) of a bare leg, whose shoe and device do not stay as they are."""
    first, other = (
        needs_of(afo.load("scenario", "walk-dropfoot", body(68.5 * a, 1.7 * b)))[1]
        for a, b in ((1.0, 1.0), (heavier, taller))
    )
    for one, two in zip(first[:2], other, strict=False):
        assert two.torque.max() == pytest.approx(heavier * taller * one.torque.max(), rel=1e-3)


def test_what_is_lacking_is_the_need_less_the_map() -> None:
    """At the supply's pressure, by interpolation between the map's own angles."""
    found = afo.torque_map("walk-dropfoot-afo-timer", {"supply.pressure": "3.5 bar"})
    front, back = found.maps
    assert front.pressures[-2] == 3.5e5
    swing, _, _, push_off = found.lacking
    assert (swing[0], push_off[0]) == ((front.chamber,), (back.chamber,))
    _, need, lacking = swing
    given = np.interp(need.angle, front.angles, front.torque[:, -2])
    free = np.interp(need.angle, front.angles, front.contraction[:, -2]) > 0.002
    assert lacking.max() > 1.0 and free.sum() > 0.9 * len(free)
    asked = free & (need.torque > 0.0)
    assert lacking[asked] == pytest.approx((need.torque - given)[asked], abs=0.02)
    assert not lacking[need.torque <= 0.0].any() and not push_off[2].any()


@pytest.mark.parametrize(
    ("patient", "phase", "sign", "lost", "start", "end"),
    [
        ("drop-foot", "initial and mid swing", 1.0, 1.0, 0.63, 1.0),
        ("drop-foot", "loading response", 1.0, 1.0, 0.0, 0.12),
        ("drop-foot-mild", "loading response", 1.0, 0.7, 0.0, 0.12),
        ("plantarflexor-weak", "push-off", -1.0, 0.6, 0.40, 0.62),
    ],
)
def test_the_need_is_the_strength_that_is_lost(
    patient: str, phase: str, sign: float, lost: float, start: float, end: float
) -> None:
    """Of the healthy active moment: the recorded one less the tissue's, with its damping."""
    sets = {"patient": patient}
    found = afo.torque_map(WALK, sets, angles=[0.0])
    run = afo.run(WALK, sets)
    rows = run["gait/solved"] == 1.0
    damping = own_tissue(found.scenario).damping * np.gradient(run["gait/ankle_angle"], run["time"])
    active = (run["gait/ankle_moment"] + damping - run["gait/passive_moment"])[rows]
    way = run["gait/phase"][rows]
    if phase == "swing":  # until the shank leans back
        end = way[(way > start) & (run["shank/angle"][rows] <= 0.0)].min()
    inside = (way > start) & (way < end)
    (need,) = (each for each in found.needs if each.phase == phase)
    assert need.torque.max() == pytest.approx(lost * (sign * active[inside]).max(), rel=0.01)
    assert need.torque.max() > 1.0


def test_a_device_is_worn_in_a_walk_on_the_same_leg() -> None:
    """Its patient and gait are set in the walk, its supply in the device's scenario."""
    sets = body(26, 1.28) | {"supply.pressure": "2.5 bar"}
    found = afo.torque_map("seated", sets, walk=WALK)
    own = afo.torque_map(WALK, sets)
    assert found.scenario.supply.pressure == 2.5e5
    peaks, others = ([need.peak for need in each.needs] for each in (found, own))
    assert peaks == pytest.approx(others, rel=1e-3, abs=1e-9) and others[0] == pytest.approx(1.48, rel=0.01)
    for one, other in zip(found.maps, own.maps, strict=True):
        assert one.torque == pytest.approx(other.torque, abs=1e-6)


@pytest.mark.parametrize("scenario", ["seated", "knee", "arm"])
def test_nothing_is_needed_where_nobody_walks(scenario: str) -> None:
    found = afo.torque_map(scenario)
    assert found.needs == [] and found.lacking == []
    assert max(np.abs(own.torque).max() for own in found.maps) > 1.0


def test_of_a_patients_own_walk_no_need_is_known() -> None:
    """Neither healthy muscle nor weakness is known of it; bands of it are none."""
    found = afo.torque_map(WALK, {"gait.walker": "patient"})
    assert found.needs == [] and found.lacking == [] and found.scenario.walking
    assert need_bands(found.scenario, 20) == {}


@pytest.mark.parametrize(
    ("scenario", "walk", "field"),
    [
        ("walk-healthy", None, "orthosis"),
        ("walk-healthy", WALK, "orthosis"),
        ("knee", WALK, "walk"),
        ("arm", WALK, "walk"),
        ("seated", "seated", "walk"),
        ("seated", "walk-dropfoot-af", "walk"),
    ],
)
def test_what_cannot_be_mapped_is_refused(scenario: str, walk: str | None, field: str) -> None:
    with pytest.raises(InputError) as caught:
        afo.torque_map(scenario, walk=walk)
    assert caught.value.field == field


def test_the_need_rises_in_a_straight_line_with_the_tissues_stiffness() -> None:
    """What a foot is held up against is the tissue's moment times its factor (Riener & Edrich 1999)."""
    half, whole, double = (
        needs_of(afo.load("scenario", WALK, {"patient.passive_scale": scale}))[1][0]
        for scale in (0.5, 1.0, 2.0)
    )
    assert double.torque - whole.torque == pytest.approx(2.0 * (whole.torque - half.torque), abs=1e-9)
    assert double.peak - whole.peak == pytest.approx(
        4.9, abs=0.1
    )  # needed_swing_torque_tissue: docs/metrics.md


@pytest.mark.parametrize("angles", [[], [np.nan], [0.0, 2.0], [-2.0, 0.0]])
def test_angles_beyond_the_stops_are_refused(angles: list[float]) -> None:
    with pytest.raises(InputError) as caught:
        afo.torque_map("seated", angles=angles)
    assert caught.value.field == "angles"


def test_bands_of_the_need_are_those_of_patient_and_walk() -> None:
    """Of the tissue, all else of a stride moves the need little; of the device nothing moves it."""
    scenario, tissue = afo.load("scenario", WALK), ("patient.passive_scale", "patient.passive_offset")
    found = need_bands(scenario, 20)
    drawn = draw(check_draws(scenario, 20, "usual"), scenario, 20)
    sets = [{key: drawn.sets(k)[key] for key in tissue} for k in range(20)]
    peaks = [[need.peak for need in needs_of(scenario.set(each))[1]] for each in sets]
    for quantiles, own in zip(found.values(), np.quantile(peaks, [0.05, 0.5, 0.95], axis=0).T, strict=True):
        assert quantiles == pytest.approx(own, rel=0.05, abs=0.05)
        assert quantiles == sorted(quantiles)
