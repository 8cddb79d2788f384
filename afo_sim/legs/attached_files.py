"""A model with orthoses as files: MJCF with all its digits, its meshes, and a sidecar with the parameters."""

import dataclasses
import pathlib
import shutil
import tomllib
from xml.sax.saxutils import quoteattr

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import (
    InputError,
    JsonDict,
    JsonMapping,
    assets,
    check_text,
    parse_toml,
    read_text,
    together,
    write_bytes,
    write_sealed,
    write_text,
)
from afo_sim.description import Orthosis, load, toml_text
from afo_sim.description.portable import portable
from afo_sim.legs.attached import Attached
from afo_sim.legs.attached_spec import compiled, own_spec
from afo_sim.legs.attaching import completed
from afo_sim.legs.finding import Found
from afo_sim.legs.mjcf import files_of
from afo_sim.model import circuit_of, endless, exact_xml

VERSION = 2  # of the sidecar
ARRAYS = ("centre", "axes")
HEAD = """
  {name}: with the orthosis {devices}, added by afo-sim.
  The callbacks of afo_sim compute the forces of its muscles, by their user= and {sidecar}. In Python:
      from afo_sim.legs import read_attached; leg = read_attached("{file}"); data = leg.data()
      with leg.callbacks(): step leg.model and data as ever
  Loaded by MuJoCo alone, its muscles carry no force (they are limp) without any message.
"""


def write_attached(
    attached: Attached, path: str | pathlib.Path, *, force: bool = False, mjb: bool = False
) -> list[pathlib.Path]:
    """Write a model with all its orthoses as MJCF, with what `read_attached` reads again to the bit."""
    path = pathlib.Path(path)
    if path.suffix != ".xml":
        problem = "is not a valid name of an MJCF file"
        raise InputError(problem, field="out", value=str(path), allowed="NAME.xml")
    names = [path.name, f"{path.stem}.toml", *([f"{path.stem}.mjb"] if mjb else [])]
    for name in names if not force else ():
        if (there := path.parent / name).exists():
            raise InputError("is there already", field="out", value=str(there), allowed="--force")
    with together(path.parent) as scratch:
        text = mjcf_beside(attached.spec, path.stem, scratch)
        worn = [f"{leg.orthosis.name} on {next(iter(leg.bodies.values()))}" for leg in attached.legs.values()]
        facts = {"name": attached.spec.modelname, "sidecar": names[1], "file": path.name}
        head = HEAD.format(devices=", ".join(worn), **facts).replace("--", "- -")
        write_text(scratch / path.name, f"<!--{head}-->\n{text}")
        table = {"version": VERSION, "model": path.name, "leg": _legs(attached, path, scratch)}
        write_sealed(scratch / names[1], toml_text(table), "worn model", scratch)
        if mjb:
            mujoco.mj_saveModel(attached.model, str(scratch / names[2]))
        written = [file.relative_to(scratch) for file in sorted(scratch.rglob("*")) if file.is_file()]
    return [path.parent / file for file in written]


