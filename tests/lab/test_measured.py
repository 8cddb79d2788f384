"""Measured characteristics: what is read, in which unit, and what is refused."""

import pathlib

import numpy as np
import pytest

from afo_sim.common import AMBIENT_PRESSURE, GRAVITY, InputError, assets
from afo_sim.lab import read_measured

GOOD = """# total_length: 20 cm
# a remark
pressure [bar],contraction [%],force [N]
1,0,100
2,5,150

3,10,120
"""


def write(folder: pathlib.Path, text: str) -> pathlib.Path:
    path = folder / "data.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_units_are_those_of_the_titles(tmp_path: pathlib.Path) -> None:
    data = read_measured(write(tmp_path, GOOD))
    assert data.pressure == pytest.approx([1e5, 2e5, 3e5], rel=1e-12)
    assert data.contraction == pytest.approx([0.0, 0.05, 0.1], rel=1e-12)
    assert list(data.force) == [100.0, 150.0, 120.0]
    assert data.facts["total_length"] == pytest.approx(0.2)
    assert not data.loaded


@pytest.mark.parametrize("mark", [";", "\t"])
def test_a_spreadsheet_s_decimal_commas_are_points(tmp_path: pathlib.Path, mark: str) -> None:
    text = (
        GOOD.replace(",", mark).replace("150", "1,505E+02").replace("# a remark", f'"# a; remark"{2 * mark}')
    )
    data = read_measured(write(tmp_path, text))
    assert list(data.force) == [100.0, 150.5, 120.0]
    assert data.facts["total_length"] == pytest.approx(0.2)


def test_loads_hang_with_their_hanger(tmp_path: pathlib.Path) -> None:
    text = "# total_length: 215 mm\n# hanger: 100 g\npressure (MPa), load (g), length (cm)\n"
    text += ".2,1000,20\n.3,1500,19\n.4,2000,18\n"
    data = read_measured(write(tmp_path, text))
    assert data.loaded
    assert data.force == pytest.approx(np.array([1.1, 1.6, 2.1]) * GRAVITY)
    assert data.change == pytest.approx([0.015, 0.025, 0.035])
    assert data.pressure == pytest.approx([2e5, 3e5, 4e5])


@pytest.mark.parametrize(
    ("title", "loads"),
    [
        ("load [N]", "10,20,30"),
        ("LOAD [newton]", "10,20,30"),
        ("Load [daN]", "1,2,3"),
        ("load [kgf]", ",".join(str(x / GRAVITY) for x in (10, 20, 30))),
        ("load [kg]", ",".join(str(x / GRAVITY) for x in (10, 20, 30))),
    ],
)
def test_every_unit_of_a_load_is_the_same_force(tmp_path: pathlib.Path, title: str, loads: str) -> None:
    rows = "".join(f"{k + 1},{x},0.1\n" for k, x in enumerate(loads.split(",")))
    data = read_measured(write(tmp_path, f"# hanger: 100 g\npressure [bar],{title},contraction [-]\n{rows}"))
    assert data.force == pytest.approx(np.array([10.0, 20.0, 30.0]) + 0.1 * GRAVITY)


def test_absolute_pressure_is_taken_to_gauge(tmp_path: pathlib.Path) -> None:
    text = "absolute pressure [Pa],contraction [-],force [N]\n201325,0,1\n301325,0,2\n401325,0,3\n"
    data = read_measured(write(tmp_path, text))
    assert data.pressure == pytest.approx(np.array([201325, 301325, 401325]) - AMBIENT_PRESSURE)


def test_s1_table_i_is_what_is_printed() -> None:
    data = read_measured(assets.folder("models") / "muscles/s1_215mm/table_1.csv")
    assert data.change is not None
    by_load = {round(f / GRAVITY - 0.1, 3) for f in data.force}
    assert by_load == {1.0, 1.5, 2.0, 3.0}
    heaviest = np.isclose(data.force, 3.1 * GRAVITY)
    assert data.pressure[heaviest] == pytest.approx([2e5, 3e5, 4e5])
    assert data.change[heaviest] == pytest.approx([0.013, 0.026, 0.031])


BAD = {
    "no unit": (GOOD.replace("pressure [bar]", "pressure"), "pressure", "has no unit"),
    "another dimension": (GOOD.replace("[bar]", "[kg]"), "pressure", "does not convert"),
    "unknown unit": (GOOD.replace("[N]", "[Newtonz]"), "force", "unknown unit"),
    "unknown column": (GOOD.replace("force", "forse"), "forse", "did you mean 'force'"),
    "text in a number": (GOOD.replace("150", "abc"), "abc", "line 5"),
    "comma for a point": (GOOD.replace("2,5,150", "2,5,1,50"), "line 5", "4 values"),
    "not a number": (GOOD.replace("150", "nan"), "nan", "finite"),
    "infinite": (GOOD.replace("150", "inf"), "inf", "finite"),
    "no pressure": (GOOD.replace("pressure [bar]", "curve"), "header", "lacks a pressure"),
    "two lengths": (GOOD.replace("force [N]", "length [m]"), "header", "contraction and length"),
    "twice": (GOOD.replace("force [N]", "pressure [bar]"), "pressure", "twice"),
    "per cent as a ratio": (GOOD.replace("[%]", "[-]"), "contraction", "per cent"),
    "pascal as bar": (GOOD.replace("3,10,120", "300000,10,120"), "pressure", "out of range"),
    "metres as millimetres": (
        "# total_length: 20 cm\npressure [bar],change of length [m],force [N]\n1,1,5\n2,2,5\n3,3,5\n",
        "change of length",
        "unit right",
    ),
    "length without total": (
        "pressure [bar],length [cm],force [N]\n1,20,5\n2,19,5\n3,18,5\n",
        "length",
        "at rest",
    ),
    "two points": ("pressure [bar],contraction [-],force [N]\n1,0,5\n2,0,6\n", "data.csv", "2 points"),
    "empty": ("# nothing\n", "data.csv", "no points"),
    "both decimals": (GOOD.replace(",", ";").replace("2;5;150", "2.5;5;150,5"), "data.csv", "decimal commas"),
    "underscore": (GOOD.replace("150", "1_50"), "1_50", "finite"),
    "near header": ("# hangar: 0.1 kg\n" + GOOD, "hangar", "did you mean 'hanger'"),
    "negative bore": ("# bore: -11.5 mm\n" + GOOD, "bore", "0.05 to 20 cm"),
    "huge bore": ("# bore: 11.5 m\n" + GOOD, "bore", "out of range"),
    "ends longer": ("# end_length: 30 cm\n" + GOOD, "end_length", "total length"),
    "bad header value": (GOOD.replace("20 cm", "20"), "total_length", "has no unit"),
}


@pytest.mark.parametrize(("text", "where", "what"), BAD.values(), ids=BAD)
def test_bad_data_is_refused_with_a_reason(tmp_path: pathlib.Path, text: str, where: str, what: str) -> None:
    with pytest.raises(InputError) as refused:
        read_measured(write(tmp_path, text))
    assert where in str(refused.value)
    assert what in str(refused.value)
    assert "data.csv" in str(refused.value)
