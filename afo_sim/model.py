"""spec → MjSpec → MjModel, and the addresses by name that everything downstream uses."""

import pathlib
from dataclasses import dataclass

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.errors import InputError, nearest_name
from afo_sim.spec import MuscleGroup, Orthosis, Scenario
from afo_sim.units import (
    AMBIENT_PRESSURE,
    AMBIENT_TEMPERATURE,
    GAS_CONSTANT,
    GRAVITY,
    HEAT_CAPACITY_RATIO,
    STANDARD_DENSITY,
    in_unit,
)

ANKLE = "ankle"
PASSIVE = "passive_ankle"
STABILITY_LIMIT = 1.0  # of rate × time step for the explicitly integrated air


@dataclass(frozen=True)
class Index:
    """Actuator ids and joint addresses by name, in the order they are recorded."""

    muscles: dict[str, int]
    chambers: dict[str, int]
    valves: dict[str, int]
    passive: int
    ankle_qpos: int
    ankle_dof: int


@dataclass(frozen=True)
class Built:
    """A compiled scenario: the model that runs, its text, and what was found while building."""

    scenario: Scenario
    model: mujoco.MjModel
    xml: str
    index: Index
    damper_stability: float
    air_stability: float
    warnings: tuple[str, ...]


def build(scenario: Scenario) -> Built:
    """Put the orthosis on the leg, compile, and check what only the compiled model can tell.

    Parameters
    ----------
    scenario : frozen description

    Returns
    -------
    Built

    Raises
    ------
    InputError
        The leg lacks a body or joint; a muscle's braid locks within the range of motion; the air
        would be unstable at this time step (with the step that would do).
    """
    spec = _assemble(scenario)
    try:
        model = spec.compile()
    except ValueError as error:
        raise InputError(f"MuJoCo cannot compile it: {error}", file=scenario.leg.file) from None
    index = _index(model, scenario.orthosis)
    _fill_parameters(model, index, scenario)
    warnings = _check_stretch(model, index, scenario)
    damper, air = _stability(model, index, scenario)
    return Built(scenario, model, spec.to_xml(), index, damper, air, (*_warnings(scenario), *warnings))


def muscle_names(orthosis: Orthosis) -> dict[str, MuscleGroup]:
    """Every single muscle by name ("dorsiflexor_1", …), with its group."""
    return {
        f"{name}_{k}": group for name, group in orthosis.muscle.items() for k in range(1, group.count + 1)
    }


def valve_names(orthosis: Orthosis) -> list[str]:
    """Every valve by name ("dorsiflexor_inlet", …)."""
    return [f"{name}_{side}" for name in orthosis.chamber for side in ("inlet", "outlet")]


def _assemble(scenario: Scenario) -> mujoco.MjSpec:
    spec = _leg_spec(scenario)
    orthosis = scenario.orthosis
    segments = _attach(spec, scenario)
    for name, group in muscle_names(orthosis).items():
        _add_tendon(spec, segments, name, group)
    _add_actuators(spec, orthosis)
    option = spec.option
    option.timestep = scenario.timestep
    option.gravity = [0.0, 0.0, -GRAVITY]
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    # an unstable simulation must stop, not start again from zero
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    return spec


def _leg_spec(scenario: Scenario) -> mujoco.MjSpec:
    leg = scenario.leg
    try:
        spec = mujoco.MjSpec.from_file(str(leg.file))
    except ValueError as error:
        raise InputError(f"MuJoCo cannot read it: {error}", file=leg.file) from None
    spec.compiler.fusestatic = False  # a URDF's fixed root would lose its mass
    for kind, name, existing in (
        ("shank", leg.shank, spec.bodies),
        ("foot", leg.foot, spec.bodies),
        ("ankle", leg.ankle, spec.joints),
    ):
        names = [element.name for element in existing if element.name]
        if name not in names:
            raise InputError(
                "the leg has no such body or joint",
                file=leg.file,
                field=f"leg.{kind}",
                value=name,
                allowed=", ".join(names),
                nearest=nearest_name(name, names),
            )
    ankle = spec.joint(leg.ankle)
    if ankle.type != mujoco.mjtJoint.mjJNT_HINGE:
        raise InputError("the ankle is not a hinge", file=leg.file, field="leg.ankle", value=leg.ankle)
    ankle.name = ANKLE
    ankle.damping = leg.damping if np.isscalar(ankle.damping) else [leg.damping, 0.0, 0.0]
    return spec


