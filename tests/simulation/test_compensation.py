"""A patient's own walk without what hip, knee and pelvis make up for: heights, signs, needless devices."""

import csv
import dataclasses
import itertools
import pathlib

import numpy as np
import pytest
from campaign import sampled
from compensating_patient import write_patient

import afo_sim
from afo_sim.common import assets, with_code
from afo_sim.gait import signs
from afo_sim.gait.file import read

HEALTHY = ("gatk_mean", "opensim_walk", "bovi2011_natural", "bovi2011_m")
BENT = ((0.0, 0.0), (25.0, 0.0), (25.0, 25.0))  # knee and hip in swing beyond the healthy stride's [deg]
PATIENTS = [*itertools.product(HEALTHY, (0.0, 8.0, 16.0, 24.0, 30.0), BENT)]
WITHOUT, WORN = "uncompensated_reference_toe_clearance", "uncompensated_toe_clearance"
BRIEF = {"duration": "4 s"}
SWING = {"gait.compensation": "removed", "ground.mode": "recorded"}


def patient(folder: pathlib.Path, name: str, *degrees: float) -> str:
    """The gait file of a patient who makes up for a foot that hangs."""
    return str(write_patient(assets.find_gait(name), folder / "patient.csv", *degrees))


@pytest.mark.parametrize(("name", "drop", "bent"), sampled(PATIENTS, 6))
def test_no_device_is_called_needless_where_only_hip_and_knee_lift_the_toe(
    name: str, drop: float, bent: tuple[float, float], tmp_path: pathlib.Path
) -> None:
    """Wanted are 10 mm, with the device and without; who is lifted by more than the ankle is not GOOD."""
    file = patient(tmp_path, name, drop, *bent)
    walk = afo_sim.run("walk-dropfoot-afo", BRIEF | {"gait.cycle": file})
    height = {n: walk.metrics[n].value for n in ("reference_toe_clearance", "toe_clearance", WITHOUT, WORN)}
    help_, lift = walk.verdict[:2]
    needed = min(height["reference_toe_clearance"], height[WITHOUT]) < 10.0
    assert needed or help_.status == "doubtful"  # not needed for the toe
    if "good" in (help_.status, lift.status):
        assert min(height["toe_clearance"], height[WORN]) >= 10.0
    if height[WORN] > 16.0 and height["toe_clearance"] > 13.0 and needed:  # also with toes less extended
        assert (help_.status, lift.status) == ("good", "good")
    seen = with_code(walk.warnings, "steppage")
    assert bool(seen) is (drop >= 8.0 and (bent[0] > 0.0 or name == "opensim_walk"))  # whose knee bends more
    assert all(note.data["low"] > drop - 3.0 for note in seen)


