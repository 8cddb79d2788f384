"""Laws and frictions of a user's own: the same numbers as a shipped kernel's, and what is refused."""

import math
import pathlib
import pickle
import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import afo_sim as afo
from afo_sim.common import extending, identity_of, packed
from afo_sim.physics import FIRST_USER_ID, FRICTIONS, LAWS, Law, LawParameter, forces
from afo_sim.physics.user_kernels import KERNELS

MUSCLE = "orthosis.muscle.dorsiflexor"
SETS = {"duration": "1 s"}
OWN = "tondu_lopez_2000_bladder"  # the scenario's
AREA = LawParameter("area", "A", "m^2", 0.0, 0.01, "area that the pressure pulls on", (1e-3, 3e-3))
LOST = LawParameter("lost", "s", "", 0.0, 20.0, "share of the force lost per contraction", (2.0, 5.0))


def grown(pressure: float, area: float) -> float:
    return pressure * area


def straight(contraction: float, pressure: float, area: float, lost: float) -> float:
    """A force that falls in a straight line; it calls a function that nobody marked."""
    return grown(pressure, area) * (1.0 - lost * contraction)


def bare(contraction: float, pressure: float, *coefficients: float) -> float:
    return SHIPPED(contraction, pressure, *coefficients)


SHIPPED = LAWS[OWN].kernel


def by_law(law: str, **sets: Any) -> afo.Recording:
    """A run in which a muscle has the numbers of its own one under another law's name."""
    own = afo.load("muscle", "s1_215mm").laws[OWN].model_dump(mode="json")
    numbers = {key: value for key, value in own.items() if key not in ("law", "provenance")}
    return afo.run("seated", SETS | {f"{MUSCLE}.type.law": law, f"{MUSCLE}.type.laws.{law}": numbers} | sets)


def test_a_law_with_slopes_gives_the_bits_of_the_same_shipped_one() -> None:
    afo.register(replace(LAWS[OWN], name="mine", native_id=0))
    assert LAWS["mine"].native_id >= FIRST_USER_ID
    shipped, own = afo.run("seated", SETS), by_law("mine")
    assert "law-of-your-own" in [getattr(each, "code", "") for each in own.warnings]
    assert own.ok and float(np.ptp(own["ankle/angle"])) > 0.05
    for column, values in shipped.columns.items():
        np.testing.assert_array_equal(own[column], values, err_msg=column)


def test_a_law_without_slopes_settles_where_the_same_one_with_slopes_does() -> None:
    afo.register(replace(LAWS[OWN], name="bare", kernel=bare, native_id=0))
    shipped, own = afo.run("seated", SETS), by_law("bare")
    assert np.abs(own["ankle/angle"] - shipped["ankle/angle"]).max() < np.radians(1e-5)
    assert np.abs(own["chamber/dorsiflexor/pressure"] - shipped["chamber/dorsiflexor/pressure"]).max() < 0.1