def _attach(spec: mujoco.MjSpec, scenario: Scenario) -> dict[str, mujoco.MjsBody]:
    """Cuff and plate, each a spec of its own with its own prefix, on shank and foot."""
    leg, orthosis = scenario.leg, scenario.orthosis
    shank, foot, ankle = spec.body(leg.shank), spec.body(leg.foot), spec.joint(ANKLE)
    joint_in_foot = np.array(ankle.pos)
    joint_in_shank = np.array(foot.pos) + joint_in_foot  # parallel axes at zero ankle angle
    segments = {}
    for segment, parent, file, position in (
        ("shank", shank, orthosis.cuff, joint_in_shank),
        ("foot", foot, orthosis.plate, joint_in_foot),
    ):
        part = _part_spec(file)
        root = part.worldbody.first_body()
        name = f"{file.stem}_{root.name}"
        parent.add_frame(pos=position).attach_body(root, f"{file.stem}_", "")
        segments[segment] = spec.body(name)
    return segments


def _part_spec(file: pathlib.Path) -> mujoco.MjSpec:
    try:
        part = mujoco.MjSpec.from_file(str(file))
    except ValueError as error:
        raise InputError(f"MuJoCo cannot read it: {error}", file=file) from None
    if len(part.worldbody.bodies) != 1:
        raise InputError("needs exactly one body below the world", file=file)
    return part


def _add_tendon(
    spec: mujoco.MjSpec, segments: dict[str, mujoco.MjsBody], name: str, group: MuscleGroup
) -> None:
    """The path of one muscle between two sites; half its mass stands at each end."""
    number = int(name.rsplit("_", 1)[1])
    tendon = spec.add_tendon(name=name, width=group.type.bore / 2.0)
    tendon.rgba = [0.75, 0.25, 0.2, 1.0]
    for end, anchor in (("origin", group.origin), ("insertion", group.insertion)):
        offset = (number - 0.5 * (group.count + 1)) * anchor.spacing
        position = np.array(anchor.from_ankle) + np.array([0.0, offset, 0.0])
        body = segments[anchor.segment]
        site = body.add_site(name=f"{name}_{end}", pos=position, size=[0.005] * 3)
        body.add_geom(
            name=f"{name}_{end}",
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            pos=position,
            size=[0.006, 0.0, 0.0],
            mass=group.type.mass / 2.0,
            contype=0,
            conaffinity=0,
            rgba=[0.8, 0.8, 0.82, 1.0],
        )
        tendon.wrap_site(site.name)


def _add_actuators(spec: mujoco.MjSpec, orthosis: Orthosis) -> None:
    user_dynamics = {
        "dyntype": mujoco.mjtDyn.mjDYN_USER,
        "gaintype": mujoco.mjtGain.mjGAIN_FIXED,
        "gainprm": [0.0] * 10,
        "biastype": mujoco.mjtBias.mjBIAS_NONE,
        "trntype": mujoco.mjtTrn.mjTRN_JOINT,
        "target": ANKLE,
    }
    blank = [0.0] * native.N_USER
    spec.nuser_actuator = native.N_USER
    spec.nuserdata = native.FLOWS_PER_CHAMBER * len(orthosis.chamber)
    for name in muscle_names(orthosis):
        spec.add_actuator(
            name=name,
            trntype=mujoco.mjtTrn.mjTRN_TENDON,
            target=name,
            gaintype=mujoco.mjtGain.mjGAIN_AFFINE,
            gainprm=[0.0, 0.0, -1.0] + [0.0] * 7,
            biastype=mujoco.mjtBias.mjBIAS_USER,
            userdata=blank,
        )
    spec.add_actuator(
        name=PASSIVE,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        target=ANKLE,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        gainprm=[0.0] * 10,
        biastype=mujoco.mjtBias.mjBIAS_USER,
        userdata=blank,
    )
    for name in orthosis.chamber:
        spec.add_actuator(name=f"chamber_{name}", actdim=3, userdata=blank, **user_dynamics)
    for name in valve_names(orthosis):
        spec.add_actuator(name=f"valve_{name}", actdim=2, userdata=blank, **user_dynamics)


def _index(model: mujoco.MjModel, orthosis: Orthosis) -> Index:
    joint = model.joint(ANKLE)
    return Index(
        muscles={name: model.actuator(name).id for name in muscle_names(orthosis)},
        chambers={name: model.actuator(f"chamber_{name}").id for name in orthosis.chamber},
        valves={name: model.actuator(f"valve_{name}").id for name in valve_names(orthosis)},
        passive=model.actuator(PASSIVE).id,
        ankle_qpos=int(joint.qposadr[0]),
        ankle_dof=int(joint.dofadr[0]),
    )


