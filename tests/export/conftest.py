"""Short runs that are exported."""

import pathlib

import pytest

import afo_sim
from afo_sim.common import assets
from afo_sim.simulation import Recording


@pytest.fixture(scope="session")
def seated_second() -> Recording:
    return afo_sim.run("seated", {"duration": "1 s"})


@pytest.fixture(scope="session")
def walked() -> Recording:
    """Strides walked from the start, and the settled one; toes that bend."""
    return afo_sim.run("walk-dropfoot-afo", {"duration": "2.6 s"})


@pytest.fixture(scope="session")
def walked_left(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """The same walker's other leg."""
    text = (assets.folder("gait_data") / "bovi2011_natural.csv").read_text(encoding="utf-8")
    assert "# side: right" in text
    file = pathlib.Path(tmp_path_factory.mktemp("left")) / "left.csv"
    file.write_text(text.replace("# side: right", "# side: left"), encoding="utf-8")
    return afo_sim.run("walk-dropfoot", {"duration": "1.2 s", "gait.cycle": str(file)})
