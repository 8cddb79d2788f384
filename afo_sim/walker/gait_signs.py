"""Signs of a gait in clinical terms, by rules on its numbers and the norm's at its speed."""

import math
from collections.abc import Mapping

from afo_sim.common import JsonDict
from afo_sim.walker.respond import Case
from afo_sim.walker.strides import HEEL_FIRST, SPREAD, norm_at, shape, sole_tilt

OFF = 1.5 * math.degrees(SPREAD)  # 1.5 SD off the norm, a deviation by the Edinburgh Visual Gait Score [deg]
FOREFOOT_FIRST = -1.6  # pitch of the sole below which the forefoot lands first [deg]
_LIFTED = ("thigh_max", 1, OFF, 1.0), ("knee_max", 1, OFF, 1.0)
_HANGS = ("ankle_swing", -1, -OFF, 1.0)
# shown where each number is above (1), below (-1) a bound and a share of the norm's; sources: docs/walker.md
SIGNS: dict[str, tuple[tuple[str, int, float, float], ...]] = {
    "steppage": (*_LIFTED, _HANGS),
    "high step": (*_LIFTED, ("ankle_swing", 1, -OFF, 1.0)),
    "foot drop": (_HANGS,),
    "dorsiflexed swing": (("ankle_swing", 1, OFF, 1.0),),
    "toe drag": (("scuffs", 1, 0.5, 0.0),),
    "stiff knee": (("knee_max", -1, 40.0, 0.0),),
    "equinus": (("ankle_stance_max", -1, 0.0, 0.0),),
    "crouch": (("knee_mid_stance", 1, 19.0, 0.0),),
    "forefoot contact": (("pitch_contact", -1, FOREFOOT_FIRST, 0.0),),
    "flat contact": (("pitch_contact", 1, FOREFOOT_FIRST, 0.0), ("pitch_contact", -1, HEEL_FIRST, 0.0)),
    "slap": (("foot_fall", 1, 0.0, 2.0),),
    "vaulting": (("ankle_mid_stance", -1, -3.0, 0.0),),
    "weak push-off": (("push_off_peak", -1, 0.0, 0.5),),
    "forward lean": (("trunk_forward", 1, 10.0, 0.0),),
    "backward lean": (("trunk_forward", -1, -10.0, 0.0),),
}


def shown(own: Mapping[str, float], norm: Mapping[str, float]) -> list[str]:
    """Names of the signs that a leg's numbers show against the norm's; unknown numbers give none."""

    def beyond(name: str, way: int, bound: float, share: float) -> bool:
        return way * (own.get(name, math.nan) - bound - (share and share * norm.get(name, math.nan))) > 0.0

    return [sign for sign, rules in SIGNS.items() if all(beyond(*rule) for rule in rules)]


def signs_of(case: Case) -> list[JsonDict] | None:
    """Signs of "right", "left" leg, "trunk" with numbers and the norm's, plain data; None without strides."""
    if not math.isfinite(speed := case.numbers["speed"]):
        return None
    body, found = case.walked.body, []
    curves = norm_at(round(speed, 2), body.size.taller)
    for leg in ("right", "left", "trunk"):
        tilt = sole_tilt(body, leg)  # by which a worn sole's foot points down from the norm's
        norm = shape(
            curves | {"ankle": curves["ankle"] - tilt}, float(curves["duration"]), math.degrees(tilt)
        )
        own = {name.removeprefix(f"{leg}/"): x for name, x in case.numbers.items() if name.startswith(leg)}
        for sign in shown(own, norm):
            pairs = {name: {"own": own[name], "norm": norm.get(name)} for name, *_ in SIGNS[sign]}
            found.append({"sign": sign, "leg": leg, "numbers": pairs})
    return found
