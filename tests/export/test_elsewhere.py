"""An exported scenario steps without this package, to the bits of its run, and refuses what it cannot."""

import ctypes
import functools
import importlib
import math
import os
import pathlib
import shutil
import subprocess
import sys
import threading
import zipfile
from collections.abc import Callable, Iterator
from typing import Any

import mujoco
import numpy as np
import pytest
from campaign import SEED, nightly, size
from exported_library import NAME, Failed, Simulation, loaded, opened

import afo_sim
from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, CallbackError, InputError, assets
from afo_sim.description import load
from afo_sim.export.elsewhere.variables import variables_of
from afo_sim.export.elsewhere.writing import write_elsewhere
from afo_sim.metrics import SOLVED
from afo_sim.model.build import build
from afo_sim.model.supply_and_timer import controls
from afo_sim.physics import Law, LawParameter
from afo_sim.simulation import Recording

HERE = pathlib.Path(__file__).with_name("elsewhere")
LIBRARY = pathlib.Path(native.__file__).with_name("library")
SHIPPED = sorted(file.stem for file in (assets.folder("models") / "scenarios").glob("*.toml"))
BY_DAY = ("seated", "arm-positions", "walk-dropfoot-afo")
COIL, OUTLET, PRESSURE = (f"{each[0]}/dorsiflexor{each[1]}" for each in (
    ("valve", "_inlet/coil"), ("valve", "_outlet/coil"), ("chamber", "/pressure")))  # fmt: skip
SUPPLY, ANGLE = "supply/pressure", "ankle/angle"
OTHER = (
    '<mujoco><worldbody><body><joint name="j"/><geom size=".1"/></body></worldbody>'
    '<actuator><general joint="j" biastype="user" user="1"/></actuator></mujoco>'
)
Export = Callable[..., pathlib.Path]


@pytest.fixture(scope="session")
def runs() -> Callable[[str], Recording]:
    return functools.cache(lambda name: afo_sim.run(name, step="fixed"))


@pytest.fixture(scope="session")
def export(runs: Callable[[str], Recording], tmp_path_factory: pytest.TempPathFactory) -> Export:
    """Folder, or FMU, of a shipped scenario; of the run where a controller commands it."""
    try:
        native.library_file()
    except CallbackError as error:
        pytest.skip(str(error))

    @functools.cache
    def exported(name: str, to: str) -> pathlib.Path:
        what = runs(name) if afo_sim.load("scenario", name).controller is not None else name
        out = tmp_path_factory.mktemp(f"{name}-{to}") / ("its.fmu" if to == "fmu" else "out")
        write_elsewhere(what, to, out)
        return out

    return exported


@pytest.fixture(scope="session")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., pathlib.Path]:
    """A program of `elsewhere/`, compiled with all warnings as errors."""
    folder = tmp_path_factory.mktemp("programs")

    def program(source: str, *more: str) -> pathlib.Path:
        cpp = source.endswith("cpp")
        compiler = shutil.which("g++" if cpp else "gcc")
        if compiler is None:
            pytest.skip("no compiler")
        strict = ["-Wall", "-Wextra", "-Werror", "-pthread", "-std=c++17" if cpp else "-std=c11"]
        out = folder / source.replace(".", "_")
        command = [compiler, "-O2", "-g", *strict, str(HERE / source), *more, "-lm", "-o", str(out)]
        subprocess.run(command, check=True)
        return out

    return program


def linked(folder: pathlib.Path) -> list[str]:
    """What a program needs to be linked with an exported folder's library."""
    return [f"-I{folder}", str(folder / NAME), f"-Wl,-rpath,{folder}"]


def alone(*words: Any, cwd: pathlib.Path, timeout: float = 300.0) -> str:
    """What another process prints, which has tests/helpers but not this package; it has to end well."""
    there = {**os.environ, "PYTHONPATH": os.pathsep.join([str(HERE.parents[1] / "helpers"), *SITE])}
    told = list(map(str, words))
    done = subprocess.run(told, capture_output=True, text=True, cwd=cwd, env=there, timeout=timeout)
    assert done.returncode == 0, (done.returncode, done.stdout[-2000:], done.stderr[-4000:])
    return done.stdout


# where packages lie that are not in the interpreter's own folders
SITE = [path for path in os.environ.get("PYTHONPATH", "").split(os.pathsep) if path and (
    not (pathlib.Path(path) / "afo_sim").is_dir())]  # fmt: skip
REFUSES = "import sys, importlib.abc\nclass No(importlib.abc.MetaPathFinder):\n" + (
    "    def find_spec(self, name, *_):\n        assert name.partition('.')[0] != 'afo_sim', name\n"
    "sys.meta_path.insert(0, No())\n"
)


def code(text: str) -> list[str]:
    """A Python program that cannot import this package."""
    return [sys.executable, "-c", REFUSES + text]


def walked(recording: Recording) -> dict[str, np.ndarray]:
    """Rows of the steps that an export has: of a settled run those before the stride that is solved for."""
    found = {name: np.asarray(values) for name, values in recording.columns.items()}
    return {name: v[found[SOLVED] == 0.0] for name, v in found.items()} if SOLVED in found else found


