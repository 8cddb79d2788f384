"""One table of optional libraries; one sentence where one is missing."""

import contextlib
import fnmatch
import importlib.metadata
import itertools
import pathlib
import re
import sys
import tomllib

import pytest
from packaging.requirements import Requirement

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


def test_each_file_of_data_has_a_source_and_the_licence_that_it_states(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    from sbom import licences

    _, rows = licences((ROOT / "docs" / "installation.md").read_text(encoding="utf-8"))
    files = [
        path for folder in ("models", "gait_data") for path in (ROOT / folder).rglob("*") if path.is_file()
    ]
    for path in (path for path in files if path.suffix != ".png"):  # pictures are drawn here, and stay here
        name = path.relative_to(ROOT).as_posix()
        ((source, licence),) = [said for pattern, said in rows.items() if fnmatch.fnmatch(name, pattern)]
        assert source and licence, name
        if name.startswith("gait_data") and path.suffix == ".csv":
            stated = re.search(r"^# licence: (.+)$", path.read_text(encoding="utf-8"), flags=re.M)
            assert stated and licence in (stated[1] + stated[1].replace(" ", "-")), name
    assert all(any(fnmatch.fnmatch(str(path.relative_to(ROOT)), each) for path in files) for each in rows)


def needed(name: str, found: set[str]) -> set[str]:
    """What a library that is installed here needs, and what that needs, of what is installed."""
    for each in map(Requirement, importlib.metadata.requires(name) or []):
        if each.name not in found and (each.marker is None or each.marker.evaluate({"extra": ""})):
            with contextlib.suppress(importlib.metadata.PackageNotFoundError):
                found = needed(each.name, {*found, each.name})
    return found


def test_nothing_that_the_core_needs_is_under_a_copyleft_licence() -> None:
    libraries = {
        each for one in named(PROJECT["dependencies"]) - {"numba"} for each in {one, *needed(one, set())}
    }
    assert len(libraries) > 15
    for each in libraries:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            told = importlib.metadata.metadata(each)
            said = [*told.get_all("License-Expression", []), *told.get_all("Classifier", [])]
            assert not re.search(
                r"GPL|MPL|General Public|Mozilla Public|EUPL|CDDL|Eclipse", " ".join(said)
            ), each


def test_the_lowest_versions_are_those_that_the_project_states(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / ".ci"))
    import versions

    for each in versions.lowest():
        constraint = Requirement(each)
        (bound,) = constraint.specifier
        stated = [*PROJECT["dependencies"], *itertools.chain(*PROJECT["optional-dependencies"].values())]
        same = [
            one
            for one in map(Requirement, stated)
            if (one.name, one.marker) == (constraint.name, constraint.marker)
        ]
        assert any(one.specifier.contains(bound.version) for one in same), each
    assert {Requirement(each).name for each in versions.lowest()} >= named(PROJECT["dependencies"])
    project = {"dependencies": ["a>=1.2,<3", "b[x]>=2; python_version < '3.13'", "c", "d<4"]}
    monkeypatch.setattr(versions, "PROJECT", project)
    monkeypatch.setattr(versions, "EXTRAS", {"more": ["own[all]", "a>1", "e>=0.4.1"]})
    assert versions.lowest() == ["a==1.2", 'b==2; python_version < "3.13"', "e==0.4.1"]
    assert versions.lowest("e") == ["e==0.4.1"]


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
