"""The doctor imports what a file's kind needs, and no more."""

import pathlib
import subprocess
import sys

import pytest

from afo_sim.cli.doctor.kinds import check_file
from afo_sim.common import InputError, assets
from afo_sim.description.new import new
from afo_sim.study import new_study

BLOCKED = """
import pathlib, sys
from afo_sim.cli.doctor.kinds import check_file
for name in ("legs", "study", "lab", "gait_lab", "show"):
    sys.modules[f"afo_sim.{name}"] = None
for what, finding in check_file(pathlib.Path(sys.argv[1])):
    print(what, finding)
print("heavy:", "mujoco" in sys.modules)
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "name", "heavy"),
    [("muscle", "dmsp_20", False), ("valve", "mh1", False), ("orthosis", "s1", True)],
)
def test_part_is_checked_without_the_rooms_of_other_kinds(kind: str, name: str, heavy: bool) -> None:
    file = assets.find(kind, name)
    done = subprocess.run([sys.executable, "-c", BLOCKED, str(file)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert f"kind {kind}" in done.stdout
    assert ("heavy: True" in done.stdout) is heavy


def test_gait_is_checked_without_a_laboratory(tmp_path: pathlib.Path) -> None:
    file = assets.find_gait("opensim_walk")
    done = subprocess.run([sys.executable, "-c", BLOCKED, str(file)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "kind gait cycle" in done.stdout


def told(file: pathlib.Path) -> dict[str, object]:
    """Everything that is said to be wrong with a file, by field."""
    with pytest.raises(InputError) as refused:
        check_file(file)
    every = [refused.value, *refused.value.others]
    assert all(str(each.file) == str(file) for each in every)
    if len(every) > 1:
        assert f"({len(every) - 1} more below)" in str(refused.value).splitlines()[0]
    assert len(str(refused.value).splitlines()) == len(every)
    return {each.field: each.nearest for each in every}


def test_every_error_of_an_orthosis_is_told_at_once(tmp_path: pathlib.Path) -> None:
    """An unknown key, a unit, a range, a choice, a reference and a missing file, each planted."""
    file = new("orthosis", "brace", tmp_path)
    text = file.read_text()
    for right, wrong in (
        ('link_length = "11.5 cm"', 'lnk_length = "11.5 cm"'),
        ('["-20 deg", "20 deg"]', '["-20 deg", "20 kg"]'),
        ("count = 3", "count = 30"),
        ('segment = "foot", from_joint = ["-6', 'segment = "fot", from_joint = ["-6'),
        ('inlet = "mh1"\noutlet', 'inlet = "mh1_3_22"\noutlet'),
        ('"cuff.xml"', '"cufff.xml"'),
    ):
        assert right in text
        text = text.replace(right, wrong)
    file.write_text(text)
    assert told(file) == {
        "muscle.plantarflexor.lnk_length": "link_length",
        "range_of_motion.1": None,
        "muscle.dorsiflexor.count": None,
        "muscle.plantarflexor.insertion.segment": "foot",
        "chamber.plantarflexor.inlet": "mh1_3_2",
        "cuff": "cuff.xml",
    }


def test_every_error_of_a_sweep_is_told_at_once(tmp_path: pathlib.Path) -> None:
    file = new_study("sweep", "mine", tmp_path)
    text = file.read_text().replace('"grid"', '"gird"').replace("steps = 3", "steps = 0\nstpes = 3")
    file.write_text(text.replace('"air_per_cycle"', '"air_per_cycel"').replace("[set]", "[sett]"))
    assert told(file) == {
        "sett": "set",
        "parameters.pressure.stpes": "steps",
        "design": "grid",
        "metrics.1": "air_per_cycle",
        "parameters.pressure.steps": None,
    }


@pytest.mark.parametrize(
    ("wrong", "fields"),
    [
        ({"side: right": "side: rihgt", "stride_time_s: 1": "stride_time_s: 99"}, {"side", "stride_time_s"}),
        ({"knee_angle_deg": "kne_angle_deg"}, {"knee_angle_deg", "kne_angle_deg"}),
        ({"# side:": "# sid:", "stride_time_s": "stride_tim_s"}, {"side", "stride_time_s"}),
    ],
)
def test_every_error_of_a_gait_file_is_told_at_once(
    wrong: dict[str, str], fields: set[str], tmp_path: pathlib.Path
) -> None:
    text = assets.find_gait("bovi2011_natural").read_text()
    for right, other in wrong.items():
        assert right in text
        text = text.replace(right, other)
    file = tmp_path / "gait.csv"
    file.write_text(text)
    assert told(file).keys() == fields