def check_bits(folder: pathlib.Path, recording: Recording, played: dict[str, np.ndarray]) -> None:
    """Each output after each step is what the run has: states after it, forces and pressures of it."""
    rows, compared = walked(recording), 0
    for line in (folder / "variables.txt").read_text(encoding="utf-8").splitlines():
        kind, array, _, _, _, name, unit, _ = line.split("\t", 7)
        if kind == "input" or not name:
            continue
        column = name if name in rows else name.replace("joint_force", "force")
        later = 1 if array in ("qpos", "qvel", "act") else 0
        there = rows[column][later:]
        assert len(played[name]) == len(there) + later
        assert np.array_equal(played[name][: len(there)], there), name
        assert unit == recording.describe(column)[0], name
        compared += 1
    assert compared >= 2


def played_by_c(folder: pathlib.Path, steps: int) -> dict[str, np.ndarray]:
    """The same by the library's functions from Python, where no compiler is there."""
    simulation, rows = opened(folder), []
    numbers = {name: simulation.find(name) for name in simulation.outputs()}
    for _ in range(steps):
        simulation.step()
        rows.append([simulation.own.afo_get(simulation.at, k) for k in numbers.values()])
    simulation.close()
    return dict(zip(numbers, np.array(rows).T, strict=True))


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[] if name in BY_DAY else nightly("three scenarios run by day"))
        for name in SHIPPED
    ],
)
def test_every_bit_is_that_of_the_run(
    name: str, export: Export, runs: Callable[[str], Recording], compiled: Any, tmp_path: pathlib.Path
) -> None:
    plugin, c = export(name, "plugin"), export(name, "c")
    out = tmp_path / "played.npz"
    alone(
        sys.executable,
        HERE / "plain.py",
        plugin,
        plugin / NAME,
        c / "variables.txt",
        out,
        cwd=tmp_path,
    )
    with np.load(out) as found:
        check_bits(c, runs(name), {each.replace("|", "/"): found[each] for each in found.files})
    simulation = opened(c)
    names, begun = simulation.outputs(), [simulation.get(each) for each in simulation.outputs()]
    for each, value in zip(names, begun, strict=True):  # at t = 0 all belong to the start
        column = each if each in runs(name).columns else each.replace("joint_force", "force")
        least = 1e-12 * (AMBIENT_PRESSURE if each.endswith("pressure") else 1.0)
        assert value == pytest.approx(walked(runs(name))[column][0], rel=1e-12, abs=least), each
    simulation.close()
    if shutil.which("gcc") is None:
        check_bits(c, runs(name), played_by_c(c, len(walked(runs(name))["time"])))
        return
    alone(compiled("play.c", *linked(c)), c, tmp_path / "played.bin", cwd=tmp_path)
    values = np.fromfile(tmp_path / "played.bin").reshape(-1, len(names)).T
    check_bits(c, runs(name), dict(zip(names, values, strict=True)))


OWN_LAW = "orthosis.muscle.dorsiflexor.type"


@pytest.mark.skipif(shutil.which("gcc") is None, reason="a user's law is linked by a C compiler")
def test_a_law_of_a_users_own_is_played_without_the_package(export: Export, tmp_path: pathlib.Path) -> None:
    export("seated", "c")  # skips where there is no library
    area = LawParameter("area", "A", "m^2", 0.0, 0.01, "that the pressure pulls on", (1e-3, 3e-3))
    sets = {"duration": "1 s", f"{OWN_LAW}.law": "exported", f"{OWN_LAW}.laws.exported.area": "20 cm^2"}
    afo_sim.register(Law("exported", lambda kappa, p, area: p * area * (1.0 - 3.0 * kappa), (area,)))
    recording = afo_sim.run("seated", sets, step="fixed")
    for to in ("plugin", "c"):
        write_elsewhere("seated", to, tmp_path / to, sets)
    assert np.ptp(recording["ankle/angle"]) > 0.1 and not np.array_equal(
        recording["ankle/angle"], afo_sim.run("seated", {"duration": "1 s"}, step="fixed")["ankle/angle"]
    )
    plugin, c, out = tmp_path / "plugin", tmp_path / "c", tmp_path / "played.npz"
    alone(sys.executable, HERE / "plain.py", plugin, plugin / NAME, c / "variables.txt", out, cwd=tmp_path)
    with np.load(out) as found:
        check_bits(c, recording, {each.replace("|", "/"): found[each] for each in found.files})
    program = (
        "import pathlib, sys; from exported_library import opened\nit = opened(pathlib.Path(sys.argv[1]))\n"
    )
    program += "for _ in range(500): it.step()\nprint(repr(it.get('ankle/angle')))"
    (c / "afo_sim_user.so").rename(c / "away.so")  # and without it nothing moves by another law
    with pytest.raises(AssertionError, match="not a number in actuator"):
        alone(*code(program), c, cwd=tmp_path)
    (c / "away.so").rename(c / "afo_sim_user.so")
    assert abs(float(alone(*code(program), c, cwd=tmp_path))) < 1.0


