"""Sweeps as they are described: parameters, designs, constraints, and everything that is refused."""

import itertools
import json
import math
import pathlib
import sys
import tomllib
from typing import Any

import numpy as np
import pytest
from campaign import NIGHTLY, size
from command import Call
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from afo_sim.common import InputError, assets, units
from afo_sim.description import load
from afo_sim.study import cases_of, design, sweep_plan
from afo_sim.study.design import Cases
from afo_sim.study.parameter import Normal

PRESSURE = '[parameters.pressure]\nkey = "supply.pressure"\nfrom = "2 bar"\nto = "6 bar"\n'
ARM = "orthosis.muscle.dorsiflexor.insertion.from_joint[0]"
THREE = (
    PRESSURE
    + '[parameters.start]\nkey = "phases.dorsiflexor.inlet[0][0]"\nfrom = 0.45\nto = 0.75\n'
    + '[parameters.end]\nkey = "phases.dorsiflexor.inlet[0][1]"\nfrom = 0.7\nto = 1.0\n'
)


def written(folder: pathlib.Path, head: str, parameters: str = PRESSURE) -> pathlib.Path:
    file = folder / "sweep.toml"
    text = head if "scenario" in head else f'scenario = "walk-dropfoot-afo"\n{head}'
    file.write_text(f"{text}\n{parameters}", encoding="utf-8")
    return file


def cases(folder: pathlib.Path, head: str, parameters: str = PRESSURE, **options: int) -> Cases:
    return cases_of(sweep_plan.read(written(folder, head, parameters)), **options)


def refused(folder: pathlib.Path, head: str, parameters: str = PRESSURE, **options: int) -> InputError:
    with pytest.raises(InputError) as caught:
        cases(folder, head, parameters, **options)
    return caught.value


# -- items of lists in --set ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("key", "says"),
    [
        ("orthosis.range_of_motion[2]", "there is no item [2]; allowed: [0] to [1]"),
        ("phases.dorsiflexor.inlet[0][0][0]", "is not a list"),
        ("supply.pressure[0]", "is not a list"),
        ("orthosis.range_of_motion[-1]", "is not a valid key"),
        ("orthosis.range_of_motion[0", "is not a valid key"),
        ("orthosis.range_of_motion[a]", "is not a valid key"),
        ("orthosis.muscle[0].count", "is a table of names, not a list"),
        ("orthosis.range_of_motion[0]", "has no unit"),
    ],
)
def test_items_that_are_not_there(key: str, says: str) -> None:
    with pytest.raises(InputError) as caught:
        load("scenario", "walk-dropfoot-afo", {key: 1.0})
    assert says in str(caught.value)


# -- designs ----------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_grid_is_the_full_product_in_order(tmp_path: pathlib.Path) -> None:
    found = cases(
        tmp_path,
        'design = "grid"',
        PRESSURE + 'steps = 3\n[parameters.arm]\nkey = "' + ARM + '"\nvalues = ["5 cm", "7 cm"]\n'
        '[parameters.patient]\nkey = "patient"\nvalues = ["drop-foot", "drop-foot-mild"]\n'
        '[parameters.count]\nkey = "orthosis.muscle.dorsiflexor.count"\nvalues = [3, 2]\n'
        '[parameters.noise]\nkey = "gait.seed"\nfrom_seed = true\n',
    )
    assert list(found.values) == ["pressure", "arm", "patient", "count", "noise"]
    assert [p.unit for p in found.plan.parameters] == ["Pa", "m", "", "", ""]
    rows = list(zip(*(found.values[name] for name in ("pressure", "arm", "patient", "count")), strict=True))
    wanted = itertools.product([2e5, 4e5, 6e5], [0.05, 0.07], ["drop-foot", "drop-foot-mild"], [3.0, 2.0])
    assert rows == list(wanted)
    assert found.values["noise"].tolist() == found.seeds.tolist()
    sets = found.sets(5)
    assert sets["orthosis.muscle.dorsiflexor.count"] == 2
    assert isinstance(sets["gait.seed"], int)
    scenario = load("scenario", "walk-dropfoot-afo", sets)
    assert scenario.supply.pressure == 2e5
    assert scenario.patient.name == "drop-foot"
    assert scenario.orthosis.muscle["dorsiflexor"].count == 2
    assert scenario.gait.seed == found.seeds[5]


@pytest.mark.slow
def test_a_latin_hypercube_has_one_sample_per_stratum_and_dimension(tmp_path: pathlib.Path) -> None:
    found = cases(tmp_path, 'design = "latin-hypercube"\ncases = 37', THREE)
    for name, low, high in (("pressure", 2e5, 6e5), ("start", 0.45, 0.75), ("end", 0.7, 1.0)):
        strata = np.floor((found.values[name] - low) / (high - low) * 37)
        assert sorted(strata) == list(range(37))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["random", "sobol"])
