"""Metrics in a clinician's words: what each is called, what it means, how its number is written."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from afo_sim.metrics.metric import Metric

UNITS = {"N*m": "N·m", "percent": "%", "deg": "°", "deg/s": "°/s"}
DIGITS = {"mm": 1, "deg": 1, "percent": 1, "N*m": 2, "J/kg": 4, "W/kg": 3, "deg/s": 0, "bar": 2}
DIGITS |= {"g": 3, "l": 3, "s": 3, "": 0}

CLEARANCE, CONTACT, ANKLE = "Clearance in swing", "Initial contact and loading", "Angle"
NEED, TORQUE, WORK, AIR = (
    "Torque needed",
    "Torque of the orthosis",
    "Work of the orthosis",
    "Air and pressure",
)
TIME, OTHER = "Walking", "Further"
GROUPS = (TIME, CLEARANCE, CONTACT, ANKLE, NEED, TORQUE, WORK, AIR, OTHER)


@dataclass(frozen=True)
class Words:
    """What a metric belongs to, its name for people, and what it means."""

    group: str
    label: str
    meaning: str = ""


_DIP = (
    "least height in swing: the minimum between two peaks, else the lowest of mid-swing; below zero is a trip"
)
_SHARE = "of the recorded healthy ankle's whole internal moment, each at its peak"
WORDS = {
    "strides_counted": Words(
        TIME, "Strides counted", "the first ones are left out: the start, and until the air has settled"
    ),
    "stride_time": Words(TIME, "Stride time", "heel strike to the same foot's next"),
    "stance": Words(TIME, "Stance", "heel strike to toe-off, of the stride"),
    "toe_clearance": Words(CLEARANCE, "Toe clearance", _DIP),
    "toe_clearance_phase": Words(CLEARANCE, "Toe clearance, when", "of the gait cycle"),
    "toe_clearance_to_recorded": Words(
        CLEARANCE, "Toe clearance less the healthy trial's", "the same foot with the recorded ankle angle"
    ),
    "lowest_toe_clearance": Words(CLEARANCE, "Toe clearance, lowest stride"),
    "swings_with_toe_contact": Words(CLEARANCE, "Swings in which the toe touches", "clearance below zero"),
    "swings_without_toe_dip": Words(CLEARANCE, "Swings without a minimum of the toe", "between two peaks"),
    "ball_clearance": Words(CLEARANCE, "Ball clearance", "of the ball of the foot, likewise"),
    "ball_clearance_phase": Words(CLEARANCE, "Ball clearance, when", "of the gait cycle"),
    "ball_clearance_to_recorded": Words(
        CLEARANCE, "Ball clearance less the healthy trial's", "the same foot with the recorded ankle angle"
    ),
    "lowest_ball_clearance": Words(CLEARANCE, "Ball clearance, lowest stride"),
    "swings_with_ball_contact": Words(CLEARANCE, "Swings in which the ball touches", "clearance below zero"),
    "swings_without_ball_dip": Words(CLEARANCE, "Swings without a minimum of the ball", "between two peaks"),
    "foot_pitch_at_contact": Words(
        CONTACT, "Foot pitch at initial contact", "sole to floor, toe up positive"
    ),
    "contacts_with_heel": Words(CONTACT, "Strides that begin with the heel", "pitch above 8°"),
    "contacts_with_flat": Words(CONTACT, "Strides that begin flat", "pitch from −1.6° to 8°"),
    "contacts_with_forefoot": Words(CONTACT, "Strides that begin with the forefoot", "pitch below −1.6°"),
    "foot_slap_velocity": Words(
        CONTACT, "Foot slap", "highest plantarflexion velocity as the foot comes down after heel strike"
    ),
    "peak_swing_dorsiflexion": Words(ANKLE, "Peak dorsiflexion in swing", "dorsiflexion positive"),
    "mid_swing_angle": Words(ANKLE, "Ankle angle at mid-swing", "half-way from toe-off to heel strike"),
    "ankle_range": Words(ANKLE, "Ankle range", "highest less lowest angle of the stride"),
    "angle_error_recorded": Words(ANKLE, "Distance from the healthy trial (RMSE)", "over the whole stride"),
    "angle_error_norm": Words(ANKLE, "Distance from the norm (RMSE)", "adults' published mean"),
    "gvs_recorded": Words(ANKLE, "Gait variable score against the healthy trial", "RMS over 51 points"),
    "gvs_norm": Words(ANKLE, "Gait variable score against the norm", "RMS over 51 points"),
    "needed_dorsiflexion_torque": Words(
        NEED, "Dorsiflexion torque needed, peak", "healthy ankle's active moment less what the patient gives"
    ),
    "needed_plantarflexion_torque": Words(NEED, "Plantarflexion torque needed, peak", "likewise"),
    "needed_swing_torque": Words(NEED, "Dorsiflexion torque needed in swing, peak", "likewise"),
    "orthosis_peak_dorsiflexion_torque": Words(TORQUE, "Dorsiflexion torque, peak"),
    "orthosis_mean_dorsiflexion_torque": Words(TORQUE, "Dorsiflexion torque, mean", "over the stride"),
    "orthosis_peak_plantarflexion_torque": Words(TORQUE, "Plantarflexion torque, peak"),
    "orthosis_mean_plantarflexion_torque": Words(TORQUE, "Plantarflexion torque, mean", "over the stride"),
    "share_of_dorsiflexion_moment": Words(TORQUE, "Share of the biological dorsiflexion moment", _SHARE),
    "share_of_plantarflexion_moment": Words(TORQUE, "Share of the biological plantarflexion moment", _SHARE),
    "torque_covered": Words(TORQUE, "Needed torque covered", "of its integral over the stride"),
    "torque_missing": Words(TORQUE, "Torque missing, peak", "need that the orthosis leaves open"),
    "torque_unneeded": Words(TORQUE, "Torque not needed, peak", "beyond the need or against it"),
    "orthosis_positive_work": Words(WORK, "Positive work", "given to the ankle per stride and body mass"),
    "orthosis_negative_work": Words(WORK, "Negative work", "taken from the ankle per stride and body mass"),
    "orthosis_peak_power": Words(WORK, "Peak power given"),
    "orthosis_peak_absorption": Words(WORK, "Peak power taken"),
    "share_of_positive_work": Words(
        WORK, "Share of biological positive work", "of the recorded healthy ankle's"
    ),
    "air_per_stride": Words(AIR, "Air per stride", "taken from the supply"),
    "free_air_per_stride": Words(
        AIR, "Normal litres per stride", "at 1 bar, 20 °C, 65 % humidity (ISO 8778)"
    ),
    "range_of_motion": Words(ANKLE, "Range of motion"),
    "rise_time": Words(ANKLE, "Rise time", "from 10 % to 90 % of the way up"),
    "air_per_cycle": Words(AIR, "Air per cycle", "taken from the supply"),
}
OF_CHAMBER = {
    "air_per_stride_": "Air per stride, {}",
    "air_per_cycle_": "Air per cycle, {}",
    "peak_pressure_": "Peak pressure, {}",
    "lowest_pressure_": "Lowest pressure, {}",
}


def words(name: str) -> Words:
    """What a metric is called; a metric that is not known is called by its name."""
    if name in WORDS:
        return WORDS[name]
    for prefix, label in OF_CHAMBER.items():
        if name.startswith(prefix):
            meaning = "gauge" if "pressure" in prefix else ""
            return Words(AIR, label.format(name.removeprefix(prefix)), meaning)
    way = re.fullmatch(r"peak_(\w+)_(angle|torque)", name)  # of a leg that names its directions
    if way:
        label = f"{way[1].replace('_', ' ').capitalize()} {way[2]}, peak"
        return Words(TORQUE if way[2] == "torque" else ANKLE, label)
    return Words(OTHER, name.replace("_", " "))


def unit(metric: Metric) -> str:
    """Its unit as people write it."""
    return UNITS.get(metric.unit, metric.unit)


def number(value: float, in_unit: str, signed: bool = False) -> str:
    """A value with as many digits as its unit deserves, and a true minus sign."""
    if not math.isfinite(value):
        return "–"
    digits = DIGITS.get(in_unit)
    text = f"{value:+.4g}" if digits is None else f"{round(value, digits) + 0.0:+.{digits}f}"
    if not signed or not text.strip("+-0."):
        text = text.removeprefix("+")
    return text.replace("-", "−")


def plain(text: str) -> str:
    """A name as a figure can show it: no mathematics, no characters that the font lacks."""
    shown = "".join(c if c.isprintable() and ord(c) < 0x250 else "?" for c in text)
    shown = shown if len(shown) <= 34 else shown[:33] + "…"
    return (f" {shown}" if shown.startswith("_") else shown).replace("$", r"\$")


def in_short(metrics: Mapping[str, Metric]) -> list[str]:
    """What matters most of a walking run, as sentences; none of other runs."""
    said = []
    for name, point in (("toe_clearance", "toe"), ("ball_clearance", "ball of the foot")):
        if name in metrics:
            off = metrics[f"{name}_to_recorded"].value
            than = f"{abs(off):.0f} mm {'higher' if off >= 0.0 else 'lower'} than in the healthy trial"
            than = "as in the healthy trial" if abs(off) < 0.5 else than
            said.append(f"In swing the {point} passes {_height(metrics[name].value)}, {than}.")
    parts = {"heel": "with the heel", "flat": "with a flat foot", "forefoot": "with the forefoot"}
    shares = {
        how: metrics[f"contacts_with_{k}"].value
        for k, how in parts.items()
        if f"contacts_with_{k}" in metrics
    }
    begun = {how: share for how, share in shares.items() if share > 0.0}
    if len(begun) == 1:
        said.append(f"Every stride begins {next(iter(begun))}.")
    elif begun:
        said.append(f"Strides begin {', '.join(f'{share:.0f} % {how}' for how, share in begun.items())}.")
    if "mid_swing_angle" in metrics:
        angle = metrics["mid_swing_angle"].value
        side = "dorsiflexion" if angle >= 0.0 else "plantarflexion"
        said.append(f"In mid-swing the ankle stands at {number(abs(angle), 'deg')}° of {side}.")
    if "torque_covered" in metrics:
        covered, air = metrics["torque_covered"].value, metrics["air_per_stride"].value
        said.append(
            f"The orthosis gives {covered:.0f} % of the torque that the patient lacks and takes "
            f"{number(air, 'g')} g of air per stride."
        )
    return said


def _height(millimetres: float) -> str:
    side = "above" if millimetres >= 0.0 else "below"
    return f"{abs(millimetres):.0f} mm {side} the floor"
