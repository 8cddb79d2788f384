"""What cuff, plate and cables do to S1's orthosis on a drop foot, and what restores the lift.

Prints the tables of `docs/mounting.md`, and the strides with which walking begins. Clearance, torque and air
are those of the settled stride that is solved for; in the rigid part, to be held against other programs, of
the last of 14 that are walked. "Without air" is the same device whose inlet never opens and whose outlet is
never shut.

    python scripts/cuff_study.py [--part cuff|parts|remedies|shipped|rigid]
"""

import argparse
from collections.abc import Iterator

import afo_sim as afo

PLAIN, SHORT = "walk-dropfoot-afo", "walk-dropfoot-afo-short"
BRIEF = {"duration": "2.6 s"}  # hardly more than the settled strides
WALKED = {"duration": "18 s", "gait.settled": "walked"}
SHANK, FOOT = "orthosis.anchor.shank", "orthosis.anchor.foot"
FRONT = "orthosis.muscle.dorsiflexor."
CABLES = (f"{FRONT}cable.stiffness", "orthosis.muscle.plantarflexor.cable.stiffness")
LINK, LENGTH = 112, 215  # of S1's dorsiflexors [mm]
STIFFENING = {"stiffening": {"force": "33 N", "length": "17 mm"}}
LATE = {"phases.dorsiflexor.outlet[0][0]": 0.40}
PLATE_ALONE = {"foot": {"stiffness": "50 kN/m"}}
CUFF_ALONE = {"shank": {"stiffness": "4 kN/m"}}
NO_AIR = {"phases.dorsiflexor": {"outlet": [[0.0, 1.0]]}}
HEAD = "toe [mm]", "without air [mm]", "peak torque, 10 ms [N·m]", "air per stride [mg]", "cuff gives [mm]"

OUTLET = "orthosis.chamber.dorsiflexor.outlet.conductance"

Sets = dict[str, object]
Case = tuple[str, str, Sets]  # label, scenario, what it sets


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


def of_cuffs() -> Iterator[Case]:
    """The cuff alone; plate and cables stay as shipped."""
    yield "cuff and plate rigid", PLAIN, {"orthosis.anchor": {}}
    for stiffness in (None, 16, 8, 4, 2):
        yield "rigid" if stiffness is None else f"{stiffness} kN/m", PLAIN, cuff(stiffness)
    yield "stiffening, 33 N, 17 mm", PLAIN, {SHANK: STIFFENING}


def of_parts() -> Iterator[Case]:
    """Cables and plate at half, double and rigid."""
    yield "as shipped", PLAIN, {}
    for stiffness in ("50 kN/m", "200 kN/m", "1000 kN/m"):
        yield f"cables {stiffness}", PLAIN, cables(stiffness)
    for stiffness in ("25 kN/m", "100 kN/m"):
        yield f"plate {stiffness}", PLAIN, {f"{FOOT}.stiffness": stiffness}
    yield "plate rigid", PLAIN, {"orthosis.anchor": CUFF_ALONE}


def of_remedies() -> Iterator[Case]:
    """What restores the lift, on 4 kN/m and on a cuff half and twice as stiff."""
    for stiffness in (4, 2, 8):
        on = cuff(stiffness)
        yield f"{stiffness} kN/m: as shipped", PLAIN, on
        for shorter in (10, 20, 25, 30):
            yield f"{stiffness} kN/m: links {shorter} mm shorter", PLAIN, on | link(shorter)
        for more in (20, 40, 80):
            yield f"{stiffness} kN/m: muscles {more} mm longer", PLAIN, on | longer(more)
        yield f"{stiffness} kN/m: vented from 0.40", PLAIN, on | LATE
        yield f"{stiffness} kN/m: vented from 0.40, links 30 mm shorter", PLAIN, on | LATE | link(30)


def of_shipped() -> Iterator[Case]:
    """The shipped scenario on shorter links, on other cuffs."""
    for stiffness in (None, 8, 4, 2):
        yield "rigid" if stiffness is None else f"{stiffness} kN/m", SHORT, cuff(stiffness)
    yield "stiffening, 33 N, 17 mm", SHORT, {SHANK: STIFFENING}
    yield "3 bar", SHORT, {"supply.pressure": "3 bar"}


def of_rigid() -> Iterator[Case]:
    """Nothing gives: cables of 1e6 N/m, no cuff, no plate."""
    rigid = cables("1000 kN/m") | {"orthosis.anchor": {}} | WALKED
    yield "rigid, 4 bar", PLAIN, rigid
    yield "the same, cables 10 MN/m", PLAIN, rigid | cables("10 MN/m")
    yield "rigid, 3 bar", PLAIN, rigid | {"supply.pressure": "3 bar"}
    yield "rigid, 2.5 bar", PLAIN, rigid | {"supply.pressure": "2.5 bar"}
    yield "rigid, outlet three times as large", PLAIN, rigid | {OUTLET: "0.165 dm^3/(s*bar)"}


PARTS = {
    "cuff": of_cuffs,
    "parts": of_parts,
    "remedies": of_remedies,
    "shipped": of_shipped,
    "rigid": of_rigid,
}


def row(case: Case) -> str:
    """One line of a table: the last stride with air, and without."""
    label, scenario, sets = case
    run = afo.run(scenario, BRIEF | sets)
    bare = {key: value for key, value in sets.items() if not key.startswith("phases.")}
    empty = afo.run(scenario, BRIEF | bare | NO_AIR).metrics["toe_clearance"]
    found, given = run.strides[max(run.strides)], "–"
    if "cuff/shank/displacement" in run.columns:
        last = run["gait/stride"] == max(run.strides)
        given = f"{1e3 * run['cuff/shank/displacement'][last].max():.0f}"
    torque = found["orthosis_peak_dorsiflexion_torque_10ms"]
    numbers = found["toe_clearance"], empty, torque, 1e3 * found["air_per_stride"]
    return f"| {label} | {' | '.join(f'{number:.1f}' for number in numbers)} | {given} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--part", choices=PARTS, action="append")
    for part in parser.parse_args().part or PARTS:
        print(f"\n| {part} | {' | '.join(HEAD)} |\n|{'---|' * (len(HEAD) + 1)}")
        for case in PARTS[part]():
            print(row(case), flush=True)
    for scenario in (PLAIN, SHORT):
        strides = afo.run(scenario).strides
        toes = ", ".join(f"{m['toe_clearance']:.1f}" for m in strides.values() if "toe_clearance" in m)
        print(f"\n{scenario}, toe by stride [mm]: {toes}")


if __name__ == "__main__":
    main()
