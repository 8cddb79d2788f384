"""The library as a notebook's user meets it: names, examples, what a recording and a report take and show."""

import doctest
import functools
import html
import inspect
import pathlib
import re
import subprocess
import sys
import types
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import afo_sim as afo
from afo_sim.simulation import Recording

METHODS = {
    "Muscle": ("force", "contraction", "pressure", "volume", "using"),
    "Scenario": ("set",),
    "Recording": ("to_pandas", "to_xarray", "save", "export", "view"),
}


@pytest.fixture(scope="module")
def short() -> Recording:
    return afo.run("seated", {"duration": "1 s"})


@pytest.fixture(scope="module")
def walked() -> Recording:
    return afo.run("walk-dropfoot", {"duration": "2.6 s"})


# --- names


def test_dir_lists_what_there_is_and_nothing_else() -> None:
    names = {name for name in dir(afo) if not name.startswith("_")}
    assert names == set(afo.__all__)
    assert len(afo.__all__) == len(set(afo.__all__))
    for name in names:
        assert callable(getattr(afo, name))


def test_listing_names_imports_nothing_heavy() -> None:
    heavy = ("mujoco", "numba", "pint", "matplotlib")
    code = f"import afo_sim, sys; dir(afo_sim); print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="simulate"):
        afo.simulate  # noqa: B018


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        (lambda: afo.load("muscles", "dmsp_20"), "did you mean 'muscle'"),
        (lambda: afo.load("scenario", "seated", "supply.pressure=3 bar"), "sets .* is not a dict"),  # type: ignore
        (lambda: afo.load("scenario", "seated").set("supply.pressure=3 bar"), "sets .* is not a dict"),  # type: ignore
        (lambda: afo.report("one", afo.load("leg", "arm")), "out .* is no name of a file"),  # type: ignore
        (lambda: afo.sweep("seated", ["supply.pressure"]), "parameters .* is not a dict"),  # type: ignore
        (lambda: afo.sweep("seated", {"supply.pressure": "2 bar"}), "is one text"),
        (
            lambda: afo.sweep("seated", {"supply.pressure": ["2 bar"]}, metrics="rise_time"),
            "metrics .* one text",
        ),
    ],
)
def test_an_argument_of_another_type_is_told(wrong: Callable[[], Any], says: str) -> None:
    with pytest.raises(afo.InputError, match=says):
        wrong()


def test_a_description_says_its_name_and_what_it_is() -> None:
    muscle = afo.load("muscle", "dmsp_20")
    assert repr(muscle) == str(muscle) == f"<Muscle 'dmsp_20': {muscle.description}>"
    assert "contraction_max" in repr(muscle.limits)


# --- documentation


DOCUMENTED = [*afo.__all__, *(f"{name}.{method}" for name in METHODS for method in METHODS[name])]


def found(name: str) -> Any:
    return functools.reduce(getattr, name.split("."), afo)


