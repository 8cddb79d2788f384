"""Firmware in the loop: exported C here and on a simulated ATmega328P, a user's own in C and Python."""

import functools
import json
import pathlib
from types import SimpleNamespace
from typing import Any

import pytest
from campaign import size
from export.boards import CHAMBERS, MACHINE, compiler, controlled, export, on_avr, timed

import afo_sim as afo
from afo_sim.common import InputError
from afo_sim.control import Log, differences
from afo_sim.description import Scenario
from afo_sim.export import Firmware, commanded

STRIDES = size(3, 100)
WALK: dict[str, Any] = {"duration": f"{1.12 * STRIDES:.1f} s", "reference": None}
# of a converter of 10 bits at 5 V, so that native controller and board read the same
HEEL = {"column": "foot/heel_load", "resolution": f"{5000 / 1023!r} mV", "calibration": {"slope": "5 mV/N"}}


@functools.cache
def native(kind: str) -> tuple[Scenario, Log]:
    """A walk, and what its own controller commands."""
    machine = json.loads(json.dumps(MACHINE).replace("foot/heel_load", "sensor/heel"))
    read = {"rate": "100 Hz", "state_machine": machine}
    scenario = timed(**WALK) if kind == "timer" else controlled(read, **{"sensor.heel": HEEL}, **WALK)
    return scenario, commanded(scenario).log


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["timer", "state machine"])
@pytest.mark.parametrize("board", ["host", "simavr"])
def test_it_switches_as_the_simulation_does(kind: str, board: str, tmp_path: pathlib.Path) -> None:
    compiler("cc", "gcc", "clang")
    scenario, simulated = native(kind)
    folder = export(scenario, tmp_path / "board")
    sensed = () if kind == "timer" else ('-DCOLUMN="sensor/heel"', "-DVOLTS=0.005")
    firmware = Firmware(folder, CHAMBERS) if board == "host" else on_avr(folder, *sensed)
    assert afo.run(scenario, controller=firmware, rate=1000 if kind == "timer" else 100).ok
    for found in differences(firmware.log, simulated, 0.0 if board == "host" else 1e-3):
        assert found.first == "" and found.counts[0] == found.counts[1]
        assert found.counts[0] >= 3 * STRIDES or found.chamber == "plantarflexor"


def test_the_watchdog_resets_a_board_that_hangs_and_the_serial_line_says_so(tmp_path: pathlib.Path) -> None:
    firmware = on_avr(export(timed(), tmp_path / "board"), "-DHANG=700")
    for k in range(1100):
        firmware(SimpleNamespace(time=1e-3 * k, period=1e-3))  # type: ignore[arg-type]
    said = (tmp_path / "board" / "serial.txt").read_text().splitlines()
    last = firmware.log.switches["dorsiflexor"][-1]
    # 32,768 cycles of the watchdog's 128 kHz: ATmega328P data sheet, table "Watchdog Timer Prescale Select"
    assert said[-1] == "# stopped: the watchdog reset the board" and last.coils == (False, False)
    assert last.time == pytest.approx(0.7 + 32768 / 128e3, abs=1e-3)


class Blinking:
    """Python for a board: the outlet and the inlet in turn."""

    def setup(self, board: Firmware) -> None:
        self.begun = board.micros()

    def loop(self, board: Firmware) -> None:
        on = (board.micros() - self.begun) // 252_500 % 2 == 1 and board.read("supply/pressure") > 0.0
        board.write("dorsiflexor", on, not on)


def test_python_code_is_looped_between_two_commands() -> None:
    firmware = Firmware(Blinking(), CHAMBERS, loop=5e-4)
    run = afo.run("seated", {"duration": "1 s"}, controller=firmware, rate=100)
    assert [switch.time for switch in firmware.log.switches["dorsiflexor"]] == [0.0, 0.2525, 0.505, 0.7575]
    on = 0.2525 + (1.0 - 0.7575)  # [s]
    assert run["valve/dorsiflexor_inlet/coil"].mean() == pytest.approx(on, abs=1e-9)


WAITING = """#include "board.h"
static int loops = 0;
static void wait(const board_t *b, uint64_t us) { uint64_t t = b->micros(); while (b->micros() - t < us) {} }
void setup(const board_t *b) { wait(b, 2500); }
void loop(const board_t *b) { b->write("d", loops++ % 2 == 0, 0); if (loops > 2) wait(b, 1000); }"""


def test_waits_end_and_each_run_begins_with_the_first_values_of_statics(tmp_path: pathlib.Path) -> None:
    compiler("cc", "gcc", "clang")
    (tmp_path / "own.c").write_text(WAITING)
    firmware = Firmware(tmp_path / "own.c", ["d"])
    for k in (*range(6), *range(6)):
        if k == 0:
            firmware.reset()
        firmware(SimpleNamespace(time=1e-3 * k, period=1e-3))  # type: ignore[arg-type]
        # off; setup ends at 2.5 ms, then two loops 0.1 ms apart, and from the third on one each millisecond
        switched = [round(1e3 * switch.time, 3) for switch in firmware.log.switches["d"]]
        assert switched == [at for at in (0.0, 2.5, 2.6, 2.7, 3.7, 4.7, 5.7) if at < k + 1]


C = '#include "board.h"\nvoid setup(const board_t *board) { (void)board; }\n'
REFUSED = {
    "": r"own.c: firmware: defines no loop\(const board_t \*\)",
    "board->": r"own.c: firmware: the compiler refuses it: .*own.c:3:.* error: expected identifier",
    'board->read("ankle/angel")': "did you mean 'ankle/angle'",
    "missing()": r"own.c: firmware: is compiled, but cannot be loaded: undefined symbol: missing;",
    'board->write("dorsal", 1, 0)': "dorsal.*no such chamber; allowed: dorsiflexor",
}


@pytest.mark.parametrize("statement", REFUSED)
def test_c_that_does_not_fit_is_one_sentence(statement: str, tmp_path: pathlib.Path) -> None:
    compiler("cc", "gcc", "clang")
    loop = f"void loop(const board_t *board) {{ {statement}; }}" if statement else ""
    (tmp_path / "own.c").write_text(f"{C}void missing(void);{loop}")
    with pytest.raises(InputError, match=REFUSED[statement]):
        firmware = Firmware(tmp_path / "own.c", ["dorsiflexor"])
        raise InputError(afo.run("seated", {"duration": "0.1 s"}, controller=firmware).status)


def test_no_compiler_is_one_sentence(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "own.c").write_text(C)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match="needs a C compiler, but this machine has none"):
        Firmware(tmp_path / "own.c", CHAMBERS)
