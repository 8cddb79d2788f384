"""One table of optional libraries; one sentence where one is missing."""

import pathlib
import re
import sys
import tomllib

import pytest

import afo_sim
from afo_sim.common import EXTRAS, AfoSimError, MissingExtra, machine_code, missing_extra, optional

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


def test_code_that_must_be_compiled_names_its_extra_where_numba_and_llvm_are_missing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for package in ("numba", "llvmlite"):
        monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MissingExtra, match=re.escape("afo-sim[compile]")):
        machine_code.functions("no_such_kind", None, ["none"], list)


@pytest.mark.parametrize(
    ("package", "show"),
    [
        ("matplotlib", "figure"),
        ("PIL", "draw"),
        ("rerun", "view"),
    ],
)
def test_python_names_the_extra_of_a_picture(
    package: str, show: str, monkeypatch: pytest.MonkeyPatch, tmp_path: pathlib.Path
) -> None:
    recording = afo_sim.run("seated", {"duration": "0.1 s"})
    for name in [name for name in sys.modules if name.partition(".")[0] == package]:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setitem(sys.modules, package, None)
    make = {
        "figure": lambda: afo_sim.figure(recording).save(tmp_path / "a.png"),
        "draw": lambda: afo_sim.draw("seated", tmp_path / "a.png"),
        "view": lambda: afo_sim.view(recording),
    }
    with pytest.raises(MissingExtra, match="pip install"):
        make[show]()
