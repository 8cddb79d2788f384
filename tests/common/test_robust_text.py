"""Strange files and values: one InputError with its file, never another exception."""

import pathlib

import pytest

from afo_sim.common import InputError, assets, parse_quantity, read_table, unknown
from afo_sim.description import load

MUSCLES = pathlib.Path(__file__).parents[2] / "models" / "muscles"


@pytest.mark.parametrize(
    "text", ["x = " + 3000 * "[", "x = " + "9" * 5000, "x = 2000-13-45", "x = 1\nx = 2", "\0", "x = '\ud7ff"]
)
def test_toml_that_is_none_names_its_file(text: str, tmp_path: pathlib.Path) -> None:
    file = tmp_path / "a.toml"
    file.write_text(text)
    with pytest.raises(InputError, match="is not valid TOML") as caught:
        assets.read_toml(file)
    assert caught.value.file == file


def test_byte_order_mark_is_accepted(tmp_path: pathlib.Path) -> None:
    shipped = assets.find("scenario", "seated").read_text("utf-8")
    (tmp_path / "a.toml").write_text(shipped, encoding="utf-8-sig")
    mine, theirs = load("scenario", str(tmp_path / "a.toml")), load("scenario", "seated")
    assert mine.model_copy(update={"name": theirs.name}) == theirs


def test_whole_number_beyond_any_float_is_refused() -> None:
    for value in (10**400, -(10**400), "1e400"):
        with pytest.raises(ValueError, match="is not finite"):
            parse_quantity(value, "")
    for value in (10**400, 10**5000):
        with pytest.raises(InputError, match="contraction_max"):
            load("muscle", "dmsp_20", {"limits.contraction_max": value})


def test_cell_longer_than_the_csv_module_takes_is_one_message(tmp_path: pathlib.Path) -> None:
    file = tmp_path / "a.csv"
    for text in ("a,b\n1," + 140_000 * "2" + "\n", 140_000 * "a" + ",b\n1,2\n"):
        file.write_text(text)
        with pytest.raises(InputError, match="is not a line of a CSV") as caught:
            read_table(file, "a,b")
        assert caught.value.file == file


def test_symlinks_in_a_circle_are_one_message(tmp_path: pathlib.Path) -> None:
    loop = tmp_path / "a.toml"
    loop.symlink_to(loop)
    with pytest.raises(InputError, match="cannot be read"):
        assets.read_toml(loop)
    with pytest.raises(InputError, match="there is no such scenario"):
        assets.find("scenario", str(loop))
    with pytest.raises(InputError, match="cannot be read"):
        read_table(loop, "a,b")


@pytest.mark.parametrize(
    ("law", "problem"),
    [
        ("5", "is not a text"),
        ("true", "is not a text"),
        ("{ source = 'S1', kind = 'published' }", "is missing"),
        ("[]", "is not a text"),
        ("'sarosi_201'", "did you mean 'sarosi_2012'"),
    ],
)
def test_law_that_is_no_name_is_refused(law: str, problem: str, tmp_path: pathlib.Path) -> None:
    file = tmp_path / "muscle.toml"
    lines = (MUSCLES / "dmsp_20" / "muscle.toml").read_text("utf-8").splitlines()
    changed = [f"law = {law}" if line.startswith("law = ") else line for line in lines]
    assert changed != lines
    file.write_text("\n".join(changed), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load("muscle", str(file))
    assert caught.value.field == "law"
    assert caught.value.file == file
    assert problem in str(caught.value)
    file.write_text("\n".join(line for line in lines if not line.startswith("law = ")), encoding="utf-8")
    with pytest.raises(InputError, match="law: is missing; allowed: "):
        load("muscle", str(file))


def test_unknown_lists_what_is_allowed_and_the_nearest() -> None:
    error = unknown("forse", ("force", "pressure"), field="colour")
    assert str(error) == "colour = 'forse': is no choice; allowed: force, pressure; did you mean 'force'?"
    assert unknown(3, ("force", "pressure"), field="colour").nearest is None
