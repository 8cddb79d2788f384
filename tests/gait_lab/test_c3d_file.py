"""C3D files of all processors and kinds, and files that contradict themselves, written byte by byte."""

import dataclasses
import pathlib
import random
from typing import Any

import numpy as np
import pytest
from c3d_bytes import BLOCK, DEC, INTEL, MIPS, C3dBytes
from c3d_plates import ORIGIN, channels, turned, write
from gait_lab.c3d_writer import write_c3d
from gait_lab.laboratory import Laboratory
from real_trials import C3D

from afo_sim.common import InputError, with_code
from afo_sim.gait_lab import Choices, import_gait
from afo_sim.gait_lab.readers.c3d import read_c3d
from afo_sim.gait_lab.readers.c3d_file import C3dFile, read_c3d_file

RATE, FRAMES, SAMPLES, CHANNELS = 60.0, 40, 17, 5
PROCESSORS = {"Intel": INTEL, "DEC": DEC, "MIPS": MIPS}
KINDS = [(name, floating) for name in PROCESSORS for floating in (True, False)]


def recorded(**more: Any) -> C3dBytes:
    """Points, one lost for a while, and channels with scales, offsets and a general scale."""
    dice = np.random.default_rng(5)
    file = C3dBytes(RATE, dice.uniform(-900.0, 900.0, (FRAMES, 3, 3)), first=21, **more)
    file.residuals = np.zeros((FRAMES, 3))
    file.residuals[5:9, 1] = -1.0
    file.analogs = dice.uniform(-300.0, 300.0, (FRAMES * SAMPLES, CHANNELS))
    scales = np.array([0.1, 0.02, -0.05, 0.1, 1.0])
    file.parameters["ANALOG"] = {"GEN_SCALE": [0.5], "SCALE": scales, "OFFSET": np.array([0, 7, -9, 0, 0])}
    return file


def contradictions(file: C3dFile) -> dict[str, float]:
    """What a file states twice and otherwise: what was taken."""
    return {notice.subject: notice.data["taken"] for notice in with_code(file.notices, "c3d-contradicts")}


def read(file: C3dBytes, folder: pathlib.Path) -> C3dFile:
    return read_c3d_file(file.write(folder / "a.c3d"))


def assert_read(found: C3dFile, file: C3dBytes) -> None:
    """The written numbers: floats to 24 bits, whole ones to half a unit."""
    points = 1e-4 if file.floating else 0.5001 * file.scale
    seen = (file.residuals if file.residuals is not None else np.zeros(file.points.shape[:2])) >= 0.0
    assert np.array_equal(np.isfinite(found.points).all(axis=2), seen)
    assert np.abs(found.points - file.points)[seen].max(initial=0.0) < points
    count = file.analogs.shape[1]
    error = np.abs(found.analogs(np.arange(count))[0] - file.analogs)
    assert (error <= (5e-5 if file.floating else 0.501 * np.abs(found.analogs(np.arange(count))[1]))).all()


@pytest.mark.parametrize(("name", "floating"), KINDS)
def test_each_processor_and_kind_comes_back(tmp_path: pathlib.Path, name: str, floating: bool) -> None:
    file = recorded(processor=PROCESSORS[name], floating=floating)
    found = read(file, tmp_path)
    assert_read(found, file)
    assert (found.layout.frame_rate, found.layout.first_frame) == (RATE, 21)
    assert found.words.shape == (FRAMES, SAMPLES, CHANNELS)
    assert not found.notices


@pytest.mark.parametrize(("name", "floating"), [kind for kind in KINDS if kind[0] != "MIPS"])
def test_ezc3d_reads_the_same(tmp_path: pathlib.Path, name: str, floating: bool) -> None:
    ezc3d = pytest.importorskip("ezc3d")
    file = recorded(processor=PROCESSORS[name], floating=floating)
    file.parameters["ANALOG"]["OFFSET"][2] = 9  # it takes a negative one's amount
    assert_as_ezc3d(ezc3d, file.write(tmp_path / "a.c3d"))


@pytest.mark.parametrize("file", ["walking5.c3d", "test_walking.c3d"])
def test_ezc3d_reads_real_trials_the_same(file: str) -> None:
    ezc3d = pytest.importorskip("ezc3d")
    if not (C3D / file).exists():
        pytest.skip("the public trials are not here")
    assert_as_ezc3d(ezc3d, C3D / file)


