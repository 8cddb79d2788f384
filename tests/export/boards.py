"""Exported boards, compiled by this machine's compiler."""

import functools
import os
import pathlib
import shutil
import subprocess
from typing import Any

import pytest

from afo_sim.description import Scenario, load
from afo_sim.export import Firmware, board_of, header, host, sketch

HERE = pathlib.Path(__file__).with_name("board")
CHAMBERS = ("dorsiflexor", "plantarflexor")
STRICT = ("-Wall", "-Wextra", "-Werror", "-pedantic", "-O1")


def compiler(*names: str) -> str:
    """A compiler; the test is skipped where this machine has none."""
    found = next((name for name in names if shutil.which(name)), None)
    if found is None:
        pytest.skip(f"this machine has no {' or '.join(names)}, and the exported program cannot be compiled")
    return found


def export(scenario: Scenario, folder: pathlib.Path) -> pathlib.Path:
    """Header, sketch and host program of a scenario."""
    board = board_of(scenario)
    (folder / "valves").mkdir(parents=True)
    (folder / "valves" / "valves.h").write_text(header(board), encoding="utf-8")
    (folder / "valves" / "valves.ino").write_text(sketch(board), encoding="utf-8")
    (folder / "host.c").write_text(host(board), encoding="utf-8")
    return folder


def compile_host(folder: pathlib.Path, *options: str) -> pathlib.Path:
    program = folder / "host"
    command = [compiler("cc", "gcc", "clang"), "-std=c99", *STRICT, *options]
    subprocess.run([*command, "-o", program, folder / "host.c"], check=True)
    return program


def compile_sketch(folder: pathlib.Path, *options: str) -> pathlib.Path:
    program = folder / "board"
    named = f'-DSKETCH="{folder / "valves" / "valves.ino"}"'
    command = [compiler("c++", "g++", "clang++"), "-std=c++11", *STRICT, f"-I{HERE}", named]
    subprocess.run([*command, *options, "-o", program, HERE / "main.cpp"], check=True)
    return program


def on_avr(folder: pathlib.Path, *options: str) -> Firmware:
    """The sketch on a simulated ATmega328P, which prints to serial.txt; skipped where that cannot be made."""
    command = [compiler("avr-g++"), "-std=c++11", "-mmcu=atmega328p", "-Os", "-Wall", "-Wextra", "-Werror"]
    if not all(map(os.path.exists, ("/usr/include/simavr/sim_avr.h", "/usr/lib/avr/include/avr/io.h"))):
        pytest.skip("this machine has no libsimavr-dev and avr-libc, and no board is simulated")
    elf, named = folder / "avr.elf", f'-DSKETCH="{folder / "valves" / "valves.ino"}"'
    subprocess.run([*command, named, "-o", elf, HERE / "avr.cpp"], check=True)
    made = (f'-DELF="{elf}"', f'-DSERIAL="{folder / "serial.txt"}"', "-lsimavr", *options)
    return Firmware(HERE / "simavr.c", CHAMBERS, options=made)


def printed(program: pathlib.Path, *arguments: object) -> str:
    """What a program prints."""
    found = subprocess.run(
        [program, *map(str, arguments)], check=True, capture_output=True, text=True, timeout=60
    )
    return found.stdout


@functools.cache
def timed(**sets: Any) -> Scenario:
    """The shipped walk whose valves follow a clock of 1.1 s."""
    return load("scenario", "walk-dropfoot-afo-timer", sets)


MACHINE: dict[str, Any] = {
    "start": "swing",
    "state": {
        "swing": {"dorsiflexor": "inlet", "plantarflexor": "outlet"},
        "contact": {"dorsiflexor": "shut"},
        "stance": {"dorsiflexor": "outlet"},
    },
    "transition": [
        {"state": "swing", "to": "contact", "column": "foot/heel_load", "above": "50 N", "after": "0.2 s"},
        {"state": "contact", "to": "stance", "column": "state_time", "above": "80 ms"},
        {"state": "stance", "to": "swing", "column": "foot/heel_load", "below": "20 N", "after": "0.25 s"},
    ],
}


def controlled(controller: dict[str, Any], **sets: Any) -> Scenario:
    """A shipped walk with a controller, whose strides vary."""
    varied = {"phases": None, "controller": controller, "gait.variability": 0.03, "reference": None}
    return load("scenario", "walk-dropfoot-afo", varied | sets)
