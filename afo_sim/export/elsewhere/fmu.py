"""FMI 2.0 for co-simulation: the description of an FMU, and its archive."""

import importlib.metadata
import pathlib
import platform
import sys
import uuid
import zipfile
from collections.abc import Sequence
from xml.etree import ElementTree as Xml

from afo_sim.export.elsewhere.variables import Variable

IDENTIFIER = "afo_sim"
# Exponents of kg, m, s, A, K, mol, cd, rad.
UNITS = {
    "Pa": {"kg": 1, "m": -1, "s": -2}, "N": {"kg": 1, "m": 1, "s": -2}, "N*m": {"kg": 1, "m": 2, "s": -2},
    "N*m/rad": {"kg": 1, "m": 2, "s": -2, "rad": -1}, "rad": {"rad": 1}, "rad/s": {"rad": 1, "s": -1},
    "rad/s^2": {"rad": 1, "s": -2}, "m": {"m": 1}, "m^3": {"m": 3},
    "m/s^2": {"m": 1, "s": -2}, "kg": {"kg": 1}, "kg/s": {"kg": 1, "s": -1},
}  # fmt: skip
# Of FMI 2.0 nothing says that steps are of whole time steps: importers are not asked to vary them.
FIXED = dict.fromkeys(("canGetAndSetFMUstate", "canSerializeFMUstate"), "true")


def description_of(name: str, variables: Sequence[Variable], step: float, stop: float) -> bytes:
    """modelDescription.xml of a scenario; its identity follows from its content."""
    root = Xml.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=name,
        description="an input that is never set is the scenario's own (timer, walk, a run's commands); "
        "one that is set, also to 0, is the importer's from then on; no verdict or warning of a run is in it",
        generationTool=f"afo-sim {importlib.metadata.version('afo-sim')}",
    )
    root.set("variableNamingConvention", "flat")
    root.set("numberOfEventIndicators", "0")
    Xml.SubElement(root, "CoSimulation", {"modelIdentifier": IDENTIFIER, **FIXED})
    units = Xml.SubElement(root, "UnitDefinitions")
    for unit in sorted({each.unit for each in variables} - {""}):
        base = {kind: str(power) for kind, power in UNITS[unit].items()}
        Xml.SubElement(Xml.SubElement(units, "Unit", name=unit), "BaseUnit", base)
    times = {"startTime": "0", "stopTime": repr(stop), "stepSize": repr(step)}
    Xml.SubElement(root, "DefaultExperiment", times)
    table, structure = Xml.SubElement(root, "ModelVariables"), Xml.Element("ModelStructure")
    outputs, initial = (Xml.SubElement(structure, each) for each in ("Outputs", "InitialUnknowns"))
    named = [(number, each) for number, each in enumerate(variables) if each.name]
    for place, (number, each) in enumerate(named, start=1):
        causality = "output" if each.start is None else "input"
        facts = {"name": each.name, "valueReference": str(number), "causality": causality}
        row = Xml.SubElement(table, "ScalarVariable", facts, description=each.description)
        real = Xml.SubElement(row, "Real", {"unit": each.unit} if each.unit else {})
        if each.start is None:
            for table_of in (outputs, initial):  # they follow inputs with the next step
                Xml.SubElement(table_of, "Unknown", index=str(place), dependencies="")
        else:
            real.set("start", repr(each.start))
    root.append(structure)
    root.set("guid", f"{{{uuid.uuid5(uuid.NAMESPACE_URL, Xml.tostring(root, encoding='unicode'))}}}")
    Xml.indent(root)
    return Xml.tostring(root, encoding="UTF-8", xml_declaration=True)


def binaries() -> str:
    """The folder in an FMU for libraries of this platform."""
    bits = {"win32": "win", "darwin": "darwin"}.get(sys.platform, "linux")
    arm = platform.machine().lower() in ("arm64", "aarch64")
    return f"binaries/{bits}64" if not arm else f"binaries/{'aarch64' if bits != 'darwin' else 'darwin64'}"


def zipped(folder: pathlib.Path, path: pathlib.Path) -> None:
    """Pack a folder, the same folder into the same bytes."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(each for each in folder.rglob("*") if each.is_file()):
            entry = zipfile.ZipInfo(file.relative_to(folder).as_posix())
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, file.read_bytes())
