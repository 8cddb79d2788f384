"""Another name of `afo_sim.rl`, for what imports `physics` of it so; its entities are retired."""

import sys

from afo_sim.rl import entity, physics

for name, module in {"entity": entity, "leg_entity": entity, "physics": physics}.items():
    sys.modules[f"{__name__}.{name}"] = module
