"""The search for gains, strides' numbers, and what they are held against."""

import csv
import dataclasses
import json
import os
import pathlib
import signal
import subprocess
import sys
import time
from types import SimpleNamespace
from typing import Any

import documents
import numpy as np
import pytest

from afo_sim.common import InputError, SimulationError
from afo_sim.physics import GAINS
from afo_sim.simulation import occupy, released
from afo_sim.walker import (
    Body,
    Cost,
    Found,
    Free,
    build_body,
    falls_of,
    norm_at,
    prepared,
    read_gait,
    search,
    strengths_of,
    walk,
    walk_body,
)
from afo_sim.walker.bounds import BOUNDS, LEAST, MOST
from afo_sim.walker.gait import OFFSETS
from afo_sim.walker.search import ADAPTING, adapt, pushes_at

MODULE = sys.modules["afo_sim.walker.search"]  # its name in the room is the function's
SHORT: dict[str, Any] = {"generations": 3, "duration": 0.5, "seed": 3}
FEW, CHEAP = Free(("lean", "vasti_force"), pose=False), Cost(1.2, pushed=False)
# A search in a process of its own, which is killed.
SEARCH = """
import pathlib, sys
from afo_sim.simulation import occupy
from afo_sim.walker import Cost, Free, build_body, prepared, read_gait, search
occupy(pathlib.Path(sys.argv[1]), "search")
body = build_body(prepared("walk-healthy", {"timestep": "1 ms"}))
free = Free(("lean", "vasti_force"), pose=False)
vector = read_gait("natural").vector
search([body], vector, Cost(1.2, pushed=False), free, generations=1000, duration=0.5, seed=3)
"""


def test_free_numbers_go_in_and_out() -> None:
    vector = read_gait("natural").vector
    for free, count in (
        (Free(), 7 + 2 * len(GAINS)),
        (Free(alike=True), 7 + len(GAINS)),
        (Free(("lean",), pose=False), 2),
    ):
        values = free.pack(vector)
        assert len(values) == count
        moved = free.unpack(vector, values + 0.1)
        assert np.allclose(free.pack(moved), values + 0.1)
    assert (vector.gains == read_gait("natural").vector.gains).all()  # the given one stays


@pytest.fixture(scope="module")
def body() -> Body:
    return build_body(prepared("walk-healthy", {"timestep": "1 ms"}))


@pytest.fixture(scope="module")
def whole(body: Body) -> Found:
    """A search that nobody has killed."""
    return search([body], read_gait("natural").vector, CHEAP, FEW, threads=1, **SHORT)


def parts(folder: pathlib.Path) -> list[pathlib.Path]:
    """What is kept of a search."""
    return [path for path in folder.glob(".afo-sim/*/[!.]*") if path.is_file()]


def assert_same(found: Found, whole: Found) -> None:
    """Each bit is."""
    assert found.vector.gains.tobytes() == whole.vector.gains.tobytes()
    assert found.vector.offsets.tobytes() == whole.vector.offsets.tobytes()
    assert found.history.tobytes() == whole.history.tobytes()
    assert (found.parts, found.evaluations) == (whole.parts, whole.evaluations)


def test_a_search_does_not_depend_on_threads_and_keeps_what_is_not_free(body: Body, whole: Found) -> None:
    vector = read_gait("natural").vector
    np.random.seed(7)  # whoever uses NumPy's own generator beside it changes nothing
    assert_same(search([body], vector, CHEAP, FEW, threads=2, **SHORT), whole)
    changed = np.flatnonzero((whole.vector.gains != vector.gains).any(axis=0))
    assert {GAINS[k] for k in changed} == {"lean", "vasti_force"}
    assert isinstance(whole.converged, bool)  # a file of the gait holds it
    assert whole.evaluations == 48 and whole.history.shape == (3, 2)
    assert 0.0 < whole.seconds < 60.0


