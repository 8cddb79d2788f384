"""The picture of an air path: its numbers are the description's, words and lines stand apart."""

import itertools
import pathlib
import random
from typing import Any

import numpy as np
import pytest
from colour_vision import contrast
from command import call
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

import afo_sim as afo
from afo_sim.description import AMBIENT
from afo_sim.model import AirEdge, AirScheme, conductance
from afo_sim.model.air_scheme import AirNode
from afo_sim.show import scheme_of, style, ways
from afo_sim.show.air_drawing import NARROW, THIN, WIDE, Layout, label, layout, page
from afo_sim.show.style import ink

S1 = pathlib.Path(__file__).parents[2] / "models/orthoses/s1"
SMALLEST = 5.5  # letters [points]
LITRE = 1e-8  # m³/(s·Pa) in a dm³/(s·bar)
MANIFOLD = "manifold_of_the_waist_belt_behind_the_back"
THIRD = f"""
[chamber.peroneus_longus_of_the_right_leg]
inlet = "mha2"
tube = "pun_6x4"
tube_length = "1.2 m"
wall_conductance = "0.3 W/K"
feed = "{MANIFOLD}"
exhaust = "collector"
[volume.{MANIFOLD}]
volume = "20 ml"
[volume.reservoir]
volume = "0.4 l"
[volume.collector]
volume = "5 ml"
[restriction.check]
kind = "check_valve"
conductance = "0.5 dm^3/(s*bar)"
critical_ratio = 0.3
cracking_pressure = "0.05 bar"
upstream = "supply"
downstream = "reservoir"
[restriction.feed]
kind = "tube"
tube = "pun_4x2_5"
length = "1 m"
upstream = "reservoir"
downstream = "{MANIFOLD}"
[restriction.silencer]
kind = "silencer"
conductance = "1 dm^3/(s*bar)"
critical_ratio = 0.3
upstream = "collector"
[restriction.seam]
kind = "leak"
conductance = "0.0005 dm^3/(s*bar)"
upstream = "dorsiflexor"
"""


def flow(kind: str, upstream: str, downstream: str = AMBIENT, c: float = 0.3, **more: Any) -> dict[str, Any]:
    """A restriction with a conductance [dm³/(s·bar)]."""
    rated = {"conductance": f"{c} dm^3/(s*bar)", "critical_ratio": 0.3}
    return {"kind": kind, "upstream": upstream, "downstream": downstream, **rated, **more}


KINDS: dict[str, Any] = {  # every kind of restriction, a cartridge, two regulators, air that is taken up
    "supply.source": "co2_16g",
    "supply.regulator": "droop_tenth",
    "supply.pressure": "6 bar",
    "orthosis.volume": {name: {"volume": "20 ml"} for name in ("low", "front", "rear", "dump")},
    "orthosis.restriction": {
        "second": {
            "kind": "regulator",
            "regulator": "droop_tenth",
            "pressure": "4 bar",
            "upstream": "supply",
            "downstream": "low",
        },
        "quick": flow("quick_exhaust", "front", "dorsiflexor", exhaust_conductance="0.9 dm^3/(s*bar)"),
        "slow": flow("throttle", "low", "rear", 0.03, check_conductance="0.3 dm^3/(s*bar)"),
        "purge": {"kind": "valve", "valve": "mpye_m5", "upstream": "low"},
        "link": {
            "kind": "tube",
            "tube": "pun_4x2_5",
            "length": "0.2 m",
            "upstream": "low",
            "downstream": "front",
        },
        "muffler": flow("silencer", "dump"),
        "equaliser": flow("orifice", "plantarflexor", "dorsiflexor", 0.01),
        "seam": flow("leak", "low", c=0.001),
    },
    "orthosis.chamber.dorsiflexor.feed": "front",
    "orthosis.chamber.dorsiflexor.exhaust": "dump",
    "orthosis.chamber.dorsiflexor.inlet": "mpye_m5",
    "orthosis.chamber.plantarflexor.feed": "rear",
    "orthosis.chamber.plantarflexor.exhaust": "dorsiflexor",
}
PUMP: dict[str, Any] = {
    "supply.source": "vn_c4",
    "supply.pressure": "1 bar",
    "orthosis.chamber.dorsiflexor": {"inlet": "mha2", "tube_volume": "4 ml", "wall_conductance": "0.5 W/K"},
    "timer.dorsiflexor.outlet": [],
}
CASES = ("s1", "s1_waist", "arm_s1", "pump", "kinds", "three")


