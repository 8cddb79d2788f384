"""No reader of the package is forgotten: each module that reads files has a base here that it reads."""

import ast
import pathlib
from collections.abc import Iterator

from fuzz import written
from fuzz.bases import BASES, OWN
from test_walls import PACKAGE, SOURCES

from afo_sim.cli.doctor import kinds
from afo_sim.common import WRITTEN, assets
from afo_sim.gait_lab.trial import files as trial
from afo_sim.studio.messages import MESSAGES

# What opens files: in this package's own words, and Python's.
READS = {"read_text", "read_bytes", "read_foreign", "read_table", "read_toml", "read_json", "read_parquet"}
READS |= {"open_parquet", "read_header", "check_regular", "read_phase_table", "table_of", "open"}
# {module that reads what people or this program have written: a base whose file it reads}
READERS = {
    "cli/doctor/kinds": "gait gatk_stride1", "cli/leg": "read: worn model",
    "cli/overwriting": "read: manifest",
    "common/assets": "scenario seated", "common/csv_table": "points", "common/phase_table": "gait norm_adult",
    "common/reading": "trc", "common/sealing": "read: stride", "common/user_cache": "read: recording",
    "common/machine_code": "read: recording", "common/writing": "read: manifest",
    "control/switch_log": "read: commands", "description/new": "scenario seated",
    "description/tree": "points", "gait/family": "gait gatk_stride1", "gait/file": "gait gatk_stride1",
    "gait/norm": "gait norm_adult", "gait_lab/readers/c3d_file": "c3d type 2",
    "gait_lab/readers/opensim_model": "osim 4", "gait_lab/readers/text": "trc",
    "gait_lab/trial/files": "grf.mot", "gait_lab/trial/opencap": "osim and angles",
    "gait_lab/trial/roles": "read: role map", "lab/air_log": "read: air log",
    "lab/bench_log": "read: bench log",
    "lab/bench_sets": "read: bench set", "lab/calibration": "calibration", "lab/law_muscle": "muscle dmsp_20",
    "lab/ledger": "read: ledger", "lab/measured": "points", "lab/run_problem": "log",
    "lab/torque_data": "bench",
    "lab/stand": "points", "lab/stand_table": "points", "legs/attached_files": "read: worn model",
    "legs/exporting": "leg adult_75kg", "legs/mjcf": "mjcf", "legs/urdf_files": "urdf",
    "model/design": "orthosis s1", "model/leg": "leg and its mjcf", "model/rescale": "orthosis s1",
    "show/report": "recording's report", "simulation/checks": "read: checks", "simulation/files": "recording",
    "simulation/recording": "recording", "studio/design": "read: variant", "study/folder": "read: manifest",
    "study/parameter_table": "parameters.csv", "study/results": "read: results",
    "study/runner": "read: manifest",
    "study/search/loop": "read: generation", "study/search/plan": "search placement",
    "study/search/runner": "read: generation", "study/search/store": "read: designs",
    "study/store": "read: chunk", "study/sweep_plan": "sweep patients", "study/template": "sweep patients",
    "study/uncertainty/spreads": "read: uncertainty", "walker/gait_file": "read: adapted gait",
    "walker/patients": "read: gaits", "walker/population": "read: population",
}  # fmt: skip
# What is shipped with the package, or was written a moment ago by the same process.
ITS_OWN = {
    "cli/descriptions", "cli/error_handler", "cli/program", "common/child", "cli/sweep",
    "common/versions", "description/catalogue",
    "export/electronics/c_text", "export/electronics/firmware", "export/elsewhere/fmu",
    "export/elsewhere/writing", "export/formats", "export/opensim", "lab/credibility", "lab/paper",
    "lab/paper_values", "lab/validation_knee", "metrics/covered", "native/struct_layout",
    "show/compared_figures", "show/in_words", "show/notebook", "show/rerun/recording_file",
    "show/rerun/viewer", "show/run_pictures", "show/style", "simulation/parts", "studio/server",
    "walker/measured",
}  # fmt: skip


def readers() -> Iterator[str]:
    """Every module that calls what opens files."""
    for path in SOURCES:
        called = (node.func for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call))
        if READS & {getattr(each, "attr", getattr(each, "id", "")) for each in called}:
            yield path.relative_to(PACKAGE).with_suffix("").as_posix()


def test_every_module_that_reads_files_has_a_base() -> None:
    found = set(readers())
    assert found - READERS.keys() - ITS_OWN == set(), "name a base of it"
    assert (READERS.keys() | ITS_OWN) - found == set(), "reads no more"
    assert set(READERS.values()) <= BASES.keys()


def test_every_kind_has_a_base() -> None:
    begun = {name.removeprefix("read: ").split()[0] for name in BASES}
    assert {*assets.KINDS, "gait", *trial._WITH_COLUMNS} - {"csv"} <= begun
    assert {*WRITTEN, *(f"message {op}" for op in MESSAGES)} <= set(OWN)
    suffixes = {pathlib.Path(base.file).suffix for base in BASES.values()}
    for table in (kinds._OF_SUFFIX, trial._READ_AS):
        read = {reader for suffix, reader in table.items() if suffix in suffixes}
        assert read == set(table.values())


def test_every_base_of_a_function_has_a_file(tmp_path: pathlib.Path) -> None:
    (tmp_path / "part" / "chunks").mkdir(parents=True)
    (tmp_path / "part" / "chunks" / "0.parquet").touch()
    for kind in written.SHIPPED:
        (tmp_path / f"shipped-{kind}.toml").touch()
    assert set(OWN) <= written.files(tmp_path).keys()
