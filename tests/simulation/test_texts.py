"""A text with its unit does what the number in SI does, and a wrong one is told."""

import pathlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import afo_sim as afo
from afo_sim.common import ControllerError, InputError, SimulationError, si
from afo_sim.metrics import Metric

SHORT = {"duration": "0.2 s"}
DRIVEN = SHORT | {"drive": {"dorsiflexor": {"kind": "bang_bang"}}}


@pytest.mark.parametrize(
    ("given", "unit", "expected"),
    [
        (3, "Pa", 3.0),
        (np.float32(0.5), "s", 0.5),
        ("10 ms", "s", 0.01),
        ("3 bar", "Pa", 3e5),
        ("180 deg", "rad", np.pi),
        (Metric(20.0, "mm"), "m", 0.02),
        (float("inf"), "s", float("inf")),
    ],
)
def test_an_argument_in_si(given: Any, unit: str, expected: float) -> None:
    found = si(given, unit, "argument")
    assert type(found) is float and np.isclose(found, expected, rtol=1e-14)


@pytest.mark.parametrize("given", ["10 m", "10", "ten", True, None, [1.0], Metric(1.0, "kg")])
def test_what_is_no_time_is_refused(given: Any) -> None:
    with pytest.raises(InputError) as wrong:
        si(given, "s", "dt", "0.001 s times 1, 2, 3")
    assert (wrong.value.field, wrong.value.allowed) == ("dt", "0.001 s times 1, 2, 3")


def lift(seen: Any) -> dict[str, str]:
    return {"dorsiflexor": "inlet" if seen["ankle/angle"] < 0.05 else "outlet"}


def test_a_run_takes_rate_and_limit_as_texts() -> None:
    number = afo.run("seated", SHORT, controller=lift, rate=50, time_limit=5)
    text = afo.run("seated", SHORT, controller=lift, rate="50 Hz", time_limit="5000 ms")
    assert all(np.array_equal(text[name], number[name]) for name in number)


def test_steps_take_texts() -> None:
    with afo.Simulator("seated", SHORT) as simulator:
        assert simulator.step(None, "10 ms").time == 0.01 and simulator.step(dt=0.01).time == 0.02
        for wrong in ("0.3 ms", "10 m", "10"):
            with pytest.raises(InputError) as refused:
                simulator.step(None, wrong)
            assert refused.value.field == "dt" and simulator.time == 0.02
    with afo.Simulators("seated", SHORT, count=2) as many:
        assert {seen.time for seen in many.step(dt="20 ms")} == {0.02}
    with afo.Simulator("seated", SHORT, controller=lift, rate="50 Hz") as controlled:
        controlled.step(dt="40 ms")
        assert controlled.time == 0.04


def test_a_drive_is_commanded_by_a_text() -> None:
    def ask(pressure: Any) -> Any:
        return lambda seen: {"dorsiflexor": pressure}

    number = afo.run("seated", DRIVEN, controller=ask(3e5))
    text = afo.run("seated", DRIVEN, controller=ask("3 bar"))
    assert np.array_equal(text["chamber/dorsiflexor/pressure"], number["chamber/dorsiflexor/pressure"])
    for wrong in ("3 m", "30 bar", "3 bars of air", "-1 bar"):
        with pytest.raises(InputError) as refused:
            afo.run("seated", DRIVEN, controller=ask(wrong))
        assert refused.value.field == "dorsiflexor"
    with pytest.raises(InputError, match=r"\[drive\.dorsiflexor\]"):
        afo.run("seated", SHORT, controller=ask("3 bar"))


def test_files_take_rates_as_texts(seated: afo.Recording, tmp_path: pathlib.Path) -> None:
    texts = [
        seated.export(tmp_path / f"{k}.csv", rate=rate, columns=["ankle/*"])[0].read_text()
        for k, rate in enumerate((100, "100 Hz", "0.1 kHz"))
    ]
    assert len(texts[0].splitlines()) > 100 and len(set(texts)) == 1
    for write in (seated.export, seated.save):
        with pytest.raises(InputError) as refused:
            write(tmp_path / "wrong.csv", rate="100 m")  # type: ignore[operator]
        assert refused.value.field == "rate" and not (tmp_path / "wrong.csv").exists()


def test_a_torque_map_takes_texts() -> None:
    number = afo.torque_map("seated", angles=np.radians([-5.0, 10.0]), pressures=[2e5])
    text = afo.torque_map("seated", angles=["-5 deg", "10 deg"], pressures=["2 bar"])
    for a, b in zip(number.maps, text.maps, strict=True):
        assert np.allclose(a.torque, b.torque, rtol=1e-12) and np.array_equal(a.pressures, b.pressures)


@pytest.mark.parametrize(
    ("use", "field"),
    [
        (lambda: afo.walk("walk-dropfoot-afo", duration="20 m"), "duration"),
        (lambda: afo.walk("walk-dropfoot-afo", push="50 s"), "push"),
        (lambda: afo.torque_map("seated", angles=["5 bar"]), "angles"),
        (lambda: afo.torque_map("seated", pressures=["5 deg"]), "pressures"),
        (lambda: afo.load("muscle", "dmsp_20").force("3 m", contraction=0.1), "pressure"),
        (lambda: afo.draw("s1", pressure="3 m"), "pressure"),
    ],
)
def test_a_wrong_unit_is_told(use: Callable[[], Any], field: str) -> None:
    with pytest.raises(InputError, match="convert") as refused:
        use()
    assert refused.value.field == field


def test_a_leg_is_imported_with_texts(tmp_path: pathlib.Path) -> None:
    pytest.importorskip("lxml")
    file = afo.load("leg", "adult_75kg").file
    numbers = {"zero": 0.1, "range": (-0.5, 0.25), "body_mass": 80.0, "body_height": 1.8}
    texts = {"zero": "0.1 rad", "range": ("-0.5 rad", 0.25), "body_mass": "80 kg", "body_height": "180 cm"}
    written = []
    for k, given in enumerate((numbers, texts)):
        imported = afo.import_leg(file, tmp_path / str(k) / "mine", **given)  # type: ignore[arg-type]
        assert imported.folder is not None
        written.append({path.name: path.read_bytes() for path in imported.folder.iterdir()})
    assert written[0] == written[1] and "leg.toml" in written[0]
    with pytest.raises(InputError) as refused:
        afo.import_leg(file, body_mass="80 m")
    assert refused.value.field == "body_mass"


def test_an_error_without_a_time_names_none() -> None:
    for kind in (SimulationError, ControllerError):
        assert str(kind("why", time=0.5)).endswith("t = 0.5 s: why")
        assert str(kind("why")) == str(kind("why", time=float("inf"))) == "why"