def test_compiled_and_plain_python_agree_for_a_law_of_one_line() -> None:
    afo.register(Law("straight", straight, (AREA, LOST)))
    kappa, p = np.linspace(0.0, 0.2, 7), np.full(7, 3e5)
    expected = 3e5 * 2e-3 * (1.0 - 3.5 * kappa)
    np.testing.assert_allclose(
        forces(LAWS["straight"].native_id, (2e-3, 3.5), kappa, p), expected, rtol=1e-14
    )
    sets = {"law": "straight", "laws.straight": {"area": "20 cm^2", "lost": 3.5}}
    muscle = afo.load("muscle", "dmsp_20", sets)
    np.testing.assert_allclose(muscle.force("3 bar", contraction=kappa), expected, rtol=1e-14)
    assert LAWS["straight"].fitted == ("area", "lost")
    native, python = (
        afo.run(
            "seated",
            SETS
            | {"duration": "0.1 s", "callback": mode}
            | {f"{MUSCLE}.type.{k}": v for k, v in sets.items()},
        )
        for mode in ("native", "python")
    )
    np.testing.assert_allclose(python["ankle/angle"], native["ankle/angle"], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("shipped", FRICTIONS)
def test_a_friction_gives_the_bits_of_the_same_shipped_one(shipped: str) -> None:
    afo.register(replace(FRICTIONS[shipped], name="mine", native_id=0))
    numbers = {p.name: f"{p.typical} {p.unit}" for p in FRICTIONS[shipped].parameters}

    def rubbed(friction: str) -> afo.Recording:
        sets = {f"{MUSCLE}.type.friction": friction, f"{MUSCLE}.type.frictions.{friction}": numbers}
        return afo.run("seated", SETS | sets)

    there, own = rubbed(shipped), rubbed("mine")
    assert float(np.abs(there["ankle/angle"] - afo.run("seated", SETS)["ankle/angle"]).max()) > 1e-6
    for column, values in there.columns.items():
        np.testing.assert_array_equal(own[column], values, err_msg=column)


def test_a_law_registered_again_replaces_the_first_everywhere() -> None:
    numbers = {
        f"{MUSCLE}.type.law": "straight",
        f"{MUSCLE}.type.laws.straight": {"area": "20 cm^2", "lost": 3.5},
    }

    def forces_of_both() -> tuple[float, float]:
        run = afo.run("seated", SETS | numbers)
        muscle = afo.load(
            "muscle", "dmsp_20", {k.removeprefix(f"{MUSCLE}.type."): v for k, v in numbers.items()}
        )
        force = float(muscle.force("3 bar", contraction=0.1))
        return float(run["muscle/dorsiflexor_1/force"].max()), force

    def weaker(contraction: float, pressure: float, area: float, lost: float) -> float:
        return 0.5 * pressure * area * (1.0 - lost * contraction)

    afo.register(Law("straight", straight, (AREA, LOST)))
    first, first_id = forces_of_both(), LAWS["straight"].native_id
    afo.register(Law("straight", weaker, (AREA, LOST)))
    second = forces_of_both()
    assert LAWS["straight"].native_id != first_id
    assert second[0] < first[0]
    assert second[1] == pytest.approx(0.5 * first[1], rel=1e-14)
    afo.register(Law("straight", straight, (AREA, LOST)))
    assert forces_of_both() == first and LAWS["straight"].native_id == first_id
    assert len([law for law in extending.ADDED if law.name == "straight"]) == 1


def test_an_identity_is_that_of_what_is_computed() -> None:
    text = "def f(contraction, pressure, a):\n    return {} * a * pressure\n"
    made = []
    for head, factor in (("", "1.0"), ("\n\n\n", "1.0"), ("", "2.0")):
        space: dict[str, Any] = {"__name__": "somewhere"}
        exec(compile(head + text.format(factor), f"file{len(made)}.py", "exec"), space)
        made.append(Law("one", space["f"], (AREA,)))
    one, moved, other = map(identity_of, made)
    assert one == moved != other
    classes = []
    for gain in ("2.0", "2.0", "3.0"):
        space = {"__name__": "somewhere"}
        exec(
            f"class Held:\n    def __call__(self, x):\n        return {gain} if x in {{'a', 'b'}} else 0",
            space,
        )
        classes.append(identity_of(space["Held"]))
    assert classes[0] == classes[1] != classes[2]
    assert identity_of(Law("one", straight, (AREA, LOST))) != identity_of(Law("two", straight, (AREA, LOST)))


def wrong_slope(contraction: float, pressure: float, area: float, lost: float) -> Any:
    return (
        pressure * area * (1.0 - lost * contraction),
        pressure * area * lost,
        area * (1.0 - lost * contraction),
    )


def no_number(contraction: float, pressure: float, area: float, lost: float) -> float:
    return math.log(-1.0 - pressure) * area


def unknown_to_numba(contraction: float, pressure: float, area: float, lost: float) -> float:
    return float(pathlib.Path("1").name) * pressure * area


def without(contraction: float, pressure: float, area: float) -> float:
    return pressure * area


def other_order(contraction: float, pressure: float, lost: float, area: float) -> float:
    return straight(contraction, pressure, area, lost)


def printing(contraction: float, pressure: float, area: float, lost: float) -> float:
    print(contraction)
    return straight(contraction, pressure, area, lost)


def no_number_at_ends(contraction: float, pressure: float, area: float, lost: float) -> float:
    return math.nan if contraction > 0.2 else straight(contraction, pressure, area, lost)


def pulls_again(contraction: float, pressure: float, area: float, lost: float) -> float:
    return pressure * area * (1.0 - 0.0 * lost - 3.0 * contraction) * (1.0 - 2.5 * contraction)


@pytest.mark.parametrize(
    "kernel", [pulls_again, no_number, unknown_to_numba, without, other_order, printing, no_number_at_ends]
)
def test_a_wrong_law_is_refused_and_leaves_nothing(kernel: Any) -> None:
    before = dict(LAWS), dict(KERNELS), list(extending.ADDED)
    with pytest.raises(afo.InputError):
        afo.register(Law("wrong", kernel, (AREA, LOST)))
    assert before == (LAWS, KERNELS, extending.ADDED)


def test_slopes_of_another_force_are_refused() -> None:
    def kernel(contraction: float, pressure: float, area: float, lost: float) -> float:
        return straight(contraction, pressure, area, lost)

    kernel.slopes = wrong_slope  # type: ignore[attr-defined]  # as with_slopes leaves it
    with pytest.raises(afo.InputError, match="slope by κ"):
        afo.register(Law("wrong", kernel, (AREA, LOST)))


@pytest.mark.parametrize("name", [OWN, "my law", ""])
def test_a_shipped_name_and_no_name_are_refused(name: str) -> None:
    with pytest.raises(afo.InputError):
        afo.register(Law(name, straight, (AREA, LOST)))
    assert LAWS[OWN].kernel is SHIPPED


def test_a_fit_finds_the_parameters_that_the_points_were_made_with() -> None:
    afo.register(Law("straight", straight, (AREA, LOST)))
    kappa, p = (each.ravel() for each in np.meshgrid(np.linspace(0.0, 0.2, 6), [1e5, 3e5, 5e5]))
    data = {"contraction [-]": kappa, "pressure [Pa]": p, "force [N]": p * 2.2e-3 * (1.0 - 3.1 * kappa)}
    facts = {"bore": "20 mm", "braid_angle": "25 deg"}
    found = afo.fit(data, law="straight", facts=facts)
    assert found.ranking == ("straight",)
    np.testing.assert_allclose(
        [found.parameters[name] for name in ("area", "lost")], [2.2e-3, 3.1], rtol=1e-6
    )
    assert found.muscle.law == "straight"


MINE = """
from afo_sim.physics import Law, LawParameter
AREA = LawParameter("area", "A", "m^2", 0.0, 0.01, "area", (1e-3, 3e-3))
def kernel(contraction, pressure, area):
    return pressure * area * (1.0 - {lost} * contraction)
LAW = Law("from_a_file", kernel, (AREA,))
"""


def test_a_law_goes_to_another_process_by_value(tmp_path: pathlib.Path) -> None:
    file = tmp_path / "json.py"  # whose name is another module's
    file.write_text(MINE.format(lost="3.0"), encoding="utf-8")
    afo.register(file)
    force = forces(LAWS["from_a_file"].native_id, (2e-3,), np.array([0.1]), np.array([3e5]))
    np.testing.assert_allclose(force, 3e5 * 2e-3 * 0.7, rtol=1e-14)
    (tmp_path / "packed").write_bytes(packed())
    file.unlink()
    program = "import sys, json, pathlib; from afo_sim.common import take; from afo_sim.physics import LAWS; "
    program += "take(pathlib.Path(sys.argv[1]).read_bytes()); print(LAWS['from_a_file'].native_id)"
    command = [sys.executable, "-c", program, str(tmp_path / "packed")]
    said = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path).stdout
    assert int(said) == LAWS["from_a_file"].native_id
    assert pickle.loads(pickle.loads(packed())[1])[-1][1].name == "from_a_file"


