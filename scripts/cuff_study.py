"""What cuff, plate and cables do to S1's orthosis on a drop foot, and what restores the lift.

Prints the tables of `docs/mounting.md` and of both orthoses' pages, and the strides with which walking
begins, from muscles that were filled and from empty ones. All numbers are those of the settled stride that
is solved for. "Without air" is the same device whose inlets never open and whose outlets are never shut. A
toe with a star is the height where the recorded foot passes lowest: this one has no minimum of its own while
it is fast.

    python scripts/cuff_study.py [--part bare|cuff|parts|remedies|shipped|walkers]
"""

import argparse

import pandas as pd

import afo_sim as afo

Sets = dict[str, object]
PLAIN, SHORT = "walk-dropfoot-afo", "walk-dropfoot-afo-short"
BARE, HEALTHY = "walk-dropfoot", "walk-healthy"
WORN: Sets = {"duration": "2.6 s", "reference": "orthosis-off"}  # hardly more than the settled strides
SHOD: Sets = {"shoe": "trainer"}
WALKERS = "bovi2011_xs", "bovi2011_natural", "bovi2011_l", "gatk_stride1", "gatk_mean", "opensim_walk"
EMPTY: Sets = {"start.dorsiflexor.fill_time": "0 s"}
SHANK, FOOT = "orthosis.anchor.shank", "orthosis.anchor.foot"
FRONT, BACK = "orthosis.muscle.dorsiflexor", "orthosis.muscle.plantarflexor"
LINK, LENGTH = 112, 215  # of S1's dorsiflexors [mm]
RIGID_CUFF: Sets = {"orthosis.anchor": {"foot": {"stiffness": "50 kN/m"}}}
STIFFENING: Sets = {SHANK: {"stiffening": {"force": "33 N", "length": "17 mm"}}}
COLUMNS = {  # heading: metric, factor to its unit, digits
    "toe [mm]": ("toe_clearance", 1.0, 1),
    "toes less extended [mm]": ("toe_clearance_less_extended", 1.0, 1),
    "ball [mm]": ("ball_clearance", 1.0, 1),
    "without air [mm]": ("reference_toe_clearance", 1.0, 1),
    "against push-off, 10 ms [N·m]": ("torque_against_push_off", 1.0, 1),
    "air per stride [mg]": ("air_per_stride", 1e3, 0),
}

Case = tuple[str, str, Sets]  # label, scenario, what it sets


def cuff(stiffness: int) -> Sets:
    """A cuff of so many kN/m."""
    return {f"{SHANK}.stiffness": f"{stiffness} kN/m"}


def cables(stiffness: int) -> Sets:
    """All cables of so many kN/m."""
    return {f"{group}.cable.stiffness": f"{stiffness} kN/m" for group in (FRONT, BACK)}


def link(shorter: int) -> Sets:
    """Links shorter by so many millimetres in front."""
    return {f"{FRONT}.link_length": f"{LINK - shorter} mm"}


REMEDIES: dict[str, Sets] = {
    "as shipped": {},
    "links 10 mm shorter": link(10),
    "links 30 mm shorter": link(30),
    **{
        f"muscles {more} mm longer": link(more) | {f"{FRONT}.type.total_length": f"{LENGTH + more} mm"}
        for more in (40, 80)
    },
    "vented from 0.40": {"phases.dorsiflexor.outlet[0][0]": 0.40},
}
PARTS: dict[str, list[Case]] = {
    "bare": [  # what they are held against: nobody wears an orthosis
        ("healthy, in the trainer", HEALTHY, SHOD),
        ("drop foot, in the trainer", BARE, SHOD),
    ],
    "cuff": [  # alone; plate and cables stay as shipped
        ("cuff and plate rigid", PLAIN, {"orthosis.anchor": {}}),
        ("rigid", PLAIN, RIGID_CUFF),
        *((f"{stiffness} kN/m", PLAIN, cuff(stiffness)) for stiffness in (8, 4, 2)),
        ("stiffening, 33 N, 17 mm", PLAIN, STIFFENING),
    ],
    "parts": [  # cables and plate at half, double and rigid
        *((f"cables {each} kN/m", PLAIN, cables(each)) for each in (50, 200, 1000)),
        *((f"plate {each} kN/m", PLAIN, Sets({f"{FOOT}.stiffness": f"{each} kN/m"})) for each in (25, 100)),
        ("plate rigid", PLAIN, {"orthosis.anchor": {"shank": {"stiffness": "4 kN/m"}}}),
    ],
    "remedies": [  # what restores the lift, on 4 kN/m and on a cuff half and twice as stiff
        (f"{stiffness} kN/m: {label}", PLAIN, cuff(stiffness) | sets)
        for stiffness in (4, 2, 8)
        for label, sets in REMEDIES.items()
    ],
    "shipped": [  # the scenario on shorter links, on other cuffs
        ("rigid", SHORT, RIGID_CUFF),
        *((f"{stiffness} kN/m", SHORT, cuff(stiffness)) for stiffness in (8, 4, 2)),
        ("stiffening, 33 N, 17 mm", SHORT, STIFFENING),
        ("3 bar", SHORT, {"supply.pressure": "3 bar"}),
    ],
    "walkers": [  # other strides than the natural mean curves, alone in a trainer and with both devices
        (f"{walker}: {label}", scenario, {"gait.cycle": walker} | sets)
        for walker in WALKERS
        for label, scenario, sets in (
            ("healthy, in the trainer", HEALTHY, SHOD),
            ("drop foot, in the trainer", BARE, SHOD),
            ("S1's device", PLAIN, {}),
            ("on shorter links", SHORT, {}),
        )
    ],
}


def shown(value: float, digits: int = 1) -> str:
    """A number with a true minus sign."""
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "−")


def row(label: str, scenario: str, sets: Sets) -> dict[str, str]:
    """One line of a table: the settled stride with air, and the toe without."""
    run = afo.run(scenario, (WORN if scenario in (PLAIN, SHORT) else {}) | sets)
    cells = {
        heading: shown(factor * run.metrics[metric], digits)
        for heading, (metric, factor, digits) in COLUMNS.items()
        if metric in run.metrics
    }
    cells["toe [mm]"] += "*" if run.metrics["swings_without_toe_event"] > 0.0 else ""
    if "cuff/shank/displacement" in run.columns:
        settled = run["cuff/shank/displacement"][run["gait/solved"] == 1.0]
        cells["cuff gives [mm]"] = shown(1e3 * settled.max(), 0)
    return {"": label} | cells


def begun(scenario: str, sets: Sets) -> str:
    """Toe of the first strides [mm], and the air taken before and in the first one."""
    run = afo.run(scenario, sets)
    toes = [shown(m["toe_clearance"]) for m in run.strides.values() if "toe_clearance" in m]
    air = [shown(1e3 * run.metrics[name], 0) for name in ("air_before_first_step", "air_first_stride")]
    return f"{', '.join(toes)} mm; {air[0]} mg before the first step, {air[1]} mg in it"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--part", choices=PARTS, action="append")
    for part in parser.parse_args().part or PARTS:
        table = pd.DataFrame([row(*case) for case in PARTS[part]]).fillna("")
        print(f"\n{part}\n{table.to_string(index=False)}", flush=True)
    for scenario in (PLAIN, SHORT):
        print(f"\n{scenario}, toe by stride: {begun(scenario, {})}")
        print(f"{scenario}, from empty muscles: {begun(scenario, EMPTY)}")


if __name__ == "__main__":
    main()
