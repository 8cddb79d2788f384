"""Keys that can be set: all of them, the field at one, nearest ones; checked when set."""

import math
import pathlib
import time

import pytest
from command import call

from afo_sim.common import InputError, assets
from afo_sim.description import field_at, load, product
from afo_sim.description.keys import keys
from afo_sim.lab.run_problem import KINDS, find_parameters
from afo_sim.physics import FRICTIONS, LAWS


@pytest.mark.parametrize("name", ["arm-s1", "walk-dropfoot-afo"])
def test_every_key_is_a_field_of_the_same_unit(name: str) -> None:
    scenario = load("scenario", name)
    for key in keys(name):
        if key.value != "[]" and not (key.value == "" and key.allowed.startswith("two of")):  # no empty list
            assert field_at(key.key, scenario).unit == key.unit, key
        assert key.meaning.endswith("."), key
        assert key.allowed, key


def test_every_value_can_be_set_and_changes_nothing() -> None:
    """What `keys` prints is what `--set` reads."""
    shipped = load("scenario", "walk-dropfoot-afo")
    sets = {
        key.key: float(key.value) if key.value.replace(".", "").isdigit() and not key.unit else key.value
        for key in keys("walk-dropfoot-afo")
        if key.value and key.value != "[]" and key.allowed not in ("a name or a path", "a text")
    }
    counts = ("count", "seed")
    whole = {k: int(v) if isinstance(v, float) and k.endswith(counts) else v for k, v in sets.items()}
    again = load("scenario", "walk-dropfoot-afo", whole)
    assert len(whole) > 100
    for key in whole:
        value, now = (field_at(key, scenario).value for scenario in (shipped, again))
        assert value == now or value == pytest.approx(now, rel=1e-12), key


def test_a_key_says_where_its_value_comes_from(tmp_path: pathlib.Path) -> None:
    text = (assets.folder("models") / "scenarios" / "seated.toml").read_text()
    (tmp_path / "mine.toml").write_text(text.replace('"4 bar"', '"3 bar"'))
    found = {key.key: key for key in keys(tmp_path / "mine.toml", sets={"duration": "2 s"})}
    assert found["supply.pressure"].source == str(tmp_path / "mine.toml")
    assert found["supply.pressure"].value == "3 bar"
    assert (found["duration"].value, found["duration"].source) == ("2 s", "set")
    assert found["load_moment"].source == "default"
    valve = found["orthosis.chamber.dorsiflexor.inlet.opening_delay"]
    assert (valve.source, valve.kind) == ("models/valves/mh1/valve.toml", "published")
    swapped = keys("seated", "bore", {"orthosis.muscle.dorsiflexor.type": "dmsp_10"})
    assert [key.source for key in swapped if "Inner diameter" in key.meaning] == [
        "models/muscles/dmsp_10/muscle.toml",
        "models/muscles/s1_215mm/muscle.toml",
    ]
    assert "timer.dorsiflexor.inlet[0][1]" in found
    assert not any(key.startswith("gait.") for key in found)


def test_keys_command_filters(capsys: pytest.CaptureFixture[str]) -> None:
    code, printed, _ = call(capsys, "keys", "seated", "tube")
    assert code == 0
    assert "orthosis.chamber.plantarflexor.tube_volume" in printed
    assert "duration" not in printed
    assert call(capsys, "keys", "seated", "zzz")[0] == 2
    assert "did you mean 'pressure'" in call(capsys, "keys", "seated", "presure")[2]