def assert_as_ezc3d(ezc3d: Any, path: pathlib.Path) -> None:
    """Points, channels and parameters to each bit of a float."""
    found, other = read_c3d_file(path), ezc3d.c3d(str(path))
    points = other["data"]["points"][:3].transpose(2, 1, 0).astype(np.float32)
    assert np.array_equal(found.points, points, equal_nan=True)
    analogs = found.analogs(np.arange(found.layout.channels))[0].T.astype(np.float32)
    assert np.array_equal(analogs, other["data"]["analogs"][0].astype(np.float32))
    assert found.layout.first_frame - 1 == other["header"]["points"]["first_frame"]
    for group, parts in found.groups.items():
        for name in parts:
            theirs = other["parameters"][group][name]
            if theirs["type"] == -1:
                assert [text.strip() for text in theirs["value"]] == list(parts[name].values), (group, name)
            else:
                values = np.ravel(theirs["value"], order="F")
                assert np.array_equal(values, parts[name].values), (group, name)


@pytest.mark.parametrize("processor", PROCESSORS.values(), ids=PROCESSORS)
def test_unsigned_channels(tmp_path: pathlib.Path, processor: int) -> None:
    """Above 32767 without a sign, and an offset in the middle of the range."""
    file = C3dBytes(RATE, np.ones((FRAMES, 1, 3)), floating=False, processor=processor)
    file.analogs = np.linspace(-3200.0, 3200.0, FRAMES)[:, None]
    file.parameters["ANALOG"] = {"SCALE": [0.1], "OFFSET": np.array([32768]), "FORMAT": ["UNSIGNED"]}
    assert_read(read(file, tmp_path), file)


def test_parameters_of_all_kinds(tmp_path: pathlib.Path) -> None:
    """Seven dimensions, 300 texts, a record of more than 32767 bytes, a locked one, a late section."""
    seven = np.arange(128.0).reshape((2,) * 7)
    file = recorded(parameter_block=5)
    texts = [f"{k} " + "x" * 140 for k in range(300)]
    file.parameters["OWN"] = {"SEVEN": seven, "TEXTS": texts, "LOCKED": np.array([-7, 8]), "NONE": []}
    content = file.content()
    assert content.count(b"\x06\x03LOCKED") == 1
    path = tmp_path / "a.c3d"
    path.write_bytes(content.replace(b"\x06\x03LOCKED", b"\xfa\x03LOCKED"))
    found = read_c3d_file(path)
    assert_read(found, file)
    assert np.array_equal(found.numbers("OWN", "SEVEN"), seven.ravel(order="F"))
    assert found.groups["OWN"]["SEVEN"].shape == (2,) * 7
    assert found.texts("OWN", "TEXTS") == texts
    assert found.numbers("own", "locked").tolist() == [-7.0, 8.0]
    assert not found.texts("OWN", "NONE") and not found.texts("NO", "SUCH")


MANY = 66_500
SAID = {  # where a file of more than 65,535 frames says how many they are
    "its size alone": {},
    "LONG_FRAMES": {"POINT": {"LONG_FRAMES": [float(MANY)]}},
    "FRAMES as a float": {"POINT": {"FRAMES": [float(MANY)]}},
    "FRAMES as two words": {"POINT": {"FRAMES": np.array([MANY & 0xFFFF, MANY >> 16])}},
    "FRAMES of -1": {"POINT": {"FRAMES": np.array([-1])}},
    "a trial's fields": {
        "TRIAL": {"ACTUAL_START_FIELD": np.array([1, 0]), "ACTUAL_END_FIELD": np.array([MANY & 0xFFFF, 1])}
    },
}


@pytest.mark.parametrize("said", SAID)
def test_more_frames_than_the_header_can_say(tmp_path: pathlib.Path, said: str) -> None:
    points = np.arange(3.0 * MANY).reshape(MANY, 1, 3) % 4999.0 + 1.0
    file = C3dBytes(100.0, points, parameters={group: dict(parts) for group, parts in SAID[said].items()})
    found = read(file, tmp_path)
    assert np.array_equal(found.points, points)
    assert contradictions(found) == ({"frames": MANY} if said in ("its size alone", "FRAMES of -1") else {})
    file.header[5] = MANY & 0xFFFF  # a header that has overflowed instead
    found = read(file, tmp_path)
    assert np.array_equal(found.points, points)
    assert contradictions(found)["frames"] == MANY


