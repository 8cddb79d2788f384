"""What is said of drives that do not fit their valves, and what would do really does."""

import re
from typing import Any

import numpy as np
import pytest

import afo_sim
from afo_sim.common import InputError
from afo_sim.description import Drive, load
from afo_sim.model.air_checks import fastest_rise
from afo_sim.model.build import build
from afo_sim.physics.pneumatics import iso_6358_flow

FAST = {
    "orthosis.chamber.dorsiflexor.inlet.conductance": "0.2 dm^3/(s*bar)",
    "orthosis.chamber.dorsiflexor.outlet.conductance": "0.2 dm^3/(s*bar)",
}


def said(**drive: Any) -> str:
    """Warnings of a drive on a valve that is four times the shipped one."""
    table = {"drive.dorsiflexor": drive, "timestep": "1 ms"} | FAST
    built = build(load("scenario", "seated-antagonist", table))
    return "; ".join(w for w in built.warnings if w.startswith("drive of"))


def test_the_fastest_rise_is_that_of_choked_flow() -> None:
    orthosis = load("scenario", "seated-antagonist").orthosis
    valve, group = orthosis.chamber["dorsiflexor"].inlet, orthosis.muscle["dorsiflexor"]
    flow = iso_6358_flow(5e5, 1e5, 293.15, valve.conductance, valve.critical_ratio)
    tube = orthosis.chamber["dorsiflexor"].tube_volume
    bore = np.pi / 4.0 * group.type.bore**2 * group.type.nominal_length + group.type.dead_volume
    expected = 1.4 * 287.0 * 293.15 * flow / (tube + group.count * bore)
    assert fastest_rise(orthosis, "dorsiflexor", 4e5) == pytest.approx(expected, rel=0.02)


def test_a_period_shorter_than_the_step_is_refused() -> None:
    with pytest.raises(
        InputError, match=r"drive\.dorsiflexor\.period.*shorter than the time step.*at least 1 ms"
    ):
        said(kind="pwm", period="0.5 ms")
    assert said(kind="pwm", period="1 ms", full_at="5 bar")  # no longer than the opening delay


def test_what_changes_nothing_is_said() -> None:
    assert "period, full_at changes nothing" in said(
        kind="bang_bang", period="5 ms", full_at="1 bar", dead_band="1 bar"
    )
    assert said(kind="bang_bang", dead_band="1 bar") == ""


@pytest.mark.parametrize(
    ("drive", "key"),
    [
        ({"kind": "bang_bang", "dead_band": "10 mbar"}, "dead_band"),
        ({"kind": "pwm", "full_at": "10 mbar", "period": "20 ms"}, "full_at"),
        ({"kind": "regulator", "full_at": "1 mbar", "bandwidth": "2000 Hz"}, "full_at"),
        ({"kind": "regulator", "full_at": "20 mbar", "filter_time": "30 ms"}, "full_at"),
    ],
)
def test_what_would_do_does(drive: dict[str, str], key: str) -> None:
    text = said(**drive)
    found = re.search(rf"{key} of ([\d.e+-]+) bar would do", text)
    assert found is not None, text
    assert said(**drive | {key: f"{1.05 * float(found[1])} bar"}) == ""


def test_a_shorter_step_that_would_do_does() -> None:
    drive = {"kind": "regulator", "full_at": "10 mbar", "bandwidth": "2000 Hz"}
    found = re.search(r"timestep of ([\d.e+-]+) ms", said(**drive))
    table = {"drive.dorsiflexor": drive, "timestep": f"{0.9 * float(found[1]):.3g} ms"} | FAST
    built = build(load("scenario", "seated-antagonist", table))
    assert not any(w.startswith("drive of") for w in built.warnings)


def swing(target: float = 2e5, **drive: str) -> float:
    """How far the pressure goes up and down once it is there [Pa]."""
    table = {"drive.dorsiflexor": drive, "timestep": "1 ms", "duration": "2 s"} | FAST
    run = afo_sim.run("seated-antagonist", table, controller=lambda seen: {"dorsiflexor": target}, rate=50)
    return float(np.ptp(run["chamber/dorsiflexor/pressure"][-500:]))


def test_a_warned_drive_swings_and_a_gentle_one_rests() -> None:
    """The regulator whose transducer is too slow for its full_at."""
    drive = {"kind": "regulator", "filter_time": "30 ms", "dead_band": "0 bar"}
    assert swing(**drive, full_at="20 mbar") > 1e4
    gentle = re.search(r"full_at of ([\d.e+-]+) bar", said(**drive, full_at="20 mbar"))
    assert swing(**drive, full_at=f"{1.5 * float(gentle[1])} bar") < 1e3


def test_a_derivative_that_turns_pulses_round_is_warned_of() -> None:
    """Of a pulse train: 1 bar is asked for, and the pressure goes up and down by tenths of a bar."""
    drive = {"kind": "pwm", "full_at": "0.3 bar"}
    assert swing(1e5, **drive, derivative_time="200 ms") > 2e4
    found = re.search(
        r"a derivative_time of ([\d.e+-]+) ms would do", said(**drive, derivative_time="200 ms")
    )
    gentle = f"{0.95 * float(found[1])} ms"
    assert said(**drive, derivative_time=gentle) == ""
    assert swing(1e5, **drive, derivative_time=gentle) < 1e3


@pytest.mark.parametrize(
    ("changed", "field"),
    [
        ({"release": 3e3}, "release"),
        ({"kind": "pwm", "least_on": 0.03}, "least_on"),
        ({"period": 0.0}, "period"),
    ],
)
def test_what_makes_no_sense_is_refused(changed: dict[str, Any], field: str) -> None:
    with pytest.raises(InputError, match=field):
        Drive(kind="bang_bang").with_values(**changed)
