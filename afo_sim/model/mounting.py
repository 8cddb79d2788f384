"""Mounting of the muscles, and the checks before a run that need the compiled model."""

import math
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common.errors import InputError
from afo_sim.description.leg import Leg
from afo_sim.description.orthosis import MuscleGroup, Orthosis
from afo_sim.description.rest_curves import at_rest
from afo_sim.description.scenario import Scenario
from afo_sim.physics.passive_ankle import KNEE_LIMIT

ANKLE, SUBTALAR = "ankle", "subtalar"
MOST_JOINTS = 8  # that an error names
RIGHTWARD = np.array([0.0, -1.0, 0.0])  # axis about which toe up is positive


@dataclass(frozen=True)
class Index:
    """Actuator ids and joint addresses by name, in the order they are recorded."""

    muscles: dict[str, int]
    chambers: dict[str, int]
    valves: dict[str, int]
    frictions: dict[str, int]
    anchors: dict[str, tuple[int, int]]  # (network, number in it)
    passive: int
    walking: dict[str, int]
    ankle_qpos: int
    ankle_dof: int
    drives: dict[str, int] = field(default_factory=dict)  # by chamber
    volumes: dict[str, int] = field(default_factory=dict)
    stores: dict[str, int] = field(default_factory=dict)
    restrictions: dict[str, int] = field(default_factory=dict)  # those without a coil


def muscle_names(orthosis: Orthosis) -> dict[str, MuscleGroup]:
    """Every single muscle by name ("dorsiflexor_1", …), with its group."""
    return {
        f"{name}_{k}": group for name, group in orthosis.muscle.items() for k in range(1, group.count + 1)
    }


def chamber_of(muscle: str, group: MuscleGroup) -> str:
    """The chamber that a single muscle ("dorsiflexor_1") of a group hangs on."""
    return group.chamber or muscle.rsplit("_", 1)[0]


def valve_names(orthosis: Orthosis) -> list[str]:
    """Every valve by name ("dorsiflexor_inlet", …)."""
    return [f"{name}_{side}" for name in orthosis.chamber for side in ("inlet", "outlet")]


def check_leg(model: mujoco.MjModel, scenario: Scenario) -> None:
    """Refuse a leg that is put together otherwise than everything here assumes."""
    leg = scenario.leg
    joint, toes = model.joint(ANKLE), leg.toes
    hinges = [model.joint(toes.joint).id] if toes is not None and scenario.walking else []
    foot, shank = model.body(leg.foot).id, model.body(leg.shank).id
    data = native.scratch(model)
    data.qpos[joint.qposadr[0]] = 0.0
    mujoco.mj_kinematics(model, data)
    turned = max(np.abs(data.xmat[body].reshape(3, 3) - np.eye(3)).max() for body in (foot, shank))
    for wrong, problem in (
        (joint.bodyid[0] != foot, f"the ankle is not the joint of the body {leg.foot!r}"),
        (model.body_parentid[foot] != shank, f"{leg.foot!r} does not hang on {leg.shank!r} directly"),
        (
            any(np.abs(data.xaxis[k] - RIGHTWARD).max() > 1e-6 for k in hinges),
            'the toes\' axis is not axis="0 -1 0", about which extension is positive',
        ),
        (turned > 1e-6, "shank or foot is turned against x forward, y left, z up at zero ankle angle"),
        (
            np.abs(data.xaxis[joint.id] - RIGHTWARD).max() > 1e-6,
            'the ankle\'s axis is not axis="0 -1 0", about which dorsiflexion is positive',
        ),
        (
            not model.jnt_limited[joint.id] or not np.isfinite(model.jnt_range[joint.id]).all(),
            "the ankle has no range: it needs stops",
        ),
    ):
        if wrong:
            raise InputError(problem, file=leg.file, field="leg", allowed=_cut_out(leg))


def check_joints(names: Sequence[str], leg: Leg, subtalar: bool) -> None:
    """Refuse a leg that has joints beside the ankle and the toes' hinge."""
    own = (
        {ANKLE} | ({SUBTALAR} if subtalar else set()) | ({leg.toes.joint} if leg.toes is not None else set())
    )
    found = [name or "one without a name" for name in names if name not in own]
    if not found:
        return
    joints = f"{'is the joint' if len(found) == 1 else 'are the joints'} {', '.join(found[:MOST_JOINTS])}"
    more = f" and {len(found) - MOST_JOINTS} more" if len(found) > MOST_JOINTS else ""
    raise InputError(
        f"beside the ankle there {joints}{more} in the leg's file; the toes' hinge is described by [toes] in "
        "the leg's TOML file",
        file=leg.file,
        field="leg",
        allowed=_cut_out(leg),
    )


