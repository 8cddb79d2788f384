"""Build hook: the kernels become a library, for a wheel and for an editable install alike.

numba compiles them, the C of `afo_sim/native/library` makes them a plugin of MuJoCo's and an FMU, and a C
compiler links both: the machine's own, or else that of the package ziglang. A wheel carries the library,
models/ and gait_data/ inside the package; an editable install reads the checkout. AFO_SIM_PURE=1 makes a
wheel for every platform, without the library.
"""

import base64
import hashlib
import importlib
import importlib.metadata
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from packaging.tags import platform_tags

fcntl: Any = importlib.import_module("fcntl") if os.name == "posix" else None
IMPORTS = {"lazy-loader", "mujoco", "numba", "numpy", "pydantic"}  # of the core's dependencies, by PROGRAM
PROGRAM = """
import sys
sys.path.insert(0, sys.argv[1])  # pip takes folders of editable installs out of PYTHONPATH
from afo_sim.model import contact, muscle_weakness
from afo_sim.common import machine_code, user_cache
from afo_sim.metrics import kernel
from afo_sim.native import between_strides, compiled, sensing, slots, struct_layout
from afo_sim.physics import curves, energy, in_series, jitable
from afo_sim.simulation import settle
loads = compiled.callbacks, compiled.planar_steps, kernel.compiled, *jitable.KERNELS
part, header = sys.argv[2], struct_layout.c_header(slots.N_USER, slots.THIS_LAYOUT)
if part != "there":
    user_cache.BROUGHT = ()
elif machine_code._brought().get("header") == header:
    machine_code._compile = lambda *told: sys.exit(1)
else:
    sys.exit(1)
half = 2  # of the time; steps of a walker call what the callbacks call
for load in {"there": loads, "callbacks": loads[:half], "others": loads[half:]}[part]:
    load()
if part == "callbacks":
    print(machine_code.LIBRARY, header, sep=chr(10), end="")
"""
# Code for whatever processor, in a library that is loaded without changes to its text.
ANY_PROCESSOR = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
PURE = os.environ.get("AFO_SIM_PURE") == "1"
WARNINGS = ["-Wall", "-Wextra", "-Wno-unused-parameter"]
LINK = ["-std=c11", "-O2", *WARNINGS, "-fPIC", "-fvisibility=hidden", "-shared"]
LINUX = ["-Wl,-z,defs", "-Wl,-z,noexecstack", "-Wl,-Bsymbolic", "-lm", "-ldl"]


class DataFolders(BuildHookInterface):
    def dependencies(self) -> list[str]:
        if PURE:
            return []
        own = [each.partition(";")[0] for each in self.metadata.core.dependencies]
        own = [each for each in own if re.split(r"[<>=]", each)[0] in IMPORTS]
        return own if compiler() else [*own, "ziglang>=0.13"]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        root = pathlib.Path(self.root)
        folders = ["models", "gait_data"] if PURE else ["models", "gait_data", "machine_code"]
        try:
            if not PURE:
                compile_kernels(root)
        except (OSError, subprocess.CalledProcessError) as error:
            self.app.display_warning(f"{error}: no machine code is shipped; the first run compiles its own")
        if version != "standard":
            return
        if not PURE and (root / "machine_code" / "content.json").is_file():  # for a platform, and any Python
            own = next(tag for tag in platform_tags() if not tag.startswith(("manylinux", "musllinux")))
            build_data |= {"pure_python": False, "tag": f"py3-none-{own}"}
        for name in folders:
            for path in sorted((root / name).rglob("*")):
                if path.is_file() and path.suffix != ".png":  # pictures are the documents'
                    build_data["force_include"][str(path)] = f"afo_sim/{path.relative_to(root).as_posix()}"
        self.list_parts(build_data)

    def list_parts(self, build_data: dict[str, Any]) -> None:
        """Have the wheel carry its bill of materials; what serves developers alone is left out."""
        sys.path.append(str(pathlib.Path(self.root, "scripts")))
        from sbom import bill

        core, root = self.metadata.core, pathlib.Path(self.root)
        needs = {"": core.dependencies, **core.optional_dependencies}
        needs = {extra: needs[extra] for extra in needs if extra not in ("all", "docs", "test")}
        files = [pathlib.Path(each).relative_to(root).as_posix() for each in build_data["force_include"]]
        self.scratch = tempfile.TemporaryDirectory()
        file = pathlib.Path(self.scratch.name, f"{core.name}.cdx.json")
        file.write_bytes(bill(root, core.name, core.version or self.metadata.version, needs, files))
        build_data["sbom_files"].append(str(file))