HEADER_SAYS = {  # a word of the header: what is taken in spite of it
    (2, 4): {"points": 3},
    (3, 80): {"analog numbers": SAMPLES * CHANNELS},
    (4, 20): {"frames": FRAMES},
    (5, 59): {"frames": FRAMES},
    (9, 4): {"first block": 3},
    (10, 5): {"samples a frame": SAMPLES},
}


@pytest.mark.parametrize(("word", "value"), HEADER_SAYS)
def test_a_header_that_the_file_refutes(tmp_path: pathlib.Path, word: int, value: int) -> None:
    file = recorded(header={word: value})
    found = read(file, tmp_path)
    assert_read(found, file)
    assert contradictions(found) == HEADER_SAYS[word, value]


def test_a_header_whose_frame_rate_is_0_leaves_it_to_the_parameters(tmp_path: pathlib.Path) -> None:
    file = dataclasses.replace(recorded(), rate=0.0)
    file.parameters["POINT"] = file.parameters.get("POINT", {}) | {"RATE": [RATE]}
    file.parameters["ANALOG"] = file.parameters.get("ANALOG", {}) | {"RATE": [RATE * SAMPLES]}
    found = read(file, tmp_path)
    assert_read(found, file)
    assert (found.layout.frame_rate, found.layout.samples_a_frame) == (RATE, SAMPLES)


PARAMETERS_SAY: dict[str, tuple[str, str, Any, dict[str, float]]] = {  # and what is taken in spite of it
    "ANALOG:USED of 0": ("ANALOG", "USED", np.array([0]), {"channels": CHANNELS}),
    "no ANALOG:USED": ("ANALOG", "USED", None, {}),
    "another ANALOG:RATE": ("ANALOG", "RATE", [1000.0], {"analog rate": RATE * SAMPLES}),
    "no ANALOG:RATE": ("ANALOG", "RATE", None, {}),
    "one point more": ("POINT", "USED", np.array([4]), {"points": 3}),
    "another first block": ("POINT", "DATA_START", np.array([4]), {"first block": 3}),
    "fewer frames": ("POINT", "FRAMES", np.array([30]), {"frames": FRAMES}),
    "whole numbers": ("POINT", "SCALE", [0.1], {"scale": -0.1}),
    "another frame rate": ("POINT", "RATE", [50.0], {"frame rate": RATE}),
    "a frame rate's name": ("POINT", "RATE", [59.94], {"frame rate": RATE}),
}


@pytest.mark.parametrize("name", PARAMETERS_SAY)
def test_parameters_that_the_file_refutes(tmp_path: pathlib.Path, name: str) -> None:
    group, parameter, value, taken = PARAMETERS_SAY[name]
    file = recorded()
    file.parameters.setdefault(group, {})[parameter] = value
    found = read(file, tmp_path)
    assert_read(found, file)
    assert contradictions(found) == pytest.approx(taken)
    assert all(notice.severity == ("note" if "name" in name else "warning") for notice in found.notices)
    assert found.layout.frame_rate == RATE


def test_a_walk_whose_header_knows_its_samples(tmp_path: pathlib.Path) -> None:
    """17 samples a frame at 60 Hz, said to be 1000 Hz: the walk is that of the file that says 1020 Hz."""
    laboratory = Laboratory(rate=60.0, plate_rate=1020.0)

    def imported(*rate: float) -> np.ndarray:
        def change(file: C3dBytes) -> None:
            file.parameters["ANALOG"] |= {"RATE": list(rate), "USED": np.array([0])} if rate else {}

        points, plates = laboratory.markers("plug-in gait"), laboratory.plates("feet")
        file = write_c3d(tmp_path / "walk.c3d", laboratory.time, points, plates, change=change)
        done = import_gait([file], Choices())
        assert bool(with_code(done.warnings, "c3d-contradicts")) is bool(rate)
        return done.cycle.ankle_moment

    assert np.array_equal(imported(), imported(1000.0))


OVERFLOWS = {  # whole numbers, channel, its scale: a moment [N·mm], and a force [N] that passes 32767 once
    "a float's moment": (True, 3, 0.1),
    "a moment": (False, 3, 0.1),
    "a force": (False, 2, 0.02),
}


