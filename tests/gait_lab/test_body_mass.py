"""The body's mass by plates that carry a known weight."""

from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from afo_sim.common import GRAVITY, InputError
from afo_sim.gait_lab.trial.body_mass import BodyMass, find_mass
from afo_sim.gait_lab.trial.ground_force import PlateContact
from afo_sim.gait_lab.trial.importing import _require_mass

MASS, PERIOD, STANCE = 70.0, 1.1, 0.68  # [kg, s, s]
TIME = np.arange(0.0, 6.0, 0.001)
ORDER = {"right": 0.2, "left": 0.2 + 0.5 * PERIOD}


def upward(start: float, share: float) -> np.ndarray:
    """A stance with two humps whose impulse is the weight's over a stride, times the leg's share."""
    phase = np.clip((TIME - start) / STANCE, 0.0, 1.0)
    shape = np.sin(np.pi * phase) + 0.4 * np.sin(3.0 * np.pi * phase)
    mean = (2.0 + 0.4 * 2.0 / 3.0) / np.pi  # of the shape over phase, by its integral
    return share * MASS * GRAVITY * PERIOD / (STANCE * mean) * shape


def walk(
    sides: tuple[str, ...] = ("right", "left"),
    *,
    share: float = 0.5,
    offset: float = 0.0,
    loaded: bool = True,
    count: int = 3,
) -> tuple[dict[str, object], list[object]]:
    """Grounds and strides, as read from plates with an offset [N]; `share` is the right leg's."""
    grounds: dict[str, object] = {}
    strides: list[object] = []
    for side in sides:
        starts = [ORDER[side] + k * PERIOD for k in range(count)]
        force = sum(upward(start, share if side == "right" else 1.0 - share) for start in starts) + offset
        pressed = force > 20.0 + offset
        edges = TIME[np.flatnonzero(np.diff(pressed.astype(int)))]
        contacts = tuple(
            PlateContact(side, float(a), float(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)
        )
        # what was filtered is zero outside contacts, and holds the offset inside
        filtered = np.where(pressed, force, 0.0)
        grounds[side] = SimpleNamespace(
            time=TIME, force_z=filtered, contacts=contacts, foreign=(), plates={side: (TIME, force)}
        )
        strides += [
            SimpleNamespace(
                side=side, start=s, end=s + PERIOD, toe_off=s + STANCE, by="force", loaded=loaded, closed=None
            )
            for s in starts
        ]
    return grounds, strides


@pytest.mark.parametrize("offset", [0.0, -18.0, 15.0])
@pytest.mark.parametrize("share", [0.5, 0.46])
def test_both_legs_carry_the_weight(offset: float, share: float) -> None:
    found = find_mass(*walk(share=share, offset=offset), None, None)
    assert found.mass == pytest.approx(MASS, rel=0.002)
    assert found.how == "by the plates"
    assert found.estimated == found.mass
    (remark,) = found.remarks
    assert remark == "the plates carry 70.0 kg (±2 %) over 3 right and 3 left strides"
    assert len(found.warnings) == (2 if offset else 0)
    assert all(f"reads {offset:+.0f} N while unloaded" in warning for warning in found.warnings)


def test_a_foot_half_beside_its_plate_is_told() -> None:
    found = find_mass(*walk(share=0.4), None, None)
    assert found.warnings == (
        "the right leg carries only 40 % of the weight: a limp, or a foot partly off its plate; then "
        "the mass is more likely 84.0 kg",  # twice the left leg's 42 kg
    )
    assert "±20 %" in found.remarks[0]


def test_one_leg_is_taken_for_half() -> None:
    found = find_mass(*walk(("left",), count=1), None, None)
    assert found.mass == pytest.approx(MASS, rel=0.002)
    assert found.remarks == ("the plates carry 70.0 kg (±5 %) over 1 left stride, assuming equal legs",)
    assert [told.code for told in found.warnings] == ["mass-of-one-leg"]
    lame = find_mass(*walk(("left",), share=0.55), None, None)
    assert lame.mass == pytest.approx(0.9 * MASS, rel=0.002)


@pytest.mark.parametrize(
    ("given", "model", "mass", "how", "warns"),
    [
        (72.0, None, 72.0, "given", 0),
        (49.0, None, 49.0, "given", 1),
        (91.0, None, 91.0, "given", 1),
        (None, 71.0, 71.0, "of the model", 0),
        (None, 90.0, 70.0, "by the plates", 1),
        (71.0, 90.0, 71.0, "given", 1),
        (90.0, 71.0, 90.0, "given", 2),
    ],
)
def test_masses_are_compared(
    given: float | None, model: float | None, mass: float, how: str, warns: int
) -> None:
    found = find_mass(*walk(), given, model)
    assert (found.mass, found.how) == (pytest.approx(mass, rel=0.002), how)
    assert found.estimated == pytest.approx(MASS, rel=0.002)
    assert len(found.warnings) == warns


def test_the_warning_has_its_numbers() -> None:
    (warning,) = find_mass(*walk(), 49.0, None).warnings
    assert warning == "the mass given, 49.0 kg, is used; by the plates it is 70.0 kg (-30 % off that)"


def test_without_plates_the_mass_must_be_known() -> None:
    grounds, strides = walk(loaded=False)
    for known in (grounds, {}):
        with pytest.raises(InputError, match="the body mass is not in the files") as caught:
            find_mass(known, strides, None, None)
        assert caught.value.field == "mass"
        assert find_mass(known, strides, 72.0, None).estimated is None


def test_two_plates_carry_one_step() -> None:
    grounds, strides = walk()
    right = grounds["right"]
    half = 0.5 * right.plates["right"][1]  # type: ignore[attr-defined]
    right.plates = {"a": (TIME, half), "b": (TIME, half)}  # type: ignore[attr-defined]
    right.contacts = tuple(  # type: ignore[attr-defined]
        PlateContact(name, c.start, c.end)
        for c in right.contacts  # type: ignore[attr-defined]
        for name in "ab"
    )
    assert find_mass(grounds, strides, None, None).mass == pytest.approx(MASS, rel=0.002)


def test_forces_in_another_unit_are_no_mass() -> None:
    grounds, strides = walk()
    for ground in grounds.values():
        ground.plates = {n: (t, 1e-3 * f) for n, (t, f) in ground.plates.items()}  # type: ignore[attr-defined]
    with pytest.raises(InputError, match=r"the plates carry 0\.07 kg: forces in another unit"):
        find_mass(grounds, strides, None, None)
    assert "by the plates it is 0.1 kg" in find_mass(grounds, strides, 70.0, None).warnings[0]


@pytest.mark.parametrize("later", [False, True])
@pytest.mark.parametrize(("quiet", "told"), [(0.12, True), (0.08, False)])
def test_a_plates_offset_is_what_it_reads_0_1_s_from_any_contact(
    quiet: float, told: bool, later: bool
) -> None:
    """Nearer, a foot sets down: there it reads 15 N; what it reads for less than 0.1 s shows nothing."""
    start, end = (0.05, 0.75) if later else (quiet + 0.1, quiet + 0.8)
    time = np.arange(0.0, 0.85 + quiet, 0.001)
    force = np.where((time < start - 0.1) | (time > end + 0.1), 8.0, 15.0)
    force = np.where((time > start) & (time < end), 700.0, force)
    ground = SimpleNamespace(
        time=time,
        force_z=force,
        foreign=(PlateContact("1", start, end),),
        contacts=(PlateContact("2", 0.0, 1.0),),
        plates={"1": (time, force)},
    )
    found = find_mass({"right": ground}, [], 70.0, None)  # type: ignore[dict-item]
    offsets = [notice.data["force"] for notice in found.notices if notice.code == "plate-offset-in-mass"]
    assert offsets == ([8.0] if told else [])


@pytest.mark.parametrize(("share", "refused"), [(0.72, True), (0.78, False), (1.22, False), (1.28, True)])
@pytest.mark.parametrize("how", ["given", "of the file"])
def test_a_mass_that_the_plates_contradict_is_refused(share: float, refused: bool, how: str) -> None:
    """More than 25 % off either way; what one leg carries, or no plate, contradicts none."""
    mass = BodyMass(share * MASS, how, MASS)
    with pytest.raises(InputError) if refused else nullcontext() as caught:
        _require_mass(mass)
    if caught is not None:
        assert caught.value.field == "mass"
    for vague in (replace(mass, one_leg=True), replace(mass, estimated=None)):
        _require_mass(vague)
