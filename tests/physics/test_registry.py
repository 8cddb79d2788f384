"""Laws and frictions as files: what is found, what is refused at import, and what compiled code answers."""

import math
import pathlib
import sys
import types

import numba
import numpy as np
import pytest
from campaign import nightly

from afo_sim.physics import (
    FRICTIONS,
    LAWS,
    MAX_COEFFICIENTS,
    RETIRED_FRICTIONS,
    Friction,
    Law,
    friction,
    laws,
    register_all,
    static_force,
)
from afo_sim.physics.friction import dispatch

LAW = """
from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.law import Law, LawParameter, plain

@register_jitable
def {kernel}(contraction, pressure, *a):
    return a[0] * pressure * (1.0 - contraction)

PARAMETERS = tuple(LawParameter(f"a{{i}}", f"a{{i}}", "", 0.0, 1.0, "") for i in range({count}))
THIS = Law(name="{name}", native_id={native_id}, kernel={kernel}, parameters=PARAMETERS,
    coefficients=plain(PARAMETERS), fitted=(), formula="", pressure_range=(0.0, 1e6),
    contraction_range=(0.0, 0.3), validity="", source="")
"""

FRICTION = """
from numba.extending import register_jitable  # numba's own does as well
from afo_sim.physics.friction.law import Friction
from afo_sim.physics.law import LawParameter, plain

@register_jitable
def kernel({arguments}):
    return c * rate, c

@register_jitable
def moving(yields, moved, x, y, c, step):
    return yields + x, c * moved / step

PARAMETERS = (LawParameter("c", "c", "", 0.0, 1.0, ""),)
THIS = Friction(name="{name}", native_id={native_id}, unit="{unit}", n_state={n_state}, parameters=PARAMETERS,
    coefficients=plain(PARAMETERS), kernel=kernel, formula="", validity="", source=""{more})
"""


def law_file(
    name: str = "new_2026", native_id: int = 77, kernel: str = "kernel", count: int = 1
) -> dict[str, str]:
    return {"new_law": LAW.format(name=name, native_id=native_id, kernel=kernel, count=count)}


def friction_file(
    name: str = "new_2026",
    native_id: int = 77,
    unit: str = "Pa",
    n_state: int = 0,
    arguments: str = "yields, rate, c",
    more: str = "",
) -> dict[str, str]:
    return {
        "new_friction": FRICTION.format(
            name=name, native_id=native_id, unit=unit, n_state=n_state, arguments=arguments, more=more
        )
    }


