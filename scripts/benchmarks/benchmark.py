"""Speed of one run, or of many designs.

    python scripts/benchmarks/benchmark.py run [--parts steps,networks,…] [--repeats 5] [--out now.json]
    python scripts/benchmarks/benchmark.py designs [--parts designs,strides,…] [--repeats 5] [--out now.json]

Of a run: its steps and their parts, networks, the engine's own limit, what a user waits for, environments,
walkers. Of designs: designs and strides per second, what accuracy costs, and memory; `--short-cases 10000`
shows that it stays flat. Measurements are repeated in turn; tables tell the best and the median. Speeds of
two machines cannot be compared, ratios within a run can. `compare_benchmarks.py` compares two files.
"""

import argparse
import pathlib
from collections.abc import Callable, Mapping

from measuring import Figure, arguments, chosen, collect

Measures = Mapping[str, Callable[[], list[Figure]]]


def of_run(options: argparse.Namespace) -> Measures:
    """The parts of one run's speed."""
    from motors import against_motors
    from processes import wall_times
    from step_parts import network_costs, step_parts
    from walkers import walker_rates

    def environments() -> list[Figure]:
        from environment_rates import environment_rates  # which needs dm_control and gymnasium

        return environment_rates(options.repeats)

    scenarios, steps, repeats = ("seated", "walk-dropfoot-afo"), options.steps, options.repeats
    return {
        "steps": lambda: [each for name in scenarios for each in step_parts(name, steps, repeats)],
        "networks": lambda: network_costs(steps, repeats),
        "motors": lambda: against_motors(options.simulations, steps, repeats),
        "waits": lambda: wall_times(repeats),
        "environments": environments,
        "walkers": lambda: walker_rates(repeats),
    }


def of_designs(options: argparse.Namespace) -> Measures:
    """The parts of many designs' speed."""
    from designs import design_rates, overheads, stride_rates
    from processes import memory
    from step_accuracy import accuracy

    return {
        "designs": lambda: design_rates(options.cases, options.repeats),
        "overhead": lambda: overheads(options.cases, options.repeats),
        "strides": lambda: stride_rates(options.cases, options.repeats),
        "accuracy": lambda: accuracy(options.repeats, options.reference),
        "memory": lambda: memory(options.short_cases),
    }


def main() -> None:
    """Measure the parts that are asked for."""
    parser = arguments(__doc__)
    parser.add_argument("what", choices=("run", "designs"))
    parser.add_argument("--simulations", type=int, default=64, help="of a batch of motors")
    parser.add_argument("--steps", type=int, default=4000, help="of a run that is taken apart, or replayed")
    parser.add_argument("--cases", type=int, default=32, help="of a sweep")
    parser.add_argument("--short-cases", type=int, default=800, help="whose memory is watched")
    parser.add_argument("--reference", type=pathlib.Path, help="keep the run at 10 µs here (.npz)")
    options = parser.parse_args()
    title, of = {"run": ("one run", of_run), "designs": ("many designs", of_designs)}[options.what]
    measures = of(options)
    collect(title, {part: measures[part] for part in chosen(parser, options.parts, list(measures))}, options)


if __name__ == "__main__":
    main()
