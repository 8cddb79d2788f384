"""How a walker makes up for a foot that hangs: signs of it in a stride, and the stride without it.

What people of that size and speed do whose foot does not hang is read from the shipped family of healthy
adults, scaled at equal Froude number.
"""

import dataclasses
import functools
import math

import numpy as np

from afo_sim.common import Keywords, Notice, find_gait
from afo_sim.gait import family
from afo_sim.gait.checks import stance
from afo_sim.gait.cycle import DEGREE, GaitCycle
from afo_sim.gait.norm import PEOPLE, swing_off_norm
from afo_sim.gait.variants import Chain, scaled

_HEALTHY = "bovi2011_natural"  # of a family from 0.84 to 1.97 m/s; their ankle's path is derived
_JOINED = 0.15  # share of swing at either end, over which the ankle passes to and from the healthy one's [-]
_HARMONICS = 24  # that the passing over needs
_SHARES = np.linspace(0.2, 0.8, 61)  # of swing, in which the foot passes the floor
_LOW, _BENT, _FLEXED = 6.0 * DEGREE, 6.0 * DEGREE, 10.0 * DEGREE  # off healthy people; assumed [rad]
_RISEN = 0.04  # rise of the swinging hip beyond healthy people's [m]; assumed
STEPPAGE, LOW_ANKLE, HIP_RISES = "steppage", "ankle-low-in-swing", "hip-rises-in-swing"


@functools.lru_cache(maxsize=16)  # cases of a sweep share it
def healthy_stride(speed: float, body_height: float) -> GaitCycle:
    """The stride of healthy people of a height [m] at a speed [m/s], or the nearest that they walk at.

    Source: Bovi et al. 2011, Gait Posture 33(1):6-13, scaled after Hof 1996 (`scaled`).
    """
    file = find_gait(_HEALTHY)
    members = [cycle for _, cycle in family.family_of(file)]
    taller = body_height / (members[0].body_height or body_height)
    least, most = (math.sqrt(taller) * cycle.walking_speed for cycle in (members[0], members[-1]))
    return scaled(family.at_speed(file, min(max(speed, least), most), taller), taller)


@functools.lru_cache(maxsize=8)
def uncompensated(cycle: GaitCycle, body_height: float) -> GaitCycle:
    """The stride with hip, knee and path of healthy people of a height [m] under the ankle it has in swing.

    Both swings are laid on each other by their shares, toe-off to heel strike. Body and stride time stay.
    Near both ends of swing the ankle passes over to the healthy one's, so that the foot stands.
    """
    healthy = healthy_stride(cycle.walking_speed, body_height)
    lifted = stance(healthy)
    share = np.clip((healthy.phase - lifted) / (1.0 - lifted), 0.0, 1.0)
    end = np.clip(np.minimum(share, 1.0 - share) / _JOINED, 0.0, 1.0)
    own = _in_swing(cycle, "ankle_angle", share) - healthy.ankle_angle
    found = dataclasses.replace(
        healthy,
        ankle_angle=healthy.ankle_angle + end**2 * (3.0 - 2.0 * end) * own,
        side=cycle.side,
        stride_time=cycle.stride_time,
        body_mass=cycle.body_mass,
        walker=cycle.walker,
        harmonics=_HARMONICS,
    )
    vars(found)["flat"] = healthy.flat  # its ankle in stance is the same
    return found


def _in_swing(cycle: GaitCycle, name: str, share: np.ndarray) -> np.ndarray:
    """A kinematic signal at shares of swing (n,)."""
    lifted = stance(cycle)
    return cycle.signal(name, lifted + share * (1.0 - lifted))


@functools.lru_cache(maxsize=16)  # cases of a sweep share it
def signs(cycle: GaitCycle, body_height: float) -> tuple[Notice, ...]:
    """What the stride of a person of a height [m] shows of a foot that hangs, and of making up for it.

    Of one leg's sagittal stride: whether the leg swings round or the other foot rises on its toes cannot be
    told but by the hip's height.
    """
    healthy = healthy_stride(cycle.walking_speed, body_height)
    chain = Chain.of_height(body_height)

    def posture(of: GaitCycle) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        names = "shank_angle", "knee_angle", "ankle_angle", "ankle_z"
        shank, knee, ankle, height = (_in_swing(of, name, _SHARES) for name in names)
        *quiet, _, level = (of.signal(name, 0.25) for name in names)
        rise = (height + chain.hip(shank, knee)[1]) - (level + chain.hip(*quiet)[1])
        return ankle, knee, knee - shank, rise

    ankle, knee, hip, rise = (a - b for a, b in zip(posture(cycle), posture(healthy), strict=True))
    low, bent, flexed, risen = float(np.mean(ankle)), float(knee.max()), float(hip.max()), float(rise.max())
    if low > -_LOW:
        return ()
    code, seen = LOW_ANKLE, "it hangs, or its zero is off"
    if bent >= _BENT or flexed >= _FLEXED:
        code = STEPPAGE
        seen = "steppage, the knee is up to {bent:.0f}° and the hip up to {flexed:.0f}° more bent than theirs"
    elif risen >= _RISEN:
        code = HIP_RISES
        seen = "the hip is up to {risen:.0f} mm higher than theirs: vaulting, a raised pelvis or "
        seen += "circumduction, which one leg's sagittal stride does not tell apart"
    text = "in swing the ankle is {low:.0f}° lower than healthy people's of this height at {speed:.2g} m/s; "
    data: Keywords = {"speed": healthy.walking_speed, "low": -low / DEGREE, "bent": bent / DEGREE}
    data |= {"flexed": flexed / DEGREE, "risen": 1e3 * risen}
    return (Notice(code, text + seen, subject="swing", **data),)


def as_healthy(cycle: GaitCycle) -> tuple[Notice, ...]:
    """A doubt about a patient's own stride whose ankle swings as healthy people's: no device helps there."""
    beyond = swing_off_norm(cycle)[1]
    if beyond > PEOPLE:
        return ()
    text = "in swing the ankle moves as healthy people's does ({beyond:.0f} deg RMS off the norm's band; "
    text += "healthy people up to {limit:.0f}): is it the patient's own walk, without the device ({subject})?"
    return (Notice("trial-looks-healthy", text, subject="walker", limit=PEOPLE, beyond=beyond),)
