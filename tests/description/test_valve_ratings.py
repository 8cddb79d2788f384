"""Valves from data sheets: converted, traced, refused where a figure tells too little, set, read again."""

import copy
import math
import pathlib
import re
from typing import Any

import pytest
from documents import PAGES, script

import afo_sim
from afo_sim import InputError, load
from afo_sim.common import assets
from afo_sim.description import Valve
from afo_sim.description.keys import keys
from afo_sim.description.reader import with_keys

INLET = "orthosis.chamber.dorsiflexor.inlet"
UNIT = 1e-8  # dm³/(s·bar)
FLOW = {"flow": "100 l/min", "norm": "ANR", "upstream": "6 bar", "downstream": "5 bar"}
BARE: dict[str, Any] = {"critical_ratio": 0.3, "opening_delay": "2 ms", "closing_delay": "3 ms"}
RATED = BARE | {"name": "rated", "nominal_flow": FLOW}
FACTOR = 60.0 * 7.0 * math.sqrt(1.0 - ((6.0 / 7.0 - 0.3) / 0.7) ** 2)  # l/min ANR of C = 1, by hand: 254.3
SHIPPED = assets.names("valve")


def valve(**table: Any) -> Valve:
    return load("valve", BARE | table)


def refused(**table: Any) -> str:
    with pytest.raises(InputError) as caught:
        valve(**table)
    return str(caught.value)


# --- conversion


@pytest.mark.parametrize(
    ("key", "value", "c"),
    [
        ("nominal_flow", FLOW, 100.0 / FACTOR),
        ("nominal_flow", FLOW | {"norm": "DIN 1343"}, 100.0 / FACTOR * 1.293 / 1.185),
        ("nominal_flow", FLOW | {"downstream": "0 bar"}, 100.0 / 420.0),  # choked
        ("cv", 0.29, 3.6 * 0.29),
        ("kv", 0.25, 3.6 * 0.25 / 0.865),
        ("sonic_area", "20 mm^2", 4.0),
        ("orifice", "1.02 mm", 0.128 * 1.02**2),
    ],
)
def test_a_rating_becomes_a_conductance_that_says_how(key: str, value: Any, c: float) -> None:
    found = valve(**{key: value})
    assert found.conductance == pytest.approx(c * UNIT, rel=1e-12)
    assert found.row["conductance"] == found.conductance
    told = found.provenance["conductance"]
    assert told.kind == "derived"
    assert key.replace("_", " ") in told.source.replace("_", " ")
    assert valve(conductance=f"{c!r} dm^3/(s*bar)").provenance == {}


def test_the_conversion_tells_what_is_assumed_and_what_is_rough() -> None:
    b = {"value": 0.3, "kind": "assumed", "source": "usual"}
    flow = {"value": "100 l/min", "kind": "published", "source": "page 2"}
    found = valve(critical_ratio=b, nominal_flow=FLOW | {"flow": flow})
    source = found.provenance["conductance"].source
    for part in ("100 l/min ANR from 6 bar to 5 bar gauge", "critical_ratio = 0.3"):
        assert part in source
    assert "assumed: critical_ratio" in source and "published: flow" in source
    assert "±20 %" in valve(cv=0.3).provenance["conductance"].source
    assert "not verified" in valve(orifice="1 mm").provenance["conductance"].source


def test_keys_list_the_conductance_as_derived() -> None:
    found = {key.key: key for key in keys("seated", sets={INLET: "mha2"})}
    key = found[f"{INLET}.conductance"]
    assert (key.kind, key.source) == ("derived", "models/valves/mha2/valve.toml")
    assert "100 l/min DIN 1343" in key.reference
    assert float(key.value.split()[0]) == pytest.approx(100.0 / FACTOR * 1.293 / 1.185, rel=1e-9)
    assert found[f"{INLET}.nominal_flow.flow"].value == "100 l/min"


# --- set, and read again


@pytest.mark.parametrize("name", SHIPPED)
def test_a_valve_written_out_reads_again_exactly(name: str) -> None:
    found = load("valve", name)
    again = load("valve", found.model_dump(mode="json"))
    assert again == found
    assert again.conductance == found.conductance  # to the last bit
    assert again.row == found.row


@pytest.mark.parametrize(
    "sets",
    [
        {"conductance": "0.2 dm^3/(s*bar)"},
        {"critical_ratio": 0.5},
        {"nominal_flow.flow": "200 l/min"},
        {"nominal_flow": FLOW | {"upstream": "4 bar", "downstream": "3 bar"}},
        {"cv": 0.1},
        {"exhaust.conductance": "0.2 dm^3/(s*bar)"},
        {"exhaust.critical_ratio": 0.1},
    ],
)
def test_setting_a_key_of_a_rated_valve(sets: dict[str, Any]) -> None:
    """Over its file and over the finished description alike."""
    table = RATED | {"exhaust": {"critical_ratio": 0.3, "nominal_flow": FLOW}}
    found = load("valve", copy.deepcopy(table), sets)
    later = with_keys(load("valve", copy.deepcopy(table)), sets)
    for one, other in ((found, later), (found.exhaust, later.exhaust)):
        assert one is not None and other is not None
        assert one.conductance == other.conductance
        assert one.provenance["conductance"] == other.provenance["conductance"]
        assert one.rating == other.rating


