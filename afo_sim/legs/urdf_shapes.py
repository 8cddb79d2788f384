"""Shapes of parts as URDF's visual and collision elements, and as mesh files."""

import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from afo_sim.legs.names import free_name
from afo_sim.legs.pose import shift
from afo_sim.legs.tree import Part, Shape

CAPSULES = ("capsules are", "a cylinder with two spheres")
ELLIPSOIDS = ("ellipsoids are", "meshes")
ROUNDNESS = 3  # subdivisions of an icosahedron: 1280 faces, whose volume is 0.9 % below the ellipsoid's


@dataclass
class Shapes:
    """What is written for shapes.

    folder : of the mesh files, relative to the robot's file
    files : {mesh file: its content}
    colours : {rgba: name of the material}
    otherwise : {what is written as what: names of the shapes}
    """

    folder: str
    files: dict[str, bytes] = field(default_factory=dict)
    colours: dict[tuple[float, float, float, float], str] = field(default_factory=dict)
    otherwise: dict[tuple[str, str], list[str]] = field(default_factory=dict)
    meshes: dict[int, str] = field(default_factory=dict)

    def of(self, part: Part, frame: np.ndarray) -> tuple[list[Any], list[Any]]:
        """Visuals and collisions of a part, the same shapes twice.

        Units: frame (4, 4).
        """
        from yourdfpy import Collision, Material, Visual

        visuals, collisions = [], []
        for shape in part.shapes:
            material = self.colours.setdefault(shape.rgba, f"colour_{len(self.colours) + 1}")
            for name, origin, geometry in self._geometries(shape):
                place = frame @ shape.pose @ origin
                visuals.append(
                    Visual(name=name, origin=place, geometry=geometry, material=Material(material))
                )
                collisions.append(Collision(name=f"{name}_collision", origin=place, geometry=geometry))
        return visuals, collisions

    def materials(self) -> list[Any]:
        """The colours of all shapes."""
        from yourdfpy import Color, Material

        return [Material(name=name, color=Color(np.array(rgba))) for rgba, name in self.colours.items()]

    def _geometries(self, shape: Shape) -> list[tuple[str, np.ndarray, Any]]:
        """(name, pose in the shape's axes, geometry) for each piece of a shape."""
        from yourdfpy import Box, Cylinder, Geometry, Sphere

        size = [float(number) for number in shape.size]
        if shape.kind == "box":
            return [(shape.name, np.eye(4), Geometry(box=Box(2 * np.asarray(shape.size))))]
        if shape.kind == "sphere":
            return [(shape.name, np.eye(4), Geometry(sphere=Sphere(size[0])))]
        if shape.kind in ("cylinder", "capsule"):
            found = [(shape.name, np.eye(4), Geometry(cylinder=Cylinder(size[0], 2 * size[1])))]
            if shape.kind == "capsule":
                self.otherwise.setdefault(CAPSULES, []).append(shape.name)
                ball = Geometry(sphere=Sphere(size[0]))
                for end, height in (("top", size[1]), ("bottom", -size[1])):
                    found.append((f"{shape.name}_{end}", shift(np.array([0.0, 0.0, height])), ball))
            return found
        from yourdfpy import Mesh

        return [(shape.name, np.eye(4), Geometry(mesh=Mesh(filename=self._mesh_file(shape))))]

    def _mesh_file(self, shape: Shape) -> str:
        """Name of the STL file of a mesh or an ellipsoid; shapes of the same mesh share theirs."""
        import trimesh

        if shape.kind == "mesh" and id(shape.vertices) in self.meshes:
            return self.meshes[id(shape.vertices)]
        if shape.kind == "mesh":
            mesh = trimesh.Trimesh(shape.vertices, shape.faces, process=False)
        else:
            self.otherwise.setdefault(ELLIPSOIDS, []).append(shape.name)
            mesh = trimesh.creation.icosphere(subdivisions=ROUNDNESS)
            mesh.apply_scale(shape.size)
        stem = re.sub(r"[^A-Za-z0-9._-]+", "_", shape.name).strip("._") or "mesh"
        taken = {name.rsplit("/", 1)[-1].removesuffix(".stl").lower() for name in self.files}
        lower = free_name(stem.lower(), taken)  # some systems take A.stl and a.stl for the same
        name = f"{self.folder}/{stem}{lower[len(stem) :]}.stl"
        self.files[name] = mesh.export(file_type="stl")
        if shape.kind == "mesh":
            self.meshes[id(shape.vertices)] = name
        return name
