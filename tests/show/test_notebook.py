"""Every result as a notebook shows it: short texts, its picture, the answer above it."""

import base64
import dataclasses
import functools
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from campaign import NIGHTLY
from figures import leave_blank

import afo_sim as afo
from afo_sim.lab.validation import Validation
from afo_sim.simulation import Recording

SHORT = {"duration": "0.5 s"}
MOST = 5000  # bytes of the texts that a notebook shows of one result
POINTS = {
    "bore": "20 mm",
    "pressure [bar]": [1, 1, 2, 2, 3, 3],
    "contraction [-]": [0.0, 0.05, 0.0, 0.1, 0.0, 0.15],
    "force [N]": [253, 15, 500, 110, 755, 130],
}


@functools.cache
def sat() -> Recording:
    return afo.run("seated", {"duration": "1.5 s", "record_rate": "100 Hz"})


@functools.cache
def walked() -> Recording:
    return afo.run("walk-dropfoot-afo", {"timestep": "4 ms", "duration": "4 s"}, uncertainty=20)


@functools.cache
def bench() -> Any:
    return afo.stand("all", "dmsp_20", static=True)


def torques() -> dict[str, Any]:
    muscle = afo.load("muscle", "dmsp_20")
    angle, bar = np.tile(np.linspace(-30.0, 30.0, 7), 3), np.repeat([2.0, 3.0, 4.0], 7)
    path = 0.1 + 0.05 * np.radians(angle) / muscle.nominal_length
    force = muscle.force(1e5 * bar, contraction=path, series_stiffness="20 kN/m", offset="3 mm")
    return {"angle [deg]": angle, "pressure [bar]": bar, "torque [N*m]": 0.05 * force}


def log() -> dict[str, Any]:
    return {"time [s]": sat()["time"], "angle [deg]": np.round(np.degrees(sat()["ankle/angle"]), 1)}


PRESSURES = {"supply.pressure": ["2 bar", "4 bar"]}
ALL_METRICS = functools.partial(afo.sweep, "seated", PRESSURES, SHORT, threads=1)
LIMITS = ["peak_pressure_dorsiflexor >= 1 bar"]
SEARCH = {"generations": 2, "population": 4, "starts": 1, "threads": 1}
RESULTS: dict[str, tuple[Callable[[], Any], int]] = {  # what makes it, and how many pictures it has
    "seated": (sat, 1),
    "walk": (walked, 1),
    "metrics": (lambda: walked().metrics, 0),
    "strides": (lambda: walked().strides, 0),
    "columns": (lambda: walked().columns, 0),
    "resolved": (lambda: walked().described, 0),
    "parameters": (lambda: walked().parameters, 0),
    "both": (lambda: afo.both("walk-dropfoot-afo", sets={"timestep": "4 ms", "duration": "4 s"}), 1),
    "scenario": (lambda: afo.load("scenario", "walk-dropfoot-afo"), 0),
    "leg": (lambda: afo.load("leg", "adult_75kg"), 0),
    "orthosis": (lambda: afo.load("orthosis", "s1"), 1),
    "nameless": (lambda: afo.load("orthosis", "s1").with_values(name=""), 1),
    "muscle": (lambda: afo.load("muscle", "dmsp_20"), 1),
    "group": (lambda: afo.load("orthosis", "s1").muscle["dorsiflexor"], 0),
    "limits": (lambda: afo.load("limits", "usual"), 0),
    "built": (lambda: afo.build("walk-dropfoot-afo"), 0),
    "design": (lambda: afo.draw("s1"), 1),
    "facts": (lambda: afo.draw("s1").facts[0], 0),
    "air": (lambda: afo.draw("s1_waist", view="air"), 1),
    "imported": (lambda: afo.import_leg(afo.load("leg", "adult_75kg").file), 1),
    "attached": (lambda: afo.attach("adult_75kg", "s1"), 0),
    "sweep": (ALL_METRICS, 1),
    "search": (lambda: afo.optimise("seated", {"supply.pressure": ("2 bar", "4 bar")}, SHORT, **SEARCH,
                                    highest="range_of_motion", limits=LIMITS), 0),
    "size": (lambda: afo.size("pressure", "seated", {"duration": "1 s"}, limits=LIMITS, threads=1), 1),
    "effects": (lambda: afo.effects("walk-dropfoot-afo", {"timestep": "4 ms"}), 0),
    "stand": (bench, 3),
    "trial": (lambda: bench().trials[0], 1),
    "fit": (lambda: afo.fit(POINTS, hold_out="none"), 1),
    "fit_run": (lambda: afo.fit(log(), scenario="seated", free=["friction"], hold_out=0), 1),
    "fit_torque": (lambda: afo.fit(torques(), orthosis="arm", chamber="flexor", hold_out="pressure"), 1),
}  # fmt: skip


