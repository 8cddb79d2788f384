"""No command runs what lies in the folder that it is started in, and none writes that folder's name."""

import base64
import importlib.metadata
import os
import pathlib
import re
import shutil
import subprocess
import sys
import zlib
from collections.abc import Iterator

import pytest
from c3d_plates import write
from campaign import nightly
from command import call
from test_walls import PACKAGE

from afo_sim.common import InputError
from afo_sim.description import load

# {command: its arguments}; "nothing" is named where a command would take long, and ends in an error of input
COMMANDS = {
    "run": "seated --set duration=0.2s --out r",
    "compare": "seated --set duration=0.2s --out laws",
    "torque-map": "--angle 0deg 1deg 1deg --pressure 1bar --out map",
    "both": "nothing",
    "size": "pressure nothing",
    "walk": "nothing",
    "electronics": "nothing",
    "recover": "r --out recovered",
    "view": "r --screenshot r.png",
    "figure": "r",
    "report": "r",
    "video": "r r.mp4",
    "studio": "no_such --no-browser",
    "check-run": "r",
    "draw": "s1",
    "export": "r --to mat",
    "stand": "isometric nothing",
    "fit": "nothing --law sarosi_2012",
    "calibrate": "nothing",
    "paper": "nothing",
    "credibility": "seated --question q --context c --influence low --consequence low",
    "validate": "--nothing",
    "sweep": "sweep.toml --workers 2 --out s",
    "replay": "s 0",
    "optimise": "nothing",
    "list": "",
    "check": "sweep.toml",
    "new": "patient mine",
    "keys": "seated",
    "refit": "nothing",
    "attach": "nothing --orthosis s1",
    "gait import": "trial.c3d --walker healthy --out walk.csv",
    "gait show": "bovi2011_natural",
    "leg import": "nothing",
    "leg export": "adult_75kg --to leg.urdf",
}
SWEEP = """scenario = "seated"
design = "latin-hypercube"
cases = 1
set.duration = "3.9 s"
parameters.pressure = { key = "supply.pressure", from = "2 bar", to = "3 bar" }
"""
# Stands outside the folder, as the console script does.
# Settings that libraries look for in the current folder; matplotlib's is read, and without effect.
DECOYS = {
    ".numba_config.yaml": "disable_jit: 1\n",
    **dict.fromkeys(("dask.yaml", "distributed.yaml", ".dask", ".env", ".netrc", "pip.conf"), "{"),
    **dict.fromkeys(("fonts.conf", "setup.cfg", "pyproject.toml", "cma_signals.in", ".pdbrc"), "{"),
    **dict.fromkeys(("ipython_config.py", "jupyter_config.py", ".rerun", "tox.ini", ".coveragerc"), "{"),
}
DRIVER = f"""import os, shlex, sys
def watch(event, told):
    name = os.path.basename(str(told[0])) if event == "open" else ""
    if name in {set(DECOYS)!r} and os.path.realpath(told[0]) == os.path.join(os.getcwd(), name):
        print("read", name, flush=True)
sys.addaudithook(watch)
from afo_sim.cli import app, error_handler
if __name__ == "__main__":
    for name, arguments in {COMMANDS!r}.items():
        sys.argv = ["afo-sim", *name.split(), *shlex.split(arguments)]
        print(name, error_handler.run(app), flush=True)
    import numba
    print("just in time", numba.config.DISABLE_JIT)
"""
PROGRAMS = ("ffmpeg", "latex", "rerun", "rerun-loader-any")


def commands() -> Iterator[str]:
    """Every command of the program, by its words."""
    from afo_sim.cli import app

    for group, words in [
        (app, ""),
        *((each.typer_instance, f"{each.name} ") for each in app.registered_groups),
    ]:
        for command in group.registered_commands:
            yield words + (command.name or command.callback.__name__)


@pytest.fixture
def hostile(tmp_path: pathlib.Path) -> pathlib.Path:
    """A folder with a module of every name, programs and settings; each leaves a mark when it is run."""
    folder, mark = tmp_path / "hostile", tmp_path / "mark"
    folder.mkdir()
    names = {"sitecustomize", "usercustomize", "afo_sim", *sys.stdlib_module_names}
    names |= set(importlib.metadata.packages_distributions())
    for name in filter(str.isidentifier, names):
        (folder / f"{name}.py").write_text(f"open({str(mark)!r}, 'a').write(__name__ + ' ')\n")
    for name in PROGRAMS:
        (folder / name).write_text(f"#!/bin/sh\necho {name} >> {mark}\n")
        (folder / name).chmod(0o755)
    (folder / "matplotlibrc").write_text("text.usetex: True\nbackend: module://antigravity\n")
    for name, text in DECOYS.items():
        (folder / name).write_text(text)
    return folder


def test_the_list_has_every_command() -> None:
    assert sorted(COMMANDS) == sorted(commands())


