"""A tree as a URDF file, through yourdfpy's objects and its writer."""

import pathlib
import re
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from afo_sim.common import Foreign, InputError, Notice, missing_extra, together, write_bytes
from afo_sim.legs.tree import Joint, Part, Shape, Tree, check_finite, free_name, listed, pose_of, reading_note
from afo_sim.legs.urdf_files import quiet

try:
    import yourdfpy as urdf
    from lxml import etree
except ImportError as error:
    raise missing_extra(error) or error from None

UNLIMITED = 1e9  # URDF wants a largest effort and velocity of each joint; a tree knows none
FAR = 1e3  # [m] where a slide without stops ends, since URDF's slides have ends
SMALL = 1e-12  # [m] below which a root stands in the world's origin
# With these MuJoCo keeps fixed links and their masses, shows the meshes, and finds them in their folder.
MUJOCO = {"fusestatic": "false", "discardvisual": "false", "strippath": "false"}
JOINT_TYPE_OF = {"hinge": "revolute", "slide": "prismatic", "free": "floating"}
CAPSULES = ("capsules are", "a cylinder with two spheres")
ELLIPSOIDS = ("ellipsoids are", "meshes")
REMARKS = {
    "massless-links-between": "URDF has one joint between two links, so that massless links stand between: "
    "{names}; MuJoCo's own importer does not move links without mass",
    "coordinates-shifted": "URDF's coordinates count from the posture of the tree: {names} begin elsewhere",
    "springs-left-out": "URDF has no springs: that of {names} is left out",
    "rotors-left-out": "URDF has no rotor inertia: that of {names} is left out",
    "slides-end": f"URDF's slides have ends: {{names}} without stops end {FAR:g} m away",
    "root-moves": "URDF leaves it to the program that reads it how the root {names} moves",
}
ROUNDNESS = 3  # subdivisions of an icosahedron: 1280 faces, whose volume is 0.9 % below the ellipsoid's


def write_urdf(tree: Tree, path: str | pathlib.Path, *, name: str | None = None) -> tuple[str, ...]:
    """Write a tree as a URDF file, with its meshes in `<stem>_meshes/` beside it."""
    path = pathlib.Path(path)
    if path.suffix.lower() != ".urdf":
        allowed = "a name that ends with .urdf"
        raise InputError("is not a valid name of a URDF file", file=path, allowed=allowed)
    if not tree.parts:
        raise InputError("there is no part to write", file=tree.file)
    if balls := [name for name, (_, joint) in tree.joints().items() if joint.kind == "ball"]:
        problem = f"URDF has no ball joint: {listed(balls)}"
        raise InputError(problem, file=tree.file, allowed="three hinges in its place")
    check_finite(tree)
    shapes = Shapes(f"{path.stem}_meshes")
    robot = _Robot(tree, name or path.stem, shapes)
    made = robot.made()
    with together(path.parent) as folder:
        for place, content in shapes.files.items():
            write_bytes(folder / place, content)
        with quiet():
            plain = {"build_scene_graph": False, "load_meshes": False}
            document = urdf.URDF(robot=made, filename_handler=lambda name: name, **plain).write_xml()
        etree.SubElement(etree.SubElement(document.getroot(), "mujoco"), "compiler", attrib=MUJOCO)
        document.write(str(folder / path.name), xml_declaration=True, pretty_print=True, encoding="utf-8")
    return tuple(robot.remarks())


