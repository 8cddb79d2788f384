"""May a run decide a question? Factors of ASME V&V 40, graded by the rules of `models/credibility`."""

import functools
import math
import os
import pathlib
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

from afo_sim.common import InputError, Json, Shown, SimulationError, assets, digest, json_text, shown, unknown
from afo_sim.description import Scenario, load
from afo_sim.lab.ledger import devices
from afo_sim.lab.ledger_predictions import si
from afo_sim.metrics import coverage, decides
from afo_sim.simulation import Progress, Recording, found_step_errors, limits_of
from afo_sim.simulation.run import run

Numbers = dict[str, Json]
_KINDS = ("user", "published", "fitted", "derived", "assumed", "set")  # of numbers; by hand for this run
_MUSCLES = "DCBA"  # grades of muscles, the worst first
_NOTICED = 0.01  # share of a band's width, below which a measurement is not planned [-]


@dataclass(frozen=True)
class Factor:
    """A factor with its grade and the required one, and the grade of each number that it rests on."""

    name: str  # of ASME V&V 40
    part: str  # of the assessment that it belongs to
    categories: list[int]  # of FDA's evidence, from 1
    grade: int  # 0 to 3
    required: int  # grade by the risk, 0 to 3
    says: str  # what was found, in words
    needs: str  # what a better grade needs
    numbers: dict[str, int]  # grade of each number that it rests on


@dataclass(frozen=True, repr=False)
class Credibility(Shown):
    """Whether a run may decide a question: all but the `recording` is in `to_json()`.

    asked : question, context, metric, influence and consequence
    risk : of the model, by influence and consequence
    answer : the metric with its band, and what the draws decide
    evidence : what stands behind the run
    factors : graded and required
    plan : what to measure next, the most telling first
    comparators : measured numbers of this metric, by device
    recording : the run with its bands
    """

    asked: dict[str, str]
    risk: str
    answer: Numbers
    evidence: Numbers
    factors: tuple[Factor, ...]
    plan: tuple[Numbers, ...]
    comparators: tuple[Numbers, ...]
    recording: Recording

    @property
    def short(self) -> list[Factor]:
        """Factors that fall short, the worst first."""
        below = [each for each in self.factors if each.grade < each.required]
        return sorted(below, key=lambda each: each.grade - each.required)

    @property
    def judgement(self) -> str:
        """Sufficient where no factor falls short and the draws decide the answer; else insufficient."""
        return "insufficient" if self.short or self.answer["answer"] == "undecided" else "sufficient"

    @property
    def because(self) -> list[str]:
        """Reasons: factors that fall short, whether the draws decide, what to measure next."""
        a, below = self.answer, ", ".join(f"{each.name} ({each.grade})" for each in self.short)
        needed = f"grade {self.factors[0].required}, as {self.risk} model risk requires"
        reached = len(self.factors) - len(self.short)
        graded = f"{reached} of {len(self.factors)} factors reach {needed}"
        graded += f"; too low: {below}" if below else ""
        wanted = "" if a["wanted"] is None else f"; target: {a['good']} {a['wanted']:.3g} {a['unit']}"
        band = f"5 to 95 % of {a['draws']} draws: {a['low']:.3g} to {a['high']:.3g} {a['unit']}"
        # no yes or no: the program cannot know how the question is put
        told = f"by the draws, {self.asked['metric'].replace('_', ' ')} is {a['answer']}; {band}{wanted}"
        told += f"; the verdict of the run is {a['status']}"
        found = [graded, told] if below else [told, graded]
        if not self.evidence["worn"]:
            found.append(
                "no measured value of a worn orthosis, nor of this patient, was compared with a prediction"
            )
        return found + [f"measure next: {one['what']}: {one['measure']}" for one in self.plan[:1]]

    def to_json(self) -> Numbers:
        """All of it as plain data, without the run."""
        rules, run = rules_of(), self.recording
        # a digest that is the same on every machine
        described = json_text(run.described).replace(str(assets.folder("models")), "models").encode()
        found = {"scenario": run.described["name"], "scenario_digest": digest(described)} | self.asked
        found |= {"risk": self.risk, "required": rules["required"][self.risk], "judgement": self.judgement}
        found |= {"because": self.because, "short": [each.name for each in self.short]}
        found |= {key: getattr(self, key) for key in ("answer", "plan", "comparators", "evidence")}
        found |= {"factors": [asdict(each) for each in self.factors], "versions": run.versions}
        return found | {"categories": rules["categories"], "sources": rules["sources"]}

    def __repr__(self) -> str:
        return f"<Credibility of {self.recording.described['name']!r}: {self.judgement}>"

    def save(self, folder: str | os.PathLike[str]) -> list[pathlib.Path]:
        """Write credibility.html and credibility.json into a folder: the files."""
        return shown().credibility(self, pathlib.Path(folder))