def test_a_run_with_a_controller_in_python_is_played_from_its_folder(
    export: Export, tmp_path: pathlib.Path
) -> None:
    export("seated", "c")  # skips where there is no library

    def held(seen: Any) -> dict[str, float]:
        return {"dorsiflexor": "inlet" if seen["ankle/angle"] < 0.0 else "outlet"}

    recording = afo_sim.run("seated", {"duration": "4 s"}, controller=held, rate=50.0)
    assert set(recording["valve/dorsiflexor_inlet/coil"]) == {0.0, 1.0}
    kept = afo_sim.read_recording(recording.save(tmp_path / "run", rrd=False))
    write_elsewhere(kept, "c", tmp_path / "out")
    check_bits(tmp_path / "out", recording, played_by_c(tmp_path / "out", 2000))


@pytest.mark.parametrize("sets", [{"record_rate": "10 Hz"}, {}])
def test_a_run_whose_commands_are_not_whole_is_refused(
    sets: dict[str, str], export: Export, tmp_path: pathlib.Path
) -> None:
    export("seated", "c")  # skips where there is no library

    def switched(seen: Any) -> dict[str, str]:
        if seen["time"] > 0.8 and not sets:
            raise ValueError
        return {"dorsiflexor": "inlet" if seen["time"] % 0.2 < 0.1 else "outlet"}

    try:
        recording = afo_sim.run("seated", {"duration": "1 s"} | sets, controller=switched, rate=50.0)
    except ValueError as error:
        recording = error.recording  # type: ignore[attr-defined]  # the rows until then
    with pytest.raises(afo_sim.InputError) as refused:
        write_elsewhere(recording, "c", tmp_path / "out")
    assert refused.value.field == "run" and not (tmp_path / "out").exists()


# --- functions of the library


@pytest.fixture
def simulation(export: Export) -> Iterator[Simulation]:
    found = opened(export("seated", "c"))
    yield found
    found.close()


def test_the_c_is_without_warnings(tmp_path: pathlib.Path) -> None:
    if shutil.which("gcc") is None:
        pytest.skip("no compiler")
    from afo_sim.native.slots import THIS_LAYOUT
    from afo_sim.native.struct_layout import c_header

    (tmp_path / "places.h").write_text(c_header(native.N_USER, THIS_LAYOUT))
    strict = ["-std=c11", "-O2", "-Wall", "-Wextra", "-Werror", "-Wno-unused-parameter", f"-I{tmp_path}"]
    for source in sorted(LIBRARY.glob("*.c")):
        subprocess.run(["gcc", *strict, "-c", str(source), "-o", str(tmp_path / "o")], check=True)


@pytest.mark.slow
def test_memory_is_clean(compiled: Any, export: Export, tmp_path: pathlib.Path) -> None:
    folder = export("seated", "c")
    program = compiled("careful.c", *linked(folder))
    alone(program, folder, cwd=tmp_path)
    if shutil.which("valgrind") is None:
        pytest.skip("no valgrind")
    kinds = "definite,indirect,possible"
    words = ["--error-exitcode=9", "--leak-check=full", f"--errors-for-leak-kinds={kinds}"]
    alone("valgrind", *words, program, folder, cwd=tmp_path)


@pytest.mark.skipif(sys.platform != "linux", reason="of ELF files")
def test_its_text_is_never_changed_and_it_needs_libc_alone(export: Export) -> None:
    reader = shutil.which("readelf")
    if reader is None:
        pytest.skip("no readelf")
    library = export("seated", "c") / "afo_sim.so"
    text = subprocess.run([reader, "-d", "-W", str(library)], capture_output=True, text=True, check=True)
    needed = {line.split("[")[1].split("]")[0] for line in text.stdout.splitlines() if "(NEEDED)" in line}
    assert "TEXTREL" not in text.stdout
    assert needed and {name.split(".")[0].split("-")[0] for name in needed} <= {"libc", "libm", "libdl", "ld"}


def test_a_step_that_fails_names_its_actuator_and_is_undone(simulation: Simulation) -> None:
    simulation.step(2200)
    expected = simulation.get(ANGLE)
    simulation.reset()
    for value in (-5e5, -101325.0):
        simulation.set(SUPPLY, value)
        with pytest.raises(Failed, match="'chamber_dorsiflexor'"):
            simulation.step(100)
        with pytest.raises(Failed, match="'chamber_dorsiflexor'"):
            simulation.step()
        simulation.reset()
    simulation.step(2200)
    assert simulation.get(ANGLE) == expected


def test_it_takes_failures_without_end(simulation: Simulation) -> None:
    simulation.step(600)
    kept, twin = simulation.state, None
    for _ in range(size(2000, 30_000)):
        simulation.set(SUPPLY, -5e5)
        with pytest.raises(Failed):
            simulation.step()
        simulation.state = kept
        assert twin is None or simulation.get(ANGLE) == twin
        twin = simulation.get(ANGLE)
    simulation.step(100)
    failed = simulation.get(ANGLE)
    simulation.reset()
    simulation.step(700)
    assert simulation.get(ANGLE) == failed


