"""The antagonistic arm: S2's and S1's own equations, the pulley, the load, laws side by side."""

import itertools
import math
import pathlib

import numpy as np
import pytest
from air.reference import iso_flow
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

import afo_sim
from afo_sim.common import InputError
from afo_sim.description import load
from afo_sim.model import sweep_ankle
from afo_sim.model.build import build
from afo_sim.show import panels, run_figure
from afo_sim.show.run_view import alone
from afo_sim.simulation import Recording

LAWS = ("kerscher_2006", "maximum_force", "sarosi_2012", "polynomial")
GROUPS = ("flexor", "extensor")


def law_in_all(law: str) -> dict[str, str]:
    return {f"orthosis.muscle.{group}.type.law": law for group in GROUPS}


def degrees(run: Recording) -> np.ndarray:
    return np.degrees(run["ankle/angle"])


# --- S2's equations written out: nothing below calls this project's physics -------------------------

AMBIENT, WARM, GAS, GAMMA = 101_325.0, 293.15, 287.05, 1.4  # Pa, K, J/(kg K), -


def spring_force(law: str, q: dict[str, float], kappa: float, p: float, radius: float, angle: float) -> float:
    """F_s(κ, p) of S2, eq. 3–5, 8–9, 10 and 11; p gauge [Pa]."""
    bar = p / 1e5
    if law == "kerscher_2006":
        a, b = 3.0 / math.tan(angle) ** 2, 1.0 / math.sin(angle) ** 2
        mu = q["a_kappa"] * math.exp(-q["c_kappa"] * kappa) - q["b_kappa"]
        epsilon = q["a_epsilon"] * math.exp(-bar) - q["b_epsilon"]
        return mu * math.pi * radius**2 * p * (a * (1.0 - epsilon * kappa) ** 2 - b)
    if law == "maximum_force":
        most = sum(q[f"b{i}"] * kappa**i for i in range(5))
        return most - (q["maximum_pressure"] - p) * sum(q[f"a{i}"] * kappa**i for i in range(3))
    if law == "sarosi_2012":
        x = 100.0 * kappa
        start = (q["a1"] * bar + q["a2"]) * math.exp(q["a3"] * x)
        return start + q["a4"] * x * bar + q["a5"] * bar + q["a6"]
    if law == "tondu_lopez_2000_bladder":  # S1's spring force, less what its bladder takes
        a, b = 3.0 / math.tan(angle) ** 2, 1.0 / math.sin(angle) ** 2
        braid = math.pi * radius**2 * p * (a * (1.0 - q["k"] * kappa) ** 2 - b)
        return braid - q["bladder_force"] - q["bladder_stiffness"] * kappa
    x, y = 10.0 * kappa, p / 6e5
    return sum(q[f"a{i}{j}"] * x**i * y**j for i in range(6) for j in range(6 - i))


