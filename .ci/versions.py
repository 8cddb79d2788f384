"""The tests on the versions that pyproject.toml allows: a line for each environment, ok or which fails.

    .venv/bin/python .ci/versions.py                                        every environment
    .venv/bin/python .ci/versions.py lowest core-3.13 --tests tests/native  these, with these tests

`core-3.X` has the newest of all that the core needs, `all-3.X` every extra; `mujoco` is the core on the
lowest MuJoCo, `lowest` every requirement at its lower bound. Each gets the wheel, whose runs compile
nothing and are compared with those of the first environment.
"""

import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib

import numpy as np
import pyarrow.parquet as pq
from packaging.requirements import Requirement

ROOT = pathlib.Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]
PYTHONS = [each.split()[-1] for each in PROJECT["classifiers"] if "Python :: 3." in each]
RUNS = ("seated", "walk-dropfoot-afo")
OLD = ["-W", "default"]  # old libraries warn of the new ones that they need


def lowest(*names: str) -> list[str]:
    """Constraints that hold requirements at their lower bounds: these, or all of the core and the extras."""
    every = map(
        Requirement, [*PROJECT["dependencies"], *(each for extra in EXTRAS.values() for each in extra)]
    )
    return [
        f"{each.name}=={bound.version}" + (f"; {each.marker}" if each.marker else "")
        for each in every
        for bound in each.specifier
        if bound.operator == ">=" and each.name in (names or [each.name])
    ]


# {environment: its Python, the wheel's extras, constraints, options of pytest}
ENVIRONMENTS: dict[str, tuple[str, str, list[str], list[str]]] = {
    **{f"core-{each}": (each, "", [], []) for each in PYTHONS},
    "mujoco": (PYTHONS[0], "", lowest("mujoco"), []),
    "lowest": (PYTHONS[0], "[test,cluster]", lowest(), OLD),
    **{f"all-{each}": (each, "[test,cluster]", [], []) for each in PYTHONS},
}


def interpreter(version: str) -> str:
    """A Python of a version, which runs here."""
    pyenv = pathlib.Path(os.environ.get("PYENV_ROOT", pathlib.Path.home() / ".pyenv"))
    for each in (shutil.which(f"python{version}"), *map(str, pyenv.glob(f"versions/{version}.*/bin/python"))):
        if each and subprocess.run([each, "-c", ""], capture_output=True).returncode == 0:
            return each
    raise OSError(f"no Python {version} is here")


def attempt(name: str, wheel: pathlib.Path, folder: pathlib.Path, tests: list[str]) -> str:
    """Install, run and test an environment in an empty folder, which keeps the runs; what is to be told."""

    def step(*words: str) -> str:
        environment = {**os.environ, "AFO_SIM_CACHE": str(folder / "cache")}
        told = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True, "env": environment}
        return subprocess.run(words, cwd=folder, check=True, **told).stdout  # type: ignore[call-overload]

    python, extras, constraints, options = ENVIRONMENTS[name]
    (folder / "constraints").write_text("\n".join(constraints))
    step(interpreter(python), "-m", "venv", "venv")
    pip = ("venv/bin/python", "-m", "pip")
    step(*pip, "install", "-q", "-c", "constraints", f"{wheel}{extras}")
    step(*pip, "check")
    size = sum(each.stat().st_size for each in (folder / "venv").rglob("*") if each.suffix != ".pyc")
    for run in RUNS:
        step("venv/bin/afo-sim", "run", run, "--no-rrd", "--out", run)
    if (folder / "cache").exists():
        raise OSError("runs of the wheel compile something")
    testing = [each for each in EXTRAS["test"] if each.startswith(("pytest", "hypothesis"))]
    step(*pip, "install", "-q", "-c", "constraints", f"{wheel}[compile]", *testing)
    options = [*options, "-m", "not slow" if extras else "core and not slow", "-n", "2", "--dist", "loadfile"]
    chosen = [str(ROOT / each) for each in tests]
    said = step(
        "venv/bin/pytest", "-q", "--rootdir", str(ROOT), "-c", str(ROOT / "pyproject.toml"), *options, *chosen
    )
    return f"{size / 1e6:.0f} MB, {said.splitlines()[-1].strip('= ')}"


def difference(run: str, folder: pathlib.Path, first: pathlib.Path) -> str:
    """By how much a run differs in two folders, of the largest value of a column."""
    here, there = (pq.ParquetFile(each / run / "recording.parquet").read() for each in (folder, first))
    largest = 0.0
    for name in there.column_names:
        old = there[name].to_numpy()
        if np.issubdtype(old.dtype, np.floating):
            apart, unit = np.abs(here[name].to_numpy() - old), np.nanmax(np.abs(old), initial=0.0)
            largest = max(largest, np.nanmax(apart, initial=0.0) / (unit or 1.0))
    return f"{run} " + (f"differs by {largest:.0e}" if largest else "equal")


def main() -> int:
    """Try environments one after another; 1 where one fails."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("environments", nargs="*", choices=[[], *ENVIRONMENTS], metavar="ENVIRONMENT")
    parser.add_argument("--tests", nargs="+", default=["tests"], help="of the repository; all by default")
    options, failed, first = parser.parse_args(), False, None
    with tempfile.TemporaryDirectory() as scratch:
        pip = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", scratch, str(ROOT)]
        subprocess.run(pip, check=True)
        (wheel,) = pathlib.Path(scratch).glob("*.whl")
        for name in options.environments or ENVIRONMENTS:
            folder, start = pathlib.Path(scratch, name), time.monotonic()
            folder.mkdir()
            try:
                said = f"ok, {attempt(name, wheel, folder, options.tests)}"
            except (OSError, subprocess.CalledProcessError) as error:
                lines = (getattr(error, "stdout", "") or str(error)).splitlines()
                which = [each for each in lines if each.startswith(("FAILED", "ERROR"))] or lines[-1:]
                said, failed = f"fails: {'; '.join(which)}", True
            if all((folder / run / "recording.parquet").is_file() for run in RUNS):
                first = first or folder
                said = "; ".join([said, *(difference(run, folder, first) for run in RUNS)])
            print(f"{name}: {said}; {time.monotonic() - start:.0f} s", flush=True)
            shutil.rmtree(folder / "venv", ignore_errors=True)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
