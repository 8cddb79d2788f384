"""Tubes, sources and regulators as they are described: what is refused, and what the shipped ones say."""

import re
from typing import Any

import numpy as np
import pytest
from command import call
from documents import PAGES
from scipy.integrate import solve_ivp

from afo_sim.common import InputError, assets
from afo_sim.description import Source, load
from afo_sim.description.air.source import MAY_HAVE, NEEDED, OF_ONE_KIND
from afo_sim.physics import store_pressure, store_temperature_rate

CARTRIDGE = {"kind": "cartridge", "gas": "co2", "volume": "23.5 ml", "content": "16 g"}
BOTTLE = {"kind": "bottle", "volume": "0.5 l", "filling_pressure": "300 bar"}
COMPRESSOR = {
    "kind": "compressor",
    "volume": "0.5 l",
    "switch_on": "6 bar",
    "switch_off": "7 bar",
    "free_air_delivery": "10 l/min",
    "delivery_pressure": "1 bar",
    "stall_pressure": "9 bar",
}
C = "0.1 dm^3/(s*bar)"
REGULATOR = {
    "droop": "0.4 bar",
    "rated_flow": "60 l/min",
    "conductance": "0.4 dm^3/(s*bar)",
    "outlet_volume": "5 ml",
    "set_range": ["0.5 bar", "7 bar"],
}


@pytest.mark.parametrize(
    ("kind", "table", "changed", "field", "problem"),
    [
        ("tube", {"bore": "2.5 mm"}, {"bore": "0 mm"}, "bore", "out of range"),
        ("tube", {"bore": "2.5 mm"}, {"bore": "2.5"}, "bore", "no unit"),
        ("tube", {"bore": "2.5 mm"}, {"outer_diameter": "2.5 mm"}, "outer_diameter", "no wall"),
        ("source", BOTTLE, {"volume": "0 l"}, "volume", "out of range"),
        ("source", BOTTLE, {"volume": "0.5 bar"}, "volume", "does not convert"),
        ("source", BOTTLE, {"filling_pressure": "-0.2 bar"}, "filling_pressure", "out of range"),
        ("source", BOTTLE, {"filling_pressure": "400 bar"}, "filling_pressure", "out of range"),
        ("source", BOTTLE, {"wall_conductance": "-1 W/K"}, "wall_conductance", "out of range"),
        ("source", BOTTLE, {"kind": "cylinder"}, "kind", "not a valid choice"),
        ("source", BOTTLE, {"gas": "helium"}, "gas", "not a valid choice"),
        ("source", BOTTLE, {"switch_on": "2 bar"}, "switch_on", "not a valid key of a bottle"),
        ("source", BOTTLE, {"gas": "co2"}, "filling_pressure", "would make it liquid"),
        ("source", CARTRIDGE, {"gas": "air"}, "gas", "cannot be liquid"),
        ("source", CARTRIDGE, {"content": "18 g"}, "content", "would burst it"),
        ("source", COMPRESSOR, {"gas": "co2"}, "gas", "not what a compressor takes in"),
        ("source", COMPRESSOR, {"switch_on": "7 bar"}, "switch_on", "not below the pressure at which it"),
        ("source", COMPRESSOR, {"switch_off": "9 bar"}, "switch_off", "stalls before"),
        ("source", COMPRESSOR, {"delivery_pressure": "9 bar"}, "delivery_pressure", "not below the stall"),
        ("source", COMPRESSOR, {"free_air_delivery": "0 l/min"}, "free_air_delivery", "out of range"),
        ("regulator", REGULATOR, {"conductance": "-1 dm^3/(s*bar)"}, "conductance", "out of range"),
        ("regulator", REGULATOR, {"droop": "0 bar"}, "droop", "out of range"),
        ("regulator", REGULATOR, {"droop": "8 bar"}, "droop", "more than can be set"),
        ("regulator", REGULATOR, {"set_range": ["7 bar", "1 bar"]}, "set_range", "is not a valid range"),
        ("regulator", REGULATOR, {"bleed": "-1 l/min"}, "bleed", "out of range"),
        ("regulator", REGULATOR, {"relief_conductance": C}, "relief_conductance", "no relief"),
    ],
)
def test_what_cannot_be_is_refused_by_its_field(
    kind: str, table: dict[str, Any], changed: dict[str, Any], field: str, problem: str
) -> None:
    load(kind, table)
    with pytest.raises(InputError, match=problem) as error:
        load(kind, table | changed)
    assert error.value.field == field
    assert error.value.allowed or field == "set_range" or "unit" in problem or "convert" in problem