def credibility(
    scenario: str | os.PathLike[str] | Scenario | Mapping[str, object],
    sets: Mapping[str, object] | None = None,
    *,
    question: str,
    context: str,
    influence: str,
    consequence: str,
    metric: str = "toe_clearance",
    draws: int = 200,
    progress: Progress | None = None,
) -> Credibility:
    """Assess whether a walk may decide a question, after ASME V&V 40-2018 and FDA's guidance of 2023.

    Parameters
    ----------
    scenario : a shipped name, a path, a dict or a Scenario, of walking
    sets : dotted keys and values laid over it
    question : the decision to be made, in your words
    context : of use: how the run is used beside other evidence, in your words
    influence, consequence : of the run on the decision, and of a wrong decision: "low", "medium" or "high"
    metric : the answer: toe_clearance, foot_pitch_at_contact, torque_against_push_off_per_mass,
        work_against_push_off or air_per_stride
    draws : of the uncertain inputs, at least 20
    progress : called with (steps or draws done, in all)

    Returns
    -------
    Credibility: `judgement`, "sufficient" or "insufficient"; `answer` with its band; `factors` with `grade`
    and `required` [0 to 3]; `plan`, what to measure; `recording`; `to_json()`; `save(folder)` writes a page

    Raises
    ------
    InputError
        Nobody walks, a metric or level does not exist, a text is empty, or the description is wrong.
    SimulationError
        The walk stopped early.

    Examples
    --------
    >>> found = credibility("walk-dropfoot-afo", {"duration": "4 s"}, question="Does it lift the toe?",
    ...                     context="a choice between two springs", influence="low", consequence="low",
    ...                     draws=20)
    >>> found.judgement, found.risk, len(found.factors)
    ('insufficient', 'low', 13)
    """
    asked = {"question": question, "context": context, "metric": metric}
    asked |= {"influence": influence, "consequence": consequence}
    choices = rules_of() | dict.fromkeys(("influence", "consequence"), rules_of()["required"])
    for field, given in asked.items():
        if field in choices and given not in choices[field]:
            raise unknown(given, choices[field], field=field)
        if not given.strip():
            raise InputError("is empty", field=field, allowed="a sentence in your own words")
    description = load("scenario", scenario, sets)
    if not description.walking:
        problem = "this scenario does not walk, and only walks are assessed"
        allowed = "a scenario with a gait: `afo-sim list scenarios`"
        raise InputError(problem, field="scenario", value=description.name, allowed=allowed)
    if not draws:
        problem = "needs draws for a band"
        raise InputError(problem, field="draws", value=draws, allowed="20 or more")
    recording = run(description, uncertainty=draws, progress=progress, step="controlled")
    if not recording.ok:
        raise SimulationError(recording.status)
    return assess(recording, asked)


def assess(recording: Recording, asked: dict[str, str]) -> Credibility:
    """A run with bands, assessed."""
    metric, study = asked["metric"], recording.studies["uncertainty"]
    risk = rules_of()["risk"][asked["influence"]][asked["consequence"]]
    answer = _answer(recording, metric)
    comparators = tuple(  # what the ledger has of this very number
        {"device": of.device, "quantity": each.quantity, "measured": each.value, "error": each.error}
        | {"source": of.source, "given": len(of.given), "drawn": len(of.unknown)}
        for of in devices().values()
        for each in of.measured
        if each.at.get("metric") == metric
    )
    evidence = _evidence(recording, metric, answer, comparators) | _inputs(recording.described)
    factors = graded(evidence, rules_of()["required"][risk])
    plan = _plan(study, metric, evidence, factors, answer["status"])
    return Credibility(asked, risk, answer, evidence, factors, plan, comparators, recording)


def graded(evidence: Numbers, required: int) -> tuple[Factor, ...]:
    """The factors, each graded by the worst of its rules."""
    said = {name: f"{x:.3g}" if isinstance(x, float) else x for name, x in evidence.items()}
    said |= {name: "not known" for name, x in evidence.items() if x is None}
    found = []
    for told in rules_of()["factor"]:
        rules = [rule for rule in told["rules"] if rule["number"] in evidence]
        grades = {rule["number"]: _grade(rule, evidence[rule["number"]]) for rule in rules}
        says = "; ".join(rule["says"].format_map(said) for rule in rules)
        names, worst = (told["name"], told["part"], told["categories"]), min(grades.values(), default=0)
        found.append(Factor(*names, worst, required, says, told["needs"], grades))
    return tuple(found)


