"""Files of spreads: what they say, what is wrong with them, and what a scenario has of it."""

import dataclasses
import math
import pathlib

import numpy as np
import pytest
from scipy import stats
from spread_tables import spread, spreads_file

from afo_sim.common import InputError, assets, format_quantity
from afo_sim.description import Scenario, load
from afo_sim.lab import fit
from afo_sim.physics import LAWS
from afo_sim.study.engine import outcomes
from afo_sim.study.uncertainty.draw import Applied, applied, draw
from afo_sim.study.uncertainty.spreads import Distribution, Kind, read

CUFF = spread("cuff", "lognormal", key="orthosis.anchor.shank.stiffness", factor_sd=0.35)
NORMAL = spread("cuff", "normal", key="orthosis.anchor.shank.stiffness", sd="0.5 kN/m")


@pytest.fixture(scope="module")
def walk() -> Scenario:
    found: Scenario = load("scenario", "walk-dropfoot-afo")
    return found


def applied_to(folder: pathlib.Path, text: str, scenario: Scenario) -> Applied:
    return applied(read(spreads_file(folder, text)), scenario)


def refused(folder: pathlib.Path, text: str, scenario: Scenario) -> InputError:
    with pytest.raises(InputError) as caught:
        applied_to(folder, text, scenario)
    return caught.value


def test_every_shipped_file_fits_the_shipped_walk(walk: Scenario) -> None:
    for name in assets.names("uncertainty"):
        found = applied(read(name), walk)
        assert found.unknowns and found.fits and not found.notes
        # its fit draws the ends, and it states no tube
        left_out = {line.partition(":")[0] for line in found.left_out}
        assert left_out == {"ends", "tube_modulus", "tube_wall"}


def test_the_own_value_stands_in_the_middle(tmp_path: pathlib.Path, walk: Scenario) -> None:
    valves = ["orthosis.chamber.*.inlet.conductance", "orthosis.chamber.*.outlet.conductance"]
    text = (
        spread("valve", "normal", keys=valves, relative_sd=0.1)
        + spread("links", "normal", key="orthosis.muscle.*.link_length", sd="2 mm")
        + spread("pace", "normal", key="gait.stride_time", each_stride=True, relative_sd=0.03)
    )
    valve, links, pace = applied_to(tmp_path, text, walk).unknowns
    (target,) = valve.targets
    own = walk.orthosis.chamber["dorsiflexor"].inlet.conductance
    assert len(target.keys) == 4 and target.own == own
    assert target.distribution.width == pytest.approx(0.1 * own)
    assert [each.own for each in links.targets] == pytest.approx([0.112, 0.115])
    assert [each.distribution.width for each in links.targets] == pytest.approx([0.002, 0.002])
    assert pace.targets[0].own == pytest.approx(1.0929)  # gait_data/bovi2011_natural.csv
    assert pace.targets[0].distribution.width == pytest.approx(0.03 * 1.0929)


def test_bounds_are_those_of_the_field_and_of_the_table(tmp_path: pathlib.Path, walk: Scenario) -> None:
    text = spread("tissue", "lognormal", key="patient.passive_scale", factor_sd=0.5, at_most=4.0)
    ((target,),) = (unknown.targets for unknown in applied_to(tmp_path, text, walk).unknowns)
    assert (target.distribution.lower, target.distribution.upper) == (0.0, 4.0)


def test_what_is_cut_off_at_a_bound_is_told(tmp_path: pathlib.Path, walk: Scenario) -> None:
    text = CUFF.replace('key = "orthosis.anchor.shank.stiffness"', 'key = "patient.passive_scale"')
    found = applied_to(tmp_path, text.replace("factor_sd = 0.35", "factor_sd = 0.5\nat_most = 1.1"), walk)
    beyond = 0.5 * math.erfc(math.log(1.1) / 0.5 / math.sqrt(2.0))
    assert f"{100 * beyond:.0f} %" in found.notes[0]


@pytest.mark.parametrize("scenario", ["walk-dropfoot", "walk-healthy"])
def test_without_an_orthosis_its_parts_are_left_out_and_told(scenario: str) -> None:
    found = applied(read("usual"), load("scenario", scenario))
    assert {unknown.name for unknown in found.unknowns} >= {"tissue", "toe_extension", "pace", "swing_path"}
    assert not found.fits
    assert {line.partition(":")[0] for line in found.left_out} >= {"muscle_fit", "bore", "cuff", "inlet"}


