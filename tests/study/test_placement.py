"""The shipped search `placement`: what its limits stand for, and that its answer holds in a direct run."""

import pathlib

import numpy as np
import pytest

import afo_sim as afo
from afo_sim.common import assets
from afo_sim.model.rescale import fits
from afo_sim.study.search import plan
from tests.command import call


def test_its_limits_are_what_s1_does_at_4_bar() -> None:
    """Each bound is S1's own number, to the digits that the file has."""
    own = afo.run("seated", {"duration": "8 s"}).metrics
    bounds = {limit.metric: str(limit.bound) for limit in plan.read("placement").limits}
    for metric in ("peak_dorsiflexion_torque_10ms", "peak_dorsiflexion_angle", "peak_plantarflexion_angle"):
        number = float(bounds[metric].split()[0])
        assert number == pytest.approx(float(own[metric]), abs=0.04), metric
    assert bounds["cuff_skin_pressure"] == "14 kPa"


@pytest.mark.slow
def test_it_finds_less_pressure_for_the_same_torque(
    tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A direct run of the found design keeps what is asked for, by the numbers of S1's own run."""
    text = assets.find("search", "placement").read_text(encoding="utf-8")
    file = tmp_path / "short.toml"
    file.write_text(text.replace("generations = 80", "generations = 30"), encoding="utf-8")
    assert call(capsys, "optimise", file, "--out", tmp_path / "found")[0] == 0
    best = afo.load("scenario", tmp_path / "found" / "best.toml")
    own, found = afo.run("seated", {"duration": "8 s"}), afo.run(best)
    assert best.supply.pressure < 0.9 * 4e5
    # the bounds are written in four digits
    torque = "peak_dorsiflexion_torque_10ms"
    assert float(found.metrics[torque]) >= float(own.metrics[torque]) - 1e-3
    assert found["ankle/angle"].max() >= own["ankle/angle"].max() - np.radians(0.02)
    assert found["ankle/angle"][0] == pytest.approx(own["ankle/angle"][0], abs=np.radians(0.1))
    # without air it is slack where the foot rests, and taut below
    assert np.degrees(fits(best.orthosis)["dorsiflexor"].taut) < -9.0