def read_attached(path: str | pathlib.Path) -> Attached:
    """The model that `attach` has written beside a NAME.toml, with exact parameters, as its first leg's."""
    path = pathlib.Path(path)
    sidecar = path.with_suffix(".toml")
    spec, _, _ = own_spec(path)
    if not sidecar.is_file():
        problem = "is missing: the muscles' parameters stand in it"
        raise InputError(problem, file=sidecar, allowed="the files that afo-sim attach has written")
    try:
        table = parse_toml(check_text(read_text(sidecar), sidecar))
        legs = table["leg"]
        if table["version"] != VERSION:
            problem = f"is of version {table['version']}, and this program reads {VERSION}"
            raise InputError(problem, file=sidecar, field="version")
        model = compiled(spec, path)
        return completed([_leg(leg, model, spec, sidecar) for leg in legs])[0]
    except (UnicodeDecodeError, ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
        problem = f"does not belong to {path.name}, or is damaged ({error})"
        raise InputError(problem, file=sidecar, allowed="the files that afo-sim attach has written") from None


def _leg(table: JsonMapping, model: mujoco.MjModel, spec: mujoco.MjSpec, sidecar: pathlib.Path) -> Attached:
    facts = dict(table["found"])
    arrays = {name: np.array(facts.pop(name)) for name in ARRAYS}
    empty = {f.name: None for f in dataclasses.fields(Found) if f.name not in facts and f.name not in arrays}
    tuples = {name: tuple(facts.pop(name)) for name in ("welded", "notes")}
    found = Found(**{**empty, **facts, **arrays, **tuples})
    description = dict(table["orthosis"])
    for kind in ("cuff", "plate"):
        if kind in description:
            description[kind] = assets.file_beside(description[kind], sidecar)
    device: Orthosis = load("orthosis", description)
    joints = tuple(table["joints"])
    inverts = joints != (found.ankle,)
    circuit = circuit_of(device, found.ankle, inverts=inverts, supply=endless(table["supply"]))
    bodies, prefix, told = dict(table["bodies"]), table["prefix"], tuple(table["told"])
    ids, first, supply = native.circuit_ids(model, circuit, prefix), table["userdata"], table["supply"]
    if not 0 <= first <= model.nuserdata - circuit.userdata:
        raise ValueError(f"userdata {first} is beyond the model's {model.nuserdata}")
    return Attached(model, spec, device, found, bodies, joints, prefix, supply, circuit, ids, first, told)


def _legs(attached: Attached, path: pathlib.Path, scratch: pathlib.Path) -> list[JsonDict]:
    """Every leg's orthosis as plain data."""
    rows = []
    for leg in attached.legs.values():
        folder = f"{path.stem}_files/{leg.prefix}orthosis"
        table = {"orthosis": leg.orthosis.model_dump(mode="json", exclude_none=True)}
        device = portable(table, path.parent / folder, scratch / folder)["orthosis"]
        for kind in ("cuff", "plate"):
            if (scratch / folder / str(device.get(kind))).is_file():
                device[kind] = f"{folder}/{device[kind]}"
        facts = {f.name: getattr(leg.found, f.name) for f in dataclasses.fields(Found)}
        found = {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in facts.items()}
        row = {"prefix": leg.prefix, "supply": leg.supply, "userdata": leg.userdata, "bodies": leg.bodies}
        row |= {"joints": list(leg.joints), "told": list(leg.notices), "found": found, "orthosis": device}
        rows.append(row)
    # without None, which TOML lacks, tuples as lists, and sources beside their values
    return [tomllib.loads(toml_text(row)) for row in rows]


def mjcf_beside(spec: mujoco.MjSpec, stem: str, scratch: pathlib.Path) -> str:
    """MJCF with all digits; it names copies of the meshes and pictures, which are made in STEM_files."""
    taken, text = dict[str, str](), exact_xml(spec)
    cubes = [file for texture in spec.textures for file in texture.cubefiles if file]
    for file in [*(file for _, file, _ in files_of(spec)), *cubes]:
        if file in taken:
            continue
        name = f"{len(taken) + 1}_{pathlib.Path(file).name}"
        target = scratch / f"{stem}_files" / name
        target.parent.mkdir(exist_ok=True)
        if file in spec.assets:
            write_bytes(target, spec.assets[file])
        elif pathlib.Path(file).is_file():
            shutil.copyfile(file, target)
        else:
            raise InputError("there is no such file", file=file)
        taken[file] = f"{stem}_files/{name}"
    for file, name in taken.items():
        text = text.replace(f"file={quoteattr(file)}", f"file={quoteattr(name)}")
        for side in ("right", "left", "up", "down", "front", "back"):
            text = text.replace(f"file{side}={quoteattr(file)}", f"file{side}={quoteattr(name)}")
    return text
