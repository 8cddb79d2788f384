"""Warnings of a run: what is not to be believed, limits left, laws beyond their range, skin, a source.

A time step that was too long shows in energy.
"""

import itertools
from collections.abc import Iterator, Mapping

import numpy as np

from afo_sim.common import LEAST_NUMBER, Notice
from afo_sim.description import WORN, Described, MuscleGroup, Scenario, provenance_note
from afo_sim.metrics import Metric, Window, cut, skin_metrics
from afo_sim.model import ANKLE, SOURCE, Built, chamber_of, muscle_names
from afo_sim.physics import BRAID_BLEND, FIRST_USER_ID, LAWS, TRIPLE_TEMPERATURE, rubber_force
from afo_sim.physics.static_force import static_force
from afo_sim.simulation.energy_balance import Columns, Energy, balances
from afo_sim.simulation.facts import facts_of

MADE = 10.0  # of the air's net work that laws may give or take [percent]
UNBALANCED = 0.01  # of the work that may be found nowhere [-]
NOTHING = 1e-3  # work that is too little to judge [J]
STRETCHES = 50  # stretches of a run, among which the one that closes least is looked for
NEGLIGIBLE = 0.01  # share of a muscle's force limit below which its law's range does not matter
WHO = {"cuff": "it", "plate": "its strap"}  # presses on the skin
GIVES = 0.1  # stretch of a cable that takes up all that a muscle can shorten [m]
SELDOM = 0.5  # share of a run for which a controller must know its gait phase
SLIGHTLY = 0.01  # of a range's upper end, by which a law may be asked beyond it


def validity_warnings(built: Built, columns: Columns, static: Columns, energy: Energy) -> Iterator[Notice]:
    """Warnings of what no muscle does, with the time."""
    done = energy.turnover + energy.damper_loss + abs(energy.law_mismatch)
    if done < NOTHING:
        return
    for code, found, problem in (
        ("energy-lost", abs(energy.residual), "of the work is unaccounted for"),
        (
            "energy-from-friction",
            -energy.friction_loss,
            "of the work comes from friction, which should only absorb work",
        ),
    ):
        if not found <= UNBALANCED * done:
            # where it closes least, and the muscle that moves most there
            cuts = np.unique(np.linspace(0, len(columns["time"]) - 1, STRETCHES + 1).astype(int)).tolist()
            stretches = [Window(*ends) for ends in itertools.pairwise(cuts)]
            each = balances(built.scenario.orthosis, columns, static, stretches)
            missed = [abs(one.residual) + max(-one.friction_loss, 0.0) for one in each]
            part = cut(columns, stretches[missed.index(max(missed))].of)
            moved = {name: float(np.ptp(part[f"muscle/{name}/contraction"])) for name in static}
            muscle, time = max(moved, key=moved.__getitem__), float(part["time"].mean())
            yield Notice(
                code,
                "the energy balance does not close: {share:.1f} % {problem}, mostly near {time:.2f} s, "
                "where {subject} moves; try a shorter time step",
                subject=muscle,
                share=100.0 * found / done,
                beyond=float(abs(found) / done),
                problem=problem,
                time=time,
            )


def mismatch_warning(energy: Mapping[str, Metric]) -> Iterator[Notice]:
    """Warning of laws whose work is not that of their air, from the metrics of the balance."""
    if "law_mismatch_share" not in energy or abs(energy["law_mismatch"]) < NOTHING:
        return
    share = float(energy["law_mismatch_share"])
    if abs(share) > MADE:
        yield Notice(
            "law-mismatch",
            "the muscles' laws {way} {work:.3g} J per cycle beside the air's work of {net:.3g} J: force and "
            "volume contradict each other, so torque, air or clearance are wrong; choose another law",
            subject="law",
            way="give" if share > 0.0 else "take",
            work=abs(float(energy["law_mismatch"])),
            net=float(energy["air_work"]),
            beyond=abs(share),
        )


_FURTHER = ": measure the muscle further (afo-sim fit), or take a longer one or less pressure"


