"""An export format of a user's own: what it is given, who uses it, and what goes wrong in it."""

import json
import pathlib
from typing import Any

import numpy as np
import pytest
from command import Call

import afo_sim as afo
from afo_sim.export import Format, Order
from afo_sim.simulation import Recording


def mine(**facts: Any) -> Format:
    def write(order: Order, path: pathlib.Path) -> list[str] | None:
        rows = order.rows()
        columns = {name: values.tolist() for name, values in rows.columns.items()}
        path.write_text(json.dumps({"units": dict(rows.units), "columns": columns}))
        return facts.get("notes")

    return Format("mine", write, **{k: v for k, v in facts.items() if k != "notes"})


def test_the_ending_of_a_file_chooses_it_and_its_rows_are_those_asked_for(
    seated_second: Recording, tmp_path: pathlib.Path
) -> None:
    afo.register(mine())
    (file,) = seated_second.export(tmp_path / "a.mine", rate=100.0, columns=["ankle/angle"])
    found = json.loads(file.read_text())
    assert found["units"] == {"time": "s", "ankle/angle": "rad"}
    every = round(0.01 / (seated_second["time"][1] - seated_second["time"][0]))
    np.testing.assert_array_equal(found["columns"]["ankle/angle"], seated_second["ankle/angle"][::every])
    np.testing.assert_allclose(np.diff(found["columns"]["time"]), 0.01)


def test_the_command_line_writes_it_beside_the_run(
    seated_second: Recording, tmp_path: pathlib.Path, call: Call
) -> None:
    afo.register(mine(opens="json.load of {name}, a dict: {}", notes=["without strides"]))
    folder = seated_second.save(tmp_path / "run", rrd=False)
    code, said, noted = call("export", folder, "--to", "mine")
    assert code == 0 and (folder / "recording.mine").is_file()
    assert "open it with json.load of recording.mine, a dict: {}" in said
    assert "note: without strides" in noted


def test_the_same_name_again_replaces_it(seated_second: Recording, tmp_path: pathlib.Path) -> None:
    afo.register(mine())
    afo.register(mine(rows=False))
    with pytest.raises(afo.InputError, match="no rows"):
        seated_second.export(tmp_path / "a.mine", rate=100.0)


def test_what_fails_in_it_is_raised_says_where_and_leaves_nothing(
    seated_second: Recording, tmp_path: pathlib.Path, call: Call
) -> None:
    def write(order: Order, path: pathlib.Path) -> None:
        path.write_text("half")
        raise ZeroDivisionError("amid it")

    afo.register(Format("mine", write))
    with pytest.raises(ZeroDivisionError) as caught:
        seated_second.export(tmp_path / "a.mine")
    lines = pathlib.Path(__file__).read_text().splitlines()
    line = 1 + lines.index('        raise ZeroDivisionError("amid it")')
    (note,) = caught.value.__notes__
    assert "mine" in note and note.endswith(f"{pathlib.Path(__file__).name}:{line}")
    assert not list(tmp_path.iterdir())
    folder = seated_second.save(tmp_path / "run", rrd=False)
    code, _, said = call("export", folder, "--to", "mine")
    assert code == 2 and f":{line}: ZeroDivisionError: amid it" in said and "bug" not in said


def test_a_format_that_writes_another_file_is_refused(
    seated_second: Recording, tmp_path: pathlib.Path
) -> None:
    def write(order: Order, path: pathlib.Path) -> None:
        path.with_suffix(".other").write_text("elsewhere")

    afo.register(Format("mine", write))
    with pytest.raises(afo.InputError) as caught:
        seated_second.export(tmp_path / "a.mine")
    assert caught.value.value == "mine" and not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["csv", "fmu", "c", ".mine", "Mine", ""])
def test_a_name_that_is_taken_or_none_is_refused(name: str) -> None:
    with pytest.raises(afo.InputError) as caught:
        afo.register(Format(name, lambda order, path: None))
    assert (caught.value.field, caught.value.value) == ("name", name)
