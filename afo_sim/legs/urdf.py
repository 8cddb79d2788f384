"""A tree from a URDF file, through yourdfpy."""

import dataclasses
import io
import pathlib
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from afo_sim.common import Foreign, InputError, JsonDict, Keywords, Notice, nearest_name, refuse
from afo_sim.legs import tree, urdf_files

LARGE_MESH = 5.0  # [m] no link of a body or a device is that long …
NEAR_JOINTS = 2.0  # [m] … whose joints lie that near
WORLD = "world"  # root link that stands for what nothing moves
# {code: what a user would not expect of the parts}
REMARKS = {
    "massless-links": "links without mass: {names}",
    "point-masses": "links whose inertia is zero are point masses: {names}",
    "meshes-missing": "missing meshes are not shown: {names}; give their folder as `packages`, "
    "or in ROS_PACKAGE_PATH",
    "meshes-broken": "unreadable meshes are not shown: {names}",
    "joints-endless": "joints without a range have no stops: {names}",
    "roots-several": "links without a joint are independent: {names}",
    "joints-planar": "a planar joint is read as two slides and a hinge: {names}",
    "meshes-large": 'meshes look like millimetres: {names}; give them scale="0.001 0.001 0.001"',
}
MIMICS = "joint {subject} follows another, {rule}; in a leg alone it moves by itself"


def read_urdf(
    file: str | pathlib.Path, *, packages: urdf_files.Packages = (), contact: bool = False
) -> tree.Tree:
    """Read a URDF file through yourdfpy."""
    file = pathlib.Path(file)
    root = urdf_files.robot_element(file)
    root.set("name", root.get("name") or file.stem)
    odd = urdf_files.without_odd_shapes(root)
    refuse(urdf_files.text_problems(root, file))
    urdf_files.split_commas(root)
    capsules = urdf_files.take_capsules(root)
    robot = _parsed(root, file)
    if not robot.links:
        raise InputError("has no <link>", file=file)
    refuse((*_joint_problems(robot, file), *_tree_problems(robot, file)))
    reading = _Reading(file, packages, robot, capsules, contact)
    parts = reading.parts()
    rules = [(joint.name, joint.mimic) for joint in robot.joints if joint.mimic is not None]
    couplings = tuple((name, rule.joint, rule.offset, rule.multiplier) for name, rule in rules)
    text = "left out: {why} ({names})"
    notes = [tree.reading_note("shapes-left-out", text, odd[why], why=why) for why in odd]
    remarks = [(code, text, dict.fromkeys(reading.seen[code])) for code, text in REMARKS.items()]
    notes += [tree.reading_note(*remark) for remark in remarks if remark[2]]
    for name, other, offset, by in couplings:
        notes.append(Notice("joint-mimics", MIMICS, subject=name, rule=f"{by:g} × {other} + {offset:g}"))
    return tree.Tree(file, parts, _beside(root, [name for name, _ in rules]), tuple(notes), couplings)


def _parsed(root: Foreign, file: pathlib.Path) -> Foreign:
    import yourdfpy
    from lxml import etree

    with urdf_files.quiet():
        try:
            content = io.BytesIO(etree.tostring(root))
            return yourdfpy.URDF.load(content, load_meshes=False, build_scene_graph=False).robot
        except Exception as error:  # yourdfpy passes on whatever its reading of one element raises
            raise InputError(f"yourdfpy cannot read it: {' '.join(str(error).split())}", file=file) from None


def _joint_problems(robot: Foreign, file: pathlib.Path) -> Iterator[InputError]:
    """What makes a robot's joints impossible, with the way to mend it."""
    for joint in robot.joints:
        place, (lower, upper) = f"joint {joint.name!r}", _stops(joint)
        if joint.type not in ("fixed", "floating") and not joint.axis.any():
            problem = 'its axis has no length; give for example <axis xyz="0 -1 0"/>'
            yield InputError(problem, file=file, field=place)
        if lower > upper and joint.type in ("revolute", "prismatic"):
            problem = f"its range runs from {lower:g} to {upper:g}: exchange lower and upper"
            yield InputError(problem, file=file, field=place)
        for name, value in _dynamics(joint).items():
            if value < 0:
                problem = f"its {name} of {value:g} is negative: it would drive the joint"
                yield InputError(problem, file=file, field=place)


