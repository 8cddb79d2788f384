"""One changed bit in a file that this program wrote and reads back is noticed, wherever it is."""

import base64
import dataclasses
import hashlib
import json
import pathlib
import random
import shutil
import warnings
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import sweep_runs
from campaign import size
from command import call
from fuzz import written
from fuzz.written import BESIDE, NUMBERS, VARIANT

from afo_sim.common import (
    WRITTEN,
    InputError,
    assets,
    find,
    parquet_writer,
    read_json,
    read_parquet,
    user_cache,
    write_json,
    write_parquet,
    write_sealed,
)
from afo_sim.description import load, toml_text
from afo_sim.simulation import Recording, read_recording, recover_recording
from afo_sim.simulation.files import FORMAT, RUN_KEY
from afo_sim.study import recover, runner


@pytest.fixture(scope="module")
def place(seated: Recording, tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    columns = {name: values[:400] for name, values in seated.columns.items()}
    found = tmp_path_factory.mktemp("sealed")
    written.make(found, dataclasses.replace(seated, columns=columns))
    return found


@pytest.fixture(scope="module")
def run(place: pathlib.Path) -> pathlib.Path:
    return place / "run"


@pytest.fixture(scope="module")
def files(place: pathlib.Path) -> written.Files:
    return written.files(place)


@pytest.fixture(scope="module", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Any:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(user_cache.VARIABLE, str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.mark.parametrize("kind", (*WRITTEN, *BESIDE, VARIANT))
def test_no_flipped_bit_is_silent(kind: str, files: written.Files) -> None:
    path, reader = files[kind]
    whole = path.read_bytes()
    assert reader() is not None
    draw = random.Random(kind)
    ends = [*range(min(48, len(whole))), *range(max(len(whole) - 96, 0), len(whole))]  # seals and footers
    try:
        for trial in range(size(12, 640)):
            place = draw.choice(ends) if trial % 4 == 0 else draw.randrange(len(whole))
            bit = draw.randrange(8)
            path.write_bytes(whole[:place] + bytes([whole[place] ^ 1 << bit]) + whole[place + 1 :])
            try:
                found = reader()
            except InputError as error:
                assert path.name in str(error) or str(path.parent) in str(error)
            except ValueError as error:  # of `read_json`, whose callers name the file
                assert kind in NUMBERS and "digest" in str(error)
            else:
                assert found is None, f"bit {bit} of byte {place} of {len(whole)}"
    finally:
        path.write_bytes(whole)


def test_an_edited_file_says_which_line_to_delete(tmp_path: pathlib.Path) -> None:
    file = tmp_path / "a.toml"
    table = load("scenario", "seated").resolved()
    write_sealed(file, toml_text(table), "scenario")
    file.write_text(file.read_text(encoding="utf-8"), encoding="utf-8", newline="\r\n")  # as Windows does
    assert load("scenario", file).duration == 16.0
    file.write_text(file.read_text(encoding="utf-8").replace('duration = "16.0 s"', 'duration = "3 s"'))
    with pytest.raises(InputError, match=r"has changed since.*deletes the first line of a\.toml"):
        load("scenario", file)
    file.write_text(file.read_text(encoding="utf-8").partition("\n")[2])
    assert load("scenario", file).duration == 3.0


def test_another_format_is_read_or_its_version_is_named(run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    table = read_parquet(run / "recording.parquet")
    header = json.loads(table.schema.metadata[RUN_KEY.encode()])
    assert header["format"] == FORMAT and header["columns"] == table.column_names
    file = tmp_path / "recording.parquet"

    def written(header: dict[str, Any], table: pa.Table = table) -> pathlib.Path:
        pq.write_table(table.replace_schema_metadata({RUN_KEY: json.dumps(header)}), file)
        return tmp_path

    newer = header | {"format": FORMAT + 1, "versions": {"afo-sim": "9.1"}}
    assert read_recording(written(newer)).status == "ok"
    del newer["metrics"]
    with pytest.raises(InputError, match=rf"by afo-sim 9\.1 in format {FORMAT + 1}, .* reads up to {FORMAT}"):
        read_recording(written(newer))
    older = read_recording(
        written({k: v for k, v in header.items() if k != "format"}, table.drop(["ankle/angle"]))
    )
    with pytest.raises(InputError, match="has no such column"):
        older.columns["ankle/angle"]
    with pytest.raises(InputError, match="is not a column of this version"):
        older.describe("ankle/of_a_newer_version")


def test_a_seal_without_its_digest_is_damage(tmp_path: pathlib.Path) -> None:
    """A table that other programs have written anew holds our mark, but other bytes."""
    write_parquet(tmp_path / "a.parquet", pa.table({"x": [1.0]}))
    table = read_parquet(tmp_path / "a.parquet")
    pq.write_table(table, tmp_path / "b.parquet")
    with pytest.raises(InputError, match="its digest does not match"):
        read_parquet(tmp_path / "b.parquet")
    write_json(tmp_path / "a.json", {"a": 1})
    assert read_json(tmp_path / "a.json") == {"a": 1}
    shutil.copy(tmp_path / "a.json", tmp_path / "b.json")
    (tmp_path / "b.json").write_text((tmp_path / "b.json").read_text().replace("digest", "Digest"))
    with pytest.raises(ValueError, match="digest"):
        read_json(tmp_path / "b.json")


def with_flipped_end(file: pathlib.Path, column: Any) -> bytearray:
    """The content of a Parquet file, which is written with one bit changed in a column's last page."""
    start = column.dictionary_page_offset if column.has_dictionary_page else column.data_page_offset
    content = bytearray(file.read_bytes())
    content[start + column.total_compressed_size - 3] ^= 1
    file.write_bytes(content)
    return content


def test_what_is_whole_of_a_run_is_recovered(
    run: pathlib.Path, tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    damaged = pathlib.Path(shutil.copytree(run, tmp_path / "run"))
    file, before = damaged / "recording.parquet", read_recording(run)
    column = pq.ParquetFile(file).metadata.row_group(0).column(7)
    content = with_flipped_end(file, column)
    code, said, _ = call(capsys, "recover", damaged)
    assert code == 0 and f"lost: {column.path_in_schema} (rows 0 to 399)" in said
    found = read_recording(tmp_path / "run-recovered")
    assert found.metrics == before.metrics and found.warnings[-1].code == "recovered"
    assert found.scenario["description"].startswith(f"{found.warnings[-1]}; ")  # the title of its pictures
    for name, values in before.columns.items():
        lost = name == column.path_in_schema
        assert np.array_equal(
            found[name], np.full(len(values), np.nan) if lost else values, equal_nan=True
        ), name
    content[-200] ^= 1  # of the footer
    file.write_bytes(content)
    with pytest.raises(InputError, match=r"recording\.parquet|header is damaged"):
        recover_recording(damaged)


@pytest.mark.slow
def test_a_damaged_sweep_goes_on_from_what_is_whole(tmp_path: pathlib.Path) -> None:
    before, out = sweep_runs.swept(tmp_path, sweep_runs.SEATED), tmp_path / "out"
    results = out / "results.parquet"
    with parquet_writer(results, before.schema) as writer:  # a row group for each chunk of four
        for first in (0, 4, 8):
            writer.write_table(before.slice(first, 4))
    column = pq.ParquetFile(results).metadata.row_group(1).column(9)
    with_flipped_end(results, column)
    assert recover(out) == (8, 12)
    store = sweep_runs.opened(tmp_path / "sweep.toml", out)
    assert store.pending() == [1]
    runner.run(store)
    sweep_runs.assert_same(sweep_runs.table(out), before)


def test_a_shipped_file_that_has_changed_is_warned_of(monkeypatch: pytest.MonkeyPatch) -> None:
    """The installed wheel's RECORD says what each file was; a checkout has none."""
    file = find("scenario", "seated")
    name = file.relative_to(file.parents[3]).as_posix()
    own = base64.urlsafe_b64encode(hashlib.sha256(file.read_bytes()).digest()).rstrip(b"=").decode()
    words = f"{file}: has changed since it was shipped"
    for stated, expected in ((own, []), (own.swapcase(), [words])):
        assets._warn_of_change.cache_clear()
        monkeypatch.setattr(assets, "_shipped", lambda stated=stated: {name: stated})
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            find("scenario", "seated")
        assert [str(one.message) for one in caught] == expected
    assets._warn_of_change.cache_clear()


@pytest.mark.slow
@pytest.mark.parametrize("what", ["footer", "rows"])
def test_a_small_file_does_not_unpack_to_gigabytes(what: str, tmp_path: pathlib.Path) -> None:
    """Many groups of rows take 200 times their bytes; a column of one number takes none."""
    file = tmp_path / "a.parquet"
    if what == "footer":
        table = pa.table({str(k): [0.0] * 1100 for k in range(2)})
        pq.write_table(table, file, row_group_size=1)
    else:
        step = pa.table({str(k): pa.array(np.zeros(1_000_000)) for k in range(2)})
        with pq.ParquetWriter(file, step.schema) as writer:
            for _ in range(70):
                writer.write_table(step)
    with pytest.raises(InputError, match=r"size limit|would unpack"):
        read_parquet(file)
