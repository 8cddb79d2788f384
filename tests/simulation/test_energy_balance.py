"""The energy balance on written motions, whose works are known in closed form, and on a run."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from thick_wall import wall_energy, wall_tension

import afo_sim
from afo_sim import load
from afo_sim.description import Orthosis
from afo_sim.metrics import Window
from afo_sim.model.build import build
from afo_sim.physics import LAWS
from afo_sim.simulation import Energy, balance
from afo_sim.simulation.energy_balance import balance_of, balances

AMBIENT = 101_325.0
FRONT = "muscle.dorsiflexor"
PERIOD, AMPLITUDE, MIDDLE = 0.8, 0.06, 0.12  # of a contraction that swings
OMEGA = 2.0 * math.pi / PERIOD


def orthosis(**sets: Any) -> Orthosis:
    """Three ideal braids in front, one behind that stays slack and empty; cables of 50 kN/m, no damper."""
    keys = {
        f"{FRONT}.type": "shadow_30mm",
        f"{FRONT}.type.damping": "0 m^2*s",
        f"{FRONT}.cable.stiffness": "50 kN/m",
        "muscle.plantarflexor.count": 1,
        "anchor": {},
    }
    return load("orthosis", "s1", keys | {key.replace("__", "."): value for key, value in sets.items()})


def volume(device: Orthosis, contraction: Any) -> Any:
    """Of one ideal braid: a cylinder of length ℓ cos α and radius ℓ sin α/(2πn), as functions of κ [m³]."""
    muscle = device.muscle["dorsiflexor"].type
    fibre = muscle.nominal_length / math.cos(muscle.braid_angle)
    turns = fibre * math.sin(muscle.braid_angle) / (math.pi * muscle.bore)
    length = muscle.nominal_length * (1.0 - contraction)
    return length * (fibre**2 - length**2) / (4.0 * math.pi * turns**2)


def ideal_force(device: Orthosis, contraction: Any, pressure: Any) -> Any:
    """−p dV/dL of one ideal braid [N]."""
    muscle = device.muscle["dorsiflexor"].type
    fibre = muscle.nominal_length / math.cos(muscle.braid_angle)
    turns = fibre * math.sin(muscle.braid_angle) / (math.pi * muscle.bore)
    length = muscle.nominal_length * (1.0 - contraction)
    return pressure * (3.0 * length**2 - fibre**2) / (4.0 * math.pi * turns**2)


def written(
    device: Orthosis,
    time: np.ndarray,
    contraction: np.ndarray,
    pressure: np.ndarray,
    tension: np.ndarray,
    displacements: dict[str, np.ndarray] | None = None,
) -> dict[str, np.ndarray]:
    """Columns of a motion of the three muscles in front."""
    group, moved, blank = device.muscle["dorsiflexor"], displacements or {}, np.zeros_like(time)
    path = group.series_length + group.type.nominal_length * (1.0 - contraction)
    path = path + tension / group.cable.stiffness + sum(moved.values())
    columns = {"time": time, "chamber/plantarflexor/pressure": blank, "chamber/plantarflexor/volume": blank}
    columns["chamber/dorsiflexor/pressure"] = pressure
    columns["chamber/dorsiflexor/volume"] = group.count * volume(device, contraction) + 5e-6
    for k in range(1, group.count + 1):
        columns[f"muscle/dorsiflexor_{k}/force"] = tension
        columns[f"muscle/dorsiflexor_{k}/contraction"] = contraction
        columns[f"muscle/dorsiflexor_{k}/path_length"] = path
    for column in ("force", "contraction", "path_length"):
        columns[f"muscle/plantarflexor_1/{column}"] = blank
    for name, displacement in moved.items():
        columns[f"cuff/{name}/displacement"] = displacement
        columns[f"cuff/{name}/force"] = group.count * tension
    return columns


def swing(cycles: float, rows: int = 4001) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(time, contraction, its rate) of a swing from its middle."""
    time = np.linspace(0.0, cycles * PERIOD, rows)
    contraction = MIDDLE + AMPLITUDE * np.sin(OMEGA * time)
    return time, contraction, AMPLITUDE * OMEGA * np.cos(OMEGA * time)


def close(found: Energy, tolerance: float = 1e-5, **expected: float) -> None:
    """Each term as expected, the others zero, within a share of the turnover."""
    for term, value in vars(found).items():
        if term != "turnover":
            assert value == pytest.approx(expected.get(term, 0.0), abs=tolerance * found.turnover), term
    assert abs(found.error) < tolerance


def test_the_braid_of_this_test_is_that_of_the_law() -> None:
    muscle = orthosis().muscle["dorsiflexor"].type
    kappa = np.linspace(0.0, 0.25, 6)
    assert muscle.force(3e5, contraction=kappa) == pytest.approx(
        ideal_force(orthosis(), kappa, 3e5), rel=1e-9
    )