def _tree_problems(robot: Foreign, file: pathlib.Path) -> Iterator[InputError]:
    """Each link has at most one joint to a parent, and hangs on a root."""
    links = [link.name for link in robot.links]
    above: dict[str, list[Foreign]] = {name: [] for name in links}
    for joint in robot.joints:
        for end, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in above:
                place, near = f"joint {joint.name!r} <{end} link>", nearest_name(name, links)
                problem = "is not a link of the file"
                yield InputError(problem, file=file, field=place, value=name, nearest=near)
        if joint.child in above:
            above[joint.child].append(joint)
    for name, joints in above.items():
        if len(joints) > 1:
            names = " and ".join(repr(joint.name) for joint in joints)
            problem = f"has two parents, by the joints {names}: take one of them out"
            yield InputError(problem, file=file, field=f"link {name!r}")
    circling = {name: joints for name, joints in above.items() if joints}
    while hung := [name for name, joints in circling.items() if joints[0].parent not in circling]:
        for name in hung:
            del circling[name]
    if circling:
        problem = f"is attached to itself, by the links {tree.listed(circling)}; take out one of the joints"
        yield InputError(problem, file=file, field=f"link {next(iter(circling))!r}")


@dataclass
class _Reading:
    """The parts of a checked robot, and what is remarked on the way."""

    file: pathlib.Path
    packages: urdf_files.Packages
    robot: Foreign
    capsules: set[tuple[str, str, int]]
    contact: bool = False
    world: str | None = None
    loaded: dict[tuple[pathlib.Path, str], tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)
    seen: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))

    def parts(self) -> dict[str, tree.Part]:
        """Parents before children, in the order of the file."""
        links = {link.name: link for link in self.robot.links}
        joints: dict[str, list[Foreign]] = {}
        for joint in self.robot.joints:
            joints.setdefault(joint.parent, []).append(joint)
        children = {joint.child for joint in self.robot.joints}
        roots = [name for name in links if name not in children]
        found, todo = {}, list(roots)
        for root in roots:
            inertial = links[root].inertial
            if root == WORLD and len(links) > 1 and not (inertial and inertial.mass):
                self.world = root  # by the convention of ROS and Gazebo
            else:
                found[root] = self._part(links[root], None, joints.get(root, []))
        self.seen["roots-several"] = roots if len(roots) > 1 else []
        while todo:
            for joint in joints.get(todo.pop(0), []):
                found[joint.child] = self._part(links[joint.child], joint, joints.get(joint.child, []))
                todo.append(joint.child)
        return found

    def _part(self, link: Foreign, joint: Foreign, below: list[Foreign]) -> tree.Part:
        parent = joint.parent if joint and joint.parent != self.world else None
        pose, inertial = _origin(joint.origin if joint else None), self._inertial(link)
        joints = self._joints(joint) if joint else ()
        return tree.Part(link.name, parent, pose, *inertial, joints, tuple(self._shapes(link, below)))

    def _inertial(self, link: Foreign) -> tuple[float, np.ndarray, np.ndarray]:
        """Mass, centre and R I Rᵀ, R the turn of the inertial frame against the link's."""
        inertial = link.inertial
        if inertial is None or not inertial.mass:
            self.seen["massless-links"].append(link.name)
        elif inertial.inertia is None or np.abs(inertial.inertia).max() < tree.LEAST_INERTIA:
            self.seen["point-masses"].append(link.name)
        if inertial is None:
            return 0.0, np.zeros(3), np.zeros((3, 3))
        origin = _origin(inertial.origin)
        turn = origin[:3, :3]
        inertia = np.zeros((3, 3)) if inertial.inertia is None else turn @ inertial.inertia @ turn.T
        return float(inertial.mass or 0.0), origin[:3, 3].copy(), (inertia + inertia.T) / 2

    def _joints(self, joint: Foreign) -> tuple[tree.Joint, ...]:
        same: Keywords = {"position": np.zeros(3), **_dynamics(joint)}
        if joint.type == "fixed":
            return ()
        if joint.type == "floating":
            return (tree.Joint(name=joint.name, kind="free", axis=np.array([0.0, 0.0, 1.0]), **same),)
        axis = joint.axis / np.abs(joint.axis).max()  # whose square is a number, however long it was
        axis = axis / np.linalg.norm(axis)
        if joint.type == "planar":
            self.seen["joints-planar"].append(joint.name)
            return _planar(joint.name, axis, same, {other.name for other in self.robot.joints})
        lower, upper = _stops(joint)
        stopped = lower != upper and joint.type != "continuous"
        if lower == upper and joint.type != "continuous":  # CAD exporters leave zeros where no range was set
            self.seen["joints-endless"].append(joint.name)
        kind: Foreign = "slide" if joint.type == "prismatic" else "hinge"
        return (tree.Joint(joint.name, kind, axis, range=(lower, upper) if stopped else None, **same),)

    def _shapes(self, link: Foreign, below: list[Foreign]) -> Iterator[tree.Shape]:
        """What is to be seen; of a link that shows nothing, or for contact, what it collides with."""
        reach = float(max([np.linalg.norm(_origin(joint.origin)[:3, 3]) for joint in below], default=0.0))
        shapes = [(shape, "visual", number) for number, shape in enumerate(link.visuals)]
        if self.contact or not shapes:
            shapes += [(shape, "collision", number) for number, shape in enumerate(link.collisions)]
        given = [shape.name or "" for shape, *_ in shapes]
        names = tree.own_names(given, [f"{link.name}_shape"] * len(shapes))
        for (shape, word, number), name in zip(shapes, names, strict=True):
            made = self._shape(shape, name, reach)
            if made is not None and (link.name, word, number) in self.capsules:
                made = dataclasses.replace(made, kind="capsule")
            if made is not None:
                yield dataclasses.replace(made, touches=self.contact and word == "collision")

    def _shape(self, shape: Foreign, name: str, reach: float) -> tree.Shape | None:
        geometry, pose, rgba = shape.geometry, _origin(shape.origin), self._rgba(shape)
        if geometry.box is not None:
            return tree.Shape(name, "box", pose, np.asarray(geometry.box.size) / 2, rgba=rgba)
        if geometry.sphere is not None:
            return tree.Shape(name, "sphere", pose, np.array([geometry.sphere.radius, 0.0, 0.0]), rgba=rgba)
        if geometry.cylinder is not None:
            size = np.array([geometry.cylinder.radius, geometry.cylinder.length / 2, 0.0])
            return tree.Shape(name, "cylinder", pose, size, rgba=rgba)
        surface = self._surface(geometry.mesh, reach)
        if surface is None:
            return None
        return tree.Shape(name, "mesh", pose, np.zeros(3), vertices=surface[0], faces=surface[1], rgba=rgba)

    def _surface(self, mesh: Foreign, reach: float) -> tuple[np.ndarray, np.ndarray] | None:
        path = urdf_files.find_mesh(mesh.filename, self.file, self.packages)
        if path is None:
            self.seen["meshes-missing"].append(mesh.filename)
            return None
        key = path, str(mesh.scale)
        try:
            vertices, faces = self.loaded[key] = self.loaded.get(key) or urdf_files.load_mesh(
                path, mesh.scale
            )
        except ValueError as error:
            self.seen["meshes-broken"].append(f"{mesh.filename} ({' '.join(str(error).split())})")
            return None
        length = float(np.max(np.ptp(vertices, axis=0)))
        if length > LARGE_MESH and reach < NEAR_JOINTS:
            self.seen["meshes-large"].append(f"{mesh.filename}, {length:.3g} m long")
        return vertices, faces

    def _rgba(self, shape: Foreign) -> tuple[float, float, float, float]:
        material = getattr(shape, "material", None)
        if material is not None and material.color is None:  # by the name of one that the robot has
            named = {one.name: one for one in self.robot.materials if one.color is not None}
            material = named.get(material.name)
        if material is None or material.color is None:
            return tree.Shape.rgba
        red, green, blue, opacity = (*map(float, material.color.rgba), 1.0)[:4]
        return red, green, blue, opacity