def test_the_first_cases_do_not_depend_on_how_many_follow(kind: str, tmp_path: pathlib.Path) -> None:
    head = f'design = "{kind}"\nseed = 5\nconstraints = ["start < end - 0.1"]\n'
    few = cases(tmp_path, f"{head}cases = 50", THREE)
    many = cases(tmp_path, f"{head}cases = 3000", THREE)
    for name in few.values:
        assert np.array_equal(few.values[name], many.values[name][:50])
    assert np.array_equal(few.seeds, many.seeds[:50])


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["random", "latin-hypercube", "sobol", "saltelli"])
def test_the_same_plan_makes_the_same_cases_and_another_seed_others(
    kind: str, tmp_path: pathlib.Path
) -> None:
    head = f'design = "{kind}"\ncases = 16\n'
    a, b = cases(tmp_path, head, THREE), cases(tmp_path, head, THREE)
    other = cases(tmp_path, f"{head}seed = 1", THREE)
    for name in a.values:
        assert np.array_equal(a.values[name], b.values[name])
        assert not np.array_equal(a.values[name], other.values[name])
    assert not set(a.seeds) & set(other.seeds)


def test_saltelli_is_its_scheme(tmp_path: pathlib.Path) -> None:
    """Per base sample: A, A with one column of B each, B with one column of A each, B."""
    found = cases(tmp_path, 'design = "saltelli"\ncases = 8', THREE)
    assert len(found) == 8 * (2 * 3 + 2)
    blocks = np.column_stack([*found.values.values()]).reshape(8, 8, 3)
    for rows in blocks:
        a, b = rows[0], rows[-1]
        for k in range(3):
            mixed = a.copy()
            mixed[k] = b[k]
            assert np.array_equal(rows[1 + k], mixed)
            mixed = b.copy()
            mixed[k] = a[k]
            assert np.array_equal(rows[4 + k], mixed)
    assert len(np.unique(blocks[:, 0, 0])) == 8


def test_saltelli_says_what_to_install(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "SALib.sample.sobol", None)
    assert "pip install 'afo-sim[study]'" in str(refused(tmp_path, 'design = "saltelli"\ncases = 8', THREE))


def test_a_list_is_read_row_by_row(tmp_path: pathlib.Path) -> None:
    (tmp_path / "cases.csv").write_text(
        "patient,pressure [bar],strength [%],arm\ndrop-foot,3,10,5 cm\ndrop-foot-mild,4.5,20,6 cm\n"
    )
    file = 'design = "list"\nfile = "cases.csv"'
    keys = (
        '[parameters.pressure]\nkey = "supply.pressure"\n'
        '[parameters.patient]\nkey = "orthosis.muscle.dorsiflexor.insertion.segment"\n'
        '[parameters.strength]\nkey = "patient.dorsiflexor_strength"\n'
        f'[parameters.arm]\nkey = "{ARM}"\n'
    )
    assert "'drop-foot'" in str(refused(tmp_path, file, keys))
    (tmp_path / "cases.csv").write_text(
        "patient,pressure [bar],strength [%],arm\nfoot,3,10,5 cm\nfoot,4.5,20,6 cm\n"
    )
    from_file = cases(tmp_path, file, keys)
    assert list(from_file.values) == ["pressure", "patient", "strength", "arm"]
    assert from_file.values["pressure"].tolist() == [3e5, 4.5e5]
    assert from_file.values["strength"].tolist() == [0.1, 0.2]
    assert from_file.values["arm"].tolist() == [0.05, 0.06]
    told = cases(
        tmp_path,
        'design = "list"',
        '[parameters.pressure]\nkey = "supply.pressure"\nvalues = ["3 bar", "4.5 bar"]\n'
        f'[parameters.arm]\nkey = "{ARM}"\nvalues = ["5 cm", "6 cm"]\n',
    )
    for name in told.values:
        assert np.array_equal(told.values[name], from_file.values[name])


# -- spreads ----------------------------------------------------------------------------------------------


def test_normal_quantiles_are_scipys(tmp_path: pathlib.Path) -> None:
    """Where the hypercube's coordinate is u, the value is the distribution's quantile of u."""
    head = 'design = "sobol"\ncases = 64\n'
    even = cases(
        tmp_path, head, '[parameters.m]\nkey = "patient.dorsiflexor_strength"\nfrom = 0.0\nto = 1.0\n'
    )
    u = even.values["m"]
    told = '[parameters.m]\nkey = "patient.body_mass"\ndistribution = '
    normal = cases(tmp_path, head, told + '"normal"\nmean = "75 kg"\nsd = "10 kg"\n')
    assert normal.values["m"] == pytest.approx(stats.norm(75.0, 10.0).ppf(u), rel=1e-10)
    cut = cases(
        tmp_path, head, told + '"normal"\nmean = "75 kg"\nsd = "10 kg"\nfrom = "70 kg"\nto = "90 kg"\n'
    )
    low, high = stats.norm(75.0, 10.0).cdf([70.0, 90.0])
    assert cut.values["m"] == pytest.approx(stats.norm(75.0, 10.0).ppf(low + u * (high - low)), rel=1e-9)
    logs = cases(tmp_path, head, told + '"lognormal"\nmedian = "75 kg"\nsd = 0.1\n')
    assert logs.values["m"] == pytest.approx(stats.lognorm(0.1, scale=75.0).ppf(u), rel=1e-10)
    from_zero = Normal(75.0, 0.1, 0.0, math.inf, of_logarithm=True)
    assert from_zero.at(u) == pytest.approx(logs.values["m"], rel=1e-12)


