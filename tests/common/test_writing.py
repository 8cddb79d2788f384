"""Files and groups of files: old or new, never half; permissions by the umask; refusals in a sentence."""

import errno
import json
import math
import os
import pathlib
import stat
import subprocess
import sys

import pytest

from afo_sim.common import InputError, writing


@pytest.mark.parametrize("umask", [0o022, 0o077, 0o002])
def test_permissions_follow_the_umask(tmp_path: pathlib.Path, umask: int) -> None:
    before = os.umask(umask)
    try:
        writing.write_text(tmp_path / "one.txt", "1")
        with writing.together(tmp_path / "group") as scratch:
            (scratch / "two.txt").write_text("2")
        with writing.together(tmp_path / "group") as scratch:
            writing.write_text(scratch / "three.txt", "3")
    finally:
        os.umask(before)
    for name in ("one.txt", "group/two.txt", "group/three.txt"):
        assert stat.S_IMODE((tmp_path / name).stat().st_mode) == 0o666 & ~umask
    assert stat.S_IMODE((tmp_path / "group").stat().st_mode) == 0o777 & ~umask


def test_what_fails_in_the_block_leaves_the_old_and_nothing_else(tmp_path: pathlib.Path) -> None:
    writing.write_text(tmp_path / "a.txt", "old")
    with pytest.raises(ZeroDivisionError), writing.replacing(tmp_path / "a.txt") as path:
        path.write_text("half")
        raise ZeroDivisionError
    with pytest.raises(ZeroDivisionError), writing.together(tmp_path) as scratch:
        (scratch / "a.txt").write_text("half")
        raise ZeroDivisionError
    with pytest.raises(ZeroDivisionError), writing.together(tmp_path / "fresh") as scratch:
        (scratch / "a.txt").write_text("half")
        raise ZeroDivisionError
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == "old"


def test_group_replaces_its_own_and_keeps_what_is_not(tmp_path: pathlib.Path) -> None:
    group = ("a", "b", "sub/c")
    with writing.together(tmp_path, group) as scratch:
        for name in group:
            (scratch / name).parent.mkdir(exist_ok=True)
            (scratch / name).write_text("old")
    (tmp_path / "mine").write_text("note")
    with writing.together(tmp_path, group) as scratch:
        (scratch / "a").write_text("new")
    found = {p.relative_to(tmp_path).as_posix(): p.read_text() for p in tmp_path.rglob("*") if p.is_file()}
    assert found == {"a": "new", "mine": "note"}


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (errno.ENOSPC, "the disk is full"),
        (errno.EDQUOT, "the disk is full"),
        (errno.EACCES, "no permission"),
        (errno.EROFS, "read-only"),
    ],
)
def test_refusals_are_a_sentence_with_the_file(tmp_path: pathlib.Path, code: int, words: str) -> None:
    for write in (writing.replacing, writing.together):
        with pytest.raises(InputError, match=words) as caught, write(tmp_path / "x"):
            raise OSError(code, os.strerror(code))
        assert caught.value.file == tmp_path / "x"
    assert not list(tmp_path.iterdir())


def test_symlinks_in_a_circle_and_files_in_the_way_are_refused(tmp_path: pathlib.Path) -> None:
    (tmp_path / "a").symlink_to(tmp_path / "b")
    (tmp_path / "b").symlink_to(tmp_path / "a")
    (tmp_path / "file").write_text("in the way")
    for folder in (tmp_path / "a", tmp_path / "a" / "x", tmp_path / "file", tmp_path / "file" / "x"):
        with pytest.raises(InputError), writing.together(folder) as scratch:
            (scratch / "x").write_text("1")
        with pytest.raises(InputError):
            writing.write_text(folder / "x", "1")
        with pytest.raises(InputError):
            writing.check_writable(folder)
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError, match="is a folder"):
        writing.write_text(tmp_path / "folder", "1")
    with pytest.raises(InputError, match="is a folder"), writing.together(tmp_path) as scratch:
        (scratch / "folder").write_text("1")
    assert (tmp_path / "file").read_text() == "in the way"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b", "file", "folder"]


