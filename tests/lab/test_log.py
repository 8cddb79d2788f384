"""A builder's log: what its titles mean, and one message for each thing that can be wrong with it."""

import pathlib
from typing import Any

import numpy as np
import pytest

import afo_sim
from afo_sim.common import AMBIENT_PRESSURE, InputError
from afo_sim.description import load
from afo_sim.lab.run_problem import read_log, read_noise, recorded_columns
from afo_sim.simulation import Recording

SCENARIO = load("scenario", "seated")
TITLES = "time [ms], angle [deg], pressure dorsiflexor [bar], force dorsiflexor [N]"


def written(folder: pathlib.Path, titles: str = TITLES, rows: int = 12, **cells: str) -> pathlib.Path:
    """A log of `rows` samples every 100 ms; `cells` replaces some: r2c1="x" is row 2, column 1."""
    count = len(titles.split(","))
    table = [[f"{100 * k}", *(f"{k + c}" for c in range(1, count))] for k in range(rows)]
    for place, text in cells.items():
        row, column = map(int, place.removeprefix("r").split("c"))
        table[row][column] = text
    file = folder / "log.csv"
    lines = ["# source: the bench", "# who: me", titles, *(", ".join(row) for row in table)]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file


def test_titles_become_columns_in_si(tmp_path: pathlib.Path) -> None:
    log = read_log(written(tmp_path), SCENARIO)
    assert log.time == pytest.approx(0.1 * np.arange(12))
    angle, pressure, force = log.channels
    assert angle.columns == ("ankle/angle",)
    assert np.degrees(angle.values) == pytest.approx(np.arange(12) + 1)
    assert pressure.columns == ("chamber/dorsiflexor/pressure",)
    assert pressure.values == pytest.approx(1e5 * (np.arange(12) + 2))
    assert force.columns == tuple(f"muscle/dorsiflexor_{k}/force" for k in (1, 2, 3))
    assert log.facts == {"source": "the bench"}


def test_paths_and_single_muscles_and_absolute_pressures(tmp_path: pathlib.Path) -> None:
    titles = (
        "ankle/velocity [deg/s], time [ms], force dorsiflexor_2 [kN], absolute pressure plantarflexor [kPa],"
        "muscle/dorsiflexor_1/contraction [%], chamber/dorsiflexor/mass_flow_in [g/s]"
    )
    log = read_log(written(tmp_path, titles, r0c1="0", **{f"r{k}c1": str(k) for k in range(1, 12)}), SCENARIO)
    values = {channel.columns[0]: channel.values for channel in log.channels}
    assert values["ankle/velocity"][3] == pytest.approx(np.radians(300.0))
    assert values["muscle/dorsiflexor_2/force"][3] == pytest.approx(5000.0)
    assert values["chamber/plantarflexor/pressure"][3] == pytest.approx(6000.0 - AMBIENT_PRESSURE)
    assert values["muscle/dorsiflexor_1/contraction"][3] == pytest.approx(0.07)
    assert values["chamber/dorsiflexor/mass_flow_in"][3] == pytest.approx(0.008)


@pytest.mark.parametrize(
    ("name", "sets"), [("seated", {}), ("arm-s1", {}), ("seated", {"supply.source": "co2_16g"})]
)
def test_every_recorded_column_may_be_logged(name: str, sets: dict[str, Any]) -> None:
    run = afo_sim.run(name, sets | {"duration": "0.1 s"})
    named = set(recorded_columns(load("scenario", name, sets)))
    assert named == {c for c in run.columns if c != "time" and not c.startswith("qpos/")}


def test_groups_force_is_the_sum_of_its_muscles(tmp_path: pathlib.Path, seated: Recording) -> None:
    force = read_log(written(tmp_path), SCENARIO).channels[2]
    total = force.simulated(seated, np.array([1.0, 2.001]))
    each = [seated[f"muscle/dorsiflexor_{k}/force"] for k in (1, 2, 3)]
    assert total[0] == pytest.approx(sum(column[500] for column in each))
    assert total[1] == pytest.approx(0.5 * sum(column[1000] + column[1001] for column in each))


