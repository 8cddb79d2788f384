"""Random bodies in MuJoCo's own words, trees built in MuJoCo, and without massless parts, for comparison."""

import mujoco
import numpy as np

from afo_sim.legs import Tree

KINDS = {"hinge": mujoco.mjtJoint.mjJNT_HINGE, "slide": mujoco.mjtJoint.mjJNT_SLIDE}
KINDS |= {"ball": mujoco.mjtJoint.mjJNT_BALL, "free": mujoco.mjtJoint.mjJNT_FREE}
OPTIONS = (
    '<compiler angle="radian"/><option timestep="0.001" integrator="RK4"><flag contact="disable"/></option>'
)


def words(numbers: np.ndarray) -> str:
    return " ".join(f"{number:.17g}" for number in numbers)


def random_inertia(rng: np.random.Generator) -> tuple[float, np.ndarray]:
    """Mass and inertia of a box in random axes, which some body has."""
    mass, (a, b, c) = rng.uniform(0.2, 5), rng.uniform(0.05, 0.4, 3)
    moments = mass / 12 * np.array([b * b + c * c, a * a + c * c, a * a + b * b])
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return mass, turn @ np.diag(moments) @ turn.T


def random_mjcf(seed: int, *, bodies: int = 5, most_joints: int = 1) -> str:
    """A model in which every number of a tree is another one: poses, anchors, axes, stops, references."""
    rng = np.random.default_rng(seed)
    above = [-1] + [int(rng.integers(0, body)) for body in range(1, bodies)]
    heads = [_body_text(rng, body, most_joints) for body in range(bodies)]

    def text(body: int) -> str:
        below = [child for child in range(bodies) if above[child] == body]
        return heads[body] + "".join(map(text, below)) + "</body>"

    return f"<mujoco>{OPTIONS}<worldbody>{text(0)}</worldbody></mujoco>"


def _body_text(rng: np.random.Generator, body: int, most_joints: int) -> str:
    mass, full = random_inertia(rng)
    numbers = words(full[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])
    joints = [
        _joint_text(rng, f"j{body}_{number}") for number in range(int(rng.integers(1, most_joints + 1)))
    ]

    def place(most: float) -> str:
        return f'pos="{words(rng.uniform(-most, most, 3))}"'

    def turn() -> str:
        return f'quat="{words(rng.normal(size=4))}"'

    size = words(rng.uniform(0.02, 0.1, 3))
    return (
        f'<body name="b{body}" {place(0.4)} {turn()}>'
        f'<inertial {place(0.2)} mass="{mass:.17g}" fullinertia="{numbers}"/>{"".join(joints)}'
        f'<site name="p{body}" {place(0.2)}/>'
        f'<geom name="g{body}" type="box" size="{size}" mass="0" {place(0.2)} {turn()}/>'
    )


def _joint_text(rng: np.random.Generator, name: str) -> str:
    reference = rng.uniform(-0.5, 0.5)
    lower, upper = reference - rng.uniform(0.1, 1), reference + rng.uniform(0.1, 1)
    return (
        f'<joint name="{name}" type="{rng.choice(["hinge", "slide"], p=[0.8, 0.2])}" '
        f'axis="{words(rng.normal(size=3))}" pos="{words(rng.uniform(-0.2, 0.2, 3))}" '
        f'ref="{reference:.17g}" limited="true" range="{lower:.17g} {upper:.17g}" '
        f'damping="{rng.uniform(0, 2):.17g}" frictionloss="{rng.uniform(0, 0.3):.17g}"/>'
    )


def built(tree: Tree) -> mujoco.MjModel:
    """A tree in MuJoCo, by its public numbers only."""
    spec = mujoco.MjSpec.from_string(f"<mujoco>{OPTIONS}</mujoco>")
    spec.compiler.fusestatic = False
    bodies = {None: spec.worldbody}
    for part in tree.parts.values():
        body = bodies[part.parent].add_body(name=part.name, pos=part.pose[:3, 3])
        turn = np.empty(4)
        mujoco.mju_mat2Quat(turn, part.pose[:3, :3].flatten())
        body.quat = turn
        full = part.inertia
        if part.mass:
            body.mass, body.ipos, body.explicitinertial = part.mass, part.centre, True
            body.fullinertia = [full[0, 0], full[1, 1], full[2, 2], full[0, 1], full[0, 2], full[1, 2]]
        for joint in part.joints:
            lower, upper = joint.range or (0.0, 0.0)
            made = body.add_joint(
                name=joint.name, type=KINDS[joint.kind], axis=joint.axis, pos=joint.position
            )
            made.ref, made.range, made.limited = joint.zero, [lower, upper], joint.range is not None
            made.frictionloss = joint.friction
            made.damping = [joint.damping, *np.zeros(len(np.atleast_1d(made.damping)) - 1)]
        bodies[part.name] = body
    return spec.compile()


def assert_moves_alike(one: mujoco.MjModel, other: mujoco.MjModel, joints: list[str], seed: int) -> None:
    """The same inertia matrix, bias and passive forces in a random posture, at a random speed."""
    position, speed = np.random.default_rng(seed).normal(size=(2, len(joints)))
    both = (motion(model, joints, position, speed) for model in (one, other))
    for ours, theirs in zip(*both, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9)


def motion(
    model: mujoco.MjModel, joints: list[str], position: np.ndarray, speed: np.ndarray
) -> list[np.ndarray]:
    """Inertia matrix and bias force by the joints' names, the joints moved from where they stand at first."""
    data = mujoco.MjData(model)
    order = [model.joint(name).dofadr[0] for name in joints]
    for name, value, rate in zip(joints, position, speed, strict=True):
        joint = model.joint(name)
        data.qpos[joint.qposadr[0]] += value
        data.qvel[joint.dofadr[0]] = rate
    mujoco.mj_forward(model, data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    return [inertia[np.ix_(order, order)], data.qfrc_bias[order], data.qfrc_passive[order]]