def _cut_out(leg: Leg) -> str:
    """The command that mends a leg."""
    return f"a leg cut out and turned by: afo-sim leg import {shlex.quote(str(leg.file))}"


def sweep_ankle(
    model: mujoco.MjModel, index: Index, angles: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Geometry of the muscles over the ankle's angle, from the compiled model.

    Parameters
    ----------
    angles : ankle angles [rad] (n,)

    Returns
    -------
    (contraction ratio of the path, as of a muscle on rigid anchors [-] (n, n_muscle), moment arm −dL/dθ [m]
    (n, n_muscle), inertia about the ankle [kg·m²] (n,))
    """
    data = native.scratch(model)
    ids = list(index.muscles.values())
    lengths = np.empty((len(angles), len(ids)))
    arm, inertia = np.empty_like(lengths), np.empty(len(angles))
    mass_matrix = np.zeros((model.nv, model.nv))
    jacobian = np.zeros((model.nu, model.nv))
    for k, angle in enumerate(angles):
        data.qpos[index.ankle_qpos] = angle
        mujoco.mj_fwdPosition(model, data)
        lengths[k] = data.actuator_length[ids]
        mujoco.mju_sparse2dense(
            jacobian, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind
        )
        arm[k] = -jacobian[ids, index.ankle_dof]
        mujoco.mj_fullM(model, data, mass_matrix)
        inertia[k] = mass_matrix[index.ankle_dof, index.ankle_dof]
    return contractions(model, ids, lengths), arm, inertia


def contractions(model: mujoco.MjModel, muscles: list[int], lengths: np.ndarray) -> np.ndarray:
    """Contraction ratios of paths of these lengths [m] (n, n_muscle), by the muscles' rows [-]."""
    rows = model.actuator_user[muscles]
    own = rows[:, native.MUSCLE_NOMINAL_LENGTH]
    return (own + rows[:, native.MUSCLE_SERIES_LENGTH] - lengths) / own


def sweep_lengths(model: mujoco.MjModel, muscles: list[int], ankle: int, angles: np.ndarray) -> np.ndarray:
    """Lengths of the muscles' paths over the ankle's angle [m] (n, n_muscle).

    Parameters
    ----------
    model : compiled
    muscles : actuator ids
    ankle : the ankle's place in qpos
    angles : [rad] (n,)
    """
    data = native.scratch(model)
    lengths = np.empty((len(angles), len(muscles)))
    for k, angle in enumerate(angles):
        data.qpos[ankle] = angle
        mujoco.mj_fwdPosition(model, data)
        lengths[k] = data.actuator_length[muscles]
    return lengths


def path_contraction(group: MuscleGroup, orthosis: Orthosis, kappa: float) -> float:
    """Contraction ratio of the path [-] that stretches a muscle without air to its own `kappa` [-].

    The difference is what its cable, and under the pull of the whole group cuff and plate, give.
    """
    return _path_contraction(group, orthosis)(kappa)


def _path_contraction(group: MuscleGroup, orthosis: Orthosis) -> Callable[[float], float]:
    """`path_contraction` as a function of the own contraction."""
    anchors = tuple(orthosis.anchor.values()) if group.pulley is None else ()
    bare, cable, length = at_rest(group.type), group.cable.stiffness, group.type.nominal_length

    def of(kappa: float) -> float:
        pull = bare.force(float(kappa), 0.0)
        gives = pull / cable + sum(a.displacement(group.count * pull) for a in anchors)
        return kappa - gives / length

    return of


def own_contraction(group: MuscleGroup, orthosis: Orthosis, path: float) -> float:
    """Contraction ratio of a muscle without air, where that of its path is `path` [-]."""
    if path >= 0.0:
        return path
    of = _path_contraction(group, orthosis)

    def too_long(kappa: float) -> float:
        return of(kappa) - path

    if too_long(path) >= 0.0:
        return path
    if too_long(0.0) <= 0.0:
        return 0.0
    from scipy.optimize import brentq  # large, and seldom needed

    return float(brentq(too_long, path, 0.0))


def check_stretch(
    model: mujoco.MjModel,
    angles: np.ndarray,
    lengths: np.ndarray,
    muscles: Mapping[str, int],
    orthosis: Orthosis,
) -> list[str]:
    """Refuse a braid that locks in the range of motion; warn of one stretched beyond its limit.

    Parameters
    ----------
    model : with its parameters
    angles : of the ankle over the range of motion [rad] (n,)
    lengths : of the muscles' paths at these angles [m] (n, n_muscle)
    muscles : actuator ids by name
    orthosis : whose muscles they are
    """
    contraction = contractions(model, list(muscles.values()), lengths)
    known: dict[tuple[str, float], float] = {}  # parallel muscles are stretched alike
    warnings = []
    groups = muscle_names(orthosis)
    for column, name in enumerate(muscles):
        group, worst = groups[name], int(np.argmin(contraction[:, column]))
        path, angle = contraction[worst, column], np.degrees(angles[worst])
        role = name.rsplit("_", 1)[0]
        if (role, path) not in known:
            known[role, path] = own_contraction(group, orthosis, path)
        least = known[role, path]
        lock = group.type.braid.lock
        allowed = group.type.limits
        if least <= lock:
            problem = (
                f"{name} is mounted too taut: at {angle:.0f} deg, within the range of motion, its braid "
                f"would be stretched by {-100 * least:.1f} %, and it locks at {-100 * lock:.1f} %"
            )
            would_do = path_contraction(group, orthosis, allowed.contraction_min)
            raise _too_taut(problem, orthosis.name, role, group, would_do - path)
        if not name.endswith("_1"):
            continue  # its neighbours say the same
        if least < allowed.contraction_min:
            warnings.append(
                f"{role} muscles are stretched to a contraction of {least:.3f} at {angle:.0f} deg, "
                f"beyond their limit of {allowed.contraction_min:g}"
            )
        most = float(contraction[:, column].max())
        if most > allowed.contraction_max:
            travel = 100.0 * (most - least) * group.type.nominal_length
            gives = 100.0 * allowed.contraction_max * group.type.nominal_length
            warnings.append(
                f"{role} muscles cannot follow the whole range of motion: it takes up {travel:.1f} cm, "
                f"they shorten by {gives:.1f} cm at most; a longer muscle, a shorter moment arm or a "
                "narrower range_of_motion would do"
                if travel > gives
                else f"{role} muscles are mounted too slack to follow the whole range of motion: at its end "
                f"they would have to be shorter by a contraction of {most:.3f}, and their limit is "
                f"{allowed.contraction_max:g}; a shorter link_length would do"
            )
    return warnings


def _too_taut(problem: str, file: str, role: str, group: MuscleGroup, missing: float) -> InputError:
    """With what would do: `missing` is the contraction ratio of the path that the mounting lacks."""
    if group.pulley is not None:
        kappa = group.pulley.initial_contraction
        field, value = "pulley.initial_contraction", f"{kappa:g}"
        enough = f"at least {math.ceil(1000 * (kappa + missing)) / 1000:g}"
    else:
        field, value = "slack", f"{group.slack * 1000:g} mm"
        length = group.slack + missing * group.type.nominal_length
        enough = f"at least {math.ceil(1000 * length)} mm, or as much more link_length"
    return InputError(
        problem,
        file=file,
        field=f"orthosis.muscle.{role}.{field}",
        value=value,
        allowed=f"{enough}, or a narrower range_of_motion",
    )


def check_description(scenario: Scenario) -> list[str]:
    """Warnings that follow from the description alone."""
    found = []
    knee = scenario.shank.knee_angle
    if knee is not None and knee > KNEE_LIMIT and scenario.leg.passive.scale > 0.0:
        found.append(
            f"the passive ankle is extrapolated: Riener & Edrich measured to 60 deg of knee angle, "
            f"here it is {np.degrees(knee):g} deg"
        )
    for name, times in scenario.timer.chambers.items() if scenario.timer else ():
        for a, b in times.inlet:
            for c, d in times.outlet:
                if max(a, c) < min(b, d):
                    found.append(
                        f"inlet and outlet of chamber {name!r} are open together from "
                        f"{max(a, c):g} s to {min(b, d):g} s: the supply blows off"
                    )
    if scenario.walking and scenario.orthosis.plate is not None and scenario.orthosis.outsole is None:
        on = "in the shoe" if scenario.shoe is not None else "barefoot"
        found.append(
            f"the orthosis' plate has no [outsole]: the foot walks as if {on}, whatever lies under it"
        )
    return found
