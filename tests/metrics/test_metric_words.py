"""What docs/metrics.md and the reference say of metrics is what the registry says."""

import importlib
import math
import pathlib
import re
from typing import Any

import pytest
from documents import PAGES

from afo_sim.common import NORMAL_DENSITY, STANDARD_DENSITY
from afo_sim.description import load
from afo_sim.metrics import metric_words as page
from afo_sim.metrics.metric import RENAMED
from afo_sim.metrics.metric_words import METRICS

ROOT = pathlib.Path(__file__).parents[2]
PAGE = PAGES["metrics"]


@pytest.fixture
def reference(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The module that makes the reference pages."""
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    return importlib.import_module("docs_reference")


def test_every_metric_and_every_old_name_stands_once_in_the_reference(reference: Any) -> None:
    shown = reference.metrics()
    rows = re.findall(r"^\| `([^`]+)` \| (.+?) \|", shown, flags=re.M)
    units = {row.name.replace("{}", "…"): page.UNITS.get(row.unit, row.unit) for row in METRICS.values()}
    assert sorted(rows) == sorted((name, unit or "–") for name, unit in units.items())
    assert all(shown.count(f"`{old}`") == 1 for old in RENAMED)


def test_sources_and_earlier_meanings_are_of_metrics_that_there_are(reference: Any) -> None:
    assert set(reference.BEFORE) <= set(METRICS)
    assert all(any(name.startswith(start) for name in METRICS) for start in reference.SOURCES)


def test_the_verdicts_page_tells_the_usual_limits() -> None:
    limits = load("limits", "usual")
    shown = {
        "toe_clearance": [f"{1e3 * x:.0f} mm" for x in limits.toe_clearance],
        "contact_pitch": ["8°", "−1.6°"],
        "torque_against_push_off": [f"{x:g} N·m/kg" for x in limits.torque_against_push_off],
        "work_against_push_off": [f"{x:g} J/kg" for x in limits.work_against_push_off],
        "strides_per_bottle": [f"{x:g}" for x in limits.strides_per_bottle],
    }
    assert [math.degrees(x) for x in limits.contact_pitch] == pytest.approx([8.0, -1.6])
    for name, (wanted, bad) in shown.items():
        row = next(line for line in PAGES["verdict"].splitlines() if line.startswith(f"| `{name}` |"))
        assert f"| {wanted} | {bad} | {limits.provenance[name].kind} |" in row
    assert limits.bottle_volume == pytest.approx(0.5e-3) and limits.bottle_pressure == pytest.approx(300e5)
    assert "| 0.5 l, 300 bar |" in PAGES["verdict"]


def test_the_page_tells_the_densities() -> None:
    for density in (STANDARD_DENSITY, NORMAL_DENSITY):
        assert f"{1.0 / density:.3f}" in PAGE and f"{density:g} kg/m³" in PAGE
    assert f"{100.0 * (NORMAL_DENSITY / STANDARD_DENSITY - 1.0):.0f}" == "9"


def test_times_of_all_sizes_have_three_digits_and_round_off_is_zero() -> None:
    hours = [page.number(seconds / 3600.0, "h") for seconds in (0.776, 32.0 * 60.0, 7200.0, 1.5e6)]
    assert hours == ["0.000216", "0.533", "2", "417"]
    assert [page.number(value, "") for value in (0.286, 8.855, 1750.3, 11.0)] == [
        "0.286",
        "8.86",
        "1750",
        "11",
    ]
    assert [page.number(1.455e-16, unit) for unit in ("bar", "J", "h")] == ["0.00", "0", "0"]


def test_the_pictures_are_there() -> None:
    pictures = re.findall(r"\]\(\.\./(models/scenarios/pictures/metrics-[\w-]+\.png)\)", PAGE)
    assert len(pictures) == 5 and all((ROOT / picture).is_file() for picture in pictures)
