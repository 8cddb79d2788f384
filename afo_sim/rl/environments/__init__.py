"""Tasks for learning and control research: Gymnasium and dm_control environments on a scenario.

Importing this package registers the tasks in Gymnasium, where that is installed.
"""

from afo_sim.rl.environments.registering import register

register()
