"""Another name of `afo_sim.rl.environments`, for what imports it so."""

import sys

from afo_sim.rl import environments

sys.modules[__name__] = environments
