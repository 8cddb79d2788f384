"""Machine code of the package's library or the cache: of the same code alone, and the same to the bit."""

import ctypes
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
from typing import Any

import mujoco
import pytest
from campaign import nightly, size
from test_walls import ROOMS

from afo_sim.common import CallbackError, machine_code, user_cache
from afo_sim.native import COMPLAINTS, compiled, struct_layout
from afo_sim.native.error_codes import MJU_ERROR, RAISED
from afo_sim.physics import jitable

PACKAGE = pathlib.Path(compiled.__file__).parents[1]
# Every force of a run, to the bit; whether numba or LLVM were there; a complaint.
PROGRAM = """
import hashlib, sys
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
print(*(name in sys.modules for name in ("numba", "llvmlite")), found.hexdigest())
"""
COMPILES, LOADS, SHIPPED = (True, True), (False, True), (False, False)


ANOTHER = {"NUMBA_LOOP_VECTORIZE": "1"}  # a setting as it is by default; code is shipped for none


def fingerprint() -> str | None:
    """The key of the callbacks' code."""
    return machine_code.fingerprint(*compiled.follows())


load = compiled.callbacks.__wrapped__  # each time anew
# complaint; whether numba and LLVM were imported; checksum of all forces
Found = tuple[str, tuple[bool, bool], str]


def keep(kind: str, key: str, codes: list[machine_code.Code]) -> None:
    """Put code into the cache."""
    machine_code._compile(kind, key, lambda: codes)


def said_at_once(program: str, *folders: object, **more: str) -> list[list[str]]:
    """The lines that processes print which run at once, each over its cache folder."""
    command, there = [sys.executable, "-c", program], os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    environments = [there | more | {user_cache.VARIABLE: str(folder)} for folder in folders]
    processes = [
        subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=there) for there in environments
    ]
    said = [process.communicate(timeout=280)[0].splitlines() for process in processes]
    assert [process.returncode for process in processes] == [0] * len(folders)
    return said


def in_new_processes(*folders: pathlib.Path) -> list[Found]:
    """What processes say that run at once, each over its cache folder."""
    found = [(complaint, line.split()) for complaint, line in said_at_once(PROGRAM, *folders, **ANOTHER)]
    return [(complaint, (numba == "True", llvm == "True"), sha) for complaint, (numba, llvm, sha) in found]


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
    for name, value in (ANOTHER | {user_cache.VARIABLE: str(tmp_path / "cache")}).items():
        monkeypatch.setenv(name, value)
    load()
    code = machine_code._kept(compiled.KIND, fingerprint())
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
    """Of four that start at once, too; and as the package's library does, which needs no compiler."""
    folder, found = first
    (complaint, _, forces), imports = found[0], sorted(each for _, each, _ in found)
    assert imports[:4] == [LOADS, LOADS, LOADS, COMPILES]
    assert complaint.rpartition(" ")[0] in COMPLAINTS
    assert {(complaint, forces) for complaint, _, forces in found} == {(complaint, forces)}
    assert len(list(folder.iterdir())) == 1
    assert in_new_processes(folder) == [(complaint, LOADS, forces)]
    if is_shipped():
        assert said_at_once(PROGRAM, "off") == [[complaint, f"False False {forces}"]]


@pytest.mark.slow
def test_curves_of_a_later_process_are_the_same_and_need_no_compiler(tmp_path: pathlib.Path) -> None:
    program = (
        "import sys\nfrom afo_sim.physics.curves import contractions, forces\n"
        "row = (0.01, 8.0, 1.0, 1.0, 1.0, 1.0)\nf = forces(1, row, [[0.0], [0.1]], [1e5, 3e5])\n"
        "print(f.tobytes().hex(), contractions(1, row, f, 3e5).tobytes().hex())\n"
        "print(*{'numba', 'scipy', 'pint'} & set(sys.modules))"
    )
    (first, one), (second, other) = said_at_once(program, tmp_path, tmp_path, **ANOTHER)
    assert "numba" in one + other and "" in (one, other) and first == second  # one compiles, the other waits
    assert said_at_once(program, tmp_path, **ANOTHER) == [[first, ""]]
    assert len(list(tmp_path.iterdir())) == 1
    assert said_at_once(program, tmp_path)[0][0] == first


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
    places = *(place(*each) for each in struct_layout.READ), 0
    table = (ctypes.c_int64 * len(places))(*places)
    compiled.places = lambda: table
