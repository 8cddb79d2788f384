"""Files to start from: a new description of any kind, complete and commented, that runs as it is."""

import os
import pathlib
import re
import shutil
from collections.abc import Mapping
from typing import Any

from afo_sim.common import InputError, assets, check_writable, parse_quantity, replacing, write_text
from afo_sim.description.handmade import muscle_values
from afo_sim.description.reader import load
from afo_sim.description.schema import SPECS
from afo_sim.description.template import Template
from afo_sim.description.tree import FILES

# The shipped product whose numbers a new file has, and those that show what else it may hold.
_LIKE = {
    "muscle": "s1_215mm",
    "orthosis": "s1",
    "valve": "mh1",
    "tube": "pun_4x2_5",
    "source": "bottle_0_5l",
    "regulator": "vppe_3_1_1_8_6",
    "leg": "adult_75kg",
    "patient": "drop-foot",
    "shoe": "trainer",
    "limits": "usual",
    "sensor": "gp2y0a41",
    "scenario": "seated",
}
_SHOWN = {"muscle": ("serres_2009",), "orthosis": ("arm",), "scenario": ("walk-dropfoot-afo", "seated")}
_OWN = {"muscle": ("covariance",)}  # what a product has of its own measurements, and one like it has not
# Examples of keys that no shipped product sets, or that are a product's own.
_EXAMPLES: dict[str, dict[str, Any]] = {
    "muscle": {
        "free_contraction": 0.2,
        "blocked_force": "400 N",
        "covariance": {
            "law": "tondu_lopez_2000_bladder",
            "parameters": ["braid_angle", "laws.tondu_lopez_2000_bladder.bladder_force"],
            "standard_errors": ["3 deg", "50 N"],
            "correlation": [[1.0, -0.9], [-0.9, 1.0]],
            "freedom": 20,
        },
        "lengths": {
            "reference": "21.5 cm",
            "shortest": "4 cm",
            "longest": "9 m",
            "mass_per_length": "94 g/m",
            "force": {
                "slope": "19.03 m^-1",
                "offset": "7.5 mm",
                "shortest": "112 mm",
                "longest": "518 mm",
            },
        },
    },
    "orthosis": {
        "muscle": {
            "flexor": {
                "chamber": "dorsiflexor",
                "path": [
                    {
                        "segment": "shank",
                        "from_joint": ["6.5 cm", "0 cm", "5 cm"],
                        "surface": {"shape": "cylinder", "radius": "1.5 cm", "axis": [0.0, 1.0, 0.0]},
                    }
                ],
            }
        },
        "anchor": {
            "shank": {"stiffness": "4 kN/m", "stiffening": {"force": "33 N", "length": "17 mm"}},
        },
        "chamber": {
            "dorsiflexor": {
                "tube": "pun_4x2_5",
                "tube_length": "1 m",
                "quick_exhaust": {
                    "conductance": "0.3 dm^3/(s*bar)",
                    "critical_ratio": 0.3,
                    "exhaust_conductance": "0.6 dm^3/(s*bar)",
                    "cracking_pressure": "0.05 bar",
                },
            }
        },
        "volume": {"manifold": {"volume": "20 ml", "wall_conductance": "0.1 W/K", "start_pressure": "4 bar"}},
        "restriction": {
            "feed": {
                "kind": "tube",
                "upstream": "supply",
                "downstream": "manifold",
                "tube": "pun_4x2_5",
                "length": "1 m",
                "valve": "mh1",
                "regulator": "vppe_3_1_1_8_6",
                "pressure": "3 bar",
                "conductance": "0.1 dm^3/(s*bar)",
                "critical_ratio": 0.3,
                "check_conductance": "0.2 dm^3/(s*bar)",
                "exhaust_conductance": "0.2 dm^3/(s*bar)",
                "cracking_pressure": "0.1 bar",
            }
        },
    },
    "leg": {
        "body_mass": "75 kg",
        "body_height": "1.75 m",
        "shank_length": "43 cm",
        "foot_length": "26 cm",
    },
    "patient": {"body_mass": "75 kg", "body_height": "1.75 m"},
    "source": {
        "mass": "1 kg",
        "content": "16 g",
        "switch_on": "6 bar",
        "switch_off": "7 bar",
        "free_air_delivery": "10 l/min",
        "delivery_pressure": "0 bar",
        "stall_pressure": "9 bar",
        "electric_power": "40 W",
    },
    "regulator": {"relief": "0.3 bar", "relief_conductance": "0.5 dm^3/(s*bar)"},
    "valve": {
        "nominal_flow": {"flow": "14 l/min", "norm": "ANR", "upstream": "6 bar", "downstream": "5 bar"},
        "cv": 0.015,
        "kv": 0.013,
        "sonic_area": "0.28 mm^2",
        "orifice": "0.66 mm",
        "exhaust": {
            "critical_ratio": 0.3,
            "nominal_flow": {"flow": "10 l/min", "norm": "ANR", "upstream": "6 bar", "downstream": "5 bar"},
            "conductance": "0.039 dm^3/(s*bar)",
        },
        "bandwidth": "80 Hz",
        "dead_band": 0.02,
        "minimum_on_time": "5 ms",
        "rated_switches": 1e8,
        "working_pressure": ["0 bar", "8 bar"],
        "mass": "30 g",
        "power": "1 W",
    },
    "sensor": {
        "gain": 1.01,
        "offset": "1 mm",
        "drift": "1 mm/s",
        "hysteresis": "2 mm",
        "lowpass": "100 Hz",
        "delay": "5 ms",
        "threshold": "20 cm",
        "debounce": "10 ms",
        "calibration": {"assumed_slope": "10 V*cm", "assumed_intercept": "0.1 V"},
    },
    "scenario": {
        "gait": {"stride_time": "1.2 s"},
        "sensor": {
            "pressure": {
                "column": "chamber/dorsiflexor/pressure",
                "type": "mpx5700",
                "gain": 1.01,
                "offset": "0.02 bar",
                "drift": "1 Pa/s",
                "hysteresis": "0.01 bar",
                "lowpass": "100 Hz",
                "rate": "250 Hz",
                "noise": "10 mbar",
                "minimum": "0 bar",
                "maximum": "7 bar",
                "resolution": "5 mV",
                "delay": "4 ms",
                "threshold": "1 bar",
                "debounce": "10 ms",
                "calibration": {
                    "slope": "6.43 mV/kPa",
                    "intercept": "0.2 V",
                    "shape": "linear",
                    "assumed_slope": "6.5 mV/kPa",
                    "assumed_intercept": "0.2 V",
                },
            }
        },
        "load_moment": "1 N*m",
        "record_rate": "500 Hz",
        "side": "left",
        "controller": {
            "state_machine": {
                "state": {"swing": {"dorsiflexor": "inlet"}},
                "transition": [
                    {"state": "swing", "to": "stance", "column": "foot/heel_load", "above": "50 N"}
                ],
            }
        },
        "drive": {"dorsiflexor": {"kind": "bang_bang"}},
    },
}
# Keys under which a file names other descriptions.
_PLACES: dict[str, dict[str, tuple[str, ...]]] = {
    "orthosis": {"muscle": ("muscle", "type"), "valve": ("chamber", "inlet", "outlet")},
    "scenario": {"leg": (), "orthosis": (), "patient": (), "shoe": (), "limits": ()},
}
_NAME = r"[A-Za-z0-9][\w.-]*"


