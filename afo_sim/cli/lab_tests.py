"""Commands of the laboratory: stand, fit, calibrate, paper, validate, credibility."""

import json
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from afo_sim.cli.common import (
    RecordingOption,
    Scenario,
    Sets,
    app,
    drawn,
    one_group,
    picked,
    print_table,
    print_tables,
    progress,
    quantity,
    read_sets,
)
from afo_sim.cli.common import print_line as print
from afo_sim.cli.overwriting import check_folder
from afo_sim.common import Foreign, Function, Mixed, check_writable

if TYPE_CHECKING:
    from afo_sim.lab import Stand

# Options of a test alone; `replay` and `sensitivity` refuse them.
_OF_A_TEST = ["law", "friction", "pressure", "load", "contraction", "length", "stiffness", "series"]
_OF_A_TEST += ["valve", "supply"]
_RUN_FILES = ("fit_run.json", "scenario.toml", "fit_run.png", "fit_run.pdf")
_LAW_FILES = ("fit.json", "muscle.toml", "fit.png", "fit.pdf")
_PAIRS = {"fixed": "k=1", "facts": 'bore="20 mm"', "sets": 'supply.pressure="3 bar"'}  # of `fit`
_PAIRS |= {"noise": 'angle="0.5 deg"', "rates": 'angle="2 deg/s"'}


@dataclass(frozen=True)
class _Test:
    """Options of `stand`: muscles, and what is done to them."""

    test: Annotated[
        str,
        Argument(
            help="isobaric|isotonic|isometric (all: these)|auxotonic|sealed|step|release|sensitivity|replay"
        ),
    ]
    muscles: Annotated[list[str], Argument(help="shipped muscles or TOML files; for replay: logs of a bench")]
    law: Annotated[list[str] | None, Option(help="force law; repeat for several")] = None
    friction: Annotated[list[str] | None, Option(help="friction law, or none; repeat for several")] = None
    pressure: Annotated[
        list[str] | None,
        Option(help='gauge pressure, "3 bar"; repeat for several curves, or for from and to'),
    ] = None
    load: Annotated[list[str] | None, Option(help='load, "200 N" or "20 kg"; repeat for several')] = None
    contraction: Annotated[
        list[str] | None, Option(help='contraction, 0.1 or "10 %"; repeat for several')
    ] = None
    length: Annotated[list[str] | None, Option(help="length of the braid, instead of a contraction")] = None
    stiffness: Annotated[list[str] | None, Option(help='for auxotonic: "5 N/mm"; repeat for several')] = None
    series: Annotated[int | None, Option(help="number of equal muscles end to end")] = None
    valve: Annotated[str | None, Option(help="for step and release: valve (mh1 by default)")] = None
    supply: Annotated[str | None, Option(help="supply pressure; by default the muscle's limit")] = None
    time: Annotated[str | None, Option(help="duration of one stroke up or down; slow by default")] = None
    static: Annotated[bool, Option("--static", help="static formula instead of the simulated rig")] = False
    compare: Annotated[Path | None, Option(help="CSV of measured points to compare with")] = None
    sets: Annotated[
        list[str] | None,
        Option("--set", metavar="KEY=VALUE", help='set a key of the muscle, such as damping="1e-4 m^2*s"'),
    ] = None
    bench: Annotated[
        list[str] | None,
        Option(
            metavar="KEY=VALUE", help='for replay: facts of the bench, such as muscle=dmsp_10, supply="6 bar"'
        ),
    ] = None
    free: Annotated[str, Option(help="for replay: settings to fit to the first log, comma-separated")] = ""
    out: Annotated[Path, Option(help="output folder, .csv or .parquet file")] = Path("runs/stand")
    rrd: RecordingOption = None


@app.command("stand")
@one_group
def stand_command(test: _Test) -> None:
    """Test muscles on a simulated stand. Compares them with measured points and logs on request."""
    if test.test == "replay":
        return _replay(test)
    if test.test == "sensitivity":
        return _sensitivity(test)
    with progress("compiling the muscles") as report:
        from afo_sim.lab import printed
        from afo_sim.lab.stand import stand
        from afo_sim.show import target, write_stand_files

        place = target(test.out, test.test).folder
        (check_folder if place == test.out else check_writable)(place)  # a table may lie beside others
        tests = stand(
            test.test,
            test.muscles,
            sets=read_sets(test.sets, example='damping="1e-4 m^2*s"'),
            progress=report,
            **picked(test, *_OF_A_TEST, "time", "static", "compare"),
        )
        written = {}
        for kind in tests.kinds:
            report(0, 0, f"writing {kind}")
            written[kind] = write_stand_files(tests.of(kind), target(test.out, kind), rrd=drawn(test.rrd))
    for kind, files in written.items():
        own = tests.of(kind)
        for trial in own.trials:
            print_table(*printed(trial))
        for line in _remarks(own):
            print(line)
        wall = sum(trial.wall_seconds for trial in own.trials)
        print(f"{wall:.1f} s; written: {', '.join(map(str, files))}")