@pytest.mark.parametrize("name", OVERFLOWS)
def test_a_channel_that_overflowed_is_put_together(tmp_path: pathlib.Path, name: str) -> None:
    """In 16 bits, some times over: the force and its place come back."""
    floating, channel, scale = OVERFLOWS[name]
    signal = channels(2, turned(20.0), ORIGIN, 1e-3)
    scales = np.array([0.01, 0.01, 0.05, 10.0, 10.0, 1.0])
    scales[channel] = scale

    def change(file: C3dBytes) -> None:
        wrapped = (np.round(file.analogs[:, channel] / scale) + 32768) % 65536 - 32768
        file.analogs[:, channel] = scale * wrapped
        file.floating = floating
        file.parameters["ANALOG"]["SCALE"] = scales

    def plate(folder: str, done: Any) -> Any:
        (tmp_path / folder).mkdir()
        return read_c3d(write(tmp_path / folder / "a.c3d", [signal], [2], [turned(20.0)], change=done))[1][0]

    def whole(file: C3dBytes) -> None:
        file.parameters["ANALOG"]["SCALE"] = scales

    sound, found = plate("sound", whole), plate("wrapped", change)
    (notice,) = with_code(found.notices, "plate-overflow-mended")
    assert (notice.subject, notice.data["channel"]) == ("1", f"C{channel}")
    pressed = np.abs(sound.force[:, 2]) > 100.0
    assert np.abs(found.force - sound.force).max() < 0.2
    assert np.abs(found.place - sound.place)[pressed].max() < 1e-3
    assert not with_code(sound.notices, "plate-overflow-mended")


def test_an_overflow_that_is_not_clear_is_doubted(tmp_path: pathlib.Path) -> None:
    """Steps of a third of 16 bits and more may be two ways."""
    signal = channels(2, turned(0.0), ORIGIN, 1e-3)

    def change(file: C3dBytes) -> None:
        file.analogs[:, 3] = (np.round(file.analogs[:, 3] * 60.0) + 32768) % 65536 - 32768

    _, (plate,) = read_c3d(write(tmp_path / "a.c3d", [signal], [2], [turned(0.0)], change=change))
    assert [notice.subject for notice in with_code(plate.warnings, "plate-overflow")] == ["1"]


@pytest.mark.parametrize("size", [100.0, 3000.0])
def test_an_overflow_that_was_scaled_since_is_doubted(tmp_path: pathlib.Path, size: float) -> None:
    """Nothing in the file says where it turned over."""
    signal = channels(2, turned(20.0), ORIGIN, 1e-3)
    wrapped = signal.copy()
    reach = 0.3 * np.abs(signal[:, 3]).max()
    wrapped[:, 3] = (signal[:, 3] + reach) % (2.0 * reach) - reach

    def change(file: C3dBytes) -> None:
        file.floating = True
        file.analogs = file.analogs * size

    _, (plate,) = read_c3d(write(tmp_path / "a.c3d", [wrapped], [2], [turned(20.0)], change=change))
    (notice,) = with_code(plate.warnings, "plate-overflow")
    assert notice.data["channel"] == "C3" and notice.data["high"] == pytest.approx(size * reach, rel=0.1)


def test_a_sample_that_dropped_out_is_doubted_not_put_together(tmp_path: pathlib.Path) -> None:
    signal = channels(2, turned(0.0), ORIGIN, 1e-3)

    def change(file: C3dBytes) -> None:
        file.parameters["ANALOG"]["SCALE"] = np.full(6, 0.01)
        file.analogs[900, 2] = -327.68

    _, (plate,) = read_c3d(write(tmp_path / "a.c3d", [signal], [2], [turned(0.0)], change=change))
    assert not with_code(plate.warnings, "plate-overflow-mended")


@pytest.mark.parametrize(("kind", "used"), [(5, 2), (0, 2), (2, 0)])
def test_a_walk_without_readable_plates_says_why(tmp_path: pathlib.Path, kind: int, used: int) -> None:
    laboratory = Laboratory()

    def change(file: C3dBytes) -> None:
        group = file.parameters["FORCE_PLATFORM"]
        group["TYPE"][:], group["USED"][:] = kind, used

    points, plates = laboratory.markers("plug-in gait"), laboratory.plates("feet")
    file = write_c3d(tmp_path / "walk.c3d", laboratory.time, points, plates, change=change)
    with pytest.raises(InputError) as caught:
        import_gait([file], Choices())
    said = {(5, 2): ("plate 1", "plate 2", "type is 5"), (0, 2): ("not stated",), (2, 0): ("12 analog",)}
    assert all(words in str(caught.value) for words in said[kind, used])
    assert "no file holds ground forces" not in str(caught.value)