def _planar(name: str, axis: np.ndarray, same: JsonDict, taken: set[str]) -> tuple[tree.Joint, ...]:
    """Two slides across the axis and a hinge about it, named as MuJoCo's importer names them."""
    first = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
    first /= np.linalg.norm(first)
    ends = [tree.free_name(f"{name}_{end}", taken) for end in ("TX", "TY", "RZ")]
    return (
        tree.Joint(name=ends[0], kind="slide", axis=first, **same),
        tree.Joint(name=ends[1], kind="slide", axis=np.cross(axis, first), **same),
        tree.Joint(name=ends[2], kind="hinge", axis=axis, **same),
    )


def _origin(matrix: np.ndarray | None) -> np.ndarray:
    return np.eye(4) if matrix is None else np.array(matrix, dtype=float)


def _stops(joint: Foreign) -> tuple[float, float]:
    """Stops [rad, m], 0 where there are none."""
    given = joint.limit
    return (0.0, 0.0) if given is None else (float(given.lower or 0.0), float(given.upper or 0.0))


def _dynamics(joint: Foreign) -> dict[str, float]:
    """Damping [N·m·s/rad, N·s/m] and dry friction [N·m, N]; yourdfpy leaves them texts."""
    given = joint.dynamics
    damping, friction = (given.damping, given.friction) if given is not None else (None, None)
    return {"damping": float(damping or 0.0), "friction": float(friction or 0.0)}


def _beside(root: Foreign, mimics: list[str]) -> dict[str, tuple[str, ...]]:
    gazebo = [f"gazebo {element.get('reference', '')}".strip() for element in root.findall("gazebo")]
    found = {
        "transmissions": tuple(element.get("name", "") for element in root.findall("transmission")),
        "mimic joints": tuple(mimics),
        "simulator's additions": (*gazebo, *("mujoco" for _ in root.findall("mujoco"))),
    }
    return {kind: names for kind, names in found.items() if names}