def test_without_damper_the_air_works_on_skeleton_and_cable() -> None:
    """A quarter swing at 3 bar, T = −p dV/dL: n p (V2 − V1) less n (T2² − T1²)/2k."""
    device = orthosis()
    time, kappa, _ = swing(0.25)
    tension = ideal_force(device, kappa, 3e5)
    found = balance_of(device, written(device, time, kappa, np.full_like(time, 3e5), tension))
    work = 3.0 * 3e5 * (volume(device, MIDDLE + AMPLITUDE) - volume(device, MIDDLE))
    first, last = (ideal_force(device, k, 3e5) for k in (MIDDLE, MIDDLE + AMPLITUDE))
    stored = 3.0 * (last**2 - first**2) / (2.0 * 50e3)
    # above 1 bar there is no return force: the air has given back what a muscle without air would hold
    close(found, air_work=work, skeleton_work=work - stored, spring_change=stored)
    assert found.turnover == pytest.approx(work, rel=1e-6)


def test_over_a_cycle_a_damper_takes_what_the_skeleton_gives() -> None:
    """c ∮ κ̇ dκ of a sine is c π ω A², with c = R p_abs, for each of n muscles of length L0."""
    device = orthosis(muscle__dorsiflexor__type__damping="2e-4 m^2*s")
    time, kappa, rate = swing(1.0)
    loss = 2e-4 * (3e5 + AMBIENT)
    tension = ideal_force(device, kappa, 3e5) - loss * rate
    found = balance_of(device, written(device, time, kappa, np.full_like(time, 3e5), tension))
    taken = 3.0 * device.muscle["dorsiflexor"].type.nominal_length * loss * math.pi * OMEGA * AMPLITUDE**2
    close(found, damper_loss=taken, skeleton_work=-taken)


def test_a_three_element_damper_takes_more_one_way_than_the_other() -> None:
    """B = 40 N·s/m contracting and 90 N·s/m relaxing: half a cycle of each, B L0² π ω A²/2."""
    damper = {"contracting": ["40 N*s/m", "0 N*s/(m*Pa)"], "relaxing": ["90 N*s/m", "0 N*s/(m*Pa)"]}
    device = orthosis(muscle__dorsiflexor__type__damper=damper)
    time, kappa, rate = swing(1.0)
    nominal = device.muscle["dorsiflexor"].type.nominal_length
    resistance = np.where(rate > 0.0, 40.0, 90.0)
    tension = ideal_force(device, kappa, 3e5) - resistance * nominal * rate
    found = balance_of(device, written(device, time, kappa, np.full_like(time, 3e5), tension))
    taken = 3.0 * 0.5 * (40.0 + 90.0) * nominal**2 * math.pi * OMEGA * AMPLITUDE**2
    close(found, damper_loss=taken, skeleton_work=-taken)


def test_friction_is_the_remainder() -> None:
    """12 N against every motion, over 4 A L0 of way in a cycle."""
    friction = {"static_coefficient": 0.0, "kinetic_coefficient": 0.0, "stribeck_velocity": "0.1 m/s"}
    friction |= {"creep_velocity": "0.1 mm/s"}
    device = orthosis(
        muscle__dorsiflexor__type__friction="tondu_lopez_2000_stribeck",
        muscle__dorsiflexor__type__frictions={"tondu_lopez_2000_stribeck": friction},
    )
    time, kappa, rate = swing(1.0)
    tension = ideal_force(device, kappa, 3e5) - 12.0 * np.sign(rate)
    found = balance_of(device, written(device, time, kappa, np.full_like(time, 3e5), tension))
    taken = 3.0 * 12.0 * 4.0 * AMPLITUDE * device.muscle["dorsiflexor"].type.nominal_length
    close(found, tolerance=2e-4, friction_loss=taken, skeleton_work=-taken)


