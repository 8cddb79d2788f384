"""A session's folder of OpenCap: the model, angles and forces of one trial, or one sentence."""

import pathlib

import numpy as np
import pytest
from gait_lab.laboratory import Laboratory
from gait_lab.osim_writer import write_osim
from gait_lab.trial_files import write_angles, write_forces, write_trc

from afo_sim.common import InputError
from afo_sim.gait_lab import Choices, import_gait, read_trial

LAB = Laboratory()
SET = "rajagopal"


def write_session(
    folder: pathlib.Path, *trials: str, forces: bool = True, angles: bool = True
) -> pathlib.Path:
    """The layout of a download: markers in mm, angles in degrees, the scaled model and one made of it."""
    session = folder / "OpenCapData_1"
    markers, motion, model = session / "MarkerData", session / "OpenSimData" / "Kinematics", session
    model = session / "OpenSimData" / "Model"
    for part in (markers, motion, model, session / "ForceData"):
        part.mkdir(parents=True)
    for name in (*trials, "neutral"):
        write_trc(markers / f"{name}.trc", LAB.time, LAB.markers(SET))
        if angles:
            write_angles(motion / f"{name}.mot", LAB.time, LAB.angles())
        if forces and name != "neutral":
            write_forces(session / "ForceData" / f"{name}_forces.mot", LAB.plates())
    write_osim(model / "LaiUhlrich2022_scaled_adjusted.osim", LAB.walker, SET, scale=0.9)
    write_osim(model / "LaiUhlrich2022_scaled.osim", LAB.walker, SET)
    text = f"gender_mf: f\nheight_m: 1.75\niphoneModel:\n  Cam0: iPhone13,3\nmass_kg: {LAB.walker.mass}\n"
    (session / "sessionMetadata.yaml").write_text(text)
    return session


@pytest.mark.parametrize("angles", [True, False])
def test_the_folder_is_its_one_trial(tmp_path: pathlib.Path, angles: bool) -> None:
    """The stride is that of the same files, given one by one; mass and height are the session's."""
    session = write_session(tmp_path, "walk1", angles=angles)
    done = import_gait([session], Choices())
    data = session / "OpenSimData"
    motion = data / "Kinematics" / "walk1.mot" if angles else session / "MarkerData" / "walk1.trc"
    model, forces = data / "Model" / "LaiUhlrich2022_scaled.osim", session / "ForceData" / "walk1_forces.mot"
    alone = import_gait([motion, forces, model], Choices(mass=LAB.walker.mass, height=1.75))
    np.testing.assert_array_equal(done.cycle.ankle_angle, alone.cycle.ankle_angle)
    np.testing.assert_array_equal(done.cycle.ankle_moment, alone.cycle.ankle_moment)
    assert done.cycle.body_height == 1.75 and done.mass.mass == LAB.walker.mass


def test_one_of_several_trials_is_chosen_by_a_file_of_it(tmp_path: pathlib.Path) -> None:
    session = write_session(tmp_path, "squat", "walk1")
    with pytest.raises(InputError) as caught:
        read_trial([session])
    assert "2 trials: squat, walk1" in str(caught.value)
    trial = read_trial([session, session / "MarkerData" / "walk1.trc"])
    assert [file.name for file in trial.files] == [
        "walk1.mot",
        "LaiUhlrich2022_scaled.osim",
        "walk1_forces.mot",
    ]


def test_a_session_has_no_forces_of_its_own(tmp_path: pathlib.Path) -> None:
    session = write_session(tmp_path, "walk1", forces=False)
    with pytest.raises(InputError) as caught:
        read_trial([session])
    assert "no ground forces" in str(caught.value) and "force plates" in str(caught.value.allowed)
    beside = write_forces(tmp_path / "plates.mot", LAB.plates())
    assert len(read_trial([session, beside]).plates) == 2


def test_any_other_folder_is_refused(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match="is a folder"):
        read_trial([tmp_path])
