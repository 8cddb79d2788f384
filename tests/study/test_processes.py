"""Processes beside this one: the same outcomes, ended with this one, and no module of the current folder."""

import itertools
import math
import os
import pathlib
import pickle
import signal
import subprocess
import sys
import types
from collections.abc import Iterator
from typing import Any

import pytest
from installed import needs
from sweep_runs import exact

from afo_sim.common import Child, Notice, register
from afo_sim.description import expand, load
from afo_sim.physics import Law, LawParameter
from afo_sim.simulation import EVERYTHING
from afo_sim.study import engine, processes
from afo_sim.study.pool import Pool, pool
from afo_sim.study.processes import Processes

pytestmark = needs("psutil")
ROOT = pathlib.Path(__file__).parents[2]
SCENARIO = expand("scenario", "seated")
MANY = 60
SCRIPT = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
from afo_sim.study.processes import Processes
cases = ((k, {"duration": "0.2 s"}) for k in range(10**6))
for number, _ in Processes(2, 0.0).outcomes("seated", cases):
    print(number, flush=True)
"""  # without a guard of its main module


def cases(count: int = MANY) -> Iterator[tuple[int, dict[str, Any]]]:
    """Cases of every kind: that run, that fail, and in plain Python."""
    for k in range(count):
        own = {"load_moment": "1000 N*m"} if k % 7 == 3 else {"callback": "python"} if k % 20 == 5 else {}
        yield k, {"duration": "0.05 s", "supply.pressure": f"{2.0 + 0.01 * k!r} bar"} | own


class Deadly:
    """Ends the process that unpickles it."""

    def __reduce__(self) -> tuple[Any, ...]:
        return os._exit, (3,)


def straight(contraction: float, pressure: float, area: float) -> float:
    return pressure * area * (1.0 - 3.0 * contraction)


@pytest.fixture
def user_law() -> str:
    area = LawParameter("area", "A", "m^2", 0.0, 0.01, "that the pressure pulls on", (1e-3, 3e-3))
    register(Law("straight_2026", straight, (area,)))
    return "straight_2026"


@pytest.fixture(scope="module")
def alone() -> dict[int, Any]:
    return {number: exact(outcome) for number, outcome in engine.outcomes(SCENARIO, cases())}


def found(beside: Processes, threads: int = 1) -> dict[int, Any]:
    return {n: exact(outcome) for n, outcome in beside.outcomes(SCENARIO, cases(), threads)}


def ready(beside: Processes) -> list[int]:
    """Numbers of the processes, one of which has computed: the first cases come from here alone."""
    list(beside.outcomes(SCENARIO, cases(1)))
    beside.jobs.put((SCENARIO, list(cases(1)), EVERYTHING, b""))
    assert len(beside.answers.get(timeout=60.0)) == 1
    return [child.process.pid for child in beside.children]


@pytest.mark.slow
@pytest.mark.parametrize(("count", "threads"), [(1, 1), (2, 2)])
def test_outcomes_are_those_of_one_process_and_the_others_are_kept(
    alone: dict[int, Any], count: int, threads: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    import psutil

    with Processes(count, 0.0) as beside:
        get, answered = beside.answers.get, []
        monkeypatch.setattr(
            beside,
            "answers",
            types.SimpleNamespace(
                put=beside.answers.put,
                empty=beside.answers.empty,
                get=lambda **how: answered.append(get(**how)) or answered[-1],
            ),
        )
        numbers = ready(beside)
        assert [found(beside, threads) for _ in range(3)] == [alone] * 3
        assert len(numbers) == count and len(answered) > 3
        assert [child.process.pid for child in beside.children] == numbers
        beside.patience = math.inf  # as a call that comes early
        assert found(beside, threads) == alone
    assert not any(map(psutil.pid_exists, numbers))


def test_short_work_starts_no_process(alone: dict[int, Any]) -> None:
    with pool(2) as who:
        list(who.beside.outcomes(SCENARIO, cases(2), 2))
        assert who.beside.count == 1 and who.beside.children == []
    assert Pool().beside.count == 0


@pytest.mark.parametrize(("number", "started"), [(5, 0), (6, 1)])
def test_less_work_than_there_was_before_starts_no_process(
    number: int, started: int, alone: dict[int, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = itertools.count()
    monkeypatch.setattr(processes, "time", types.SimpleNamespace(monotonic=lambda: float(next(clock))))
    with Processes(1, patience=3.0) as beside:  # which three cases take
        told = {n: exact(outcome) for n, outcome in beside.outcomes(SCENARIO, cases(number))}
        assert len(beside.children) == started
    assert told == {n: alone[n] for n in range(number)}


def test_cases_of_a_process_that_is_killed_are_computed_again_once(alone: dict[int, Any]) -> None:
    with Processes(1, 0.0) as beside, pytest.warns(UserWarning, match="SIGKILL") as warned:
        os.kill(ready(beside)[0], signal.SIGKILL)
        told = []
        for number, outcome in beside.outcomes(SCENARIO, cases()):
            told.append((number, exact(outcome)))
            if len(told) == MANY // 2:
                beside.children[0].close()
        assert len(beside.children) == 1
    assert sorted(told) == sorted(alone.items())
    assert 1 <= len(warned) <= 2 and {one.message.args[0].code for one in warned} == {"process-ended"}


@pytest.mark.slow
def test_a_case_that_ends_three_processes_is_given_up_and_the_others_are_computed() -> None:
    deadly = pickle.dumps(Deadly())
    with Processes(1, 0.0) as beside:
        ready(beside)
        for number, added in enumerate((b"", deadly, b"")):
            beside.jobs.put((SCENARIO, [(number, {"duration": "0.05 s"})], EVERYTHING, added))
        told = [beside.answers.get(timeout=60.0) for _ in range(5)]
    assert [type(each) for each in told] == [list, Notice, Notice, dict, list]
    assert [each[0][0] for each in (told[0], told[4])] == [0, 2]
    assert list(told[3]) == [1] and "exit code 3" in told[3][1]


@pytest.mark.slow
def test_what_no_case_is_to_blame_for_comes_back_as_it_was_raised() -> None:
    child = Child(f"{processes.__name__}:serve")
    for asked in (None, EVERYTHING):
        child.send((SCENARIO, list(cases(1)), asked, b""))
    code, error, outcomes = (child.receive(60.0) for _ in range(3))
    child.close()
    assert code == processes._CODE
    assert isinstance(error, AttributeError) and "'NoneType'" in str(error)
    assert outcomes[0][1].status == engine.OK
    with Processes(1, 0.0) as beside:
        ready(beside)
        beside.jobs.put((SCENARIO, [(0, {"duration": lambda: 1.0})], EVERYTHING, b""))  # cannot be sent
        assert isinstance(beside.answers.get(timeout=60.0), Exception)


@pytest.mark.slow
def test_a_process_of_other_code_computes_nothing(
    alone: dict[int, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    with Processes(1, 0.0) as beside:
        monkeypatch.setattr(processes, "_CODE", "an older one's")
        assert found(beside) == alone
        assert len(beside.children) == 1


def test_another_process_computes_by_a_law_of_a_users_own(user_law: str) -> None:
    """The law is a function of this module, which the other process cannot import."""
    sets = [{"duration": "0.05 s", "supply.pressure": f"{2.0 + 0.1 * k} bar"} for k in range(24)]
    own = {"orthosis.muscle.dorsiflexor.type.law": user_law}
    own[f"orthosis.muscle.dorsiflexor.type.laws.{user_law}"] = {"area": "20 cm^2"}
    scenario = load("scenario", "seated", own).resolved()
    expected = {n: exact(each) for n, each in engine.outcomes(scenario, enumerate(sets))}
    with Processes(1, 0.0) as beside:
        assert {n: exact(each) for n, each in beside.outcomes(scenario, enumerate(sets))} == expected
        assert len(beside.children) == 1


@pytest.mark.slow
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_no_process_outlives_a_script_and_none_takes_modules_of_its_folder(
    how: signal.Signals, tmp_path: pathlib.Path
) -> None:
    import psutil

    script, folder, mark = tmp_path / "script.py", tmp_path / "folder", tmp_path / "mark"
    script.write_text(SCRIPT)
    folder.mkdir()
    for name in ("afo_sim", "numpy", "pickle", "queue", "sitecustomize", "usercustomize"):
        (folder / f"{name}.py").write_text(f"open({str(mark)!r}, 'a').write(__name__)\n")
    there = os.environ | {"PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        [sys.executable, script], cwd=folder, env=there, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as begun:
        assert begun.stdout is not None
        for _ in range(100):
            begun.stdout.readline()
        children = psutil.Process(begun.pid).children()
        begun.send_signal(how)
        begun.communicate(timeout=20)
    assert len(children) == 2
    assert psutil.wait_procs(children, timeout=20)[1] == []
    assert not mark.exists()
