"""The ledger's rules by hand, three of its rows by papers' formulas alone, its files, its logs of air."""

import json
import math
import pathlib
import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from campaign import nightly
from command import call
from documents import PAGES, script

from afo_sim import InputError
from afo_sim.lab import ledger as lab
from afo_sim.lab import ledger_predictions
from afo_sim.lab.air_log import air_row
from afo_sim.lab.ledger import LedgerRow
from afo_sim.metrics import Metric, coverages

DEVICES, LABORATORIES = lab.devices(), lab.laboratories()
BAND = (80.0, 90.0, 100.0)


# --- the rules


@pytest.mark.parametrize(
    ("band", "measured", "error", "verdict"),
    [
        (BAND, 104.0, 5.0, "agrees"),  # 99 lies in both
        (BAND, 106.0, 5.0, "disagrees"),  # 101 is the least
        (BAND, 75.0, 5.0, "agrees"),  # touching, and 15 of 37.5
        ((50.0, 90.0, 130.0), 90.0, 5.0, "agrees"),  # 45 of 45
        ((50.0, 90.0, 131.0), 90.0, 5.0, "cannot tell"),  # 45.5 of 45
        (None, 90.0, 5.0, "cannot tell"),
        (BAND, 90.0, None, "cannot tell"),
    ],
)
def test_verdict_is_the_written_rule(band: Any, measured: float, error: float | None, verdict: str) -> None:
    assert LedgerRow("d", "q", "N", band, measured, error).verdict == verdict


def test_verdict_against_a_search_for_a_common_number() -> None:
    """Independently: a grid of numbers, one of which has to lie in band and measured ± error."""
    rng = np.random.default_rng(1)
    for _ in range(300):
        low, middle, high = np.sort(rng.integers(10, 100, 3)).astype(float)
        measured, error = float(rng.integers(20, 100)), float(rng.integers(1, 20))
        grid = np.arange(0.0, 200.0, 0.5)
        common = np.any((grid >= low) & (grid <= high) & (np.abs(grid - measured) <= error))
        vague = (high - low) / 2.0 + error > measured / 2.0
        expected = "disagrees" if not common else "cannot tell" if vague else "agrees"
        assert LedgerRow("d", "q", "N", (low, middle, high), measured, error).verdict == expected


@pytest.mark.parametrize(
    ("x", "score"),  # Gneiting & Raftery 2007, eq. 43, α = 0.1, by hand
    [(90.0, 20.0 / 90.0), (100.0, 0.2), (110.0, (20.0 + 20.0 * 10.0) / 110.0), (70.0, (20.0 + 200.0) / 70.0)],
)
def test_interval_score_by_hand(x: float, score: float) -> None:
    assert float(lab.interval_score(80.0, 100.0, x)) == pytest.approx(score, rel=1e-12)


def test_the_score_is_least_in_the_mean_for_the_true_quantiles() -> None:
    """What makes it a score: no band that is narrower, wider or shifted does better."""
    x = 100.0 + 10.0 * np.random.default_rng(2).standard_normal(200_000)
    true = np.array([100.0 - 16.449, 100.0 + 16.449])
    best = np.mean(lab.interval_score(true[0], true[1], x) * x)
    for low, high in (true * [1.05, 0.95], true * [0.9, 1.1], true + 5.0, true - 5.0):
        assert np.mean(lab.interval_score(low, high, x) * x) > best


def test_summary_counts() -> None:
    rows = [
        LedgerRow("a", "q", "N", BAND, 90.0, 1.0, bench="A"),  # in its band
        LedgerRow("a", "q", "N", BAND, 45.0, 1.0, bench="A"),  # half of the prediction
        LedgerRow("b", "q", "N", BAND, 180.0, 1.0, bench="B"),
        LedgerRow("c", "q"),
    ]
    first, second, third, once, fourth = lab.summary(rows)
    assert first == "1 agrees, 2 disagrees, 1 cannot tell; 2 benches or groups with a verdict"
    assert "median error 50 %" in second and "22 % of the measured value" in second
    assert "25 % lie in it, standard error 25 %" in once  # a half and none: their mean, and 0.5/√2/√2
    # Clopper & Pearson for 1 of 3: 1 − (1 − p)³ = 0.05, and (1 − p)³ + 3 p (1 − p)² = 0.05
    assert third.startswith("1 of 3 measured") and "2 to 86 %" in third and "too narrow" in third
    scores = [20.0 / 90.0, (20.0 + 20.0 * 35.0) / 45.0, (20.0 + 20.0 * 80.0) / 180.0]
    assert f"median {np.median(scores):.2f}, mean {np.mean(scores):.2f}" in fourth
    assert f"{(0.5 * (scores[0] + scores[1]) + scores[2]) / 2.0:.2f}" in fourth


