"""One shipped product, whole."""

from collections.abc import Iterator, Mapping, Sequence

from afo_sim.common import InputError, Mixed, assets, nearest_name, read_header, read_table
from afo_sim.description.keys import keys
from afo_sim.description.quantity import amount
from afo_sim.description.schema import SPECS, holder, split_key
from afo_sim.description.tree import read_named
from afo_sim.physics import FRICTIONS, LAWS

_Rows = Sequence[Sequence[str]]
_TableOf = tuple[str, Sequence[str], _Rows]  # title, header, rows


def product(name: str) -> list[_TableOf]:
    """Everything of this name that is shipped, with each of its numbers."""
    found: list[_TableOf] = []
    for kind in assets.KINDS:
        if name in assets.names(kind):
            found.append(_described(kind, name) if kind in SPECS else _plain(kind, name))
    for kind, known in (("law", LAWS), ("friction", FRICTIONS)):
        found += _law(kind, known[name]) if name in known else ()
    found += _gait(name) if name in assets.gait_names() else ()
    if not found:
        shipped = [name for kind in assets.KINDS for name in assets.names(kind)]
        nearest = nearest_name(name, [*assets.LISTS, *shipped, *LAWS, *FRICTIONS, *assets.gait_names()])
        allowed = f"a product's name, or one of: {', '.join(assets.LISTS)}"
        raise InputError("cannot be listed", field="list", value=name, allowed=allowed, nearest=nearest)
    return found


def _described(kind: str, name: str) -> _TableOf:
    """The product's own keys; what it refers to by name is a product of its own."""
    table, file = read_named(kind, name)
    own = "" if file is None else str(file.relative_to(assets.folder("models").parent))
    rows = []
    for key in keys(name, kind=kind, whole=True):
        # a default that stands in the product itself, not in one that it refers to
        own_default = key.value and isinstance(holder(table, split_key(key.key)[0]), Mapping)
        if key.source == own:
            rows.append((key.key, key.value, key.kind, key.reference, key.meaning))
        elif key.source == "default" and own_default:
            rows.append((key.key, key.value, key.kind, "default", key.meaning))
    return f"{kind} {name}: {own or 'registered'}", ("key", "value", "kind", "source", "meaning"), rows


def _plain(kind: str, name: str) -> _TableOf:
    file = assets.find(kind, name)
    rows = list(_flat(assets.read_toml(file), ""))
    return f"{kind} {name}: {file.relative_to(assets.folder('models').parent)}", ("key", "value"), rows


def _flat(node: Mixed, at: str) -> Iterator[tuple[str, str]]:
    if isinstance(node, Mapping):
        for key, value in node.items():
            yield from _flat(value, f"{at}.{key}" if at else str(key))
    elif isinstance(node, list) and any(isinstance(item, Mapping) for item in node):
        for k, item in enumerate(node):
            yield from _flat(item, f"{at}[{k}]")
    else:
        yield at, ", ".join(map(str, node)) if isinstance(node, list) else str(node)


def _law(kind: str, law: Mixed) -> Iterator[_TableOf]:
    facts = [("formula", law.formula), ("holds", law.validity), ("source", law.source)]
    if kind == "law":
        low, high = (amount(p, "Pa") for p in law.pressure_range)
        facts += [("pressure", f"{low} to {high}")]
        facts += [("contraction", "{:g} to {:g}".format(*law.contraction_range))]
    else:
        facts += [("gives", "a force [N]" if law.unit == "N" else "a pressure [Pa]")]
    yield f"{kind} {law.name}", ("", ""), facts
    rows: _Rows = [
        (
            parameter.name,
            parameter.symbol,
            parameter.unit,
            f"{parameter.lower:g} to {parameter.upper:g}",
            "needed" if parameter.default is None else f"{parameter.default:g}",
            parameter.meaning,
        )
        for parameter in law.parameters
    ]
    yield "parameters", ("name", "symbol", "unit", "allowed [unit]", "default", "meaning"), rows


def _gait(name: str) -> Iterator[_TableOf]:
    """A gait's header, and the range of each of its columns; names end in their units."""
    file = assets.find_gait(name)
    yield f"gait {name}: gait_data/{file.name}", ("", ""), list(read_header(file).items())
    text = read_table(file, "")
    rows = []
    for k, title in enumerate(text.titles):
        cells = [float(row[k]) for _, row in text.rows if row[k]]
        bounds = [f"{value:.4g}" for value in (min(cells), max(cells))] if cells else ["", ""]
        rows.append((title, str(len(cells)), *bounds))
    yield "columns", ("name", "rows", "lowest", "highest"), rows