class Arm:
    """φ″ = ((F1 − F2) r − T_L)/J; states φ, φ̇, and κ, m, P of each.

    F = F_s − R P κ̇ is the tension of a cable between the muscle and where κ0 ± r φ/l0 would have it.
    """

    def __init__(self, name: str, law: str):
        self.scenario = load("scenario", name, law_in_all(law))
        self.law, self.inertia = law, 0.05  # models/legs/arm/leg.xml
        self.groups = [self.scenario.orthosis.muscle[g] for g in GROUPS]
        self.chambers = [self.scenario.orthosis.chamber[g] for g in GROUPS]
        muscle = self.groups[0].type
        self.length = muscle.total_length - muscle.end_length
        self.radius, self.angle = muscle.bore / 2.0, muscle.braid_angle
        self.values = muscle.laws[law].parameters
        self.lowest = muscle.laws[law].pressure_range[0]
        kappas = np.linspace(0.0, 0.27, 541)
        forces = [
            [spring_force(law, self.values, x, p, self.radius, self.angle) for p in (6e5, 1e5)]
            for x in kappas.tolist()
        ]
        self.by_pressure = CubicSpline(kappas, np.subtract(*np.transpose(forces)) / 5e5)
        self.grown = self.by_pressure.antiderivative()

    def braid(self, kappa: float) -> tuple[float, float]:
        """Volume of a braid of constant thread (Chou & Hannaford), and dV/dκ."""
        b, x = 1.0 / math.sin(self.angle) ** 2, 1.0 - kappa
        full = math.pi * self.radius**2 * self.length
        return full * x * (b - (b - 1.0) * x * x), full * (3.0 * (b - 1.0) * x * x - b)

    def volume(self, k: int, kappa: float, absolute: float) -> tuple[float, float, float]:
        """Muscles, fittings and tube: a braid and L0 ∫ ∂F/∂p dκ of law and return force; ∂V/∂κ, ∂V/∂p."""
        muscle, p = self.groups[k].type, max(absolute - AMBIENT, 0.0)
        own, slope = self.braid(kappa)
        if self.law not in ("kerscher_2006", "tondu_lopez_2000_bladder"):  # whose volume is the braid's
            inside = max(kappa, 0.0)
            rate = float(self.by_pressure(inside))
            own = self.braid(0.0)[0] + self.length * (float(self.grown(inside)) + rate * (kappa - inside))
            slope = self.length * rate
        left, returning = max(0.0, 1.0 - p / 1e5), self.length * muscle.return_stiffness * kappa / 1e5
        own, slope = own + returning * kappa * left, slope + 2.0 * returning * left
        by_pressure = -returning * kappa / 1e5 if left > 0.0 else 0.0
        count, tube = self.groups[k].count, self.chambers[k].tube_volume
        return count * (own + muscle.dead_volume) + tube, count * slope, count * by_pressure

    def tension(self, k: int, phi: float, kappa: float) -> float:
        """Of one muscle's cable, which hangs through where the muscle is longer than its path."""
        pulley = self.groups[k].pulley
        path = pulley.initial_contraction + (1, -1)[k] * pulley.radius * phi / self.length
        return self.groups[k].cable.stiffness * max(self.length * (kappa - path), 0.0)

    def force(self, k: int, kappa: float, absolute: float) -> float:
        """Of one muscle: the law, stretched its braid and air, without air its return force."""
        p, muscle = max(absolute - AMBIENT, 0.0), self.groups[k].type
        static = spring_force(self.law, self.values, max(kappa, 0.0), p, self.radius, self.angle)
        if p < self.lowest:  # below where the law was fitted: no more than in proportion to the pressure
            least = spring_force(self.law, self.values, max(kappa, 0.0), self.lowest, self.radius, self.angle)
            static = min(static, least * p / self.lowest)
        if kappa < 0.0:
            if static < 0.0:  # what pushes leaves the braid over half a per mil
                static *= max(0.0, 1.0 + kappa / 5e-4)
            within = min(-kappa, 0.005)  # the braid's stiffness sets in over half a per cent
            static += muscle.braid_stiffness * (within**2 / 0.01 - kappa - within)
            static += p * (self.braid(kappa)[1] - self.braid(0.0)[1]) / self.length
        return static - muscle.return_stiffness * kappa * max(0.0, 1.0 - p / 1e5) ** 2

    def resting(self, k: int, phi: float) -> float:
        """κ of an empty muscle."""
        return brentq(lambda x: self.force(k, x, AMBIENT) - self.tension(k, phi, x), -0.08, 0.5, xtol=1e-14)

    def rates(self, state: np.ndarray, opened: dict[str, bool]) -> list[float]:
        phi, speed = state[:2]
        torque, own = 0.0, []
        for k, name in enumerate(GROUPS):
            kappa, mass, absolute = state[2 + 3 * k : 5 + 3 * k]
            group, chamber = self.groups[k], self.chambers[k]
            tension = self.tension(k, phi, kappa)
            torque += (1, -1)[k] * group.pulley.radius * group.count * tension
            rate = (self.force(k, kappa, absolute) - tension) / (group.type.damping * absolute)
            volume, slope, softer = self.volume(k, kappa, absolute)
            warm = absolute * volume / (mass * GAS)
            gains = losses = 0.0
            for side, valve, ends in (
                ("inlet", chamber.inlet, (self.scenario.supply.pressure + AMBIENT, WARM, absolute, warm)),
                ("outlet", chamber.outlet, (absolute, warm, AMBIENT, WARM)),
            ):
                if opened[f"{name}_{side}"]:
                    through = iso_flow(*ends, valve.conductance, valve.critical_ratio)
                    into = through if side == "inlet" else -through
                    gains, losses = gains + max(into, 0.0), losses + max(-into, 0.0)
            enthalpy = GAMMA * GAS * (gains * WARM - losses * warm)
            heat = (GAMMA - 1.0) * chamber.wall_conductance * (WARM - warm)
            stiff = volume + GAMMA * absolute * softer  # V ṗ + γ p V̇ = …, and V̇ holds ∂V/∂p ṗ
            own += [rate, gains - losses, (enthalpy + heat - GAMMA * absolute * slope * rate) / stiff]
        return [speed, (torque - self.scenario.load_moment) / self.inertia, *own]

    def is_open(self, moment: float) -> dict[str, bool]:
        """Each valve opens and shuts its dead time after the timer says so."""
        found = {}
        for name, chamber in zip(GROUPS, self.chambers, strict=True):
            times = self.scenario.timer.chambers[name]
            for side in ("inlet", "outlet"):
                valve = getattr(chamber, side)
                found[f"{name}_{side}"] = any(
                    start + valve.opening_delay <= moment < end + valve.closing_delay
                    for start, end in getattr(times, side)
                )
        return found

    def solve(self, duration: float, phi: float = 0.0) -> np.ndarray:
        """φ every millisecond [deg], from rest at `phi` with empty muscles, switch by switch."""
        contractions = [self.resting(k, phi) for k in range(2)]
        air = [
            AMBIENT * self.volume(k, kappa, AMBIENT)[0] / (GAS * WARM) for k, kappa in enumerate(contractions)
        ]
        rest = [x for kappa, mass in zip(contractions, air, strict=True) for x in (kappa, mass, AMBIENT)]
        state, angles = np.array([phi, 0.0, *rest]), []
        changes = {0.0, duration}
        for times in self.scenario.timer.chambers.values():
            for event in itertools.chain(*times.inlet, *times.outlet):
                changes.add(round(event + 0.004, 9))  # both dead times
        marks = sorted(c for c in changes if 0.0 <= c <= duration)
        for start, end in itertools.pairwise(marks):
            opened = self.is_open(0.5 * (start + end))
            points = np.arange(round(start * 1000), round(end * 1000)) / 1000.0
            found = solve_ivp(
                lambda t, y, opened=opened: self.rates(y, opened),
                (start, end),
                state,
                method="LSODA",
                t_eval=np.append(points, end),
                rtol=1e-8,
                atol=[1e-9, 1e-8, 1e-9, 1e-12, 1e-2, 1e-9, 1e-12, 1e-2],
            )
            assert found.success
            angles.append(found.y[0, :-1])
            state = found.y[:, -1]
        return np.degrees(np.concatenate(angles))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "law"), [*(("arm", law) for law in LAWS), *(("arm-short", law) for law in LAWS)]
)
def test_arm_follows_s2s_equations(name: str, law: str) -> None:
    """The whole run within 0.02° of an integration that shares only the shipped numbers."""
    run = afo_sim.run(name, law_in_all(law))
    expected = Arm(name, law).solve(11.0)
    assert np.ptp(expected) > 15.0
    assert np.abs(degrees(run) - expected).max() < 0.02


