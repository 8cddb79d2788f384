"""Strange files and values: one InputError with its file, never another exception."""

import os
import pathlib

import pytest

from afo_sim.common import MOST_FAULTS, InputError, assets, parse_quantity, read_table, unknown
from afo_sim.description import load

MUSCLES = pathlib.Path(__file__).parents[2] / "models" / "muscles"


@pytest.mark.parametrize(
    "text",
    [
        *("x = " + 3000 * "[", "x = " + 200 * "[" + 200 * "]", "x = " + 100 * "{a = " + "1" + 100 * "}"),
        *("a." * 400_000 + "a = 1", "'a' . " * 40 + "a = 1", "[" + "a." * 100_000 + "a]", '"\\' * 400_000),
        *("x = " + "9" * 5000, "x = 2000-13-45", "x = 1\nx = 2", "\0", "x = '\ud7ff"),
    ],
    ids=range(12),
)
def test_toml_that_is_none_names_its_file(text: str, tmp_path: pathlib.Path) -> None:
    file = tmp_path / "a.toml"
    file.write_text(text)
    with pytest.raises(InputError, match="is not valid TOML") as caught:
        assets.read_toml(file)
    assert caught.value.file == file


@pytest.mark.parametrize("size", [2**20, 2**20 + 1])
def test_a_description_is_of_bounded_size(size: int, tmp_path: pathlib.Path) -> None:
    file = tmp_path / "a.toml"
    file.write_text("x = 1\n" + "#" * (size - 6))
    if size == 2**20:
        assert assets.read_toml(file) == {"x": 1}
        return
    with pytest.raises(InputError, match="is too large; allowed: up to 1 MiB"):
        assets.read_toml(file)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no pipes with names")
def test_what_never_ends_or_waits_is_no_file(tmp_path: pathlib.Path) -> None:
    os.mkfifo(tmp_path / "pipe.toml")  # nobody writes into it
    for path, kind in (
        (tmp_path / "pipe.toml", "a pipe or a device"),
        ("/dev/zero", "device"),
        (tmp_path, "a folder"),
    ):
        with pytest.raises(InputError, match=f"cannot be read: it is .*{kind}"):
            assets.read_toml(pathlib.Path(path))


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
    assert (
        str(error)
        == "colour = 'forse': is not a valid choice; allowed: force, pressure; did you mean 'force'?"
    )
    assert unknown(3, ("force", "pressure"), field="colour").nearest is None


def test_a_thousand_faults_are_told_up_to_a_number(tmp_path: pathlib.Path) -> None:
    """Each of them would be compared with all valid names."""
    with pytest.raises(InputError) as refused:
        load("scenario", "seated", {f"presure{k}": 1 for k in range(300)})
    assert len(refused.value.others) < MOST_FAULTS
    file = tmp_path / "a.csv"
    file.write_text(",".join(["a"] * 6000) + "\n")
    with pytest.raises(InputError, match="6000 columns"):
        read_table(file, "a")
