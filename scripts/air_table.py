"""S1's orthosis on a drop foot with other air paths: clearance, air, strides of a bottle, the lowest supply.

    python scripts/air_table.py

The first stride begins with the air that the scenario fills in while the wearer stands. Strides are those of
the scenario's source; without one, of a bottle of 0.5 l at 300 bar. All end at the supply's pressure.
"""

import afo_sim as afo

SCENARIO = "walk-dropfoot-afo"
CHAMBERS = ("dorsiflexor", "plantarflexor")


def of_chambers(**keys: str) -> dict[str, str]:
    """The same keys of both chambers."""
    return {
        f"orthosis.chamber.{c}.{key.replace('__', '.')}": value
        for c in CHAMBERS
        for key, value in keys.items()
    }


TUBE = of_chambers(tube="pun_4x2_5", tube_length="0.8 m", tube_volume="0 ml")
LARGE = of_chambers(inlet__conductance="0.22 dm^3/(s*bar)", outlet__conductance="0.22 dm^3/(s*bar)")
ROWS: dict[str, dict[str, str]] = {
    "own valves, 4 ml of tube without friction": {},
    "own valves, 0.8 m of 2.5 mm tube": TUBE,
    "valves four times as large, no friction": LARGE,
    "valves four times as large, 0.8 m of 2.5 mm tube": TUBE | LARGE,
    "own valves, 0.5 l bottle": {"supply.source": "bottle_0_5l"},
    "own valves, 16 g of carbon dioxide": {"supply.source": "co2_16g"},
    "large valves and tube, 0.5 l bottle, regulator that droops": TUBE
    | LARGE
    | {"supply.source": "bottle_0_5l", "supply.regulator": "droop_tenth"},
}
METRICS = (
    "toe_clearance_stride_1",
    "toe_clearance",
    "lowest_toe_clearance",
    "air_per_stride",
    "strides_per_bottle",
)


def main() -> None:
    """Print the table."""
    print("| air path | stride 1 [mm] | settled [mm] | lowest [mm] | air per stride [g] | strides |")
    print("|---|---|---|---|---|---|")
    for title, sets in ROWS.items():
        metrics = afo.run(SCENARIO, sets).metrics
        numbers = [metrics[name].value if name in metrics else float("nan") for name in METRICS]
        print(f"| {title} | " + " | ".join(f"{number:.4g}" for number in numbers) + " |")


if __name__ == "__main__":
    main()
