"""What shoes and outsoles do to walking: the tables of `docs/footwear.md`.

Prints them as markdown; `--write` puts them into the page, between its marks. All numbers are those of
settled strides that are solved for. The leg has the recorded walker's mass.

    python scripts/footwear_table.py [--write]
"""

import argparse
import pathlib
from collections.abc import Iterator

import numpy as np

import afo_sim as afo
from afo_sim.common import assets
from afo_sim.simulation import reference_of

PAGE = pathlib.Path(__file__).parents[1] / "docs" / "footwear.md"
BEGIN, END = "<!-- footwear: begin {} -->\n", "<!-- footwear: end {} -->"
BRIEF = {"duration": "3.7 s"}  # one stride from the start, and the settled ones
DEVICES = {"S1's device": "walk-dropfoot-afo", "on shorter links": "walk-dropfoot-afo-short"}
MINUS = "−"
PASSING = 0.72  # of the stride, when the foot has left the floor [-]

Sets = dict[str, object]


def shown(value: float, digits: int = 1) -> str:
    """A number with a true minus sign."""
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", MINUS)


def forefoot(run: afo.Recording) -> float:
    """Least height of ball and toe in the settled swing, until the shank is upright [mm]."""
    passing = (run["gait/solved"] == 1.0) & (run["gait/phase"] > PASSING) & (run["shank/angle"] > 0.0)
    return 1e3 * float(np.minimum(run["ball/height"], run["toe/height"])[passing].min())


def signed(value: float) -> str:
    """A difference with its sign."""
    return ("+" if value >= 0.0 else "") + shown(value)


def table(*rows: tuple[str, ...]) -> str:
    """Rows as markdown; the first is the head."""
    lines = [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join([lines[0], "|" + "---|" * len(rows[0]), *lines[1:]])


def toe(run: afo.Recording) -> str:
    """Toe clearance; with a star where no minimum while the foot is fast gave it."""
    metrics = run.metrics
    return shown(float(metrics["toe_clearance"])) + ("*" if metrics["swings_without_toe_event"] > 0.0 else "")


def walked(scenario: str, **sets: object) -> afo.Recording:
    """A scenario's run, hardly longer than its settled stride."""
    return afo.run(scenario, BRIEF | sets)


def of_shoes() -> Iterator[tuple[str, ...]]:
    """Each shoe on a healthy foot and on a drop foot without orthosis."""
    names = sorted(assets.names("shoe"), key=lambda name: afo.load("shoe", name).toe_stiffness)
    yield (
        "worn",
        "healthy forefoot [mm]",
        "drop foot's toe [mm]",
        "its ball [mm]",
        "foot at the event [°]",
        "toes at push-off [°]",
    )
    for shoe in (None, *names):
        worn: Sets = {} if shoe is None else {"shoe": shoe}
        healthy, drop = walked("walk-healthy", **worn), walked("walk-dropfoot", **worn)
        metrics = drop.metrics
        at = np.abs(drop["gait/phase"] - 0.01 * metrics["toe_clearance_phase"]).argmin()
        pitch = np.degrees(drop["ankle/angle"][at] - drop["shank/angle"][at])
        push_off = np.degrees(healthy["toe/extension"].max())
        yield (
            shoe or "barefoot",
            shown(forefoot(healthy)),
            toe(drop),
            shown(metrics["ball_clearance"]),
            shown(pitch),
            shown(push_off, 0),
        )


def of_properties() -> Iterator[tuple[str, ...]]:
    """The trainer without one of its properties at a time, on a drop foot."""
    shoe, key = afo.load("shoe", "trainer"), "shoe."
    without: dict[str, Sets] = {
        "as it is": {},
        "without mass": {f"{key}mass": "0 kg", f"{key}inertia": "0 kg*m^2"},
        "without drop (25 mm all along)": {f"{key}heel_stack": "25 mm", f"{key}ball_stack": "25 mm"},
        "half as thick": {
            f"{key}heel_stack": f"{500 * shoe.heel_stack:g} mm",
            f"{key}ball_stack": f"{500 * shoe.ball_stack:g} mm",
        },
        "without toe spring": {f"{key}toe_spring": "0 mm"},
        "as stiff as a leather shoe": {f"{key}toe_stiffness": "30 N*m/rad"},
        "no longer than the foot": {f"{key}tip_ahead": "0 mm"},
    }
    plain = 0.0
    yield "trainer on a drop foot", "toe [mm]", "difference"
    for label, sets in without.items():
        run = walked("walk-dropfoot", shoe="trainer", **sets)
        height = float(run.metrics["toe_clearance"])
        plain = height if not sets else plain
        yield label, toe(run), signed(height - plain) if sets else ""


def of_steps() -> Iterator[tuple[str, ...]]:
    """Barefoot → shoe → orthosis without air → with air: the steps add up to the whole."""
    yield "toe [mm]", "barefoot", "in the trainer", "orthosis off", "orthosis on", "sum of the steps"
    for label, name in DEVICES.items():
        bare, shod = walked("walk-dropfoot"), walked("walk-dropfoot", shoe="trainer")
        scenario = afo.load("scenario", name, BRIEF | {"reference": "orthosis-off"})
        off, on = afo.run(reference_of(scenario)), afo.run(scenario)
        runs = [bare, shod, off, on]
        heights = [float(run.metrics["toe_clearance"]) for run in runs]
        steps = [signed(step) for step in np.diff(heights)]
        cells = [f"{toe(run)} ({step})" for run, step in zip(runs[1:], steps, strict=True)]
        yield label, toe(bare), *cells, signed(heights[-1] - heights[0])


def of_bands() -> Iterator[tuple[str, ...]]:
    """The toe of S1's outsole, which is assumed, within its bounds."""
    key = "orthosis.outsole."
    bands: dict[str, Sets] = {
        "as shipped: toe spring 13 mm, 7 N·m/rad": {},
        "toe spring 0 mm": {f"{key}toe_spring": "0 mm"},
        "toe spring 15 mm": {f"{key}toe_spring": "15 mm"},
        "as stiff as a leather shoe, 30 N·m/rad": {f"{key}toe_stiffness": "30 N*m/rad"},
        "rigid plate, 500 N·m/rad, toe spring 0 mm": {
            f"{key}toe_stiffness": "500 N*m/rad",
            f"{key}toe_spring": "0 mm",
        },
    }
    yield "toe [mm]", *DEVICES
    for label, sets in bands.items():
        runs = [walked(name, **sets) for name in DEVICES.values()]
        yield label, *(f"{toe(run)}, ball {shown(run.metrics['ball_clearance'])}" for run in runs)


TABLES = {"shoes": of_shoes, "properties": of_properties, "steps": of_steps, "bands": of_bands}


def main() -> None:
    """Print the tables, or write them into the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--write", action="store_true", help="into docs/footwear.md")
    write = parser.parse_args().write
    for name, rows in TABLES.items():
        text = table(*rows())
        print(f"{text}\n")
        if write:
            page = PAGE.read_text(encoding="utf-8")
            before, _, rest = page.partition(BEGIN.format(name))
            _, end, after = rest.partition(END.format(name))
            PAGE.write_text(f"{before}{BEGIN.format(name)}{text}\n{end}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