def test_arm_follows_s1s_angle_subsystem() -> None:
    """φ″ = (T − T_L)/J with S1's muscles, over one cycle of its timer, from where the load rests."""
    run = afo_sim.run("arm-s1", {"duration": "8 s"})
    expected = Arm("arm-s1", "tondu_lopez_2000_bladder").solve(8.0, run["ankle/angle"][0])
    assert np.ptp(expected) > 50.0
    assert np.abs(degrees(run) - expected).max() < 0.02


@pytest.mark.parametrize("name", ["arm", "arm-short", "arm-s1"])
def test_half_the_step_moves_the_arm_by_less_than_a_hundredth_of_a_degree(name: str) -> None:
    fine = afo_sim.run(name, {"timestep": "0.5 ms"})
    assert np.abs(degrees(afo_sim.run(name)) - degrees(fine)).max() < 0.01


# --- the pulley, the load, the words ----------------------------------------------------------------


def built(**sets: object):
    return build(load("scenario", "arm", sets))


def test_pulley_has_a_constant_arm_and_adds_no_inertia() -> None:
    """κ = κ0 ± r φ/L0, moment arm ± r, and J as the leg's file states it."""
    for name, radius, length in (("arm", 0.05, 0.30), ("arm-s1", 0.03, 0.215 - 0.0519)):
        b = build(load("scenario", name))
        angles = np.radians(np.linspace(-35.0, 35.0, 15))
        contraction, arm, inertia = sweep_ankle(b.model, b.index, angles)
        for column, muscle in enumerate(b.index.muscles):
            side = 1.0 if muscle.startswith("flexor") else -1.0
            assert arm[:, column] == pytest.approx(side * radius, abs=1e-15)
            assert contraction[:, column] == pytest.approx(0.1 + side * radius * angles / length, abs=1e-14)
        assert inertia == pytest.approx(0.05, rel=1e-12)


