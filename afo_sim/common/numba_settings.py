"""numba's settings: those of the environment, not of a file in the current folder, which it would read."""

import sys
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from types import CodeType

_MODULE, _FILE = "numba.core.config", ".numba_config.yaml"


class _Settings(SourceFileLoader):
    """Finds and loads numba's module of settings, which knows no file then."""

    @classmethod
    def find_spec(cls, name: str, path: object = None, _: object = None) -> ModuleSpec | None:
        found = PathFinder.find_spec(name, path) if name == _MODULE else None  # type: ignore[arg-type]  # as importlib calls it
        if found is not None and isinstance(found.loader, SourceFileLoader):
            found.loader = cls(name, found.loader.path)
        return found

    def get_code(self, fullname: str) -> CodeType | None:
        code = super().get_code(fullname)
        return code and code.replace(co_consts=tuple("" if x == _FILE else x for x in code.co_consts))


sys.meta_path.insert(0, _Settings)
if _MODULE in sys.modules:  # it reads that file again whenever it compiles
    vars(sys.modules[_MODULE])["_config_fname"] = ""