def with_files(
    package: types.ModuleType, files: dict[str, str], folder: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The package as if it held these files too."""
    for name, text in files.items():
        (folder / f"{name}.py").write_text(text, encoding="utf-8")
        monkeypatch.delitem(sys.modules, f"{package.__name__}.{name}", raising=False)
        monkeypatch.setattr(package, name, None, raising=False)  # what the import leaves is taken away
    monkeypatch.setattr(package, "__path__", [*package.__path__, str(folder)])


@pytest.fixture(autouse=True)
def nothing_stays(request: pytest.FixtureRequest) -> None:
    def forget() -> None:
        for package, name in ((laws, "new_law"), (friction, "new_friction")):
            sys.modules.pop(f"{package.__name__}.{name}", None)

    request.addfinalizer(forget)


@pytest.mark.parametrize(("package", "kind", "known"), [(laws, Law, LAWS), (friction, Friction, FRICTIONS)])
def test_every_entry_of_every_file_is_known(
    package: types.ModuleType, kind: type, known: dict[str, object]
) -> None:
    files = {p.stem for p in pathlib.Path(package.__path__[0]).glob("*.py")} - {"__init__", "law", "dispatch"}
    entries = [
        value
        for file in files
        for value in vars(sys.modules[f"{package.__name__}.{file}"]).values()
        if isinstance(value, kind)
    ]
    assert len(entries) == len(known)
    assert all(known[entry.name] is entry for entry in entries)  # type: ignore[attr-defined]


def test_ids_rise_and_mean_what_they_meant() -> None:
    """A row in a model that was saved says the id alone."""
    for known in (LAWS, FRICTIONS):
        ids = [entry.native_id for entry in known.values()]  # type: ignore[attr-defined]
        assert ids == sorted(ids)
    first = {law.native_id: law.kernel.__name__ for law in LAWS.values()}
    assert (first[0], first[7], first[10]) == ("chou_hannaford_1996", "takosoglu_2016", "three_element")
    assert {f.native_id: f.name for f in FRICTIONS.values()}[5] == "maxwell_slip"
    # no new friction may take the place of a retired one
    assert {2, 4}.isdisjoint(entry.native_id for entry in FRICTIONS.values())
    assert set(RETIRED_FRICTIONS).isdisjoint(FRICTIONS) and set(RETIRED_FRICTIONS.values()) <= set(FRICTIONS)


@pytest.mark.parametrize("entries", [LAWS, FRICTIONS])
def test_typical_values_are_allowed(entries: dict[str, Law] | dict[str, Friction]) -> None:
    for entry in entries.values():
        for parameter in entry.parameters:
            assert parameter.lower <= parameter.typical <= parameter.upper, (entry.name, parameter.name)


@nightly("the page of the architecture adds a law, too")
@pytest.mark.slow
def test_a_new_file_is_a_law(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Found, in the dispatcher, and the same compiled; the laws before it keep their branches."""
    with_files(laws, law_file(), tmp_path, monkeypatch)
    found = laws.collected()
    assert set(found) == {*LAWS, "new_2026"}
    one = static_force.over(found.values())
    sloped = static_force.over(found.values(), slopes=True)
    register_all()
    compiled = numba.njit(lambda law, kappa, p, u: (one(law, kappa, p, u, 1), sloped(law, kappa, p, u, 1)))
    for law in found.values():
        row = np.array([9.0, *law.typical, *[0.0] * MAX_COEFFICIENTS])
        expected = law.kernel(0.1, 3e5, *law.typical)
        assert one(float(law.native_id), 0.1, 3e5, row, 1) == expected
        force, slopes = compiled(float(law.native_id), 0.1, 3e5, row)
        assert (force, slopes[0]) == pytest.approx((expected, expected), rel=1e-12)
        assert slopes == pytest.approx(sloped(float(law.native_id), 0.1, 3e5, row, 1), rel=1e-12)
    # the new one, p (1 − κ)/2, has no slopes of its own; `law` is the last, since its id is the greatest
    assert slopes[1:] == pytest.approx((-0.5 * 3e5, 0.5 * 0.9), rel=1e-6)


STATES = {"n_state": 2, "arguments": "yields, rate, x, y, c", "more": ", rate_kernel=moving"}


@pytest.mark.slow
@pytest.mark.parametrize(
    "files",
    [
        friction_file(),
        friction_file(**STATES),  # type: ignore[arg-type]
        friction_file(unit="N", arguments="contraction, rate, pressure, c"),
    ],
    ids=["dead band", "dead band with states", "motion"],
)
def test_a_new_file_is_a_friction(
    files: dict[str, str], tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with_files(friction, files, tmp_path, monkeypatch)
    found = friction.collected()
    new, all_ = found["new_2026"], found.values()
    of_motion, of_dead_band = (dispatch.answers_over(all_, unit) for unit in ("N", "Pa"))
    rates = dispatch.rates_over(all_)
    is_force = dispatch.which_are_forces(all_)
    assert [f.name for f in all_ if is_force(float(f.native_id))] == [f.name for f in all_ if f.unit == "N"]
    # compiled, with the states behind another actuator's, and the coefficients within a row
    id_, c = float(new.native_id), new.typical[0]
    act, row, out = np.array([5.0, 0.1, 0.2]), np.array([9.0, 8.0, c]), np.zeros(3)
    register_all()
    if new.unit == "N":
        answer = numba.njit(lambda a, u: of_motion(id_, 0.1, 0.3, 3e5, a, 1, u, 2))(act, row)
    else:
        answer = numba.njit(lambda a, u: of_dead_band(id_, 7.0, 0.3, a, 1, u, 2))(act, row)
    assert answer == (c * 0.3, c)
    if new.n_state:
        assert numba.njit(lambda a, u, o: rates(id_, 7.0, 0.3, a, 1, u, 2, 1e-3, o))(act, row, out) == 0.0
        assert out.tolist() == [0.0, 7.1, c * 0.3 / 1e-3]


@pytest.mark.parametrize(
    ("package", "files", "message"),
    [
        (laws, law_file(native_id=5), r"id 5 is given twice: .*'new_2026' in .*new_law.*; \d+ is free"),
        (laws, law_file(name="sarosi_2012"), r"the name 'sarosi_2012' is given twice: in .* and "),
        (laws, law_file(count=22), r"'new_2026' has 22 coefficients; an actuator's row has 21 slots"),
        (
            laws,
            {"new_law": law_file()["new_law"].replace("pressure, *a)", "pressure, a, b)")},
            r"'new_2026' has 1 coefficients, which its kernel does not take: missing .* 'b'",
        ),
        (laws, {"new_law": "PARAMETERS = ()\n"}, r"physics\.laws\.new_law holds no Law at its top level"),
        (friction, friction_file(native_id=5), r"the native id 5 is given twice: .*; \d+ is free"),
        (friction, friction_file(native_id=0), "'new_2026' has the native id 0; 0 is no friction"),
        (friction, friction_file(n_state=2), "'new_2026' has 2 states and no rate_kernel"),
        (friction, friction_file(more=", rate_kernel=moving"), "has 0 states and a rate_kernel"),
        (friction, friction_file(unit="N", **STATES), "'new_2026' has states, and no dead band"),  # type: ignore[arg-type]
        (
            friction,
            friction_file(arguments="yields, rate, c, d"),
            "1 coefficients, which its kernel does not take",
        ),
    ],
)
def test_a_wrong_entry_is_refused(
    package: types.ModuleType,
    files: dict[str, str],
    message: str,
    tmp_path: pathlib.Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with_files(package, files, tmp_path, monkeypatch)
    with pytest.raises(ValueError, match=message):
        package.collected()


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_the_dispatchers_know_every_law(law: Law) -> None:
    expected, asked = law.kernel(0.1, 3e5, *law.typical), (float(law.native_id), 0.1, 3e5, law.typical, 0)
    assert static_force.static_force(*asked) == static_force.static_slopes(*asked)[0] == expected


@pytest.mark.parametrize("model", FRICTIONS.values(), ids=FRICTIONS)
def test_the_dispatchers_know_every_friction(model: Friction) -> None:
    id_, row, rates = float(model.native_id), model.typical, [0.0] * 4
    states = [0.1 * k for k in range(model.n_state)]
    memory = (states, 0, row, 0)
    of_motion = dispatch.friction_of_motion(id_, 0.1, 0.2, 3e5, *memory)
    of_dead_band = dispatch.friction_of_dead_band(id_, 9.0, 0.2, *memory)
    found, other = (of_motion, of_dead_band) if dispatch.is_force(id_) else (of_dead_band, of_motion)
    motion = (0.1, 0.2, 3e5) if model.unit == "N" else (9.0, 0.2)
    assert found == model.kernel(*motion, *states, *row)
    assert all(map(math.isnan, other))
    one = dispatch.friction_rates(id_, 9.0, 0.2, *memory, 1e-3, rates)
    if model.rate_kernel is not None:
        expected = model.rate_kernel(9.0, 0.2, *states, *row, 1e-3)
        assert (one if model.n_state == 1 else tuple(rates[: model.n_state])) == expected