@pytest.mark.parametrize("value", [math.inf, -math.inf, 2e10, -1e300])
def test_an_input_that_mujoco_would_drop_is_refused(simulation: Simulation, value: float) -> None:
    """MuJoCo sets all inputs to 0 where one is larger than 1e10."""
    simulation.set(COIL, 1.0)
    with pytest.raises(Failed, match="knee/angle"):
        simulation.set("knee/angle", value)
    simulation.step(500)
    assert simulation.get(PRESSURE) > 1e5


def test_inputs_that_have_ended_may_be_set(simulation: Simulation) -> None:
    with pytest.raises(Failed, match="inputs have ended"):
        simulation.step(10_000)
    for name in (COIL, OUTLET):  # those of the two that change; what is constant is held
        with pytest.raises(Failed, match="inputs have ended"):
            simulation.step()
        simulation.set(name, 1.0)
    mass = simulation.get("chamber/dorsiflexor/mass")
    simulation.step(50)
    assert simulation.get("chamber/dorsiflexor/mass") > mass


def test_a_moment_on_the_ankle_is_dorsiflexion_positive(simulation: Simulation) -> None:
    begun = simulation.get(ANGLE)
    simulation.set("ankle/moment/applied", 1.0)
    simulation.step(100)
    assert simulation.get(ANGLE) > begun + 0.01
    simulation.set("ankle/moment/applied")
    simulation.step(1500)
    assert simulation.get("ankle/moment/applied") == 0.0
    simulation.reset()
    simulation.step(1600)
    assert simulation.get("ankle/moment/orthosis") > 0.0  # the dorsiflexors are filled


@pytest.mark.parametrize(
    ("file", "content"),
    [
        ("model.xml", None),
        ("model.xml", b""),
        ("model.xml", b"\0\xff no model"),
        ("model.xml", b"<mujoco/>"),
        ("model.xml", OTHER.encode()),
        ("start.bin", None),
        ("start.bin", b"\0" * 8),
        ("inputs.bin", b""),
        ("inputs.bin", b"\0" * 100),
        ("variables.txt", b""),
        ("variables.txt", b"output ctrl 0 1 0 a b c\n"),
        ("variables.txt", b"\t" * 1_000_000),
        ("variables.txt", b"\t" * 1_000_000 + b"\n"),
        ("variables.txt", b"output\tqpos\t0\t1\t0\ta\t\t\n\0"),
        ("variables.txt", b"output\tqpos\t0\t1\t0\ta\t\t"),
        *(
            ("variables.txt", f"output\t{array}\t{place}\t{scale}\t{offset}\ta\t\t\n".encode())
            for array, place, scale, offset in (
                ("qpos", 1, 1, 0), ("qpos", -1, 1, 0), ("qpos", "1e300", 1, 0), ("qpos", "nan", 1, 0),
                ("qpos", 0, 0, 0), ("qpos", 0, "inf", 0), ("qpos", 0, 1, "nan"), ("xpos", 0, 1, 0),
                ("userdata", 46, 1, 0), ("qpos", "", 1, 0), ("qpos", "0 0", 1, 0),
            )
        ),
        ("variables.txt", b"input\tqpos\t0\t1\t0\ta\t\t\n"),
    ],
)  # fmt: skip
def test_a_damaged_folder_is_refused(
    file: str, content: bytes | None, export: Export, tmp_path: pathlib.Path
) -> None:
    own = loaded(export("seated", "c"))
    for name in ("model.xml", "start.bin", "inputs.bin", "variables.txt"):
        shutil.copyfile(export("seated", "c") / name, tmp_path / name)
    Simulation(tmp_path, own).close()
    (tmp_path / file).unlink() if content is None else (tmp_path / file).write_bytes(content)
    with pytest.raises(Failed, match=str(tmp_path)):
        Simulation(tmp_path, own)


@pytest.mark.parametrize("file", ["start.bin", "inputs.bin"])
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_numbers_that_are_none_are_refused(
    file: str, value: float, export: Export, tmp_path: pathlib.Path
) -> None:
    folder = export("seated", "c")
    for name in ("model.xml", "start.bin", "inputs.bin", "variables.txt"):
        shutil.copyfile(folder / name, tmp_path / name)
    numbers = np.fromfile(folder / file)
    numbers[3] = value
    (tmp_path / file).write_bytes(numbers.tobytes())
    with pytest.raises(Failed, match="not finite"):
        Simulation(tmp_path, loaded(folder))
    (tmp_path / file).write_bytes(np.concatenate([np.fromfile(folder / "start.bin")] * 2).tobytes())
    with pytest.raises(Failed, match=file):  # of twice the length, or of no whole rows
        Simulation(tmp_path, loaded(folder))


