"""Colours of figures are seen on white, and told apart by readers without red, green or blue cones too."""

import itertools

import pytest
from colour_vision import VISIONS, contrast, difference, nearest

from afo_sim.show import style
from afo_sim.show.style import ink, ratio

APART = {"all cones": 0.15, "no green": 0.10, "no red": 0.10, "no blue": 0.095}  # least distances in OKLab
TWO_COLOURS = 5.0  # CIE 1976, from which on an observer sees two colours: Mokrzycki & Tatol 2011
NOTICED = 2.3  # CIE 1976, just noticeable: Mahy, Van Eycken & Oosterlinck 1994


def test_the_measures_are_those_of_their_definitions() -> None:
    """Black on white has the contrast 21; red is nearer to green without green cones."""
    assert contrast("#000") == pytest.approx(21.0)
    assert contrast("#777777") == pytest.approx(4.48, abs=0.01)
    assert nearest(["#000000", "#ffffff"], "all cones") == pytest.approx(1.0, abs=1e-3)
    assert difference("#000000", "#ffffff", "all cones") == pytest.approx(100.0, abs=0.1)
    assert difference("#ff0000", "#00ff00", "all cones") == pytest.approx(170.57, abs=0.1)
    assert nearest(["#c04040", "#408040"], "no green") < 0.5 * nearest(["#c04040", "#408040"], "all cones")


@pytest.mark.parametrize("colour", [*style.COLOURS, style.GREY])
def test_lines_stand_out_and_their_words_are_read(colour: str) -> None:
    assert contrast(colour) >= 3.0
    assert contrast(ink(colour)) >= 4.5
    assert ratio(colour) == pytest.approx(contrast(colour), rel=1e-12)


@pytest.mark.parametrize("vision", VISIONS)
@pytest.mark.parametrize(
    "drawn",
    [style.COLOURS, style.RUNS, tuple(style.MOMENTS.values()), (*style.COLOURS, "#000000", style.GREY)],
)
def test_no_two_colours_of_one_panel_are_alike(drawn: tuple[str, ...], vision: str) -> None:
    assert nearest(drawn, vision) >= APART[vision]
    assert min(difference(a, b, vision) for a, b in itertools.combinations(drawn, 2)) > 2.0 * TWO_COLOURS


def test_colour_is_not_alone_in_telling_lines_apart() -> None:
    grey = [f"#{3 * f'{round(255 * style.luminance(c) ** (1 / 2.2)):02x}'}" for c in style.RUNS]
    assert min(difference(a, b, "all cones") for a, b in itertools.combinations(grey, 2)) < NOTICED
    assert len({str(each) for each in style.RUN_STYLES}) == len(style.RUNS)  # so dashes tell them in grey
    assert len(set(style.MARKERS)) == len(style.COLOURS)
    looks = [str(style.MOMENT_STYLES.get(name, "-")) for name in style.MOMENTS]
    told = [(colour, look) for colour, look in zip(style.MOMENTS.values(), looks, strict=True)]
    assert len(set(told)) == len(told) and len(set(looks)) >= len(looks) - 1


def test_a_scale_is_dark_enough_throughout() -> None:
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        assert contrast(to_hex(colormaps[style.SCALE](share * style.SCALE_END))) >= 3.0
