from .environments.gym_env import OrthosisVectorEnv as OrthosisVectorEnv
from .environments.suite import OrthosisEnvironment as OrthosisEnvironment
from .environments.suite import load as load
from .environments.task import coils_of as coils_of
from .environments.tasks import TASKS as TASKS
from .physics import dm_control_physics as dm_control_physics
