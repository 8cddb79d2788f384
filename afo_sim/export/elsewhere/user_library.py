"""Laws and frictions of a user's own as a library beside the package's, which finds it there."""

import os
import pathlib
import shutil
import sys
import tempfile

import mujoco

from afo_sim import native
from afo_sim.common import InputError, complaint, machine_code, write_bytes, write_text

NAME = "afo_sim_user.so"
_WHOLE = ("-Wl,-z,defs",) if sys.platform == "linux" else ()  # nothing of it stands in another library


def link_user_library(model: mujoco.MjModel, folder: pathlib.Path) -> None:
    """Write the library of what a model's rows ask for; nothing where all of it is shipped."""
    asked = native.user_kernels(model)
    codes = {key: code for key, (code, _) in machine_code.USER_CODES.items() if key[0] in asked}
    if not codes:
        return
    found = next(filter(None, map(shutil.which, (os.environ.get("CC", "cc"), "gcc", "clang"))), None)
    if found is None or sys.platform == "win32":
        problem = "your own law or friction needs a C compiler to be linked, but none was found"
        raise InputError(problem, field="to", allowed="with gcc or clang installed, on Linux and macOS")
    with tempfile.TemporaryDirectory() as scratch:
        objects, entries, names = [], [], [code.symbol for code in codes.values()]
        for k, ((number, gives), code) in enumerate(codes.items()):
            objects.append(pathlib.Path(scratch, f"{k}.o"))
            write_bytes(objects[-1], code.binary)
            entries.append(
                f"t[{3 * k}] = {number}; t[{3 * k + 1}] = {gives}; t[{3 * k + 2}] = (int64_t){code.symbol};"
            )
        declared = "".join(f"double {name}(void);\n" for name in names)
        text = f"#include <stdint.h>\n{declared}void afo_sim_user(int64_t *t) {{ {' '.join(entries)} }}\n"
        source = pathlib.Path(scratch, "user.c")
        write_text(source, text)
        command = [found, "-shared", "-fPIC", "-O2", str(source), *map(str, objects), "-lm", *_WHOLE]
        command += ["-o", str(folder / NAME)]
        if said := complaint(command, pathlib.Path(scratch)):
            raise InputError(f"your own law cannot be linked: {said}", field="to")
