"""A walk as a task: what its sensors see, from the recorded stride and the state, and its reward.

Toe and heel earn, a hindered push-off and air cost, each 0 to 1 between limits of the verdict.
"""

import math
from collections.abc import Callable, Mapping

import numpy as np

from afo_sim.common import GRAVITY, FloatOrArray
from afo_sim.description import Scenario, load
from afo_sim.gait import STANCE_FORCE, STANCE_SHARE, GaitCycle
from afo_sim.metrics import HEEL_RISE, air_given
from afo_sim.model import ACTIVE, GROUND, JOINTS, SPASTIC, STIFFNESS, TOE_POINTS, Built
from afo_sim.rl.environments.task import Random, Reader, Sample
from afo_sim.simulation import NARROWEST

FAST, BEGUN = 0.75, 0.1  # quantile of speed, share of swing: as in the metrics of clearance [-]
CLOSES = 30.0  # load of a foot switch, as of `sensors/fsr_footswitch` [N]
PASSING, PUSHING, STRUCK, UPWARD, AHEAD, FIRST_NOISE = range(6)  # columns of the script
# of shank's angle [rad], its rate [rad/s], two pressures [Pa]: as of the shipped sensors
NOISE = (math.radians(0.1), math.radians(0.05), 780.0, 780.0)
# The verdict ranks no question above another; doing nothing earns what the patient does without the device.
LIFT, HEEL, PUSH_OFF, AIR = 0.5, 0.5, -0.5, -0.5
LEAST, MOST = PUSH_OFF + AIR, 1.0  # of a period [-]
BEYOND = 1e-12  # from equal limits to the whole price
FEWEST = 1e-9  # strides of a bottle that a limit may ask for; 0 would divide


def script(built: Built, times: np.ndarray) -> Callable[[Random], np.ndarray]:
    """What a recorded walk asks at times [s] (k,), and the noise of its sensors (k, 9)."""
    assert built.walk is not None
    steps = 1 + np.rint(times / built.scenario.timestep).astype(int)
    share, stride = np.modf(built.walk.phase[steps])
    _, upward, ahead = (values[steps] for values in built.walk.ground)
    first, last = passing(built.walk.cycle)
    struck = np.diff(stride, prepend=stride[0]) > 0.0
    passes, pushes = (
        mask * (struck.sum() / mask.sum())  # of one for each stride
        for mask in ((share >= first) & (share < last), (upward > STANCE_FORCE) & (share >= HEEL_RISE))
    )
    table = np.stack([passes, pushes, struck, upward * built.body_mass * GRAVITY, ahead], axis=1)
    return lambda random: np.hstack([table, random.normal(0.0, NOISE, (len(times), len(NOISE)))])


def passing(cycle: GaitCycle) -> tuple[float, float]:
    """Phases between which a swinging foot passes the standing leg, as the metrics of clearance have it."""
    phase = np.arange(1000) / 1000.0
    speed, lean = cycle.signal("ankle_x", phase, 1), cycle.signal("shank_angle", phase)
    swings = (cycle.ground(phase)[1] <= STANCE_FORCE) & (phase > STANCE_SHARE[0])
    off = float(phase[np.argmax(swings)])
    upright = float(phase[swings & (lean <= 0.0)][0]) if (swings & (lean <= 0.0)).any() else 1.0
    fast = phase[swings & (speed >= np.quantile(speed, FAST)) & (phase < upright)]
    return max(float(fast[0]), off + BEGUN * (1.0 - off)), upright