def _sensitivity(test: _Test) -> None:
    """What braid angle, length and bore do to each muscle at each pressure."""
    from afo_sim.common import InputError
    from afo_sim.description import load
    from afo_sim.lab.stand import sensitivity

    others = {*_OF_A_TEST, "time", "static", "compare", "bench", "free"} - {"pressure"}
    if given := sorted(name for name in others if getattr(test, name)):
        raise InputError("is not accepted by sensitivity", field=given[0], allowed="--pressure or --set")
    for name in test.muscles:
        muscle = load("muscle", name, read_sets(test.sets))
        for text in test.pressure or ["3 bar"]:
            pressure = quantity("--pressure", text, "Pa", above=0.0, at_most=muscle.limits.pressure)
            rows = [[key, *(f"{x:.4g}" for x in y)] for key, y in sensitivity(muscle, pressure).items()]
            print_table(f"{muscle.name}, {muscle.law}, {text}", ["", "-10 %", "as it is", "+10 %"], rows)


def _replay(test: _Test) -> None:
    """Logs of a bench replayed, after a fit to the first."""
    sets, bench = read_sets(test.sets), read_sets(test.bench, "--bench", 'supply="6 bar"')
    with progress("compiling the muscles"):
        from afo_sim.common import InputError
        from afo_sim.lab import fit_replay, replay
        from afo_sim.show import write_replays

        if given := [name for name, value in picked(test, *_OF_A_TEST).items() if value]:
            raise InputError("is not accepted by replay", field=given[0], allowed="--bench or --set")
        check_folder(test.out)
        names = [name.strip() for name in test.free.split(",") if name.strip()]
        fit = fit_replay(test.muscles[:1], names, bench=bench, sets=sets) if names else None
        fitted = fit.values if fit else {}
        found = [replay(log, bench=bench | fitted, sets=sets) for log in test.muscles]
        files = write_replays(found, test.out)
    shares = [[one.log.file.name, *row] for one in found for row in one.rows]
    print_table("replayed", ["log", "channel", "RMS error", "of the largest [%]"], shares)
    for line in fit.lines if fit else ():
        print(f"fitted to the first log: {line}")
    if fitted and len(found) > 1:
        print("the other logs were held out")
    for one in found:
        if one.loops:
            loops = " N, ".join(f"{side} {width:.3g}" for side, width in one.loops.items())
            print(f"{one.log.file.name}: loop of force over pressure, {loops} N")
        for warning in one.warnings:
            print(f"warning: {warning}")
    print(f"written: {', '.join(map(str, files))}")


def _remarks(tests: "Stand") -> Iterator[str]:
    """Lines below the tables: S0's lines, exceeded limits, errors against measured points."""
    from afo_sim.lab import static_load

    for trial in tests.trials:
        if trial.plan.kind == "isobaric" and trial.plan.muscle.law in ("reynolds_2003", "serres_2009"):
            yield f"{trial.name}: {static_load(trial).text}"
        if trial.plan.kind == "step":
            moving = max(m["still_moving"].value for m in trial.metrics)
            if moving > 1.0:
                yield f"{trial.name}: still moving ({moving:.2g} %) after venting; use a longer --time"
        yield from (f"warning: {warning}" for warning in trial.warnings)
    for trial, compared in zip(tests.trials, tests.compared, strict=False):
        factor, unit = (100.0, "%") if trial.plan.kind == "isotonic" else (1.0, "N")
        left = f"; {compared.left_out} points lie on no curve" if compared.left_out else ""
        yield (
            f"{trial.name} against {compared.name}: {factor * compared.rms:.3g} {unit} RMS, worst "
            f"{factor * compared.worst:.3g} {unit}, {len(compared.x)} points{left}"
        )


