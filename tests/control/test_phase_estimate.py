"""The phase estimated from the shank of every shipped walker, against the phase that laid the walk out."""

import math
import pathlib
import re
import subprocess

import numpy as np
import pytest
from campaign import NIGHTLY, size
from control.phase_walks import ALONE, ALWAYS, CALIBRATED, NOISE, apart, estimated, table, worst
from export.boards import STRICT, compiler

from afo_sim.control import PhaseEstimate
from afo_sim.control.phase_estimate import SHANK, after_swing, templates

ROOT = pathlib.Path(__file__).parents[2]
ALLOWED = 3.0  # of the cycle, from the third stride on [%]
STRIDES_LATER, STEADY = 5.0, 0.98  # error two strides later [%]; least share of time that is `ready`


SHIPPED = [name for name in table.walkers() if "," not in name]
HARD = ("5 % varied", "a stop")  # an even walk is a part of the second


@pytest.mark.parametrize("walker", SHIPPED)
@pytest.mark.parametrize("condition", HARD)
def test_with_a_foot_switch_no_error_is_above_three_percent(walker: str, condition: str) -> None:
    most, rms = worst(walker, condition, switch=ALWAYS, noise=NOISE, seeds=1)
    assert most <= ALLOWED and rms <= 1.5


@pytest.mark.slow  # all together
@pytest.mark.parametrize("walker", SHIPPED)
def test_who_was_calibrated_in_four_strides_needs_no_switch(walker: str) -> None:
    most, _ = worst(walker, "5 % varied", switch=CALIBRATED, noise=NOISE, seeds=1)
    assert most <= ALLOWED


@pytest.mark.slow  # all together
@pytest.mark.parametrize("walker", SHIPPED)
def test_the_shank_alone_is_off_by_what_walkers_differ(walker: str) -> None:
    even, _ = worst(walker, "a stop", switch=ALONE, noise=0.0)
    varied, _ = worst(walker, "5 % varied", switch=ALONE, noise=NOISE, seeds=2)
    assert max(even, varied) <= STRIDES_LATER


def test_who_stands_is_found_and_the_phase_stays() -> None:
    trial = estimated("bovi2011_natural", "a stop", noise=NOISE)
    stands = np.concatenate([[False], np.diff(trial.walked) == 0.0])
    begun, end = trial.time[stands][0], trial.time[stands][-1]
    inside = (trial.time > begun + 0.3) & (trial.time < end)
    assert trial.stopped[inside].all()
    assert np.ptp(trial.phase[inside]) == 0.0
    walks = np.diff(trial.walked, prepend=-1.0) > 0.5 * 0.01 / 1.1
    assert not trial.stopped[walks].any()  # nor at half the cadence is anybody taken to stand


@pytest.mark.parametrize("stride_time", [2.2, 2.8])
@pytest.mark.parametrize("walker", ["gatk_mean", "opensim_walk"])
def test_who_walks_slowly_is_not_taken_to_stand(walker: str, stride_time: float) -> None:
    walked = np.arange(0.0, 12.0, 0.01 / stride_time)
    shank = table.cycle(walker).signal("shank_angle", walked)
    struck = np.append(False, np.diff(np.floor(walked)) > 0.0)
    phase, _, stopped, _ = table.followed(shank, struck)
    assert not stopped.any()
    assert (
        100.0 * np.abs(apart(phase, walked))[walked > 5.0].max() <= ALLOWED
    )  # the first strides learn his shape


def test_the_stride_time_follows_the_cadence() -> None:
    even = estimated("gatk_mean")
    assert np.ptp(even.walked) > 13.0
    own = float(np.polyfit(even.walked, even.time, 1)[0])
    assert table.followed(even.shank)[3, -1] == pytest.approx(own, rel=0.03)


@pytest.mark.parametrize("period", [0.02, 0.005, 0.001])
def test_other_control_rates_do_as_well(period: float) -> None:
    trial = estimated("opensim_walk", "5 % varied", switch=ALWAYS, period=period)
    assert 100.0 * np.abs(trial.error[trial.counts]).max() <= ALLOWED


def test_a_lead_makes_up_for_the_age_of_the_samples() -> None:
    late, led = (estimated("bovi2011_natural", switch=ALWAYS, age=0.05, lead=lead) for lead in (0.0, 0.05))
    # an old sample is 0.05 s of 1.09 s late; the switch is as old
    behind = np.mean(led.error[led.counts]) - np.mean(late.error[late.counts])
    assert behind == pytest.approx(0.05 / 1.0929, rel=0.1)
    assert np.abs(led.error[led.counts]).max() < 0.03


