"""Hostile files: each command ends well or with a sentence, within 20 s and 2 GB, without a traceback."""

import collections
import json
import os
import pathlib
import random
import subprocess
import sys
from collections.abc import Sequence

import pytest
from campaign import NIGHTLY, SEED, sampled, size
from fuzz.bases import BASES
from fuzz.found import FOUND

from afo_sim.cli.doctor.kinds import check_file
from afo_sim.common import AfoSimError

TESTS = pathlib.Path(__file__).parents[1]
WELL = {"fine", "refused"}


def ended(cases: Sequence[Sequence[str]], folder: pathlib.Path) -> list[list[str]]:
    """Each case's damage, how its command ended and what it said; a process that dies is begun again."""
    paths = os.pathsep.join([str(TESTS), str(TESTS / "helpers"), str(TESTS.parent)])
    one = dict.fromkeys(("NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1")
    environment = {**os.environ, **one, "PYTHONPATH": paths}
    found: list[list[str]] = []
    while len(found) < len(cases):
        asked = "\n".join(json.dumps(case) for case in cases[len(found) :]) + "\n"
        done = subprocess.run(
            [sys.executable, "-m", "fuzz.child", str(folder)],
            input=asked.encode(), capture_output=True, env=environment, check=False,
        )  # fmt: skip
        found += [json.loads(line) for line in done.stdout.splitlines()]
        if done.returncode and len(found) < len(cases):
            found.append([*cases[len(found)], "died or hung", done.stderr.decode("utf-8", "replace")[-3000:]])
    return found


def require_well(found: Sequence[Sequence[str]]) -> None:
    ill = [json.dumps(case, indent=1).replace("\\n", "\n") for case in found if case[-2] not in WELL]
    assert not ill, f"AFO_SIM_FUZZ_SEED={SEED}: {len(ill)} of {len(found)}; the first:\n" + "\n".join(ill[:5])


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    return tmp_path_factory.mktemp("bases")


@pytest.mark.parametrize("number", range(size(1, 10)))
def test_damaged_files_are_answered_or_refused(number: int, folder: pathlib.Path) -> None:
    """What was found once comes first, in the suite six of it, then damage by chance to four files."""
    seed, dice = SEED + number, random.Random(SEED + number)
    # by day test_sealed_files has those that a function reads
    names = [n for n, base in BASES.items() if base.command or NIGHTLY for _ in range(base.share)]
    names = names if NIGHTLY else dice.sample(names, 4)
    cases = [list(vars(damage).values()) for damage in sampled(FOUND, 6)] if number == 0 else []
    cases += [[dice.choice(names), f"{seed} {k}"] for k in range(size(8, 5000))]
    found = ended(cases, folder)
    counts = collections.Counter((case[0], case[-2]) for case in found)
    print(*(f"{count:6} {name}: {how}" for (name, how), count in sorted(counts.items())), sep="\n")
    require_well(found)


@pytest.mark.slow
def test_whole_files_are_answered(folder: pathlib.Path) -> None:
    names = [name for name, base in BASES.items() if base.command or NIGHTLY]
    names = names if NIGHTLY else random.Random(SEED).sample(names, 6)
    found = ended([[name, "none", ""] for name in names], folder)
    assert [case for case in found if case[-2] != "fine"] == []


@pytest.mark.parametrize("suffix", [".toml", ".csv", ".xml", ".urdf", ".mjcf"])
def test_files_of_no_kind_are_refused(suffix: str, tmp_path: pathlib.Path) -> None:
    (tmp_path / "folder").with_suffix(suffix).mkdir()
    loop = tmp_path / f"loop{suffix}"
    loop.symlink_to(loop)
    files = [(tmp_path / "folder").with_suffix(suffix), loop, tmp_path / f"none{suffix}"]
    for number, data in enumerate(
        (b"", b"\0" * 99, b"\xff\xfe\x00", bytes(range(256)), b"\n\n\n", b"x" * 200_000)
    ):
        files.append(tmp_path / f"{number}{suffix}")
        files[-1].write_bytes(data)
    for file in files:
        with pytest.raises(AfoSimError):
            check_file(file)
