"""The search for gains, strides' numbers, and what they are held against."""

from types import SimpleNamespace

import numpy as np
import pytest

from afo_sim.common import InputError
from afo_sim.physics import GAINS
from afo_sim.walker import (
    Cost,
    Found,
    Free,
    build_body,
    falls_of,
    norm_at,
    prepared,
    read_gait,
    respond,
    search,
    strengths_of,
)
from afo_sim.walker.measured import _same_way
from afo_sim.walker.search import pushes_at


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


@pytest.mark.slow
def test_a_search_does_not_depend_on_threads_and_keeps_what_is_not_free() -> None:
    body, vector = build_body(prepared("walk-healthy", {"timestep": "1 ms"})), read_gait("natural").vector
    free, cost = Free(("lean", "vasti_force"), pose=False), Cost(1.2, pushed=False)
    found = [
        search([body], vector, cost, free, generations=2, duration=1.0, threads=threads, seed=3)
        for threads in (1, 2)
    ]
    assert (found[0].vector.gains == found[1].vector.gains).all()
    changed = np.flatnonzero((found[0].vector.gains != vector.gains).any(axis=0))
    assert {GAINS[k] for k in changed} == {"lean", "vasti_force"}
    assert isinstance(found[0].converged, bool)  # a file of the gait holds it
    assert found[0].evaluations == 32 and found[0].history.shape == (2, 2)


def test_pushes_are_as_many_forward_as_backward() -> None:
    pushes = pushes_at(10.0, 5)
    assert abs(sum(push.force for push in pushes)) <= 50.0
    assert [push.time for push in pushes] != [push.time for push in pushes_at(10.0, 6)]


def test_falls_do_not_depend_on_threads() -> None:
    body, gait = (
        build_body(prepared("walk-dropfoot", {"timestep": "1 ms"}), {"tibialis": 0.0}),
        read_gait("natural"),
    )
    assert falls_of(body, gait, starts=3, threads=1) == falls_of(body, gait, starts=3, threads=2)


def test_the_norm_is_the_published_walkers() -> None:
    norm = norm_at(1.22)
    assert np.degrees(norm["knee"].max()) == pytest.approx(62.0, abs=2.0)  # Bovi et al. 2011, natural speed
    assert np.degrees(norm["ankle"].min()) == pytest.approx(-17.0, abs=1.0)
    assert float(norm["load"].max()) == pytest.approx(1.14, abs=0.03)
    assert np.degrees(norm["thigh"][0]) == pytest.approx(15.1 + 8.0, abs=1.0)


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
        (lambda: respond("walk-dropfoot", duration=1.0), "too short"),
        (lambda: respond("walk-dropfoot", push=float("nan")), "push"),
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


def test_a_response_agrees_within_half_and_twice_and_in_its_direction() -> None:
    verdicts = [
        _same_way("", 9.0, simulated, "deg", "", "").verdict for simulated in (4.4, 4.6, 17.9, 18.1, -9.0)
    ]
    assert verdicts == ["disagrees", "agrees", "agrees", "disagrees", "disagrees"]