def test_a_log_scale_is_even_in_ratios(tmp_path: pathlib.Path) -> None:
    told = '[parameters.c]\nkey = "leg.friction"\nfrom = "0.01 N*m"\nto = "10 N*m"\nscale = "log"\n'
    grid = cases(tmp_path, 'design = "grid"', told + "steps = 4\n")
    assert grid.values["c"] == pytest.approx([0.01, 0.1, 1.0, 10.0], rel=1e-12)
    drawn = cases(tmp_path, 'design = "latin-hypercube"\ncases = 30', told)
    strata = np.floor(np.log10(drawn.values["c"] / 0.01) * 10.0)
    assert sorted(strata) == list(range(30))


def test_whole_numbers_and_words_are_drawn_by_equal_shares(tmp_path: pathlib.Path) -> None:
    found = cases(
        tmp_path,
        'design = "sobol"\ncases = 1024',
        '[parameters.count]\nkey = "orthosis.muscle.dorsiflexor.count"\nfrom = 1\nto = 4\n'
        '[parameters.patient]\nkey = "patient"\nvalues = ["drop-foot", "healthy"]\n',
    )
    values, often = np.unique(found.values["count"], return_counts=True)
    assert values.tolist() == [1.0, 2.0, 3.0, 4.0]
    assert often.tolist() == [256] * 4
    assert np.unique(found.values["patient"].astype(str), return_counts=True)[1].tolist() == [512] * 2


def test_one_parameter_sets_several_keys_alike(tmp_path: pathlib.Path) -> None:
    keys = [f"orthosis.chamber.{c}.inlet.conductance" for c in ("dorsiflexor", "plantarflexor")]
    found = cases(
        tmp_path,
        'design = "random"\ncases = 2',
        f'[parameters.c]\nkeys = {keys}\nfrom = "1e-10 m^3/(s*Pa)"\nto = "0.1 dm^3/(s*bar)"\n',
    )
    scenario = load("scenario", "walk-dropfoot-afo", found.sets(1))
    for chamber in scenario.orthosis.chamber.values():
        assert chamber.inlet.conductance == found.values["c"][1]


def test_a_laws_own_parameter(tmp_path: pathlib.Path) -> None:
    muscle = load("muscle", "s1_215mm")
    name, value = next((n, v) for n, v in muscle.law_set.parameters.items() if v > 0.0)
    from afo_sim.physics import LAWS

    unit = LAWS[muscle.law].parameter(name).unit
    low, high = (units.format_quantity(f * value, unit) for f in (0.9, 1.1))
    key = f"orthosis.muscle.dorsiflexor.type.laws.{muscle.law}.{name}"
    told = f"[parameters.k]\nkey = {json.dumps(key)}\nfrom = {json.dumps(low)}\nto = {json.dumps(high)}\n"
    found = cases(tmp_path, 'design = "random"\ncases = 3', told)
    assert found.plan.parameters[0].unit == unit
    scenario = load("scenario", "walk-dropfoot-afo", found.sets(2))
    assert scenario.orthosis.muscle["dorsiflexor"].type.law_set.parameters[name] == found.values["k"][2]


def test_every_case_has_its_own_seed_and_not_the_neighbours() -> None:
    seeds = design.case_seeds(0, 5000)
    assert seeds.dtype == np.uint32
    assert len(set(seeds)) == 5000
    assert seeds[17] == np.random.SeedSequence([0, 17]).generate_state(1)[0]
    assert np.array_equal(design.case_seeds(0, 20), seeds[:20])


# -- exactness --------------------------------------------------------------------------------------------


def has_magnitude(value: float) -> bool:
    """A smaller number would be 0, as a rest of rounding."""
    return not 0.0 < abs(value) < 1e-9


