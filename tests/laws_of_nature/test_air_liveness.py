"""Every field of an air path is live in the kinds that have it: changed, a named column of a run moves.

The fields are found in the descriptions, not listed here: a new one without an entry fails.
"""

from typing import Any

import numpy as np
import pytest
from campaign import sampled

import afo_sim
from afo_sim.description import PARTS, Chamber, Regulator, Restriction, Source, Supply, Tube
from afo_sim.description.air.air_parts import QuickExhaust, Volume

WORDS = {"name", "description", "provenance"}
MUSCLES, MANIFOLD = "chamber/dorsiflexor/pressure", "volume/manifold/pressure"
DURATION = {"duration": "0.6 s", "timestep": "2 ms", "timer.period": "0.6 s"}
TIMES = {
    "timer.dorsiflexor": {"inlet": [["0 s", "0.3 s"]], "outlet": [["0.3 s", "0.6 s"]]},
    "timer.plantarflexor": {"outlet": [["0 s", "0.6 s"]]},
}
WIDE = {
    "conductance": "0.3 dm^3/(s*bar)",
    "critical_ratio": 0.3,
    "opening_delay": "4 ms",
    "closing_delay": "3 ms",
}
SLOW = {"conductance": "0.05 dm^3/(s*bar)", "critical_ratio": 0.3}
# The valves are wide, so that what is before them has a say.
STOUT = {f"orthosis.chamber.dorsiflexor.{side}": WIDE for side in ("inlet", "outlet")}
FED = {
    "orthosis.volume.manifold": {"volume": "10 ml", "wall_conductance": "0.1 W/K", "start_pressure": "1 bar"},
    "orthosis.chamber.dorsiflexor.feed": "manifold",
}
REGULATOR = {
    "droop": "2 bar",
    "rated_flow": "10 l/min",
    "conductance": "0.03 dm^3/(s*bar)",
    "critical_ratio": 0.3,
    "relief": "0.1 bar",
    "relief_conductance": "0.02 dm^3/(s*bar)",
    "outlet_volume": "10 ml",
    "bleed": "1 l/min",
    "set_range": ["0 bar", "8 bar"],
}


def restricted(kind: str, **own: Any) -> dict[str, Any]:
    """A restriction of a kind between the supply and the manifold; a silencer and a leak behind it."""
    table = {"kind": kind, "upstream": "supply", "downstream": "manifold"} | BASE[kind] | own
    if kind == "quick_exhaust":
        port = {"volume": "2 ml"}
        ways = {
            "in": {"kind": "valve", "valve": WIDE, "upstream": "supply", "downstream": "port"},
            "out": {"kind": "valve", "valve": WIDE, "upstream": "port", "downstream": "ambient"},
            "probe": table | {"upstream": "port", "downstream": "dorsiflexor"},
        }
        return {
            "orthosis.volume.port": port,
            **{f"orthosis.restriction.{name}": way for name, way in ways.items()},
            "timer.in": {"open": [["0 s", "0.3 s"]]},
            "timer.out": {"open": [["0.3 s", "0.6 s"]]},
            "timer.plantarflexor": TIMES["timer.plantarflexor"],
            "timer.dorsiflexor": {},
        }
    if kind in ("silencer", "leak"):
        open_end = {"kind": "orifice", "upstream": "supply", "downstream": "manifold"} | SLOW
        return FED | {
            "orthosis.restriction.probe": table | {"upstream": "manifold", "downstream": "ambient"},
            "orthosis.restriction.feed": open_end,
        }
    timed = {"timer.probe": {"open": [["0.01 s", "0.4 s"]]}} if kind == "valve" else {}
    return FED | {"orthosis.restriction.probe": table} | timed


BASE: dict[str, dict[str, Any]] = {
    "tube": {"tube": {"bore": "1 mm"}, "length": "5 m"},
    "orifice": SLOW,
    "throttle": SLOW | {"check_conductance": "0.5 dm^3/(s*bar)", "cracking_pressure": "0.1 bar"},
    "check_valve": SLOW | {"conductance": "0.5 dm^3/(s*bar)", "cracking_pressure": "0.1 bar"},
    "quick_exhaust": SLOW | {"exhaust_conductance": "0.3 dm^3/(s*bar)", "cracking_pressure": "0.02 bar"},
    "silencer": SLOW,
    "leak": SLOW,
    "valve": {"valve": WIDE | SLOW},
    "regulator": {"regulator": REGULATOR, "pressure": "2 bar"},
}
CHANGED: dict[str, Any] = {
    "tube": {"bore": "1.2 mm"},
    "length": "3 m",
    "valve": WIDE | SLOW | {"opening_delay": "20 ms"},
    "regulator": REGULATOR | {"droop": "1 bar"},
    "pressure": "1.5 bar",
    "conductance": "0.06 dm^3/(s*bar)",
    "critical_ratio": 0.5,
    "check_conductance": "0.3 dm^3/(s*bar)",
    "exhaust_conductance": "0.2 dm^3/(s*bar)",
    "cracking_pressure": "0.4 bar",
}
# a tube's inertia needs air at both ends: tests/air/test_lines.py
FIELDS = [(kind, key) for kind, part in PARTS.items() for key in part.own if key != "inertia"]


