"""CSV, read back by pandas, by the standard library and as a device's log: the same bits, the same units."""

import csv
import io
import pathlib

import numpy as np
import pytest

import afo_sim
from afo_sim.description import load
from afo_sim.lab.run_problem import read_log
from afo_sim.metrics import words
from afo_sim.simulation import Recording
from afo_sim.study import with_studies


def read(path: pathlib.Path) -> list[list[str]]:
    text = path.read_bytes().decode("utf-8")
    return list(csv.reader(io.StringIO(text, newline=""), strict=True))


def test_every_number_comes_back_to_the_bit(walked: Recording, tmp_path: pathlib.Path) -> None:
    walked.export(tmp_path / "walk.csv")
    titles, *rows = read(tmp_path / "walk.csv")
    assert [title.rsplit(" [", 1)[0] for title in titles] == list(walked.columns)
    values = np.array(rows, float)
    assert all(np.array_equal(values[:, k], v) for k, v in enumerate(walked.columns.values()))
    assert {"time [s]", "ankle/angle [rad]", "gait/phase [-]", "ankle/moment/ground [N*m]"} <= set(titles)
    import pandas

    frame = pandas.read_csv(tmp_path / "walk.csv")  # its own way with digits may differ in the last one
    assert list(frame.columns) == titles
    assert np.allclose(frame.to_numpy(), values, rtol=1e-15, atol=0.0)


def test_it_is_rfc_4180(seated_second: Recording, tmp_path: pathlib.Path) -> None:
    seated_second.export(tmp_path / "a.csv", columns=["ankle/*"])
    raw = (tmp_path / "a.csv").read_bytes()
    assert raw.count(b"\r\n") == raw.count(b"\n") == len(seated_second["time"]) + 1
    lines = read(tmp_path / "a.csv")
    assert {len(line) for line in lines} == {len(lines[0])}


def test_fit_run_reads_it_as_a_log_of_the_device(seated_second: Recording, tmp_path: pathlib.Path) -> None:
    """All columns of the orthosis; the joints' coordinates are no channels of a device."""
    kinds = ["ankle/*", "muscle/*", "cuff/*", "chamber/*", "valve/*", "supply/*", "exhaust/*"]
    seated_second.export(tmp_path / "log.csv", columns=kinds)
    log = read_log(tmp_path / "log.csv", load("scenario", seated_second.scenario))
    assert np.array_equal(log.time, seated_second["time"])
    channels = {channel.columns[0]: channel for channel in log.channels}
    assert set(channels) == {n for n in seated_second.columns if n != "time" and not n.startswith("qpos/")}
    for name, channel in channels.items():
        assert channel.scale == 1.0 and np.array_equal(channel.values, seated_second[name]), name


def test_metrics_go_with_it(walked: Recording, tmp_path: pathlib.Path) -> None:
    assert [file.name for file in walked.export(tmp_path / "w.csv")] == ["w.csv", "w_metrics.csv"]
    titles, *rows = read(tmp_path / "w_metrics.csv")
    assert titles == ["name", "value", "unit", "label"]
    assert [row[0] for row in rows] == list(walked.metrics)
    values = [float(row[1]) for row in rows]
    assert np.array_equal(values, [float(metric) for metric in walked.metrics.values()], equal_nan=True)
    assert [row[2] for row in rows] == [metric.unit for metric in walked.metrics.values()]
    assert {row[0]: row[3] for row in rows}["toe_clearance"] == words("toe_clearance").label


@pytest.mark.slow
def test_bands_stand_beside_their_metric(tmp_path: pathlib.Path) -> None:
    drawn = with_studies(
        afo_sim.run("walk-dropfoot-afo-short", {"duration": "1.2 s"}),
        afo_sim.load("scenario", "walk-dropfoot-afo-short", {"duration": "1.2 s"}),
        draws=20,
    )
    drawn.export(tmp_path / "w.csv")
    titles, *rows = read(tmp_path / "w_metrics.csv")
    assert titles[4:] == ["quantile_5", "quantile_50", "quantile_95"]
    told = {row[0]: row[4:] for row in rows}
    low, middle, high = map(float, told["toe_clearance"])
    assert [low, middle, high] == drawn.studies["uncertainty"]["metrics"]["toe_clearance"]["quantiles"]
    assert low < middle < high
    assert told["strides_counted"] == ["", "", ""]
