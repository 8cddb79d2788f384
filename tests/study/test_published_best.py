"""The best design that docs/search.md names keeps the limits of its search on patients that it never saw."""

import pathlib

import numpy as np
import pytest

from afo_sim.common import assets, parse_quantity, read_toml
from afo_sim.study.runner import sweep
from afo_sim.study.sweep_plan import read

UNITS = {"toe_clearance": "mm", "toe_clearance_stride_1": "mm", "torque_against_push_off": "N*m"}


@pytest.mark.slow
def test_the_published_best_design_keeps_its_limits_on_fresh_patients(tmp_path: pathlib.Path) -> None:
    judged = sweep(read(assets.find("sweep", "least-air-best")), tmp_path / "judged").to_pandas()
    limits = {limit["metric"]: limit for limit in read_toml(assets.find("search", "least-air"))["limits"]}
    for metric, unit in UNITS.items():
        limit = limits[metric]
        sign, key = (1.0, "at_least") if "at_least" in limit else (-1.0, "at_most")
        (column,) = (name for name in judged if name.partition(" ")[0] == metric)
        kept = sign * judged[column] >= sign * parse_quantity(limit[key], unit)
        assert np.mean(kept) >= limit["share"], metric
    assert len(judged) == 200
