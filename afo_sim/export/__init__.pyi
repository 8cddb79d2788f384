from .electronics.c_text import header as header
from .electronics.c_text import host as host
from .electronics.c_text import notes as notes
from .electronics.c_text import sketch as sketch
from .electronics.exporting import board_of as board_of
from .electronics.exporting import commanded as commanded
from .exported import export as export
from .exported import format_of as format_of