@pytest.mark.slow
@settings(derandomize=not NIGHTLY, deadline=None, max_examples=size(25, 100))
@given(
    pressure=st.floats(1.0, 2e6, exclude_min=True),
    x=st.floats(-2.0, 2.0).filter(has_magnitude),
    strength=st.floats(0.0, 1.0).filter(has_magnitude),
    offset=st.floats(-0.35, 0.35).filter(has_magnitude),
    inlet=st.floats(1e-15, 1e-6),
)
def test_the_scenario_gets_exactly_the_cases_values(
    pressure: float, x: float, strength: float, offset: float, inlet: float, tmp_path_factory: Any
) -> None:
    told = {
        "supply.pressure": (pressure, "Pa"),
        ARM: (x, "m"),
        "patient.dorsiflexor_strength": (strength, ""),
        "gait.ankle_offset": (offset, "rad"),
        "orthosis.chamber.dorsiflexor.inlet.conductance": (inlet, "m^3/(s*Pa)"),
    }
    values = {k: json.dumps(f"{v!r} {unit}") if unit else repr(v) for k, (v, unit) in told.items()}
    text = "".join(
        f"[parameters.p{n}]\nkey = '{k}'\nvalues = [{v}]\n" for n, (k, v) in enumerate(values.items())
    )
    found = cases(tmp_path_factory.mktemp("exact"), 'design = "grid"', text)
    scenario = load("scenario", "walk-dropfoot-afo", found.sets(0))
    read = (
        scenario.supply.pressure,
        scenario.orthosis.muscle["dorsiflexor"].insertion.from_joint[0],
        scenario.patient.dorsiflexor_strength,
        scenario.gait.ankle_offset,
        scenario.orthosis.chamber["dorsiflexor"].inlet.conductance,
    )
    assert read == tuple(v for v, _ in told.values())
    assert read == tuple(found.values[f"p{n}"][0] for n in range(len(told)))


# -- constraints ------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "holds"),
    [
        ("start < end - 0.05", lambda v: v["start"] < v["end"] - 0.05),
        ("pressure <= '4 bar' or end < 0.8", lambda v: (v["pressure"] <= 4e5) | (v["end"] < 0.8)),
        ("not (start > 0.5 and end > 0.9)", lambda v: ~((v["start"] > 0.5) & (v["end"] > 0.9))),
        ("0.5 < start <= 0.6 < end", lambda v: (v["start"] > 0.5) & (v["start"] <= 0.6) & (v["end"] > 0.6)),
        ("pressure * start / '1 bar' >= 2", lambda v: v["pressure"] * v["start"] / 1e5 >= 2.0),
        ("-start + 2 * end != 1", lambda v: -v["start"] + 2.0 * v["end"] != 1.0),
        ("pressure * '2 cm' * '3 cm' < '200 N'", lambda v: v["pressure"] * 6e-4 < 200.0),
        (
            "start + 0.1 < end and pressure > '3 bar' and end < 0.95 or end > 0.99",
            lambda v: (
                (v["start"] + 0.1 < v["end"]) & (v["pressure"] > 3e5) & (v["end"] < 0.95) | (v["end"] > 0.99)
            ),
        ),
    ],
)
@pytest.mark.parametrize("kind", ["random", "sobol"])
def test_constraints_against_the_whole_sample(
    kind: str, text: str, holds: Any, tmp_path: pathlib.Path
) -> None:
    head = f'design = "{kind}"\nseed = 3\n'
    every = cases(tmp_path, f"{head}cases = 4096", THREE)
    mask = holds(every.values)
    wanted = min(200, int(mask.sum()))
    kept = cases(tmp_path, f'{head}cases = {wanted}\nconstraints = ["{text}"]', THREE)
    for name in every.values:
        assert np.array_equal(kept.values[name], every.values[name][mask][:wanted])
    assert kept.dropped == np.flatnonzero(mask)[wanted - 1] + 1 - wanted


def test_constraints_on_a_grid_and_words(tmp_path: pathlib.Path) -> None:
    parameters = (
        PRESSURE + 'steps = 5\n[parameters.patient]\nkey = "patient"\nvalues = ["drop-foot", "healthy"]\n'
        f'[parameters.arm]\nkey = "{ARM}"\nvalues = ["5 cm", "6 cm"]\n'
    )
    texts = ["patient == 'drop-foot' or pressure < '3.5 bar'", "'healthy' != patient or arm == '5 cm'"]
    found = cases(tmp_path, f'design = "grid"\nconstraints = {texts}', parameters)
    wanted = [
        (p, patient, arm)
        for p in (2e5, 3e5, 4e5, 5e5, 6e5)
        for patient in ("drop-foot", "healthy")
        for arm in (0.05, 0.06)
        if (patient == "drop-foot" or p < 3.5e5) and (patient != "healthy" or arm == 0.05)
    ]
    assert list(zip(*found.values.values(), strict=True)) == wanted
    assert found.dropped == 20 - len(wanted)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("pressure <= 5", "different dimensions: 'pressure' in kilogram·meter^-1·second^-2 and '5' in bare"),
        ("pressure + start < '1 bar'", "different dimensions"),
        ("start < '3 s'", "different dimensions"),
        ("start < '20 deg'", "different dimensions"),
        ("presure < '5 bar'", "at character 1: 'presure' is not a parameter"),
        ("start < end and strat > 1", "at character 17: 'strat'"),
        ("'1 µm' < '1 m' and strat > 1", "at character 20: 'strat'"),
        ("pressure ** 2 > '1 Pa'", "is not allowed in a constraint"),
        ("__import__('os')", "is neither true nor false"),
        ("start.real < 1", "is not allowed in a constraint"),
        ("[x for x in (1,)] == start", "is not allowed in a constraint"),
        ("start", "is neither true nor false"),
        ("start < end + (start < end)", "is not allowed in a constraint"),
        ("start in (1, 2)", "is not a comparison"),
        ("start is 1", "is not a comparison"),
        ("start < True", "is not a number"),
        ("start < 1e999", "is not a number"),
        ("start < 1j", "is not a number"),
        ("start < '5 lightbulbs'", "unknown unit"),
        ("start < 'word'", "is not a quantity"),
        ("start <", "cannot be read"),
        ("start < 1; end < 1", "cannot be read"),
        ("(" * 300 + "1" + ")" * 300 + " < 2", "cannot be read"),
        ("not " * 200 + "start < 1", "nested too deeply"),
        ("start < 1 or " * 100 + "end < 1", "is too long"),
        ("start < 1\x00", "cannot be read"),
        ("  ", "is empty"),
    ],
)
def test_what_is_no_constraint(text: str, says: str, tmp_path: pathlib.Path) -> None:
    error = refused(
        tmp_path, f'design = "random"\ncases = 4\nconstraints = ["end > 0", {json.dumps(text)}]', THREE
    )
    assert says in str(error)
    assert error.field == "constraints[1]"
    assert error.file == tmp_path / "sweep.toml"