def three(folder: pathlib.Path) -> pathlib.Path:
    """An orthosis of three chambers and long names: reservoir, manifold, tubes, a collector of exhausts."""
    text = (S1 / "orthosis.toml").read_text(encoding="utf-8")
    for part in ("cuff", "plate"):
        text = text.replace(f'"{part}.xml"', f'"{S1 / part}.xml"')
    muscle = text[text.index("[muscle.plantarflexor]") : text.index("[chamber.")]
    text += "\n" + muscle.replace("plantarflexor", "peroneus_longus_of_the_right_leg", 1) + THIRD
    for name in ("dorsiflexor", "plantarflexor"):
        text = text.replace(f"[chamber.{name}]", f'[chamber.{name}]\nfeed = "{MANIFOLD}"')
    text = text.replace("[chamber.dorsiflexor]", '[chamber.dorsiflexor]\nexhaust = "collector"')
    (folder / "orthosis.toml").write_text(text)
    return folder


def scheme_named(name: str, folder: pathlib.Path) -> AirScheme:
    if name in ("kinds", "pump"):
        return scheme_of(afo.load("scenario", "seated", KINDS if name == "kinds" else PUMP))
    return scheme_of(three(folder) if name == "three" else name)


def any_scheme(random: random.Random) -> AirScheme:
    """Chambers, volumes and parts that hang together as chance will have it."""
    volumes, chambers = ([f"{k}{n}" for n in range(random.randint(1, 5))] for k in ("volume", "chamber"))
    nodes = {"supply": AirNode("supply", "supply")}
    nodes |= {name: AirNode("volume", name) for name in volumes}
    edges = []
    for name in chambers:
        others = [*volumes, *(other for other in chambers if other != name)]
        feed, exhaust = random.choice(["supply", *others]), random.choice([AMBIENT, *others])
        end = f"{name} end" if random.random() < 0.5 else name
        if end != name:
            nodes[end] = AirNode("point", "valve end")
            edges.append(AirEdge("tube", f"{name} tube", "tube", end, name, 1e-9, 1e-9, 0.3))
        nodes[name] = AirNode("chamber", name)
        valve, c = ("valve_3_2" if random.random() < 0.3 else "valve"), 1e-9
        way = {"exhaust": exhaust, "venting": c} if valve == "valve_3_2" else {}
        edges.append(AirEdge(valve, f"{name} inlet", "in", feed, end, c, c, 0.3, way="inlet", **way))
        if not way:
            edges.append(AirEdge(valve, f"{name} outlet", "out", end, exhaust, c, c, 0.3, way="outlet"))
    for k in range(random.randint(0, 8)):
        a, b = random.sample(["supply", AMBIENT, *volumes, *chambers], 2)
        kind = random.choice(["tube", "orifice", "check_valve", "valve", "leak", "throttle"])
        back = 0.0 if kind == "check_valve" else 1e-9
        edges.append(AirEdge(kind, f"part {k}", "part", a, b, 1e-9, back, 0.3))
    nodes[AMBIENT] = AirNode("ambient", "ambient air")
    return AirScheme("any", "", nodes, {edge.name: edge for edge in edges}, "supply")


@pytest.fixture(scope="module", params=CASES)
def drawn(request: Any, tmp_path_factory: pytest.TempPathFactory) -> tuple[AirScheme, Layout, Figure]:
    scheme = scheme_named(request.param, tmp_path_factory.mktemp("own"))
    size, fill = page(scheme)
    with rc_context(style.STYLE):
        figure = Figure(figsize=size)
        FigureCanvasAgg(figure)
        fill(figure)
        figure.canvas.draw()
    return scheme, layout(scheme), figure


def test_words_are_within_the_page_large_enough_and_apart(drawn: tuple[AirScheme, Layout, Figure]) -> None:
    figure = drawn[2]
    width, height = figure.canvas.get_width_height()  # type: ignore[attr-defined]
    texts = [text for text in (*figure.texts, *figure.axes[0].texts) if text.get_text()]
    found = [(text.get_text(), text.get_window_extent()) for text in texts]
    for text, box in found:
        assert box.x0 >= 0 and box.y0 >= 0 and box.x1 <= width and box.y1 <= height, text
    for (one, a), (other, b) in itertools.combinations(found, 2):
        assert not a.padded(-0.5).overlaps(b.padded(-0.5)), (one, other)
    assert all(text.get_fontsize() >= SMALLEST for text in texts)


