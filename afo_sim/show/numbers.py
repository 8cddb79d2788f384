"""Metrics as people read them: digits, units, and why a number is undefined."""

import math
from collections.abc import Collection, Iterable, Mapping
from typing import TYPE_CHECKING

from afo_sim.common import InputError, JsonMapping, Keywords, Notice, parse_quantity, with_code
from afo_sim.description import body_height, body_mass, worn
from afo_sim.description.scenario_text import joint_words, own_walk, reference
from afo_sim.metrics import AIR_BEFORE, NAMES, ROUND_OFF, Metric, lift, number

if TYPE_CHECKING:
    from afo_sim.gait import GaitCycle

Metrics = Mapping[str, Metric]  # by name
Strides = Mapping[int, Metrics]  # by the stride's number
_UNDEFINED = {"rise_time": "never rises"}  # why a metric can be no number
# of a sweep's or search's answer, whose numbers do not know of a start
_UNSEEN = (
    "note: these numbers exclude the first strides after a stop, in which the wearer may trip: "
    "add the metrics toe_clearance_stride_1 or lowest_toe_clearance_first_ten"
)
_FILLING = (
    "note: air_per_stride is that of a settled stride and excludes filling the muscles after a stop: "
    "add the metrics air_before_first_step and air_first_stride"
)
_HARM = (
    "note: a device that lifts the toe may resist push-off and press on the skin, which no number here "
    "shows: add the metrics torque_against_push_off_per_mass and cuff_skin_pressure, or read the verdict of "
    "the chosen design"
)
_RESPONDING = "note: experimental. Falls in simulation are no patient's risk: only compare cases"
_CHANGES = (("walked_clearance_change", "mm", "toe clearance"), ("walked_air_change", "%", "air"))
_WHICH_STRIDES = "which-strides"  # code of the note of which strides the numbers are
FIRST = 8  # strides of a run whose toe clearance is listed
# of the recorded walker and the patient, as a share; beyond it both are stated
_SAME_MASS, _SAME_HEIGHT = 0.05, 0.01
_IDEAL = ("chou_hannaford_1996", "tondu_lopez_2000")  # laws of the braid's geometry, without rubber
_BRIEF = {
    "filled-first": "the muscles are filled before the first step",
    "cuff-assumed": "the result depends on the assumed cuff stiffness",
    "ankle-derived": "toe clearance is accurate to about 8 mm",
}
_STILL = 1e-6  # range of motion below which a joint does not move [deg]


def undefined(name: str, metric: Metric) -> str | None:
    """The reason why a metric has no value; None where it has one."""
    if not math.isfinite(metric.value):
        return _UNDEFINED.get(name, "undefined")
    if name == "range_of_motion" and metric.unit == "deg" and abs(metric.value) < _STILL:
        return "does not move"
    return None


def readable(name: str, metric: Metric) -> str:
    """A metric's value with its unit's digits, or a dash with the reason."""
    reason = undefined(name, metric)
    return number(metric.value, metric.unit) if reason is None else f"– ({reason})"


def printed(name: str, metric: Metric) -> str:
    """A metric's value in four digits, round-off as zero, or a dash with the reason."""
    if (reason := undefined(name, metric)) is not None:
        return f"– ({reason})"
    return f"{metric.value:.4g}" if abs(metric.value) >= ROUND_OFF else number(0.0, metric.unit)


def known(metrics: Metrics) -> list[tuple[str, str]]:
    """Each metric that has a value, with its unit."""
    return [(n, f"{printed(n, m)} {m.unit}".rstrip()) for n, m in metrics.items() if not undefined(n, m)]


def in_brief(notes: Iterable[str]) -> str:
    """Notes on one line: some in the short form of their code."""
    return "; ".join(dict.fromkeys(_BRIEF.get(getattr(note, "code", ""), note) for note in notes))


def unseen(scenario: JsonMapping, metrics: Collection[str]) -> list[str]:
    """Notes on what the metrics of a sweep or search leave out: first strides, filling, harm."""
    if any(name.startswith("walkers_") for name in metrics):
        return [_RESPONDING]
    if not scenario.get("gait"):
        return []
    found = [_UNSEEN] if NAMES.isdisjoint(metrics) else []
    if "air_per_stride" in metrics and AIR_BEFORE not in metrics:
        found.append(_FILLING)
    lifts = any(name.startswith(("toe_clearance", "lowest_toe_clearance")) for name in metrics)
    harms = any("push_off" in name or "skin_pressure" in name for name in metrics)
    if lifts and (scenario.get("orthosis") or {}).get("muscle") and not harms:
        found.append(_HARM)
    return found


