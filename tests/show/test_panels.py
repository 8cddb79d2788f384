"""Panels: the air path, muscles and their mountings, what the electronics report."""

import dataclasses
import pathlib

import numpy as np
import pytest
from colour_vision import nearest
from figures import lines, panel
from matplotlib.figure import Figure
from yielding import STIFFNESS

import afo_sim
from afo_sim.description import load
from afo_sim.physics import AIR, CO2
from afo_sim.show import RunView, panels, report_figures, run_figure
from afo_sim.show.report import page, read_runs
from afo_sim.show.run_figure import electronics, plain_numbers
from afo_sim.show.run_view import alone
from afo_sim.simulation import Recording

APART = {"all cones": 0.12, "no green": 0.08, "no red": 0.08}  # least distances in OKLab
WAIST = {"orthosis": "s1_waist", "duration": "1 s"}


@pytest.fixture(scope="module")
def waist() -> Recording:
    """A bottle with a regulator, tubes, a manifold."""
    return afo_sim.run("seated", {**WAIST, "supply.source": "bottle_0_5l", "supply.regulator": "droop_tenth"})


@pytest.fixture(scope="module")
def cartridge() -> Recording:
    return afo_sim.run("seated", {"supply.source": "co2_16g", "duration": "1 s"})


def test_volumes_stand_beside_their_chambers(waist: Recording) -> None:
    axis = panel(panels.pressures, waist)
    drawn = lines(axis)
    for label, volume in {"manifold": "manifold", "dorsiflexor, valve end": "dorsiflexor_valve_end"}.items():
        assert np.array_equal(drawn[label], 1e-5 * waist[f"volume/{volume}/pressure"])
    thick = {line.get_label(): line.get_linewidth() for line in axis.lines}
    assert thick["manifold"] < thick["dorsiflexor"]
    # The supply's line is the regulator's outlet, which is not drawn twice, and droops below what is set.
    assert np.array_equal(drawn["supply"], 1e-5 * waist["volume/regulator/pressure"])
    assert not any("regulator" in label for label in drawn)
    assert drawn["supply, set"].min() == pytest.approx(4.0) and drawn["supply"].min() < 3.9
    looks = [(line.get_color(), line.get_linestyle(), line.get_marker()) for line in axis.lines]
    assert len(set(looks)) == len(looks)


def test_flow_is_what_the_bottle_loses(waist: Recording) -> None:
    """∫ Q dt of free air by its density against the fall of the bottle's mass."""
    drawn = lines(panel(run_figure._air_flow, waist))
    step = waist["time"][1] - waist["time"][0]
    free = drawn["from the supply"].sum() * step / 6e4  # [m³]
    lost = waist["store/source/mass"][0] - waist["store/source/mass"][-1]
    assert lost > 1e-5
    assert free * AIR.free_density == pytest.approx(lost, rel=0.02)


def test_a_name_of_a_figures_legend_is_of_one_line(waist: Recording) -> None:
    """A legend tells each name once, of all panels of a figure."""
    pressure, flow = panel(panels.pressures, waist), panel(run_figure._air_flow, waist)
    assert not lines(pressure).keys() & lines(flow).keys()


def test_valves_of_no_chamber_have_a_lane() -> None:
    purge = {"kind": "valve", "valve": "mh1", "upstream": "manifold"}
    times = {"timer.purge.open": [["0 s", "0.5 s"]]}
    run = afo_sim.run("seated", {**WAIST, "orthosis.restriction.purge": purge, **times})
    axis = panel(panels.valves, run)
    assert [label.get_text() for label in axis.get_yticklabels()][-2:] == ["plantarflexor outlet", "purge"]
    path = axis.collections[-1].get_paths()[0]
    assert path.contains_point((0.3, 4)) and not path.contains_point((0.8, 4))


def test_litres_are_of_the_gas_that_flows(cartridge: Recording) -> None:
    drawn = lines(panel(run_figure._air_flow, cartridge))
    expected = 6e4 * cartridge["supply/mass_flow"] / CO2.free_density
    assert drawn["from the supply"] == pytest.approx(expected, rel=1e-12) and expected.max() > 1.0