def test_who_goes_on_with_another_part_of_the_stride_is_found_again() -> None:
    trial = estimated("bovi2011_natural")
    jump = np.searchsorted(trial.walked, 5.3)
    onward = np.searchsorted(trial.walked, 6.7)  # the same angles go on 1.4 strides later
    shank = np.concatenate([trial.shank[:jump], trial.shank[onward:]])
    walked = np.concatenate([trial.walked[:jump], trial.walked[onward:]])
    error = apart(table.followed(shank)[0], walked)
    assert 100.0 * np.abs(error[walked > 8.7]).max() <= ALLOWED


def test_nothing_is_known_before_the_first_swing_and_after_a_reset() -> None:
    estimate = PhaseEstimate()
    for _ in range(300):
        estimate.update(0.1, 0.01)
    assert not estimate.ready and math.isnan(estimate.phase) and math.isnan(estimate.stride_time)
    assert estimate.stopped
    trial = estimated("gatk_mean", noise=NOISE)
    runs = []
    for _ in range(2):
        estimate.reset()
        runs.append(table.followed(trial.shank[:500], estimate=estimate)[:2])
    assert np.array_equal(runs[0], runs[1], equal_nan=True)
    ready = runs[0][1]
    assert 1.5 < trial.walked[int(np.argmax(ready))] < 2.0 and ready[-1]


def test_the_phase_runs_back_only_to_where_the_walker_stopped() -> None:
    trial = estimated("gatk_stride1", "a stop", noise=NOISE)
    step = (np.diff(trial.phase) + 0.5) % 1.0 - 0.5
    known = np.isfinite(step) & (trial.walked[1:] > 2.0)
    (found,) = np.flatnonzero(trial.stopped[1:] & ~trial.stopped[:-1])
    assert step[known & (np.arange(len(step)) != found)].min() >= -1e-12
    assert abs(trial.error[found + 1]) < 0.03


EVENTS = tuple(table.phase_events.EVENTS)
FEW = ("turn × 0.75", "stop", "turn × 0.5", "cadence × 1.3")
SWITCH = pytest.mark.parametrize("switch", [False, True], ids=["alone", "with a foot switch"])
LONG, LONGEST = 0.1, 0.2  # of an error over a tenth of a stride with `ready`: in 99 of 100 events, ever [s]


@SWITCH
def test_a_phase_that_is_ready_is_right_through_drawn_peoples_events(switch: bool) -> None:
    found = [
        table.through_events(table.phase_events.drawn(k), EVENTS[k % 5 :], switch=switch, seed=k)
        for k in range(2000, 2000 + size(3, 60))
    ]
    lies = np.concatenate([walk.lies for walk in found])
    late = np.concatenate([walk.late for walk in found])
    assert np.mean(lies <= LONG + 1e-9) >= 0.99 and lies.max() <= LONGEST
    assert np.mean(late <= STRIDES_LATER) >= 0.97
    steady = [walk.steady for walk in found]
    assert np.mean(steady) >= STEADY and min(steady) >= 0.9


@SWITCH
@pytest.mark.parametrize("walker", SHIPPED[:: size(4, 1)])
def test_a_phase_that_is_ready_is_right_on_shipped_walkers(walker: str, switch: bool) -> None:
    found = table.through_events(table.shipped(walker), EVENTS if NIGHTLY else FEW, switch=switch, seed=0)
    assert max(found.lies) <= LONG + 1e-9
    assert found.steady >= STEADY


@pytest.mark.parametrize(("noise", "rate"), [(2.0, 100.0), (2.0, 1000.0), (1.0, 50.0)])
def test_noise_and_rate_make_it_neither_lie_nor_wait(noise: float, rate: float) -> None:
    person = table.phase_events.drawn(2001)
    found = table.through_events(person, FEW[:2], switch=False, seed=3, rate=rate, noise=noise)
    assert max(found.lies) <= LONG + 1e-9 and found.steady >= 0.9


def test_the_heel_strike_is_learned_from_the_shank() -> None:
    early, late, known = [], [], []
    for who in range(2000, 2008):
        walk = table.phase_events.walk(table.phase_events.drawn(who), (), who)
        angle, true = np.tile(walk.angle, 3), np.tile(walk.phase, 3)
        estimate = PhaseEstimate()
        off = apart(table.followed(angle, estimate=estimate)[0], true)
        early.append(np.mean(off[(true > 2.0) & (true < 3.0)][:100]))
        late.append(np.mean(off[-200:-50]))
        known.append(estimate.heel_strike)
    assert np.std(late) < 0.5 * np.std(early) and np.abs(late).max() < 0.04
    assert np.mean(known) >= 0.5 and max(known) == 1


def test_a_phase_that_is_wrong_is_not_called_right_by_the_judge() -> None:
    walk = table.phase_events.walk(table.shipped("gatk_mean"), ("turn × 0.5", "stop"), 0)
    ready, true = np.ones(len(walk.angle), dtype=bool), walk.phase % 1.0
    exact, off = (table.phase_events.judged(walk, (true + by) % 1.0, ready) for by in (0.0, 0.12))
    assert max(exact.lies) == 0.0 and max(exact.late) == 0.0
    assert min(off.lies) > 2.0 and off.late == pytest.approx([12.0, 12.0])
    stands = np.isnan(walk.phase)
    assert stands.any() and np.ptp(walk.angle[stands]) < np.radians(6.0)  # noise and drift
    strikes = np.flatnonzero(walk.struck)
    assert np.allclose(np.round(walk.phase[strikes]), walk.phase[strikes], atol=0.02)


