"""The cache folder: where it is, what comes back from it, and what it does where it cannot be used."""

import errno
import os
import pathlib
import subprocess
import sys
import threading

import pytest

from afo_sim.common import user_cache

TWO_WRITERS = """
import sys
from afo_sim.common import user_cache
letter = sys.argv[1].encode()
print("ready", flush=True)
sys.stdin.readline()
for _ in range(40):
    user_cache.write("kind", "key", letter * 300_000)
"""

HOLDER = """
from afo_sim.common import user_cache
with user_cache.locked():
    print("in", flush=True)
    input()
"""


@pytest.fixture
def cache(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> pathlib.Path:
    folder = tmp_path / "deep" / "cache"
    monkeypatch.setenv(user_cache.VARIABLE, str(folder))
    return folder


def test_what_is_written_comes_back(cache: pathlib.Path) -> None:
    assert user_cache.read("kind", "key") is None
    user_cache.write("kind", "key", b"one")
    user_cache.write("kind", "other", b"two")
    assert user_cache.read("kind", "key") == b"one"
    user_cache.write("kind", "key", b"")
    assert user_cache.read("kind", "key") == b""
    assert user_cache.read("kind", "other") == b"two"


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such modes")
def test_folder_is_the_users_alone(cache: pathlib.Path) -> None:
    user_cache.write("kind", "key", b"one")
    assert cache.stat().st_mode & 0o777 == 0o700


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such modes")
@pytest.mark.parametrize("whose", ["group", "others", "another user", "a link"])
def test_folder_of_others_is_passed_over(
    cache: pathlib.Path, monkeypatch: pytest.MonkeyPatch, whose: str
) -> None:
    """What stands in it would be run."""
    user_cache.write("kind", "key", b"content")
    if whose == "another user":
        stranger = os.getuid() + 1
        monkeypatch.setattr(os, "getuid", lambda: stranger)
    elif whose == "a link":
        cache.rename(cache.with_name("elsewhere"))
        cache.symlink_to("elsewhere")
    else:
        cache.chmod(0o770 if whose == "group" else 0o707)
    user_cache._warn.cache_clear()
    with pytest.warns(UserWarning, match="the cache folder .* is not used") as told:
        assert user_cache.read("kind", "key") is None
        user_cache.write("kind", "other", b"content")
    assert len(told) == 1 and told[0].message.args[0].code == "cache-not-private"
    assert [path.name for path in cache.iterdir()] == ["kind-key"]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such locks")
def test_a_process_waits_until_the_other_is_done_or_dead(
    cache: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    holder = subprocess.Popen([sys.executable, "-c", HOLDER], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert holder.stdout and holder.stdout.readline() == b"in\n"
    entered = threading.Event()

    def enter() -> None:
        with user_cache.locked():
            entered.set()

    waiting = threading.Thread(target=enter)
    waiting.start()
    assert not entered.wait(0.5)
    with monkeypatch.context() as hurry:
        hurry.setattr(user_cache, "PATIENCE", 0.0)
        with user_cache.locked():  # nobody waits for ever
            assert not entered.is_set()
    holder.kill()
    holder.communicate()
    assert entered.wait(60.0)
    waiting.join()


@pytest.mark.parametrize(
    "damage",
    [lambda b: b"", lambda b: b[:20], lambda b: b[:-1], lambda b: b[:-1] + b"x", lambda b: b + b"x"],
    ids=["empty", "in the checksum", "short", "changed", "long"],
)
def test_damaged_file_is_not_read_and_is_replaced(cache: pathlib.Path, damage: object) -> None:
    user_cache.write("kind", "key", b"content")
    path = cache / "kind-key"
    path.write_bytes(damage(path.read_bytes()))  # type: ignore[operator]
    assert user_cache.read("kind", "key") is None
    user_cache.write("kind", "key", b"content")
    assert user_cache.read("kind", "key") == b"content"


def test_file_under_another_name_is_not_read(cache: pathlib.Path) -> None:
    user_cache.write("kind", "key", b"content")
    (cache / "kind-key").rename(cache / "kind-other")
    assert user_cache.read("kind", "other") is None


def test_eight_files_of_a_kind_stay(cache: pathlib.Path) -> None:
    cache.mkdir(parents=True)
    (cache / "holiday.jpg").write_bytes(b"somebody's")
    for n in range(9):
        user_cache.write("kind", str(n), b"content")
        os.utime(cache / f"kind-{n}", (1e9 + n, 1e9 + n))
        if n == 7:
            assert user_cache.read("kind", "0")  # in use: the newest
    assert sorted(path.name for path in cache.iterdir()) == [
        "holiday.jpg",
        *(f"kind-{n}" for n in (0, 2, 3, 4, 5, 6, 7, 8)),
    ]


def test_folder_that_cannot_be_made_is_passed_over(cache: pathlib.Path) -> None:
    cache.parent.write_bytes(b"a file where the folder should be")
    user_cache.write("kind", "key", b"content")
    assert user_cache.read("kind", "key") is None


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_read_only_folder_is_passed_over(cache: pathlib.Path) -> None:
    user_cache.write("kind", "key", b"content")
    cache.chmod(0o500)
    user_cache.write("kind", "other", b"content")
    assert user_cache.read("kind", "key") == b"content"
    assert user_cache.read("kind", "other") is None


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EACCES, errno.EROFS])
def test_disk_that_refuses_is_passed_over(
    cache: pathlib.Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    def refuse(path: pathlib.Path, content: bytes) -> int:
        raise OSError(number, os.strerror(number))

    user_cache.write("kind", "key", b"content")
    with monkeypatch.context() as disk:
        disk.setattr(pathlib.Path, "write_bytes", refuse)
        user_cache.write("kind", "key", b"new")
    assert user_cache.read("kind", "key") == b"content"
    assert [path.name for path in cache.iterdir()] == ["kind-key"]


def test_two_processes_write_at_once(cache: pathlib.Path) -> None:
    """Whoever reads meanwhile finds one of the two contents, whole."""
    user_cache.write("kind", "key", b"a" * 300_000)
    command = [sys.executable, "-c", TWO_WRITERS]
    writers = [
        subprocess.Popen([*command, letter], stdin=subprocess.PIPE, stdout=subprocess.PIPE) for letter in "ab"
    ]
    for writer in writers:
        assert writer.stdout and writer.stdin
        writer.stdout.readline()
    for writer in writers:
        assert writer.stdin
        writer.stdin.write(b"\n")
        writer.stdin.flush()
    while any(writer.poll() is None for writer in writers):
        assert user_cache.read("kind", "key") in (b"a" * 300_000, b"b" * 300_000)
    assert [writer.wait() for writer in writers] == [0, 0]
    assert [path.name for path in cache.iterdir()] == ["kind-key"]
    for writer in writers:
        writer.communicate()


@pytest.mark.parametrize("word", ["off", " OFF"])
def test_switched_off(monkeypatch: pytest.MonkeyPatch, tmp_path: pathlib.Path, word: str) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv(user_cache.VARIABLE, word)
    user_cache.write("kind", "key", b"content")
    assert user_cache.folder() is user_cache.read("kind", "key") is None
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("platform", "environment", "expected"),
    [
        ("linux", {}, "home/.cache/afo_sim"),
        ("linux", {"XDG_CACHE_HOME": "/elsewhere"}, "/elsewhere/afo_sim"),
        ("linux", {"XDG_CACHE_HOME": "relative"}, "home/.cache/afo_sim"),  # its standard: to be ignored
        ("darwin", {"XDG_CACHE_HOME": "/elsewhere"}, "home/Library/Caches/afo_sim"),
        ("win32", {"LOCALAPPDATA": "/local"}, "/local/afo_sim"),
        ("win32", {}, "home/AppData/Local/afo_sim"),
        ("linux", {"AFO_SIM_CACHE": "/mine", "XDG_CACHE_HOME": "/elsewhere"}, "/mine"),
        ("linux", {"AFO_SIM_CACHE": "~/mine"}, "home/mine"),
    ],
)
def test_place(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: pathlib.Path,
    platform: str,
    environment: dict[str, str],
    expected: str,
) -> None:
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA", user_cache.VARIABLE):
        monkeypatch.delenv(name, raising=False)
    for name, value in {"HOME": str(tmp_path / "home"), **environment}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(user_cache.sys, "platform", platform)
    assert user_cache.folder() == tmp_path / expected


def test_user_without_a_home(monkeypatch: pytest.MonkeyPatch) -> None:
    def none() -> pathlib.Path:
        raise RuntimeError("Could not determine home directory.")

    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA", user_cache.VARIABLE):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(pathlib.Path, "home", none)
    assert user_cache.folder() is None
    user_cache.write("kind", "key", b"content")
    assert user_cache.read("kind", "key") is None