bias, _ = compiled.callbacks.__wrapped__()
print(*(bias(moved(model, "mjModel"), moved(data, "mjData"), k).hex() for k in range(model.nu)))
"""


@pytest.mark.slow
@pytest.mark.parametrize("setting", [{}, ANOTHER], ids=["library", "cache"])
def test_one_code_serves_another_layout(
    first: tuple[pathlib.Path, list[Found]], setting: dict[str, str]
) -> None:
    """Copies of model and data, in which the fields stand elsewhere, have the same forces."""
    (as_declared,), (elsewhere,) = (
        said_at_once(SHIFTED.replace("SHIFT", str(shift)), first[0], **setting)[0] for shift in (0, 24)
    )
    assert as_declared == elsewhere and any(float.fromhex(each) for each in as_declared.split())


@pytest.mark.slow
def test_without_a_folder_code_is_compiled_each_time(
    counted: list[str | None], tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (file,) = (tmp_path / "cache").iterdir()
    monkeypatch.setenv(user_cache.VARIABLE, str(file / "below a file"))
    load()
    load()
    assert counted == [fingerprint()] * 2


@pytest.mark.slow
def test_damaged_code_is_compiled_anew(counted: list[str | None], tmp_path: pathlib.Path) -> None:
    load()
    assert counted == []
    (file,) = (tmp_path / "cache").iterdir()
    file.write_bytes(file.read_bytes()[:-100])
    load()
    assert counted == [fingerprint()]


@pytest.mark.slow
def test_code_that_needs_an_unknown_symbol_is_compiled_anew(counted: list[str | None]) -> None:
    """LLVM would call address 0."""
    key = fingerprint()
    assert key
    bias, dyn = machine_code._kept(compiled.KIND, key)
    assert MJU_ERROR in bias.needs
    keep(compiled.KIND, key, [bias, dyn._replace(needs=(*dyn.needs, "no_such_symbol"))])
    load()
    assert counted == [key]


def is_shipped() -> bool:
    return machine_code.shipped(compiled.KIND, fingerprint()) is not None


shipped = pytest.mark.skipif(
    not is_shipped(), reason="nothing is compiled at the build here, or not this code"
)


@shipped
@pytest.mark.parametrize("place", [0, 1], ids=["wheel", "checkout"])
def test_shipped_code_is_taken_if_it_is_whole_and_of_these_sources(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, place: int
) -> None:
    folders = [tmp_path / "nothing", tmp_path / "nothing"]
    folders[place] = pathlib.Path(shutil.copytree(machine_code.library_path().parent, tmp_path / "brought"))
    library, content = folders[place] / machine_code.LIBRARY, folders[place] / machine_code.CONTENT
    monkeypatch.setattr(user_cache, "BROUGHT", folders)
    monkeypatch.setattr(machine_code, "_brought", machine_code._brought.__wrapped__)
    monkeypatch.setattr(machine_code, "library", machine_code.library.__wrapped__)
    monkeypatch.setattr(machine_code, "_compile", lambda kind, key, compile_: pytest.fail(f"{kind} compiled"))
    load()
    assert compiled.library_file() == library
    whole, said = library.read_bytes(), content.read_text(encoding="utf-8")
    library.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    assert not is_shipped()
    library.write_bytes(whole)
    for damaged in ("", "{}", said.replace("sha256", "sha"), said[:-1]):
        content.write_text(damaged, encoding="utf-8")
        assert not is_shipped()
    kinds = json.loads(said)["kinds"]
    content.write_text(said.replace(kinds[compiled.KIND][0], kinds["planar"][0][::-1]), encoding="utf-8")
    assert not is_shipped()
    content.write_text(said, encoding="utf-8")
    assert is_shipped()
    library.unlink()
    assert not is_shipped()
    with pytest.raises(CallbackError, match="pip install"):
        compiled.library_file()


@shipped
@pytest.mark.parametrize("sources", ["of edited sources", None])
def test_shipped_code_is_not_taken_for_other_sources(
    monkeypatch: pytest.MonkeyPatch, sources: str | None
) -> None:
    """Nor told of places: its table may have another length."""
    monkeypatch.setattr(user_cache, "checksum", lambda: sources)
    monkeypatch.setattr(machine_code, "library", lambda: pytest.fail("loaded"))
    monkeypatch.setattr(machine_code, "functions", lambda *told: [None, None])
    assert load() == (None, None) and not is_shipped()


def test_layouts_of_mujoco_are_those_that_it_declares() -> None:
    known = json.loads(struct_layout.LAYOUTS.read_text(encoding="utf-8"))
    assert {len(table) for table in known.values()} == {len(struct_layout.READ) + 1}
    declared = list(struct_layout.places())
    assert known.get(str(mujoco.mj_version()), declared) == declared


def test_a_mujoco_that_lacks_a_field_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    declared = struct_layout.declarations("mjData")
    fewer = {name: field for name, field in declared.items() if name != "ten_wrapadr"}
    real = struct_layout.declarations
    monkeypatch.setattr(struct_layout, "declarations", lambda at: fewer if at == "mjData" else real(at))
    with pytest.raises(CallbackError, match=r"has no mjData\.ten_wrapadr; .*callback"):
        load()


@jitable.register_jitable
def own_law(x: float) -> float:
    """One of a user's own that says no."""
    if x > 0.5:
        raise ValueError("beyond the law")
    return 1.0 + x