def test_arm_is_no_ankle() -> None:
    """No tissue, no weight, no anatomical warning, and names that fit."""
    run = afo_sim.run("arm")
    assert run.ok
    assert run.warnings == ()
    assert {"peak_flexion_angle", "peak_extension_torque", "range_of_motion"} < set(run.metrics)
    assert not any("dorsi" in name or "plantar" in name for name in run.metrics)
    assert np.abs(run["ankle/moment/passive"]).max() == 0.0
    assert np.abs(run["ankle/moment/gravity"]).max() < 1e-14


def test_load_is_a_moment_of_its_own() -> None:
    """J φ″ = T − T_L, row by row."""
    run = afo_sim.run("arm-s1", {"load_moment": "1.5 N*m"})
    assert np.all(run["ankle/moment/load"] == -1.5)
    sum_of_moments = run["ankle/moment/orthosis"] + run["ankle/moment/load"]
    assert np.abs(0.05 * run["ankle/acceleration"] - sum_of_moments).max() < 1e-9
    assert np.abs(run["ankle/moment/passive"]).max() < 1e-12
    assert "ankle/moment/load" not in afo_sim.run("arm", {"duration": "0.1 s"}).columns


def test_load_hangs_on_the_leg_too() -> None:
    held = afo_sim.run("seated", {"duration": "1 s", "load_moment": "1 N*m"})
    moments = sum(held[c] for c in held.columns if c.startswith("ankle/moment/"))
    b = build(load("scenario", "seated"))
    inertia = sweep_ankle(b.model, b.index, np.zeros(1))[2][0]
    assert np.abs(inertia * held["ankle/acceleration"] - moments).max() < 1e-6
    free = afo_sim.run("seated", {"duration": "1 s"})
    assert (held["ankle/angle"] < free["ankle/angle"]).all()


PULLEY = {
    "radius": ("5.2 cm", "muscle/flexor_1/moment_arm"),
    "direction": ("negative", "muscle/flexor_1/moment_arm"),
    "initial_contraction": (0.11, "muscle/flexor_1/contraction"),
}


@pytest.mark.parametrize("key", PULLEY)
def test_every_parameter_of_a_pulley_moves_arm_and_angle(key: str) -> None:
    value, column = PULLEY[key]
    sets = {"duration": "4 s"}
    before = afo_sim.run("arm", sets)
    if key == "direction":  # both muscles the same way would lock: change over
        sets["orthosis.muscle.extensor.pulley.direction"] = "positive"
    after = afo_sim.run("arm", sets | {f"orthosis.muscle.flexor.pulley.{key}": value})
    for name in (column, "ankle/angle"):
        assert np.abs(after[name] - before[name]).max() > 1e-3


def test_every_parameter_of_a_pulley_is_tested() -> None:
    pulley = load("scenario", "arm").resolved()["orthosis"]["muscle"]["flexor"]["pulley"]
    assert set(pulley) - {"provenance", "spacing"} == set(PULLEY)


def test_spacing_sets_parallel_muscles_apart_and_changes_nothing_else() -> None:
    near, far = (
        build(load("scenario", "arm-s1", {"orthosis.muscle.flexor.pulley.spacing": s}))
        for s in ("1 cm", "2 cm")
    )
    for b, apart in ((near, 0.01), (far, 0.02)):
        places = [b.model.site(f"flexor_{k}_origin").pos[1] for k in (1, 2, 3)]
        assert np.diff(places) == pytest.approx(apart)
    assert np.array_equal(near.model.actuator_user, far.model.actuator_user)


def test_mirrored_arm_moves_the_other_way() -> None:
    """Directions changed over: the angle changes its sign, and nothing else."""
    over = {
        f"orthosis.muscle.{g}.pulley.direction": d
        for g, d in zip(GROUPS, ("negative", "positive"), strict=True)
    }
    straight, mirrored = afo_sim.run("arm"), afo_sim.run("arm", over)
    assert degrees(mirrored) == pytest.approx(-degrees(straight), abs=1e-9)
    force = "muscle/flexor_1/force"
    assert mirrored[force] == pytest.approx(straight[force], abs=1e-7)


