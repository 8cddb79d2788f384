"""The orthosis on the right leg of dm_control's CMU humanoid, hung up by its pelvis: does it lift the foot?

MUJOCO_GL=disabled python scripts/composer_humanoid.py
"""

import numpy as np
from dm_control import composer
from dm_control.locomotion.walkers.cmu_humanoid import CMUHumanoid

from afo_sim.rl import OrthosisEntity

PHASES = (("dorsiflexor", 4.0), ("plantarflexor", 4.0))  # chamber that is filled [s], the other vented


class Hanging(composer.NullTask):
    """No reward, and no motors: the joints are moved by their springs, gravity and the orthosis alone."""

    def before_step(self, physics: composer.Task, action: np.ndarray, random_state: object) -> None:
        """Leave all motors of the walker at zero."""


def main() -> None:
    """Fill one chamber after the other, and print what the sensors say."""
    arena, walker = composer.Arena(), CMUHumanoid()
    arena.attach(walker).pos = [0.0, 0.0, 1.5]  # without a free joint: its pelvis stays there
    arena.mjcf_model.option.flag.contact = "disable"  # in its first posture the thighs stand in the pelvis
    orthosis = OrthosisEntity("s1", supply_pressure=4e5)
    orthosis.attach_to(walker, shank="rtibia", foot="rfoot", ankle="rfootrx")
    orthosis.observables.enable_all()
    task = Hanging(arena)
    task.set_timesteps(control_timestep=0.5, physics_timestep=0.001)
    environment = composer.Environment(task, random_state=0)
    assert orthosis.found is not None
    print(f"{orthosis.found.side} leg; shank {orthosis.found.shank}, foot {orthosis.found.foot}")
    print("time [s]   pressures [bar]   forces of the five muscles [N]        ankle [deg]")
    seen = environment.reset().observation
    name = orthosis.mjcf_model.full_identifier
    motors = np.zeros(environment.action_spec().shape)
    for filled, duration in PHASES:
        orthosis.set_valves(**{c: "inlet" if c == filled else "outlet" for c in orthosis.chambers})
        for _ in range(round(duration / task.control_timestep)):
            seen = environment.step(motors).observation
            bar, force = seen[name + "pressure"][0] / 1e5, seen[name + "force"][0]
            angle = np.degrees(seen[name + "ankle_angle"][0, 0])
            time = environment.physics.time()
            print(f"{time:7.1f}    {bar.round(2)!s:16}  {force.round(0)!s:36}  {angle:6.1f}")
    environment.close()


if __name__ == "__main__":
    main()
