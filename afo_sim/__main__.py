"""`python -m afo_sim` is `afo-sim`."""

from afo_sim.cli import main

main()
