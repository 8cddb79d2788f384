"""Gait files: each bit comes back, and what is wrong is said."""

import dataclasses
import pathlib

import numpy as np
import pytest

from afo_sim.common import InputError, without_digests
from afo_sim.walker import Vector, read_gait, write_gait


def test_each_bit_comes_back(tmp_path: pathlib.Path) -> None:
    draw = np.random.default_rng(3)
    natural = read_gait("natural")
    vector = Vector(
        draw.normal(0.0, 0.1, natural.vector.offsets.shape),
        draw.normal(0.0, 2.0, natural.vector.gains.shape),
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
        ("[gains]", "[gains]\nlean = 1e9\n[left]", "-20 to 20"),
        ("[gains]", "[gains]\nlean = nan\n[left]", "-20 to 20"),
        ("[gains]", "[gains]\nlean = true\n[left]", "-20 to 20"),
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