@pytest.mark.parametrize("table", [BOTTLE, CARTRIDGE, COMPRESSOR])
def test_each_kind_needs_its_own_keys_and_has_no_others(table: dict[str, Any]) -> None:
    kind = table["kind"]
    for key in NEEDED[kind]:
        with pytest.raises(InputError, match=f"{key}.*is missing; a {kind} needs it"):
            load("source", {k: v for k, v in table.items() if k != key})
    samples = BOTTLE | CARTRIDGE | COMPRESSOR | {"shell_heat_capacity": "8 J/K", "electric_power": "20 W"}
    for key in OF_ONE_KIND - {*NEEDED[kind], *MAY_HAVE[kind]}:
        with pytest.raises(InputError, match=f"is not a valid key of a {kind}"):
            load("source", table | {key: samples[key]})


def test_units_become_si() -> None:
    source = load("source", COMPRESSOR | {"electric_power": "0.02 kW", "wall_conductance": "500 mW/K"})
    assert source.free_air_delivery == pytest.approx(10e-3 / 60.0)
    assert (source.volume, source.stall_pressure) == (pytest.approx(0.5e-3), pytest.approx(9e5))
    assert (source.electric_power, source.wall_conductance) == (pytest.approx(20.0), pytest.approx(0.5))
    shell = load("source", CARTRIDGE | {"shell_heat_capacity": "0.02 kJ/K"})
    assert (shell.shell, shell.full_mass) == (pytest.approx(20.0), pytest.approx(0.016))
    regulator = load("regulator", REGULATOR)
    assert regulator.gain == pytest.approx(1.185 * 1e-3 / 0.4e5)
    assert regulator.opens_to_ambient == 0.0
    assert load("regulator", REGULATOR | {"relief": "0.1 bar"}).opens_to_ambient == pytest.approx(0.4e-8)


def test_sources_tell_what_they_give() -> None:
    """16 g of carbon dioxide are 8.9 l; half a litre at 300 bar is 136 l, and 3.0 l of 10 bar down to 4."""
    assert 1e3 * load("source", CARTRIDGE).full_mass * 0.5538 == pytest.approx(8.86, abs=0.01)
    assert load("source", BOTTLE).free_litres(-101_325.0) == pytest.approx(136.0, rel=0.01)
    small = load("source", BOTTLE | {"filling_pressure": "10 bar"})
    assert small.free_litres(4e5) == pytest.approx(3.0, rel=0.02)
    assert small.free_litres(11e5) == small.delivery(4e5) == 0.0
    compressor = load("source", COMPRESSOR)
    litres = [6e4 * compressor.delivery(bar * 1e5) / 1.185 for bar in (1.0, 5.0, 9.0, 10.0)]
    assert litres == pytest.approx([10.0, 5.0, 0.0, 0.0])


@pytest.mark.parametrize("kind", ["tube", "source", "regulator"])
def test_every_shipped_number_says_where_it_comes_from(kind: str) -> None:
    found = assets.names(kind)
    assert len(found) >= {"tube": 6, "source": 8, "regulator": 4}[kind]
    for name in found:
        product = load(kind, name)
        assert product.name == name and len(product.description) > 10
        told = product.model_fields_set - {"name", "description", "provenance", "kind", "gas"}
        assert told == set(product.provenance), name
        for origin in product.provenance.values():
            assert "from memory" not in origin.source or origin.kind != "published", (name, origin)