_HOLD_OUT = "law: all|none|pressure|load|curve|muscle; scenario: share of the log's end, 0 for none; "
_HOLD_OUT += "orthosis: all|none|group|angle|pressure, repeated for several, or a CSV to predict"
_FACT = 'law: fact that the CSV lacks, such as bore="20 mm"'
_NOISE = 'scenario: noise, such as angle="0.5 deg"; estimated from the log by default'
_RATE = 'orthosis: bounds of a log\'s still samples, such as angle="2 deg/s"'


@dataclass(frozen=True)
class _Fit:
    """Options of `fit`: what is fitted to what."""

    data: Annotated[list[Path], Argument(help="CSV files of measured points or a log", metavar="FILES...")]
    law: Annotated[str | None, Option(help="name of a force law, or all (default)")] = None
    scenario: Annotated[str | None, Option(help="fit this scenario to the log: name or TOML file")] = None
    orthosis: Annotated[
        list[str] | None,
        Option(help="fit an orthosis: the one whose torque was measured, a name or file; or GROUP=ORTHOSIS"),
    ] = None
    free: Annotated[
        list[str] | None,
        Option(help="parameters to fit, separated by commas; of a law in addition to its usual ones"),
    ] = None
    hold_out: Annotated[list[str] | None, Option(help=_HOLD_OUT)] = None
    test: Annotated[list[Path] | None, Option(help="law: further CSV to predict, not to fit")] = None
    fixed: Annotated[list[str] | None, Option(metavar="NAME=VALUE", help="law: parameter to fix")] = None
    facts: Annotated[list[str] | None, Option("--fact", metavar="KEY=VALUE", help=_FACT)] = None
    loss: Annotated[str | None, Option(help="law: linear, or with outliers soft_l1|huber|cauchy")] = None
    like: Annotated[str | None, Option(help="law: muscle that supplies what the data lack")] = None
    sets: Sets = None
    noise: Annotated[list[str] | None, Option(metavar="CHANNEL=VALUE", help=_NOISE)] = None
    chamber: Annotated[str | None, Option(help="orthosis: filled chamber, if no file states it")] = None
    torque: Annotated[str | None, Option(help="orthosis: device; or difference (minus no air)")] = None
    rates: Annotated[list[str] | None, Option("--rate", metavar="KEY=VALUE", help=_RATE)] = None
    out: Annotated[Path | None, Option(help="output folder; runs/fit, fit-run or fit-torque")] = None


@app.command("fit")
@one_group
def fit_command(asked: _Fit) -> None:
    """Fit a muscle, scenario or orthosis to your measurements. Reports what the data do not determine."""
    kind = "scenario" if asked.scenario is not None else "orthosis" if asked.orthosis else "law"
    options = picked(asked, "law", "scenario", "test", "loss", "like", "chamber", "torque")
    names = [name.strip() for each in asked.free or () for name in each.split(",") if name.strip()]
    options["free"] = None if asked.free is None else names
    for name, example in _PAIRS.items():
        given = getattr(asked, name)
        options[name] = read_sets(given, f"--{name.removesuffix('s')}", example) if given else None
    if asked.orthosis:
        worn, example = asked.orthosis, "GROUP=ORTHOSIS, once for each group"
        alone = len(worn) == 1 and "=" not in worn[0]
        options["orthosis"] = worn[0] if alone else read_sets(worn, "--orthosis", example)
    held: Mixed = asked.hold_out
    if held and kind != "orthosis":
        held = quantity("--hold-out", held[-1], "") if kind == "scenario" else held[-1]
    usual = {"law": "fit", "scenario": "fit-run", "orthosis": "fit-torque"}[kind]
    out, data = asked.out or Path("runs") / usual, asked.data[0] if len(asked.data) == 1 else asked.data
    with progress("reading the files, compiling the muscles") as report:
        from afo_sim import show
        from afo_sim.common import together
        from afo_sim.lab import fit, law_result, run_report, torque_report

        made: dict[str, tuple[str, tuple[str, ...], Foreign, Function]] = {
            "law": ("fit of a muscle's law", _LAW_FILES, law_result, show.write_fit_figure),
            "scenario": ("fit to a log", _RUN_FILES, run_report, show.write_log_figure),
            "orthosis": (
                "fit to static torques",
                torque_report.FILES,
                torque_report,
                show.write_torque_figure,
            ),
        }
        what, files, words, draw = made[kind]
        check_folder(out, what)
        found: Foreign = fit(data, hold_out=held, progress=lambda text: report(0, 0, text), **options)
        with together(out, files) as folder:
            words.write(found, folder, *([out] if kind == "orthosis" else ()))
            draw(found, folder)
    print_tables(words.tables(found), words.remarks(found))
    hint = ""
    if kind == "law" and len(asked.data) == 1:
        hint = f"; put it into a device with: afo-sim new orthosis NAME --muscle {out / 'muscle.toml'}"
    if kind == "scenario" and names and found.converged:
        hint = f"; run it with: afo-sim run {out / run_report.SCENARIO}"
    if kind == "orthosis":
        place = out / next(iter(torque_report.folders(found).values()))
        hint = f"; run it with: afo-sim run --set orthosis={place}"
    print(f"written to {out}{hint}")


