"""Reading Rerun files back, and what their viewer needs."""

import pathlib
import subprocess
import sys

import numpy as np
import pyarrow as pa
import pytest
import rerun_cli

VULKAN = any(pathlib.Path("/usr/share/vulkan/icd.d").glob("*.json")) or not sys.platform.startswith("linux")


needs_vulkan = pytest.mark.skipif(not VULKAN, reason="no Vulkan driver (package mesa-vulkan-drivers)")


def read(file: pathlib.Path, entity: str, component: str) -> tuple[np.ndarray, np.ndarray]:
    """(time [ns], values (n, width)) of one component, in order of time."""
    import rerun as rr

    stream = rr.chunk.RrdReader(str(file)).stream()
    chunks = stream.filter(content=entity, is_static=False, components=component).to_chunks()
    batches = [chunk.to_record_batch() for chunk in chunks]
    time = np.concatenate([b.column("sim_time").cast(pa.int64()).to_numpy() for b in batches])
    values = []
    for batch in batches:
        column = batch.column(component).flatten()
        while not pa.types.is_primitive(column.type) and not pa.types.is_string(column.type):
            column = column.flatten()
        values.append(column.to_numpy(zero_copy_only=False).reshape(batch.num_rows, -1))
    order = np.argsort(time, kind="stable")
    return time[order], np.concatenate(values)[order]


def lists(file: pathlib.Path, entity: str, component: str) -> tuple[np.ndarray, list[list]]:
    """(time [ns], lists of values) of a component that may be empty at some times, in order of time."""
    import rerun as rr

    stream = rr.chunk.RrdReader(str(file)).stream()
    chunks = stream.filter(content=entity, is_static=False, components=component).to_chunks()
    pairs = []
    for batch in (chunk.to_record_batch() for chunk in chunks):
        time = batch.column("sim_time").cast(pa.int64()).to_pylist()
        pairs += zip(time, batch.column(component).to_pylist(), strict=True)
    pairs.sort(key=lambda pair: pair[0])
    return np.array([pair[0] for pair in pairs]), [pair[1] for pair in pairs]


def rerun(*arguments: str) -> subprocess.CompletedProcess[str]:
    name = "rerun.exe" if sys.platform == "win32" else "rerun"
    binary = pathlib.Path(rerun_cli.__file__).with_name(name)
    return subprocess.run([str(binary), "rrd", *arguments], capture_output=True, text=True, timeout=60)
