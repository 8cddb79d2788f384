"""The bill of materials that a wheel carries (PEP 770), as CycloneDX: its parts, its needs, what made it.

Licences are those that docs/installation.md lists. The same sources and compilers give the same bytes.
"""

import hashlib
import json
import pathlib
import re
import uuid
from fnmatch import fnmatch
from typing import Any

from packaging.requirements import Requirement


def licences(page: str) -> tuple[dict[str, str], dict[str, tuple[str, str]]]:
    """Licences of libraries; source and licence of data, by pattern of their paths."""
    rows = re.findall(r"^\| (.+) \|$", page.split("\n## Licences\n")[1].split("\n## ")[0], flags=re.M)
    cells = [row.split(" | ") for row in rows]
    libraries = {name.lower(): each[1] for each in cells if len(each) == 2 for name in each[0].split(", ")}
    data = {
        key: (each[1], each[2]) for each in cells if len(each) == 3 for key in re.findall("`(.+?)`", each[0])
    }
    return libraries, data


def licensed(said: str) -> list[dict[str, Any]]:
    """A licence as CycloneDX has it: by its SPDX id, or in words."""
    return [{"license": {"id" if re.fullmatch(r"[A-Z][\w.-]*[\d.]+[\w.-]*|MIT", said) else "name": said}}]


def bill(root: pathlib.Path, name: str, version: str, needs: dict[str, list[str]], files: list[str]) -> bytes:
    """The bill of a checkout's wheel: requirements by extra, "" the core's; its data and machine code."""
    libraries, data = licences((root / "docs" / "installation.md").read_text(encoding="utf-8"))
    parts: dict[str, dict[str, Any]] = {}
    for extra, texts in needs.items():
        for each in map(Requirement, texts):
            if each.name != name:
                ref = f"pkg:pypi/{each.name.lower()}"
                new = {"type": "library", "bom-ref": ref, "name": each.name, "purl": ref, "properties": []}
                part = parts.setdefault(ref, new | {"scope": "optional" if extra else "required"})
                part["properties"].append({"name": f"requirement {extra}".strip(), "value": str(each)})
                part["licenses"] = licensed(libraries[each.name.lower()])
    for file in files:
        sha = hashlib.sha256((root / file).read_bytes()).hexdigest()
        part = {"type": "data", "bom-ref": file, "name": file, "hashes": [{"alg": "SHA-256", "content": sha}]}
        if file.startswith("machine_code/"):
            content = json.loads((root / "machine_code" / "content.json").read_text(encoding="utf-8"))
            made = [{"name": each, "value": value} for each, value in content.get("made", {}).items()]
            part |= {"type": "file", "licenses": licensed("Apache-2.0"), "properties": made}
        else:
            source, licence = next(said for pattern, said in data.items() if fnmatch(file, pattern))
            part |= {"description": source, "licenses": licensed(licence)}
        parts[file] = part
    own = {"type": "library", "bom-ref": f"pkg:pypi/{name}@{version}", "name": name, "version": version}
    own |= {"purl": own["bom-ref"], "licenses": licensed("Apache-2.0")}  # type: ignore[dict-item]
    required = [ref for ref, part in parts.items() if part.get("scope") != "optional"]
    whole = {"bomFormat": "CycloneDX", "specVersion": "1.6", "version": 1, "metadata": {"component": own}}
    whole |= {"components": list(parts.values())}
    whole |= {"dependencies": [{"ref": own["bom-ref"], "dependsOn": required}]}
    serial = uuid.uuid5(uuid.NAMESPACE_URL, json.dumps(whole, sort_keys=True))
    return (json.dumps(whole | {"serialNumber": f"urn:uuid:{serial}"}, indent=1) + "\n").encode()
