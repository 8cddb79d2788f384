"""A trial → one gait cycle, with all that it was cut from."""

import pathlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from afo_sim.common import InputError, Notice, with_code
from afo_sim.gait import STRIKE, GaitCycle
from afo_sim.gait_lab.noted import note
from afo_sim.gait_lab.readers.opensim_model import read_opensim_model
from afo_sim.gait_lab.trial.body_mass import BodyMass, find_mass
from afo_sim.gait_lab.trial.choices import SIDES, Choices
from afo_sim.gait_lab.trial.chosen_stride import mean_cycle, require_loaded, take_stride
from afo_sim.gait_lab.trial.cutting import Cutter, reference_of
from afo_sim.gait_lab.trial.files import WalkingTrial, read_trial
from afo_sim.gait_lab.trial.ground_force import with_floor
from afo_sim.gait_lab.trial.imported import Imported
from afo_sim.gait_lab.trial.leg_motion import from_points
from afo_sim.gait_lab.trial.leg_points import LegPoints, leg_length
from afo_sim.gait_lab.trial.legs import find_legs
from afo_sim.gait_lab.trial.newton import find_newton
from afo_sim.gait_lab.trial.plausibility import doubts
from afo_sim.gait_lab.trial.quality import examine, words
from afo_sim.gait_lab.trial.recorded_stride import RecordedStride
from afo_sim.gait_lab.trial.steps import find_steps, open_ends
from afo_sim.gait_lab.trial.walking_frame import find_frame

# Between a given mass and the plates'; half a foot beside a plate makes 17 % (assumed) [-]
_MASS_LIMIT = 0.25
QUALITY = "quality"  # note of a cycle: which faults were looked for, and which were found
_USUAL = "trial-looks-healthy"  # a patient's stride that looks like a healthy walker's
_POUND = 0.2248  # pounds-force in a newton
_LIGHTEST = 9.0  # body mass over squared height that nobody walks with; 13 of thin children; assumed [kg/m²]
_LEG = 0.491  # hip centre to ankle centre over body height (Winter 2009)


def import_gait(files: Sequence[str | pathlib.Path], choices: Choices) -> Imported:
    """Read the files of a trial and cut one stride from it."""
    if choices.each:
        problem = "is a stride of either side, and this is one cycle"
        raise InputError(problem, field="side", value="each", allowed="import_sides(files, choices)")
    trial = _read(files, choices)
    try:
        return cut_cycle(trial, choices)
    except InputError as error:
        asked = choices.markers or choices.stride is not None  # of that side, whose they are
        if not choices.either or asked:
            raise
        refused = error
    # the other leg's stride of a healthy walker for whom no side was asked
    other = "left" if choices.side == "right" else "right"
    try:
        done = cut_cycle(trial, replace(choices, side=other))
    except InputError:
        raise refused from None
    if choices.walker != "healthy":
        way = f"{other}, whose stride can be cut"
        said = "" if refused.allowed == other else refused.allowed
        raise refused.replaced(allowed="; ".join(filter(None, (said, way))))
    text = "the {subject} leg's stride is taken, since {problem}"
    notice = Notice("other-side-taken", text, subject=other, problem=refused.problem)
    return _with_notices(done, (notice, *done.notices))


def _with_notices(done: Imported, notices: Iterable[Notice]) -> Imported:
    done = replace(done, notices=tuple(notices))
    return replace(done, cycle=done.cycle.with_warnings([str(warning) for warning in done.warnings]))