def _fill_parameters(model: mujoco.MjModel, index: Index, scenario: Scenario) -> None:
    """Exact parameters into the compiled model: MJCF text would cut them to six digits."""
    orthosis, user = scenario.orthosis, model.actuator_user
    groups = muscle_names(orthosis)
    for number, (chamber, actuator) in enumerate(index.chambers.items()):
        description = orthosis.chamber[chamber]
        members = [i for n, i in index.muscles.items() if _chamber_of(n, groups) == chamber]
        user[actuator] = native.chamber_row(
            first_muscle=members[0],
            inlet=index.valves[f"{chamber}_inlet"],
            outlet=index.valves[f"{chamber}_outlet"],
            tube_volume=description.tube_volume,
            wall_conductance=description.wall_conductance,
            userdata=native.FLOWS_PER_CHAMBER * number,
        )
        for side in ("inlet", "outlet"):
            valve = getattr(description, side)
            user[index.valves[f"{chamber}_{side}"]] = native.valve_row(
                conductance=valve.conductance,
                critical_ratio=valve.critical_ratio,
                opening_delay=valve.opening_delay,
                closing_delay=valve.closing_delay,
            )
        following = dict(zip(members, [*members[1:], -1], strict=True))
        for name, i in index.muscles.items():
            if i in following:
                group = groups[name]
                muscle = group.type
                user[i] = native.muscle_row(
                    law=muscle.law,
                    law_parameters=muscle.law_parameters,
                    braid=muscle.braid,
                    series_length=muscle.end_length + group.link_length + group.slack,
                    damping=muscle.damping,
                    braid_stiffness=muscle.braid_stiffness,
                    dead_volume=muscle.dead_volume,
                    chamber=actuator,
                    next_muscle=following[i],
                )
    passive = scenario.leg.passive
    user[index.passive] = native.passive_row(scale=passive.scale, offset=passive.offset)


def _chamber_of(muscle: str, groups: dict[str, MuscleGroup]) -> str:
    return groups[muscle].chamber or muscle.rsplit("_", 1)[0]


