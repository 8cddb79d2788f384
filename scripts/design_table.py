"""The table of docs/sweeps.md: one change at a time to S1's orthosis."""

import afo_sim

SCENARIO = "walk-dropfoot-afo"
INLET, OUTLET = "phases.dorsiflexor.inlet[0][0]", "phases.dorsiflexor.outlet[0][0]"
FRONT = "orthosis.muscle.dorsiflexor"
PRESSURE, FILLED = "supply.pressure", "start.dorsiflexor.fill_time"
ROWS: tuple[tuple[str, dict[str, object]], ...] = (
    ("as shipped: 4 bar, filled from 0.50, vented from 0.15 of the stride", {}),
    ("not filled before the first step", {FILLED: "0 s"}),
    ("filled for 1 s before the first step", {FILLED: "1 s"}),
    ("without air", {"phases.dorsiflexor.inlet": [], FILLED: "0 s"}),
    ("vented from 0.30", {OUTLET: 0.30}),
    ("vented from 0.40", {OUTLET: 0.40}),
    ("3 bar", {PRESSURE: "3 bar"}),
    ("2.5 bar", {PRESSURE: "2.5 bar"}),
    ("3 bar, vented from 0.40", {PRESSURE: "3 bar", OUTLET: 0.40}),
    ("filled from 0.60", {INLET: 0.60}),
    ("two muscles in front, not three", {f"{FRONT}.count": 2}),
    ("moment arm of 5 cm, not 6.5 cm", {f"{FRONT}.insertion.from_joint[0]": "5 cm"}),
    ("outlet valve three times as large", {}),
    ("links 15 mm shorter", {}),
    ("links 30 mm shorter", {}),
    ("links 30 mm shorter, without air", {"phases.dorsiflexor.inlet": [], FILLED: "0 s"}),
    ("links 30 mm shorter, 3.5 bar, vented from 0.40", {PRESSURE: "3.5 bar", OUTLET: 0.40}),
    ("cuff of 2 kN/m", {"orthosis.anchor.shank.stiffness": "2 kN/m"}),
    ("cuff of 8 kN/m", {"orthosis.anchor.shank.stiffness": "8 kN/m"}),
)
NUMBERS = (
    ("toe_clearance", ".1f"),
    ("toe_clearance_stride_1", ".1f"),
    ("ball_clearance", ".1f"),
    ("air_per_stride", ".3f"),
    ("torque_against_push_off_10ms", ".1f"),
    ("plantarflexion_lost_at_toe_off", ".1f"),
)


def changes(title: str, sets: dict[str, object]) -> dict[str, object]:
    """A row's overrides; those that are relative follow from the shipped scenario."""
    shipped = afo_sim.load("scenario", SCENARIO).orthosis
    if title.startswith("outlet"):
        conductance = 3.0 * shipped.chamber["dorsiflexor"].vent.conductance
        return {"orthosis.chamber.dorsiflexor.outlet.conductance": f"{conductance!r} m^3/(s*Pa)"}
    if title.startswith("links"):
        shorter, link = float(title.split()[1]) / 1000.0, shipped.muscle["dorsiflexor"].link_length
        assert link is not None
        return {f"{FRONT}.link_length": f"{link - shorter!r} m", **sets}
    return sets


def main() -> None:
    """Print the table's rows."""
    for title, sets in ROWS:
        metrics = afo_sim.run(SCENARIO, {"timestep": "2 ms", **changes(title, sets)}).metrics
        told = [f"{float(metrics[name]):{form}}".replace("-", "−") for name, form in NUMBERS]
        print(f"| {title} | {' | '.join(told)} |")


if __name__ == "__main__":
    main()