def test_json_has_null_for_what_is_not_finite() -> None:
    text = writing.json_text({"a": [math.nan, (math.inf, 1.5)], "ä": -math.inf})
    assert json.loads(text) == {"a": [None, [None, 1.5]], "ä": None}


def test_json_has_paths_of_any_bytes() -> None:
    path = {"file": os.fsdecode(b"ren\xe9.toml")}
    assert json.loads(writing.json_text(path).encode("utf-8")) == path


def test_a_name_is_on_the_disk_when_its_writer_goes_on(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    held: list[tuple[int, set[str]]] = []  # folder, its names when it was flushed

    def fsync(number: int) -> None:
        if stat.S_ISDIR(os.fstat(number).st_mode):
            held.append((os.fstat(number).st_ino, set(os.listdir(number))))

    monkeypatch.setattr(writing.os, "fsync", fsync)
    writing.write_text(tmp_path / "one", "1")
    assert held.pop() == (tmp_path.stat().st_ino, {"one"})
    for names in ({"a", "b"}, {"a", "c"}):  # a folder that is new, and one that is there
        with writing.together(tmp_path / "group", ("a", "b", "c")) as scratch:
            for name in names:
                (scratch / name).write_text(name)
        folders = {(tmp_path / "group").stat().st_ino, tmp_path.stat().st_ino}
        assert any(folder in folders and names <= found | {"group"} & names for folder, found in held)
        assert ((tmp_path / "group").stat().st_ino, names) in [(f, n & {"a", "b", "c"}) for f, n in held]


# A process that is killed at its n-th step of writing: just before a call that changes the disk.
KILLED = """
import os, pathlib, signal, sys
from afo_sim.common import writing
folder, kill_at, count = pathlib.Path(sys.argv[1]), int(sys.argv[2]), 0

def step(event, details):
    global count
    if event in ("os.mkdir", "os.rename", "os.remove", "os.rmdir", "open"):
        if event == "open" and not (isinstance(details[2], int) and details[2] & (os.O_WRONLY | os.O_RDWR)):
            return
        count += 1
        if count == kill_at:
            os.kill(os.getpid(), signal.SIGKILL)

sys.addaudithook(step)
with writing.together(folder, ("a", "b", "c")) as scratch:
    for name in ("a", "b"):
        (scratch / name).write_text("new" * 1000)
print(count)
"""


@pytest.mark.slow
@pytest.mark.parametrize("exists", [True, False])
def test_killed_at_any_step_it_leaves_old_or_new(tmp_path: pathlib.Path, exists: bool) -> None:
    old = {"a": "old", "c": "old"} if exists else {}
    new = {"a": "new" * 1000, "b": "new" * 1000}
    seen = {"old": 0, "new": 0}
    for kill_at in range(1, 100):
        folder = tmp_path / str(kill_at) / "group"
        if exists:
            folder.mkdir(parents=True)
            for name, text in old.items():
                (folder / name).write_text(text)
        command = [sys.executable, "-c", KILLED, str(folder), str(kill_at)]
        done = subprocess.run(command, capture_output=True, text=True)
        writing.settle(folder)
        there = {p.name: p.read_text() for p in folder.glob("[!.]*")} if folder.is_dir() else {}
        assert there in (old, new), (kill_at, sorted(there))
        seen["old" if there == old else "new"] += 1
        if done.returncode == 0:
            break
        writing._remove_leftovers.cache_clear()
        with writing.together(folder, ("a", "b", "c")) as scratch:
            (scratch / "a").write_text("again")
        hidden = [path.name for path in folder.parent.rglob(".*")]
        assert hidden == [], kill_at  # the next writing removes what the killed process left
    assert done.returncode == 0
    assert seen["old"] > 3 and seen["new"] >= 1 + exists * 3, seen