def test_words_are_compared_with_words_only(tmp_path: pathlib.Path) -> None:
    parameters = (
        PRESSURE + '[parameters.patient]\nkey = "patient"\nvalues = ["drop-foot", "healthy"]\n'
        '[parameters.steps]\nkey = "gait.seed"\nfrom_seed = true\n'
    )
    for text, says, nearest in (
        ("patient == 'drop-fot'", "is not a value of 'patient'", "drop-foot"),
        ("patient < 'healthy'", "orders words", None),
        ("patient + 1 < 2", "is a word, not a number", None),
        ("steps < 2", "is not a parameter that a constraint can name", None),
    ):
        head = f'design = "random"\ncases = 4\nconstraints = ["{text}"]'
        error = refused(tmp_path, head, parameters)
        assert says in str(error)
        assert error.nearest == nearest


@pytest.mark.slow
@pytest.mark.parametrize("kind", ['random"\ncases = 4', 'sobol"\ncases = 4', 'latin-hypercube"\ncases = 4'])
def test_contradictory_constraints(kind: str, tmp_path: pathlib.Path) -> None:
    error = refused(tmp_path, f'design = "{kind}\nconstraints = ["start > 0.7", "end < start - 0.1"]', THREE)
    assert "start > 0.7; end < start - 0.1" in str(error)
    grid = refused(
        tmp_path, 'design = "grid"\nconstraints = ["pressure > \'7 bar\'"]', PRESSURE + "steps = 3\n"
    )
    assert "leave none of 3 cases" in str(grid)


def test_hardly_feasible_is_refused_and_rare_is_drawn(tmp_path: pathlib.Path) -> None:
    head = 'design = "random"\ncases = 8\n'
    rare = cases(tmp_path, head + 'constraints = ["start < 0.4512"]', THREE)  # 0.4 %
    assert len(rare) == 8
    assert rare.values["start"].max() < 0.4512
    assert rare.dropped / 8 == pytest.approx(250.0, rel=1.5)
    error = refused(tmp_path, head.replace("8", "800") + 'constraints = ["start < 0.45003"]', THREE)  # 0.01 %
    assert "samples" in error.problem


# -- what is refused --------------------------------------------------------------------------------------

RANDOM = 'design = "random"\ncases = 4'


@pytest.mark.parametrize(
    ("head", "says", "nearest"),
    [
        ('design = "sobel"\ncases = 4', "is not a valid design", "sobol"),
        ('desing = "sobol"\ncases = 4', "is an unknown key", "design"),
        ('design = "sobol"', "is missing", None),
        ('design = "grid"\ncases = 4', "does not go with the design 'grid'", None),
        ('design = "random"\ncases = 0', "at least 1", None),
        ('design = "random"\ncases = 4.5', "is not a whole number", None),
        ('design = "random"\ncases = true', "is not a whole number", None),
        (RANDOM + "\nseed = -1", "at least 0", None),
        (RANDOM + "\nkeep = [4]", "there is no such case", None),
        (RANDOM + "\nkeep = [-1]", "negative", None),
        (RANDOM + '\nmetrics = ["toe_clearence"]', "is not a valid metric", "toe_clearance"),
        (RANDOM + '\nfile = "cases.csv"', "does not go with the design 'random'", None),
        (RANDOM + '\nscenario = "walk-dropfoot-af"', "there is no such scenario", "walk-dropfoot-afo"),
        (RANDOM + '\n[set]\nduratoin = "4 s"', "unknown key", "duration"),
        (RANDOM + '\n[set]\n"supply.pressure" = "4 bar"', "is set by the parameter 'pressure' too", None),
        (RANDOM + "\n[set]\nduration = 4", "has no unit", None),
        (RANDOM + '\n[set]\npatient = "drop-fot"', "set.patient = 'drop-fot'", "drop-foot"),
        ('design = "saltelli"\ncases = 4\nconstraints = ["pressure > 3"]', "sensitivity indices", None),
        ('design = "random"\ncases = 10000001', "up to 10000000, or `yes_many`", None),
    ],
)
def test_what_is_no_sweep(head: str, says: str, nearest: str | None, tmp_path: pathlib.Path) -> None:
    error = refused(tmp_path, head)
    assert says in str(error)
    assert error.nearest == nearest
    assert error.file == tmp_path / "sweep.toml"


