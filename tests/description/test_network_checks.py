"""Air paths that cannot work are refused by component with what would mend them; unusual ones are told."""

import pathlib
import re
import tomllib
from typing import Any, get_args

import pytest

from afo_sim.common import InputError
from afo_sim.description import load
from afo_sim.description.air import air_parts, network_checks
from afo_sim.model.air_checks import check_air_path, durations
from afo_sim.native import air_block

C, R, V = "orthosis.chamber.dorsiflexor.", "orthosis.restriction.", "orthosis.volume."
WIDE = {"conductance": "0.5 dm^3/(s*bar)", "critical_ratio": "0.3"}
LEAK = {"kind": "leak", "conductance": "0.001 dm^3/(s*bar)"}
REGULATOR = {"kind": "regulator", "regulator": "droop_tenth", "pressure": "3 bar"}
SECOND = REGULATOR | {"pressure": "2 bar"}
VALVE = {"kind": "valve", "valve": "mh1"}
FED = {f"{V}manifold.volume": "20 ml", f"{C}feed": "manifold"}
THREE_WAY = {
    "orthosis.chamber.dorsiflexor": {"inlet": "mha2", "tube_volume": "4 ml", "wall_conductance": "0.5 W/K"},
    "timer.dorsiflexor.outlet": [],
}
TIMELESS = {key: value for key, value in THREE_WAY.items() if not key.startswith("timer")}


def fed(kind="orifice", **changed):
    """The dorsiflexor behind a manifold that is fed through one restriction."""
    given = {"orifice": WIDE, "check_valve": WIDE, "valve": {"valve": "mh1"}}.get(kind, {})
    given = REGULATOR if kind == "regulator" else given
    ends = {"upstream": "supply", "downstream": "manifold"}
    return FED | {f"{R}feed": {"kind": kind} | given | ends | changed}


def between(kind, upstream, downstream, **given):
    return {"kind": kind, "upstream": upstream, "downstream": downstream} | (given or WIDE)