def run(sets: dict[str, Any]) -> afo_sim.Recording:
    made = afo_sim.run("seated", DURATION | TIMES | STOUT | sets)
    assert made.ok
    return made


def moved(before: dict[str, Any], after: dict[str, Any], column: str) -> float:
    """Largest change of a column, of its largest value."""
    one, other = run(before)[column], run(after)[column]
    return float(np.abs(other - one).max() / np.abs(one).max())


def test_every_field_of_a_restriction_is_declared() -> None:
    told = {"kind", "upstream", "downstream", "inertia", *WORDS}
    assert set(Restriction.model_fields) - told == set(CHANGED)


@pytest.mark.parametrize(("kind", "field"), sampled(FIELDS, 10))
def test_a_field_of_a_restriction_acts(kind: str, field: str) -> None:
    after = restricted(kind, **{field: CHANGED[field]})
    assert moved(restricted(kind), after, MUSCLES) > 1e-3


# Which sets stand before, what a field is changed to, and the column that moves.
BOTTLE = {"kind": "bottle", "volume": "5 ml", "filling_pressure": "60 bar", "shell_heat_capacity": "1 J/K"}
CARTRIDGE = {
    "kind": "cartridge",
    "gas": "co2",
    "content": "1 g",
    "volume": "2 ml",
    "shell_heat_capacity": "1 J/K",
    "wall_conductance": "0.05 W/K",
}
COMPRESSOR = {
    "kind": "compressor",
    "volume": "50 ml",
    "wall_conductance": "0.05 W/K",
    "switch_on": "4.5 bar",
    "switch_off": "5 bar",
    "free_air_delivery": "5 l/min",
    "delivery_pressure": "1 bar",
    "stall_pressure": "8 bar",
}
STORE, TANK = "store/source/pressure", "volume/source/pressure"
OF_SOURCE: dict[str, tuple[dict[str, Any], Any, str]] = {
    "volume": (BOTTLE, "6 ml", STORE),
    "filling_pressure": (BOTTLE, "70 bar", STORE),
    "shell_heat_capacity": (CARTRIDGE, "5 J/K", STORE),
    "wall_conductance": (CARTRIDGE, "5 W/K", STORE),
    "content": (CARTRIDGE, "0.9 g", "store/source/mass"),
    "switch_on": (COMPRESSOR, "4.9 bar", TANK),
    "switch_off": (COMPRESSOR, "6 bar", TANK),
    "free_air_delivery": (COMPRESSOR, "8 l/min", TANK),
    "delivery_pressure": (COMPRESSOR, "0 bar", TANK),
    "stall_pressure": (COMPRESSOR, "12 bar", TANK),
}
SAID = {"kind", "gas", "mass", "electric_power"}  # a kind is not a number; mass and power are only told


def test_every_field_of_a_source_is_declared() -> None:
    assert set(Source.model_fields) - WORDS - SAID == set(OF_SOURCE)


@pytest.mark.parametrize("field", sampled(OF_SOURCE, 4))
def test_a_field_of_a_source_acts(field: str) -> None:
    table, value, column = OF_SOURCE[field]
    assert moved({"supply.source": table}, {"supply.source": table | {field: value}}, column) > 1e-4


def test_the_gas_acts() -> None:
    air = {"kind": "bottle", "volume": "5 ml", "filling_pressure": "40 bar"}
    assert moved({"supply.source": air}, {"supply.source": air | {"gas": "co2"}}, MUSCLES) > 1e-2


LINE = {"supply.regulator": REGULATOR, "supply.line_pressure": "6 bar"}
OUTLET = "volume/regulator/pressure"
OF_REGULATOR: dict[str, Any] = {
    "droop": "0.2 bar",
    "rated_flow": "5 l/min",
    "conductance": "0.02 dm^3/(s*bar)",
    "critical_ratio": 0.85,
    "relief": "0.3 bar",
    "relief_conductance": "0.01 dm^3/(s*bar)",
    "outlet_volume": "20 ml",
    "bleed": "3 l/min",
}


def test_every_field_of_a_regulator_is_declared() -> None:
    assert set(Regulator.model_fields) - WORDS - {"set_range"} == set(OF_REGULATOR)  # bounds what may be set


