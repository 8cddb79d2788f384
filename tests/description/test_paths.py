"""A muscle's path as files, `--set`, sweeps, `keys` and `new` have it; and what is refused of it."""

import pathlib
import tomllib
from typing import Any

import pytest
from command import call

from afo_sim.common import InputError
from afo_sim.description import facts, field_at, load, product, toml_text
from afo_sim.description.keys import keys
from afo_sim.description.new import new
from afo_sim.description.portable import portable
from afo_sim.description.schema import dotted_key, split_key

GROUP = "orthosis.muscle.dorsiflexor"
PATH, FRICTION = f"{GROUP}.path", f"{GROUP}.wrap_friction"
ROLLER: dict[str, Any] = {
    "segment": "shank",
    "from_joint": ["4.5 cm", "0 cm", "5 cm"],
    "surface": {"shape": "cylinder", "radius": "2 cm", "axis": [0, 1, 0]},
}
EYE: dict[str, Any] = {"segment": "shank", "from_joint": ["7 cm", "0 cm", "2 cm"], "spacing": "2 cm"}


def rolling(**surface: Any) -> dict[str, Any]:
    """A path over the roller with another surface."""
    return {PATH: [ROLLER | {"surface": surface}]}


FRICTION_AND_PATH = """
wrap_friction = { value = 0.2, kind = "assumed", source = "nobody measured it" }

[[muscle.dorsiflexor.path]]
segment = "shank"
from_joint = { value = ["4.5 cm", "0 cm", "5 cm"], kind = "assumed", source = "drawn" }
surface = { shape = "cylinder", radius = "2 cm", axis = [0, 1, 0] }

[[muscle.dorsiflexor.path]]
segment = "shank"
from_joint = ["7 cm", "0 cm", "2 cm"]

[muscle.plantarflexor]
"""


@pytest.fixture
def own(tmp_path: pathlib.Path) -> pathlib.Path:
    file = new("orthosis", "brace", tmp_path, like="s1")
    before, _, after = file.read_text().partition("[muscle.plantarflexor]\n")
    file.write_text(before + FRICTION_AND_PATH + after)
    return file


@pytest.mark.parametrize(
    ("key", "path", "items"),
    [
        ("gait.seed", ("gait", "seed"), ()),
        ("timer.a.inlet[0][1]", ("timer", "a", "inlet"), (0, 1)),
        ("a.path[1].surface.radius", ("a", "path", "1", "surface", "radius"), ()),
        ("a.path[0].from_joint[2]", ("a", "path", "0", "from_joint"), (2,)),
        ("a.path[10]", ("a", "path"), (10,)),
    ],
)
def test_a_key_goes_through_lists_of_tables(key: str, path: tuple[str, ...], items: tuple[int, ...]) -> None:
    assert split_key(key) == (path, items)
    assert dotted_key((*path, *map(str, items))) == key


@pytest.mark.parametrize("key", ["a[", "a]b", "a[x].b", "a[0]b.c", "a[0", "a[1234567].b"])
def test_no_key_is_refused(key: str) -> None:
    with pytest.raises(InputError, match="is not a valid key"):
        split_key(key)


def test_a_file_holds_a_path(own: pathlib.Path) -> None:
    group = load("orthosis", own).muscle["dorsiflexor"]
    assert [place.surface is not None for place in group.path] == [True, False]
    assert group.path[0].surface is not None and group.path[0].surface.radius == 0.02
    assert group.path[0].provenance["from_joint"].kind == "assumed"
    assert (group.wrap_friction, group.provenance["wrap_friction"].kind) == (0.2, "assumed")


def test_set_changes_one_number_of_a_path(own: pathlib.Path) -> None:
    found = load("orthosis", own, {"muscle.dorsiflexor.path[0].from_joint[0]": "4 cm"}).muscle["dorsiflexor"]
    assert found.path[0].from_joint == (0.04, 0.0, 0.05)
    assert found.path[0].provenance["from_joint"].kind == "user"
    assert found.path[1] == load("orthosis", own).muscle["dorsiflexor"].path[1]
    assert tomllib.loads(own.read_text())  # and the file stays
    scenario = load("scenario", "seated", {"orthosis": str(own), f"{PATH}[0].surface.radius": "1 cm"})
    assert scenario.orthosis.muscle["dorsiflexor"].path[0].surface.radius == 0.01  # type: ignore[union-attr]
    again = scenario.set({f"{PATH}[1].from_joint[2]": "3 cm"})
    assert again.orthosis.muscle["dorsiflexor"].path[1].from_joint[2] == 0.03


def test_a_whole_path_comes_before_its_parts() -> None:
    sets = {f"{PATH}[1].spacing": "1 cm", PATH: [ROLLER, EYE]}
    assert load("scenario", "seated", sets).orthosis.muscle["dorsiflexor"].path[1].spacing == 0.01
    assert EYE["spacing"] == "2 cm"


def test_every_number_of_a_path_is_a_key_that_can_be_set() -> None:
    scenario = load("scenario", "seated", {PATH: [ROLLER, EYE]})
    found = {key.key: key for key in keys("seated", sets={PATH: [ROLLER, EYE]}) if key.key.startswith(PATH)}
    numbers = [f"{PATH}[0].from_joint[{k}]" for k in range(3)] + [
        f"{PATH}[0].surface.axis[{k}]" for k in range(3)
    ]
    numbers += [f"{PATH}[0].surface.radius", f"{PATH}[1].spacing", f"{PATH}[1].from_joint[2]"]
    assert set(numbers) <= set(found)
    assert not any(key.startswith(f"{PATH}[1].surface.") for key in found)
    for name in numbers:
        assert field_at(name, scenario).unit == found[name].unit == ("" if "axis" in name else "m")
        value = found[name].value
        text = float(value) if "axis" in name else value
        assert load("scenario", "seated", {PATH: [ROLLER, EYE], name: text}) == scenario


