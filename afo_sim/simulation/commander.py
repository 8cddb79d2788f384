"""Commands to chambers → inputs of the model, step by step."""

import numpy as np

from afo_sim.control.command import checked
from afo_sim.model.build import Built
from afo_sim.model.controls import OFF


class Commander:
    """The commands in force of one simulation, over the inputs that its scenario gives.

    Parameters
    ----------
    built : compiled scenario
    timed : whether chambers follow the scenario's timing until they are commanded; else their valves are shut
    """

    def __init__(self, built: Built, *, timed: bool = True):
        self.built, self.timed = built, timed
        self.reset()

    def reset(self) -> None:
        """Take all commands back."""
        shut = dict.fromkeys(self.built.index.chambers, (0.0, 0.0))
        self.commands: dict[str, tuple[float, float] | float] = {} if self.timed else dict(shut)

    def take(self, commands: object) -> None:
        """Put commands in force, all or none; InputError where one is wrong."""
        index = self.built.index
        described = self.built.scenario.orthosis.chamber
        three_way = [name for name, chamber in described.items() if chamber.three_way]
        found = checked(commands, index.chambers, index.drives, three_way)
        merged = self.commands | found
        self.commands = {name: command for name, command in merged.items() if command is not None}

    def apply(self, inputs: np.ndarray) -> None:
        """Write the commands in force into inputs (…, nu)."""
        index = self.built.index
        for chamber, command in self.commands.items():
            driven = isinstance(command, float)
            coils = (0.0, 0.0) if isinstance(command, float) else command
            for side, coil in zip(("inlet", "outlet"), coils, strict=True):
                inputs[..., index.valves[f"{chamber}_{side}"]] = coil
            if chamber in index.drives:
                inputs[..., index.drives[chamber]] = command if driven else OFF
