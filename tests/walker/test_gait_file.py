"""Gait files: each bit comes back, and what is wrong is said."""

import dataclasses
import pathlib

import numpy as np
import pytest

from afo_sim.common import InputError, without_digests
from afo_sim.physics import GAINS
from afo_sim.walker import Vector, read_gait, write_gait
from afo_sim.walker.bounds import LEAST, MOST


def test_each_bit_comes_back(tmp_path: pathlib.Path) -> None:
    draw = np.random.default_rng(3)
    natural = read_gait("natural")
    vector = Vector(
        draw.uniform(LEAST.offsets, MOST.offsets),
        draw.uniform(LEAST.gains, MOST.gains),
        1.0 / 3.0,
    )
    search = {"converged": False, "cost": 0.1 + 0.2, "evaluations": 16, "note": 'said "no"'}
    gait = dataclasses.replace(
        natural, vector=vector, speed=1.1 / 0.9, description='a "quoted" one\nü', search=search
    )
    write_gait(tmp_path / "mine.toml", gait)
    again = read_gait(tmp_path / "mine.toml")
    assert again.vector.offsets.tobytes() == vector.offsets.tobytes()
    assert again.vector.gains.tobytes() == vector.gains.tobytes()
    assert (again.vector.speed, again.speed, again.name) == (vector.speed, gait.speed, "mine")
    assert (again.description, again.search) == (gait.description, search)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("[pose]", "[post]", "did you mean 'pose'"),
        ("soleus_force", "soleus_forse", "did you mean 'soleus_force'"),
        ('speed = "1.25 m/s"', 'speed = "1.25 kg"', "speed"),
        ('speed = "1.25 m/s"', 'speed = "9 m/s"', "0.3 to 2.5 m/s"),
        ('speed = "1.25 m/s"', "", "is missing"),
        (
            "[gains]",
            "[gains]\nlean = 1e9\n[left]",
            "gains.lean = 1000000000.0: is not a number in range; allowed: 0 to 10",
        ),
        ("[gains]", "[gains]\nlean = nan\n[left]", "0 to 10"),
        ("[gains]", "[gains]\nlean = true\n[left]", "0 to 10"),
        ("[gains]", "[gains]\ntibialis_soleus = 0.1\n[left]", "-2 to 0"),
        ("[gains]", "[left]\nsoleus_force = -0.1\n[gains]", "left.soleus_force"),
        ("[gains]", "[gains]\ntibialis_offset = 0.1\n[left]", "0.3 to 2"),
        ("[pose]", "[pose]\nhip = 0.6\n[search.x]", "-0.5 to 0.5"),
        ("[pose]", "[start]\nfaster = 1.0\n[pose]", "start.faster"),
        ("[pose]", "pose = 3\n[search.x]", "is not a table"),
        ("[pose]", "[pose", "is not valid TOML"),
    ],
)
def test_what_is_wrong_is_said(old: str, new: str, says: str, tmp_path: pathlib.Path) -> None:
    file = tmp_path / "mine.toml"
    write_gait(file, read_gait("natural"))
    text = without_digests(file.read_text(encoding="utf-8")).replace("[start]\nspeed = 1.0\n", "")
    assert old in text
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=r"mine\.toml") as error:
        read_gait(file)
    assert says in str(error.value)


def test_a_gain_that_a_file_lacks_is_the_nearest_to_none_within_bounds(tmp_path: pathlib.Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text('speed = "1.2 m/s"\n[pose]\n[gains]\n', encoding="utf-8")
    gains = dict(zip(GAINS, read_gait(file).vector.gains[0], strict=True))
    assert (gains["load"], gains["knee_straight"], gains["soleus_force"]) == (0.001, 0.0, 0.0)
    write_gait(file, read_gait(file))
    assert dict(zip(GAINS, read_gait(file).vector.gains[1], strict=True)) == gains