def limit_warnings(
    built: Built, columns: Columns, static: Mapping[str, np.ndarray] | None = None
) -> Iterator[Notice]:
    """Warnings of muscles beyond their limits, and of pressure on the skin."""
    yield from _target_warnings(built, columns)
    known = float(np.isfinite(columns.get("controller/phase", np.zeros(1))).mean())
    if known < SELDOM:
        code = "phase-seldom-known" if known else "phase-never-known"
        text = "the gait phase was known for only {share:.0f} % of the run, and the valves waited otherwise: "
        text += "check that the column of {subject} is the shank's angle [rad] or a heel's load, and that "
        text += "the walk is longer than four strides"
        yield Notice(code, text, subject="controller.gait_phase", share=100.0 * known)
    elif not columns.get("controller/heel_strike", np.ones(1)).any():
        text = "the gait phase starts where other people's heels strike; a foot switch gives the "
        text += "wearer's"
        yield Notice("heel-strike-assumed", text, subject="controller.gait_phase.switch", severity="note")
    for name, group in muscle_names(built.scenario.orthosis).items():
        yield from _muscle_limits(name, group, columns)
        if name.endswith("_1"):  # its neighbours say the same
            if LAWS[group.type.law].native_id >= FIRST_USER_ID:
                text = "{subject} uses {law}, a law of your own, which no measurement supports here"
                yield Notice("law-of-your-own", text, subject=name, law=group.type.law)
            yield from _law_warnings(name, group, columns, (static or {}).get(name))
        filled = float(columns[f"chamber/{chamber_of(name, group)}/pressure"].max())
        if filled > 1e5 and columns[f"muscle/{name}/force"].max() < 1.0:
            text = "{subject} never pulls, although its chamber reaches {bar:.2g} bar: {reason}"
            law = group.type.law
            strongest = static_force(LAWS[law].native_id, 0.0, filled, [*group.type.coefficients], 0)
            why = "its cable stays slack; shorten link_length or slack, or stiffen cuff and plate"
            if strongest <= 1.0:
                why = f"its law {law} gives no force at that pressure"
            elif group.cable.stiffness * GIVES < strongest:
                why = "its cable is too soft; raise cable.stiffness"
            yield Notice("muscle-never-pulls", text, subject=name, bar=filled * 1e-5, reason=why)
    lower, upper = built.model.joint(ANKLE).range
    angle = columns["ankle/angle"]
    if angle.min() <= lower or angle.max() >= upper:
        worst, where = int(np.argmax(np.maximum(lower - angle, angle - upper))), ""
        if built.walk is not None:
            where = f" at {100.0 * columns['gait/phase'][worst]:.0f} % of the stride"
        text = f"the {built.scenario.leg.joint} reaches a stop of the joint{{where}}"
        yield Notice("stop-reached", text, subject=ANKLE, where=where)
    yield from _skin_warnings(built, columns)
    yield from _source_warnings(built, columns)


def _muscle_limits(name: str, group: MuscleGroup, columns: Columns) -> Iterator[Notice]:
    """Warnings of one muscle beyond its limits."""
    limits, contraction = group.type.limits, columns[f"muscle/{name}/contraction"]
    pressure = columns[f"chamber/{chamber_of(name, group)}/pressure"]
    for word, key, values, limit, unit in (
        ("gauge pressure", "pressure", pressure * 1e-5, limits.pressure * 1e-5, " bar"),
        ("force", "force", columns[f"muscle/{name}/force"], limits.force, " N"),
        ("contraction", "contraction_max", contraction, limits.contraction_max, ""),
        ("stretch", "contraction_min", -contraction, -limits.contraction_min, ""),
    ):
        worst = int(np.argmax(values))
        if values[worst] > limit:
            yield Notice(
                f"muscle-{word.split()[-1]}",
                "{subject}: {what} reaches {value:.3g}{unit} at {time:.3f} s, beyond its limit of "
                "{limit:.3g}{unit}{kind}",
                subject=name,
                what=word,
                value=float(values[worst]),
                limit=limit,
                beyond=float(values[worst]) - limit,
                unit=unit,
                time=float(columns["time"][worst]),
                kind=provenance_note(limits, key) + (_FURTHER if key == "contraction_max" else ""),
            )