def test_more_than_there_is_is_refused_before_memory_is_taken(tmp_path: pathlib.Path) -> None:
    """65,535 frames of 65,535 points are 69 GB."""
    header = {2: 65535, 3: 65535, 5: 65534}
    file = recorded(header=header)
    file.parameters["POINT"] = {"USED": np.array([65535]), "FRAMES": np.array([65534])}
    with pytest.raises(InputError, match=r"is cut short or damaged: it has \d+ bytes of \d{11}"):
        read(file, tmp_path)


@pytest.mark.parametrize(("name", "floating"), KINDS)
def test_blocks_of_zeros_in_the_frames_are_told(tmp_path: pathlib.Path, name: str, floating: bool) -> None:
    """Where frames have numbers before and after; points that are never seen, as zeros too, are no holes."""
    points = np.random.default_rng(2).uniform(100.0, 900.0, (300, 60, 3))
    points[:, 20:] = 0.0
    file = C3dBytes(100.0, points, processor=PROCESSORS[name], floating=floating)
    content, path = bytearray(file.content()), tmp_path / "a.c3d"
    start = len(content) - len(points) * 240 * (4 if floating else 2) // BLOCK * BLOCK
    assert not read(file, tmp_path).notices
    for at in (start + 40 * BLOCK, start + 80 * BLOCK):
        content[at : at + 3 * BLOCK] = bytes(3 * BLOCK)
    path.write_bytes(content)
    (notice,) = with_code(read_c3d_file(path).notices, "c3d-zeros")
    assert notice.data["count"] == 2


def test_parameters_that_break_off_are_refused(tmp_path: pathlib.Path) -> None:
    """A zero where a record begins would end them, and the plates' group would be lost without a word."""
    file = recorded()
    file.parameters["FORCE_PLATFORM"] = {"USED": np.array([0])}
    content, path = file.content(), tmp_path / "a.c3d"
    for group, record in (("ANALOG", b"\x06\xfeANALOG"), ("FORCE_PLATFORM", b"\x0e\xfdFORCE_PLATFORM")):
        assert content.count(record) == 1
        start = content.index(record) - 2 * len(record)  # in the record before
        path.write_bytes(content[:start] + bytes(2 * len(record)) + content[start + 2 * len(record) :])
        with pytest.raises(InputError, match=f"is damaged: .*({group}|record|is none)"):
            read_c3d_file(path)


def damaged(content: bytes, dice: random.Random) -> bytes:
    """One to four bytes changed, the end cut off, blocks of zeros, or two blocks exchanged."""
    found, blocks = bytearray(content), len(content) // BLOCK
    how = dice.choice(("bytes", "bytes", "cut", "zeros", "blocks"))
    if how == "bytes":
        for _ in range(dice.randint(1, 4)):
            found[dice.randrange(dice.choice((24, 4 * BLOCK, len(found))))] = dice.randrange(256)
    elif how == "cut":
        del found[dice.randrange(len(found)) :]
    elif how == "zeros":
        start = BLOCK * dice.randrange(blocks)
        found[start : start + BLOCK] = bytes(BLOCK)
    else:
        a, b = (slice(BLOCK * k, BLOCK * k + BLOCK) for k in dice.sample(range(blocks), 2))
        found[a], found[b] = found[b], found[a]
    return bytes(found)


@pytest.mark.parametrize(("name", "floating"), KINDS)
def test_damage_is_a_sentence_or_changes_no_more_than_its_own_numbers(
    tmp_path: pathlib.Path, name: str, floating: bool
) -> None:
    """No other error, and no layout but the sound file's without a notice."""
    file, path = recorded(processor=PROCESSORS[name], floating=floating), tmp_path / "a.c3d"
    content = file.content()
    layout = read(file, tmp_path).layout
    for seed in range(100):
        path.write_bytes(damaged(content, random.Random(f"{name} {floating} {seed}")))
        try:
            found = read_c3d_file(path)
        except InputError as error:
            assert "\n" not in str(error) and error.allowed
            continue
        assert found.layout == layout or found.notices, seed