WRONG = {
    "no unit": (TITLES.replace("angle [deg]", "angle"), {}, "angle.*has no unit"),
    "a zero of its own": (
        TITLES.replace("angle [deg]", "chamber/dorsiflexor/temperature [degC]"),
        {},
        "whose zero is not that of K",
    ),
    "unknown column": (TITLES.replace("angle", "angel"), {}, "unknown column.*did you mean 'angle'"),
    "no such chamber": (
        TITLES.replace("pressure dorsiflexor", "pressure dorsiflexr"),
        {},
        "unknown column.*did you mean 'pressure dorsiflexor'",
    ),
    "no such muscle": (TITLES.replace("force dorsiflexor", "force dorsiflexor_4"), {}, "unknown column"),
    "text in a number": (TITLES, {"r2c1": "n/a"}, "line 6: is not a finite number"),
    "an empty cell": (TITLES, {"r2c1": ""}, "line 6: is not a finite number"),
    "time stands still": (TITLES, {"r4c0": "300"}, "line 8: time does not increase"),
    "time before the scenario": (TITLES, {"r0c0": "-1"}, "outside the scenario.*0 s to 16 s"),
    "time after the scenario": (TITLES, {"r11c0": "16001"}, "outside the scenario.*0 s to 16 s"),
    "no time": (TITLES.replace("time [ms]", "force plantarflexor [N]"), {}, "lacks a time"),
    "time alone": ("time [ms]", {}, "lacks anything measured"),
    "twice": (TITLES.replace("force dorsiflexor [N]", "ankle/angle [rad]"), {}, "occurs twice"),
}


@pytest.mark.parametrize("case", WRONG)
def test_bad_log_is_one_message(case: str, tmp_path: pathlib.Path) -> None:
    titles, cells, expected = WRONG[case]
    with pytest.raises(InputError, match=expected) as error:
        read_log(written(tmp_path, titles, **cells), SCENARIO)
    assert "log.csv" in str(error.value)
    assert "\n" not in str(error.value)


def test_empty_and_short_and_foreign_files(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match="holds 9 samples; allowed: at least 10"):
        read_log(written(tmp_path, rows=9), SCENARIO)
    file = tmp_path / "log.csv"
    file.write_text("")
    with pytest.raises(InputError, match="holds no points"):
        read_log(file, SCENARIO)
    file.write_bytes(b"\x80\x00")
    with pytest.raises(InputError, match="cannot be read"):
        read_log(file, SCENARIO)
    with pytest.raises(InputError, match="cannot be read"):
        read_log(tmp_path / "nowhere.csv", SCENARIO)


def with_noise(folder: pathlib.Path, spread: float, resolution: float) -> float:
    """The noise that is estimated for a rise of 20 deg with that of a sensor upon it [deg]."""
    time = np.sort(np.random.default_rng(3).uniform(0.0, 8.0, 2000))
    angle = 20.0 * (1.0 - np.exp(-time)) + np.random.default_rng(4).normal(0.0, spread, len(time))
    angle = np.round(angle / resolution) * resolution if resolution else angle
    rows = "\n".join(f"{t}, {a}" for t, a in zip(time.tolist(), angle.tolist(), strict=True))
    (folder / "log.csv").write_text(f"time [s], angle [deg]\n{rows}\n")
    log = read_log(folder / "log.csv", SCENARIO)
    return float(np.degrees(read_noise(log, {})["angle"]))


@pytest.mark.parametrize("spread", [0.02, 0.5])
def test_noise_is_found_in_unevenly_sampled_logs(spread: float, tmp_path: pathlib.Path) -> None:
    assert with_noise(tmp_path, spread, 0.0) == pytest.approx(spread, rel=0.08)


def test_noise_is_not_below_the_resolution(tmp_path: pathlib.Path) -> None:
    assert with_noise(tmp_path, 0.0, 0.5) == pytest.approx(0.5 / np.sqrt(12.0), rel=0.01)
    assert with_noise(tmp_path, 0.0, 0.0) > 0.0


def test_told_noise_and_what_is_wrong_with_it(tmp_path: pathlib.Path) -> None:
    log = read_log(written(tmp_path), SCENARIO)
    told = read_noise(log, {"angle": "0.5 deg", "chamber/dorsiflexor/pressure": "20 mbar"})
    assert told["angle"] == pytest.approx(np.radians(0.5))
    assert told["pressure dorsiflexor"] == pytest.approx(2000.0)
    for texts, expected in (
        ({"angel": "1 deg"}, "no such channel.*did you mean 'angle'"),
        ({"angle": "1 bar"}, "does not convert to rad"),
        ({"angle": 1}, "has no unit"),
        ({"angle": "0 deg"}, "more than 0"),
    ):
        with pytest.raises(InputError, match=expected):
            read_noise(log, texts)
