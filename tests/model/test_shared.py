"""Cases share what they have in common, and are to the last bit what they are when nothing is shared."""

import contextlib
import dataclasses
import functools
import itertools
import pathlib
import re
import threading
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np
import pytest
from campaign import size
from changed_leg import changed_leg

from afo_sim.common import InputError
from afo_sim.description import Scenario, expand, load
from afo_sim.model import assemble, leg, muscle_weakness, person, supply_and_timer, walk
from afo_sim.model.build import build
from afo_sim.simulation import simulate_together

SHARED = [
    value
    for module in (assemble, leg, muscle_weakness, person, supply_and_timer, walk)
    for value in vars(module).values()
    if hasattr(value, "cache_clear") and value.__module__ == module.__name__
]
SHORT = {"duration": "0.1 s"}
EACH = size(3, 1)  # of the numbers of a description: in the suite every third is changed
WALK = expand("scenario", "walk-dropfoot-afo")
# of shapes, the tolerance of sleep, which MuJoCo takes from their extent, and paths: alike ones are one
OF_SHAPES = re.compile(
    r"geom_|body_geom|names?|bvh|oct|_sizes|narena|nbuffer|dof_length|mat_|tex_|mesh_|stat\."
    r"|tendon_|ten_J|wrap_|actuator_trnid"
)


def numbers(name: str, value: Any) -> Iterator[tuple[str, bytes | str]]:
    """Every array and number below a value, with its bits."""
    if isinstance(value, np.ndarray):
        yield name, value.tobytes()
    elif isinstance(value, mujoco.MjModel):
        for key in dir(value):
            if isinstance(array := getattr(value, key), np.ndarray):
                yield f"{name}.{key}", array.tobytes()
        for part in ("opt", "stat"):
            fields = getattr(value, part)
            for key in dir(fields):
                if isinstance(entry := getattr(fields, key), float | int | np.ndarray):
                    yield f"{name}.{part}.{key}", np.asarray(entry).tobytes()
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from numbers(f"{name}.{field.name}", getattr(value, field.name))
    else:
        yield name, repr(value)


def all_of(scenario: Scenario) -> dict[str, bytes | str]:
    """Every number of a built case and its inputs, or what is wrong with it."""
    try:
        built = build(scenario)
    except InputError as error:
        return {"error": str(error)}
    return dict(numbers("built", built)) | {"controls": supply_and_timer.controls(built).tobytes()}


def anew(scenario: Scenario) -> dict[str, bytes | str]:
    """`all_of` where nothing is shared."""
    for function in SHARED:
        function.cache_clear()
    return all_of(scenario)


def different(a: dict[str, bytes | str], b: dict[str, bytes | str]) -> list[str]:
    return [name for name in {**a, **b} if a.get(name) != b.get(name)]


def drawn(random: np.random.Generator) -> dict[str, Any]:
    """A case that changes what searches and sweeps change; some share a height, an offset, a strength."""
    start = random.uniform(0.45, 0.6)
    return SHORT | {
        "supply.pressure": f"{random.uniform(2.0, 4.0)} bar",
        "orthosis.muscle.dorsiflexor.link_length": f"{random.uniform(10.8, 11.2)} cm",
        "phases.dorsiflexor.inlet[0][0]": start,
        "phases.dorsiflexor.inlet[0][1]": random.uniform(start + 0.1, 1.0),
        "patient.body_mass": f"{random.uniform(45.0, 110.0)} kg",
        "patient.body_height": f"{random.choice([1.55, 1.75, 1.9])} m",
        "patient.dorsiflexor_strength": random.choice([0.0, 0.3, 1.0]),
        "patient.spasticity": f"{random.uniform(0.0, 2.0)} N*m*s/rad",
        "patient.passive_scale": random.uniform(0.5, 2.0),
        "gait.ankle_offset": f"{random.choice([0.0, 2.0])} deg",
        "ground.mode": str(random.choice(["recorded", "contact"])),
    }


@pytest.mark.slow
def test_random_cases_one_after_the_other_are_those_built_alone() -> None:
    random = np.random.default_rng(1)
    cases = [load("scenario", WALK, drawn(random)) for _ in range(12)]
    shared = [all_of(case) for case in cases]
    for case, found in zip(cases, shared, strict=True):
        assert "error" not in found
        assert different(found, anew(case)) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["walk-dropfoot-afo", "arm"])