def new(
    kind: str,
    name: str,
    out: str | os.PathLike[str] = ".",
    *,
    like: str = "",
    uses: Mapping[str, str] | None = None,
    braid: Mapping[str, str] | None = None,
) -> pathlib.Path:
    """Write a commented description that runs as it is."""
    target = target_of(kind, name, pathlib.Path(out))
    base = base_of(kind, like or _LIKE[kind])
    values, examples = assets.read_toml(base), _examples(kind)
    for key in _OWN.get(kind, ()):
        values.pop(key, None)
    if braid:
        _check_braid(kind, like, braid)
        values = muscle_values(braid, values)
    for used, where in (uses or {}).items():
        _use(values, kind, used, reference(used, where, target.parent))
    if kind == "orthosis" and "muscle" in (uses or {}):
        _fit_links(values, assets.read_toml(base), (uses or {})["muscle"])
    files = _beside(kind, values, base)
    begun = f"begun from {like or _LIKE[kind]}"
    if braid:
        begun = f"hand-made braid of {braid['bore']}, {braid['braid_angle']}, {braid['length']}: not measured"
    values["description"] = f"{name}, {begun}"
    template = Template(_chambers(kind, values, target))
    text = template.text(SPECS[kind], values, examples, f"{name}: {kind}.")
    check_writable(target.parent)
    _write(target, text, kind, files)
    return target


def _check_braid(kind: str, like: str, braid: Mapping[str, str]) -> None:
    """Refuse a braid's numbers for what is no muscle, or beside another one's."""
    first = next(iter(braid))
    if kind != "muscle":
        raise InputError(f"does not go with a new {kind}", field=first, allowed="a new muscle")
    if like:
        raise InputError("does not go with `like`, whose braid it would have", field=first)


def _beside(kind: str, values: dict[str, Any], base: pathlib.Path) -> dict[str, pathlib.Path]:
    """Files that a product names, by their name beside it; a product may name another product's."""
    files = {}
    for key in FILES.get(kind, ()):
        if key in values:
            source = base.parent / str(values[key])
            values[key] = source.name
            files[source.name] = source
    return files