def test_a_rigid_cuff_is_left_out(walk: Scenario) -> None:
    table = walk.resolved()
    table["orthosis"]["anchor"] = {}
    found = applied(read("usual"), load("scenario", table))
    told = [line.partition(":")[0] for line in found.left_out]
    assert "cuff" in told and "plate" in told and "bore" not in told


def test_a_recorded_path_has_no_error_of_a_derived_one(walk: Scenario) -> None:
    recorded = walk.set({"gait.cycle": "opensim_walk"})
    found = applied(read("usual"), recorded)
    assert "own_walking" not in {unknown.name for unknown in found.unknowns}
    assert any(line.startswith("own_walking: ") for line in found.left_out)


def test_a_speed_has_no_stride_time_beside_it(walk: Scenario) -> None:
    found = applied(read("usual"), walk.set({"gait.speed": "1.3 m/s"}))
    assert any("gait.stride_time has no value here" in line for line in found.left_out)


FORCE = spread(
    "specimen",
    "lognormal",
    key="orthosis.muscle.*.type.force_factor",
    factor_sd=0.15,
    factor_sd_measured=0.03,
)


def test_a_measured_muscle_is_drawn_less_widely_and_along_with_the_others(
    tmp_path: pathlib.Path, walk: Scenario
) -> None:
    own = {"value": "200 N", "kind": "user", "source": "pulled"}
    one = walk.set({"orthosis.muscle.plantarflexor.type.blocked_force": own})
    wide = {"dorsiflexor": 0.15, "plantarflexor": 0.15}
    of_contraction = FORCE.replace("force_factor", "contraction_factor")
    for text, scenario, widths in (
        (FORCE, walk, wide),
        (FORCE, one, wide | {"plantarflexor": 0.03}),
        (of_contraction, one, wide),  # its force was measured, and not its contraction
    ):
        ((unknown,), count) = (applied_to(tmp_path, text, scenario).unknowns, len(set(widths.values())))
        found = {key.split(".")[2]: t.distribution.width for t in unknown.targets for key in t.keys}
        assert found == widths and len(unknown.targets) == count
    # one deviate: both rise together, each by its own width
    columns = draw(applied_to(tmp_path, FORCE, one), one, 50).columns
    first, second = (
        np.log(column.values) / width for column, width in zip(columns, (0.15, 0.03), strict=True)
    )
    assert first == pytest.approx(second)


def test_a_muscle_that_was_fitted_is_measured(tmp_path: pathlib.Path, walk: Scenario) -> None:
    table = assets.folder("models") / "muscles/s1_215mm/table_1.csv"
    muscle = fit(table, law="tondu_lopez_2000_bladder", hold_out="none").muscle.model_dump(mode="json")
    groups = ("dorsiflexor", "plantarflexor")
    fitted = walk.set({f"orthosis.muscle.{group}.type": muscle for group in groups})
    for factor in ("force_factor", "contraction_factor"):
        (unknown,) = applied_to(tmp_path, FORCE.replace("force_factor", factor), fitted).unknowns
        assert [target.distribution.width for target in unknown.targets] == [0.03]


