"""The answers that a walk opens with: does the toe need it, does it lift the toe, land on the heel, hinder
push-off, cost air, press on the skin.

Each answer has a number, what it is held against, and a status that is stated by a word and a mark as well as
by a colour.
"""

import dataclasses
import math
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence

from afo_sim.metrics.answer import (
    ADDS,
    AGAINST,
    CHANGED,
    HEEL,
    HELP,
    LIFT,
    PUSH_OFF,
    QUESTIONS,
    SKIN,
    UNCOMPENSATED,
    Answer,
    Feed,
    Limits,
    Numbers,
    Status,
    at_least,
    at_most,
    capital,
    clean,
    has,
    in_digits,
    listed,
    millimetres,
    numbered,
    passes,
    three,
    unknown,
    worst,
)
from afo_sim.metrics.beside_strides import BY_LAWS, LESS
from afo_sim.metrics.covered import worth
from afo_sim.metrics.verdict_air import adds_limit, air, air_adds

NO_DEVICE = "A simulation, not a measurement and not a medical device."
UNJUDGED = "* Judged without uncertainty (`run --uncertainty 200` adds it)."
ENOUGH, UNSURE = "the device helps enough", "the device helps, but not reliably in every stride"
REFERENCES = {  # {scenario's reference: how the patient walks in it, and in the run}
    "shoe": ("Without the device", "with it"),
    "barefoot": ("Barefoot and without the device", "with it"),
    "orthosis-off": ("With the device and no air", "with air"),
}
_LOWERED = 5.0  # toe clearance that a needless device may take, half of what is wanted; assumed [mm]
_LESS_ALONE = f"uncompensated_{LESS}"
_TOUCHING = "swings_with_toe_contact"
_AS_MUCH = 0.98  # share of a peak from which on what lasts is no number of its own
_PARTS = {"cuff": "cuff", "plate": "foot's strap"}  # that press on the skin
_UNITS = dict(zip(AGAINST, ("N·m/kg", "J/kg"), strict=True))
MOVE = "move"
_NEUTRAL = 0.0  # dorsiflexion of a foot in mid-swing: Perry & Burnfield 2010, Gait analysis [deg]
_SWING = 0.4  # a swing's length, 0.4 of a stride of a good second: the same [s]
FIRST = "toe_clearance_stride_1"
HEIGHTS = (
    *("toe_clearance", "lowest_toe_clearance", "lowest_toe_clearance_first_ten"),
    *(FIRST, "toe_clearance_stride_2", "toe_clearance_stride_3"),
)


def verdict(
    metrics: Numbers, strides: Mapping[int, Numbers], limits: Limits, feed: Feed | None = None,
    reference: str = "shoe", own_walk: bool = False,
) -> tuple[Answer, ...]:  # fmt: skip
    """The answers of a walking run; none of other runs. `own_walk`: the patient's, without the device."""
    if "strides_counted" not in metrics and not strides:
        return ()
    told = [name for numbers in (metrics, *strides.values()) for name in numbers]
    worn = any(name.startswith(("orthosis_", "air_per_stride", "torque_against_")) for name in told)
    lift = _lift(metrics, strides, limits.toe_clearance)
    if own_walk and lift.status == "good":
        lift = _lift_by_the_ankle(lift, metrics, limits.toe_clearance)
    found = (
        *_help(metrics, worn, lift.status, limits.toe_clearance, reference, own_walk),
        lift,
        _heel(metrics, strides, limits.contact_pitch),
        _push_off(metrics, worn, limits),
        *air_adds(metrics, limits, own_walk),
        air(metrics, worn, limits, feed),
        _skin(metrics, worn, limits),
    )
    if not has(metrics, "strides_without_air"):
        return found
    said = "This is from strides on an empty source."  # nothing that is good is known from them
    unknown = [worst([answer.status, "unknown"]) for answer in found]
    return tuple(
        dataclasses.replace(answer, status=status, text=f"{answer.text} {said}", brief="")
        for answer, status in zip(found, unknown, strict=True)
    )


def undecided(limits: Limits, why: str) -> tuple[Answer, ...]:
    """The answers of a walk that has none: each is unknown, for the same reason."""
    found = (
        _lift({}, {}, limits.toe_clearance),
        _heel({}, {}, limits.contact_pitch),
        _push_off({}, True, limits),
        unknown(ADDS, why, adds_limit(limits)),
        air({}, True, limits, None),
        _skin({}, True, limits),
    )
    return tuple(dataclasses.replace(answer, text=f"Not known: {why}.", brief="") for answer in found)


