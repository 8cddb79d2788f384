"""One table of optional libraries; one sentence where one is missing."""

import pathlib
import re
import sys
import tomllib

import pytest

from afo_sim.common import EXTRAS, AfoSimError, MissingExtra, missing_extra, optional

ROOT = pathlib.Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
DISTRIBUTION = {"dm_control": "dm-control", "dm_env": "dm-control", "rerun": "rerun-sdk"}


def named(requirements: list[str]) -> set[str]:
    """What requirements name, but for extras of the project itself."""
    return {re.match(r"[\w.-]+", one)[0] for one in requirements} - {"afo-sim"}  # type: ignore[index]


@pytest.mark.parametrize("extra", EXTRAS)
def test_each_extra_brings_what_the_project_declares(extra: str) -> None:
    declared = named(PROJECT["optional-dependencies"][extra])
    brought = {DISTRIBUTION.get(package, package) for package in EXTRAS[extra]}
    assert brought == declared - (named(PROJECT["dependencies"]) - {"numba"})


def test_the_core_requires_no_library_of_an_extra() -> None:
    optional_ones = set().union(*(named(PROJECT["optional-dependencies"][extra]) for extra in EXTRAS))
    assert named(PROJECT["dependencies"]) & optional_ones <= {
        "mujoco",  # bounded for dm-control
        "numba",  # where no wheel brings machine code
    }


def test_all_means_every_extra() -> None:
    (every,) = PROJECT["optional-dependencies"]["all"]
    assert set(re.search(r"\[(.*)\]", every)[1].split(",")) == set(EXTRAS)  # type: ignore[index]


@pytest.mark.parametrize("extra", EXTRAS)
def test_a_missing_library_is_one_sentence_with_its_command(
    extra: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = EXTRAS[extra][0]
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MissingExtra, match=re.escape(f"pip install 'afo-sim[{extra}]'")) as caught:
        optional(package)
    assert caught.value.exit_code == 2 and isinstance(caught.value, AfoSimError)
    assert isinstance(caught.value, ImportError)
    assert str(caught.value).count("\n") == 0


def test_other_failures_of_an_import_are_not_explained_away() -> None:
    assert missing_extra(ModuleNotFoundError("No module named 'numpy'", name="numpy")) is None
    assert missing_extra(ImportError("cannot import name 'x'", name="matplotlib")) is None
    with pytest.raises(ModuleNotFoundError):
        optional("afo_sim.no_such_room")


def test_the_parts_that_a_library_brings_name_the_library() -> None:
    missing = missing_extra(ModuleNotFoundError("No module named 'labmaze'", name="labmaze"))
    assert missing is not None and missing.extra == "rl"


def test_the_page_of_the_installation_lists_each_library_with_its_licence() -> None:
    page = (ROOT / "docs" / "installation.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([\w ,-]+) \| [^|]*(?:MIT|BSD|Apache|PSF)[^|]* \|$", page, flags=re.M)
    listed = set(re.findall(r"[\w-]+", " ".join(rows)))
    extras = [PROJECT["optional-dependencies"][extra] for extra in EXTRAS]
    assert set().union(*map(named, (PROJECT["dependencies"], *extras))) <= listed
