"""Exported timers against the simulation's commands, switching by switching, also over the clock's wrap."""

import pathlib
import subprocess

import numpy as np
import pytest
from export.boards import CHAMBERS, compile_host, compile_sketch, controlled, export, printed, timed

from afo_sim.common import InputError
from afo_sim.control import Log, differences, read_log
from afo_sim.description import Scenario, load
from afo_sim.export import board_of, commanded
from afo_sim.export.electronics.board import Clock
from afo_sim.export.electronics.exporting import switchings

WRAP = 2**32


def read(text: str, folder: pathlib.Path) -> Log:
    file = folder / "read.csv"
    file.write_text(text, encoding="utf-8")
    return read_log(file, CHAMBERS)


def check_alike(log: Log, simulated: Log, count: int) -> None:
    for found in differences(log, simulated, 0.0):
        assert found.first == "" and found.largest == 0.0
        assert found.counts == ((count, count) if found.chamber == "dorsiflexor" else (0, 0))


@pytest.fixture(scope="module")
def simulated() -> Log:
    """A hundred strides of the walk's own commands."""
    return commanded(timed(duration="110 s")).log


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    return export(timed(), tmp_path_factory.mktemp("boards") / "timer")


def test_the_simulation_switches_where_the_scenario_says(simulated: Log) -> None:
    told = simulated.switches["dorsiflexor"]
    expected = [1.1 * k + place for k in range(100) for place in (0.16, 0.5, 0.55, 1.05)]
    assert [switch.time for switch in told[1:]] == pytest.approx(expected, abs=1e-9)
    shut, vent, fill = (False, False), (False, True), (True, False)
    assert [switch.coils for switch in told[:5]] == [shut, vent, shut, fill, shut]


@pytest.mark.parametrize("start", [0, WRAP - 1, WRAP - 55_000])
def test_a_hundred_strides_on_the_host(
    folder: pathlib.Path, simulated: Log, start: int, tmp_path: pathlib.Path
) -> None:
    host = compile_host(folder)
    check_alike(read(printed(host, 110, start), tmp_path), simulated, 400)


@pytest.mark.parametrize("start_us", [0, (WRAP - 55_000) * 1000])
def test_a_hundred_strides_of_the_sketch(
    folder: pathlib.Path, simulated: Log, start_us: int, tmp_path: pathlib.Path
) -> None:
    board = compile_sketch(folder)
    text = printed(board, 110, start_us) + "110000.000,dorsiflexor,0,0\n"
    check_alike(read(text, tmp_path), simulated, 400)


def test_the_sketch_fails_safe(folder: pathlib.Path) -> None:
    board = compile_sketch(folder)
    for arguments, end in (([], 2), (["late", "700"], 0), (["open", "700"], 0), (["closed", "0"], 0)):
        found = subprocess.run([board, "0.8", "0", *arguments], capture_output=True, text=True, check=True)
        # filling at 0.8 s: the dorsiflexor's inlet and the plantarflexor's outlet
        assert found.stderr.split() == ["boot", "0", "end", str(end)]
        assert ("# stopped: the loop came round too late" in found.stdout) == (arguments[:1] == ["late"])


def test_contacts_that_bounce_switch_once(folder: pathlib.Path) -> None:
    # opened at 0.7 s and closed 50 ms later, each with 10 ms of bounces: off at once, on after 20 ms of rest
    found = subprocess.run(
        [compile_sketch(folder), "1", "0", "bounce", "700"], capture_output=True, text=True, check=True
    )
    coils = ["0:1", "160:2", "500:1", "550:2", "700:0", "779:1", "939:2"]  # [ms]: coils that have current
    assert found.stderr.split() == ["boot", "0", *coils, "end", "2"]
    assert found.stdout.count("time_ms") == 2


