"""Speed of one run: its steps and their parts, the engine's own limit, and what a user waits for.

    python scripts/benchmark.py [--parts steps,networks,…] [--repeats 5] [--out now.json]

Measurements are repeated in turn; tables tell the best and the median. Speeds of two machines cannot be
compared, ratios within a run can. `compare_benchmarks.py` compares two files.
"""

from measuring import Figure, arguments, chosen, collect
from motors import against_motors
from network_costs import network_costs
from step_parts import step_parts
from wall_times import wall_times

PARTS = ("steps", "networks", "motors", "waits", "environments")
SCENARIOS = ("seated", "walk-dropfoot-afo")


def main() -> None:
    """Measure the parts that are asked for."""
    parser = arguments(__doc__, PARTS)
    parser.add_argument("--simulations", type=int, default=64, help="of a batch of motors")
    parser.add_argument("--steps", type=int, default=4000, help="of a run that is taken apart, or replayed")
    options = parser.parse_args()
    measures = {
        "steps": lambda: [
            found for name in SCENARIOS for found in step_parts(name, options.steps, options.repeats)
        ],
        "networks": lambda: network_costs(options.steps, options.repeats),
        "motors": lambda: against_motors(options.simulations, options.steps, options.repeats),
        "waits": lambda: wall_times(options.repeats),
        "environments": lambda: _environments(options.repeats),
    }
    collect("one run", {part: measures[part] for part in chosen(parser, options.parts, PARTS)}, options)


def _environments(repeats: int) -> list[Figure]:
    from environment_rates import environment_rates  # which needs dm_control and gymnasium

    return environment_rates(repeats)


if __name__ == "__main__":
    main()
