"""MJCF with all digits."""

import ctypes
import threading

import mujoco

from afo_sim.native import mujoco_library

DIGITS = 17  # with which a number reads again as it was

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
