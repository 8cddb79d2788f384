"""Recordings trimmed to about one stride: mass, period and moment of a known walker at any beginning."""

import dataclasses
import itertools
import pathlib

import numpy as np
import pytest
from campaign import size
from gait_lab.faulty_trials import SET
from gait_lab.known_walker import Walker
from gait_lab.laboratory import Laboratory
from gait_lab.trial_files import write_csv_forces, write_csv_markers

from afo_sim.common import InputError, with_code
from afo_sim.gait_lab import Choices, Markers, import_gait, read_options
from afo_sim.gait_lab.trial.events import period_by_motion
from afo_sim.gait_lab.trial.leg_motion import LegMotion, from_points
from afo_sim.gait_lab.trial.marker_legs import legs_from_markers
from afo_sim.gait_lab.trial.walking_frame import find_frame

PERIOD = Walker().stride_time
FULL = Laboratory(seconds=3.2 * PERIOD, ideal=True)
WALKER = FULL.walker


def files(folder: pathlib.Path, lab: Laboratory) -> list[pathlib.Path]:
    return [
        write_csv_markers(folder / "markers.csv", lab.time, lab.markers(SET)),
        write_csv_forces(folder / "forces.csv", lab.plates()),
    ]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    """The ankle moment of the same walk in a recording of three strides [N·m/kg]."""
    folder = tmp_path_factory.mktemp("whole")
    return import_gait(files(folder, FULL), Choices(mass=WALKER.mass)).cycle.ankle_moment


LENGTHS = [0.97, 1.0, 1.05, 1.1, 1.2, 1.3]
CUTS = [(length, 0, 100.0) for length in LENGTHS]
CUTS += [(0.97, 9, 100.0), (1.0, 6, 100.0), (1.0, 9, 100.0), (0.97, 0, 250.0)]
CASES = [(*cut, begun) for cut in CUTS for begun in np.arange(0.0, 1.0, 0.05)]


@pytest.mark.parametrize(
    "length, early, rate, begun", CASES[:: size(13, 1)]
)  # every cut, and most beginnings
def test_a_trimmed_recording_gives_the_same_walk(
    tmp_path: pathlib.Path, whole: np.ndarray, length: float, early: int, rate: float, begun: float
) -> None:
    """`early`: samples that the plates lack at the end; without 6 or 9 of 2 ms they stop 4 or 10 ms, a
    sample, before the motion. Cameras are faster than the walk needs at 250 Hz."""
    lab = dataclasses.replace(FULL, seconds=length * PERIOD, began=0.5 + begun * PERIOD, rate=rate)
    trial = files(tmp_path, lab)
    rows = trial[1].read_text().splitlines(keepends=True)
    trial[1].write_text("".join(rows[: len(rows) - early]))
    choices = dataclasses.replace(read_options({}), walker="healthy")  # no side is asked for
    found = import_gait(trial, choices)
    assert found.mass.mass == pytest.approx(WALKER.mass, rel=0.02)
    assert found.cycle.stride_time == pytest.approx(PERIOD, rel=0.01)
    error = found.cycle.ankle_moment - whole
    assert np.sqrt(np.mean(error**2)) < 0.05
    if begun == 0.0:
        assert import_gait(trial, dataclasses.replace(choices, mass=WALKER.mass)).mass.how == "given"


@pytest.mark.parametrize("gait", ["gatk_stride1", "bovi2011_xs", "bovi2011_m"])
@pytest.mark.parametrize("legs", ["both", "one"])
def test_the_period_of_a_cut_of_unlike_strides_is_the_stride(gait: str, legs: str) -> None:
    """Strides that differ by up to 32 mm: the first return counts, no longer time that is hardly covered."""
    wrong = []
    for seed in range(2):
        walker = Walker(seed=seed, uneven=2.0, gait=gait)
        period = walker.stride_time
        for length, begun in itertools.product((1.1, 1.3, 1.6), (0.05, 0.4, 0.75)):
            lab = Laboratory(walker, began=0.5 + begun * period, seconds=length * period, ends=0.0)
            motions = motions_of(lab)
            found = period_by_motion(motions["right"], motions["left"] if legs == "both" else None)
            time = np.linspace(lab.time[0] - 0.5, lab.time[-1] + 0.5, 2000)
            middle = np.interp(lab.time.mean(), time, walker.phase("right", time))
            true = np.diff(np.interp(middle + np.array([-0.5, 0.5]), walker.phase("right", time), time))[0]
            if isinstance(found, str) or abs(found / true - 1.0) > 0.02:
                wrong.append((seed, length, begun, found))
    assert wrong == []


def motions_of(lab: Laboratory) -> dict[str, LegMotion]:
    markers = Markers(pathlib.Path("walk.trc"), lab.time, lab.markers(SET))
    legs = legs_from_markers(markers, Choices())
    frame = find_frame(legs, Choices())
    return {side: from_points(leg, frame, 10.0) for side, leg in legs.items()}


def test_the_other_side_is_taken_of_a_healthy_walker_and_said_and_of_no_other(tmp_path: pathlib.Path) -> None:
    trial = files(tmp_path, FULL)
    left = [plate for plate in FULL.plates() if plate.name == "l"]
    write_csv_forces(trial[1], left)
    either = dataclasses.replace(read_options({}), mass=WALKER.mass)
    found = import_gait(trial, dataclasses.replace(either, walker="healthy"))
    assert found.cycle.side == "left" and with_code(found.warnings, "other-side-taken")
    for asked in (dataclasses.replace(either, walker="patient"), Choices(mass=WALKER.mass, walker="healthy")):
        with pytest.raises(InputError, match="side = 'right'") as refused:
            import_gait(trial, asked)
        assert "left" in refused.value.allowed


def test_the_other_side_is_taken_where_a_leg_is_lost_but_not_with_markers_or_a_stride_of_that_side(
    tmp_path: pathlib.Path,
) -> None:
    trial, markers = files(tmp_path, FULL), FULL.markers(SET)
    unseen = (FULL.time % 1.0 > 0.4)[:, None]  # for 0.6 s of each second
    lost = {n: np.where(unseen & (n[0] == "R" and n[1] in "LM"), np.nan, p) for n, p in markers.items()}
    write_csv_markers(trial[0], FULL.time, lost)
    either = dataclasses.replace(read_options({}), mass=WALKER.mass, walker="healthy")
    assert import_gait(trial, either).cycle.side == "left"
    for asked in ({"markers": {"ankle": ("RLMAL", "RMMAL")}}, {"stride": 1}):
        with pytest.raises(InputError) as alone:
            import_gait(trial, dataclasses.replace(either, **asked))
    with pytest.raises(InputError) as refused:  # a patient's side is never guessed, but told
        import_gait(trial, dataclasses.replace(either, walker="patient"))
    assert "left" in refused.value.allowed and alone.value.allowed in refused.value.allowed


def test_one_cycle_of_each_side_is_refused(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match="import_sides"):
        import_gait(files(tmp_path, FULL), Choices(each=True))
