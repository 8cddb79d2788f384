"""A sweep through a night: processes killed, disk full, chunks damaged; each row once, to the last bit."""

import os
import pathlib
import random
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from campaign import SEED, nightly
from faults import hidden
from installed import needs
from sweep_runs import COMMAND, SEATED, assert_same, swept, table, written

import afo_sim
from afo_sim.study.results import STEPS

CASES, CHUNK = 6000, 32
FULL_AT = (0.3, 0.6)  # of all chunks


def text(cases: int, kept: int) -> str:
    numbers = list(range(0, cases, cases // kept))
    return f"cases = {cases}\nkeep = {numbers}\n{SEATED}".replace('"grid"', '"random"').replace(
        "steps = 12", ""
    )


@pytest.fixture
def small_disk(tmp_path: pathlib.Path) -> Iterator[pathlib.Path]:
    place = tmp_path / "disk"
    place.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=50m", "none", place], check=False).returncode:
        pytest.skip("a small disk takes the right to mount one")
    yield place
    subprocess.run(["umount", "-l", place], check=True)


def fill(place: pathlib.Path) -> None:
    with suppress(OSError), (place / "filler").open("wb", buffering=0) as file:
        while file.write(bytes(1 << 12)):
            pass


def damage(chunks: pathlib.Path, rng: random.Random) -> None:
    """Of three finished chunks one has another bit, one is cut off, one is gone."""
    bit, cut, gone = rng.sample(sorted(chunks.glob("*.parquet")), 3)
    data = bytearray(bit.read_bytes())
    data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    bit.write_bytes(data)
    os.truncate(cut, rng.randrange(cut.stat().st_size))
    gone.unlink()


@dataclass
class Disturbed:
    """What became of a command that was disturbed, and called again until it was done."""

    codes: list[int] = field(default_factory=list)
    logs: list[str] = field(default_factory=list)
    kills: int = 0
    seen: list[tuple[float, int, bool, float, int]] = field(default_factory=list)  # see `_look`

    def until_done(self, command: list[str], out: pathlib.Path, chunks: int, every: float, seed: int) -> None:
        """A kill every so many seconds, two full disks, and damage to what they have left."""
        rng, full_at, begun_at = random.Random(seed), [at * chunks for at in FULL_AT], time.monotonic()
        while self.codes[-1:] != [0]:
            assert len(self.codes) < 10, self.logs[-1]
            with (out.parent.parent / "log").open("w") as log:
                begun = subprocess.Popen(command, stdout=log, stderr=log)
            killed_at, full = time.monotonic(), False
            while begun.poll() is None:
                time.sleep(1.0)
                now, done = time.monotonic(), len(list((out / "chunks").glob("*.parquet")))
                beside = self._look(begun.pid, now - begun_at, done)
                if beside and now > killed_at + every:
                    os.kill(rng.choice(beside), signal.SIGKILL)
                    self.kills, killed_at = self.kills + 1, now
                if full_at and done > full_at[0]:
                    full = bool(full_at.pop(0))
                    fill(out.parent)
            self.codes.append(begun.returncode)
            self.logs.append((out.parent.parent / "log").read_text())
            (out.parent / "filler").unlink(missing_ok=True)
            if full:
                damage(out / "chunks", rng)

    def _look(self, pid: int, at: float, done: int) -> list[int]:
        """Note time, finished chunks, whether it is beside, memory [MB], open files; the processes beside."""
        import psutil

        with suppress(psutil.Error):
            whole = psutil.Process(pid)
            beside = whole.children()
            for each in (whole, *beside):
                with suppress(psutil.Error):
                    row = each is not whole, each.memory_info().rss / 1e6, each.num_fds()
                    self.seen.append((at, done, *row))
            return [each.pid for each in beside]
        return []

    def spread(self, beside: bool, what: int, chunks: int) -> Any:
        """10, 50 and 90 % of memory (3) or open files (4) while chunks are computed."""
        told = [row[what] for row in self.seen if row[2] == beside and 0 < row[1] < chunks]
        return np.percentile(told, [10, 50, 90])


@nightly("one kill after another, for minutes")
@needs("psutil", "rerun")
def test_kills_full_disks_and_damage_lose_and_double_no_row(
    small_disk: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    out, chunks, told = small_disk / "out", CASES // CHUNK, Disturbed()
    command = [*COMMAND, str(written(tmp_path, text(CASES, 20), CHUNK)), "--out", str(out), "--workers", "2"]
    told.until_done(command, out, chunks, 15.0, SEED)
    assert told.kills > 2 and told.codes == [2, 2, 2, 0]  # full, full, damaged
    assert not any("Traceback" in log for log in told.logs)
    assert_same(swept(tmp_path / "whole", text(CASES, 20), CHUNK, threads=2), table(out))
    names = ["recordings", "results.parquet", "sweep.json", STEPS]
    assert sorted(path.name for path in out.iterdir()) == names and hidden(out) == []
    results = afo_sim.study.read(out).table
    for folder in (out / "recordings").iterdir():
        kept, row = afo_sim.read_recording(folder), results.slice(int(folder.name[-7:]), 1).to_pylist()[0]
        assert all(m.value == row[name] for name, m in kept.metrics.items() if np.isfinite(m.value))
    for beside in (False, True):
        for what in (3, 4):
            _, middle, high = told.spread(beside, what, chunks)  # low while it starts
            assert high <= 1.1 * middle, (beside, what, middle, high)
