"""Results of a population: who gains and who loses, compared with the recorded walk."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from afo_sim.description import Scenario
from afo_sim.simulation.run import run
from afo_sim.walker.answer import FALLS, NONE, ROWS, Reply, difference, in_brief
from afo_sim.walker.patients import DEVICE, SPRING, WEEKS, WITHOUT, Population
from afo_sim.walker.respond import Falls, Response

NAMES = {
    WITHOUT: "without a device",
    DEVICE: "device, first day",
    DEVICE + WEEKS: "device, after weeks",
    SPRING: "spring, first day",
    SPRING + WEEKS: "spring, after weeks",
}
ALIKE = 0.05  # probability of a sign test from which on down patients count as alike
FEWEST = 8  # patients of whom anything is told
BOOTSTRAP = 2000
CANNOT = "cannot tell"
_RECORDED = (
    "The recorded walk is people's, with the patient's muscles and the device added; hip and knee move as "
    "recorded, whatever the ankle does. The patients' hip and knee respond; how they do so is experimental."
)
_DAYS = (
    "On the first day a patient uses the previous gait with the device; after weeks the gait that a "
    "search found with it, for low effort, few falls and speed, not for toe clearance. A person may adapt "
    "differently. The spring has no "
    "mass, rests at a right angle, and is equally stiff both ways; the device has the mass of its parts."
)
Rows = tuple[list[str], list[list[str]]]  # header and rows of text


@dataclass(frozen=True)
class Effect:
    """A number that a device changes: the least change that the model resolves, and which sense is better."""

    error: float
    better: int = 0  # 1: more is better, -1: less, 0: neither
    relative: bool = False


FALLS_DIFFER = Effect(0.5, -1)  # share of starts: few starts of one patient are told by chance
# The errors: twice the RMS by which the change of one patient differs between two searches (docs/walker.md),
# and of the cost the energy model's own.
EFFECTS = {
    "speed": Effect(0.12, 1),
    "right/clearance": Effect(0.02, 1),
    "right/ankle_swing": Effect(4.6),
    "right/knee_max": Effect(2.5),
    "right/thigh_max": Effect(3.6),
    "right/push_off_peak": Effect(0.9),
    "cost_of_transport": Effect(0.1, -1, relative=True),
}
_ROWS = (
    *("speed", "right/clearance", "right/scuffs", "right/ankle_swing", "right/knee_max", "right/thigh_max"),
    *("left/thigh_max", "right/push_off_peak", "right/force_peak", "cost_of_transport"),
    *("device_torque_swing", "air_per_stride"),
)


def changes(population: Population, case: str, name: str, base: str = WITHOUT) -> np.ndarray:
    """How a number of each patient changes from a case, by default the walk without a device (n,)."""
    before, after = population.values(base, name), population.values(case, name)
    return after / before - 1.0 if name in EFFECTS and EFFECTS[name].relative else after - before


def outcomes(population: Population, case: str, base: str = WITHOUT) -> np.ndarray:
    """Of each patient 1: gains, -1: loses, 0: no change that the model can resolve (n,)."""
    better, worse = np.zeros((2, len(population.drawn)), dtype=bool)
    for name, effect in {"falls": FALLS_DIFFER, **EFFECTS}.items():
        change = effect.better * changes(population, case, name, base)
        better |= change > effect.error
        worse |= change < -effect.error
    before, after = (population.values(each, "fell") > 0.0 for each in (base, case))
    return np.where(worse | (after & ~before), -1, np.where(better | (before & ~after), 1, 0))


def share_of_falls(population: Population, case: str, *, change: bool = False) -> tuple[float, float, float]:
    """Share of starts that fall, or how it changes, with a 95 % interval over patients [%]; else NaN."""
    own = population.values(case, "falls")
    shares, n = changes(population, case, "falls") if change else own, len(own)
    if np.isnan(shares).any():
        return (math.nan,) * 3
    # the wider of a bootstrap of patients, not starts, and of what so many who fall or not can tell
    each = [Falls(float(of.sum()), n) for of in (own - shares, own)]
    low, high = difference(*each) if change else each[1].interval
    drawn = np.random.default_rng(0).integers(n, size=(BOOTSTRAP, n))
    least, most = np.percentile(shares[drawn].mean(axis=1), (2.5, 97.5))
    return 100.0 * float(shares.mean()), 100.0 * min(low, float(least)), 100.0 * max(high, float(most))


def told(population: Population, case: str, name: str) -> str:
    """Whether a case has more or less: its median beyond the error, most patients alike; or "cannot tell"."""
    values = changes(population, case, name)
    known = values[np.isfinite(values)]
    if len(known) < FEWEST:
        return CANNOT if name == "falls" else f"{CANNOT}, too few walk in both cases"
    if name == "falls":
        middle, low, high = share_of_falls(population, case, change=True)
        beyond, known = low > 0.0 or high < 0.0, known[known != 0.0]
    else:
        middle = float(np.median(known))
        beyond = abs(middle) > EFFECTS[name].error
    if not beyond:
        return CANNOT
    from scipy.stats import binomtest  # slow to import

    alike = int(np.sum(np.sign(known) == np.sign(middle)))
    if binomtest(alike, len(known)).pvalue > ALIKE:
        return CANNOT if alike == len(known) else f"{CANNOT}, patients differ"
    return "more" if middle > 0.0 else "less"


def deciding(population: Population, case: str) -> dict[str, float]:
    """Drawn numbers that gain and loss follow beyond chance (5 % for all of them): rank correlation."""
    from scipy.stats import spearmanr  # slow to import

    found = outcomes(population, case)
    drawn = {n: [each[n] for each in population.drawn] for n in population.condition.ranges}
    names = [n for n, x in drawn.items() if np.ptp(x) and (n != "cuff" or case.startswith(DEVICE))]
    names = names if len(found) >= FEWEST and np.ptp(found) else []
    ranks = {name: spearmanr(drawn[name], found) for name in names}
    return {name: float(each.statistic) for name, each in ranks.items() if each.pvalue < 0.05 / len(names)}


def _count(population: Population, case: str, sign: int, base: str = WITHOUT) -> int:
    return int((outcomes(population, case, base) == sign).sum())


def _row(name: str, *, change: bool = False) -> str:
    if name == "falls":
        return "starts that fall [%], mean"
    side, _, rest = name.rpartition("/")
    leg = {"right": ", device's leg", "left": ", other leg", "": ""}[side]
    return f"{ROWS[rest].label}{leg} [{'%' if change and EFFECTS[name].relative else ROWS[rest].unit}]"


def _spread(values: np.ndarray, name: str, *, change: bool = False) -> str:
    """Median and 5 to 95 % of patients, as text; signed of a change."""
    known, row = values[np.isfinite(values)], ROWS[name.rpartition("/")[2]]
    if not len(known):
        return NONE
    factor, digits = (100.0, 0) if change and EFFECTS[name].relative else (row.factor, row.digits)
    ends = (round(factor * float(x), digits) + 0.0 for x in np.percentile(known, (5.0, 50.0, 95.0)))
    low, middle, high = (f"{x:{'+' if change else ''}.{digits}f}".replace("-", "−") for x in ends)
    return f"{middle} ({low} to {high})"


def _cell(population: Population, case: str, name: str, *, change: bool = False) -> str:
    """A number of a case, or how it changes, over the patients, as text; of falls the mean."""
    if name == "device_torque_swing" and DEVICE not in case:
        return NONE
    if name != "falls":
        values = changes(population, case, name) if change else population.values(case, name)
        return _spread(values, name, change=change)
    form = "{:+z.0f} ({:+z.0f} to {:+z.0f})" if change else "{:.0f} ({:.0f} to {:.0f})"
    text = form.format(*share_of_falls(population, case, change=change)).replace("-", "−")
    return NONE if "nan" in text else text


def tables(population: Population) -> list[tuple[str, str, Rows]]:
    """Title, caption, header and rows: each case over the patients, and how it changes their walk."""
    cases, of = list(population.cases), len(population.drawn)
    rows = [[_row(name), *(_cell(population, case, name) for case in cases)] for name in ("falls", *_ROWS)]
    whole = [str(int((population.values(case, "fell") == 0.0).sum())) for case in cases]
    rows.insert(1, [f"patients, of {of}, who finish the undisturbed walk", *whole])
    header = ["", *(NAMES[case] for case in cases)]
    first = "Median (5 to 95 % of the patients); for falls the 95 % interval over patients."
    found = [(f"{of} patients: {population.condition.name}", first, (header, rows)), *_others(population)]
    if len(cases) == 1:
        return found
    rows = []
    for name in ("falls", *EFFECTS):
        words = [
            (told(population, case, name), _cell(population, case, name, change=True)) for case in cases[1:]
        ]
        rows.append([_row(name, change=True), *(f"{word}: {cell}" for word, cell in words)])
    for word, sign in (("patients who gain", 1), ("who lose", -1), ("for whom the model cannot tell", 0)):
        rows.append([word, *(f"{_count(population, case, sign)} of {of}" for case in cases[1:])])
    second = (
        "Change for each patient against the walk without a device. Stated if the median (for falls the "
        "mean's interval) exceeds the model's error and a sign test finds patients alike (5 %). Patients "
        "lose who fall more (by over half of the starts) or are slower, costlier or lower at the "
        "toe by more than the error; those gain who do not lose and improve in one of these."
    )
    return [*found, ("What the device changes", second, (["", *header[2:]], rows))]


def in_lines(population: Population | Response) -> list[dict[str, str]]:
    """Each case in one line, by what each cell is; of one patient without the healthy."""
    if isinstance(population, Response):
        return [in_brief(case) for case in population.cases.values() if case.name != "healthy"]
    names = ("right/clearance", "right/ankle_swing", "speed", "cost_of_transport", "air_per_stride")
    found = []
    for case in population.cases:
        row = {"case": NAMES[case], "starts that fall [%]": _cell(population, case, "falls")}
        for word, sign in (("gain", 1), ("lose", -1)):
            row[word] = NONE if case == WITHOUT else str(_count(population, case, sign))
        found.append(row | {_row(name): _cell(population, case, name) for name in names})
    return found


def _others(population: Population) -> Iterator[tuple[str, str, Rows]]:
    """Falls, speed and ankle of those who differ from the patients and keep their gait."""
    rows = []
    for how in next(iter(population.others.values()), {}):
        rows.append([how])
        for others in (groups[how] for groups in population.others.values()):
            starts, fell = (sum(getattr(one.falls, name) for one in others) for name in ("of", "count"))
            names = ("speed", "right/ankle_swing")
            speed, ankle = (_spread(np.array([one.numbers[n] for one in others]), n) for n in names)
            rows[-1].append(f"{100.0 * fell / max(starts, 1):.0f} % of {starts}; {speed} m/s; {ankle}°")
    caption = "People varied about each patient, with that patient's gait: falls, speed, ankle in mid-swing."
    if rows:
        header = ["", *(NAMES[case] for case in population.others)]
        yield "People other than those who adapted", caption, (header, rows)


@dataclass(frozen=True)
class Recorded:
    """Results of the recorded walk: toe clearance without and with the device [m], air per stride [kg]."""

    without: float
    worn: float
    air: float
    strides: float  # from one bottle


def recorded_walk(scenario: Scenario) -> Recorded:
    """Run a scenario on its recorded walk, with unchanged hip and knee."""
    metrics, device = run(scenario, step="fixed").metrics, bool(scenario.orthosis.muscle)
    names = ("reference_toe_clearance" if device else "toe_clearance", "toe_clearance", "air_per_stride")
    without, worn, air = (1e-3 * float(metrics[n]) if n in metrics else math.nan for n in names)
    strides = float(metrics["strides_per_bottle"]) if "strides_per_bottle" in metrics else math.nan
    return Recorded(without, worn if device else math.nan, air, strides)


def replies(population: Population, recorded: Recorded) -> tuple[Reply, ...]:
    """Who gains and loses, what changes, how long a bottle lasts, which result to trust, in plain English."""
    condition = population.condition
    ranges = "; ".join(f"{name}: {each.source}" for name, each in condition.ranges.items())
    who = f"Patients are drawn (seed {condition.seed}); none is real. {ranges[:1].upper()}{ranges[1:]}. "
    who += f"After weeks the search has continued, which may bring gains by itself. {_searches(population)}"
    bottle = "The bottle of the recorded walk, divided by the air per stride; leaks and pauses are not "
    bottle += "included."
    answers = (
        ("Who gains, and who loses?", _gains(population), who),
        ("Do they fall (in simulation)?", _falls(population), FALLS),
        ("What do they change?", _changes(population), _DAYS),
        ("How long does a bottle last?", _bottle(population, recorded), bottle),
        ("What does the recorded walk show, and which to believe?", _beside(population, recorded), _RECORDED),
    )
    return tuple(Reply(ask, text, (assumed,)) for ask, each, assumed in answers if (text := " ".join(each)))


def _searches(population: Population) -> str:
    told = []
    for case, worn in population.asked["worn"].items():
        each = [one.search for (key, _), one in population.gaits.items() if key == worn]
        done = sum(one.get("converged") == "true" for one in each)
        if each:
            lengths = "/".join(sorted({one.get("generations", "?") for one in each}))
            told.append(f"{NAMES[case].partition(',')[0]} {done} of {len(each)} in {lengths} generations")
    return f"Searches that converged: {'; '.join(told)}." if told else ""


def _gains(population: Population) -> Iterator[str]:
    if count := population.asked["unadapted"]:
        whom = f"{count} of {len(population.drawn)} have not adapted and"
        yield f"{whom} use the healthy gait, as in first steps with weak muscles."
    each = [
        (population.values(c, "fell") == 0.0) & np.isnan(population.values(c, "speed"))
        for c in population.cases
    ]
    if short := int(np.sum(each)):
        yield f"{short} walks are too short for strides: there only falls decide who gains (see --duration)."
    for case in list(population.cases)[1:]:
        gain, lose, rest = (_count(population, case, sign) for sign in (1, -1, 0))
        whom = f"{gain} of {len(population.drawn)} gain, {lose} lose, {rest} cannot be decided"
        yield f"{NAMES[case].capitalize()}: {whom}."
        for name, rank in deciding(population, case).items():
            more = "more" if rank > 0.0 else "less"
            yield f"The {more} {name}, the better (rank correlation {rank:+.2f}).".replace("-", "−")
    for case in (DEVICE, SPRING):
        if case in population.cases and case + WEEKS not in population.cases:
            yield f"After weeks with this {case} the result is unknown; --generations 20 lets patients adapt."
    for when in ("", WEEKS):
        if {DEVICE + when, SPRING + when} <= population.cases.keys():
            better, worse = (_count(population, DEVICE + when, sign, SPRING + when) for sign in (1, -1))
            whom = f"{better} of {len(population.drawn)} walk better, {worse} worse"
            yield f"{NAMES[DEVICE + when].capitalize()}, compared with the spring (without mass): {whom}."


def _falls(population: Population) -> Iterator[str]:
    for case in population.cases if population.asked["starts"] else ():
        mean, low, high = share_of_falls(population, case)
        share, starts = population.values(case, "falls"), population.asked["starts"]
        yield f"{NAMES[case].capitalize()}: of {starts * len(share)} starts {mean:.0f} % fall ({low:.0f} to"
        yield f"{high:.0f} %, 95 % over patients), of {int((share > 0.0).sum())} of {len(share)} patients."


def _changes(population: Population) -> Iterator[str]:
    for k, case in enumerate(list(population.cases)[1:]):
        if k == 0:
            yield "On the device's leg, median (5 to 95 % of patients)."
        known, unknown = list[str](), list[str]()
        for name, effect in EFFECTS.items():
            row, word = ROWS[name.rpartition("/")[2]], told(population, case, name)
            unit, change = "%" if effect.relative else row.unit, _cell(population, case, name, change=True)
            (unknown if word.startswith(CANNOT) else known).append(f"{row.label} {change} {unit}")
        rest = f"; cannot tell: {', '.join(unknown)}" if unknown else ""
        yield f"{NAMES[case].capitalize()}: {', '.join(known) or 'no change that the model resolves'}{rest}."


def _bottle(population: Population, recorded: Recorded) -> Iterator[str]:
    gas = recorded.strides * recorded.air
    for case in (DEVICE, DEVICE + WEEKS):
        air = population.values(case, "air_per_stride") if case in population.cases else np.array([])
        none, air = int((air == 0.0).sum()), air[air > 0.0]
        if len(air) and math.isfinite(gas):
            few, middle, many = np.percentile(gas / air, (5.0, 50.0, 95.0))
            yield f"{NAMES[case].capitalize()}: {middle:.0f} strides (median; {few:.0f} to {many:.0f}),"
            yield f"{1e3 * np.median(air):.3f} g each (recorded walk {1e3 * recorded.air:.3f} g)."
        if none:
            yield f"{NAMES[case].capitalize()}, {none} patients' device uses no air: it is never switched."


def _beside(population: Population, recorded: Recorded) -> Iterator[str]:
    if not math.isfinite(recorded.without):
        return
    lift, found = recorded.worn - recorded.without, list[bool]()  # whether they contradict
    device = f", {1e3 * recorded.worn:.0f} mm with the device" if math.isfinite(lift) else ""
    words = "In the recorded walk the middle patient's toe clears the floor by "
    words += f"{1e3 * recorded.without:.0f} mm without the device{device}."
    yield words.replace("-", "−")
    heights = population.values(WITHOUT, "right/clearance")
    heights = heights[np.isfinite(heights)]
    if len(heights) < FEWEST:
        yield "Too few patients walk without a device to tell their toe clearance."
    else:
        bare = float(np.median(heights))
        found.append((recorded.without > 0.0) != (bare > 0.0))
        if found[0]:
            steps = "the patients in that people with a drop foot step higher, but not by how much."
            believe = steps if bare > 0.0 else "the recorded walk here: its hip and knee are real people's."
            clear = f"{1e3 * bare:.0f} mm".replace("-", "−")
            yield f"The two contradict: without a device, patients clear it by {clear}. Trust {believe}"
    case = next((each for each in (DEVICE + WEEKS, DEVICE) if each in population.cases), None)
    if case and abs(lift) > EFFECTS["right/clearance"].error:
        word, meant = told(population, case, "right/clearance"), "more" if lift > 0.0 else "less"
        change = _cell(population, case, "right/clearance", change=True)
        lifts = f"recorded, the device moves the toe by {1e3 * lift:+.0f} mm, in patients by {change} mm"
        lifts = f"{lifts} ({NAMES[case]}: {word}).".replace("-", "−")
        if word.startswith(f"{CANNOT},"):
            yield lifts.capitalize()
        elif word != meant:
            yield f"The two contradict: {lifts} Trust the recorded walk for the lift at given hip and knee."
            if told(population, case, "right/thigh_max") == "less":
                yield "Trust the patients' result that a lifted foot steps lower."
            found.append(True)
    if found and not any(found):
        yield "The recorded walk and the patients agree."