def test_whoever_touches_the_band_lies_in_it() -> None:
    """Of values at its ends, beside it by their error, and by more: two within, three with their error."""
    each = ((80.0, 0.0), (100.0, 0.0), (102.0, 2.0), (102.0, 1.9))
    rows = [LedgerRow("a", "q", "N", BAND, *one, bench=name) for one, name in zip(each, "AABB", strict=True)]
    inside, of, *_, near = map(int, re.findall(r"\b\d+\b", lab.summary(rows)[2]))
    assert (inside, of, near) == (2, 4, 3)


def test_a_drawn_shift_is_added_in_the_metrics_unit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a run that is asked for with what is drawn, but for the shift."""
    asked: list[Any] = []

    def run(name: str, sets: Any, step: str) -> Any:
        asked.append(sets)
        return SimpleNamespace(metrics={"toe_clearance": Metric(12.0, "mm")})

    monkeypatch.setattr(ledger_predictions, "run", run)
    drawn, at = {"draw": 3, "patient.body_mass": "80 kg"}, {"metric": "toe_clearance"}
    assert ledger_predictions.scenario("seated", at, drawn) == pytest.approx(0.012)
    assert ledger_predictions.scenario("seated", at, drawn | {"shift": "-2 mm"}) == pytest.approx(0.010)
    for sets in asked:
        assert sets["patient.body_mass"] == "80 kg" and not {"draw", "shift"} & sets.keys()


def test_counts_of_each_kind() -> None:
    rows = [
        LedgerRow("a", "q", "N", BAND, 90.0, 1.0, bench="A", kind="muscle force"),
        LedgerRow("a", "q", "N", BAND, 45.0, None, bench="A", kind="muscle force", worn=True),
        LedgerRow("b", "q", "N", BAND, None, bench="B", kind="muscle force"),  # nothing measured
        LedgerRow("b", "q", "N", None, 90.0, bench="B", kind="muscle force"),  # nothing predicted
    ]
    found = script("ledger").coverage_of(rows)["muscle force"]
    assert (found.values, found.inside, found.benches, found.worn) == (2, 1, 1, 1)


# --- the draws


@pytest.mark.parametrize("name", [name for name, device in DEVICES.items() if not device.wanting])
def test_draws_fill_each_stated_range_evenly_and_alike_each_time(name: str) -> None:
    device, draws = DEVICES[name], DEVICES[name].draws()
    assert device.unknown, "a prediction without anything unknown is no band"
    assert draws == device.draws() and len(draws) == lab.DRAWS
    for key, number in device.unknown.items():
        if number.choices:
            assert {one[key] for one in draws} == set(number.choices)
            continue
        if number.within is None:
            continue  # a factor: the next test
        low, high = (float(str(end).partition(" ")[0]) for end in number.within)
        x = np.sort([float(str(one[key]).partition(" ")[0]) for one in draws])
        share = np.log(x / low) / math.log(high / low) if number.scale == "log" else (x - low) / (high - low)
        assert (np.floor(share * lab.DRAWS) == np.arange(lab.DRAWS)).all()


def test_factors_are_a_normal_deviate_or_students_t_of_the_other_laboratories() -> None:
    """By SciPy's distributions; the spread is the RMS of ln ratios about none."""
    from scipy import stats

    for name, others in (("martens_dmsp_10_250", 3), ("s1_120mm_unmeasured", 4)):
        device = DEVICES[name]
        assert len(device.others) == others and device.bench not in device.others
        spread = math.sqrt(np.mean(np.square([*device.others.values()])))
        x = np.log(sorted(one["force_factor"] for one in device.draws()))
        share = stats.t(others).cdf(x / spread)
        assert (np.floor(share * lab.DRAWS) == np.arange(lab.DRAWS)).all()
        y = np.log(sorted(one["contraction_factor"] for one in device.draws()))
        assert (np.floor(stats.norm.cdf(y / 0.1) * lab.DRAWS) == np.arange(lab.DRAWS)).all()


