"""Damage that once ended by a traceback, or not at all; it is done again whenever the tests run."""

from fuzz.damage import Damage

_FORCES, _ANGLES = "#\t" * 18 + "#", "#\t" * 6 + "#"  # rows of the tables
FOUND = (
    Damage("grf.mot", "number", f"1 of {_FORCES}@186", "-1e308"),
    Damage("grf.mot", "number", f"10 of {_FORCES}@233", "-1e308"),
    Damage("ik.mot", "number", f"2 of {_ANGLES}@*", "1e308"),
    Damage("osim 4", "number", '0 of <Marker name="RMT1"><socket_parent_frame>/bodyset/calcn_r</s@0', "1e15"),
    Damage("c3d type 4", "number", "word 9 h@0", "-1"),
    Damage("osim 3", "flipped", "8202 3839", ""),
    Damage("gait gatk_stride1", "pieces", "8202 4217", ""),
    Damage("muscle dmsp_20", "pieces", "8101 2560", ""),
    Damage("sweep patients", "pasted", "8202 178", ""),
    Damage("recording", "number", '0 of "time": #,@*', "inf"),
    Damage("recording", "number", '0 of "value": #,@47', "9" * 400),
    Damage("read: worn model", "number", "0 of userdata = #@0", "1e15"),
    Damage("read: time step", "number", '0 of "error": #,@20', "9" * 400),
    Damage("read: gaits", "pasted", "67113022 105", ""),
)
