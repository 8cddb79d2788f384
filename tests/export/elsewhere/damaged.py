"""Open and step a folder whose files are damaged at random: python damaged.py FOLDER SCRATCH CASES SEED.

Prints how often it was refused, how often a step failed, and how often neither. Whatever it is, the process
lives, and the folder as it was gives the same bits afterwards.
"""

import pathlib
import random
import shutil
import sys

import exported_library as library

FILES = ("model.xml", "start.bin", "inputs.bin", "variables.txt")
folder, scratch, cases, seed = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), *map(int, sys.argv[3:])
whole = {name: (folder / name).read_bytes() for name in FILES}
own, draw, counts = library.loaded(folder), random.Random(seed), [0, 0, 0]


def damaged(content: bytes) -> bytes:
    changed, kind = bytearray(content), draw.randrange(4)
    if kind == 0:
        return bytes(changed[: draw.randrange(len(changed))])
    for _ in range(1 if kind < 3 else draw.randrange(1, 40)):
        place = draw.randrange(len(changed))
        changed[place] = draw.choice(b"0123456789.-e\t\n\0<") if kind == 1 else draw.randrange(256)
    return bytes(changed)


def played(at: pathlib.Path) -> float:
    simulation = library.Simulation(at, own)
    try:
        simulation.step(20)
        return simulation.get("ankle/angle")
    finally:
        simulation.close()


expected = played(folder)
for name in FILES:
    shutil.copyfile(folder / name, scratch / name)
for _ in range(cases):
    name = draw.choice(FILES)
    (scratch / name).write_bytes(damaged(whole[name]))
    try:
        played(scratch)
        counts[2] += 1
    except library.Failed as error:
        assert str(error), name
        counts[0 if str(scratch) in str(error) else 1] += 1
    (scratch / name).write_bytes(whole[name])
assert played(scratch) == expected
print(*counts)
