"""Machine code that is shipped or in the cache: taken for the same code alone, and the same to the bit."""

import os
import pathlib
import shutil
import subprocess
import sys
from collections.abc import Iterator

import pytest
from campaign import nightly, size
from test_walls import ROOMS

from afo_sim.common import machine_code, user_cache
from afo_sim.native import COMPLAINTS, compiled
from afo_sim.native.error_codes import MJU_ERROR

PACKAGE = pathlib.Path(compiled.__file__).parents[1]
# How many functions numba compiled, and every force of a run, to the bit; then a complaint.
PROGRAM = """
import hashlib
from numba.core.event import install_recorder
with install_recorder("numba:compile") as compiles:
    import mujoco
    from rig import charged, hanging_mass
    from afo_sim import native
    model = hanging_mass(3.0)
    found = hashlib.sha256()
    with native.installed():
        data = charged(model, 3e5)
        for _ in range(500):
            mujoco.mj_step(model, data)
            found.update(data.qpos.tobytes() + data.act.tobytes() + data.actuator_force.tobytes())
        data.act[:] = -1.0
        try:
            mujoco.mj_step(model, data)
        except mujoco.FatalError as complaint:
            print(complaint)
print(len(compiles.buffer) // 2, found.hexdigest())
"""


def fingerprint() -> str | None:
    """The key of the callbacks' code."""
    return machine_code.fingerprint(*compiled.follows())


Found = tuple[str, int, str]  # complaint, number of functions compiled, checksum of all forces


def said_at_once(program: str, *folders: pathlib.Path) -> list[list[str]]:
    """The lines that processes print which run at once, each over its cache folder."""
    command, path = [sys.executable, "-c", program], os.pathsep.join(sys.path)
    environments = [os.environ | {user_cache.VARIABLE: str(folder), "PYTHONPATH": path} for folder in folders]
    processes = [
        subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=there) for there in environments
    ]
    said = [process.communicate(timeout=280)[0].splitlines() for process in processes]
    assert [process.returncode for process in processes] == [0] * len(folders)
    return said


def in_new_processes(*folders: pathlib.Path) -> list[Found]:
    """What processes say that run at once, each over its cache folder."""
    said = said_at_once(PROGRAM, *folders)
    return [(complaint, int(numbers.split()[0]), numbers.split()[1]) for complaint, numbers in said]


