"""A study as a user writes it, with every promised name; `mypy --strict` reads it, and nothing runs it."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import afo_sim as afo
from afo_sim.control import Observation

SHORT = {"duration": "1 s", "timestep": "2 ms"}


def lift(seen: Observation) -> dict[str, str]:
    unloaded = seen["foot/toe_load"] < 400.0 and bool(seen.rows("ankle/angle").max() < 0.1)
    return {"dorsiflexor": "inlet" if unloaded else "outlet"}


@afo.column("ankle/doubled", "rad")
def doubled(columns: Mapping[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    return 2.0 * columns["ankle/angle"]


@afo.metric("toe_up", "deg", "highest angle of the ankle", of="run")
def toe_up(columns: Mapping[str, NDArray[np.float64]]) -> float:
    return float(np.degrees(columns["ankle/angle"].max()))


def muscles(name: str, bore: str) -> tuple[float, NDArray[np.float64]]:
    muscle: afo.Muscle = afo.load("muscle", name, {"bore": bore}).using(law="kerscher_2006")
    pull: float = muscle.force("3 bar", contraction=0.1)
    curve: NDArray[np.float64] = muscle.force("3 bar", contraction=[0.0, 0.05, 0.1])
    rest: float = muscle.contraction("3 bar", force="100 N") + muscle.pressure(100.0, length="28 cm")
    return pull + rest + muscle.volume(contraction=0.1), curve


def runs(out: Path) -> list[float]:
    scenario: afo.Scenario = afo.load("scenario", "seated").set({"supply.pressure": "4 bar"})
    run: afo.Recording = afo.run(scenario, SHORT, controller=lift, rate=100.0)
    swing: afo.Metric = run.metrics["range_of_motion"]
    told = {column: values.mean() for column, values in run.items() if column.startswith("ankle/")}
    ranges = afo.expect(run, "ankle/angle").between("-15 deg", "28 deg")
    saved: Path = run.save(out / "run.parquet")
    again = afo.read_recording(saved)
    afo.figure(again, out / "angle.pdf", kind="angle")
    page: Path = afo.report({"one": run, "two": again}, out / "runs.html")
    afo.view([run, again])
    both = afo.both("walk-dropfoot-afo", left_sets={"supply.pressure": "3 bar"}, affected="right")
    ranges.verify()
    print(told, page, both.right.metrics, run.to_pandas(), swing > "10 deg", afo.list("muscles"))
    return [swing.value, again.metrics["air_per_cycle"].value]


def studies(out: Path) -> None:
    cases = afo.sweep("seated", {"supply.pressure": afo.span("2 bar", "4 bar", 5)}, SHORT, out=out, threads=2)
    pressure: NDArray[np.float64] = cases["pressure"]
    over = {"supply.pressure": ("2 bar", "4 bar")}
    best = afo.optimise("seated", over, SHORT, lowest="air_per_cycle", limits=["range_of_motion >= 5 deg"])
    afo.run(best.scenario)
    sized = afo.size("tube", "walk-dropfoot-afo", limits="toe_clearance >= 10 mm", length="2 m")
    first = afo.effects("walk-dropfoot-afo").ranked[0].name
    bands = afo.uncertainty("walk-dropfoot-afo", draws=40).studies
    torque = afo.torque_map("walk-dropfoot-afo", angles=[-0.1, 0.0, 0.1], pressures=[2e5]).maps[0].torque
    print(pressure.max(), sized.holds, first, bands, torque.max())


def bench(file: Path, log: dict[str, NDArray[np.float64]]) -> dict[str, float]:
    table = afo.stand("isobaric", "dmsp_20", pressure=["2 bar", "4 bar"], static=True).table()
    law = afo.fit(file, law="sarosi_2012", facts={"bore": "20 mm"}, hold_out="none")
    run = afo.fit(log, scenario="seated", free=["friction"], noise={"angle": "0.1 deg"}, hold_out=0.0)
    device = afo.fit([file, file], orthosis="s1", hold_out="angle")
    print(table["force"].max(), law.muscle.name, run.scenario.name, device.orthosis.name)
    return law.parameters | run.values | device.parameters


def bodies(out: Path) -> None:
    afo.install()
    afo.register(toe_up, doubled)
    afo.import_leg(out / "leg.urdf", out / "mine", shank="tibia", foot="foot")
    afo.export_leg("adult_75kg", out / "adult.urdf", orthosis="s1")
    afo.draw(afo.refit(afo.load("orthosis", "s1"), shank=0.9), out / "s1.png", leg="adult_75kg")
    leg = afo.attach(out / "leg.xml", "s1", side="right", supply="3 bar")
    print(sorted(leg.chambers), afo.build("seated").warnings)


def steps() -> float:
    with afo.Simulator("seated", SHORT) as one, afo.Simulators("seated", SHORT) as several:
        print(several.step(), one.step({"dorsiflexor": "inlet"}, 0.01))
    try:
        return one.time
    except (afo.InputError, afo.SimulationError) as error:
        print(error)
    except afo.AfoSimError as error:
        print(error.exit_code)
    return 0.0