def cautions(scenario: JsonMapping, metrics: Metrics, strides: Strides) -> list[str]:
    """What a reader of a run's numbers must know: what the lift is compared with, and its `doubts`."""
    lifted = [f"{told}; worn here: {worn(scenario)}" for told in lift(metrics, reference(scenario))]
    return [*lifted, *doubts(scenario, metrics, strides)]


def decisive(scenario: JsonMapping, metrics: Metrics, strides: Strides) -> list[str]:
    """What may change a decision based on the verdict and is not said there."""
    known = doubts(scenario, metrics, strides)
    if "strides_solved" in metrics:
        said = with_code(known, _WHICH_STRIDES)  # the verdict lists each stride
        known = [note for note in known if note not in said]
    return [*known, *of_walker(scenario)]


def of_leg(scenario: JsonMapping) -> list[Notice]:
    """What is mirrored onto the simulated leg, and what an imported leg lacks."""
    side = scenario.get("side") or scenario["leg"].get("side", "right")  # of one older than sides the right
    found: list[Notice] = []
    worn = {"orthosis": "orthosis"} if scenario["orthosis"].get("muscle") else {}
    parts = {"leg": "leg file"} | worn
    mirrored = [word for part, word in parts.items() if scenario[part].get("side", "right") != side]
    if mirrored:
        other = "right" if side == "left" else "left"
        verb = "are" if len(mirrored) > 1 else "is"
        words = "the {subject} leg is simulated: {what} of the {other} one {verb} mirrored"
        what = " and ".join(mirrored)
        found.append(Notice("mirrored", words, subject=side, what=what, other=other, verb=verb))
    # an imported leg takes from its file how the foot hangs and where its toe is
    sources, passive = (scenario["leg"].get(key) or {} for key in ("provenance", "passive"))
    spring = (passive.get("provenance") or {}).get("scale", {}).get("source", "")
    if passive.get("scale") == 0.0 and "spring" in spring:
        words = "the ankle's only passive stiffness is the spring of the leg's file; a person's differs "
        found.append(Notice("no-tissue", f"{words}(leg.passive.scale)", subject="leg.passive.scale"))
    if (sources.get("foot_length") or {}).get("kind") == "derived" and scenario.get("gait"):
        words = "the leg is imported: toe clearance is that of its sole points, "
        words += "which are derived from its shapes unless the file has them"
        found.append(Notice("imported-sole", words, subject="toe_clearance"))
    return found


def doubts(scenario: JsonMapping, metrics: Metrics, strides: Strides) -> list[Notice]:
    """Which strides the numbers are from, and which assumed values decide."""
    found = of_leg(scenario)
    if "toe_clearance" in metrics and "strides_counted" in metrics:
        solved = "from the settled stride, which was solved for"
        of = solved if "strides_solved" in metrics else _walked(metrics, strides)
        heights = [each["toe_clearance"] for each in strides.values() if "toe_clearance" in each][:FIRST]
        start = ", in which the muscles are not yet full"
        if len(heights) > 1:
            told = ", ".join(number(height.value, height.unit) for height in heights)
            start = f", whose toe clearance is {told} {heights[0].unit}"
        words = "the numbers are {of}; the wearer also walks the first strides{start}"
        found.append(Notice(_WHICH_STRIDES, words, of=of, start=start))
    filled = [name for name, start in (scenario.get("start") or {}).items() if name != "provenance" and start]
    if filled and scenario.get("gait"):
        words = "the {subject} is filled before the first step; with empty muscles after a stop the wearer "
        words += "may trip{key}"
        key = " (--set start={} starts empty)"
        found.append(Notice("filled-first", words, subject=", ".join(filled), key=key))
    segment = joint_words(scenario).segments[0]
    anchor = scenario["orthosis"].get("anchor", {}).get(segment, {})
    if any(source["kind"] == "assumed" for source in anchor.get("provenance", {}).values()):
        words = "the cuff's compliance is assumed{key} and decides the result: run half and twice its value"
        subject = f"orthosis.anchor.{segment}"
        found.append(Notice("cuff-assumed", words, subject=subject, key=f" ({subject})"))
    return [*found, *_of_muscles(scenario)]


