"""Clients that want to harm the studio: a process serves them, and somebody else's tab goes on."""

import concurrent.futures
import http.client
import json
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import sys
import time
import urllib.parse
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from campaign import sampled
from installed import needs
from served import Served, Tab
from websockets.exceptions import ConnectionClosed, InvalidStatus

pytestmark = [needs("uvicorn", "websockets"), pytest.mark.slow]
PRESSURE = "supply.pressure"
OWN_WORDS = re.compile(r"[A-Z]\w+Error|Errno|Traceback|NoneType|argument|has no attribute|pydantic|File \"")
CASES: dict[str, Callable[[str], object]] = {}


def said(address: str, *sent: str | bytes) -> list[str]:
    """What a tab is told that sends this: a problem each time."""
    with Tab.open(address) as tab:
        tab.until("document")
        found = []
        for each in sent:
            tab.socket.send(each)
            found.append(tab.until("problem", within=20)["text"])
    for text in found:
        assert text and not OWN_WORDS.search(text) and len(text) < 2000, text
    return found


def case(function: Callable[[str], None]) -> Callable[[str], None]:
    CASES[function.__name__] = function
    return function


def text_case(name: str, *sent: str | bytes) -> None:
    CASES[name] = lambda address: said(address, *sent)


def asks(op: Any, **more: Any) -> str:
    return json.dumps({"op": op, **more})


def change(value: str, key: str = PRESSURE) -> str:
    return f'{{"op": "change", "sets": {{"{key}": {value}}}}}'


# --- messages: (name, what is sent)
text_case("no JSON", "{", "", "hello", "\0")
text_case("no message", "[1]", "null", "3", '"undo"', "{}")
text_case("10,000 lists", "[" * 10_000, "[" * 10_000 + "]" * 10_000)
text_case("10,000 tables", '{"op":' * 10_000 + "1" + "}" * 10_000)
text_case("no number", change("NaN"), change("Infinity"), change("-Infinity"), change("1e999"))
text_case("a huge number", change("9" * 400), change("9" * 5000), change("-" + "9" * 100), change("1e308"))
text_case("half a character", change('"\\ud800"'), change('"\\udc00\\ud800"'), '{"op": "\\ud800"}')
text_case("an unknown op", asks("shutdown"), asks("__init__"), asks("x" * 50_000), asks("chnge"))
text_case("an op that is no word", asks(1), asks(None), asks([]), asks({"op": "undo"}), asks(True))
text_case("unknown keys", asks("undo", force=True), asks("save", path="/"), asks("keep", __class__="x"))
text_case(
    "sets of another type", asks("change", sets=[1]), asks("change", sets="x"), asks("change", sets=None)
)
text_case("values of another type", change("true"), change('{"a": 1}'), change("[[[1]]]"), change("[{}]"))
text_case("nothing to change", asks("change"), asks("change", sets={}), asks("change", sets={"": 1}))
text_case("10,000 keys", asks("change", sets={f"supply.k{k}": 1 for k in range(5_000)}))
text_case("a long key", change("1", "supply." + "a" * 100_000), change("1", "a\\nb"), change("1", "\\u0000"))
text_case("a long value", change('"' + "9" * 100_000 + '"'), change(json.dumps("x" * 150_000)))
text_case("a value with zeros", change('"a\\u0000b"', "patient"), change('"\\u001b[2J"', "patient"))
text_case("files of the system", change('"/dev/zero"', "orthosis.muscle.dorsiflexor.type"))
text_case("paths as names", change('"../../etc/passwd"', "patient"), change('"/proc/self/mem"', "shoe"))
text_case("keys of no control", change("1", "leg.file"), change("1", "gait.cycle"), change("1", "duration"))
text_case("10,000 intervals", change(json.dumps([[0.1, 0.2]] * 10_000), "phases.dorsiflexor.inlet"))
text_case(
    "times that are none", *(change(v, "phases.dorsiflexor.inlet") for v in ("[1]", '[["a", "b"]]', "7"))
)
text_case(
    "flags of another type", asks("change", sets={PRESSURE: 3}, join=1), change('3}, "follow": {"a": 1')
)
text_case(
    "a key of another type", asks("undo", key=5), asks("undo", key=["x"]), asks("undo", key="x" * 99_999)
)
text_case("zeros in a path", asks("save", folder="/tmp/a\0b"), asks("save", folder="\n"))
text_case("long paths", asks("save", folder="/tmp/" + "a" * 900), asks("save", folder="a/" * 50_000))
text_case("paths of the system", asks("save", folder="/dev/null"), asks("save", folder="/proc/1/x"))
text_case("folders that are files", asks("save", folder="/etc/passwd"), asks("save", folder="/etc/passwd/x"))
text_case("someone else's folder", asks("save", folder="/etc"), asks("save", folder="/"))
text_case("a path that is none", asks("save", folder=5), asks("save", folder=["x"]), asks("save", folder={}))
text_case("half a range", asks("search", keys={PRESSURE: [1]}), asks("search", keys={PRESSURE: []}))
text_case(
    "a range that is none", *(asks("search", keys={PRESSURE: v}) for v in (3, "ab", {"a": 1}, [1, [2]]))
)
text_case("nothing to search", asks("search"), asks("search", keys={}), asks("search", keys=[]))
text_case("1,000 ranges", asks("search", keys={f"supply.k{k}": [1, 2] for k in range(1_000)}))
text_case("an aim that is none", asks("search", keys={PRESSURE: [2, 3]}, objective=7))
text_case(
    "files elsewhere", *(asks("import", files=[n], walker="patient") for n in ("../x", "/etc/passwd", ".."))
)
text_case("files that are not there", asks("import", files=["x.c3d"], walker="patient"))
text_case("1,000 files", asks("import", files=["x"] * 1_000, walker="patient"), asks("import", files=[]))
text_case(
    "nobody's walk", asks("import", files=["x.c3d"], walker="x"), asks("import", files=["x"], side="up")
)
text_case("a variant that is none", asks("show", slot="D"), asks("remove", slot="C"), asks("rename", slot=0))
text_case("a long name", asks("rename", slot="A", name="x" * 99_999), asks("rename", slot="A", name=None))
text_case("frames of bytes", b"\x00\xff", b'{"op": "undo"}', b"")