def test_resolved_and_portable_scenarios_hold_the_path(own: pathlib.Path, tmp_path: pathlib.Path) -> None:
    scenario = load("scenario", "seated", {"orthosis": str(own)})
    again = load("scenario", scenario.resolved())
    assert again.orthosis.muscle == scenario.orthosis.muscle
    file = tmp_path / "moved" / "mine.toml"
    file.parent.mkdir()
    file.write_text(toml_text(portable(scenario.resolved(), file.parent)))
    assert load("scenario", file).orthosis.muscle == scenario.orthosis.muscle


def test_new_begins_from_a_path_and_shows_one(tmp_path: pathlib.Path) -> None:
    like = load("orthosis", new("orthosis", "mine", tmp_path, like="guided"))
    shipped = load("orthosis", "guided")
    assert {name: group.path for name, group in like.muscle.items()} == {
        name: group.path for name, group in shipped.muscle.items()
    }
    text = new("orthosis", "plain", tmp_path, whole=True).read_text()
    example = next(line for line in text.splitlines() if line.startswith("# path = "))
    path = tomllib.loads(example.removeprefix("# "))["path"]
    assert load("scenario", "seated", {PATH: path}).orthosis.muscle["dorsiflexor"].path[0].surface


def test_words_and_lists_tell_the_path(capsys: pytest.CaptureFixture[str]) -> None:
    told = dict(facts(load("scenario", "seated", {PATH: [ROLLER, EYE], FRICTION: 0.2}).resolved()))
    assert told["muscles, dorsiflexor"].endswith("; path over 1 point and 1 surface, friction 0.2")
    assert "path" not in told["muscles, plantarflexor"]
    ((_, _, rows),) = product("guided")
    assert any(row[0] == "muscle.dorsiflexor.path[0].surface.radius" and row[2] == "assumed" for row in rows)
    code, printed, _ = call(capsys, "keys", "seated", "path", "--set", "orthosis=guided")
    assert code == 0 and "path[0].surface.radius" in printed


@pytest.mark.parametrize(
    ("sets", "field", "problem"),
    [
        (rolling(radius="2 cm", axis=[0, 0, 0]), f"{PATH}.0.surface.axis", "no length"),
        ({PATH: [ROLLER, ROLLER]}, f"{PATH}.1.surface", "next to a surface"),
        (rolling(radius="26 cm"), f"{PATH}.0.surface.radius", "25 cm from its axis"),
        (rolling(shape="ball", radius="2 cm"), f"{PATH}.0.surface.shape", "not a valid choice"),
        (rolling(), f"{PATH}.0.surface.radius", "is missing"),
        ({PATH: [EYE | {"segment": "thigh"}]}, f"{PATH}.0.segment", "not a valid choice"),
        ({PATH: [EYE | {"spacin": "2 cm"}]}, f"{PATH}.0.spacin", "unknown key"),
        ({PATH: [EYE] * 13}, PATH, "too many items"),
        ({PATH: [3]}, f"{PATH}.0", "is not a table"),
        ({PATH: "round"}, PATH, "is not a list"),
        ({f"{PATH}[0].spacing": "2 cm"}, f"{PATH}[0].spacing", "there is no item"),
        ({PATH: [EYE], f"{PATH}[1].spacing": "2 cm"}, f"{PATH}[1].spacing", "there is no item"),
        ({PATH: [EYE], f"{PATH}.spacing": "2 cm"}, f"{PATH}.spacing", "name one of its items"),
        ({FRICTION: 0.2}, FRICTION, "has no effect: the path is straight"),
        ({PATH: [EYE | {"segment": "foot"}], FRICTION: 0.2}, FRICTION, "has no effect: the cable slides"),
        ({PATH: [EYE, EYE | {"segment": "foot"}, EYE], FRICTION: 0.2}, FRICTION, "segment to segment once"),
        ({PATH: [EYE], FRICTION: -0.1}, FRICTION, "out of range"),
        ({PATH: [EYE], f"{GROUP}.cable.offset": "40 cm"}, None, "is not shorter than the path"),
        ({PATH: [EYE], f"{GROUP}.insertion.segment": "shank"}, None, "on the same segment"),
    ],
)
def test_what_is_wrong_is_told_with_its_field(sets: dict[str, Any], field: str | None, problem: str) -> None:
    with pytest.raises(InputError, match=problem) as caught:
        load("scenario", "seated", sets)
    if field is not None:
        assert caught.value.field == field
    assert caught.value.allowed or caught.value.nearest


def test_a_path_does_not_go_with_a_pulley() -> None:
    with pytest.raises(InputError, match="does not go with a pulley") as caught:
        load("orthosis", "arm_s1", {"muscle.flexor.path": [EYE]})
    assert caught.value.field == "muscle.flexor.path"


def test_a_sphere_needs_no_axis_and_may_have_one() -> None:
    for axis in ({}, {"axis": [0, 0, 0]}, {"axis": [1, 0, 0]}):
        assert load("scenario", "seated", rolling(shape="sphere", radius="2 cm", **axis))