def test_without_an_air_path_there_are_no_such_panels(seated: Recording) -> None:
    from afo_sim.show.rerun.curves import curves, plots_of
    from afo_sim.show.rerun.run_rows import from_recording

    run = alone(seated)
    assert (run.volumes, run.source, run_figure.flows(run)) == ({}, "", [])
    assert set(lines(panel(panels.pressures, seated))) == {"supply", "dorsiflexor", "plantarflexor"}
    assert "/air" not in plots_of(curves(from_recording(seated)))


@pytest.mark.usefixtures("undrawn")
def test_the_report_has_the_source_of_runs_with_one(
    waist: Recording, seated: Recording, tmp_path: pathlib.Path
) -> None:
    with_source, plain = waist.save(tmp_path / "bottle", rrd=False), seated.save(tmp_path / "bare", rrd=False)
    both = page(read_runs([with_source, plain]))
    assert "Source of air" in both and "litres of free air" in both
    alone_page = page(read_runs([plain]))
    assert "Source of air" not in alone_page and "air flow" not in alone_page
    for quantity in panels.QUANTITIES:
        drawn = panel(lambda axis, runs, q=quantity: panels.source(axis, runs[0], q), waist)
        values = drawn.lines[0].get_ydata()
        assert len(values) == len(waist["time"]) and np.isfinite(values).all()
    kelvin = waist["store/source/temperature"]
    assert values == pytest.approx(kelvin - 273.15)


@pytest.mark.parametrize("vision", APART)
def test_the_viewers_lines_are_told_apart_and_volumes_thin(waist: Recording, vision: str) -> None:
    from afo_sim.show.rerun.curves import curves, plots_of
    from afo_sim.show.rerun.run_rows import from_recording

    plots = plots_of(curves(from_recording(waist)))
    pressure = plots["/pressure"]
    assert {"dorsiflexor", "manifold", "exhaust", "supply", "dorsiflexor, valve end"} <= {
        line.name for line in pressure
    }
    assert nearest([line.colour for line in pressure], vision) >= APART[vision]
    manifold = next(line for line in pressure if line.name == "manifold")
    block = {manifold.column: waist["volume/manifold/pressure"]}
    assert np.array_equal(manifold.values(block), 1e-5 * waist["volume/manifold/pressure"])
    widths = {line.name: line.width for line in pressure}
    assert widths["manifold"] < widths["dorsiflexor"]
    assert [line.name for line in plots["/air"]] == ["from the supply", "to the ambient air"]


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


def test_a_rigid_device_has_no_panels_of_its_mountings(yielding: Recording, rigid: Recording) -> None:
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


SINE = {"amplitude": "3 deg", "frequency": "1 Hz"}
PID = {
    "rate": "100 Hz",
    "pid": {
        "angle": {"proportional_band": "5 deg", "reference": {"amplitude": "3 deg", "frequency": "1 Hz"}}
    },
}


@pytest.fixture(scope="module")
def run() -> Recording:
    return afo_sim.run("seated", {"timer": None, "controller": PID, "duration": "1 s"})


def test_the_output_is_drawn_over_time(run: Recording) -> None:
    axis = Figure().subplots()
    electronics(axis, [alone(run)])
    (line,) = axis.lines
    assert line.get_label() == "output" and np.array_equal(line.get_ydata(), run["controller/output"])


def test_the_angle_that_is_asked_for_stands_beside_the_angle(run: Recording) -> None:
    axis = Figure().subplots()
    panels.angle(axis, [alone(run)])
    asked = next(line for line in axis.lines if line.get_label() == "asked for")
    assert np.max(asked.get_ydata()) == pytest.approx(3.0, abs=1e-6)  # [deg], the sine's amplitude


def test_a_run_without_controller_has_no_such_panel(run: Recording) -> None:
    columns = {name: values for name, values in run.columns.items() if "controller" not in name}
    assert plain_numbers(run) == ["controller/output"]
    assert plain_numbers(dataclasses.replace(run, columns=columns)) == []
