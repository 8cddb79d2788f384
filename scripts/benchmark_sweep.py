"""Speed of many designs: designs and strides per second, what accuracy costs, and memory.

    python scripts/benchmark_sweep.py [--parts designs,strides,accuracy,memory] [--repeats 5] [--out now.json]

Measurements are repeated in turn; tables tell the best and the median. Speeds of two machines cannot be
compared, ratios within a run can. `compare_benchmarks.py` compares two files.
`--short-cases 10000` shows that memory stays flat.
"""

import pathlib

from designs import design_rates, stride_rates
from measuring import arguments, chosen, collect
from memory_growth import memory
from step_accuracy import accuracy

PARTS = ("designs", "strides", "accuracy", "memory")


def main() -> None:
    """Measure the parts that are asked for."""
    parser = arguments(__doc__, PARTS)
    parser.add_argument("--cases", type=int, default=32, help="of a sweep")
    parser.add_argument("--short-cases", type=int, default=800, help="whose memory is watched")
    parser.add_argument("--reference", type=pathlib.Path, help="keep the run at 10 µs here (.npz)")
    options = parser.parse_args()
    measures = {
        "designs": lambda: design_rates(options.cases, options.repeats),
        "strides": lambda: stride_rates(options.cases, options.repeats),
        "accuracy": lambda: accuracy(options.repeats, options.reference),
        "memory": lambda: memory(options.short_cases),
    }
    collect("many designs", {part: measures[part] for part in chosen(parser, options.parts, PARTS)}, options)


if __name__ == "__main__":
    main()