# --- sockets


def knock(address: str, sent: bytes, seconds: float = 0.5) -> bytes:
    """What comes back for bytes."""
    with socket.create_connection(place(address), 20) as raw:
        raw.sendall(sent)
        raw.settimeout(seconds)
        try:
            return raw.recv(65536)
        except (TimeoutError, ConnectionError):
            return b""


def place(address: str) -> tuple[str, int]:
    url = urllib.parse.urlsplit(address)
    return str(url.hostname), int(url.port or 0)


def shaken(address: str) -> socket.socket:
    """A socket after its hand-shake, by bytes."""
    host, port = place(address)
    raw = socket.create_connection((host, port), 20)
    raw.sendall(
        f"GET {urllib.parse.urlsplit(address).path}socket HTTP/1.1\r\nHost: {host}:{port}\r\n"
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
        "Sec-WebSocket-Version: 13\r\n\r\n".encode()
    )
    assert b"101" in raw.recv(4096)
    return raw


def frame(first: int, content: bytes, masked: bool = True) -> bytes:
    size = bytes([128 * masked + 126]) + struct.pack("!H", len(content))
    return bytes([first]) + size + (b"\0\0\0\0" if masked else b"") + content


def frames(name: str, *sent: bytes) -> None:
    def send(address: str) -> None:
        for each in sent:
            with shaken(address) as raw:
                raw.sendall(each)
                time.sleep(0.2)

    CASES[name] = send


