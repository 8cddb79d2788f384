"""One OpenSim joint: functions and coordinates → pose of the child body in the parent body."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np

from afo_sim.common import InputError, plausible

_Function = Callable[[Sequence[np.ndarray]], np.ndarray]  # coordinates, (n,) each → values that fit (n,)

_SPLINES = ("SimmSpline", "NaturalCubicSpline", "natCubicSpline")  # one curve, its names over the years


def _read_function(element: Element) -> _Function:
    """Read a function from its XML element."""
    kind = element.tag
    if kind == "Constant":
        value = numbers(element, "value", 1, "0")[0]
        return lambda q: np.asarray(value)
    if kind == "LinearFunction":
        return _linear(numbers(element, "coefficients", left_out="1 0"))
    if kind == "PolynomialFunction":
        coefficients = numbers(element, "coefficients")
        return lambda q: np.polyval(coefficients, q[0])
    if kind == "MultiplierFunction":
        inner, scale = inner_function(element), numbers(element, "scale", 1, "1")[0]
        return lambda q: scale * inner(q)
    if kind in _SPLINES or kind == "PiecewiseLinearFunction":
        x, y = numbers(element, "x"), numbers(element, "y")
        if len(x) != len(y) or len(x) < 2 or np.any(np.diff(x) <= 0.0):
            raise InputError("needs as many y as x, at least two, x rising", field=kind)
        return _spline(x, y, straight=kind == "PiecewiseLinearFunction" or len(x) == 2)
    return _refused(kind)


def inner_function(element: Element) -> _Function:
    """Read the function that a TransformAxis or a MultiplierFunction holds; none counts as zero."""
    for child in element:
        if child.tag == "function" and len(child):
            return _read_function(child[0])
        if child.tag not in ("function", "axis", "coordinates", "coordinate", "scale"):
            return _read_function(child)
    return lambda q: np.asarray(0.0)


def numbers(element: Element, name: str, count: int | None = None, left_out: str = "") -> np.ndarray:
    """Numbers of a child element; `left_out` is what OpenSim takes where there is none."""
    text = (element.findtext(name) or "").strip() or left_out
    field = " ".join([element.tag, element.get("name", "")]).strip() + f": {name}"
    found = plausible(text.replace(",", " ").split(), field=field)
    if not len(found) or count not in (None, len(found)):
        needed = {None: "numbers", 1: "a number"}.get(count, f"{count} numbers")
        raise InputError(f"is not {needed}", field=field, value=text)
    return found


def _linear(coefficients: np.ndarray) -> _Function:
    def value(q: Sequence[np.ndarray]) -> np.ndarray:
        if len(coefficients) != len(q) + 1:
            problem = f"has {len(coefficients)} coefficients for {len(q)} coordinates"
            raise InputError(problem, field="LinearFunction", allowed="one more than there are coordinates")
        return np.asarray(sum(a * x for a, x in zip(coefficients[:-1], q, strict=True)) + coefficients[-1])

    return value


def _spline(x: np.ndarray, y: np.ndarray, *, straight: bool) -> _Function:
    """Straight pieces, or SIMM's cubic: Forsythe, Malcolm and Moler (1977); straight beyond the ends."""
    from scipy.interpolate import make_interp_spline

    thirds = []  # derivatives at the ends: of the cubic through the four points there
    for part in (slice(4), slice(-4, None)):
        thirds.append(6.0 * np.polyfit(x[part] - x[part][0], y[part], 3)[0] if len(x) > 3 else 0.0)
    ends = ([(3, thirds[0])], [(3, thirds[1])])
    spline = make_interp_spline(x, y, k=1) if straight else make_interp_spline(x, y, k=3, bc_type=ends)
    slopes = spline(x[[0, -1]], 1)

    def value(q: Sequence[np.ndarray]) -> np.ndarray:
        inside = np.clip(q[0], x[0], x[-1])
        below, above = np.minimum(q[0] - x[0], 0.0), np.maximum(q[0] - x[-1], 0.0)
        return np.asarray(spline(inside) + slopes[0] * below + slopes[1] * above)

    return value


