"""Speed of one run, or of many designs.

    python scripts/benchmarks/benchmark.py run [--parts motors] [--repeats 5] [--out now.json]
    python scripts/benchmarks/benchmark.py designs [--parts designs] [--repeats 5] [--out now.json]

Of a run: its steps beside the engine's own limit. Of designs: designs per second. Measurements are repeated
in turn; tables tell the best and the median. Speeds of two machines cannot be compared, ratios within a run
can. `compare_benchmarks.py` compares two files.
"""

import argparse
from collections.abc import Callable, Mapping

from measuring import Figure, arguments, chosen, collect

Measures = Mapping[str, Callable[[], list[Figure]]]


def of_run(options: argparse.Namespace) -> Measures:
    """The parts of one run's speed."""
    from motors import against_motors

    return {"motors": lambda: against_motors(options.simulations, options.steps, options.repeats)}


def of_designs(options: argparse.Namespace) -> Measures:
    """The parts of many designs' speed."""
    from designs import design_rates, overheads

    return {
        "designs": lambda: design_rates(options.cases, options.repeats),
        "overhead": lambda: overheads(options.cases, options.repeats),
    }


def main() -> None:
    """Measure the parts that are asked for."""
    parser = arguments(__doc__)
    parser.add_argument("what", choices=("run", "designs"))
    parser.add_argument("--simulations", type=int, default=64, help="of a batch of motors")
    parser.add_argument("--steps", type=int, default=4000, help="of a run that is taken apart, or replayed")
    parser.add_argument("--cases", type=int, default=32, help="of a sweep")
    options = parser.parse_args()
    title, of = {"run": ("one run", of_run), "designs": ("many designs", of_designs)}[options.what]
    measures = of(options)
    collect(title, {part: measures[part] for part in chosen(parser, options.parts, list(measures))}, options)


if __name__ == "__main__":
    main()