@dataclass
class Shapes:
    """What is written for shapes."""

    folder: str
    files: dict[str, bytes] = field(default_factory=dict)
    colours: dict[tuple[float, float, float, float], str] = field(default_factory=dict)
    otherwise: dict[tuple[str, str], list[str]] = field(default_factory=dict)
    meshes: dict[int, str] = field(default_factory=dict)

    def of(self, part: Part, frame: np.ndarray) -> tuple[list[Foreign], list[Foreign]]:
        """Visuals and collisions of a part, the same shapes twice."""
        visuals, collisions = [], []
        for shape in part.shapes:
            material = self.colours.setdefault(shape.rgba, f"colour_{len(self.colours) + 1}")
            for name, origin, geometry in self._geometries(shape):
                placed = {"origin": frame @ shape.pose @ origin, "geometry": geometry}
                visuals.append(urdf.Visual(name=name, **placed, material=urdf.Material(material)))
                collisions.append(urdf.Collision(name=f"{name}_collision", **placed))
        return visuals, collisions

    def _geometries(self, shape: Shape) -> list[tuple[str, np.ndarray, Foreign]]:
        """(name, pose in the shape's axes, geometry) for each piece of a shape."""
        size = [float(number) for number in shape.size]
        if shape.kind == "box":
            return [(shape.name, np.eye(4), urdf.Geometry(box=urdf.Box(2 * np.asarray(shape.size))))]
        if shape.kind == "sphere":
            return [(shape.name, np.eye(4), urdf.Geometry(sphere=urdf.Sphere(size[0])))]
        if shape.kind in ("cylinder", "capsule"):
            found = [(shape.name, np.eye(4), urdf.Geometry(cylinder=urdf.Cylinder(size[0], 2 * size[1])))]
            if shape.kind == "capsule":
                self.otherwise.setdefault(CAPSULES, []).append(shape.name)
                ball = urdf.Geometry(sphere=urdf.Sphere(size[0]))
                for end, height in (("top", size[1]), ("bottom", -size[1])):
                    found.append((f"{shape.name}_{end}", pose_of(np.array([0.0, 0.0, height])), ball))
            return found
        return [(shape.name, np.eye(4), urdf.Geometry(mesh=urdf.Mesh(filename=self._mesh_file(shape))))]

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