def _grade(rule: Numbers, value: float | None) -> int:
    if value is None:
        return 0
    steps = [[value >= x for x in rule.get("at_least", ())], [value <= x for x in rule.get("at_most", ())]]
    return min(sum(step) for step in steps if step)


def _answer(recording: Recording, metric: str) -> Numbers:
    """The number with band and limits, and whether the draws decide: good, bad or undecided."""
    rule, study = rules_of()["metric"][metric], recording.studies["uncertainty"]
    if metric not in study["metrics"]:
        there = ", ".join(name for name in rules_of()["metric"] if name in study["metrics"])
        raise InputError("this walk has no such metric", field="metric", value=metric, allowed=there)
    band, of = study["metrics"][metric], next(o for o in recording.verdict if o.name == rule["answer"])
    limits = getattr(limits_of(recording), rule["limit"], None)
    wanted, bad = (None, None) if limits is None else (rule["times"] * limit for limit in limits)
    (low, median, high), above = band["quantiles"], rule["good"] == "above"
    tried = of.status == "good" and of.kept is not None
    reached = tried and (wanted is None or (low >= wanted if above else high <= wanted))
    missed = of.status == "bad" and bad is not None and (high < bad if above else low > bad)
    answer = "good" if reached else "bad" if missed else "undecided"
    found: Numbers = {"answer": answer, "value": band["own"]}
    found |= {"unit": band["unit"], "low": low, "median": median, "high": high, "good": rule["good"]}
    found |= {"wanted": wanted, "bad": bad, "status": of.status, "kept": of.kept}
    found |= {"draws": study["draws"] - study["failed"]["count"], "asked": of.question, "text": of.text}
    return found | ({"wrong": study["wrong"]} if metric == "toe_clearance" and "wrong" in study else {})


def _evidence(recording: Recording, metric: str, answer: Numbers, others: Sequence[Numbers]) -> Numbers:
    """What rules and sentences take of run and ledger; None is not known, what cannot be is left out."""
    study, metrics = recording.studies["uncertainty"], recording.metrics
    errors, counted = found_step_errors(recording), rules_of()["metric"][metric]["counted"]
    own, known = errors.get(metric), coverage(counted)
    found = _tests() | {"version": recording.versions["afo-sim"], "unit": answer["unit"]}
    shares = ("energy_error", "law_mismatch_share")
    found |= {name: abs(metrics[name].value) for name in shares if name in metrics}
    found |= {"step_error": own and own.error, "step_error_times": own and own.times}
    found["step_ms"] = 1e3 * recording.studies["time_step"]["step"]
    found["metrics_beyond_step"] = sum(each.times > 1.0 for name, each in errors.items() if name != metric)
    changes = rules_of()["change"].items()
    parts = [abs(metrics[name].value) / most for name, most in changes if name in metrics]
    found |= {"stride_change_times": max(parts, default=None), "warnings": len(recording.warnings)}
    found["draws_failed_share"] = study["failed"]["count"] / study["draws"]
    found["warnings_that_decide"] = sum(map(decides, recording.warnings))
    left, scale = study.get("rest", {}).get(counted), abs(answer["wanted"] or answer["median"])
    found |= {"draws": answer["draws"], "explained": None if left is None else 1.0 - left}
    found["band_by_limit"] = (answer["high"] - answer["low"]) / scale if scale else None
    found |= {name: getattr(known, name, 0) for name in ("values", "inside", "benches", "worn")}
    found["inside_share"] = found["inside"] / found["values"] if found["values"] else None
    drawn, given = (sum(each[key] for each in others) for key in ("drawn", "given"))
    found |= {"same_values": len(others), "drawn_inputs": drawn / (drawn + given) if drawn else None}
    if others:
        largest = max(si(each["measured"]) for each in others) / si(f"1 {answer['unit']}")
        found["times_measured"] = max(-answer["low"], answer["high"]) / largest
    found["draws_rejected"] = study["rejected"]
    if answer["wanted"] is None:
        return found | {"limit_kept": 0}
    # limits of the number and of trips are at least as strict as the usual ones
    rule, run_by, usual = rules_of()["metric"][metric], limits_of(recording), load("limits", "usual")
    sides = {rule["limit"]: 1.0 if rule["good"] == "above" else -1.0, "drawn_trips": -1.0}
    limits = [(side, getattr(run_by, name), getattr(usual, name)) for name, side in sides.items()]
    kept = all(side * x >= side * y for side, *two in limits for x, y in zip(*two, strict=True))
    return found | {"limit_kept": int(kept)}


