"""What the page on walking data prints: three commands from a raw C3D to a report, and its files."""

import pathlib
import re
import shlex
import textwrap

import numpy as np
import pytest
from command import call
from documents import PAGES

from afo_sim.gait import file as gait
from afo_sim.gait_lab.readers.csv_trial import read_csv_trial

PAGE = PAGES["gait_data"]


@pytest.mark.slow
def test_three_commands_go_from_a_raw_c3d_to_a_report(
    tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("ezc3d")
    from gait_lab.c3d_writer import write_c3d
    from gait_lab.laboratory import Laboratory

    block = PAGE.split("to a report in three commands:\n\n")[1].split("\n\n")[0]
    lines = [line.removeprefix("    .venv/bin/afo-sim ") for line in block.splitlines()]
    assert [line.split()[0] for line in lines] == ["gait", "run", "report"]
    laboratory = Laboratory(forward="-y", up="z")
    points, plates = laboratory.markers("plug-in gait"), laboratory.plates("steps")
    write_c3d(tmp_path / "walk.c3d", laboratory.time, points, plates)
    monkeypatch.chdir(tmp_path)
    for line in lines:
        code, _, complaint = call(capsys, *shlex.split(line))
        assert code == 0, complaint
    assert (tmp_path / "my_walk.png").read_bytes().startswith(b"\x89PNG")
    assert gait.read(tmp_path / "my_walk.csv").side == "right"
    assert "my_walk.csv" in (tmp_path / "runs" / "mine" / "report.html").read_text(encoding="utf-8")


def test_the_pages_examples_of_csv_are_read(tmp_path: pathlib.Path) -> None:
    """The numbers are those that stand in the blocks."""
    blocks = [block for block in re.findall(r"(?:^    .+\n)+", PAGE, flags=re.M) if "time [s]" in block]
    found = []
    for number, block in enumerate(blocks):
        path = tmp_path / f"{number}.csv"
        path.write_text(textwrap.dedent(block), encoding="utf-8")
        found.append(read_csv_trial(path))
    markers, plates, angles = found
    assert markers.markers is not None
    assert np.isclose(markers.markers.positions["RKNE"][0, 0], 0.4123)
    assert np.isnan(markers.markers.positions["RANK"][1]).all()
    (plate,) = plates.plates
    assert np.allclose(plate.force[0], [-12.1, 310.4, 4.2])
    assert np.allclose(plate.place[0], [0.395, 0.0, 0.1152])
    assert np.allclose(angles.tables[0].columns["knee_angle_r"], [6.2, 6.9])