@pytest.mark.slow
def test_no_command_runs_what_lies_in_its_folder(hostile: pathlib.Path, tmp_path: pathlib.Path) -> None:
    for package in ("distributed", "rerun", "matplotlib"):
        pytest.importorskip(package)
    write(hostile / "trial.c3d", [], [], [])
    (hostile / "sweep.toml").write_text(SWEEP)
    driver = tmp_path / "bin" / "driver.py"
    driver.parent.mkdir()
    driver.write_text(DRIVER)
    places = {"PYTHONPATH": str(PACKAGE.parent), "PATH": f".{os.pathsep}{os.environ['PATH']}"}
    said = subprocess.run(
        [sys.executable, driver],
        cwd=hostile,
        env=os.environ | places,
        capture_output=True,
        text=True,
        timeout=280,
    )
    ends = dict(
        line.rsplit(" ", 1) for line in said.stdout.splitlines() if re.fullmatch(r"[a-z -]+ \d+", line)
    )
    assert not (tmp_path / "mark").exists(), (tmp_path / "mark").read_text()
    assert ends.pop("just in time") == "0" and "read " not in said.stdout, said.stdout
    assert ends.keys() == COMMANDS.keys(), said.stderr
    assert {name for name, code in ends.items() if code == "70"} == set()  # a bug
    ran = ("run", "figure", "report", "export", "sweep", "replay", "list", "check")
    assert [ends[name] for name in ran] == ["0"] * len(ran), said.stdout + said.stderr


@pytest.mark.slow
@pytest.mark.skipif(
    not shutil.which("afo-sim", path=str(pathlib.Path(sys.executable).parent)), reason="not installed"
)
def test_the_console_script_runs_nothing_of_its_folder(hostile: pathlib.Path, tmp_path: pathlib.Path) -> None:
    script = pathlib.Path(sys.executable).with_name("afo-sim")
    subprocess.run([script, "list"], cwd=hostile, capture_output=True, check=True, timeout=120)
    assert not (tmp_path / "mark").exists()


@pytest.mark.parametrize("first", ["afo_sim", "numba"])
def test_numba_takes_no_settings_of_the_folder(first: str, tmp_path: pathlib.Path) -> None:
    """Neither where it is imported after this package, nor when it compiles for it."""
    (tmp_path / ".numba_config.yaml").write_text("disable_jit: 1\n")
    code = f"import {first}, afo_sim, numba; numba.config.reload_config(); print(numba.config.DISABLE_JIT)"
    environment = {**os.environ, "PYTHONPATH": str(PACKAGE.parent)}
    said = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    assert said.stdout.split() == ["0"]


@pytest.mark.parametrize("named", ["evil:make", "evil.make", "./evil.py"])
def test_a_scenario_cannot_name_code(
    named: str, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "evil.py").write_text("raise SystemExit('it was run')\n")
    for controller in (named, {named: {}}, {"python": named}, {"pid": named}):
        with pytest.raises(InputError):
            load("scenario", "seated", {"timer": None, "controller": controller})


def texts_of(file: pathlib.Path) -> Iterator[bytes]:
    """A file's bytes, and what is packed in them: zlib's streams and base64."""
    raw = file.read_bytes()
    yield raw
    packed = [raw[found.start() :] for found in re.finditer(rb"x[\x01\x5e\x9c\xda]", raw)]
    for found in re.finditer(rb"[A-Za-z0-9+/]{64,}={0,2}", raw):
        plain = base64.b64decode(found[0][: len(found[0]) // 4 * 4])
        yield plain
        packed.append(plain)
    for data in packed:
        try:
            yield zlib.decompressobj().decompress(data)
        except zlib.error:
            continue


@nightly("every command once more, 18 s")
@pytest.mark.slow
def test_no_file_names_the_folder_that_it_was_made_in(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Own scenario, leg, orthosis, patient and gait, all named by whole paths."""
    name = "geheim_patient_4711"
    here = tmp_path / name
    here.mkdir()
    monkeypatch.chdir(here)

    def done(*words: object) -> None:
        code, _, complaint = call(capsys, *words)
        assert code == 0, (words, complaint)

    for kind in ("leg", "orthosis", "patient"):
        done("new", kind, kind)
    for scenario, like in (("walk", "walk-dropfoot-afo"), ("sits", "seated")):
        parts = (
            "--leg",
            "leg",
            "--orthosis",
            "orthosis",
            *(("--patient", "patient") if scenario == "walk" else ()),
        )
        done("new", "scenario", scenario, "--like", like, *parts)
    shutil.copy(PACKAGE.parent / "gait_data" / "bovi2011_natural.csv", here / "gait.csv")
    walk = (here / "walk.toml").read_text().replace('cycle = "bovi2011_natural"', 'cycle = "gait.csv"')
    (here / "walk.toml").write_text(walk)
    (here / "sweep.toml").write_text(SWEEP.replace('"seated"', '"sits.toml"'))
    walk_file, run = here / "walk.toml", here / "runs" / "walk"
    for _ in range(2):  # the second finds its own scenario in the first one's files
        done("run", walk_file, "--set", "duration=3.7 s", "--out", run)
    for words in (
        "report",
        "figure",
        "export --to mat",
        "export --to mjb",
        "export --to csv",
        "export --to mot",
    ):
        done(words.split()[0], run, *words.split()[1:])
    done("both", walk_file, "--set", "duration=3.7 s", "--out", here / "both")
    for _ in range(2):
        done("electronics", here / "sits.toml", "--out", here / "board")
    done("sweep", here / "sweep.toml", "--out", here / "sweep")
    done("replay", here / "sweep", 0)
    done("leg", "export", walk_file, "--to", here / "leg.urdf")
    done("draw", here / "orthosis")
    written = [file for file in here.rglob("*") if file.is_file()]
    assert {".parquet", ".json", ".html", ".png", ".mat", ".mjb", ".xml", ".urdf"} <= {
        f.suffix for f in written
    }
    assert [file for file in written if any(name.encode() in text for text in texts_of(file))] == []
