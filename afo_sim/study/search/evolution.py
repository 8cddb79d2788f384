"""CMA-ES in the unit cube: asks for designs, takes their ranks, and repeats itself when replayed."""

import math

import numpy as np

from afo_sim.study.results import optional

START, STEP = 0.5, 0.25  # middle of the cube; standard deviation of the first designs
CONVERGED = 1e-4  # standard deviation in every direction below which nothing is left to find


class Evolution:
    """A search by covariance matrix adaptation, on ranks alone.

    All that it draws comes from its seed, so that the same ranks lead to the same designs, bit for bit, on
    the same machine: a search goes on after a kill by being told again what it was told before.

    Source
    ------
    Hansen, arXiv:1604.00772; bounds by pycma's smooth transformation of the search space.
    """

    def __init__(self, dimensions: int, seed: int, population: int | None = None):
        cma = optional("cma")
        generator = np.random.default_rng(seed)
        self.dimensions = dimensions
        options = {
            "bounds": [0.0, 1.0],
            "randn": lambda *shape: generator.standard_normal(shape),
            "seed": math.nan,  # leaves NumPy's own generator alone
            "verbose": -9,
            "signals_filename": "",  # no options from whatever file lies in the current folder
            "tolx": CONVERGED,
            # What it is told are ranks, of which the best is always the same: they tell no progress.
            "tolfun": 0.0,
            "tolfunhist": 0.0,
            "tolxstagnation": False,
            **dict.fromkeys(("tolflatfitness", "tolstagnation"), math.inf),
            **dict.fromkeys(("maxiter", "tolfacupx", "tolupsigma"), math.inf),
        }
        if population is not None:
            options["popsize"] = population
        # cma knows no search along one line: a second direction changes nothing
        self._strategy = cma.CMAEvolutionStrategy([START] * max(dimensions, 2), STEP, options)

    @property
    def population(self) -> int:
        """Designs in a generation."""
        return int(self._strategy.popsize)

    @property
    def converged(self) -> bool:
        """True where the designs have come so close together that nothing is left to find."""
        return bool(self._strategy.stop())

    def ask(self) -> np.ndarray:
        """The next designs (population, dimensions), as shares from 0 to 1."""
        self._asked = self._strategy.ask()
        return np.clip(np.array(self._asked)[:, : self.dimensions], 0.0, 1.0)

    def tell(self, ranks: np.ndarray) -> None:
        """Take the ranks of the designs last asked for (population,): the lower the better."""
        self._strategy.tell(self._asked, [float(rank) for rank in ranks])
