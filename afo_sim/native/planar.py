"""Steps of a walker whose joints all turn in one plane, in joint space: MuJoCo's steps of the same model.

A step reads and writes an MjData as `mj_step` does, with the same kernels of muscles, reflexes, floor and air
and the same integrator `implicitfast`, so that either goes on where the other stopped. It knows two legs of
four hinges and paths through points, and so takes a fraction of the time. MuJoCo stays the judge.

    segment  0 trunk, 1 to 4 thigh, shank, foot, toes of the first leg, 5 to 8 of the other; each has a hinge
    plan     what a compiled model is to these steps: `places_of` says where its numbers stand
    H        M − h D of a leg and the trunk: forward, up, pitch, hip, knee, ankle, toe
"""

import math
from typing import Any, NamedTuple

from afo_sim.native.air_block import block
from afo_sim.native.callbacks import force_of, rate_of
from afo_sim.native.error_codes import FINE
from afo_sim.native.muscle import sole_pad_force
from afo_sim.native.slots import GRIP_ACT, LEG_MUSCLE_DATA, LEG_MUSCLE_ROW, REFLEX_ROW, Kind, kind_of, places
from afo_sim.native.walker import floor_at, held_by_floor, leg_muscle_dyn, rate_now, reflexes_of, toe_moment
from afo_sim.physics import SOLE_PADS, register_jitable

SEGMENTS, LEG, ROOT, DOFS = 9, 4, 3, 11
ANKLE = 3  # the first foot's hinge
POINTS = 2 * SOLE_PADS
OWN = ROOT + LEG  # coordinates of a leg with the trunk


class Head(NamedTuple):
    """Of a plan: [m/s²], [m], counts."""

    backward: int  # gravity along the floor, and to it
    gravity: int
    fallen: int  # height of the trunk from which on down it has fallen
    pieces: int
    others: int
    states: int
    actuators: int


class SegmentPlan(NamedTuple):
    """Of a segment with all that is fixed to it: its hinge in the one before, its mass and centre from it."""

    hinge_x: int
    hinge_z: int
    mass: int
    x: int
    z: int
    inertia: int
    stiffness: int
    rest: int
    damping: int
    armature: int


class PointPlan(NamedTuple):
    """Of a point of a sole: segment, place from its hinge [m], actuators of its pad and its grip."""

    segment: int
    x: int
    z: int
    pad: int
    grip: int


class PathPlan(NamedTuple):
    """Of the moving piece of a muscle's path; `first` where it begins a path, `last` where it ends one."""

    actuator: int
    near: int  # segment and place of its end that is nearer to the trunk
    near_x: int
    near_z: int
    far: int
    far_x: int
    far_z: int
    across: int  # square of its width out of the plane [m²]
    fixed: int  # length of the path's pieces that do not move [m]
    top: int  # segments between which the whole path lies
    bottom: int
    first: int
    last: int


class OtherPlan(NamedTuple):
    """Of any other actuator: the coordinate it acts on, its gear, its state if it has one, and if a gain."""

    actuator: int
    coordinate: int
    gear: int
    state: int  # place in `act` of the only one, else −1
    damped: int  # 1 where that state is its gain's input


class Row(NamedTuple):
    """A row of a walk; behind it stand all states and all actuators' forces."""

    time: int
    qpos: int
    qvel: int
    joint: int  # what body and device do at each coordinate, without the floor
    points: int  # of each point of the soles, x and height over the floor
    torque: int  # at each ankle, of the device and of the wearer's own muscles
    act: int


HEAD: Head = places(Head)
SEGMENT: SegmentPlan = places(SegmentPlan)
POINT: PointPlan = places(PointPlan)
PATH: PathPlan = places(PathPlan)
OTHER: OtherPlan = places(OtherPlan)
ROW: Row = places(Row, qpos=DOFS, qvel=DOFS, joint=DOFS, points=2 * POINTS, torque=4)
BALANCE = len(HEAD)  # segment, x, z of the trunk's and the feet's own centres, whose order makes the phase
SEGMENT_PLANS = BALANCE + 9
POINT_PLANS = SEGMENT_PLANS + SEGMENTS * len(SEGMENT)
PATH_PLANS = POINT_PLANS + POINTS * len(POINT)