def needless(metrics: Numbers, limits: Limits) -> bool:
    """Whether the toe clears what is wanted without the device, and without compensation, too."""
    bare = ("reference_toe_clearance", UNCOMPENSATED[0])
    heights = [metrics[name].value for name in bare if has(metrics, name)]
    return bool(heights) and min(heights) >= clean(1e3 * limits.toe_clearance[0])


def _height_limit(wanted: float, trips: float) -> str:
    return f"target ≥ {in_digits(wanted)} mm, trips below {in_digits(trips)} mm"


# --- help


def _help(
    metrics: Numbers, worn: bool, lift: Status, pair: tuple[float, float], reference: str, own_walk: bool
) -> Iterator[Answer]:  # fmt: skip
    """The toe without the device and with it, in the settled stride; none without a walked reference."""
    # In an own walk hip and knee may make up for the foot: what is said must hold without that, too.
    if not worn or not has(metrics, "reference_toe_clearance") or not has(metrics, "toe_clearance"):
        return
    wanted, trips = (clean(1e3 * each) for each in pair)
    heights = metrics["reference_toe_clearance"].value, metrics["toe_clearance"].value
    without, own = _judged(metrics, "reference_", trips), _judged(metrics, "", trips)
    touch = without < heights[0], own < heights[1]
    status, answer = _helped(without, own, wanted, trips)
    if own >= wanted and lift != "good":
        status = worst([status, lift])
        doubted = f"{answer}; with it, clearance is not reliable in every stride"
        answer = UNSURE if answer == ENOUGH else doubted
    toe = f" the toe {'would pass' if heights[0] < 0.0 else 'passes'}"  # no toe passes below a floor
    both = zip(REFERENCES[reference], heights, touch, (toe, ""), strict=True)
    limit = _height_limit(wanted, trips)
    late = " after the forefoot has touched the floor"
    parts = [f"{how}{verb} {passes(height)}{late * touches}" for how, height, touches, verb in both]
    low, high = map(millimetres, heights)
    start = REFERENCES[reference][0]
    brief = f"Toe clearance {low} {start[0].lower()}{start[1:]}, {high} {REFERENCES[reference][1]}"
    brief += f": {answer}" if answer != ENOUGH else ""
    found = Answer(HELP, QUESTIONS[HELP], status, f"{', '.join(parts)}: {answer}.", limit, brief)
    yield (
        _without_compensation(metrics, found, parts, lift, without, (wanted, trips)) if own_walk else found
    )


def _without_compensation(
    metrics: Numbers, answer: Answer, walked: Sequence[str], lift: Status, as_walked: float,
    limits: tuple[float, float],
) -> Answer:  # fmt: skip
    """Help in an own walk, where hip, knee or pelvis may lift the toe; `walked` says how it passes."""
    wanted, trips = limits
    if not all(has(metrics, name) for name in UNCOMPENSATED):
        text = f"{answer.text} Whether hip, knee or pelvis compensate for the foot is not known."
        return dataclasses.replace(answer, status=worst([answer.status, "unknown"]), text=text, brief="")
    without = _judged(metrics, "uncompensated_reference_", trips)
    own = _judged(metrics, "uncompensated_", trips)
    status, words = _helped(without, own, wanted, trips)
    if status == "good" and metrics.get(_LESS_ALONE, math.nan) < wanted:
        status, words = "doubtful", UNSURE
    pair = f"{passes(without)} without the device, {passes(own)} with it: {words}"
    stated = f"With healthy people's hip, knee and path, and the same ankle, the toe would pass {pair}."
    short = f"{millimetres(without)} without the device, {millimetres(own)} with it"
    if without < wanted <= as_walked:  # she clears, and only since something else lifts the foot
        bare, worn = walked
        if lift != "good" and status == "good":
            words = UNSURE
            stated = stated.replace(ENOUGH, UNSURE)
        return dataclasses.replace(
            answer,
            status=worst([status, lift]),
            text=f"{bare}, lifted by hip, knee or pelvis and not by the ankle; {worn}. {stated}",
            brief=f"Toe clearance without compensation {short}: {words}",
        )
    # where nothing hangs, nothing would be made up for
    status = answer.status if without >= wanted else worst([answer.status, status])
    brief = f"{answer.brief}; without compensation {short}"
    return dataclasses.replace(answer, status=status, text=f"{answer.text} {stated}", brief=brief)


