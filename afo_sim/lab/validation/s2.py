"""Piteľ & Tóthová (S2): the corner of its chart, its four laws on the maker's curves, its short period."""

import numpy as np

from afo_sim.description import reader
from afo_sim.lab.fitting.law_fit import fit_law, held_out
from afo_sim.lab.fitting.law_problem import pose, select
from afo_sim.lab.validation.laws import BAR, FLUIDIC, MAKER, WHY_MAKER, characteristic, law_force, one_force
from afo_sim.lab.validation.row import Row, compared, curve, lost, number
from afo_sim.physics.static_force import braid_force
from afo_sim.simulation.run import run

WHY_BOUND = "bound on the fit's RMS"
WHY_TOO_MANY = (
    "21 coefficients on 33 points: the shipped set is fitted to a grid of `sarosi_2012` instead, and only "
    "the error on unseen pressures says anything"
)

# S2's four approximations → bound on the RMS over the maker's curve at 10 and 20 mm [N].
S2_LAWS = {
    "kerscher_2006": ("eq. 3–7", 9.6, 21.5),
    "maximum_force": ("eq. 8–9", 2.4, 3.7),
    "sarosi_2012": ("eq. 10", 1.9, 2.1),
    "polynomial": ("eq. 11", 0.6, None),
}


def s2() -> list[Row]:
    found = [*_chart_corner()]
    for law, (equation, *bounds) in S2_LAWS.items():
        for bore, bound in zip(FLUIDIC, bounds, strict=True):
            found.append(_on_makers_curve(law, equation, bore, bound))
    why = "the paper names Matlab's Curve Fitting Toolbox and prints no value"
    found += _short_period()
    return [*found, lost("S2", "coefficients of eq. 3–11; damping R; the bracket of eq. 8", why)]


def _short_period() -> list[Row]:
    """The angles between which the arm swings at the short period, beside the axis of S2's figure 6."""
    angle = np.degrees(run("arm-short")["ankle/angle"])
    why = (
        "S2 prints neither filling times nor pulley nor inertia; those of `arm-short` are assumed here, so "
        "its angle is not S2's, and only the differences between laws can be compared"
    )
    return [
        compared(
            "S2 figure 6",
            f"arm at a short period: {end} angle",
            axis,
            float(swung),
            "deg",
            sourcing="printed, end of the axis; times assumed here",
            why=why,
        )
        for end, axis, swung in (("least", -5.0, angle.min()), ("largest", 35.0, angle.max()))
    ]


def _chart_corner() -> list[Row]:
    """S2's chart ends at −3 % and 600 kPa, "up to 2000 N": the maker's table, muscle and laws there."""
    data, muscle = characteristic(20), reader.load("muscle", "dmsp_20")
    stretched = np.isclose(data.contraction, -0.03)  # type: ignore[arg-type]
    line = np.polyfit(data.pressure[stretched], data.force[stretched], 1)
    braid = braid_force(-0.03, muscle.braid_stiffness)
    what = "20 mm at −3 %, 600 kPa"
    found = [
        number(
            "S2 figure 4",
            f"{what}: {name}",
            2000.0,
            simulated,
            200.0,
            "N",
            sourcing=f"printed (“up to”); {how}",
            why=WHY_MAKER,
        )
        for name, simulated, how in (
            (
                f"maker's table, along its {stretched.sum()} points at −3 %",
                float(np.polyval(line, 6.0 * BAR)),
                "table second-hand",
            ),
            (
                "muscle, law at 0 and the braid's stiffness",
                one_force(muscle, muscle.law, 0.0, 6.0 * BAR) + braid,
                "muscle fitted here",
            ),
        )
    ]
    why = (
        "laws are fitted to κ ≥ 0 and only continued here; the simulator never asks them below zero, where "
        "the braid carries"
    )
    for law in S2_LAWS:
        force = one_force(muscle, law, -0.03, 6.0 * BAR)
        found.append(
            compared(
                "S2 figure 4",
                f"{what}: `{law}` continued below κ = 0",
                2000.0,
                force,
                "N",
                sourcing="printed (“up to”); fitted here",
                why=why,
            )
        )
    return found


def _on_makers_curve(law: str, equation: str, bore: int, bound: float | None) -> Row:
    """A shipped law on the maker's curve that it was fitted to, and what it misses of unseen pressures."""
    data, _ = select(characteristic(bore))
    muscle = reader.load("muscle", FLUIDIC[bore])
    assert data.contraction is not None
    errors = law_force(muscle, law, data.contraction, data.pressure) - data.force
    unseen = held_out(fit_law(pose(law, [data]), starts=4)).held_out_rms("pressure")
    return curve(
        f"S2 {equation}",
        f"`{law}` on the {bore} mm curve, RMS",
        errors,
        bound,
        "N",
        sourcing=MAKER,
        why=WHY_BOUND if bound else WHY_TOO_MANY,
        held_out={"pressure": unseen},
    )


PARTS = (s2,)
