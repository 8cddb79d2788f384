"""A file of every kind that this program writes and reads again, with what reads it."""

import functools
import json
import pathlib
import re
import shutil
from collections.abc import Callable
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import sweep_runs
from skin_markers import body, markers_of
from studio.test_messages import SAMPLES

from afo_sim.common import (
    assets,
    find,
    find_gait,
    read_json,
    read_parquet,
    read_table,
    user_cache,
    without_digests,
    write_json,
    write_parquet,
    write_sealed,
)
from afo_sim.control import read_log
from afo_sim.control.switch_log import TITLES
from afo_sim.description import load, toml_text
from afo_sim.description.portable import portable
from afo_sim.gait import file as gait_file
from afo_sim.gait_lab import write_role_map
from afo_sim.gait_lab.trial.roles import read_role_map
from afo_sim.lab.air_log import air_row
from afo_sim.lab.bench_log import read_bench_log
from afo_sim.lab.bench_sets import read_bench
from afo_sim.lab.ledger import read_device
from afo_sim.legs import attach, import_leg, write_attached
from afo_sim.legs import read_attached as attached
from afo_sim.simulation import Recording, intact_picture, read_checks, read_recording
from afo_sim.studio import Design, Document, opened, save
from afo_sim.studio.messages import MESSAGES, read_message
from afo_sim.study import SWEEP, read, runner, time_step
from afo_sim.study.folder import told_in
from afo_sim.study.results import STEPS
from afo_sim.study.search import store as search
from afo_sim.study.uncertainty.spreads import read as read_spreads
from afo_sim.walker import read_gait, save_table, write_gait
from afo_sim.walker.patients import read_gaits
from afo_sim.walker.population import read_condition

# Kinds that people write, or other files, with the shipped one.
SHIPPED = {
    "population": "populations/contracture.toml", "walker": "walkers/natural.toml",
    "gaits": "populations/contracture.csv", "uncertainty": "uncertainties/usual.toml",
    "checks": "checks/seated.toml", "ledger": "ledger/galle_2017.toml",
}  # fmt: skip
Files = dict[str, tuple[pathlib.Path, Callable[[], Any]]]  # kind: the file, and what reads it
# Files whose digest stands in another file, and one that is of this machine.
BESIDE = ("picture", "worn model's file", "leg's file", "copied by a search", "copied by the studio", "cache")
VARIANT = "variant"  # a scenario too, which the studio alone reads
NUMBERS = (
    "both legs",
    "answer",
    "stand summary",
    "law fit",
    "torque fit",
    "run fit",
    "walk",
    "electronics",
)
TIME = np.arange(0.0, 1.5, 0.01)


def _message(file: pathlib.Path) -> object:
    return read_message(json.loads(file.read_bytes().decode("utf-8", "replace")))


def make(place: pathlib.Path, run: Recording) -> None:
    """Write them all into a folder."""
    run.save(place / "run")
    for op, sample in SAMPLES.items():
        (place / f"message-{op}.json").write_text(json.dumps({"op": op, **sample}), encoding="utf-8")
    (place / "bench").mkdir()
    shutil.copy(
        assets.folder("models") / "benches" / "aarl_festo10_isometric.toml", place / "bench" / "bench.toml"
    )
    log = [f"{0.02 * k:g},{2 + 0.1 * (k % 9):g},{80 + k:g}" for k in range(60)]
    (place / "bench-log.csv").write_text("\n".join(["time [s], pressure [bar], force [N]", *log]) + "\n")
    log = [f"{0.05 * k:g},{int(k % 24 < 12)},{900 - 0.01 * k:g}" for k in range(24 * 30)]
    (place / "air-log.csv").write_text("\n".join(["time [s], heel strike [-], bottle mass [g]", *log]) + "\n")
    for kind, name in SHIPPED.items():
        source = next(assets.folder("models").glob(name))
        shutil.copy(source, place / f"shipped-{kind}{source.suffix}")
    runner.run(sweep_runs.opened(sweep_runs.written(place, sweep_runs.SEATED), place / "part"), part=(1, 3))
    sweep_runs.swept(place / "swept", sweep_runs.SEATED)
    columns = {"x": np.linspace(0.0, 1.0, 50), "word": np.array(["a", "b"] * 25, object)}
    generation = place / "generation.parquet"
    search.write_table(generation, columns, "generation", {}, {})
    search.write_table(place / search.DESIGNS, columns, "designs", {"x": "m"}, {"search": "s"})
    write_json(place / search.BEST, {"sets": {"supply.pressure": 3e5}, "feasible": True}, "best design")
    gait_file.write(place / "stride.csv", gait_file.read(find_gait("opensim_walk")))
    write_attached(attach("adult_75kg", "s1"), place / "worn.xml")
    import_leg(find("leg", "adult_75kg").parent / "leg.xml", place / "leg", toes="toe")
    user_cache.write("kind", "key", bytes(range(256)))
    write_gait(place / "mine.toml", read_gait("natural"))
    save_table([{"wearer": "a", "speed": "1.2"}, {"wearer": "b", "speed": "1.1"}], place / "walk", {})
    write_role_map(place / "roles.toml", markers_of(body(TIME), {"heel": "{S}HEE"}, TIME))
    write_sealed(place / "commands.csv", f"{','.join(TITLES)}\n0,front,0,1\n9,front,1,0\n", "commands")
    for kind, name in {"orthosis": "s1", "muscle": "dmsp_10", "sensor": "as5048"}.items():
        text = toml_text(load(kind, name).model_dump(mode="json"))
        write_sealed(place / f"{kind}.toml", text, kind)
    for kind in NUMBERS:
        write_json(place / f"{kind}.json", {"numbers": [1.5, None], "word": "a"}, kind)
    for kind in ("stand", "walked columns"):
        write_parquet(place / f"{kind}.parquet", pa.table({"x": columns["x"]}), kind)
    own = place / "own.csv"  # a person's file without a digest, which is copied
    own.write_text(without_digests((place / "stride.csv").read_text(encoding="utf-8")), encoding="utf-8")
    document = Document(Design("walk-dropfoot-afo", {"gait.cycle": str(own)}))
    document.keep()
    save(document, place / "studio")
    best = place / "search"
    scenario = portable(document.design.scenario.resolved(), best)
    write_sealed(best / "best.toml", toml_text(scenario), "scenario", best)


