"""Numbers of a verdict in words: heights, durations, lists of strides."""

from collections.abc import Sequence


def lasting(seconds: float) -> str:
    if seconds < 60.0:
        return f"{seconds:.0f} s" if seconds >= 10.0 else f"{seconds:.1f} s"
    if seconds >= 6000.0:
        return f"{seconds / 3600.0:.1f} h"
    return f"{seconds / 60.0:.0f} min" if seconds >= 600.0 else f"{seconds / 60.0:.1f} min"


def three(value: float) -> str:
    """Whole from 100 on, three digits below."""
    return f"{value:.0f}" if value >= 99.95 else f"{value:.3g}"


def numbered(keys: Sequence[int]) -> str:
    """Strides counted from the start: "stride 3", "strides 1 to 3 and 7"; key 0 is the first."""
    numbers = sorted(k + 1 for k in keys)
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][1] + 1:
            runs[-1][1] = number
        else:
            runs.append([number, number])
    stated = [f"{a}" if a == b else f"{a} {'and' if b == a + 1 else 'to'} {b}" for a, b in runs]
    return f"stride{'s' if len(numbers) > 1 else ''} {listed(stated)}"


def listed(parts: Sequence[str]) -> str:
    return " and ".join(filter(None, [", ".join(parts[:-1]), *parts[-1:]]))


def capital(text: str) -> str:
    return text[0].upper() + text[1:]


def millimetres(height: float) -> str:
    return f"{in_digits(round(height, 1) + 0.0, '.1f')} mm"


def in_digits(value: float, form: str = "g") -> str:
    return f"{value:{form}}".replace("-", "−")


def clean(value: float) -> float:
    """A limit without the last digits of its conversion."""
    return round(value, 9) + 0.0
