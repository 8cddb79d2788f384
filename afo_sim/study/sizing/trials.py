"""What is to be sized, and runs of its candidates side by side, as the cases of a sweep are run."""

import dataclasses
import itertools
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass

from afo_sim.common import InputError, JsonDict, JsonMapping, Keywords, Mixed, with_code
from afo_sim.description import USUAL_LIMITS, Scenario, load
from afo_sim.metrics import LIFT, NEED, is_filling, words
from afo_sim.metrics.validity import CAPS, FORCE
from afo_sim.model import check_air
from afo_sim.physics import AIR
from afo_sim.simulation import Asked, run_scenario
from afo_sim.study.effects import SHARES, beyond_limit
from afo_sim.study.engine import INFEASIBLE, OK, UNSETTLED, Outcome
from afo_sim.study.pool import Pool, Report, pool
from afo_sim.study.sizing import candidates as tries
from afo_sim.study.sizing.candidates import Candidate, bar
from afo_sim.study.sizing.limits import Requirement, shown, usual
from afo_sim.study.sizing.result import ALLOWED, KINDS, VERDICT, Sizing

HOURS, STRIDES = "hours_of_source", "strides_of_source"
_SUPPLY = frozenset({"mean_flow", "peak_flow", "supply_sag", "source_empty_after", "stride_time"})
_SAGS = 2.0  # share of the set pressure from which on a sag is reported [percent]
_FULL = 100.5  # share of a limit from which on it is reported as beyond it [percent]
_HALVINGS = 4  # of the scenario's time step, at most
_STRETCHED = 1.001  # a step is adjusted to a stride by less


@dataclass(frozen=True)
class Request:
    """What is to be sized, checked."""

    kind: str
    scenario: Scenario
    requirements: tuple[Requirement, ...]
    chamber: str
    options: JsonMapping

    def to_json(self) -> JsonDict:
        """As plain data, by which a folder's content is known again."""
        found = {
            "kind": self.kind,
            "limits": [str(each) for each in self.requirements],
            "chamber": self.chamber,
            "options": dict(self.options),
            "scenario": self.scenario.resolved(),
        }
        return dict(json.loads(json.dumps(found)))

    def run(self, threads: int = 0, report: Report | None = None) -> Sizing:
        """Run what it takes."""
        scenario = at_cadence(self.scenario, self.options.get("cadence"))
        with pool(threads) as who:
            found: Sizing = getattr(Trials(self, scenario, who, report), self.kind)()
        return found


def at_cadence(scenario: Scenario, cadence: float | None) -> Scenario:
    """A scenario at another cadence [steps/min]; the gait's curves go with the stride."""
    if cadence is None:
        return scenario
    if scenario.gait is None:
        raise InputError("is of walking", field="cadence", value=cadence, allowed="none for a fixed shank")
    if scenario.gait.speed is not None:
        problem = "stands beside the scenario's gait.speed, which states the cadence"
        raise InputError(problem, field="cadence", value=cadence, allowed="gait.speed alone, with --set")
    return scenario.set({"gait.stride_time": f"{120.0 / cadence:.9g} s"})  # two steps a stride


