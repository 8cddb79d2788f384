"""Volumes, flow and source of an air path in figures, report and the viewer; nothing of them without one."""

import pathlib

import numpy as np
import pytest
from colour_vision import VISIONS, nearest
from figures import lines, panel

import afo_sim
from afo_sim.physics.gas import AIR, CO2
from afo_sim.show import panels, run_figure
from afo_sim.show.report import page, read_runs
from afo_sim.show.rerun.curves import curves, plots_of
from afo_sim.show.rerun.run_rows import from_recording
from afo_sim.show.run_view import alone
from afo_sim.simulation.recording import Recording

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
    run = alone(seated)
    assert (run.volumes, run.source, run.has_network, run_figure.flows(run)) == ({}, "", False, [])
    assert set(lines(panel(panels.pressures, seated))) == {"supply", "dorsiflexor", "plantarflexor"}
    assert "/air" not in plots_of(curves(from_recording(seated)))


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


@pytest.mark.parametrize("vision", VISIONS)
def test_the_viewers_lines_are_told_apart_and_volumes_thin(waist: Recording, vision: str) -> None:
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
