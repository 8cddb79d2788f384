"""Own contraction, the path's and what cuff and plate give are drawn so that they add up."""

import pathlib

import numpy as np
import pytest
from figures import lines, panel
from matplotlib.figure import Figure
from yielding import STIFFNESS, rigid_run, yielding_run

from afo_sim.description.reader import load
from afo_sim.show import panels, report_figures, run_figure
from afo_sim.show.run_view import RunView, alone
from afo_sim.simulation.recording import Recording


@pytest.fixture(scope="module")
def yielding() -> Recording:
    return yielding_run()


def test_a_muscle_is_shorter_than_its_path_asks_by_what_its_mountings_give(yielding: Recording) -> None:
    """Where it is taut: L0 (own − path) = z_cuff + z_plate + T/k."""
    group = load("scenario", yielding.scenario).orthosis.muscle["dorsiflexor"]
    axis = panel(panels.contractions, yielding)
    own, slack, path = (line.get_ydata() / 100.0 for line in axis.lines[1:4])
    force = yielding["muscle/dorsiflexor_1/force"]
    assert np.array_equal(np.isfinite(own), force > 0.0)
    assert np.isfinite(slack[force <= 0.0]).all()
    taut = force > 0.0
    given = 3.0 * force * sum(1.0 / k for k in STIFFNESS.values()) + force / group.cable.stiffness
    assert group.type.nominal_length * (own - path)[taut] == pytest.approx(given[taut], abs=1e-9)
    assert given.max() > 0.005
    hangs = group.type.nominal_length * (path - slack)[~taut]
    assert hangs.min() > -1e-9 and hangs.max() > 0.005  # then its cable is longer than its way


def test_slack_is_dotted_and_taut_is_not(yielding: Recording) -> None:
    axis = panel(panels.contractions, yielding)
    labels = {line.get_label(): line for line in axis.lines}
    assert labels["dorsiflexor 1–3"].get_linestyle() == "-"
    assert labels["plantarflexor 1–2"].get_linestyle() == labels["slack"].get_linestyle() == ":"
    assert not yielding["muscle/plantarflexor_1/force"].any()


def test_mountings_are_drawn_under_the_pull_of_all_muscles(yielding: Recording) -> None:
    """Each gives by the sum of all tensions over its stiffness."""
    total = 3.0 * yielding["muscle/dorsiflexor_1/force"] + 2.0 * yielding["muscle/plantarflexor_1/force"]
    gives = lines(panel(panels.displacements, yielding))
    pull = lines(panel(panels.pulls, yielding))
    assert list(gives) == list(pull) == ["cuff", "plate"]
    for name, stiffness in zip(("cuff", "plate"), STIFFNESS.values(), strict=True):
        assert pull[name] == pytest.approx(total, abs=1e-9)
        assert gives[name] == pytest.approx(1e3 * total / stiffness, abs=1e-9)


def test_a_rigid_device_has_no_panels_of_its_mountings(yielding: Recording) -> None:
    rigid = rigid_run()
    assert len(report_figures.muscle_rows([alone(yielding)])) == 4
    assert len(report_figures.muscle_rows([alone(rigid)])) == 2
    first, second = pages = [Figure(), Figure()]
    report_figures.draw_muscles(pages, [alone(yielding), RunView("b", "#000000", rigid)], "time")
    assert [axis.axison for axis in first.axes] == [True] * 4
    assert [axis.axison for axis in second.axes] == [True] * 2 + [False] * 2
    for one, other in zip(first.axes, second.axes[:2], strict=False):
        assert one.get_ylim() == other.get_ylim(), "the same scale in both runs"


@pytest.mark.slow
def test_the_figure_of_muscles_is_written(yielding: Recording, tmp_path: pathlib.Path) -> None:
    for name in ("overview", "muscles", "force_contraction"):
        run_figure.FIGURES[name](yielding, tmp_path / f"{name}.svg")
        assert (tmp_path / f"{name}.svg").stat().st_size > 10_000
