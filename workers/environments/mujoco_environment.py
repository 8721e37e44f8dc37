"""What all environments in MuJoCo share: they step, record and run plans by their simulation."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from workers.environments.environment import Command, Environment
from workers.mujoco.simulation import Simulation
from workers.plans import PlannedCommand

Record = Float[np.ndarray, " width"]
"""It is what `Simulation.record` gives."""


class MujocoEnvironment(Environment):
    """An environment whose commands go to the motors of a simulation in MuJoCo.

    Attributes:
        simulation: the scene in motion.
    """

    simulation: Simulation

    def step(self, command: Sequence[float]) -> Record:
        """Command the motors for one control step."""
        self.simulation.step(command)
        return self.record()

    def record(self) -> Record:
        """See `Record`."""
        return self.simulation.record()

    def run_commands(self, command: Command, steps: int) -> Any:
        """Apply the commands of an episode; those that follow a plan in compiled code.

        Args:
            command: of each step.
            steps: how many.

        Returns:
            The record of each step, together as `observed` takes them.
        """
        if isinstance(command, PlannedCommand):
            return self.simulation.run(command.plan, steps)
        return super().run_commands(command, steps)

    def close(self) -> None:
        """Nothing is open."""