def _judged(metrics: Numbers, of: str, trips: float) -> float:
    """A toe clearance [mm]; below what trips where the forefoot touches the floor, however the toe passes."""
    height = metrics[f"{of}toe_clearance"].value
    touches = height >= trips >= 0.0 and _touches(metrics, of + _TOUCHING)
    return math.nextafter(trips, -math.inf) if touches else height


def _helped(without: float, own: float, wanted: float, trips: float) -> tuple[Status, str]:
    """Status and words for two toe clearances [mm]."""
    if without >= wanted:
        if own >= max(without - _LOWERED, wanted):
            return "doubtful", "the toe does not need the device"
        far = " too far" if own < wanted else ""
        return "bad", f"the toe does not need the device, which lowers it{far}"
    if own >= wanted:
        return "good", ENOUGH
    if own < without - CHANGED:
        return "bad", "the device lowers the toe"
    helps = "the device helps, but not enough" if own > without + CHANGED else "the device changes nothing"
    return ("bad", f"{helps}: the toe trips") if own < trips else ("doubtful", helps)


# --- toe


def _lift(metrics: Numbers, strides: Mapping[int, Numbers], pair: tuple[float, float]) -> Answer:
    """Toe clearance of all strides that are stated; a forefoot that touches the floor trips, too."""
    wanted, trips = (clean(1e3 * each) for each in pair)
    limit = _height_limit(wanted, trips)
    if not has(metrics, "toe_clearance"):
        return unknown(LIFT, "the toe clearance is undefined", limit)
    stated = {k: s["toe_clearance"].value for k, s in strides.items() if has(s, "toe_clearance")}
    lowest = min([*stated.values(), *(metrics[name].value for name in HEIGHTS if has(metrics, name))])
    touching = [k for k, s in strides.items() if _touches(s)] if trips >= 0.0 else []
    short = sorted({k for k, height in stated.items() if height < trips}.union(touching))
    statuses: list[Status] = [at_least(lowest, (wanted, trips))]
    statuses += ["bad"] if short or (trips >= 0.0 and _touches(metrics)) else []
    less = metrics.get("toe_clearance_less_extended", math.nan)
    solved, settled = "strides_solved" in metrics, metrics["toe_clearance"].value
    heights = [f"{millimetres(settled)} {'in the settled stride' if solved else 'on average'}"]
    first = metrics[FIRST].value if has(metrics, FIRST) else stated.get(0)
    heights += [] if first is None else [f"{millimetres(first)} in stride 1"]
    told = f"Toe clearance is {listed([*heights, f'{millimetres(lowest)} in the lowest stride'])}"
    if math.isfinite(less) and round(less, 1) != round(settled, 1):
        told += f"; {millimetres(less)} if the toes extend less"
    parts = [f"{told}."]
    if lowest >= trips and "bad" in statuses:
        parts.append("The forefoot touches the floor earlier in swing.")
    statuses += ["doubtful"] if less < wanted else []
    if unstated := [k for k in strides if k not in stated]:
        parts.append(f"It is undefined in {numbered(unstated)}.")
        statuses.append("doubtful")
    if has(metrics, BY_LAWS) and metrics[BY_LAWS].value < wanted <= lowest:
        parts.append(f"With another force law of its muscles it is {millimetres(metrics[BY_LAWS].value)}.")
        statuses.append("doubtful")
    status, whole = worst(statuses), len(parts) == 1
    drags = ""
    if has(metrics, "toe_drag_force") and metrics["toe_drag_force"].value > 0.0:
        share, force = metrics["toe_drag"].value, metrics["toe_drag_force"].value
        drags = f" drags for {share:.0f} % of swing and presses with up to {force:.0f} N"
        parts.append(f"The toe{drags} (mean over 10 ms).")
        drags = f"; it{drags}"
    brief = ""  # what takes a further sentence is not told in short
    if whole:
        extended = f", {in_digits(less, '.1f')} if toes extend less" if math.isfinite(less) else ""
        low = in_digits(lowest, ".1f")
        brief = f"Toe clearance {millimetres(settled)}, lowest stride {low}{extended} "
        brief += f"(target ≥ {in_digits(wanted)}){drags}"
    if status == "bad":
        which = f" in {numbered(short)} ({len(short)} of {len(strides)})" if short else ""
        if solved and (settled < trips or _touches(metrics)):
            which = " in the settled stride"
        trip = f"The toe trips{which}."
        parts.insert(0, trip)
        brief = f"{parts[0]} {brief}" if brief else ""
    return Answer(LIFT, QUESTIONS[LIFT], status, " ".join(parts), limit, brief)