def test_a_parameter_that_would_lead_beyond_the_arrays_is_refused(
    export: Export, tmp_path: pathlib.Path
) -> None:
    """A kernel follows the rows' numbers without looking: one in a ring would never end."""
    folder = export("seated", "c")
    for name in ("model.xml", "start.bin", "inputs.bin", "variables.txt"):
        shutil.copyfile(folder / name, tmp_path / name)
    text = (folder / "model.xml").read_text(encoding="utf-8")
    assert text.count('user="2840 2 1 8 ') == 1
    for other in ('user="2840 2 1 7 ', 'user="2840 2 1 8e5 ', 'user="2839 2 1 8 '):
        (tmp_path / "model.xml").write_text(text.replace('user="2840 2 1 8 ', other), encoding="utf-8")
        with pytest.raises(Failed, match="parameters are damaged"):
            Simulation(tmp_path, loaded(folder))
    begun = text.index("<config")
    config = text[begun : text.index(">", begun) + 1]
    (tmp_path / "model.xml").write_text(text.replace(config, ""), encoding="utf-8")
    with pytest.raises(Failed, match="parameters are damaged"):
        Simulation(tmp_path, loaded(folder))
    before = '<motor name="mine" joint="ankle"/>'
    (tmp_path / "model.xml").write_text(text.replace("<actuator>", f"<actuator>{before}"), encoding="utf-8")
    with pytest.raises(Failed):  # the rows name actuators by their numbers
        Simulation(tmp_path, loaded(folder))


@pytest.mark.slow
def test_whatever_is_damaged_nothing_crashes(export: Export, tmp_path: pathlib.Path) -> None:
    folder = export("seated", "c")
    cases = size(200, 2000)
    told = alone(sys.executable, HERE / "damaged.py", folder, tmp_path, cases, SEED, cwd=tmp_path)
    refused, failed, neither = map(int, told.split())
    assert refused + failed + neither == cases and refused > cases // 5


# --- programs


def test_two_simulations_are_commanded_at_a_fixed_rate(
    compiled: Any, export: Export, tmp_path: pathlib.Path
) -> None:
    folder = export("seated", "c")
    told = alone(compiled("loop.cpp", *linked(folder)), folder, 500, cwd=tmp_path)
    first, second = map(float, told.split())
    assert first == pytest.approx(0.0, abs=0.05) and second < first


def test_mujocos_own_headers_play_it(compiled: Any, export: Export, tmp_path: pathlib.Path) -> None:
    """It refers to the callbacks, of which a linked program has a copy of its own."""
    package, folder = pathlib.Path(mujoco.__file__).parent, export("seated", "plugin")
    core = native.mujoco_library()
    program = compiled("headers.c", f"-I{package / 'include'}", str(core), f"-Wl,-rpath,{core.parent}")
    told = float(alone(program, folder / NAME, folder / "model.xml", 1500, cwd=tmp_path))
    simulation = opened(export("seated", "c"))
    simulation.step(1500)  # in which the timer's valves stay as they are at the start
    assert told == simulation.get(ANGLE)
    simulation.close()


LOADED = """
import ctypes, gc, pathlib, sys
import mujoco, numpy as np
folder = sys.argv[1]
core = ctypes.CDLL(str(next(pathlib.Path(mujoco.__file__).parent.glob("libmujoco.so*"))))
slot = ctypes.c_void_p.in_dll(core, "mjcb_act_bias")
mujoco.mj_loadPluginLibrary(folder + "/afo_sim.so")
path = folder + "/model.xml"
model = mujoco.MjModel.from_xml_path(path)
inputs = np.fromfile(folder + "/inputs.bin").reshape(-1, model.nu)[:1500]
def play(data, rows=inputs):
    mujoco.mj_resetDataKeyframe(data.model, data, 0)
    for row in rows:
        data.ctrl[:] = row
        mujoco.mj_step(data.model, data)
    return data.qpos[0]
"""


def plain(text: str, folder: pathlib.Path, cwd: pathlib.Path) -> list[str]:
    """Lines that a program behind LOADED prints."""
    return alone(*code(LOADED + text), folder, cwd=cwd).splitlines()


linux = pytest.mark.skipif(sys.platform != "linux", reason="MuJoCo's library is looked up by its Linux name")


@linux
def test_callbacks_are_in_force_while_data_live(export: Export, tmp_path: pathlib.Path) -> None:
    lines = plain(
        """
import copy, pickle
from mujoco import rollout
told = [slot.value]
data = mujoco.MjData(model)
told.append(slot.value)
for made in (lambda: [copy.copy(data) for _ in range(5)], lambda: pickle.loads(pickle.dumps(data)),
             lambda: copy.deepcopy(model), lambda: mujoco.mj_copyData(mujoco.MjData(model), model, data)):
    made()
    gc.collect()
    told.append(slot.value)
expected = play(data)
kept = mujoco.mjtState.mjSTATE_FULLPHYSICS
mujoco.mj_resetDataKeyframe(model, data, 0)
state = np.zeros(mujoco.mj_stateSize(model, kept))
mujoco.mj_getState(model, data, state, kept)
threads = [mujoco.MjData(model) for _ in range(2)]
states, _ = rollout.rollout(model, threads, np.tile(state, (4, 1)), np.tile(inputs, (4, 1, 1)))
assert np.array_equal(states, np.tile(states[:1], (4, 1, 1)))
assert states[0, -1, 1] == expected, (states[0, -1, 1], expected)
del threads
gc.collect()
told.append(slot.value)
del data
gc.collect()
assert len(set(told[1:])) == 1 and told[1], told
assert told[0] is None and slot.value is None
print(expected)
""",
        export("seated", "plugin"),
        tmp_path,
    )
    simulation = opened(export("seated", "c"))
    simulation.step(1500)
    assert float(lines[0]) == simulation.get(ANGLE)
    simulation.close()