def _inputs(scenario: Numbers) -> Numbers:
    """Kinds of a scenario's numbers, grades and fits of its muscles, its tissue beside the usual."""
    kinds = _kinds({key: part for key, part in scenario.items() if key != "limits"})  # of the verdict
    kinds["set"] = sum(part.startswith("set ") for part in scenario["description"].split("; "))
    found: Numbers = {f"numbers_{kind}": kinds[kind] for kind in _KINDS} | {"numbers": kinds.total()}
    found["unsourced_share"] = (kinds["assumed"] + kinds["set"]) / max(kinds.total(), 1)
    gait = scenario["gait"]
    shipped = (assets.folder("gait_data") / f"{gait['cycle']}.csv").is_file()
    found["own_walk"] = int(gait.get("walker") == "patient" and not shipped)
    found["friction"] = si(scenario["leg"].get("friction") or "0 N*m")
    muscles = [group["type"] for group in scenario["orthosis"].get("muscle", {}).values()]
    if muscles:
        found["muscle_grade"] = worst = min(_MUSCLES.index(muscle["grade"]) for muscle in muscles)
        found |= {"muscle_letter": _MUSCLES[worst], "muscles": len(muscles)}
        found["muscles_with_covariance"] = sum(bool(muscle.get("covariance")) for muscle in muscles)
        found["laws_known"] = min(len(muscle.get("laws", {})) for muscle in muscles)
    patient = scenario.get("patient") or {}
    tissue = (scenario["leg"].get("passive") or {}).get("scale", 1.0)
    tissue *= patient.get("stiffness", 1.0) * patient.get("passive_scale", 1.0)
    return found | {"tissue": tissue}


def _kinds(node: Mapping[str, Json]) -> Counter[str]:
    """How many numbers of a table, and of those below, are of which kind; of laws that which is in use."""
    sources = (node.get("provenance") or {}).values()
    found = Counter("set" if told["source"] == "set for this run" else told["kind"] for told in sources)
    for key, below in node.items():
        if isinstance(below, Mapping) and key != "provenance":
            used = {"laws": "law", "frictions": "friction"}.get(key)
            found += _kinds(below if used is None else below.get(node.get(used), {}))
    return found


def _plan(
    study: Numbers, metric: str, evidence: Numbers, factors: Sequence[Factor], status: str
) -> tuple[Numbers, ...]:
    """What to measure: a comparison first, where the comparator falls short; then what narrows the band."""
    ranked, counted = [], rules_of()["metric"][metric]["counted"]
    for group in study["groups"]:
        share, gain = group["explained"].get(counted, 0.0), 0.0
        left = group.get("band_left", {}).get(counted, math.sqrt(1.0 - min(max(share, 0.0), 1.0)))
        told = {"what": group["name"].replace("_", " "), "measure": group["measure"]}
        told |= {"explained": share, "band_left": left}
        if metric == "toe_clearance" and "wrong" in study and "wrong_left" in group:
            gain, told["wrong_left"] = study["wrong"] - group["wrong_left"], group["wrong_left"]
        if group["measure"] and 1.0 - left >= _NOTICED:
            ranked.append((-gain if gain > group.get("wrong_left_error", 0.0) else 0.0, left, told))
    found = [told for *_, told in sorted(ranked, key=lambda each: each[:2])]
    if status == "unknown":
        more = "nothing yet: there are too few draws; repeat with --draws 1000"
        found.insert(0, {"what": "more draws", "measure": more})
    if any(each.grade < each.required for each in factors if each.part == "validation: comparator"):
        measure = f"record the wearer with the device and compare {metric.replace('_', ' ')}"
        seen = {name: evidence[name] for name in ("values", "worn")}
        found.insert(0, {"what": "comparison", "measure": measure} | seen)
    return tuple(found)


@functools.cache
def _tests() -> Numbers:
    root = pathlib.Path(__file__).parents[2]  # of a checkout
    files = [*(root / "tests").rglob("test_*.py")] if (root / "models").is_dir() else []
    counts = [(f.parent.name, len(re.findall(r"\n *def test_", f.read_text("utf-8")))) for f in files]
    laws = sum(count for folder, count in counts if folder == "laws_of_nature")
    return {"test_files": len(files), "test_functions": sum(n for _, n in counts), "law_tests": laws}


@functools.cache
def rules_of() -> Numbers:
    """Factors, rules, risk and sources, as `models/credibility` states them."""
    return assets.read_toml(assets.folder("models") / "credibility" / "rules.toml")