def test_laboratories_by_hand() -> None:
    """Szeged's two muscles of 20 mm and Kielce's of 10 mm over the maker's curves, as Sárosi's formula."""

    def force(a: tuple[float, ...], p: float) -> float:  # at no contraction; bar
        return a[0] * p + a[1] + a[4] * p + a[5]

    twenty = force((-12.25779, 274.0102, 0.0, 0.0, 265.4195, -276.7214), 6.0)
    ten = force((-2.62891, 156.4259, 0.0, 0.0, 79.93359, -149.0788), 6.0)
    found = lab.laboratories()
    assert found["University of Szeged"] == pytest.approx(
        0.5 * (math.log(1752.0 / twenty) + math.log(1805.0 / twenty)), abs=2e-3
    )
    assert found["Kielce University of Technology"] == pytest.approx(math.log(424.1 / ten), abs=2e-3)
    assert found.keys() == {
        "Portland State University", "TU Berlin", "University of Szeged", "Kielce University of Technology"
    }  # fmt: skip


def test_no_bench_takes_part_in_its_own_prediction(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever a bench measured, what is drawn for its rows stays."""
    device = DEVICES["martens_dmsp_20_300"]
    before = device.draws()
    monkeypatch.setattr(lab, "laboratories", lambda: {**LABORATORIES, device.bench: 5.0})
    assert device.draws() == before
    monkeypatch.setattr(lab, "laboratories", lambda: {**LABORATORIES, "University of Szeged": 5.0})
    assert device.draws() != before


def drawn(*names: str) -> list[np.ndarray]:
    """Shares of a Latin hypercube from the ledger's seed, for names in their order."""
    rng = np.random.default_rng(20070302)
    return [(rng.permutation(64) + rng.random(64)) / 64 for _ in sorted(names)]


def row(name: str, quantity: str) -> LedgerRow:
    device = DEVICES[name]
    (measured,) = (each for each in device.measured if each.quantity == quantity)
    (found,) = lab.rows_of(device.model_copy(update={"measured": (measured,)}))
    return found


def test_a_fluidic_muscle_again() -> None:
    """F(κ, p) = (a1 p + a2) exp(a3 κ) + a4 κ p + a5 p + a6 of the maker's 20 mm curve; %, bar."""
    from scipy import stats

    contraction, factor, pressure, rest = drawn(
        "contraction_factor", "force_factor", "pressure", "rest_length"
    )
    p, length = 6.0 * (0.99 + 0.02 * pressure), 296.0 + 4.0 * rest
    kappa = 100.0 * (1.0 - 250.0 / length) / np.exp(0.1 * stats.norm.ppf(contraction))
    force = (-12.25779 * p + 274.0102) * np.exp(-0.2605303 * kappa) - 8.067426 * kappa * p + 265.4195 * p
    ratios = [x for bench, x in LABORATORIES.items() if bench != "TU Berlin"]
    spread = math.sqrt(np.mean(np.square(ratios)))
    expected = np.quantile((force - 276.7214) * np.exp(spread * stats.t(3).ppf(factor)), (0.05, 0.5, 0.95))
    found = row("martens_dmsp_20_300", "force at 25.0 cm, 6 bar")
    assert found.band == pytest.approx(expected, rel=0.01)
    assert (found.measured, found.verdict) == (443.5, "agrees")


def test_relaxed_ankles_again() -> None:
    """Riener & Edrich 1999, in degrees."""
    knee, scale, zero = drawn("knee", "scale", "zero")
    a, k = 10.0 - (-5.0 + 10.0 * zero), 60.0 * knee
    inside = np.minimum(a, 20.0)
    moment = (
        np.exp(-7.9763 - 0.1949 * inside + 0.0008 * k) - np.exp(2.1016 + 0.0843 * inside - 0.0176 * k) + 1.792
    )
    expected = np.quantile(-moment * (0.8 + 0.4 * scale), (0.05, 0.5, 0.95))
    found = row("chung_2004", "resistance at 10 deg of dorsiflexion")
    assert found.band == pytest.approx(expected, rel=0.01)
    assert (found.measured, found.verdict) == (6.21, "cannot tell")


def test_stiffness_of_relaxed_ankles_again() -> None:
    """The slope of Riener & Edrich's formula, by hand; the largest angle drawn is 16.5°, below its 20°."""
    angle, knee, scale, zero = drawn("angle", "knee", "scale", "zero")
    a, k = 11.5 * angle - (-5.0 + 10.0 * zero), 30.0 * knee
    dorsal, plantar = np.exp(-7.9763 - 0.1949 * a + 0.0008 * k), np.exp(2.1016 + 0.0843 * a - 0.0176 * k)
    expected = np.quantile((0.1949 * dorsal + 0.0843 * plantar) * (0.7 + 0.6 * scale), (0.05, 0.5, 0.95))
    found = row("rao_2006", "stiffness in dorsiflexion")
    assert found.band == pytest.approx(expected, rel=0.01)
    assert found.unit == "N*m/deg" and found.measured == 0.6


def test_a_braid_without_load_again() -> None:
    """Tondu & Lopez 2000: 3 (1 − κ)²/tan²α = 1/sin²α, so κ = 1 − 1/(√3 cos α)."""
    from scipy import stats

    share, factor = drawn("braid_angle", "contraction_factor")
    kappa = 1.0 - 1.0 / (math.sqrt(3.0) * np.cos(np.radians(20.0 + 10.0 * share)))
    kappa *= np.exp(0.1 * stats.norm.ppf(factor))
    found = row("shadow_30mm", "largest contraction without load")
    assert found.band == pytest.approx(100.0 * np.quantile(kappa, (0.05, 0.5, 0.95)), rel=0.01)
    assert (found.measured, found.verdict) == (40.0, "agrees")


# --- the files


@pytest.mark.parametrize("name", DEVICES)
def test_measured_numbers_have_a_place_to_look_up(name: str) -> None:
    device = DEVICES[name]
    assert any(word in device.source for word in ("http", "github.com", "models/muscles", "IEEE", "CMBBE"))
    assert bool(device.wanting) != bool(device.predict)
    assert device.kind in coverages() or device.wanting
    if device.predict:
        assert device.error_from, "an error says where it is from"
        assert all(each.error for each in device.measured)


def test_measured_numbers_are_those_of_the_papers_formulas() -> None:
    """By hand: Bolen's F620, Takosoglu's eq. 5, Hunt's equation."""
    values = {
        (n, m.quantity): float(m.value.partition(" ")[0]) for n, d in DEVICES.items() for m in d.measured
    }
    for length in (11.2, 28.1, 51.8):
        f620 = 303.5 * math.atan(19.03 * (0.01 * length - 0.0075))
        assert values["bolen_10mm", f"largest force at 620 kPa, {length} cm"] == pytest.approx(f620, abs=0.1)
    force = math.pi / 4.0 * 0.01**2 * 6e5 * (17.0 * 0.9**3.2 - 8.0)
    assert values["takosoglu_mas_10_300", "force at 10 % contraction, 6 bar"] == pytest.approx(force, abs=0.1)
    hunt = (120.0 - 254.3 - 192.0 * math.tan(-2.0265 * 0.4609)) / 1.229
    assert values["hunt_10mm", "force at no contraction, 120 kPa"] == pytest.approx(hunt, abs=0.1)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"measure": "1"}, "unknown key.*did you mean 'measured'"),
        ({"predict": "forse"}, "did you mean 'force'"),
    ],
)
def test_a_wrong_file_is_refused_by_its_key(tmp_path: pathlib.Path, change: Any, says: str) -> None:
    keys = {"device": "d", "bench": "b", "kind": "muscle force", "description": "x", "source": "s"}
    keys |= {"predict": "force"} | change
    text = "\n".join(f'{key} = "{value}"' for key, value in keys.items())
    (tmp_path / "one.toml").write_text(text + '\n[[measured]]\nquantity = "q"\nvalue = "1 N"\n')
    with pytest.raises(InputError, match=says):
        lab.read_device(tmp_path / "one.toml")