@pytest.fixture(scope="module", autouse=True)
def _nothing_shipped() -> Iterator[None]:
    """A setting of numba, as it is by default; code is shipped for no setting."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NUMBA_OPT", "3")
        yield


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> tuple[pathlib.Path, list[Found]]:
    """A cache that four processes found empty at once, and what they computed; at night one without a cache.

    One compiles everything, which takes nearly all the time of these tests.
    """
    folder, file = tmp_path_factory.mktemp("cache"), tmp_path_factory.mktemp("none") / "file"
    file.write_text("", encoding="utf-8")
    return folder, in_new_processes(*[folder] * 4, *[file / "below a file"] * size(0, 1))


@pytest.fixture
def counted(
    first: tuple[pathlib.Path, list[Found]], tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> list[str | None]:
    """The keys for which code is compiled, over a copy of the filled cache; nothing is really compiled."""
    shutil.copytree(first[0], tmp_path / "cache")
    monkeypatch.setenv(user_cache.VARIABLE, str(tmp_path / "cache"))
    compiled.callbacks()
    code = machine_code._stored(compiled.KIND, fingerprint())
    assert len(code) == 2
    compiles: list[str | None] = []

    def compile_(kind: str, key: str | None, _: object) -> list[machine_code.Code]:
        assert kind == compiled.KIND
        compiles.append(key)
        return code

    monkeypatch.setattr(machine_code, "_compile", compile_)
    return compiles


@pytest.mark.slow
def test_later_process_compiles_nothing_and_computes_the_same(
    first: tuple[pathlib.Path, list[Found]],
) -> None:
    """Of four that start at once, too."""
    folder, found = first
    (complaint, _, forces), counts = found[0], sorted(compiles for _, compiles, _ in found)
    assert counts[:3] == [0, 0, 0] and min(counts[3:]) > 50
    assert complaint.rpartition(" ")[0] in COMPLAINTS
    assert {(complaint, forces) for complaint, _, forces in found} == {(complaint, forces)}
    assert len(list(folder.iterdir())) == 1
    assert in_new_processes(folder) == [(complaint, 0, forces)]


@pytest.mark.slow
def test_later_process_imports_no_compiler(first: tuple[pathlib.Path, list[Found]]) -> None:
    program = (
        "import sys\nfrom afo_sim import native\nwith native.installed():\n"
        "    print(*{'numba', 'scipy', 'pint'} & set(sys.modules))"
    )
    there = os.environ | {user_cache.VARIABLE: str(first[0])}
    done = subprocess.run([sys.executable, "-c", program], env=there, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "\n"), done.stderr


@pytest.mark.slow
def test_curves_of_a_later_process_are_the_same_and_need_no_compiler(tmp_path: pathlib.Path) -> None:
    program = (
        "import sys\nfrom afo_sim.physics.curves import contractions, forces\n"
        "row = (0.01, 8.0, 1.0, 1.0, 1.0, 1.0)\nf = forces(1, row, [[0.0], [0.1]], [1e5, 3e5])\n"
        "print(f.tobytes().hex(), contractions(1, row, f, 3e5).tobytes().hex())\n"
        "print('numba' in sys.modules)"
    )
    (first, one), (second, other) = said_at_once(program, tmp_path, tmp_path)
    assert {one, other} == {"True", "False"} and first == second  # one compiles, and the other waits
    assert said_at_once(program, tmp_path) == [[first, "False"]]
    assert len(list(tmp_path.iterdir())) == 1


SHIFTED = """
import ctypes, mujoco
from rig import charged, hanging_mass
from afo_sim import native
from afo_sim.native import compiled, struct_layout
model = hanging_mass(3.0)
with native.installed():
    data = charged(model, 3e5)
    mujoco.mj_step(model, data)
wanted = SHIFT
held, real = [], struct_layout.c_struct
def moved(owner, name):
    raw = ctypes.string_at(owner._address, ctypes.sizeof(real(name)))
    at = real(name).opt.offset if name == "mjModel" else real(name).time.offset
    held.append(ctypes.create_string_buffer(raw[:at] + bytes(wanted) + raw[at:]))
    return ctypes.addressof(held[-1])
if wanted:
    def place(struct, name):
        offset = getattr(real(struct), name).offset
        first = {"mjModel": "opt", "mjData": "time"}.get(struct)
        return offset + wanted * (first is not None and offset >= getattr(real(struct), first).offset)
    table = (ctypes.c_int64 * len(struct_layout.READ))(*(place(*each) for each in struct_layout.READ))
    compiled.places = lambda: table