@linux
@pytest.mark.parametrize("order", ["before", "after"])
def test_another_librarys_callback_keeps_its_turn(order: str, export: Export, tmp_path: pathlib.Path) -> None:
    lines = plain(
        f"""
other = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)(lambda *_: 3.25)
theirs = ctypes.cast(other, ctypes.c_void_p).value
def of_others():
    model = mujoco.MjModel.from_xml_string({OTHER!r})
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data.actuator_force[0]
expected = play(mujoco.MjData(model))
if {order == "before"}:
    slot.value = theirs
data = mujoco.MjData(model)
if {order == "after"}:
    slot.value = theirs
try:
    print(play(data) == expected, of_others())
except mujoco.FatalError as error:
    print("callbacks" in str(error), of_others())
del data
gc.collect()
print(slot.value == theirs)
""",
        export("seated", "plugin"),
        tmp_path,
    )
    assert lines == ["True 3.25", "True"]


@linux
def test_a_second_copy_of_the_library_is_no_harm(export: Export, tmp_path: pathlib.Path) -> None:
    """MuJoCo's error within the loader would leave it locked."""
    other = tmp_path / "other"
    other.mkdir()
    shutil.copyfile(export("seated", "plugin") / "afo_sim.so", other / "afo_sim.so")
    lines = plain(
        f"""
import threading
mujoco.mj_loadPluginLibrary({str(other / "afo_sim.so")!r})
thread = threading.Thread(target=lambda: ctypes.CDLL("libm.so.6"))
thread.start()
thread.join()
print(play(mujoco.MjData(model)))
""",
        export("seated", "plugin"),
        tmp_path,
    )
    assert math.isfinite(float(lines[0]))


def test_runs_and_the_plugin_share_a_process(export: Export, runs: Any, tmp_path: pathlib.Path) -> None:
    """A run gives the callbacks back as it knows them; data of the plugin go on."""
    folder = export("seated", "plugin")
    text = f"""
import afo_sim, mujoco
afo_sim.run("seated", {{"duration": "0.1 s"}}, step="fixed")
mujoco.mj_loadPluginLibrary({str(folder / NAME)!r})
model = mujoco.MjModel.from_xml_path({str(folder / "model.xml")!r})
data = mujoco.MjData(model)
mujoco.mj_resetDataKeyframe(model, data, 0)
mujoco.mj_step(model, data, 700)
afo_sim.run("seated", {{"duration": "0.1 s"}}, step="fixed")
mujoco.mj_step(model, data, 800)
print(data.qpos[0])
"""
    done = subprocess.run(
        [sys.executable, "-c", text], capture_output=True, text=True, cwd=tmp_path, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) == runs("seated")[ANGLE][1500]


@linux
@pytest.mark.parametrize("user", ["dm_control", "gymnasium", "viewer"])
def test_others_load_model_xml_alone(user: str, export: Export, tmp_path: pathlib.Path) -> None:
    for package in {"dm_control": ["dm_control"], "gymnasium": ["gymnasium", "imageio"]}.get(user, []):
        pytest.importorskip(package)
    text = {
        "dm_control": """
import os
os.environ["MUJOCO_GL"] = "disable"
from dm_control import mujoco as dm
physics = dm.Physics.from_xml_path(path)
physics.reset(keyframe_id=0)
for row in inputs:
    physics.set_control(row)
    physics.step()
found = physics.data.qpos[0]
""",
        "gymnasium": """
import gymnasium
from gymnasium.envs.mujoco import MujocoEnv
class Env(MujocoEnv):
    metadata = {"render_modes": ["human", "rgb_array", "depth_array", "rgbd_tuple"], "render_fps": 500}
    def reset_model(self):
        mujoco.mj_resetDataKeyframe(self.model, self.data, 0)
        return self.data.qpos.copy()
    def step(self, action):
        self.do_simulation(action, 1)
        return self.data.qpos.copy(), 0.0, False, False, {}
env = Env(path, 1, gymnasium.spaces.Box(-np.inf, np.inf, (1,)))
env.reset()
for row in inputs:
    seen, *_ = env.step(row)
found = seen[0]
""",
        "viewer": """
from mujoco import viewer
found = play(viewer._file_loader(path)()[1])
""",
    }[user]
    lines = plain(text + "\nprint(found == play(mujoco.MjData(model)))", export("seated", "plugin"), tmp_path)
    assert lines[-1] == "True"


# --- FMU