@app.command("calibrate")
def calibrate_command(
    log: Annotated[Path, Argument(help="CSV of reference [bar] and reading [V], in measured order")],
    inverse: Annotated[bool, Option("--inverse", help="V = slope/x + intercept")] = False,
    step: Annotated[str, Option(help="resolution of the converter")] = "0.01 V",
    out: Annotated[Path, Option(help="folder for sensor.toml")] = Path("runs/calibration"),
) -> None:
    """Calibrate a sensor from readings at known values. The written sensor.toml works in a scenario."""
    from afo_sim.common import write_sealed
    from afo_sim.lab import calibrate

    check_folder(out)
    found, sensor = calibrate(log, inverse=inverse, step=quantity("--step", step, "V", above=0.0))
    rows = [[name, f"{value:.6g} {unit}"] for name, (value, unit) in found.items()]
    print_table(f"V = slope{'/x' if inverse else ' x'} + intercept", ["", ""], rows)
    write_sealed(out / "sensor.toml", sensor, "sensor")
    print(f'written: {out / "sensor.toml"}; in a scenario: type = "{out}"')


@app.command("paper")
def paper_command(
    name: Annotated[str, Argument(help="S0|S1|S2|S3", metavar="PAPER")] = "S1",
    as_json: Annotated[bool, Option("--json", help="print every number as JSON; write no files")] = False,
    out: Annotated[Path | None, Option(help="output folder; runs/paper-<paper> by default")] = None,
) -> None:
    """Compare a paper with the simulator, claim by claim. Every table and figure has both numbers."""
    with progress("reading the paper") as report:
        from afo_sim.common import json_text
        from afo_sim.lab import markdown, paper

        folder = out or Path("runs") / f"paper-{name}"
        if not as_json:
            check_folder(folder)
        found = paper(name, lambda done, total: report(done, total, "simulating"))
        files = []
        if not as_json:
            from afo_sim.show import write_paper

            report(0, 0, "drawing")
            files = write_paper(found, folder)
    if as_json:
        print(json_text(asdict(found)))
    else:
        print(markdown(found))
        print(f"written: {', '.join(map(str, files))}")
    if any(claim.outcome == "FAILED" for claim in found.claims):
        sys.exit(1)


@app.command("validate")
def validate_command(
    as_json: Annotated[bool, Option("--json", help="print every row and table cell as a JSON list")] = False,
    worn: Annotated[bool, Option("--worn", help="instead: other groups' devices, with bands")] = False,
    bench: Annotated[bool, Option("--bench", help="instead: logs of test benches, predicted")] = False,
    data: Annotated[Path | None, Option(help="with --bench: folder of logs with a bench.toml")] = None,
    air: Annotated[Path | None, Option(help="instead: air per stride of a log and its band")] = None,
    scenario: Annotated[str, Option(help="walking scenario of that log")] = "walk-dropfoot-afo",
    walker: Annotated[bool, Option("--walker", help="instead: responding walker and measurements")] = False,
) -> None:
    """Compare with every published number. Exit code 1 if one is missed; afo-sim paper has the details."""
    if worn or bench or air is not None:
        _ledger(as_json, worn, bench, data, air, scenario)
        return
    if walker:
        _walker(as_json)
        return
    with progress("comparing with what was published") as report:
        from afo_sim.common import json_text
        from afo_sim.lab import validation as v

        rows = v.validate(lambda done, total: report(done, total, "simulating"))
    print(json_text([asdict(row) for row in rows]) if as_json else v.summary(rows))
    if not all(row.passed for row in rows):
        sys.exit(1)


