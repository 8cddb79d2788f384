"""`--extension FILE` and entry points: what a user's Python adds, and what becomes of its errors."""

import os
import pathlib
import subprocess
import sys
from typing import Any

import pytest
from command import Call

from afo_sim.cli import app
from afo_sim.common import extending

VALVE = 'import afo_sim as afo\nmine = afo.load("valve", "mh1", {"name": "my_valve"})\n'


@pytest.fixture
def mine(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> pathlib.Path:
    monkeypatch.chdir(tmp_path)
    (file := tmp_path / "json.py").write_text(VALVE)  # named as a module of Python
    return file


def test_every_command_takes_it() -> None:
    from typer.main import get_command

    def without(command: Any) -> list[str]:
        below = getattr(command, "commands", {}).values()
        own = [] if below or any("--extension" in each.opts for each in command.params) else [command.name]
        return sum(map(without, below), own)

    assert not without(get_command(app))


@pytest.mark.parametrize("before", [True, False])
def test_a_file_is_taken_before_a_command_and_behind_it(call: Call, mine: pathlib.Path, before: bool) -> None:
    words, option = ["list", "my_valve"], ["--extension", "json.py"]
    assert call(*words)[0] == 2  # it is never found by itself
    code, out, _ = call(*option, *words) if before else call(*words, *option)
    assert code == 0 and "my_valve" in out


def test_a_registered_valve_is_set_by_its_name(call: Call, mine: pathlib.Path) -> None:
    inlet = "orthosis.chamber.dorsiflexor.inlet"
    code, out, _ = call("keys", "seated", f"{inlet}.name", "--set", f"{inlet}=my_valve", "--extension", mine)
    assert code == 0 and "registered" in out
    assert call("keys", "seated", f"{inlet}.name", "--set", f"{inlet}=my_valv", "--extension", mine)[0] == 2


def test_a_file_named_as_a_module_of_python_does_not_stand_in_its_place(mine: pathlib.Path) -> None:
    code = f"import afo_sim; afo_sim.register({str(mine)!r}); import json; print(json.dumps([1]))"
    done = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "[1]", done.stderr


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("x = 1\n\nx / 0\n", "own.py:3: ZeroDivisionError"),
        ("x = (\n", "own.py:1: SyntaxError"),
        ("import sys\nsys.exit(0)\n", "own.py:2"),
        ('import afo_sim\nafo_sim.load("valve", "my")\n', "own.py:2: valve = 'my'"),
        ("import nowhere_at_all\n", "own.py:1: ModuleNotFoundError"),
        ("x = 1\n", "own.py"),
    ],
)
def test_what_is_wrong_with_a_file_is_one_sentence_with_its_line(
    text: str, says: str, call: Call, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    pathlib.Path("own.py").write_text(text)
    code, _, err = call("list", "valves", "--extension", "own.py")
    assert code == 2 and says in err and err.count("afo-sim:") == 1
    assert [each.name for each in tmp_path.iterdir() if each.suffix != ".py"] in ([], ["__pycache__"])


def test_an_error_of_a_file_keeps_its_traceback_in_python(tmp_path: pathlib.Path) -> None:
    (file := tmp_path / "own.py").write_text("def f():\n    raise KeyError('a')\nf()\n")
    with pytest.raises(KeyError) as raised:
        extending.register(file)
    assert [each.lineno + 1 for each in raised.traceback if str(each.path) == str(file)] == [3, 2]


def installed(folder: pathlib.Path, name: str, text: str, entry: str) -> None:
    """A package as an installer leaves it: a module, and the metadata that name its entry point."""
    (folder / f"{name}.py").write_text(text)
    (info := folder / f"{name}-1.0.dist-info").mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(entry)


def python(folder: pathlib.Path, code: str) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH", "")]))
    words = [sys.executable, "-c", code]
    return subprocess.run(words, capture_output=True, text=True, env=os.environ | {"PYTHONPATH": path})


def test_what_an_installed_package_offers_is_there_at_once(tmp_path: pathlib.Path) -> None:
    installed(tmp_path, "their_valves", VALVE, "[afo_sim]\nvalves = their_valves\n")
    done = python(tmp_path, "import afo_sim; print(afo_sim.load('valve', 'my_valve').name)")
    assert done.stdout.strip() == "my_valve", done.stderr
    code = "import sys; sys.argv[1:] = ['list', 'my_valve']; from afo_sim.cli import main; main()"
    assert python(tmp_path, code).returncode == 0


def test_an_installed_package_that_fails_is_left_out_with_a_warning(tmp_path: pathlib.Path) -> None:
    installed(tmp_path, "their_bug", "1 / 0\n", "[afo_sim]\nbug = their_bug\n")
    done = python(tmp_path, "import afo_sim; print(afo_sim.load('valve', 'mh1').name)")
    assert done.stdout.strip() == "mh1" and "their_bug" in done.stderr and "ZeroDivisionError" in done.stderr
