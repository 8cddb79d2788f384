"""Warnings of a run whose time step was too long: air, motion and energy that are not to be believed."""

import itertools
import math
from collections.abc import Iterator

import numpy as np

from afo_sim.common.notice import Notice
from afo_sim.model.build import Built
from afo_sim.model.mounting import muscle_names
from afo_sim.simulation.energy_balance import Columns, Energy, balance

COLDEST, HOTTEST = 150.0, 600.0  # of air that fills and vents muscles [K]
MOVED = 0.01  # of its length that a muscle may move in a step [-]
UNBALANCED = 0.01  # of the work that may be found nowhere [-]
NOTHING = 1e-3  # work that is too little to judge [J]
PARTS = 50  # stretches of a run, among which the one that closes least is looked for
FINER = 4.0  # times as many steps, where nothing says how many would do


def validity_warnings(built: Built, columns: Columns, static: Columns, energy: Energy) -> Iterator[Notice]:
    """Warnings of what no muscle does, with the time and a smaller step.

    Units: static [N].
    """
    step = built.scenario.timestep
    yield from _air(built, columns)
    yield from _motion(built, columns)
    done = energy.turnover + energy.damper_loss + abs(energy.law_mismatch)
    if done < NOTHING:
        return
    for code, found, problem in (
        ("energy-lost", abs(energy.residual), "of the work is found nowhere"),
        (
            "energy-from-friction",
            -energy.friction_loss,
            "of the work comes from friction, which should take some",
        ),
    ):
        if not found <= UNBALANCED * done:
            muscle, time = _least_closed(built, columns, static)
            yield Notice(
                code,
                "the energy balance does not close: {share:.1f} % {problem}, most of it near {time:.2f} s, "
                "where {subject} moves; {step} would tell more",
                subject=muscle,
                share=100.0 * found / done,
                problem=problem,
                time=time,
                step=_shorter(step, FINER),
            )


def _air(built: Built, columns: Columns) -> Iterator[Notice]:
    """Warnings of air hotter or colder than filling and venting make it."""
    orthosis, step = built.scenario.orthosis, built.scenario.timestep
    for chamber in orthosis.chamber:
        temperature = columns[f"chamber/{chamber}/temperature"]
        beyond = np.maximum(COLDEST - temperature, temperature - HOTTEST)
        worst = int(np.argmax(beyond))
        if not beyond[worst] <= 0.0:
            muscles = " and ".join(orthosis.muscles_of(chamber))
            yield Notice(
                "air-temperature",
                "{subject}: the air is at {temperature:.0f} K at {time:.3f} s, outside {coldest:.0f} to "
                "{hottest:.0f} K; {step} would tell more",
                subject=muscles,
                temperature=float(temperature[worst]),
                time=float(columns["time"][worst]),
                coldest=COLDEST,
                hottest=HOTTEST,
                step=_shorter(step, FINER),
            )


def _motion(built: Built, columns: Columns) -> Iterator[Notice]:
    """Warnings of muscles that jump from step to step."""
    step = built.scenario.timestep
    for name in muscle_names(built.scenario.orthosis):
        moved = np.abs(np.diff(columns[f"muscle/{name}/contraction"]))
        worst = int(np.argmax(moved))
        if not moved[worst] <= MOVED:
            yield Notice(
                "muscle-jumps",
                "{subject} moves by {moved:.1f} % of its length in the step at {time:.3f} s, and more than "
                "{most:.0f} % is not to be believed; {step} would do",
                subject=name,
                moved=100.0 * float(moved[worst]),
                time=float(columns["time"][worst]),
                most=100.0 * MOVED,
                step=_shorter(step, moved[worst] / MOVED),
            )


def _least_closed(built: Built, columns: Columns, static: Columns) -> tuple[str, float]:
    """The muscle and the time at which a run's balance closes least."""
    cuts = np.unique(np.linspace(0, len(columns["time"]) - 1, PARTS + 1).astype(int))
    found = []
    for first, last in itertools.pairwise(cuts.tolist()):
        rows = slice(first, last + 1)
        part, forces = ({k: v[rows] for k, v in each.items()} for each in (columns, static))
        energy = balance(built, part, forces)
        found.append((abs(energy.residual) + max(-energy.friction_loss, 0.0), part))
    _, part = max(found, key=lambda each: each[0])
    muscle = max(static, key=lambda name: float(np.ptp(part[f"muscle/{name}/contraction"])))
    return muscle, float(part["time"].mean())


def _shorter(step: float, times: float) -> str:
    """A time step that is at least so many times shorter, as people write it: 1, 2 or 5 in front."""
    wanted = 1e3 * step / max(times, 1.0) if math.isfinite(times) else 1e3 * step / FINER
    decade = 10.0 ** math.floor(math.log10(wanted) + 1e-9)
    first = max(k for k in (1.0, 2.0, 5.0) if k * decade <= wanted * (1.0 + 1e-9))
    return f"a time step of {first * decade:g} ms"