def _lift_by_the_ankle(lift: Answer, metrics: Numbers, pair: tuple[float, float]) -> Answer:
    """A good clearance of an own walk, which is doubtful where hip, knee or pelvis give it."""
    known = has(metrics, UNCOMPENSATED[1])
    height = metrics[UNCOMPENSATED[1]].value if known else math.nan
    height = min(height, float(metrics.get(_LESS_ALONE, math.inf)))
    if height >= clean(1e3 * pair[0]):
        return lift
    text = f"{lift.text} Without compensation by hip, knee or pelvis "
    text += f"the toe would pass {passes(height)}." if known else "the clearance is not known."
    brief = f"{lift.brief}; without compensation {millimetres(height)}" if known and lift.brief else ""
    return dataclasses.replace(lift, status="doubtful" if known else "unknown", text=text, brief=brief)


def _touches(metrics: Numbers, name: str = _TOUCHING) -> bool:
    return has(metrics, name) and metrics[name].value > 0.0


# --- heel


def _heel(metrics: Numbers, strides: Mapping[int, Numbers], pair: tuple[float, float]) -> Answer:
    """Pitch at initial contact, and how many strides begin with the heel."""
    heel, forefoot = (clean(math.degrees(each)) for each in pair)
    limit = f"heel first from {in_digits(heel)}°, forefoot first below {in_digits(forefoot)}°"
    if not has(metrics, "foot_pitch_at_contact"):
        return unknown(HEEL, "the pitch of the foot at initial contact is undefined", limit)
    pitch = metrics["foot_pitch_at_contact"].value
    # the contact that stride 0 begins with is where the walk was started, not what a swing came to
    contacts = (each for k, each in strides.items() if k and has(each, "foot_pitch_at_contact"))
    landed = [each["foot_pitch_at_contact"].value for each in contacts]
    each = [at_least(angle, (heel, forefoot)) for angle in (landed or [pitch])]
    # shares of heel, flat foot and forefoot among the landings
    ways = {"good": "on the heel", "doubtful": "on a flat foot", "bad": "on the forefoot"}
    found = {how: each.count(status) for status, how in ways.items() if status in each}
    shares = [f"{100.0 * count / len(each):.0f} % {how}" for how, count in found.items()]
    stated = f"of {len(each)} landings {listed(shares)}" if landed else ""
    if landed and len(found) == 1:
        stated = f"all {len(each)} landings {next(iter(found))}"
    toes = f"{abs(pitch):.1f}° {'up' if pitch >= 0.0 else 'down'}"
    status = worst([*each, at_least(pitch, (heel, forefoot))])
    text = f"The foot lands with its toes {toes}{stated and '; '}{stated}."
    brief = f"{stated and capital(stated) + ', '}toes {toes} (target ≥ {in_digits(heel)}°)"
    return Answer(HEEL, QUESTIONS[HEEL], status, text, limit, brief)


# --- push-off


def _push_off(metrics: Numbers, worn: bool, limits: Limits) -> Answer:
    """Torque and work of the orthosis against push-off; the worse one decides."""
    torque, work = limits.torque_against_push_off, limits.work_against_push_off
    limit = f"target ≤ {torque[0]:g} N·m/kg and ≤ {work[0]:g} J/kg, bad above {torque[1]:g} or {work[1]:g}"
    if not worn:
        text = "Nothing is worn that could hinder it."
        return Answer(PUSH_OFF, QUESTIONS[PUSH_OFF], "good", text, limit, kept=1.0)
    if not any(has(metrics, name) for name in AGAINST):
        return unknown(PUSH_OFF, "torque and work against push-off are undefined", limit)
    each = {
        name: at_most(metrics[name].value, getattr(limits, key)) if has(metrics, name) else "unknown"
        for name, key in AGAINST.items()
    }
    parts = []
    if has(metrics, "torque_against_push_off_per_mass"):
        own = metrics["torque_against_push_off_per_mass"].value
        whole = "torque_against_push_off"
        torque_text = f"{own:.3f} N·m/kg"
        if has(metrics, whole):
            torque_text = f"{metrics[whole].value:.1f} N·m ({torque_text})"
        parts.append(f"resists push-off with up to {torque_text}")
    if has(metrics, "work_against_push_off"):
        parts.append(f"absorbs {metrics['work_against_push_off'].value:.4f} J/kg")
    text = f"The orthosis {listed(parts)}."
    status = worst(list[Status](each.values()))
    if len(set(each.values())) > 1 and status != "unknown":
        text += f" The {'torque' if each['torque_against_push_off_per_mass'] == status else 'work'} decides."
    short = [
        f"{metrics[name].value:.3g} {unit} (target ≤ {getattr(limits, AGAINST[name])[0]:g})"
        for name, unit in _UNITS.items()
        if has(metrics, name)
    ]
    brief = f"Orthosis resists with {listed(short)}"
    return Answer(PUSH_OFF, QUESTIONS[PUSH_OFF], status, text, limit, brief)