frames("a text that is none", frame(0x81, b"\xff\xfe\xfd"), frame(0x81, b'{"op": "\xff"}'))
frames("frames without a mask", frame(0x81, b"{}", masked=False))
frames("frames of no kind", frame(0x83, b"x"), frame(0xF1, b"x"), frame(0x80, b"x"))
frames("half a message", frame(0x01, b'{"op":'), frame(0x81, b"{}")[:5], b"\x81")
frames(
    "a close that is none", frame(0x88, b"\x00"), frame(0x88, b"\x03\xe8\xff\xff"), frame(0x88, b"\x00\x00")
)
frames("a frame of 2^62 bytes", b"\x81\xff" + struct.pack("!Q", 1 << 62))
frames("pings", frame(0x89, b"x" * 100) * 2_000)


@case
def a_message_of_5_megabytes(address: str) -> None:
    with pytest.raises(ConnectionClosed), Tab.open(address, max_size=None) as tab:
        tab.socket.send("x" * 5_000_000)
        while True:
            tab.until("document", within=20)


@case
def small_messages_that_unpack_to_large_ones(address: str) -> None:
    with pytest.raises(ConnectionClosed), Tab.open(address, compression="deflate") as tab:
        tab.socket.send(" " * 50_000_000)
        while True:
            tab.until("document", within=20)


@case
def a_tab_that_never_reads(address: str) -> None:
    with shaken(address) as raw:
        raw.settimeout(0.2)
        begun = time.monotonic()
        try:
            while time.monotonic() - begun < 8:
                raw.sendall(frame(0x81, asks("undo", key="x" * 9_000).encode()))
        except TimeoutError:  # it need not be heard
            pass


@case
def many_steps_at_once(address: str) -> None:
    with shaken(address) as raw:
        for op in ("undo", "redo", "keep", "bands", "stop", "report", "stop") * 20:
            raw.sendall(frame(0x81, asks(op).encode()))
        raw.sendall(frame(0x81, b"".join(b'{"op": "remove", "slot": "A"}' for _ in range(1))))
        time.sleep(1)


@case
def sockets_that_are_cut(address: str) -> None:
    for _ in range(30):
        raw = shaken(address)
        raw.sendall(frame(0x81, asks("undo").encode()))
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        raw.close()


@case
def a_hundred_tabs(address: str) -> None:
    open_ = [shaken(address) for _ in range(100)]
    time.sleep(0.5)
    for each in open_:
        each.close()
    time.sleep(0.5)


@case
def tabs_of_elsewhere(address: str) -> None:
    wrong = address.replace(address.split("/")[3], "x" * 32)
    for where, more in ((address, {"origin": "http://attacker.example"}), (wrong, {})):
        with pytest.raises(InvalidStatus), Tab.open(where, **more):
            pass


@case
def hands_that_are_not_shaken(address: str) -> None:
    path = urllib.parse.urlsplit(address).path
    for line in ("Sec-WebSocket-Version: 99", "Sec-WebSocket-Key: x", "Upgrade: websocket", ""):
        sent = f"GET {path}socket HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: Upgrade\r\n{line}\r\n\r\n"
        assert b"101" not in knock(address, sent.encode())[:20]


# --- requests


def request(address: str, method: str, path: str, body: Any = None, **headers: str) -> tuple[int, str]:
    asked = http.client.HTTPConnection(*place(address), timeout=20)
    try:
        whole = urllib.parse.urlsplit(address).path + path
        asked.request(method, whole, body, headers, encode_chunked=False)
        answer = asked.getresponse()
        return answer.status, answer.read().decode(errors="replace")
    finally:
        asked.close()


def refused(address: str, *rows: tuple[Any, ...], codes: tuple[int, ...] = (400, 403, 404, 405, 413)) -> None:
    for method, path, *more in rows:
        code, text = request(address, method, path, *more)
        assert code in codes and not OWN_WORDS.search(text), (method, path[:50], code, text[:300])


