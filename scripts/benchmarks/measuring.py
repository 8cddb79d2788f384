"""Measurements of speed: repeated in turn, kept as figures, written to JSON with machine and date."""

import argparse
import datetime
import json
import os
import pathlib
import platform
import resource
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from afo_sim.common import code_fingerprint
from afo_sim.common.versions import versions

Better = Literal["lower", "higher", ""]
Numbers = Sequence[float] | np.ndarray  # of repeats


@dataclass(frozen=True)
class Figure:
    """One measured number.

    name, unit : of the number
    better : the direction that is; empty where the number is no speed
    best, median : of the repeats
    repeats : rounds
    """

    name: str
    unit: str
    better: Better
    best: float
    median: float
    repeats: int = 1


def figure(name: str, unit: str, better: Better, values: float | Numbers) -> Figure:
    """The figure of one value or of several repeats; where no direction is better, best is the median."""
    many = np.atleast_1d(np.asarray(values, float))
    middle = float(np.median(many))
    best = {"lower": float(many.min()), "higher": float(many.max())}.get(better, middle)
    return Figure(name, unit, better, best, middle, len(many))


def ratio(name: str, above: Sequence[float], below: Sequence[float], better: Better) -> Figure:
    """The median of the ratios of two rows of repeats, round by round: a slow moment hits both.

    It is its best, too. A ratio's extreme is large because one of its rounds was disturbed.
    """
    middle = float(np.median(np.divide(above, below)))
    return Figure(name, "", better, middle, middle, len(above))


def in_turn(measures: Mapping[str, Callable[[], float]], repeats: int) -> dict[str, list[float]]:
    """Numbers of measurements that are repeated in turn; a round before those does not count."""
    found: dict[str, list[float]] = {name: [] for name in measures}
    for k in range(-1, repeats):
        for name, once in measures.items():
            value = once()
            if k >= 0:
                found[name].append(value)
    return found


@dataclass
class Spent:
    """Wall and processor time of a block [s]; the latter also of processes that ended in it."""

    wall: float = 0.0
    processor: float = 0.0


@contextmanager
def spent() -> Iterator[Spent]:
    """Measure a block."""
    found, wall, processor = Spent(), time.perf_counter(), _processor()
    yield found
    found.wall, found.processor = time.perf_counter() - wall, _processor() - processor


def _processor() -> float:
    uses = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(use.ru_utime + use.ru_stime for use in uses)


def machine() -> dict[str, Any]:
    """Processor, cores, system and what else runs; versions of Python, the packages and this code."""
    return {
        "processor": _processor_name(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "load": [round(value, 2) for value in os.getloadavg()],
        "versions": versions(),
        "code": code_fingerprint()[:16],
    }


def _processor_name() -> str:
    information = pathlib.Path("/proc/cpuinfo")
    if information.exists():
        for line in information.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def arguments(words: str) -> argparse.ArgumentParser:
    """A parser with what all benchmarks take."""
    parser = argparse.ArgumentParser(description=words)
    parser.add_argument("--parts", help="some parts, with commas; all by default")
    parser.add_argument(
        "--repeats", type=int, default=5, help="rounds, of which the best and the median are told"
    )
    parser.add_argument("--out", type=pathlib.Path, help="write the figures here, as JSON")
    return parser


def chosen(parser: argparse.ArgumentParser, words: str | None, parts: Sequence[str]) -> list[str]:
    """The parts that were asked for, in their usual order."""
    asked = parts if words is None else words.split(",")
    unknown = [word for word in asked if word not in parts]
    if unknown:
        parser.error(f"--parts: {', '.join(unknown)} is none of {', '.join(parts)}")
    return [part for part in parts if part in asked]


def table(title: str, figures: Sequence[Figure]) -> str:
    """Figures as lines of a table."""
    width = max(len(f.name) for f in figures)
    head = f"{'':{width}}  {'best':>10}  {'median':>10}"
    lines = [f"{f.name:{width}}  {f.best:10.4g}  {f.median:10.4g}  {f.unit}".rstrip() for f in figures]
    return "\n".join([title, head, *lines, ""])


def collect(
    benchmark: str, parts: Mapping[str, Callable[[], list[Figure]]], options: argparse.Namespace
) -> list[Figure]:
    """Measure part by part, print each as a table, and write all of them to the file that was asked for."""
    started, figures = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"), []
    for name, part in parts.items():
        with spent() as took:
            found = part()
        figures += found
        print(table(f"{name}  ({took.wall:.0f} s)", found), flush=True)
    if options.out:
        settings = {k: v for k, v in vars(options).items() if k != "out" and not isinstance(v, pathlib.Path)}
        written = {
            "benchmark": benchmark,
            "date": started,
            "machine": machine(),
            "options": settings,
            "figures": [asdict(found) for found in figures],
        }
        options.out.write_text(json.dumps(written, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return figures