@nightly("14 s; three rows of it run by day")
def test_the_page_shows_the_summary() -> None:
    shown = PAGES["accuracy"].partition("<!-- ledger begins -->\n")[2].partition("<!-- ledger ends -->")[0]
    rows = lab.ledger()
    assert script("ledger").coverage_of(rows) == coverages()
    assert shown == "".join(f"- {line}.\n" for line in lab.summary(rows))
    assert len({r.bench for r in rows if r.verdict != "cannot tell"}) >= 10


# --- recordings, logs, command line


def test_recordings_need_their_folder(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path) -> None:
    code, out, _ = call(capsys, "validate", "--bench", "--json")
    assert code == 0 and json.loads(out) == []
    code, out, _ = call(capsys, "validate", "--bench")
    assert code == 0 and "--data FOLDER" in out and "aarl_festo10_isometric" in out
    code, _, err = call(capsys, "validate", "--bench", "--data", tmp_path)
    assert code == 2 and "--data" in err and "Traceback" not in err
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "log.csv").write_text("time [s],pressure [bar]\n")
    code, _, err = call(capsys, "validate", "--bench", "--data", tmp_path)
    assert code == 2 and "bench.toml" in err and "[[predict]]" in err


def log(file: pathlib.Path, title: str, values: np.ndarray, *facts: str) -> pathlib.Path:
    """100 strides of 1.1 s, the foot down for 0.6 s of each."""
    time = np.arange(len(values)) * 0.1
    lines = [f"{t:.1f},{int(t % 1.1 < 0.55)},{x:.9g}" for t, x in zip(time, values, strict=True)]
    file.write_text("\n".join([*facts, f"time [s],heel strike [-],{title}", *lines]) + "\n")
    return file


