"""The walk that a walk is compared with: what it wears, that differences add up, who pays for it."""

import itertools

import pytest

import afo_sim
from afo_sim.common import InputError
from afo_sim.description import Scenario, load
from afo_sim.simulation import References, reference_of
from afo_sim.simulation import reference_walk as reference
from afo_sim.study.parameter import span

SHORT = {"duration": "3 s"}
AFO = "walk-dropfoot-afo"


def braced(kind: str, **sets: object) -> Scenario:
    return load("scenario", AFO, SHORT | {"reference": kind} | sets)


def test_barefoot_is_the_patient_in_the_same_gait_and_nothing_on() -> None:
    scenario = braced("barefoot")
    bare = reference_of(scenario)
    assert bare.shoe is bare.phases is bare.timer is bare.reference is None
    assert not bare.orthosis.muscle and bare.orthosis.plate is None
    assert (bare.patient, bare.leg) == (scenario.patient, scenario.leg)
    assert bare.gait.cycle == scenario.gait.cycle


def test_shoe_is_without_the_orthosis_in_the_shoe() -> None:
    scenario = braced("shoe", shoe="leather")
    shod = reference_of(scenario)
    assert shod.shoe == scenario.shoe and not shod.orthosis.muscle and shod.orthosis.outsole is None


def test_off_never_fills_a_muscle() -> None:
    scenario = braced("orthosis-off", start={"dorsiflexor": {"pressure": "4 bar"}})
    off = reference_of(scenario)
    assert off.orthosis == scenario.orthosis and off.start is None
    run = afo_sim.run(off)
    assert run.ok
    # through an outlet that is open all the time, air goes in and out as the ankle moves
    assert run["chamber/dorsiflexor/pressure"].max() < 0.2e5
    assert not run["valve/dorsiflexor_inlet/opening"].any()


@pytest.mark.parametrize("kind", ["barefoot", "shoe", "orthosis-off"])
def test_a_timers_strides_are_compared_with_solved_ones(kind: str) -> None:
    """The reference has no timer that could drift."""
    timed = load("scenario", "walk-dropfoot-afo-timer", {"reference": kind})
    assert reference_of(timed).timer is None
    assert reference_of(timed).gait.settled == "solved"  # type: ignore[union-attr]


@pytest.mark.slow
def test_differences_add_up() -> None:
    """Barefoot → shoe → orthosis without air → with air: each step is another run's lift over its reference.

    The sum of the steps is the whole lift over barefoot, and every reference is the run of that scenario.
    """
    shod = afo_sim.run("walk-dropfoot", SHORT | {"shoe": "trainer", "reference": "barefoot"})
    off = afo_sim.run(reference_of(braced("orthosis-off")).set({"reference": "shoe"}))
    on = afo_sim.run(braced("orthosis-off"))
    whole = afo_sim.run(braced("barefoot"))
    runs = [shod, off, on]
    assert sum(run.metrics["lift_over_reference"] for run in runs) == pytest.approx(
        whole.metrics["lift_over_reference"], abs=0.02
    )  # the settled strides are found to 0.005°
    for before, after in itertools.pairwise(runs):
        assert after.metrics["reference_toe_clearance"] == pytest.approx(
            before.metrics["toe_clearance"], abs=0.02
        )
    bare = afo_sim.run("walk-dropfoot", SHORT)
    assert whole.metrics["reference_toe_clearance"] == pytest.approx(bare.metrics["toe_clearance"], abs=1e-9)
    for run in (*runs, whole):
        own, other = run.metrics["toe_clearance"], run.metrics["reference_toe_clearance"]
        assert run.metrics["lift_over_reference"] == own - other


def test_a_patient_compared_with_herself_is_not_lifted() -> None:
    run = afo_sim.run("walk-dropfoot", SHORT | {"reference": "barefoot"})
    assert run.metrics["lift_over_reference"] == pytest.approx(0.0, abs=1e-9)
    assert "lift_over_reference" not in afo_sim.run("walk-dropfoot", SHORT).metrics


def test_strides_that_do_not_repeat_are_compared_with_such() -> None:
    """The reference's strides vary alike: the same seed draws them."""
    varied = {"gait.variability": 0.03, "duration": "6 s", "reference": "barefoot"}
    run = afo_sim.run("walk-dropfoot", varied)
    assert run.metrics["lift_over_reference"] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("scenario", "sets", "said"),
    [
        ("walk-dropfoot", {"reference": "shoe"}, "the scenario has none"),
        ("walk-dropfoot", {"reference": "orthosis-off"}, "none is worn"),
        ("walk-dropfoot", {"reference": "nobody"}, "barefoot"),
        ("seated", {"reference": "barefoot"}, "driven shank"),
    ],
)
def test_what_cannot_be_compared_is_refused(scenario: str, sets: dict[str, str], said: str) -> None:
    with pytest.raises(InputError, match=said):
        afo_sim.run(scenario, sets)


@pytest.mark.slow
def test_a_sweep_walks_the_reference_only_if_asked(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    base, walked = tmp_path_factory.mktemp("sweeps"), []
    walk = reference.walk_reference
    monkeypatch.setattr(reference, "walk_reference", lambda one: walked.append(one) or walk(one))
    over = {"supply.pressure": span("3 bar", "4 bar", 2)}
    scenario = braced("shoe", start={}).set({"timestep": "2 ms"})
    plain = afo_sim.sweep(scenario, over, out=base / "plain", threads=1)
    assert not walked and "lift_over_reference" not in plain.metrics
    wanted = ["toe_clearance", "lift_over_reference", "reference_toe_clearance"]
    asked = afo_sim.sweep(scenario, over, out=base / "asked", threads=1, metrics=wanted)
    # one for both cases: without air there is no pressure to tell them apart; one beside the checked step
    assert len(walked) == 2
    assert set(wanted) <= set(asked.metrics)
    high = afo_sim.run(scenario)
    for name in wanted:
        assert asked[name][1] == pytest.approx(float(high.metrics[name]), abs=1e-9)


def test_references_are_kept_by_all_that_decides_them() -> None:
    kept = References()
    for kind, sets in (("shoe", {}), ("shoe", {"shoe": "leather"}), ("barefoot", {}), ("shoe", {})):
        kept.of(braced(kind, **sets))
    assert len(kept.known) == 3


@pytest.mark.slow
def test_the_single_filling_is_the_lowest_that_clears_what_is_wanted() -> None:
    """Between the tries of a grid another pressure would do; a little less than the found one does not."""
    metrics = afo_sim.run("walk-dropfoot-afo", {"duration": "3 s"}).metrics
    pressure = float(metrics["filled_once_pressure"])
    shut: dict[str, object] = {
        "phases.dorsiflexor.inlet": [],
        "phases.dorsiflexor.outlet": [],
        "timestep": "2 ms",
    }
    heights = [
        afo_sim.run(
            "walk-dropfoot-afo", shut | {"duration": "3 s", "start.dorsiflexor": {"pressure": f"{bar} bar"}}
        ).metrics["toe_clearance"]
        for bar in (pressure - 0.05, pressure + 0.02)
    ]
    assert heights[0] < "10 mm" < heights[1]
    assert metrics["filled_once_toe_clearance"] >= "10 mm"