def _refused(kind: str) -> _Function:
    def value(q: Sequence[np.ndarray]) -> np.ndarray:
        allowed = "Constant, LinearFunction, PolynomialFunction, MultiplierFunction, SimmSpline, "
        allowed += "PiecewiseLinearFunction"
        raise InputError("is a function that is not read here", value=kind, allowed=allowed)

    return value


@dataclass(frozen=True, eq=False)
class Pose:
    """Places of one frame in another, over time; a single place has n = 1."""

    rotation: np.ndarray  # (n, 3, 3)
    position: np.ndarray  # of the frame's origin [m] (n, 3)

    def __matmul__(self, inner: "Pose") -> "Pose":
        """The place of `inner`'s frame, one frame further out."""
        return Pose(self.rotation @ inner.rotation, self.point(inner.position))

    def inverse(self) -> "Pose":
        """The outer frame's place in this one."""
        back = np.swapaxes(self.rotation, -1, -2)
        return Pose(back, -np.einsum("nij,nj->ni", back, self.position))

    def point(self, local: np.ndarray) -> np.ndarray:
        """A point of the frame (3,) or (n, 3) [m] → the same in the outer frame (n, 3) [m]."""
        turned = (self.rotation @ np.atleast_2d(local)[..., None])[..., 0]
        return np.asarray(turned + self.position)


@dataclass(frozen=True, eq=False)
class Coordinate:
    """A coordinate of a joint."""

    name: str
    default: float  # [rad] or [m]
    limits: tuple[float, float]  # that the model states [rad] or [m]
    rotational: bool
    locked: bool = False  # it keeps its default


@dataclass(frozen=True, eq=False)
class MotionAxis:
    """A rotation about, or a translation along, an axis of the joint's parent frame."""

    axis: np.ndarray  # of length 1, as OpenSim makes every axis (3,)
    coordinates: tuple[str, ...]
    amount: _Function  # [rad] or [m]


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint between two bodies, in either of OpenSim's layouts."""

    name: str
    kind: str  # "CustomJoint", "PinJoint", …
    parent: str  # body
    child: str  # body
    in_parent: Pose  # the joint's frame on the parent body
    in_child: Pose  # the joint's frame on the child body
    coordinates: tuple[Coordinate, ...]
    rotations: tuple[MotionAxis, ...]  # one after the other, each about an axis that the last one turned
    translations: tuple[MotionAxis, ...]
    refused: str = ""  # why its kinematics are not known

    def pose(self, values: Mapping[str, np.ndarray]) -> Pose:
        """The child body in the parent body."""
        if self.refused:
            raise InputError(self.refused, field=f"joint {self.name}", value=self.kind)
        known = {c.name: np.atleast_1d(values.get(c.name, np.asarray(c.default))) for c in self.coordinates}
        try:
            return self.in_parent @ self._motion(known) @ self.in_child.inverse()
        except InputError as error:
            raise error.replaced(field=f"joint {self.name}") from None

    def _motion(self, values: Mapping[str, np.ndarray]) -> Pose:
        from scipy.spatial.transform import Rotation

        count = max((len(value) for value in values.values()), default=1)
        rotation, position = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
        for part in self.rotations:
            angle = part.amount([values[name] for name in part.coordinates])
            turn = np.broadcast_to(angle, count)[:, None] * part.axis
            known, turned = np.isfinite(turn).all(axis=1), np.full((count, 3, 3), np.nan)
            if known.any():
                turned[known] = Rotation.from_rotvec(turn[known]).as_matrix()
            rotation = rotation @ turned
        for part in self.translations:
            way = part.amount([values[name] for name in part.coordinates])
            position = position + np.broadcast_to(way, count)[:, None] * part.axis
        return Pose(rotation, position)


def offset_pose(translation: np.ndarray, orientation: np.ndarray) -> Pose:
    """A fixed frame: its origin [m] (3,), and its turns about its own x, y, z in this order [rad] (3,)."""
    from scipy.spatial.transform import Rotation

    return Pose(Rotation.from_euler("XYZ", orientation).as_matrix()[None], translation[None])
