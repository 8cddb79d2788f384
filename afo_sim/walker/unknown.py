"""Falls in simulation over what is not known of a patient: drawn, never chosen; corners stand beside."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from afo_sim.common import InputError
from afo_sim.description import Scenario
from afo_sim.walker.answer import CASES
from afo_sim.walker.body import build_body
from afo_sim.walker.gait_file import Gait
from afo_sim.walker.population import as_drawn, draw_about
from afo_sim.walker.respond import Falls, falls_of, strengths_of

MOST_DRAWS = 1000


@dataclass(frozen=True, eq=False)
class Band:
    """Falls of each draw and of each corner, by case."""

    draws: Mapping[str, np.ndarray]  # (n,)
    corners: Mapping[str, Mapping[str, float]]  # their numbers, by name
    falls: Mapping[str, tuple[Falls, ...]]  # of the draws
    at_corners: Mapping[str, tuple[Falls, ...]]

    def shares(self, case: str) -> np.ndarray:
        """Share of starts that fell in each draw (n,)."""
        return np.array([each.count / each.of for each in self.falls[case]])

    def range(self, case: str) -> list[float]:
        """5, 50 and 95 % of the draws' shares [-]."""
        return [float(share) for share in np.percentile(self.shares(case), (5.0, 50.0, 95.0))]

    def halves(self, case: str, name: str) -> tuple[float, float]:
        """Share that falls in the draws with the lower half of a number, and with the upper one [-]."""
        shares = self.shares(case)[np.argsort(self.draws[name], kind="stable")]
        half = (len(shares) + 1) // 2
        return float(shares[:half].mean()), float(shares[-half:].mean())

    def acting(self, case: str) -> list[str]:
        """The drawn numbers that a case has: no cuff without a device."""
        return [name for name in self.draws if name != "cuff" or case.startswith("device")]

    def deciding(self, case: str) -> dict[str, float]:
        """Numbers that falls follow beyond chance (5 % for all of them), by Spearman's rank correlation."""
        from scipy.stats import spearmanr  # slow to import

        shares = self.shares(case)
        acting = self.acting(case) if len(shares) > 2 and np.ptp(shares) else []
        ranks = {name: spearmanr(self.draws[name], shares) for name in acting}
        found = {n: float(rank.statistic) for n, rank in ranks.items() if rank.pvalue < 0.05 / len(acting)}
        return dict(sorted(found.items(), key=lambda each: -abs(each[1])))

    def table(self) -> tuple[list[str], list[list[str]]]:
        """Header and rows of text, a column for each case."""
        ranges = map(self.range, self.falls)
        rows = [["drawn: median (5 to 95 %)", *(f"{b:.0%} ({a:.0%} to {c:.0%})" for a, b, c in ranges)]]
        for k, corner in enumerate(self.corners):
            rows.append([corner, *(f"{of[k].count} of {of[k].of}" for of in self.at_corners.values())])
        for name, drawn in self.draws.items():
            ends = " to ".join(f"{round(float(end), 2):.4g}" for end in (drawn.min(), drawn.max()))
            halves = ["{:.0%} → {:.0%}".format(*self.halves(case, name)) for case in self.falls]
            cells = [h if name in self.acting(c) else "–" for h, c in zip(halves, self.falls, strict=True)]
            rows.append([f"{name} {ends}: lower → upper half", *cells])
        ranks = map(self.deciding, self.falls)
        told = (", ".join(f"{n} {r:+.2f}" for n, r in each.items()).replace("-", "−") for each in ranks)
        rows.append(["what decides beyond chance, rank correlation", *(each or "–" for each in told)])
        return ["perturbed starts that fall", *(CASES[case] for case in self.falls)], rows


def draw_falls(
    scenario: Scenario,
    gaits: Mapping[str, Gait],
    *,
    draws: int,
    starts: int,
    push: float = 50.0,
    strength: Mapping[str, float] | None = None,
    seed: int = 0,
    threads: int = 2,
    report: Callable[[float], None] | None = None,
) -> Band:
    """Falls among perturbed starts of drawn patients and of corners, who are the same in all cases."""
    if not 1 <= draws <= MOST_DRAWS:
        raise InputError("is out of range", field="draws", value=draws, allowed=f"1 to {MOST_DRAWS}")
    own = {"tibialis": 1.0} | strengths_of(scenario, strength)
    drawn, corners, patients = draw_about(scenario, own, draws, seed)
    if not any(case.startswith("device") for case in gaits):
        drawn.pop("cuff", None)
    found: dict[str, tuple[Falls, ...]] = dict.fromkeys(gaits, ())
    for k, patient in enumerate(patients):
        for case, gait in gaits.items():
            body = build_body(*as_drawn(scenario, own, patient, worn=case.startswith("device")))
            falls = falls_of(body, gait.vector, starts=starts, push=push, seed=seed, threads=threads)
            found[case] += (falls,)
        if report is not None:
            report((k + 1) / len(patients))
    n = len(corners)
    after, first = ({c: of[part] for c, of in found.items()} for part in (slice(n, None), slice(n)))
    return Band(drawn, corners, after, first)
