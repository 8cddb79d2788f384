"""The answers of a run that does not walk: does the device move the foot, does the skin bear it."""

from afo_sim.metrics.verdict import Answer, Limits, Numbers, at_least, has, skin_answer
from afo_sim.metrics.verdict_words import three

MOVE = "move"
_NEUTRAL = 0.0  # dorsiflexion of a foot in mid-swing: Perry & Burnfield 2010, Gait analysis [deg]


def seated_answers(metrics: Numbers, limits: Limits) -> tuple[Answer, ...]:
    """The answers of a run that does not walk; none where no ankle moves.

    Parameters
    ----------
    metrics : of the run
    limits : of the scenario [SI]
    """
    names = ("peak_plantarflexion_angle", "peak_dorsiflexion_angle", "peak_dorsiflexion_torque")
    if not all(has(metrics, name) for name in names):
        return ()
    down, up, torque = (metrics[name].value for name in names)
    brief = f"{_degrees(down)} to {_degrees(up)} of dorsiflexion, up to {torque:.3g} N·m"
    if has(metrics, "rise_time"):
        brief += f", in {three(metrics['rise_time'].value)} s"
    limit = f"wanted {_NEUTRAL:g}°, as in mid-swing; assumed"
    status, text = at_least(up, (_NEUTRAL, _NEUTRAL)), f"The foot moves from {brief}."
    moves = Answer(MOVE, "Does it lift the foot?", status, text, limit, f"{brief} (wanted {_NEUTRAL:g}°)")
    skin = skin_answer(metrics, True, limits)
    return (moves, skin) if skin.status != "unknown" else (moves,)


def _degrees(angle: float) -> str:
    return f"{angle:.1f}°".replace("-", "−")