def _walker(as_json: bool) -> None:
    """The responding walker beside measurement; a disagreement is a result, and no failure."""
    with progress("walking"):
        from afo_sim.common import json_text
        from afo_sim.walker.measured import compare

        rows = compare()
    if as_json:
        print(json_text([asdict(row) for row in rows]))
        return
    cells = [[_spread(r.measured, *r.spread), _spread(r.simulated, *r.between)] for r in rows]
    cost = "no", "yes"
    table = [[r.quantity, *c, r.unit, r.verdict, cost[r.in_cost]] for r, c in zip(rows, cells, strict=True)]
    print_table("measured, and the responding walker", ["", "measured", "walker", "", "", "in cost"], table)
    print("\n".join(f"{row.quantity}: {row.why} ({row.source})" for row in rows))


def _spread(value: float, low: float, high: float) -> str:
    return (
        "–" if value != value else f"{value:.3g}" if low != low else f"{value:.3g} ({low:.3g} to {high:.3g})"
    )


def _ledger(
    as_json: bool, worn: bool, bench: bool, data: Path | None, air: Path | None, scenario: str
) -> None:
    """What is predicted beside what others measured; a disagreement is a result, and no failure."""
    with progress("predicting") as report:
        from afo_sim.common import InputError
        from afo_sim.lab import air_log, bench_sets
        from afo_sim.lab import ledger as lab

        rows = lab.ledger(report) if worn else []
        benches: list[bench_sets.BenchRow] = []
        if bench and data is not None:
            benches, rows = [*bench_sets.bench(data, report)], [*rows, *bench_sets.loops(data)]
        if air is not None:
            air_log.air_row(air, (0.0, 0.0, 0.0))  # refuse the file before drawing
            from afo_sim.study.python_calls import uncertainty

            bands = uncertainty(scenario).studies["uncertainty"]["metrics"]
            if "air_per_stride" not in bands:
                raise InputError("uses no air", field="--scenario", value=scenario)
            rows.append(air_log.air_row(air, bands["air_per_stride"]["quantiles"]))
    all_rows: list[bench_sets.BenchRow | lab.LedgerRow] = [*benches, *rows]
    values = [asdict(row) | {"verdict": row.verdict} for row in all_rows]
    if as_json:
        print(json.dumps(values, ensure_ascii=False, indent=1))
        return
    if bench:
        print_table("benches", list(bench_sets.HEADER), [row.cells for row in benches])
        print("\n".join(dict.fromkeys(line for row in benches for line in row.lines)))
        print("" if data else bench_sets.absent())
    if rows:
        print_table("predicted and measured", list(lab.HEADER), lab.table(rows))
    sources = dict.fromkeys(f"{row.device}: {row.source}" for row in rows if row.source)
    print("\n".join([*(lab.summary(rows) if worn else ()), "", *sources]))


@dataclass(frozen=True)
class _Question:
    """Options of `credibility`."""

    scenario: Scenario
    question: Annotated[str, Option(help="the decision to be made, in your words")]
    context: Annotated[str, Option(help="how the run is used beside other evidence, in your words")]
    influence: Annotated[str, Option(help="influence of the run on the decision: low|medium|high")]
    consequence: Annotated[str, Option(help="consequence of a wrong decision: low|medium|high")]
    metric: Annotated[str, Option(help="metric that answers the question")] = "toe_clearance"
    draws: Annotated[int, Option(help="number of draws of the uncertain inputs")] = 200
    out: Annotated[Path | None, Option(help="output folder; runs/<scenario>-credibility by default")] = None
    sets: Sets = None
    as_json: Annotated[bool, Option("--json", help="print everything as JSON; write no files")] = False


@app.command("credibility")
@one_group
def credibility_command(asked: _Question) -> None:
    """Assess whether a walk may support a decision (ASME V&V 40). It is no approval."""
    folder = asked.out or Path("runs") / f"{Path(asked.scenario).stem}-credibility"
    options = picked(asked, "question", "context", "influence", "consequence", "metric", "draws")
    with progress("reading the files, compiling the muscles") as report:
        from afo_sim.common import json_text
        from afo_sim.lab.credibility import credibility

        if not asked.as_json:
            check_folder(folder, "credibility assessment")
        options["progress"] = lambda done, total: report(done, total, "walking and drawing")
        found = credibility(asked.scenario, read_sets(asked.sets), **options)
        files = [] if asked.as_json else found.save(folder)
    if asked.as_json:
        print(json_text(found.to_json()))
        return
    rows = [[each.name, str(each.grade), str(each.required)] for each in found.factors]
    print_table(asked.question, ["", "grade", "needs"], rows, whole_names=True)
    print("\n".join([found.judgement.upper(), *found.because]))
    print(f"written: {', '.join(map(str, files))}")
