"""Colours of figures are seen on white, and told apart by readers without red or green cones too."""

import pytest
from colour_vision import VISIONS, contrast, nearest

from afo_sim.show import style
from afo_sim.show.style import ink, ratio

APART = {"all cones": 0.15, "no green": 0.10, "no red": 0.10}  # least distances in OKLab


def test_the_measures_are_those_of_their_definitions() -> None:
    """Black on white has the contrast 21; red is nearer to green without green cones."""
    assert contrast("#000") == pytest.approx(21.0)
    assert contrast("#777777") == pytest.approx(4.48, abs=0.01)
    assert nearest(["#000000", "#ffffff"], "all cones") == pytest.approx(1.0, abs=1e-3)
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


def test_colour_is_not_alone_in_telling_lines_apart() -> None:
    assert len({str(each) for each in style.RUN_STYLES}) == len(style.RUNS)
    assert len(set(style.MARKERS)) == len(style.COLOURS)
    looks = [str(style.MOMENT_STYLES.get(name, "-")) for name in style.MOMENTS]
    told = [(colour, look) for colour, look in zip(style.MOMENTS.values(), looks, strict=True)]
    assert len(set(told)) == len(told) and len(set(looks)) >= len(looks) - 1


def test_a_scale_is_dark_enough_throughout() -> None:
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        assert contrast(to_hex(colormaps[style.SCALE](share * style.SCALE_END))) >= 3.0