@pytest.fixture(scope="session")
def unzipped(export: Export, tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """The FMU's folder, at a place that a URI has to spell otherwise."""
    folder = tmp_path_factory.mktemp("fmu") / "Füße 100 %41 字"
    with zipfile.ZipFile(export("seated", "fmu")) as archive:
        archive.extractall(folder)
    return folder


class Fmu:
    """An instance of the seated FMU."""

    def __init__(self, folder: pathlib.Path, name: str = "one"):
        fmi2, model = pytest.importorskip("fmpy.fmi2"), pytest.importorskip("fmpy.model_description")
        said = model.read_model_description(str(folder))
        self.numbers = {each.name: each.valueReference for each in said.modelVariables}
        self.own = fmi2.FMU2Slave(
            guid=said.guid, unzipDirectory=str(folder), modelIdentifier="afo_sim", instanceName=name
        )
        self.own.instantiate()
        self.begin()
        self.refused: type[Exception] = importlib.import_module("fmpy.fmi1").FMICallException

    def begin(self) -> None:
        self.own.setupExperiment(startTime=0.0)
        self.own.enterInitializationMode()
        self.own.exitInitializationMode()
        self.now = 0.0

    def step(self, length: float = 0.002) -> None:
        self.own.doStep(currentCommunicationPoint=self.now, communicationStepSize=length)
        self.now += length

    def get(self, name: str) -> float:
        return self.own.getReal([self.numbers[name]])[0]

    def set(self, name: str, value: float) -> None:
        self.own.setReal([self.numbers[name]], [value])

    def close(self) -> None:
        self.own.terminate()
        self.own.freeInstance()


@pytest.fixture
def fmu(unzipped: pathlib.Path) -> Iterator[Fmu]:
    pytest.importorskip("fmpy")
    found = Fmu(unzipped)
    yield found
    found.close()


def test_an_fmu_is_valid_and_runs_as_the_run(export: Export, runs: Any) -> None:
    fmpy, validation = pytest.importorskip("fmpy"), pytest.importorskip("fmpy.validation")
    path, run = str(export("seated", "fmu")), runs("seated")
    assert validation.validate_fmu(path) == []
    names = [each.name for each in fmpy.read_model_description(path).modelVariables]
    names = [name for name in names if name in run.columns and name not in (COIL, OUTLET)]
    found = fmpy.simulate_fmu(path, output=names, output_interval=0.002)
    assert len(found) == 8001 and len(names) > 8
    assert np.array_equal(found[ANGLE][:8000], run[ANGLE])
    pressure = run[PRESSURE]
    assert np.array_equal(found[PRESSURE][1:], pressure)


def test_inputs_of_an_fmu_move_it(export: Export) -> None:
    fmpy = pytest.importorskip("fmpy")
    kinds = [("time", float), (COIL, float), (OUTLET, float)]
    signal = np.array([(0.0, 0.0, 1.0), (1.0, 0.0, 1.0), (1.0, 1.0, 0.0), (3.0, 1.0, 0.0)], dtype=kinds)
    found = fmpy.simulate_fmu(
        str(export("seated", "fmu")), input=signal, output=[PRESSURE], stop_time=3.0, output_interval=0.01
    )
    assert abs(found[PRESSURE][found["time"] < 1.0]).max() < 1e3 and found[PRESSURE][-1] > 3e5


def test_instances_are_independent_and_reset(fmu: Fmu, unzipped: pathlib.Path, runs: Any) -> None:
    other = Fmu(unzipped, "other")
    other.set(COIL, 0.0)
    for k in range(1, 1001):
        fmu.step()
        other.step()
        if k % 100 == 0:
            assert fmu.get(ANGLE) == runs("seated")[ANGLE][k]
    assert other.get(PRESSURE) < 1e3 < fmu.get(PRESSURE)
    other.own.reset()
    other.begin()
    other.step(2.0)
    assert other.get(ANGLE) == fmu.get(ANGLE)
    other.close()


def test_states_of_an_fmu_come_again(fmu: Fmu) -> None:
    fmu.step(1.0)
    kept = fmu.own.getFMUState()
    text = fmu.own.serializeFMUState(kept)
    fmu.step(0.2)
    expected = [fmu.get(name) for name in (ANGLE, PRESSURE)]
    for k in range(1000):
        state = fmu.own.deSerializeFMUstate(text) if k % 2 else kept
        fmu.own.setFMUState(state)
        fmu.now = 1.0
        if k % 2:
            fmu.own.freeFMUState(state)
        again = fmu.own.getFMUState()
        assert fmu.own.serializeFMUState(again) == text
        fmu.own.freeFMUState(again)
        if k % 50 == 0:
            fmu.step(0.2)
            assert [fmu.get(name) for name in (ANGLE, PRESSURE)] == expected
    fmu.own.freeFMUState(kept)


@pytest.mark.parametrize(
    ("now", "length"),
    [(0.0, 0.003), (0.0, 0.0021), (0.0, math.nan), (0.0, -0.002), (0.1, 0.002), (-1.0, 0.002)],
)
def test_a_step_that_an_fmu_cannot_take_is_refused(fmu: Fmu, now: float, length: float) -> None:
    begun = fmu.get("chamber/plantarflexor/mass")
    with pytest.raises(fmu.refused):
        fmu.own.doStep(currentCommunicationPoint=now, communicationStepSize=length)
    assert fmu.get("chamber/plantarflexor/mass") == begun
    fmu.step(0.01)


def test_an_fmu_does_not_take_a_step_back(fmu: Fmu) -> None:
    fmu.step(1.0)
    with pytest.raises(fmu.refused):
        fmu.own.doStep(currentCommunicationPoint=0.0, communicationStepSize=0.01)


def test_what_an_fmu_has_not_is_refused(fmu: Fmu) -> None:
    for refused in (
        lambda: fmu.own.setReal([fmu.numbers[ANGLE]], [0.0]),
        lambda: fmu.own.getReal([10_000]),
        lambda: fmu.own.setReal([10_000], [0.0]),
        lambda: fmu.set(COIL, math.nan),
        lambda: fmu.own.getInteger([0]),
        lambda: fmu.own.setFMUState(None),
    ):
        with pytest.raises(fmu.refused):
            refused()
    fmu.set(SUPPLY, -5e5)
    with pytest.raises(fmu.refused):
        fmu.step()


@pytest.mark.parametrize("uri", ["", "file:", "file:///", "file:///nowhere%", "file:///nowhere%4", "%zz%"])
def test_an_fmu_without_its_folder_is_refused(uri: str, unzipped: pathlib.Path) -> None:
    own = ctypes.CDLL(str(next(unzipped.glob("binaries/*/afo_sim.*"))))
    own.fmi2Instantiate.restype = ctypes.c_void_p
    assert own.fmi2Instantiate(b"it", 1, b"", uri.encode(), None, 0, 0) is None


def test_instances_may_have_threads(unzipped: pathlib.Path) -> None:
    pytest.importorskip("fmpy")
    found: dict[int, float] = {}
    # FMPy changes the process's folder while it loads a library: in two threads at once it would stay there.
    instances = [Fmu(unzipped, str(k)) for k in range(4)]

    def play(k: int) -> None:
        for _ in range(20):
            instances[k].step(0.1)
        found[k] = instances[k].get(ANGLE)

    threads = [threading.Thread(target=play, args=[k]) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for each in instances:
        each.close()
    assert len(found) == 4 and len(set(found.values())) == 1


def commands(folder: pathlib.Path) -> bytes:
    """What an exported folder plays."""
    return (folder / "inputs.bin").read_bytes()


def test_a_run_that_was_recorded_rarely_keeps_its_timer(export: Export, tmp_path: pathlib.Path) -> None:
    export("seated", "c")  # skips where there is no library
    rarely = afo_sim.run("seated", {"duration": "1 s", "record_rate": "10 Hz"}, step="fixed")
    write_elsewhere(rarely, "plugin", tmp_path / "run")
    write_elsewhere("seated", "plugin", tmp_path / "scenario", {"duration": "1 s"})
    assert commands(tmp_path / "run") == commands(tmp_path / "scenario")


def test_what_is_set_of_a_run_is_refused(export: Export, tmp_path: pathlib.Path) -> None:
    export("seated", "c")
    run = afo_sim.run("seated", {"duration": "0.1 s"}, step="fixed")
    with pytest.raises(InputError) as refused:
        write_elsewhere(run, "plugin", tmp_path / "run", {"supply.pressure": "2 bar"})
    assert refused.value.field == "set"


def test_a_run_is_exported_with_the_step_that_it_took(export: Export, tmp_path: pathlib.Path) -> None:
    export("seated", "c")
    sets = {"duration": "0.6 s", "timestep": "4 ms"}
    run = afo_sim.run("seated", sets, step="controlled")
    taken = run.studies["time_step"]["step"]
    assert taken < run.studies["time_step"]["asked"]  # else this tests nothing
    write_elsewhere(run, "plugin", tmp_path / "run")
    _, notes = write_elsewhere("seated", "plugin", tmp_path / "scenario", sets)
    rows = len(commands(tmp_path / "run")) / len(commands(tmp_path / "scenario"))
    assert rows == run.studies["time_step"]["asked"] / taken and len(notes) == 1 + len(
        build(load("scenario", "seated", sets)).warnings
    )


def test_a_supply_behind_a_regulator_is_its_line() -> None:
    sets = {"supply.regulator": "ir2010", "supply.line_pressure": "7 bar"}
    built = build(load("scenario", "seated", sets))
    names = {each.name: each.start for each in variables_of(built, controls(built, 1)[0])}
    assert names["supply/line_pressure"] == 7e5 and "supply/pressure" not in names


def test_an_export_names_what_cannot_exist(export: Export, tmp_path: pathlib.Path) -> None:
    export("seated", "c")  # skips where there is no library
    sets = {"leg.body_mass": "290 kg", "duration": "0.1 s"}
    told = build(load("scenario", "seated", sets)).warnings
    _, notes = write_elsewhere("seated", "plugin", tmp_path / "out", sets)
    assert "leg.body_mass" in {each.subject.split()[0] for each in told} and set(map(str, told)) < set(notes)