@pytest.mark.slow
def test_what_a_law_of_ones_own_raises_is_a_complaint(monkeypatch: pytest.MonkeyPatch) -> None:
    """Never a silent 0; over arrays no number."""
    from afo_sim.native import compiling

    def bias(m: Any, d: Any, i: int) -> float:
        return own_law(d.ctrl[i])

    def codes() -> list[machine_code.Code]:
        jitable.register_all()
        return compiling.compiling.compile_all("test", [bias], compiling.SIGNATURE, compiling._raised)

    monkeypatch.setenv(user_cache.VARIABLE, "off")
    (found,) = machine_code.functions("test", compiled._MJF_ACT, (), codes, compiled._outside)
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body><joint name="j"/><geom size=".1"/></body></worldbody>'
        '<actuator><general joint="j" gainprm="0" biastype="user"/></actuator></mujoco>'
    )
    data = mujoco.MjData(model)
    mujoco.set_mjcb_act_bias(found)
    try:
        data.ctrl[0] = 0.25
        mujoco.mj_step(model, data)
        assert data.actuator_force[0] == 1.25
        data.ctrl[0] = 0.75
        with pytest.raises(mujoco.FatalError, match=f"{COMPLAINTS[RAISED]} 0"):
            mujoco.mj_step(model, data)
    finally:
        mujoco.set_mjcb_act_bias(None)
    prototype = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_void_p, ctypes.c_double)
    (curve,) = machine_code.functions("test", prototype, (), lambda: code_of_a_sum("test", own_law))
    zero = (ctypes.c_double * 1)()
    assert curve(ctypes.addressof(zero), 0.25) == 1.25 and math.isnan(curve(ctypes.addressof(zero), 0.75))


def code_of_a_sum(kind: str, own: object) -> list[machine_code.Code]:
    """Machine code of a function that asks another one."""

    def asks(numbers: Any, x: float) -> float:
        return own(x) + numbers[0]  # type: ignore[operator]

    return jitable.code_of(kind, asks)


@pytest.mark.slow
def test_code_with_an_address_of_this_process_is_taken_by_no_other(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(user_cache.VARIABLE, str(tmp_path))
    square = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(lambda x: x * x)
    prototype = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_void_p, ctypes.c_double)
    (found,) = machine_code.functions("test", prototype, (), lambda: code_of_a_sum("test", square))
    numbers = (ctypes.c_double * 1)(0.25)
    assert found(ctypes.addressof(numbers), 3.0) == 9.25
    key = machine_code.fingerprint()
    assert key and machine_code._kept("test", key) == []
    (code,) = code_of_a_sum("test", jitable.register_jitable(lambda x: x * x))
    keep("test", key, [code])
    assert machine_code._kept("test", key) == [code]  # that of the same function without


@pytest.mark.slow
def test_a_function_that_was_compiled_is_still_called_by_what_numba_compiles_later() -> None:
    from numba import njit

    @jitable.register_jitable
    def own(x: float) -> float:
        return math.exp(-x) + x**3  # numba keeps its own function for the power

    code_of_a_sum("test", own)
    assert njit(lambda x: own(x) - own(2.0 * x))(0.3) == pytest.approx(own(0.3) - own(0.6), rel=1e-14)


@nightly("all is compiled once more")
@pytest.mark.slow
def test_code_is_the_same_for_every_processor() -> None:
    """Whatever processor numba is told of."""
    program = (
        "from afo_sim.physics import in_series, jitable\n"
        "(code,) = jitable.code_of('curve', in_series._tension_curve)\n"
        "print(code.binary.hex())"
    )
    features = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}, {"NUMBA_CPU_NAME": "skylake-avx512"}
    (one,), (other,) = (said_at_once(program, "off", **each)[0] for each in features)
    assert one == other


@pytest.mark.slow
def test_unknown_sources_are_compiled_anew(
    counted: list[str | None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(user_cache, "checksum", lambda: None)
    load()
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
        (machine_code.platform, "machine", lambda: "another machine"),
    ],
    ids=["types", "platform"],
)
def test_key_holds(monkeypatch: pytest.MonkeyPatch, owner: object, name: str, value: object) -> None:
    before = fingerprint()
    monkeypatch.setattr(owner, name, value)
    assert fingerprint() not in (before, None)


def test_key_holds_settings_of_numba(monkeypatch: pytest.MonkeyPatch) -> None:
    before = fingerprint()
    monkeypatch.setenv(*next(iter(ANOTHER.items())))
    assert fingerprint() not in (before, None)
