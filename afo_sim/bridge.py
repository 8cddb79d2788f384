"""Another name of `afo_sim.rl`, for what imports `entity`, `leg_entity` or `physics` of it so."""

import sys

from afo_sim.rl import entity, leg_entity, physics

for module in (entity, leg_entity, physics):
    sys.modules[f"{__name__}.{module.__name__.rpartition('.')[2]}"] = module