def test_a_watchdogs_reset_is_said(folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    (tmp_path / "hardware").mkdir()
    says = "inline bool watchdog_enable_caused_reboot() { return true; }"
    (tmp_path / "hardware" / "watchdog.h").write_text(says)
    board = compile_sketch(folder, "-DARDUINO_ARCH_RP2040", f"-I{tmp_path}")
    assert printed(board, "0.8", "0") == "# stopped: the watchdog reset the board\n"


def test_phases_of_a_steady_walk_are_a_clock_to_the_microsecond(tmp_path: pathlib.Path) -> None:
    scenario = load("scenario", "walk-dropfoot-afo", {"gait.stride_time": "1.0937 s", "duration": "12 s"})
    assert board_of(scenario).tick == 1
    host = compile_host(export(scenario, tmp_path / "phases"))
    check_near(read(printed(host, 12), tmp_path), commanded(scenario).log, 5e-7)


def check_near(log: Log, simulated: Log, within: float) -> None:
    """As many switchings, each within half a tick and the rounding of a share."""
    for found in differences(log, simulated, within + 1e-9):
        assert found.first == ""
        assert found.counts[0] == found.counts[1] and (found.counts[0] > 0) == (
            found.chamber == "dorsiflexor"
        )


def test_a_stride_that_is_no_whole_microseconds_drifts_as_it_is_told(tmp_path: pathlib.Path) -> None:
    stride = 1.09374_04
    scenario = load("scenario", "walk-dropfoot-afo", {"gait.stride_time": f"{stride} s"})
    logic = board_of(scenario).logic
    assert isinstance(logic, Clock)
    assert logic.period == 1_093_740 and logic.drift == pytest.approx(-4e-7, abs=1e-9)
    assert logic.rounding <= 5.1e-7


def test_a_looped_timer_with_a_foot_switch(tmp_path: pathlib.Path) -> None:
    timer = {
        "period": "1.2 s",
        "restart": {"column": "foot/heel_load", "above": "50 N"},
        "dorsiflexor": {"inlet": [["0.5553 s", "1.05 s"]], "outlet": [["0.16 s", "0.5 s"]]},
    }
    scenario = controlled({"rate": "100 Hz", "timer": timer}, duration="4 s")
    found = commanded(scenario)
    (tmp_path / "inputs.csv").write_text(found.inputs_text(), encoding="utf-8")
    host = compile_host(export(scenario, tmp_path / "looped"))
    for start in (0, WRAP - 2000):
        log = read(printed(host, tmp_path / "inputs.csv", start), tmp_path)
        assert [d.first for d in differences(log, found.log, 0.0)] == ["", ""]
        assert differences(log, found.log, 0.0)[0].counts[0] > 8


def test_the_time_of_a_switching_out_of_the_share_of_a_step() -> None:
    # on at 1.75 ms, off at 4.25 ms, on from 6 ms on
    shares = np.array([0.0, 0.25, 1.0, 1.0, 0.25, 0.0, 1.0])
    expected = [(0.0, False), (0.00175, True), (0.00425, False), (0.006, True)]
    assert switchings(shares, 1e-3, "valve") == expected
    # off at 2.4 ms, on at 3.5 ms: parts of two neighbouring steps
    assert switchings(np.array([1, 1, 0.4, 0.5, 1]), 1e-3, "valve")[1:] == [(0.0024, False), (0.0035, True)]
    with pytest.raises(InputError, match="more than once within the step"):
        switchings(np.array([0.0, 0.5, 0.0]), 1e-3, "dorsiflexor.inlet")


SHORT = [["0.55 s", "0.5500002 s"]]


@pytest.mark.parametrize(
    ("scenario", "sets", "words"),
    [
        ("walk-dropfoot-afo-timer", {"timer.period": "3000.0001 s"}, "does not fit a 32-bit clock"),
        ("walk-dropfoot-afo-timer", {"timer.dorsiflexor.inlet": SHORT}, "shorter than the board can count"),
        ("walk-dropfoot-afo", {"gait.variability": 0.02}, r"gait.variability = 0.02"),
    ],
)
def test_what_is_refused(scenario: str, sets: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        board_of(load("scenario", scenario, sets))


def test_a_name_that_c_does_not_take_is_refused() -> None:
    shipped = timed()
    chambers = {"dorsi-flexor": shipped.orthosis.chamber["dorsiflexor"]}
    orthosis = shipped.orthosis.model_copy(update={"chamber": chambers})
    scenario: Scenario = shipped.model_copy(update={"orthosis": orthosis})
    with pytest.raises(InputError, match=r"'dorsi-flexor'.*did you mean 'dorsi_flexor'"):
        board_of(scenario)