def files(place: pathlib.Path) -> Files:
    """Those of a folder, by their kinds."""
    run, studio, best, results = place / "run", place / "studio", place / "search", place / "swept" / "out"
    chunk, copied = next((place / "part" / "chunks").iterdir()), "files/gait_cycle/own.csv"
    generation = place / "generation.parquet"

    def brought(kind: str) -> pathlib.Path:
        return next(place.glob(f"shipped-{kind}.*"))

    return {
        "recording": (run / "recording.parquet", lambda: read_recording(run)),
        "picture": (run / "recording.rrd", lambda: intact_picture(run)),
        "summary": (run / "summary.json", lambda: intact_picture(run)),
        "results": (results / "results.parquet", lambda: read(results)),
        "chunk": (chunk, lambda: read(place / "part")),
        "manifest": (results / "sweep.json", lambda: SWEEP.read(results)),
        "time step": (results / STEPS, lambda: time_step.remark(results)),
        "generation": (generation, lambda: search.read_table(generation)),
        "designs": (place / "designs.parquet", lambda: search.read_table(place / search.DESIGNS)),
        "best design": (place / "best.json", lambda: told_in(place / search.BEST, "")),
        "scenario": (best / "best.toml", lambda: load("scenario", best / "best.toml")),
        "copied by a search": (best / copied, lambda: load("scenario", best / "best.toml")),
        VARIANT: (studio / "variant_A.toml", lambda: opened(str(studio))),
        "copied by the studio": (studio / copied, lambda: opened(str(studio))),
        "stride": (place / "stride.csv", lambda: gait_file.read(place / "stride.csv")),
        "orthosis": (place / "orthosis.toml", lambda: load("orthosis", place / "orthosis.toml")),
        "muscle": (place / "muscle.toml", lambda: load("muscle", place / "muscle.toml")),
        "worn model's file": (place / "worn.xml", lambda: attached(place / "worn.xml")),
        "worn model": (place / "worn.toml", lambda: attached(place / "worn.xml")),
        "leg": (place / "leg" / "leg.toml", lambda: load("leg", place / "leg")),
        "leg's file": (place / "leg" / "leg.xml", lambda: load("leg", place / "leg")),
        "adapted gait": (place / "mine.toml", lambda: read_gait(place / "mine.toml")),
        "wearers": (place / "walk" / "walk.csv", lambda: read_table(place / "walk" / "walk.csv", "")),
        "role map": (place / "roles.toml", lambda: read_role_map(place / "roles.toml")),
        "sensor": (place / "sensor.toml", lambda: load("sensor", place / "sensor.toml")),
        "commands": (place / "commands.csv", lambda: read_log(place / "commands.csv", ["front"])),
        **{
            kind: (brought(kind), functools.partial(reader, brought(kind)))
            for kind, reader in {
                "population": read_condition,
                "walker": read_gait,
                "uncertainty": read_spreads,
                "gaits": lambda file: read_gaits(file, read_condition("contracture").draw()),
                "checks": read_checks,
                "ledger": read_device,
            }.items()
        },
        "bench set": (place / "bench" / "bench.toml", lambda: read_bench(place / "bench")),
        "bench log": (place / "bench-log.csv", lambda: read_bench_log(place / "bench-log.csv")),
        "air log": (place / "air-log.csv", lambda: air_row(place / "air-log.csv", (0.1, 0.2, 0.3))),
        **{
            f"message {op}": (file := place / f"message-{op}.json", functools.partial(_message, file))
            for op in MESSAGES
        },
        "cache": (user_cache.folder() / "kind-key", lambda: user_cache.read("kind", "key")),
        **{k: (place / f"{k}.json", functools.partial(read_json, place / f"{k}.json")) for k in NUMBERS},
        **{
            kind: (place / f"{kind}.parquet", functools.partial(read_parquet, place / f"{kind}.parquet"))
            for kind in ("stand", "walked columns")
        },
    }


def unseal(path: pathlib.Path) -> None:
    """Make a file such as an older version or another program writes it, without a digest in it."""
    if path.suffix == ".parquet":
        table = pq.read_table(path)
        facts = {key: value for key, value in table.schema.metadata.items() if key != b"afo_sim_sealed"}
        pq.write_table(table.replace_schema_metadata(facts), path)
    elif path.suffix == ".json":
        path.write_text(re.sub(r',\n  "digest": "[0-9a-f]{32}"\n}', "\n}", path.read_text("utf-8")), "utf-8")
    else:
        path.write_text(without_digests(path.read_text("utf-8")), "utf-8")
