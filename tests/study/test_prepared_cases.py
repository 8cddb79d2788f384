"""What a case of a sweep costs before its first step, in counts: what its own keys change is done again."""

import pathlib
import sys
from collections import Counter
from types import FrameType
from typing import Any

import numpy as np
import pytest
from sweep_runs import exact

from afo_sim import native
from afo_sim.common import InputError, assets
from afo_sim.description import Base, Described, expand, load
from afo_sim.study import engine

WALK = Base.of("scenario", expand("scenario", "walk-dropfoot-afo") | {"timestep": "2 ms"})
WALKED = expand("scenario", "walk-dropfoot-afo") | {"timestep": "5 ms", "duration": "1.5 s"}
OPENING = "phases.dorsiflexor.inlet[0][0]"
MOST_CALLS = 1400  # Python functions that a case calls, some 1200 as this is written


def prepared(sets: dict[str, Any]) -> engine.Prepared:
    with native.installed():
        case = engine.prepare(WALK, 0, sets)
    assert isinstance(case, engine.Prepared), case
    return case


def case_of(k: int) -> dict[str, Any]:
    return {
        "supply.pressure": f"{2 + 0.1 * k} bar",
        OPENING: 0.5 + 0.01 * k,
        "patient.body_mass": f"{60 + k} kg",
    }


class Counted:
    """Counts of calls by name, and the tables of descriptions that were read, while it lasts."""

    def __init__(self) -> None:
        self.python, self.built_in, self.tables = 0, Counter[str](), Counter[str]()

    def look(self, frame: FrameType, event: str, what: Any) -> None:
        if event == "call":
            self.python += 1
            if frame.f_code.co_name == "_read_table" and issubclass(frame.f_locals["cls"], Described):
                self.tables[frame.f_locals["cls"].__name__] += 1
        elif event == "c_call":
            self.built_in[what.__name__] += 1


def counted(sets: dict[str, Any]) -> Counted:
    found = Counted()
    with native.installed():
        before = sys.getprofile()
        sys.setprofile(found.look)
        try:
            engine.prepare(WALK, 0, sets)
        finally:
            sys.setprofile(before)
    return found


@pytest.mark.slow
@pytest.mark.alone
def test_a_case_after_the_first_does_only_what_its_keys_change() -> None:
    assert counted(case_of(0) | {"timestep": "2.1 ms"}).built_in["compile"] > 0  # the counter sees it
    for k in range(3):
        prepared(case_of(k))
    found = counted(case_of(7))
    assert found.built_in["compile"] == found.built_in["open"] == found.built_in["scandir"] == 0
    # what holds the keys, and what holds these
    assert found.tables == {"Scenario": 1, "Supply": 1, "Phases": 1, "SwitchPhases": 1, "Patient": 1}
    if sys.version_info[:2] == (3, 11):  # other versions inline other calls
        assert found.python <= MOST_CALLS


def test_a_case_is_the_same_whatever_was_prepared_before() -> None:
    """Bit for bit, of a mass, height and pressure that others had before, and of caches that are full."""
    sets = case_of(3) | {"patient.body_height": "1.6 m"}
    first = prepared(sets)
    for k in range(12):
        prepared(case_of(k) | ({"patient.body_height": "1.6 m"} if k % 2 else {}))
    again = prepared(sets)
    assert np.array_equal(first.control, again.control) and first.control is not again.control
    for name in ("actuator_user", "body_mass", "dof_M0", "jnt_stiffness"):
        assert np.array_equal(getattr(first.built.model, name), getattr(again.built.model, name)), name


def test_a_case_in_a_model_that_another_had_is_the_same() -> None:
    """Of other masses, pressures and toes' springs, which share a layout."""
    cases = [case_of(k) for k in (2, 9, 2, 5, 2)] + [{"leg.toes.stiffness": "40 N*m/rad"}, case_of(2)]
    found = [exact(outcome) for _, outcome in engine.outcomes(WALKED, enumerate(cases), chunk=1)]
    alone = [exact(outcome) for _, outcome in engine.outcomes(WALKED, [(0, case_of(2))])]
    assert [found[k] for k in (0, 2, 4, 6)] == 4 * alone


SETS: list[dict[str, Any]] = [
    {},
    case_of(4),
    {"patient": "healthy"},
    {"patient": "nobody"},
    {"patient.body_mass": "5 kg"},
    {"patient": "healthy", "patient.body_mass": "66 kg"},
    {"orthosis.muscle.dorsiflexor.type": "dmsp_20"},
    {"orthosis.chamber.dorsiflexor.inlet.conductance": "3e-9 m^3/(s*Pa)"},
    {"leg.impedance": 1.0},
    {"bogus.key": 1},
    {"supply.pressure": "400 bar", "timestep": "30 ms"},
    {"limits.toe_clearance[0]": "2 cm"},
    {"phases": None, "timer.period": "1 s"},
]


@pytest.mark.parametrize("sets", SETS, ids=str)
def test_a_description_is_the_same_read_from_a_base(sets: dict[str, Any]) -> None:
    """Or refused for the same reasons, in the same words; and the base stays as it was."""

    def read(source: Any) -> Any:
        try:
            return load("scenario", source, sets).resolved()
        except InputError as error:
            return str(error), [str(other) for other in error.others]

    whole = expand("scenario", "walk-dropfoot-afo") | {"timestep": "2 ms"}
    assert read(WALK) == read(whole)
    assert load("scenario", WALK).resolved() == load("scenario", whole).resolved()


def test_a_stride_file_that_changes_between_cases_is_read_anew(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Written over, removed and written, and another one of the same name in another folder."""
    text = assets.find_gait("bovi2011_natural").read_text(encoding="utf-8")

    def masses(folder: str, mass: str) -> tuple[float, float]:
        (tmp_path / folder).mkdir(exist_ok=True)
        monkeypatch.chdir(tmp_path / folder)
        pathlib.Path("own.csv").write_text(text.replace("_kg: 68.5", f"_kg: {mass}"), encoding="utf-8")
        built = prepared({"gait.cycle": "own.csv"}).built
        monkeypatch.chdir(tmp_path)
        assert built.walk is not None
        return built.body_mass, built.walk.cycle.body_mass

    monkeypatch.chdir(tmp_path)
    for folder, mass in (("a", "68.5"), ("a", "70.5"), ("b", "80.5"), ("a", "71.5")):
        assert masses(folder, mass) == (float(mass), float(mass))
    (tmp_path / "a" / "own.csv").unlink()
    assert isinstance(engine.prepare(WALK, 0, {"gait.cycle": "a/own.csv"}), engine.Outcome)
    assert masses("a", "60.5") == (60.5, 60.5)