REFUSED = [
    (fed() | {f"{C}feed": "manifolt"}, f"{C}feed", "no node 'manifolt'.*'manifold'"),
    ({f"{C}feed": "dorsiflexor"}, f"{C}feed", "the chamber itself"),
    ({f"{C}exhaust": "dorsiflexor"}, f"{C}exhaust", "the chamber itself"),
    ({f"{C}feed": "ambient"}, f"{C}feed", "fills nothing.*supply"),
    ({f"{C}exhaust": "supply"}, f"{C}exhaust", "takes back no air.*ambient"),
    (FED, f"{C}feed", "nothing leads from the supply"),
    (
        fed("check_valve", upstream="dorsiflexor", downstream="manifold"),
        f"{C}feed",
        "nothing leads from the supply",
    ),
    (
        fed() | {f"{V}b.volume": "1 ml", f"{R}b": between("check_valve", "b", "manifold")},
        f"{V}b",
        "'b' lets air out of it only.*start_pressure",
    ),
    ({f"{V}tank.volume": "1 l", f"{C}exhaust": "tank"}, f"{C}exhaust", "'tank' to the ambient"),
    ({f"{V}b.volume": "1 ml"}, f"{V}b", "is unused"),
    ({f"{V}b.volume": "1 ml", f"{R}b": between("orifice", "supply", "b")}, f"{V}b", "no chamber"),
    ({f"{R}b": between("orifice", "supply", "ambient")}, f"{R}b", 'leak all.*"leak"'),
    (
        fed("check_valve", upstream="manifold", downstream="supply"),
        f"{R}feed.downstream",
        "takes back no air",
    ),
    (
        fed("regulator") | {f"{R}b": SECOND | {"upstream": "supply", "downstream": "manifold"}},
        f"{R}feed.pressure|{R}b.pressure",
        "conflicts with.*check valve",
    ),
    (
        fed("regulator")
        | {f"{V}b.volume": "1 ml", f"{R}t": between("orifice", "manifold", "b")}
        | {f"{R}b": SECOND | {"upstream": "supply", "downstream": "b"}},
        f"{R}feed.pressure|{R}b.pressure",
        "conflicts with",
    ),
    (
        fed("regulator") | {f"{R}t": between("orifice", "supply", "manifold")},
        f"{R}feed",
        "by-passed.*through t",
    ),
    (
        fed()
        | {f"{V}b.volume": "1 ml", f"{R}b": REGULATOR | {"upstream": "manifold", "downstream": "b"}}
        | {f"{R}c": REGULATOR | {"upstream": "b", "downstream": "manifold"}},
        f"{R}[bc].upstream",
        "fed by its own outlet, through [bc]",
    ),
    (fed("regulator", pressure="5 bar"), f"{R}feed.pressure", "'supply' has 4 bar at most"),
    (
        fed("regulator", pressure="2 bar")
        | {f"{V}b.volume": "1 ml", f"{C}feed": "b"}
        | {f"{R}b": REGULATOR | {"upstream": "manifold", "downstream": "b"}},
        f"{R}b.pressure",
        "'manifold' has 2 bar at most",
    ),
    (fed("regulator", pressure="19 bar"), f"{R}feed.pressure", "0.5 bar to 7 bar"),
    (
        {"supply.pressure": "12 bar", "supply.source": "bottle_0_5l_10bar"},
        "supply.pressure",
        r"more than its full source has \(bottle_0_5l_10bar, 10 bar\).*less than 10 bar",
    ),
    (
        FED
        | {f"{V}manifold.start_pressure": "6 bar", "orthosis.chamber.plantarflexor.feed": "manifold"}
        | {"supply.source": "bottle_0_5l"},
        "supply",
        "its source has nothing to feed",
    ),
    ({"orthosis.chamber.dorsiflexor": {"outlet": "mh1"}}, f"{C}inlet", r"a name or a path \(Valve from the"),
    ({"orthosis.restriction": 3}, "orthosis.restriction", r"not a table.*\[.*restriction.NAME\]"),
    (
        {f"{R}b": {"kind": "orifice", "upstream": "dorsiflexor", "conductance": "1 dm^3/(s*bar)"}},
        f"{R}b.critical_ratio",
        "an orifice needs it",
    ),
    ({f"{V}b.volume": "0 ml"}, f"{V}b.volume", "more than 0 ml"),
    (
        {f"{R}b": LEAK | {"upstream": "dorsiflexor", "conductance": "-1 dm^3/(s*bar)"}},
        f"{R}b.conductance",
        "out of range",
    ),
    (fed(critical_ratio="1.2"), f"{R}feed.critical_ratio", "at most 0.9"),
    (fed(critical_ratio="-0.1"), f"{R}feed.critical_ratio", "at least 0"),
    (
        {f"{R}qe": between("check_valve", "dorsiflexor_valve_end", "dorsiflexor")},
        f"{R}qe.upstream",
        "end of a chamber's own tube.*chamber.dorsiflexor.quick_exhaust",
    ),
    (
        {f"{C}quick_exhaust": WIDE | {"exhaust_conductance": "0.5 dm^3/(s*bar)"}},
        f"{C}quick_exhaust",
        "needs a tube.*tube_length",
    ),
    ({f"{R}dorsiflexor": LEAK | {"upstream": "dorsiflexor"}}, f"{R}dorsiflexor", "chamber's name"),
    ({f"{V}dorsiflexor.volume": "1 ml"}, f"{V}dorsiflexor", "another node"),
    ({f"{V}supply.volume": "1 ml"}, f"{V}supply", "another node"),
    ({f"{V}regulator.volume": "1 ml"}, f"{V}regulator", "of its own|is reserved"),
    (
        {f"{R}dorsiflexor_inlet": LEAK | {"upstream": "dorsiflexor"}},
        f"{R}dorsiflexor_inlet",
        "part of chamber",
    ),
    ({f"{R}compressor": LEAK | {"upstream": "dorsiflexor"}}, f"{R}compressor", "is reserved"),
    (
        {f"{C}tube": "pun_4x2_5", f"{C}tube_length": "1 m", f"{V}dorsiflexor_valve_end.volume": "1 ml"},
        f"{V}dorsiflexor_valve_end",
        "tube of chamber",
    ),
    ({f"{R}period": VALVE | {"upstream": "dorsiflexor"}}, f"{R}period", "is reserved"),
    (fed() | {"timer.feed.open": [["0 s", "1 s"]]}, "timer.feed", "has no coil.*'orifice'"),
    (
        {f"{V}v{k}.volume": "1 ml" for k in range(network_checks.MOST_NODES)}
        | {f"{R}r{k}": between("orifice", "dorsiflexor", f"v{k}") for k in range(network_checks.MOST_NODES)},
        "orthosis.volume",
        "too many for one network.*up to 32",
    ),
    (
        {f"{R}r{k}": LEAK | {"upstream": "dorsiflexor"} for k in range(network_checks.MOST_RESTRICTIONS)},
        "orthosis.restriction",
        "too many for one network.*up to 64",
    ),
    (THREE_WAY | {"drive.dorsiflexor.kind": "bang_bang"}, "drive.dorsiflexor", "never shut.*2/2 valves"),
    (TIMELESS, "timer.dorsiflexor.outlet", "has no coil.*outlet valve"),
]


@pytest.mark.parametrize(("sets", "field", "said"), REFUSED)
def test_what_cannot_work_is_refused_by_name(sets: dict[str, Any], field: str, said: str) -> None:
    with pytest.raises(InputError, match=rf"(?:{field.replace('.', chr(92) + '.')}).*(?:{said})"):
        load("scenario", "seated", sets)


UNUSUAL = [
    fed(),
    fed("regulator"),
    {f"{R}b": LEAK | {"upstream": "supply"}},
    FED | {f"{V}manifold.start_pressure": "6 bar"},  # a reservoir without a supply
    {f"{V}b.volume": "20 ml", f"{C}exhaust": "b", "orthosis.chamber.plantarflexor.feed": "b"},  # recovered
    fed("regulator")
    | {f"{V}b.volume": "1 ml", f"{R}t": between("check_valve", "manifold", "b")}
    | {f"{R}b": SECOND | {"upstream": "supply", "downstream": "b"}},
]