def test_no_number_of_a_description_is_lost_on_what_is_shared(name: str) -> None:
    """Each one changed alone, after the case without the change."""
    table = load("scenario", name, SHORT).model_dump(mode="json", exclude_none=True)
    first = load("scenario", table)
    unchanged, found = all_of(first), {}
    for key, value in itertools.islice(changes(table), 0, None, EACH):
        with contextlib.suppress(InputError):
            case = load("scenario", table, {key: value})
            build(first)
            found[key] = case, all_of(case)
    assert sum(different(entry, unchanged) != ["built.scenario"] for _, entry in found.values()) > 30 / EACH
    for key, (case, entry) in found.items():
        assert different(entry, anew(case)) == [], key


def changes(table: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    """Every number of a description, a little larger."""
    if isinstance(table, dict):
        for name, value in table.items():
            if name not in ("provenance", "laws", "frictions"):  # the last two: in a muscle's row only
                yield from changes(value, f"{key}.{name}" if key else name)
    elif isinstance(table, list):
        for place, value in enumerate(table):
            yield from changes(value, f"{key}[{place}]")
    elif isinstance(table, float):
        yield key, 1.01 * table if table else 0.001
    elif isinstance(table, str) and (found := re.fullmatch(r"(-?[\d.]+(?:e-?\d+)?) (\S.*)", table)):
        number = float(found[1])
        yield key, f"{1.01 * number if number else 0.001!r} {found[2]}"


def test_masses_that_are_written_are_those_that_are_compiled() -> None:
    """`full_model` is compiled with the person's masses in its spec."""
    for mass in (50.0, 61.7, 75.0, 103.21):
        built = build(load("scenario", WALK, SHORT | {"patient.body_mass": f"{mass} kg"}))
        stepped, full = (dict(numbers("", model)) for model in (built.model, built.full_model))
        assert [n for n in different(stepped, full) if not OF_SHAPES.match(n[1:])] == []
        for mean in ("meanmass", "meaninertia"):
            assert getattr(built.model.stat, mean) == getattr(built.full_model.stat, mean)


@pytest.mark.parametrize("name", ["walk-dropfoot-afo", "contact", "seated", "arm", "arm-s1"])
def test_what_only_pictures_need_changes_no_state(name: str) -> None:
    contact = {"ground.mode": "contact"} if name == "contact" else {}
    scenario = "walk-dropfoot-afo" if name == "contact" else name
    built = build(load("scenario", scenario, {"duration": "0.3 s", **contact}))
    full = dataclasses.replace(built, model=built.full_model)
    assert built.model.ngeom == 0 < full.model.ngeom
    inputs = supply_and_timer.controls(built)
    lean, whole = simulate_together([built], [inputs])[0], simulate_together([full], [inputs])[0]
    assert lean.failure is None and len(lean.rows["qpos"]) == len(inputs)
    for field, rows in whole.rows.items():
        assert lean.rows[field].tobytes() == rows.tobytes(), field


def test_threads_share_without_harm() -> None:
    cases = [load("scenario", WALK, drawn(np.random.default_rng(k))) for k in range(8)]
    found: dict[tuple[int, int], dict[str, bytes | str]] = {}

    def work(thread: int) -> None:
        for k in np.random.default_rng(thread).permutation(len(cases)):
            found[thread, int(k)] = all_of(cases[k])

    threads = [threading.Thread(target=work, args=(thread,)) for thread in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for k, case in enumerate(cases):
        alone = anew(case)
        assert all(different(found[thread, k], alone) == [] for thread in range(2))


def test_a_leg_that_changes_is_compiled_again(tmp_path: pathlib.Path) -> None:
    for mass in (0.929, 1.5):
        leg = changed_leg(tmp_path, functools.partial(re.sub, 'mass="0.929"', f'mass="{mass}"'))
        assert build(load("scenario", "seated", leg)).model.body("foot").mass[0] == mass


def test_a_leg_whose_inertia_is_a_full_matrix_is_compiled_for_every_mass(tmp_path: pathlib.Path) -> None:
    """MuJoCo turns it into principal axes, which rounds."""
    old, new = "0.0018 0.00423392 0.00423392", "0.0018 0.0042 0.0041 1e-4 2e-4 1e-4"
    leg = changed_leg(tmp_path, lambda text: text.replace(f'diaginertia="{old}"', f'fullinertia="{new}"'))
    for kilograms in (60.0, 91.3):
        sets = SHORT | leg | {"patient.body_mass": f"{kilograms} kg"}
        built = build(load("scenario", "walk-dropfoot-afo", sets))
        for array in ("body_mass", "body_inertia", "body_iquat", "dof_M0"):
            assert getattr(built.model, array).tobytes() == getattr(built.full_model, array).tobytes()