FLEXOR = "orthosis.muscle.flexor"
ANCHOR = {"segment": "shank", "from_joint": ["5 cm", "0 cm", "30 cm"]}


@pytest.mark.parametrize(
    ("sets", "field", "problem"),
    [
        ({f"{FLEXOR}.origin": ANCHOR}, "origin", "does not go with a pulley"),
        ({f"{FLEXOR}.link_length": "1 cm"}, "link_length", "does not go with a pulley"),
        ({f"{FLEXOR}.slack": "1 cm"}, "slack", "does not go with a pulley"),
        ({f"{FLEXOR}.pulley.radius": "0 cm"}, "radius", "out of range"),
        ({"leg.directions": ["flexion"]}, "directions", "missing"),
    ],
)
def test_pulley_described_otherwise_is_refused(sets: dict, field: str, problem: str) -> None:
    with pytest.raises(InputError, match=problem) as refused:
        built(**sets)
    assert field in refused.value.field


@pytest.mark.parametrize("key", ["origin", "insertion", "link_length"])
def test_muscle_without_anchors_or_pulley_is_refused(key: str) -> None:
    scenario = load("scenario", "seated").resolved()
    del scenario["orthosis"]["muscle"]["dorsiflexor"][key]
    with pytest.raises(InputError, match="not mounted") as refused:
        load("scenario", scenario)
    assert refused.value.field.endswith(key)
    assert "a pulley" in refused.value.allowed


def test_too_taut_over_a_pulley_is_refused_with_what_would_do() -> None:
    key = f"{FLEXOR}.pulley.initial_contraction"
    with pytest.raises(InputError, match="too taut") as refused:
        built(**{key: -0.02})
    assert refused.value.field == key
    enough = float(refused.value.allowed.split(",")[0].removeprefix("at least "))
    assert built(**{key: enough}).warnings == ()


def test_slack_device_rests_at_zero() -> None:
    """Empty muscles leave the arm where it stands; a load lets it down onto the braid."""
    assert afo_sim.run("arm", {"duration": "0.1 s"})["ankle/angle"][0] == 0.0
    loaded = afo_sim.run("arm", {"duration": "0.1 s", "load_moment": "1 N*m"})
    angle, force = loaded["ankle/angle"][0], loaded["muscle/flexor_1/force"][0]
    assert angle < -0.1 * 0.30 / 0.05  # beyond where the flexor's braid is taut
    assert force * 0.05 == pytest.approx(1.0, rel=1e-6)


@pytest.mark.slow
def test_figures_speak_of_the_arm(tmp_path: pathlib.Path) -> None:
    from matplotlib.figure import Figure

    run = afo_sim.run("arm-s1", {"duration": "1 s"})
    axis = Figure().subplots()
    panels.moments(axis, [alone(run)])
    assert axis.get_ylabel() == "hinge moment [N·m]\nflexion +"
    drawn = {line.get_label(): line.get_ydata() for line in axis.lines}
    assert np.array_equal(drawn["load"], run["ankle/moment/load"])
    written = {path.stem for path in run_figure.write_figures(run, tmp_path)}
    assert {"overview", "torque"} < written


def test_recording_shows_the_muscles_beside_the_pulley(tmp_path: pathlib.Path) -> None:
    """Each tube hangs straight over the pulley's rim and is as long as its muscle."""
    from afo_sim.show.rerun import write_rrd

    run = afo_sim.run("arm", {"duration": "4 s"})
    write_rrd(run, tmp_path / "arm.rrd")
    for name, side in (("flexor_1", 1.0), ("extensor_1", -1.0)):
        import rerun as rr

        chunks = rr.chunk.RrdReader(str(tmp_path / "arm.rrd")).stream()
        chunks = chunks.filter(content=f"/world/muscles/{name}", is_static=False).to_chunks()
        batch = chunks[0].to_record_batch()
        place = np.array(batch.column("Capsules3D:translations").to_pylist()).reshape(-1, 3)
        length, radius = (
            np.array(batch.column(f"Capsules3D:{part}").to_pylist()).ravel() for part in ("lengths", "radii")
        )
        assert place[:, 0] == pytest.approx(side * 0.05, abs=1e-6)
        tube = run[f"muscle/{name}/length"][::10][: len(length)]
        assert length + 2.0 * radius == pytest.approx(tube, abs=1e-6)