SLOW = ("fit", "stand", "fit_torque")  # half of the time of all: at night


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in RESULTS if NIGHTLY or name not in SLOW])
def test_a_result_is_short_and_has_its_picture(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    leave_blank(monkeypatch)
    make, count = RESULTS[name]
    result = make()
    page = result._repr_html_() if hasattr(result, "_repr_html_") else None
    bare = re.sub('base64,[^"]+', "", page or "")
    assert len(f"{result!r}{bare}".encode()) < MOST
    assert page is None or (page.count("<table>") == page.count("</table>") and "http" not in page)
    pictures = [base64.b64decode(data) for data in re.findall('base64,([^"]+)"', page or "")]
    assert len(pictures) == count and all(picture.startswith(b"\x89PNG") for picture in pictures)


def test_a_walk_opens_with_its_verdict_and_shows_its_bands(monkeypatch: pytest.MonkeyPatch) -> None:
    leave_blank(monkeypatch)
    page = walked()._repr_html_()
    assert page is not None
    for answer in walked().verdict:
        assert 0 < page.index(answer.question) < page.index("<img")
    assert "All uncertain inputs varied together (20 draws)" in page
    assert "toe clearance is accurate to about 8 mm" in page  # what the answers depend on
    seated = sat()._repr_html_()
    assert seated is not None and "⚠" in seated and "range_of_motion" in seated


def test_what_does_not_fit_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    leave_blank(monkeypatch)
    page = afo.load("orthosis", "s1").with_values(name="", description="x" * 1400)._repr_html_()
    assert page is not None and re.search(r"… and \d+ more lines than have room here", page)
    many = dataclasses.replace(sat(), columns={f"column/{k}": np.zeros(2) for k in range(400)})
    assert re.search(r"… and \d+ more of 400", repr(many.columns))


def test_a_run_that_never_began_is_shown_too() -> None:
    nothing = {name: values[:0] for name, values in sat().columns.items()}
    page = dataclasses.replace(sat(), columns=nothing, metrics={}, status="failed: <why>")._repr_html_()
    assert page is not None and "failed: &lt;why&gt;, 0 rows" in page and "<img" not in page
    assert "no picture: there is nothing to draw: the recording has no rows" in page


def test_without_the_extra_that_draws_the_texts_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    def lacking(*_: Any) -> None:
        raise ModuleNotFoundError("No module named 'matplotlib'", name="matplotlib")

    monkeypatch.setattr("afo_sim.show.notebook.draw_in_short", lacking)
    page = sat()._repr_html_()
    assert page is not None and "no picture: this needs the library matplotlib" in page
    assert "range_of_motion" in page


def test_a_validation_counts_its_rows() -> None:
    from afo_sim.lab.paper_values import rows_of, validated

    lost = [row for told in validated() if told["part"] == "s0" for row in rows_of(told)]
    found = Validation(lost)
    assert "3 lost" in repr(found) and found == lost and len(found._repr_html_() or "") < MOST