def compiler() -> list[str]:
    """The command of this machine's C compiler; none where it has none."""
    names = [os.environ.get("CC", "cc"), "gcc", "clang"]
    return next(([found] for name in names if (found := shutil.which(name))), [])


def compile_kernels(root: pathlib.Path) -> None:
    """The library in a checkout's folder `machine_code`, with what it holds; one of these sources stays.

    Whoever loads it knows by its digest whether it is whole, and by the keys whether it is of these sources.
    """
    root = root.resolve()
    there = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    with alone_in(root), tempfile.TemporaryDirectory(prefix=".machine_code-", dir=root) as scratch:

        def started(part: str, **how: Any) -> subprocess.Popen[str]:
            own = pathlib.Path(scratch, part)  # a folder of its own: one locks its folder
            own.mkdir(mode=0o700)
            environment = there | ANY_PROCESSOR | {"AFO_SIM_CACHE": str(own)}
            command = [sys.executable, "-P", "-c", PROGRAM, str(root), part]
            return subprocess.Popen(command, env=environment, cwd=scratch, text=True, **how)

        if started("there", stderr=subprocess.DEVNULL).wait() == 0:
            return
        parts = [started(part, stdout=subprocess.PIPE) for part in ("callbacks", "others")]  # side by side
        printed = [process.communicate()[0] for process in parts]
        if failed := [process.args for process in parts if process.returncode]:
            raise subprocess.CalledProcessError(1, failed[0])
        link(root, pathlib.Path(scratch), *printed[0].split("\n", 1))


@contextmanager
def alone_in(root: pathlib.Path) -> Iterator[None]:
    """A block that one build of a checkout at a time is in: the others find what it has made."""
    if fcntl is None:
        yield
        return
    lock = os.open(root, os.O_RDONLY)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
    finally:
        os.close(lock)


def link(root: pathlib.Path, scratch: pathlib.Path, name: str, header: str) -> None:
    """Link what was compiled in a folder with the C around it, and write what the library holds."""
    objects, kinds = [], {}
    for made in sorted(scratch.glob("*/*-*")):  # KIND-KEY: a digest, then symbol, object file, needs of each
        kind, key = made.name.split("-")
        codes = json.loads(made.read_bytes()[hashlib.sha256().digest_size :])
        kinds[kind] = [key, len(codes)]
        for symbol, text, needs in codes:
            if any(need.startswith("numba.dynamic") for need in needs):
                raise OSError(f"{kind} holds an address of the process that compiled it")
            objects.append(scratch / f"{symbol}.o")
            objects[-1].write_bytes(base64.b64decode(text))
    (scratch / "places.h").write_text(header)
    sources = sorted((root / "afo_sim/native/library").glob("*.c"))
    command = compiler() or [sys.executable, "-m", "ziglang", "cc"]
    own = ["-Wl,-z,text"] * len(compiler())  # ziglang's linker does it unasked, and knows no such word
    extra = [*LINUX, *own] if sys.platform == "linux" else []
    command += [*LINK, f"-I{scratch}", *map(str, (*sources, *objects)), *extra, "-o", str(scratch / name)]
    subprocess.run(command, check=True)
    digest = hashlib.sha256((scratch / name).read_bytes()).hexdigest()
    version = [*command[: command.index(LINK[0])], "--version"]
    by = {"C compiler": subprocess.run(version, capture_output=True, text=True).stdout.partition("\n")[0]}
    by |= {each: importlib.metadata.version(each) for each in ("llvmlite", "mujoco", "numba")}
    by |= {"linked, dynamically": " ".join(each for each in extra if each.startswith("-l"))}
    said = json.dumps({"sha256": digest, "kinds": kinds, "header": header, "made": by})
    (scratch / "content.json").write_text(said)
    folder = root / "machine_code"
    folder.mkdir(exist_ok=True)
    for old in {each.name for each in folder.iterdir()} - {name, "content.json"}:
        (folder / old).unlink(missing_ok=True)
    for file in (name, "content.json"):  # another file, not other content: what is there may be running
        (scratch / file).replace(folder / file)
