"""MJCF with all digits."""

import ctypes
import threading
import zlib
from xml.etree import ElementTree as Xml

import mujoco
import numpy as np

from afo_sim.native import N_USER, kind_of, mujoco_library

DIGITS = 17  # with which a number reads again as it was
PLUGIN, START = "afo_sim.muscles", "afo_start"  # the key whose air the plugin takes

_lock = threading.Lock()


def exact_xml(spec: mujoco.MjSpec) -> str:
    """A compiled spec as MJCF with all digits; with six where MuJoCo has no setting for them."""
    library = ctypes.CDLL(str(mujoco_library()))
    put = getattr(library, "_mjPRIVATE__set_xml_precision", lambda digits: None)
    get = getattr(library, "_mjPRIVATE__get_xml_precision", int)
    with _lock:
        before = get()
        put(DIGITS)
        try:
            return str(spec.to_xml())
        finally:
            put(before)


def started_xml(text: str, data: mujoco.MjData, *, plugin: bool = False) -> str:
    """MJCF with a state as its key START; `plugin` lets the first body that has none bring the muscles'."""
    # as text, since MuJoCo writes no plugin that is not registered
    root = Xml.fromstring(text, Xml.XMLParser(target=Xml.TreeBuilder(insert_comments=True)))
    if plugin:
        Xml.SubElement(Xml.SubElement(root, "extension"), "plugin", plugin=PLUGIN)
        free = next(body for body in root.findall("worldbody//body") if body.find("plugin") is None)
        free.insert(0, Xml.Element("plugin", plugin=PLUGIN))
        total = data.userdata.size
        rows = (each.get("user", "0 0").split() for each in root.findall("actuator/*") if each.attrib)
        for i, row in enumerate(np.array(each, float)[:N_USER] for each in rows):
            total = zlib.crc32(row.tobytes(), total ^ i) if kind_of(row, 0) else total
        Xml.SubElement(free[0], "config", key="rows", value=str(total))
    # no userdata, which each step writes before it reads them, and no force of the last step
    values = {name: np.atleast_1d(getattr(data, name)) for name in ("time", "qpos", "qvel", "act", "ctrl")}
    key = {name: " ".join(map(repr, row.tolist())) for name, row in values.items()}
    Xml.SubElement(Xml.SubElement(root, "keyframe"), "key", key | {"name": START})
    Xml.indent(root)
    return Xml.tostring(root, encoding="unicode") + "\n"