def test_a_regulators_droop_is_nowhere_printed() -> None:
    for name in assets.names("regulator"):
        assert load("regulator", name).provenance["droop"].kind == "assumed"


@pytest.mark.parametrize(
    ("product", "says"),
    [
        ("models/tubes/pun_4x2_5/tube.toml", "C 0.378 dm³/(s·bar), b 0.29, 4.91 ml"),
        ("models/sources/co2_16g/source.toml", "8.74 l of free gas"),
        ("models/sources/vn_c4/source.toml", "delivers at 4 bar"),
        ("models/regulators/droop_tenth/regulator.toml", "0.4 bar at 50 l/min"),
    ],
)
def test_check_says_what_it_means(product: str, says: str, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = call(capsys, "check", str(assets.folder("models").parent / product))
    assert code == 0
    assert says in re.sub(r"\s+", " ", out)


def rows_of(text: str) -> dict[str, list[str]]:
    """Table rows of a page by the product in their first cell."""
    cells = [[cell.strip() for cell in line.strip("| ").split("|")] for line in text.splitlines()]
    return {row[0].strip("`"): row[1:] for row in cells if len(row) > 2 and row[0].startswith("`")}


def test_page_shows_the_shipped_sources_tubes_and_regulators() -> None:
    found = rows_of(PAGES["supply"])
    assert set(found) == {name for kind in ("tube", "source", "regulator") for name in assets.names(kind)}
    for name in assets.names("source"):
        source: Source = load("source", name)
        told = [1e3 * source.full_mass, source.free_litres(4e5), source.free_litres(6e5)]
        if source.free_air_delivery is not None and source.stall_pressure is not None:
            told = [6e4 * source.free_air_delivery, 1e-5 * source.stall_pressure]
        assert found[name] == [f"{number:.3g}" for number in told], name
    for name in assets.names("tube"):
        tube = load("tube", name)
        numbers = [
            f"{1e3 * tube.bore:g}",
            f"{1e8 * tube.conductance(2.0):.3g}",
            f"{1e6 * tube.volume(1.0):.3g}",
        ]
        assert found[name] == numbers, name
    for name in assets.names("regulator"):
        regulator = load("regulator", name)
        numbers = [1e-5 * regulator.droop, 6e4 * regulator.rated_flow, 1e8 * regulator.conductance]
        assert found[name] == [f"{number:.3g}" for number in numbers], name


def test_page_tells_how_long_a_cartridge_lasts() -> None:
    """16 g of carbon dioxide at a steady flow, down to 4 bar gauge, with the shipped shell and walls."""
    source = load("source", "co2_16g")
    row = source.real_gas.row
    found = re.findall(r"([\d.]+)\smin\sat\s(\d+)\sl/min\sANR\s\(([\d.]+)\sif\swarm\)", PAGES["supply"])
    (coldest,) = re.findall(r"the\scoldest\sis\s(\S+)\s°C", PAGES["supply"])
    assert len(found) == 2
    for lasts, litres, warm in found:
        flow = float(litres) * 1e-3 / 60.0 / source.real_gas.litres_per_gram

        def rates(_: float, state: np.ndarray, flow: float = flow) -> list[float]:
            around = (source.shell, source.wall_conductance, 293.15)
            return [-flow, store_temperature_rate(*state, source.volume, 0.0, flow, *around, row)]

        def too_low(_: float, state: np.ndarray) -> float:
            return store_pressure(*state, source.volume, row) - 501_325.0

        too_low.terminal = True  # type: ignore[attr-defined]
        span = (0.0, 0.999 * source.full_mass / flow)
        run = solve_ivp(rates, span, [source.full_mass, 293.15], events=too_low, rtol=1e-7, atol=1e-10)
        assert f"{run.t[-1] / 60.0:.2g}" == lasts
        assert f"{source.free_litres(4e5) / float(litres):.2g}" == warm
        assert f"{run.y[1].min() - 273.15:.0f}".replace("-", "−") == coldest
