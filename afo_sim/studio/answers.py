"""What a page shows of a design: the settled stride at once, then the whole run with its verdict."""

import math
import pathlib
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass

import numpy as np

from afo_sim.common import InputError, Json, JsonDict, JsonMapping, SimulationError
from afo_sim.description import Limits, Scenario, unchanged
from afo_sim.gait import norm
from afo_sim.metrics import closing, passes, words
from afo_sim.metrics.strides import strides
from afo_sim.model import Built, muscle_names, person_of, persons_stride, two_strides, why_walked
from afo_sim.model import supply_and_timer as inputs
from afo_sim.model.build import build
from afo_sim.show import bands, effects, headed, kept_in_mind, whom, write_report
from afo_sim.show import verdict_texts as verdict
from afo_sim.show.moving_parts import Mountings
from afo_sim.show.walking_figure import COLUMNS as POSED
from afo_sim.show.walking_figure import Limbs, wrapped_paths
from afo_sim.simulation import Asked, Recording, limits_of, reference_of, run_at_step
from afo_sim.simulation.examine import examine
from afo_sim.simulation.settle import settle
from afo_sim.studio.controls import controls, idle, shown, values
from afo_sim.studio.design import Design
from afo_sim.studio.engine import compared
from afo_sim.study import UNCERTAINTY, with_studies
from afo_sim.study.search.best import best_design
from afo_sim.study.search.plan import search_of
from afo_sim.study.search.runner import optimise

PHASES = np.linspace(0.0, 1.0, 101)
FRAMES = np.linspace(0.0, 1.0, 51)  # of the walking figure
_CURVES = {  # name on the page: column, factor to the unit that is shown
    "ankle": ("ankle/angle", 180.0 / np.pi),
    "recorded": ("gait/ankle_angle", 180.0 / np.pi),
    "toe": ("toe/height_without_floor", 1e3),
    "torque": ("ankle/moment/orthosis", 1.0),
}
_DECISIVE = (  # metrics that designs are compared by
    "toe_clearance",
    "air_per_stride",
    "strides_per_bottle",
    "cuff_skin_pressure",
    "plate_skin_pressure",
    "orthosis_peak_dorsiflexion_torque",
)
_ENDS = {"low": 0, "high": 2}  # of a band, in quantiles of 5, 50 and 95 %
Report = Callable[..., None]


@dataclass(frozen=True, eq=False)
class Settled:
    """The settled stride of a scenario, as its run ends with it."""

    scenario: Scenario
    built: Built
    columns: Mapping[str, np.ndarray]
    clearance: float

    @classmethod
    def of(cls, scenario: Scenario) -> "Settled":
        """Solve for it, and for no first strides and no reference."""
        built = build(two_strides(scenario))
        rollout = settle([built], [inputs.controls(built)], mode=scenario.callback)[0].rollout
        if rollout.failure is not None:
            raise SimulationError(str(rollout.failure))
        asked = Asked(frozenset({"toe_clearance"}), doubts=False)
        columns, found = examine(built, rollout, solved=True, asked=asked)
        clearance = found.totals.get("toe_clearance")
        return cls(scenario, built, columns, math.nan if clearance is None else clearance.value)

    def message(self) -> JsonDict:
        """Curves and clearance for a page, and the walker over FRAMES [m], by the names in `Pose`."""
        step = float(np.diff(self.columns["time"][:2])[0])
        stride = strides(self.columns, step, self.built.body_mass)[-1]
        curves = {
            name: _rounded(factor * stride.at(column, PHASES))
            for name, (column, factor) in _CURVES.items()
            if column in self.columns
        }
        chambers = self.scenario.orthosis.chamber
        pressures = {c: _rounded(1e-5 * stride.at(f"chamber/{c}/pressure", PHASES)) for c in chambers}
        foot = self.built.foot
        assert foot is not None
        limbs = Limbs(persons_stride(self.scenario), person_of(self.scenario).body_height, foot)
        x, z, shank, angle = (stride.at(name, FRAMES) for name in POSED)
        bent = "toe/extension" in self.columns
        ankle = np.stack([x, z], axis=-1)
        sole = limbs.sole(ankle, angle - shank, stride.at("toe/extension", FRAMES) if bent else 0.0)
        model = self.built.full_model
        mountings = Mountings(model, muscle_names(self.scenario.orthosis), self.columns)
        paths = [
            wrapped_paths(model, mountings, lambda name, phase=phase: float(stride.at(name, phase)), place)  # type: ignore[misc]  # `phase` is no argument
            for phase, place in zip(FRAMES, ankle, strict=True)
        ]
        poses: JsonDict = {
            **limbs.points(ankle, shank, FRAMES),
            "ankle": ankle,
            "sole": sole,
            "muscles": [list(path) for path in zip(*paths, strict=True)],
        }
        return {
            "curves": curves | {"pressure": pressures},
            "toe_off": stride.toe_off,
            "stride_time": stride.duration,
            "clearance": None if math.isnan(self.clearance) else self.clearance,
            "lowest": "not known" if math.isnan(self.clearance) else passes(self.clearance),
            "poses": {name: _rounded(points, 4) for name, points in poses.items()},
        }