@pytest.mark.parametrize("columns", [80, 120, 150, 200])
def test_keys_stand_beside_long_sources(
    columns: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    code, printed, _ = call(capsys, "keys", "seated", "pressure")
    assert code == 0
    assert {"key", "value"} <= set(" ".join(printed.splitlines()[1:3]).split())
    assert any(line.startswith("supply.pressure ") for line in printed.splitlines())


@pytest.mark.parametrize(
    ("key", "expected"),
    [
        ("pressure", "supply.pressure"),
        ("conductance", "orthosis.chamber.dorsiflexor.inlet.conductance"),
        ("orthosis.conductance", "orthosis.chamber.dorsiflexor.inlet.conductance"),
        ("seed", "gait.seed"),
        ("perod", "timer.period"),
        ("supply.presure", "pressure"),
        ("orthosis.muscle.dorsiflexor.type.bor", "bore"),
    ],
)
def test_unknown_key_suggests_across_levels(key: str, expected: str) -> None:
    with pytest.raises(InputError) as caught:
        load("scenario", "seated", {key: 3})
    assert caught.value.nearest == expected


def test_unknown_key_in_a_file_suggests_one_of_that_file(tmp_path: pathlib.Path) -> None:
    text = (assets.folder("models") / "scenarios" / "seated.toml").read_text()
    (tmp_path / "mine.toml").write_text('presure = "3 bar"\n' + text)
    with pytest.raises(InputError, match=r"presure.*did you mean 'supply\.pressure'"):
        load("scenario", tmp_path / "mine.toml")


def test_a_very_long_key_is_refused_at_once() -> None:
    begun = time.process_time()
    with pytest.raises(InputError) as refused:
        load("scenario", "seated", {"supply." + "pressure" * 8000: "3 bar"})
    assert refused.value.nearest is None
    assert time.process_time() - begun < 2.0  # 12 s when every name was compared in full


def test_all_problems_of_a_file_at_once(tmp_path: pathlib.Path) -> None:
    (tmp_path / "muscle.toml").write_text(
        """
        law = "tondu_lopez_2000_bladder"
        total_lenth = "21 cm"
        bore = "11 kg"
        [laws.tondu_lopez_2000_bladder]
        k = 9.0
        bladder = "3 N"
        pressure_range = ["1 m", "2 bar"]
        [laws.foo]
        [limits]
        pressure = 3
        """
    )
    with pytest.raises(InputError) as caught:
        load("muscle", tmp_path)
    problems = [caught.value, *caught.value.others]
    fields = [problem.field for problem in problems]
    law = "laws.tondu_lopez_2000_bladder"
    assert fields[0] == "total_lenth"
    assert {f"{law}.k", f"{law}.bladder", f"{law}.bladder_force", f"{law}.pressure_range.0"} < set(fields)
    assert {"laws.foo", "bore", "end_length", "damping", "mass", "limits.pressure", "limits.force"} < set(
        fields
    )
    assert "total_length" not in fields  # its misspelling is told
    assert len(fields) == len(set(fields))
    assert str(caught.value).count("\n") == len(problems) - 1


def test_unfound_names_stand_among_the_other_problems(tmp_path: pathlib.Path) -> None:
    text = (assets.folder("models") / "scenarios" / "seated.toml").read_text()
    text = text.replace('"adult_75kg"', '"adult"').replace('"s1"', '"s2"').replace('"4 bar"', "4")
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(InputError) as caught:
        load("scenario", tmp_path / "mine.toml")
    fields = {problem.field for problem in (caught.value, *caught.value.others)}
    assert fields == {"leg", "orthosis", "supply.pressure"}


def test_replaced_values_are_checked() -> None:
    scenario, muscle = load("scenario", "seated"), load("muscle", "s1_215mm")
    assert scenario.with_values(duration=2.0).duration == 2.0
    assert muscle.with_values(total_length=0.3).total_length == 0.3
    with pytest.raises(InputError, match="out of range"):
        scenario.with_values(duration=-4.0)
    with pytest.raises(InputError, match="no braid is left"):
        muscle.with_values(end_length=0.3)
    with pytest.raises(InputError, match="did you mean 'duration'"):
        scenario.with_values(duraton=4.0)
    assert muscle.with_values() == muscle


@pytest.mark.slow
@pytest.mark.parametrize("kind", assets.KINDS)
def test_each_product_is_listed_whole(kind: str) -> None:
    for name in assets.names(kind):
        titles = [title for title, _, _ in product(name)]
        assert any(title.startswith(f"{kind} {name}:") for title in titles)
        assert all(rows for _, _, rows in product(name))


def test_listed_muscle_tells_every_number_and_its_source() -> None:
    (_, header, rows), *_ = product("s1_215mm")
    found = {row[0]: dict(zip(header, row, strict=True)) for row in rows}
    muscle = load("muscle", "s1_215mm")
    assert {f"limits.{name}" for name in muscle.limits.provenance} < set(found)
    for name, told in muscle.provenance.items():
        assert (found[name]["kind"], found[name]["source"]) == (told.kind, told.source)


@pytest.mark.parametrize("name", [*LAWS, *FRICTIONS])
def test_law_is_listed_with_its_parameters(name: str) -> None:
    rows = next(rows for title, _, rows in product(name) if title == "parameters")
    assert [row[0] for row in rows] == [p.name for p in {**LAWS, **FRICTIONS}[name].parameters]


def test_gaits_are_listed() -> None:
    for name in assets.gait_names():
        _, (_, _, columns) = product(name)
        assert columns


SCENARIO = load("scenario", "walk-dropfoot-afo")
TIMES = SCENARIO.phases.chambers["dorsiflexor"]
CHAMBER, VALVE = "orthosis.chamber.dorsiflexor", SCENARIO.orthosis.chamber["dorsiflexor"].inlet


@pytest.mark.parametrize(
    ("key", "value", "unit", "bounds"),
    [
        ("leg.friction", SCENARIO.leg.friction, "N*m", (0.0, 100.0)),
        ("supply.pressure", SCENARIO.supply.pressure, "Pa", None),
        ("gait.seed", SCENARIO.gait.seed, "", (-math.inf, math.inf)),
        ("phases.dorsiflexor.inlet[0][1]", TIMES.inlet[0][1], "", (0.0, 1.0)),
        (f"{CHAMBER}.inlet.conductance", VALVE.conductance, "m^3/(s*Pa)", (0.0, 1e-6)),
    ],
)
def test_a_field_says_value_unit_and_bounds(
    key: str, value: object, unit: str, bounds: tuple[float, float] | None
) -> None:
    field = field_at(key, SCENARIO)
    assert field.value == value
    assert field.unit == unit
    assert bounds is None or field.bounds == bounds


def test_what_a_fit_searches_lies_within_what_its_field_allows() -> None:
    for name, (sets, _, kind) in KINDS.items():
        if not sets:
            continue
        (parameter,) = find_parameters([name], SCENARIO)
        for key in parameter.keys:
            field = field_at(key, SCENARIO)
            low, high = field.bounds
            assert low <= kind.lower < kind.upper <= high, name
            assert parameter.unit == field.unit
        assert parameter.low == field_at(next(iter(parameter.keys)), SCENARIO).value