# places in the scratch
C, S, X, Z, GX, GZ, W, VX, VZ, FX, FZ, N, MASS, CX, CZ, IN = (k * SEGMENTS for k in range(16))
PX, PZ, LOAD, LOSS, HOLD, KEEP = (16 * SEGMENTS + k * POINTS for k in range(6))
JOINT = 16 * SEGMENTS + 6 * POINTS  # generalised forces but floor's, inertia's and the joints' own
RIGHT = JOINT + DOFS  # right side, and then the acceleration
TORQUE = RIGHT + DOFS  # at each ankle, of the device and of the wearer's own muscles
H = TORQUE + 4
ARM = H + 2 * OWN * OWN  # slope of the path at hand by each hinge


@register_jitable
def before(k: int) -> int:
    """The segment that carries a segment."""
    return 0 if k % LEG == 1 else k - 1


@register_jitable
def place_segments(p: Any, q: Any, v: Any, s: Any) -> None:
    """Hinges and centres of all segments, and their velocities."""
    angle = q[2]
    s[X], s[Z], s[VX], s[VZ], s[W] = q[0], q[1], v[0], v[1], v[2]
    for k in range(SEGMENTS):
        a = SEGMENT_PLANS + k * len(SEGMENT)
        if k > 0:
            up = before(k)
            if up == 0:
                angle = q[2]
            angle += q[2 + k]
            along, high = p[a + SEGMENT.hinge_x], p[a + SEGMENT.hinge_z]
            x = s[C + up] * along - s[S + up] * high
            z = s[S + up] * along + s[C + up] * high
            s[X + k], s[Z + k] = s[X + up] + x, s[Z + up] + z
            s[W + k] = s[W + up] + v[2 + k]
            s[VX + k], s[VZ + k] = s[VX + up] - s[W + up] * z, s[VZ + up] + s[W + up] * x
        c, n = math.cos(angle), math.sin(angle)
        s[C + k], s[S + k] = c, n
        along, high = p[a + SEGMENT.x], p[a + SEGMENT.z]
        s[GX + k], s[GZ + k] = s[X + k] + c * along - n * high, s[Z + k] + n * along + c * high


@register_jitable
def place_points(m: Any, d: Any, p: Any, s: Any) -> None:
    """Points of the soles, and what the floor does to them: force and loss of pads, and their inputs."""
    floor = int(m.actuator_user[REFLEX_ROW.floor])
    for k in range(POINTS):
        a = POINT_PLANS + k * len(POINT)
        g, pad, grip = int(p[a + POINT.segment]), int(p[a + POINT.pad]), int(p[a + POINT.grip])
        x = s[C + g] * p[a + POINT.x] - s[S + g] * p[a + POINT.z]
        z = s[S + g] * p[a + POINT.x] + s[C + g] * p[a + POINT.z]
        s[PX + k], s[PZ + k] = s[X + g] + x, s[Z + g] + z
        d.actuator_length[pad], d.actuator_velocity[pad] = s[PZ + k], s[VZ + g] + s[W + g] * x
        d.actuator_length[grip], d.actuator_velocity[grip] = s[PX + k], s[VX + g] - s[W + g] * z
        d.ctrl[pad] = floor_at(d.userdata, floor, s[PX + k])
        s[LOAD + k], s[LOSS + k] = sole_pad_force(m, d, pad, m.nuser_actuator * pad)
        s[HOLD + k], s[KEEP + k], anchor = held_by_floor(m, d, grip, m.nuser_actuator * grip, s[LOAD + k])
        per_step = 1.0 / m.opt.timestep
        at = m.actuator_actadr[grip]
        d.act_dot[m.actuator_actadr[pad]] = (s[LOSS + k] - d.act[m.actuator_actadr[pad]]) * per_step
        d.act_dot[at + GRIP_ACT.anchor] = (anchor - d.act[at + GRIP_ACT.anchor]) * per_step
        d.act_dot[at + GRIP_ACT.carried] = (s[KEEP + k] - d.act[at + GRIP_ACT.carried]) * per_step
        d.actuator_force[pad], d.actuator_force[grip] = s[LOAD + k], s[HOLD + k]