def keyed(key: str, text: str, name: str = "p") -> str:
    return f'[parameters.{name}]\nkey = "{key}"\n{text}\n'


def pressure(text: str, name: str = "p") -> str:
    return keyed("supply.pressure", text, name)


TWO = 'values = ["1 ms", "2 ms"]'
NONE_LEFT = 'distribution = "lognormal"\nmedian = "1 N*m"\nsd = 0.1\nto = "0 N*m"'
MASS = '[parameters.p]\nkey = "patient.body_mass"\ndistribution = "normal"\n'


@pytest.mark.parametrize(
    ("parameter", "field", "says", "nearest"),
    [
        (pressure('from = 2\nto = "6 bar"'), "from", 'has no unit; write it like "4 bar" (supply', None),
        (pressure('from = "2 s"\nto = "6 bar"'), "from", "does not convert to Pa", None),
        (pressure('from = "6 bar"\nto = "2 bar"'), "from", "the range is empty", None),
        (pressure('from = "2 bar"\nto = "2 bar"'), "from", "the range is empty", None),
        (pressure('from = "2 bar"\nto = "600 bar"'), "to", "at most 20", None),
        (pressure('from = "2 bar"'), "to", "is missing", None),
        (pressure('to = "2 bar"'), "from", "is missing", None),
        (pressure(""), "from", "its values are not stated", None),
        (pressure('from = "2 bar"\nto = "6 bar"\nsteps = 3'), "steps", "does not go with the design", None),
        (pressure('from = "2 bar"\nto = "6 bar"\nstep = 3'), "step", "is an unknown key", "steps"),
        (pressure('from = "2 bar"\nto = "6 bar"\nscale = "lg"'), "scale", "is not a valid choice", None),
        (pressure('values = ["2 bar"]\nscale = "log"'), "scale", "does not go with values", None),
        (pressure("values = []"), "values", "is empty", None),
        (pressure('values = ["2 bar", "2e5 Pa"]'), "values", "is there twice", None),
        (pressure('values = ["2 bar", 3]'), "values", "has no unit", None),
        (pressure("from_seed = true"), "from_seed", "goes to whole numbers only", None),
        (pressure('values = ["2 bar"]', "from"), "", "is not a valid name for a column", None),
        (pressure('values = ["2 bar"]', '"a b"'), "", "is not a valid name for a column", None),
        ('[parameters.p]\nkey = "supply.presure"\nvalues = [1]', "key", "is an unknown key", "pressure"),
        ('[parameters.p]\nkey = "suply.pressure"\nvalues = [1]', "key", "is an unknown key", "supply"),
        (
            keyed("orthosis.muscle.dorsiflexr.slack", "values = [1]"),
            "key",
            "at orthosis.muscle.dorsiflexr)",
            "dorsiflexor",
        ),
        ('[parameters.p]\nkey = "supply"\nvalues = [1]', "key", "is a table", None),
        ('[parameters.p]\nkey = "supply.pressure.x"\nvalues = [1]', "key", "is a value, not a table", None),
        ('[parameters.p]\nkey = "orthosis.range_of_motion"\nvalues = [1]', "key", "is a list", None),
        ('[parameters.p]\nkey = "orthosis.range_of_motion[2]"\nvalues = [1]', "key", "no item [2]", None),
        ('[parameters.p]\nkey = "phases.dorsiflexor.inlet[1][0]"\nvalues = [1]', "key", "no item [1]", None),
        ('[parameters.p]\nkey = "supply.pressure[0]"\nvalues = [1]', "key", "is not a list", None),
        ("[parameters.p]\nvalues = [1]", "key", "not stated", None),
        ('[parameters.p]\nkeys = ["supply.pressure", "duration"]', "keys", "another kind", None),
        ('[parameters.p]\nkey = "patient"\nvalues = ["drop-fot"]', "values", "no such patient", "drop-foot"),
        (keyed("gait.cycle", 'values = ["gatk_strid1"]'), "values", "no such gait", "gatk_stride1"),
        (keyed("orthosis.cuff", 'values = ["none.xml"]'), "values", "there is no such file", None),
        ('[parameters.p]\nkey = "patient"\nvalues = [3]', "values", "is not a text", None),
        ('[parameters.p]\nkey = "callback"\nvalues = ["nativ"]', "values", "is not a valid choice", "native"),
        ('[parameters.p]\nkey = "patient"\nfrom = "a"\nto = "b"', "from", "not a way to state words", None),
        ('[parameters.p]\nkey = "gait.seed"\nfrom = 1.5\nto = 4', "from", "is not a whole number", None),
        ('[parameters.p]\nkey = "gait.seed"\nfrom_seed = false', "from_seed", "has no effect", None),
        (keyed("leg.friction", 'from = "0 N*m"\nto = "1 N*m"\nscale = "log"'), "from", "logarithm", None),
        (MASS + 'mean = "75 kg"', "sd", "is missing", None),
        (keyed("leg.friction", NONE_LEFT), "to", "leaves nothing", None),
        (MASS + 'mean = "75 kg"\nsd = 10', "sd", "has no unit", None),
        (MASS + 'mean = "75 kg"\nsd = "0 kg"', "sd", "more than zero", None),
        (MASS + 'mean = "75 kg"\nmedian = "75 kg"\nsd = "3 kg"', "median", "does not go with normal", None),
        (MASS + 'mean = "75 kg"\nsd = "3 kg"\nfrom = "90 kg"\nto = "80 kg"', "from", "range is empty", None),
        (MASS + 'mean = "75 kg"\nsd = "3 kg"\nscale = "log"', "scale", "does not go with distribution", None),
    ],
)
def test_what_is_no_parameter(
    parameter: str, field: str, says: str, nearest: str | None, tmp_path: pathlib.Path
) -> None:
    error = refused(tmp_path, RANDOM, parameter)
    (name,) = tomllib.loads(parameter)["parameters"]
    assert says in str(error)
    assert error.field == f"parameters.{name}" + (f".{field}" if field else "")
    assert error.nearest == nearest


