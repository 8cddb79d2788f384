"""The names that are called from outside this room."""

from .commands import app as app
from .commands import gait_app as gait_app
from .program import main as main
