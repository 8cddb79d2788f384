"""Numbers per cycle are of the cycle that is described, and say so where none is."""

from typing import Any

import pytest

import afo_sim

SINE = {"amplitude": "3 deg", "frequency": "0.5 Hz"}
PID = {"pid": {"lowers": "plantarflexor", "angle": {"proportional_band": "2 deg", "reference": SINE}}}
HELD = {"pid": {"angle": {"proportional_band": "2 deg", "reference": {"mean": "2 deg"}}}}
WHOLE = "numbers per cycle are of the whole run"


def run(controller: dict[str, Any]) -> afo_sim.Recording:
    return afo_sim.run("seated", {"timer": None, "controller": controller, "duration": "6 s"})


def test_a_sine_has_its_period() -> None:
    """Three periods of 2 s: a third of the air that the inlets let in."""
    found = run(PID)
    flows = [found[f"valve/{c}_inlet/mass_flow"] for c in ("dorsiflexor", "plantarflexor")]
    air = 2e-3 * sum(flow[flow > 0.0].sum() for flow in flows) / 3.0
    assert float(found.metrics["air_per_cycle"]) * 1e-3 == pytest.approx(air, rel=1e-9)
    assert not any(WHOLE in warning for warning in found.warnings)


def test_what_does_not_repeat_says_that_the_run_is_the_cycle() -> None:
    assert any(WHOLE in warning for warning in run(HELD).warnings)