def import_sides(files: Sequence[str | pathlib.Path], choices: Choices) -> dict[str, Imported]:
    """A stride of each side, from one reading of the files; parameters as of `import_gait`."""
    trial = _read(files, choices)
    found: dict[str, Imported] = {}
    refused: list[InputError] = []
    for side in SIDES:
        try:
            found[side] = cut_cycle(trial, replace(choices, side=side))
        except InputError as error:
            refused.append(error)
    if refused:
        alone = [f"the {side} side alone, whose stride can be cut" for side in found]
        raise refused[0].replaced(allowed="; ".join(filter(None, (refused[0].allowed, *alone))))
    usual = all(with_code(done.notices, _USUAL) for done in found.values())
    for side, done in found.items():
        done = _with_notices(done, (notice for notice in done.notices if usual or notice.code != _USUAL))
        others = [time for s in done.strides if s.side != side for time in (s.start, s.end)]
        own = (done.strides[k] for k in done.chosen)
        after = [[(time - s.start) / s.time for time in others] for s in own]
        # the phase at which the other foot strikes, the mean over the taken strides
        strike = np.mean([min(phases, key=lambda phase: abs(phase - 0.5)) % 1.0 for phases in after])
        notes = {**done.cycle.notes, STRIKE: f"{strike:.4f}"}
        found[side] = replace(done, cycle=replace(done.cycle, notes=notes))
    return found


def _read(files: Sequence[str | pathlib.Path], choices: Choices) -> WalkingTrial:
    trial, file = read_trial([pathlib.Path(file) for file in files]), choices.static
    if file is None:
        return trial
    standing = read_trial([file]).markers
    if standing is None:
        raise InputError("holds no markers", file=file, field="static", allowed="a .trc, .c3d or .csv")
    return replace(trial, standing=standing)


def cut_cycle(trial: WalkingTrial, choices: Choices) -> Imported:
    """Find the strides of a trial, and bring one of them to gait phase; errors as `import_gait`."""
    path = choices.model or trial.model
    model = None if path is None else read_opensim_model(path)
    legs, model = find_legs(trial, choices, model)
    frame = with_floor(find_frame(legs, choices), trial.plates)
    stated = trial.stated
    choices = replace(choices, height=stated.height if choices.height is None else choices.height)
    marked = {side: stated.events.get((side, "heel strike"), ()) for side in legs}
    found = {side: from_points(leg, frame, choices.cutoff) for side, leg in legs.items()}
    motions = {side: replace(motion, marked=marked[side]) for side, motion in found.items()}
    grounds, strides, left_out = find_steps(trial, legs, motions, frame, choices)
    require_loaded(strides, choices)
    law = find_newton(trial, legs, motions, grounds, frame)
    mass = find_mass(grounds, strides, choices.mass, None if model is None else model.mass, stated.mass, law)
    _require_mass(mass)
    by_side = {side: [stride for stride in strides if stride.side == side] for side in motions}
    cutters = {
        side: Cutter.of(own, legs[side], motions[side], grounds.get(side), frame, mass.mass, choices)
        for side, own in by_side.items()
        if own
    }
    strides, cycles, not_cut = _cycles(strides, cutters, trial, choices)
    source = ", ".join(file.name for file in trial.files)
    chosen, cycle, not_taken = take_stride(strides, cycles, source, choices)
    sides = SIDES if choices.both else (choices.side,)
    taken = dict.fromkeys(sides, (cycle, chosen))
    if choices.both:
        firsts = {side: next(k for k in chosen if strides[k].side == side) for side in sides}
        taken = {side: (cycles[k], (k,)) for side, k in firsts.items()}
    notices = [
        *trial.notices,
        *(notice for side in sides for notice in legs[side].notices),
        *frame.notices,
        *(notice for side in sides for notice in grounds[side].notices),
        *left_out,
        *not_cut,
        *not_taken,
        *mass.notices,
        *_pounds(mass, legs[choices.side], choices),
        *open_ends([strides[k] for k in chosen]),
        *_doubts(strides, taken, trial, cutters, legs),
    ]
    alike = [c for s, c in zip(strides, cycles, strict=True) if choices.both or s.side == choices.side]
    done = Imported(
        cycle=cycle,
        chosen=chosen,
        strides=tuple(strides),
        cycles=tuple(cycles),
        band=mean_cycle(alike)[1] if len(alike) > 1 else None,
        legs=legs,
        motions=motions,
        grounds=grounds,
        frame=frame,
        mass=mass,
        newton=law,
        zero=cutters[choices.side].zero,
        reference=reference_of(trial, [strides[k] for k in chosen], mass.mass, choices.rows),
        trial=trial,
        notices=tuple(dict.fromkeys(notices)),
    )
    checks = examine(done)
    doubted = [check.notice for check in checks if check.notice is not None]
    cycle = replace(cycle, notes={**cycle.notes, QUALITY: words(checks)})
    return _with_notices(replace(done, cycle=cycle, checks=checks), dict.fromkeys((*done.notices, *doubted)))