@register_jitable
def piece(p: Any, a: int, s: Any) -> float:
    """Length of the piece of a path whose plan is at a; its slopes by the hinges are added to the arms."""
    i, j = int(p[a + PATH.near]), int(p[a + PATH.far])
    far_x = s[X + j] + s[C + j] * p[a + PATH.far_x] - s[S + j] * p[a + PATH.far_z]
    far_z = s[Z + j] + s[S + j] * p[a + PATH.far_x] + s[C + j] * p[a + PATH.far_z]
    x = far_x - s[X + i] - s[C + i] * p[a + PATH.near_x] + s[S + i] * p[a + PATH.near_z]
    z = far_z - s[Z + i] - s[S + i] * p[a + PATH.near_x] - s[C + i] * p[a + PATH.near_z]
    length = math.sqrt(x * x + z * z + p[a + PATH.across])
    x, z = x / length, z / length
    while j != i:
        s[ARM + j] += z * (far_x - s[X + j]) - x * (far_z - s[Z + j])
        j = before(j)
    return length


@register_jitable
def ask_reflexes(m: Any, d: Any, p: Any, s: Any) -> None:
    """Let both legs' reflexes ask, by what the soles bear and which foot is ahead; the toes' extensors."""
    rows, slope = m.nuser_actuator, m.actuator_user[REFLEX_ROW.slope]
    trunk = ahead = other = 0.0
    for k in range(3):
        a = BALANCE + 3 * k
        g = int(p[a])
        along = s[X + g] + s[C + g] * p[a + 1] - s[S + g] * p[a + 2]
        up = s[Z + g] + s[S + g] * p[a + 1] + s[C + g] * p[a + 2]
        trunk, ahead, other = ahead, other, math.cos(slope) * along - math.sin(slope) * up
    first = second = 0.0
    for k in range(SOLE_PADS):
        first += s[LOAD + k]
        second += s[LOAD + SOLE_PADS + k]
    weight = m.actuator_user[REFLEX_ROW.weight]
    first, second = first / weight, second / weight
    reflexes_of(m, d, 0, 0, first, second, ahead - trunk, other - trunk)
    reflexes_of(m, d, 1, rows, second, first, other - trunk, ahead - trunk)


@register_jitable
def act_on(p: Any, a: int, s: Any, force: float, loss: float) -> None:
    """A path's force at the hinges, and what it loses by speed; its last piece's plan is at a."""
    i, j = int(p[a + PATH.top]), int(p[a + PATH.bottom])
    while j != i:
        s[JOINT + 2 + j] += force * s[ARM + j]
        if loss > 0.0:
            leg, k = (j - 1) // LEG, j
            while k != i:
                at = H + OWN * OWN * leg + OWN * (ROOT + (j - 1) % LEG) + ROOT + (k - 1) % LEG
                s[at] += loss * s[ARM + j] * s[ARM + k]
                k = before(k)
        j = before(j)


@register_jitable
def paths(m: Any, d: Any, p: Any, s: Any, pulling: bool) -> None:
    """Lengths of all paths, and the pull of the leg's own muscles; or the device's pull."""
    u, rows, step = m.actuator_user, m.nuser_actuator, m.opt.timestep
    length = 0.0
    for k in range(int(p[HEAD.pieces])):
        a = PATH_PLANS + k * len(PATH)
        i = int(p[a + PATH.actuator])
        row = rows * i
        own = kind_of(u, row) == Kind.LEG_MUSCLE
        if own and pulling:
            continue
        if p[a + PATH.first] > 0.0:
            length = p[a + PATH.fixed]
            for j in range(SEGMENTS):
                s[ARM + j] = 0.0
        length += piece(p, a, s)
        if not p[a + PATH.last] > 0.0:
            continue
        if own:
            d.actuator_length[i] = length
            leg_muscle_dyn(m, d, i, row)
            force = -d.userdata[int(u[row + LEG_MUSCLE_ROW.userdata]) + LEG_MUSCLE_DATA.tension]
            d.actuator_force[i] = force
            act_on(p, a, s, force, 0.0)
            s[TORQUE + 1] += force * s[ARM + ANKLE]
            s[TORQUE + 3] += force * s[ARM + ANKLE + LEG]
        elif pulling:
            _, force = force_of(m, d, i)
            d.actuator_force[i] = force
            act_on(p, a, s, force, step * d.ctrl[i])
            s[TORQUE] += force * s[ARM + ANKLE]
            s[TORQUE + 2] += force * s[ARM + ANKLE + LEG]
        else:
            velocity = 0.0
            for j in range(1, SEGMENTS):
                velocity += s[ARM + j] * d.qvel[2 + j]
            d.actuator_length[i], d.actuator_velocity[i] = length, velocity


