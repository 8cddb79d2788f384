"""The repeatability study's script: readings scatter as the sensor's steps and noise say."""

import importlib.util
import math
import pathlib
import sys
from types import ModuleType

import pytest

FOLDER = pathlib.Path(__file__).parents[1] / "scripts"


@pytest.fixture(scope="module")
def script() -> ModuleType:
    sys.path.insert(0, str(FOLDER))  # for small_png beside it
    try:
        spec = importlib.util.spec_from_file_location("repeatability", FOLDER / "repeatability.py")
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules["repeatability"] = module  # where its dataclass looks itself up
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(FOLDER))
    return module


def test_scatter_follows_from_the_inverse_line(script: ModuleType) -> None:
    filling = script.fill(4.0, repeats=200)
    # noise of 10 mV, and rounding to 10 mV: variance σ² + step²/12 in V; dx = x²/slope dV
    volts = math.sqrt(0.01**2 + 0.01**2 / 12.0)
    for name, distance in (("far", filling.length), ("near", filling.length - script.NEARER)):
        mean, deviation = filling.error(name)
        expected = distance**2 / 0.1038 * volts
        assert deviation == pytest.approx(expected, rel=0.2)
        assert abs(mean) < 4.0 * expected / math.sqrt(200.0) + 0.1 * expected
    mean, deviation = filling.error("pressure")
    assert deviation == pytest.approx(math.sqrt(0.005**2 + (5.0 / 1024.0) ** 2 / 12.0) / 6.429e-6, rel=0.2)
    assert "lost" in script.table([filling])