@pytest.mark.parametrize(
    ("first", "second", "says"),
    [
        ("supply.pressure", "supply.pressure", "sets what 'a' sets already"),
        ("patient", "patient.name", "sets what lies within 'a'"),
        ("patient.name", "patient", "sets all of what 'a'"),
    ],
)
def test_two_parameters_for_one_field(first: str, second: str, says: str, tmp_path: pathlib.Path) -> None:
    values = {"supply.pressure": ["3 bar"], "patient": ["healthy"], "patient.name": ["x"]}
    text = f'[parameters.a]\nkey = "{first}"\nvalues = {values[first]}\n[parameters.b]\nkey = "{second}"\n'
    assert says in str(refused(tmp_path, RANDOM, text + f"values = {values[second]}\n"))


@pytest.mark.parametrize(
    ("head", "parameters", "says"),
    [
        ('design = "grid"', PRESSURE, "a grid needs it"),
        ('design = "grid"', PRESSURE + "steps = 1\n", "at least 2"),
        ('design = "grid"', MASS + 'mean = "75 kg"\nsd = "3 kg"', "does not go with the design 'grid'"),
        ('design = "grid"', PRESSURE + "steps = 10_000_001\n", "`yes_many`"),
        ('design = "grid"', keyed("gait.seed", "from = 0\nto = 3\nsteps = 9"), "whole numbers"),
        ('design = "list"', PRESSURE, "does not go with the design 'list'"),
        ('design = "list"', pressure('values = ["3 bar"]') + keyed("timestep", TWO, "b"), "p: 1, b: 2"),
    ],
)
def test_what_a_grid_and_a_list_refuse(head: str, parameters: str, says: str, tmp_path: pathlib.Path) -> None:
    assert says in str(refused(tmp_path, head, parameters))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("pressure [bar],presure\n3,4\n", "of the sweep; allowed: pressure; did you mean 'pressure'?"),
        ("pressure [s]\n3\n", "does not convert to Pa"),
        ("pressure [bar]\n", "has no rows"),
        ("pressure [bar]\nx\n", "line 2: is not a finite number"),
        ("pressure\n3\n", "has no unit"),
        ("other\n3\n", "is not a parameter of the sweep"),
    ],
)
def test_what_is_no_list_of_cases(text: str, says: str, tmp_path: pathlib.Path) -> None:
    (tmp_path / "cases.csv").write_text(text)
    error = refused(
        tmp_path, 'design = "list"\nfile = "cases.csv"', '[parameters.pressure]\nkey = "supply.pressure"\n'
    )
    assert says in str(error)


def test_a_slip_of_some_zeros_fills_no_memory(tmp_path: pathlib.Path) -> None:
    refused(tmp_path, 'design = "grid"', PRESSURE + "steps = 3000000000\n", most=10_000_000)


def test_a_million_times_too_many_can_be_asked_for(tmp_path: pathlib.Path) -> None:
    assert "the design has 9 cases" in str(
        refused(tmp_path, 'design = "grid"', PRESSURE + "steps = 9\n", most=8)
    )
    assert len(cases(tmp_path, 'design = "grid"', PRESSURE + "steps = 9\n", most=9)) == 9