def _target_warnings(built: Built, columns: Mapping[str, np.ndarray]) -> Iterator[Notice]:
    """Warnings of pressures that a drive is asked for and that can hardly be meant."""
    supply = built.scenario.supply.pressure
    for chamber in built.scenario.drive:
        asked = columns.get(f"chamber/{chamber}/target", np.zeros(0))
        most = float(np.nanmax(asked, initial=0.0))  # not a number: the drive is off
        who = f"drive of chamber {chamber!r}"
        if len(asked) and np.isnan(asked).all():
            text = "{subject}: never gets a pressure command, so it has no effect but the valves of a "
            text += "regulator: a controller must command it"
            yield Notice("drive-never-asked", text, subject=who)
        elif 0.0 < most < LEAST_NUMBER:
            yield Notice(
                "drive-asked-too-little",
                "{subject}: its commands never exceed {most:.3g} Pa; commands are in Pa: was bar meant?",
                subject=who,
                most=most,
            )
        elif most > supply * (1.0 + SLIGHTLY):
            text = "{subject}: is commanded up to {asked:.3g} bar, above the supply's {supply:.3g} bar, "
            text += "which it cannot reach"
            yield Notice("drive-asked-too-much", text, subject=who, asked=1e-5 * most, supply=1e-5 * supply)


def _law_warnings(
    name: str, group: MuscleGroup, columns: Columns, static: np.ndarray | None
) -> Iterator[Notice]:
    """Warnings of a law that gave a force outside its range, or that has another volume or length."""
    role, muscle, law = name.rsplit("_", 1)[0], group.type, group.type.law_set
    force = columns[f"muscle/{name}/force"] if static is None else static
    pressure = columns[f"chamber/{chamber_of(name, group)}/pressure"][: len(force)]
    contraction = columns[f"muscle/{name}/contraction"][: len(force)]
    # stretched, braid and tube carry; the law is asked at zero contraction
    stretch = np.maximum(-contraction, 0.0)
    carried = np.where(stretch < BRAID_BLEND, stretch**2 / (2.0 * BRAID_BLEND), stretch - 0.5 * BRAID_BLEND)
    carried *= muscle.braid_stiffness  # as `braid_force`, whole rows at once
    stiffness, bore, turn = muscle.rubber  # its tube carries, too, in proportion to the stretch
    carried -= stretch * rubber_force(-1.0, stiffness, bore, muscle.braid.b, turn)[1]
    pulling = force - carried > NEGLIGIBLE * muscle.limits.force
    for word, values, (lower, upper), unit in (
        ("gauge pressure", pressure * 1e-5, np.multiply(law.pressure_range, 1e-5), " bar"),
        ("contraction", np.maximum(contraction, 0.0), muscle.contraction_range, ""),
    ):
        beyond = np.where(pulling, np.maximum(lower - values, values - upper), -np.inf)
        worst = int(np.argmax(beyond))
        if beyond[worst] > SLIGHTLY * upper:
            yield Notice(
                f"law-outside-its-{word.split()[-1]}",
                "{subject}: the law {law} was used at a {what} of {value:.3g}{unit} at {time:.3f} s, "
                "outside its range of {lower:g} to {upper:g}{unit}",
                subject=role,
                law=muscle.law,
                what=word,
                value=float(values[worst]),
                lower=float(lower),
                upper=float(upper),
                beyond=float(beyond[worst]),
                unit=unit,
                time=float(columns["time"][worst]),
            )
    if why := muscle.law_volume.reason:
        text = "{subject}: the braid's volume is used instead of the one that follows from {law}: {why}"
        yield Notice("law-volume", text, subject=role, law=muscle.law, why=why)
    if why := muscle.length_warning:
        yield Notice("muscle-length", "{subject}: {why}", subject=role, why=why)