def base_of(kind: str, like: str) -> pathlib.Path:
    """The file that a new product is like; an unknown name is the argument `like`'s."""
    try:
        return assets.find(kind, like)
    except InputError as error:
        raise error.renamed(lambda _: "like", str) from None


def target_of(kind: str, name: str, out: pathlib.Path) -> pathlib.Path:
    """The file of a new product; refuses a name that is none, or taken."""
    if not re.fullmatch(_NAME, name):
        raise InputError(
            "is not a valid name", field="name", value=name, allowed="letters, digits, . - and _"
        )
    if name in assets.names(kind):
        raise InputError(f"is the name of a shipped {kind}", field="name", value=name, allowed="another name")
    target = out / f"{name}.toml" if kind in assets.FLAT else out / name / f"{kind}.toml"
    if target.exists():
        raise InputError("is there already, and is not overwritten", file=target)
    return target


def reference(kind: str, where: str, folder: pathlib.Path) -> str:
    """Name by which a file in `folder` refers to another product: shipped, or a path from there."""
    file = assets.find(kind, where)
    if where in assets.names(kind):
        return where
    path = file.resolve() if kind in assets.FLAT or file.name != f"{kind}.toml" else file.resolve().parent
    relative = pathlib.Path(os.path.relpath(path, folder.resolve())).as_posix()
    return f"./{relative}" if relative in assets.names(kind) else relative


def _examples(kind: str) -> dict[str, Any]:
    """Values of commented keys: of several products, those of the first that has the key."""
    found: dict[str, Any] = {}
    shipped = [assets.read_toml(assets.find(kind, name)) for name in _SHOWN.get(kind, ())]
    for table in (_EXAMPLES.get(kind, {}), *shipped):
        found = _merged(table, found)
    return found


def _merged(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Two tables, in which the one above wins."""
    merged = dict(below) | dict(above)
    for key in below.keys() & above.keys():
        if isinstance(below[key], Mapping) and isinstance(above[key], Mapping):
            merged[key] = _merged(below[key], above[key])
    return merged


def _use(values: dict[str, Any], kind: str, used: str, name: str) -> None:
    """Let a table refer to another product."""
    places = _PLACES.get(kind, {})
    if used not in places:
        allowed = ", ".join(f"`{place}`" for place in places) or "none of these options"
        raise InputError(f"does not go with a new {kind}", field=used, value=name, allowed=allowed)
    if not places[used]:
        if used in ("patient", "shoe") and "gait" not in values:
            problem = "goes with a scenario that walks"
            raise InputError(problem, field=used, value=name, allowed="`like=walk-dropfoot`")
        values[used] = name
        return
    group, *keys = places[used]
    for entry in values.get(group, {}).values():
        entry.update(dict.fromkeys(keys, name))


def _fit_links(values: dict[str, Any], before: Mapping[str, Any], muscle: str) -> None:
    """Let each link be longer by what its new muscle is shorter: both pull taut where the former did."""
    after = load("muscle", assets.find("muscle", muscle))
    for name, entry in values["muscle"].items():
        if "link_length" in entry:
            former = load("muscle", before["muscle"][name]["type"])
            link = parse_quantity(entry["link_length"], "m") + former.total_length - after.total_length
            entry["link_length"] = f"{1e3 * max(link, 0.0):.5g} mm"


def _chambers(kind: str, values: dict[str, Any], target: pathlib.Path) -> tuple[str, ...]:
    """The chambers that a scenario switches; its timing goes over to chambers of other names, in order."""
    if kind != "scenario":
        return ()
    found = tuple(load("orthosis", str(assets.find("orthosis", values["orthosis"], target))).chamber)
    for key in ("timer", "phases"):
        table = values.get(key, {})
        timing = {name: entry for name, entry in table.items() if isinstance(entry, dict)}
        if timing and not set(timing) <= set(found):
            kept = {name: entry for name, entry in table.items() if name not in timing}
            values[key] = kept | dict(zip(found, timing.values(), strict=False))
    return found


def _write(target: pathlib.Path, text: str, kind: str, files: Mapping[str, pathlib.Path]) -> None:
    """Write a description and the files that it names; nothing stays of one that does not load."""
    named = [target.parent / name for name in files]
    for path in named:
        if path.exists():
            raise InputError("is there already, and is not overwritten", file=path)
    new_folders = [folder for folder in (target.parent, *target.parent.parents) if not folder.exists()]
    try:
        for path in named:
            with replacing(path) as temporary:
                shutil.copyfile(files[path.name], temporary)
        write_text(target, text)
        load(kind, target)
    except InputError:
        for path in (target, *named):
            path.unlink(missing_ok=True)
        for folder in new_folders:
            folder.rmdir()
        raise
