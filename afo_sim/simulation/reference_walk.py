"""The walk that a walk is compared with: the same patient and gait, with something else worn.

What a device lifts depends on what it is compared with. A shoe alone changes the clearance, and an orthosis
is worn with a sole.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import cast

from afo_sim.common import InputError, Keywords, Notice
from afo_sim.description import USUAL_LIMITS, Scenario, load
from afo_sim.description.scenario_text import reference as in_words
from afo_sim.metrics import (
    AGAINST,
    COMPARED,
    LESS,
    TOUCHES,
    Metric,
    Metrics,
    by_laws_metrics,
    filled_once_metrics,
    reference_metrics,
    uncompensated_metrics,
)
from afo_sim.model import UNDRIVEN, two_strides, walker_of, why_walked
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.simulation.examine import Asked, examine
from afo_sim.simulation.recording import Later, Recording
from afo_sim.simulation.rollout import Rollout
from afo_sim.simulation.settle import settle
from afo_sim.simulation.simulate import simulate

OPEN = {"inlet": (), "outlet": ((0.0, 1.0),)}  # a chamber that never gets air
ASKED = Asked(frozenset({COMPARED, TOUCHES}), doubts=False)
FILLED = Asked(frozenset({COMPARED, LESS, TOUCHES, *AGAINST}), doubts=False)
COARSE = 4e-3  # step at which a settled clearance is good to 0.1 mm, peak torque to 0.03 % [s]
FILLINGS = (0.2, 0.4, 0.6, 0.8, 1.0)  # of the pressures that supply, muscles and laws allow, tried first
HALVINGS = 5  # between the last that does not clear and the first that does


def reference_of(scenario: Scenario) -> Scenario:
    """The scenario that a scenario's run is compared with: its patient and gait, wearing its `reference`."""
    kind, gait, orthosis = scenario.reference, scenario.gait, scenario.orthosis
    if kind is None or gait is None:
        allowed = '"barefoot", "shoe" or "orthosis-off", where somebody walks'
        raise InputError("names nothing to compare with", field="reference", allowed=allowed)
    if kind == "shoe" and scenario.shoe is None:
        problem = "compares with a shoe, and the scenario has none"
        raise InputError(problem, field="reference", value=kind, allowed="a shoe, such as shoe=trainer")
    if kind == "orthosis-off" and not orthosis.muscle:
        problem = "compares with an orthosis without air, and none is worn"
        raise InputError(problem, field="reference", value=kind, allowed="barefoot, shoe")
    changed: Keywords = {
        **UNDRIVEN,
        "name": f"{scenario.name} reference".strip(),
        "gait": gait.model_copy(update={"settled": "solved"}),
    }
    if kind == "orthosis-off":
        changed["phases"] = dict.fromkeys(orthosis.chamber, OPEN)
    else:
        changed["orthosis"] = load("orthosis", "none")
    if kind == "barefoot":
        changed["shoe"] = None
    return scenario.with_values(**changed)


@dataclass(frozen=True)
class Reference:
    """A walked reference: its metrics, or the reason for which there are none."""

    metrics: dict[str, Metric]
    failure: str = ""


def walk_reference(scenario: Scenario) -> Reference:
    """Walk a scenario's reference: its settled stride alone, or the whole run where none repeats."""
    return _tried(reference_of(scenario), {})  # a lighter foot may need a shorter step on its floor


def _tried(scenario: Scenario, changed: Mapping[str, object], asked: Asked = ASKED) -> Reference:
    """The settled stride of a changed scenario, the whole run where none repeats; or its refusal."""
    try:
        scenario = scenario.with_values(**changed)
        solved = not why_walked(scenario)
        built = build(two_strides(scenario) if solved else scenario)
        control = schedule.controls(built)
        rollout: Rollout
        if solved:
            rollout = settle([built], [control], mode=scenario.callback)[0].rollout
        else:
            rollout = simulate(built, control)
        if rollout.failure is not None:
            return Reference({}, str(rollout.failure))
        return Reference(examine(built, rollout, transient=False, solved=solved, asked=asked)[1].totals)
    except InputError as error:
        return Reference({}, str(error))


@dataclass
class References:
    """Walked references, each once: cases of a sweep often have the same."""

    known: dict[str, Reference] = field(default_factory=dict)

    def of(self, scenario: Scenario) -> Reference:
        """The reference of a scenario."""
        reference = reference_of(scenario)
        without_air = set() if reference.orthosis.chamber else {"supply"}
        key = reference.model_dump_json(exclude={"name", "description", "limits"} | without_air)
        if key not in self.known:
            self.known[key] = walk_reference(scenario)
        return self.known[key]


def not_compared(scenario: Scenario, reference: Reference) -> tuple[Notice, ...]:
    """A warning where a scenario's reference could not be walked."""
    who = in_words({"reference": scenario.reference, "shoe": {"name": scenario.shoe and scenario.shoe.name}})
    if not reference.failure:
        return ()
    return (Notice("not-compared", "not compared with {who}: {why}", who=who, why=reference.failure),)