def _doubts(
    strides: Sequence[RecordedStride], taken: Mapping[str, tuple[GaitCycle, Sequence[int]]],
    trial: WalkingTrial, cutters: Mapping[str, Cutter], legs: Mapping[str, LegPoints],
) -> list[Notice]:  # fmt: skip
    """Doubts about what was taken of each side, its cycle and the strides that this is the mean of."""
    found: list[Notice] = []
    for side, (cycle, chosen) in taken.items():
        cutter = cutters[side]
        reference = reference_of(trial, [strides[k] for k in chosen], cutter.mass, cutter.choices.rows)
        own = [
            *cutter.notices,
            *doubts(cycle, legs[side], cutter.motion, cutter.ground, cutter.zero, reference),
        ]
        found += [notice.after(f"{side} leg: ") for notice in own] if len(taken) > 1 else own
    return found


def _cycles(
    strides: Sequence[RecordedStride], cutters: Mapping[str, Cutter], trial: WalkingTrial, choices: Choices
) -> tuple[list[RecordedStride], list[GaitCycle], list[Notice]]:
    """The strides that can be cut, their cycles, and why the others cannot."""
    found, cycles, why = [], [], []
    problems: list[InputError] = []
    for stride in strides:
        try:
            cycles.append(cutters[stride.side].cycle(stride, trial))
        except InputError as error:
            problems.append(error)
            text = "{subject} stride from {start:.2f} s left out: {problem}"
            data = {"start": stride.start, "problem": error.problem}
            why.append(note("stride-left-out", text, subject=stride.side, **data))
        else:
            found.append(stride)
    if problems and not any(stride.side == choices.side and stride.loaded for stride in found):
        raise problems[0]
    return found, cycles, why


def _require_mass(mass: BodyMass) -> None:
    """Refuse a mass that the plates contradict: every force and moment would be wrong by as much."""
    if mass.estimated is None or mass.one_leg or abs(mass.mass / mass.estimated - 1.0) <= _MASS_LIMIT:
        return
    off = 100.0 * (mass.mass / mass.estimated - 1.0)
    carried = f"{off:+.0f} % off what the plates carry, {mass.estimated:.1f} kg"
    if abs(_POUND * mass.mass / mass.estimated - 1.0) <= _MASS_LIMIT:
        carried += ": forces in pounds (lbf)?"
    within = f"within {100.0 * _MASS_LIMIT:.0f} %"
    if mass.how != "given":
        problem = f"the mass {mass.how}, {mass.mass:.1f} kg, is {carried}"
        raise InputError(problem, field="mass", allowed=f"the walker's own by `mass`, {within}")
    allowed = f"the walker's own, {within}; left out it is taken from the plates"
    raise InputError(f"is {carried}", field="mass", value=f"{mass.mass:g} kg", allowed=allowed)


def _pounds(mass: BodyMass, leg: LegPoints, choices: Choices) -> list[Notice]:
    """A warning where plates carry less than any walker of this height: their forces may be in pounds."""
    height = choices.height or leg_length(leg) / _LEG
    if mass.how != "by the plates" or not mass.mass < _LIGHTEST * height**2:
        return []
    text = "the plates carry {mass:.1f} kg, of a walker {height:.2f} m tall: pounds (lbf), of {fits:.0f} kg?"
    return [Notice("forces-in-pounds", text, mass=mass.mass, height=height, fits=mass.mass / _POUND)]