@pytest.mark.parametrize("field", sampled(OF_REGULATOR, 4))
def test_a_field_of_a_regulator_acts(field: str) -> None:
    sets = LINE
    if field.startswith("relief"):  # air is pushed back into the outlet: the chamber begins above it
        back = {"kind": "orifice", "upstream": "high", "downstream": "manifold"} | SLOW
        high = {"volume": "200 ml", "start_pressure": "8 bar"}
        sets = restricted("regulator", pressure="1 bar") | {
            "orthosis.volume.high": high,
            "orthosis.restriction.back": back,
        }
        after = sets | {"orthosis.restriction.probe.regulator": REGULATOR | {field: OF_REGULATOR[field]}}
        assert moved(sets, after, MANIFOLD) > 1e-3
        return
    own = REGULATOR
    if field == "critical_ratio":  # it has a say where the seat is open and not choked
        own = REGULATOR | {"droop": "0.05 bar"}
        sets = {"supply.regulator": own, "supply.line_pressure": "4.3 bar"}
    after = sets | {"supply.regulator": own | {field: OF_REGULATOR[field]}}
    assert moved(sets, after, OUTLET) > 1e-3


def test_every_field_of_supply_volume_tube_and_chamber_is_declared() -> None:
    assert set(Supply.model_fields) - WORDS == {"pressure", "source", "regulator", "line_pressure"}
    assert set(Volume.model_fields) - WORDS == set(OF_VOLUME)
    assert set(Tube.model_fields) - WORDS == {"bore", "outer_diameter"}  # the outer one is for fittings
    of_chamber = {"inlet", "outlet", "tube_volume", "wall_conductance"}  # test_liveness.py moves these
    assert set(Chamber.model_fields) - WORDS - of_chamber == {
        "feed",
        "exhaust",
        "tube",
        "tube_length",
        "quick_exhaust",
        *("tube_inertia", "port_volume", "wall_conductance_by_flow"),  # tests/air/test_lines.py moves these
    }
    assert set(QuickExhaust.model_fields) - WORDS == set(BASE["quick_exhaust"])


def test_the_line_pressure_acts() -> None:
    assert moved(LINE, LINE | {"supply.line_pressure": "5 bar"}, OUTLET) > 1e-3


OF_VOLUME = {"volume": "20 ml", "wall_conductance": "2 W/K", "start_pressure": "3 bar"}
OF_VOLUME |= {"wall_conductance_by_flow": "5000 J/(kg*K)"}


@pytest.mark.parametrize("field", OF_VOLUME)
def test_a_field_of_a_volume_acts(field: str) -> None:
    sets = restricted("orifice")
    table = sets["orthosis.volume.manifold"] | {field: OF_VOLUME[field]}
    assert moved(sets, sets | {"orthosis.volume.manifold": table}, MANIFOLD) > 1e-3


def test_a_chambers_tube_and_ways_act() -> None:
    at = "orthosis.chamber.dorsiflexor"
    tube = {f"{at}.tube": {"bore": "1.5 mm"}, f"{at}.tube_length": "1 m"}
    assert moved({}, tube, MUSCLES) > 1e-2
    assert moved(tube, tube | {f"{at}.tube_length": "2 m"}, MUSCLES) > 1e-3
    assert moved({}, {f"{at}.exhaust": "plantarflexor"}, "chamber/plantarflexor/pressure") > 0.5


TUBE = {"tube": {"bore": "2.5 mm"}, "tube_length": "2 m"}


def at_muscle(**own: Any) -> dict[str, Any]:
    """A chamber's tube with a quick exhaust at the muscles' end."""
    table = TUBE | {"quick_exhaust": BASE["quick_exhaust"] | own}
    return {f"orthosis.chamber.dorsiflexor.{key}": value for key, value in table.items()}


@pytest.mark.parametrize("field", BASE["quick_exhaust"])
def test_a_field_of_a_chambers_quick_exhaust_acts(field: str) -> None:
    assert moved(at_muscle(), at_muscle(**{field: CHANGED[field]}), MUSCLES) > 1e-3


def test_a_quick_exhaust_at_the_muscles_vents_past_a_narrow_outlet() -> None:
    """It fills through the inlet, empties faster than through tube and outlet; nothing comes by itself."""
    at = "orthosis.chamber.dorsiflexor."
    tube = {f"{at}{key}": value for key, value in TUBE.items()} | {f"{at}outlet": WIDE | SLOW}
    quick = tube | at_muscle(conductance="1 dm^3/(s*bar)")
    shut = {"timer.dorsiflexor": {"outlet": [["0 s", "0.6 s"]]}}
    made, parts = run(quick), "restriction/dorsiflexor_quick_exhaust"
    without, with_it = run(tube)[MUSCLES], made[MUSCLES]
    mass = made["chamber/dorsiflexor/mass"]
    flows = (made[f"{parts}{end}/mass_flow"] for end in ("", "_exhaust"))
    came, went = (float((flow[:-1] * np.diff(made["time"])).sum()) for flow in flows)
    assert came > 0.0 and went > 0.0 and came - went == pytest.approx(mass[-1] - mass[0], abs=1e-10 * came)
    full = len(without) // 2
    assert with_it[full] == pytest.approx(without[full], rel=0.03)
    assert with_it[full] - with_it[-1] > 2.0 * (without[full] - without[-1])
    assert np.abs(run(quick | shut)[MUSCLES]).max() < 1.0
