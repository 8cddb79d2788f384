"""A child under supervision: how it ends is told in words, and nothing of it outlives its parent."""

import os
import pathlib
import signal
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest
from installed import needs

from afo_sim.common import ALONE, LIMITS, Child, ChildEnded, complaint

pytestmark = needs("psutil")
ROOT = pathlib.Path(__file__).parents[2]


DOES = """
def serve(receive, send):
    while True:
        exec(receive(), {"send": send})
"""


@pytest.fixture(scope="module", autouse=True)
def found_by_children(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A module among those that a child can import: it does what is sent."""
    folder = tmp_path_factory.mktemp("does")
    (folder / "does.py").write_text(DOES)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", os.pathsep.join([str(folder), str(ROOT)]))
        yield


# how it ends, by the predicate that the error begins with
ENDS = {
    "import sys; sys.exit(0)": "ended itself (exit code 0)",
    "import os; os._exit(7)": "ended itself (exit code 7)",
    "import os; os.abort()": "was stopped by SIGABRT",
    "import ctypes; ctypes.string_at(0)": "was stopped by SIGSEGV",
    "import os; os.kill(os.getpid(), 9)": "was stopped by SIGKILL",
    "import os; os.closerange(0, 64); __import__('time').sleep(60)": "has closed its files",
    "import os; os.write(4, b'what is it')": "has sent what is no answer",
    "while True: pass": "gave no answer within 0.5 s",
}


@pytest.mark.parametrize("does", ENDS)
def test_how_a_child_has_ended_is_told_in_words(does: str) -> None:
    child = Child("does:serve", LIMITS)
    child.send("send(1)")
    assert child.receive(60.0) == 1
    child.send(does)
    with pytest.raises(ChildEnded) as error:
        child.receive(0.5 if "while" in does else 60.0)
    assert str(error.value).startswith(ENDS[does])
    child.send("send(2)")  # to nobody: the next to receive is told the same
    with pytest.raises(ChildEnded):
        child.receive(60.0)
    child.close()
    assert child.process.returncode is not None


@pytest.mark.skipif(sys.platform != "linux", reason="Linux alone can end who starts a process")
@pytest.mark.parametrize("does", ["os.fork()", "os.kill(os.getppid(), 9)", "os.system('sleep 60')"])
def test_code_of_others_starts_no_process_and_sends_no_signal(does: str) -> None:
    child = Child("does:serve", ALONE)
    child.send(f"import os; {does}; send(1)")
    with pytest.raises(ChildEnded, match="was stopped by SIGSYS"):
        child.receive(60.0)


LOOPS = """
import ctypes, pathlib
library = {library!r}
def serve(receive, send):
    loop = ctypes.{kind}(library).loop
    send(1)
    loop()
"""
PARENT = """
import sys
from afo_sim.common import Child
child = Child("looping:serve")
assert child.receive(60.0) == 1
print(child.process.pid, flush=True)
child.receive()
"""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a thread of Python has to tell")
@pytest.mark.parametrize("kind", ["CDLL", "PyDLL"])
def test_a_child_in_an_endless_loop_in_c_ends_with_its_parent(kind: str, tmp_path: pathlib.Path) -> None:
    """Also where no thread of Python runs meanwhile."""
    import psutil

    (tmp_path / "loop.c").write_text("void loop(void) { for (;;); }")
    command = ["cc", "-shared", "-fPIC", "-o", str(tmp_path / "loop.so"), str(tmp_path / "loop.c")]
    assert complaint(command, tmp_path) == ""
    (tmp_path / "looping.py").write_text(LOOPS.format(library=str(tmp_path / "loop.so"), kind=kind))
    there = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(tmp_path)])}
    with subprocess.Popen([sys.executable, "-c", PARENT], env=there, stdout=subprocess.PIPE) as parent:
        assert parent.stdout is not None
        child = psutil.Process(int(parent.stdout.readline()))
        time.sleep(0.05)
        parent.send_signal(signal.SIGKILL)
    assert psutil.wait_procs([child], timeout=20)[1] == []


def test_a_compiler_that_waits_is_ended_with_what_it_has_started(tmp_path: pathlib.Path) -> None:
    import psutil

    os.mkfifo(tmp_path / "waits.h")
    (tmp_path / "own.c").write_text('#include "waits.h"\n')
    assert complaint(["cc", "-c", str(tmp_path / "own.c")], tmp_path, 0.5) == "it gave no answer within 0.5 s"
    mine = [p for p in psutil.process_iter(["cmdline"]) if str(tmp_path) in str(p.info["cmdline"])]
    assert psutil.wait_procs(mine, timeout=5)[1] == []