def test_a_force_that_cannot_be_scaled_is_left_out(
    tmp_path: pathlib.Path, walk: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    law = walk.orthosis.muscle["dorsiflexor"].type.law
    monkeypatch.setitem(LAWS, law, dataclasses.replace(LAWS[law], force_powers=()))
    found = applied_to(tmp_path, FORCE, walk)
    assert not found.unknowns and all("cannot be scaled" in line for line in found.left_out)
    assert applied_to(tmp_path, FORCE.replace("force_factor", "contraction_factor"), walk).unknowns


@pytest.mark.parametrize("fit_first", [True, False])
def test_a_fit_has_precedence_wherever_it_stands(
    tmp_path: pathlib.Path, walk: Scenario, fit_first: bool
) -> None:
    fit = spread("muscle_fit", fit="orthosis.muscle.*.type")
    ends = spread("ends", "normal", key="orthosis.muscle.*.type.end_length", sd="2 mm")
    found = applied_to(tmp_path, fit + ends if fit_first else ends + fit, walk)
    assert not found.unknowns and len(found.fits) == 1
    assert len(found.left_out) == 2 and all("drawn with the fit" in line for line in found.left_out)
    (unknown,) = applied_to(tmp_path, ends, walk).unknowns  # without the fit they are drawn
    assert unknown.targets[0].own == pytest.approx(0.0519)


def test_nothing_is_relative_to_zero(tmp_path: pathlib.Path, walk: Scenario) -> None:
    text = CUFF.replace("orthosis.anchor.shank.stiffness", "orthosis.muscle.*.type.return_stiffness")
    found = applied_to(tmp_path, text, walk)
    assert not found.unknowns and len(found.left_out) == 2 and "zero" in found.left_out[0]


@pytest.mark.parametrize(
    ("text", "field", "said"),
    [
        (CUFF.replace("lognormal", "lognorml"), "parameters.cuff.distribution", "lognorm"),
        (CUFF.replace("factor_sd", "factr_sd"), "parameters.cuff.factr_sd", "factor_sd"),
        (CUFF.replace("factor_sd = 0.35", "sd = '1 kN/m'"), "parameters.cuff.sd", "factor_sd"),
        (CUFF.replace("0.35", "-0.35"), "parameters.cuff.factor_sd", ""),
        (CUFF.replace("stiffness", "stifness"), "parameters.cuff", "stiffness"),
        (CUFF.replace("orthosis.anchor.shank.stiffness", "patient"), "parameters.cuff", "number"),
        (CUFF.replace('kind = "assumed"\n', ""), "parameters.cuff.kind", ""),
        (CUFF + "fit = 'orthosis.muscle.*.type'\n", "parameters.cuff", "one of"),
        (CUFF + "factor_sd_measured = 0.03\n", "parameters.cuff.factor_sd_measured", "force_factor"),
        (NORMAL + "factor_sd_measured = 0.03\n", "parameters.cuff.factor_sd_measured", "factor_sd"),
        (CUFF + CUFF.replace("parameters.cuff", "parameters.strap"), "parameters.strap", "'cuff'"),
        (CUFF.replace('key = "orthosis.anchor.shank.stiffness"', 'fit = "orthosis.muscle"'), "", "fit"),
        (NORMAL.replace('"0.5 kN/m"', '"-1 kN/m"'), "parameters.cuff.sd", "is below zero"),
        (NORMAL.replace('"0.5 kN/m"', "nan"), "parameters.cuff.sd", "is not finite"),
        (NORMAL.replace('"0.5 kN/m"', '["1 kN/m"]'), "parameters.cuff.sd", "is not a quantity"),
        (NORMAL.replace('"0.5 kN/m"', '"wide"'), "parameters.cuff.sd", "is not a quantity"),
        (NORMAL.replace('"0.5 kN/m"', '"3 mm"'), "parameters.cuff.sd", "N/m"),
        (NORMAL.replace('sd = "0.5 kN/m"', "relative_sd = 2.0"), "parameters.cuff.relative_sd", "at most 1"),
        (NORMAL.replace('"a test"', '""'), "parameters.cuff.source", "is empty"),
        (NORMAL.replace("orthosis.anchor.shank.stiffness", "timestep"), "", "is not a property of orthosis"),
        (NORMAL.replace("orthosis.anchor.shank.stiffness", "limits.bottle_volume"), "", "is not a property"),
        (NORMAL.replace("anchor.shank.stiffness", "muscle.*.foo"), "", "fits no key of any scenario"),
        (NORMAL + "relative_sd = 0.1\n", "parameters.cuff.sd", "sd or relative_sd"),
        (NORMAL + 'at_least = "nan kN/m"\n', "parameters.cuff.at_least", "is not"),
        (NORMAL + 'at_least = "8 kN/m"\n', "parameters.cuff.at_least", "allowed: at most 4000 N/m"),
        ("description = 'nothing'\n", "parameters", ""),
        ("[parameters]\n", "parameters", ""),
    ],
)
def test_what_is_wrong_names_field_and_what_is_allowed(
    tmp_path: pathlib.Path, walk: Scenario, text: str, field: str, said: str
) -> None:
    error = refused(tmp_path, text, walk)
    assert error.file == tmp_path / "spreads.toml"
    assert error.field.startswith(field or "parameters.cuff") and said in str(error)


def test_a_misspelt_name_is_told_with_the_nearest() -> None:
    with pytest.raises(InputError) as caught:
        read("usal")
    assert caught.value.field == "spreads" and caught.value.nearest == "usual"


@pytest.mark.slow
def test_no_usual_spread_lifts_the_toe_whichever_way_it_goes() -> None:
    """One that did would make a device look safer, the less is known of it."""
    scenario = load("scenario", "walk-dropfoot-afo", {"timestep": "4 ms", "duration": "4 s"})
    ways: list[dict[str, str]] = []
    for unknown in applied(read("usual"), scenario).unknowns:
        for deviate in (-1.0, 1.0):
            values = [(t, float(t.distribution.at(np.array([deviate]), t.own)[0])) for t in unknown.targets]
            ways.append({k: format_quantity(value, t.unit) for t, value in values for k in t.keys})
    found = dict(outcomes(scenario.resolved(), enumerate([{}, *ways]), 1))
    own, *heights = (float(found[k].metrics["toe_clearance"]) for k in range(len(found)))
    both = np.array(heights).reshape(-1, 2) - own  # [mm]
    assert np.abs(both).max() > 2.0
    assert np.all(both.min(axis=1) <= 0.2)


EVEN = stats.norm.ppf((np.arange(200_000) + 0.5) / 200_000)  # deviates at even shares


def moments(distribution: Distribution, own: float) -> tuple[float, float, float]:
    found = distribution.at(EVEN, own)
    return float(found.mean()), float(found.std()), float(stats.skew(found))


def test_normal_has_its_standard_deviation_about_the_own_value() -> None:
    assert moments(Distribution("normal", 0.3), 5.0) == pytest.approx((5.0, 0.3, 0.0), abs=1e-3)


def test_lognormal_has_the_own_value_as_its_median() -> None:
    found = Distribution("lognormal", 0.5).at(EVEN, 4000.0)
    assert np.median(found) == pytest.approx(4000.0, rel=1e-4)
    assert found.mean() == pytest.approx(4000.0 * math.exp(0.5 * 0.5**2), rel=1e-3)
    low, high = np.quantile(found, stats.norm.cdf([-1.0, 1.0]))
    assert high / low == pytest.approx(math.exp(2 * 0.5), rel=1e-3)


def test_uniform_reaches_from_end_to_end() -> None:
    found = Distribution("uniform", 5.0).at(EVEN, 11.0)
    assert (found.min(), found.max()) == pytest.approx((6.0, 16.0), abs=1e-4)
    assert found.std() == pytest.approx(10.0 / math.sqrt(12.0), rel=1e-4)


def test_pearson3_has_mean_deviation_and_skew() -> None:
    assert moments(Distribution("pearson3", 3.0, skew=0.6), 0.0) == pytest.approx((0.0, 3.0, 0.6), abs=5e-3)


@pytest.mark.parametrize("kind", ["normal", "lognormal", "uniform", "pearson3"])
def test_zero_width_is_the_own_value_to_the_bit(kind: Kind) -> None:
    skew = 0.6 if kind == "pearson3" else 0.0
    assert (Distribution(kind, 0.0, skew).at(EVEN[::1000], 0.1 + 0.2) == 0.1 + 0.2).all()


@pytest.mark.parametrize(
    ("distribution", "own"),
    [
        (Distribution("normal", 1.0, lower=-0.5), 0.0),
        (Distribution("lognormal", 0.5, upper=1.2), 1.0),
        (Distribution("uniform", 5.0, lower=0.0), 2.0),
    ],
)
def test_nothing_lies_beyond_a_bound_and_nothing_is_heaped_up_at_it(
    distribution: Distribution, own: float
) -> None:
    found = distribution.at(EVEN, own)
    assert found.min() >= distribution.lower and found.max() <= distribution.upper
    assert len(np.unique(found)) > 0.99 * len(found)
    free = Distribution(distribution.kind, distribution.width).at(EVEN, own)
    inside = (free >= distribution.lower) & (free <= distribution.upper)
    # a distribution cut off is that of the free draws which lie within
    shares = np.linspace(0.02, 0.98, 25)
    assert np.quantile(found, shares) == pytest.approx(np.quantile(free[inside], shares), abs=2e-3)
    assert distribution.cut(own) == pytest.approx(1.0 - inside.mean(), abs=1e-4)
