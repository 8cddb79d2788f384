"""Types as a user meets them: `mypy --strict` passes what is right, and finds what is wrong."""

import os
import pathlib
import re
import subprocess
import sys

import pytest

import afo_sim

ROOT = pathlib.Path(__file__).parents[1]
USER = ROOT / "tests" / "helpers" / "typed_user.py"
EXPERIMENTAL = {"walk", "credibility", "paper", "validate", "column", "controller"}
WRONG = """import afo_sim as afo
run = afo.run("seated")
text: str = run["ankle/angle"]
name: str = run.metrics["range_of_motion"]
force: float = afo.load("muscle", "dmsp_20").force("3 bar", contraction=[0.1])
afo.load("muscle", "dmsp_20").force("3 bar", contracton=0.1)
afo.load("scenario", "seated").force("3 bar")
afo.run("seated", set={"duration": "1 s"})
afo.run("seated", controller=lambda seen: 1.0)
afo.fit("points.csv", law="all", scenario="seated")
afo.fit("log.csv", scenario="seated").muscle
afo.fit_run("seated", "log.csv")
"""


def test_the_example_has_every_name_that_is_promised() -> None:
    used = set(re.findall(r"\bafo\.(\w+)", USER.read_text(encoding="utf-8")))
    assert used - EXPERIMENTAL == set(afo_sim.__all__) - EXPERIMENTAL
    assert (ROOT / "afo_sim" / "py.typed").is_file()


@pytest.mark.slow
def test_mypy_passes_a_user_and_finds_his_mistakes(tmp_path: pathlib.Path) -> None:
    pytest.importorskip("mypy")
    wrong = tmp_path / "wrong.py"
    wrong.write_text(WRONG, encoding="utf-8")
    options = ("--strict", "--follow-imports=silent", "--cache-dir", str(tmp_path / "cache"))
    mypy = (sys.executable, "-m", "mypy", *options, str(USER), str(wrong))
    done = subprocess.run(
        mypy, cwd=tmp_path, env=os.environ | {"MYPYPATH": str(ROOT)}, capture_output=True, text=True
    )
    found = re.findall(r"^(.+?):(\d+): error", done.stdout, flags=re.M)
    assert {pathlib.Path(file).name for file, _ in found} == {"wrong.py"}, done.stdout + done.stderr
    assert {int(line) for _, line in found} == set(range(3, 1 + len(WRONG.splitlines()))), done.stdout