@dataclass(frozen=True)
class Trials:
    """Runs of candidates side by side, and the answer that they give; a method for each kind."""

    request: Request
    scenario: Scenario
    who: Pool
    report: Report | None

    @property
    def air(self) -> str:
        """The metric of the air that it takes."""
        return "air_per_stride" if self.scenario.walking else "air_per_cycle"

    def pressure(self) -> Sizing:
        """A scan of the allowed range, then every step between two of it where what is met may change."""
        at, between = (self.request.options.get(name) for name in ("at", "between"))
        scan = tries.scanned(self.scenario, between)
        tried = self._confirmed(self._pressures(scan if at is None else sorted({*scan, at})), at)
        inner = [
            p
            for a, b in itertools.pairwise(tried)
            if b.size <= scan[-1] and not (a.meets and b.meets) and not _lacks(a) & _lacks(b)
            for p in tries.steps_between(a.size, b.size)
        ]
        tried += self._pressures(inner, beyond=len(tried))
        tried = self._confirmed(sorted(tried, key=lambda each: each.size))
        first = next((k for k, each in enumerate(tried) if each.meets), None)
        interval = None
        if first is not None:
            interval = (tried[first - 1].size if first else math.nan, tried[first].size)
        asked = next((each for each in tried if each.size == at), None)
        notes = []
        if between and (limit := tries.exceeded(self.scenario, between[1])):
            notes.append(f"above {bar(limit[0])} no pressure was tried: {limit[1]} allowed no more")
        return self._sizing(tried, notes=notes, asked=asked, interval=interval)

    def _pressures(self, pressures: Sequence[float], beyond: int = 0) -> list[Candidate]:
        found = self._run([tries.pressure(p) for p in pressures], beyond)
        for k, each in enumerate(found):
            if limit := tries.exceeded(self.scenario, each.size):
                words = f"beyond what {limit[1]} allowed ({bar(limit[0])})"
                found[k] = dataclasses.replace(each, short={ALLOWED: words, **each.short})
        return found

    def valve(self) -> Sizing:
        """Every valve on one chamber."""
        options = {k: v for k, v in self.request.options.items() if k in ("side", "proportional")}
        tried = self._run(tries.valves(self.scenario, self.request.chamber, **options))
        return self._sizing(tried, part=f"chamber {self.request.chamber}")

    def tube(self) -> Sizing:
        """Every tube at every chamber."""
        length = self.request.options["length"]
        tried = self._run(tries.tubes(self.scenario, length))
        return self._sizing(tried, notes=tries.tube_notes(self.scenario, length))

    def supply(self) -> Sizing:
        """Every source, with how long it lasts."""
        hours, strides = (self.request.options.get(name) for name in ("hours", "strides"))
        if self.scenario.walking and hours is None and strides is None:
            strides = (self.scenario.limits or load("limits", USUAL_LIMITS)).strides_per_bottle[0]
        lasting = [
            (STRIDES, strides, "Strides without a pause", ""),
            (HOURS, hours, "Hours without a pause", "h"),
        ]
        more = tuple(Requirement(name, True, n, *label) for name, n, *label in lasting if n is not None)
        tried = [self._lasting(each, more) for each in self._run(tries.sources(self.scenario), asked=_SUPPLY)]
        return self._sizing(tried, more)

    def _lasting(self, each: Candidate, lasting: tuple[Requirement, ...]) -> Candidate:
        """A source that was run, with how long it lasts, and whether that is long enough."""
        if each.status != "run":
            return each
        source, pressure = load("source", each.name), self.scenario.supply.pressure
        flow, delivery = each.values["mean_flow"], 6e4 * source.delivery(pressure) * AIR.litres_per_gram
        hours = math.nan if math.isnan(flow) else math.inf
        if flow > delivery:  # [kg/s]: a gram's litres are a kilogram's m³
            taken = (flow - delivery) / 6e4 / source.real_gas.litres_per_gram
            hours = source.given_at(pressure, taken) / taken / 3600.0
        values = {**each.values, HOURS: hours, STRIDES: 3600.0 * hours / each.values["stride_time"]}
        short = {r.label: r.shortfall(values[r.metric]) for r in lasting if not r.met(values[r.metric])}
        facts = {**each.facts, "mean": f"{flow:.3g}", "peak": f"{values['peak_flow']:.3g}"}
        notes = list(each.notes)
        if values["supply_sag"] > _SAGS:
            notes.append(f"its pressure sags by {values['supply_sag']:.0f} %")
        if math.isfinite(values["source_empty_after"]):
            notes.append(f"below the set pressure after {shown(values['source_empty_after'], 's')}")
        if source.kind == "compressor":
            kept = "keeps up" if flow <= delivery else "cannot keep up"
            notes.append(f"the compressor {kept}: it delivers {delivery:.3g} l/min at {bar(pressure)}")
        short = {**each.short, **short}
        return dataclasses.replace(each, facts=facts, values=values, short=short, notes=tuple(notes))

    def muscle(self) -> Sizing:
        """Every muscle for one group."""
        group = self.request.options.get("group") or next(iter(self.scenario.orthosis.muscle))
        tried = self._run(tries.muscles(self.scenario, group, self.request.options.get("count")))
        return self._sizing(tried, part=group)

    def _run(
        self, candidates: Sequence[Candidate], beyond: int = 0, asked: frozenset[str] = frozenset()
    ) -> list[Candidate]:
        """Run candidates that are not excluded."""
        tried = [
            dataclasses.replace(each, status="excluded", sets={}) if each.reason else self._fine(each)
            for each in candidates
        ]
        metrics = {self.air, *SHARES, *asked, *(each.metric for each in self.request.requirements)}
        cases = [dict(each.sets) for each in tried if not each.reason]

        def progress(done: int, count: int, doing: str) -> None:
            if self.report is not None:
                self.report(beyond + done, beyond + count, doing)

        wanted, doing = Asked(frozenset(metrics), doubts=False), f"trying a {self.request.kind}"
        outcomes = iter(self.who.in_order(self.scenario, cases, wanted, doing, progress))
        tried = [each if each.reason else self._judged(each, next(outcomes), metrics) for each in tried]
        ran = [each for each in tried if each.status == "run"]
        for requirement in self.request.requirements:
            values = [each.values[requirement.metric] for each in ran]
            if not ran or is_filling(requirement.metric):  # a time to fill may simply not be reached
                continue
            if all(map(math.isnan, values)):
                problem = "is reported by no run of this scenario"
                allowed = "a metric that `afo-sim run --numbers` of it prints"
                raise InputError(problem, field="limit", value=str(requirement), allowed=allowed)
            same = len({*map(repr, values)}) == 1 < len(ran) and not requirement.met(values[0])
            full = values[0] in (0.0, 100.0)  # as a share may be that depends on what is sized
            if (same and not full) or words(requirement.metric).group == NEED:
                problem = f"does not depend on the {self.request.kind}"
                allowed = self._moved(cases[0], cases[-1], requirement.unit)
                raise InputError(problem, field="limit", value=str(requirement), allowed=allowed)
        return tried

    def _moved(self, first: JsonDict, last: JsonDict, unit: str) -> str:
        """Metrics that two candidates differ most in, by a hundredth at least; those of a unit first."""
        every, doing = Asked(doubts=False), "trying the extremes"
        ran = self.who.in_order(self.scenario, [first, last], every, doing, self.report)
        one, other = ({name: float(value) for name, value in each.metrics.items()} for each in ran)
        moved = {name: abs(other.get(name, by) - by) / max(abs(by), 1e-9) for name, by in one.items()}
        named = [name for name, by in moved.items() if by > 0.01 and words(name).group != NEED]
        return ", ".join(sorted(named, key=lambda name: (words(name).unit != unit, -moved[name]))[:8])

    def _fine(self, candidate: Candidate) -> Candidate:
        """The candidate with half the time step, or half of that, where its air is coarse; else as it is."""
        try:
            orthosis = self.scenario.set(candidate.sets).orthosis
        except InputError:  # the case's own trouble, which its run reports
            return candidate
        steps = [self.scenario.timestep / 2**halving for halving in range(_HALVINGS + 1)]
        step = next((s for s in steps if not check_air(orthosis, _STRETCHED * s)[1]), steps[-1])
        if step == steps[0]:
            return candidate
        sets = {**candidate.sets, "timestep": f"{step!r} s"}
        notes = (*candidate.notes, f"run with a time step of {1e3 * step:.3g} ms")
        return dataclasses.replace(candidate, sets=sets, notes=notes)

    def _judged(self, candidate: Candidate, outcome: Outcome, metrics: set[str]) -> Candidate:
        """What an outcome means for its candidate."""
        if outcome.status != OK:
            status: tries.Status = "refused" if outcome.status == INFEASIBLE else "failed"
            return dataclasses.replace(candidate, status=status, reason=outcome.reason)
        values = {name: float(outcome.metrics.get(name, math.nan)) for name in metrics}
        short = {
            each.label: each.shortfall(values[each.metric])
            for each in self.request.requirements
            if not each.met(values[each.metric])
        }
        beyond = {name: beyond_limit(name, values[name]) for name in SHARES if values[name] > _FULL}
        if self.request.kind == "muscle":  # one that leaves its own limits does not do
            own = [name for name in beyond if name.startswith("muscle_")]
            short |= {SHARES[name]: beyond.pop(name) for name in own}
        notes = (*candidate.notes, *beyond.values(), *with_code(outcome.warnings, UNSETTLED))
        return dataclasses.replace(candidate, values=values, short=short, notes=notes)

    def _confirmed(self, tried: Sequence[Candidate], at: float | None = None) -> list[Candidate]:
        """The same, where the smallest that meets all, and the one at a size, do so by their own verdicts."""
        found, sure = [*tried], False
        for k in sorted(range(len(found)), key=lambda k: bool(found[k].doubt)):
            if found[k].meets and found[k].said is None and (not sure or found[k].size == at):
                found[k] = self._by_its_verdict(found[k])
            sure = sure or found[k].meets
        return found

    def _by_its_verdict(self, each: Candidate) -> Candidate:
        """A candidate after a run of its own, whose verdict may doubt that the limits are met."""
        run = run_scenario(self.scenario.set(each.sets))
        told = {answer.name: answer for answer in run.verdict if answer.status != "good"}
        why = [str(w) for w in run.warnings if FORCE in CAPS.get(getattr(w, "code", ""), ("", ()))[1]]
        if LIFT in told and {*usual(self.scenario)} <= {*self.request.requirements}:
            lift = told.pop(LIFT)
            why = [f"{lift.word}, {lift.brief or lift.text}"]
        short = {VERDICT: f"in doubt by its own run: {why[0]}"} if why else {}
        return dataclasses.replace(each, short=short, said={name: a.word for name, a in told.items()})

    def _sizing(
        self,
        tried: Sequence[Candidate],
        more: tuple[Requirement, ...] = (),
        notes: Sequence[str] = (),
        **found: Mixed,
    ) -> Sizing:
        requirements, tried = (*self.request.requirements, *more), self._confirmed(tried)
        told: Keywords = {"air": self.air, "request": self.request.to_json()} | found
        answer = Sizing(self.request.kind, self.scenario.name, requirements, tuple(tried), **told)
        return dataclasses.replace(answer, notes=(*KINDS[self.request.kind].notes, *notes, *answer.worse()))


def _lacks(each: Candidate) -> set[str]:
    return set(each.short) if each.status == "run" else {each.status}