def test_words_are_within_their_boxes(drawn: tuple[AirScheme, Layout, Figure]) -> None:
    _, found, figure = drawn
    axis = figure.axes[0]
    texts = iter([text for text in axis.texts if text.get_text()])
    for box in found.boxes.values():
        middle, half = np.array([box.x, box.y]), 0.5 * np.array([box.width, box.height])
        (x0, y0), (x1, y1) = axis.transData.transform([middle - half, middle + half])
        for line in box.lines:
            text = next(texts)
            extent = text.get_window_extent()
            assert text.get_text() == line
            assert x0 <= extent.x0 and extent.x1 <= x1 and y0 <= extent.y0 + 1 and extent.y1 - 1 <= y1


def check(scheme: AirScheme, found: Layout) -> None:
    """Boxes are apart, no line meets one but at its own ends, and every line has an end of its own."""
    assert found.boxes.keys() == {*scheme.nodes, *scheme.edges} - {AMBIENT}
    for a, b in itertools.combinations(found.boxes.values(), 2):
        apart = abs(a.x - b.x) - 0.5 * (a.width + b.width), abs(a.y - b.y) - 0.5 * (a.height + b.height)
        assert max(apart) > 0.05, (a, b)
    joined = {(end, edge.name) for edge in scheme.edges.values() for end in edge.ends if end != AMBIENT}
    assert {(node, edge) for node, edge, *_ in found.lines} == joined
    for node, edge, (x0, y0), (x1, y1) in found.lines:
        for name, x, y in ((node, x0, y0), (edge, x1, y1)):
            box = found.boxes[name]
            assert abs(x - box.x) == pytest.approx(0.5 * box.width) and abs(y - box.y) < 0.5 * box.height
        left, right = sorted((x0, x1))
        for box in found.boxes.values():
            assert box.x + 0.5 * box.width < left + 1e-6 or box.x - 0.5 * box.width > right - 1e-6
    ends = [line[3] for line in found.lines]
    assert len(set(ends)) == len(ends)


def test_boxes_and_lines_are_apart(drawn: tuple[AirScheme, Layout, Figure]) -> None:
    check(drawn[0], drawn[1])


def test_layers_are_steps_from_the_source(tmp_path: pathlib.Path) -> None:
    found = layout(scheme_named("three", tmp_path)).boxes
    layers = sorted({box.x for box in found.values()})
    way = ("supply", "check", "reservoir", "feed", MANIFOLD, "dorsiflexor inlet", "dorsiflexor", "seam")
    assert [layers.index(found[name].x) for name in way] == list(range(8))


@pytest.mark.parametrize("seed", range(12))
def test_any_network_is_drawn(seed: int) -> None:
    scheme = any_scheme(random.Random(seed))
    check(scheme, layout(scheme))


def test_labels_tell_conductances_and_volumes(drawn: tuple[AirScheme, Layout, Figure]) -> None:
    scheme, found, _ = drawn
    for name, box in found.boxes.items():
        told = " ".join(box.lines)
        assert (box.lines, box.bold) == label(scheme, name)
        edge = scheme.edges.get(name)
        if edge is not None and np.isfinite(edge.forward):
            c = edge.back if edge.kind == "throttle" else edge.forward
            assert f"C {conductance(c)}, b {edge.ratio:.2g}" in told
        if edge is None:
            assert "".join(scheme.nodes[name].lines).replace(" ", "") in told.replace(" ", "")
        assert (NARROW in box.lines) == (name in scheme.narrowest)
    assert scheme.filling.keys() == scheme.venting.keys() != set()
    assert all(way.narrowest in scheme.edges for way in scheme.filling.values())