bias, _ = compiled.callbacks()
print(*(bias(moved(model, "mjModel"), moved(data, "mjData"), k).hex() for k in range(model.nu)))
"""


@pytest.mark.slow
def test_one_code_serves_another_layout() -> None:
    """Copies of model and data, in which the fields stand elsewhere, have the same forces."""
    (as_declared,), (elsewhere,) = (
        said_at_once(SHIFTED.replace("SHIFT", str(shift)), user_cache.folder())[0] for shift in (0, 24)
    )
    assert as_declared == elsewhere and any(float.fromhex(each) for each in as_declared.split())


@pytest.mark.slow
def test_without_a_folder_code_is_compiled_each_time(
    counted: list[str | None], tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (file,) = (tmp_path / "cache").iterdir()
    monkeypatch.setenv(user_cache.VARIABLE, str(file / "below a file"))
    compiled.callbacks()
    compiled.callbacks()
    assert counted == [fingerprint()] * 2


@pytest.mark.slow
def test_damaged_code_is_compiled_anew(counted: list[str | None], tmp_path: pathlib.Path) -> None:
    compiled.callbacks()
    assert counted == []
    (file,) = (tmp_path / "cache").iterdir()
    file.write_bytes(file.read_bytes()[:-100])
    compiled.callbacks()
    assert counted == [fingerprint()]


@pytest.mark.slow
def test_code_that_needs_an_unknown_symbol_is_compiled_anew(counted: list[str | None]) -> None:
    """LLVM would call address 0."""
    key = fingerprint()
    assert key
    bias, dyn = machine_code._stored(compiled.KIND, key)
    assert MJU_ERROR in bias.needs
    unknown = dyn._replace(needs=(*dyn.needs, "no_such_symbol"))
    user_cache.write(compiled.KIND, key, machine_code._packed([bias, unknown]))
    compiled.callbacks()
    assert counted == [key]


@pytest.mark.slow
@pytest.mark.parametrize("package", [".", "afo_sim"], ids=["wheel", "checkout"])
def test_shipped_code_is_taken_if_it_is_whole_and_of_these_sources(
    counted: list[str | None], tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, package: str
) -> None:
    (file,) = (tmp_path / "cache").iterdir()
    (tmp_path / "machine_code").mkdir()
    shipped = file.replace(tmp_path / "machine_code" / compiled.KIND)
    monkeypatch.setattr(user_cache, "_PACKAGE", tmp_path / package)
    compiled.callbacks()
    assert counted == []
    whole, key = shipped.read_bytes(), fingerprint()
    shipped.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    compiled.callbacks()
    assert counted == [key]
    shipped.write_bytes(whole)
    monkeypatch.setattr(user_cache, "checksum", lambda: "of edited sources")
    compiled.callbacks()
    assert counted == [key, fingerprint()] and key != fingerprint()


@nightly("all is compiled once more")
@pytest.mark.slow
def test_code_is_the_same_for_every_processor() -> None:
    """Whatever processor numba is told of."""
    program = (
        "from afo_sim.physics import in_series, jitable\n"
        "code, _ = jitable.code_of(in_series._tension_curve)\n"
        "print(code[0].binary.hex())"
    )
    features = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}, {"NUMBA_CPU_NAME": "skylake-avx512"}
    said = {
        subprocess.check_output([sys.executable, "-c", program], env=os.environ | each) for each in features
    }
    assert len(said) == 1


@pytest.mark.slow
def test_unknown_sources_are_compiled_anew(
    counted: list[str | None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(user_cache, "checksum", lambda: None)
    compiled.callbacks()
    assert counted == [None]


@pytest.mark.parametrize(
    "file",
    [
        *("physics/laws/sarosi.py", "physics/static_force.py", "native/network.py", "common/units.py"),
        "physics/laws/new_2026.py",
    ],
)
def test_a_change_of_any_source_makes_another_key(tmp_path: pathlib.Path, file: str) -> None:
    checksum = user_cache.checksum.__wrapped__
    copy = tmp_path / "afo_sim"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    before = checksum(copy)
    assert before == user_cache.checksum()
    with (copy / file).open("ab") as source:
        source.write(b"\n")
    assert checksum(copy) not in (before, None)


def test_sources_that_are_not_there_have_no_key(tmp_path: pathlib.Path) -> None:
    assert user_cache.checksum.__wrapped__(tmp_path) is None


def test_key_holds_every_room_that_kernels_may_import() -> None:
    assert set(user_cache.ROOMS) == ROOMS["native"] | {"native"}


@pytest.mark.parametrize(
    ("owner", "name", "value"),
    [
        (compiled, "kinds", lambda: ["mjModel.opt: another"]),
        (machine_code.llvm, "get_process_triple", lambda: "another-platform"),
    ],
    ids=["types", "platform"],
)
def test_key_holds(monkeypatch: pytest.MonkeyPatch, owner: object, name: str, value: object) -> None:
    before = fingerprint()
    monkeypatch.setattr(owner, name, value)
    assert fingerprint() not in (before, None)


def test_key_holds_settings_of_numba(monkeypatch: pytest.MonkeyPatch) -> None:
    before = fingerprint()
    monkeypatch.setenv("NUMBA_OPT", "1")
    assert fingerprint() not in (before, None)