@dataclass
class _Robot:
    """Links and joints of yourdfpy, made of parts."""

    tree: Tree
    name: str
    shapes: Shapes
    links: list[Foreign] = field(default_factory=list)
    joints: list[Foreign] = field(default_factory=list)
    frames: dict[str, np.ndarray] = field(default_factory=dict)  # link's place in the part's axes [m] (3,)
    between: list[str] = field(default_factory=list)

    def made(self) -> Foreign:
        """The robot, complete."""
        roots = [part for part in self.tree.parts.values() if part.parent is None]
        world = None
        if not _is_root(roots):
            world = self._new_link("world")
            self.links.append(urdf.Link(name=world))
        for part in self.tree.parts.values():
            self._add(part, part.parent or world)
        colours = self.shapes.colours.items()
        shown = [urdf.Material(name=name, color=urdf.Color(np.array(rgba))) for rgba, name in colours]
        return urdf.Robot(name=self.name, links=self.links, joints=self.joints, materials=shown)

    def _add(self, part: Part, parent: str | None) -> None:
        frame = np.zeros(3)
        if parent is not None:
            steps = list(_steps(part, self.frames.get(part.parent or "", frame)))
            for number, (joint, origin, place) in enumerate(steps):
                child = part.name
                if number < len(steps) - 1:
                    child = self._new_link(f"{part.name}_{joint.name if joint else ''}")
                    self.links.append(urdf.Link(name=child))
                    self.between.append(child)
                self.joints.append(self._joint(joint, parent, child, origin))
                parent, frame = child, place
        self.frames[part.name] = frame
        self.links.append(self._link(part))
        for name, place in part.points.items():
            point = self._new_link(f"{name}_point")
            self.links.append(urdf.Link(name=point))
            self.joints.append(self._fixed(part.name, point, pose_of(place - frame)))

    def _joint(self, joint: Joint | None, parent: str, child: str, origin: np.ndarray) -> Foreign:
        if joint is None:
            return self._fixed(parent, child, origin)
        moving = bool(joint.damping or joint.friction)
        return urdf.Joint(
            name=joint.name,
            type="continuous" if joint.kind == "hinge" and joint.range is None else JOINT_TYPE_OF[joint.kind],
            parent=parent,
            child=child,
            origin=origin,
            axis=None if joint.kind == "free" else joint.axis / np.linalg.norm(joint.axis),
            dynamics=urdf.Dynamics(damping=joint.damping, friction=joint.friction) if moving else None,
            limit=_limit(joint),
        )

    def _link(self, part: Part) -> Foreign:
        frame = pose_of(-self.frames[part.name])
        massless = not part.mass and not part.inertia.any()
        centre = frame @ pose_of(part.centre)
        inertial = urdf.Inertial(origin=centre, mass=float(part.mass), inertia=part.inertia)
        shown = dict(zip(("visuals", "collisions"), self.shapes.of(part, frame), strict=True))
        return urdf.Link(name=part.name, inertial=None if massless else inertial, **shown)

    def _fixed(self, parent: str, child: str, origin: np.ndarray) -> Foreign:
        taken = {*self.tree.joints(), *(joint.name for joint in self.joints)}
        name = free_name(f"{child}_fixed", taken)
        return urdf.Joint(name=name, type="fixed", parent=parent, child=child, origin=origin)

    def _new_link(self, wanted: str) -> str:
        return free_name(wanted, {*self.tree.parts, *(link.name for link in self.links)})

    def remarks(self) -> Iterator[Notice]:
        """What URDF does not hold, or holds otherwise."""
        joints = [joint for _, joint in self.tree.joints().values()]
        roots = [part for part in self.tree.parts.values() if part.parent is None]
        found = {
            "massless-links-between": self.between,
            "coordinates-shifted": [joint.name for joint in joints if joint.zero],
            "springs-left-out": [joint.name for joint in joints if joint.stiffness],
            "rotors-left-out": [joint.name for joint in joints if joint.armature],
            "slides-end": [joint.name for joint in joints if joint.kind == "slide" and joint.range is None],
            "root-moves": [roots[0].name] if _is_root(roots) and roots[0].joints else [],
        }
        yield from (reading_note(code, REMARKS[code], names) for code, names in found.items() if names)
        if self.tree.beside:
            kinds = listed(self.tree.beside, len(self.tree.beside))
            yield Notice("kinds-left-out", "left out: {subject}", subject=kinds, severity="note")
        for (what, how), names in self.shapes.otherwise.items():
            text = "{what} written as {how}: {names}"
            yield reading_note("shapes-replaced", text, names, what=what, how=how)


def _is_root(roots: list[Part]) -> bool:
    """Whether the tree has one root that needs no link for the world above it."""
    if len(roots) != 1:
        return False
    joints = roots[0].joints
    if [joint.kind for joint in joints] == ["free"]:
        return True
    return not joints and np.allclose(roots[0].pose, np.eye(4), rtol=0, atol=SMALL)


def _steps(part: Part, above: np.ndarray) -> Iterator[tuple[Joint | None, np.ndarray, np.ndarray]]:
    """Each joint of a part with its origin in the link above, and its place in the part's axes."""
    # MuJoCo turns a part about its first joint first: T M₁ M₂ …, so that the first is the outermost link. The
    # first origin is pose_of(−above) T pose_of(p₁), each later one pose_of(pₖ − pₖ₋₁).
    before = pose_of(-above) @ part.pose
    last = np.zeros(3)
    for joint in part.joints or (None,):
        place = joint.position if joint is not None and joint.kind == "hinge" else np.zeros(3)
        yield joint, before @ pose_of(place - last), place
        before, last = np.eye(4), place


def _limit(joint: Joint) -> Foreign:
    """Stops, counted from the posture of the tree; None for a hinge without stops, and a free joint."""
    if joint.kind == "free" or (joint.kind == "hinge" and joint.range is None):
        return None
    lower, upper = joint.range or (joint.zero - FAR, joint.zero + FAR)
    ends = {"lower": float(lower - joint.zero), "upper": float(upper - joint.zero)}
    return urdf.Limit(effort=UNLIMITED, velocity=UNLIMITED, **ends)