def sweep_ankle(
    model: mujoco.MjModel, index: Index, angles: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Geometry of the muscles over the ankle's angle, from the compiled model.

    Parameters
    ----------
    angles : ankle angles [rad] (n,)

    Returns
    -------
    (contraction ratio [-] (n, n_muscle), moment arm −dL/dθ [m] (n, n_muscle), inertia about the
    ankle [kg·m²] (n,))
    """
    data = mujoco.MjData(model)
    ids = list(index.muscles.values())
    rows = model.actuator_user[ids]
    length = rows[:, native.MUSCLE_NOMINAL_LENGTH]
    chain = length + rows[:, native.MUSCLE_SERIES_LENGTH]
    contraction = np.empty((len(angles), len(ids)))
    arm, inertia = np.empty_like(contraction), np.empty(len(angles))
    mass_matrix = np.zeros((model.nv, model.nv))
    jacobian = np.zeros((model.nu, model.nv))
    for k, angle in enumerate(angles):
        data.qpos[index.ankle_qpos] = angle
        mujoco.mj_fwdPosition(model, data)
        contraction[k] = (chain - data.actuator_length[ids]) / length
        mujoco.mju_sparse2dense(
            jacobian, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind
        )
        arm[k] = -jacobian[ids, index.ankle_dof]
        mujoco.mj_fullM(model, data, mass_matrix)
        inertia[k] = mass_matrix[index.ankle_dof, index.ankle_dof]
    return contraction, arm, inertia


def lock_contraction(braid_angle: float) -> float:
    """The (negative) contraction ratio at which a braid locks: κ = 1 − 1/cos α0 [-]."""
    return 1.0 - 1.0 / float(np.cos(braid_angle))


def _check_stretch(model: mujoco.MjModel, index: Index, scenario: Scenario) -> list[str]:
    """Refuse a braid that locks in the range of motion; warn of one stretched beyond its limit."""
    lower, upper = scenario.orthosis.range_of_motion
    angles = np.linspace(lower, upper, 41)
    contraction, _, _ = sweep_ankle(model, index, angles)
    warnings = []
    groups = muscle_names(scenario.orthosis)
    for column, name in enumerate(index.muscles):
        group, worst = groups[name], int(np.argmin(contraction[:, column]))
        least, angle = contraction[worst, column], np.degrees(angles[worst])
        lock = lock_contraction(group.type.braid_angle)
        role = name.rsplit("_", 1)[0]
        if least <= lock:
            missing = (lock - least) * group.type.nominal_length
            raise InputError(
                f"{name} is mounted so taut that its braid locks (contraction {lock:.3f}) within the "
                f"range of motion: {least:.3f} at {angle:.0f} deg of ankle angle",
                file=scenario.orthosis.name,
                field=f"orthosis.muscle.{role}.slack",
                value=f"{group.slack * 1000:g} mm",
                allowed=f"at least {1000 * (group.slack + missing) + 1:.0f} mm, or a longer link",
            )
        if least < group.type.limits.contraction_min and name.endswith("_1"):
            warnings.append(
                f"{role} muscles are stretched to a contraction of {least:.3f} at {angle:.0f} deg, "
                f"beyond their limit of {group.type.limits.contraction_min:g}"
            )
    return warnings


def _stability(model: mujoco.MjModel, index: Index, scenario: Scenario) -> tuple[float, float]:
    """Rate × time step of the Hill damper, and of the fastest chamber.

    The damper's number h R p_abs Σr²/(L0 I) would have to stay below 2 for an explicit integrator;
    here it is integrated implicitly and the number is only reported. The air is explicit: laminar
    flow through open valves, and heat to the wall, must be slow against the time step.
    """
    step, orthosis = scenario.timestep, scenario.orthosis
    absolute = scenario.supply.pressure + AMBIENT_PRESSURE
    _, arm, inertia = sweep_ankle(model, index, np.linspace(*orthosis.range_of_motion, 9))
    groups = muscle_names(orthosis)
    gain = np.array([g.type.damping * absolute / g.type.nominal_length for g in groups.values()])
    damper = float(np.max(step * (arm**2 @ gain) / inertia))
    air = 0.0
    for name, chamber in orthosis.chamber.items():
        muscles = orthosis.muscles_of(name).values()
        volume = chamber.tube_volume + sum(g.count * g.type.dead_volume for g in muscles)
        volume += sum(g.count * g.type.braid.nominal_length * np.pi * g.type.bore**2 / 4 for g in muscles)
        flow = sum(_laminar_slope(v.conductance, v.critical_ratio) for v in (chamber.inlet, chamber.outlet))
        mass = AMBIENT_PRESSURE * volume / (GAS_CONSTANT * AMBIENT_TEMPERATURE)
        heat = chamber.wall_conductance / (mass * GAS_CONSTANT / (HEAT_CAPACITY_RATIO - 1.0))
        rate = HEAT_CAPACITY_RATIO * GAS_CONSTANT * AMBIENT_TEMPERATURE * flow / volume + heat
        air = max(air, step * rate)
        if step * rate > STABILITY_LIMIT:
            raise InputError(
                f"the air of chamber {name!r} moves too fast for this time step "
                f"({rate:.0f} /s through its open valves and walls)",
                field="timestep",
                value=f"{in_unit(step, 's', 'ms'):g} ms",
                allowed=f"at most {in_unit(STABILITY_LIMIT / rate, 's', 'ms'):.2g} ms",
            )
    return damper, air


def _laminar_slope(conductance: float, critical: float) -> float:
    """Slope of the valve's mass flow at equal pressures [kg/(s·Pa)]."""
    from afo_sim.physics.pneumatics import LAMINAR_RATIO

    x = (LAMINAR_RATIO - critical) / (1.0 - critical)
    return conductance * STANDARD_DENSITY * float(np.sqrt(1.0 - x * x)) / (1.0 - LAMINAR_RATIO)


def _warnings(scenario: Scenario) -> list[str]:
    """What the description itself gives reason to say."""
    found = []
    from afo_sim.physics.passive_ankle import KNEE_LIMIT

    if scenario.shank.knee_angle > KNEE_LIMIT:
        found.append(
            f"the passive ankle is extrapolated: Riener & Edrich measured to 60 deg of knee angle, "
            f"here it is {np.degrees(scenario.shank.knee_angle):g} deg"
        )
    for name, times in scenario.timer.chambers.items():
        for a, b in times.inlet:
            for c, d in times.outlet:
                if max(a, c) < min(b, d):
                    found.append(
                        f"inlet and outlet of chamber {name!r} are open together from "
                        f"{max(a, c):g} s to {min(b, d):g} s: the supply blows off"
                    )
    return found