def test_a_case_that_is_no_scenario_is_told_before_it_runs(tmp_path: pathlib.Path) -> None:
    """Each value is allowed alone; together they are an empty event."""
    text = (
        '[parameters.start]\nkey = "phases.dorsiflexor.inlet[0][0]"\nvalues = [0.4, 0.9]\n'
        '[parameters.end]\nkey = "phases.dorsiflexor.inlet[0][1]"\nvalues = [0.9, 0.95]\n'
    )
    error = refused(tmp_path, 'design = "grid"', text)
    assert "case 2 is not a valid scenario" in str(error)
    assert "the event [0.9, 0.9] is empty" in str(error)
    assert len(cases(tmp_path, 'design = "grid"\nconstraints = ["start < end"]', text)) == 3
    wide = refused(tmp_path, RANDOM.replace("4", "400"), MASS + 'mean = "20 kg"\nsd = "10 kg"')
    assert wide.field == "parameters.p"
    assert "patient.body_mass" in str(wide)
    assert "at least" in wide.allowed


# -- files ------------------------------------------------------------------------------------------------


def test_a_scenario_and_patients_beside_the_sweep(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shipped = assets.find("scenario", "walk-dropfoot-afo").read_text(encoding="utf-8")
    (tmp_path / "mine.toml").write_text(shipped.replace('"4 bar"', '"3 bar"'))
    (tmp_path / "anna.toml").write_text("dorsiflexor_strength = 0.25\nplantarflexor_strength = 1.0\n")
    text = '[parameters.who]\nkey = "patient"\nvalues = ["anna.toml", "healthy"]\n'
    file = written(tmp_path, 'scenario = "mine.toml"\ndesign = "grid"\n[set]\nduration = "2 s"', text)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    found = cases_of(sweep_plan.read(file))
    assert found.values["who"].tolist() == ["anna.toml", "healthy"]
    scenario = load("scenario", found.plan.scenario, found.sets(0))
    assert scenario.supply.pressure == 3e5
    assert scenario.patient.dorsiflexor_strength == 0.25
    assert scenario.duration == 2.0
    before = found.plan.canonical()
    (tmp_path / "anna.toml").write_text("dorsiflexor_strength = 0.26\nplantarflexor_strength = 1.0\n")
    assert sweep_plan.read(file).canonical() != before


def test_canonical_holds_what_decides_the_results_and_nothing_else(tmp_path: pathlib.Path) -> None:
    head = 'design = "random"\ncases = 4\n'
    base = json.dumps(sweep_plan.read(written(tmp_path, head, THREE)).canonical())
    for idle in ('description = "x"', "keep = [1]", "chunk = 7", "# a remark"):
        assert json.dumps(sweep_plan.read(written(tmp_path, head + idle, THREE)).canonical()) == base
    other = tmp_path / "other"
    other.mkdir()
    assert json.dumps(sweep_plan.read(written(other, head, THREE)).canonical()) == base
    same = THREE.replace('"2 bar"', '"200 kPa"')
    assert json.dumps(sweep_plan.read(written(tmp_path, head, same)).canonical()) == base
    for telling in ("seed = 1", 'metrics = ["toe_clearance"]', 'constraints = ["start < end"]',
                    '[set]\nduration = "2 s"'):  # fmt: skip
        assert json.dumps(sweep_plan.read(written(tmp_path, head + telling, THREE)).canonical()) != base
    for telling in (THREE.replace("0.45", "0.46"), THREE.replace("start", "begin"),
                    THREE.replace("0.7\n", '0.7\nscale = "log"\n', 1)):  # fmt: skip
        assert json.dumps(sweep_plan.read(written(tmp_path, head, telling)).canonical()) != base


@pytest.mark.parametrize("name", assets.names("sweep"))
def test_shipped_sweeps_are_good(name: str) -> None:
    found = sweep_plan.read(name)
    assert len(found.description) > 10
    many = cases_of(found)
    assert len(many) > 1 if found.design == "grid" else len(many) == found.cases  # a grid tells no number
    assert all(np.isfinite(many.values[p.name]).all() for p in found.parameters if not p.words)


def test_a_sweep_is_checked(call: Call, tmp_path: pathlib.Path) -> None:
    file = written(tmp_path, 'design = "saltelli"\ncases = 4', THREE)
    code, out, _ = call("check", file)
    assert code == 0
    assert "32 (saltelli)" in out
    file.write_text(file.read_text().replace("supply.pressure", "supply.presure"))
    code, _, err = call("check", file)
    assert code == 2
    assert "did you mean 'pressure'" in err


def test_any_quantity_is_read_to_the_last_digit_of_its_si_unit() -> None:
    for unit, example in units.EXAMPLES.items():
        if unit:
            value, measures = units.read_any_quantity(example)
            assert math.isclose(value, units.parse_quantity(example, unit), rel_tol=0.0)
            assert measures == units.dimension(unit)
    assert units.dimension("rad") != units.dimension("")
    with pytest.raises(ValueError, match="has no unit"):
        units.read_any_quantity("5")