@pytest.mark.parametrize("stiffening", [False, True])
def test_cuff_and_plate_store_and_damp(stiffening: bool) -> None:
    """Muscles held at their length while the pressure swings: the skeleton gives what the springs get."""
    law = {"stiffening": {"force": "33 N", "length": "17 mm"}} if stiffening else {"stiffness": "4 kN/m"}
    anchors = {"shank": law | {"damping": "190 N*s/m"}, "foot": {"stiffness": "50 kN/m"}}
    device = orthosis(anchor=anchors, muscle__dorsiflexor__type__return_stiffness="0 N")  # which has a volume
    time = np.linspace(0.0, 0.25 * PERIOD, 4001)
    cuff, rate = 0.01 + 0.004 * np.sin(OMEGA * time), 0.004 * OMEGA * np.cos(OMEGA * time)
    held = 33.0 * np.expm1(cuff / 0.017) if stiffening else 4e3 * cuff
    pull = held + 190.0 * rate
    kappa = np.full_like(time, MIDDLE)
    pressure = 1e5 * (pull / 3.0) / ideal_force(device, MIDDLE, 1e5)
    columns = written(device, time, kappa, pressure, pull / 3.0, {"shank": cuff, "foot": pull / 50e3})
    found = balance_of(device, columns)
    in_cuff = 0.5 * 4e3 * (0.014**2 - 0.010**2)
    if stiffening:
        in_cuff = quad(lambda z: 33.0 * math.expm1(z / 0.017), 0.010, 0.014)[0]
    others = (pull[-1] ** 2 - pull[0] ** 2) * (0.5 / 50e3 + 0.5 / (3.0 * 50e3))
    damped = 190.0 * 0.25 * math.pi * OMEGA * 0.004**2
    assert found.turnover == 0.0 and math.isnan(found.error)
    for term, value in {
        "air_work": 0.0,
        "spring_change": in_cuff + others,
        "damper_loss": damped,
        "skeleton_work": -in_cuff - others - damped,
        "law_mismatch": 0.0,
        "residual": 0.0,
    }.items():
        assert getattr(found, term) == pytest.approx(value, rel=1e-5, abs=1e-7), term


def test_a_law_that_does_not_derive_from_its_volume_has_a_mismatch() -> None:
    """Round κ = 5 to 15 %, p = 2 to 4 bar: what the law gives, by quadrature, less Δp ΔV of the braid."""
    key = {"muscle__dorsiflexor__type": "dmsp_20_200n", "muscle__dorsiflexor__type__damping": "0 m^2*s"}
    device = orthosis(**key)
    muscle = device.muscle["dorsiflexor"].type
    corners = [(0.05, 2e5), (0.05, 4e5), (0.15, 4e5), (0.15, 2e5), (0.05, 2e5)]
    path = np.linspace(0.0, 4.0, 8001)
    kappa = np.interp(path, range(5), [corner[0] for corner in corners])
    pressure = np.interp(path, range(5), [corner[1] for corner in corners])
    kernel, given = LAWS[muscle.law].kernel, muscle.coefficients
    tension = np.array([kernel(k, p, *given) for k, p in zip(kappa, pressure, strict=True)])
    found = balance_of(device, written(device, path, kappa, pressure, tension))
    excess = quad(lambda k: kernel(k, 4e5, *given) - kernel(k, 2e5, *given), 0.05, 0.15)[0]
    of_law = 3.0 * muscle.nominal_length * excess
    of_air = 3.0 * 2e5 * (volume(device, 0.15) - volume(device, 0.05))
    assert abs(of_law - of_air) > 0.05 * of_air  # there is something to see
    close(found, air_work=of_air, skeleton_work=of_law, law_mismatch=of_law - of_air)


def test_a_slack_muscle_comes_back_by_what_its_bladder_holds() -> None:
    """No air, no tension: ½ k_r L0 κ² of the return force goes into the damper."""
    device = orthosis(muscle__dorsiflexor__type__damping="2e-4 m^2*s")
    muscle = device.muscle["dorsiflexor"].type
    decay = muscle.return_stiffness / (2e-4 * AMBIENT)
    time = np.linspace(0.0, 1.0, 4001)
    kappa = 0.1 * np.exp(-decay * time)
    blank = np.zeros_like(time)
    columns = written(device, time, kappa, blank, blank)
    found = balance_of(device, columns)
    held = 3.0 * 0.5 * muscle.return_stiffness * muscle.nominal_length * (kappa[0] ** 2 - kappa[-1] ** 2)
    assert found.bladder_change == pytest.approx(-held, rel=1e-5)
    assert found.damper_loss == pytest.approx(held, rel=1e-5)
    assert found.residual == pytest.approx(0.0, abs=1e-5 * held)


def test_a_rubber_tube_stores_what_it_takes() -> None:
    """A quarter swing at 3 bar: n (U2 − U1) of its wall; p (V2 − V1) is as without."""
    tube = {"modulus": "1.5 MPa", "wall_thickness": "2 mm"}
    device = orthosis(muscle__dorsiflexor__type__tube=tube)
    muscle = device.muscle["dorsiflexor"].type
    radius = 0.5 * muscle.bore
    stiffness = math.pi * 0.5e6 * radius**2 / 2.0
    wall = math.degrees(muscle.braid_angle), (1.0 - 2e-3 / radius) ** 2
    time, kappa = swing(0.25)[0], swing(0.25)[1] - 0.05
    assert kappa[-1] < muscle.rubber[2]  # it takes more and more
    taken = stiffness * wall_tension(kappa, *wall)
    tension = ideal_force(device, kappa, 3e5) + taken
    found = balance_of(device, written(device, time, kappa, np.full_like(time, 3e5), tension))
    stored = 3.0 * stiffness * muscle.nominal_length * np.diff(wall_energy(kappa[[0, -1]], *wall)).item()
    air = 3.0 * 3e5 * (volume(device, kappa[-1]) - volume(device, kappa[0]))
    spring = 3.0 * (tension[-1] ** 2 - tension[0] ** 2) / (2.0 * 50e3)
    assert stored > 0.03 * air
    terms = {"air_work": air, "bladder_change": stored, "spring_change": spring}
    close(found, **terms, skeleton_work=air - stored - spring)