def _skin_warnings(built: Built, columns: Mapping[str, np.ndarray]) -> Iterator[Notice]:
    """Warnings of a cuff or strap that presses beyond discomfort, at any time of these rows."""
    limits, facts = built.scenario.limits, facts_of(built)
    for segment, interface in built.scenario.orthosis.interface.items():
        part = WORN[segment]
        if limits is None or part not in (facts.skins or {}):
            continue
        found = skin_metrics(facts, part, columns)
        pressure = found[f"{part}_skin_pressure"].value
        discomfort, pain = 1e-3 * limits.skin_pressure[0], 1e-3 * limits.skin_pressure[1]
        if pressure <= discomfort:
            continue
        worse = (
            f"{discomfort:g} kPa at which discomfort begins (pain from {pain:g} kPa"
            if pressure <= pain
            else f"{pain:g} kPa at which pain begins (discomfort from {discomfort:g} kPa"
        )
        yield Notice(
            "skin-pressure",
            "{subject}: {who} must press on the skin with {pressure:.3g} kPa so as not to slide under "
            "{pull:.0f} N, which exceeds the {worse}{limit_kind}); on {area:g} cm², with a friction "
            "coefficient of {friction:g}{kind}",
            subject=part,
            who=WHO[part],
            pressure=pressure,
            beyond=pressure - discomfort,
            pull=found[f"{part}_pull_along"].value,
            worse=worse,
            limit_kind=_kinds(limits, "skin_pressure", mark="; "),
            area=1e4 * interface.area,
            friction=interface.friction,
            kind=_kinds(interface, "area", "friction", mark=": "),
        )


def _kinds(described: Described, *keys: str, mark: str) -> str:
    """What kinds of numbers some keys of a description hold, behind `mark`; nothing where none is known."""
    kinds = {described.provenance[key].kind for key in keys if key in described.provenance}
    return mark + " and ".join(sorted(kinds)) if kinds else ""


def empty_warnings(scenario: Scenario, sag: Mapping[str, float], of: str = "") -> Iterator[Notice]:
    """A warning where bottle or cartridge runs empty, by metrics of its sag; `of` what the numbers are."""
    source = scenario.supply.source
    if source is None or "source_empty_after" not in sag:
        return
    usual = "the strides before" if scenario.walking else "the whole run, with and without air"
    yield Notice(
        "source-empty",
        "{subject}: {name} is empty after {after:.3g} s (less than the set {needed:g} bar): from then on the "
        "device lacks air, and the numbers are of {of}",
        subject=SOURCE,
        name=source.name or source.kind,
        after=float(sag["source_empty_after"]),
        needed=1e-5 * scenario.supply.pressure,
        of="strides on an empty source, too" if "strides_without_air" in sag else of or usual,
    )


def _source_warnings(built: Built, columns: Mapping[str, np.ndarray]) -> Iterator[Notice]:
    """Warnings of a source that has too little left when the walk begins, and of dry ice in it."""
    source, needed = built.scenario.supply.source, built.scenario.supply.pressure
    if source is None:
        return
    pressure = columns.get(f"store/{SOURCE}/pressure")
    temperature = columns.get(f"store/{SOURCE}/temperature")
    name = source.name or source.kind
    if pressure is not None and columns["time"][0] <= built.scenario.timestep and pressure[0] < needed:
        yield Notice(
            "source-short",
            "{subject}: filling chambers and volumes before the first step leaves {left:.2g} bar in {name}, "
            "but {needed:g} bar are needed: take a larger source, smaller volumes, or fill the volumes from "
            "elsewhere",
            subject=SOURCE,
            name=name,
            left=1e-5 * float(pressure[0]),
            needed=1e-5 * needed,
        )
    if temperature is not None and source.real_gas.liquefies and (temperature < TRIPLE_TEMPERATURE).any():
        yield Notice(
            "source-freezes",
            "{subject}: {name} is below {triple:g} K from {begun:.3g} s on, where carbon dioxide turns to "
            "dry ice: its pressure and all that depends on it are no longer valid",
            subject=SOURCE,
            name=name,
            triple=TRIPLE_TEMPERATURE,
            begun=float(columns["time"][np.argmax(temperature < TRIPLE_TEMPERATURE)]),
        )