def _rounded(values: Json, digits: int = 3) -> Json:
    """Plain numbers; points of paths may differ in number from frame to frame."""
    if isinstance(values, list):
        return [_rounded(each, digits) for each in values]
    return (np.round(np.where(np.isfinite(values), values, 0.0), digits) + 0.0).tolist()  # no "-0"


class Answers:
    """The messages of each stage; references are walked once for each patient and gait."""

    def __init__(self, folder: pathlib.Path) -> None:
        self.folder = folder  # for files of this session
        self._references: dict[str, JsonDict] = {}
        self._run: tuple[Design, Recording] | None = None

    def settled(self, design: Design) -> JsonDict:
        """The settled stride: curves, poses, clearance; a sentence where strides do not repeat."""
        if why := why_walked(design.scenario):
            return {"kind": "unsettled", "text": f"The strides do not repeat ({why}): the last one is shown."}
        return {"kind": "settled", **Settled.of(design.scenario).message()}

    def state(self, design: Design) -> JsonDict:
        """Controls, anchors and timing, with the norm's band."""
        band = {end: _rounded(np.degrees(norm.read().at(f"ankle_{end}", PHASES))) for end in ("low", "high")}
        scenario = design.scenario
        switched, table = scenario.timer or scenario.phases, "timer" if scenario.timer else "phases"
        anchors = {  # ends from the ankle, with the foot flat [mm]
            f"{name} {end}": {"key": f"orthosis.muscle.{name}.{end}.from_joint"}
            | {axis: round(1e3 * anchor.from_joint[k], 2) for axis, k in (("x", 0), ("z", 2))}
            for name, group in scenario.orthosis.muscle.items()
            for end, anchor in (("origin", group.origin), ("insertion", group.insertion))
            if anchor is not None
        }
        return {
            "kind": "state",
            "title": unchanged(scenario.description)[0] or scenario.name,
            "controls": controls(design),
            "idle": idle(design),
            "anchors": anchors,
            "period": scenario.timer.period if scenario.timer else None,  # None: of gait phase
            "timing": {  # of each chamber the intervals in which its valves have current
                f"{table}.{name}.{side}": [list(interval) for interval in getattr(times, side)]
                for name, times in (switched.chambers.items() if switched else ())
                for side in ("inlet", "outlet")
            },
            "values": values(design),
            "norm": band,
            "clearance": words("toe_clearance").meaning,
        }

    def reference(self, design: Design) -> Iterator[JsonDict]:
        """The walk that the design is compared with; none where it names none."""
        other = reference_of(design.scenario) if design.scenario.reference else None
        if other is None or why_walked(other):
            return
        key = other.model_dump_json(exclude={"name", "description", "limits", "supply"})
        if key not in self._references:
            self._references = {key: Settled.of(other).message()}
        yield {"kind": "reference", "compared_with": design.scenario.reference, **self._references[key]}

    def run(self, design: Design, report: Report) -> Iterator[JsonDict]:
        """The whole run, from the first stride on, with its verdict; curves where strides do not repeat."""
        recording = run_at_step(design.scenario, halvings=0, report=report)
        if not recording.ok:
            raise SimulationError(recording.status.removeprefix("failed: "))
        self._run = design, recording
        if why_walked(design.scenario):
            clearance = recording.metrics["toe_clearance"].value
            walked = Settled(design.scenario, build(design.scenario), recording.columns, clearance)
            yield {"kind": "settled", **walked.message()}
        answers = [
            asdict(answer) | {"mark": verdict.badge(answer), "limit": verdict.limit(recording, answer)}
            for answer in recording.verdict
        ]
        found = {name: recording.metrics[name] for name in _DECISIVE if name in recording.metrics}
        results = [(words(name).label, str(value).replace("*", "·"), "") for name, value in found.items()]
        yield {
            "kind": "run",
            "lead": verdict.lead(recording),
            "verdict": answers,
            "whom": whom(recording.described),
            "notes": kept_in_mind(recording),
            "warnings": [headed(warning) for warning in recording.warnings],
            "device": closing(recording.verdict, recording.metrics),
            "results": results + [(one["question"], one["mark"], one["status"]) for one in answers],
        }

    def variant(self, slot: str, design: Design, report: Report) -> Iterator[JsonDict]:
        """What a kept design is compared by; the run of the present design stays what it is."""
        present, told = self._run, {"state": self.state(design)}
        try:
            told |= {each["kind"]: each for each in (self.settled(design), *self.run(design, report))}
        except (InputError, SimulationError) as error:
            told["problem"] = {"text": str(error)}
        finally:
            self._run = present
        yield compared(slot, told) | {"design": design}

    def effects(self, design: Design, report: Report) -> JsonDict:
        """What to change first, each step with the values that try it."""
        recording = with_studies(
            self._recording(design, report), design.scenario, effects=True, report=report
        )
        found = effects.effects_of(recording)
        helping = [] if found is None else zip(found.helping, effects.sentences(found, 3), strict=False)
        steps = [{"text": text, "sets": effect.sets} for effect, text in helping]
        return {"kind": "effects", "lines": effects.lines(recording)[:1], "steps": steps}

    def further(self, design: Design, what: str, options: JsonMapping, report: Report) -> Iterator[JsonDict]:
        """What is made on demand: "bands", "report" or "search" (the lowest objective within the limits)."""
        recording = self._recording(design, report)
        if what == "search":
            yield self._search(design, limits_of(recording), options, report)
        if what == "bands":
            told = with_studies(recording, design.scenario, draws=200, report=report)
            drawn = told.studies[UNCERTAINTY]["curves"]
            curves = {
                name: {end: _rounded(factor * np.array(drawn[column][k])) for end, k in _ENDS.items()}
                for name, (column, factor) in _CURVES.items()
                if name in ("ankle", "toe") and column in drawn
            }
            yield {"kind": "bands", "lines": bands.lines(told), "curves": curves}
        if what == "report":
            told = with_studies(recording, design.scenario, effects=True, report=report)
            told.save(self.folder / "run", rrd=False)
            write_report([self.folder / "run"], self.folder / "report.html")
            yield {"kind": "report", "file": "report.html"}

    def _search(self, design: Design, limits: Limits, options: JsonMapping, report: Report) -> JsonDict:
        """The design with the lowest objective within the limits of the verdict."""
        scenario, metric = design.scenario, str(options.get("objective", "air_per_stride"))
        kept = [
            f"toe_clearance >= {1e3 * limits.toe_clearance[0]:g} mm",
            f"torque_against_push_off_per_mass <= {limits.torque_against_push_off[1]:g} N*m/kg",
        ]
        plan = search_of(scenario, options["over"], lowest=metric, limits=kept, generations=9, starts=1)
        with tempfile.TemporaryDirectory(dir=self.folder) as folder:
            found = best_design(plan, optimise(plan, pathlib.Path(folder), threads=1, report=report))
        kept_all = "all limits are kept" if found.feasible else "no design was found that keeps all limits"
        numbers = ", ".join(f"{words(name).label} {value}" for name, value in found.metrics.items())
        return {
            "kind": "found",
            "text": f"{numbers[:1].upper()}{numbers[1:]}; {kept_all}",
            "sets": {k: shown(k, v) for k, v in found.summary["sets"].items()},
        }

    def _recording(self, design: Design, report: Report) -> Recording:
        if self._run is None or self._run[0] != design:
            list(self.run(design, report))
        assert self._run is not None
        return self._run[1]