def test_a_set_conductance_replaces_the_nominal_flow() -> None:
    sets = {INLET: "mha2", f"{INLET}.conductance": "0.2 dm^3/(s*bar)"}
    found = load("scenario", "seated", sets).orthosis.chamber["dorsiflexor"].inlet
    assert found.conductance == pytest.approx(0.2 * UNIT, rel=1e-14)
    assert found.nominal_flow is None
    assert found.provenance["conductance"].kind == "user"
    assert load("scenario", "seated", {INLET: "mha2"}).set(
        {f"{INLET}.conductance": "0.2 dm^3/(s*bar)"}
    ) == load("scenario", "seated", sets)


def test_replaced_values_follow_the_same_rules() -> None:
    rated = load("valve", RATED)
    assert rated.with_values(conductance=2e-9).conductance == 2e-9
    assert rated.with_values(conductance=2e-9).provenance["conductance"].kind == "user"
    assert rated.with_values(critical_ratio=0.5).conductance < 0.9 * rated.conductance
    assert rated.with_values(cv=0.29).conductance == pytest.approx(3.6 * 0.29 * UNIT)
    assert rated.with_values(opening_delay=1e-3).conductance == rated.conductance
    assert rated.provenance["conductance"].kind == "derived"


# --- refusals


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ({"conductance": "100 l/min"}, ["conductance = '100 l/min'", "is a volume flow", "norm"]),
        ({"nominal_flow": "100 l/min"}, ["nominal_flow = '100 l/min'", "norm and its two pressures"]),
        ({"nominal_flow": {"flow": "100 l/min"}}, ["does not state norm, upstream, downstream"]),
        ({"nominal_flow": {k: v for k, v in FLOW.items() if k != "norm"}}, ["does not state norm:"]),
        ({"nominal_flow": {k: v for k, v in FLOW.items() if k != "upstream"}}, ["does not state upstream:"]),
    ],
)
def test_a_flow_alone_is_refused_with_the_usual_choices(table: Any, says: list[str]) -> None:
    text = refused(**table)
    for part in (*says, "SMC", "ANR", "Festo", "DIN 1343", "6 to 5 bar gauge", "9 %"):
        assert part in text
    # the example in the message is a good one
    example = re.search(r"nominal_flow = \{ (.*?) \}", text)
    assert example is not None
    given = dict(re.findall(r'(\w+) = "(.*?)"', example[1]))
    assert valve(nominal_flow=given).conductance == pytest.approx(100.0 / FACTOR * UNIT, rel=1e-12)


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ({"nominal_flow": FLOW | {"norm": "SCFM"}}, "nominal_flow.norm"),
        ({"nominal_flow": FLOW | {"downstream": "6 bar"}}, "nominal_flow.downstream"),
        ({"nominal_flow": FLOW | {"flow": "100 kg"}}, "nominal_flow.flow"),
        ({"nominal_flow": FLOW, "cv": 0.3}, "cv = 0.3: conflicts with nominal_flow"),
        ({"nominal_flow": FLOW, "conductance": "0.4 dm^3/(s*bar)"}, "which gives 0.3933 dm^3/(s*bar)"),
        ({"cv": -0.3}, "cv = -0.3: is out of range"),
        ({"orifice": 1.02}, "orifice = 1.02: has no unit"),
        ({}, "conductance: is missing; allowed: a conductance, or one of nominal_flow, cv, kv"),
        ({"conductance": "0.4 dm^3/(s*bar)", "dead_band": 0.1}, "dead_band = 0.1"),
        ({"conductance": "0.4 dm^3/(s*bar)", "bandwidth": "80 Hz"}, "opening_delay = '2 ms': has no effect"),
        ({"conductance": "0.4 dm^3/(s*bar)", "working_pressure": ["8 bar", "0 bar"]}, "working_pressure"),
        ({"conductance": "0.4 dm^3/(s*bar)", "minimum_on_time": "-1 ms"}, "at least 0 s"),
        ({"conductance": "0.4 dm^3/(s*bar)", "exhaust": {"critical_ratio": 0.3}}, "exhaust.conductance: is"),
    ],
)
def test_what_does_not_fit_is_refused(table: Any, says: str) -> None:
    assert says in refused(**table)


@pytest.mark.parametrize(
    ("written", "meant"), {"Festo": "DIN 1343", "DIN1343": "DIN 1343", "anr": "ANR", "SMC": "ANR"}.items()
)
def test_a_norm_by_another_name_is_told_with_who_counts_so(written: str, meant: str) -> None:
    says = refused(nominal_flow=FLOW | {"norm": written})
    assert f"'{meant}'" in says and "Festo DIN 1343" in says, says