def readers(built: Built) -> Mapping[str, Reader]:
    """Columns of a walk by name: the formulas of `simulation/walk_columns.py`, addresses looked up once."""
    assert built.foot is not None
    model, index, foot, toes = built.model, built.index, built.foot, built.scenario.leg.toes
    height, shank = (int(model.joint(name).qposadr[0]) for name in JOINTS[1:])
    rate = int(model.joint(JOINTS[2]).dofadr[0])
    extension = None if toes is None else int(model.joint(toes.joint).qposadr[0])
    heel, ball = foot.points["heel"], foot.points["ball"]
    hinge = foot.toes.hinge if foot.toes else (0.0, 0.0)
    pulp, tip = (np.subtract(foot.points[name], hinge) for name in TOE_POINTS)
    others = [index.passive, *(index.walking[name] for name in (ACTIVE, STIFFNESS, SPASTIC, GROUND))]
    limits, mass = limits_of(built.scenario), built.body_mass

    def pitch(s: Sample) -> np.ndarray:
        return s.rows["qpos"][index.ankle_qpos] - s.rows["qpos"][shank]

    def raised(point: FloatOrArray, angle: np.ndarray) -> np.ndarray:
        return point[0] * np.sin(angle) + point[1] * np.cos(angle)

    def lowest(s: Sample) -> np.ndarray:
        angle = s["pitch"] if extension is None else s["pitch"] + s.rows["qpos"][extension]
        ahead = raised(hinge, s["pitch"]) + np.minimum(raised(pulp, angle), raised(tip, angle))
        return s.rows["qpos"][height] + np.minimum(raised(ball, s["pitch"]), ahead)

    def toe_load(s: Sample) -> np.ndarray:
        behind, before = (x * np.cos(s["pitch"]) - z * np.sin(s["pitch"]) for x, z in (heel, ball))
        share = (s.script[AHEAD] - behind) / np.maximum(before - behind, NARROWEST)
        return s.script[UPWARD] * np.clip(share, 0.0, 1.0)

    def moment(s: Sample) -> np.ndarray:
        own = np.add.reduce(s.rows["actuator_force"][others])
        return (s.rows["qfrc_actuator"][index.ankle_dof] - own) / mass

    return {
        "limits": lambda s: limits,
        "passing": lambda s: s.script[PASSING],
        "pushing": lambda s: s.script[PUSHING],
        "struck": lambda s: s.script[STRUCK],
        "shank/angle": lambda s: s.rows["qpos"][shank],
        "shank/velocity": lambda s: s.rows["qvel"][rate],
        "pitch": pitch,
        "sole/pitch": lambda s: s["pitch"] - foot.level,
        "toe/height": lowest,
        "foot/toe_load": toe_load,
        "foot/heel_load": lambda s: s.script[UPWARD] - s["foot/toe_load"],
        "ankle/moment/orthosis": moment,  # by body mass [N·m/kg]
    }


def limits_of(scenario: Scenario) -> np.ndarray:
    """Limits of the verdict on toe [m], heel [rad], torque [N·m/kg] and air of a stride [kg] (4, 2)."""
    limits = scenario.limits or load("limits", "usual")
    bottle = air_given(limits.bottle_volume, limits.bottle_pressure, scenario.supply.pressure)
    air = bottle / np.maximum(limits.strides_per_bottle, FEWEST)
    pairs = np.array([limits.toe_clearance, limits.contact_pitch, limits.torque_against_push_off, air])
    falling = np.array([-1.0, -1.0, 1.0, 1.0])
    pairs[:, 1] += np.where(pairs[:, 0] == pairs[:, 1], BEYOND * falling, 0.0)
    return pairs


def badness(value: FloatOrArray, pair: np.ndarray) -> FloatOrArray:
    """0 up to the first limit, 1 from the second on, straight between them; also of limits that fall."""
    good, bad = pair
    return np.clip((value - good) / (bad - good), 0.0, 1.0)


def walking_reward(sample: Sample) -> FloatOrArray:
    """Of a period of walking [-], LEAST to MOST."""
    toe, heel, torque, air = sample["limits"]
    earned = LIFT * sample["passing"] * (1.0 - badness(sample["toe/height"], toe))
    earned += HEEL * sample["struck"] * (1.0 - badness(sample["sole/pitch"], heel))
    against = sample["pushing"] * badness(sample["ankle/moment/orthosis"], torque)
    return earned + PUSH_OFF * against + AIR * np.minimum(sample["air/taken"] / air[1], 1.0)
