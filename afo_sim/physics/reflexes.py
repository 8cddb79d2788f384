"""What a leg's reflexes ask of its muscles, by the state of its gait."""

from typing import Any, NamedTuple

from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.leg_muscle import LEAST_ACTIVATION

LEG_MUSCLES = ("hamstrings", "glutei", "iliopsoas", "vasti", "gastrocnemius", "soleus", "tibialis")
HAMSTRINGS, GLUTEI, ILIOPSOAS, VASTI, GASTROCNEMIUS, SOLEUS, TIBIALIS = range(7)
EARLY_STANCE, LATE_STANCE, LIFT_OFF, SWING, LANDING = range(5)
BALANCED = -0.105  # pitch of the trunk that the stance hip keeps [rad]
SHORT, MIDDLE, LONG = 0.005, 0.010, 0.020  # delays of hip and trunk, of the knee, of the ankle [s]


class Gains(NamedTuple):
    """Gains of a leg's reflexes, over greatest forces and optimal lengths.

    load : share of the body weight from which on a leg stands
    tibialis_length, tibialis_offset : k (l − l_0) in all states
    tibialis_soleus : k F of the soleus in all states
    soleus_force, gastrocnemius_force : k F in stance and lift-off
    vasti_force, vasti_start, knee_straight : k F + c in stance; c where a knee beyond that angle extends
    hamstrings_, glutei_, iliopsoas_ pitch, rate, start : c + k_p (−0.105 − θ) − k_d θ' in stance
    iliopsoas_lift, glutei_lift : constant in lift-off
    iliopsoas_length, iliopsoas_offset : k max(l − l_0, 0) in swing
    lean_offset, lean : k (θ_0 − θ) on the iliopsoas in swing
    stretch, stretch_offset : k max(l − l_0, 0) of the hamstrings on the iliopsoas in swing
    hamstrings_force, glutei_force : k F in swing
    tibialis_swing, hamstrings_swing, vasti_swing : constant in swing, landing too of the first
    tibialis_loading : constant in early stance
    soleus_, gastrocnemius_ start : constant from landing to lift-off
    soleus_, gastrocnemius_ length, offset : k max(l − l_0, 0) in stance and lift-off

    Source
    ------
    Geyer & Herr 2010, IEEE Trans. Neural Syst. Rehabil. Eng. 18(3), doi 10.1109/TNSRE.2010.2047592, as
    Geijtenbeek's SCONE 2.4 writes them (ControllerGH2010v12). The last ten are this project's: without the
    first three nothing that a wearer changes would lift a foot whose tibialis is dead, without the others
    the ankle does not move as people's.
    """

    load: int = 0
    tibialis_length: int = 1
    tibialis_offset: int = 2
    tibialis_soleus: int = 3
    soleus_force: int = 4
    gastrocnemius_force: int = 5
    vasti_force: int = 6
    vasti_start: int = 7
    knee_straight: int = 8
    hamstrings_pitch: int = 9
    hamstrings_rate: int = 10
    hamstrings_start: int = 11
    glutei_pitch: int = 12
    glutei_rate: int = 13
    glutei_start: int = 14
    iliopsoas_pitch: int = 15
    iliopsoas_rate: int = 16
    iliopsoas_start: int = 17
    iliopsoas_lift: int = 18
    glutei_lift: int = 19
    iliopsoas_length: int = 20
    iliopsoas_offset: int = 21
    lean_offset: int = 22
    lean: int = 23
    stretch: int = 24
    stretch_offset: int = 25
    hamstrings_force: int = 26
    glutei_force: int = 27
    tibialis_swing: int = 28
    hamstrings_swing: int = 29
    vasti_swing: int = 30
    tibialis_loading: int = 31
    soleus_start: int = 32
    soleus_length: int = 33
    soleus_offset: int = 34
    gastrocnemius_start: int = 35
    gastrocnemius_length: int = 36
    gastrocnemius_offset: int = 37


REFLEX = Gains()
GAINS = Gains._fields


class Nerve(NamedTuple):
    """What a leg's nerves carry: forces of its seven muscles, lengths of five, knee and trunk with rates."""

    force: int = 0
    tibialis_length: int = 7
    iliopsoas_length: int = 8
    hamstrings_length: int = 9
    knee: int = 10
    knee_rate: int = 11
    pitch: int = 12
    pitch_rate: int = 13
    soleus_length: int = 14
    gastrocnemius_length: int = 15


NERVE = Nerve()
NERVES = 16


