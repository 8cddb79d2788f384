"""Meshes that a URDF file names: where they lie, and what they look like."""

import contextlib
import logging
import os
import pathlib
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from urllib.parse import unquote

import numpy as np

Packages = Mapping[str, str | os.PathLike[str]] | Sequence[str | os.PathLike[str]] | str | os.PathLike[str]
SCHEMES = ("package://", "model://")
LOUD = ("yourdfpy", "trimesh", "collada")


@contextmanager
def quiet() -> Iterator[None]:
    """Without what yourdfpy, trimesh and pycollada log, and what they warn of in their own code."""
    loggers = [logging.getLogger(name) for name in LOUD]
    levels = [logger.level for logger in loggers]
    try:
        for logger in loggers:
            logger.setLevel(logging.CRITICAL + 1)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def find_mesh(name: str, file: pathlib.Path, packages: Packages) -> pathlib.Path | None:
    """Where a mesh lies that a file names; None where it is nowhere.

    `package://NAME/REST` and `model://NAME/REST` are sought in the folder given for that name, in the given
    folders, beside the file and above it, and in ROS_PACKAGE_PATH: as FOLDER/NAME/REST, as FOLDER/REST where
    the folder has that name, and last as FOLDER/REST. Other names are paths, relative to the file.
    """
    for candidate in _candidates(name.strip(), file, packages):
        with contextlib.suppress(OSError):  # a name too long for the system
            if candidate.is_file():
                return candidate
    return None


def _candidates(name: str, file: pathlib.Path, packages: Packages) -> Iterator[pathlib.Path]:
    if isinstance(packages, str | os.PathLike):
        packages = (packages,)
    named = dict(packages) if isinstance(packages, Mapping) else {}
    given = map(pathlib.Path, named.values() if isinstance(packages, Mapping) else packages)
    ros = filter(None, os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep))
    folders = [*given, *file.absolute().parents, *map(pathlib.Path, ros)]
    scheme = next((scheme for scheme in SCHEMES if name.startswith(scheme)), "")
    if not scheme:
        path = unquote(name.removeprefix("file://")) if name.startswith("file://") else name
        for text in dict.fromkeys((path, path.replace("\\", "/"))):
            yield from (folder / text for folder in [file.absolute().parent, *folders])
        return
    package, _, rest = name.removeprefix(scheme).partition("/")
    if package in named:
        yield pathlib.Path(named[package]) / rest
    for folder in folders:
        yield folder / package / rest
        if folder.name == package:
            yield folder / rest
    yield from (folder / rest for folder in folders)


def load_mesh(path: pathlib.Path, scale: float | np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) [m] and faces (m, 3) of a mesh file, through trimesh.

    A file that tells its unit, as COLLADA does, is turned into metres, as ROS does. STL and OBJ tell none.
    """
    import trimesh

    with quiet():
        try:
            mesh = trimesh.load(str(path), force="mesh", skip_materials=True)
            unit = trimesh.units.unit_conversion(mesh.units, "meters") if mesh.units else 1.0
        except Exception as error:  # each of trimesh's readers has errors of its own
            raise ValueError(str(error) or type(error).__name__) from None
    faces = np.asarray(getattr(mesh, "faces", ()), dtype=int).reshape(-1, 3)
    factor = np.ones(3) * unit * (1.0 if scale is None else scale)
    vertices = np.asarray(mesh.vertices, dtype=float).reshape(-1, 3) * factor
    if not len(faces) or not np.isfinite(vertices).all():
        raise ValueError("it holds no surface")
    if np.prod(factor) < 0:  # a mirrored mesh would show its inside
        faces = faces[:, ::-1]
    return vertices, faces