@case
def methods_that_are_not_meant(address: str) -> None:
    refused(address, *((m, "", b"x") for m in ("POST", "PUT", "DELETE", "PATCH", "TRACE", "BREW")))
    refused(address, ("GET", "files/x.c3d"), ("DELETE", "files/x"), ("POST", "socket", b"x"))


@case
def long_addresses(address: str) -> None:
    refused(address, ("GET", "a" * 50_000), ("GET", "a/" * 5_000), ("GET", "%2e%2e/" * 50 + "etc/passwd"))
    refused(address, ("GET", "%00"), ("GET", "%ff"), ("GET", "..%2f..%2fserver.py"), ("GET", "%5c..%5c"))


@case
def headers_that_are_none(address: str) -> None:
    path = urllib.parse.urlsplit(address).path.encode()
    for line in (
        b"X: \xff\xfe",
        b"Host: 127.0.0.1\xff",
        b"Host: evil",
        b"X: " + b"a" * 100_000,
        b": x",
        b"\0: x",
    ):
        found = knock(address, b"GET " + path + b" HTTP/1.1\r\nHost: 127.0.0.1\r\n" + line + b"\r\n\r\n")
        assert not OWN_WORDS.search(found.decode(errors="replace").partition("\r\n\r\n")[0])


@case
def addresses_of_elsewhere(address: str) -> None:
    for headers in ({"Host": "attacker.example"}, {"Origin": "null"}, {"Origin": "http://attacker.example"}):
        assert request(address, "GET", "", None, **headers)[0] == 403
        assert request(address, "PUT", "files/x.c3d", b"x", **headers)[0] == 403


@case
def requests_that_are_none(address: str) -> None:
    for sent in (
        b"\0" * 5_000,
        b"\x16\x03\x01\x02\x00\x01",
        b"GET\r\n\r\n",
        b"GET / HTTP/9.9\r\n\r\n",
        b"\r\n" * 999,
    ):
        assert b" 200 " not in knock(address, sent, 0.2)
    path = urllib.parse.urlsplit(address).path.encode()
    for length in (b"-1", b"x", b"99999999999999999999"):
        sent = (
            b"PUT "
            + path
            + b"files/a HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: "
            + length
            + b"\r\n\r\nx"
        )
        assert b" 200 " not in knock(address, sent, 0.2)


@case
def requests_that_never_end(address: str) -> None:
    idle = [socket.create_connection(place(address), 20) for _ in range(100)]
    for each in idle:
        each.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: ")
    time.sleep(1)
    for each in idle:
        each.close()


@case
def five_hundred_requests_at_once(address: str) -> None:
    path = urllib.parse.urlsplit(address).path
    assert knock(address, f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode() * 500)


@case
def names_of_files_that_are_none(address: str) -> None:
    for name in ("a" * 300, "%00", ".hidden", "..%00", "é" * 250, "a%0ab", "%2e%2e"):
        refused(address, ("PUT", f"files/{urllib.parse.quote(name, safe='%')}", b"x"))
    refused(
        address, ("PUT", "files/a%2fb", b"x"), ("PUT", "files/", b"x"), ("PUT", "files/..%2f..%2fx", b"x")
    )


@case
def a_hundred_files(address: str) -> None:
    codes = [request(address, "PUT", f"files/many{k}.c3d", b"x")[0] for k in range(100)]
    assert 40 <= codes.count(200) <= 50 and codes.count(413) == 100 - codes.count(200)


@case
def a_file_that_is_cut(address: str) -> None:
    host, port = place(address)
    path = urllib.parse.urlsplit(address).path
    for _ in range(5):
        with socket.create_connection((host, port), 20) as raw:
            head = (
                f"PUT {path}files/cut.c3d HTTP/1.1\r\nHost: {host}:{port}\r\nContent-Length: 999999\r\n\r\n"
            )
            raw.sendall(head.encode() + b"x" * 100_000)
            time.sleep(0.1)
    assert request(address, "GET", "trial/cut.c3d")[0] == 404