@pytest.mark.slow
@pytest.mark.parametrize("name", DOCUMENTED)
def test_examples_run(name: str, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if name == "dm_control_physics":
        pytest.importorskip("dm_control")  # not on Python 3.13
    monkeypatch.chdir(tmp_path)
    names = {each: getattr(afo, each) for each in afo.__all__ if each != "list"} | {"np": np, "afo_sim": afo}
    text = inspect.getdoc(found(name)) or ""
    example = doctest.DocTestParser().get_doctest(text, names, name, None, None)
    said: list[str] = []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        held: list[object] = []
    monkeypatch.setattr("afo_sim.native.install._FOR_GOOD", held)
    doctest.DocTestRunner(verbose=False).run(example, out=said.append)
    held.clear()  # what is in force for good ends with the example
    assert not said, "".join(said)
    assert example.examples or "." in name, f"{name} has no example"


@pytest.mark.parametrize("name", DOCUMENTED)
def test_parameters_are_all_documented(name: str) -> None:
    thing = found(name)
    text = inspect.getdoc(thing) or ""
    assert text
    if not isinstance(thing, types.FunctionType):
        return
    for parameter in inspect.signature(thing).parameters:
        assert parameter == "self" or re.search(rf"\b{parameter}\b", text), (
            f"{name} says nothing of {parameter}"
        )


# --- a recording


def test_the_terminal_shows_status_size_and_warnings(short: Recording) -> None:
    text = repr(short)
    assert "'seated': ok, 500 rows" in text and f"{len(short.warnings)} warning" in text


def test_columns_complete_and_a_wrong_one_is_told(short: Recording) -> None:
    assert short._ipython_key_completions_() == list(short.columns)
    with pytest.raises(afo.InputError, match="did you mean 'ankle/angle'"):
        short["ankle/angel"]


def test_pandas_and_xarray_carry_units(short: Recording) -> None:
    frame, dataset = short.to_pandas(), short.to_xarray()
    assert len(frame) == 500 and frame.attrs["units"]["muscle/dorsiflexor_1/force"] == "N"
    titles = [f"{name} [{short.describe(name)[0] or '-'}]" for name in short.columns]
    assert list(frame.columns) == titles and "ankle/angle [rad]" in titles
    assert set(dataset.data_vars) | {"time"} == set(short.columns)
    assert np.array_equal(dataset["time"], short["time"])
    angle = dataset["ankle/angle"]
    assert angle.dims == ("time",) and np.array_equal(angle, short["ankle/angle"])
    assert (angle.attrs["units"], angle.attrs["sign"]) == ("rad", "dorsiflexion positive")
    assert dataset.attrs["status"] == "ok"
    assert dataset.attrs["range_of_motion"] == str(short.metrics["range_of_motion"])
    assert np.isclose(dataset.sel(time=0.5, method="nearest")["ankle/angle"], short["ankle/angle"][250])


def test_strides_take_slices(walked: Recording) -> None:
    strides = walked.strides
    first = strides[:2]
    assert list(first) == list(strides)[:2] and all(first[k] is strides[k] for k in first)
    assert list(strides[-1:]) == [max(strides)] and type(strides[1:][:1]) is type(strides)
    assert strides[0]["toe_clearance"].unit == "mm" and strides == dict(strides)
    with pytest.raises(KeyError):
        strides[-1]  # no stride has this number


@pytest.mark.parametrize(
    ("scenario", "more", "says"),
    [
        ("seated", {}, "nobody walks"),
        ("walk-dropfoot", {"controller": lambda seen: {}}, "the draws would run without it"),
    ],
)
def test_bands_that_cannot_be_drawn_are_refused(scenario: str, more: dict[str, Any], says: str) -> None:
    with pytest.raises(afo.InputError, match=says):
        afo.run(scenario, uncertainty=200, **more)


# --- pictures


@pytest.mark.slow
def test_a_report_takes_recordings_folders_lists_and_names(
    short: Recording, walked: Recording, tmp_path: pathlib.Path
) -> None:
    kept = short.save(tmp_path / "kept", rrd=False)
    for runs, names in (
        (short, ["seated"]),
        (kept, ["kept"]),
        ([short, short, str(kept)], ["seated", "seated 2", "kept"]),
        ({3: short, "two/3": kept}, ["3", "two_3"]),
    ):
        path = afo.report(runs, tmp_path / "report.html")
        text = path.read_text(encoding="utf-8")
        title = re.search("<title>(.*?)</title>", text)
        assert title is not None
        said = title[1].removesuffix(" – simulation report")
        if len(names) == 1:  # the title of one run is what it simulates
            words = html.unescape(said).removesuffix(" (1 changed)")
            assert words.casefold() == short.scenario["description"].split("; ", 1)[1].casefold()
        else:
            assert re.split(" compared with |, ", said.casefold()) == names  # it begins with a capital
    assert {path.name for path in tmp_path.iterdir()} == {"kept", "report.html"}


@pytest.mark.parametrize("runs", [[], {}, 3, [3], {"a": None}])
def test_what_is_no_run_is_refused(runs: Any, tmp_path: pathlib.Path) -> None:
    with pytest.raises(afo.InputError, match=r"is no run|holds no run"):
        afo.report(runs, tmp_path / "report.html")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", ["png", "pdf", "svg"])
def test_a_figure_is_written_and_shown(short: Recording, suffix: str, tmp_path: pathlib.Path) -> None:
    picture = afo.figure(short, tmp_path / "new" / f"angle.{suffix}", kind="angle")
    assert (tmp_path / "new" / f"angle.{suffix}").stat().st_size > 2000
    assert picture._repr_png_().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda run: afo.figure(run, kind="anlge"), "did you mean 'angle'"),
        (lambda run: afo.figure(run, kind="clearance"), "cannot be shown for this run"),
        (lambda run: afo.figure(run, "angle.gif"), "gif"),
        (lambda run: afo.figure("nowhere"), "there is no run here"),
        (lambda run: afo.view(run), "no display"),
    ],
)
def test_a_wrong_picture_is_refused(
    short: Recording,
    make: Callable[[Recording], Any],
    says: str,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Any,
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(afo.InputError, match=says):
        make(short)
    assert not list(tmp_path.iterdir())


def test_view_opens_one_file_of_all_runs(short: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    from afo_sim.show import rerun
    from afo_sim.show.rerun import viewer

    opened: list[int] = []
    monkeypatch.setattr(viewer, "require_display", lambda: None)
    monkeypatch.setattr(
        rerun, "open_recordings", lambda paths: opened.extend(p.stat().st_size for p in paths)
    )
    afo.view(short)
    afo.view({"a": short, "b": short})
    assert len(opened) == 2 and min(opened) > 10_000