@pytest.mark.parametrize("sets", UNUSUAL)
def test_what_is_only_unusual_is_read(sets: dict[str, Any]) -> None:
    assert load("scenario", "seated", sets).orthosis.chamber


WARNED = [
    (fed() | {f"{R}v": VALVE | {"upstream": "manifold"}}, "'v' never opens: set timer.v.open"),
    (
        {f"{V}b.volume": "1 ml", f"{R}b": between("check_valve", "dorsiflexor", "b")},
        "volume 'b' fills and never vents",
    ),
    (fed() | {f"{R}b": between("silencer", "manifold", "ambient")}, "through feed, b"),
    (
        fed()
        | {f"{R}qe": between("quick_exhaust", "manifold", "dorsiflexor")}
        | {f"{R}qe.exhaust_conductance": "0.5 dm^3/(s*bar)"},
        "always connected to the supply.*bypassed by restriction 'feed', 'qe'; chamber.dorsiflexor.quick",
    ),
    (
        fed() | {f"{V}manifold.start_pressure": "6 bar"},
        "volume 'manifold' starts with 6 bar, more than the supply's 4 bar",
    ),
    (
        {f"{C}tube": "pun_4x2_5", f"{C}tube_length": "10 m"},
        "chamber 'dorsiflexor' is 10 m long.*29.* ms",
    ),
    (
        {"supply.pressure": "9 bar", f"{C}inlet": "matrix_821"},
        "dorsiflexor_inlet .* has 9 bar before it, but its maker allows only 6 bar",
    ),
    (
        {
            f"{C}inlet": {
                "conductance": "0.1 dm^3/(s*bar)",
                "critical_ratio": "0.3",
                "opening_delay": "1 ms",
                "closing_delay": "1 ms",
                "working_pressure": ["5 bar", "10 bar"],
            }
        },
        "has 4 bar before it, but needs 5 bar",
    ),
]


@pytest.mark.parametrize(("sets", "said"), WARNED)
def test_what_is_unusual_is_told(sets: dict[str, Any], said: str) -> None:
    found = check_air_path(load("scenario", "seated", sets))
    assert any(re.search(said, warning) for warning in found), found


def test_shipped_scenarios_have_nothing_unusual_in_their_air() -> None:
    for name in ("seated", "seated-antagonist", "walk-dropfoot-afo", "walk-dropfoot-afo-timer", "arm"):
        assert check_air_path(load("scenario", name)) == []


def test_example_of_the_page_is_read_and_has_nothing_unusual() -> None:
    text = pathlib.Path(__file__).parents[2].joinpath("docs", "air.md").read_text()
    (block,) = re.findall(r"```toml\n(.*?)```", text.partition("## Examples")[2], re.DOTALL)
    sets = {f"orthosis.chamber.{name}": each for name, each in tomllib.loads(block)["chamber"].items()}
    assert check_air_path(load("scenario", "seated-antagonist", sets)) == []


SHORT = {"inlet": "mh1", "outlet": "mh1", "tube_volume": "4 ml", "wall_conductance": "0.5 W/K"}
THROTTLE = WIDE | {"conductance": "0.05 dm^3/(s*bar)", "check_conductance": "0.5 dm^3/(s*bar)"}
USUAL: list[dict[str, Any]] = [
    {
        f"{V}manifold.volume": "10 ml",
        f"{R}feed": between("throttle", "supply", "manifold", **THROTTLE),
        "orthosis.chamber.dorsiflexor": SHORT | {"feed": "manifold"},
    },
    {"orthosis.chamber.dorsiflexor": SHORT | {"exhaust": "plantarflexor"}},
    {
        f"{R}share": VALVE | {"upstream": "dorsiflexor", "downstream": "plantarflexor"},
        "timer.share": {"open": [["4 s", "5 s"]]},
    },
]


@pytest.mark.parametrize("sets", USUAL)
def test_usual_networks_are_read_and_have_nothing_unusual(sets: dict[str, Any]) -> None:
    assert check_air_path(load("scenario", "seated-antagonist", sets)) == []


def test_room_is_that_of_compiled_code() -> None:
    assert network_checks.MOST_NODES == air_block.MOST_NODES - air_block.FIRST_NODE
    assert network_checks.MOST_RESTRICTIONS == air_block.MOST_EDGES


def test_durations_of_repeating_intervals() -> None:
    assert durations(((0.2, 0.3), (0.3, 0.6)), 1.0) == pytest.approx([0.4])
    assert durations(((0.9, 0.1),), 1.0) == pytest.approx([0.2])
    assert durations(((0.0, 0.1), (0.95, 1.0), (0.5, 0.51)), 1.0) == pytest.approx([0.01, 0.15])
    assert durations(((0.0, 1.0),), 1.0) == []


def test_every_kind_of_part_has_one_entry() -> None:
    assert set(get_args(air_parts.Kind)) == air_parts.PARTS.keys()