@register_jitable
def next_state(
    state: int, load: float, other_load: float, ahead: float, other_ahead: float, threshold: float
) -> int:
    """The state of a leg's gait after a step.

    Parameters
    ----------
    state : early stance, late stance, lift-off, swing, landing
    load, other_load : on this foot and the other, over the body weight
    ahead, other_ahead : how far the centres of the feet are ahead of the trunk's [m]
    threshold : load from which on a leg stands

    Source
    ------
    The finite state machine of SCONE's GaitStateController (Geijtenbeek 2019, doi 10.21105/joss.01421).
    """
    if state == EARLY_STANCE and ahead < 0.0:
        state = LATE_STANCE
    if state <= LATE_STANCE and other_load > threshold and other_ahead > ahead:
        return LIFT_OFF
    if state == LIFT_OFF and load <= threshold:
        return SWING
    if state == SWING and ahead > 0.0:
        state = LANDING
    if state == LANDING and load > threshold:
        return EARLY_STANCE
    return state


@register_jitable
def _beyond(value: float, offset: float) -> float:
    return value - offset if value > offset else 0.0


@register_jitable
def excitations(state: int, g: Any, i: int, s: Any, out: Any, o: int, stride: int) -> None:
    """What the reflexes ask of a leg's muscles, within 0.01 and 1.

    Parameters
    ----------
    state : of the leg's gait
    g, i : gains, and where they begin
    s : what the nerves carry, each with its own delay, (16,)
    out, o, stride : where the seven excitations go, from a place on and so far apart
    """
    tibialis = g[i + REFLEX.tibialis_length] * (s[NERVE.tibialis_length] - g[i + REFLEX.tibialis_offset])
    tibialis += g[i + REFLEX.tibialis_soleus] * s[NERVE.force + SOLEUS]
    ham = glu = ili = vas = gas = sol = 0.0
    theta, rate = BALANCED - s[NERVE.pitch], -s[NERVE.pitch_rate]
    if state <= LIFT_OFF:
        sol = g[i + REFLEX.soleus_force] * s[NERVE.force + SOLEUS]
        sol += g[i + REFLEX.soleus_length] * _beyond(s[NERVE.soleus_length], g[i + REFLEX.soleus_offset])
        gas = g[i + REFLEX.gastrocnemius_force] * s[NERVE.force + GASTROCNEMIUS]
        gas += g[i + REFLEX.gastrocnemius_length] * _beyond(
            s[NERVE.gastrocnemius_length], g[i + REFLEX.gastrocnemius_offset]
        )
    if state == EARLY_STANCE:
        tibialis += g[i + REFLEX.tibialis_loading]
    if state != SWING:
        sol += g[i + REFLEX.soleus_start]
        gas += g[i + REFLEX.gastrocnemius_start]
    if state <= LATE_STANCE:
        vas = g[i + REFLEX.vasti_start]
        if not (s[NERVE.knee] > g[i + REFLEX.knee_straight] and s[NERVE.knee_rate] > 0.0):
            vas += g[i + REFLEX.vasti_force] * s[NERVE.force + VASTI]
        ham = g[i + REFLEX.hamstrings_start]
        ham += g[i + REFLEX.hamstrings_pitch] * theta + g[i + REFLEX.hamstrings_rate] * rate
        glu = (
            g[i + REFLEX.glutei_start] + g[i + REFLEX.glutei_pitch] * theta + g[i + REFLEX.glutei_rate] * rate
        )
        ili = g[i + REFLEX.iliopsoas_start]
        ili += g[i + REFLEX.iliopsoas_pitch] * theta + g[i + REFLEX.iliopsoas_rate] * rate
    elif state == LIFT_OFF:
        ili, glu = g[i + REFLEX.iliopsoas_lift], g[i + REFLEX.glutei_lift]
    else:
        ili = g[i + REFLEX.iliopsoas_length] * _beyond(
            s[NERVE.iliopsoas_length], g[i + REFLEX.iliopsoas_offset]
        )
        ili += g[i + REFLEX.lean] * (g[i + REFLEX.lean_offset] - s[NERVE.pitch])
        ili += g[i + REFLEX.stretch] * _beyond(s[NERVE.hamstrings_length], g[i + REFLEX.stretch_offset])
        ham = g[i + REFLEX.hamstrings_force] * s[NERVE.force + HAMSTRINGS]
        glu = g[i + REFLEX.glutei_force] * s[NERVE.force + GLUTEI]
        tibialis += g[i + REFLEX.tibialis_swing]
        if state == SWING:
            ham += g[i + REFLEX.hamstrings_swing]
        else:
            vas = g[i + REFLEX.vasti_swing]
    asked = (ham, glu, ili, vas, gas, sol, tibialis)
    for k in range(7):
        out[o + k * stride] = min(max(asked[k], LEAST_ACTIVATION), 1.0)
