"""What cuff, plate and cables do to S1's orthosis on a drop foot, and what restores the lift.

Prints the tables of `docs/mounting.md` and of both orthoses' pages, and the strides with which walking
begins, from muscles that were filled and from empty ones. All numbers are those of the settled stride that
is solved for. "Without air" is the same device whose inlets never open and whose outlets are never shut. A
toe with a star is the height where the recorded foot passes lowest: this one has no minimum of its own while
it is fast.

    python scripts/cuff_study.py [--part bare|cuff|parts|remedies|shipped|walkers|rigid]
"""

import argparse

import afo_sim as afo

Sets = dict[str, object]
PLAIN, SHORT = "walk-dropfoot-afo", "walk-dropfoot-afo-short"
BRIEF: Sets = {"duration": "2.6 s", "reference": "orthosis-off"}  # hardly more than the settled strides
BARE, HEALTHY = "walk-dropfoot", "walk-healthy"
SHOD: Sets = {"shoe": "trainer"}
WALKERS = "bovi2011_xs", "bovi2011_natural", "bovi2011_l", "gatk_stride1", "gatk_mean", "opensim_walk"
EMPTY: Sets = {"start.dorsiflexor.fill_time": "0 s"}
SHANK, FOOT = "orthosis.anchor.shank", "orthosis.anchor.foot"
FRONT = "orthosis.muscle.dorsiflexor."
CABLES = (f"{FRONT}cable.stiffness", "orthosis.muscle.plantarflexor.cable.stiffness")
LINK, LENGTH = 112, 215  # of S1's dorsiflexors [mm]
STIFFENING = {"stiffening": {"force": "33 N", "length": "17 mm"}}
LATE: Sets = {"phases.dorsiflexor.outlet[0][0]": 0.40}
PLATE_ALONE = {"foot": {"stiffness": "50 kN/m"}}
CUFF_ALONE = {"shank": {"stiffness": "4 kN/m"}}
HEAD = (
    "toe [mm]",
    "toes less extended [mm]",
    "ball [mm]",
    "without air [mm]",
    "against push-off, 10 ms [N·m]",
    "air per stride [mg]",
    "cuff gives [mm]",
    "pull [N]",
)
OUTLET = "orthosis.chamber.dorsiflexor.outlet.conductance"

Case = tuple[str, str, Sets]  # label, scenario, what it sets
CUFFS = {None: "rigid", 16: "16 kN/m", 8: "8 kN/m", 4: "4 kN/m", 2: "2 kN/m"}


def cuff(stiffness: int | None) -> Sets:
    """A cuff of so many kN/m; None is a rigid one."""
    if stiffness is None:
        return {"orthosis.anchor": PLATE_ALONE}
    return {f"{SHANK}.stiffness": f"{stiffness} kN/m"}


def link(shorter: int) -> Sets:
    """Links shorter by so many millimetres in front."""
    return {f"{FRONT}link_length": f"{LINK - shorter} mm"}


def longer(more: int) -> Sets:
    """Dorsiflexors longer by so many millimetres, with links shorter by as much."""
    return link(more) | {f"{FRONT}type.total_length": f"{LENGTH + more} mm"}


def cables(stiffness: str) -> Sets:
    """All cables of one stiffness."""
    return dict.fromkeys(CABLES, stiffness)