@case
def a_file_without_end(address: str) -> None:
    def endless() -> Iterator[bytes]:
        for _ in range(320):
            yield b"x" * 1_000_000

    with pytest.raises((ConnectionError, AssertionError, http.client.HTTPException)):
        code, _ = request(address, "PUT", "files/endless.c3d", (_chunk(each) for each in endless()),
                          **{"Transfer-Encoding": "chunked"})  # fmt: skip
        assert code == 200
    assert request(address, "GET", "trial/endless.c3d")[0] == 404


def _chunk(content: bytes) -> bytes:
    return f"{len(content):x}\r\n".encode() + content + b"\r\n"


@case
def two_files_of_one_name(address: str) -> None:
    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        rows = [bytes([65 + k]) * 200_000 for k in range(8)]
        found = pool.map(lambda row: request(address, "PUT", "files/many0.c3d", row)[0], rows)
        assert set(found) <= {200, 413}
    code, text = request(address, "GET", "trial/many0.c3d")
    assert code == 404 or len(set(text)) == 1  # of one of them, whole


@case
def trials_that_are_none(address: str) -> None:
    for name, content in (
        ("a.c3d", b"\x02\x50" + b"\xff" * 2_000),
        ("b.c3d", b"x"),
        ("c.trc", b"1\t2\n" * 99),
    ):
        request(address, "PUT", f"files/{name}", content)
        said(address, asks("import", files=[name], walker="patient"))


# --- the campaign


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    served = Served(tmp_path_factory.mktemp("hostile"))
    with Tab.open(served.address) as tab:
        tab.until("run")
    yield served
    served.close()


def memory(served: Served) -> int:
    """Of the server [MiB]."""
    found = re.search(r"VmRSS:\s+(\d+)", pathlib.Path(f"/proc/{served.process.pid}/status").read_text())
    assert found
    return int(found[1]) // 1024


@pytest.mark.skipif(not pathlib.Path("/proc/self/status").exists(), reason="memory is read as on Linux")
@pytest.mark.parametrize("name", sampled(CASES, 4))
def test_a_hostile_client_harms_nobody(served: Served, name: str) -> None:
    before, before_said = memory(served), served.said  # of a slow start
    with Tab.open(served.address, max_size=None) as tab, concurrent.futures.ThreadPoolExecutor(1) as pool:
        serial = tab.until("document")["serial"]
        harm = pool.submit(CASES[name], served.address)
        for k in range(100):
            going = not harm.done()
            tab.ask("change", sets={PRESSURE: 3.0 + 0.01 * (k % 50) + 0.001 * (serial % 7)})
            serial = tab.until("document", serial + 1, within=20)["serial"]
            tab.until("settled", serial, within=20)
            if not going:
                break
        harm.result(20)
    assert served.said == before_said and served.process.poll() is None
    assert memory(served) < before + 100


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_the_end_leaves_nothing(tmp_path: pathlib.Path, stop: signal.Signals) -> None:
    words = [sys.executable, "-m", "afo_sim", "studio", "--no-browser", "--out", str(tmp_path / "saved")]
    (tmp_path / "temporary").mkdir()
    own = os.environ | {"TMPDIR": str(tmp_path / "temporary")}
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=own, text=True)
    assert process.stdout is not None
    with Tab.open(process.stdout.readline().split()[-1]) as tab:
        tab.until("settled")
        children = pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children").parent.parent.glob(
            "*/children"
        )
        own_children = [int(pid) for each in children for pid in each.read_text().split()]
        tab.ask("search", keys={PRESSURE: [2.0, 4.2]})
        time.sleep(0.3)
        process.send_signal(stop)
        process.communicate(timeout=20)
    assert process.returncode == 128 + stop
    assert [*(tmp_path / "temporary").iterdir()] == []
    assert own_children and not any(pathlib.Path(f"/proc/{pid}/cmdline").exists() for pid in own_children)
