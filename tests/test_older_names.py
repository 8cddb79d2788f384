"""Older names: each answers with one notice, in Python and at the command line."""

import importlib
import inspect
import warnings
from typing import Any

import pytest
import typer
import typer.main

import afo_sim as afo
from afo_sim import cli
from afo_sim.common import RENAMED, RETIRED, older, takes_older

NAMES = [name for name in RENAMED if name.isidentifier() and name != "environments"]
WORDS = [name for name in RENAMED if " " in name]
ARGUMENTS = [name for name in RENAMED if "(" in name]


def group() -> Any:
    return typer.main.get_command(cli.app)


def test_the_table_has_what_a_name_can_be_and_no_name_twice() -> None:
    kinds = [*NAMES, *WORDS, *ARGUMENTS, "environments", "bridge.physics"]
    assert sorted(kinds) == sorted(RENAMED) and not set(RENAMED) & set(RETIRED)
    assert not set(NAMES) & set(afo.__all__)


@pytest.mark.parametrize("name", NAMES)
def test_an_older_name_answers_with_one_notice(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if name == "dm_control_physics":
        pytest.importorskip("dm_control")  # not on Python 3.13
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a machine without a screen
            importlib.import_module("afo_sim.rl.physics")
    monkeypatch.delitem(vars(afo), name, raising=False)
    with pytest.warns(FutureWarning, match=f"afo_sim.{name} is {RENAMED[name].replace(':', '.')}") as notices:
        exec(f"from afo_sim import {name}\nimport afo_sim\nafo_sim.{name}", {})
    assert len(notices) == 1
    with pytest.warns(FutureWarning):
        assert callable(older(name)) and getattr(afo, name) is older(name)


@pytest.mark.parametrize("entry", ARGUMENTS)
def test_an_older_argument_is_the_newer_one(entry: str) -> None:
    function, argument = entry.rstrip(")").split("(")
    public = getattr(afo, function)
    known = inspect.signature(public).parameters
    assert RENAMED[entry] in known and argument not in known

    def size(**given: object) -> dict[str, object]:
        return given

    size.__name__ = function
    with pytest.warns(FutureWarning, match=RENAMED[entry]) as notices:
        assert takes_older(size)(**{argument: 1, "other": 2}) == {RENAMED[entry]: 1, "other": 2}
    assert len(notices) == 1 and notices[0].filename == __file__
    assert hasattr(public, "__wrapped__")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert takes_older(size)(**{RENAMED[entry]: 1}) == {RENAMED[entry]: 1}


def test_an_argument_without_a_newer_one_is_refused_by_what_to_use() -> None:
    with pytest.raises(afo.InputError, match="afo-sim walk"):
        afo.walk("walk-dropfoot-afo", kept="folder")


@pytest.mark.parametrize("entry", WORDS)
def test_an_older_word_is_the_newer_one(entry: str, capsys: pytest.CaptureFixture[str]) -> None:
    command, *option = entry.removeprefix("afo-sim ").split(" ")
    new = RENAMED[entry]
    context = typer.Context(group(), info_name="afo-sim")
    name, found, words = group().resolve_command(context, [command, *(f"{each}=x=1" for each in option)])
    told = capsys.readouterr().err.splitlines()
    assert sum(line.startswith("warning: ") and f" {new} now" in line for line in told) == 1
    options = {each for parameter in found.params for each in parameter.opts}
    assert name in group().commands
    if option:
        assert words == [f"{new}=x=1"] and new in options and option[0] not in options
    else:
        assert new == f"afo-sim {name}" and command not in group().commands


def test_words_of_today_are_told_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    context = typer.Context(group(), info_name="afo-sim")
    line = ["fit", "a.csv", "--fixed", "k=1", "--free", "--fit"]
    assert group().resolve_command(context, line)[2] == line[1:]
    assert not capsys.readouterr().err