@pytest.mark.parametrize("walks", [0, 20, 47])
def test_a_killed_search_goes_on_bit_by_bit(
    walks: int, body: Body, whole: Found, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is killed in the midst of a generation: none, one or two are whole."""
    count, vector = [0], read_gait("natural").vector

    def counted(*of: Any, **more: Any) -> Any:
        count[0] += 1
        if count[0] > walks:
            raise KeyboardInterrupt
        return walk_body(*of, **more)

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt), released():
        patch.setattr(MODULE, "walk_body", counted)
        occupy(tmp_path, "search")
        search([body], vector, CHEAP, FEW, threads=1, **SHORT)
    assert len(parts(tmp_path)) == walks // 16
    count[0] = -1000
    monkeypatch.setattr(MODULE, "walk_body", counted)
    with released():
        assert bool(occupy(tmp_path, "search")) == (walks >= 16)
        assert_same(search([body], vector, CHEAP, FEW, threads=2, **SHORT), whole)
        again = 48 - walks // 16 * 16  # those of whole generations are not walked again
        assert count[0] + 1000 == again + 2 * MODULE.HELD_OUT  # of the end and of the beginning
        longer = search([body], vector, CHEAP, FEW, **SHORT | {"generations": 4})
        assert longer.history[:3].tobytes() == whole.history.tobytes()
        shorter = search([body], vector, CHEAP, FEW, **SHORT | {"generations": 2})
        assert shorter.history.tobytes() == whole.history[:2].tobytes()
    assert not parts(tmp_path)


def test_a_walk_that_ends_in_an_error_costs_more_than_one_that_falls_at_once(
    body: Body, monkeypatch: pytest.MonkeyPatch
) -> None:
    natural, like = read_gait("natural").vector, dataclasses.replace(CHEAP, likeness=40.0)
    limp = walk_body(body, dataclasses.replace(natural, gains=np.zeros_like(natural.gains)), 2.0)
    limp_cost, count = sum(like.of(limp, 2.0).values()), [0]
    assert limp.fell is not None and limp_cost > 2000.0

    def erring(*of: Any, **more: Any) -> Any:
        count[0] += 1
        if count[0] <= 16:
            raise SimulationError("no number")
        return walk_body(*of, **more)

    monkeypatch.setattr(MODULE, "walk_body", erring)
    found = search([body], natural, like, FEW, threads=1, **SHORT | {"generations": 1})
    assert found.history[0, 0] > limp_cost


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGKILL")
def test_a_process_that_is_killed_leaves_a_search_that_goes_on(
    body: Body, whole: Found, tmp_path: pathlib.Path
) -> None:
    child = subprocess.Popen([sys.executable, "-c", SEARCH, str(tmp_path)])
    try:
        until = time.monotonic() + 120.0
        while not parts(tmp_path) and child.poll() is None and time.monotonic() < until:
            time.sleep(0.02)
        child.send_signal(signal.SIGSTOP)
        if child.poll() is None:
            with pytest.raises(InputError, match="another afo-sim"), released():
                occupy(tmp_path, "search")
    finally:
        child.send_signal(signal.SIGKILL)
        child.wait()
    with released():
        assert occupy(tmp_path, "search")
        assert_same(search([body], read_gait("natural").vector, CHEAP, FEW, **SHORT), whole)


def test_another_searchs_parts_are_not_taken(body: Body, tmp_path: pathlib.Path) -> None:
    natural, short = read_gait("natural").vector, SHORT | {"generations": 1}
    weak = build_body(prepared("walk-healthy", {"timestep": "1 ms"}), {"left_soleus": 0.999})
    with released():
        occupy(tmp_path, "search")
        first = search([body], natural, CHEAP, FEW, **short)
        walk_body(body, natural, 0.1)  # leaves the gait's gains in the body's model, which is no other body
        assert_same(search([body], natural, CHEAP, FEW, **short), first)
        assert len(parts(tmp_path)) == 1
        search([body], natural, Cost(1.3, pushed=False), FEW, **short)
        search([weak], natural, CHEAP, FEW, **short)
        search([body], dataclasses.replace(natural, speed=1.01), CHEAP, FEW, **short)
        search([body], natural, CHEAP, Free(("lean",), pose=False), **short)
        search([body], natural, CHEAP, FEW, **short | {"seed": 4})
        search([body], natural, CHEAP, FEW, **short | {"duration": 0.6})
        assert len(parts(tmp_path)) == 7


def test_a_search_stays_within_bounds_and_begins_there(body: Body) -> None:
    """On the bound at first, and from beyond it; the legs are alike."""
    natural = read_gait("natural").vector
    gains = natural.gains.copy()
    gains[:, GAINS.index("tibialis_soleus")], gains[:, GAINS.index("soleus_force")] = 0.0, -1.0
    begun, free = (
        dataclasses.replace(natural, gains=gains),
        Free(("tibialis_soleus", "soleus_force"), alike=True),
    )
    tried: list[np.ndarray] = []

    def seen(body: Body, vector: Any, *of: Any) -> Any:
        tried.append(free.pack(vector))
        return walk_body(body, vector, *of)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(MODULE, "walk_body", seen)
        found = search([body], begun, CHEAP, free, spread=0.5, threads=1, **SHORT)
    assert (found.vector.gains[0] == found.vector.gains[1])[[3, 4]].all()
    assert (np.array(tried) >= free.pack(LEAST)).all() and (np.array(tried) <= free.pack(MOST)).all()
    assert len({tuple(each) for each in tried[:16]}) == 16  # and does not stick to them


def test_a_number_is_searched_as_widely_below_zero_as_above(
    body: Body, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A first standard deviation of 8 %, by the same draws."""
    natural, free = (
        read_gait("natural").vector,
        Free(("lean_offset", "tibialis_swing"), pose=False, alike=True),
    )
    apart = []
    for sign in (1.0, -1.0):
        gains, tried = natural.gains.copy(), list[np.ndarray]()
        gains[:, [GAINS.index(name) for name in free.names]] = begun = sign * np.array([0.5, 0.25])

        def seen(body: Body, vector: Any, *_: Any, tried: Any = tried) -> Any:
            tried.append(free.pack(vector))
            return walk_body(body, vector, 0.05)

        monkeypatch.setattr(MODULE, "walk_body", seen)
        search([body], dataclasses.replace(natural, gains=gains), CHEAP, free, threads=1, **SHORT)
        apart.append((tried[:16] - begun) / begun * sign)
    assert apart[0] == pytest.approx(apart[1]) and 0.04 < np.std(apart[0]) < 0.16


def test_every_number_of_a_gait_has_bounds_and_every_shipped_one_lies_within() -> None:
    assert {*GAINS, *OFFSETS} == set(BOUNDS)
    assert all(low < high and low <= 0.5 for low, high in BOUNDS.values())
    for name in ("slow", "natural", "fast", "drop-foot", "drop-foot-s1"):
        vector = read_gait(name).vector
        for values, least, most in zip(
            (vector.offsets, vector.gains),
            (LEAST.offsets, LEAST.gains),
            (MOST.offsets, MOST.gains),
            strict=True,
        ):
            assert (least <= values).all() and (values <= most).all(), name
    assert BOUNDS["tibialis_offset"] == (0.3, 2.0)  # too wide: see there


def test_several_bodies_share_a_cost_and_one_of_those_drawn_walks_beside(
    body: Body, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario, natural = prepared("walk-healthy", {"timestep": "1 ms"}), read_gait("natural").vector
    weak = build_body(scenario, {"soleus": 0.6})
    one, other, both, drawn = (
        search(bodies, natural, CHEAP, FEW, drawn=more, generations=0, duration=1.0)
        for bodies, more in (([body], ()), ([weak], ()), ([body, weak], ()), ([body], [weak]))
    )
    assert one.parts != other.parts
    for name, value in both.parts.items():
        assert value == pytest.approx((one.parts[name] + other.parts[name]) / 2.0, rel=1e-12)
    lasted = walk_body(weak, natural, 8.0).fell or 8.0
    assert drawn.parts == one.parts | {"weak": pytest.approx(60.0 * (1.0 - lasted / 8.0))}
    seen = []

    def walked(which: Body, *of: Any, **more: Any) -> Any:
        seen.append((which.weight, of[1]))
        return walk_body(which, *of, **more)

    monkeypatch.setattr(MODULE, "walk_body", walked)
    several = [dataclasses.replace(body, weight=float(k)) for k in range(1, 9)]
    search([body], natural, CHEAP, FEW, drawn=several, threads=1, **SHORT)
    beside = [weight for weight, lasts in seen if lasts == 8.0]
    assert len({*beside[:16]}) == 1 and len({*beside}) > 1  # one of them in a generation, others in the next


def _walked_shortly(body: Body, vector: Any, _: float, *of: Any, **more: Any) -> Any:
    return walk_body(body, vector, 0.3, *of, **more)


def test_who_adapts_goes_by_way_of_the_stronger_and_on_after_a_stop(
    body: Body, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        MODULE, "walk_body", lambda body, vector, _, *of, **more: walk_body(body, vector, 0.3, *of, **more)
    )
    natural, told = read_gait("natural").vector, []
    stages: list[list[Body]] = [[body], [body, body]]

    def stopped(k: int, n: int, _: float) -> None:
        told.append((k, n))
        if len(told) == 3:
            raise KeyboardInterrupt

    whole = adapt(stages, natural, CHEAP, FEW, generations=4, threads=1)
    with pytest.raises(KeyboardInterrupt), released():
        occupy(tmp_path, "adapt")
        adapt(stages, natural, CHEAP, FEW, generations=4, progress=stopped)
    with released():
        assert occupy(tmp_path, "adapt")
        found = adapt(stages, natural, CHEAP, FEW, generations=4, threads=2, progress=stopped)
    assert_same(found, whole)
    assert told[3:] == [(1, 5), (2, 5), (3, 5), (4, 5), (5, 5)] and found.evaluations == 80
    once = {"generations": 1, "spread": ADAPTING}
    alone = adapt([stages[0]], natural, CHEAP, FEW, generations=1)
    assert_same(search(stages[0], natural, CHEAP, FEW, **once), alone)  # one stage is one search


@pytest.mark.slow
def test_one_command_searches_by_several_seeds_and_takes_the_best(tmp_path: pathlib.Path) -> None:
    """The same command again walks no generation again, and writes the same."""
    out = tmp_path / "brisk"
    program = [sys.executable, documents.ROOT / "scripts" / "search_gait.py", "natural", "--speed", "1.3"]
    before: dict[str, bytes] = {}
    for jobs in ("2", "1"):
        command = [*program, "--generations", "1", "--seeds", "2", "--threads", jobs, "--out", out]
        said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        found = {path.name: path.read_bytes() for path in out.iterdir()}
        assert set(found) == {f"seed_{k}.{kind}" for k in (1, 2) for kind in ("json", "toml")} | {
            "seeds.csv",
            "brisk.toml",
        }
        assert found == (before or found)
        before = found
    rows = list(csv.DictReader((out / "seeds.csv").read_text(encoding="utf-8").splitlines()))
    assert [row["seed"] for row in rows] == ["1", "2"] and float(rows[0]["cpu_minutes"]) > 0.0
    standing = [row for row in rows if (row["fell_pushed"], row["fell_undisturbed"]) == ("False", "False")]
    best = min(standing, key=lambda row: float(row["cost"]))["seed"]
    assert f"the best is seed {best}" in said and read_gait(out / "brisk.toml").search["seed"] == int(best)
    tried = [json.loads((out / f"seed_{k}.json").read_text(encoding="utf-8"))["told"] for k in (1, 2)]
    assert tried[0][0]["asked"] != tried[1][0]["asked"] and read_gait(out / "seed_1.toml").speed == 1.3


def test_pushes_are_as_many_forward_as_backward() -> None:
    pushes = pushes_at(10.0, 5)
    assert abs(sum(push.force for push in pushes)) <= 50.0
    assert [push.time for push in pushes] != [push.time for push in pushes_at(10.0, 6)]


def test_falls_do_not_depend_on_threads() -> None:
    body, gait = (
        build_body(prepared("walk-dropfoot", {"timestep": "1 ms"}), {"tibialis": 0.0}),
        read_gait("natural").vector,
    )
    assert falls_of(body, gait, starts=3, threads=1) == falls_of(body, gait, starts=3, threads=2)


def test_the_norm_is_the_published_walkers() -> None:
    norm = norm_at(1.22)
    assert np.degrees(norm["knee"].max()) == pytest.approx(62.0, abs=2.0)  # Bovi et al. 2011, natural speed
    assert np.degrees(norm["ankle"].min()) == pytest.approx(-17.0, abs=1.0)
    assert float(norm["load"].max()) == pytest.approx(1.14, abs=0.03)
    assert np.degrees(norm["thigh"][0]) == pytest.approx(15.1 + 8.0, abs=1.0)


@pytest.mark.parametrize("taller", [0.7, 1.1, 1.2])
@pytest.mark.parametrize("speed", [0.3, 1.22, 2.5])
def test_the_norm_of_another_height_is_dynamically_similar(taller: float, speed: float) -> None:
    similar = {"duration": 0.5, "length": 1.0, "moment": 1.0, "power": 0.5}  # powers of the height
    norm, other = norm_at(speed), norm_at(speed * taller**0.5, taller)
    for name, values in norm.items():
        assert other[name] == pytest.approx(values * taller ** similar.get(name, 0.0), rel=1e-9), name


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: strengths_of(prepared("walk-dropfoot"), {"tibialis": -0.1}), "0 to 2"),
        (lambda: strengths_of(prepared("walk-dropfoot"), {"tibalis": 0.1}), "tibialis"),
        (lambda: prepared("seated"), "nobody walks"),
        (lambda: read_gait("naturall"), "natural"),
        (lambda: prepared("walk-dropfoot-afo", {"timestep": "5 ms"}), "2 ms"),
        (lambda: prepared("walk-dropfoot-afo", {"start.dorsiflexor.fill_time": "0.1 s"}), "fill_time"),
        (lambda: prepared("walk-dropfoot-afo", {"load_moment": "1 N*m"}), "load_moment"),
        (lambda: prepared("walk-dropfoot-afo", {"gait.pace": [["3 s", 0]]}), "gait.pace"),
        (lambda: walk("walk-dropfoot", duration=1.0), "4 to 600"),
        (lambda: walk("walk-dropfoot", push=float("nan")), "push"),
    ],
)
def test_wrong_input_is_a_sentence(call, words: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(InputError, match=words):
        call()


@pytest.mark.parametrize(
    ("medians", "converged"),
    [([5.0], False), ([5.0] * 29, False), ([9.0] * 25 + [5.0] * 5, False), ([9.0] + [5.0] * 29, True)],
)
def test_a_search_that_still_gains_did_not_converge(medians: list[float], converged: bool) -> None:
    history = np.array([medians, medians]).T
    found = Found(read_gait("natural").vector, history, 16, {}, SimpleNamespace(fell=None))  # type: ignore[arg-type]
    assert found.converged is converged