def test_the_narrowest_of_parts_in_series() -> None:
    """The way at the waist, computed anew: 0.5 m of 4 mm tube, a valve, 1 m of 2.5 mm tube."""
    scheme = afo.draw("s1_waist", view="air")
    orthosis = afo.load("orthosis", "s1_waist")
    chamber, feed = orthosis.chamber["dorsiflexor"], orthosis.restriction["feed"]
    assert feed.tube is not None and chamber.tube is not None and chamber.outlet is not None
    parts = [feed.tube.conductance(0.5), chamber.inlet.conductance, chamber.tube.conductance(1.0)]
    way = scheme.filling["dorsiflexor"]
    assert [name for name, _ in way.edges] == ["feed", "dorsiflexor inlet", "dorsiflexor tube"]
    assert way.conductance == pytest.approx((1.0 / np.square(parts)).sum() ** -0.5, rel=1e-12)
    assert way.narrowest == "dorsiflexor inlet" and parts[1] == min(parts)
    assert way.share == pytest.approx(parts[1] ** -2 / (1.0 / np.square(parts)).sum(), rel=1e-12)
    out = [chamber.tube.conductance(1.0), chamber.outlet.conductance, 1.0 * LITRE]
    assert scheme.venting["dorsiflexor"].conductance == pytest.approx(
        (1.0 / np.square(out)).sum() ** -0.5, rel=1e-12
    )
    wide = {f"orthosis.chamber.{c}.inlet": "vuvs_lt25" for c in ("dorsiflexor", "plantarflexor")}
    scheme = scheme_of(afo.load("scenario", "seated", {"orthosis": "s1_waist", **wide}))
    assert scheme.narrowest == {"dorsiflexor tube", "plantarflexor tube"}


def test_ways_heed_checks_and_third_ports(tmp_path: pathlib.Path) -> None:
    scheme = scheme_named("kinds", tmp_path)
    ways_in = {name: [edge for edge, _ in way.edges] for name, way in scheme.filling.items()}
    assert ways_in["plantarflexor"] == ["regulator of the supply", "second", "slow", "plantarflexor inlet"]
    slow = dict(scheme.filling["plantarflexor"].edges)["slow"]
    assert slow == pytest.approx(0.33 * LITRE)  # towards the muscle through throttle and check valve
    # The quick exhaust, 0.9, is wider than the outlet into the dump with its silencer.
    assert scheme.venting["dorsiflexor"].edges == (("quick", pytest.approx(0.9 * LITRE)),)
    pump = scheme_named("pump", tmp_path)
    assert [name for name, _ in pump.venting["dorsiflexor"].edges] == ["dorsiflexor inlet"]
    assert pump.origin == "source" and pump.nodes["source"].kind == "compressor"


def test_the_mark_does_not_hang_on_colour(drawn: tuple[AirScheme, Layout, Figure]) -> None:
    scheme, _, figure = drawn
    shown = [text.get_text() for text in figure.axes[0].texts].count(NARROW)
    assert shown == len(scheme.narrowest) >= 1
    assert contrast(ink(style.ORANGE)) >= 4.5 and WIDE > 1.5 * THIN


def test_exhausts_are_marked_and_arrows_lead_with_the_air(drawn: tuple[AirScheme, Layout, Figure]) -> None:
    scheme, _, figure = drawn
    triangles = [patch for patch in figure.axes[0].patches if len(patch.get_path().vertices) == 4]
    assert len(triangles) == sum(AMBIENT in edge.ends for edge in scheme.edges.values()) >= 1
    one_way = [edge for edge in scheme.edges.values() if edge.way or edge.back == 0.0]
    ends = [end for edge in one_way for end in {edge.downstream, edge.exhaust} - {AMBIENT, ""}]
    styles = [str(text.arrow_patch.get_arrowstyle()) for text in figure.axes[0].texts if not text.get_text()]
    assert sum("CurveFilledB" in style for style in styles) == len(ends)


@pytest.mark.slow
def test_files_and_what_the_command_tells(
    tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    code, printed, said = call(
        capsys, "draw", "s1_waist", "--view", "air", "--out", "a.png", "--out", "a.svg"
    )
    assert code == 0, said
    scheme = afo.draw("s1_waist", "a.pdf", view="air", pressure="3 bar")
    assert all(line in printed for line in ways(scheme))
    assert "3 bar" in scheme.nodes["supply"].lines
    with Image.open("a.png") as picture:
        assert picture.size == pytest.approx([200.0 * side for side in page(scheme)[0]], abs=2)
        assert picture.convert("RGB").getpixel((5, 5)) == (255, 255, 255)
    assert pathlib.Path("a.png").stat().st_size < 150_000
    assert pathlib.Path("a.pdf").read_bytes().startswith(b"%PDF")
    assert b"<svg" in pathlib.Path("a.svg").read_bytes()[:2000]
    assert call(capsys, "draw", "s1", "--view", "air")[0] == 0 and pathlib.Path("s1-air.pdf").is_file()
