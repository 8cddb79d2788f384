"""How well a colour is seen on its ground: the contrast ratio of WCAG 2.2."""

TEXT, MARK = 4.5, 3.0  # least contrast ratios: of text (level AA, 1.4.3), of lines and marks (1.4.11)
STEP = 0.97  # by which a colour is darkened at a time


def luminance(colour: str) -> float:
    """Relative luminance of an sRGB colour, 0 of black to 1 of white [-].

    Source: WCAG 2.2, "relative luminance".
    """
    from matplotlib.colors import to_rgb

    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in to_rgb(colour)]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def ratio(one: str, other: str = "white") -> float:
    """Contrast ratio of two sRGB colours, (brighter + 0.05)/(darker + 0.05), 1 to 21 [-]."""
    brighter, darker = sorted((luminance(one), luminance(other)), reverse=True)
    return (brighter + 0.05) / (darker + 0.05)


def ink(colour: str) -> str:
    """A line's colour, darkened as far as words in it on white need it."""
    from matplotlib.colors import to_hex, to_rgb

    shade = colour
    while ratio(shade) < TEXT:
        shade = to_hex([STEP * part for part in to_rgb(shade)])
    return shade