def filled_once(scenario: Scenario, lifting: Collection[str]) -> dict[str, Metric]:
    """The walk whose lifting chambers are filled before the first step, then shut, at the best pressure."""
    # Nothing leaks. The best is the lowest pressure that clears what is wanted, since torque against push-off
    # rises with it; where none does, the one that clears most.
    shut = {"inlet": (), "outlet": ()}
    gait = scenario.gait
    assert gait is not None
    wanted = (scenario.limits or load("limits", USUAL_LIMITS)).toe_clearance[0]
    changed = {
        **UNDRIVEN,
        "timestep": max(scenario.timestep, COARSE),
        "record_rate": None,
        "gait": gait.model_copy(update={"settled": "solved"}),
        "phases": {name: shut if name in lifting else OPEN for name in scenario.orthosis.chamber},
    }
    types = [g.type for name, g in scenario.orthosis.muscle.items() if (g.chamber or name) in lifting]
    low = max(muscle.law_set.pressure_range[0] for muscle in types)
    tops = [min(muscle.limits.pressure, muscle.law_set.pressure_range[1]) for muscle in types]
    high = min(scenario.supply.pressure, *tops)
    found: dict[float, dict[str, Metric]] = {}

    def clears(pressure: float) -> bool:
        start = {name: {"pressure": f"{pressure!r} Pa"} for name in lifting}
        walk = _tried(scenario, changed | {"start": start}, FILLED).metrics
        if COMPARED in walk:
            found[pressure] = {**walk, "pressure": Metric(1e-5 * pressure, "bar")}
        return COMPARED in walk and 1e-3 * float(walk[COMPARED]) >= wanted

    below, above = low, None
    for pressure in (low + share * (high - low) for share in FILLINGS if high > low):
        if clears(pressure):
            above = pressure
            break
        below = pressure
    for _ in range(HALVINGS if above else 0):
        middle = 0.5 * (below + above)  # type: ignore[operator]  # known in this loop
        below, above = (below, middle) if clears(middle) else (middle, above)
    best = above or max(found, key=lambda pressure: float(found[pressure][COMPARED]), default=None)
    return filled_once_metrics(found[best]) if best else {}


def by_other_laws(scenario: Scenario) -> dict[str, Metric]:
    """The lowest clearance by any other law that the muscles' files hold; none where they hold one."""
    groups, heights = scenario.orthosis.muscle, []
    for law in sorted({law for group in groups.values() for law in group.type.laws}):
        other = {
            name: group.model_copy(update={"type": group.type.using(law=law)})
            for name, group in groups.items()
            if law in group.type.laws and law != group.type.law
        }
        if other:
            orthosis = scenario.orthosis.model_copy(update={"muscle": {**groups, **other}})
            found = _tried(scenario, {"orthosis": orthosis}).metrics
            heights += [float(found[COMPARED])] if COMPARED in found else []
    return by_laws_metrics(min(heights)) if heights else {}


def compared(recording: Recording, scenario: Scenario) -> Recording:
    """A recording with its distance from the scenario's reference, and with what the toe clears if nothing
    makes up for the foot; what that takes is walked when it is read."""
    if not recording.ok:
        return recording
    own, beside = cast(Metrics, recording.metrics), Later(lambda: _beside(recording, scenario))
    return recording.changed(
        metrics=Metrics(own.known, own.whole, lambda: beside()[0]),
        warnings=Later(lambda: (*recording.warnings, *beside()[1])),
    )


def _beside(recording: Recording, scenario: Scenario) -> tuple[dict[str, Metric], tuple[Notice, ...]]:
    """What the walks say that a recording is compared with."""
    found: dict[str, Metric] = {}
    warned: tuple[Notice, ...] = ()
    if scenario.reference is not None:
        reference = walk_reference(scenario)
        found = reference_metrics(recording.metrics, reference.metrics)
        warned = not_compared(scenario, reference)
    gait, judged = scenario.gait, scenario
    if gait is not None and gait.compensation == "kept" and walker_of(scenario) == "patient":
        # the recorded sole goes with the recorded path
        removed = gait.model_copy(update={"compensation": "removed", "sole_thickness": None})
        judged = scenario.with_values(gait=removed)
        worn = _tried(judged, {}, FILLED)
        bare = Reference({}) if scenario.reference is None else _tried(reference_of(judged), {})
        found |= uncompensated_metrics(bare.metrics, worn.metrics)
        if failed := bare.failure or worn.failure:
            text = "toe clearance without compensation is not known: {why}"
            warned = (*warned, Notice("compensation-unknown", text, subject="gait.compensation", why=failed))
    if "reference_toe_clearance" in found:
        found |= by_other_laws(scenario)
        groups = scenario.orthosis.muscle
        arms = {name: float(recording[f"muscle/{name}_1/moment_arm"].mean()) for name in groups}
        if lifting := {group.chamber or name for name, group in groups.items() if arms[name] > 0.0}:
            found |= filled_once(judged, lifting)
    return found, warned