MAIN = """#include <stdio.h>
#include "phase.h"
int main(void) {
    static phase_t p; double angle; int struck;
    phase_begin(&p, 0);
    while (scanf("%lf %d", &angle, &struck) == 2) {
        phase_update(&p, (real_t)angle, (real_t)0.01, struck);
        printf("%.12f %d\\n", p.follows ? (double)phase_now(&p) : -1.0, phase_ready(&p));
    }
    return 0;
}
"""


@pytest.mark.slow
@pytest.mark.parametrize("lost", [0.0, 0.1])
@pytest.mark.parametrize(("real", "differs", "unlike"), [("double", 1e-7, 0), ("float", 2e-3, 5)])
def test_the_c_header_computes_the_same(
    real: str, differs: float, unlike: int, lost: float, tmp_path: pathlib.Path
) -> None:
    walk = table.phase_events.walk(table.shipped("gatk_mean"), FEW, 1)
    walk.angle[np.random.default_rng(5).random(len(walk.angle)) < lost] = math.nan
    if lost:
        walk.angle[3000:3008] = walk.angle[4000:4040] = math.nan
    (tmp_path / "main.c").write_text(MAIN, encoding="utf-8")
    command = [compiler("cc", "gcc", "clang"), "-std=c99", *STRICT, f"-DPHASE_REAL={real}"]
    command += [f"-I{ROOT / 'docs'}", "-o", str(tmp_path / "main"), str(tmp_path / "main.c"), "-lm"]
    subprocess.run(command, check=True)
    rows = "".join(f"{a!r} {int(s)}\n" for a, s in zip(walk.angle.tolist(), walk.struck, strict=True))
    printed = subprocess.run([tmp_path / "main"], input=rows, capture_output=True, text=True, check=True)
    phase, ready = np.array([line.split() for line in printed.stdout.splitlines()], dtype=float).T
    own, believed, *_ = table.followed(walk.angle, walk.struck)
    assert np.array_equal(np.isnan(own), phase < 0.0)
    known = phase >= 0.0
    assert np.abs(apart(phase, own)[known]).max() < differs
    assert np.count_nonzero(ready != believed) <= unlike and 0.5 < ready.mean() < 1.0


def test_the_c_header_has_the_constants_of_the_estimator() -> None:
    text = (ROOT / "docs" / "phase.h").read_text(encoding="utf-8")
    written = table.written_c(text)
    number = r"-?\d+\.\d+(?:e-?\d+)?"  # of a fit, whose last bits are the processor's
    assert re.sub(number, "", written) == re.sub(number, "", text) and "#define WAKING_RATE" in text
    own, shipped = (np.array(re.findall(number, each), dtype=float) for each in (written, text))
    assert np.allclose(own, shipped, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("share", [0.1, 0.3])
def test_the_phase_goes_on_while_samples_are_lost(share: float) -> None:
    trial = estimated("bovi2011_natural", noise=NOISE)
    lost = np.random.default_rng(2).random(len(trial.shank)) < share
    phase, _, _, stride_time = table.followed(np.where(lost, math.nan, trial.shank))
    assert 100.0 * np.abs(apart(phase, trial.walked))[trial.counts].max() < 5.0
    assert np.mean(stride_time[trial.counts]) == pytest.approx(1.0929, rel=0.02)


def test_a_gap_is_not_ready_until_the_angle_was_as_expected_again() -> None:
    trial = estimated("bovi2011_natural", noise=NOISE)
    trial.shank[900:1400] = math.nan
    phase, ready, *_ = table.followed(trial.shank)
    assert ready[904] and not any(ready[905:1450]) and ready[-1]
    assert abs(apart(phase, trial.walked)[-1]) < 0.05


def test_the_template_is_the_published_curve_at_its_own_stride_time() -> None:
    template = min(templates(), key=lambda template: abs(template.stride_time - 1.046))
    phase = np.arange(0.0, 1.0, 0.05)
    order = np.arange(1, len(template.series) // 2 + 1)
    wave = 2.0 * np.pi * np.outer(phase, order)
    shape = template.series[0] + np.cos(wave) @ template.series[1::2] + np.sin(wave) @ template.series[2::2]
    assert np.degrees(shape) == pytest.approx(SHANK[:-1], abs=1.0)  # six harmonics
    assert np.ptp(np.degrees(shape) - SHANK[:-1]) > 0.0
    quick, slow = after_swing(0.25), after_swing(0.45)
    assert quick.stride_time < slow.stride_time and quick.highest < slow.highest