@pytest.mark.parametrize("name", ["gatk_mean", "opensim_walk"])
def test_the_height_without_compensation_is_that_of_rigid_parts(name: str, tmp_path: pathlib.Path) -> None:
    """Her ankle on healthy people's shank and ankle path, with the leg's own points: within 1 mm in swing."""
    file = patient(tmp_path, name, 20.0, 20.0, 10.0)
    walk = afo_sim.run("walk-dropfoot", SWING | {"gait.cycle": file})
    solved = walk["gait/solved"] > 0.5
    phase = walk["gait/phase"][solved] % 1.0
    hers, head = columns(pathlib.Path(file))
    recorded = hers["ankle_angle_deg"]  # what does not close is taken out about mid-stride
    hers["ankle_angle_deg"] = recorded - (recorded[-1] - recorded[0]) * (hers["phase"] - 0.5)
    tall, speed = float(head["body_height_m"]), float(head["walking_speed_m_per_s"])
    of_norm = [columns(assets.find_gait(f"bovi2011_{size}")) for size in ("xs", "s", "natural", "m", "l")]
    taller = tall / float(of_norm[0][1]["body_height_m"])
    speeds = [float(other["walking_speed_m_per_s"]) * np.sqrt(taller) for _, other in of_norm]
    above = int(np.searchsorted(speeds, speed))
    share = (speed - speeds[above - 1]) / (speeds[above] - speeds[above - 1])
    slow, fast = of_norm[above - 1][0], of_norm[above][0]
    norm = {n: (1.0 - share) * slow[n] + share * fast[n] for n in slow}
    start, own_start = (toe_off(each) for each in (norm, hers))
    swing = np.linspace(0.3, 0.7, 41)
    at, hers_at = start + swing * (1.0 - start), own_start + swing * (1.0 - own_start)
    shank, ankle = (
        np.radians(np.interp(p, of["phase"], of[n]))
        for p, of, n in ((at, norm, "shank_angle_deg"), (hers_at, hers, "ankle_angle_deg"))
    )
    size = tall / 1.75  # of the leg
    stands = (norm["phase"] > 0.15) & (norm["phase"] < 0.3)
    flat = np.radians(norm["ankle_angle_deg"] - norm["shank_angle_deg"])[stands]
    needed = np.max([-x * np.sin(flat) + 0.068 * np.cos(flat) for x in (-0.060, 0.120)], axis=0)
    standing = np.cos(np.radians(norm["shank_angle_deg"])[stands])
    along = np.mean(size * needed - taller * norm["ankle_z_m"][stands]) / np.mean(standing)  # the shank
    high = along * np.cos(shank) + taller * np.interp(at, norm["phase"], norm["ankle_z_m"])
    pitch = ankle - shank
    ball = high + size * (0.120 * np.sin(pitch) - 0.068 * np.cos(pitch))
    simulated = np.interp(at, phase[np.argsort(phase)], walk["ball/height"][solved][np.argsort(phase)])
    assert np.abs(simulated - ball).max() < 1e-3


def columns(file: pathlib.Path) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """A gait file's columns and its header."""
    lines = file.read_text().splitlines()
    head = dict(line[2:].split(": ", 1) for line in lines if line.startswith("# ") and ": " in line)
    names, *rows = csv.reader(line for line in lines if not line.startswith("#"))
    cells = np.array([[float(cell or "nan") for cell in row] for row in rows])
    return dict(zip(names, cells.T, strict=True)), head


def toe_off(of: dict[str, np.ndarray]) -> float:
    return float(of["phase"][(of["grf_z_bw"] > 0.05) & (of["phase"] < 0.9)].max())


def test_no_healthy_walker_shows_a_sign() -> None:
    for file in assets.find_gait("gatk_mean").parent.glob("[!n]*.csv"):  # a norm is no stride
        cycle = read(file)
        assert [*signs(cycle, cycle.body_height or 1.75)] == [], file


def test_a_hip_that_rises_is_named_where_the_knee_does_not_bend(tmp_path: pathlib.Path) -> None:
    file = pathlib.Path(patient(tmp_path, "gatk_mean", 15.0))
    lines = file.read_text().splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("phase"))
    names, rows = lines[first].split(","), [line.split(",") for line in lines[first + 1 :]]
    for row in rows:
        swung = max(0.0, (float(row[0]) - 0.65) / 0.35)
        height = float(row[names.index("ankle_z_m")]) + 0.06 * float(np.sin(np.pi * swung) ** 2)
        row[names.index("ankle_z_m")] = str(height)
    file.write_text("\n".join([*lines[: first + 1], *map(",".join, rows)]) + "\n")
    (sign,) = signs(read(file), 1.78)
    assert sign.code == "hip-rises-in-swing" and 40.0 < sign.data["risen"] < 80.0


def test_what_cannot_be_walked_without_compensation_is_not_known(tmp_path: pathlib.Path) -> None:
    """And no answer is good that needs it."""
    file = patient(tmp_path, "gatk_mean", 0.0)
    walk = afo_sim.run("walk-dropfoot-afo", BRIEF | {"gait.cycle": file})
    known = {n: m for n, m in walk.metrics.items() if n not in (WITHOUT, WORN)}
    help_, lift = dataclasses.replace(walk, metrics=known).verdict[:2]
    assert help_.status == "unknown" and lift.status == "unknown"
    assert [answer.status for answer in walk.verdict[:2]] == ["doubtful"] * 2  # a healthy person's walk
    assert "trial-looks-healthy" in {warning.code for warning in walk.warnings}
