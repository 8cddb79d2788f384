"""Names for what Python's types say no closer: each is Any, for the reason beside it."""

from collections.abc import Callable, Mapping
from typing import Any

Json = Any  # what JSON or TOML say: texts, numbers, lists, tables, of any depth; its reader examines it
JsonDict = dict[str, Json]
JsonMapping = Mapping[str, Json]
Given = Any  # whatever a user gives: its reader, or numpy, examines it, and refuses it by name
Keywords = dict[str, Any]  # arguments by name, of as many types as the function has that they go to
FloatOrArray = Any  # numpy's operators give a float of floats, an array of arrays
Function = Callable[..., Any]  # of any signature: it is kept, compiled or called with what it takes
Doubles = Any  # to compiled code an address of doubles; to Python an array or a list of numbers
Struct = Any  # mjModel or mjData: to compiled code its address; to Python MuJoCo's object
NamedNumbers = Any  # a named tuple whose names stand in a table, where no type checker reads them
TableLike = Any  # a path to a CSV, {title with unit: array}, or a pandas DataFrame of such titles
Mixed = Any  # of one of many types, which are only compared, copied or handed on
Foreign = Any  # an object of a library without types, or of one that is imported only where it is used