@pytest.mark.parametrize("column", ["force", "contraction", "path_length"])
def test_a_wrong_column_is_found(column: str) -> None:
    """2 % more of one of them, over half a swing."""
    device = orthosis()
    time, kappa, _ = swing(0.25)
    columns = written(device, time, kappa, np.full_like(time, 3e5), ideal_force(device, kappa, 3e5))
    assert abs(balance_of(device, columns).error) < 1e-5
    name = f"muscle/dorsiflexor_1/{column}"
    assert abs(balance_of(device, columns | {name: 1.02 * columns[name]}).error) > 1e-3


@pytest.mark.parametrize("cut", [300.0, 299.25, 0.5, 699.75])
def test_parts_of_a_stretch_add_up(cut: float) -> None:
    """Straight between two rows: a part may end anywhere, and what follows begins there."""
    damper = {"contracting": ["40 N*s/m", "0 N*s/(m*Pa)"], "relaxing": ["90 N*s/m", "0 N*s/(m*Pa)"]}
    anchors = {"shank": {"stiffness": "4 kN/m", "damping": "190 N*s/m"}}
    sets: dict[str, Any] = {"muscle__dorsiflexor__type__damping": "2e-4 m^2*s", "anchor": anchors}
    device = orthosis(**sets, muscle__dorsiflexor__type__damper=damper)
    time, kappa, rate = swing(0.7, 701)
    tension = ideal_force(device, kappa, 3e5) - 2e-4 * (3e5 + AMBIENT) * rate
    columns = written(device, time, kappa, 3e5 + 1e5 * np.sin(3.0 * time), tension, {"shank": tension / 4e3})
    law = {name: columns[f"muscle/{name}/force"] + 7.0 for name in ("dorsiflexor_1", "plantarflexor_1")}
    stretches = [Window(0.0, 700.0), Window(0.0, cut), Window(cut, 700.0)]
    whole, first, second = map(dataclasses.asdict, balances(device, columns, law, stretches))
    assert all(abs(whole[term]) > 1e-3 for term in ("air_work", "skeleton_work", "damper_loss"))
    for term, value in whole.items():
        if term != "turnover":  # whose sign may change within a step
            assert first[term] + second[term] == pytest.approx(value, rel=1e-10, abs=1e-10), term


def test_beyond_the_last_row_nothing_changes() -> None:
    device = orthosis()
    time, kappa, _ = swing(0.25, 101)
    columns = written(device, time, kappa, np.full_like(time, 3e5), ideal_force(device, kappa, 3e5))
    known = {name: columns[f"muscle/{name}/force"] for name in ("dorsiflexor_1", "plantarflexor_1")}
    last, beyond = balances(device, columns, known, [Window(0.0, 100.0), Window(0.0, 100.75)])
    assert beyond.air_work == last.air_work > 0.0 and beyond.skeleton_work == last.skeleton_work
    assert balance_of(device, {name: values[:0] for name, values in columns.items()}) == Energy()


def test_a_run_is_balanced() -> None:
    scenario = load("scenario", "seated", {"duration": "2 s"})
    found = balance(build(scenario), afo_sim.run(scenario).columns)
    assert found.air_work > 1.0
    assert abs(found.error) < 1e-3


def test_a_run_with_a_tube_is_balanced() -> None:
    """The braid's own formula has no mismatch; with rubber it has none, and less stroke."""
    muscle = {"orthosis.muscle.dorsiflexor.type": "handmade_10mm", "duration": "4 s"}
    muscle |= {"orthosis.muscle.dorsiflexor.link_length": "12.6 cm"}
    angles = []
    for tube in (None, {"modulus": "1 MPa", "wall_thickness": "1 mm"}):
        scenario = load("scenario", "seated", muscle | {"orthosis.muscle.dorsiflexor.type.tube": tube})
        run = afo_sim.run(scenario)
        found = balance(build(scenario), run.columns)
        assert found.air_work > 0.1 and abs(found.error) < 1e-3
        assert abs(found.law_mismatch) < 2e-3 * found.turnover
        angles.append(run.metrics["peak_dorsiflexion_angle"])
        assert (abs(found.bladder_change) > 0.01) == (tube is not None)
    assert angles[1] < angles[0]
