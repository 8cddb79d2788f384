"""The tube of smallest bore between valves and muscles, at a stated length."""

from typing import Any

from afo_sim.common import assets
from afo_sim.description.air.tube import Tube
from afo_sim.description.reader import load
from afo_sim.description.scenario import Scenario
from afo_sim.metrics.metric_words import words
from afo_sim.study.sizing.candidate import Candidate, Tried
from afo_sim.study.sizing.requirement import shown
from afo_sim.study.sizing.result import Sizing
from afo_sim.study.sizing.trial import Trials
from afo_sim.study.sizing.valves import DM3, UNIT
from afo_sim.study.sizing.words import larger_is_worse, smallest


def size_tube(trials: Trials, length: float) -> Sizing:
    """The tube of smallest bore, of one length [m] at every chamber."""
    tubes = {name: load("tube", name) for name in assets.names("tube")}
    ordered = sorted(tubes.items(), key=lambda item: (item[1].bore, item[0]))
    tried = trials.run([_candidate(trials.scenario, length, *each) for each in ordered])
    best = next((each for each in tried if each.meets), None)
    return Sizing(
        kind="tube",
        scenario=trials.scenario.name,
        requirements=trials.requirements,
        air=trials.air,
        axis=("bore", "mm", 1e3),
        tried=tuple(tried),
        best=best,
        answer=smallest(tried, trials.requirements, f"tube of {length:g} m", "tube"),
        notes=tuple(_notes(trials, tried, length)),
    )


def _candidate(scenario: Scenario, length: float, name: str, tube: Tube) -> Candidate:
    facts = {
        "bore [mm]": f"{1e3 * tube.bore:.3g}",
        "C": f"{DM3 * tube.conductance(length):.3g}",
        "b": f"{tube.critical_ratio(length):.2g}",
        "air [ml]": f"{1e6 * tube.volume(length):.3g}",
    }
    sets: dict[str, Any] = {}
    for chamber, now in scenario.orthosis.chamber.items():
        key = f"orthosis.chamber.{chamber}"
        sets |= {f"{key}.tube": name, f"{key}.tube_length": f"{length!r} m"}
        if now.tube is None:  # the volume stood for the tube
            sets[f"{key}.tube_volume"] = "0 ml"
    return Candidate(name, tube.bore, sets, facts)


def _notes(trials: Trials, tried: list[Tried], length: float) -> list[str]:
    """What a larger bore costs, and what no run counts."""
    notes = [f"C, b: sonic conductance [{UNIT}] and critical pressure ratio of the tube alone"]
    notes += larger_is_worse(tried, "tube")
    ran = [each for each in tried if each.status == "run"]
    if len(ran) > 1:
        first, last = ran[0], ran[-1]
        unit = words(trials.air).unit
        costs = " and ".join(f"{shown(e.values[trials.air], unit)} with {e.name}" for e in (first, last))
        notes.append(f"{words(trials.air).label.lower()}: {costs}; the tube's own air counts")
    replaced = [
        f"{name}'s {1e6 * now.tube_volume:.3g} ml"
        for name, now in trials.scenario.orthosis.chamber.items()
        if now.tube is None and now.tube_volume > 0.0
    ]
    if replaced:
        notes.append(f"the tube takes the place of tube_volume ({', '.join(replaced)})")
    if ran:
        delay = load("tube", ran[0].name).delay(length)
        notes.append(f"sound takes {1e3 * delay:.1f} ms through the tube, which no run counts")
    return notes