# --- skin


def _skin(metrics: Numbers, worn: bool, limits: Limits) -> Answer:
    """Peak and sustained pressure of cuff and strap; the worst one decides."""
    (discomfort, pain), flow = limits.skin_pressure, limits.blood_flow_pressure
    limit = f"discomfort from {1e-3 * discomfort:.3g} kPa, pain from {1e-3 * pain:.3g} kPa; sustained "
    limit += f"at most {1e-3 * flow:.3g} kPa (blood flow)"
    if not worn:
        text = "Nothing is worn that presses on the skin."
        return Answer(SKIN, QUESTIONS[SKIN], "good", text, limit, kept=1.0)
    statuses: list[Status] = []
    parts, short = [], []
    for part, name in _PARTS.items():
        if not has(metrics, f"{part}_skin_pressure"):
            continue
        most = metrics[f"{part}_skin_pressure"].value
        lasting = metrics.get(f"{part}_skin_pressure_sustained", metrics[f"{part}_skin_pressure"]).value
        statuses += [at_most(1e3 * most, limits.skin_pressure), at_most(1e3 * lasting, (flow, math.inf))]
        if most <= 0.0:
            continue
        peak, always = (f"{value:.3g} kPa" for value in (most, lasting))
        steady = lasting >= _AS_MUCH * most
        presses = peak if steady else f"at most {peak} and {always}"
        parts.append(f"the {name} presses on the skin with {presses} all the time")
        short.append(f"{name} presses with {peak}" + ("" if steady else f" ({always} all the time)"))
    if not statuses:
        return unknown(SKIN, "neither cuff nor strap is described", limit)
    text = f"To hold by friction (assumed), {listed(parts)}." if parts else "Nothing presses on the skin."
    against = f"discomfort starts at {1e-3 * discomfort:.3g}, sustained limit {1e-3 * flow:.3g}"
    brief = f"{capital(', '.join(short))}; {against}; friction assumed" if short else ""
    return Answer(SKIN, QUESTIONS[SKIN], worst(statuses), text, limit, brief)


# --- seated


def seated_answers(metrics: Numbers, limits: Limits) -> tuple[Answer, ...]:
    """The answers of a run that does not walk; none where no ankle moves, or no orthosis pulls at it."""
    # Perry & Burnfield 2010, Gait Analysis: the ankle is neutral in mid-swing, and swing is 0.4 of a stride
    names = ("peak_plantarflexion_angle", "peak_dorsiflexion_angle", "peak_dorsiflexion_torque")
    if not all(has(metrics, name) for name in names):
        return ()
    down, up, torque = (metrics[name].value for name in names)
    rise = metrics.get("rise_time", math.nan)
    brief = f"foot moves from {in_digits(down, '.1f')}° to {in_digits(up, '.1f')}° of dorsiflexion"
    brief += f" in {three(rise)} s" if math.isfinite(rise) else ""
    brief += f", with up to {torque:.3g} N·m"
    statuses: list[Status] = [at_least(up, (_NEUTRAL, _NEUTRAL)), "good" if rise <= _SWING else "doubtful"]
    limit = f"target {_NEUTRAL:g}° within {_SWING:g} s, as in swing; assumed"
    moves = Answer(MOVE, "Does it lift the foot?", worst(statuses), f"The {brief}.", limit)
    skin = _skin(metrics, True, limits)
    moves = dataclasses.replace(moves, brief=f"{capital(brief)} ({limit})")
    return (moves, skin) if skin.status != "unknown" else (moves,)


# --- words


def closing(answers: Iterable[Answer], metrics: Container[str]) -> list[str]:
    """Lines below the answers: how past predictions did, what a marked good one means, what none is."""
    marked = any(answer.word.endswith("*") for answer in answers)
    ends = [worth(metrics), f"{UNJUDGED} {NO_DEVICE}" if marked else NO_DEVICE]
    return list(filter(None, ends))
