"""Files to start from: a new description of any kind, commented, that runs as it is."""

import os
import pathlib
import re
import shutil
from collections.abc import Mapping

import tomlkit

from afo_sim.common import (
    InputError,
    JsonDict,
    assets,
    check_writable,
    parse_quantity,
    replacing,
    without_digests,
    write_text,
)
from afo_sim.description.handmade import fill_braid
from afo_sim.description.reader import load
from afo_sim.description.tree import FILES

_BRAID = "handmade_10mm"  # whose numbers are replaced by those of another braid
# Keys under which a file names other descriptions.
_PLACES: dict[str, dict[str, tuple[str, ...]]] = {
    "orthosis": {"muscle": ("muscle", "type"), "valve": ("chamber", "inlet", "outlet")},
    "scenario": {"leg": (), "orthosis": (), "patient": (), "shoe": (), "limits": ()},
}
_OF_CHAMBERS = ("timer", "phases", "start", "drive")  # tables of a scenario
_NAME = r"[A-Za-z0-9][\w.-]*"


def new(
    kind: str, name: str, out: str | os.PathLike[str] = ".", *, like: str = "",
    uses: Mapping[str, str] | None = None, braid: Mapping[str, str] | None = None, whole: bool = False,
) -> pathlib.Path:  # fmt: skip
    """Write a commented description that runs as it is: its main keys, all, or a shipped one's own."""
    uses = uses or {}
    target = target_of(kind, name, pathlib.Path(out))
    if braid:
        # its numbers are of no other kind, and not beside those of another muscle
        first = next(iter(braid))
        if kind != "muscle":
            raise InputError(f"is not an option of a new {kind}", field=first, allowed="a new muscle")
        if like:
            raise InputError("does not go with `like`, whose braid it would have", field=first)
    refuse_both(whole, like, braid)
    base = base_of(kind, like or _BRAID) if like or braid else assets.template(kind, whole=whole)
    before = assets.read_toml(base)
    text = without_digests(base.read_text(encoding="utf-8"))
    if like or braid:
        text = f"# Every key of a {kind}, and what it means: afo-sim new {kind} NAME --all.\n{text}"
    if kind == "scenario":
        text = _prepared(text, assets.find("orthosis", before["orthosis"], base), uses)
    values = tomlkit.parse(text)
    values.pop("covariance", None)  # of a product's own measurements
    begun = f"begun from {like}" if like else str(values["description"])
    if braid:
        fill_braid(values, braid)
        begun = f"hand-made braid of {braid['bore']}, {braid['braid_angle']}, {braid['length']}: not measured"
    values["description"] = f"{name}, {begun}"
    for used, where in uses.items():
        _use(values, kind, used, reference(used, where, target.parent))
    if kind == "orthosis" and "muscle" in uses:  # each link is longer by what its new muscle is shorter
        after = load("muscle", assets.find("muscle", uses["muscle"]))
        for group, entry in values["muscle"].items():
            if "link_length" in entry:
                former = load("muscle", before["muscle"][group]["type"])
                given = entry["link_length"]
                given = given["value"] if isinstance(given, Mapping) else given
                link = parse_quantity(given, "m") + former.total_length - after.total_length
                entry["link_length"] = f"{1e3 * max(link, 0.0):.5g} mm"
    # Files that a product names, by their name beside it; a product may name another product's
    files = {}
    for key in FILES.get(kind, ()):
        if key in values:
            source = base.parent / str(values[key])
            values[key] = source.name
            files[source.name] = source
    check_writable(target.parent)
    _write(target, tomlkit.dumps(values), kind, files)
    return target


def refuse_both(whole: bool, like: str, braid: object = None) -> None:
    """Refuse every option of a file that is another's."""
    if whole and (like or braid):
        what = "`like`" if like else "a braid's numbers"
        raise InputError(
            f"does not go with {what}, whose file it would be", field="whole", allowed="one of them"
        )


def base_of(kind: str, like: str) -> pathlib.Path:
    """The file that a new product is like; an unknown name is the argument `like`'s."""
    try:
        return assets.find(kind, like)
    except InputError as error:
        raise error.renamed(lambda _: "like", str) from None


def target_of(kind: str, name: str, out: pathlib.Path) -> pathlib.Path:
    """The file of a new product; refuses a name that is none, or taken."""
    if not re.fullmatch(_NAME, name):
        problem = "is not a valid name"
        raise InputError(problem, field="name", value=name, allowed="letters, digits, . - and _")
    if name in assets.names(kind) and (kind, name) not in assets.OWN:
        raise InputError(f"is the name of a shipped {kind}", field="name", value=name, allowed="another name")
    target = out / f"{name}.toml" if kind in assets.FLAT else out / name / f"{kind}.toml"
    if target.exists():
        raise InputError("already exists and is not overwritten", file=target)
    return target


def reference(kind: str, where: str, folder: pathlib.Path) -> str:
    """Name by which a file in `folder` refers to another product: shipped, or a path from there."""
    file = assets.find(kind, where)
    if where in assets.names(kind):
        return where
    path = file.resolve() if kind in assets.FLAT or file.name != f"{kind}.toml" else file.resolve().parent
    relative = pathlib.Path(os.path.relpath(path, folder.resolve())).as_posix()
    return f"./{relative}" if relative in assets.names(kind) else relative


def _use(values: JsonDict, kind: str, used: str, name: str) -> None:
    """Let a table refer to another product."""
    places = _PLACES.get(kind, {})
    if used not in places:
        allowed = ", ".join(f"`{place}`" for place in places) or "none of these options"
        raise InputError(f"is not an option of a new {kind}", field=used, value=name, allowed=allowed)
    if not places[used]:
        if used in ("patient", "shoe") and "gait" not in values:
            problem = "goes with a scenario that walks"
            raise InputError(problem, field=used, value=name, allowed="`like=walk-dropfoot`")
        values[used] = name
        return
    group, *keys = places[used]
    for entry in values.get(group, {}).values():
        entry.update(dict.fromkeys(keys, name))


def _prepared(text: str, orthosis: pathlib.Path, uses: Mapping[str, str]) -> str:
    """A scenario's text with the keys that it is to use, and another orthosis' chambers in order."""
    for used in _PLACES["scenario"].keys() & uses.keys():
        text = re.sub(rf"^# (?={used} = )", "", text, count=1, flags=re.MULTILINE)
    if "orthosis" not in uses:
        return text
    former, found = (
        list(load("orthosis", file).chamber) for file in (orthosis, assets.find("orthosis", uses["orthosis"]))
    )
    if set(former) <= set(found):
        return text
    values = tomlkit.parse(text)
    for key in _OF_CHAMBERS:
        for name in former[len(found) :]:
            values.get(key, {}).pop(name, None)
    names = dict(zip(former, found, strict=False))
    chambers = re.compile(rf"\b({'|'.join(former)})\b")
    # tables and keys, also behind #; no defaults, nor a controller's side, which is no chamber
    return re.sub(
        r"^(?:# )?(?!side = )(?:\[|[\w.]+ = ).*$",
        lambda line: chambers.sub(lambda it: names.get(it[0], it[0]), line[0]),
        tomlkit.dumps(values),
        flags=re.MULTILINE,
    )


def _write(target: pathlib.Path, text: str, kind: str, files: Mapping[str, pathlib.Path]) -> None:
    """Write a description and the files that it names; nothing stays of one that does not load."""
    named = [target.parent / name for name in files]
    for path in named:
        if path.exists():
            raise InputError("already exists and is not overwritten", file=path)
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