@register_jitable
def others(m: Any, d: Any, p: Any, s: Any) -> int:
    """Whatever else acts: tissue, stops, air; the complaint, FINE for none."""
    first, step = PATH_PLANS + int(p[HEAD.pieces]) * len(PATH), m.opt.timestep
    for k in range(int(p[HEAD.others])):
        a = first + k * len(OTHER)
        i, at, gear = int(p[a + OTHER.actuator]), int(p[a + OTHER.coordinate]), p[a + OTHER.gear]
        d.actuator_length[i], d.actuator_velocity[i] = gear * d.qpos[at], gear * d.qvel[at]
    for k in range(int(p[HEAD.others])):
        a = first + k * len(OTHER)
        complaint, _, rate = rate_of(m, d, int(p[a + OTHER.actuator]))
        if complaint != FINE:
            return complaint
        if p[a + OTHER.state] >= 0.0:
            d.act_dot[int(p[a + OTHER.state])] = rate
    for k in range(int(p[HEAD.others])):
        a = first + k * len(OTHER)
        i, at, gear = int(p[a + OTHER.actuator]), int(p[a + OTHER.coordinate]), p[a + OTHER.gear]
        complaint, force = force_of(m, d, i)
        if complaint != FINE:
            return complaint
        d.actuator_force[i] = force
        if p[a + OTHER.damped] > 0.0:
            state = int(p[a + OTHER.state])
            carried = d.act[state] + step * d.act_dot[state]
            d.actuator_force[i] -= carried * d.actuator_velocity[i]
            diagonal = (OWN + 1) * (ROOT + (at - ROOT) % LEG)
            s[H + OWN * OWN * ((at - ROOT) // LEG) + diagonal] += step * gear * gear * carried
        s[JOINT + at] += gear * d.actuator_force[i]
    return FINE


@register_jitable
def balance(d: Any, p: Any, s: Any, push: float, odd: int) -> None:
    """The right side: forces at the hinges less what moves, weighs and presses; on the way composites."""
    for k in range(SEGMENTS):
        a = SEGMENT_PLANS + k * len(SEGMENT)
        s[W + k] = rate_now(d, 2 + k, odd)
        if k == 0:
            s[CX], s[CZ] = p[HEAD.backward], p[HEAD.gravity]
        else:
            up = before(k)
            s[W + k] += s[W + up]
            turning = s[W + up] * s[W + up]
            s[CX + k] = s[CX + up] - turning * (s[X + k] - s[X + up])
            s[CZ + k] = s[CZ + up] - turning * (s[Z + k] - s[Z + up])
        mass, spin = p[a + SEGMENT.mass], s[W + k] * s[W + k]
        x, z = s[GX + k] - s[X + k], s[GZ + k] - s[Z + k]
        s[FX + k], s[FZ + k] = mass * (s[CX + k] - spin * x), mass * (s[CZ + k] - spin * z)
        s[N + k] = x * s[FZ + k] - z * s[FX + k]
    for k in range(POINTS):
        g = int(p[POINT_PLANS + k * len(POINT) + POINT.segment])
        s[FX + g] -= s[HOLD + k]
        s[FZ + g] -= s[LOAD + k]
        s[N + g] -= (s[PX + k] - s[X + g]) * s[LOAD + k] - (s[PZ + k] - s[Z + g]) * s[HOLD + k]
    if push != 0.0:
        s[FX] -= push
        s[N] += (s[S] * p[BALANCE + 1] + s[C] * p[BALANCE + 2]) * push
    for k in range(SEGMENTS):
        a = SEGMENT_PLANS + k * len(SEGMENT)
        s[MASS + k], s[IN + k] = p[a + SEGMENT.mass], p[a + SEGMENT.inertia]
        s[CX + k], s[CZ + k] = s[GX + k], s[GZ + k]
    for k in range(SEGMENTS - 1, -1, -1):
        a = SEGMENT_PLANS + k * len(SEGMENT)
        own = p[a + SEGMENT.stiffness] * (d.qpos[2 + k] - p[a + SEGMENT.rest])
        s[RIGHT + 2 + k] = s[JOINT + 2 + k] - s[N + k] - own - p[a + SEGMENT.damping] * d.qvel[2 + k]
        if k == 0:
            break
        up = before(k)
        s[FX + up] += s[FX + k]
        s[FZ + up] += s[FZ + k]
        s[N + up] += s[N + k] + (s[X + k] - s[X + up]) * s[FZ + k] - (s[Z + k] - s[Z + up]) * s[FX + k]
        whole = s[MASS + up] + s[MASS + k]
        share = s[MASS + k] / whole
        x, z = s[CX + k] - s[CX + up], s[CZ + k] - s[CZ + up]
        s[IN + up] += s[IN + k] + s[MASS + up] * share * (x * x + z * z)
        s[CX + up] += share * x
        s[CZ + up] += share * z
        s[MASS + up] = whole
    s[RIGHT], s[RIGHT + 1] = -s[FX], -s[FZ]


@register_jitable
def inertia(p: Any, s: Any, step: float) -> None:
    """M, and what joints lose, into both legs' H."""
    for leg in range(2):
        h = H + OWN * OWN * leg
        for j in range(ROOT - 1, OWN):
            k = 0 if j < ROOT else LEG * leg + j - ROOT + 1
            if k == 0 and leg == 1:
                continue
            row, mass = h + OWN * j, s[MASS + k]
            x, z = s[CX + k] - s[X + k], s[CZ + k] - s[Z + k]
            s[row] -= mass * z
            s[row + 1] += mass * x
            for i in range(ROOT - 1, j + 1):
                g = 0 if i < ROOT else LEG * leg + i - ROOT + 1
                s[row + i] += s[IN + k] + mass * ((s[CX + k] - s[X + g]) * x + (s[CZ + k] - s[Z + g]) * z)
            a = SEGMENT_PLANS + k * len(SEGMENT)
            s[row + j] += p[a + SEGMENT.armature] + step * p[a + SEGMENT.damping]
    s[H] += s[MASS]
    s[H + OWN + 1] += s[MASS]


@register_jitable
def floor_losses(p: Any, s: Any, step: float) -> None:
    """What the floor loses by speed, into both legs' H."""
    for point in range(POINTS):
        up, along = step * s[LOSS + point], step * s[KEEP + point]
        if up == 0.0 and along == 0.0:
            continue
        g = int(p[POINT_PLANS + point * len(POINT) + POINT.segment])
        leg = (g - 1) // LEG
        h, last = H + OWN * OWN * leg, ROOT + (g - 1) % LEG
        s[h] += along
        s[h + OWN + 1] += up
        for j in range(ROOT - 1, last + 1):
            k = 0 if j < ROOT else LEG * leg + j - ROOT + 1
            x, z = s[PX + point] - s[X + k], s[PZ + point] - s[Z + k]
            row = h + OWN * j
            s[row] -= along * z
            s[row + 1] += up * x
            for i in range(ROOT - 1, j + 1):
                g = 0 if i < ROOT else LEG * leg + i - ROOT + 1
                s[row + i] += up * x * (s[PX + point] - s[X + g]) + along * z * (s[PZ + point] - s[Z + g])


@register_jitable
def eliminate(s: Any, h: int, leg: int, k: int) -> None:
    """Eliminate coordinate k from those before it, in a leg's H that starts at h and in the right side."""
    row, own = h + OWN * k, RIGHT + LEG * leg
    share = 1.0 / s[row + k]
    right = (own if k >= ROOT else RIGHT) + k
    for i in range(k - 1, -1, -1):
        part = s[row + i] * share
        for j in range(i + 1):
            s[h + OWN * i + j] -= part * s[row + j]
        s[(own if i >= ROOT else RIGHT) + i] -= part * s[right]
        s[row + i] = part
    s[right] *= share


@register_jitable
def solve(s: Any) -> None:
    """H a = right, in place: each leg from the toes to the hip, then the trunk, and back."""
    for leg in range(2):
        for k in range(OWN - 1, ROOT - 1, -1):
            eliminate(s, H + OWN * OWN * leg, leg, k)
    for k in range(ROOT):
        for i in range(k + 1):
            s[H + OWN * k + i] += s[H + OWN * OWN + OWN * k + i]
    for k in range(ROOT - 1, -1, -1):
        eliminate(s, H, 0, k)
    for k in range(ROOT):
        for i in range(k):
            s[RIGHT + k] -= s[H + OWN * k + i] * s[RIGHT + i]
    for leg in range(2):
        h, own = H + OWN * OWN * leg, RIGHT + LEG * leg
        for k in range(ROOT, OWN):
            for i in range(k):
                s[own + k] -= s[h + OWN * k + i] * s[(own if i >= ROOT else RIGHT) + i]


@register_jitable
def take_step(m: Any, d: Any, p: Any, s: Any, push: float) -> int:
    """One step; the complaint, FINE for none."""
    step, states = m.opt.timestep, int(p[HEAD.states])
    for k in range(states):
        d.act_dot[k] = 0.0
    for k in range(JOINT, ARM):
        s[k] = 0.0
    place_segments(p, d.qpos, d.qvel, s)
    place_points(m, d, p, s)
    ask_reflexes(m, d, p, s)
    paths(m, d, p, s, False)
    for side in range(2):
        force = toe_moment(m, d, side, m.nuser_actuator * side)
        d.actuator_force[side] = force
        s[JOINT + ROOT + LEG * (side + 1) - 1] += force
    complaint = others(m, d, p, s)
    if complaint != FINE:
        return complaint
    paths(m, d, p, s, True)
    balance(d, p, s, push, int(d.time / step + 0.5) % 2)
    inertia(p, s, step)
    floor_losses(p, s, step)
    solve(s)
    for k in range(DOFS):
        d.qvel[k] += step * s[RIGHT + k]
        d.qpos[k] += step * d.qvel[k]
    for k in range(states):
        d.act[k] += step * d.act_dot[k]
    d.time += step
    return FINE


@register_jitable
def write_row(m: Any, d: Any, p: Any, s: Any, rows: Any, at: int) -> None:
    """A row of a walk, as of the step that was taken last."""
    rows[at + ROW.time] = d.time
    for k in range(DOFS):
        rows[at + ROW.qpos + k], rows[at + ROW.qvel + k] = d.qpos[k], d.qvel[k]
        rows[at + ROW.joint + k] = s[JOINT + k]
    for k in range(POINTS):
        pad = int(p[POINT_PLANS + k * len(POINT) + POINT.pad])
        rows[at + ROW.points + 2 * k], rows[at + ROW.points + 2 * k + 1] = s[PX + k], s[PZ + k] - d.ctrl[pad]
    for k in range(4):
        rows[at + ROW.torque + k] = s[TORQUE + k]
    own, states = at + ROW.act, int(p[HEAD.states])
    for k in range(states):
        rows[own + k] = d.act[k]
    for k in range(int(p[HEAD.actuators])):
        rows[own + states + k] = d.actuator_force[k]


@register_jitable
def walk_on(m: Any, d: Any, p: Any, pushes: Any, rows: Any, ticks: int, steps: int, width: int) -> int:
    """Take steps for some ticks, each with its push, and write a row each where rows have a width.

    Returns
    -------
    How many ticks are over when the trunk has sunk, or all; −2 less the complaint of one that could not be
    """
    s, floor = block(), int(m.actuator_user[REFLEX_ROW.floor])
    for tick in range(ticks):
        for _ in range(steps):
            complaint = take_step(m, d, p, s, pushes[tick])
            if complaint != FINE:
                return -2 - complaint
        if width > 0:
            write_row(m, d, p, s, rows, width * tick)
        if not d.qpos[1] - floor_at(d.userdata, floor, d.qpos[0]) >= p[HEAD.fallen]:
            return tick + 1
    return ticks