def test_what_is_no_number_in_a_run_is_its_status_and_ends_no_process(tmp_path: pathlib.Path) -> None:
    """In a process in which the library was loaded before MuJoCo was there."""
    program = """
import math
import afo_sim as afo
from afo_sim.physics import Law, LawParameter
AREA = LawParameter("area", "A", "m^2", 0.0, 0.01, "area", (1e-3, 3e-3))
def kernel(contraction, pressure, area):
    return math.nan if 1e5 < pressure < 1.02e5 else pressure * area * (1.0 - 3.0 * contraction)
afo.register(Law("law", kernel, (AREA,)))
muscle = "orthosis.muscle.dorsiflexor.type"
run = afo.run("seated", {f"{muscle}.law": "law", f"{muscle}.laws.law.area": "20 cm^2", "duration": "1 s"})
print(run.status)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0 and "failed: " in done.stdout, done.stderr


def test_a_changed_number_outside_is_another_law(monkeypatch: pytest.MonkeyPatch) -> None:
    def force() -> float:
        afo.register(Law("scaled", scaled, (AREA,)))
        return float(forces(LAWS["scaled"].native_id, (2e-3,), np.array([0.1]), np.array([3e5]))[0])

    first = force()
    monkeypatch.setitem(globals(), "FACTOR", 2.0)
    assert force() == pytest.approx(2.0 * first, rel=1e-14)


FACTOR = 1.0


def scaled(contraction: float, pressure: float, area: float) -> float:
    return FACTOR * pressure * area * (1.0 - contraction)