def test_a_log_of_bottle_flow_or_tank_gives_the_same_air(tmp_path: pathlib.Path) -> None:
    """0.09 g in 1.1 s; over 1.185 kg/m³ a flow, and V Δp = m R T in a tank of 2 l at 20 °C."""
    time = np.arange(1112) * 0.1
    rate = 0.09 / 1.1  # [g/s]
    litres = np.full(len(time), 60.0 * rate / 1.185)
    pressure = 20.0 - time * rate * 1e-3 * 287.05 * 293.15 / 2e-3 * 1e-5
    band = (0.08, 0.09, 0.10)
    rows = [
        air_row(log(tmp_path / "a.csv", "bottle mass [g]", 700.0 - rate * time, "# error: 0.5 g"), band),
        air_row(log(tmp_path / "b.csv", "flow [l/min]", litres), band),
        air_row(log(tmp_path / "c.csv", "tank pressure [bar]", pressure, "# tank volume: 2 l"), band),
    ]
    for found in rows:
        assert found.measured == pytest.approx(0.09, rel=2e-3)
        assert found.source.startswith("inside") and found.verdict == "agrees"
    assert rows[0].error == pytest.approx(0.5 / 100.0, rel=0.02)
    assert air_row(tmp_path / "b.csv", (0.10, 0.11, 0.12)).source.startswith("outside")


def test_a_log_refutes_by_air_that_was_taken_and_by_more_than_its_error(tmp_path: pathlib.Path) -> None:
    file, lost = tmp_path / "a.csv", 700.0 - 0.09 / 1.1 * np.arange(1112) * 0.1
    for fact in ("# error: 5 g", "# error: 1 kg"):
        found = air_row(log(file, "bottle mass [g]", lost, fact), (0.10, 0.11, 0.12))
        assert found.source.startswith("not distinguishable") and found.verdict != "disagrees"
    for values, fact in ((lost[::-1], ""), (lost, "# error: -5 g")):
        with pytest.raises(InputError, match="no log of consumed air"):
            air_row(log(file, "bottle mass [g]", values, *([fact] if fact else [])), (0.10, 0.11, 0.12))


@pytest.mark.parametrize(
    ("title", "count", "says"),
    [
        ("air [g]", 1112, "does not state air"),
        ("tank pressure [bar]", 1112, "tank volume"),
        ("flow [l/min]", 60, "heel strikes"),
    ],
)
def test_a_log_that_says_too_little_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path, title: str, count: int, says: str
) -> None:
    code, _, err = call(capsys, "validate", "--air", log(tmp_path / "x.csv", title, np.ones(count)))
    assert code == 2 and says in err and "Traceback" not in err