REMEDIES: dict[str, Sets] = {
    "as shipped": {},
    **{f"links {shorter} mm shorter": link(shorter) for shorter in (10, 20, 25, 30)},
    **{f"muscles {more} mm longer": longer(more) for more in (20, 40, 80)},
    "vented from 0.40": LATE,
    "vented from 0.40, links 30 mm shorter": LATE | link(30),
}
RIGID = cables("1000 kN/m") | {"orthosis.anchor": {}}
PARTS: dict[str, list[Case]] = {
    "bare": [  # what they are held against: nobody wears an orthosis
        (f"{scenario}, {shod}", scenario, sets)
        for scenario in (HEALTHY, BARE)
        for shod, sets in (("barefoot", {}), ("in the trainer", SHOD))
    ],
    "cuff": [  # alone; plate and cables stay as shipped
        ("cuff and plate rigid", PLAIN, {"orthosis.anchor": {}}),
        *((CUFFS[stiffness], PLAIN, cuff(stiffness)) for stiffness in CUFFS),
        ("stiffening, 33 N, 17 mm", PLAIN, {SHANK: STIFFENING}),
    ],
    "parts": [  # cables and plate at half, double and rigid
        ("as shipped", PLAIN, {}),
        *((f"cables {each}", PLAIN, cables(each)) for each in ("50 kN/m", "200 kN/m", "1000 kN/m")),
        ("plate 25 kN/m", PLAIN, {f"{FOOT}.stiffness": "25 kN/m"}),
        ("plate 100 kN/m", PLAIN, {f"{FOOT}.stiffness": "100 kN/m"}),
        ("plate rigid", PLAIN, {"orthosis.anchor": CUFF_ALONE}),
    ],
    "remedies": [  # what restores the lift, on 4 kN/m and on a cuff half and twice as stiff
        (f"{stiffness} kN/m: {label}", PLAIN, cuff(stiffness) | sets)
        for stiffness in (4, 2, 8)
        for label, sets in REMEDIES.items()
    ],
    "shipped": [  # the scenario on shorter links, on other cuffs
        *((CUFFS[stiffness], SHORT, cuff(stiffness)) for stiffness in (None, 8, 4, 2)),
        ("stiffening, 33 N, 17 mm", SHORT, {SHANK: STIFFENING}),
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
    "rigid": [  # nothing gives: cables of 1e6 N/m, no cuff, no plate
        ("rigid, 4 bar", PLAIN, RIGID),
        ("the same, cables 10 MN/m", PLAIN, RIGID | cables("10 MN/m")),
        ("rigid, 3 bar", PLAIN, RIGID | {"supply.pressure": "3 bar"}),
        ("rigid, 2.5 bar", PLAIN, RIGID | {"supply.pressure": "2.5 bar"}),
        ("rigid, outlet three times as large", PLAIN, RIGID | {OUTLET: "0.165 dm^3/(s*bar)"}),
    ],
}


def shown(value: float, digits: int = 1) -> str:
    """A number with a true minus sign."""
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "−")


def mounted(run: afo.Recording) -> list[str]:
    """What only a walk with an orthosis has: the columns from "without air" on."""
    metrics, solved = run.metrics, run["gait/solved"] == 1.0
    found = [
        shown(metrics["reference_toe_clearance"]),
        shown(metrics["torque_against_push_off"]),
        shown(1e3 * metrics["air_per_stride"], 0),
    ]
    if "cuff/shank/displacement" not in run.columns:
        return [*found, "", ""]
    gives, pull = (run[f"cuff/shank/{name}"][solved].max() for name in ("displacement", "force"))
    return [*found, shown(1e3 * gives, 0), shown(pull, 0)]


def row(case: Case) -> str:
    """One line of a table: the settled stride with air, and the toe without."""
    label, scenario, sets = case
    worn = scenario in (PLAIN, SHORT)
    run = afo.run(scenario, (BRIEF if worn else {}) | sets)
    metrics = run.metrics
    star = "*" if metrics["swings_without_toe_event"] > 0.0 else ""
    cells = [
        shown(metrics["toe_clearance"]) + star,
        shown(metrics["toe_clearance_less_extended"]),
        shown(metrics["ball_clearance"]),
        *(mounted(run) if worn else [""] * (len(HEAD) - 3)),
    ]
    return f"| {label} | {' | '.join(cells)} |"


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
        print(f"\n| {part} | {' | '.join(HEAD)} |\n|{'---|' * (len(HEAD) + 1)}")
        for case in PARTS[part]:
            print(row(case), flush=True)
    for scenario in (PLAIN, SHORT):
        print(f"\n{scenario}, toe by stride: {begun(scenario, {})}")
        print(f"{scenario}, from empty muscles: {begun(scenario, EMPTY)}")


if __name__ == "__main__":
    main()