def test_a_bound_may_be_written_in_another_unit() -> None:
    assert valve(conductance="100 dm^3/(s*bar)").conductance == 1e-6
    assert "out of range" in refused(conductance="100.0001 dm^3/(s*bar)")


def test_a_missing_critical_ratio_says_what_is_usual() -> None:
    with pytest.raises(InputError) as caught:
        load("valve", {k: v for k, v in RATED.items() if k != "critical_ratio"})
    assert caught.value.field == "critical_ratio" and not caught.value.others
    for part in ("makers seldom print it", "0.3 is usual", 'kind = "assumed"'):
        assert part in str(caught.value)


def test_a_solenoid_valve_needs_its_delays() -> None:
    with pytest.raises(InputError) as caught:
        load("valve", {"critical_ratio": 0.3, "cv": 0.3})
    assert {e.field for e in (caught.value, *caught.value.others)} == {"opening_delay", "closing_delay"}


# --- kinds of valve


def test_an_exhaust_makes_three_ports_and_a_bandwidth_a_proportional_valve() -> None:
    plain = valve(cv=0.3)
    assert not plain.three_way and not plain.proportional
    times = {f"{way}_{time}" for way in ("opening", "closing") for time in ("delay", "ramp")}
    held = {"threshold", "hold_decay", "hold_pressure"}
    assert set(plain.row) == {"conductance", "critical_ratio", *times, *held}
    three = valve(cv=0.3, exhaust={"critical_ratio": 0.2, "sonic_area": "2 mm^2"})
    assert three.three_way and three.exhaust is not None
    assert three.exhaust.conductance == pytest.approx(0.4 * UNIT)
    assert three.row == plain.row
    spool = load("valve", {"critical_ratio": 0.2, "cv": 0.3, "bandwidth": "80 Hz", "dead_band": 0.02})
    assert spool.proportional and spool.row["bandwidth"] == 80.0
    assert spool.opening_delay == spool.closing_delay == 0.0


def test_a_proportional_valve_runs_and_follows_with_its_bandwidth() -> None:
    short = {"duration": "0.2 s", f"{INLET}": "mpye_m5"}
    run = afo_sim.run("seated", short)
    opening, time = run["valve/dorsiflexor_inlet/opening"], run["time"]
    at = int((opening > 0.5).argmax())
    rate, step = 2.0 * math.pi * 95.0, time[1] - time[0]  # the coil is on from the start
    mean = 1.0 - math.exp(-rate * time[at]) * -math.expm1(-rate * step) / (rate * step)
    assert opening[at] == pytest.approx(mean, abs=1e-6)


# --- catalogue


@pytest.mark.parametrize("name", SHIPPED)
def test_every_number_of_a_valve_says_where_it_comes_from(name: str) -> None:
    found = load("valve", name)
    for path in filter(None, (found, found.exhaust, found.nominal_flow)):
        given = {key for key in path.model_fields_set if getattr(path, key) is not None}
        told = set(path.provenance)
        assert given - {"name", "description", "provenance", "nominal_flow", "exhaust"} <= told
        for key, provenance in path.provenance.items():
            if "memory" in provenance.source:
                assert provenance.kind == "assumed" and "not verified" in provenance.source, key
            if provenance.kind == "published":
                assert not re.search("assumed|taken equal|usual", provenance.source), key


def test_the_catalogue_is_large_enough_and_its_conversions_are_right() -> None:
    assert len(SHIPPED) >= 12
    hand = {  # C by hand from the printed flows, b = 0.3 or 0.23
        "mh1_3_2": 10.0 / FACTOR,
        "mha2": 100.0 / FACTOR * 1.0911,
        "matrix_821": 180.0 / 420.0 * 1.0911,
        "mpye_m5": 100.0 / 243.7 * 1.0911,
        "mpye_3_8": 2000.0 / 243.7 * 1.0911,
    }
    for name, c in hand.items():
        assert load("valve", name).conductance == pytest.approx(c * UNIT, rel=1e-3)


def test_page_shows_the_shipped_valves() -> None:
    printed = script("valves_table").markdown().strip()
    shown = PAGES["valves"].partition("<!-- catalogue begins -->")[2].partition("<!-- catalogue ends -->")[0]
    assert shown.strip() == printed, "put what the script prints into the page"


def test_toml_of_the_page_is_a_valve(tmp_path: pathlib.Path) -> None:
    (text,) = re.findall(r"```toml\n(.*?)```", PAGES["valves"], flags=re.S)
    (tmp_path / "valve.toml").write_text(text, encoding="utf-8")
    found = load("valve", tmp_path)
    assert found.three_way and found.provenance["conductance"].kind == "derived"