def _of_muscles(scenario: JsonMapping) -> list[Notice]:
    """Muscle forces that are not measured, by muscle group."""
    found = []
    for name, group in scenario["orthosis"].get("muscle", {}).items():
        muscle = group["type"]
        law = muscle["law"]
        numbers = (muscle.get("laws", {}).get(law) or {}).get("provenance") or {}
        kinds = {told["kind"] for told in numbers.values()}
        if law in _IDEAL and not muscle.get("tube") and not kinds & {"fitted", "published", "measured"}:
            words = "the {subject}'s law {law} is the braid's geometry alone, an upper bound not measured on "
            words += "this muscle: expect less force, or test the muscle on a stand (afo-sim fit)"
            found.append(Notice("ideal-law", words, subject=name, law=law))
        elif kinds and kinds <= {"derived", "assumed"} and muscle.get("grade") == "D":
            words = "the {subject}'s force is derived, not measured: {what}"
            found.append(Notice("derived-force", words, subject=name, what=muscle.get("description", "")))
    return found


def of_walker(scenario: JsonMapping) -> list[Notice]:
    """What a reader must know about a run's gait cycle: doubts at its import, another mass or height."""
    from afo_sim.common import find_gait
    from afo_sim.gait import closing_doubts
    from afo_sim.gait.file import read

    if not scenario.get("gait"):
        return []
    try:
        cycle = read(find_gait(scenario["gait"]["cycle"]))
    except InputError:
        return []
    words = "the gait cycle was imported with a warning: {subject}"
    found = [Notice("gait-import", words, subject=str(warning)) for warning in cycle.warnings]
    if "quality" not in cycle.notes:  # no import wrote it, which warns of its ends
        found += [doubt.after("of the gait cycle ") for doubt in closing_doubts(cycle)]
    if "ankle_z_m" in cycle.notes.get("derived", ""):
        words = "toe clearance is accurate to about 8 mm: "
        words += "this gait's ankle path is derived, not recorded"
        found.append(Notice("ankle-derived", words, subject="toe_clearance"))
    mass = body_mass(scenario)
    if abs(cycle.body_mass / mass - 1.0) > _SAME_MASS:
        words = "the recorded walker weighs {walker:.1f} kg, the patient {patient:g} kg: forces and moments "
        words += "are scaled to the patient{key}"
        data: Keywords = {"walker": cycle.body_mass, "patient": mass, "key": " (patient.body_mass)"}
        found.append(Notice("walker-mass", words, subject="patient.body_mass", **data))
    found += _of_height(cycle, scenario)
    if own_walk(scenario):
        words = "the recorded walk is the patient's own, without the device: the muscles act as recorded, "
        words += "and the torque that the patient lacks is unknown"
        found.append(Notice("own-walk", words, subject="gait.walker"))
    return found


def _of_height(cycle: "GaitCycle", scenario: JsonMapping) -> list[Notice]:
    """A recorded walker's height that is not known, or that is not the patient's."""
    height, leg = body_height(scenario), parse_quantity(scenario["leg"]["body_height"], "m")
    trial = cycle.body_height or leg
    unknown = "is of unknown height ({walker:.2f} m is assumed)"
    is_tall = "is {walker:.2f} m tall" if cycle.body_height else unknown
    if abs(trial / height - 1.0) > _SAME_HEIGHT:
        end = f"{is_tall}: the stride is scaled to the patient's {{patient:.2f}} m{{key}}"
        if abs(leg / height - 1.0) > 0.05:  # its moment arms are another person's
            end += f"; the device remains placed for a body of {leg:.2f} m (fit it with afo-sim refit)"
    elif cycle.body_height:
        return []
    else:
        end = f"{is_tall}, as of the leg"
    data: Keywords = {"walker": trial, "patient": height, "key": " (patient.body_height)"}
    return [Notice("walker-height", f"the recorded walker {end}", subject="patient.body_height", **data)]


def _walked(metrics: Metrics, strides: Strides) -> str:
    """Over which strides a walked run's numbers are averaged, and how much these still change."""
    last, counted = max(strides, default=0), round(float(metrics["strides_counted"]))
    changes = [
        f"{number(metrics[name].value, metrics[name].unit, signed=True)} {unit} of {what}"
        for name, unit, what in _CHANGES
        if name in metrics
    ]
    if counted < 2 or not changes:
        return f"from stride {last} alone, which does not show whether it repeats"
    still = f"which still change by {' and '.join(changes)} from the last stride but one to the last"
    return f"means over strides {last - counted + 1} to {last}, {still}"
